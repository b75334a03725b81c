//! What is wrong with a set of recordings before any of it is looked at: the same data as fitted and held out, and inputs that nothing takes.

use crate::error::SetError;
use backdrive_bags::Reader;
use backdrive_diagnosis::recordings::problem::{Problem, Record};
use backdrive_plant::model::Model;
use backdrive_plant::recording::{Source, TableSource, signals_of, units};
use backdrive_plant::set::RecordingSet;
use std::io::Read;
use std::path::Path;

/// Refuses what is fitted and held out at once, under whichever name; a recording that is fitted twice is a note, for it counts twice.
pub fn repeated(set: &RecordingSet) -> Result<Vec<String>, SetError> {
    let mut notes = Vec::new();
    let all: Vec<(&String, bool)> = set.fit.iter().map(|f| (f, false)).chain(set.held_out.iter().map(|f| (f, true))).collect();
    for (i, (second, held)) in all.iter().enumerate() {
        let same = |first: &String| overlap(set, first, second) && same_recording(&set.table(first), &set.table(second));
        let Some((first, first_held)) = all[..i].iter().find(|(first, _)| same(first)) else { continue };
        let (first, second) = (set.table(first).name(), set.table(second).name());
        let which =
            if first == second { format!("{second}: is given twice") } else { format!("{second}: is the same recording as {first}") };
        if held != first_held {
            return Err(SetError::new(format!(
                "{which}, once to be fitted and once held out. A recording used in a fit cannot test it: hold out another recording, or \
                    name it once"
            )));
        }
        notes.push(format!("{which}: its samples would count twice, and intervals would be too narrow"));
    }
    Ok(notes)
}

/// Refuses a recording that is both fitted and held out in another form, such as a table and the bag that it was imported into. The test is that the
/// samples that the model takes are the same, bit for bit.
pub(crate) fn repeated_samples(problem: &Problem) -> Result<(), SetError> {
    let moves = |record: &Record| record.inputs.iter().chain(record.outputs.iter().flatten()).any(|s| s.iter().any(|x| *x != s[0]));
    let same = |a: &Record, b: &Record| a.inputs == b.inputs && a.outputs == b.outputs && moves(a);
    for held in &problem.held_out {
        if let Some(fitted) = problem.fit.iter().find(|fitted| same(fitted, held)) {
            return Err(SetError::new(format!(
                "{}: holds the same samples as {}, once to be fitted and once held out. A recording used in a fit cannot test it: hold \
                 out another recording, or name it once",
                held.name, fitted.name
            )));
        }
    }
    Ok(())
}

/// Whether the rows that count in two files of a set have some in common, were the files the same.
fn overlap(set: &RecordingSet, first: &str, second: &str) -> bool {
    let (a, b) = (set.rules_of(first).piece, set.rules_of(second).piece);
    let [from_a, to_a] = a.rows.unwrap_or([0, usize::MAX]);
    let [from_b, to_b] = b.rows.unwrap_or([0, usize::MAX]);
    from_a < to_b && from_b < to_a && a.keep == b.keep
}

/// Whether two recordings are one, or hold the same. One in memory and one in a file are compared by what the model takes of them.
fn same_recording(first: &TableSource, second: &TableSource) -> bool {
    match (first, second) {
        (TableSource::File(first), TableSource::File(second)) => same_data(first, second),
        (TableSource::Frame(first), TableSource::Frame(second)) => first.is_same_data(second),
        _ => false,
    }
}

/// Whether two paths lead to one file, or to files of the same bytes. What cannot be read is reported where it is used.
pub(crate) fn same_data(first: &Path, second: &Path) -> bool {
    if is_same_file(first, second) {
        return true;
    }
    let open = |path: &Path| {
        backdrive_plant::input_file::open(path).ok().map(|f| (f.metadata().map_or(0, |m| m.len()), std::io::BufReader::new(f)))
    };
    let (Some((size, first)), Some((other, second))) = (open(first), open(second)) else { return false };
    size == other && size > 0 && first.bytes().zip(second.bytes()).all(|(a, b)| matches!((a, b), (Ok(a), Ok(b)) if a == b))
}

