//! The induced motion that the hand at work leaves, less what is not sure of it.

use super::bank::HandBank;
use super::estimate::{Estimate, HandEstimator};
use crate::core::Events;
use backdrive_msgs::MAX_AXES;

/// An estimate with a relative deviation above this is a guess.
const GUESS_AT: f64 = 0.1;
/// Conservatism gain: raises the assumed grip stiffness in proportion to the excess relative standard deviation of the estimate.
const GUESS_COSTS: f64 = 5.0;
/// Most of the predicted motion that is cancelled where it is fast: what is cancelled whole may be too much.
const MOST: f64 = 0.97;
/// The part that is not cancelled acts as no canceller at this share of the gain that is stable without one.
const LEFT: f64 = 0.3;
/// Where it is slow this much of the share is cancelled: what cannot be known at rest is left to the hand, which without a canceller is stable there.
const SLOW: f64 = 0.5;
/// Between slow and fast, Hz.
const CORNER_HZ: f64 = 1.0;
/// A force below this share of the largest of late is none.
const NO_FORCE: f64 = 0.02;
/// A force below this is none, N or N m.
const LEAST_FORCE: f64 = 1e-3;
/// How fast the largest force is forgotten, s.
const FORCE_MEMORY_S: f64 = 5.0;
/// Time constant with which a remaining displacement decays where no force acts, s.
const LET_GO_S: f64 = 0.2;

/// A hand is reported where its relative deviation is below this.
const TELLS_AT: f64 = 0.1;
/// And where it differs from the last reported one by more than this, in the logarithm of the firmness.
const TELLS_AFTER: f64 = 0.2;

/// One axis.
pub(super) struct Axis {
    estimator: HandEstimator,
    /// Output of the bank at the step before.
    before: Vec<f64>,
    /// Least relative deviation of the estimate since the hand was last seen to have changed.
    surest: f64,
    /// Motion that the force did, of the hands that were estimated meanwhile.
    induced: f64,
    /// Its slow part.
    slow: f64,
    largest_force: f64,
    /// The last reported firmness, if there was one.
    reported: Option<f64>,
}

impl Axis {
    /// Softness of the hand whose motion is cancelled, 0 for the firmest of the bank: that one until anything is known.
    pub(super) fn cancelled(&mut self, estimate: &Estimate, changed: bool) -> f64 {
        let unsure = estimate.deviation * estimate.firmness();
        self.surest = if changed { unsure } else { self.surest.min(unsure) };
        if !self.surest.is_finite() {
            return 0.0;
        }
        // Where too little moved to identify the hand, a firm one is cancelled: too much is fatal, too little is as without a canceller.
        estimate.softness * (1.0 - GUESS_COSTS * (self.surest - GUESS_AT).max(0.0))
    }
}

/// A bank with the estimate of the hand of every axis.
pub struct Scheduled {
    bank: HandBank,
    axes: Vec<Axis>,
    started: bool,
    force_keep: f64,
    let_go: f64,
    slow_gain: f64,
    /// Share of the predicted motion that is cancelled where it is fast.
    share: f64,
    /// Gain product that the loop bears without a canceller, where it is known.
    edge_without: Option<f64>,
}

impl Scheduled {
    /// Around a bank. `edge_without` is the lowest gain product at which the loop oscillates without a canceller, in the softest and the firmest hand. Where
    /// it is not known, the share that a high gain needs is cancelled at any gain.
    pub fn new(bank: HandBank, edge_without: Option<f64>, period_s: f64) -> Scheduled {
        let hands = bank.softness().len();
        let axis = |axis: usize| Axis {
            estimator: HandEstimator::new(bank.softness(), bank.sensor_noise(axis), period_s),
            before: vec![0.0; hands],
            surest: f64::INFINITY,
            induced: 0.0,
            slow: 0.0,
            largest_force: 0.0,
            reported: None,
        };
        let axes = (0..bank.axes().min(MAX_AXES)).map(axis).collect();
        let (force_keep, let_go) = ((-period_s / FORCE_MEMORY_S).exp(), 1.0 - (-period_s / LET_GO_S).exp());
        let slow_gain = 1.0 - (-2.0 * std::f64::consts::PI * CORNER_HZ * period_s).exp();
        Scheduled { bank, axes, started: false, force_keep, let_go, slow_gain, share: MOST, edge_without }
    }

