//! Dry friction and stiff elements, solved together.
//!
//! Each constraint is a scalar law between its force f and the mean relative velocity of its ends, `u = w - Σ P f`. Here w is the velocity without
//! the constraint, and P = G A⁻¹ Gᵀ the compliance between constraints. Block Gauss-Seidel solves one law at a time exactly. Where friction contacts
//! share their load so closely that it converges slowly, those that stick are solved directly; where there are friction contacts alone that comes
//! first (`at_once.rs`).

use super::contact::{Bounds, FrictionContact};
use super::path::PathElement;
use super::points::Points;
use super::slots::{Columns, MAX_ELEMENTS, SLOTS, Slots};
use super::sticking::Sticking;

/// Sweeps before the sticking contacts are solved directly.
const SWEEPS: usize = 25;
/// The same where a robot's links couple all joints: there sweeps converge slowly, and fewer of them cost half as much in all.
const SWEEPS_OF_LINKS: usize = 6;
/// Direct solutions at most.
const ROUNDS: usize = 12;
/// Change of a force in a sweep, against its span, that counts as none.
const TOLERANCE: f64 = 1e-14;
/// The same for a law of the path, against the force that would stop its ends.
const TOLERANCE_OF_LAWS: f64 = 4e-12;
/// How exactly one law is solved, as a share of the velocities in it. Steep laws round their force more coarsely than a velocity, and sweeps go on
/// until forces change by less than a few times this.
const EXACT: f64 = 1e-12;
/// Elements whose force changes by more than this share per share of velocity are solved implicitly.
const STIFF: f64 = 0.1;
/// The same where slopes are only estimates.
const STIFF_UNBOUNDED: f64 = 0.01;
/// Above this the substep does not resolve the element. Its force is then taken at the end of the substep, not in the middle. This is first order,
/// but the work it does is never more than what it stored, so a stiff wall throws nothing back quicker than it came.
const UNRESOLVED: f64 = 1.0;
/// Evaluations of a law in one scalar solution.
const EVALUATIONS: usize = 60;

/// The constraints of a network at a given substep. Friction contacts come first.
#[derive(Debug, Clone, Default)]
pub(super) struct Constraints {
    /// Ends of each.
    ends: Vec<(usize, usize)>,
    /// Index among the path elements, of those that are no friction contacts.
    paths: Vec<usize>,
    /// How many are friction contacts.
    pub(super) frictions: usize,
    /// Sweeps before the sticking contacts are solved directly.
    sweeps: usize,
    /// P, row by row, m/s per N.
    compliance: Vec<f64>,
    /// How often it has changed.
    pub(super) changes: u64,
    /// A⁻¹ Gᵀ: change of the mean velocity of each free body per unit of each force, m/s per N.
    pub(super) response: Vec<Slots>,
}

/// Space for a solution.
#[derive(Debug, Clone)]
pub(super) struct Work {
    /// w, m/s: half the relative velocity at the end for friction, the mean for others, before any constraint acts.
    pub(super) base: [f64; MAX_ELEMENTS],
    pub(super) bounds: [Bounds; MAX_ELEMENTS],
    pub(super) force: [f64; MAX_ELEMENTS],
    /// Of contacts that stop: share of the substep until then, and force until then, N. Else (0, 0).
    pub(super) stop: [(f64, f64); MAX_ELEMENTS],
    /// Whether any contact stopped in the last substep; only then the three below are of it.
    pub(super) stopped: bool,
    /// The same as `stop`, kept.
    pub(super) shares: [(f64, f64); MAX_ELEMENTS],
    /// Forces and bounds before it was known that they stop.
    pub(super) first_force: [f64; MAX_ELEMENTS],
    pub(super) first_bounds: [Bounds; MAX_ELEMENTS],
    /// Always there between solutions.
    pub(super) sticking: Option<Box<Sticking>>,
}

impl Work {
    /// `frictions`: how many of the constraints are friction contacts.
    pub(super) fn new(frictions: usize) -> Work {
        Work {
            base: [0.0; MAX_ELEMENTS],
            bounds: [Bounds::default(); MAX_ELEMENTS],
            force: [0.0; MAX_ELEMENTS],
            stop: [(0.0, 0.0); MAX_ELEMENTS],
            stopped: false,
            shares: [(0.0, 0.0); MAX_ELEMENTS],
            first_force: [0.0; MAX_ELEMENTS],
            first_bounds: [Bounds::default(); MAX_ELEMENTS],
            sticking: Some(Box::new(Sticking::new(frictions))),
        }
    }
}

