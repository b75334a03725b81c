//! From the files of a set to records: which inputs nobody measured, and each recording, from CSV or from a bag.

use super::error::ProblemError;
use super::record::Record;
use crate::recordings::unknown::Unknown;
use backdrive_bags::{Reader, recording_up_to, topic_of};
use backdrive_plant::model::{Hold, Model};
use backdrive_plant::recording::{Columns, Recording, signals_of};
use backdrive_plant::set::RecordingSet;
use std::path::Path;

/// Samples of a signal that are read of a bag of which no rows are named: the first. A search is given far fewer, and memory is not to grow with a bag.
pub const MOST_OF_A_BAG: usize = 1_000_000;

/// The inputs that a set declares unmeasured.
pub(super) fn unknown_of(set: &RecordingSet, model: &Model) -> Result<Vec<Unknown>, ProblemError> {
    let one = |(name, bandwidth_hz): &(String, f64)| {
        let place = set.folder.join("set.toml");
        let Some(input) = model.inputs.iter().position(|i| i.name == *name) else {
            let all = names(model.inputs.iter().map(|i| i.name.as_str()));
            return Err(ProblemError::Set(format!("{}, unknown.{name}: the model has no such input; it has {all}", place.display())));
        };
        if set.columns.iter().any(|(signal, _)| signal == name) {
            let place = place.display();
            return Err(ProblemError::Set(format!("{place}, unknown.{name}: has a column too; an input is recorded or unknown")));
        }
        Ok(Unknown { input, bandwidth_hz: *bandwidth_hz })
    };
    set.unknown.iter().map(one).collect()
}

/// Reads one file of a set onto a regular grid.
pub(super) fn record(set: &RecordingSet, file: &str, model: &Model, unknown: &[Unknown]) -> Result<Record, ProblemError> {
    let rules = set.rules_of(file);
    let nobody_measured = |name: &str| set.unknown.iter().any(|(input, _)| input == name);
    let recording = match set.is_bag(file) {
        true => from_bag(&set.path_of(file), model, &set.columns, &rules.piece)?,
        false => set.table(file).read_signals_of(model, &set.columns, &rules.piece, &nobody_measured)?,
    };
    recording.check_units(model)?;
    // Pieces of one file have names of their own.
    let name = set.folder.join(file).display().to_string();
    let recording = Recording { name, ..recording };
    let unmeasured: Vec<usize> = unknown.iter().map(|u| u.input).collect();
    Record::without(&recording, model, rules.condition, &unmeasured)
}

fn from_bag(path: &Path, model: &Model, columns: &Columns, piece: &backdrive_plant::recording::Piece) -> Result<Recording, ProblemError> {
    let reader = Reader::open_begun(path)?;
    let there = |name: &str| columns.iter().any(|(signal, _)| signal == name) || reader.topic(&topic_of(name)).is_ok();
    let wanted: Vec<&str> = signals_of(model).into_iter().filter(|name| there(name)).collect();
    if wanted.is_empty() {
        let asked = names(signals_of(model).into_iter());
        return Err(ProblemError::Set(format!("{}: state in [columns] of set.toml which topics hold {asked}", path.display())));
    }
    let hold = |name: &str| model.inputs.iter().find(|i| i.name == name).map_or(Hold::Linear, |i| i.hold);
    Ok(recording_up_to(&reader, Some(&wanted), columns, piece, &hold, MOST_OF_A_BAG)?)
}

pub(super) fn names<'a>(all: impl Iterator<Item = &'a str>) -> String {
    all.collect::<Vec<_>>().join(", ")
}
