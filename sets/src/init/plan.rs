//! What is driven and measured: the answers to the questions, and how the recordings are to be read by them.

use super::ask::{Asker, Question, usage};
use super::error::InitError;
use super::found::{Column, Recordings};
use super::options::{Attached, Choice, Driven, Motion, Options};
use backdrive_plant::recording::units::{self, Kind, Unit};
use backdrive_plant::recording::{ColumnRule, Columns};
use std::io::{BufRead, Write};

/// A signal of the model and where it stands in the recordings.
#[derive(Debug, Clone)]
pub struct Signal {
    /// Its name in the model: the user's own for it.
    pub name: String,
    /// Where it stands.
    pub column: Column,
    /// Its unit, where the heading does not name it.
    pub unit: Option<Unit>,
    /// A motor's constant or the size of a count.
    pub scale: Option<f64>,
    /// The option that states its unit, where nothing does and SI units are assumed: with the unit.
    pub assumed: Option<(String, Unit)>,
}

impl Signal {
    /// Its rule in `[columns]`.
    pub fn rule(&self) -> ColumnRule {
        // With a scale the unit has to be said here: a heading's goes unheard then.
        let unit = self.unit.or(self.column.unit.filter(|_| self.scale.is_some()));
        ColumnRule { unit, scale: self.scale, ..ColumnRule::of(self.column.source.clone()) }
    }
}

/// The answers.
pub struct Plan {
    /// Along a line or turning.
    pub motion: Motion,
    /// What is prescribed.
    pub driven: Driven,
    /// Its column.
    pub drive: Signal,
    /// The time; `None` where a bag's stamps tell it.
    pub time: Option<Signal>,
    /// A measured position.
    pub position: Option<Signal>,
    /// A measured velocity.
    pub velocity: Option<Signal>,
    /// A measured force.
    pub force: Option<Signal>,
    /// What the driven body holds on to.
    pub attached: Attached,
    /// Where a load rings, Hz.
    pub resonance: f64,
    /// Whether a hand that nobody measured holds it.
    pub hand: bool,
}

impl Plan {
    /// The measured signals.
    pub fn measured(&self) -> impl Iterator<Item = &Signal> {
        [&self.position, &self.velocity, &self.force].into_iter().flatten()
    }

    /// How the recordings are read.
    pub fn columns(&self) -> Columns {
        let time = self.time.iter().map(|t| ("t".to_string(), t.rule()));
        time.chain(std::iter::once(&self.drive).chain(self.measured()).map(|s| (s.name.clone(), s.rule()))).collect()
    }
}

/// Words that name what drives, in headings of no unit.
const DRIVES: [&str; 8] = ["force", "torque", "tau", "effort", "command", "cmd", "u", "f"];
const CURRENTS: [&str; 5] = ["current", "i", "iq", "amps", "ampere"];
const POSITIONS: [&str; 12] = ["position", "pos", "x", "q", "angle", "theta", "phi", "encoder", "enc", "displacement", "disp", "count"];
const VELOCITIES: [&str; 8] = ["velocity", "vel", "speed", "v", "omega", "w", "rpm", "qd"];
const FORCES: [&str; 8] = ["force", "load", "torque", "effort", "tau", "reaction", "f", "fz"];
const TIMES: [&str; 5] = ["t", "time", "timestamp", "stamp", "sec"];

/// The one answer of a column that is not there.
const NONE: &str = "none";

