//! Excitations from a command line and from a file.

use super::error::ExcitationError;
use super::multisine::lines_in;
use super::shape::{Grid, Shape, Spacing};
use super::signal::Excitation;
use crate::elements::Range;
use crate::model::Model;
use crate::tomlfile::{FileError, Table, unknown};
use std::fmt;
use std::path::Path;
use std::str::FromStr;

/// One experiment of an excitation file: what drives which input.
#[derive(Debug, Clone, PartialEq)]
pub struct Experiment {
    /// Such as `sweep-large`; the recording takes this name.
    pub name: String,
    /// Input and what drives it; `None` where the device has one input only.
    pub drives: Vec<(Option<String>, Excitation)>,
}

impl Experiment {
    /// One column of samples for each input of the model, in its order, as long as the longest excitation; an
    /// input that nothing drives rests at 0.
    pub fn columns_for(&self, model: &Model, rate_hz: f64) -> Result<Vec<Vec<f64>>, ExcitationError> {
        let wrong = |message: String| ExcitationError::Experiment { experiment: self.name.clone(), message };
        let mut columns = vec![Vec::new(); model.inputs.len()];
        for (input, excitation) in &self.drives {
            let index = match input {
                Some(name) => {
                    let all = model.inputs.iter().map(|i| i.name.as_str());
                    all.clone().position(|n| n == name).ok_or_else(|| wrong(unknown("input", name, all)))?
                }
                None if model.inputs.len() == 1 => 0,
                None => {
                    let all: Vec<&str> = model.inputs.iter().map(|i| i.name.as_str()).collect();
                    return Err(wrong(format!("which input does it drive? the model has {}", all.join(", "))));
                }
            };
            columns[index] = excitation.samples(rate_hz)?;
        }
        let longest = columns.iter().map(Vec::len).max().unwrap_or(0);
        for column in &mut columns {
            column.resize(longest, 0.0);
        }
        Ok(columns)
    }
}

/// Reads a file of excitations.
///
/// ```toml
/// [[excitations]]
/// name = "sweep-small"      # tables of the same name drive several inputs at once
/// input = "feedback_force"  # may be left out where there is one input
/// kind = "sweep"
/// amplitude = 0.5
/// from = 1.0
/// to = 200.0
/// duration = 10.0
/// ```
pub fn load_experiments(path: &Path) -> Result<Vec<Experiment>, FileError> {
    let mut top = Table::open(path)?;
    let mut experiments: Vec<Experiment> = Vec::new();
    for mut table in top.tables("excitations")? {
        let name = table.need_string("name")?;
        table.label(&name);
        let input = table.string("input")?;
        let line = table.error_at("name", "");
        let excitation = read(table)?;
        match experiments.iter_mut().find(|e| e.name == name) {
            Some(there) if there.drives.iter().any(|d| d.0 == input || d.0.is_none() || input.is_none()) => {
                let message = "another excitation of this name drives the same input; give each its input";
                return Err(FileError { message: message.to_string(), ..line });
            }
            Some(there) => there.drives.push((input, excitation)),
            None => experiments.push(Experiment { name, drives: vec![(input, excitation)] }),
        }
    }
    if experiments.is_empty() {
        return Err(top.error("has no excitations; expected [[excitations]] tables"));
    }
    top.finish()?;
    Ok(experiments)
}

const KINDS: [(&str, &str); 6] = [
    ("sweep", "sweep"),
    ("multisine", "multisine"),
    ("triangle", "triangle"),
    ("steps", "steps"),
    ("impacts", "impacts"),
    ("sines", "sines"),
];

