//! LuGre friction with a Preisach operator for its bristles: announced, not available yet.

use super::{Kind, Mechanics, Parameter, Range, Role};

/// LuGre whose bristle stiffness is a Preisach operator. No version so far simulates it.
#[derive(Debug, Clone, PartialEq)]
pub struct PreisachLugre {
    /// In the order of the kind's parameters.
    values: [f64; 8],
}

impl PreisachLugre {
    pub(super) const KIND: Kind = Kind {
        name: "preisach_lugre",
        equation: "f = σ0 h(z) + σ1 dz/dt, dz/dt = v - h(z)/g(v) |v|, h a Preisach operator",
        source: "Choi, Han & Kim 2006, eqs (4)-(13)",
        energy: "not available yet in this version",
        parameters: &[
            Parameter::number("stiffness", "N/m", Range::Positive, "σ0"),
            Parameter::number("damping", "N s/m", Range::NonNegative, "σ1"),
            Parameter::number("coulomb", "N", Range::Positive, "level at speed"),
            Parameter::number("static", "N", Range::Positive, "level at rest"),
            Parameter::number("velocity", "m/s", Range::Positive, "Stribeck velocity"),
            Parameter::number("break_away", "m", Range::Positive, "z_ba, bristle deflection at break-away"),
            Parameter::number("loop_force", "N", Range::Positive, "f_c of the deformed Dahl curves"),
            Parameter::number("loop_slope", "N/m", Range::Positive, "s of the deformed Dahl curves"),
        ],
        build: |_| Err("preisach_lugre is not available yet in this version; maxwell_slip also has non-local memory".to_owned()),
    };

    pub(super) fn values(&self) -> Vec<Vec<f64>> {
        self.values.iter().map(|v| vec![*v]).collect()
    }
}

impl Mechanics for PreisachLugre {
    fn role(&self) -> Role {
        Role::Unavailable
    }
}
