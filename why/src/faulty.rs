//! What a sensor, a motor or a way does that its model does not say, put around a node's core.

use backdrive_control::core::{Core, Events, Port, Tick};
use backdrive_control::live_margin::MarginEstimate;
use backdrive_msgs::{Gains, Sample};
use backdrive_signal::butterworth::Butterworth;
use backdrive_stability::by_itself::recorded::Quantity;
use backdrive_stability::by_itself::shapes::{Filter, Renewal};
use serde::Serialize;
use std::collections::VecDeque;
use std::f64::consts::TAU;

/// Which side of a node a signal is on.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
pub enum Side {
    /// The first output of a stage.
    Output,
    /// An input of a stage, by its number there.
    Input(usize),
}

/// What is done to a signal on its way into or out of a node, in this order: factor, low-pass, hold, delay, noise, steps, rails, death.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Distortion {
    /// Name of the node.
    pub node: String,
    /// Number of the node's stage.
    pub stage: usize,
    /// Which of the stage's signals.
    pub side: Side,
    /// Which of its quantities.
    pub quantity: Quantity,
    /// Number of the axis.
    pub axis: usize,
    /// Factor.
    pub gain: f64,
    /// What is added on the side to which the signal moves, in its unit: a feed-forward of dry friction; 0 for none.
    pub lead: f64,
    /// A sine that is added: amplitude in the signal's unit, and Hz.
    pub dither: [f64; 2],
    /// A low-pass.
    pub filter: Option<Filter>,
    /// A rate of its own at which it is renewed.
    pub hold: Option<Renewal>,
    /// Whether it then goes on a straight line from the value before to the new one, instead of a step: smooth, and one renewal late.
    pub ramps: bool,
    /// Rows by which it is late.
    pub late: usize,
    /// Standard deviation of added noise, in the signal's unit.
    pub noise: f64,
    /// Step to which it is rounded; 0 for none.
    pub step: f64,
    /// Values between which it stays.
    pub rails: [f64; 2],
    /// Step from which on it stands still.
    pub dead_from: Option<usize>,
}

impl Distortion {
    /// Nothing is done to the signal.
    pub fn none(node: &str, quantity: Quantity, axis: usize) -> Distortion {
        Distortion {
            node: node.to_string(),
            stage: 0,
            side: Side::Output,
            quantity,
            axis,
            gain: 1.0,
            lead: 0.0,
            dither: [0.0, 0.0],
            filter: None,
            hold: None,
            ramps: false,
            late: 0,
            noise: 0.0,
            step: 0.0,
            rails: [f64::NEG_INFINITY, f64::INFINITY],
            dead_from: None,
        }
    }
}

/// A signal with a distortion, and what that remembers.
struct Signal {
    how: Distortion,
    filter: Option<Butterworth>,
    period_s: f64,
    /// The value before, and to which side it moved last.
    raw: f64,
    side: f64,
    held: f64,
    /// The value before the held one, and the step of the last renewal.
    before: f64,
    renewed: u64,
    past: VecDeque<f64>,
    last: f64,
    seed: u64,
}

impl Signal {
    fn new(how: &Distortion, period_s: f64, seed: u64) -> Signal {
        let filter = how.filter.map(|f| Butterworth::new(f.order, f.corner_hz, period_s));
        Signal {
            how: how.clone(),
            period_s,
            raw: f64::NAN,
            side: 0.0,
            filter,
            held: f64::NAN,
            before: f64::NAN,
            renewed: 0,
            past: VecDeque::with_capacity(how.late + 1),
            last: f64::NAN,
            seed,
        }
    }

    /// What becomes of a value at a step.
    fn pass(&mut self, value: f64, step: u64) -> f64 {
        let how = &self.how;
        if value != self.raw && self.raw.is_finite() {
            self.side = (value - self.raw).signum();
        }
        self.raw = value;
        let [swing, hz] = how.dither;
        let mut value = how.gain * value + how.lead * self.side + swing * (TAU * hz * step as f64 * self.period_s).sin();
        if let Some(filter) = self.filter.as_mut().filter(|_| value.is_finite()) {
            value = filter.step(value);
        }
        if let Some(hold) = &how.hold {
            if value.is_finite() && (self.held.is_nan() || hold.is_at(step as f64)) {
                self.before = if self.held.is_nan() { value } else { self.held };
                (self.held, self.renewed) = (value, step);
            }
            let share = if how.ramps { ((step - self.renewed) as f64 / hold.rows).min(1.0) } else { 1.0 };
            value = self.before + share * (self.held - self.before);
        }
        if how.late > 0 {
            self.past.push_back(value);
            let first = self.past.front().copied().unwrap_or(value);
            value = if self.past.len() > how.late { self.past.pop_front().unwrap_or(value) } else { first };
        }
        if how.noise > 0.0 {
            value += how.noise * normal(self.seed, step);
        }
        if how.step > 0.0 {
            value = (value / how.step).round() * how.step;
        }
        if value.is_finite() {
            value = value.clamp(how.rails[0], how.rails[1]);
        }
        if how.dead_from.is_some_and(|from| step as usize >= from) && self.last.is_finite() {
            value = self.last;
        }
        self.last = value;
        value
    }
}

/// A core whose signals go through distortions.
pub struct Faulty {
    core: Box<dyn Core>,
    signals: Vec<Signal>,
    inputs: Vec<Port>,
}

