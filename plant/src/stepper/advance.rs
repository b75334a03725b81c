//! One substep.

use super::account::Done;
use super::compiled::Compiled;
use super::constraints::Work;
use super::contact::{Bounds, FrictionContact};
use super::follow::Follow;
use super::motion::Motion;
use super::segment::Segment;
use super::slots::{SLOTS, Slots, prescribed_slot};
use super::state::Plant;

/// Stands for a number of free bodies that is not known when the code is compiled.
const ANY: usize = 0;

/// Constraints beyond which a large network answers all their forces at once.
const FEW: usize = 4;

impl Plant {
    /// One period by substeps, whatever the model, with somebody who follows them.
    pub(super) fn step_followed<F: Follow>(&mut self, inputs: &[Segment], follower: &mut F) {
        self.take(inputs);
        self.step_by_substeps(follower);
        self.periods += 1;
    }

    /// One period by substeps.
    pub(super) fn step_by_substeps<F: Follow>(&mut self, follower: &mut F) {
        for index in 0..self.substeps {
            let from = self.substep * index as f64;
            let to = if index + 1 == self.substeps { self.period } else { self.substep * (index + 1) as f64 };
            match self.fixed.free {
                1 => self.substep::<1, F>(from, to, follower),
                2 => self.substep::<2, F>(from, to, follower),
                3 => self.substep::<3, F>(from, to, follower),
                4 => self.substep::<4, F>(from, to, follower),
                5 => self.substep::<5, F>(from, to, follower),
                6 => self.substep::<6, F>(from, to, follower),
                7 => self.substep::<7, F>(from, to, follower),
                8 => self.substep::<8, F>(from, to, follower),
                _ => self.substep::<ANY, F>(from, to, follower),
            }
            if self.sense.watches_substeps() {
                self.note_pushes(to);
                self.links_here();
                self.note_outputs();
                follower.noted(self);
            }
        }
        self.note_pushes(self.period);
        self.links_here();
    }

    /// `N` is the number of free bodies, or [`ANY`].
    #[inline]
    fn substep<const N: usize, F: Follow>(&mut self, from: f64, to: f64, follower: &mut F) {
        let n = if N == ANY { self.fixed.free.min(SLOTS) } else { N };
        let Some(mut motion) = self.motion.take() else { return };
        self.drive(n, from, to, &mut motion);
        self.links_to_the_middle(&mut motion);
        self.paths_to_the_middle(&mut motion);
        let points = !self.fixed.points.is_empty();
        if points {
            self.fixed.points.pass_on(&mut motion.force);
        }
        self.move_freely::<N>(n, &mut motion);
        if points {
            self.carry_points(&mut motion);
        }
        if self.fixed.constraints.len() > 0 {
            self.constrain(n, &mut motion);
            if points {
                self.carry_points(&mut motion);
            }
        }
        self.count_energy(&motion);
        follower.forces(self, n, &motion);
        self.arrive(n, &motion);
        follower.arrived(self, n);
        self.motion = Some(motion);
    }

    /// The motion that is known before: pushed and prescribed by inputs, and the free continuation of free bodies.
    #[inline(always)]
    fn drive(&mut self, n: usize, from: f64, to: f64, motion: &mut Motion) {
        let h = self.substep;
        let half = 0.5 * h;
        for i in 0..n {
            motion.force[i] = self.fixed.constant[i];
            motion.end[i] = 0.0;
        }
        for i in self.fixed.points.places() {
            motion.force[i] = 0.0;
        }
        for drive in &mut self.drives {
            let slot = drive.slot;
            if drive.moves {
                let ((x0, v0), (x1, v1, a1)) = drive.motion_over(from, to);
                (self.x[slot], motion.end[slot], motion.end_velocity[slot]) = (x0, x1, v1);
                self.prescribed_acceleration[slot] = a1;
                // Mean of the cubic through both ends.
                motion.middle[slot] = 0.5 * (x0 + x1) + h / 12.0 * (v0 - v1);
                motion.mean_velocity[slot] = (x1 - x0) / h;
            } else {
                let push = drive.mean(from, to);
                motion.force[slot] += push;
                motion.pushed[slot] = if drive.is_first { push } else { motion.pushed[slot] + push };
            }
        }
        for i in 0..n {
            motion.middle[i] = self.x[i] + half * self.v[i];
            motion.mean_velocity[i] = self.v[i];
        }
    }

