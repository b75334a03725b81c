//! Forces and accelerations at an instant, from the balance of forces there.
//!
//! A substep knows forces as means over it; outputs want them at the sample.

use super::compiled::Share;
use super::contact::Bounds;
use super::dense;
use super::instant::Endpoint;
use super::slots::{Columns, GROUND, SLOTS, Slots, Square};
use super::state::Plant;

/// Sweeps over the friction contacts: accelerations need no more digits than an output has.
const SWEEPS: usize = 200;
/// Of a network without a robot.
const NO_BIAS: Slots = [0.0; SLOTS];

/// Inverse of the inertia of the free bodies; not numbers where there is none.
fn invert(inverse: &mut Columns, mass: &Square, free: usize) {
    if inverse.size() != free {
        *inverse = Columns::new(free);
    }
    for i in 0..free {
        inverse[i].copy_from_slice(&mass[i][..free]);
    }
    if !dense::invert(inverse, free) {
        inverse.fill(f64::NAN);
    }
}

impl Plant {
    /// The balance of forces now. Sliding contacts have the level of their speed; those that stick what keeps their
    /// ends together.
    pub(super) fn endpoint(&self) -> Endpoint {
        let mut now = Endpoint::new();
        self.balance(&mut now);
        now
    }

    /// The same into a place that is there already.
    pub(super) fn balance(&self, now: &mut Endpoint) {
        let fixed = &self.fixed;
        let mut force = [0.0; SLOTS];
        let bias = self.links.as_ref().map_or(&NO_BIAS, |links| &links.bias);
        let prescribed = GROUND - fixed.prescribed;
        for i in prescribed..GROUND {
            now.acceleration[i] = self.prescribed_acceleration[i];
        }
        for i in 0..fixed.free {
            let (stiffness, damping, mass) = (&fixed.stiffness[i], &fixed.damping[i], &fixed.mass[i]);
            let mut f = fixed.constant[i] + self.pushed[i];
            for j in (0..fixed.free).chain(prescribed..GROUND) {
                f -= stiffness[j] * self.x[j] + damping[j] * self.v[j];
            }
            for j in prescribed..GROUND {
                f -= mass[j] * self.prescribed_acceleration[j];
            }
            force[i] = f - bias[i];
        }
        for i in fixed.points.places() {
            force[i] = self.pushed[i];
        }
        for (path, f) in self.paths.iter().zip(&mut now.path) {
            let (first, second) = (path.first, path.second);
            *f = path.law.force(&path.memory, self.x[first] - self.x[second], self.v[first] - self.v[second]);
            force[first] -= *f;
            force[second] += *f;
        }
        for (contact, f) in self.frictions.iter().zip(&mut now.friction) {
            let load = contact.joint.load(&self.x, |path| now.path[path]);
            *f = contact.force_at(self.v[contact.first] - self.v[contact.second], load);
            force[contact.first] -= *f;
            force[contact.second] += *f;
        }
        fixed.points.pass_on(&mut force);
        if self.links.is_none() {
            self.accelerate(&fixed.inverse_mass, &force, &mut now.acceleration);
            self.hold_sticking(&fixed.inverse_mass, now);
            return;
        }
        let mut of_pose = std::mem::take(&mut now.inverse);
        invert(&mut of_pose, &fixed.mass, fixed.free);
        self.accelerate(&of_pose, &force, &mut now.acceleration);
        self.hold_sticking(&of_pose, now);
        now.inverse = of_pose;
    }

    fn accelerate(&self, inverse_mass: &Columns, force: &Slots, acceleration: &mut Slots) {
        for i in 0..self.fixed.free {
            acceleration[i] = (0..self.fixed.free).map(|j| inverse_mass[j][i] * force[j]).sum();
        }
        self.fixed.points.carry_acceleration(acceleration);
    }

