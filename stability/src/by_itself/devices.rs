//! Devices beside their models, window by window: what a device does late in a recording counts as much as what it does at its begin.

use super::recorded::Quantity;
use crate::part_check::PartCheck;

/// Share of the steps in which a device's sensor may be silent in lockstep; as much as may be lost of a topic.
const MOST_SILENT: f64 = 0.01;

/// Fewer steps than this in which something is recorded and predicted say nothing.
const FEWEST: usize = 64;

/// A window in which a device moves little is measured by this share of the one in which it moves most: at rest, rounding is all that there is.
const OF_THE_LIVELIEST: f64 = 0.1;

/// An output of a device, and how it is compared.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Output {
    /// Name of the part.
    pub(super) part: &'static str,
    pub(super) axis: usize,
    pub(super) quantity: Quantity,
    /// Twice this share of the output counts as no difference.
    pub(super) small: f64,
    /// Whether a value is due in every step.
    pub(super) lockstep: bool,
}

/// What one window shows of an output.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct InWindow {
    output: Output,
    /// Steps in which there is a value to compare, and in which the sensor is silent.
    rows: usize,
    silent: usize,
    /// Root mean squares, in the quantity's unit.
    error: f64,
    predicted: f64,
    recorded: f64,
    /// Times between which the window lies, s from the begin of the recording.
    span_s: [f64; 2],
}

impl InWindow {
    /// Compares; `None` where nothing is predicted.
    pub(super) fn of(output: Output, recorded: &[f64], predicted: &[f64], span_s: [f64; 2]) -> Option<InWindow> {
        let (mut rows, mut silent) = (0, 0);
        let (mut error, mut expected, mut is) = (0.0, 0.0, 0.0);
        for (r, p) in recorded.iter().zip(predicted).filter(|(_, p)| p.is_finite()) {
            if r.is_finite() {
                (rows, error, expected, is) = (rows + 1, error + (r - p).powi(2), expected + p * p, is + r * r);
            } else {
                silent += 1;
            }
        }
        let rms = |sum: f64| (sum / rows.max(1) as f64).sqrt();
        let (error, predicted, recorded) = (rms(error), rms(expected), rms(is));
        (rows + silent >= FEWEST).then_some(InWindow { output, rows, silent, error, predicted, recorded, span_s })
    }

    fn is_of(&self, other: &InWindow) -> bool {
        let key = |window: &InWindow| (window.output.part, window.output.axis, window.output.quantity);
        key(self) == key(other)
    }

    fn size(&self) -> f64 {
        self.predicted.max(self.recorded)
    }

    /// Steps in which the sensor is silent, where those are more than a few lost messages.
    fn silence(&self) -> usize {
        let speaks = !self.output.lockstep || self.silent as f64 <= MOST_SILENT * (self.silent + self.rows) as f64;
        if speaks { 0 } else { self.silent }
    }

    /// By how many times the error is more than it may be.
    fn excess(&self, liveliest: f64) -> f64 {
        if self.error == 0.0 || self.rows < FEWEST {
            return 0.0;
        }
        self.error / (2.0 * self.output.small * self.size().max(OF_THE_LIVELIEST * liveliest)).max(f64::MIN_POSITIVE)
    }
}

/// One answer for each output from all its windows: that of the worst of them where one does not agree, with the times between which such windows lie.
pub(super) fn whole(windows: &[InWindow]) -> Vec<PartCheck> {
    let first = |(index, window): (usize, &InWindow)| (!windows[..index].iter().any(|w| w.is_of(window))).then(|| window.clone());
    let outputs = windows.iter().enumerate().filter_map(first);
    outputs.filter_map(|one| together(&windows.iter().filter(|w| w.is_of(&one)).collect::<Vec<_>>())).collect()
}

