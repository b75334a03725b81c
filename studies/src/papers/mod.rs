//! The papers' own stories, blind: recordings made with a paper's last model, handed over with its first one.
//!
//! [`Story::record`] writes recordings, set and first model into the folder `set` of the results, and what is true into `truth.json` beside that
//! folder. [`walk`] diagnoses from the first model, replaces the first model by the found one and repeats this, until nothing is missing. Only then
//! [`score`] opens `truth.json`.

pub(crate) mod ball_screw;
pub(crate) mod engine_bench;
pub(crate) mod impulse_engine;
pub(crate) mod steering_compensator;

use crate::error::failed;
use crate::run::{Ask, diagnose, findings, read, said, write};
use crate::table::Report;
use crate::{Context, StudyError, csv_columns};
use backdrive_diagnosis::verdict::{MODEL_FILE, Verdict};
use backdrive_plant::excitation::Excitation;
use backdrive_plant::model::{Hold, InputKind, Model};
use backdrive_plant::stepper::{Options, simulate};
use serde_json::{Value, json};
use std::path::{Path, PathBuf};

/// The set of a story, in its results.
const SET: &str = "set";
/// What is true, beside the set.
const TRUTH: &str = "truth.json";
/// Samples of the true device for each that is recorded.
const FINER: usize = 8;

/// A step of a paper's path: effects that its last model has and its first one has not.
pub(super) struct Step {
    /// The paper's value.
    pub paper: &'static str,
    /// Names of effects that are this one, or that this one is a case of.
    pub accept: &'static [&'static str],
    /// The place, and others at which it is the same device for its driver and its measurements.
    pub places: &'static [[&'static str; 2]],
}

/// What drives the device in one recording.
pub(super) struct Drive {
    /// File name without its ending.
    pub name: &'static str,
    /// Whether no fit sees it.
    pub held_out: bool,
    /// For each input of the model an excitation as a command line has it; empty for one that stays at 0.
    pub inputs: Vec<String>,
}

/// A device, what it is taken for, and how it is driven.
pub(super) struct Story<'a> {
    /// The device.
    pub truth: Model,
    /// What it is taken for.
    pub first: &'a Model,
    /// Samples per second of the recordings.
    pub rate: f64,
    /// The recordings.
    pub drives: &'a [Drive],
    /// What is to be found.
    pub steps: &'a [Step],
}

/// A model of the project.
pub(super) fn device(name: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../plant/models").join(name)
}

