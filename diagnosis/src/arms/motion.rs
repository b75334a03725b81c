//! Logs on an even grid, low-passed without delay, with derivatives: what a regression sees.
//!
//! Positions go through a zero-phase Butterworth and are differentiated there. Every regressor and the torque then go through a second, lower one (the
//! "parallel filtering" of Gautier, Dynamic identification of robots with power model, ICRA 1997). The filter then removes the same on both sides, and
//! one sample in several is kept.

use crate::arms::log::Log;
use backdrive_plant::model::Hold;
use backdrive_plant::recording::resample;
use backdrive_plant::robot::Payload;
use backdrive_signal::derivative;
use backdrive_signal::low_pass::LowPass;
use backdrive_signal::statistics::{middle_step, rms};
use realfft::RealFftPlanner;

/// Order of the Butterworth filters; run both ways the order counts twice.
pub(crate) const ORDER: usize = 4;
/// The corner of the regression, in times the frequency below which this share of the power of the velocities lies.
const ABOVE: f64 = 12.0;
/// See [`ABOVE`].
const SHARE: f64 = 0.95;
/// Least and largest corner of the regression, Hz.
const CORNERS: [f64; 2] = [2.0, 20.0];
/// Highest corner of the regression, in the rate of the grid.
pub(crate) const HIGHEST: f64 = 0.1;
/// Speed below which a joint counts as resting, as a share of its usual one.
const RESTING: f64 = 0.04;
/// Corner of the positions, in times the corner of the regression.
const POSITION: f64 = 5.0;

/// Corners and rates, the same for all logs of a diagnosis.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Rates {
    /// Rate at which the logs are laid on an even grid, Hz: that of the slowest log.
    pub grid: f64,
    /// Corner of the filter of the positions, Hz.
    pub position_corner: f64,
    /// Corner of the filter of torque and regressors, Hz.
    pub corner: f64,
    /// One in this number of samples of the grid is used for computing.
    pub thinned: usize,
    /// One in this number of those is kept as a row of the regression.
    pub kept: usize,
}

impl Rates {
    /// For these logs: the corner follows the motion. `corner`: that of the regression, Hz, where it is given.
    pub fn of(logs: &[&Log], corner: Option<f64>) -> Rates {
        let grid = logs.iter().map(|log| 1.0 / middle_step(&log.t).unwrap_or(1.0)).fold(f64::INFINITY, f64::min).clamp(1.0, 1e5);
        let mut highest: f64 = 0.0;
        let rough = LowPass::butterworth(ORDER, 20.0f64.min(grid / 5.0), grid);
        for log in logs {
            for position in &log.position {
                let even = rough.both_ways(&on_grid(&log.t, position, grid));
                let f = frequency_below(&derivative(&even, 1.0 / grid), grid);
                highest = highest.max(f);
            }
        }
        let corner = corner.unwrap_or((ABOVE * highest).clamp(CORNERS[0], CORNERS[1])).min(HIGHEST * grid);
        let position_corner = (POSITION * corner).min(grid / 5.0);
        let thinned = ((grid / (8.0 * corner).max(100.0)).floor() as usize).max(1);
        let kept = ((grid / thinned as f64 / (4.0 * corner)).floor() as usize).max(1);
        Rates { grid, position_corner, corner, thinned, kept }
    }

    /// Time between two samples that are computed with, s.
    pub fn period(&self) -> f64 {
        self.thinned as f64 / self.grid
    }

    /// Time between two rows, s.
    pub fn row_period(&self) -> f64 {
        self.period() * self.kept as f64
    }

    /// Time of a row of a motion, s from the log's first sample.
    pub fn time_of(&self, row: usize) -> f64 {
        self.ends() as f64 * self.period() + row as f64 * self.row_period()
    }

    /// Samples over which the filter of the positions smears a jump of the torque.
    pub(crate) fn smeared(&self) -> usize {
        (0.5 / self.position_corner / self.period()).ceil() as usize
    }

    /// Samples left out at either end, where the filter still sees its mirrored beginning.
    fn ends(&self) -> usize {
        ((1.0 / self.corner) / self.period()).ceil() as usize
    }

    /// A signal of a motion through the filter of the regression, one sample in [`Rates::kept`].
    pub fn rows(&self, samples: &[f64]) -> Vec<f64> {
        let filtered = LowPass::butterworth(ORDER, self.corner, 1.0 / self.period()).both_ways(samples);
        let ends = self.ends().min(filtered.len() / 2);
        filtered[ends..filtered.len() - ends].iter().step_by(self.kept).copied().collect()
    }
}

/// A log on an even grid; the first index of every list is the joint.
#[derive(Debug, Clone, PartialEq)]
pub struct Motion {
    /// The log's file.
    pub name: String,
    /// Coordinates, rad or m.
    pub position: Vec<Vec<f64>>,
    /// Rates, rad/s or m/s.
    pub velocity: Vec<Vec<f64>>,
    /// Accelerations, rad/s² or m/s².
    pub acceleration: Vec<Vec<f64>>,
    /// Torque through the filter of the positions, N m or N.
    pub torque: Vec<Vec<f64>>,
    /// Rates from the drive, through the same filter.
    pub recorded_velocity: Vec<Option<Vec<f64>>>,
    /// 1 while a joint moves, 0 where it hardly does: dry friction is then anything between its levels, and a regression learns nothing of it.
    pub moves: Vec<Vec<f64>>,
    /// 1 where the torque of a joint counts, 0 where it does not, as where it is clipped.
    pub counts: Vec<Vec<f64>>,
    /// A known mass that the arm carries, with the index of its link.
    pub payload: Option<(usize, Payload)>,
}

