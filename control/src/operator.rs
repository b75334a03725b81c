//! The operator as a node: the intended motion of the hand, from a script or a recording.

use crate::core::{Core, Events, Port, Tick};
use backdrive_msgs::{MAX_AXES, Sample};

/// The hand's wanted motion on one axis.
#[derive(Debug, Clone, PartialEq)]
pub enum Intent {
    /// Stays at 0.
    Rest,
    /// Through (time s, position m) points, at rest in each: minimum-jerk moves (Flash & Hogan 1985). Times increase.
    Waypoints(Vec<[f64; 2]>),
    /// `amplitude sin(2 pi frequency t)`, faded in over the first period; m, Hz.
    Sine {
        /// m or rad.
        amplitude: f64,
        /// Hz.
        frequency: f64,
    },
    /// Position and velocity for every step, m and m/s (or rad), and the last position from then on.
    Recorded(Vec<[f64; 2]>),
}

impl Intent {
    /// Position and velocity at a step.
    pub fn at(&self, tick: &Tick) -> (f64, f64) {
        match self {
            Intent::Rest => (0.0, 0.0),
            Intent::Waypoints(points) => minimum_jerk(points, tick.time_s),
            Intent::Sine { amplitude, frequency } => {
                let w = 2.0 * std::f64::consts::PI * frequency;
                let (sin, cos) = (w * tick.time_s).sin_cos();
                let fade = (tick.time_s * frequency).min(1.0);
                let fade_rate = if tick.time_s * frequency < 1.0 { *frequency } else { 0.0 };
                (amplitude * fade * sin, amplitude * (fade * w * cos + fade_rate * sin))
            }
            Intent::Recorded(rows) => match rows.get(tick.step as usize) {
                Some([position, velocity]) => (*position, *velocity),
                None => (rows.last().map_or(0.0, |row| row[0]), 0.0),
            },
        }
    }
}

fn minimum_jerk(points: &[[f64; 2]], time: f64) -> (f64, f64) {
    let Some(next) = points.iter().position(|[t, _]| *t > time) else {
        return (points.last().map_or(0.0, |p| p[1]), 0.0);
    };
    if next == 0 {
        return (points[0][1], 0.0);
    }
    let ([t0, x0], [t1, x1]) = (points[next - 1], points[next]);
    let (s, span) = ((time - t0) / (t1 - t0), x1 - x0);
    let shape = s * s * s * (10.0 + s * (-15.0 + 6.0 * s));
    let slope = s * s * (30.0 + s * (-60.0 + 30.0 * s));
    (x0 + span * shape, span * slope / (t1 - t0))
}

/// Output `intent` (position and velocity of the hand). Its inputs only hold it back, so that in lockstep it does not run ahead.
pub struct Operator {
    axes: Vec<Intent>,
}

impl Operator {
    /// One intent per axis; at most [`MAX_AXES`] are used.
    pub fn new(mut axes: Vec<Intent>) -> Operator {
        axes.truncate(MAX_AXES);
        Operator { axes }
    }
}

impl Core for Operator {
    fn step(&mut self, tick: &Tick, _inputs: &[Port], outputs: &mut [Sample], _events: &mut Events) {
        // A short script leaves the further axes at rest.
        for axis in 0..outputs[0].len() {
            let intent = self.axes.get(axis).unwrap_or(&Intent::Rest);
            (outputs[0].position[axis], outputs[0].velocity[axis]) = intent.at(tick);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn at(intent: &Intent, time_s: f64) -> (f64, f64) {
        intent.at(&Tick { step: (time_s * 1000.0).round() as u64, time_s, period_s: 1e-3 })
    }

    #[test]
    fn waypoints_are_met_at_rest_and_velocity_is_the_slope() {
        let intent = Intent::Waypoints(vec![[0.5, 0.0], [1.0, 0.01], [2.0, 0.01], [2.5, 0.0]]);
        assert_eq!(at(&intent, 0.2), (0.0, 0.0));
        assert_eq!(at(&intent, 1.5).0, 0.01);
        assert_eq!(at(&intent, 9.0), (0.0, 0.0));
        // Peak speed of a minimum-jerk move is 15/8 of the mean.
        assert!((at(&intent, 0.75).1 - 15.0 / 8.0 * 0.02).abs() < 1e-12);
        for i in 0..2600 {
            let t = i as f64 * 1e-3;
            let slope = (at(&intent, t + 5e-7).0 - at(&intent, t - 5e-7).0) / 1e-6;
            assert!((slope - at(&intent, t).1).abs() < 1e-6, "at {t} s");
        }
    }

    #[test]
    fn a_script_of_fewer_axes_leaves_the_others_at_rest() {
        let mut outputs = [Sample::new(2)];
        let tick = Tick { step: 0, time_s: 0.0, period_s: 1e-3 };
        Operator::new(vec![Intent::Waypoints(vec![[0.0, 0.01]])]).step(&tick, &[], &mut outputs, &mut Events::default());
        assert_eq!(outputs[0].position[..2], [0.01, 0.0]);
    }

    #[test]
    fn a_recorded_intent_is_played_step_by_step() {
        let intent = Intent::Recorded(vec![[0.0, 1.0], [1e-3, 2.0], [3e-3, 0.5]]);
        assert_eq!(at(&intent, 0.001), (1e-3, 2.0));
        assert_eq!(at(&intent, 5.0), (3e-3, 0.0));
    }
}