impl Story<'_> {
    /// Writes set and truth into `out`, which is made.
    pub fn record(&self, out: &Path) -> Result<(), StudyError> {
        let set = out.join(SET);
        std::fs::create_dir_all(&set).map_err(|e| StudyError::File(format!("{}: cannot be made: {e}", set.display())))?;
        for (number, drive) in self.drives.iter().enumerate() {
            let columns = self.run(drive, number as u64)?;
            let count = columns.first().map_or(0, Vec::len);
            let t: Vec<f64> = (0..count).map(|k| k as f64 / self.rate).collect();
            let signals = self.truth.inputs.iter().map(|i| i.name.as_str()).chain(self.truth.outputs.iter().map(|o| o.name.as_str()));
            let names: Vec<&str> = std::iter::once("t").chain(signals).collect();
            let all: Vec<&[f64]> = std::iter::once(t.as_slice()).chain(columns.iter().map(Vec::as_slice)).collect();
            csv_columns::write(&set.join(format!("{}.csv", drive.name)), &names, &all)?;
        }
        write(&set.join("model.toml"), &self.first.to_toml())?;
        let of = |held_out: bool| -> Vec<String> {
            self.drives.iter().filter(|d| d.held_out == held_out).map(|d| format!("{}.csv", d.name)).collect()
        };
        write(&set.join("set.toml"), &format!("model = \"model.toml\"\nfit = {:?}\nheld_out = {:?}\n", of(false), of(true)))?;
        let steps: Vec<Value> = self.steps.iter().map(|s| json!({ "paper": s.paper, "accept": s.accept, "places": s.places })).collect();
        let truth = json!({ "steps": steps, "model": self.truth.to_toml() });
        write(&out.join(TRUTH), &format!("{}\n", serde_json::to_string_pretty(&truth).map_err(failed)?))
    }

    /// Columns of the inputs and the outputs, as they are recorded.
    fn run(&self, drive: &Drive, seed: u64) -> Result<Vec<Vec<f64>>, StudyError> {
        let fine = self.rate * FINER as f64;
        let excitations: Vec<Option<Excitation>> = drive
            .inputs
            .iter()
            .map(|text| (!text.is_empty()).then(|| text.parse()).transpose())
            .collect::<Result<_, _>>()
            .map_err(failed)?;
        let seconds = excitations.iter().flatten().map(Excitation::duration).fold(0.0, f64::max);
        let count = (seconds * self.rate).round() as usize * FINER;
        let mut inputs = Vec::new();
        for (input, excitation) in self.truth.inputs.iter().zip(&excitations) {
            let mut column = match excitation {
                None => vec![0.0; count],
                // A servo holds its force from sample to sample; everything else runs on in between.
                Some(e) if input.kind == InputKind::Force && input.hold == Hold::Zero => {
                    let samples = e.samples(self.rate).map_err(failed)?;
                    samples.into_iter().flat_map(|x| std::iter::repeat_n(x, FINER)).collect()
                }
                Some(e) => e.samples(fine).map_err(failed)?,
            };
            column.resize(count, 0.0);
            inputs.push(column);
        }
        let options = Options { add_noise: Some(seed), quantise: true, ..Options::default() };
        let outputs = simulate(&self.truth, &inputs, 1.0 / fine, &options).map_err(failed)?;
        Ok(inputs.iter().chain(&outputs).map(|column| column.iter().step_by(FINER).copied().collect()).collect())
    }
}

/// How far a walk goes.
pub(super) struct Walk<'a> {
    /// How many effects the diagnoses from the first model may add at once: one diagnosis for each of these numbers.
    pub effects: &'a [usize],
    /// How often the found model replaces the one before, at most.
    pub again: usize,
    /// s, how long one diagnosis searches at most.
    pub effort: f64,
}

/// What a diagnosis named.
pub(super) struct Named {
    /// The effect.
    pub physics: String,
    /// The place.
    pub place: String,
    /// Folder of the diagnosis.
    pub by: String,
    /// Whether it was claimed; else it is only the nearest to what is unexplained.
    pub claimed: bool,
}

impl Named {
    fn text(&self) -> String {
        let how = if self.claimed { "" } else { "nearest: " };
        format!("{how}{} at {} ({})", self.physics, self.place, self.by)
    }
}

/// What a walk came to.
pub(super) struct Walked {
    /// What was named on the way to the last model.
    pub named: Vec<Named>,
    /// Folder of the diagnosis from the first model that predicted the held-out records best.
    pub best: String,
}

