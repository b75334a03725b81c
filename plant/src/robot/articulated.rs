//! Inertia of an articulated body (RBDA, chapter 7): what a body weighs, felt at it, when the joints beyond give way.

use super::inertia::Inertia;
use super::spatial::{Placement, Twist, Wrench};
use nalgebra::Matrix3;
use std::ops::AddAssign;

/// A symmetric matrix of six by six that makes a force of an acceleration, in blocks.
#[derive(Debug, Clone, Copy)]
pub(super) struct ArticulatedInertia {
    /// Moment from angular acceleration, kg m².
    rotational: Matrix3<f64>,
    /// Moment from linear acceleration, kg m; its transpose makes force from angular acceleration.
    coupling: Matrix3<f64>,
    /// Force from linear acceleration, kg.
    mass: Matrix3<f64>,
}

impl ArticulatedInertia {
    pub(super) fn zero() -> ArticulatedInertia {
        ArticulatedInertia { rotational: Matrix3::zeros(), coupling: Matrix3::zeros(), mass: Matrix3::zeros() }
    }

    /// Of a body by itself.
    #[inline]
    pub(super) fn of(body: &Inertia) -> ArticulatedInertia {
        ArticulatedInertia {
            rotational: body.rotational,
            coupling: body.first_moment.cross_matrix(),
            mass: Matrix3::from_diagonal_element(body.mass),
        }
    }

    #[inline]
    pub(super) fn times(&self, twist: &Twist) -> Wrench {
        Wrench {
            moment: self.rotational * twist.angular + self.coupling * twist.linear,
            force: self.coupling.tr_mul(&twist.angular) + self.mass * twist.linear,
        }
    }

    /// Less `u uᵀ / d`: what a joint that gives way takes off.
    #[inline]
    pub(super) fn give_way(&mut self, u: &Wrench, d: f64) {
        let by = 1.0 / d;
        self.rotational -= u.moment * u.moment.transpose() * by;
        self.coupling -= u.moment * u.force.transpose() * by;
        self.mass -= u.force * u.force.transpose() * by;
    }

    /// The same seen from the frame in which this one is at `placement`.
    #[inline]
    pub(super) fn outside(&self, placement: &Placement) -> ArticulatedInertia {
        let Placement { rotation, translation } = placement;
        let turn = |block: &Matrix3<f64>| rotation * block * rotation.transpose();
        let (rotational, turned, mass) = (turn(&self.rotational), turn(&self.coupling), turn(&self.mass));
        let r = translation.cross_matrix();
        let coupling = turned + r * mass;
        ArticulatedInertia { rotational: rotational - turned * r + r * coupling.transpose(), coupling, mass }
    }
}

impl AddAssign for ArticulatedInertia {
    fn add_assign(&mut self, other: ArticulatedInertia) {
        self.rotational += other.rotational;
        self.coupling += other.coupling;
        self.mass += other.mass;
    }
}
