//! The compensator as parameters: eq (2), the paper's tables, and the network that they make. Marks of parameters that the paper's text as we have it
//! does not settle: (R) recovered from others that it states, (A) ambiguous, the readings are named, (L) lost, ours replaces it.

use backdrive_plant::elements::{Backlash, Dahl, Damper, Inerter, Law, Spring, Stribeck};
use backdrive_plant::model::{Body, Element, Fragment, Model, Place};
use nalgebra::Complex;
use std::f64::consts::TAU;

/// The oils, in the order of the tables.
pub const OILS: [&str; 4] = ["SAE-40", "SAE-30", "SAE-20", "SAE-10"];
/// Index of the oil of the time responses.
pub const SAE_10: usize = 3;
/// Length of the lever, m (R): 2 alpha of 0.00336 rad is the paper's 0.34 mm.
pub const LEVER: f64 = 0.050;
/// Damping c_b of the shaft with the gap, N s/m (A): 1, 10, 100 or 1000.
const SHAFT_DAMPING: f64 = 100.0;
/// Speed at which the friction has come from rest to motion, m/s (L): chosen.
const STRIBECK_VELOCITY: f64 = 1e-3;
/// Friction in motion and at rest over h, N: the bench measurements.
const FRICTION: [f64; 2] = [1.75, 2.0];

/// The parameters of the device with each of its oils, at the lever's end.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Compensator {
    /// Stiffness of the gearbox, N/m.
    pub k: f64,
    /// Inertance of the flywheel, kg.
    pub b: f64,
    /// Parasitic inertance, kg.
    pub b1: f64,
    /// Friction over that of the bench; 0 where there is none.
    pub h: f64,
    /// Total gap 2 alpha at the lever's end, m; 0 where there is none.
    pub gap: f64,
    /// Distance behind a reversal in which friction comes back, m; 0 for friction that is there at once.
    pub presliding: f64,
    /// Damping of the oil c and parasitic damping c1, N s/m, in the order of [`OILS`].
    pub oils: [[f64; 2]; 4],
}

/// Table I: the design. c of SAE-20 and SAE-10 by halving (R).
pub const TABLE_1: Compensator = Compensator {
    k: 480e3,
    b: 98.4,
    b1: 21.6,
    h: 0.0,
    gap: 0.0,
    presliding: 0.0,
    oils: [[5518.0, 0.0], [2759.0, 0.0], [1380.0, 0.0], [690.0, 0.0]],
};

/// Table II: friction and parasitic damping, fitted up to 20 Hz. c1 of SAE-40 is 1430 or 1403, of SAE-30 1100 or 1010, of SAE-20 780 or 708 (A).
pub const TABLE_2: Compensator = Compensator {
    k: 563e3,
    b: 94.5,
    b1: 23.0,
    h: 9.36,
    gap: 0.0,
    presliding: 0.0,
    oils: [[5742.0, 1430.0], [4346.0, 1100.0], [3219.0, 780.0], [1472.0, 347.0]],
};

/// Table III, run 1: with backlash, fitted up to 24 Hz. b1 is lost; that of run 2 stands in its place (L). c of SAE-20 is 3062 or 3602, c1 of
/// SAE-30 1104, 1140 or 1014, of SAE-20 804 or 840 (A).
pub const TABLE_3_RUN_1: Compensator = Compensator {
    k: 875e3,
    b: 81.2,
    b1: 24.8,
    h: 9.36,
    gap: 2.0 * 0.00338 * LEVER,
    presliding: 0.0,
    oils: [[6382.0, 1398.0], [4423.0, 1104.0], [3062.0, 804.0], [1375.0, 364.0]],
};

/// Table III, run 2: with backlash, fitted up to 36 Hz; the parameters of the model files. c of SAE-20 is 3035 or 3350, c1 of SAE-30 1106, 1160 or
/// 1016, of SAE-20 808 or 880, of SAE-10 370 or 307 (A).
pub const TABLE_3_RUN_2: Compensator = Compensator {
    k: 861e3,
    b: 80.1,
    b1: 24.8,
    h: 9.36,
    gap: 2.0 * 0.00336 * LEVER,
    presliding: 0.0,
    oils: [[6261.0, 1397.0], [4349.0, 1106.0], [3035.0, 808.0], [1354.0, 370.0]],
};

/// A number of the device.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Parameter {
    /// k.
    Stiffness,
    /// b.
    Inertance,
    /// b1.
    Parasitic,
    /// h.
    Friction,
    /// The gap.
    Gap,
    /// The presliding distance.
    Presliding,
    /// c of an oil.
    Oil(usize),
    /// c1 of an oil.
    Beside(usize),
}

impl Parameter {
    /// Which oil it belongs to; `None` where all share it.
    pub fn oil(self) -> Option<usize> {
        match self {
            Parameter::Oil(oil) | Parameter::Beside(oil) => Some(oil),
            _ => None,
        }
    }
}

impl Compensator {
    /// A number of it.
    pub fn get(&self, parameter: Parameter) -> f64 {
        let mut own = *self;
        *own.place(parameter)
    }

    /// The same device with another number; an oil that there is not changes the last one.
    pub fn with(mut self, parameter: Parameter, value: f64) -> Compensator {
        *self.place(parameter) = value;
        self
    }

