//! An axis's stability limit from the newest windows.

use super::edge::Edge;
use super::lines::{DITHER, FELT, Lines, MAX_LINES, SENT, Taken, Window};
use crate::margins::critical_factor;
use nalgebra::Complex;
use std::f64::consts::TAU;

/// Length of a window, s.
const WINDOW_S: f64 = 0.6;

/// Windows that count.
const WINDOWS: usize = 8;

/// Windows without an impact that an answer needs.
const LEAST_WINDOWS: usize = 3;

/// A window whose force, beside its dither, has more than this times the power of the third quietest holds an impact or a jerk of the hand. The quietest of
/// all is no measure: where friction holds the device still for a window, the force that comes back is a hundredth of what it is in the others.
const QUIET: f64 = 10.0;

/// Contact forces that are missing for up to this time are bridged by the last one, s: the loop itself holds it. It is half a period of the highest line.
const BRIDGED_S: f64 = 0.002;

/// An answer is given up where no window came to its end for this time, s.
const OLD_S: f64 = 2.0;

/// Lowest and highest line, Hz.
const BAND_HZ: [f64; 2] = [6.5, 250.0];

/// Distance of neighbouring lines: a window's resolution, and this share of the frequency where that is more.
const SPACING: f64 = 0.085;

/// The hand may mask lines up to here, Hz; the limit that the other lines show is reported nevertheless.
const HAND_HZ: f64 = 16.0;

/// Standard deviation of a known line, as a share of its magnitude, at most.
pub(super) const KNOWN: f64 = 0.3;

/// Lines on which the dither has less than this share of its strongest line's power are left out.
const LEAST_POWER: f64 = 1e-3;

/// Steps in which nothing at all is felt that mean free motion.
const FREE_STEPS: u32 = 3;

/// Scatter of one window's answer, as a share of it, that leakage leaves even without noise (found in the tests here).
const LEAST_SCATTER: f64 = 0.15;

/// Estimates the stability limit of one axis of the running loop. A step costs the same whatever is estimated and allocates nothing.
#[derive(Debug, Clone)]
pub struct LiveMargin {
    count: usize,
    pub(super) hz: Lines,
    pub(super) twice_cosine: Lines,
    hann: Vec<f64>,
    windows: Box<[Window; 2]>,
    taken: Vec<Taken>,
    oldest: usize,
    /// The signals of the step before, and how they changed in it.
    pub(super) last: Option<[f64; 3]>,
    pub(super) slope: Option<[f64; 3]>,
    pub(super) mu: f64,
    free_steps: u32,
    /// Steps without a contact force now, and how many are bridged.
    missing: u32,
    bridged: u32,
    /// Steps since a window came to its end, and after how many an answer is old.
    since_window: u32,
    old: u32,
    pub(super) least_force: f64,
    pub(super) edge: Edge,
}

impl LiveMargin {
    /// For a dither of one value per step, N or N m, repeated when it ends; `least_force`: a felt force below this RMS is
    /// none, N or N m. `None` where the dither has no power on any line.
    pub fn new(dither: &[f64], least_force: f64, period_s: f64) -> Option<LiveMargin> {
        if dither.is_empty() || !(period_s.is_finite() && period_s > 0.0) || dither.iter().any(|d| !d.is_finite()) {
            return None;
        }
        let half = ((0.5 * WINDOW_S / period_s).round() as usize).max(8);
        let length = 2 * half;
        let hann: Vec<f64> = (0..length).map(|i| 0.5 - 0.5 * (TAU * (i as f64 + 0.5) / length as f64).cos()).collect();
        let resolution = 1.0 / (length as f64 * period_s);
        let highest = BAND_HZ[1].min(0.2 / period_s);
        let mut all = Vec::new();
        let mut hz = BAND_HZ[0].max(4.0 * resolution);
        while hz <= highest && all.len() < MAX_LINES {
            all.push(hz);
            hz += resolution.max(SPACING * hz);
        }
        // Where the dither has power, over a whole period of it.
        let mut power = vec![0.0; all.len()];
        let windows = dither.len().div_ceil(half).max(2);
        for window in 0..windows {
            for (line, hz) in all.iter().enumerate() {
                let w = TAU * hz * period_s;
                let sample = |i: usize| dither[(window * half + i) % dither.len()];
                let sum: Complex<f64> =
                    (1..length).map(|i| Complex::from_polar(hann[i] * (sample(i) - sample(i - 1)), -w * i as f64)).sum();
                // A difference has (w T)^2 times the power of the signal.
                power[line] += sum.norm_sqr() / (w * w);
            }
        }
        let strongest = power.iter().copied().fold(0.0, f64::max);
        let used: Vec<f64> = all.iter().zip(&power).filter(|(_, p)| **p > LEAST_POWER * strongest).map(|(hz, _)| *hz).collect();
        if used.len() < 2 {
            return None;
        }
        let (mut hz, mut twice_cosine) = ([f64::NAN; MAX_LINES], [0.0; MAX_LINES]);
        for (line, f) in used.iter().enumerate() {
            (hz[line], twice_cosine[line]) = (*f, 2.0 * (TAU * f * period_s).cos());
        }
        let none = Taken { amplitudes: [[Complex::new(0.0, 0.0); MAX_LINES]; 3], power: 0.0 };
        Some(LiveMargin {
            count: used.len(),
            hz,
            twice_cosine,
            hann,
            windows: Box::new([Window::EMPTY, Window::EMPTY]),
            taken: vec![none; WINDOWS],
            oldest: 0,
            last: None,
            slope: None,
            mu: f64::NAN,
            free_steps: 0,
            missing: 0,
            bridged: ((BRIDGED_S / period_s).round() as u32).max(1),
            since_window: 0,
            old: (OLD_S / period_s).round() as u32,
            least_force,
            edge: Edge::Free,
        })
    }

