//! Elements with a force of their own, in each lane.

use super::lane::{Across, Lane, between};
use super::lanes::Lanes;
use super::shared::{Rates, advanced, padded, pushed, standing};
use crate::stepper::motion::Motion;
use crate::stepper::path::PathElement;
use crate::stepper::slots::GROUND;
use crate::stepper::state::Plant;

impl<const W: usize> Lanes<W> {
    /// Advances the memory of an element in each lane to where it comes there, as the plant's own has been.
    #[inline(always)]
    pub(super) fn advance(&mut self, index: usize, path: &PathElement, to: &Across<W>, dt: f64) {
        let (from, before) = &self.before[index];
        let length = before.len();
        if length > 0 && self.serves[index] {
            let [first, second] = padded(before);
            let place = |(l, lane): (usize, &Lane)| {
                let [reached, first, second] = standing(&lane.moved.paths[index]);
                [reached, to[l] - reached, first, second]
            };
            let sharing = self.lanes.iter().enumerate().filter(|(_, lane)| lane.shares[index]).map(place);
            let rates = Rates::of([*from, path.reached - from, first, second], sharing, padded(&path.memory), |at| {
                advanced(&path.law, length, dt, at)
            });
            for (l, lane) in self.lanes.iter_mut().enumerate().filter(|(_, lane)| lane.shares[index]) {
                let mine = &mut lane.moved.paths[index];
                let [reached, first, second] = standing(mine);
                mine.memory.copy_from_slice(&rates.at(&[reached, to[l] - reached, first, second])[..length]);
            }
        }
        for (l, lane) in self.lanes.iter_mut().enumerate() {
            let mine = &mut lane.moved.paths[index];
            if length > 0 && !(self.serves[index] && lane.shares[index]) {
                mine.law.advance(&mut mine.memory, mine.reached, to[l], dt);
            }
            mine.reached = to[l];
        }
    }

    /// Elements with a force of their own: those without a constraint push, the memory of the others follows a body that has jumped.
    pub(super) fn of_paths(&mut self, plant: &Plant, n: usize, motion: &Motion) {
        let half = 0.5 * plant.substep;
        for (index, path) in plant.paths.iter().enumerate() {
            let (first, second) = (path.first, path.second);
            let (x, middle, v) =
                (plant.x[first] - plant.x[second], motion.middle[first] - motion.middle[second], plant.v[first] - plant.v[second]);
            let (mut start, mut reached, mut velocity) = ([x; W], [middle; W], [v; W]);
            for (l, lane) in self.lanes.iter().enumerate() {
                let (dx, dv) = (between(&self.x, first, second, l), between(&self.v, first, second, l));
                start[l] += lane.step * dx;
                reached[l] += lane.step * (dx + half * dv);
                velocity[l] += lane.step * dv;
            }
            if path.constraint.is_none() {
                self.advance(index, path, &reached, half);
                self.push(index, path, (&start, x), &reached, (&velocity, v));
            } else if [first, second].iter().any(|slot| (n..GROUND).contains(slot)) {
                for (l, lane) in self.lanes.iter_mut().enumerate() {
                    let mine = &mut lane.moved.paths[index];
                    if start[l] != mine.reached {
                        mine.law.advance(&mut mine.memory, mine.reached, start[l], 0.0);
                        mine.reached = start[l];
                    }
                }
            }
            self.lanes.iter_mut().zip(&velocity).for_each(|(lane, v)| lane.moved.paths[index].velocity_before = *v);
        }
    }

    /// Forces by which an element that is solved explicitly pushes more in each lane.
    #[inline(always)]
    fn push(
        &mut self,
        index: usize,
        path: &PathElement,
        (start, x): (&Across<W>, f64),
        reached: &Across<W>,
        (velocity, v): (&Across<W>, f64),
    ) {
        let length = path.memory.len();
        let at = |l: usize, mine: &PathElement| {
            let [first, second] = padded(&mine.memory);
            [start[l], reached[l] - start[l], 1.5 * velocity[l] - 0.5 * mine.velocity_before, first, second]
        };
        let rates = self.serves[index].then(|| {
            let [first, second] = padded(&path.memory);
            // The plant has noted this velocity as the one before the next substep.
            let there = [x, path.reached - x, 1.5 * v - 0.5 * self.velocity_before[index], first, second];
            let sharing =
                self.lanes.iter().enumerate().filter(|(_, lane)| lane.shares[index]).map(|(l, lane)| at(l, &lane.moved.paths[index]));
            Rates::of(there, sharing, [path.force], |at| pushed(&path.law, length, at))
        });
        self.velocity_before[index] = v;
        for (l, lane) in self.lanes.iter_mut().enumerate() {
            let mine = &mut lane.moved.paths[index];
            mine.force = match &rates {
                Some(rates) if lane.shares[index] => rates.at(&at(l, mine))[0],
                _ => {
                    let velocity = 1.5 * velocity[l] - 0.5 * mine.velocity_before;
                    mine.law.mean_force(&mine.memory, start[l], 2.0 * reached[l] - start[l], velocity)
                }
            };
            let push = (mine.force - path.force) / lane.step;
            self.force[path.first][l] -= push;
            self.force[path.second][l] += push;
        }
    }
}
