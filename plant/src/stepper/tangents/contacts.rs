//! Dry friction and elements that are solved implicitly, in each lane.

use super::lane::{Across, between};
use super::lanes::Lanes;
use super::shared::{Rates, standing};
use crate::stepper::constraints::{Constraints, trial_force};
use crate::stepper::motion::Motion;
use crate::stepper::slots::{SLOTS, Slots};
use crate::stepper::state::Plant;

/// Whether a contact sticks: its force is neither the lowest nor the highest.
#[inline(always)]
fn inside(plant: &Plant, c: usize) -> bool {
    let (force, bounds) = (plant.work.force[c], plant.work.bounds[c]);
    force > bounds.low && force < bounds.high
}

impl<const W: usize> Lanes<W> {
    /// Derivatives of what each contact's force may be, and of a path's force at the velocity that it has.
    fn laws(&mut self, plant: &mut Plant, motion: &Motion) {
        let (half, stopped) = (0.5 * plant.substep, plant.work.stopped);
        let mut middle: Slots = [0.0; SLOTS];
        for (c, contact) in plant.frictions.iter().enumerate() {
            let before = if stopped { plant.work.first_bounds[c] } else { plant.work.bounds[c] };
            let v0 = plant.v[contact.first] - plant.v[contact.second];
            // What sticks and has stuck needs no bounds.
            let needed = stopped || !inside(plant, c);
            for (l, lane) in self.lanes.iter_mut().enumerate() {
                let mine = &mut lane.moved.frictions[c];
                let v0 = v0 + lane.step * between(&self.v, contact.first, contact.second, l);
                if !needed {
                    mine.velocity_before = v0;
                    continue;
                }
                for slot in [contact.joint.first, contact.joint.second] {
                    middle[slot] = motion.middle[slot] + lane.step * (self.x[slot][l] + half * self.v[slot][l]);
                }
                let mine = &mut lane.moved.frictions[c];
                let bounds = mine.bounds(v0, &middle, &lane.moved.paths);
                mine.velocity_before = v0;
                self.solution.low[c][l] = (bounds.low - before.low) / lane.step;
                self.solution.high[c][l] = (bounds.high - before.high) / lane.step;
            }
        }
        for path in &mut plant.paths {
            let Some(c) = path.constraint else { continue };
            let u = motion.mean_velocity[path.first] - motion.mean_velocity[path.second];
            let own = plant.fixed.constraints.own_compliance(c);
            let apart = 1e-6 * (u.abs() + own * path.force.abs()) + 1e-12;
            let there = trial_force(path, u);
            self.solution.slope[c] = (trial_force(path, u + apart) - there) / apart;
            let Some(index) = plant.fixed.constraints.path(c) else { continue };
            let (length, shared) = (path.memory.len(), self.serves[index]);
            let rates = shared.then(|| {
                let at = standing(path);
                let sharing = self.lanes.iter().filter(|lane| lane.shares[index]).map(|lane| standing(&lane.moved.paths[index]));
                let rates = Rates::of(at, sharing, [there], |[reached, first, second]| {
                    path.reached = *reached;
                    path.memory.copy_from_slice(&[*first, *second][..length]);
                    [trial_force(path, u)]
                });
                path.reached = at[0];
                path.memory.copy_from_slice(&at[1..=length]);
                rates
            });
            for (l, lane) in self.lanes.iter_mut().enumerate() {
                let mine = &mut lane.moved.paths[index];
                let force = match &rates {
                    Some(rates) if lane.shares[index] => rates.at(&standing(mine))[0],
                    _ => trial_force(mine, u),
                };
                self.solution.direct[c][l] = (force - there) / lane.step;
            }
        }
    }

