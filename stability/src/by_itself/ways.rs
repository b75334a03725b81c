//! What a way does to samples that are passed on as they are: how late they come, how unevenly, and how many never.

/// Longest delay that is looked for, rows at most and s.
pub(crate) const MOST_LATE: usize = 4000;
pub(crate) const MOST_LATE_S: f64 = 0.5;

/// Of a node that only passes values on: how late each new one was, and the share that was lost. `None` where most of them are no earlier value at all.
/// Where no new value arrives, the node holds its last value, lets it decay, or publishes nothing.
pub(crate) fn unsteady(recorded: &[f64], predicted: &[f64], period_s: f64) -> Option<(usize, usize, f64)> {
    let most = MOST_LATE.min((MOST_LATE_S / period_s) as usize);
    let size = predicted.iter().filter(|x| x.is_finite()).fold(0.0_f64, |m, x| m.max(x.abs()));
    let tiny = 1e-12 * size;
    let moves = |row: usize| row > 0 && (predicted[row] - predicted[row - 1]).abs() > tiny;
    let (mut lates, mut told, mut oldest, mut last) = (Vec::new(), 0_usize, 0_usize, None);
    for row in 1..recorded.len() {
        let value = recorded[row];
        if !value.is_finite() || value == 0.0 || (value - recorded[row - 1]).abs() <= tiny {
            continue;
        }
        let from = oldest.max(row.saturating_sub(most));
        let place = (from..=row).rev().find(|j| (predicted[*j] - value).abs() <= tiny);
        // A force whose input has been away for long decays.
        let decays = last.is_some_and(|last| row > last + HELD_ROWS);
        told += usize::from(place.is_some() || !decays);
        if let Some(place) = place {
            (oldest, last) = (place, Some(row));
            // Where a signal stands still, its rows cannot be distinguished.
            if moves(place) {
                lates.push(row - place);
            }
        }
    }
    if lates.len() < 64 || (lates.len() as f64) < 0.5 * told as f64 {
        return None;
    }
    let came = lates.len() as f64;
    lates.sort_unstable();
    let at = |share: f64| lates[((lates.len() - 1) as f64 * share) as usize];
    let (late, span) = (at(0.01), at(0.99) - at(0.01));
    let sent = (1..predicted.len()).filter(|row| predicted[*row] != 0.0 && moves(*row)).count() as f64;
    let mean = lates.iter().map(|l| l.saturating_sub(late) as f64).sum::<f64>() / came;
    let (jitter, lost) = scatter((came / sent.max(came)).min(1.0), span, mean);
    Some((late, jitter, lost))
}

/// Jitter, rows, and the lost share of a connection. A share `comes` of its samples is the newest on arrival; they are up to `span` rows late and `mean`
/// rows on average. A sample that a later one overtakes is never seen, so those that are seen are less late than all.
fn scatter(comes: f64, span: usize, mean: f64) -> (usize, f64) {
    if span == 0 || span > MOST_SPAN {
        return (span, 1.0 - comes);
    }
    let loss_of = |jitter: usize| {
        let (mut low, mut high) = (0.0, 1.0);
        for _ in 0..20 {
            let middle = 0.5 * (low + high);
            if in_time(jitter, middle).0 > comes { low = middle } else { high = middle }
        }
        low
    };
    let all = (span..=3 * span + 2).map(|jitter| {
        let lost = loss_of(jitter);
        ((in_time(jitter, lost).1 - mean).abs(), jitter, lost)
    });
    let mut all: Vec<(f64, usize, f64)> = all.collect();
    let nearest = all.iter().map(|a| a.0).fold(f64::INFINITY, f64::min);
    // More jitter and less loss look nearly the same: then it is jitter alone.
    all.retain(|a| a.0 <= nearest + ALIKE * mean.max(1.0));
    all.into_iter().min_by(|a, b| a.2.total_cmp(&b.2)).map_or((span, 1.0 - comes), |(_, jitter, lost)| (jitter, lost))
}

/// Two connections whose mean delays differ by less than this share are not distinguished.
const ALIKE: f64 = 0.05;
/// Where the delay varies from sample to sample by more than this, it is taken as observed, rows.
const MOST_SPAN: usize = 150;

/// Rows after which a value that nothing renews may decay.
const HELD_ROWS: usize = 20;

/// A share that counts as none.
const NEVER: f64 = 1e-6;

/// Share of the samples that are the newest when they arrive, and by how many rows these are late on average. Each sample is up to `jitter` rows late with
/// a uniform distribution, and a share `lost` never arrives.
pub(crate) fn in_time(jitter: usize, lost: f64) -> (f64, f64) {
    let all = (jitter + 1) as f64;
    let (mut share, mut late) = (0.0, 0.0);
    for rows in 0..=jitter {
        // The sample that is sent j rows later overtakes where it is at most rows - j late: at the same row the later one counts.
        let newest: f64 = (1..=rows).map(|j| 1.0 - (1.0 - lost) * (rows - j + 1) as f64 / all).product();
        // The later one is, the surer it is overtaken.
        if newest < NEVER {
            break;
        }
        share += newest / all;
        late += rows as f64 * newest / all;
    }
    ((1.0 - lost) * share, late / share)
}