/// Whether two paths lead to one file that is there.
pub(crate) fn is_same_file(first: &Path, second: &Path) -> bool {
    matches!((first.canonicalize(), second.canonicalize()), (Ok(a), Ok(b)) if a == b)
}

/// Refuses to go on where the recordings hold an input that no part of the model takes; other signals that are not used are a note.
/// `ignored` are names that may be left out.
pub(crate) fn left_out(set: &RecordingSet, model: &Model, ignored: &[String], has_grip: bool) -> Result<Option<String>, SetError> {
    let mut unused: Vec<(String, String)> = Vec::new();
    for file in set.fit.iter().chain(&set.held_out) {
        for name in unused_in(set, file, model) {
            if !unused.iter().any(|(other, _)| *other == name) {
                unused.push((name, set.table(file).name()));
            }
        }
    }
    let may_be_left = |name: &String| ignored.contains(name) || set.ignore.contains(name);
    unused.retain(|(name, _)| !may_be_left(name));
    if let Some((name, file)) = unused.iter().find(|(name, _)| is_hand(name)) {
        let takes: Vec<&str> = model.inputs.iter().map(|i| i.name.as_str()).collect();
        let prefix = name.strip_suffix("hand").map_or("", |p| p.trim_end_matches(['.', '_']));
        let hint = match has_grip {
            true => format!("the given grip is not \"{prefix}\""),
            false => format!("did you mean --grip {prefix}.toml (the grip that held the device), or a model that holds the hand?"),
        };
        return Err(SetError::new(format!(
            "{file}: {name}, a motion of the hand, is in the recordings, but the model has no input for it. Its inputs are {}; {hint} \
             --ignore-signal {name}, or ignore = [\"{name}\"] in set.toml, continues without it",
            takes.join(", ")
        )));
    }
    let names: Vec<&str> = unused.iter().map(|(name, _)| name.as_str()).collect();
    Ok(match names.as_slice() {
        [] => None,
        names => Some(format!("recorded, but not used, because the model has no such input or output: {}", names.join(", "))),
    })
}

/// The name that a grip's hand has in recordings: `GRIP.hand`, or `GRIP_hand` where a name may have no point (topics).
fn is_hand(name: &str) -> bool {
    name.ends_with(".hand") || name.ends_with("_hand")
}

/// Signals of one file that are neither the model's nor named by the set. None of a file that cannot be read: another check reports that.
fn unused_in(set: &RecordingSet, file: &str, model: &Model) -> Vec<String> {
    let own = signals_of(model);
    let by_rule = |heading: &str| set.columns.iter().any(|(_, rule)| matches!(&rule.source, Source::Column(c) if c == heading));
    let topic_by_rule =
        |name: &str| set.columns.iter().any(|(_, rule)| matches!(&rule.source, Source::Topic { topic, .. } if topic == name));
    if set.is_bag(file) {
        let Ok(reader) = Reader::open(&set.path_of(file)) else { return Vec::new() };
        let flat: Vec<String> = own.iter().map(|s| s.replace('.', "_")).collect();
        let names = reader.topics().iter().filter(|t| !topic_by_rule(&t.name)).filter_map(|t| t.name.strip_prefix("/recording/"));
        return names.filter(|n| !own.contains(n) && !flat.iter().any(|f| f == n)).map(str::to_string).collect();
    }
    let Ok(headings) = set.table(file).headings() else { return Vec::new() };
    let rows_by = set.rules_of(file).piece.keep;
    let is_own = |h: &str| {
        // A heading is meant by its whole text or by its name without the unit.
        [h, units::split(h).0]
            .iter()
            .any(|name| *name == "t" || own.contains(name) || by_rule(name) || rows_by.iter().any(|(c, _)| c == name))
    };
    headings.into_iter().filter(|h| !h.is_empty() && !is_own(h)).collect()
}
