//! The excitations that may be chosen, within the range that the recordings cover.
//!
//! Each shape separates certain laws:
//!
//! | shape | separates |
//! |---|---|
//! | triangles of two speeds | friction that grows with speed from friction that does not |
//! | slow small triangles | a jump of friction at reversal from presliding, a gap from either |
//! | nested reversals | hysteresis that remembers its last reversal from one that remembers all of them |
//! | sines of two amplitudes and two frequencies | a gap or friction (falls with amplitude) from a delay (grows with frequency) |
//! | multisine at two levels, sweeps | delay, lag, inertia and compliance by phase and gain; what scales from what does not |
//! | steps of several levels | a limit of the drive from a softening spring; what saturates |
//! | impacts | contacts and what is stiff |
//! | a bias with little on it | asymmetric laws from offsets; a bias closes a gap |

use crate::recordings::problem::Problem;
use crate::tuning::tuning;
use backdrive_plant::excitation::{Excitation, Grid, Shape, Spacing};
use backdrive_plant::model::InputKind;
use backdrive_plant::write::round_significant;
use std::f64::consts::TAU;

/// The range of an input over all recordings of a problem.
#[derive(Debug, Clone, Copy)]
pub(super) struct InputRange {
    /// Mean value, unit of the input; 0 where it is small against the peak.
    pub mean: f64,
    /// Largest departure from the mean, unit of the input.
    peak: f64,
    /// Amplitude that it may have throughout: twice the largest root mean square of a recording, at most the peak.
    lasting: f64,
    /// Largest rate of change, unit of the input per s; infinite for forces.
    rate: f64,
    /// Largest second derivative, unit of the input per s²; infinite for forces.
    curvature: f64,
    /// Frequency that it mostly had, Hz.
    centre: f64,
}

impl InputRange {
    /// What the recordings show of one input. `None` where it never moves.
    pub(super) fn of(problem: &Problem, input: usize) -> Option<InputRange> {
        let records = problem.fit.iter().chain(&problem.held_out);
        let columns: Vec<(&[f64], f64)> = records.filter_map(|r| Some((r.inputs.get(input)?.as_slice(), r.period))).collect();
        let count: usize = columns.iter().map(|c| c.0.len()).sum();
        let mean = columns.iter().flat_map(|c| c.0).sum::<f64>() / count.max(1) as f64;
        let largest = |mean: f64| columns.iter().flat_map(|c| c.0).fold(0.0f64, |a, u| a.max((u - mean).abs()));
        let mean = if mean.abs() < tuning().experiment.small_mean * largest(mean) { 0.0 } else { mean };
        let shown = largest(mean);
        if !(shown > 0.0 && shown.is_finite()) {
            return None;
        }
        let rms = |u: &[f64]| (u.iter().map(|u| (u - mean).powi(2)).sum::<f64>() / u.len().max(1) as f64).sqrt();
        let strongest = columns.iter().map(|c| rms(c.0)).fold(0.0, f64::max);
        let own = problem.model.inputs.get(input)?;
        let is_motion = own.kind == InputKind::Motion;
        let limit = problem.model.axes.iter().filter(|a| a.feedback == input).filter_map(|a| a.force).reduce(f64::min);
        let peak = match limit {
            Some(limit) if !is_motion => (tuning().experiment.force * shown).min(limit - mean.abs()).max(shown.min(limit)),
            _ => shown,
        };
        let (rate, curvature) = if is_motion { rates(&columns) } else { (f64::INFINITY, f64::INFINITY) };
        let mut centres: Vec<f64> = columns.iter().filter_map(|(u, period)| crossings(u, *period)).collect();
        centres.sort_by(f64::total_cmp);
        let centre = centres.get(centres.len() / 2).copied().unwrap_or(1.0);
        // A peak of short duration, such as an impact, may not last.
        Some(InputRange { mean, peak, lasting: (peak / shown * 2.0 * strongest).min(peak), rate, curvature, centre })
    }

    /// By how much an excitation's samples have to be made smaller to stay within it, at most 1.
    pub(super) fn share(&self, samples: &[f64], period: f64, lasting: bool) -> f64 {
        let highest = samples.iter().fold(0.0f64, |a, u| a.max(u.abs()));
        let (rate, curvature) = if self.rate.is_finite() { rates(&[(samples, period)]) } else { (0.0, 0.0) };
        let level = if lasting { self.lasting } else { self.peak };
        [level / highest, self.rate / rate, self.curvature / curvature].into_iter().filter(|x| x.is_finite()).fold(1.0, f64::min)
    }
}

