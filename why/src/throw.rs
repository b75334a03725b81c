//! How far a remedy throws the device before it holds it still.

use backdrive_stability::session::{AxisSignals, Session};
use serde::Serialize;

/// A motion counts from this share of the recorded span on, a force from this share of the recorded peak: what is less lies within what the
/// re-simulation of a recording misses by itself.
const COUNTS: f64 = 0.1;

/// What a trial does beyond everything that was recorded. A hand is on the device: a remedy that moves or pushes it harder than the fault that it cures is no
/// improvement for the user.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Throw {
    /// How far the master goes beyond the range in which it was recorded, m or rad; 0 where it does not.
    pub beyond_m: f64,
    /// Largest force on the master, N or N m.
    pub force_n: f64,
    /// The same as recorded, N or N m.
    pub recorded_force_n: f64,
    /// Whether the motion leaves the recorded range by a tenth of it or more.
    moves: bool,
    /// Whether the force is a tenth or more above the recorded one.
    pushes: bool,
}

impl Throw {
    /// Of the worst axis of a trial against the recording; `None` where it moves and pushes the device no harder than was recorded.
    pub fn of(trial: &Session, recorded: &Session) -> Option<Throw> {
        let axes = trial.axes.iter().zip(&recorded.axes).map(|(trial, recorded)| Throw::of_axis(trial, recorded));
        let worst = axes.max_by(|a, b| a.weight().total_cmp(&b.weight()))?;
        (worst.moves || worst.pushes).then_some(worst)
    }

    fn of_axis(trial: &AxisSignals, recorded: &AxisSignals) -> Throw {
        let ([low, high], [lowest, highest]) = (range(&recorded.master), range(&trial.master));
        let beyond_m = (low - lowest).max(highest - high).max(0.0);
        let (force_n, recorded_force_n) = (peak(&trial.force), peak(&recorded.force));
        let moves = beyond_m > COUNTS * (high - low) && beyond_m.is_finite();
        let pushes = force_n > (1.0 + COUNTS) * recorded_force_n;
        Throw { beyond_m, force_n, recorded_force_n, moves, pushes }
    }

    /// Those that move or push too hard first, then by the motion.
    fn weight(&self) -> f64 {
        f64::from(u8::from(self.moves || self.pushes)) + self.beyond_m.min(0.9)
    }
}

impl std::fmt::Display for Throw {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let motion = format!("moves the master {:.1} mm beyond the recorded range", 1e3 * self.beyond_m);
        let force = format!("pushes it with up to {:.1} N ({:.1} N were recorded)", self.force_n, self.recorded_force_n);
        match (self.moves, self.pushes) {
            (true, true) => write!(f, "at first it {motion} and {force}"),
            (true, false) => write!(f, "at first it {motion}"),
            _ => write!(f, "at first it {force}"),
        }
    }
}

fn range(column: &[f64]) -> [f64; 2] {
    let finite = || column.iter().copied().filter(|x| x.is_finite());
    [finite().fold(f64::INFINITY, f64::min), finite().fold(f64::NEG_INFINITY, f64::max)]
}

fn peak(column: &[f64]) -> f64 {
    column.iter().filter(|x| x.is_finite()).fold(0.0, |peak, x| peak.max(x.abs()))
}