    /// The lines, Hz.
    pub fn lines_hz(&self) -> &[f64] {
        &self.hz[..self.count]
    }

    /// What is known now.
    pub fn edge(&self) -> Edge {
        self.edge
    }

    /// Forgets everything: what it is of has changed.
    fn restart(&mut self) {
        (self.missing, self.since_window) = (0, 0);
        if self.last.is_none() && self.edge == Edge::Free {
            return;
        }
        self.drop_windows();
        self.taken.iter_mut().for_each(|t| t.power = 0.0);
        self.edge = Edge::Free;
    }

    /// Gives up the windows that have begun; those that came to their end are of the same loop and stay.
    fn drop_windows(&mut self) {
        self.windows.iter_mut().for_each(Window::clear);
        (self.last, self.slope) = (None, None);
    }

    /// A step without a contact force: nothing was sent, and the master holds the last force. The held values of the step before, or `None` where the gap is
    /// too long for a window to bridge.
    fn held(&mut self) -> Option<[f64; 2]> {
        self.missing = self.missing.saturating_add(1);
        let held = self.last.filter(|_| self.missing <= self.bridged).map(|[_, sent, felt]| [sent, felt]);
        if held.is_none() {
            self.drop_windows();
        }
        held
    }

    /// One step: the dither, the force sent, which holds it, and the contact force felt of which it is made, N or N m; `None` for one that has not
    /// come. `mu` is the position scale now: the critical gain is that of one position scale, so a change restarts the estimate. Returns whether
    /// [`LiveMargin::edge`] is new.
    pub fn step(&mut self, dither: f64, sent: f64, felt: Option<f64>, mu: f64) -> bool {
        if mu != self.mu {
            self.mu = mu;
            self.restart();
            return false;
        }
        self.since_window = self.since_window.saturating_add(1);
        if self.since_window > self.old && self.edge != Edge::Late {
            self.taken.iter_mut().for_each(|t| t.power = 0.0);
            self.edge = Edge::Late;
            return true;
        }
        let felt = felt.filter(|f| f.is_finite() && sent.is_finite());
        let [sent, felt] = match felt {
            Some(felt) => {
                self.missing = 0;
                [sent, felt]
            }
            None => match self.held() {
                Some(held) => held,
                None => return false,
            },
        };
        self.free_steps = if felt == 0.0 { (self.free_steps + 1).min(FREE_STEPS) } else { 0 };
        if self.free_steps >= FREE_STEPS {
            self.restart();
            return false;
        }
        let now = [dither, sent, felt];
        let Some(last) = self.last.replace(now) else {
            // The second window begins half a window after the first.
            self.windows[1].at = 0;
            return false;
        };
        let slope = [now[0] - last[0], now[1] - last[1], now[2] - last[2]];
        let Some(before) = self.slope.replace(slope) else { return false };
        let differences = [slope[0] - before[0], slope[1] - before[1], slope[2] - before[2]];
        let (length, half) = (self.hann.len(), self.hann.len() / 2);
        let second_runs = self.windows[1].at > 0 || self.windows[0].at == half;
        let mut is_new = false;
        for index in 0..2 {
            if index == 1 && !second_runs {
                continue;
            }
            let window = &mut self.windows[index];
            let weight = self.hann[window.at];
            window.take(weight, differences, &self.twice_cosine);
            window.square_sum += felt * felt;
            if window.at == length {
                is_new |= self.close(index);
            }
        }
        is_new
    }