    /// The gain product now in force, NaN where it is not known. No more is cancelled than it needs: the remaining motion acts as the whole would at a lower
    /// gain.
    pub fn set_gain(&mut self, gain: f64) {
        if let Some(edge) = self.edge_without.filter(|_| !gain.is_nan()) {
            self.share = (1.0 - LEFT * edge / gain.max(f64::MIN_POSITIVE)).clamp(0.0, MOST);
        }
    }

    /// Share of the predicted motion that is cancelled where it is fast.
    pub fn share(&self) -> f64 {
        self.share
    }

    /// What is known of the hand of an axis.
    pub fn estimate(&self, axis: usize) -> Option<Estimate> {
        self.axes.get(axis).map(|a| a.estimator.estimate())
    }

    #[cfg(test)]
    pub(super) fn axis_mut(&mut self, axis: usize) -> Option<&mut Axis> {
        self.axes.get_mut(axis)
    }

    /// Whether the models go on.
    pub fn is_finite(&self) -> bool {
        self.bank.is_finite()
    }

    /// The next step: the force that was held until now, and the position of each axis where it is measured. The induced motion, m or rad. A hand that
    /// surely differs from the last reported one is reported in an event.
    pub fn step(&mut self, force: &[f64; MAX_AXES], measured: Option<&[f64; MAX_AXES]>, events: &mut Events) -> [f64; MAX_AXES] {
        let known = self.bank.axes();
        if self.started {
            self.bank.step(&force[..known]);
        } else {
            self.bank.start(&force[..known]);
            self.started = true;
        }
        let mut induced = [0.0; MAX_AXES];
        for (number, axis) in self.axes.iter_mut().enumerate() {
            let changed = measured.is_some_and(|measured| axis.estimator.step(measured[number], |hand| self.bank.position(hand, number)));
            let estimate = axis.estimator.estimate();
            let (firmness, unsure) = (estimate.firmness(), estimate.deviation * estimate.firmness());
            let is_another = axis.reported.is_none_or(|reported| (firmness / reported).ln().abs() > TELLS_AFTER);
            if unsure < TELLS_AT && is_another {
                axis.reported = Some(firmness);
                events.push("hand_holds", firmness, 0);
            }
            let softness = axis.cancelled(&estimate, changed);
            axis.largest_force = (self.force_keep * axis.largest_force).max(force[number].abs());
            let (mut moved, mut stands) = (0.0, 0.0);
            for (hand, weight) in between(self.bank.softness(), softness) {
                let position = self.bank.position(hand, number);
                moved += weight * (position - axis.before[hand]);
                stands += weight * position;
            }
            for (hand, before) in axis.before.iter_mut().enumerate() {
                *before = self.bank.position(hand, number);
            }
            axis.induced += moved;
            if force[number].abs() < LEAST_FORCE.max(NO_FORCE * axis.largest_force) {
                axis.induced += self.let_go * (stands - axis.induced);
            }
            axis.slow += self.slow_gain * (axis.induced - axis.slow);
            induced[number] = self.share * (axis.induced - axis.slow + SLOW * axis.slow);
        }
        induced
    }
}

/// The two neighbours of a softness in an ascending list, with their shares; the first alone below.
fn between(softness: &[f64], wanted: f64) -> [(usize, f64); 2] {
    let last = softness.len().saturating_sub(1);
    let upper = softness.partition_point(|s| *s < wanted).min(last);
    if upper == 0 || wanted.is_nan() {
        return [(0, 1.0), (0, 0.0)];
    }
    let share = ((wanted - softness[upper - 1]) / (softness[upper] - softness[upper - 1])).clamp(0.0, 1.0);
    [(upper - 1, 1.0 - share), (upper, share)]
}
