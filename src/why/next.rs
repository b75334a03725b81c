//! What to do after an answer: the remedies that stop the loop, each with the commands that try it.

use crate::cli::{Cli, Command};
use crate::offered::{Builder, Offered, Step};
use backdrive_bags::free;
use backdrive_nodes::graph::Overrides;
use backdrive_pages::parts::large;
use backdrive_report::percent;
use backdrive_why::answer::Answer;
use backdrive_why::happening::Happening;
use backdrive_why::options::Word;
use backdrive_why::remedy::Remedy;
use clap::Parser;
use std::path::{Path, PathBuf};

/// Remedies that are proposed.
const PROPOSED: usize = 3;

/// What was asked, as far as commands need it.
pub struct Asked<'a> {
    /// The recording.
    pub recording: &'a Path,
    /// The roles file of a recording that is not ours.
    pub roles: Option<&'a Path>,
    /// Where the master as recorded has been written, if it has.
    pub master: Option<&'a Path>,
    /// Whether the graph of the bag takes such changes.
    pub takes: &'a dyn Fn(&Overrides) -> bool,
    /// Whether the graph of the bag can be run from the bag alone.
    pub runs: bool,
}

/// What to do, the best first.
pub fn next(found: &Answer, asked: &Asked) -> Vec<Step> {
    let stop: Vec<&Remedy> = found.remedies.iter().filter(|r| r.stops).take(PROPOSED).collect();
    let mut steps: Vec<Step> = stop.iter().map(|remedy| Step::new(sentence(found, remedy), commands(found, asked, remedy))).collect();
    if let Some(run) = stop.iter().find_map(|remedy| run(found, asked, remedy)) {
        let text = "When the replay does what you want, run the bag's graph with it: every option of the recorded run stays as recorded.";
        steps.push(Step::new(text, [Some(run)]));
    }
    if stop.is_empty() && found.happening.is_trouble() {
        let dithered = asked.runs.then(|| {
            let bag = free(Path::new("dithered.mcap"));
            let run = Builder::verb("run").reads(asked.recording).flag("--dither").option_writes("--bag", &bag).flag("--overwrite").build();
            [run, Builder::verb("stability").reads_later(&bag).build()]
        });
        let text = if found.remedies.is_empty() && !found.reproduced {
            "The re-simulation with the models in the bag does not oscillate, so no remedy could be tried. Correct the differences, or \
                record the loop with a dither and measure its stability limit."
        } else {
            "None of the tried remedies stabilises the re-simulation. Record the loop with a dither and measure its stability limit."
        };
        steps.push(Step::new(text, dithered.into_iter().flatten()));
    }
    if let Happening::NotJudged { why } = found.happening {
        steps.push(Step::said(why.advice()));
    }
    steps
}

/// The commands that try a remedy, in their order; none where the command line cannot make the recorded loop with it.
pub fn commands(found: &Answer, asked: &Asked, remedy: &Remedy) -> Vec<Option<Offered>> {
    if let Some(roles) = asked.roles {
        // No loop can be run again; the measured one is asked at the lower gain.
        let gain = format!("{:.4}", found.gain * remedy.force_kept);
        return vec![Builder::verb("stability").reads(asked.recording).option_reads("--roles", roles).option("--gain", gain).build()];
    }
    if found.differences.is_empty() {
        return vec![with(Builder::verb("replay").reads(asked.recording), asked, remedy, None)];
    }
    // Of what is not as the graph states, only another master or another slave can be put into a replay.
    let of_device = |d: &backdrive_why::difference::Difference| d.device.as_ref().is_some_and(|device| device.files.is_some());
    let other = match (&found.master, &found.slave) {
        (Some(_), None) => "master",
        (None, Some(_)) => "slave",
        _ => return Vec::new(),
    };
    if !found.differences.iter().all(|d| of_device(d) && d.kind.name() == other) {
        return Vec::new();
    }
    let (file, write) = match asked.master {
        Some(file) => (file.to_path_buf(), None),
        None => {
            let stem = asked.recording.file_stem().map_or_else(String::new, |s| s.to_string_lossy().into_owned());
            let file: PathBuf = free(&PathBuf::from(format!("{stem}-{other}.toml")));
            (file.clone(), Some(Builder::verb("why").reads(asked.recording).option_writes("--out", &file).build()))
        }
    };
    let replay = Builder::verb("replay").reads(asked.recording).word(format!("--{other}")).reads_later(&file);
    let replay = if other == "master" { replay.option("--grip", "none") } else { replay };
    write.into_iter().chain([with(replay, asked, remedy, Some(&file))]).collect()
}

/// The graph of the bag, run with a remedy.
fn run(found: &Answer, asked: &Asked, remedy: &Remedy) -> Option<Offered> {
    if !asked.runs || !found.differences.is_empty() {
        return None;
    }
    with(Builder::verb("run").reads(asked.recording), asked, remedy, None)
}

/// A command with the options of a remedy, if the graph of the bag takes them.
fn with(command: Builder, asked: &Asked, remedy: &Remedy, master: Option<&Path>) -> Option<Offered> {
    let words: Option<Vec<String>> = remedy
        .options
        .as_ref()?
        .iter()
        .map(|word| match word {
            Word::Text(text) => Some(text.clone()),
            Word::MasterFile => master.map(|path| path.display().to_string()),
        })
        .collect();
    let words = words?;
    // A file that is written first cannot be looked at yet.
    let names_file = remedy.options.iter().flatten().any(|word| *word == Word::MasterFile);
    (names_file || changes(&words).is_some_and(|changes| (asked.takes)(&changes))).then_some(())?;
    command.words(words).build()
}

/// Options of `replay` as a graph takes them.
fn changes(words: &[String]) -> Option<Overrides> {
    let all = ["backdrive", "replay", "bag"].into_iter().chain(words.iter().map(String::as_str));
    match Cli::try_parse_from(all).ok()?.command {
        Command::Replay(options) => Some(options.changes.overrides(None)),
        _ => None,
    }
}

fn sentence(found: &Answer, remedy: &Remedy) -> String {
    if let Happening::FollowerStairs { .. } = found.happening {
        return format!("{}: {} (the slave alone, on its recorded commands).", large(&remedy.text), remedy.outcome);
    }
    let hands = match remedy.robust {
        true => "also with 0.7 to 1.5 times the grip, on walls of 0.5 to 2 times the stiffness, and with 25 % more gain",
        false => "with this grip and this gain only",
    };
    let throws = remedy.throws.as_ref().map_or_else(String::new, |throw| format!("; {throw}"));
    format!(
        "{}: {}, {hands}; {} of the force and {} of the motion remain{throws}.",
        large(&remedy.text),
        remedy.outcome,
        percent(remedy.force_kept),
        percent(remedy.motion_kept)
    )
}
