//! A mass with a damper that stands for a slave that follows positions: forces move it, and where it is the slave shall be.

/// A mass on a damper to the ground, stepped by the implicit Euler method: it never creates energy, whatever the step.
#[derive(Debug, Clone)]
pub(super) struct Proxy {
    mass: f64,
    damping: f64,
    /// m or rad.
    pub position: f64,
    /// m/s or rad/s.
    pub velocity: f64,
}

impl Proxy {
    /// At rest at 0. `mass` in kg or kg m2, `damping` in N s/m or N m s/rad.
    pub fn new(mass: f64, damping: f64) -> Proxy {
        Proxy { mass, damping, position: 0.0, velocity: 0.0 }
    }

    /// (a, c) of the velocity at the end of a step in which a force acts: a + c force.
    pub fn answer(&self, period_s: f64) -> (f64, f64) {
        let inertia = self.mass + period_s * self.damping;
        (self.mass * self.velocity / inertia, period_s / inertia)
    }

    /// Kinetic energy, J.
    pub fn energy(&self) -> f64 {
        0.5 * self.mass * self.velocity * self.velocity
    }

    /// Moves it by a step under a force, N or N m.
    pub fn advance(&mut self, force: f64, period_s: f64) {
        let (a, c) = self.answer(period_s);
        self.velocity = a + c * force;
        self.position += period_s * self.velocity;
    }
}