    /// Gauss-Seidel over the sticking contacts: no relative acceleration, within the level at rest.
    fn hold_sticking(&self, inverse_mass: &Columns, now: &mut Endpoint) {
        let (free, points) = (self.fixed.free, &self.fixed.points);
        for _ in 0..SWEEPS {
            let mut settled = true;
            for (contact, f) in self.frictions.iter().zip(&mut now.friction).filter(|(contact, _)| contact.mode == 0) {
                let (a, b) = (contact.first, contact.second);
                let (from_a, from_b) = (points.respond(inverse_mass, free, a), points.respond(inverse_mass, free, b));
                let seen = |answer: &Slots, place: usize| points.seen(answer, free, place);
                let own = seen(&from_a, a) + seen(&from_b, b) - seen(&from_b, a) - seen(&from_a, b);
                if own <= 0.0 {
                    continue;
                }
                let relative = now.acceleration[a] - now.acceleration[b];
                let Bounds { low, high } = contact.bounds_at_rest(contact.joint.load(&self.x, |path| now.path[path]));
                let wanted = (*f + relative / own).min(high).max(low);
                let change = wanted - *f;
                if change.abs() > 1e-13 * (high - low) {
                    settled = false;
                }
                *f = wanted;
                for i in 0..free {
                    now.acceleration[i] -= (from_a[i] - from_b[i]) * change;
                }
                points.carry_acceleration(&mut now.acceleration);
            }
            if settled {
                return;
            }
        }
    }

    /// Force of an element that needs no accelerations, N: one along a path, a linear one that is no inerter. `None` of all others.
    #[inline]
    pub(super) fn force_without_balance(&self, element: usize) -> Option<f64> {
        let across = |q: &Slots, first: usize, second: usize| q[first] - q[second];
        match self.fixed.elements.get(element)? {
            Share::Path(path) => self.paths.get(*path).map(|path| {
                let (x, v) = (across(&self.x, path.first, path.second), across(&self.v, path.first, path.second));
                path.law.force(&path.memory, x, v)
            }),
            Share::Linear(linear, a, b) if linear.inertance == 0.0 => {
                Some(linear.force + linear.stiffness * across(&self.x, *a, *b) + linear.damping * across(&self.v, *a, *b))
            }
            Share::Linear(..) | Share::Friction(_) => None,
        }
    }

    /// Force of an element, N; not a number when there is no such element.
    pub(super) fn force_at(&self, element: usize, now: &Endpoint) -> f64 {
        match self.fixed.elements.get(element) {
            None => f64::NAN,
            Some(Share::Friction(c)) => now.friction[*c],
            Some(Share::Path(p)) => now.path[*p],
            Some(Share::Linear(linear, a, b)) => {
                let across = |q: &Slots| q[*a] - q[*b];
                linear.force
                    + linear.stiffness * across(&self.x)
                    + linear.damping * across(&self.v)
                    + linear.inertance * across(&now.acceleration)
            }
        }
    }

    /// What the mover of a prescribed body has to do, N.
    pub(super) fn reaction_at(&self, slot: usize, now: &Endpoint) -> f64 {
        if slot < self.fixed.free {
            return 0.0;
        }
        let fixed = &self.fixed;
        let bias = self.links.as_ref().map_or(0.0, |links| links.bias[slot]);
        let mut reaction = bias - fixed.constant[slot] - self.pushed[slot];
        for j in (0..fixed.free).chain(GROUND - fixed.prescribed..GROUND) {
            reaction +=
                fixed.mass[slot][j] * now.acceleration[j] + fixed.damping[slot][j] * self.v[j] + fixed.stiffness[slot][j] * self.x[j];
        }
        let frictions = self.frictions.iter().zip(&now.friction).map(|(c, f)| (c.first, c.second, *f));
        for (first, second, f) in frictions.chain(self.paths.iter().zip(&now.path).map(|(p, f)| (p.first, p.second, *f))) {
            if first != second {
                reaction += f * fixed.points.share(first, slot) - f * fixed.points.share(second, slot);
            }
        }
        for point in fixed.points.places() {
            reaction -= fixed.points.share(point, slot) * self.pushed[point];
        }
        reaction
    }
}