/// All windows of one output; `None` where nothing was ever compared.
fn together(windows: &[&InWindow]) -> Option<PartCheck> {
    let compared = windows.iter().filter(|w| w.rows >= FEWEST);
    let rows: usize = compared.clone().map(|w| w.rows).sum();
    let liveliest = compared.clone().map(|w| w.size()).fold(0.0, f64::max);
    let worst = compared.clone().max_by(|a, b| a.excess(liveliest).total_cmp(&b.excess(liveliest)))?;
    let fails = |w: &InWindow| w.silence() > 0 || w.excess(liveliest) > 1.0;
    let failed: Vec<&InWindow> = windows.iter().copied().filter(|w| fails(w)).collect();
    let rms = |value: fn(&InWindow) -> f64| (compared.clone().map(|w| w.rows as f64 * value(w).powi(2)).sum::<f64>() / rows as f64).sqrt();
    let (error_rms, effect_rms) = if fails(worst) { (worst.error, worst.predicted) } else { (rms(|w| w.error), rms(|w| w.predicted)) };
    let Output { part, axis, quantity, .. } = worst.output;
    let quantity = match quantity {
        Quantity::Position => "position",
        Quantity::Effort if part == "slave's force" => "contact force",
        Quantity::Effort => "applied force",
    };
    let is_part = failed.len() < windows.len();
    let span_s = failed.first().zip(failed.last()).filter(|_| is_part).map(|(first, last)| [first.span_s[0], last.span_s[1]]);
    let silent = failed.iter().map(|w| w.silence()).sum();
    Some(PartCheck { part, axis, quantity, error_rms, effect_rms, floor_rms: 0.0, silent, span_s, agrees: failed.is_empty() })
}

#[cfg(test)]
mod tests {
    use super::*;

    fn check(recorded: impl Fn(usize) -> f64, predicted: impl Fn(usize) -> f64) -> PartCheck {
        let output = Output { part: "slave's motion", axis: 0, quantity: Quantity::Position, small: 0.01, lockstep: true };
        let windows = (0..5).map(|window| {
            let rows = window * 1000..(window + 1) * 1000;
            let column = |value: &dyn Fn(usize) -> f64| rows.clone().map(value).collect::<Vec<f64>>();
            InWindow::of(output, &column(&recorded), &column(&predicted), [window as f64, window as f64 + 1.0]).unwrap()
        });
        let [one] = whole(&windows.collect::<Vec<_>>()).try_into().unwrap();
        one
    }

    #[test]
    fn what_a_device_does_in_any_window_counts_and_its_time_is_told() {
        let motion = |row: usize| (0.05 * row as f64).sin();
        let fine = check(motion, motion);
        assert!(fine.agrees && fine.span_s.is_none() && fine.error_rms == 0.0, "{fine:?}");
        let late = check(|row| if row < 4000 { motion(row) } else { 1.2 * motion(row) }, motion);
        assert_eq!((late.agrees, late.span_s), (false, Some([4.0, 5.0])));
        assert!((late.error_rms / late.effect_rms - 0.2).abs() < 1e-9, "{late:?}");
        let always = check(|row| 1.2 * motion(row), motion);
        assert_eq!((always.agrees, always.span_s), (false, None));
    }

    #[test]
    fn rounding_of_a_device_at_rest_is_no_difference_and_another_motion_is() {
        let motion = |row: usize| if row < 1000 { (0.05 * row as f64).sin() } else { 1e-6 };
        assert!(check(|row| motion(row) + if row % 2 == 0 { 2e-6 } else { 0.0 }, motion).agrees);
        let slid = check(|row| motion(row) + if row >= 3000 { 0.1 } else { 0.0 }, motion);
        assert_eq!((slid.agrees, slid.span_s), (false, Some([3.0, 5.0])));
    }

    #[test]
    fn a_sensor_that_falls_silent_late_is_told() {
        let motion = |row: usize| (0.05 * row as f64).sin();
        let silent = check(|row| if row < 3000 { motion(row) } else { f64::NAN }, motion);
        assert_eq!((silent.agrees, silent.silent, silent.span_s), (false, 2000, Some([3.0, 5.0])));
        let few = check(|row| if row % 200 == 0 { f64::NAN } else { motion(row) }, motion);
        assert!(few.agrees && few.silent == 0, "{few:?}");
    }
}