impl Constraints {
    /// Lists the friction contacts and those path elements that are too stiff for the substep; the latter are informed of it. `from_forces` are what the
    /// bodies answer to forces, and how their points move: first as they begin, then as they may come to answer where that changes on the way.
    pub(super) fn new(
        from_forces: &[(Columns, Points)],
        free: usize,
        substep: f64,
        frictions: &[FrictionContact],
        paths: &mut [PathElement],
    ) -> Constraints {
        let sweeps = if from_forces.len() > 1 { SWEEPS_OF_LINKS } else { SWEEPS };
        let mut all = Constraints { frictions: frictions.len(), sweeps, ..Constraints::default() };
        for contact in frictions {
            all.ends.push((contact.first, contact.second));
        }
        // Several in one place add up: all that stay explicit must be stable together.
        let stiff = STIFF.min(0.5 / paths.len().max(1) as f64);
        for (index, path) in paths.iter_mut().enumerate() {
            let ends = (path.first, path.second);
            let slopes = path.law.slopes();
            let most = from_forces
                .iter()
                .fold(0.0, |most: f64, (columns, points)| most.max(across(points, ends, free, &respond(columns, points, free, ends))));
            let stiffness = most * (0.5 * substep * slopes.stiffness + slopes.damping);
            if stiffness > if slopes.bounded { stiff } else { STIFF_UNBOUNDED } {
                path.constraint = Some(all.ends.len());
                path.unresolved = stiffness > if slopes.bounded { UNRESOLVED } else { STIFF };
                path.ahead = if path.unresolved { substep } else { 0.5 * substep };
                all.paths.push(index);
                all.ends.push(ends);
            }
        }
        all.response = vec![[0.0; SLOTS]; all.ends.len()];
        all.compliance = vec![0.0; all.ends.len() * all.ends.len()];
        if let Some((now, points)) = from_forces.first() {
            all.answer_by(now, free, points);
        }
        all
    }

    /// What the bodies answer to forces is now this.
    pub(super) fn answer_by(&mut self, from_force: &Columns, free: usize, points: &Points) {
        for (response, ends) in self.response.iter_mut().zip(&self.ends) {
            *response = respond(from_force, points, free, *ends);
        }
        self.changes += 1;
        let count = self.ends.len();
        for (c, ends) in self.ends.iter().enumerate() {
            for (d, response) in self.response.iter().enumerate() {
                self.compliance[c * count + d] = across(points, *ends, free, response);
            }
        }
    }

    #[inline]
    pub(super) fn len(&self) -> usize {
        self.ends.len()
    }

    #[inline]
    pub(super) fn own_compliance(&self, c: usize) -> f64 {
        self.compliance[c * self.ends.len() + c]
    }

    /// Mean velocity that a unit of the force of constraint `d` takes from across constraint `c`, m/s per N.
    #[inline]
    pub(super) fn compliance(&self, c: usize, d: usize) -> f64 {
        self.compliance[c * self.ends.len() + d]
    }

    /// The places of a constraint's ends.
    #[inline]
    pub(super) fn ends(&self, c: usize) -> (usize, usize) {
        self.ends[c]
    }

    /// Index among the path elements; `None` of a friction contact.
    #[inline]
    pub(super) fn path(&self, c: usize) -> Option<usize> {
        c.checked_sub(self.frictions).and_then(|p| self.paths.get(p)).copied()
    }

    /// Relative velocity of a constraint's ends.
    #[inline]
    pub(super) fn across(&self, c: usize, velocity: &Slots) -> f64 {
        let (first, second) = self.ends[c];
        velocity[first] - velocity[second]
    }

    /// Mean velocity across constraint `c` under the forces so far (for friction: half that at the end), m/s.
    #[inline]
    pub(super) fn velocity(&self, c: usize, work: &Work) -> f64 {
        let count = self.ends.len();
        let row = &self.compliance[c * count..(c + 1) * count];
        row.iter().zip(&work.force).fold(work.base[c], |u, (p, f)| u - p * f)
    }

    /// One law solved for the others as they are; returns the change of its force.
    #[inline]
    fn relax(&self, c: usize, work: &mut Work, paths: &mut [PathElement]) -> f64 {
        let before = work.force[c];
        let u = self.velocity(c, work);
        let own = self.own_compliance(c);
        if c < self.frictions {
            let Bounds { low, high } = work.bounds[c];
            work.force[c] = if own > 0.0 {
                (before + u / own).min(high).max(low)
            } else if u > 0.0 {
                high
            } else if u < 0.0 {
                low
            } else {
                before.min(high).max(low)
            };
        } else if let Some(path) = self.paths.get(c - self.frictions).and_then(|p| paths.get_mut(*p)) {
            work.force[c] = solve_law(path, u + own * before, own, before);
        }
        work.force[c] - before
    }

    /// Solves all laws at once. `work.force` holds the start and then the solution.
    #[inline]
    pub(super) fn solve(&self, work: &mut Work, paths: &mut [PathElement]) {
        let count = self.ends.len();
        if count == 1 {
            self.relax(0, work, paths);
            return;
        }
        if count == self.frictions && self.solve_contacts(work) {
            return;
        }
        for _ in 0..ROUNDS {
            for _ in 0..self.sweeps {
                let mut settled = true;
                for c in 0..count {
                    let change = self.relax(c, work, paths).abs();
                    settled &= change <= self.tolerance(c, work, paths);
                }
                if settled {
                    return;
                }
            }
            self.make_stick(work);
        }
    }

