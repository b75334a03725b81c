//! Signals of different clocks and rates on one row of times.

use super::file::Located;
use crate::grid::{Grid, Ordered, Resampled, Series, even_period};
use crate::signal_role::SignalRole;
use crate::unjudged::Unjudged;

/// Clocks that differ by more than this are not one clock, ns.
const SAME_CLOCK_NS: i64 = 100_000_000;

/// Orders every signal in time since the first message; signals whose stamps are of another clock are moved by the difference
/// that the log times show.
pub(super) fn on_one_clock(wanted: &[(SignalRole, &Located)], series: &[Series], notes: &mut Vec<String>) -> Vec<Ordered> {
    let offsets: Vec<i64> = series.iter().map(Series::clock_offset).collect();
    let told = || offsets.iter().zip(series).filter(|(_, s)| !s.values.is_empty()).map(|(o, _)| *o);
    let (least, most) = (told().min().unwrap_or(0), told().max().unwrap_or(0));
    let mixed = most.saturating_sub(least) > SAME_CLOCK_NS;
    if mixed {
        let name = |at: i64| {
            let place = offsets.iter().position(|o| *o == at).and_then(|i| wanted.get(i));
            place.map_or(String::new(), |(_, located)| located.signal.topic.clone())
        };
        notes.push(format!(
            "time stamps of {} and {} come from different clocks ({:.3} s apart relative to log time); the signals are aligned by log \
             time, so the delay includes transport",
            name(least),
            name(most),
            most.saturating_sub(least) as f64 * 1e-9
        ));
    }
    let unstamped: Vec<&str> =
        wanted.iter().zip(series).filter(|(_, s)| !s.stamped && !s.values.is_empty()).map(|((_, l), _)| l.signal.topic.as_str()).collect();
    if !unstamped.is_empty() {
        let mut names = unstamped;
        names.dedup();
        notes.push(format!("{}: no header stamps; the times are those of the recorder", names.join(", ")));
    }
    let shift = |i: usize| if mixed { offsets.get(i).copied().unwrap_or(0) } else { 0 };
    let starts = series.iter().enumerate().flat_map(|(i, s)| s.stamps.iter().map(move |t| t.saturating_add(shift(i))));
    let origin = starts.min().unwrap_or(0);
    series.iter().enumerate().map(|(i, s)| s.ordered(shift(i), origin)).collect()
}

pub(super) fn note_resampled(located: &Located, signal: &Ordered, laid: &Resampled, grid: &Grid, notes: &mut Vec<String>) {
    let name = located.place();
    if signal.disordered > 0 {
        notes.push(format!("{name}: {} messages were out of order or had the time of another", signal.disordered));
    }
    if laid.missing > 0 {
        notes.push(format!("{name}: {} of {} rows have no value: gaps of more than 4 of its intervals", laid.missing, grid.rows));
    }
    if signal.interval > 0 && signal.jitter as f64 > 0.1 * signal.interval as f64 {
        let (jitter, interval) = (signal.jitter as f64 * 1e-6, signal.interval as f64 * 1e-6);
        notes.push(format!("{name}: its intervals of {interval:.3} ms deviate by up to {jitter:.3} ms (nine in ten)"));
    }
    if laid.delay_s > 0.05 * grid.period * 1e-9 {
        notes.push(format!("{name}: holding it between its samples delays it by {:.3} ms on average", laid.delay_s * 1e3));
    }
    if signal.interval as f64 > 1.5 * grid.period {
        notes.push(format!("{name}: has {:.1} values per second, the rows {:.1}", 1e9 / even_period(signal), 1e9 / grid.period));
    }
}

/// Whether one of the signals ends (or begins) so much before another that its sender was gone for more than 1 % of the recording.
pub(super) fn ends_apart(needed: &[&Ordered], grid: &Grid) -> Option<Unjudged> {
    let firsts = || needed.iter().filter_map(|o| o.times.first());
    let lasts = || needed.iter().filter_map(|o| o.times.last());
    let all = (lasts().max()? - firsts().min()?) as f64;
    let common = (lasts().min()? - firsts().max()?) as f64;
    let rows = |time: f64| (time / grid.period) as usize;
    (common < 0.99 * all).then(|| Unjudged::Gaps { steps: rows(all - common), of: rows(all) })
}