/// Rate of change and second derivative that only one sample in a thousand exceeds: noise and jumps do not count.
fn rates(columns: &[(&[f64], f64)]) -> (f64, f64) {
    let high = |mut all: Vec<f64>| {
        let at = all.len().saturating_sub(1 + all.len() / 1000);
        if all.is_empty() { 0.0 } else { *all.select_nth_unstable_by(at, f64::total_cmp).1 }
    };
    let speeds = columns.iter().flat_map(|(u, h)| u.windows(3).map(move |w| ((w[2] - w[0]) / (2.0 * h)).abs()));
    let bends = columns.iter().flat_map(|(u, h)| u.windows(3).map(move |w| ((w[2] - 2.0 * w[1] + w[0]) / (h * h)).abs()));
    (high(speeds.collect()), high(bends.collect()))
}

/// Frequency of a signal by how often it crosses its mean, Hz.
fn crossings(u: &[f64], period: f64) -> Option<f64> {
    let mean = u.iter().sum::<f64>() / u.len().max(1) as f64;
    let times = u.windows(2).filter(|w| (w[0] - mean) * (w[1] - mean) < 0.0).count();
    (times > 0).then(|| times as f64 / (2.0 * u.len() as f64 * period))
}

/// An excitation of one input that may be played.
#[derive(Debug, Clone)]
pub(super) struct Choice {
    /// The input.
    pub input: usize,
    /// What shakes it.
    pub excitation: Excitation,
    /// Whether its amplitude lasts, other than a knock's.
    pub lasting: bool,
}

/// Every excitation that is considered. `period` is the sample time, s, and `longest` the length of the longest recording, s.
pub(super) fn choices(problem: &Problem, ranges: &[Option<InputRange>], period: f64, longest: f64) -> Vec<Choice> {
    let mut all = Vec::new();
    for (input, range) in ranges.iter().enumerate() {
        let (Some(range), Some(own)) = (range, problem.model.inputs.get(input)) else { continue };
        let highest = tuning().experiment.band / period;
        let centre = range.centre.clamp(2.0 / longest, 0.5 * highest);
        let long = longest.min((8.0 / centre).max(3.0)).min(tuning().experiment.longest * period);
        let mut spans = vec![(long, 12.0), (long / 3.0, 12.0)];
        if highest > 24.0 * centre {
            // Much faster than what was recorded, too: a drive's lag shows there, and stiff joints.
            spans.push((long, highest / centre));
        }
        for (length, width) in spans {
            let high = highest.min(width * centre);
            let centre = if width > 12.0 { (centre * high).sqrt() } else { centre };
            let band = Band { length, low: (centre / 8.0).max(1.5 / length), centre: centre.max(3.0 / length), high };
            if band.low >= band.high || band.centre >= band.high {
                continue;
            }
            let shapes = if own.kind == InputKind::Motion { motions(range, &band) } else { forces(range, &band, period) };
            all.extend(shapes.into_iter().map(|(shape, bias)| {
                let lasting = !matches!(shape, Shape::Impacts { .. });
                Choice { input, excitation: framed(shape, range.mean + bias, length), lasting }
            }));
        }
    }
    all
}

/// How long, s, and from which over which to which frequency, Hz.
struct Band {
    length: f64,
    low: f64,
    centre: f64,
    high: f64,
}

fn round(x: f64) -> f64 {
    round_significant(x, 3)
}

fn sweep(amplitude: f64, band: &Band, tilt: f64) -> Shape {
    let spacing = Spacing::Log;
    Shape::Sweep { amplitude: round(amplitude), from: round(band.low), to: round(band.high), duration: round(band.length), spacing, tilt }
}

fn multisine(peak: f64, band: &Band, to: f64, periods: u32, levels: &[f64], grid: Grid) -> Shape {
    let period = round_significant(band.length / (f64::from(periods) * levels.len() as f64), 2);
    let (from, peak) = (round(band.low.max(1.0 / period)), Some(round(peak)));
    Shape::Multisine { rms: None, peak, from, to: round(to), period, periods, levels: levels.to_vec(), grid, seed: 1, crest: 20 }
}

fn triangle(amplitude: f64, period: &[f64], cycles: u32, nested: u32) -> Shape {
    Shape::Triangle { amplitude: round(amplitude), period: period.iter().map(|p| round(*p)).collect(), cycles, nested, inner: 0.5 }
}

/// Sines that fill a length.
fn sines(amplitude: &[f64], frequency: &[f64], length: f64) -> Shape {
    let one = length / amplitude.len() as f64;
    let cycles = (one / frequency.iter().map(|f| 1.0 / f).sum::<f64>()).floor().clamp(1.0, 200.0) as u32;
    Shape::Sines {
        amplitude: amplitude.iter().map(|a| round(*a)).collect(),
        frequency: frequency.iter().map(|f| round(*f)).collect(),
        cycles,
    }
}