    fn place(&mut self, parameter: Parameter) -> &mut f64 {
        match parameter {
            Parameter::Stiffness => &mut self.k,
            Parameter::Inertance => &mut self.b,
            Parameter::Parasitic => &mut self.b1,
            Parameter::Friction => &mut self.h,
            Parameter::Gap => &mut self.gap,
            Parameter::Presliding => &mut self.presliding,
            Parameter::Oil(oil) => &mut self.oils[oil.min(3)][0],
            Parameter::Beside(oil) => &mut self.oils[oil.min(3)][1],
        }
    }

    /// The device with an oil (index into [`OILS`]) as an environment, its port the lever.
    pub fn fragment(&self, oil: usize) -> Fragment {
        let [c, c1] = self.oils[oil.min(3)];
        let body = |name: &str| Body { name: name.to_string(), inertia: 0.0 };
        let (lever, disc, flywheel): (Place, Place, Place) = (Some(0), Some(1), Some(2));
        let mut elements = Vec::new();
        let mut add = |name: &str, between: [Place; 2], law: Law| elements.push(Element { name: name.to_string(), between, law });
        add(
            "gearbox",
            [lever, disc],
            if self.gap > 0.0 {
                Law::Backlash(Backlash { gap: self.gap, stiffness: self.k, damping: SHAFT_DAMPING, rounding: 0.0 })
            } else {
                Law::Spring(Spring { stiffness: self.k, rest: 0.0 })
            },
        );
        add("parasitic_inertance", [disc, None], Law::Inerter(Inerter { inertance: self.b1 }));
        if c1 > 0.0 {
            add("parasitic_damping", [disc, None], Law::Damper(Damper { damping: c1 }));
        }
        if self.h > 0.0 {
            let [coulomb, at_rest] = FRICTION.map(|f| f * self.h);
            let law = if self.presliding > 0.0 {
                Law::Dahl(Dahl { stiffness: coulomb / self.presliding, coulomb })
            } else {
                Law::Stribeck(Stribeck { coulomb, at_rest, velocity: STRIBECK_VELOCITY })
            };
            add("friction", [disc, None], law);
        }
        add("oil", [disc, flywheel], Law::Damper(Damper { damping: c }));
        add("inertance", [flywheel, None], Law::Inerter(Inerter { inertance: self.b }));
        let bodies = vec![body("port"), body("disc"), body("flywheel")];
        let name = format!("steering-compensator-{}", OILS[oil.min(3)].to_lowercase());
        Fragment { network: Model { name, bodies, elements, ..Model::default() }, hand: None }
    }

    /// The device with an oil, its lever moved: input 0 the displacement, output 0 the force.
    pub fn model(&self, oil: usize) -> Model {
        self.fragment(oil).driven()
    }

    /// Eq (2), the admittance of the network without friction, gap and parasitic damping, N s/m.
    pub fn linear_admittance(&self, oil: usize, frequency_hz: f64) -> Complex<f64> {
        let (k, b, b1, c) = (self.k, self.b, self.b1, self.oils[oil.min(3)][0]);
        let s = Complex::new(0.0, TAU * frequency_hz);
        k * s * (b * b1 * s + c * (b + b1)) / (b * b1 * s * s * s + c * (b + b1) * s * s + k * b * s + k * c)
    }

    /// Frequency at which the gain of eq (2) does not depend on c, Hz, and that gain, N s/m.
    pub fn invariant(&self) -> (f64, f64) {
        let omega = (0.5 * (self.k / self.b1 + self.k / (self.b + self.b1))).sqrt();
        (omega / TAU, 2.0 * self.b1 * (self.b + self.b1) * omega / self.b)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use backdrive_plant::linear::{LinearModel, Operating};

    #[test]
    fn the_networks_are_those_of_the_files() {
        for (table, suffixes) in
            [(TABLE_1, [("", 0)].as_slice()), (TABLE_3_RUN_2, &[("-sae-40", 0), ("-sae-30", 1), ("-sae-20", 2), ("-sae-10", 3)])]
        {
            for (suffix, oil) in suffixes {
                let path = format!("{}/../plant/environments/steering-compensator{suffix}.toml", env!("CARGO_MANIFEST_DIR"));
                let file = Fragment::load(path.as_ref()).unwrap();
                let ours = table.fragment(*oil);
                assert_eq!(file.network.elements.len(), ours.network.elements.len());
                for (theirs, own) in file.network.elements.iter().zip(&ours.network.elements) {
                    let [a, b] = [theirs, own].map(|e| e.law.values().concat());
                    assert_eq!((&theirs.name, theirs.between, a.len()), (&own.name, own.between, b.len()));
                    assert!(a.iter().zip(&b).all(|(a, b)| (a / b - 1.0).abs() < 1e-3 || a == b), "{}: {a:?} {b:?}", own.name);
                }
            }
        }
    }

    #[test]
    fn equation_2_is_the_network_and_has_an_invariant_point() {
        let (f, gain) = TABLE_1.invariant();
        assert!((f - 18.2238).abs() < 1e-4 && (gain / 6032.3932 - 1.0).abs() < 1e-7);
        for oil in 0..4 {
            let model = TABLE_1.model(oil);
            let linear = LinearModel::new(&model, &Operating::small()).unwrap();
            for f in [0.1, 3.24, f, 35.0] {
                let network = linear.response(0, 0, &[f]).unwrap()[0] / Complex::new(0.0, TAU * f);
                let equation = TABLE_1.linear_admittance(oil, f);
                assert!((network / equation - Complex::new(1.0, 0.0)).norm() < 1e-9);
            }
            assert!((TABLE_1.linear_admittance(oil, f).norm() / gain - 1.0).abs() < 1e-12);
        }
    }
}
