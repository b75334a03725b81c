//! Points of a robot's links at work: places whose motion is that of the joints.
//!
//! A point has a place of its own in the state arrays, behind the free bodies, and a row: the derivatives of its displacement by the bodies that are joints.
//! A force at the place is transmitted to the joints (`Jᵀ F`), and the motion of the joints gives that of the place (`J v`). Displacements are those of the
//! geometry, not the row times the joints': nothing drifts. Over a substep the row is that in its middle, so the work of a force on a point is that of its
//! joint forces, and forwards and backwards in time are the same.

use super::slots::{Columns, GROUND, SLOTS, Slots};

/// The points of a network; none without a robot.
#[derive(Debug, Clone, Default)]
pub(super) struct Points {
    /// Place of the first.
    first: usize,
    /// Place from which on bodies on motion inputs are.
    moved: usize,
    /// J, a row for each: m/rad or 1, by place of the joints.
    pub(super) rows: Vec<Slots>,
    /// `J̇ v` at the instant that was evaluated last, m/s².
    pub(super) drift: Vec<f64>,
}

impl Points {
    /// This number of points, from this place on, and of bodies on motion inputs.
    pub(super) fn new(first: usize, count: usize, prescribed: usize) -> Points {
        Points { first, moved: GROUND - prescribed, rows: vec![[0.0; SLOTS]; count], drift: vec![0.0; count] }
    }

    #[inline]
    pub(super) fn is_empty(&self) -> bool {
        self.rows.is_empty()
    }

    /// Their places.
    #[inline]
    pub(super) fn places(&self) -> std::ops::Range<usize> {
        self.first..self.first + self.rows.len()
    }

    /// Where the joints may be: the free bodies, and those on motion inputs.
    #[inline]
    fn joints(&self) -> [std::ops::Range<usize>; 2] {
        [0..self.first, self.moved..GROUND]
    }

    /// The row of a place that is a point.
    #[inline]
    pub(super) fn row(&self, slot: usize) -> Option<&Slots> {
        slot.checked_sub(self.first).and_then(|point| self.rows.get(point))
    }

    /// How the displacement of any place changes with that of the body at `slot`.
    #[inline]
    pub(super) fn share(&self, place: usize, slot: usize) -> f64 {
        match self.row(place) {
            Some(row) if place != slot => row[slot],
            _ => f64::from(u8::from(place == slot)),
        }
    }

    /// Passes forces on points on to the joints, and leaves them where they were: `Jᵀ F`.
    #[inline]
    pub(super) fn pass_on(&self, force: &mut Slots) {
        for (row, point) in self.rows.iter().zip(self.places()) {
            let pushed = force[point];
            if pushed != 0.0 {
                for joints in self.joints() {
                    for (force, share) in force[joints.clone()].iter_mut().zip(&row[joints]) {
                        *force += share * pushed;
                    }
                }
            }
        }
    }

    /// Velocities of points from those of the joints: `J v`.
    #[inline]
    pub(super) fn carry(&self, velocity: &mut Slots) {
        for (row, point) in self.rows.iter().zip(self.places()) {
            velocity[point] = self
                .joints()
                .into_iter()
                .flat_map(|joints| row[joints.clone()].iter().zip(&velocity[joints]))
                .map(|(share, v)| share * v)
                .sum();
        }
    }

    /// Accelerations of points from those of the joints: `J a + J̇ v`.
    pub(super) fn carry_acceleration(&self, acceleration: &mut Slots) {
        self.carry(acceleration);
        for (drift, point) in self.drift.iter().zip(self.places()) {
            acceleration[point] += drift;
        }
    }

    /// What a unit of force at any place does to the free bodies; `answer[j][i]` is what one at free body j does to free body i.
    pub(super) fn respond(&self, answer: &Columns, free: usize, place: usize) -> Slots {
        let mut response = [0.0; SLOTS];
        for j in 0..free {
            let share = self.share(place, j);
            if share != 0.0 {
                for i in 0..free {
                    response[i] += share * answer[j][i];
                }
            }
        }
        response
    }

    /// How much of the free bodies' motion any place has.
    pub(super) fn seen(&self, motion: &Slots, free: usize, place: usize) -> f64 {
        match self.row(place) {
            Some(row) => (0..free).map(|j| row[j] * motion[j]).sum(),
            None if place < free => motion[place],
            None => 0.0,
        }
    }
}
