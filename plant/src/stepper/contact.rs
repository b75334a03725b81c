//! Dry friction at work.

use super::path::PathElement;
use super::slots::Slots;
use crate::elements::{Law, Rubbing, Side};

/// Between what a friction force may be, N.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct Bounds {
    pub(super) low: f64,
    pub(super) high: f64,
}

/// A friction contact.
#[derive(Debug, Clone)]
pub(super) struct FrictionContact {
    pub(super) first: usize,
    pub(super) second: usize,
    pub(super) law: Law,
    pub(super) memory: Vec<f64>,
    pub(super) joint: Joint,
    /// Between what its force may be, where that is always the same.
    pub(super) constant: Option<Bounds>,
    /// 0 while it sticks, else the direction in which it slides.
    pub(super) mode: i8,
    /// Multiplier over the last substep, N.
    pub(super) force: f64,
    /// Relative velocity before the last substep, m/s.
    pub(super) velocity_before: f64,
}

/// The joint that loads a contact, laid out so that its force resists motion of the contact forwards.
#[derive(Debug, Clone, Default)]
pub(super) struct Joint {
    pub(super) first: usize,
    pub(super) second: usize,
    /// Of its springs, N/m.
    pub(super) stiffness: f64,
    /// Of its springs without displacement, N.
    pub(super) force: f64,
    /// Index among the path elements, and which way round it lies.
    pub(super) paths: Vec<(usize, f64)>,
}

impl Joint {
    /// Its force at these positions, N; `of_path` gives that of a path element.
    #[inline]
    pub(super) fn load(&self, x: &Slots, of_path: impl Fn(usize) -> f64) -> f64 {
        let springs = self.stiffness * (x[self.first] - x[self.second]) + self.force;
        self.paths.iter().fold(springs, |sum, (path, sign)| sum + sign * of_path(*path))
    }
}

impl FrictionContact {
    /// At rest between two places, without load.
    pub(super) fn new(first: usize, second: usize, law: &Law) -> FrictionContact {
        let mut contact = FrictionContact {
            first,
            second,
            law: law.clone(),
            memory: vec![0.0; law.memory_len()],
            joint: Joint::default(),
            constant: None,
            mode: 0,
            force: 0.0,
            velocity_before: 0.0,
        };
        contact.constant = law.is_constant().then(|| contact.bounds_at_rest(0.0));
        contact
    }

    /// Back to rest.
    pub(super) fn reset(&mut self) {
        self.memory.fill(0.0);
        self.mode = 0;
        self.force = 0.0;
        self.velocity_before = 0.0;
    }

    /// Level in one direction, N; `speed` is `None` while it sticks.
    #[inline]
    pub(super) fn level(&self, side: Side, speed: Option<f64>, load: f64) -> f64 {
        self.law.level(&Rubbing { side, speed, load, memory: &self.memory })
    }

    /// Between what its force may be while it sticks.
    #[inline]
    pub(super) fn bounds_at_rest(&self, load: f64) -> Bounds {
        Bounds { low: -self.level(Side::Backwards, None, load), high: self.level(Side::Forwards, None, load) }
    }

    /// Between what its force may be over a substep that begins with relative velocity `v0` and has the bodies at `middle` in its middle.
    #[inline]
    pub(super) fn bounds(&self, v0: f64, middle: &Slots, paths: &[PathElement]) -> Bounds {
        if let Some(bounds) = self.constant {
            return bounds;
        }
        self.changing_bounds(v0, middle, paths)
    }

    fn changing_bounds(&self, v0: f64, middle: &Slots, paths: &[PathElement]) -> Bounds {
        let load = self.joint.load(middle, |path| paths[path].force);
        let mut bounds = self.bounds_at_rest(load);
        if self.mode != 0 {
            let mean = 1.5 * v0 - 0.5 * self.velocity_before;
            let v = if mean * f64::from(self.mode) < 0.0 { 0.0 } else { mean };
            if self.mode > 0 {
                bounds.high = self.level(Side::Forwards, Some(v), load);
            } else {
                bounds.low = -self.level(Side::Backwards, Some(v), load);
            }
        }
        bounds
    }

    /// Force at an instant while it slides at `v`; what it was over the last substep while it sticks.
    #[inline]
    pub(super) fn force_at(&self, v: f64, load: f64) -> f64 {
        match self.mode {
            1 => self.level(Side::Forwards, Some(v), load),
            -1 => -self.level(Side::Backwards, Some(v), load),
            _ => self.force,
        }
    }
}