/// Asks, and takes what options say.
///
/// # Errors
/// Usage: an answer is missing or makes no sense beside the others.
pub fn plan<R: BufRead, W: Write>(asker: &mut Asker<R, W>, options: &Options, found: &Recordings) -> Result<Plan, InitError> {
    let mut talk = Talk { asker, found, taken: Vec::new(), names: vec!["t".to_string()] };
    let motion = talk.one_of("motion", "Does it move along a line or turn?", options.motion, Some(Motion::Translation))?;
    let driven = talk.one_of(
        "driven",
        "What is prescribed and recorded: a force (or torque), a motor's current, or a motion whose reaction force is measured?",
        options.driven,
        Some(Driven::Force),
    )?;
    let time = time(&mut talk, options)?;
    let drive = drive(&mut talk, options, motion, driven)?;
    let (attached, resonance) = attached(&mut talk, options, driven)?;
    let mut plan = Plan { motion, driven, drive, time, position: None, velocity: None, force: None, attached, resonance, hand: false };
    if driven != Driven::Motion {
        position_and_velocity(&mut talk, options, &mut plan)?;
    } else {
        refuse("position", &options.position, "a prescribed motion is --drive, and its reaction --force")?;
        refuse("velocity", &options.velocity, "a prescribed motion is --drive, as a position; its reaction is --force")?;
    }
    match driven == Driven::Motion || attached == Attached::Load {
        true => plan.force = force(&mut talk, options, motion, driven)?,
        false => refuse(
            "force",
            &options.force,
            "without a prescribed motion or a load (--attached load) there is no joint in which it could be measured",
        )?,
    }
    if plan.measured().next().is_none() {
        return Err(usage(
            "give --position or --velocity: without a measured signal there is nothing to compare the model with".to_string(),
        ));
    }
    if driven != Driven::Motion {
        plan.hand = talk.one_of("hand", "Is it held by a hand whose motion was not measured?", options.hand, Some(false))?;
    } else if options.hand == Some(true) {
        return Err(usage("--hand: the motion is prescribed, so a hand cannot move it".to_string()));
    }
    Ok(plan)
}

/// The column of the time, which a bag's messages have by themselves.
fn time<R: BufRead, W: Write>(talk: &mut Talk<R, W>, options: &Options) -> Result<Option<Signal>, InitError> {
    let is_table = talk.found.columns.iter().any(|c| matches!(c.source, backdrive_plant::recording::Source::Column(_)));
    match is_table || options.time.is_some() {
        true => talk.signal(&Asked {
            option: "time",
            words: "Which column is the time? (if there is none, give the sampling rate with --rate HZ)",
            kinds: &[Kind::Time],
            likely: &TIMES,
            column: &options.time,
            unit: &options.time_unit,
            si: "s",
            may_be_absent: false,
        }),
        false => Ok(None),
    }
}

/// What drives it.
fn drive<R: BufRead, W: Write>(talk: &mut Talk<R, W>, options: &Options, motion: Motion, driven: Driven) -> Result<Signal, InitError> {
    let (force, position) = ([motion.pick(Kind::Force, Kind::Torque)], [motion.pick(Kind::Length, Kind::Angle), Kind::Count]);
    let (words, kinds, likely, si): (&str, &[Kind], &[&str], &str) = match driven {
        Driven::Force => ("Which column is the force or torque that drives it?", &force, &DRIVES, motion.pick("N", "N m")),
        Driven::Current => ("Which column is the motor's current?", &[Kind::Current], &CURRENTS, "A"),
        Driven::Motion => {
            ("Which column is the prescribed motion, a position or an angle?", &position, &POSITIONS, motion.pick("m", "rad"))
        }
    };
    let column =
        Asked { option: "drive", words, kinds, likely, column: &options.drive, unit: &options.drive_unit, si, may_be_absent: false };
    let mut drive = talk.signal(&column)?.ok_or_else(|| usage("give --drive: the column that drives it".to_string()))?;
    if driven == Driven::Current {
        let words =
            motion.pick("The motor's constant, N/A (with the gear's ratio)?", "The motor's constant, N m/A (with the gear's ratio)?");
        drive.scale = Some(talk.number("constant", words, options.constant, None)?);
        drive.name = talk.unique(motion.pick("motor_force", "motor_torque"));
    }
    if driven == Driven::Motion && is_count(&drive) {
        drive.scale = Some(per_count(talk, options, motion)?);
    }
    Ok(drive)
}

/// Whether a signal is read in counts of an encoder.
fn is_count(s: &Signal) -> bool {
    s.unit.or(s.column.unit).is_some_and(|u| u.kind == Kind::Count)
}

/// The size of a count, m or rad.
fn per_count<R: BufRead, W: Write>(talk: &mut Talk<R, W>, options: &Options, motion: Motion) -> Result<f64, InitError> {
    let words = motion.pick("The size of one count, m?", "The size of one count, rad? (6.2832 over the counts of a turn)");
    talk.number("per-count", words, options.per_count, None)
}

