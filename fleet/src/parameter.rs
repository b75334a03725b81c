//! The parameters that a triage estimates of each joint: their names in the table, in words, and their units.

/// A parameter of a joint.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Parameter {
    /// Its column in the table; the column of its standard error ends in `_sd`.
    pub name: &'static str,
    /// In a sentence.
    pub words: &'static str,
    /// Its unit where torques were recorded.
    pub unit: &'static str,
    /// Its unit where commands and positions were recorded.
    pub servo_unit: &'static str,
}

/// Dry friction.
pub const DRY: Parameter = Parameter { name: "dry", words: "dry friction", unit: "N m", servo_unit: "rad" };
/// Viscous friction; of a position servo the time by which the position lags its command.
pub const VISCOUS: Parameter = Parameter { name: "viscous", words: "viscous friction", unit: "N m s/rad", servo_unit: "s" };
/// Torque that is always there.
pub const CONSTANT: Parameter = Parameter { name: "constant", words: "constant torque", unit: "N m", servo_unit: "rad" };
/// Recorded torque per torque of the model's links, less 1.
pub const GAIN: Parameter = Parameter { name: "gain", words: "torque scale", unit: "1", servo_unit: "rad/(N m)" };
/// Inertia that turns with the joint, beside that of the links.
pub const INERTIA: Parameter = Parameter { name: "inertia", words: "inertia", unit: "kg m2", servo_unit: "s2" };
/// Time by which the recorded torque lags that of the links.
pub const LAG: Parameter = Parameter { name: "lag", words: "lag of the torque", unit: "s", servo_unit: "s" };

/// Of a position servo: the part of its lag by which it answers late, beside what inertia and damping take.
pub const DELAY: Parameter = Parameter { name: "delay", words: "delay", unit: "s", servo_unit: "s" };
/// Of a position servo: width of the hysteresis between command and position, of play, dry friction and dead band together.
pub const LOST_MOTION: Parameter = Parameter { name: "lost_motion", words: "lost motion at reversals", unit: "rad", servo_unit: "rad" };

/// Those of the regression, in the order in which it takes them up.
pub const REGRESSED: [Parameter; 6] = [DRY, VISCOUS, CONSTANT, GAIN, INERTIA, LAG];
/// All of them.
pub const ALL: [Parameter; 8] = [DRY, VISCOUS, CONSTANT, GAIN, INERTIA, LAG, DELAY, LOST_MOTION];

impl Parameter {
    /// By its column.
    pub fn of(name: &str) -> Option<Parameter> {
        ALL.into_iter().find(|parameter| parameter.name == name)
    }

    /// In a sentence, by whether the joint was recorded by commands and positions.
    pub fn said(self, is_servo: bool) -> &'static str {
        match self.name {
            "viscous" if is_servo => "lag behind the command",
            "constant" if is_servo => "offset from the command",
            "gain" if is_servo => "droop under gravity",
            _ => self.words,
        }
    }

    /// The unit, by whether the joint was recorded by commands and positions.
    pub fn unit(self, is_servo: bool) -> &'static str {
        if is_servo { self.servo_unit } else { self.unit }
    }
}

/// An effect beside the common parameters, whose size a triage estimates one by one.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Effect {
    /// Its column in the table; the column of its standard error ends in `_sd`.
    pub name: &'static str,
    /// In a sentence.
    pub words: &'static str,
}

/// Effects whose size is estimated beside the common parameters, each alone. All are torques at the joint's usual speed, or at the usual torque of its
/// links, so that sizes compare with that of dry friction.
pub const EFFECTS: [Effect; 4] = [
    Effect { name: "stribeck", words: "Stribeck friction" },
    Effect { name: "load_friction", words: "friction that grows with the load" },
    Effect { name: "drag", words: "quadratic drag" },
    Effect { name: "asymmetric", words: "viscous friction that depends on the direction" },
];
