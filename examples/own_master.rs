//! A master of one's own: a joystick in place of the simulated one, as a program that a graph starts.
//!
//! ```sh
//! cargo build --release --example own_master
//! backdrive run launch/own-master.toml
//! ```
//!
//! What a node does is a [`Core`]: a function of the step, its inputs and its own state. Time, transport, recording and
//! the end of the run are not its business. Here the device is simulated in a few lines; a real one would read its
//! encoder and write its motor current at the same places.

use backdrive_control::core::{Core, Events, Port, Tick};
use backdrive_launch::join::join;
use backdrive_msgs::Sample;
use backdrive_nodes::graph::NodeKind;
use std::process::ExitCode;

/// Of stick and motor at the tip, kg.
const MASS: f64 = 0.25;
/// Of the user's hand, N/m and N s/m.
const HAND: (f64, f64) = (400.0, 23.0);
/// Of the encoder at the tip, m.
const RESOLUTION: f64 = 2.0e-6;
/// Largest force of the motor, N.
const MOST_FORCE: f64 = 5.0;
/// Steps without a new force after which the motor is switched off.
const PATIENCE: u64 = 100;

/// One mass between motor and hand.
#[derive(Default)]
struct Joystick {
    position: f64,
    velocity: f64,
    /// What the motor does from the last step to this one, N.
    force: f64,
}

impl Core for Joystick {
    /// Inputs and outputs in the order in which a master has them: intent and force; measured and user.
    fn step(&mut self, tick: &Tick, inputs: &[Port], outputs: &mut [Sample], events: &mut Events) {
        // First to the present: semi-implicit Euler, stable for this hand at any rate above 100 Hz.
        let intent = inputs[0].sample.map_or((0.0, 0.0), |s| (s.position[0], s.velocity[0]));
        let grip = HAND.0 * (intent.0 - self.position) + HAND.1 * (intent.1 - self.velocity);
        if tick.step > 0 {
            self.velocity += (self.force + grip) / MASS * tick.period_s;
            self.position += self.velocity * tick.period_s;
        }

        // Then the force until the next step. A loop that has gone quiet must not go on pushing.
        let stale = inputs[1].age_steps > PATIENCE;
        if stale && self.force != 0.0 {
            events.push("force_stale", inputs[1].age_steps as f64, 1);
        }
        // What nobody has measured yet is NaN.
        let wanted = inputs[1].sample.map(|s| s.effort[0]).filter(|f| f.is_finite() && !stale);
        self.force = wanted.unwrap_or(0.0).clamp(-MOST_FORCE, MOST_FORCE);

        outputs[0].position[0] = (self.position / RESOLUTION).round() * RESOLUTION;
        outputs[0].effort[0] = self.force;
        outputs[1].position[0] = self.position;
        outputs[1].velocity[0] = self.velocity;
        outputs[1].effort[0] = grip;
    }
}

fn main() -> ExitCode {
    join(|_graph, node| match node.kind {
        NodeKind::Master => Ok(vec![Box::new(Joystick::default())]),
        other => Err(format!("own_master is a master; node \"{}\" is a {}", node.name, other.name())),
    })
}