/// What the driven body holds on to, and where a load rings against it, Hz.
fn attached<R: BufRead, W: Write>(talk: &mut Talk<R, W>, options: &Options, driven: Driven) -> Result<(Attached, f64), InitError> {
    let attached = talk.one_of(
        "attached",
        "What is attached to the driven body: nothing (its bearing only), a spring to the frame (a specimen, a return spring), or a load \
         behind a compliant joint?",
        options.attached,
        Some(if driven == Driven::Motion { Attached::Spring } else { Attached::Nothing }),
    )?;
    let resonance = match attached {
        Attached::Load => talk.number(
            "resonance",
            "At which frequency does the load resonate against the motor, roughly, Hz?",
            options.resonance,
            Some(30.0),
        )?,
        Attached::Nothing | Attached::Spring => 30.0,
    };
    Ok((attached, resonance))
}

/// What is measured of a body that a force or a current drives.
fn position_and_velocity<R: BufRead, W: Write>(talk: &mut Talk<R, W>, options: &Options, plan: &mut Plan) -> Result<(), InitError> {
    plan.position = talk.signal(&Asked {
        option: "position",
        words: "Which column is the measured position (angle) of the driven body?",
        kinds: &[plan.motion.pick(Kind::Length, Kind::Angle), Kind::Count],
        likely: &POSITIONS,
        column: &options.position,
        unit: &options.position_unit,
        si: plan.motion.pick("m", "rad"),
        may_be_absent: true,
    })?;
    if let Some(position) = plan.position.as_mut().filter(|p| is_count(p)) {
        position.scale = Some(per_count(talk, options, plan.motion)?);
    }
    plan.velocity = talk.signal(&Asked {
        option: "velocity",
        words: "Which column is its measured velocity? (none, if it was computed from the position: it contains no new information)",
        kinds: &[plan.motion.pick(Kind::Speed, Kind::AngularSpeed)],
        likely: &VELOCITIES,
        column: &options.velocity,
        unit: &options.velocity_unit,
        si: plan.motion.pick("m/s", "rad/s"),
        may_be_absent: true,
    })?;
    Ok(())
}

/// The measured reaction of a prescribed motion, or the force in the joint to a load.
fn force<R: BufRead, W: Write>(
    talk: &mut Talk<R, W>,
    options: &Options,
    motion: Motion,
    driven: Driven,
) -> Result<Option<Signal>, InitError> {
    let is_reaction = driven == Driven::Motion;
    talk.signal(&Asked {
        option: "force",
        words: match is_reaction {
            true => "Which column is the measured reaction, the force (torque) that moves it?",
            false => "Which column is the measured force (torque) in the joint to the load?",
        },
        kinds: &[motion.pick(Kind::Force, Kind::Torque)],
        likely: &FORCES,
        column: &options.force,
        unit: &options.force_unit,
        si: motion.pick("N", "N m"),
        may_be_absent: !is_reaction,
    })
}

/// An option that has no place beside the others.
fn refuse(option: &str, given: &Option<String>, why: &str) -> Result<(), InitError> {
    match given.as_deref().filter(|text| *text != NONE) {
        Some(text) => Err(usage(format!("--{option} {text}: {why}"))),
        None => Ok(()),
    }
}

/// A question for a column.
struct Asked<'a> {
    option: &'a str,
    words: &'a str,
    /// What its unit may measure, the first unless a unit states another one.
    kinds: &'a [Kind],
    likely: &'a [&'a str],
    column: &'a Option<String>,
    unit: &'a Option<String>,
    si: &'a str,
    may_be_absent: bool,
}

struct Talk<'a, R, W> {
    asker: &'a mut Asker<R, W>,
    found: &'a Recordings,
    taken: Vec<Column>,
    names: Vec<String>,
}