    /// Explicit paths come to the middle of the substep and act from there; those with a constraint to its start.
    #[inline(always)]
    fn paths_to_the_middle(&mut self, motion: &mut Motion) {
        let half = 0.5 * self.substep;
        for path in &mut self.paths {
            let (first, second) = (path.first, path.second);
            let v0 = self.v[first] - self.v[second];
            if path.constraint.is_none() {
                let x = motion.middle[first] - motion.middle[second];
                // Velocity in the middle by extrapolation: second order for laws that depend on it.
                let v = 1.5 * v0 - 0.5 * path.velocity_before;
                path.law.advance(&mut path.memory, path.reached, x, half);
                path.reached = x;
                let start = self.x[first] - self.x[second];
                path.force = path.law.mean_force(&path.memory, start, 2.0 * x - start, v);
                motion.force[first] -= path.force;
                motion.force[second] += path.force;
            } else {
                // A prescribed body may have jumped to the start of this substep.
                let x = self.x[first] - self.x[second];
                if x != path.reached {
                    path.law.advance(&mut path.memory, path.reached, x, 0.0);
                    path.reached = x;
                }
            }
            path.velocity_before = v0;
        }
    }

    /// Velocities as they would be without constraints.
    #[inline(always)]
    fn move_freely<const N: usize>(&self, n: usize, motion: &mut Motion) {
        if let Some(sparse) = &self.fixed.sparse {
            let mut change = sparse.change(&motion.force, &self.x, &self.v);
            return self.change_velocities(n, motion, &mut change);
        }
        // No more room than is needed: to clear that of the largest network takes longer than to step a small one.
        if N == ANY {
            let mut change = [0.0; SLOTS];
            self.answer_forces(n, motion, &mut change);
            self.change_velocities(n, motion, &mut change);
        } else {
            let mut change = [0.0; N];
            self.answer_forces(N, motion, &mut change);
            self.change_velocities(N, motion, &mut change);
        }
    }

    /// Half of what forces, springs and dampers change of the velocities in a substep.
    #[inline(always)]
    fn answer_forces(&self, n: usize, motion: &Motion, change: &mut [f64]) {
        let fixed = &self.fixed;
        for j in 0..n {
            let (f, x, v) = (motion.force[j], self.x[j], self.v[j]);
            let (by_force, by_position, by_velocity) =
                (&fixed.from_force[j][..n], &fixed.from_position[j][..n], &fixed.from_velocity[j][..n]);
            for i in 0..n {
                change[i] += by_force[i] * f + by_position[i] * x + by_velocity[i] * v;
            }
        }
    }

    /// `change`: half the change of the velocities, still without what prescribed bodies add.
    #[inline(always)]
    fn change_velocities(&self, n: usize, motion: &mut Motion, change: &mut [f64]) {
        let h = self.substep;
        for (p, by) in self.fixed.from_prescribed.iter().enumerate() {
            let slot = prescribed_slot(p);
            let acceleration = (motion.end_velocity[slot] - self.v[slot]) / h;
            let (x, v) = (motion.middle[slot], motion.mean_velocity[slot]);
            let [by_position, by_velocity, by_acceleration] = by;
            for i in 0..n {
                change[i] += by_position[i] * x + by_velocity[i] * v + by_acceleration[i] * acceleration;
            }
        }
        for i in 0..n {
            motion.mean_velocity[i] += change[i];
            motion.end_velocity[i] = motion.mean_velocity[i] + change[i];
        }
    }

