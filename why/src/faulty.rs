//! What a sensor or a motor does that its model does not say, put around a node's core.

use backdrive_control::core::{Core, Events, Port, Tick};
use backdrive_control::live_margin::MarginEstimate;
use backdrive_msgs::{Gains, Sample};
use backdrive_stability::by_itself::recorded::Quantity;
use serde::Serialize;
use std::collections::VecDeque;

/// What is done to a signal on its way out of a node, in this order: factor, delay, noise, steps, rails, death.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Distortion {
    /// Name of the node.
    pub node: String,
    /// Number of the node's stage, whose first output it is.
    pub stage: usize,
    /// Which of that output's quantities.
    pub quantity: Quantity,
    /// Number of the axis.
    pub axis: usize,
    /// Factor.
    pub gain: f64,
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
        let rails = [f64::NEG_INFINITY, f64::INFINITY];
        Distortion { node: node.to_string(), stage: 0, quantity, axis, gain: 1.0, late: 0, noise: 0.0, step: 0.0, rails, dead_from: None }
    }
}

/// A core whose outputs go through distortions.
pub struct Faulty {
    core: Box<dyn Core>,
    signals: Vec<(Distortion, VecDeque<f64>, f64)>,
    seed: u64,
}

impl Faulty {
    /// Puts distortions around the core of a stage.
    pub fn new(core: Box<dyn Core>, distortions: &[Distortion], seed: u64) -> Faulty {
        let signals = distortions.iter().map(|d| (d.clone(), VecDeque::with_capacity(d.late + 1), f64::NAN)).collect();
        Faulty { core, signals, seed }
    }
}

impl Core for Faulty {
    fn step(&mut self, tick: &Tick, inputs: &[Port], outputs: &mut [Sample], events: &mut Events) {
        self.core.step(tick, inputs, outputs, events);
        let Some(output) = outputs.first_mut() else { return };
        for (number, (how, past, last)) in self.signals.iter_mut().enumerate() {
            let mut value = how.gain * how.quantity.of(output, how.axis);
            if how.late > 0 {
                past.push_back(value);
                let first = past.front().copied().unwrap_or(value);
                value = if past.len() > how.late { past.pop_front().unwrap_or(value) } else { first };
            }
            if how.noise > 0.0 {
                value += how.noise * normal(self.seed.wrapping_add(number as u64), tick.step);
            }
            if how.step > 0.0 {
                value = (value / how.step).round() * how.step;
            }
            if value.is_finite() {
                value = value.clamp(how.rails[0], how.rails[1]);
            }
            if how.dead_from.is_some_and(|from| tick.step as usize >= from) && last.is_finite() {
                value = *last;
            }
            *last = value;
            how.quantity.set(output, how.axis, value);
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
        let mut core = Faulty::new(Box::new(Ramp), &[how], 1);
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
        let noisy = out(Distortion { gain: 0.0, noise: 1.0, ..none });
        assert!(noisy.windows(2).all(|w| w[0] != w[1]) && noisy.iter().all(|x| x.abs() < 6.0));
    }
}
