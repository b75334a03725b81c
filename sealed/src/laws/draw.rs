//! Where a law is drawn as a hidden effect, and what the device does there.

/// A sort of place.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Draw {
    /// Dry friction of a body against ground, instead of Coulomb friction that the model states.
    Friction {
        /// Whether it needs a joint whose force loads it.
        loaded: bool,
    },
    /// Of a body against ground, beside friction.
    Body(StatedDamper),
    /// In a joint.
    Joint(InJoint),
}

/// What becomes of a damper that the model states at the same place.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum StatedDamper {
    /// It stays.
    Stays,
    /// The law would only be that damper with another number, so it is not drawn there.
    Refuses,
    /// The law takes its place.
    IsReplaced,
}

/// What becomes of the joint's own elements.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum InJoint {
    /// All stay.
    Beside,
    /// The law takes the place of the joint's spring.
    ForSpring,
    /// The law takes the place of the joint's spring and dampers.
    ForSpringAndDampers,
}

/// What the nominal device does at a place under its working force.
#[derive(Debug, Clone, PartialEq)]
pub(crate) enum Here {
    /// Of a body against ground.
    Body(AtBody),
    /// Of a joint.
    Joint(AtJoint),
}

/// Of a body against ground.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct AtBody {
    /// m, half of the range of its position.
    pub travel: f64,
    /// m/s, amplitude of its speed.
    pub speed: f64,
    /// N, amplitude of the force that moves it.
    pub force: f64,
    /// N, a level of dry friction that shows.
    pub friction: f64,
    /// kg.
    pub inertia: f64,
    /// N s/m, of the damper that is replaced.
    pub stated_damping: f64,
    /// The joint that loads it.
    pub joint: Option<Loading>,
}

/// A joint that loads friction.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Loading {
    /// Name of its spring.
    pub name: String,
    /// N, amplitude of its force; `None` where it has none.
    pub force: Option<f64>,
}

/// Of a joint.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct AtJoint {
    /// N/m, that the model states.
    pub stiffness: f64,
    /// N s/m, of the dampers that are replaced.
    pub damping: f64,
    /// m, half of the range of its stretch.
    pub stretch: f64,
    /// m/s, amplitude of the speed across it.
    pub speed: f64,
    /// N, amplitude of its force.
    pub force: f64,
    /// Share of the stiffness that the model's has absorbed of the effect: the joint's own is higher where a gap softens it, lower where it
    /// stiffens.
    pub absorbed: f64,
}
