//! The roles file: which field of which topic, or which column of a table, is which signal.

use crate::outcome::Unit;
use crate::signal_role::{SessionError, SignalRole};
use backdrive_bags::Signal;
use backdrive_plant::elements::Range;
use backdrive_plant::model::{Hold, Motion};
use backdrive_plant::tomlfile::{FileError, Table};
use std::path::Path;

/// The contents of a roles file.
#[derive(Debug, Clone, PartialEq)]
pub struct Roles {
    /// The signals of each axis.
    pub axes: Vec<AxisRoles>,
    /// Position scale mu; estimated where `None`.
    pub mu: Option<f64>,
    /// Force scale lambda; estimated where `None`.
    pub lambda: Option<f64>,
    /// Rows per second, Hz; the rate of the most frequent signal where `None`.
    pub rate_hz: Option<f64>,
    /// Column with the times of a table, s.
    pub time: String,
    /// Further sensors by name, to be checked for faults.
    pub(super) sensors: Vec<Sensor>,
    /// The roles file, for messages.
    pub(super) file: String,
}

/// Where the signals of an axis are.
#[derive(Debug, Clone, PartialEq)]
pub struct AxisRoles {
    /// Name of the axis.
    pub name: String,
    /// Whether it slides or turns; unknown where the roles file does not say.
    pub unit: Unit,
    pub(super) signals: Vec<(SignalRole, Located)>,
}

/// A signal, and where the roles file names it.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Located {
    /// Its topic and field are empty where the roles file can only mean a column.
    pub(super) signal: Signal,
    /// The column that is meant in a table; `None` where the roles file can only mean a topic.
    pub(super) column: Option<String>,
    line: usize,
    key: String,
}

impl Located {
    /// For messages: the field of its topic, or its column.
    pub(super) fn place(&self) -> String {
        match (&self.column, self.signal.topic.is_empty()) {
            (Some(column), _) => column.clone(),
            (None, _) => format!("{}.{}", self.signal.topic, self.signal.field),
        }
    }
}

/// A sensor that no answer needs, and what it measures besides another.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Sensor {
    pub(super) name: String,
    pub(super) located: Located,
    /// The signal that it measures too, such as the force of the hand.
    pub(super) of: Option<SignalRole>,
}

/// Keys of `[signals]`, whether they must be there, and how they run between their samples.
const KEYS: [(&str, SignalRole, bool, Hold); 9] = [
    ("x_m", SignalRole::Master, true, Hold::Linear),
    ("F_f", SignalRole::Force, true, Hold::Zero),
    ("x_c", SignalRole::Command, true, Hold::Linear),
    ("F_s", SignalRole::Contact, true, Hold::Zero),
    ("x_s", SignalRole::Slave, false, Hold::Linear),
    ("dither", SignalRole::Dither, false, Hold::Zero),
    ("operator", SignalRole::Intent, false, Hold::Linear),
    ("tau_s", SignalRole::SlaveForce, false, Hold::Zero),
    ("F_h", SignalRole::Hand, false, Hold::Zero),
];

impl Roles {
    /// Reads a roles file.
    ///
    /// # Errors
    /// What is wrong, at file, line and key.
    pub fn load(path: &Path) -> Result<Roles, FileError> {
        Roles::read(Table::open(path)?)
    }

    /// The same from text; `name` stands for the file in errors.
    pub fn from_toml(text: &str, name: &str) -> Result<Roles, FileError> {
        Roles::read(Table::parse(text, name)?)
    }

