//! Spatial vectors: velocities and forces of a body in six dimensions, and how frames lie in each other (RBDA, chapter 2).

use nalgebra::{Matrix3, Vector3};
use std::ops::{Add, AddAssign, Mul, Neg, Sub};

/// Where a frame is in another: a point at `p` in it is at `rotation p + translation` in the other.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Placement {
    /// Columns are the frame's axes, seen from the other.
    pub rotation: Matrix3<f64>,
    /// The frame's origin, seen from the other, m.
    pub translation: Vector3<f64>,
}

impl Default for Placement {
    fn default() -> Placement {
        Placement { rotation: Matrix3::identity(), translation: Vector3::zeros() }
    }
}

impl Placement {
    /// Shifted by `translation`, m.
    pub fn at(translation: Vector3<f64>) -> Placement {
        Placement { rotation: Matrix3::identity(), translation }
    }

    /// A frame that is `inner` in this one, seen from where this one is seen from.
    pub fn then(&self, inner: &Placement) -> Placement {
        Placement { rotation: self.rotation * inner.rotation, translation: self.point(&inner.translation) }
    }

    /// The other frame, seen from this one.
    pub fn inverse(&self) -> Placement {
        let rotation = self.rotation.transpose();
        Placement { rotation, translation: -(rotation * self.translation) }
    }

    /// A point of this frame, seen from the other, m.
    pub fn point(&self, p: &Vector3<f64>) -> Vector3<f64> {
        self.rotation * p + self.translation
    }

    /// A velocity that is given in the other frame, at its origin, in this one, at the origin of this one.
    #[inline]
    pub fn twist_inside(&self, twist: &Twist) -> Twist {
        let linear = twist.linear + twist.angular.cross(&self.translation);
        Twist { angular: self.rotation.tr_mul(&twist.angular), linear: self.rotation.tr_mul(&linear) }
    }

    /// A velocity that is given in this frame, at its origin, in the other, at the origin of the other.
    #[inline]
    pub fn twist_outside(&self, twist: &Twist) -> Twist {
        let angular = self.rotation * twist.angular;
        Twist { angular, linear: self.rotation * twist.linear - angular.cross(&self.translation) }
    }

    /// A force that is given in this frame, about its origin, in the other, about the origin of the other.
    #[inline]
    pub fn wrench_outside(&self, wrench: &Wrench) -> Wrench {
        let force = self.rotation * wrench.force;
        Wrench { moment: self.rotation * wrench.moment + self.translation.cross(&force), force }
    }
}

/// Velocity of a body: how it turns, and how the point of it moves that is at the origin of the frame it is given in. Accelerations have the same form.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Twist {
    /// rad/s.
    pub angular: Vector3<f64>,
    /// m/s.
    pub linear: Vector3<f64>,
}

impl Twist {
    /// `self ×` of a motion: how `other` changes, that is carried along with this velocity (RBDA, section 2.9).
    #[inline]
    pub fn cross(&self, other: &Twist) -> Twist {
        Twist { angular: self.angular.cross(&other.angular), linear: self.angular.cross(&other.linear) + self.linear.cross(&other.angular) }
    }

    /// `self ×*` of a force: how `wrench` changes, that is carried along with this velocity (RBDA, section 2.9).
    #[inline]
    pub fn cross_force(&self, wrench: &Wrench) -> Wrench {
        Wrench { moment: self.angular.cross(&wrench.moment) + self.linear.cross(&wrench.force), force: self.angular.cross(&wrench.force) }
    }

    /// Power of a force at this velocity, W.
    #[inline]
    pub fn dot(&self, wrench: &Wrench) -> f64 {
        self.angular.dot(&wrench.moment) + self.linear.dot(&wrench.force)
    }
}

impl Add for Twist {
    type Output = Twist;
    fn add(self, other: Twist) -> Twist {
        Twist { angular: self.angular + other.angular, linear: self.linear + other.linear }
    }
}

impl Sub for Twist {
    type Output = Twist;
    fn sub(self, other: Twist) -> Twist {
        Twist { angular: self.angular - other.angular, linear: self.linear - other.linear }
    }
}

impl Mul<f64> for Twist {
    type Output = Twist;
    fn mul(self, by: f64) -> Twist {
        Twist { angular: self.angular * by, linear: self.linear * by }
    }
}

/// Force on a body: its moment about the origin of the frame it is given in, and the force.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Wrench {
    /// N m.
    pub moment: Vector3<f64>,
    /// N.
    pub force: Vector3<f64>,
}

impl Add for Wrench {
    type Output = Wrench;
    fn add(self, other: Wrench) -> Wrench {
        Wrench { moment: self.moment + other.moment, force: self.force + other.force }
    }
}

impl AddAssign for Wrench {
    fn add_assign(&mut self, other: Wrench) {
        *self = *self + other;
    }
}

impl Mul<f64> for Wrench {
    type Output = Wrench;
    fn mul(self, by: f64) -> Wrench {
        Wrench { moment: self.moment * by, force: self.force * by }
    }
}

impl Neg for Wrench {
    type Output = Wrench;
    fn neg(self) -> Wrench {
        Wrench { moment: -self.moment, force: -self.force }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use nalgebra::Rotation3;

    fn placement() -> Placement {
        Placement { rotation: *Rotation3::from_euler_angles(0.3, -0.8, 1.9).matrix(), translation: Vector3::new(0.2, -0.5, 0.7) }
    }

    #[test]
    fn power_is_the_same_in_every_frame() {
        let inside = Twist { angular: Vector3::new(1.0, 2.0, -0.5), linear: Vector3::new(0.3, -1.0, 0.2) };
        let wrench = Wrench { moment: Vector3::new(-0.4, 0.9, 2.0), force: Vector3::new(3.0, -2.0, 0.1) };
        let outside = placement().twist_outside(&inside);
        assert!((outside.dot(&placement().wrench_outside(&wrench)) - inside.dot(&wrench)).abs() < 1e-13);
        let back = placement().twist_inside(&outside) - inside;
        assert!(back.angular.norm() < 1e-14 && back.linear.norm() < 1e-14);
    }

    #[test]
    fn a_placement_and_its_inverse_are_nothing() {
        let none = placement().then(&placement().inverse());
        assert!((none.rotation - Matrix3::identity()).norm() < 1e-14 && none.translation.norm() < 1e-14);
    }

    #[test]
    fn what_is_carried_along_does_no_work_by_itself() {
        // (v × m) · f = -m · (v ×* f).
        let v = Twist { angular: Vector3::new(1.0, 2.0, -0.5), linear: Vector3::new(0.3, -1.0, 0.2) };
        let m = Twist { angular: Vector3::new(-0.7, 0.2, 0.5), linear: Vector3::new(1.3, 0.4, -0.9) };
        let f = Wrench { moment: Vector3::new(-0.4, 0.9, 2.0), force: Vector3::new(3.0, -2.0, 0.1) };
        assert!((v.cross(&m).dot(&f) + m.dot(&v.cross_force(&f))).abs() < 1e-13);
    }
}
