//! How far the running loop is from its edge, told from the loop itself.
//!
//! **With a dither** `d` on the force channel: the backward path sends `F_f(k) = lambda F_s(k-1) + d(k)` and knows all three
//! exactly, so `P = S_(d,F_s) / S_(d,F_f)` is the response once round the loop from the force sent to the force felt, whatever
//! the hand does and whatever the gain is; `L = lambda P`, and the edge is where `lambda P` passes through `+1`
//! ([`crate::margins`]). The three are demodulated at up to 40 lines from 6.7 to 250 Hz where the dither has power, in Hann windows
//! of 0.6 s that overlap by half, by Goertzel's recursion on their second differences (which takes the slow force
//! of the hand out before it leaks). The newest eight windows count, without those that hold an impact. The residual
//! `F_s - P F_f` over the windows gives each line's standard deviation (Bendat & Piersol, for an instrumental variable);
//! a line that is not known well enough might hide a nearer edge, and then only a bound is told: with
//! `|P| + 2 sd < 1 / lambda` at every line no edge is below `lambda` (small gain). In free motion nothing comes back, and
//! nothing is told. Only lines below 16 Hz, which the hand often drowns, may be unknown beside a known edge: what runs away so
//! slowly is for the guard to see. What a friction hides from a small dither stays hidden: this is the edge at the dither's amplitude. So
//! does what lies above 250 Hz or outside of the dither's band.
//!
//! **Without a dither** there is no response: operator motion alone returns `1 / (lambda H_se)`. Then only [`RingDown`] speaks:
//! how fast what the loop oscillates dies after contacts and disturbances.

use crate::margins::critical_factor;
use backdrive_msgs::margin;
use nalgebra::Complex;
use std::f64::consts::TAU;

/// Length of a window, s.
const WINDOW_S: f64 = 0.6;
/// Windows that count.
const WINDOWS: usize = 8;
/// Windows without an impact that an answer needs.
const LEAST_WINDOWS: usize = 3;
/// A window whose force, beside its dither, has more than this times the power of the quietest's holds an impact or a jerk of the hand.
const QUIET: f64 = 10.0;
/// Lowest and highest line, Hz.
const BAND_HZ: [f64; 2] = [6.5, 250.0];
/// Distance of neighbouring lines: a window's resolution, and this share of the frequency where that is more.
const SPACING: f64 = 0.085;
/// The hand may drown lines up to here, Hz, without the edge that the others show being kept back.
const HAND_HZ: f64 = 16.0;
/// Lines at most.
pub const MAX_LINES: usize = 40;
/// Standard deviation of a known line, as a share of its magnitude, at most.
const KNOWN: f64 = 0.3;
/// Lines on which the dither has less than this share of its strongest line's power are left out.
const LEAST_POWER: f64 = 1e-3;
/// Steps in which nothing at all is felt that mean free motion.
const FREE_STEPS: u32 = 3;

/// Scatter of one window's answer, as a share of it, that leakage leaves even without noise (found in the tests here).
const LEAST_SCATTER: f64 = 0.15;

/// The signals that are demodulated.
const DITHER: usize = 0;
const SENT: usize = 1;
const FELT: usize = 2;

/// Where the edge of the running loop is, as the gain of the force at the present position scale.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub enum Edge {
    /// Nothing is touched, or not for long enough.
    #[default]
    Free,
    /// In contact, and no edge is below this lambda; where it is is not known.
    Above {
        /// Force scale, no unit.
        lambda: f64,
    },
    /// It is here.
    At {
        /// Force scale, no unit.
        lambda: f64,
        /// Standard deviation of lambda, as a share of it.
        deviation: f64,
        /// What it would oscillate at there, Hz; 0 for a loop that runs away without oscillating.
        frequency_hz: f64,
    },
}

/// What a core tells of the loop's margin; the fields of [`backdrive_msgs::Margin`] that are its own.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Told {
    /// The axis that is nearest to its edge, from 0.
    pub axis: u32,
    /// One of [`backdrive_msgs::margin`].
    pub known: u32,
    /// mu*lambda now in force.
    pub gain: f64,
    /// See [`backdrive_msgs::Margin::factor`].
    pub factor: f64,
    /// See [`backdrive_msgs::Margin::deviation`].
    pub deviation: f64,
    /// See [`backdrive_msgs::Margin::frequency_hz`].
    pub frequency_hz: f64,
    /// See [`backdrive_msgs::Margin::decay_per_s`].
    pub decay_per_s: f64,
}

