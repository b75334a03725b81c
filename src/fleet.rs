//! `backdrive fleet`: many recordings of many units, and what changed on which unit since when.

use crate::failure::{Failure, code};
use crate::{cli, interrupt, output, progress};
use backdrive_fleet::analysis::{Analysis, analyse};
use backdrive_fleet::error::FleetError;
use backdrive_fleet::manifest::Manifest;
use backdrive_fleet::store::{Done, Progress, Store, Version, Work, run};
use backdrive_fleet::table::{self, Table};
use backdrive_fleet::what::What;
use serde_json::{Value, json};
use std::path::{Path, PathBuf};
use std::sync::atomic::AtomicBool;
use std::time::{Duration, Instant};

/// Recordings and sentences that a terminal lists at most.
const LISTED: usize = 20;

/// Answers for every recording, and prints what they show together.
pub fn fleet(options: &cli::Fleet) -> Result<u8, Failure> {
    if let Some(html) = &options.html {
        output::writable(html)?;
    }
    let is_table = options.manifest.extension().is_some_and(|e| e.eq_ignore_ascii_case("parquet"));
    let found = match (&options.out, is_table) {
        (_, true) => Surveyed::of_table(&options.manifest, options.false_discoveries)?,
        (Some(out), false) => {
            let stop = interrupt::heard()?;
            let asked = Survey {
                manifest: options.manifest.clone(),
                model: options.model.clone(),
                what: options.what,
                shard: options.shard,
                jobs: options.jobs,
                out: out.clone(),
                false_discoveries: options.false_discoveries,
            };
            Surveyed::of(&asked, &stop)?
        }
        (None, false) => {
            let message = "--out DIR is missing: it names the folder for the answers and the table".to_string();
            return Err(Failure { code: code::USAGE, message });
        }
    };
    if options.json {
        output::json(&found.json()?)?;
    } else {
        output::text(found.text())?;
    }
    if let (Some(html), Some(page)) = (&options.html, found.page()) {
        output::page(html, page)?;
        output::note(format_args!("wrote {}", html.display()));
    }
    Ok(found.code())
}

/// What is asked of a fleet.
pub struct Survey {
    /// Manifest, folder or dataset.
    pub manifest: PathBuf,
    /// The model of recordings for which the manifest names none.
    pub model: Option<PathBuf>,
    /// What is asked of each recording.
    pub what: What,
    /// Which shard, from 1, of how many.
    pub shard: (usize, usize),
    /// Threads; 0 for one a core.
    pub jobs: usize,
    /// Folder for the answers.
    pub out: PathBuf,
    /// False discovery rate.
    pub false_discoveries: f64,
}

/// What was found of a fleet.
pub struct Surveyed {
    done: Option<Done>,
    shard: (usize, usize),
    file: Option<PathBuf>,
    table: Option<Table>,
    analysis: Option<Analysis>,
}

impl Surveyed {
    /// Answers for the recordings of a shard, and analyses the table once it is whole.
    ///
    /// # Errors
    /// The manifest or a model is wrong, a file cannot be written, or it was stopped.
    pub fn of(asked: &Survey, stop: &AtomicBool) -> Result<Surveyed, Failure> {
        let manifest = Manifest::open(&asked.manifest, asked.model.as_deref())?;
        let store = Store::open(&asked.out)?;
        let work = Work {
            manifest: &manifest,
            what: asked.what,
            shard: asked.shard,
            jobs: asked.jobs,
            version: Version(env!("BACKDRIVE_VERSION").to_string()),
        };
        let bar = progress::work();
        bar.set_message(asked.what.name());
        let begun = Instant::now();
        let hear = |now: Progress| {
            bar.set_length(now.all.max(1) as u64);
            bar.set_position(now.done as u64);
            bar.set_message(match left(begun.elapsed(), now) {
                Some(left) => format!("{}, {left} left", asked.what),
                None => asked.what.to_string(),
            });
        };
        let done = run(&work, &store, &hear, stop);
        bar.finish_and_clear();
        let mut done = done?;
        let table = done.table.take();
        let file = asked.out.join(format!("{}.parquet", asked.what));
        if let Some(table) = &table {
            store.replace(&file, |into| table::write(table, into).map_err(std::io::Error::other))?;
        }
        let analysis = table.as_ref().filter(|_| asked.what == What::Triage).map(|table| analyse(table, asked.false_discoveries));
        if let Some(analysis) = &analysis {
            let mut text = serde_json::to_string_pretty(analysis).map_err(Failure::input)?;
            text.push('\n');
            output::file(&asked.out.join("fleet.json"), text)?;
        }
        Ok(Surveyed { done: Some(done), shard: asked.shard, file: table.is_some().then_some(file), table, analysis })
    }

