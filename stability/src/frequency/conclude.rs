//! One stability limit from those of all amplitudes, gains and states of contact, extrapolated to rest and to large motions.

use super::edge::{self, Edge};
use super::note::Note;
use super::{Frequency, LevelEstimate};
use crate::spectra::Window;
use backdrive_control::margins::critical_factor;
use nalgebra::Complex;

/// Levels or gains whose stability limits differ by less are not distinguished.
const SAME_EDGE: f64 = 0.05;

/// Whether two stability limits differ by more than their uncertainty.
fn apart(a: &Edge, b: &Edge) -> bool {
    let (Some((a_low, a_high)), Some((b_low, b_high))) = (a.interval(), b.interval()) else { return false };
    let above = |low: f64, high: Option<f64>| high.is_some_and(|high| low > high);
    if !above(a_low, b_high) && !above(b_low, a_high) {
        return false;
    }
    let value = |e: &Edge, low: f64| e.gain.unwrap_or(low);
    (value(a, a_low) / value(b, b_low)).ln().abs() > SAME_EDGE
}

impl Frequency {
    /// One answer from all levels.
    pub(super) fn conclude(&mut self) {
        let pairs = |edges: &[&Edge]| (0..edges.len()).any(|i| (0..i).any(|j| apart(edges[i], edges[j])));
        let mut states: Vec<Vec<bool>> = self.levels.iter().map(|l| l.contact.clone()).collect();
        states.sort();
        states.dedup();
        self.amplitude_dependent = states.iter().any(|state| {
            let edges: Vec<&Edge> = self.levels.iter().filter(|l| &l.contact == state).map(|l| &l.edge).collect();
            pairs(&edges)
        });
        self.gains_disagree = pairs(&self.gains.iter().map(|g| &g.edge).collect::<Vec<_>>());
        if self.gains_disagree {
            self.notes.push(Note::GainsDisagree);
        }
        if self.amplitude_dependent {
            self.notes.push(Note::AmplitudeDependent);
        }
        let edges: Vec<Edge> = self.levels.iter().map(|l| l.edge).collect();
        let several = self.amplitude_dependent || states.len() > 1;
        self.edge = if several { widest(&edges) } else { sharpest(&edges) };
        if self.amplitude_dependent && states.len() == 1 {
            self.continue_to_large_amplitude();
            self.continue_to_rest();
        }
        if let Some(level) = self.levels.first() {
            self.method = describe(level);
        }
    }

    /// Widens the interval to the stability limit above the largest dither, because an impact moves the master more than a dither may.
    ///
    /// By its describing function, dry friction (and a hysteresis that has reached its limit) takes a share `c/d` of a force of amplitude `d`. The
    /// stability limit therefore approaches its final value as `1/d`: a straight line through the two largest amplitudes.
    fn continue_to_large_amplitude(&mut self) {
        let mut levels: Vec<(f64, f64, f64)> = Vec::new();
        for level in &self.levels {
            let low = level.edge.interval().map_or(0.0, |i| i.0);
            levels.extend(level.edge.gain.or(level.edge.at_least).map(|gain| (level.amplitude_rms, gain, low)));
        }
        levels.sort_by(|a, b| a.0.total_cmp(&b.0));
        let [.., (d1, k1, _), (d2, k2, low)] = levels[..] else { return };
        if !(d2 > 1.2 * d1 && k2 > 0.0) {
            return;
        }
        // A line through two points is not trusted beyond a factor of three.
        let limit = (k2 + (k2 - k1) * d1 / (d2 - d1)).clamp(k2 / 3.0, 3.0 * k2);
        if let Some((from, to)) = &mut self.edge.ci95 {
            *from = from.min(limit * low / k2);
            *to = to.map(|to| to.max(limit));
            self.notes.push(Note::ContinuedToLarge { gain: limit });
        }
    }