/// The set of `out` diagnosed from the first model; then from the found one that predicts the held-out records best, and so on until nothing is
/// missing.
pub(super) fn walk(report: &mut Report, outer: &Context, walk: &Walk) -> Result<Walked, StudyError> {
    let out = outer.out;
    let set = out.join(SET);
    let context = Context { folder: &set, data: &set, out, quick: false, longer: outer.longer };
    let mut stage = |name: &str, model: &str, effects: usize| -> Result<Verdict, StudyError> {
        let ask = Ask { name, set: "set.toml", model, without: &[], effects, effort: walk.effort };
        let verdict = diagnose(&context, &ask)?.verdict;
        told(report, name, &verdict);
        Ok(verdict)
    };
    let mut best: Option<(f64, String, usize, Verdict)> = None;
    for effects in walk.effects {
        let name = format!("effects-{effects}");
        let verdict = stage(&name, "model.toml", *effects)?;
        let error = verdict.held_out.nrmse_after.unwrap_or(f64::NAN);
        if best.as_ref().is_none_or(|(least, ..)| error < *least) {
            best = Some((error, name, *effects, verdict));
        }
    }
    let Some((_, best, effects, mut verdict)) = best else { return Err(failed("a walk without a diagnosis")) };
    let (mut named, mut by) = (Vec::new(), best.clone());
    for round in 1..=walk.again + 1 {
        let claimed = verdict.word.claims();
        let new = findings(&verdict);
        if new.is_empty() {
            break;
        }
        named.extend(new.into_iter().map(|(physics, place)| Named { physics, place, by: by.clone(), claimed }));
        if round > walk.again {
            break;
        }
        let model = format!("found-{round}.toml");
        write(&set.join(&model), &read(&out.join(&by).join(MODEL_FILE))?)?;
        by = format!("again-{round}");
        verdict = stage(&by, &model, effects)?;
    }
    Ok(Walked { named, best })
}

/// A line of a diagnosis: its verdict, the held-out error as given and as diagnosed.
fn told(report: &mut Report, name: &str, verdict: &Verdict) {
    let held = &verdict.held_out;
    let [before, refit, after, floor] =
        [held.nrmse_before, held.nrmse_refit, held.nrmse_after, held.noise_floor].map(|error| error.unwrap_or(f64::NAN));
    let text = format!("held-out error {before:.4} -> {after:.4}");
    let beside = format!("refitted alone {refit:.4}, noise floor {floor:.4}");
    report.line(name, said(verdict), text, &beside, None);
    report.figure(&format!("{name} before"), before);
    report.figure(&format!("{name} after"), after);
    report.figure(&format!("{name} floor"), floor);
    report.word(name, &said(verdict));
}

/// Holds what was named against what is true: how many of the paper's steps were found.
pub(super) fn score(report: &mut Report, out: &Path, paper: &str, walked: &Walked) -> Result<usize, StudyError> {
    let path = out.join(TRUTH);
    let truth: Value = serde_json::from_str(&read(&path)?).map_err(|e| StudyError::File(format!("{}: {e}", path.display())))?;
    let (mut hits, mut used) = (0, vec![false; walked.named.len()]);
    for step in truth["steps"].as_array().into_iter().flatten() {
        let text = |value: &Value| value.as_str().unwrap_or("").to_string();
        let accept: Vec<String> = step["accept"].as_array().into_iter().flatten().map(text).collect();
        let ends: Vec<[String; 2]> = step["places"].as_array().into_iter().flatten().map(|ends| [text(&ends[0]), text(&ends[1])]).collect();
        let at = |place: &str| ends.iter().any(|[a, b]| place == format!("{a}-{b}") || place == format!("{b}-{a}"));
        let place = ends.first().map_or(String::new(), |[a, b]| format!("{a}-{b}"));
        let hit = walked.named.iter().position(|n| accept.contains(&n.physics) && at(&n.place));
        let measured = hit.and_then(|i| walked.named.get(i)).map_or("not named".to_string(), Named::text);
        let claimed = hit.and_then(|i| walked.named.get(i)).is_some_and(|n| n.claimed);
        if let Some(i) = hit {
            used[i] = true;
        }
        hits += usize::from(claimed);
        report.line(&format!("at {place}"), measured, text(&step["paper"]), paper, Some(claimed));
    }
    let beside: Vec<String> = walked.named.iter().zip(&used).filter(|(_, used)| !**used).map(|(n, _)| n.text()).collect();
    let text = if beside.is_empty() { "nothing".to_string() } else { beside.join(", ") };
    report.line("named beside these", text, "nothing", paper, Some(beside.is_empty()));
    report.figure("steps found", hits as f64);
    report.figure("named beside", beside.len() as f64);
    Ok(hits)
}