    /// Derivatives of the forces of dry friction and of paths that are solved implicitly, and what they make of the velocities.
    pub(super) fn constrain(&mut self, plant: &mut Plant, n: usize, motion: &Motion) {
        self.laws(plant, motion);
        let shares = self.moments_of_rest(plant);
        let (constraints, work) = (&plant.fixed.constraints, &plant.work);
        self.solution.unknown.clear();
        for c in 0..plant.frictions.len() {
            let solution = &mut self.solution;
            if inside(plant, c) {
                solution.unknown.push(c);
            } else if let Some((share, sliding, by)) = shares.as_ref().and_then(|s| s.get(c)).copied().flatten() {
                // It slid one way and then the other: its mean force shifts with the moment between.
                let forwards = sliding == work.first_bounds[c].high;
                let (other, before, after) = if forwards {
                    (work.first_bounds[c].low, solution.high[c], solution.low[c])
                } else {
                    (work.first_bounds[c].high, solution.low[c], solution.high[c])
                };
                for l in 0..W {
                    solution.force[c][l] = by[l] * (sliding - other) + share * before[l] + (1.0 - share) * after[l];
                }
            } else {
                solution.force[c] = if work.force[c] >= work.bounds[c].high { solution.high[c] } else { solution.low[c] };
            }
        }
        self.base(constraints, plant.frictions.len());
        self.solution.unknown.extend(plant.frictions.len()..constraints.len());
        self.solution.solve(constraints, plant.frictions.len());
        for c in 0..constraints.len() {
            let (f, response) = (self.solution.force[c], &constraints.response[c]);
            for i in 0..n {
                for l in 0..W {
                    self.mean_velocity[i][l] -= response[i] * f[l];
                    self.end_velocity[i][l] -= 2.0 * response[i] * f[l];
                }
            }
        }
        for (c, rest) in shares.iter().flatten().enumerate() {
            let Some((share, sliding, by)) = rest else { continue };
            let before = if *sliding == work.first_bounds[c].high { self.solution.high[c] } else { self.solution.low[c] };
            let after = (work.force[c] - share * sliding) / (1.0 - share);
            for l in 0..W {
                let by_after = (self.solution.force[c][l] - by[l] * sliding - share * before[l] + by[l] * after) / (1.0 - share);
                let moment =
                    plant.substep * ((before[l] - by_after) * share * (1.0 - share) + (sliding - after) * by[l] * (1.0 - 2.0 * share));
                for i in 0..n {
                    self.end[i][l] -= constraints.response[c][i] * moment;
                }
            }
        }
        for (c, contact) in plant.frictions.iter().enumerate() {
            let (first, second) = (contact.first, contact.second);
            if contact.mode == 0 && first < n {
                self.end_velocity[first] = self.end_velocity[second];
            } else if contact.mode == 0 && second < n {
                self.end_velocity[second] = self.end_velocity[first];
            }
            let v = motion.mean_velocity[first] - motion.mean_velocity[second];
            for (l, lane) in self.lanes.iter_mut().enumerate() {
                let mine = &mut lane.moved.frictions[c];
                (mine.mode, mine.force) = (contact.mode, contact.force + lane.step * self.solution.force[c][l]);
                if !mine.memory.is_empty() {
                    let work = mine.force * (v + lane.step * between(&self.mean_velocity, first, second, l)) * plant.substep;
                    mine.law.rubbed(&mut mine.memory, work, plant.substep);
                }
            }
        }
        for (index, path) in plant.paths.iter().enumerate() {
            let Some(c) = path.constraint else { continue };
            for (l, lane) in self.lanes.iter_mut().enumerate() {
                lane.moved.paths[index].force = path.force + lane.step * self.solution.force[c][l];
            }
        }
    }

    /// Without any of the constraints' forces: derivatives of half the relative velocity at the end of contacts, of the mean relative velocity of paths.
    #[inline(always)]
    fn base(&mut self, constraints: &Constraints, frictions: usize) {
        for (c, base) in self.solution.base.iter_mut().enumerate() {
            let (first, second) = constraints.ends(c);
            let (of, factor) = if c < frictions { (&self.end_velocity, 0.5) } else { (&self.mean_velocity, 1.0) };
            for l in 0..W {
                base[l] = factor * between(of, first, second, l);
            }
        }
    }

    /// Of contacts that come to rest in this substep: the share of it until then, the force until then, and the share's derivatives. `None` where
    /// none does.
    #[cold]
    #[inline(never)]
    fn rests(&mut self, plant: &Plant) -> Vec<Option<(f64, f64, Across<W>)>> {
        let (constraints, work) = (&plant.fixed.constraints, &plant.work);
        let count = plant.frictions.len();
        // The forces before it was known that it stops.
        self.solution.unknown.clear();
        for c in 0..count {
            let (force, bounds) = (work.first_force[c], work.first_bounds[c]);
            if force > bounds.low && force < bounds.high {
                self.solution.unknown.push(c);
            } else {
                self.solution.force[c] = if force >= bounds.high { self.solution.high[c] } else { self.solution.low[c] };
            }
        }
        self.base(constraints, count);
        self.solution.unknown.extend(count..constraints.len());
        self.solution.solve(constraints, count);
        for c in 0..count {
            let (share, sliding) = work.shares[c];
            if share > 0.0 && share < 1.0 {
                let forwards = sliding == work.first_bounds[c].high;
                self.solution.force[c] = if forwards { self.solution.high[c] } else { self.solution.low[c] };
            }
        }
        let rest = |c: usize| {
            let (share, sliding) = work.shares[c];
            if !(share > 0.0 && share < 1.0) {
                return None;
            }
            let contact = &plant.frictions[c];
            let v0 = plant.v[contact.first] - plant.v[contact.second];
            // share = v0/(v0 - v1)
            let apart = v0 / share;
            let by = std::array::from_fn(|l| {
                let by_v0 = between(&self.v, contact.first, contact.second, l);
                let mut by_v1 = self.solution.base[c][l];
                for d in 0..constraints.len() {
                    by_v1 -= constraints.compliance(c, d) * self.solution.force[d][l];
                }
                (by_v0 - share * (by_v0 - 2.0 * by_v1)) / apart
            });
            Some((share, sliding, by))
        };
        (0..count).map(rest).collect()
    }

    #[inline]
    fn moments_of_rest(&mut self, plant: &Plant) -> Option<Vec<Option<(f64, f64, Across<W>)>>> {
        plant.work.stopped.then(|| self.rests(plant))
    }
}