    /// Change of a constraint's force in a sweep that counts as none, N.
    #[inline]
    fn tolerance(&self, c: usize, work: &Work, paths: &[PathElement]) -> f64 {
        if c < self.frictions {
            return TOLERANCE * (work.bounds[c].high - work.bounds[c].low);
        }
        let own = self.own_compliance(c);
        if own <= 0.0 {
            return TOLERANCE_OF_LAWS * work.force[c].abs();
        }
        let unknown = self.paths.get(c - self.frictions).and_then(|p| paths.get(*p)).map_or(0.0, PathElement::rounding);
        TOLERANCE_OF_LAWS * (work.force[c].abs() + work.base[c].abs() / own) + 4.0 * unknown / own
    }
}

/// What a unit of a constraint's force takes from the velocities of the free bodies.
fn respond(from_force: &Columns, points: &Points, free: usize, (first, second): (usize, usize)) -> Slots {
    if !points.is_empty() {
        let (mut response, other) = (points.respond(from_force, free, first), points.respond(from_force, free, second));
        response.iter_mut().zip(other).for_each(|(value, other)| *value -= other);
        return response;
    }
    let weight = |slot: usize, i: usize| if slot < free { from_force[slot][i] } else { 0.0 };
    let mut response = [0.0; SLOTS];
    for (i, value) in response.iter_mut().enumerate().take(free) {
        *value = weight(first, i) - weight(second, i);
    }
    response
}

/// What of velocities of free bodies is seen across two places.
fn across(points: &Points, (first, second): (usize, usize), free: usize, velocity: &Slots) -> f64 {
    points.seen(velocity, free, first) - points.seen(velocity, free, second)
}

impl PathElement {
    /// What rounding of its displacement leaves unknown of its mean velocity over a substep, m/s.
    #[inline]
    fn rounding(&self) -> f64 {
        f64::EPSILON * self.reached.abs() / self.ahead
    }
}

/// Force of a path element over a substep whose mean relative velocity is `u`.
#[inline]
pub(super) fn trial_force(path: &mut PathElement, u: f64) -> f64 {
    let ahead = path.reached + path.ahead * u;
    // Most have one number, which is quicker copied than asked for its length.
    match (&mut path.trial[..], &path.memory[..]) {
        ([trial], [memory]) => *trial = *memory,
        (trial, memory) => trial.copy_from_slice(memory),
    }
    path.law.advance(&mut path.trial, path.reached, ahead, path.ahead);
    if path.unresolved {
        path.law.force(&path.trial, ahead, u)
    } else {
        path.law.mean_force(&path.trial, path.reached, 2.0 * ahead - path.reached, u)
    }
}

/// Solves `u + own f(u) = w` for f, starting from the force `start`: secant steps kept inside a bracket. The left side
/// rises with u for every law that does not push back harder the slower it is pushed.
fn solve_law(path: &mut PathElement, w: f64, own: f64, start: f64) -> f64 {
    if own <= 0.0 {
        return trial_force(path, w);
    }
    let mut best_force = start;
    let unknown = path.rounding();
    let rise = path.rise;
    let mut excess = |u: f64, best: &mut f64| {
        *best = trial_force(path, u);
        u + own * *best - w
    };
    let scale = EXACT * (w.abs() + own * start.abs()) + unknown;
    let mut a = w - own * start;
    let mut at_a = excess(a, &mut best_force);
    if at_a.abs() <= scale {
        return best_force;
    }
    // The first step trusts the slope of the last solution, the next bracket the solution by widening.
    let mut b = a - at_a / rise;
    let mut at_b = excess(b, &mut best_force);
    let slope = (at_b - at_a) / (b - a);
    let mut reach = 1.0;
    let mut evaluations = 2;
    while at_a * at_b > 0.0 && evaluations < EVALUATIONS {
        if at_b.abs() <= scale {
            break;
        }
        let secant = if at_b == at_a { b - at_b } else { b - at_b * (b - a) / (at_b - at_a) };
        let step = (secant - b).abs().min(4.0 * reach * at_b.abs().max((b - a).abs()));
        reach *= 2.0;
        (a, at_a) = (b, at_b);
        b -= step.copysign(at_b);
        at_b = excess(b, &mut best_force);
        evaluations += 1;
    }
    // Illinois: the stale end's value is halved so that both ends close in.
    while evaluations < EVALUATIONS && at_b.abs() > scale && (b - a).abs() > EXACT * (a.abs() + b.abs()) + unknown {
        let next = b - at_b * (b - a) / (at_b - at_a);
        let value = excess(next, &mut best_force);
        if value * at_b < 0.0 {
            (a, at_a) = (b, at_b);
        } else {
            at_a *= 0.5;
        }
        (b, at_b) = (next, value);
        evaluations += 1;
    }
    path.rise = if (0.5..1e6).contains(&slope) { slope } else { 1.0 };
    best_force
}
