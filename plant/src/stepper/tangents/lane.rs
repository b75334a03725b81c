//! A parameter's lane.

use crate::elements::Linear;
use crate::model::Model;
use crate::stepper::compiled::Share;
use crate::stepper::slots::{GROUND, SLOTS};
use crate::stepper::state::Plant;

/// One number for each lane.
pub(super) type Across<const W: usize> = [f64; W];

/// What a parameter's step changes of the linear elements between two places.
#[derive(Debug, Clone)]
pub(super) struct Change {
    pub(super) first: usize,
    pub(super) second: usize,
    pub(super) by: Linear,
}

/// A parameter.
#[derive(Debug, Clone)]
pub(super) struct Lane {
    /// The model a step further. Its elements remember what they would there.
    pub(super) moved: Plant,
    /// The step, in the parameter's unit.
    pub(super) step: f64,
    pub(super) linear: Vec<Change>,
    /// For each path element, whether the step leaves its law unchanged.
    pub(super) shares: Vec<bool>,
}

impl Lane {
    pub(super) fn new(plant: &Plant, model: &Model, changed: &Model, mut moved: Plant, step: f64) -> Option<Lane> {
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

/// A quantity between two places.
#[inline(always)]
pub(super) fn between<const W: usize>(of: &[Across<W>; SLOTS], first: usize, second: usize, lane: usize) -> f64 {
    of[first][lane] - of[second][lane]
}