/// Reads an excitation from a table with a `kind`, and refuses keys that it does not know.
fn read(mut table: Table) -> Result<Excitation, FileError> {
    let kind = table.need_one_of("kind", &KINDS)?;
    let shape = match kind {
        "sweep" => sweep(&mut table)?,
        "multisine" => multisine(&mut table)?,
        "triangle" => Shape::Triangle {
            amplitude: table.need_number("amplitude", Range::Positive)?,
            period: list(&mut table, "period", Range::Positive)?,
            cycles: count(&mut table, "cycles", 1, 2)?,
            nested: count(&mut table, "nested", 0, 0)?,
            inner: table.number_or("inner", Range::Between(0.0, 2.0), 0.25)?,
        },
        "steps" => {
            let hold = table.need_number("hold", Range::Positive)?;
            Shape::Steps {
                amplitude: list(&mut table, "amplitude", Range::Any)?,
                hold,
                rise: table.number_or("rise", Range::Between(0.0, hold), 0.0)?,
                count: count(&mut table, "count", 1, 1)?,
            }
        }
        "impacts" => {
            let interval = table.need_number("interval", Range::Positive)?;
            let width = table.need_number("width", Range::Positive)?;
            if width > interval {
                return Err(table.error_at("width", format!("must be at most the interval of {interval} s, is {width}")));
            }
            Shape::Impacts {
                amplitude: list(&mut table, "amplitude", Range::Any)?,
                width,
                interval,
                count: count(&mut table, "count", 1, 1)?,
                bounces: count(&mut table, "bounces", 0, 0)?,
            }
        }
        _ => Shape::Sines {
            amplitude: list(&mut table, "amplitude", Range::Any)?,
            frequency: list(&mut table, "frequency", Range::Positive)?,
            cycles: count(&mut table, "cycles", 1, 10)?,
        },
    };
    let excitation = Excitation {
        shape,
        quiet: table.number_or("quiet", Range::NonNegative, 0.0)?,
        fade_in: table.number_or("fade_in", Range::NonNegative, 0.0)?,
        fade_out: table.number_or("fade_out", Range::NonNegative, 0.0)?,
        offset: table.number_or("offset", Range::Any, 0.0)?,
        limit: table.number("limit", Range::Positive)?.unwrap_or(f64::INFINITY),
    };
    let length = excitation.shape.duration();
    if excitation.fade_in + excitation.fade_out > length {
        let key = if excitation.fade_in > 0.0 { "fade_in" } else { "fade_out" };
        return Err(table.error_at(key, format!("the fades are longer than the {length} s between them")));
    }
    table.finish()?;
    Ok(excitation)
}

fn sweep(table: &mut Table) -> Result<Shape, FileError> {
    Ok(Shape::Sweep {
        amplitude: table.need_number("amplitude", Range::Any)?,
        from: table.need_number("from", Range::Positive)?,
        to: table.need_number("to", Range::Positive)?,
        duration: table.need_number("duration", Range::Positive)?,
        spacing: table.one_of("spacing", &[("log", Spacing::Log), ("linear", Spacing::Linear)])?.unwrap_or_default(),
        tilt: table.number_or("tilt", Range::Between(-4.0, 4.0), 0.0)?,
    })
}

fn multisine(table: &mut Table) -> Result<Shape, FileError> {
    let rms = table.number("rms", Range::Positive)?;
    let peak = table.number("peak", Range::Positive)?;
    if rms.is_some() == peak.is_some() {
        let message = if rms.is_some() { "has both rms and peak; keep one" } else { "needs either rms or peak" };
        return Err(table.error(message));
    }
    let from = table.need_number("from", Range::NonNegative)?;
    let to = table.need_number("to", Range::Positive)?;
    let period = table.need_number("period", Range::Positive)?;
    let grid = table.one_of("grid", &[("full", Grid::Full), ("odd", Grid::Odd)])?.unwrap_or_default();
    if to * period > 1e6 {
        return Err(table.error_at("period", format!("makes {:.0} lines up to {to} Hz; at most 1000000", to * period)));
    }
    if lines_in([from, to], period, grid).is_empty() {
        return Err(table.error_at("period", format!("no line of a period of {period} s lies from {from} to {to} Hz")));
    }
    Ok(Shape::Multisine {
        rms,
        peak,
        from,
        to,
        period,
        periods: count(table, "periods", 1, 1)?,
        levels: if table.contains("levels") { list(table, "levels", Range::Any)? } else { vec![1.0] },
        grid,
        seed: table.integer("seed", 0, i64::MAX)?.map_or(1, i64::unsigned_abs),
        crest: count(table, "crest", 0, 0)?.min(10_000),
    })
}

/// A number or a list of at least one.
fn list(table: &mut Table, key: &str, range: Range) -> Result<Vec<f64>, FileError> {
    let values = if table.is_list(key) { table.numbers(key, range)? } else { table.number(key, range)?.map(|x| vec![x]) };
    match values {
        None => Err(table.missing(key)),
        Some(values) if values.is_empty() => Err(table.error_at(key, "must not be empty")),
        Some(values) => Ok(values),
    }
}

fn count(table: &mut Table, key: &str, lowest: i64, default: u32) -> Result<u32, FileError> {
    Ok(table.integer(key, lowest, 1_000_000)?.map_or(default, |n| u32::try_from(n).unwrap_or(default)))
}

impl FromStr for Excitation {
    type Err = ExcitationError;

