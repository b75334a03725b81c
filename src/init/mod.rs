//! `backdrive init`: a model and a set for recordings of one's own, asked for, written and checked.

mod ask;
mod estimate;
mod found;
mod made;
mod plan;
mod stated;
mod write;

use crate::cli::{self, Attached, Driven, Start};
use crate::failure::Failure;
use crate::offered::Builder;
use crate::output;
use crate::output::may_replace;
use crate::recordings as sets;
use ask::{Asker, Question, usage};
use backdrive_bags::Reader;
use backdrive_diagnosis::audit::{self, Weight};
use backdrive_diagnosis::noise::step_of;
use backdrive_diagnosis::verdict::Remark;
use backdrive_plant::model::Hold;
use backdrive_plant::recording::{Piece, Recording, Source, read_csv};
use backdrive_report::number;
use backdrive_signal::statistics::rms;
use estimate::{Measured, Numbers, Shown, estimate};
use found::{Recordings, recordings};
use plan::{Plan, plan};
use serde_json::json;
use std::io::{BufRead, IsTerminal, Write};
use std::path::Path;
use write::Seen;

const MODEL: &str = "model.toml";
const SET: &str = "set.toml";
/// The answer of who does not know the inertia.
const ESTIMATE: &str = "estimate";

/// Asks, writes, checks, and says what to do next.
pub fn init(options: &cli::Init) -> Result<u8, Failure> {
    let (model, set) = (options.folder.join(MODEL), options.folder.join(SET));
    may_replace(&model, options.overwrite)?;
    may_replace(&set, options.overwrite)?;
    let found = recordings(options)?;
    // A bag has its times by itself.
    let made = cli::Init { time: None, time_unit: None, ..options.clone() };
    let options = if found.made.is_some() { &made } else { options };
    let stdin = std::io::stdin();
    let is_terminal = stdin.is_terminal() && std::io::stderr().is_terminal();
    let mut asker = Asker::new(stdin.lock(), std::io::stderr(), is_terminal, options.yes);
    let plan = plan(&mut asker, options, &found)?;
    let records = read(&plan, &found)?;
    let assumed = stated::check(&plan, &records)?;
    let seen = seen(&mut asker, options, &plan, &found, &records)?;

    let folder = options.folder.canonicalize().unwrap_or_else(|_| options.folder.clone());
    let name = folder.file_name().map_or("device".to_string(), |n| n.to_string_lossy().into_owned());
    if let Some(made) = &found.made {
        made.keep()?;
    }
    output::file(&model, write::model(&plan, &seen, &name))?;
    output::file(&set, write::set(&plan, &seen, MODEL))?;

    let wrote = format!("{} and {}", model.display(), set.display());
    let opened = sets::open(std::slice::from_ref(&options.folder), None, None, &[])
        .map_err(|e| Failure { code: e.code, message: format!("wrote {wrote}, and diagnose would refuse them: {}", e.message) })?;
    let remarks = audit::audit(&opened.problem);
    let next = Builder::verb("diagnose").reads(&options.folder).word("--out").reads_later(&options.folder.join("diagnosis")).build();
    if options.json {
        output::json(&json!({
            "model": model, "set": set, "fit": seen.fit, "held_out": seen.held_out,
            "start": { "inertia": seen.numbers.inertia, "damping": seen.numbers.damping, "stiffness": seen.numbers.stiffness, "from": seen.from },
            "doubt": seen.doubt, "assumed": assumed, "notes": opened.notes, "audit": remarks.iter().map(Remark::from).collect::<Vec<_>>(), "next": next,
        }))?;
        return Ok(0);
    }
    output::line(format_args!("read      {}", told_recordings(&seen, &records)))?;
    output::line(format_args!("start     {}", told_numbers(&plan, &seen)))?;
    let cautions: Vec<String> = remarks.iter().filter(|r| r.weight > Weight::Note).map(|r| r.to_string()).collect();
    let partial = found.partial.iter().map(|name| format!("{name}: is not in all of the recordings, so that it was not offered"));
    let told: Vec<String> = seen
        .doubt
        .clone()
        .into_iter()
        .chain(assumed)
        .chain(cautions)
        .chain(opened.notes)
        .chain(partial)
        .chain(found.unread.clone())
        .collect();
    if told.is_empty() {
        output::line("check     fine: diagnose takes them, and nothing in the recordings speaks against it")?;
    }
    for (index, text) in told.iter().enumerate() {
        output::line(format_args!("{:<9} {text}", if index == 0 { "check" } else { "" }))?;
    }
    if let Some(made) = &found.made {
        output::line(format_args!("made      {}: bags of the tables", made.names().join(", ")))?;
    }
    output::line(format_args!("wrote     {wrote}: look at them"))?;
    next.iter().try_for_each(|next| output::line(format_args!("next      {next}")))?;
    if is_terminal {
        // What an option cannot say is what happens without it.
        let sayable = asker.said().iter().filter(|(_, answer)| answer != ESTIMATE);
        let again = options
            .recording
            .iter()
            .fold(Builder::verb("init").reads(&options.folder), |again, file| again.word("--recording").reads(file));
        let of_tables = [
            ("columns", (!options.columns.is_empty()).then(|| options.columns.join(","))),
            ("rate", options.rate.map(|rate| rate.to_string())),
        ];
        let of_tables = of_tables.into_iter().filter_map(|(option, value)| Some((option, value?)));
        let again = of_tables.fold(again, |again, (option, value)| again.word(format!("--{option}")).word(value));
        let again = sayable.fold(again, |again, (option, answer)| again.word(format!("--{option}")).word(answer));
        // What was written now would be in its way.
        let again = again.flag("--yes").flag("--overwrite").build();
        again.iter().try_for_each(|again| output::line(format_args!("again     {again}")))?;
    }
    Ok(0)
}

