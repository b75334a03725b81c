//! Several runs in one table: the time begins again where another column changes.

use crate::recording::Recording;

/// Parts a table at the rows at which the time goes back, where a column with few values changes at each of them; else leaves it whole.
pub fn parted(recording: Recording) -> Vec<Recording> {
    let [stream] = recording.streams.as_slice() else { return vec![recording] };
    let back: Vec<usize> = (1..stream.times.len()).filter(|row| stream.times[*row] < stream.times[*row - 1]).collect();
    if back.is_empty() {
        return vec![recording];
    }
    let numbers_runs = |values: &[f64]| {
        let changes: Vec<usize> = (1..values.len()).filter(|row| values[*row] != values[*row - 1]).collect();
        !changes.is_empty() && back.iter().all(|row| changes.contains(row)) && changes.len() <= 2 * back.len()
    };
    let Some(by) = recording.signals.iter().position(|signal| signal.values.len() == stream.times.len() && numbers_runs(&signal.values))
    else {
        return vec![recording];
    };
    let mut cuts = vec![0];
    cuts.extend(back.iter().copied());
    cuts.push(stream.times.len());
    let name = recording.signals[by].name.clone();
    let mut out = Vec::new();
    for cut in cuts.windows(2) {
        let rows = cut[0]..cut[1];
        let mut piece = recording.clone();
        let value = recording.signals[by].values[rows.start];
        piece.file = format!("{} ({name} = {value})", recording.file);
        for signal in &mut piece.signals {
            signal.values = signal.values.get(rows.clone()).map(<[f64]>::to_vec).unwrap_or_default();
        }
        let of = &mut piece.streams[0];
        of.times = of.times[rows.clone()].to_vec();
        of.lines = of.lines.get(rows).map(<[u64]>::to_vec).unwrap_or_default();
        out.push(piece);
    }
    out
}
