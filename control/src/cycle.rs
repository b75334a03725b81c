//! The operator of a test bench: a cycle of pedal and speed over time.

use crate::core::{Core, Events, Port, Tick};
use backdrive_msgs::Sample;

/// What is wanted over time: pedal (0 to 1) and speed (rad/s).
#[derive(Debug, Clone, PartialEq)]
pub enum Cycle {
    /// Through [time s, pedal, speed], in straight lines; times do not fall, and two points at one time are a step. The last one holds.
    Points(Vec<[f64; 3]>),
    /// [pedal, speed] of every step, the last one from then on.
    Recorded(Vec<[f64; 2]>),
}

impl Cycle {
    /// Pedal and speed at a step.
    pub fn at(&self, tick: &Tick) -> [f64; 2] {
        match self {
            Cycle::Recorded(rows) => rows.get(tick.step as usize).or(rows.last()).copied().unwrap_or_default(),
            Cycle::Points(points) => {
                let rest = |p: &[f64; 3]| [p[1], p[2]];
                let after = points.partition_point(|p| p[0] <= tick.time_s);
                let (Some(before), Some(next)) = (after.checked_sub(1).and_then(|i| points.get(i)), points.get(after)) else {
                    let nearest = if after == 0 { points.first() } else { points.last() };
                    return nearest.map_or([0.0; 2], rest);
                };
                let share = (tick.time_s - before[0]) / (next[0] - before[0]);
                [1, 2].map(|i| before[i] + share * (next[i] - before[i]))
            }
        }
    }
}

/// Outputs `pedal` (position, 0 to 1), `speed` (velocity, rad/s).
pub struct CycleNode {
    cycle: Cycle,
}

impl CycleNode {
    /// The cycle as a node.
    pub fn new(cycle: Cycle) -> CycleNode {
        CycleNode { cycle }
    }
}

impl Core for CycleNode {
    fn step(&mut self, tick: &Tick, _inputs: &[Port], outputs: &mut [Sample], _events: &mut Events) {
        let [pedal, speed] = self.cycle.at(tick);
        let (pedals, speeds) = outputs.split_at_mut(1);
        for axis in 0..pedals[0].len() {
            pedals[0].position[axis] = pedal;
            speeds[0].velocity[axis] = speed;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn points_are_joined_by_lines_and_two_at_one_time_are_a_step() {
        let cycle = Cycle::Points(vec![[1.0, 0.0, 100.0], [2.0, 0.5, 100.0], [2.0, 1.0, 100.0], [4.0, 1.0, 200.0]]);
        let at = |time_s: f64| cycle.at(&Tick { step: 0, time_s, period_s: 1e-3 });
        assert_eq!(at(0.0), [0.0, 100.0]);
        assert_eq!(at(1.5), [0.25, 100.0]);
        assert_eq!(at(2.0), [1.0, 100.0]);
        assert_eq!(at(3.0), [1.0, 150.0]);
        assert_eq!(at(9.0), [1.0, 200.0]);
    }
}
