//! Units that recordings come in, as they stand in a heading (`x [mm]`) or in `[columns]` (`unit = "mm"`).
//!
//! A table of its own and no crate: the crates for units check them when a program is compiled. Those that read text know either far more (parsing
//! whole expressions) or not the kinds that a model's signals have.

use crate::model::{InputKind, Model, Motion, OutputKind};

/// What a unit measures.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Kind {
    /// s
    Time,
    /// m
    Length,
    /// rad
    Angle,
    /// m/s
    Speed,
    /// rad/s
    AngularSpeed,
    /// m/s²
    Acceleration,
    /// rad/s²
    AngularAcceleration,
    /// N
    Force,
    /// N m
    Torque,
    /// A: a force or a torque only by a motor's constant, as `scale`.
    Current,
    /// Counts of an encoder or a converter: a length or a force only by `scale`.
    Count,
}

impl Kind {
    /// In words, with its SI unit.
    pub fn text(self) -> &'static str {
        match self {
            Kind::Time => "a time (s)",
            Kind::Length => "a length (m)",
            Kind::Angle => "an angle (rad)",
            Kind::Speed => "a speed (m/s)",
            Kind::AngularSpeed => "an angular speed (rad/s)",
            Kind::Acceleration => "an acceleration (m/s^2)",
            Kind::AngularAcceleration => "an angular acceleration (rad/s^2)",
            Kind::Force => "a force (N)",
            Kind::Torque => "a torque (N m)",
            Kind::Current => "a current (A)",
            Kind::Count => "a count",
        }
    }
}

/// A unit: what it measures, and its size in the SI unit of that.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Unit {
    /// Its spelling.
    pub name: &'static str,
    /// What it measures.
    pub kind: Kind,
    /// Its size in SI units.
    pub factor: f64,
}

const TURN: f64 = std::f64::consts::TAU;
const DEGREE: f64 = TURN / 360.0;
/// Exact by definition: 1959 international yard and pound, and standard gravity (CGPM 1901).
const INCH: f64 = 0.0254;
const POUND: f64 = 0.453_592_37;
const GRAVITY: f64 = 9.806_65;

const fn unit(name: &'static str, kind: Kind, factor: f64) -> Unit {
    Unit { name, kind, factor }
}

/// Every unit that is known. Where one has several spellings the first is the usual one.
pub const UNITS: &[Unit] = &[
    unit("s", Kind::Time, 1.0),
    unit("ms", Kind::Time, 1e-3),
    unit("us", Kind::Time, 1e-6),
    unit("ns", Kind::Time, 1e-9),
    unit("min", Kind::Time, 60.0),
    unit("m", Kind::Length, 1.0),
    unit("cm", Kind::Length, 1e-2),
    unit("mm", Kind::Length, 1e-3),
    unit("um", Kind::Length, 1e-6),
    unit("nm", Kind::Length, 1e-9),
    unit("in", Kind::Length, INCH),
    unit("rad", Kind::Angle, 1.0),
    unit("mrad", Kind::Angle, 1e-3),
    unit("deg", Kind::Angle, DEGREE),
    unit("rev", Kind::Angle, TURN),
    unit("m/s", Kind::Speed, 1.0),
    unit("mm/s", Kind::Speed, 1e-3),
    unit("cm/s", Kind::Speed, 1e-2),
    unit("in/s", Kind::Speed, INCH),
    unit("rad/s", Kind::AngularSpeed, 1.0),
    unit("deg/s", Kind::AngularSpeed, DEGREE),
    unit("rev/s", Kind::AngularSpeed, TURN),
    unit("mrad/s", Kind::AngularSpeed, 1e-3),
    unit("rpm", Kind::AngularSpeed, TURN / 60.0),
    unit("m/s^2", Kind::Acceleration, 1.0),
    unit("mm/s^2", Kind::Acceleration, 1e-3),
    unit("g", Kind::Acceleration, GRAVITY),
    unit("rad/s^2", Kind::AngularAcceleration, 1.0),
    unit("deg/s^2", Kind::AngularAcceleration, DEGREE),
    unit("N", Kind::Force, 1.0),
    unit("mN", Kind::Force, 1e-3),
    unit("kN", Kind::Force, 1e3),
    unit("lbf", Kind::Force, POUND * GRAVITY),
    unit("kgf", Kind::Force, GRAVITY),
    unit("N m", Kind::Torque, 1.0),
    unit("mN m", Kind::Torque, 1e-3),
    unit("kN m", Kind::Torque, 1e3),
    unit("N cm", Kind::Torque, 1e-2),
    unit("N mm", Kind::Torque, 1e-3),
    unit("lbf in", Kind::Torque, POUND * GRAVITY * INCH),
    unit("A", Kind::Current, 1.0),
    unit("mA", Kind::Current, 1e-3),
    unit("counts", Kind::Count, 1.0),
];

