//! Elasto-plastic bristles, spread widely: a form of the hidden plant's own.

use super::described::{Checked, Described, Facts, Read};
use super::draw::{Draw, Here, InJoint};
use super::families::{FRICTION, LOOPS, PRESLIDING};
use super::force::{ForceLaw, Path};
use super::gaussian::between_rest_and_speed;
use super::maxwell_slip::{MaxwellSlip, slide};
use crate::draw::sizing::{between, presliding, rounded, share};
use crate::network::allowed::Allowed::{NotNegative, One, Positive};
use rand::RngExt;
use rand_chacha::ChaCha8Rng;
use serde::{Deserialize, Serialize};

/// More bristles than this only cost time.
const BRISTLES_AT_MOST: usize = 1024;

/// A field of bristles whose stiffness and break-away force are spread widely and independently of each other.
///
/// Both are log-logistic over the field, in proportions that [`BristleField::bristles`] fixes, so that a few parameters define it: the first slope of
/// the virgin curve is `stiffness`, the force of steady sliding is `force`. Break-away forces may be higher near rest: all of them are then
/// multiplied by `1 + (static_ratio - 1) exp(-(v/velocity)^2)`. No LuGre or Dahl law has this virgin curve, nor their loops its non-local memory; a
/// handful of spring-sliders comes near it but never meets it.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct BristleField {
    /// N/m, of all bristles together.
    pub stiffness: f64,
    /// N, of steady sliding, all bristles together.
    pub force: f64,
    /// Spread of stiffness: the logistic scale of its logarithm.
    pub stiffness_spread: f64,
    /// Spread of break-away force: the logistic scale of its logarithm.
    pub force_spread: f64,
    /// How many bristles there are.
    pub count: usize,
    /// Break-away force at rest over that at speed, at least 1.
    pub static_ratio: f64,
    /// m/s, speed at which the excess at rest has fallen to 1/e.
    pub velocity: f64,
}

impl BristleField {
    /// Stiffness (N/m) and break-away force (N) of every bristle.
    pub fn bristles(&self) -> MaxwellSlip {
        // Quantiles of the two at places that never line up: evenly spaced, and spaced by the golden ratio.
        const GOLDEN: f64 = 0.618_033_988_749_894_9;
        let n = self.count.max(1);
        let quantile = |share: f64| (share / (1.0 - share)).ln();
        let even = |i: usize| (i as f64 + 0.5) / n as f64;
        let golden = |i: usize| ((i as f64 + 0.5) * GOLDEN).fract().clamp(1e-3, 1.0 - 1e-3);
        let stiffness: Vec<f64> = (0..n).map(|i| (self.stiffness_spread * quantile(even(i))).exp()).collect();
        let force: Vec<f64> = (0..n).map(|i| (self.force_spread * quantile(golden(i))).exp()).collect();
        let scaled = |shares: Vec<f64>, total: f64| -> Vec<f64> {
            let sum: f64 = shares.iter().sum();
            shares.into_iter().map(|share| share * total / sum).collect()
        };
        MaxwellSlip { stiffness: scaled(stiffness, self.stiffness), force: scaled(force, self.force) }
    }

    /// The field with its bristles laid out, ready to step.
    pub fn laid_out(&self) -> LaidField {
        LaidField { bristles: self.bristles(), static_ratio: self.static_ratio, velocity: self.velocity }
    }
}

impl Described for BristleField {
    const NAME: &'static str = "bristle_field";
    const FACTS: Facts = Facts { takes_energy: true, is_friction: true, is_linear: false, family: &[FRICTION, LOOPS] };
    const READ: Read<BristleField> = None;
    const DRAWS: &'static [Draw] = &[Draw::Friction { loaded: false }, Draw::Joint(InJoint::Beside)];

    fn to_force(&self) -> Box<dyn ForceLaw> {
        Box::new(self.laid_out())
    }

    fn numbers(&self) -> Vec<Checked> {
        vec![
            ("stiffness", self.stiffness, Positive),
            ("force", self.force, Positive),
            ("stiffness_spread", self.stiffness_spread, NotNegative),
            ("force_spread", self.force_spread, NotNegative),
            ("static_ratio", self.static_ratio, One),
            ("velocity", self.velocity, Positive),
            ("count", if self.count <= BRISTLES_AT_MOST { self.count as f64 } else { f64::INFINITY }, One),
        ]
    }

    fn draw(here: &Here, random: &mut ChaCha8Rng) -> Option<BristleField> {
        let (friction, stiffness, speed) = match here {
            Here::Body(at) => (at.friction, at.friction / presliding(at.travel, random), at.speed),
            Here::Joint(at) => {
                // Rubbing flanks: 5 to 20 % of the working force, released within 3 to 30 % of the working stretch.
                let friction = rounded(share([0.05, 0.2], random) * at.force);
                (friction, friction / (at.stretch * between(0.03, 0.3, random)), at.speed)
            }
        };
        Some(BristleField {
            stiffness: rounded(stiffness),
            force: friction,
            // Logistic scales: the middle four fifths of the bristles span a factor of 4 to 20.
            stiffness_spread: rounded(random.random_range(0.3..0.7)),
            force_spread: rounded(random.random_range(0.3..0.7)),
            count: random.random_range(40..=80),
            // Half of the fields hold tighter at rest.
            static_ratio: if random.random_bool(0.5) { 1.0 } else { rounded(between(1.2, 1.8, random)) },
            velocity: rounded(speed * between(0.05, 0.3, random)),
        })
    }

    /// Friction whose force first rises with displacement: every law with presliding. Beside a joint's spring the same field
    /// is a spring with a loop.
    fn names(at_ground: bool) -> Vec<&'static str> {
        if at_ground { PRESLIDING.to_vec() } else { [PRESLIDING, LOOPS].concat() }
    }
}

/// A [`BristleField`] with the parameters of every bristle computed.
#[derive(Debug, Clone, PartialEq)]
pub struct LaidField {
    bristles: MaxwellSlip,
    static_ratio: f64,
    velocity: f64,
}

impl ForceLaw for LaidField {
    fn memory(&self) -> usize {
        self.bristles.memory()
    }

    fn path_force(&self, path: &Path, memory: &mut [f64]) -> f64 {
        let level = between_rest_and_speed(self.static_ratio, 1.0, path.speed / self.velocity);
        slide(&self.bristles.stiffness, &self.bristles.force, level, path, memory)
    }

    fn stiffness(&self) -> f64 {
        self.bristles.stiffness()
    }
}
