//! The signals of one side made ready for its fits: without holes, in the band in which they are known, cut into blocks of time.

use super::filter::{BothWays, FilteredRate};
use super::law::Term;
use super::types::{NoCoupling, Signals};
use crate::spectra::welch;
use backdrive_signal::statistics::deviation;
use std::ops::Range;

/// Blocks of time over which residuals count as independent, and by which held-out time is drawn.
pub(super) const BLOCKS: usize = 20;
/// More rows than this are not used: the piece with the most force is.
const MOST_ROWS: usize = 60_000;
/// A shorter recording holds no motion to fit, s.
const LEAST_S: f64 = 1.0;
/// Coherence below which a line contains more noise than law. Where all noise is in the inputs of the law, the law is underestimated by one minus the
/// coherence (Bendat and Piersol, Random Data, 4th ed., 6.1).
const COHERENT: f64 = 0.9;
/// No band ends below this, Hz.
const LEAST_BAND_HZ: f64 = 5.0;
/// A force counts as clamped where this share of its samples is at its largest size.
const CLAMPED_SHARE: f64 = 0.005;

/// One side of the pair.
pub(super) struct Side {
    pub(super) period_s: f64,
    /// Force of its motor.
    pub(super) force: Vec<f64>,
    pub(super) own: Vec<f64>,
    /// The other side's position, in own units.
    pub(super) other: Vec<f64>,
    pub(super) own_force: Option<Vec<f64>>,
    pub(super) other_force: Option<Vec<f64>>,
    /// Rows of each block, of those that are kept.
    pub(super) blocks: Vec<Range<usize>>,
    /// Rows that count.
    pub(super) kept: Vec<usize>,
    /// Largest force where the motor is clamped.
    pub(super) limit: Option<f64>,
    /// Upper end of the band, Hz.
    pub(super) band_hz: f64,
    /// The step of the own sensor, m or rad.
    pub(super) resolution: f64,
    low_pass: Option<BothWays>,
}

impl Side {
    /// The master (`true`) or the slave of a pair.
    pub(super) fn of(signals: &Signals, master: bool) -> Result<Side, NoCoupling> {
        let n = signals.len();
        let scaled = |x: &[f64], by: f64| x.iter().map(|x| by * x).collect::<Vec<f64>>();
        let (force, own, other, own_force, other_force) = if master {
            (signals.master_force, signals.master.to_vec(), scaled(signals.slave, 1.0 / signals.mu), signals.hand, signals.contact)
        } else {
            (signals.slave_force, signals.slave.to_vec(), scaled(signals.master, signals.mu), signals.contact, signals.hand)
        };
        if (n as f64) * signals.period_s < LEAST_S {
            return Err(NoCoupling::TooShort { seconds: n as f64 * signals.period_s });
        }
        let piece = most_force(force);
        let holes: Vec<bool> = piece
            .clone()
            .map(|row| {
                let hole = |x: &[f64]| x.get(row).is_none_or(|x| !x.is_finite());
                hole(force) || hole(&own) || hole(&other) || own_force.is_some_and(hole) || other_force.is_some_and(hole)
            })
            .collect();
        let take = |x: &[f64]| filled(x.get(piece.clone()).unwrap_or_default());
        let own_force = own_force.map(take);
        let other_force = other_force.map(take);
        let (force, own, other) = (take(force), take(&own), take(&other));
        if deviation(&force) <= 0.0 || (deviation(&own) <= 0.0 && deviation(&other) <= 0.0) {
            return Err(NoCoupling::NoMotion { master });
        }
        let limit = clamp(&force);
        let period_s = signals.period_s;
        let band_hz = band(&force, &own, &other, [own_force.as_deref(), other_force.as_deref()], period_s);
        let low_pass = BothWays::new(band_hz, period_s);
        // The filter's memory is a few of its periods long; beyond a hole or a clamp it remembers them.
        let memory = if low_pass.is_some() { (2.0 / (band_hz * period_s)).ceil() as usize } else { 2 };
        let at_limit = |row: usize| limit.is_some_and(|l| force.get(row).is_some_and(|f| f.abs() >= l * (1.0 - 1e-6)));
        let mut usable: Vec<bool> = vec![true; force.len()];
        for row in (0..force.len()).filter(|row| holes.get(*row).copied().unwrap_or(true) || at_limit(*row)) {
            let (from, to) = (row.saturating_sub(memory), (row + memory + 1).min(usable.len()));
            usable.get_mut(from..to).unwrap_or_default().fill(false);
        }
        let every = ((0.25 / (band_hz * period_s)).floor() as usize).min(force.len() / (100 * BLOCKS)).max(1);
        // The filter of speeds remembers how it began.
        let begins = memory.max((0.05 / period_s) as usize);
        let inner = begins..force.len().saturating_sub(begins);
        let kept: Vec<usize> = inner.step_by(every).filter(|row| usable.get(*row).copied().unwrap_or(false)).collect();
        if kept.len() < 10 * BLOCKS {
            return Err(NoCoupling::TooShort { seconds: kept.len() as f64 * every as f64 * period_s });
        }
        let blocks = (0..BLOCKS).map(|b| b * kept.len() / BLOCKS..(b + 1) * kept.len() / BLOCKS).collect();
        let resolution = signals.resolution;
        Ok(Side { period_s, force, own, other, own_force, other_force, blocks, kept, limit, band_hz, resolution, low_pass })
    }