/// Spellings beside the names of [`UNITS`], in small letters; here upper case does not count.
const SPELLINGS: &[(&str, &str)] = &[
    ("sec secs second seconds", "s"),
    ("msec millisecond milliseconds", "ms"),
    ("usec microsecond microseconds", "us"),
    ("nsec nanosecond nanoseconds", "ns"),
    ("minute minutes", "min"),
    ("meter meters metre metres", "m"),
    ("millimeter millimeters millimetre millimetres", "mm"),
    ("micrometer micrometers micrometre micrometres micron microns", "um"),
    ("inch inches", "in"),
    ("radian radians rads rad", "rad"),
    ("degree degrees degs deg", "deg"),
    ("revolution revolutions turn turns rev revs", "rev"),
    ("rad/sec radians/s radians/sec", "rad/s"),
    ("deg/sec degrees/s degrees/sec deg/s", "deg/s"),
    ("rpm rev/min 1/min", "rpm"),
    ("newton newtons", "N"),
    ("newtonmeter newtonmeters newtonmetre newtonmetres newton-meters newton-metres", "N m"),
    ("amp amps ampere amperes", "A"),
    ("milliamp milliamps milliampere milliamperes", "mA"),
    ("count cts tick ticks counts", "counts"),
];

/// The unit that a text names: `N*m`, `N.m`, `Nm` and `N·m` are `N m`; `µm` is `um`; `°` is `deg`; `m/s²` and `m/s2` are `m/s^2`.
/// Words such as `Degrees` or `sec` are known in any case; the case of symbols counts, because `mN` and `MN` differ.
///
/// # Errors
/// A sentence that lists what is known.
pub fn parse(text: &str) -> Result<Unit, String> {
    let plain = |text: &str| -> String {
        let text = text.replace(['µ', 'μ'], "u").replace(['°', 'º'], "deg").replace('²', "^2").replace("s2", "s^2").replace("**", "^");
        text.chars().filter(|c| !c.is_whitespace() && !['*', '.', '·', '⋅'].contains(c)).collect()
    };
    let asked = plain(text);
    let word = asked.to_lowercase();
    let spelt = SPELLINGS.iter().find(|(spellings, _)| spellings.split(' ').any(|spelling| spelling == word)).map(|(_, name)| plain(name));
    let asked = spelt.unwrap_or(asked);
    UNITS.iter().find(|unit| plain(unit.name) == asked).copied().ok_or_else(|| {
        let known: Vec<&str> = UNITS.iter().map(|u| u.name).collect();
        format!("unknown unit \"{}\"; known are {}", text.trim(), known.join(", "))
    })
}

/// What often stands in parentheses behind a name and is no unit.
const REMARKS: &str = " raw filtered unfiltered smoothed measured meas desired commanded command cmd actual act reference ref target setpoint estimated est model \
                       simulated sim left right master slave leader follower front rear motor joint link load sensor encoder x y z ";

