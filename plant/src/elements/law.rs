//! What a law of force has to say for itself: one trait for linear laws, one for dry friction, one for all others.
//!
//! `x` in m and `v` in m/s are taken across the element; forces in N, positive when it is stretched. A memory holds what the
//! element remembers of its path or of its work; at rest all of it is zero.

use super::sine::Sine;

/// Coefficients of a linear element: `f = stiffness x + damping v + inertance dv/dt + force`.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Linear {
    /// N/m.
    pub stiffness: f64,
    /// N s/m.
    pub damping: f64,
    /// kg.
    pub inertance: f64,
    /// Force at `x = v = dv/dt = 0`, N.
    pub force: f64,
}

impl Linear {
    /// Force at `x`, m, and `v`, m/s, while the velocity does not change, N.
    #[inline]
    pub(super) fn at(&self, x: f64, v: f64) -> f64 {
        self.stiffness * x + self.damping * v + self.force
    }

    /// Energy that can be had back at `x`, m, less that at 0, J.
    pub(super) fn stored(&self, x: f64) -> f64 {
        (0.5 * self.stiffness * x + self.force) * x
    }

    /// Slopes of its force.
    pub(super) fn slopes(&self) -> Slopes {
        Slopes { stiffness: self.stiffness.abs(), damping: self.damping.abs(), bounded: true }
    }
}

/// A law that is part of the constant matrices.
pub trait LinearLaw {
    /// Its coefficients.
    fn coefficients(&self) -> Linear;
}

/// Against which motion dry friction acts.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Side {
    /// v > 0, or a push that way.
    Forwards,
    /// v < 0, or a push that way.
    Backwards,
}

impl Side {
    /// The direction of a speed; that of 0 counts as forwards.
    pub fn of(v: f64) -> Side {
        if v < 0.0 { Side::Backwards } else { Side::Forwards }
    }
}

/// Under what a friction contact rubs or sticks.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Rubbing<'a> {
    /// The direction whose level is wanted.
    pub side: Side,
    /// Sliding speed, m/s, with its sign; `None` while it sticks.
    pub speed: Option<f64>,
    /// Force of the joint that loads the contact, N (see [`crate::load`]): positive where it resists motion forwards. So `load * speed > 0` where the
    /// contact's bodies drive the joint, and below 0 where the joint drives them. 0 where nothing loads it.
    pub load: f64,
    /// The contact's memory.
    pub memory: &'a [f64],
}

/// Set-valued friction: while it slides its force is the level of that direction, while it sticks anything between the levels.
pub trait FrictionLaw {
    /// Level, N, at least 0.
    fn level(&self, at: &Rubbing) -> f64;

    /// Whether its levels are always the same, whatever the speed, the load and the memory.
    fn is_constant(&self) -> bool {
        false
    }

    /// Length of its memory, numbers.
    fn memory_len(&self) -> usize {
        0
    }

    /// Carries its memory on over `dt` seconds in which it took `work` (J, at least 0 but for rounding) out of its bodies. Only asked of a law
    /// with a memory.
    fn rubbed(&self, _memory: &mut [f64], _work: f64, _dt: f64) {}

    /// What it looks like to a sine: `harmonic::of_friction` works it out from the levels.
    fn linearised(&self, at: &Sine) -> Linear;
}

/// Largest slopes that an element shows, for the choice of step and of the solution method.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Slopes {
    /// Of force over displacement, N/m.
    pub stiffness: f64,
    /// Of force over velocity, N s/m.
    pub damping: f64,
    /// Whether these are bounds; else they are estimates for ordinary deflections and speeds.
    pub bounded: bool,
}

/// A force that depends on `x`, `v` and a memory of the path.
pub trait PathLaw {
    /// Largest slopes of its force.
    fn slopes(&self) -> Slopes;

    /// Force at `x` and `v` with the present memory.
    fn force(&self, memory: &[f64], x: f64, v: f64) -> f64;

    /// Energy that can be had back, J.
    fn stored(&self, memory: &[f64], x: f64) -> f64;

    /// What it looks like to a sine: `harmonic::of_path` works it out from the force.
    fn linearised(&self, at: &Sine) -> Linear;

    /// One sentence where cycles of this amplitude (in `unit`) create energy; `None` where none do.
    fn creates_energy(&self, amplitude: f64, unit: &str) -> Option<String>;

    /// Length of its memory, numbers.
    fn memory_len(&self) -> usize {
        0
    }

    /// Advances the memory along the straight path from `from` to `to`, which takes `dt` seconds.
    fn advance(&self, _memory: &mut [f64], _from: f64, _to: f64, _dt: f64) {}

    /// Mean force over the straight path from `from` to `to` at speed `v`, with the memory of its middle. Worth its own
    /// form where the force jumps on the way.
    fn mean_force(&self, memory: &[f64], from: f64, to: f64, v: f64) -> f64 {
        self.force(memory, 0.5 * (from + to), v)
    }

    /// Whether an evaluation takes far longer than the rest of a substep.
    fn is_costly(&self) -> bool {
        false
    }

    /// Whether its force is proportional to the preceding path, so that [`PathLaw::linearised`] is exact and depends on frequency alone.
    fn is_viscoelastic(&self) -> bool {
        false
    }

    /// Its bristles at speed `v`; `None` for a law without.
    fn bristles(&self, _memory: &[f64], _v: f64) -> Option<Bristles> {
        None
    }
}

/// Friction's bristles, `f = σ0 h + σ1 dz/dt` with `dz/dt = v - leak σ0 h`, as a controller estimates them.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Bristles {
    /// σ0 h, N or N m.
    pub force: f64,
    /// σ0, N/m or N m/rad.
    pub stiffness: f64,
    /// σ1, N s/m or N m s/rad.
    pub damping: f64,
    /// What lets them creep: the speed at which they creep back per bristle force, 1/(N s/m).
    pub leak: f64,
}
