//! What may be missing at a servo joint: the parameters of each effect, where its fit starts, and what it is easily taken for.

use backdrive_plant::servo::{Number, Numbers};

/// An effect that may be added.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Physics {
    /// Its name in a verdict.
    pub name: &'static str,
    /// In words.
    pub words: &'static str,
    /// The parameters that it frees, its size first.
    pub numbers: &'static [Number],
    /// Another effect that it needs.
    pub needs: &'static [&'static str],
    /// Those that do nearly the same.
    pub rivals: &'static [&'static str],
}

const fn physics(
    name: &'static str,
    words: &'static str,
    numbers: &'static [Number],
    needs: &'static [&'static str],
    rivals: &'static [&'static str],
) -> Physics {
    Physics { name, words, numbers, needs, rivals }
}

/// Delay, second order and offset: what every servo joint has.
pub const BASE: [Number; 4] = [Number::Delay, Number::Inertia, Number::Damping, Number::Offset];

/// All that are tried.
pub const ALL: [Physics; 14] = [
    physics("coulomb", "dry friction", &[Number::Friction], &[], &["dead_band", "backlash", "load_friction"]),
    physics(
        "stribeck",
        "dry friction that is larger at rest",
        &[Number::Stribeck, Number::StribeckSpeed],
        &["coulomb"],
        &["dead_band", "backlash"],
    ),
    physics("load_friction", "friction that grows with the load", &[Number::LoadFriction], &["gravity", "payload"], &["coulomb"]),
    physics("dead_band", "a dead band of the servo", &[Number::DeadBand], &[], &["coulomb", "backlash"]),
    physics("backlash", "play", &[Number::Play], &[], &["coulomb", "dead_band"]),
    physics("gravity", "droop under the weight of the links", &[Number::Gravity], &[], &["payload", "gain"]),
    physics(
        "payload",
        "droop under a weight that the robot file does not contain",
        &[Number::MomentCos, Number::MomentSin],
        &[],
        &["gravity", "gain"],
    ),
    physics("gain", "a scale between command and position", &[Number::Gain], &[], &["gravity", "payload"]),
    physics("saturation", "a limit of the torque", &[Number::Limit], &[], &["speed_limit", "acceleration_limit"]),
    physics("speed_limit", "a limit of the speed", &[Number::Speed], &[], &["saturation", "acceleration_limit"]),
    physics("acceleration_limit", "a limit of the acceleration", &[Number::Acceleration], &[], &["saturation", "speed_limit"]),
    physics("integral", "an integral term of the servo", &[Number::Integral], &[], &[]),
    physics("lead", "a derivative term on the command", &[Number::Lead], &[], &[]),
    physics(
        "quadratic_drag",
        "drag that grows with the square of the speed",
        &[Number::QuadraticDamping],
        &[],
        &["speed_limit", "saturation"],
    ),
];

/// An effect by its name.
pub fn named(name: &str) -> Option<&'static Physics> {
    ALL.iter().find(|p| p.name == name)
}

impl Physics {
    /// Where a fit of it may start, from that of the structure before. `typical` is the usual size of command less position, rad; `fastest` is the largest
    /// speed of the position, rad/s; `quickest` is its largest acceleration, rad/s².
    pub fn starts(&self, from: &Numbers, size: &Sizes) -> Vec<Numbers> {
        let with = |changes: &[(Number, f64)]| {
            let mut numbers = *from;
            changes.iter().for_each(|(n, x)| numbers[*n] = *x);
            numbers
        };
        let e = size.lag;
        match self.name {
            "coulomb" => vec![with(&[(Number::Friction, 0.1 * e)]), with(&[(Number::Friction, 0.5 * e)])],
            "stribeck" => {
                let f = from[Number::Friction];
                vec![
                    with(&[
                        (Number::Friction, 0.7 * f),
                        (Number::Stribeck, 0.3 * f.max(0.1 * e)),
                        (Number::StribeckSpeed, 0.1 * size.speed),
                    ]),
                    with(&[
                        (Number::Friction, 0.5 * f),
                        (Number::Stribeck, 0.5 * f.max(0.1 * e)),
                        (Number::StribeckSpeed, 0.03 * size.speed),
                    ]),
                ]
            }
            "load_friction" => {
                let f = from[Number::Friction];
                vec![
                    with(&[(Number::LoadFriction, 0.2), (Number::Friction, 0.7 * f)]),
                    with(&[(Number::LoadFriction, 0.7), (Number::Friction, 0.3 * f)]),
                ]
            }
            "dead_band" => vec![
                with(&[(Number::DeadBand, 0.1 * e)]),
                with(&[(Number::DeadBand, 0.3 * e), (Number::Friction, 0.5 * from[Number::Friction])]),
            ],
            "backlash" => {
                vec![with(&[(Number::Play, 0.1 * e)]), with(&[(Number::Play, 0.4 * e), (Number::Friction, 0.7 * from[Number::Friction])])]
            }
            "gravity" => {
                let size = 0.3 * e / size.weight.max(1e-9);
                vec![with(&[(Number::Gravity, 0.3 * size)]), with(&[(Number::Gravity, size), (Number::Gain, 1.0)])]
            }
            "payload" => vec![with(&[]), with(&[(Number::MomentCos, 0.2 * e)]), with(&[(Number::MomentSin, 0.2 * e)])],
            "saturation" => vec![with(&[(Number::Limit, 0.6 * size.largest_lag)]), with(&[(Number::Limit, 0.25 * size.largest_lag)])],
            "speed_limit" => vec![with(&[(Number::Speed, 0.9 * size.speed)]), with(&[(Number::Speed, 1.3 * size.speed)])],
            "acceleration_limit" => [0.3, 1.0, 3.0].iter().map(|x| with(&[(Number::Acceleration, x * size.acceleration)])).collect(),
            "integral" => vec![with(&[(Number::Integral, 0.3)])],
            "lead" => vec![with(&[(Number::Lead, 0.2 * from[Number::Damping])])],
            "quadratic_drag" => vec![with(&[(Number::QuadraticDamping, 0.1 * from[Number::Damping] / size.speed.max(1e-3))])],
            _ => vec![*from],
        }
    }
}

/// Sizes of what the recordings hold.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Sizes {
    /// Usual size of command less position, rad: the 90th percentile.
    pub lag: f64,
    /// The largest of them, rad.
    pub largest_lag: f64,
    /// Fastest motion, rad/s.
    pub speed: f64,
    /// Quickest change of speed, rad/s².
    pub acceleration: f64,
    /// Largest torque of gravity by the robot file, N m.
    pub weight: f64,
}
