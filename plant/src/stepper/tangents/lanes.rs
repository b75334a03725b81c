//! The lanes of several parameters abreast.

use super::lane::{Across, Change, Lane, between};
use super::shared::SHARED_MEMORY;
use super::solution::Solution;
use crate::model::OutputKind;
use crate::stepper::follow::Follow;
use crate::stepper::motion::Motion;
use crate::stepper::slots::SLOTS;
use crate::stepper::state::Plant;

#[derive(Debug, Clone)]
pub(super) struct Lanes<const W: usize> {
    pub(super) lanes: Vec<Lane>,
    pub(super) x: [Across<W>; SLOTS],
    pub(super) v: [Across<W>; SLOTS],
    pub(super) mean_velocity: [Across<W>; SLOTS],
    pub(super) end_velocity: [Across<W>; SLOTS],
    /// What coming to rest within the substep adds to the positions at its end.
    pub(super) end: [Across<W>; SLOTS],
    /// Forces on the places.
    pub(super) force: [Across<W>; SLOTS],
    pub(super) solution: Solution<W>,
    /// Where each path element of the plant stood before it was last advanced, and its memory there.
    pub(super) before: Vec<(f64, Vec<f64>)>,
    /// Relative velocity of each path element of the plant before its last substep.
    pub(super) velocity_before: Vec<f64>,
    /// Of each path element, whether one differencing of its law serves all lanes that share it: with fewer of them each is differenced along its own direction.
    pub(super) serves: Vec<bool>,
    pub(super) values: Vec<f64>,
}

impl<const W: usize> Lanes<W> {
    pub(super) fn new(plant: &Plant, lanes: Vec<Lane>) -> Lanes<W> {
        let (count, zero) = (plant.fixed.constraints.len(), [[0.0; W]; SLOTS]);
        let each = || vec![[0.0; W]; count];
        let solution = Solution {
            force: each(),
            low: each(),
            high: each(),
            slope: vec![0.0; count],
            direct: each(),
            base: each(),
            unknown: Vec::with_capacity(count),
            matrix: Vec::with_capacity(count * count),
            right: Vec::with_capacity(count),
        };
        let values = vec![0.0; plant.output_count()];
        let before: Vec<(f64, Vec<f64>)> = plant.paths.iter().map(|path| (path.reached, path.memory.clone())).collect();
        let share = |index: usize| lanes.iter().filter(|lane| lane.shares[index]).count();
        let serves = before
            .iter()
            .enumerate()
            .map(|(index, (_, memory))| {
                plant.paths[index].law.is_costly() && memory.len() <= SHARED_MEMORY && share(index) > 2 + memory.len()
            })
            .collect();
        Lanes {
            lanes,
            x: zero,
            v: zero,
            mean_velocity: zero,
            end_velocity: zero,
            end: zero,
            force: zero,
            solution,
            before,
            velocity_before: vec![0.0; plant.paths.len()],
            serves,
            values,
        }
    }

    pub(super) fn start_at(&mut self, first: &[f64]) {
        self.lanes.iter_mut().for_each(|lane| lane.moved.start_at(first));
        (self.x, self.v) = ([[0.0; W]; SLOTS], [[0.0; W]; SLOTS]);
        self.velocity_before.fill(0.0);
        self.begin();
    }

    pub(super) fn set_motion(&mut self, body: usize, position: f64, velocity: f64) {
        self.lanes.iter_mut().for_each(|lane| lane.moved.set_motion(body, position, velocity));
        self.begin();
    }

    /// At the start all lanes are where the plant is.
    fn begin(&mut self) {
        let Some(lane) = self.lanes.first() else { return };
        for ((reached, memory), path) in self.before.iter_mut().zip(&lane.moved.paths) {
            *reached = path.reached;
            memory.clone_from(&path.memory);
        }
    }

    /// Notes where the plant's elements stand.
    #[inline(always)]
    fn note(&mut self, plant: &Plant) {
        for ((reached, memory), path) in self.before.iter_mut().zip(&plant.paths) {
            *reached = path.reached;
            memory.copy_from_slice(&path.memory);
        }
    }