    /// Reads `kind:key=value,key=value`; a list of numbers is written `0.5/1/2`.
    fn from_str(text: &str) -> Result<Excitation, ExcitationError> {
        let wrong = |message: String| ExcitationError::Text { text: text.to_string(), message };
        let (kind, keys) = text.split_once(':').unwrap_or((text, ""));
        // Written out as the table that a file would have, so that both are read by the same code.
        let mut toml = format!("kind = {}\n", toml_edit::Value::from(kind.trim()));
        for pair in keys.split(',').map(str::trim).filter(|p| !p.is_empty()) {
            let (key, value) = pair.split_once('=').ok_or_else(|| wrong(format!("expected key=value, found \"{pair}\"")))?;
            let (key, value) = (key.trim(), value.trim());
            if key.is_empty() || !key.chars().all(|c| c.is_ascii_alphanumeric() || c == '_') {
                return Err(wrong(format!("\"{key}\" is not a key")));
            }
            toml.push_str(&format!("{key} = {}\n", value_text(value)));
        }
        let table = Table::parse(toml, "").map_err(|e| wrong(e.message))?;
        read(table).map_err(|e| match e.key.as_str() {
            "" => wrong(e.message),
            key => wrong(format!("{key}: {}", e.message)),
        })
    }
}

/// A value of a command line as TOML: an integer, a number, a list of numbers, else a string.
fn value_text(value: &str) -> String {
    let number = |text: &str| match (text.parse::<i64>(), text.parse::<f64>()) {
        (Ok(integer), _) => Some(integer.to_string()),
        (_, Ok(x)) if x.is_finite() => Some(crate::write::number(x)),
        _ => None,
    };
    if let Some(text) = number(value) {
        return text;
    }
    let parts: Option<Vec<String>> = value.split('/').map(|part| number(part.trim())).collect();
    match parts {
        Some(parts) if parts.len() > 1 => format!("[{}]", parts.join(", ")),
        _ => toml_edit::Value::from(value).to_string(),
    }
}

impl fmt::Display for Excitation {
    /// As a command line has it; reads back as the same excitation.
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let list = |values: &[f64]| values.iter().map(f64::to_string).collect::<Vec<_>>().join("/");
        let mut keys: Vec<String> = match &self.shape {
            Shape::Sweep { amplitude, from, to, duration, spacing, tilt } => {
                let mut keys =
                    vec![format!("amplitude={amplitude}"), format!("from={from}"), format!("to={to}"), format!("duration={duration}")];
                if *spacing == Spacing::Linear {
                    keys.push("spacing=linear".to_string());
                }
                if *tilt != 0.0 {
                    keys.push(format!("tilt={tilt}"));
                }
                keys
            }
            Shape::Multisine { rms, peak, from, to, period, periods, levels, grid, seed, crest } => {
                let size = rms.map(|x| format!("rms={x}")).or_else(|| peak.map(|x| format!("peak={x}")));
                let mut keys: Vec<String> = size.into_iter().collect();
                keys.extend([format!("from={from}"), format!("to={to}"), format!("period={period}"), format!("periods={periods}")]);
                if *levels != [1.0] {
                    keys.push(format!("levels={}", list(levels)));
                }
                if *grid == Grid::Odd {
                    keys.push("grid=odd".to_string());
                }
                keys.extend([format!("seed={seed}"), format!("crest={crest}")]);
                keys
            }
            Shape::Triangle { amplitude, period, cycles, nested, inner } => vec![
                format!("amplitude={amplitude}"),
                format!("period={}", list(period)),
                format!("cycles={cycles}"),
                format!("nested={nested}"),
                format!("inner={inner}"),
            ],
            Shape::Steps { amplitude, hold, rise, count } => {
                vec![format!("amplitude={}", list(amplitude)), format!("hold={hold}"), format!("rise={rise}"), format!("count={count}")]
            }
            Shape::Impacts { amplitude, width, interval, count, bounces } => vec![
                format!("amplitude={}", list(amplitude)),
                format!("width={width}"),
                format!("interval={interval}"),
                format!("count={count}"),
                format!("bounces={bounces}"),
            ],
            Shape::Sines { amplitude, frequency, cycles } => {
                vec![format!("amplitude={}", list(amplitude)), format!("frequency={}", list(frequency)), format!("cycles={cycles}")]
            }
        };
        let frame = [("quiet", self.quiet), ("fade_in", self.fade_in), ("fade_out", self.fade_out), ("offset", self.offset)];
        keys.extend(frame.iter().filter(|(_, x)| *x != 0.0).map(|(key, x)| format!("{key}={x}")));
        if self.limit.is_finite() {
            keys.push(format!("limit={}", self.limit));
        }
        write!(f, "{}:{}", self.shape.kind(), keys.join(","))
    }
}

impl TryFrom<String> for Excitation {
    type Error = ExcitationError;

    fn try_from(text: String) -> Result<Excitation, ExcitationError> {
        text.parse()
    }
}

impl From<Excitation> for String {
    fn from(excitation: Excitation) -> String {
        excitation.to_string()
    }
}