/// The signals of every recording, in SI units.
fn read(plan: &Plan, found: &Recordings) -> Result<Vec<Recording>, Failure> {
    let columns = plan.columns();
    let names: Vec<&str> = columns.iter().map(|(name, _)| name.as_str()).filter(|name| *name != "t").collect();
    let one = |path: &Path| -> Result<Recording, Failure> {
        let recording = match plan.drive.column.source {
            Source::Column(_) => read_csv(path, Some(&names), &columns, &Piece::default())?,
            Source::Topic { .. } => {
                let reader = Reader::open(path).map_err(Failure::input)?;
                backdrive_bags::recording(&reader, Some(&names), &columns, &Piece::default(), &|_| Hold::Linear).map_err(Failure::input)?
            }
        };
        // What is looked at here stands on an even grid.
        if recording.is_regular(0.5) {
            Ok(recording)
        } else {
            recording.onto_grid(recording.period, |_| Hold::Linear).map_err(Failure::input)
        }
    };
    found.paths.iter().map(|path| one(path)).collect()
}

/// What the recordings show of what was not asked, and the last questions, whose defaults they tell.
fn seen<R: BufRead, W: Write>(
    asker: &mut Asker<R, W>,
    options: &cli::Init,
    plan: &Plan,
    found: &Recordings,
    records: &[Recording],
) -> Result<Seen, Failure> {
    let moving = match plan.driven {
        Driven::Motion => Some(&plan.drive),
        Driven::Force | Driven::Current => plan.position.as_ref(),
    };
    let begins = if records.iter().any(|r| begins_moving(r, moving.map(|s| s.name.as_str()), plan)) { "free" } else { "rest" };
    let question = Question {
        option: "start",
        words: "How does each recording begin: at rest at 0, or in a state that is to be estimated (free)?",
        choices: vec!["rest".to_string(), "free".to_string()],
        default: Some(begins.to_string()),
    };
    let start =
        asker.ask(&question, options.start.map(|s| if s == Start::Rest { "rest" } else { "free" }.to_string()), |text| match text {
            "rest" => Ok(Start::Rest),
            "free" => Ok(Start::Free),
            _ => Err("expected rest or free".to_string()),
        })?;

    let with_spring = plan.attached == Attached::Spring || plan.hand;
    let estimated = estimate(&shown(plan, records), with_spring);
    let question = Question {
        option: "inertia",
        words: plan
            .motion
            .pick("The moving mass, kg? (estimate: from the recordings)", "The moving inertia, kg m^2? (estimate: from the recordings)"),
        choices: Vec::new(),
        default: estimated.is_some().then(|| ESTIMATE.to_string()),
    };
    let inertia = asker.ask(&question, options.inertia.map(|x| x.to_string()), |text| match text.parse::<f64>() {
        Ok(x) if x > 0.0 && x.is_finite() => Ok(Some(x)),
        Err(_) if text == ESTIMATE && estimated.is_some() => Ok(None),
        _ => Err("expected a number above 0; the recordings do not tell it".to_string()),
    })?;
    let (numbers, from) = match (inertia, estimated) {
        (None, Some(numbers)) => (numbers, "estimated from the recordings by least squares"),
        (Some(inertia), Some(numbers)) => (Numbers { inertia, ..numbers }, "the inertia as given, the rest estimated from the recordings"),
        // A bearing that takes a second to stop, and a spring on which it swings once a second.
        (inertia, None) => {
            let inertia = inertia.unwrap_or(1.0);
            let stiffness = if with_spring { inertia * std::f64::consts::TAU.powi(2) } else { 0.0 };
            (Numbers { inertia, damping: inertia, stiffness }, "the inertia as given, the rest guessed")
        }
    };
    let doubt = inertia.zip(estimated).map(|(given, shown)| given / shown.inertia).filter(|f| !(1.0 / DOUBTED..=DOUBTED).contains(f)).map(|factor| {
        format!(
            "the inertia as given is {} times what the recordings show by themselves: is it, a unit, the motor's constant or the size of a count wrong?",
            number(factor)
        )
    });
    let encoder = plan.position.as_ref().map(|position| {
        let shows = records.iter().find_map(|r| r.signal(&position.name).and_then(step_of));
        options.resolution.or(position.scale.filter(|_| shows.is_some())).or(shows).unwrap_or(0.0)
    });
    let held_out = held_out(asker, options, plan, found, records)?;
    let (held_out, fit) = found.names.iter().cloned().partition(|name| Some(name) == held_out.as_ref());
    Ok(Seen { numbers, from, resolution: encoder.unwrap_or(0.0), start, fit, held_out, doubt })
}

