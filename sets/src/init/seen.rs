//! What the recordings show of what was not asked, and the last questions, whose defaults they tell.

use super::ask::{Asker, Question, usage};
use super::error::InitError;
use super::estimate::{Measured, Numbers, Shown, estimate};
use super::found::Recordings;
use super::options::{Attached, Choice, Driven, Options, Start};
use super::plan::Plan;
use super::write::Seen;
use backdrive_bags::Reader;
use backdrive_diagnosis::recordings::noise::step_of;
use backdrive_plant::model::Hold;
use backdrive_plant::recording::{Piece, Recording, Source, read_csv};
use backdrive_report::number;
use backdrive_signal::statistics::rms;
use std::io::{BufRead, Write};
use std::path::Path;

/// The answer of who does not know the inertia.
pub const ESTIMATE: &str = "estimate";

/// The signals of every recording, in SI units.
pub(crate) fn read(plan: &Plan, found: &Recordings) -> Result<Vec<Recording>, InitError> {
    let columns = plan.columns();
    let names: Vec<&str> = columns.iter().map(|(name, _)| name.as_str()).filter(|name| *name != "t").collect();
    let one = |path: &Path| -> Result<Recording, InitError> {
        let recording = match plan.drive.column.source {
            Source::Column(_) => read_csv(path, Some(&names), &columns, &Piece::default())?,
            Source::Topic { .. } => {
                let reader = Reader::open(path).map_err(InitError::input)?;
                backdrive_bags::recording(&reader, Some(&names), &columns, &Piece::default(), &|_| Hold::Linear)
                    .map_err(InitError::input)?
            }
        };
        // What is looked at here stands on an even grid.
        if recording.is_regular(0.5) {
            Ok(recording)
        } else {
            recording.onto_grid(recording.period, |_| Hold::Linear).map_err(InitError::input)
        }
    };
    found.paths.iter().map(|path| one(path)).collect()
}

/// What the recordings show of what was not asked, and the last questions, whose defaults they tell.
pub(crate) fn seen<R: BufRead, W: Write>(
    asker: &mut Asker<R, W>,
    options: &Options,
    plan: &Plan,
    found: &Recordings,
    records: &[Recording],
) -> Result<Seen, InitError> {
    let moving = match plan.driven {
        Driven::Motion => Some(&plan.drive),
        Driven::Force | Driven::Current => plan.position.as_ref(),
    };
    let moves = records.iter().any(|r| begins_moving(r, moving.map(|s| s.name.as_str()), plan));
    let begins = if moves { Start::Free } else { Start::Rest };
    let question = Question {
        option: "start",
        words: "How does each recording begin: at rest at 0, or in a state that is to be estimated (free)?",
        choices: vec![Start::Rest.word().to_string(), Start::Free.word().to_string()],
        default: Some(begins.word().to_string()),
    };
    let start = asker.ask(&question, options.start.map(|s| s.word().to_string()), |text| {
        Start::of(text).ok_or_else(|| "expected rest or free".to_string())
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
        _ => Err("expected a number above 0; it cannot be estimated from the recordings".to_string()),
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
    let doubt = inertia.zip(estimated).map(|(given, shown)| given / shown.inertia).filter(|f| !(1.0 / DOUBTED..=DOUBTED).contains(f)).map(
        |factor| {
            format!(
                "the given inertia is {} times the estimate from the recordings: is it, a unit, the motor constant or the size of a count \
                wrong?",
                number(factor)
            )
        },
    );
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

/// The data of each recording that an estimate receives.
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
    options: &Options,
    plan: &Plan,
    found: &Recordings,
    records: &[Recording],
) -> Result<Option<String>, InitError> {
    if found.names.len() < 2 {
        return match &options.held_out {
            Some(file) => {
                Err(usage(format!("--held-out {}: is the only recording; at least one other is needed for the fit", file.display())))
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
    let words = "Which recording is held out, so that no fit uses it?";
    let question = Question { option: "held-out", words, choices: found.names.clone(), default: middle };
    let given = options.held_out.as_ref().map(|path| path.display().to_string());
    let list = found.names.join(", ");
    let chosen = asker.ask(&question, given, |text| {
        let named = Path::new(text).file_name();
        let is = |name: &&String| name.as_str() == text || Path::new(name).file_name() == named;
        found.names.iter().find(is).cloned().ok_or_else(|| format!("is not one of the recordings, {list}"))
    })?;
    Ok(Some(chosen))
}