/// A heading's name and the text of its unit.
///
/// The unit stands in brackets, in parentheses, or behind a slash or a comma: `x [mm]`, `x (mm)`, `x / mm`, `x/mm`, `v / (m/s)` and `x, mm`.
/// In brackets and parentheses, and behind a slash between spaces, any text is a unit, so that an unknown one is refused and not taken
/// for SI. Behind a bare slash or a comma only a known one is, because names such as `arm/x` have slashes. `x []`, `position[0]`, `q(1)`,
/// `x (filtered)` and `x` have none.
pub fn split(heading: &str) -> (&str, Option<&str>) {
    let unit = |name: &'_ str, unit: &'_ str| -> bool { !name.trim().is_empty() && parse(unit).is_ok() };
    for (open, close) in [('[', ']'), ('(', ')')] {
        let Some((name, text)) = heading.strip_suffix(close).and_then(|rest| rest.rsplit_once(open)) else { continue };
        let is_entry = text.parse::<usize>().is_ok() && (open == '(' || !name.ends_with(char::is_whitespace));
        let is_remark = open == '(' && REMARKS.contains(&format!(" {} ", text.trim().to_lowercase()));
        if is_entry || is_remark || name.trim().is_empty() {
            return (heading, None);
        }
        // `v / (m/s)`: the slash belongs to neither.
        let name = name.trim_end();
        let name = name.strip_suffix('/').map_or(name, str::trim_end);
        return (name, Some(text.trim()).filter(|u| !u.is_empty() && *u != "-"));
    }
    if let Some((name, text)) = heading.split_once(" / ").filter(|(name, text)| !name.trim().is_empty() && !text.trim().is_empty()) {
        return (name.trim_end(), Some(text.trim()));
    }
    // `v, m/s` has a slash in its unit.
    let behind_comma = heading.rsplit_once(", ").filter(|(name, text)| unit(name, text));
    match behind_comma.or_else(|| heading.split_once('/').filter(|(name, text)| unit(name, text))) {
        Some((name, text)) => (name.trim_end(), Some(text.trim())),
        None => (heading, None),
    }
}

/// The unit that many write behind a name, as in `time_ms` or `angle_deg`. It is a hint and no statement: `x_m` may be the master's x.
pub fn hinted(name: &str) -> Option<Unit> {
    name.rsplit_once('_').and_then(|(_, unit)| parse(unit).ok())
}

/// The unit of a heading under which times stand: what it states, else what stands behind its name.
///
/// # Errors
/// The unit is not known, or measures no time.
pub fn of_times(heading: &str) -> Result<Option<Unit>, String> {
    let (name, stated) = split(heading);
    match stated {
        None => Ok(hinted(name).filter(|unit| unit.kind == Kind::Time)),
        Some(text) => match parse(text)? {
            unit if unit.kind == Kind::Time => Ok(Some(unit)),
            unit => Err(format!("is in {}, {}, expected a time such as s or ms", unit.name, unit.kind.text())),
        },
    }
}

/// The SI unit of a kind; a current and a count are their own.
pub fn si(kind: Kind) -> Unit {
    UNITS.iter().find(|unit| unit.kind == kind && unit.factor == 1.0).copied().unwrap_or(unit("counts", Kind::Count, 1.0))
}

