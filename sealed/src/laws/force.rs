//! What the integrator asks of a law.

/// One substep of an element's displacement, which laws with a memory follow.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Path {
    /// m, where the element stood when its memory was last carried on.
    pub from: f64,
    /// m, where it stands now.
    pub to: f64,
    /// m/s, its speed.
    pub speed: f64,
    /// s, the time in between.
    pub duration: f64,
}

/// What presses the surfaces of dry friction together.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Load<'a> {
    /// Nothing that changes.
    None,
    /// The force of the element of this name, whichever way round it lies.
    Element(&'a str),
    /// The transmitted force. For friction between two bodies it is that of the other elements between them. For a body's friction against ground it
    /// is that of the springs between it and the first other body that elements join it with. Where they join it with none, it is that of its springs
    /// to ground.
    Joint,
}

/// The three parts of a law that the integrator treats apart: what hangs on the path, what hangs on the speed and
/// is smooth, and dry friction, which is set-valued at rest.
pub trait ForceLaw: Send {
    /// How many numbers the law remembers. All are 0 in a device at rest that was never moved.
    fn memory(&self) -> usize {
        0
    }

    /// N, the part of the force that the path up to now sets. Carries the memory on to the end of the path.
    fn path_force(&self, _path: &Path, _memory: &mut [f64]) -> f64 {
        0.0
    }

    /// N s/m, the damping at displacement `x` (m) and speed `v` (m/s): the smooth force is this times `v`.
    fn damping(&self, _x: f64, _v: f64, _memory: &[f64]) -> f64 {
        0.0
    }

    /// N, the levels of dry friction against motion forwards and backwards at speed `v` (m/s) under the force `load` (N) that [`ForceLaw::load`]
    /// selects; of a joint it is positive where it resists motion forwards.
    fn dry(&self, _v: f64, _load: f64, _memory: &[f64]) -> [f64; 2] {
        [0.0, 0.0]
    }

    /// Whether the law has dry friction at all.
    fn is_dry(&self) -> bool {
        false
    }

    /// Carries on what friction itself changes (heat): `friction` (N) acted at speed `v` (m/s) for `duration` (s).
    fn after(&self, _friction: f64, _v: f64, _duration: f64, _memory: &mut [f64]) {}

    /// N/m, a bound of the slope of force over displacement, from which the substep is chosen.
    fn stiffness(&self) -> f64 {
        0.0
    }

    /// kg, the force per relative acceleration.
    fn inertance(&self) -> f64 {
        0.0
    }

    /// What presses the friction surfaces together.
    fn load(&self) -> Load<'_> {
        Load::None
    }
}
