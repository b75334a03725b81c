//! Plays an excitation on a force channel, for identification.

use crate::core::{Core, Events, Port, Tick};
use backdrive_msgs::{MAX_AXES, Sample};

/// Output `force` (effort). Its inputs only hold it back. An axis without samples gets zero force.
pub struct Exciter {
    axes: Vec<Vec<f64>>,
}

impl Exciter {
    /// One list of forces per axis, one value per step, N or N m; zero after the end.
    pub fn new(mut axes: Vec<Vec<f64>>) -> Exciter {
        axes.truncate(MAX_AXES);
        Exciter { axes }
    }
}

impl Core for Exciter {
    fn step(&mut self, tick: &Tick, _inputs: &[Port], outputs: &mut [Sample], _events: &mut Events) {
        for axis in 0..outputs[0].len() {
            let force = self.axes.get(axis).and_then(|samples| samples.get(tick.step as usize));
            outputs[0].effort[axis] = force.copied().unwrap_or(0.0);
        }
    }
}
