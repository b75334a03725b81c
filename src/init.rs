//! `backdrive init`: a model and a set for recordings of one's own, asked for, written and checked.

use crate::cli;
use crate::failure::{Failure, code};
use crate::offered::Builder;
use crate::output::{self, may_replace};
use backdrive_diagnosis::audit::{self, Weight};
use backdrive_diagnosis::verdict::Remark;
use backdrive_plant::recording::Recording;
use backdrive_report::number;
use backdrive_sets::init::ask::Asker;
use backdrive_sets::init::estimate::Numbers;
use backdrive_sets::init::options::Options;
use backdrive_sets::init::plan::Plan;
use backdrive_sets::init::{ESTIMATE, InitError, Prepared, Seen, prepare};
use backdrive_sets::open::open;
use serde_json::json;
use std::io::IsTerminal;

const MODEL: &str = "model.toml";
const SET: &str = "set.toml";

/// Asks, writes, checks, and prints what to do next.
pub fn init(options: &cli::Init) -> Result<u8, Failure> {
    let (model, set) = (options.folder.join(MODEL), options.folder.join(SET));
    may_replace(&model, options.overwrite)?;
    may_replace(&set, options.overwrite)?;
    let stdin = std::io::stdin();
    let is_terminal = stdin.is_terminal() && std::io::stderr().is_terminal();
    let mut asker = Asker::new(stdin.lock(), std::io::stderr(), is_terminal, options.yes);
    let prepared = prepare(&mut asker, &resolved(options))?;

    let folder = options.folder.canonicalize().unwrap_or_else(|_| options.folder.clone());
    let name = folder.file_name().map_or("device".to_string(), |n| n.to_string_lossy().into_owned());
    let made = prepared.keep()?;
    output::file(&model, prepared.model(&name))?;
    output::file(&set, prepared.set(MODEL))?;
    let partial = prepared.partial().iter().map(|name| format!("{name}: is not in all recordings, so it was not offered"));
    let (partial, unread): (Vec<String>, _) = (partial.collect(), prepared.unread().to_vec());
    let Prepared { plan, seen, records, assumed, .. } = prepared;

    let wrote = format!("{} and {}", model.display(), set.display());
    let opened = open(&options.folder.as_path().into(), None, None, &[])
        .map_err(|e| Failure::input(format!("wrote {wrote}, but diagnose would refuse them: {e}")))?;
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
    let told: Vec<String> =
        seen.doubt.clone().into_iter().chain(assumed).chain(cautions).chain(opened.notes).chain(partial).chain(unread).collect();
    if told.is_empty() {
        output::line("check     passed: diagnose accepts the files, and the recordings show no problem")?;
    }
    for (index, text) in told.iter().enumerate() {
        output::line(format_args!("{:<9} {text}", if index == 0 { "check" } else { "" }))?;
    }
    if !made.is_empty() {
        output::line(format_args!("made      {}: bags of the tables", made.join(", ")))?;
    }
    output::line(format_args!("wrote     {wrote}: check them"))?;
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

/// The options of the work.
fn resolved(asked: &cli::Init) -> Options {
    let asked = asked.clone();
    Options {
        folder: asked.folder,
        recording: asked.recording,
        held_out: asked.held_out,
        columns: asked.columns,
        rate: asked.rate,
        motion: asked.motion,
        driven: asked.driven,
        drive: asked.drive,
        drive_unit: asked.drive_unit,
        constant: asked.constant,
        time: asked.time,
        time_unit: asked.time_unit,
        position: asked.position,
        position_unit: asked.position_unit,
        per_count: asked.per_count,
        resolution: asked.resolution,
        velocity: asked.velocity,
        velocity_unit: asked.velocity_unit,
        force: asked.force,
        force_unit: asked.force_unit,
        attached: asked.attached,
        resonance: asked.resonance,
        hand: asked.hand,
        inertia: asked.inertia,
        start: asked.start,
        yes: asked.yes,
        overwrite: asked.overwrite,
    }
}

impl From<InitError> for Failure {
    fn from(error: InitError) -> Failure {
        match error {
            InitError::Usage(message) => Failure { code: code::USAGE, message },
            InitError::Input(message) => Failure::input(message),
            InitError::Machine(message) => Failure::machine(message),
            InitError::Bag(error) => Failure::bag(error),
        }
    }
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
