//! Position and force scaling: x_c = mu x_u and F_f = lambda F_s, in one process whose two paths step separately.

use crate::core::{Core, Events, Port, Tick};
use crate::freshness::Freshness;
use crate::guard::Guard;
use crate::live_margin::{Edge, LiveMargin, MarginEstimate, RingDown};
use backdrive_msgs::{Gains, MAX_AXES, Sample, flag};

/// A gain that ramps to what is wanted in a straight line.
#[derive(Debug, Clone)]
pub(crate) struct Ramp {
    pub(crate) now: f64,
    target: f64,
    change_per_step: f64,
}

impl Ramp {
    pub(crate) fn new(value: f64) -> Ramp {
        Ramp { now: value, target: value, change_per_step: 0.0 }
    }

    pub(crate) fn aim(&mut self, target: f64, ramp_s: f64, period_s: f64) {
        self.target = target;
        let steps = (ramp_s / period_s).round().max(1.0);
        self.change_per_step = (target - self.now).abs() / steps;
    }

    pub(crate) fn step(&mut self) -> f64 {
        let left = self.target - self.now;
        self.now = if left.abs() <= self.change_per_step { self.target } else { self.now + self.change_per_step.copysign(left) };
        self.now
    }
}

/// A contact force below this RMS is none, N or N m.
const LEAST_FORCE: f64 = 0.01;

/// A ring-down below this RMS is not evaluated, N or N m.
const LEAST_RING: f64 = 0.004;

/// A change of gains that the graph file asks for.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct GainChange {
    /// When it starts, s.
    pub at_s: f64,
    /// New position scale.
    pub mu: f64,
    /// New force scale.
    pub lambda: f64,
}

/// Gains at the start and later.
#[derive(Debug, Clone, PartialEq)]
pub struct GainPlan {
    /// Position scale.
    pub mu: f64,
    /// Force scale.
    pub lambda: f64,
    /// Time over which a change ramps, s.
    pub ramp_s: f64,
    /// In order of time.
    pub changes: Vec<GainChange>,
}

impl GainPlan {
    pub(crate) fn due(&self, done: &mut usize, tick: &Tick) -> Option<GainChange> {
        let change = self.changes.get(*done).filter(|c| tick.time_s >= c.at_s).copied();
        *done += usize::from(change.is_some());
        change
    }
}

/// Both gains as they are in force: those of a plan, or what was asked for since, ramped.
#[derive(Debug, Clone)]
pub(crate) struct GainsInForce {
    plan: GainPlan,
    changes_done: usize,
    pub(crate) mu: Ramp,
    pub(crate) lambda: Ramp,
    period_s: f64,
}

impl GainsInForce {
    /// The plan's first gains.
    pub(crate) fn new(plan: GainPlan, period_s: f64) -> GainsInForce {
        let (mu, lambda) = (Ramp::new(plan.mu), Ramp::new(plan.lambda));
        GainsInForce { plan, changes_done: 0, mu, lambda, period_s }
    }

    /// The gains of the next step: (mu, lambda).
    pub(crate) fn step(&mut self, tick: &Tick) -> (f64, f64) {
        if let Some(change) = self.plan.due(&mut self.changes_done, tick) {
            self.mu.aim(change.mu, self.plan.ramp_s, self.period_s);
            self.lambda.aim(change.lambda, self.plan.ramp_s, self.period_s);
        }
        (self.mu.step(), self.lambda.step())
    }

    /// Other gains are wanted from now on.
    pub(crate) fn set(&mut self, gains: &Gains) {
        self.mu.aim(gains.mu, gains.ramp_s, self.period_s);
        self.lambda.aim(gains.lambda, gains.ramp_s, self.period_s);
    }
}

/// Input `motion` (position); output `command` (position x_c = mu x).
///
/// Without a new input the output is not measured: the slave then holds.
pub struct Forward {
    gains: GainsInForce,
    motion: Freshness,
}

impl Forward {
    /// Starts at the plan's first gains.
    pub fn new(plan: GainPlan, period_s: f64) -> Forward {
        Forward { gains: GainsInForce::new(plan, period_s), motion: Freshness::default() }
    }
}

impl Core for Forward {
    fn step(&mut self, tick: &Tick, inputs: &[Port], outputs: &mut [Sample], _events: &mut Events) {
        let (mu, _) = self.gains.step(tick);
        if let Some(motion) = self.motion.new_sample(&inputs[0], |s| s.position[0]) {
            for axis in 0..motion.len().min(outputs[0].len()) {
                outputs[0].position[axis] = mu * motion.position[axis];
            }
        }
    }