    /// Widens the interval to the stability limit below the smallest dither, where something is cancelled.
    ///
    /// A master that dry friction holds does not move, but the canceller still subtracts. G_f is then 0, and the remaining path from F_f to x_c is
    /// the canceller's own response, measured as the difference of the two.
    fn continue_to_rest(&mut self) {
        let largest = self.levels.iter().max_by(|a, b| a.amplitude_rms.total_cmp(&b.amplitude_rms));
        let Some((level, axis)) = largest.and_then(|level| Some((level, level.axes.first().filter(|_| level.axes.len() == 1)?))) else {
            return;
        };
        let complex = |v: &[f64; 2]| Complex::new(v[0], v[1]);
        let (mut hz, mut held) = (Vec::new(), Vec::new());
        let (mut cancelled, mut moved) = (0.0, 0.0);
        for (line, f) in level.hz.iter().enumerate().filter(|(line, _)| axis.told[*line]) {
            let (g, c) = (complex(&axis.g_f.value[line]), complex(&axis.motion.value[line]));
            if !(g.norm().is_finite() && c.norm().is_finite() && c.norm() > 0.0) {
                continue;
            }
            (cancelled, moved) = (cancelled + (c - g).norm_sqr(), moved + g.norm_sqr());
            hz.push(*f);
            held.push(complex(&axis.l[line]) * (c - g) / c);
        }
        // Where nothing is cancelled a held master opens the loop.
        if cancelled < 0.04 * moved {
            return;
        }
        let Some(edge) = critical_factor(&hz, &held) else { return };
        if let Some((from, to)) = &mut self.edge.ci95 {
            *from = from.min(0.95 * edge.factor);
            *to = to.map(|to| to.max(1.05 * edge.factor));
            self.notes.push(Note::ContinuedToRest { gain: edge.factor });
        }
    }
}

/// The stability limit with the least uncertainty.
fn sharpest(edges: &[Edge]) -> Edge {
    let width = |e: &Edge| match e.ci95 {
        Some((low, Some(high))) => (high / low).ln(),
        Some(_) => 1e3,
        None => 1e6 / e.at_least.unwrap_or(0.0).max(1e-6),
    };
    edges.iter().min_by(|a, b| width(a).total_cmp(&width(b))).copied().unwrap_or_default()
}

/// The lowest stability limit, with an interval over all of them.
fn widest(edges: &[Edge]) -> Edge {
    let low = edges.iter().filter_map(|e| e.interval()).map(|i| i.0).min_by(f64::total_cmp);
    let open = edges.iter().any(|e| e.interval().is_none_or(|i| i.1.is_none()));
    let high = edges.iter().filter_map(|e| e.interval().and_then(|i| i.1)).max_by(f64::total_cmp);
    let lowest = edges.iter().filter(|e| e.gain.is_some()).min_by(|a, b| a.gain.unwrap_or(0.0).total_cmp(&b.gain.unwrap_or(0.0)));
    match (lowest, low) {
        (Some(lowest), Some(low)) => Edge { ci95: Some((low, high.filter(|_| !open))), ..*lowest },
        _ => sharpest(edges),
    }
}

fn describe(level: &LevelEstimate) -> String {
    let a = &level.averaging;
    let cut = match a.window {
        Window::Periods => format!("{} whole periods of {:.2} s of the dither, no window", a.segments, a.segment_s),
        Window::Hann => {
            format!("{} segments of {:.2} s, Hann window, {:.0} % overlap, trend removed", a.segments, a.segment_s, a.overlap * 100.0)
        }
    };
    let by = if level.amplitude_rms > 0.0 { "the dither as instrument" } else { "intent and force as inputs" };
    format!(
        "loop by cross-spectra with {by}: {cut}, {:.1} independent averages, lines {:.2} Hz apart, locally quadratic over 6 % of the \
         frequency. A line is used if the loop is {} times its standard deviation. The interval is from draws of the noise, with half \
         the resolution for the bias",
        a.averages,
        a.resolution_hz,
        edge::TOLD
    )
}
