//! Dry friction that falls with speed.

use super::gaussian::between_rest_and_speed;
use super::harmonic;
use super::kind::{KindOf, Parameter, Range};
use super::law::{FrictionLaw, Linear, Rubbing};
use super::sine::Sine;

/// `f = (coulomb + (static - coulomb) exp(-(v/velocity)²)) sign(v)`, set-valued at rest.
#[derive(Debug, Clone, PartialEq)]
pub struct Stribeck {
    /// N, at speed.
    pub coulomb: f64,
    /// N, at rest; `static` in model files.
    pub at_rest: f64,
    /// m/s, speed at which the excess has fallen to 1/e.
    pub velocity: f64,
}

impl Stribeck {
    pub(super) const KIND: KindOf<Stribeck> = KindOf {
        name: "stribeck",
        equation: "f = (c + (s - c) exp(-(v/vs)²)) sign(v), set-valued at rest",
        source: "Stribeck 1902; Gaussian form of Armstrong-Helouvry 1991",
        energy: "dissipates, creates none",
        parameters: &[
            Parameter::number("coulomb", "N", Range::NonNegative, "c"),
            Parameter::number("static", "N", Range::NonNegative, "s, at least c"),
            Parameter::number("velocity", "m/s", Range::Positive, "vs"),
        ],
        build: |v| {
            let (coulomb, at_rest) = (v[0][0], v[1][0]);
            if at_rest < coulomb {
                return Err(format!(
                    "static ({at_rest}) must be at least coulomb ({coulomb}); friction that is lower at rest is a friction_deficit"
                ));
            }
            Ok(Stribeck { coulomb, at_rest, velocity: v[2][0] })
        },
    };

    pub(super) fn values(&self) -> Vec<Vec<f64>> {
        vec![vec![self.coulomb], vec![self.at_rest], vec![self.velocity]]
    }
}

impl FrictionLaw for Stribeck {
    #[inline]
    fn level(&self, at: &Rubbing) -> f64 {
        match at.speed {
            None => self.at_rest,
            Some(v) => between_rest_and_speed(self.at_rest, self.coulomb, v / self.velocity),
        }
    }

    fn linearised(&self, at: &Sine) -> Linear {
        harmonic::of_friction(self, at)
    }
}

#[cfg(test)]
mod tests {
    use super::super::law::Side;
    use super::*;

    #[test]
    fn static_below_coulomb_is_refused() {
        assert!((Stribeck::KIND.build)(&[vec![2.0], vec![1.0], vec![0.1]]).is_err());
    }

    #[test]
    fn level_falls_to_one_part_in_e_at_the_stribeck_velocity() {
        let law = Stribeck { coulomb: 1.0, at_rest: 3.0, velocity: 0.02 };
        let level = |speed| law.level(&Rubbing { side: Side::Forwards, speed, load: 0.0, memory: &[] });
        assert!((level(Some(0.02)) - (1.0 + 2.0 * (-1.0f64).exp())).abs() < 1e-15);
        assert_eq!((level(Some(0.0)), level(None)), (3.0, 3.0));
    }
}