    pub(super) fn read(mut top: Table) -> Result<Roles, FileError> {
        let names = top.strings("axes")?;
        let units = read_units(&mut top)?;
        let mut signals = top.table("signals")?.ok_or_else(|| top.missing("signals"))?;
        let mut axes: Vec<AxisRoles> = Vec::new();
        let mut first_key = "";
        // A slave with a motor of its own may follow the master itself, without a position command.
        let commanded = !(signals.contains("tau_s") && signals.contains("x_s"));
        for (key, role, required, hold) in KEYS {
            let found = read_signals(&mut signals, key, hold)?;
            if found.is_empty() {
                if required && (role != SignalRole::Command || commanded) {
                    let what = format!("missing key \"{key}\": {}; without it {}", role.text(), role.without());
                    // A misspelt key is reported as such.
                    let misspelt = signals.missing(key);
                    return Err(if misspelt.message.contains("did you mean") { misspelt } else { signals.error(what) });
                }
                continue;
            }
            if axes.is_empty() {
                first_key = key;
                let blank = |index| AxisRoles { name: format!("axis{index}"), unit: Unit::Unknown, signals: Vec::new() };
                axes = (0..found.len()).map(blank).collect();
            }
            if found.len() != axes.len() {
                return Err(signals.error_at(key, format!("has {} axes, but {first_key} has {}", found.len(), axes.len())));
            }
            for (axis, located) in axes.iter_mut().zip(found) {
                axis.signals.push((role, located));
            }
        }
        signals.finish()?;
        if let Some(names) = names {
            if names.len() != axes.len() {
                return Err(top.error_at("axes", format!("has {} names, but [signals] has {} axes", names.len(), axes.len())));
            }
            for (axis, name) in axes.iter_mut().zip(names) {
                axis.name = name;
            }
        }
        if units.len() > 1 && units.len() != axes.len() {
            return Err(
                top.error_at("motion", format!("has {} words, but [signals] has {} axes; one word serves all", units.len(), axes.len()))
            );
        }
        for (axis, unit) in axes.iter_mut().zip(units.iter().cycle()) {
            axis.unit = *unit;
        }
        let (mut mu, mut lambda, mut rate_hz) = (None, None, None);
        if let Some(mut gains) = top.table("gains")? {
            mu = gains.number("mu", Range::Positive)?;
            lambda = gains.number("lambda", Range::NonNegative)?;
            gains.finish()?;
        }
        if let Some(mut resample) = top.table("resample")? {
            rate_hz = resample.number("rate_hz", Range::Positive)?;
            resample.finish()?;
        }
        let time = top.string("time")?.unwrap_or_else(|| "t".to_owned());
        let sensors = top.table("sensors")?.map_or(Ok(Vec::new()), read_sensors)?;
        let file = top.file_name().to_owned();
        top.finish()?;
        Ok(Roles { axes, mu, lambda, rate_hz, time, sensors, file })
    }

    pub(super) fn at(&self, located: &Located, message: String) -> SessionError {
        SessionError::Roles(FileError::at(&self.file, located.line, &located.key, message))
    }
}

/// The key of a role.
pub(super) fn key_of(role: SignalRole) -> &'static str {
    KEYS.iter().find(|(_, r, ..)| *r == role).map_or("sensor", |(key, ..)| key)
}

pub(super) fn is_required(role: SignalRole) -> bool {
    KEYS.iter().any(|(_, r, required, _)| *r == role && *required)
}

/// `motion = "rotation"`: one word for all axes, or one per axis; none where the key is absent.
fn read_units(table: &mut Table) -> Result<Vec<Unit>, FileError> {
    let words = table.string_or_strings("motion")?.unwrap_or_default();
    let unit = |word: &String| match word.as_str() {
        "translation" => Ok(Unit::of(Motion::Translation)),
        "rotation" => Ok(Unit::of(Motion::Rotation)),
        _ => Err(table.error_at("motion", format!("expected \"translation\" (m, N) or \"rotation\" (rad, N m), found \"{word}\""))),
    };
    words.iter().map(unit).collect()
}

/// A string, a table, or a list of one of them, one entry per axis; none where the key is absent.
fn read_signals(table: &mut Table, key: &'static str, hold: Hold) -> Result<Vec<Located>, FileError> {
    let line = table.line_of(key);
    if table.is_table(key) {
        let one = table.table(key)?;
        return one.into_iter().map(|t| read_table(t, key, hold)).collect();
    }
    if table.is_list_of_tables(key) {
        return table.tables(key)?.into_iter().map(|t| read_table(t, key, hold)).collect();
    }
    let specs = table.string_or_strings(key)?.unwrap_or_default();
    let several = specs.len() > 1;
    let read = |(index, spec): (usize, &String)| {
        let place = if several { format!("signals.{key}[{index}]") } else { format!("signals.{key}") };
        read_text(spec, &place, line, hold).map_err(|message| table.error_at(key, message))
    };
    specs.iter().enumerate().map(read).collect()
}

