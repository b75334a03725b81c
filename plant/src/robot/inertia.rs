//! Inertia of a rigid body (RBDA, section 2.13).

use super::spatial::{Placement, Twist, Wrench};
use nalgebra::{Matrix3, Vector3};
use std::ops::AddAssign;

/// Inertia of a rigid body about the origin of a frame.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Inertia {
    /// kg.
    pub mass: f64,
    /// Mass times the centre of mass, kg m.
    pub first_moment: Vector3<f64>,
    /// About the origin, along the frame's axes, kg m².
    pub rotational: Matrix3<f64>,
}

impl Default for Inertia {
    fn default() -> Inertia {
        Inertia { mass: 0.0, first_moment: Vector3::zeros(), rotational: Matrix3::zeros() }
    }
}

impl Inertia {
    /// Of a body of this mass, kg, with its centre of mass at `centre`, m, and inertia `about_centre`, kg m², along the axes of the frame.
    pub fn new(mass: f64, centre: Vector3<f64>, about_centre: Matrix3<f64>) -> Inertia {
        let c = centre.cross_matrix();
        Inertia { mass, first_moment: mass * centre, rotational: about_centre - mass * (c * c) }
    }

    /// The same body seen from the frame in which this one is at `placement`.
    #[inline]
    pub fn outside(&self, placement: &Placement) -> Inertia {
        let Placement { rotation, translation } = placement;
        let turned = rotation * self.first_moment;
        let first_moment = turned + self.mass * translation;
        let r = translation.cross_matrix();
        let rotational = rotation * self.rotational * rotation.transpose() - r * turned.cross_matrix() - first_moment.cross_matrix() * r;
        Inertia { mass: self.mass, first_moment, rotational }
    }

    /// Momentum at a velocity, kg m²/s and kg m/s; of an acceleration the force that makes it.
    #[inline]
    pub fn times(&self, twist: &Twist) -> Wrench {
        Wrench {
            moment: self.rotational * twist.angular + self.first_moment.cross(&twist.linear),
            force: self.mass * twist.linear - self.first_moment.cross(&twist.angular),
        }
    }
}

impl AddAssign for Inertia {
    fn add_assign(&mut self, other: Inertia) {
        self.mass += other.mass;
        self.first_moment += other.first_moment;
        self.rotational += other.rotational;
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use nalgebra::Rotation3;

    #[test]
    fn energy_is_the_same_in_every_frame() {
        let placement =
            Placement { rotation: *Rotation3::from_euler_angles(0.3, -0.8, 1.9).matrix(), translation: Vector3::new(0.2, -0.5, 0.7) };
        let body = Inertia::new(2.0, Vector3::new(0.1, 0.3, -0.2), Matrix3::new(0.3, 0.01, 0.02, 0.01, 0.4, -0.03, 0.02, -0.03, 0.5));
        let inside = Twist { angular: Vector3::new(1.0, 2.0, -0.5), linear: Vector3::new(0.3, -1.0, 0.2) };
        let outside = placement.twist_outside(&inside);
        let energy = inside.dot(&body.times(&inside));
        assert!((outside.dot(&body.outside(&placement).times(&outside)) - energy).abs() < 1e-13 * energy);
    }
}