/// Factor between an inertia as given and as estimated from which on one of them is doubted: friction alone does not make that much.
const DOUBTED: f64 = 3.0;

/// Beginnings that count as moving: a share of the usual speed, or of the whole travel away from 0.
const MOVING: f64 = 0.2;
const AWAY: f64 = 0.02;

/// Whether a recording begins in motion or away from 0.
fn begins_moving(record: &Recording, position: Option<&str>, plan: &Plan) -> bool {
    if let Some(x) = position.and_then(|name| record.signal(name)) {
        let first = x.first().copied().unwrap_or(0.0);
        let (low, high) = x.iter().fold((first, first), |(low, high), x| (low.min(*x), high.max(*x)));
        let apart = (x.len() / 500).max(3);
        let steps: Vec<f64> = x.iter().zip(x.iter().skip(apart)).map(|(a, b)| b - a).collect();
        // Two steps of an encoder are no motion yet.
        let least = 2.0 * step_of(x).unwrap_or(0.0);
        let begun = steps.first().copied().unwrap_or(0.0).abs();
        return begun > (MOVING * rms(&steps)).max(least) || first.abs() > (AWAY * (high - low)).max(least);
    }
    let velocity = plan.velocity.as_ref().and_then(|v| record.signal(&v.name)).unwrap_or_default();
    velocity.first().is_some_and(|v| v.abs() > MOVING * rms(velocity))
}

