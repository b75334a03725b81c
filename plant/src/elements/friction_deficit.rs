//! Dry friction that is lower near rest.

use super::gaussian::between_rest_and_speed;
use super::harmonic;
use super::kind::{KindOf, Parameter, Range};
use super::law::{FrictionLaw, Linear, Rubbing};
use super::sine::Sine;

/// `f = (coulomb - (coulomb - rest) exp(-(v/velocity)²)) sign(v)`, set-valued at rest.
#[derive(Debug, Clone, PartialEq)]
pub struct FrictionDeficit {
    /// N, at speed.
    pub coulomb: f64,
    /// N, at rest.
    pub rest: f64,
    /// m/s, speed at which the deficit has fallen to 1/e.
    pub velocity: f64,
}

impl FrictionDeficit {
    pub(super) const KIND: KindOf<FrictionDeficit> = KindOf {
        name: "friction_deficit",
        equation: "f = (c - (c - r) exp(-(v/vs)²)) sign(v), r < c, set-valued at rest",
        source: "the counterpart of stribeck",
        energy: "dissipates, creates none",
        parameters: &[
            Parameter::number("coulomb", "N", Range::NonNegative, "c"),
            Parameter::number("rest", "N", Range::NonNegative, "r, less than c"),
            Parameter::number("velocity", "m/s", Range::Positive, "vs"),
        ],
        build: |v| {
            let (coulomb, rest) = (v[0][0], v[1][0]);
            if rest >= coulomb {
                return Err(format!("rest ({rest}) must be less than coulomb ({coulomb}); friction that is higher at rest is a stribeck"));
            }
            Ok(FrictionDeficit { coulomb, rest, velocity: v[2][0] })
        },
    };

    pub(super) fn values(&self) -> Vec<Vec<f64>> {
        vec![vec![self.coulomb], vec![self.rest], vec![self.velocity]]
    }
}

impl FrictionLaw for FrictionDeficit {
    #[inline]
    fn level(&self, at: &Rubbing) -> f64 {
        match at.speed {
            None => self.rest,
            Some(v) => between_rest_and_speed(self.rest, self.coulomb, v / self.velocity),
        }
    }

    fn linearised(&self, at: &Sine) -> Linear {
        harmonic::of_friction(self, at)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn rest_at_coulomb_is_refused() {
        assert!((FrictionDeficit::KIND.build)(&[vec![1.0], vec![1.0], vec![0.1]]).is_err());
    }
}
