//! The parameters of a servo joint: what each is, its unit, its limits, and the value at which it does nothing.

/// A number of a servo joint. Forces are those of the joint over the servo's proportional gain, so they are angles (rad).
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
#[repr(usize)]
#[allow(missing_docs, reason = "FACTS describes each")]
pub enum Number {
    Delay,
    Inertia,
    Damping,
    Gain,
    Offset,
    Friction,
    LoadFriction,
    Stribeck,
    StribeckSpeed,
    DeadBand,
    Limit,
    Speed,
    Acceleration,
    Play,
    Gravity,
    MomentCos,
    MomentSin,
    Integral,
    Lead,
    QuadraticDamping,
}

/// How many there are.
pub const COUNT: usize = 20;

/// What a number is.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Facts {
    /// The number.
    pub number: Number,
    /// Its key in a model file.
    pub key: &'static str,
    /// Its unit.
    pub unit: &'static str,
    /// Its least and its largest value.
    pub range: [f64; 2],
    /// The value at which it does nothing.
    pub nothing: f64,
    /// The size of a usual change.
    pub scale: f64,
}

const fn facts(number: Number, key: &'static str, unit: &'static str, range: [f64; 2], nothing: f64, scale: f64) -> Facts {
    Facts { number, key, unit, range, nothing, scale }
}

const FAR: f64 = 1e9;

/// All of them, in the order of [`Number`].
pub const FACTS: [Facts; COUNT] = [
    facts(Number::Delay, "delay", "s", [-0.1, 1.0], 0.0, 0.01),
    facts(Number::Inertia, "inertia", "s^2", [1e-6, 1.0], 1e-6, 1e-3),
    facts(Number::Damping, "damping", "s", [1e-4, 10.0], 1e-4, 0.02),
    facts(Number::Gain, "ratio", "-", [-10.0, 10.0], 1.0, 0.02),
    facts(Number::Offset, "offset", "rad", [-3.0, 3.0], 0.0, 0.01),
    facts(Number::Friction, "friction", "rad", [0.0, 3.0], 0.0, 0.01),
    facts(Number::LoadFriction, "load_friction", "-", [0.0, 10.0], 0.0, 0.05),
    facts(Number::Stribeck, "friction_at_rest", "rad", [0.0, 3.0], 0.0, 0.01),
    facts(Number::StribeckSpeed, "stribeck_speed", "rad/s", [0.005, 10.0], 0.1, 0.05),
    facts(Number::DeadBand, "dead_band", "rad", [0.0, 1.0], 0.0, 0.005),
    facts(Number::Limit, "limit", "rad", [1e-3, FAR], FAR, 0.1),
    facts(Number::Speed, "speed", "rad/s", [1e-3, FAR], FAR, 0.5),
    facts(Number::Acceleration, "acceleration", "rad/s^2", [1e-2, FAR], FAR, 5.0),
    facts(Number::Play, "play", "rad", [0.0, 1.0], 0.0, 0.005),
    facts(Number::Gravity, "gravity", "rad/(N m)", [-10.0, 10.0], 0.0, 0.05),
    facts(Number::MomentCos, "moment_cos", "rad", [-3.0, 3.0], 0.0, 0.02),
    facts(Number::MomentSin, "moment_sin", "rad", [-3.0, 3.0], 0.0, 0.02),
    facts(Number::Integral, "integral", "1/s", [0.0, 100.0], 0.0, 0.3),
    facts(Number::Lead, "lead", "s", [-1.0, 1.0], 0.0, 0.01),
    facts(Number::QuadraticDamping, "drag", "s^2/rad", [0.0, 10.0], 0.0, 0.01),
];

/// The parameters of a servo joint.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Numbers(pub [f64; COUNT]);

impl Default for Numbers {
    fn default() -> Numbers {
        Numbers(FACTS.map(|f| f.nothing))
    }
}

impl std::ops::Index<Number> for Numbers {
    type Output = f64;
    fn index(&self, n: Number) -> &f64 {
        &self.0[n as usize]
    }
}

impl std::ops::IndexMut<Number> for Numbers {
    fn index_mut(&mut self, n: Number) -> &mut f64 {
        &mut self.0[n as usize]
    }
}

impl Number {
    /// What it is.
    pub fn facts(self) -> &'static Facts {
        &FACTS[self as usize]
    }
}