    fn set_gains(&mut self, gains: &Gains) {
        self.gains.set(gains);
    }

    // The backward path reports the gains of both, because the guard acts there.
}

/// Inputs `contact` (effort F_s), `measured` (the master's, one step late: what the guard watches); outputs
/// `force` (effort F_f = lambda F_s + dither), `dither` (effort: the added excitation alone).
///
/// When contact forces stop coming the output is not measured: the master then removes its force. It does so too where the contact force is that of a
/// slave that holds because no command reaches it.
pub struct Backward {
    gains: GainsInForce,
    contact: Freshness,
    dither: Vec<Vec<f64>>,
    guard: Option<Guard>,
    /// F_f without the dither, of the step before.
    reflected: [f64; MAX_AXES],
    /// Per axis; `None` without a dither.
    live: Vec<Option<LiveMargin>>,
    ring: Vec<RingDown>,
    axes: usize,
}

impl Backward {
    /// Starts at the plan's first gains. `dither` has one list of forces per axis, N or N m, one value per step, repeated from the start when they end; it may be empty.
    pub fn new(plan: GainPlan, dither: Vec<Vec<f64>>, guard: Option<Guard>, period_s: f64) -> Backward {
        let gains = GainsInForce::new(plan, period_s);
        let of = |axis: usize| dither.get(axis).and_then(|d| LiveMargin::new(d, LEAST_FORCE, period_s));
        let live = (0..MAX_AXES).map(of).collect();
        let ring = vec![RingDown::new(LEAST_RING, period_s); MAX_AXES];
        let (contact, reflected) = (Freshness::default(), [0.0; MAX_AXES]);
        Backward { gains, contact, dither, guard, reflected, live, ring, axes: 1 }
    }
}

impl Backward {
    /// The dither of an axis at a step. It is periodic: it lasts as long as the run.
    fn dither_at(&self, axis: usize, step: u64) -> Option<f64> {
        self.dither.get(axis).filter(|d| !d.is_empty()).map(|d| d[step as usize % d.len()])
    }

    /// Shows the guard what the loop does by itself, without the dither; the share of the gain that it allows.
    fn watch(&mut self, lambda: f64, master: Option<Sample>, events: &mut Events) -> f64 {
        let master = master.map(|mut sample| {
            for axis in 0..sample.len() {
                sample.effort[axis] -= self.dither_at(axis, sample.step).unwrap_or(0.0);
            }
            sample
        });
        let Some(guard) = &mut self.guard else { return 1.0 };
        if let Some(reason) = guard.step(&self.reflected, master.as_ref()) {
            events.push(reason.event(), lambda * guard.target(), 1);
        }
        guard.share()
    }

    fn lambda_in_force(&self) -> f64 {
        self.gains.lambda.now * self.guard.as_ref().map_or(1.0, Guard::share)
    }
}

impl Core for Backward {
    fn step(&mut self, tick: &Tick, inputs: &[Port], outputs: &mut [Sample], events: &mut Events) {
        let (mu, lambda) = self.gains.step(tick);
        let guarded = self.watch(lambda, inputs.get(1).and_then(|p| p.sample), events);
        let (force, dither) = outputs.split_at_mut(1);
        for axis in 0..force[0].len() {
            if let Some(added) = self.dither_at(axis, tick.step) {
                dither[0].effort[axis] = added;
            }
        }
        if guarded < 1.0 {
            force[0].flags |= flag::GUARDED;
        }
        self.axes = force[0].len();
        // Before the first contact force has come there is none: only the dither is played.
        let contact = self.contact.new_sample(&inputs[0], |s| s.effort[0]).copied();
        if contact.is_none() && self.contact.begun() {
            for axis in 0..self.axes {
                self.ring[axis].step(f64::NAN);
                if let Some(live) = &mut self.live[axis] {
                    live.step(dither[0].effort[axis], f64::NAN, None, mu);
                }
            }
            return;
        }
        // A slave that holds for want of commands no longer feels what the hand does.
        if contact.is_some_and(|c| c.flags & flag::STALE != 0) {
            force[0].flags |= flag::STALE;
        }
        for axis in 0..force[0].len() {
            let felt = contact.map_or(0.0, |c| if c.effort[axis].is_finite() { c.effort[axis] } else { 0.0 });
            let added = if dither[0].effort[axis].is_nan() { 0.0 } else { dither[0].effort[axis] };
            let reflected = guarded * lambda * felt;
            self.reflected[axis] = reflected;
            force[0].effort[axis] = reflected + added;
            self.ring[axis].step(reflected);
            if let Some(live) = &mut self.live[axis]
                && live.step(added, reflected + added, Some(felt), mu)
                && let (Edge::At { lambda: edge, deviation, .. }, Some(guard)) = (live.edge(), &mut self.guard)
                && let Some(reason) = guard.margin(edge / (lambda * guard.target()), deviation)
            {
                events.push(reason.event(), lambda * guard.target(), 1);
            }
        }
    }

