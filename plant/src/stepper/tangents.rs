//! Derivatives of a motion by parameters, carried along with the motion (forward mode).
//!
//! The plant moves under the model as it is. Beside it each parameter has a lane: the derivatives of all positions and velocities by it, which obey the
//! linear equations of a substep with the sticking and sliding of the plant's own (a tangent linear model), and the memories of the elements as they are
//! where the parameter is a small step further. A substep of a lane thus solves no law and searches no contact that sticks; it only differences each law
//! once along the lane's own direction. Where dry friction comes to rest and goes on the other way, the moment of rest moves along, too.

use super::compiled::Share;
use super::constraints::{Constraints, trial_force};
use super::motion::Motion;
use super::options::Options;
use super::path::PathElement;
use super::segment::Segment;
use super::shared::{Rates, SHARED_MEMORY, advanced, padded, pushed, standing};
use super::slots::{GROUND, SLOTS, Slots};
use super::state::Plant;
use crate::elements::Linear;
use crate::model::{Model, OutputKind};

/// Lanes that are carried abreast, at most.
pub const LANES: usize = 8;

/// Follows a plant through its substeps.
pub(super) trait Follow {
    /// The forces and velocities of a substep are known; positions and memories are still those of its start.
    fn forces(&mut self, plant: &mut Plant, n: usize, motion: &Motion);
    /// The substep is over.
    fn arrived(&mut self, plant: &Plant, n: usize);
    /// Delayed outputs have been noted.
    fn noted(&mut self, plant: &Plant);
}

/// Nobody follows.
impl Follow for () {
    #[inline(always)]
    fn forces(&mut self, _: &mut Plant, _: usize, _: &Motion) {}
    #[inline(always)]
    fn arrived(&mut self, _: &Plant, _: usize) {}
    #[inline(always)]
    fn noted(&mut self, _: &Plant) {}
}

/// What a parameter's step changes of the linear elements between two places.
#[derive(Debug, Clone)]
struct Change {
    first: usize,
    second: usize,
    by: Linear,
}

/// A parameter.
#[derive(Debug, Clone)]
struct Lane {
    /// The model a step further. Its elements remember what they would there.
    moved: Plant,
    /// The step, in the parameter's unit.
    step: f64,
    linear: Vec<Change>,
    /// Of each path element, whether the step leaves its law as it is.
    shares: Vec<bool>,
}

/// Derivatives of a plant's motion by up to [`LANES`] parameters.
#[derive(Debug, Clone)]
pub struct Tangents(Wide);

#[derive(Debug, Clone)]
enum Wide {
    Four(Lanes<4>),
    Eight(Lanes<8>),
}

/// One number for each lane.
type Across<const W: usize> = [f64; W];

#[derive(Debug, Clone)]
struct Lanes<const W: usize> {
    lanes: Vec<Lane>,
    x: [Across<W>; SLOTS],
    v: [Across<W>; SLOTS],
    mean_velocity: [Across<W>; SLOTS],
    end_velocity: [Across<W>; SLOTS],
    /// What coming to rest within the substep adds to the positions at its end.
    end: [Across<W>; SLOTS],
    /// Forces on the places.
    force: [Across<W>; SLOTS],
    solution: Solution<W>,
    /// Where each path element of the plant stood before it was last advanced, and its memory there.
    before: Vec<(f64, Vec<f64>)>,
    /// Relative velocity of each path element of the plant before its last substep.
    velocity_before: Vec<f64>,
    /// Of each path element, whether one differencing of its law serves all lanes that share it: with fewer of them each is differenced along its own direction.
    serves: Vec<bool>,
    values: Vec<f64>,
}