impl Motion {
    /// Of a log.
    pub fn of(log: &Log, rates: &Rates) -> Motion {
        let filter = LowPass::butterworth(ORDER, rates.position_corner, rates.grid);
        let smooth = |samples: &[f64]| filter.both_ways(&on_grid(&log.t, samples, rates.grid));
        let thin = |samples: Vec<f64>| samples.into_iter().step_by(rates.thinned).collect::<Vec<f64>>();
        let (mut position, mut velocity, mut acceleration) = (Vec::new(), Vec::new(), Vec::new());
        for samples in &log.position {
            let q = smooth(samples);
            let v = derivative(&q, 1.0 / rates.grid);
            acceleration.push(thin(derivative(&v, 1.0 / rates.grid)));
            velocity.push(thin(v));
            position.push(thin(q));
        }
        let torque = log.torque.iter().map(|s| thin(smooth(s))).collect();
        let recorded_velocity = log.velocity.iter().map(|v| v.as_ref().map(|s| thin(smooth(s)))).collect();
        let smeared = rates.smeared();
        let moves = velocity.iter().zip(&log.position).map(|(v, q)| moving(v, resting(v, q, rates), smeared)).collect();
        let counts = position.iter().map(|q| vec![1.0; q.len()]).collect();
        Motion {
            name: log.name.clone(),
            counts,
            position,
            velocity,
            acceleration,
            torque,
            recorded_velocity,
            moves,
            payload: log.payload.clone(),
        }
    }

    /// Samples.
    pub fn len(&self) -> usize {
        self.position.first().map_or(0, Vec::len)
    }

    /// Whether there are none.
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }
}

/// The speed below which a joint hardly moves, rad/s or m/s: a share of its usual one, and no less than the sensor's steps leave of a rate.
fn resting(velocity: &[f64], logged: &[f64], rates: &Rates) -> f64 {
    let usual = rms(velocity);
    let step = logged.windows(2).map(|w| (w[1] - w[0]).abs()).filter(|d| *d > 0.0).fold(f64::INFINITY, f64::min);
    // Rounding is noise of step/√12 over half the rate; differentiated below a corner f it is 2π f/√3 times what lies below f.
    let below = (2.0 * rates.position_corner / rates.grid).sqrt() * std::f64::consts::TAU * rates.position_corner / 3f64.sqrt();
    let noise = if step.is_finite() { step / 12f64.sqrt() * below } else { 0.0 };
    (RESTING * usual).max(4.0 * noise).min(0.2 * usual)
}

fn moving(velocity: &[f64], least: f64, smeared: usize) -> Vec<f64> {
    let mut out = vec![1.0; velocity.len()];
    for (i, v) in velocity.iter().enumerate() {
        // Through 0 between two samples is a rest too.
        let turns = i > 0 && velocity[i - 1] * v < 0.0;
        if v.abs() < least || turns {
            let last = velocity.len().min(i + smeared + 1);
            out[i.saturating_sub(smeared)..last].fill(0.0);
        }
    }
    out
}

pub(crate) fn on_grid(t: &[f64], samples: &[f64], rate: f64) -> Vec<f64> {
    let (Some(first), Some(last)) = (t.first(), t.last()) else { return Vec::new() };
    let count = ((last - first) * rate + 1e-6).floor().max(0.0) as usize + 1;
    let grid: Vec<f64> = (0..count).map(|i| first + i as f64 / rate).collect();
    resample(Hold::Linear, t, samples, &grid)
}

/// The frequency below which [`SHARE`] of the power lies, Hz.
fn frequency_below(samples: &[f64], rate: f64) -> f64 {
    power_below(samples, rate, SHARE)
}

/// The frequency below which a share of the power about the mean lies, Hz; 0 for a signal that is too short.
pub(crate) fn power_below(samples: &[f64], rate: f64, share: f64) -> f64 {
    if samples.len() < 16 {
        return 0.0;
    }
    let mean = samples.iter().sum::<f64>() / samples.len() as f64;
    // A Hann window: the ends of a record do not meet.
    let window = |i: usize| 0.5 - 0.5 * (std::f64::consts::TAU * i as f64 / (samples.len() - 1) as f64).cos();
    let mut input: Vec<f64> = samples.iter().enumerate().map(|(i, x)| (x - mean) * window(i)).collect();
    let plan = RealFftPlanner::<f64>::new().plan_fft_forward(input.len());
    let mut spectrum = plan.make_output_vec();
    if plan.process(&mut input, &mut spectrum).is_err() {
        return 0.0;
    }
    let power: Vec<f64> = spectrum.iter().map(|c| c.norm_sqr()).collect();
    let total: f64 = power.iter().sum();
    let mut sum = 0.0;
    for (i, p) in power.iter().enumerate() {
        sum += p;
        if sum >= share * total {
            return i as f64 * rate / samples.len() as f64;
        }
    }
    0.0
}