    /// Analyses a table that was written before.
    ///
    /// # Errors
    /// The file is no table of a fleet.
    pub fn of_table(path: &Path, false_discoveries: f64) -> Result<Surveyed, Failure> {
        let table = table::read(path)?;
        let analysis = (table.what == What::Triage).then(|| analyse(&table, false_discoveries));
        Ok(Surveyed { done: None, shard: (1, 1), file: None, table: Some(table), analysis })
    }

    /// The result for programs.
    ///
    /// # Errors
    /// It cannot be written as JSON.
    pub fn json(&self) -> Result<Value, Failure> {
        let done = self.done.as_ref().map(|done| {
            json!({ "done": done.progress.done, "kept": done.progress.kept, "all": done.progress.all, "missing": done.missing, "failed": done.failed })
        });
        let analysis = serde_json::to_value(&self.analysis).map_err(Failure::input)?;
        Ok(json!({ "shard": [self.shard.0, self.shard.1], "recordings": done, "table": self.file, "analysis": analysis }))
    }

    /// The page; `None` while there is no whole table.
    pub fn page(&self) -> Option<backdrive_report::Page> {
        Some(backdrive_pages::fleet::page(self.table.as_ref()?, self.analysis.as_ref()?))
    }

    /// The exit code.
    pub fn code(&self) -> u8 {
        let failed = self.done.as_ref().is_some_and(|done| !done.failed.is_empty() && done.failed.len() == done.progress.all);
        match &self.analysis {
            _ if failed => code::BAD_INPUT,
            Some(found) if !found.changes.is_empty() || !found.together.is_empty() || !found.odd.is_empty() => code::NEGATIVE,
            // Where every recording is left out nothing is known.
            Some(found) if counted(found) == 0 => code::CANNOT_TELL,
            _ => 0,
        }
    }

    fn text(&self) -> String {
        let mut lines = Vec::new();
        if let Some(done) = &self.done {
            let Progress { done: answered, kept, all } = done.progress;
            let shard = if self.shard.1 > 1 { format!(" of shard {} of {}", self.shard.0, self.shard.1) } else { String::new() };
            let without = match done.failed.len() {
                0 => String::new(),
                failed if failed == answered => ", none of them with an answer".to_string(),
                failed => format!(", {failed} of them without an answer"),
            };
            lines.push(format!("fleet     {answered} of {all} recordings{shard} done{without}, {kept} of them before"));
            for (name, why) in done.failed.iter().take(LISTED) {
                lines.push(format!("no answer {name}: {why}"));
            }
            if done.failed.len() > LISTED {
                lines.push(format!("no answer and {} more: see the column error of the table", done.failed.len() - LISTED));
            }
            match &self.file {
                Some(file) => lines.push(format!("table     {}", file.display())),
                None => {
                    lines.push(format!("table     waits for {} recordings of other shards; the last one to finish writes it", done.missing))
                }
            }
        }
        let Some(found) = &self.analysis else { return lines.join("\n") + "\n" };
        let mut said = |title: &str, sentences: Vec<&str>| {
            for sentence in sentences.iter().take(LISTED) {
                lines.push(format!("{title:9} {sentence}"));
            }
            if sentences.len() > LISTED {
                lines.push(format!("{title:9} and {} more: see --json or the page", sentences.len() - LISTED));
            }
        };
        said("changed", found.changes.iter().map(|change| change.sentence.as_str()).collect());
        said("together", found.together.iter().map(|change| change.sentence.as_str()).collect());
        said("odd", found.odd.iter().map(|odd| odd.sentence.as_str()).collect());
        said("left out", found.left_out.iter().map(|left| left.recording.as_str()).collect());
        said("note", found.notes.iter().map(String::as_str).collect());
        match self.code() {
            0 => lines.push(format!("answer    nothing changed on {} units in {} recordings that count", found.units, counted(found))),
            code::CANNOT_TELL => lines.push("answer    not known: every recording is left out".to_string()),
            _ => {}
        }
        lines.join("\n") + "\n"
    }
}

/// Recordings that are not left out.
fn counted(found: &Analysis) -> usize {
    found.recordings.saturating_sub(found.left_out.len())
}

/// Time that is left, by the recordings that were not kept from before.
fn left(elapsed: Duration, now: Progress) -> Option<String> {
    let worked = now.done.checked_sub(now.kept).filter(|worked| *worked > 0)?;
    let seconds = elapsed.as_secs_f64() / worked as f64 * (now.all - now.done) as f64;
    Some(match seconds {
        s if s < 120.0 => format!("{s:.0} s"),
        s if s < 7200.0 => format!("{:.0} min", s / 60.0),
        s => format!("{:.1} h", s / 3600.0),
    })
}

impl From<FleetError> for Failure {
    fn from(error: FleetError) -> Failure {
        let code = match error {
            FleetError::Input(_) => code::BAD_INPUT,
            FleetError::Machine(_) => code::MACHINE,
            FleetError::Stopped => code::INTERRUPTED,
        };
        Failure { code, message: error.to_string() }
    }
}
