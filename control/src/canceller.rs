//! The induced-motion canceller: it predicts what the reflected force alone does to the master, and subtracts it.

use crate::core::{Core, Events, Port, Tick};
use crate::device::Device;
use crate::freshness::Freshness;
use crate::hand::{HandBank, Scheduled};
use crate::scaling::{GainPlan, GainsInForce, Ramp};
use backdrive_msgs::{Gains, MAX_AXES, Sample};

/// Input `measured` (position; effort = applied force); outputs `motion` (position without the predicted induced motion,
/// x_m - x^_mf), `induced` (position x^_mf).
///
/// Kuchenbecker & Niemeyer 2005, Fig. 3: the model is driven by the applied force alone, with the hand at rest.
pub struct Canceller {
    model: Option<Device>,
    scheduled: Option<(Scheduled, GainsInForce)>,
    high_pass: Option<HighPass>,
    measured: Freshness,
    force: [f64; MAX_AXES],
    started: bool,
    trusted: bool,
    /// Share of the prediction that is subtracted: 1, or on its way to 0 or back.
    share: Ramp,
    /// A switch that is to take place at the next step: whether on, and its ramp, s.
    switch: Option<(bool, f64)>,
}

impl Canceller {
    /// Without a model nothing is subtracted. `high_pass_hz` above 0 passes the estimate through a first-order
    /// high-pass of that corner: it lifts the limit that over-cancelling at DC sets, at the price of phase near the corner.
    pub fn new(model: Option<Device>, high_pass_hz: f64, period_s: f64) -> Canceller {
        let high_pass = (high_pass_hz > 0.0).then(|| HighPass::new(high_pass_hz, period_s));
        Canceller {
            model,
            scheduled: None,
            high_pass,
            measured: Freshness::default(),
            force: [0.0; MAX_AXES],
            started: false,
            trusted: true,
            share: Ramp::new(1.0),
            switch: None,
        }
    }

    /// With a model for each of several hands, and the hand estimated while the loop runs ([`crate::hand`]), at the loop's `gains` (NaN where they are not
    /// known). `edge_without` as in [`Scheduled::new`], `high_pass_hz` as in [`Canceller::new`].
    pub fn scheduled(bank: HandBank, edge_without: Option<f64>, gains: GainPlan, high_pass_hz: f64, period_s: f64) -> Canceller {
        let scheduled = Some((Scheduled::new(bank, edge_without, period_s), GainsInForce::new(gains, period_s)));
        Canceller { scheduled, ..Canceller::new(None, high_pass_hz, period_s) }
    }
}

impl Core for Canceller {
    fn step(&mut self, tick: &Tick, inputs: &[Port], outputs: &mut [Sample], events: &mut Events) {
        if let Some((on, ramp_s)) = self.switch.take() {
            self.share.aim(f64::from(u8::from(on)), ramp_s, tick.period_s);
            events.push(if on { "canceller_switched_on" } else { "canceller_switched_off" }, ramp_s, 1);
        }
        let share = self.share.step();
        let fresh = self.measured.new_sample(&inputs[0], |s| s.position[0]).copied();
        let mut induced = [0.0; MAX_AXES];
        if let Some(model) = &mut self.model {
            let axes = model.axes();
            // The model runs on through a gap under the last force it knows of.
            if self.started {
                model.step(&self.force[..axes], &[]);
            } else {
                model.start(&self.force[..axes], &[]);
                self.started = true;
            }
            if self.trusted && !model.is_finite() {
                self.trusted = false;
                events.push("canceller_off", tick.time_s, 2);
            }
            if self.trusted {
                for axis in 0..axes {
                    induced[axis] = model.measured(axis);
                }
            }
        }
        if let Some((scheduled, gains)) = &mut self.scheduled {
            let (mu, lambda) = gains.step(tick);
            scheduled.set_gain(mu * lambda);
            let predicted = scheduled.step(&self.force, fresh.as_ref().map(|s| &s.position), events);
            if self.trusted && !scheduled.is_finite() {
                self.trusted = false;
                events.push("canceller_off", tick.time_s, 2);
            }
            if self.trusted {
                induced = predicted;
            }
        }
        if let Some(high_pass) = &mut self.high_pass {
            high_pass.apply(&mut induced);
        }
        // Without a measurement there is nothing to say: the outputs stay not measured.
        if let Some(measured) = fresh {
            let (motion, estimate) = outputs.split_at_mut(1);
            for axis in 0..measured.len() {
                // The model runs on while it is left out, so that it is right when it comes back.
                let subtracted = if share < 1.0 { share * induced[axis] } else { induced[axis] };
                motion[0].position[axis] = measured.position[axis] - subtracted;
                estimate[0].position[axis] = subtracted;
                self.force[axis] = if measured.effort[axis].is_nan() { 0.0 } else { measured.effort[axis] };
            }
        }
    }

    fn set_gains(&mut self, gains: &Gains) {
        if let Some((_, in_force)) = &mut self.scheduled {
            in_force.set(gains);
        }
    }

    fn set_active(&mut self, active: bool, ramp_s: f64) {
        self.switch = Some((active, ramp_s));
    }
}

/// First-order high-pass, the bilinear image of s / (s + 2 pi corner).
struct HighPass {
    feed: f64,
    keep: f64,
    input: [f64; MAX_AXES],
    output: [f64; MAX_AXES],
}

impl HighPass {
    fn new(corner_hz: f64, period_s: f64) -> HighPass {
        let warped = (std::f64::consts::PI * corner_hz * period_s).min(1.5).tan();
        HighPass { feed: 1.0 / (1.0 + warped), keep: (1.0 - warped) / (1.0 + warped), input: [0.0; MAX_AXES], output: [0.0; MAX_AXES] }
    }

    fn apply(&mut self, values: &mut [f64; MAX_AXES]) {
        for axis in 0..MAX_AXES {
            self.output[axis] = self.keep * self.output[axis] + self.feed * (values[axis] - self.input[axis]);
            self.input[axis] = values[axis];
            values[axis] = self.output[axis];
        }
    }
}
