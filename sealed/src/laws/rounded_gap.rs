//! A shaft behind a gap with rounded ends: a form of the hidden plant's own.

use super::described::{Checked, Described, Facts, Read};
use super::draw::{Draw, Here, InJoint};
use super::families::ELASTIC;
use super::force::{ForceLaw, Path};
use crate::draw::sizing::{between, rounded};
use crate::network::allowed::Allowed::{NotNegative, Positive};
use rand_chacha::ChaCha8Rng;
use serde::{Deserialize, Serialize};

/// Shaft behind a gap whose ends are worn round: `f = k s(x) + c s'(x) v` with `s(x) = w (ln(1 + e^((x - g/2)/w)) - ln(1 + e^((-x - g/2)/w)))`.
///
/// s goes from 0 inside the gap g to `x ∓ g/2` outside, over a few widths w of rounding. It has no memory, and unlike a gap with sharp ends its
/// stiffness is never quite zero: `s'(0) = 2/(1 + e^(g/(2w)))`.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct RoundedGap {
    /// m, g, whole width.
    pub gap: f64,
    /// m, w.
    pub rounding: f64,
    /// N/m, k, far outside.
    pub stiffness: f64,
    /// N s/m, c, far outside.
    pub damping: f64,
}

impl RoundedGap {
    /// m, the shaft's twist s at displacement `x` (m).
    pub fn twist(&self, x: f64) -> f64 {
        let (w, half) = (self.rounding, 0.5 * self.gap);
        w * (softplus((x - half) / w) - softplus((-x - half) / w))
    }

    /// The share s' of the contact that carries at displacement `x` (m), 0 to 1.
    pub fn contact(&self, x: f64) -> f64 {
        let (w, half) = (self.rounding, 0.5 * self.gap);
        logistic((x - half) / w) + logistic((-x - half) / w)
    }
}

impl ForceLaw for RoundedGap {
    fn path_force(&self, path: &Path, _: &mut [f64]) -> f64 {
        self.stiffness * self.twist(path.to)
    }

    fn damping(&self, x: f64, _: f64, _: &[f64]) -> f64 {
        self.damping * self.contact(x)
    }

    fn stiffness(&self) -> f64 {
        self.stiffness
    }
}

impl Described for RoundedGap {
    const NAME: &'static str = "rounded_gap";
    const FACTS: Facts = Facts { takes_energy: false, is_friction: false, is_linear: false, family: &[ELASTIC, &["series_compliance"]] };
    const READ: Read<RoundedGap> = None;
    const DRAWS: &'static [Draw] = &[Draw::Joint(InJoint::ForSpringAndDampers)];

    fn to_force(&self) -> Box<dyn ForceLaw> {
        Box::new(self.clone())
    }

    fn numbers(&self) -> Vec<Checked> {
        vec![
            ("gap", self.gap, NotNegative),
            ("rounding", self.rounding, Positive),
            ("stiffness", self.stiffness, Positive),
            ("damping", self.damping, NotNegative),
        ]
    }

    fn draw(here: &Here, random: &mut ChaCha8Rng) -> Option<RoundedGap> {
        let Here::Joint(at) = here else { return None };
        // 10 to 60 % of the working stretch on each side, with ends rounded over 5 to 25 % of that.
        let half = at.stretch * between(0.1, 0.6, random);
        Some(RoundedGap {
            gap: rounded(2.0 * half),
            rounding: rounded(half * between(0.05, 0.25, random)),
            stiffness: rounded(at.stiffness * (1.0 + at.absorbed)),
            damping: rounded(at.damping),
        })
    }

    fn names(_at_ground: bool) -> Vec<&'static str> {
        vec!["backlash"]
    }
}

/// `ln(1 + e^u)` without overflow.
fn softplus(u: f64) -> f64 {
    u.max(0.0) + (-u.abs()).exp().ln_1p()
}

/// `1/(1 + e^(-u))`.
fn logistic(u: f64) -> f64 {
    1.0 / (1.0 + (-u).exp())
}