impl Told {
    /// What is told of an axis at the scales now in force. Without a dither `edge` is `None`.
    pub fn of(axis: usize, edge: Option<Edge>, mu: f64, lambda: f64, ring: Option<f64>) -> Told {
        let (known, factor, deviation, frequency_hz) = match edge {
            None => (margin::NO_DITHER, f64::NAN, f64::NAN, f64::NAN),
            Some(Edge::Free) => (margin::FREE, f64::NAN, f64::NAN, f64::NAN),
            Some(Edge::At { lambda: edge, deviation, frequency_hz }) if lambda > 0.0 => {
                (margin::KNOWN, edge / lambda, deviation, frequency_hz)
            }
            // A bound below the gain that is in force says nothing.
            Some(Edge::Above { lambda: edge }) if lambda > 0.0 && edge > lambda => (margin::ABOVE, edge / lambda, f64::NAN, f64::NAN),
            Some(_) => (margin::NOISY, f64::NAN, f64::NAN, f64::NAN),
        };
        let decay_per_s = ring.unwrap_or(f64::NAN);
        Told { axis: axis as u32, known, gain: mu * lambda, factor, deviation, frequency_hz, decay_per_s }
    }

    /// Whether it is the worse news of two axes: a known margin before a bound, that before what is not known.
    pub fn is_tighter_than(&self, other: &Told) -> bool {
        self.known > other.known || self.known == other.known && self.factor < other.factor
    }
}

type Lines = [f64; MAX_LINES];

/// Goertzel's recursion of the three signals at all lines over one window.
#[derive(Debug, Clone)]
struct Window {
    at: usize,
    newest: [Lines; 3],
    before: [Lines; 3],
    square_sum: f64,
}

impl Window {
    const EMPTY: Window = Window { at: 0, newest: [[0.0; MAX_LINES]; 3], before: [[0.0; MAX_LINES]; 3], square_sum: 0.0 };

    fn clear(&mut self) {
        *self = Window::EMPTY;
    }

    fn take(&mut self, weight: f64, differences: [f64; 3], twice_cosine: &Lines) {
        for (signal, difference) in differences.into_iter().enumerate() {
            let (newest, before) = (&mut self.newest[signal], &mut self.before[signal]);
            let weighted = weight * difference;
            for line in 0..MAX_LINES {
                let next = weighted + twice_cosine[line] * newest[line] - before[line];
                before[line] = newest[line];
                newest[line] = next;
            }
        }
        self.at += 1;
    }

    /// Up to a turn that is the same for all three signals.
    fn amplitude(&self, signal: usize, line: usize, turn: Complex<f64>) -> Complex<f64> {
        Complex::new(self.newest[signal][line], 0.0) - turn.conj() * self.before[signal][line]
    }
}

/// A window that is over.
#[derive(Debug, Clone)]
struct Taken {
    amplitudes: [[Complex<f64>; MAX_LINES]; 3],
    /// Power of the felt force over all lines beside the dither's; 0 for none.
    power: f64,
}