/// Derivatives of the forces of all constraints over a substep, and space to find them.
#[derive(Debug, Clone)]
struct Solution<const W: usize> {
    force: Vec<Across<W>>,
    /// Derivatives of a contact's lowest and highest force.
    low: Vec<Across<W>>,
    high: Vec<Across<W>>,
    /// Slope of a path's force over its mean velocity, and what the parameters change of the force at the same velocity.
    slope: Vec<f64>,
    direct: Vec<Across<W>>,
    /// Derivatives of the velocities by which constraints are solved, without any of their forces.
    base: Vec<Across<W>>,
    unknown: Vec<usize>,
    matrix: Vec<f64>,
    right: Vec<Across<W>>,
}

impl Tangents {
    /// Follows `plant`, which was compiled from `model` for samples `period` seconds apart and has not moved yet. Each parameter is given by a model that
    /// differs from `model` in it alone, and by how much it differs: small enough for a straight line. `None` where a model differs in more than its bodies
    /// and elements, where there are more than [`LANES`], and for a linear model, whose exact solution has no substeps to follow.
    pub fn new(plant: &Plant, model: &Model, moved: &[(Model, f64)], period: f64) -> Option<Tangents> {
        let options = Options { substeps: Some(plant.substeps), ..Options::default() };
        let alike = |m: &Model| m.inputs == model.inputs && m.outputs == model.outputs && m.elements.len() == model.elements.len();
        if plant.exact.is_some() || moved.len() > LANES || moved.iter().any(|(m, step)| !alike(m) || *step == 0.0) {
            return None;
        }
        let lanes: Option<Vec<Lane>> =
            moved.iter().map(|(m, step)| Lane::new(plant, model, m, Plant::new(m, period, &options).ok()?, *step)).collect();
        Some(Tangents(if moved.len() <= 4 { Wide::Four(Lanes::new(plant, lanes?)) } else { Wide::Eight(Lanes::new(plant, lanes?)) }))
    }

    /// As [`Plant::start_at`] of the plant.
    pub fn start_at(&mut self, first: &[f64]) {
        match &mut self.0 {
            Wide::Four(lanes) => lanes.start_at(first),
            Wide::Eight(lanes) => lanes.start_at(first),
        }
    }

    /// As [`Plant::set_motion`] of the plant: the motion at the start depends on no parameter.
    pub fn set_motion(&mut self, body: usize, position: f64, velocity: f64) {
        match &mut self.0 {
            Wide::Four(lanes) => lanes.set_motion(body, position, velocity),
            Wide::Eight(lanes) => lanes.set_motion(body, position, velocity),
        }
    }

    /// Advances the plant by one period, and its derivatives along.
    pub fn step(&mut self, plant: &mut Plant, inputs: &[Segment]) {
        match &mut self.0 {
            Wide::Four(lanes) => plant.step_followed(inputs, lanes),
            Wide::Eight(lanes) => plant.step_followed(inputs, lanes),
        }
    }

    /// Derivatives of the plant's outputs, whose values now are `values`: `derivatives[lane][output]`.
    pub fn outputs(&mut self, plant: &Plant, values: &[f64], derivatives: &mut [Vec<f64>]) {
        match &mut self.0 {
            Wide::Four(lanes) => lanes.outputs(plant, values, derivatives),
            Wide::Eight(lanes) => lanes.outputs(plant, values, derivatives),
        }
    }
}