/// What an estimate is told of each recording.
fn shown<'a>(plan: &Plan, records: &'a [Recording]) -> Vec<Shown<'a>> {
    let signal = |record: &'a Recording, name: &str| record.signal(name);
    let one = |record: &'a Recording| -> Option<Shown<'a>> {
        let drive = signal(record, &plan.drive.name)?;
        let (force, motion) = match plan.driven {
            Driven::Motion => (signal(record, &plan.force.as_ref()?.name)?, Measured::Position(drive)),
            Driven::Force | Driven::Current => match (&plan.position, &plan.velocity) {
                (Some(position), _) => (drive, Measured::Position(signal(record, &position.name)?)),
                (None, Some(velocity)) => (drive, Measured::Velocity(signal(record, &velocity.name)?)),
                (None, None) => return None,
            },
        };
        Some(Shown { period: record.period, force, motion })
    };
    records.iter().filter_map(one).collect()
}

/// The recording that no fit sees: as asked, else one that is driven neither most nor least, so that what was fitted lies on both sides of it.
fn held_out<R: BufRead, W: Write>(
    asker: &mut Asker<R, W>,
    options: &cli::Init,
    plan: &Plan,
    found: &Recordings,
    records: &[Recording],
) -> Result<Option<String>, Failure> {
    if found.names.len() < 2 {
        return match &options.held_out {
            Some(file) => {
                Err(usage(format!("--held-out {}: is the only recording; what is held out has to be another one", file.display())))
            }
            None => Ok(None),
        };
    }
    let level = |record: &Recording| {
        let samples = record.signal(&plan.drive.name).unwrap_or_default();
        samples.iter().map(|x| x * x).sum::<f64>() / samples.len().max(1) as f64
    };
    let mut order: Vec<(f64, &String)> = records.iter().map(level).zip(&found.names).collect();
    order.sort_by(|a, b| a.0.total_cmp(&b.0));
    let middle = order.get((order.len() - 1) / 2).map(|(_, name)| (*name).clone());
    let words = "Which recording is held out, so that no fit sees it?";
    let question = Question { option: "held-out", words, choices: found.names.clone(), default: middle };
    let given = options.held_out.as_ref().map(|path| path.display().to_string());
    let list = found.names.join(", ");
    let chosen = asker.ask(&question, given, |text| {
        let named = Path::new(text).file_name();
        let is = |name: &&String| name.as_str() == text || Path::new(name).file_name() == named;
        found.names.iter().find(is).cloned().ok_or_else(|| format!("is none of the recordings, {list}"))
    })?;
    Ok(Some(chosen))
}

fn told_recordings(seen: &Seen, records: &[Recording]) -> String {
    let samples: usize = records.iter().map(Recording::len).sum();
    let held = match seen.held_out.as_slice() {
        [] => "none held out: record a second one".to_string(),
        names => format!("{} held out", names.join(", ")),
    };
    let rate = records.first().map_or(0.0, |r| 1.0 / r.period);
    format!("{} recordings ({held}), {samples} samples, the first at {} Hz", records.len(), number(rate))
}

fn told_numbers(plan: &Plan, seen: &Seen) -> String {
    let (mass, damps, holds) = plan.motion.pick(("kg", "N s/m", "N/m"), ("kg m^2", "N m s/rad", "N m/rad"));
    let Numbers { inertia, damping, stiffness } = seen.numbers;
    let spring = if stiffness > 0.0 { format!(", stiffness {} {holds}", number(stiffness)) } else { String::new() };
    format!("inertia {} {mass}, damping {} {damps}{spring}: {}", number(inertia), number(damping), seen.from)
}