impl Faulty {
    /// Puts distortions around the core of a stage of a node that steps every `period_s`.
    pub fn new(core: Box<dyn Core>, distortions: &[Distortion], period_s: f64, seed: u64) -> Faulty {
        let each = distortions.iter().enumerate();
        let signals = each.map(|(number, how)| Signal::new(how, period_s, seed.wrapping_add(number as u64))).collect();
        Faulty { core, signals, inputs: Vec::new() }
    }
}

impl Core for Faulty {
    fn step(&mut self, tick: &Tick, inputs: &[Port], outputs: &mut [Sample], events: &mut Events) {
        self.inputs.clear();
        self.inputs.extend_from_slice(inputs);
        for signal in &mut self.signals {
            let Side::Input(port) = signal.how.side else { continue };
            let (quantity, axis) = (signal.how.quantity, signal.how.axis);
            if let Some(sample) = self.inputs.get_mut(port).and_then(|port| port.sample.as_mut()) {
                let value = signal.pass(quantity.of(sample, axis), tick.step);
                quantity.set(sample, axis, value);
            }
        }
        self.core.step(tick, &self.inputs, outputs, events);
        let Some(output) = outputs.first_mut() else { return };
        for signal in self.signals.iter_mut().filter(|s| s.how.side == Side::Output) {
            let (quantity, axis) = (signal.how.quantity, signal.how.axis);
            let value = signal.pass(quantity.of(output, axis), tick.step);
            quantity.set(output, axis, value);
        }
    }

    fn set_gains(&mut self, gains: &Gains) {
        self.core.set_gains(gains);
    }

    fn gains(&self) -> Option<(f64, f64)> {
        self.core.gains()
    }

    fn margin(&self) -> Option<MarginEstimate> {
        self.core.margin()
    }
}

/// A number of a standard normal distribution, by (seed, step) alone: the sum of twelve uniform ones less six.
fn normal(seed: u64, step: u64) -> f64 {
    let mut state = seed.wrapping_mul(0x9e37_79b9_7f4a_7c15) ^ step.wrapping_mul(0xbf58_476d_1ce4_e5b9);
    let mut sum = 0.0;
    for _ in 0..12 {
        state ^= state >> 30;
        state = state.wrapping_mul(0xbf58_476d_1ce4_e5b9);
        state ^= state >> 27;
        state = state.wrapping_mul(0x94d0_49bb_1331_11eb).wrapping_add(1);
        sum += (state >> 11) as f64 / (1_u64 << 53) as f64;
    }
    sum - 6.0
}

#[cfg(test)]
mod tests {
    use super::*;

    struct Ramp;

    impl Core for Ramp {
        fn step(&mut self, tick: &Tick, _: &[Port], outputs: &mut [Sample], _: &mut Events) {
            outputs[0].position[0] = tick.step as f64;
        }
    }

    fn out(how: Distortion) -> Vec<f64> {
        let mut core = Faulty::new(Box::new(Ramp), &[how], 1e-3, 1);
        let one = |step: u64| {
            let mut outputs = [Sample::new(1)];
            core.step(&Tick { step, time_s: 0.0, period_s: 1e-3 }, &[], &mut outputs, &mut Events::default());
            outputs[0].position[0]
        };
        (0..10).map(one).collect()
    }

    #[test]
    fn each_distortion_does_what_it_says() {
        let none = Distortion::none("n", Quantity::Position, 0);
        assert_eq!(out(none.clone()), (0..10).map(f64::from).collect::<Vec<_>>());
        assert_eq!(out(Distortion { late: 3, ..none.clone() }), [0.0, 0.0, 0.0, 0.0, 1.0, 2.0, 3.0, 4.0, 5.0, 6.0]);
        assert_eq!(out(Distortion { gain: -2.0, rails: [-7.0, 7.0], ..none.clone() })[..6], [0.0, -2.0, -4.0, -6.0, -7.0, -7.0]);
        assert_eq!(out(Distortion { step: 4.0, ..none.clone() })[..7], [0.0, 0.0, 4.0, 4.0, 4.0, 4.0, 8.0]);
        assert_eq!(out(Distortion { dead_from: Some(4), ..none.clone() })[2..], [2.0, 3.0, 3.0, 3.0, 3.0, 3.0, 3.0, 3.0]);
        let hold = Some(Renewal { rows: 2.5, phase: 1.0 });
        assert_eq!(out(Distortion { hold, ..none.clone() }), [0.0, 1.0, 1.0, 3.0, 3.0, 3.0, 6.0, 6.0, 8.0, 8.0]);
        let ramps = out(Distortion { hold: Some(Renewal { rows: 2.0, phase: 0.0 }), ramps: true, ..none.clone() });
        assert_eq!(ramps, [0.0, 0.0, 0.0, 1.0, 2.0, 3.0, 4.0, 5.0, 6.0, 7.0], "smooth, and one renewal late");
        let led = out(Distortion { lead: 0.5, ..none.clone() });
        assert_eq!(led[..3], [0.0, 1.5, 2.5]);
        let swung = out(Distortion { gain: 0.0, dither: [2.0, 250.0], ..none.clone() });
        assert!((swung[1] - 2.0).abs() < 1e-9 && swung[2].abs() < 1e-9 && (swung[3] + 2.0).abs() < 1e-9, "{swung:?}");
        let slow = out(Distortion { filter: Some(Filter { order: 1, corner_hz: 1.0 }), ..none.clone() });
        assert!(slow.windows(2).all(|w| w[1] > w[0]) && slow[9] < 0.5, "{slow:?}");
        let noisy = out(Distortion { gain: 0.0, noise: 1.0, ..none });
        assert!(noisy.windows(2).all(|w| w[0] != w[1]) && noisy.iter().all(|x| x.abs() < 6.0));
    }
}
