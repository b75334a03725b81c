//! A model's signals out of a bag.

use crate::signals::{Signal, gather};
use crate::{BagError, Reader};
use backdrive_plant::model::Hold;
use backdrive_plant::recording::{Columns, Piece, Recording, Source};

/// Reads the signals of a model, as [`backdrive_plant::recording::read_csv`] does from a table.
///
/// A signal is found by its rule in `columns`, else in `position[0]` of `/recording/NAME`, as [`crate::import_csv`] puts it; `names` of `None` takes
/// every number in the bag. `hold` is the interpolation of a signal between its samples where they have no steps in common. Rows in which a signal is
/// missing are left out and show as gaps of the recording.
///
/// Errors: as of [`crate::signals()`]; a signal that was never measured; fewer than two rows; a `where` that is not for bags.
pub fn recording(
    reader: &Reader,
    names: Option<&[&str]>,
    columns: &Columns,
    piece: &Piece,
    hold: &dyn Fn(&str) -> Hold,
) -> Result<Recording, BagError> {
    recording_up_to(reader, names, columns, piece, hold, usize::MAX)
}

/// As [`recording`], no further than where the first signal has more than `most` samples, or as many as the piece asks for: so memory does not
/// grow with the bag.
pub fn recording_up_to(
    reader: &Reader,
    names: Option<&[&str]>,
    columns: &Columns,
    piece: &Piece,
    hold: &dyn Fn(&str) -> Hold,
    most: usize,
) -> Result<Recording, BagError> {
    let most = most.max(piece.rows.map_or(0, |[_, to]| to));
    if let Some((column, _)) = piece.keep.first() {
        return Err(BagError::Usage(format!("{}: rows can be chosen by the value of {column:?} in a table only", reader.path().display())));
    }
    let rule = |name: &str| columns.iter().find(|(signal, _)| signal == name).map(|(_, rule)| rule);
    let signal = |name: &str| {
        let (topic, field) = match rule(name).map(|rule| &rule.source) {
            Some(Source::Topic { topic, field }) => (topic.clone(), field.clone()),
            Some(Source::Column(column)) => (crate::table::topic_of(column), "position[0]".to_owned()),
            None => (crate::table::topic_of(name), "position[0]".to_owned()),
        };
        let (scale, offset) = rule(name).map_or((1.0, 0.0), |rule| (rule.factor(), rule.offset));
        Signal { name: name.to_owned(), topic, field, scale, offset, hold: hold(name) }
    };
    let mut wanted = match names {
        Some(names) => names.iter().map(|name| signal(name)).collect(),
        None => crate::table::columns_of(reader, None)?,
    };
    if rule("t").is_some_and(|rule| matches!(rule.source, Source::Topic { .. })) {
        wanted.push(signal("t"));
    }
    let table = gather(reader, &wanted, true, most)?;
    for (signal, missing) in wanted.iter().zip(&table.alignment.missing) {
        if *missing == table.t.len() as u64 {
            let what = if table.t.is_empty() { "has no time in common with the other signals" } else { "was never measured" };
            return Err(BagError::Field { topic: signal.topic.clone(), field: signal.field.clone(), what: what.to_owned() });
        }
    }
    let [from, to] = piece.rows.unwrap_or([0, usize::MAX]);
    let whole: Vec<usize> = (from..to.min(table.t.len())).filter(|row| table.columns.iter().all(|column| !column[*row].is_nan())).collect();
    let pick = |column: &[f64]| whole.iter().map(|row| column[*row]).collect::<Vec<f64>>();
    let mut found: Vec<(String, Vec<f64>)> = table.names.into_iter().zip(table.columns.iter().map(|column| pick(column))).collect();
    let t = match found.last() {
        Some((name, _)) if name == "t" => found.pop().map(|(_, t)| t).unwrap_or_default(),
        _ => pick(&table.t),
    };
    let units =
        columns.iter().filter_map(|(signal, rule)| Some((signal.clone(), rule.checked_unit()?))).filter(|(s, _)| s != "t").collect();
    Ok(Recording { units, ..Recording::new(reader.path().display().to_string(), t, found)? })
}