/// What a model's signal, or the time `t`, measures; `None` for what the model does not have.
pub fn kind_of(model: &Model, signal: &str) -> Option<Kind> {
    let pick = |translation, rotation| match model.motion {
        Motion::Translation => translation,
        Motion::Rotation => rotation,
    };
    let force = pick(Kind::Force, Kind::Torque);
    let position = pick(Kind::Length, Kind::Angle);
    if let Some(input) = model.inputs.iter().find(|i| i.name == signal) {
        return Some(if input.kind == InputKind::Force { force } else { position });
    }
    model.outputs.iter().find(|o| o.name == signal).map(|output| match output.kind {
        OutputKind::Position(_) => position,
        OutputKind::Velocity(_) => pick(Kind::Speed, Kind::AngularSpeed),
        OutputKind::Acceleration(_) => pick(Kind::Acceleration, Kind::AngularAcceleration),
        OutputKind::Force(_) | OutputKind::Reaction(_) => force,
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn units_are_what_they_are_called() {
        let size = |text: &str| parse(text).unwrap().factor;
        assert_eq!((size("ms"), size("mm"), size("rad")), (1e-3, 1e-3, 1.0));
        // 3000 rpm are 50 turns a second; 180 degrees are pi.
        assert!((3000.0 * size("rpm") - 50.0 * TURN).abs() < 1e-9 && (180.0 * size("°") - 0.5 * TURN).abs() < 1e-12);
        // NIST SP 811: 1 lbf = 4.448222 N, 1 lbf in = 0.1129848 N m.
        assert!((size("lbf") - 4.448_222).abs() < 1e-6 && (size("lbf in") - 0.112_984_8).abs() < 1e-7);
        for same in ["N m", "Nm", "N*m", "N.m", "N·m"] {
            assert_eq!(parse(same).unwrap().name, "N m");
        }
        assert_eq!((parse("µm").unwrap().name, parse("m/s²").unwrap().name, parse("m/s2").unwrap().name), ("um", "m/s^2", "m/s^2"));
        let told = parse("furlong").unwrap_err();
        assert!(told.starts_with("unknown unit \"furlong\"; known are s, ms"), "{told}");
    }

    #[test]
    fn no_two_units_read_alike() {
        for unit in UNITS {
            assert_eq!(parse(unit.name).unwrap(), *unit);
        }
    }

    #[test]
    fn a_heading_is_a_name_and_perhaps_a_unit() {
        assert_eq!(split("t [ms]"), ("t", Some("ms")));
        assert_eq!(split("tau[N m]"), ("tau", Some("N m")));
        assert_eq!(split("x []"), ("x", None));
        assert_eq!(split("position[0]"), ("position[0]", None));
        assert_eq!(split("x"), ("x", None));
    }

    #[test]
    fn a_unit_is_read_in_every_usual_place() {
        for (name, unit) in
            [("time", "ms"), ("q1", "deg"), ("tau_1", "Nm"), ("v", "m/s"), ("a", "m/s^2"), ("w", "rad/s"), ("phi", "°"), ("x", "µm")]
        {
            let bracketed = [format!("{name} [{unit}]"), format!("{name}[{unit}]"), format!("{name} ({unit})"), format!("{name}({unit})")];
            let slashed = [format!("{name} / {unit}"), format!("{name}/{unit}"), format!("{name} / ({unit})"), format!("{name}, {unit}")];
            for heading in bracketed.iter().chain(&slashed) {
                assert_eq!(split(heading), (name, Some(unit)), "{heading}");
                assert!(parse(unit).is_ok(), "{unit}");
            }
        }
        for (heading, meant) in [
            ("Time(MSEC)", "ms"),
            ("q (Deg)", "deg"),
            ("q (Degrees)", "deg"),
            ("t (Seconds)", "s"),
            ("tau (N*m)", "N m"),
            ("w (deg/sec)", "deg/s"),
        ] {
            assert_eq!(parse(split(heading).1.unwrap()).unwrap().name, meant, "{heading}");
        }
    }

    #[test]
    fn an_unknown_unit_is_stated_and_a_name_is_no_unit() {
        // Stated, so that whoever needs the column refuses it by this text.
        for heading in ["q (grad)", "q(grad)", "q [grad]", "q / grad"] {
            assert_eq!(split(heading), ("q", Some("grad")), "{heading}");
            assert!(parse("grad").unwrap_err().starts_with("unknown unit \"grad\""));
        }
        // 1 MN is no mN.
        assert!(parse("MN").is_err() && parse("MS").is_err());
        for heading in
            ["q(1)", "x (filtered)", "x (Measured)", "arm/x", "/joint_states/position[0]", "robot/arm/q", "x_m", "(deg)", "/m", "force (2)"]
        {
            assert_eq!(split(heading), (heading, None));
        }
    }

    #[test]
    fn times_have_their_unit_stated_or_behind_their_name() {
        let name = |heading: &str| of_times(heading).map(|unit| unit.map(|unit| unit.name));
        assert_eq!((name("time_ms"), name("t (us)"), name("stamp"), name("t_deg")), (Ok(Some("ms")), Ok(Some("us")), Ok(None), Ok(None)));
        assert!(name("t (deg)").unwrap_err().contains("expected a time") && name("t (h)").unwrap_err().contains("unknown unit \"h\""));
        assert_eq!((si(Kind::Angle).name, si(Kind::Torque).name, si(Kind::Current).name), ("rad", "N m", "A"));
    }
}