impl Lane {
    fn new(plant: &Plant, model: &Model, changed: &Model, mut moved: Plant, step: f64) -> Option<Lane> {
        let same = moved.fixed.slots == plant.fixed.slots && moved.frictions.len() == plant.frictions.len();
        if !same || moved.paths.len() != plant.paths.len() {
            return None;
        }
        for (path, of_plant) in moved.paths.iter_mut().zip(&plant.paths) {
            if path.memory.len() != of_plant.memory.len() {
                return None;
            }
            // What is solved implicitly is the plant's choice.
            (path.constraint, path.unresolved, path.ahead) = (of_plant.constraint, of_plant.unresolved, of_plant.ahead);
        }
        let mut linear = Vec::new();
        for (share, of_plant) in moved.fixed.elements.iter().zip(&plant.fixed.elements) {
            if let (Share::Linear(new, first, second), Share::Linear(old, ..)) = (share, of_plant)
                && new != old
                && first != second
            {
                let by = Linear {
                    stiffness: new.stiffness - old.stiffness,
                    damping: new.damping - old.damping,
                    inertance: new.inertance - old.inertance,
                    force: new.force - old.force,
                };
                linear.push(Change { first: *first, second: *second, by });
            }
        }
        for ((body, old), slot) in changed.bodies.iter().zip(&model.bodies).zip(&plant.fixed.slots) {
            if body.inertia != old.inertia {
                let by = Linear { inertance: body.inertia - old.inertia, ..Linear::default() };
                linear.push(Change { first: *slot, second: GROUND, by });
            }
        }
        let shares = moved.paths.iter().zip(&plant.paths).map(|(mine, of_plant)| mine.law == of_plant.law).collect();
        Some(Lane { moved, step, linear, shares })
    }
}

/// Whether a contact sticks: its force is neither the lowest nor the highest.
#[inline(always)]
fn inside(plant: &Plant, c: usize) -> bool {
    let (force, bounds) = (plant.work.force[c], plant.work.bounds[c]);
    force > bounds.low && force < bounds.high
}

/// A quantity between two places.
#[inline(always)]
fn between<const W: usize>(of: &[Across<W>; SLOTS], first: usize, second: usize, lane: usize) -> f64 {
    of[first][lane] - of[second][lane]
}

impl<const W: usize> Lanes<W> {
    fn new(plant: &Plant, lanes: Vec<Lane>) -> Lanes<W> {
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
        let serves = before.iter().enumerate().map(|(index, (_, memory))| plant.paths[index].law.is_costly() && memory.len() <= SHARED_MEMORY && share(index) > 2 + memory.len()).collect();
        Lanes { lanes, x: zero, v: zero, mean_velocity: zero, end_velocity: zero, end: zero, force: zero, solution, before, velocity_before: vec![0.0; plant.paths.len()], serves, values }
    }

    fn start_at(&mut self, first: &[f64]) {
        self.lanes.iter_mut().for_each(|lane| lane.moved.start_at(first));
        (self.x, self.v) = ([[0.0; W]; SLOTS], [[0.0; W]; SLOTS]);
        self.velocity_before.fill(0.0);
        self.begin();
    }