    fn set_gains(&mut self, gains: &Gains) {
        self.gains.set(gains);
        if let Some(guard) = &mut self.guard {
            guard.restore();
        }
    }

    fn gains(&self) -> Option<(f64, f64)> {
        Some((self.gains.mu.now, self.lambda_in_force()))
    }

    fn margin(&self) -> Option<MarginEstimate> {
        let (mu, lambda) = (self.gains.mu.now, self.lambda_in_force());
        let of = |axis: usize| {
            MarginEstimate::of(axis, self.live[axis].as_ref().map(LiveMargin::edge), mu, lambda, self.ring[axis].decay_per_s())
        };
        (0..self.axes.min(MAX_AXES)).map(of).reduce(|a, b| if b.is_tighter_than(&a) { b } else { a })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn tick(step: u64) -> Tick {
        Tick { step, time_s: step as f64 * 1e-3, period_s: 1e-3 }
    }

    fn contact(step: u64, force: f64) -> [Port; 2] {
        let mut sample = Sample::new(1);
        (sample.step, sample.effort[0]) = (step, force);
        [Port { sample: Some(sample), age_steps: 0 }, Port::EMPTY]
    }

    #[test]
    fn a_gain_change_ramps() {
        let changes = vec![GainChange { at_s: 0.010, mu: 1.0, lambda: 1.0 }];
        let plan = GainPlan { mu: 1.0, lambda: 0.5, ramp_s: 0.010, changes };
        let mut core = Backward::new(plan, Vec::new(), None, 1e-3);
        let mut forces = Vec::new();
        for step in 0..30 {
            let mut outputs = [Sample::new(1), Sample::new(1)];
            core.step(&tick(step), &contact(step, -2.0), &mut outputs, &mut Events::default());
            forces.push(outputs[0].effort[0]);
        }
        assert_eq!(forces[9], -1.0);
        assert!((forces[14] + 1.5).abs() < 1e-12, "half way after half the ramp: {}", forces[14]);
        assert_eq!(forces[25], -2.0);
        assert!(forces.windows(2).all(|w| (w[1] - w[0]).abs() <= 0.1 + 1e-12));
    }

    #[test]
    fn a_slave_that_holds_or_ran_away_is_passed_on() {
        let plan = GainPlan { mu: 1.0, lambda: 0.5, ramp_s: 0.010, changes: Vec::new() };
        let mut core = Backward::new(plan, Vec::new(), None, 1e-3);
        let mut step = |step: u64, force: f64, flags: u32| {
            let mut inputs = contact(step, force);
            inputs[0].sample.iter_mut().for_each(|s| s.flags = flags);
            let mut outputs = [Sample::new(1), Sample::new(1)];
            core.step(&tick(step), &inputs, &mut outputs, &mut Events::default());
            (outputs[0].effort[0], outputs[0].flags)
        };
        assert_eq!(step(0, -2.0, 0), (-1.0, 0));
        assert_eq!(step(1, -2.0, flag::STALE), (-1.0, flag::STALE));
        assert!(step(2, f64::NEG_INFINITY, 0).0.is_nan());
        assert_eq!(step(3, -2.0, 0), (-1.0, 0));
    }

    #[test]
    fn silence_of_the_slave_is_passed_on() {
        let plan = GainPlan { mu: 1.0, lambda: 0.5, ramp_s: 0.010, changes: Vec::new() };
        let mut core = Backward::new(plan, Vec::new(), None, 1e-3);
        let mut outputs = [Sample::new(1), Sample::new(1)];
        core.step(&tick(0), &contact(0, -2.0), &mut outputs, &mut Events::default());
        assert_eq!(outputs[0].effort[0], -1.0);
        let mut outputs = [Sample::new(1), Sample::new(1)];
        core.step(&tick(1), &contact(0, -2.0), &mut outputs, &mut Events::default());
        assert!(outputs[0].effort[0].is_nan());
    }
}