    /// A window is over.
    fn close(&mut self, index: usize) -> bool {
        let length = self.hann.len();
        let window = &self.windows[index];
        let rms = (window.square_sum / length as f64).sqrt();
        self.since_window = 0;
        if rms < self.least_force {
            self.restart();
            return true;
        }
        let taken = &mut self.taken[self.oldest];
        self.oldest = (self.oldest + 1) % WINDOWS;
        for line in 0..self.count {
            let cosine = 0.5 * self.twice_cosine[line];
            let turn = Complex::new(cosine, (1.0 - cosine * cosine).max(0.0).sqrt());
            for signal in [DITHER, SENT, FELT] {
                taken.amplitudes[signal][line] = window.amplitude(signal, line, turn);
            }
        }
        let power = |signal: usize| taken.amplitudes[signal][..self.count].iter().map(|z| z.norm_sqr()).sum::<f64>();
        taken.power = if power(DITHER) > 0.0 { power(FELT) / power(DITHER) } else { 0.0 };
        self.windows[index].clear();
        self.edge = self.estimate();
        true
    }

    fn estimate(&self) -> Edge {
        let there = || self.taken.iter().filter(|t| t.power > 0.0);
        if there().count() < LEAST_WINDOWS {
            return Edge::Settling;
        }
        let below = |power: f64| there().filter(|t| t.power < power).count();
        let quietest = there().map(|t| t.power).filter(|power| below(*power) < LEAST_WINDOWS).fold(0.0, f64::max);
        let quiet = || there().filter(|t| t.power <= QUIET * quietest);
        let windows = quiet().count();
        let nothing = Complex::new(0.0, 0.0);
        let (mut response, mut deviation) = ([Complex::new(f64::NAN, f64::NAN); MAX_LINES], [f64::INFINITY; MAX_LINES]);
        let mut most = 0.0_f64;
        let mut known = [false; MAX_LINES];
        let mut all = [nothing; MAX_LINES];
        for line in 0..self.count {
            let at = |t: &Taken, signal: usize| t.amplitudes[signal][line];
            let cross = |a: usize, b: usize| quiet().map(|t| at(t, a).conj() * at(t, b)).sum::<Complex<f64>>();
            let (dither_sent, dither_felt) = (cross(DITHER, SENT), cross(DITHER, FELT));
            if dither_sent.norm_sqr() == 0.0 {
                return Edge::Above { lambda: 0.0 };
            }
            let p = dither_felt / dither_sent;
            let residual: f64 = quiet().map(|t| (at(t, FELT) - p * at(t, SENT)).norm_sqr()).sum();
            let variance = cross(DITHER, DITHER).re * residual / (windows as f64 - 1.0) / dither_sent.norm_sqr();
            let sd = variance.sqrt();
            (all[line], deviation[line]) = (p, sd);
            most = most.max(p.norm() + 2.0 * sd);
            known[line] = sd < KNOWN * p.norm();
            if known[line] {
                response[line] = p;
            }
        }
        let bound = if most > 0.0 { Edge::Above { lambda: 1.0 / most } } else { Edge::Free };
        let hz = &self.hz[..self.count];
        let Some(edge) = critical_factor(hz, &response[..self.count]) else { return bound };
        // The lines that the limit was read from must be neighbours, and no unknown line may hide a lower one.
        let above = hz.iter().position(|f| *f > edge.frequency_hz).unwrap_or(self.count - 1).max(1);
        let (lower, upper) = (above - 1, above);
        let hidden = (0..self.count).any(|i| !known[i] && hz[i] > HAND_HZ && (all[i].norm() + 2.0 * deviation[i]) * edge.factor > 1.0);
        if !known[lower] || !known[upper] || hidden {
            return bound;
        }
        let share = |line: usize| deviation[line] / all[line].norm();
        let scatter = LEAST_SCATTER / (windows as f64).sqrt();
        let deviation = (0.5 * share(lower).hypot(share(upper))).max(scatter);
        Edge::At { lambda: edge.factor, deviation, frequency_hz: edge.frequency_hz }
    }
}