    fn set_motion(&mut self, body: usize, position: f64, velocity: f64) {
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

    /// Advances the memory of an element in each lane to where it comes there, as the plant's own has been.
    #[inline(always)]
    fn advance(&mut self, index: usize, path: &PathElement, to: &Across<W>, dt: f64) {
        let (from, before) = &self.before[index];
        let length = before.len();
        if length > 0 && self.serves[index] {
            let [first, second] = padded(before);
            let place = |(l, lane): (usize, &Lane)| {
                let [reached, first, second] = standing(&lane.moved.paths[index]);
                [reached, to[l] - reached, first, second]
            };
            let sharing = self.lanes.iter().enumerate().filter(|(_, lane)| lane.shares[index]).map(place);
            let rates = Rates::of([*from, path.reached - from, first, second], sharing, padded(&path.memory), |at| advanced(&path.law, length, dt, at));
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

    /// Elements with a force of their own: those without a constraint push, the memory of the others follows a body that has jumped.
    fn of_paths(&mut self, plant: &Plant, n: usize, motion: &Motion) {
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
    fn push(&mut self, index: usize, path: &PathElement, (start, x): (&Across<W>, f64), reached: &Across<W>, (velocity, v): (&Across<W>, f64)) {
        let length = path.memory.len();
        let at = |l: usize, mine: &PathElement| {
            let [first, second] = padded(&mine.memory);
            [start[l], reached[l] - start[l], 1.5 * velocity[l] - 0.5 * mine.velocity_before, first, second]
        };
        let rates = self.serves[index].then(|| {
            let [first, second] = padded(&path.memory);
            // The plant has noted this velocity as the one before the next substep.
            let there = [x, path.reached - x, 1.5 * v - 0.5 * self.velocity_before[index], first, second];
            let sharing = self.lanes.iter().enumerate().filter(|(_, lane)| lane.shares[index]).map(|(l, lane)| at(l, &lane.moved.paths[index]));
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
    fn constrain(&mut self, plant: &mut Plant, n: usize, motion: &Motion) {
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
        // The forces as they were when nobody knew that it stops.
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

    fn outputs(&mut self, plant: &Plant, values: &[f64], derivatives: &mut [Vec<f64>]) {
        let differenced = plant.sense.needs_forces || plant.sense.delayed;
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

impl<const W: usize> Solution<W> {
    /// Solves for the unknown forces; the others are known. A contact sticks: its ends stay together. A path's force follows its velocity.
    fn solve(&mut self, constraints: &Constraints, frictions: usize) {
        let k = self.unknown.len();
        if let ([c], 1) = (&self.unknown[..], constraints.len()) {
            let (own, c) = (constraints.own_compliance(*c), *c);
            for l in 0..W {
                let (base, direct) = (self.base[c][l], self.direct[c][l]);
                self.force[c][l] = match own {
                    _ if c >= frictions => (self.slope[c] * base + direct) / (1.0 + self.slope[c] * own),
                    _ if own > 0.0 => base / own,
                    _ => 0.0,
                };
            }
            return;
        }
        self.matrix.clear();
        self.matrix.resize(k * k, 0.0);
        self.right.clear();
        let known = |c: usize| !self.unknown.contains(&c);
        for (row, c) in self.unknown.iter().enumerate() {
            let mut right = self.base[*c];
            for d in (0..constraints.len()).filter(|d| known(*d)) {
                let p = constraints.compliance(*c, d);
                (0..W).for_each(|l| right[l] -= p * self.force[d][l]);
            }
            let factor = if *c < frictions { 1.0 } else { self.slope[*c] };
            for (column, d) in self.unknown.iter().enumerate() {
                self.matrix[row * k + column] = factor * constraints.compliance(*c, *d);
            }
            if *c >= frictions {
                self.matrix[row * k + row] += 1.0;
                (0..W).for_each(|l| right[l] = factor * right[l] + self.direct[*c][l]);
            }
            self.right.push(right);
        }
        self.eliminate(k);
        for (row, c) in self.unknown.iter().enumerate() {
            self.force[*c] = self.right[row];
        }
    }

    /// Gauss elimination from the first row on: the equations of contacts are symmetric, and those of paths are near to 1. Of contacts in one place, whose
    /// equations are the same, the first holds.
    fn eliminate(&mut self, k: usize) {
        for i in 0..k {
            let pivot = self.matrix[i * k + i];
            let holds = pivot.abs() > 1e-12 * (0..k).map(|j| self.matrix[i * k + j].abs()).fold(f64::MIN_POSITIVE, f64::max);
            for row in i + 1..k {
                let factor = if holds { self.matrix[row * k + i] / pivot } else { 0.0 };
                if factor != 0.0 {
                    for column in i..k {
                        self.matrix[row * k + column] -= factor * self.matrix[i * k + column];
                    }
                    let above = self.right[i];
                    (0..W).for_each(|l| self.right[row][l] -= factor * above[l]);
                }
            }
        }
        for i in (0..k).rev() {
            let pivot = self.matrix[i * k + i];
            let holds = pivot.abs() > 1e-12 * (i..k).map(|j| self.matrix[i * k + j].abs()).fold(f64::MIN_POSITIVE, f64::max);
            for j in i + 1..k {
                let (factor, below) = (self.matrix[i * k + j], self.right[j]);
                (0..W).for_each(|l| self.right[i][l] -= factor * below[l]);
            }
            self.right[i] = if holds { self.right[i].map(|r| r / pivot) } else { [0.0; W] };
        }
    }
}