impl<R: BufRead, W: Write> Talk<'_, R, W> {
    fn one_of<T: Choice>(&mut self, option: &str, words: &str, given: Option<T>, default: Option<T>) -> Result<T, InitError> {
        let name = |value: &T| value.word().to_string();
        let choices: Vec<String> = T::ALL.iter().map(|(word, _)| word.to_string()).collect();
        let list = choices.join(", ");
        let question = Question { option, words, choices, default: default.as_ref().map(name) };
        self.asker.ask(&question, given.as_ref().map(name), |text| T::of(text).ok_or_else(|| format!("expected one of {list}")))
    }

    fn number(&mut self, option: &str, words: &str, given: Option<f64>, default: Option<f64>) -> Result<f64, InitError> {
        let question = Question { option, words, choices: Vec::new(), default: default.map(|d| d.to_string()) };
        self.asker.ask(&question, given.map(|g| g.to_string()), |text| match text.parse::<f64>() {
            Ok(x) if x > 0.0 && x.is_finite() => Ok(x),
            _ => Err("expected a number above 0, such as 0.035".to_string()),
        })
    }

    fn signal(&mut self, asked: &Asked) -> Result<Option<Signal>, InitError> {
        let taken: Vec<&Column> = self.taken.iter().collect();
        let guess = self.found.guess(asked.kinds, asked.likely, &taken).map(|c| c.name.clone());
        let mut choices: Vec<String> = self.found.columns.iter().filter(|c| !taken.contains(c)).map(|c| c.name.clone()).collect();
        if asked.may_be_absent {
            choices.push(NONE.to_string());
        }
        let default = guess.or(asked.may_be_absent.then(|| NONE.to_string()));
        let question = Question { option: asked.option, words: asked.words, choices, default };
        let (found, taken) = (self.found, self.taken.clone());
        let column = self.asker.ask(&question, asked.column.clone(), |text| {
            if text == NONE && asked.may_be_absent {
                return Ok(None);
            }
            let column = found.column(text)?;
            if taken.contains(&column) {
                return Err("is used for another signal already".to_string());
            }
            let fits = column.unit.is_none_or(|unit| asked.kinds.contains(&unit.kind));
            let unit = column.unit.map_or(String::new(), |unit| format!("is in {}, {}", unit.name, unit.kind.text()));
            if fits { Ok(Some(column)) } else { Err(format!("{unit}, and {} is needed", either(asked.kinds))) }
        })?;
        let Some(column) = column else { return Ok(None) };
        let mut assumed = None;
        let unit = match (column.unit, asked.unit) {
            (Some(_), None) => None,
            (Some(unit), Some(other)) => return Err(usage(format!("--{}-unit {other}: the heading states {}", asked.option, unit.name))),
            (None, given) => {
                let option = format!("{}-unit", asked.option);
                let words = match &column.unknown_unit {
                    Some(unknown) => format!("In which unit is {}? The unit \"{unknown}\" of its heading is not known", column.name),
                    None => format!("In which unit is {}?", column.name),
                };
                // Many write the unit behind the name: `time_ms`.
                let behind = units::hinted(column.short_name()).filter(|unit| asked.kinds.contains(&unit.kind));
                let likely = behind.map_or(asked.si, |unit| unit.name);
                // What the heading states and is not known is no SI unit.
                let default = Some(likely.to_string()).filter(|_| column.unknown_unit.is_none());
                let question = Question { option: &option, words: &words, choices: Vec::new(), default };
                let is_stated = given.is_some() || behind.is_some() || column.is_si || !self.asker.takes_defaults();
                let unit = self.asker.ask(&question, given.clone(), |text| {
                    let unit = units::parse(text)?;
                    let fits = asked.kinds.contains(&unit.kind);
                    if fits { Ok(unit) } else { Err(format!("is {}, and {} is needed", unit.kind.text(), either(asked.kinds))) }
                })?;
                assumed = Some((option, unit)).filter(|_| !is_stated);
                Some(unit)
            }
        };
        self.taken.push(column.clone());
        let name = if asked.option == "time" { "t".to_string() } else { self.unique(column.short_name()) };
        // What is said once more in SI units needs no saying.
        let is_needed =
            |unit: &Unit| unit.factor != 1.0 || [Kind::Current, Kind::Count].contains(&unit.kind) || column.unknown_unit.is_some();
        let unit = unit.filter(is_needed);
        Ok(Some(Signal { name, column, unit, scale: None, assumed }))
    }

    /// A name that no other signal of the model has.
    fn unique(&mut self, name: &str) -> String {
        let tried = std::iter::once(name.to_string()).chain((2..).map(|n| format!("{name}_{n}")));
        let free = tried.into_iter().find(|name| !self.names.contains(name)).unwrap_or_default();
        self.names.push(free.clone());
        free
    }
}

fn either(kinds: &[Kind]) -> String {
    kinds.iter().map(|kind| kind.text()).collect::<Vec<_>>().join(" or ")
}