/// Shapes for a force, each with a bias that it rides on. Their length is about that of the band.
fn forces(range: &InputRange, band: &Band, period: f64) -> Vec<(Shape, f64)> {
    let (a, peak, t) = (range.lasting, range.peak, band.length);
    let middle = (band.low * band.centre).sqrt();
    let width = round((6.0 * period).max(0.25 / band.high));
    let interval = round(t / 4.0);
    let mut all = vec![
        (sweep(a, band, 0.0), 0.0),
        (sweep(0.3 * a, band, 0.0), 0.0),
        (multisine(a, band, band.high, 2, &[1.0, 0.3], Grid::Odd), 0.0),
        (multisine(a, band, band.centre, 1, &[1.0, 0.3], Grid::Full), 0.0),
        (triangle(a, &[0.6 * t, 0.2 * t], 1, 0), 0.0),
        (triangle(a, &[0.16 * t, 0.04 * t], 4, 0), 0.0),
        (triangle(a, &[0.4 * t], 1, 3), 0.0),
        (triangle(0.25 * a, &[0.6 * t, 0.2 * t], 1, 0), 0.0),
        (Shape::Steps { amplitude: [0.25, 0.5, 1.0].map(|x| round(x * a)).to_vec(), hold: round(t / 12.0), rise: 0.0, count: 1 }, 0.0),
        (sines(&[0.25 * a, a], &[band.low, band.centre], t), 0.0),
        (sines(&[0.25 * a, a], &[middle, 4.0 * middle], t), 0.0),
        (sines(&[0.25 * a, a], &[band.centre, 4.0 * band.centre.min(band.high / 4.0)], t), 0.0),
        (sines(&[0.25 * a, a], &[band.high / 3.0, band.high], t / 2.0), 0.0),
        (sines(&[0.15 * a], &[band.centre], t), 0.6 * a),
        (triangle(0.3 * a, &[0.45 * t], 2, 0), 0.6 * a),
    ];
    if width < interval {
        let amplitude = [1.0, -1.0, 0.4, -0.4].map(|x| round(x * peak)).to_vec();
        all.push((Shape::Impacts { amplitude, width, interval, count: 1, bounces: 0 }, 0.0));
    }
    all
}

/// Shapes for a prescribed motion: without corners, and within the speed and acceleration that were recorded.
fn motions(range: &InputRange, band: &Band) -> Vec<(Shape, f64)> {
    let (a, t) = (range.lasting, band.length);
    // The amplitude that has the recorded speed at a frequency.
    let at = |f: f64| a.min(range.rate / (TAU * f));
    let one = |share: f64, f: f64| sines(&[share * at(f)], &[f], t);
    vec![
        (sweep(at(band.low), band, -1.0), 0.0),
        (sweep(0.3 * at(band.low), band, -1.0), 0.0),
        (sweep(at(band.high), band, 0.0), 0.0),
        (sweep(at(band.low), &Band { high: band.centre, ..*band }, -0.5), 0.0),
        (multisine(at(band.centre), band, band.high, 2, &[1.0], Grid::Odd), 0.0),
        (multisine(a, band, band.centre, 1, &[1.0], Grid::Full), 0.0),
        (one(1.0, band.low), 0.0),
        (one(0.25, band.low), 0.0),
        (one(1.0, band.centre), 0.0),
        (one(0.25, band.centre), 0.0),
        (one(1.0, 4.0 * band.centre.min(band.high / 4.0)), 0.0),
        (one(0.15, band.centre), 0.6 * a),
    ]
}

/// Rest before it. Excitations that would start with a jump, or would not end at zero, are faded.
fn framed(shape: Shape, offset: f64, length: f64) -> Excitation {
    let fade = round_significant(0.08 * length, 2);
    let fades = offset != 0.0 || matches!(shape, Shape::Sweep { .. } | Shape::Multisine { .. } | Shape::Sines { .. });
    let (fade_in, fade_out) = if fades && 2.5 * fade < shape.duration() { (fade, fade) } else { (0.0, 0.0) };
    Excitation { quiet: round_significant(0.02 * length, 1), fade_in, fade_out, offset: round(offset), ..Excitation::of(shape) }
}

/// The same excitation with its amplitude and offset multiplied.
pub(super) fn scaled(excitation: &Excitation, factor: f64) -> Excitation {
    let mut new = excitation.clone();
    new.offset = round(factor * new.offset);
    let by = |x: &mut f64| *x = round(factor * *x);
    match &mut new.shape {
        Shape::Sweep { amplitude, .. } | Shape::Triangle { amplitude, .. } => by(amplitude),
        Shape::Multisine { rms, peak, .. } => rms.iter_mut().chain(peak).for_each(by),
        Shape::Steps { amplitude, .. } | Shape::Impacts { amplitude, .. } | Shape::Sines { amplitude, .. } => {
            amplitude.iter_mut().for_each(by)
        }
    }
    new
}

/// A constant value for as long as `length`, s: what another input keeps meanwhile.
pub(super) fn constant(value: f64, length: f64) -> Excitation {
    let hold = length / 4.0;
    let fade = round_significant(0.08 * length, 2);
    let steps = Shape::Steps { amplitude: vec![0.0], hold, rise: 0.0, count: 1 };
    Excitation { offset: round(value), fade_in: fade, fade_out: fade, ..Excitation::of(steps) }
}