/// `TOPIC.FIELD`, or the column of a table: what begins with a slash can only be a topic, what has no dot only a column.
fn read_text(spec: &str, key: &str, line: usize, hold: Hold) -> Result<Located, String> {
    // Names of topics have no dots.
    let split = spec.split_once('.').filter(|(t, f)| !t.is_empty() && !f.is_empty());
    let is_topic = spec.starts_with('/');
    if spec.is_empty() || (is_topic && split.is_none()) {
        return Err(format!("expected \"TOPIC.FIELD\", such as \"/joint_states.position[0]\", or the column of a table, found \"{spec}\""));
    }
    let (topic, field) = split.unwrap_or(("", ""));
    let signal = Signal { hold, ..Signal::new(key, topic, field) };
    Ok(Located { signal, column: (!is_topic).then(|| spec.to_owned()), line, key: key.to_owned() })
}

/// `NAME = "COLUMN"` or a table, which may say of what it is another sensor.
fn read_sensors(mut table: Table) -> Result<Vec<Sensor>, FileError> {
    let mut sensors = Vec::new();
    for name in table.keys() {
        let line = table.line_of(&name);
        let sensor = if table.is_string(&name) {
            let spec = table.need_string(&name)?;
            let located = read_text(&spec, &format!("sensors.{name}"), line, Hold::Linear).map_err(|m| table.error_at(&name, m))?;
            Sensor { name, located, of: None }
        } else {
            let Some(mut inner) = table.table(&name)? else { continue };
            let roles = KEYS.map(|(key, role, ..)| (key, role));
            let of = inner.one_of("of", &roles)?;
            Sensor { located: read_table(inner, &name, Hold::Linear)?, name, of }
        };
        sensors.push(sensor);
    }
    table.finish()?;
    Ok(sensors)
}

fn read_table(mut table: Table, key: &str, hold: Hold) -> Result<Located, FileError> {
    let line = table.line();
    let column = table.string("column")?;
    let (topic, field) = match column {
        Some(_) => (String::new(), String::new()),
        None => (table.need_string("topic")?, table.need_string("field")?),
    };
    let scale = table.number_or("scale", Range::Any, 1.0)?;
    if scale == 0.0 {
        return Err(table.error_at("scale", "must not be 0: it would remove the signal"));
    }
    let offset = table.number_or("offset", Range::Any, 0.0)?;
    let hold = table.one_of("hold", &[("linear", Hold::Linear), ("zero", Hold::Zero)])?.unwrap_or(hold);
    let key = if table.path().is_empty() { format!("signals.{key}") } else { table.path().to_owned() };
    let signal = Signal { name: key.clone(), topic, field, scale, offset, hold };
    table.finish()?;
    Ok(Located { signal, column, line, key })
}

#[cfg(test)]
mod tests {
    use super::*;

    const GOOD: &str = "axes = [\"x\", \"y\"]\n[signals]\nx_m = [\"/m.position[0]\", \"/m.position[1]\"]\n\
        F_f = [{ topic = \"/f\", field = \"wrench.force.x\", scale = -1.0 }, { topic = \"/f\", field = \"wrench.force.y\" }]\n\
        x_c = [\"/c.data[0]\", \"/c.data[1]\"]\nF_s = [\"/s.wrench.force.x\", \"/s.wrench.force.y\"]\n[gains]\nmu = 2.0\n";

    #[test]
    fn strings_tables_and_lists_are_read() {
        let roles = Roles::from_toml(GOOD, "r.toml").unwrap();
        assert_eq!((roles.axes.len(), roles.axes[1].name.as_str(), roles.mu, roles.lambda), (2, "y", Some(2.0), None));
        let force = &roles.axes[0].signals.iter().find(|(role, _)| *role == SignalRole::Force).unwrap().1.signal;
        assert_eq!((force.topic.as_str(), force.field.as_str(), force.scale, force.hold), ("/f", "wrench.force.x", -1.0, Hold::Zero));
        let position = &roles.axes[1].signals[0].1.signal;
        assert_eq!((position.topic.as_str(), position.field.as_str(), position.hold), ("/m", "position[1]", Hold::Linear));
    }