    /// Whether the input of a term was recorded.
    pub(super) fn has(&self, term: Term) -> bool {
        match term {
            Term::OwnForce => self.own_force.as_ref().is_some_and(|f| deviation(f) > 0.0),
            Term::OtherForce => self.other_force.as_ref().is_some_and(|f| deviation(f) > 0.0),
            Term::Position | Term::Rate | Term::Damping | Term::Friction => true,
        }
    }

    /// A signal in the band, at every row.
    pub(super) fn smooth(&self, signal: &[f64]) -> Vec<f64> {
        self.low_pass.map_or_else(|| signal.to_vec(), |f| f.of(signal))
    }

    /// A signal in the band, at the rows that count.
    pub(super) fn in_band(&self, signal: &[f64]) -> Vec<f64> {
        let values = self.smooth(signal);
        self.kept.iter().map(|row| values.get(*row).copied().unwrap_or(0.0)).collect()
    }
}

/// The rows that are used: all, or of a long recording the piece with the most force.
fn most_force(force: &[f64]) -> Range<usize> {
    if force.len() <= MOST_ROWS {
        return 0..force.len();
    }
    let power = |from: usize| force.iter().skip(from).take(MOST_ROWS).filter(|f| f.is_finite()).map(|f| f * f).sum::<f64>();
    let starts = (0..=force.len() - MOST_ROWS).step_by(MOST_ROWS / 4);
    let best = starts.map(|from| (from, power(from))).max_by(|a, b| a.1.total_cmp(&b.1)).map_or(0, |(from, _)| from);
    best..best + MOST_ROWS
}

/// A signal whose holes keep the value before them.
fn filled(signal: &[f64]) -> Vec<f64> {
    let mut before = signal.iter().copied().find(|x| x.is_finite()).unwrap_or(0.0);
    let value = |x: &f64| {
        before = if x.is_finite() { *x } else { before };
        before
    };
    signal.iter().map(value).collect()
}

/// The size at which a force is clamped.
fn clamp(force: &[f64]) -> Option<f64> {
    let largest = force.iter().fold(0.0_f64, |m, f| m.max(f.abs()));
    let there = force.iter().filter(|f| f.abs() >= largest * (1.0 - 1e-6)).count();
    (largest > 0.0 && there >= 10 && there as f64 >= CLAMPED_SHARE * force.len() as f64).then_some(largest)
}

/// Upper limit of the band in which the possible inputs of the law determine the force, Hz.
fn band(force: &[f64], own: &[f64], other: &[f64], forces: [Option<&[f64]>; 2], period_s: f64) -> f64 {
    let half = 0.5 / period_s;
    let error: Vec<f64> = other.iter().zip(own).map(|(r, x)| r - x).collect();
    // A law of velocity cannot be identified from a position that drifts, because drift leaks over every line.
    let rate = |x: &[f64]| FilteredRate::of(x, 2.0 * period_s, period_s);
    let (error_rate, own_rate) = (rate(&error), rate(own));
    let mut columns: Vec<&[f64]> = vec![force, &error, own, &error_rate, &own_rate];
    columns.extend(forces.into_iter().flatten());
    let segment = ((0.5 / period_s) as usize).min(force.len() / 8).max(16);
    let whole = 0..force.len();
    let Some(spectra) = welch(&columns, std::slice::from_ref(&whole), segment, period_s, half) else { return half };
    let best = |line: usize| (1..columns.len()).map(|c| spectra.coherence(line, 0, c)).fold(0.0, f64::max);
    let all: Vec<f64> = (0..spectra.hz.len()).map(best).collect();
    // A single line may lie in a notch: a tenth of the frequency to either side is evaluated together.
    let smooth = |line: usize| {
        let wide = (line / 10).max(1);
        let piece = all.get(line.saturating_sub(wide)..(line + wide + 1).min(all.len())).unwrap_or_default();
        piece.iter().sum::<f64>() / piece.len().max(1) as f64
    };
    let good = (0..all.len()).rev().find(|line| smooth(*line) >= COHERENT).and_then(|line| spectra.hz.get(line));
    good.copied().unwrap_or(LEAST_BAND_HZ).max(LEAST_BAND_HZ).min(half)
}
