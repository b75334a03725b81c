//! Dry friction that its own heat lowers.

use super::harmonic;
use super::kind::{KindOf, Parameter, Range};
use super::law::{FrictionLaw, Linear, Rubbing};
use super::sine::Sine;

/// `f = force sign(v)/(1 + w)`, set-valued at rest, with the warming w fed by the friction's own power and lost with a time constant:
/// `dw/dt = |f v|/half_heat - w/cooling_time`. Memory: w, which is 1 where the friction has fallen to half.
///
/// A lubricant whose viscosity falls as it warms. At constant speed the friction settles where `c (1 + c |v| cooling_time/half_heat) = force`.
#[derive(Debug, Clone, PartialEq)]
pub struct WarmFriction {
    /// N, cold.
    pub force: f64,
    /// J, the heat that halves it where none is lost.
    pub half_heat: f64,
    /// s.
    pub cooling_time: f64,
}

impl WarmFriction {
    pub(super) const KIND: KindOf<WarmFriction> = KindOf {
        name: "warm_friction",
        equation: "f = c sign(v)/(1 + w), set-valued at rest; dw/dt = |f v|/Q - w/τ",
        source: "first-order lubricant heating, as in thermal friction models of robot joints (Simoni, Beschi, Legnani & Visioli 2015)",
        energy: "dissipates, creates none",
        parameters: &[
            Parameter::number("force", "N", Range::NonNegative, "c, cold"),
            Parameter::number("half_heat", "J", Range::Positive, "Q, heat that halves it"),
            Parameter::number("cooling_time", "s", Range::Positive, "τ"),
        ],
        build: |v| Ok(WarmFriction { force: v[0][0], half_heat: v[1][0], cooling_time: v[2][0] }),
    };

    pub(super) fn values(&self) -> Vec<Vec<f64>> {
        vec![vec![self.force], vec![self.half_heat], vec![self.cooling_time]]
    }
}

impl FrictionLaw for WarmFriction {
    #[inline]
    fn level(&self, at: &Rubbing) -> f64 {
        self.force / (1.0 + at.memory.first().copied().unwrap_or(0.0))
    }

    fn memory_len(&self) -> usize {
        1
    }

    /// Exact for a power that is constant over the time.
    fn rubbed(&self, memory: &mut [f64], work: f64, dt: f64) {
        let [warming] = memory else { return };
        if dt > 0.0 {
            let settled = work.max(0.0) / dt * self.cooling_time / self.half_heat;
            *warming = settled + (*warming - settled) * (-dt / self.cooling_time).exp();
        }
    }

    fn linearised(&self, at: &Sine) -> Linear {
        harmonic::of_friction(self, at)
    }
}