    /// The forces of dry friction and of stiff paths, and what they make of the velocities.
    #[inline(always)]
    fn constrain(&mut self, n: usize, motion: &mut Motion) {
        self.constraint_forces(n, motion);
        let (h, fixed, work) = (self.substep, &self.fixed, &mut *self.work);
        let Motion { mean_velocity, end_velocity, .. } = motion;
        let at_once = if fixed.constraints.len() > FEW { fixed.sparse.as_ref() } else { None };
        if let Some(sparse) = at_once {
            let mut taken = [0.0; SLOTS];
            for c in 0..fixed.constraints.len() {
                let (first, second) = fixed.constraints.ends(c);
                taken[first] += work.force[c];
                taken[second] -= work.force[c];
            }
            sparse.solve(&mut taken);
            for i in 0..n {
                mean_velocity[i] -= taken[i];
                end_velocity[i] -= 2.0 * taken[i];
            }
        }
        for c in if at_once.is_some() { 0..0 } else { 0..fixed.constraints.len() } {
            let (f, response) = (work.force[c], &fixed.constraints.response[c]);
            for i in 0..n {
                mean_velocity[i] -= response[i] * f;
                end_velocity[i] -= 2.0 * response[i] * f;
            }
        }
        for (c, contact) in self.frictions.iter_mut().enumerate() {
            contact.force = work.force[c];
            let Bounds { low, high } = work.bounds[c];
            contact.mode = if contact.force > low && contact.force < high {
                0
            } else if low == high {
                let v = end_velocity[contact.first] - end_velocity[contact.second];
                i8::from(v > 0.0) - i8::from(v < 0.0)
            } else if contact.force >= high {
                1
            } else {
                -1
            };
        }
        for path in &mut self.paths {
            if let Some(c) = path.constraint {
                path.force = work.force[c];
            }
        }
        settle(&self.frictions, n, end_velocity);
        for contact in self.frictions.iter_mut().filter(|contact| !contact.memory.is_empty()) {
            let work = contact.force * (mean_velocity[contact.first] - mean_velocity[contact.second]) * h;
            contact.law.rubbed(&mut contact.memory, work, h);
        }
    }

    /// Solves for the forces of the constraints; of contacts that stop on the way also how much further that lets the bodies come.
    #[inline(always)]
    fn constraint_forces(&mut self, n: usize, motion: &mut Motion) {
        let (h, fixed, work) = (self.substep, &self.fixed, &mut *self.work);
        for (c, contact) in self.frictions.iter_mut().enumerate() {
            work.base[c] = 0.5 * fixed.constraints.across(c, &motion.end_velocity);
            let v0 = self.v[contact.first] - self.v[contact.second];
            work.bounds[c] = contact.bounds(v0, &motion.middle, &self.paths);
            work.force[c] = contact.force.min(work.bounds[c].high).max(work.bounds[c].low);
            contact.velocity_before = v0;
        }
        for path in &self.paths {
            if let Some(c) = path.constraint {
                work.base[c] = fixed.constraints.across(c, &motion.mean_velocity);
                work.force[c] = path.force;
            }
        }
        fixed.constraints.solve(work, &mut self.paths);

        let stops = self.frictions.iter().enumerate().any(|(c, contact)| contact.leaves_its_level(c, work));
        work.stopped = stops && stop(fixed, &self.frictions, work);
        if work.stopped {
            fixed.constraints.solve(work, &mut self.paths);
            for (c, (share, sliding)) in work.stop.iter_mut().enumerate().take(self.frictions.len()) {
                if *share > 0.0 && *share < 1.0 {
                    // The force acted in two levels, the first one early: so much more (or less) way was made.
                    let after = (work.force[c] - *share * *sliding) / (1.0 - *share);
                    let moment = (*sliding - after) * h * *share * (1.0 - *share);
                    for i in 0..n {
                        motion.end[i] -= fixed.constraints.response[c][i] * moment;
                    }
                }
                *share = 0.0;
            }
        }
    }

    #[inline(always)]
    fn count_energy(&mut self, motion: &Motion) {
        if self.energy.is_none() {
            return;
        }
        let bias = self.bias_over(motion);
        if let Some(account) = &mut self.energy {
            let done = Done {
                velocity: &self.v,
                middle: &motion.middle,
                mean_velocity: &motion.mean_velocity,
                end_velocity: &motion.end_velocity,
                pushed: &motion.pushed,
                bias: &bias,
                length: self.substep,
            };
            account.count(&self.fixed, &self.drives, &self.frictions, &mut self.paths, &done);
        }
    }