    #[test]
    fn an_axis_slides_or_turns_as_it_is_said() {
        let units = |key: &str| -> Vec<Unit> {
            Roles::from_toml(&format!("{key}{GOOD}"), "r.toml").unwrap().axes.iter().map(|axis| axis.unit).collect()
        };
        assert_eq!(units(""), [Unit::Unknown; 2]);
        assert_eq!(units("motion = \"rotation\"\n"), [Unit::Radian; 2]);
        assert_eq!(units("motion = [\"translation\", \"rotation\"]\n"), [Unit::Metre, Unit::Radian]);
    }

    #[test]
    fn what_is_wrong_is_said_with_its_line() {
        let says = |text: &str, what: &[&str]| {
            let error = Roles::from_toml(text, "r.toml").unwrap_err().to_string();
            assert!(what.iter().all(|w| error.contains(w)), "{error}");
        };
        says("[signal]\n", &["r.toml:1", "signals"]);
        says(&GOOD.replace("F_s = [\"/s.wrench.force.x\", \"/s.wrench.force.y\"]\n", ""), &["F_s", "contact and the loop"]);
        says(&GOOD.replace("\"/c.data[1]\"", "\"/c/data\""), &["r.toml:5", "x_c", "TOPIC.FIELD"]);
        says(&GOOD.replace(", \"/c.data[1]\"", ""), &["r.toml:5", "x_c", "has 1 axes, but x_m has 2"]);
        says(&GOOD.replace("scale = -1.0", "skale = -1.0"), &["r.toml:4", "did you mean \"scale\""]);
        says(&GOOD.replace("scale = -1.0", "scale = 0"), &["r.toml:4", "must not be 0"]);
        says(&GOOD.replace("mu = 2.0", "mu = -2.0"), &["mu", "above 0"]);
        says(&GOOD.replace("\"x\", \"y\"", "\"x\""), &["r.toml:1", "axes"]);
        says(&format!("motion = \"turning\"\n{GOOD}"), &["r.toml:1", "motion", "rotation", "turning"]);
        says(&format!("motion = [\"rotation\", \"rotation\", \"rotation\"]\n{GOOD}"), &["r.toml:1", "motion", "has 3 words", "2 axes"]);
        says(&format!("{GOOD}[resample]\nrate = 5\n"), &["resample", "rate"]);
        says(&format!("{TABLE}gauge = {{ column = \"g\", of = \"F_x\" }}\n"), &["sensors.gauge.of", "F_x"]);
        says(&TABLE.replace("tau_s = \"ts\"\n", ""), &["x_c", "commanded"]);
    }

    const TABLE: &str = "time = \"time_s\"\n[signals]\nx_m = \"xm.raw\"\nx_s = \"xs\"\nF_f = { column = \"tm\", scale = -1.0 }\n\
        tau_s = \"ts\"\nF_s = \"fe\"\nF_h = \"fh\"\n[sensors]\nb = { column = \"gb\", of = \"F_h\" }\na = \"ga\"\n";

    #[test]
    fn columns_of_a_table_stand_where_topics_do_and_a_driven_slave_needs_no_command() {
        let roles = Roles::from_toml(TABLE, "r.toml").unwrap();
        let found = |role: SignalRole| roles.axes[0].signals.iter().find(|(r, _)| *r == role).map(|(_, l)| l.column.clone().unwrap());
        assert_eq!(found(SignalRole::Master).as_deref(), Some("xm.raw"));
        assert_eq!((found(SignalRole::Force).as_deref(), found(SignalRole::Command)), (Some("tm"), None));
        assert_eq!(roles.time, "time_s");
        let sensors: Vec<(&str, Option<SignalRole>)> = roles.sensors.iter().map(|s| (s.name.as_str(), s.of)).collect();
        assert!(sensors.contains(&("b", Some(SignalRole::Hand))) && sensors.contains(&("a", None)), "{sensors:?}");
    }
}