    /// Forces by which linear elements that a parameter changes push more than the plant's own.
    fn of_linear(&mut self, plant: &Plant, n: usize, motion: &Motion) {
        let force = &mut self.force;
        let h = plant.substep;
        let state = |slot: usize| {
            let change = motion.mean_velocity[slot] - plant.v[slot];
            if slot < n {
                (motion.middle[slot] + plant.fixed.theta * 0.5 * h * change, motion.mean_velocity[slot], 2.0 * change / h)
            } else {
                (motion.middle[slot], motion.mean_velocity[slot], (motion.end_velocity[slot] - plant.v[slot]) / h)
            }
        };
        for (l, lane) in self.lanes.iter().enumerate() {
            for Change { first, second, by } in &lane.linear {
                let (a, b) = (state(*first), state(*second));
                let push = by.stiffness * (a.0 - b.0) + by.damping * (a.1 - b.1) + by.inertance * (a.2 - b.2) + by.force;
                force[*first][l] -= push / lane.step;
                force[*second][l] += push / lane.step;
            }
        }
    }

    /// What the rest of the network would do without constraints.
    #[inline(always)]
    fn move_freely(&mut self, plant: &Plant, n: usize) {
        let fixed = &plant.fixed;
        for i in 0..n {
            let mut change = [0.0; W];
            for j in 0..n {
                let (by_force, by_position, by_velocity) = (fixed.from_force[j][i], fixed.from_position[j][i], fixed.from_velocity[j][i]);
                let (f, x, v) = (&self.force[j], &self.x[j], &self.v[j]);
                for l in 0..W {
                    change[l] += by_force * f[l] + by_position * x[l] + by_velocity * v[l];
                }
            }
            for l in 0..W {
                self.mean_velocity[i][l] = self.v[i][l] + change[l];
                self.end_velocity[i][l] = self.mean_velocity[i][l] + change[l];
            }
            self.end[i] = [0.0; W];
        }
    }

    /// A lane's plant takes the state that the plant would have a step further.
    fn move_lane(&mut self, plant: &Plant, l: usize) {
        let lane = &mut self.lanes[l];
        for slot in 0..SLOTS {
            lane.moved.x[slot] = plant.x[slot] + lane.step * self.x[slot][l];
            lane.moved.v[slot] = plant.v[slot] + lane.step * self.v[slot][l];
        }
        lane.moved.prescribed_acceleration = plant.prescribed_acceleration;
        lane.moved.pushed = plant.pushed;
    }

    pub(super) fn outputs(&mut self, plant: &Plant, values: &[f64], derivatives: &mut [Vec<f64>]) {
        let differenced = plant.sense.reads_forces || plant.sense.delayed;
        for (l, derivatives) in derivatives.iter_mut().enumerate().take(self.lanes.len()) {
            if differenced {
                self.move_lane(plant, l);
                let lane = &mut self.lanes[l];
                lane.moved.outputs(&mut self.values);
                for ((derivative, moved), value) in derivatives.iter_mut().zip(&self.values).zip(values) {
                    *derivative = (moved - value) / lane.step;
                }
                continue;
            }
            for (derivative, sensor) in derivatives.iter_mut().zip(&plant.sense.sensors) {
                let of = if matches!(sensor.what, OutputKind::Velocity(_)) { &self.v } else { &self.x };
                *derivative = sensor.gain * of[sensor.slot][l];
            }
        }
    }
}

impl<const W: usize> Follow for Lanes<W> {
    fn forces(&mut self, plant: &mut Plant, n: usize, motion: &Motion) {
        // What is pushed onto other places is not read.
        self.force[..n].fill([0.0; W]);
        self.of_linear(plant, n, motion);
        self.of_paths(plant, n, motion);
        self.move_freely(plant, n);
        if plant.fixed.constraints.len() > 0 {
            self.constrain(plant, n, motion);
        }
        let half = 0.5 * plant.substep;
        for i in 0..n {
            for l in 0..W {
                self.x[i][l] += self.end[i][l] + half * (self.v[i][l] + self.end_velocity[i][l]);
            }
            self.v[i] = self.end_velocity[i];
        }
        self.note(plant);
    }

    fn arrived(&mut self, plant: &Plant, _n: usize) {
        for (index, path) in plant.paths.iter().enumerate() {
            let (first, second) = (path.first, path.second);
            let mut to = [plant.x[first] - plant.x[second]; W];
            self.lanes.iter().enumerate().for_each(|(l, lane)| to[l] += lane.step * between(&self.x, first, second, l));
            self.advance(index, path, &to, if path.constraint.is_some() { plant.substep } else { 0.5 * plant.substep });
        }
        self.note(plant);
    }

    fn noted(&mut self, plant: &Plant) {
        for l in 0..self.lanes.len() {
            self.move_lane(plant, l);
            self.lanes[l].moved.note_outputs();
        }
    }
}