    /// The state and the paths come to the end of the substep.
    #[inline(always)]
    fn arrive(&mut self, n: usize, motion: &Motion) {
        let h = self.substep;
        let half = 0.5 * h;
        for i in 0..n {
            self.x[i] = motion.end[i] + (self.x[i] + half * (self.v[i] + motion.end_velocity[i]));
            self.v[i] = motion.end_velocity[i];
        }
        for drive in self.drives.iter().filter(|drive| drive.moves) {
            self.x[drive.slot] = motion.end[drive.slot];
            self.v[drive.slot] = motion.end_velocity[drive.slot];
        }
        self.bring_points();
        for path in &mut self.paths {
            let x = self.x[path.first] - self.x[path.second];
            // An explicit one has already come to the middle.
            let left = if path.constraint.is_some() { h } else { half };
            path.law.advance(&mut path.memory, path.reached, x, left);
            path.reached = x;
        }
    }

    /// The points go with the joints.
    fn carry_points(&self, motion: &mut Motion) {
        self.fixed.points.carry(&mut motion.mean_velocity);
        self.fixed.points.carry(&mut motion.end_velocity);
    }

    /// Forces of the inputs at `s` of this period, seen from before.
    #[inline]
    pub(super) fn note_pushes(&mut self, s: f64) {
        for drive in self.drives.iter().filter(|drive| !drive.moves) {
            let force = drive.force_before(s);
            let pushed = &mut self.pushed[drive.slot];
            *pushed = if drive.is_first { force } else { *pushed + force };
        }
    }
}

/// Gives contacts that stop in this substep the bounds of their mean force: each slides until then, and sticks or slides back
/// after. Whether there are any.
#[cold]
fn stop(fixed: &Compiled, frictions: &[FrictionContact], work: &mut Work) -> bool {
    let solved = work.force;
    (work.first_force, work.first_bounds) = (work.force, work.bounds);
    let sliding = |contact: &FrictionContact, bounds: Bounds| if contact.mode > 0 { bounds.high } else { bounds.low };
    // By velocity, not by force: of several contacts in one place some may still have the level of sliding on.
    for (c, contact) in frictions.iter().enumerate() {
        let direction = f64::from(contact.mode);
        let (v0, v1) = (contact.velocity_before * direction, 2.0 * fixed.constraints.velocity(c, work) * direction);
        if v0 > 0.0 && v1 <= 1e-9 * v0 {
            work.stop[c].1 = f64::NAN;
        }
    }
    // Until the first of them stops all go on sliding: that motion gives the time.
    for (c, contact) in frictions.iter().enumerate() {
        if work.stop[c].1.is_nan() {
            work.force[c] = sliding(contact, work.bounds[c]);
        }
    }
    let mut any = false;
    for (c, contact) in frictions.iter().enumerate() {
        if !work.stop[c].1.is_nan() {
            continue;
        }
        work.stop[c] = (0.0, 0.0);
        let (v0, v1) = (contact.velocity_before, 2.0 * fixed.constraints.velocity(c, work));
        if v0 * v1 >= 0.0 {
            continue;
        }
        let (share, level) = (v0 / (v0 - v1), sliding(contact, work.bounds[c]));
        let bounds = &mut work.bounds[c];
        if contact.mode > 0 {
            bounds.low = share * level + (1.0 - share) * bounds.low;
        } else {
            bounds.high = share * level + (1.0 - share) * bounds.high;
        }
        work.stop[c] = (share, level);
        any = true;
    }
    work.force = solved;
    work.shares = work.stop;
    any
}

/// Makes the ends of each sticking contact move as one to the last bit, so that nothing creeps.
#[inline]
fn settle(frictions: &[FrictionContact], free: usize, velocity: &mut Slots) {
    for contact in frictions {
        if contact.mode == 0 && velocity[contact.first] != velocity[contact.second] {
            if contact.first < free {
                velocity[contact.first] = velocity[contact.second];
            } else if contact.second < free {
                velocity[contact.second] = velocity[contact.first];
            }
        }
    }
}

impl FrictionContact {
    /// Whether it was sliding and its force is not that of sliding on.
    #[inline]
    fn leaves_its_level(&self, c: usize, work: &Work) -> bool {
        match self.mode {
            0 => false,
            1 => work.force[c] != work.bounds[c].high,
            _ => work.force[c] != work.bounds[c].low,
        }
    }
}