/// Estimates the edge of one axis of the running loop. A step costs the same whatever is estimated and allocates nothing.
#[derive(Debug, Clone)]
pub struct LiveMargin {
    count: usize,
    hz: Lines,
    twice_cosine: Lines,
    hann: Vec<f64>,
    windows: Box<[Window; 2]>,
    taken: Vec<Taken>,
    oldest: usize,
    /// The signals of the step before, and how they changed in it.
    last: Option<[f64; 3]>,
    slope: Option<[f64; 3]>,
    mu: f64,
    free_steps: u32,
    least_force: f64,
    edge: Edge,
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
        if self.last.is_none() {
            return;
        }
        self.windows.iter_mut().for_each(Window::clear);
        self.taken.iter_mut().for_each(|t| t.power = 0.0);
        (self.last, self.slope, self.edge) = (None, None, Edge::Free);
    }

    /// One step: the dither, the force sent, which holds it, and the contact force felt of which it is made, N or N m;
    /// `None` for one that has not come. `mu` is the position scale now: the edge is that of one position scale, so a
    /// change begins anew. Says whether [`LiveMargin::edge`] is new.
    pub fn step(&mut self, dither: f64, sent: f64, felt: Option<f64>, mu: f64) -> bool {
        let Some(felt) = felt.filter(|f| f.is_finite() && sent.is_finite()) else {
            self.restart();
            return false;
        };
        self.free_steps = if felt == 0.0 { (self.free_steps + 1).min(FREE_STEPS) } else { 0 };
        if self.free_steps >= FREE_STEPS || mu != self.mu {
            self.mu = mu;
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
        let quietest = there().map(|t| t.power).fold(f64::INFINITY, f64::min);
        let quiet = || there().filter(|t| t.power <= QUIET * quietest);
        let windows = quiet().count();
        if windows < LEAST_WINDOWS {
            return Edge::Free;
        }
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
        // The lines that it was read from must be neighbours, and no line that is not known may hide a nearer edge.
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

/// Length of a window of the ring-down, s.
const RING_WINDOW_S: f64 = 0.05;
/// What is slower is the hand, Hz.
pub(crate) const CORNER_HZ: f64 = 8.0;
/// Windows over which a ring-down must hold.
const RING_WINDOWS: usize = 4;

/// How fast the part of a force above 8 Hz dies: the slope of the logarithm of its RMS over four windows of 50 ms, where it falls (or
/// rises) from each to the next by about as much. It is what an oscillation did, not how far the edge is.
#[derive(Debug, Clone)]
pub struct RingDown {
    smoothing: f64,
    low: f64,
    /// What a force that changes evenly leaves above the first corner.
    slope: f64,
    square_sum: f64,
    filled: u32,
    window: u32,
    window_s: f64,
    /// Natural logarithm of the RMS of the last windows, the newest last; NaN where there was too little.
    history: [f64; RING_WINDOWS],
    least_force: f64,
}

impl RingDown {
    /// What is below `least_force` RMS, N or N m, is not looked at.
    pub fn new(least_force: f64, period_s: f64) -> RingDown {
        let window = ((RING_WINDOW_S / period_s).round() as u32).max(4);
        RingDown {
            smoothing: 1.0 - (-TAU * CORNER_HZ * period_s).exp(),
            low: 0.0,
            slope: 0.0,
            square_sum: 0.0,
            filled: 0,
            window,
            window_s: f64::from(window) * period_s,
            history: [f64::NAN; RING_WINDOWS],
            least_force,
        }
    }

    /// One step with the force, N or N m.
    pub fn step(&mut self, force: f64) {
        if !force.is_finite() {
            self.history = [f64::NAN; RING_WINDOWS];
            return;
        }
        self.low += self.smoothing * (force - self.low);
        let fast = force - self.low;
        self.slope += self.smoothing * (fast - self.slope);
        self.square_sum += (fast - self.slope).powi(2);
        self.filled += 1;
        if self.filled == self.window {
            let rms = (self.square_sum / f64::from(self.window)).sqrt();
            self.history.rotate_left(1);
            self.history[RING_WINDOWS - 1] = if rms > self.least_force { rms.ln() } else { f64::NAN };
            (self.filled, self.square_sum) = (0, 0.0);
        }
    }

    /// 1/s, positive where it dies and negative where it grows; `None` where nothing rings.
    pub fn decay_per_s(&self) -> Option<f64> {
        let falls = |i: usize| self.history[i] - self.history[i + 1];
        let (mut low, mut high) = (f64::INFINITY, f64::NEG_INFINITY);
        for i in 0..RING_WINDOWS - 1 {
            if falls(i).is_nan() {
                return None;
            }
            (low, high) = (low.min(falls(i)), high.max(falls(i)));
        }
        let mean = (self.history[0] - self.history[RING_WINDOWS - 1]) / (RING_WINDOWS - 1) as f64;
        (low * high > 0.0 && high - low < 1.5 * mean.abs()).then_some(mean / self.window_s)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const PERIOD: f64 = 1.0 / 5000.0;

    /// A generator of numbers between -1 and 1 (xorshift).
    struct Noise(u64);

    impl Noise {
        fn next(&mut self) -> f64 {
            self.0 ^= self.0 << 13;
            self.0 ^= self.0 >> 7;
            self.0 ^= self.0 << 17;
            (self.0 >> 11) as f64 / (1u64 << 52) as f64 - 1.0
        }
    }

    /// A multisine from `from` to `to` on lines of 0.5 Hz, at most `peak`.
    fn multisine(from: f64, to: f64, peak: f64) -> Vec<f64> {
        let mut noise = Noise(42);
        let lines: Vec<(f64, f64)> =
            (1..2000).map(|k| 0.5 * f64::from(k)).filter(|f| (from..=to).contains(f)).map(|f| (f, TAU * noise.next())).collect();
        let wave: Vec<f64> =
            (0..10_000).map(|i| lines.iter().map(|(f, phase)| (TAU * f * i as f64 * PERIOD + phase).cos()).sum()).collect();
        let most = wave.iter().fold(0.0_f64, |m, x| m.max(x.abs()));
        wave.into_iter().map(|x| peak * x / most).collect()
    }

    /// A mass on a spring against a wall, with one step of delay: `F_s = -wall x`, exactly discretised.
    struct Loop {
        a: [f64; 4],
        b: [f64; 2],
        x: f64,
        v: f64,
    }

    const MASS: f64 = 0.03;
    const DAMPING: f64 = 2.0;
    const STIFFNESS: f64 = 4000.0;
    const WALL: f64 = 3000.0;

    impl Loop {
        fn new() -> Loop {
            let (w, sigma) = ((STIFFNESS / MASS - (DAMPING / (2.0 * MASS)).powi(2)).sqrt(), DAMPING / (2.0 * MASS));
            let (e, c, s) = ((-sigma * PERIOD).exp(), (w * PERIOD).cos(), (w * PERIOD).sin());
            let a = [e * (c + sigma / w * s), e * s / w, -e * STIFFNESS / (MASS * w) * s, e * (c - sigma / w * s)];
            Loop { a, b: [(1.0 - a[0]) / STIFFNESS, -a[2] / STIFFNESS], x: 0.0, v: 0.0 }
        }

        fn step(&mut self, force: f64) -> f64 {
            let [a, b, c, d] = self.a;
            (self.x, self.v) = (a * self.x + b * self.v + self.b[0] * force, c * self.x + d * self.v + self.b[1] * force);
            -WALL * self.x
        }

        /// `F_f(k) -> felt(k)`: the force moves the mass by the next step, and that is felt the other steps of the delay later.
        fn response(&self, hz: f64) -> Complex<f64> {
            let z = Complex::from_polar(1.0, TAU * hz * PERIOD);
            let [a, b, c, d] = self.a;
            let det = (z - a) * (z - d) - b * c;
            -WALL * ((z - d) * self.b[0] + self.b[1] * b) / det / z.powi(DELAY as i32 - 1)
        }

        /// The first edge of the loop, by a fine search.
        fn edge(&self) -> (f64, f64) {
            let hz: Vec<f64> = (1..8000).map(|i| 0.05 * f64::from(i)).collect();
            let l: Vec<_> = hz.iter().map(|f| self.response(*f)).collect();
            let found = critical_factor(&hz, &l).unwrap();
            (found.factor, found.frequency_hz)
        }
    }

    const DELAY: usize = 8;

    /// Runs the loop at a gain; `hand` is what else is felt. Returns every estimate.
    fn drive(dither: &[f64], lambda: f64, seconds: f64, mut hand: impl FnMut(f64) -> f64) -> Vec<(f64, Edge)> {
        let mut plant = Loop::new();
        let mut live = LiveMargin::new(dither, 0.01, PERIOD).unwrap();
        let mut line = [0.0; DELAY];
        let mut estimates = Vec::new();
        for k in 0..(seconds / PERIOD) as usize {
            let felt = line[k % DELAY] + hand(k as f64 * PERIOD);
            let sent = lambda * felt + dither[k % dither.len()];
            if live.step(dither[k % dither.len()], sent, Some(felt), 1.0) {
                estimates.push((k as f64 * PERIOD, live.edge()));
            }
            line[k % DELAY] = plant.step(sent);
        }
        estimates
    }

    #[test]
    fn the_edge_of_a_known_loop_is_found_at_any_gain_below_it() {
        let (edge, hz) = Loop::new().edge();
        let dither = multisine(1.0, 500.0, 0.05);
        for share in [0.2, 0.5, 0.8] {
            let found = drive(&dither, share * edge, 4.0, |t| -2.0 - 0.3 * (TAU * 0.7 * t).sin());
            let (_, last) = found.last().unwrap();
            let Edge::At { lambda, frequency_hz, .. } = last else { panic!("{last:?}") };
            println!("at {share} of the edge: {:.3} of it, {frequency_hz:.1} of {hz:.1} Hz", lambda / edge);
            assert!((lambda / edge - 1.0).abs() < 0.1, "{lambda} of {edge}");
            assert!((frequency_hz / hz - 1.0).abs() < 0.04, "{frequency_hz} of {hz}");
            assert!(found[0].0 < 0.9 && found[0].1 == Edge::Free, "one window is no answer: {:?}", found[0]);
        }
    }

    #[test]
    fn noise_widens_the_answer_and_never_makes_a_wrong_one() {
        let (edge, _) = Loop::new().edge();
        let dither = multisine(1.0, 500.0, 0.05);
        let (mut told, mut beyond, mut at_least) = (0, 0, 0);
        for seed in 1..=12 {
            for size in [0.002, 0.01, 0.05] {
                let mut noise = Noise(seed * 7919 + (size * 1e4) as u64);
                for (_, found) in drive(&dither, 0.5 * edge, 3.0, |_| -1.0 + size * noise.next()) {
                    match found {
                        Edge::At { lambda, deviation, .. } => {
                            (told, beyond) = (told + 1, beyond + usize::from((lambda / edge).ln().abs() > 0.05 + 3.0 * deviation));
                            assert!((lambda / edge).ln().abs() < 0.5, "{lambda} of {edge} with noise {size}: +-{deviation}");
                        }
                        Edge::Above { lambda } => {
                            at_least += 1;
                            assert!(lambda < 1.05 * edge, "above {lambda}, the edge is {edge}");
                        }
                        Edge::Free => {}
                    }
                }
            }
        }
        println!("{told} told, {beyond} beyond three deviations, {at_least} bounds");
        assert!(told > 50 && at_least > 20, "{told} {at_least}");
        assert!(beyond * 30 < told, "{beyond} of {told}");
    }

    #[test]
    fn an_impact_and_another_level_of_the_dither_do_not_spoil_it() {
        let (edge, _) = Loop::new().edge();
        let quiet = multisine(1.0, 500.0, 0.02);
        let loud = multisine(1.0, 500.0, 0.08);
        let dither = [quiet, loud].concat();
        let impact = |t: f64| if t < 0.05 { -20.0 * (1.0 - t / 0.05) } else { -2.0 };
        let found = drive(&dither, 0.5 * edge, 4.0, impact);
        for (t, found) in &found {
            match found {
                Edge::At { lambda, deviation, .. } => {
                    assert!((lambda / edge).ln().abs() < 0.1 + 3.0 * deviation, "{t}: {lambda} +-{deviation} of {edge}")
                }
                Edge::Above { lambda } => assert!(*lambda < edge, "{t}: above {lambda}, the edge is {edge}"),
                Edge::Free => assert!(*t < 1.6, "{t}: {found:?}"),
            }
        }
        assert!(matches!(found.last(), Some((_, Edge::At { .. }))), "{found:?}");
    }

    #[test]
    fn free_motion_and_the_hand_alone_tell_nothing() {
        let dither = multisine(1.0, 500.0, 0.05);
        let mut live = LiveMargin::new(&dither, 0.01, PERIOD).unwrap();
        let mut noise = Noise(3);
        for k in 0..10_000 {
            let d = dither[k % dither.len()];
            live.step(d, d, Some(0.0), 1.0);
            assert_eq!(live.edge(), Edge::Free);
        }
        for k in 0..10_000 {
            let d = dither[k % dither.len()];
            let felt = 1e-3 * noise.next();
            live.step(d, d + 0.5 * felt, Some(felt), 1.0);
            assert_eq!(live.edge(), Edge::Free, "sensor noise is no contact");
        }
        // A hand that shakes at a wall that does not give way to the dither: no edge may be told.
        for k in 0..20_000 {
            let d = dither[k % dither.len()];
            let felt = -1.0 + 0.2 * (TAU * 9.0 * k as f64 * PERIOD).sin() + 0.05 * noise.next();
            live.step(d, d + 0.5 * felt, Some(felt), 1.0);
            assert!(!matches!(live.edge(), Edge::At { .. }), "{:?}", live.edge());
        }
    }

    #[test]
    fn a_lost_contact_or_another_position_scale_begins_anew() {
        let (edge, _) = Loop::new().edge();
        let dither = multisine(1.0, 500.0, 0.05);
        let mut plant = Loop::new();
        let mut live = LiveMargin::new(&dither, 0.01, PERIOD).unwrap();
        let mut felt = 0.0;
        let mut run = |live: &mut LiveMargin, steps: usize, mu: f64| {
            for k in 0..steps {
                let d = dither[k % dither.len()];
                let sent = 0.3 * edge * felt + d;
                live.step(d, sent, Some(felt - 1.0), mu);
                felt = plant.step(sent);
            }
        };
        run(&mut live, 10_000, 1.0);
        assert_ne!(live.edge(), Edge::Free);
        run(&mut live, 1, 0.9);
        assert_eq!(live.edge(), Edge::Free);
        run(&mut live, 10_000, 0.9);
        assert_ne!(live.edge(), Edge::Free);
        live.step(0.0, 0.0, None, 0.9);
        assert_eq!(live.edge(), Edge::Free);
    }

    #[test]
    fn over_cancelling_is_an_edge_at_dc() {
        // felt = +gain of a first-order lag of 25 Hz: positive feedback.
        let dither = multisine(1.0, 500.0, 0.05);
        let mut live = LiveMargin::new(&dither, 0.01, PERIOD).unwrap();
        let (mut lag, mut felt) = (0.0, 0.0);
        for k in 0..15_000 {
            let d = dither[k % dither.len()];
            let sent = 0.5 * felt + d;
            live.step(d, sent, Some(felt - 1.0), 1.0);
            lag += (1.0 - (-TAU * 25.0 * PERIOD).exp()) * (0.8 * sent - lag);
            felt = lag;
        }
        let Edge::At { lambda, frequency_hz, .. } = live.edge() else { panic!("{:?}", live.edge()) };
        assert_eq!(frequency_hz, 0.0);
        assert!((lambda * 0.8 - 1.0).abs() < 0.15, "{lambda}");
    }

    #[test]
    fn lines_stay_within_the_dither_and_none_is_no_margin() {
        let live = LiveMargin::new(&multisine(30.0, 90.0, 0.05), 0.01, PERIOD).unwrap();
        assert!(live.lines_hz().iter().all(|f| (25.0..95.0).contains(f)), "{:?}", live.lines_hz());
        let wide = LiveMargin::new(&multisine(1.0, 500.0, 0.05), 0.01, PERIOD).unwrap();
        assert!((30..=MAX_LINES).contains(&wide.lines_hz().len()), "{}", wide.lines_hz().len());
        assert!(LiveMargin::new(&[], 0.01, PERIOD).is_none());
        assert!(LiveMargin::new(&[0.0; 100], 0.01, PERIOD).is_none());
        assert!(LiveMargin::new(&[f64::NAN; 100], 0.01, PERIOD).is_none());
    }

    #[test]
    fn a_ring_down_tells_its_rate() {
        for rate in [12.0, -6.0] {
            let mut ring = RingDown::new(0.02, PERIOD);
            for k in 0..1500 {
                let t = k as f64 * PERIOD;
                ring.step(-1.0 + 2.0 * (-rate * t).exp() * (TAU * 40.0 * t).sin());
            }
            let found = ring.decay_per_s().unwrap();
            assert!((found / rate - 1.0).abs() < 0.05, "{found} of {rate}");
        }
        let mut quiet = RingDown::new(0.02, PERIOD);
        (0..5000).for_each(|k| quiet.step(-1.0 - 0.1 * (TAU * 0.5 * k as f64 * PERIOD).sin()));
        assert_eq!(quiet.decay_per_s(), None);
    }
}
