//! Stairs of a follower: it stands and jumps while its command moves evenly.

use backdrive_signal::statistics::median;
use backdrive_stability::outcome::Unit;
use backdrive_stability::session::{AxisSignals, Session};

/// Time over which a motion is looked at, s.
const WINDOW_S: f64 = 0.02;

/// A window stands in which the slave moves by less than this share of its command.
const STANDS: f64 = 0.1;

/// Stairs are where the slave stands for this share of the time in which its command moves, and at least this number of jumps.
const STANDING: f64 = 0.3;
const JUMPS: usize = 3;

/// Stairs of a slave.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Stairs {
    /// Size of one step, m or rad.
    pub step: f64,
    /// Steps per second.
    pub frequency_hz: f64,
    /// Share of the time in which it stands while its command moves.
    pub stands: f64,
}

/// The stairs of a slave behind its command; `free` is whether nothing touches it at a row. `None` where it does not go in stairs.
pub fn stairs(command: &[f64], slave: &[f64], free: impl Fn(usize) -> bool, period_s: f64) -> Option<Stairs> {
    let window = (WINDOW_S / period_s).round() as usize;
    let rows = command.len().min(slave.len());
    // A few samples a window say nothing of how it is climbed.
    if window < 3 || rows < 4 * window {
        return None;
    }
    let finite = |row: usize| command[row].is_finite() && slave[row].is_finite() && free(row);
    let moves = |signal: &[f64], from: usize| signal[from + window] - signal[from];
    let size = |signal: &[f64]| {
        let all = || signal[..rows].iter().copied().filter(|x| x.is_finite());
        all().fold(f64::NEG_INFINITY, f64::max) - all().fold(f64::INFINITY, f64::min)
    };
    let least = 1e-4 * size(command);
    // Windows in which the command moves: whether the slave stands in them, and where it is.
    let all: Vec<(bool, f64)> = (0..rows - window)
        .step_by(window)
        .filter(|row| finite(*row) && finite(row + window) && moves(command, *row).abs() > least)
        .map(|row| (moves(slave, row).abs() < STANDS * moves(command, row).abs(), slave[row]))
        .collect();
    let standing = all.iter().filter(|(stands, _)| *stands).count();
    let mut levels: Vec<f64> = Vec::new();
    let mut was_standing = false;
    for (stands, x) in &all {
        if *stands && !was_standing {
            levels.push(*x);
        }
        was_standing = *stands;
    }
    let steps: Vec<f64> = levels.windows(2).map(|w| (w[1] - w[0]).abs()).filter(|step| *step > 10.0 * least).collect();
    let stands = standing as f64 / all.len().max(1) as f64;
    let time_s = all.len() as f64 * window as f64 * period_s;
    let count = steps.len();
    (stands >= STANDING && count >= JUMPS)
        .then(|| Some(Stairs { step: median(steps)?, frequency_hz: count as f64 / time_s, stands }))
        .flatten()
}

/// Stairs of the slave of a recording, with the unit of its axis.
pub fn of_session(session: &Session) -> Option<(Stairs, Unit)> {
    let of_axis = |axis: &AxisSignals| {
        let slave = axis.slave.as_ref()?;
        let free = |row: usize| axis.contact.get(row).is_none_or(|f| *f == 0.0 || !f.is_finite());
        Some((stairs(&axis.command, slave, free, session.period_s)?, axis.unit))
    };
    session.axes.iter().filter_map(of_axis).max_by(|a, b| a.0.step.total_cmp(&b.0.step))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn stairs_are_counted_and_an_even_or_resting_motion_has_none() {
        let period_s = 2e-3;
        let command: Vec<f64> = (0..4000).map(|i| 0.05 * f64::from(i) * period_s).collect();
        let climbed: Vec<f64> = command.iter().map(|x| (x / 0.07).floor() * 0.07).collect();
        let found = stairs(&command, &climbed, |_| true, period_s).unwrap();
        assert!((found.step - 0.07).abs() < 1e-9 && (found.frequency_hz - 0.05 / 0.07).abs() < 0.2 && found.stands > 0.9, "{found:?}");
        let late: Vec<f64> = command.iter().map(|x| x - 0.01).collect();
        assert_eq!(stairs(&command, &late, |_| true, period_s), None);
        assert_eq!(stairs(&vec![0.3; 4000], &vec![0.1; 4000], |_| true, period_s), None, "a command that rests asks for no motion");
        assert_eq!(stairs(&command, &climbed, |_| false, period_s), None, "what is touched holds a slave as well");
    }
}
