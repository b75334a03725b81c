//! The gain at which a loop stops being stable.

use super::sweep::{log_grid, sweep};
use super::{ResimulateError, Run, RunOptions, Scenario};
use crate::outcome::Outcome;
use rayon::prelude::*;
use std::sync::atomic::AtomicBool;

/// The range of gains that is searched for the stability limit, and the tolerance.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Search {
    /// Lowest mu*lambda of the grid.
    pub lowest: f64,
    /// Where not even that is stable the grid goes on downwards, in the same steps, to this; not below `lowest` where this is not below it. So the
    /// stability limit is found wherever it lies, and it does not depend on the gain in question.
    pub floor: f64,
    /// Highest mu*lambda.
    pub highest: f64,
    /// Width of the bracket at the end, as a share of the gain.
    pub tolerance: f64,
    /// Grid points per factor of 10.
    pub per_decade: usize,
    /// Whether the grid is run beyond its first gain that is not stable: only then it is seen whether the loop is stable again
    /// above, and from where on a clamp acts.
    pub whole_grid: bool,
    /// Whether the verdict is repeated around the stability limit: only then is flickering seen.
    pub around: bool,
}

impl Default for Search {
    fn default() -> Search {
        Search { lowest: 0.05, floor: 5e-5, highest: 50.0, tolerance: 0.005, per_decade: 40, whole_grid: true, around: true }
    }
}

/// Gains that are run at a time where the grid ends at the first that is not stable.
const AT_ONCE: usize = 6;

/// More gains than this are not run below the grid.
const MOST_BELOW: i32 = 1000;

/// Gains, as factors, at which the verdict is repeated around a stability limit that was found.
const AROUND: [f64; 10] = [0.88, 0.91, 0.94, 0.96, 0.98, 1.02, 1.04, 1.06, 1.09, 1.12];

impl Search {
    fn grid(&self) -> Result<Vec<f64>, ResimulateError> {
        let Search { lowest, floor, highest, tolerance, per_decade, .. } = *self;
        let good = |x: f64| x.is_finite() && x > 0.0;
        if !(good(lowest) && good(floor) && good(highest) && good(tolerance) && lowest < highest && per_decade > 0) {
            return Err(ResimulateError::Search { lowest, highest, tolerance });
        }
        Ok(log_grid(lowest, highest, ((highest / lowest).log10() * per_decade as f64).ceil() as usize + 1))
    }

    /// The gains below the grid, downwards: multiples of its lowest, so that they are the same whatever is asked.
    fn below(&self) -> Vec<f64> {
        let ratio = 10_f64.powf(-1.0 / self.per_decade as f64);
        let gain = |i: i32| self.lowest * ratio.powi(i);
        (1..=MOST_BELOW).map(gain).take_while(|gain| *gain > self.floor * 0.999_999).collect()
    }
}

/// Where a loop stops being stable, for the scenario's script.
#[derive(Debug, Clone)]
pub struct Edge {
    /// The lowest mu*lambda at which it oscillates or runs away; `None` where there is none in the range, or where a clamp or
    /// the travel comes first.
    pub critical_gain: Option<f64>,
    /// The highest gain below the stability limit that was found stable; 0 where not even the lowest was, and where nothing could be judged.
    pub at_least: f64,
    /// Lowest gain that is not stable and highest that is, where the verdict changes more than once within 12 % of the stability limit. Causes are
    /// slow growth from a small amplitude, a sensor's steps and dry friction.
    pub flickers: Option<[f64; 2]>,
    /// The verdict just beyond: at the upper end of the last bracket. Where it was not judged there, the stability limit is not known.
    pub outcome_beyond: Option<Outcome>,
    /// Frequency of the oscillation just above the limit, Hz; 0 for a run-away without oscillation; `None` where there is no limit.
    pub frequency_hz: Option<f64>,
    /// The lowest gain at which a clamp acts or the travel is left: exact to the tolerance where this comes before any
    /// oscillation, else to the grid. `None` where there is none.
    pub limited_from: Option<f64>,
    /// The lowest gain of the grid above the stability limit at which it is stable again.
    pub returns_to_stable: Option<f64>,
    /// Runs that were needed.
    pub evaluations: usize,
    /// One sentence: what ends the stable range, or that nothing does.
    pub reason: String,
    /// The grid: mu*lambda and verdict.
    pub grid: Vec<(f64, Outcome)>,
}

fn is_unjudged(outcome: &Outcome) -> bool {
    matches!(outcome, Outcome::NotJudged { .. })
}

/// Finds the stability limit: a grid first, then its first bracket is narrowed. `done` hears (runs done, runs in the grid).
///
/// # Errors
/// A search over no range; a run that cannot be done; `cancel` was set.
pub fn edge(
    scenario: &Scenario,
    search: &Search,
    options: &RunOptions,
    done: &(dyn Fn(usize, usize) + Sync),
    cancel: &AtomicBool,
) -> Result<Edge, ResimulateError> {
    let options = &RunOptions { keep_signals: false, ..*options };
    let grid = grid(scenario, search, options, done, cancel)?;
    let verdicts: Vec<(f64, Outcome)> = grid.iter().map(|(gain, run)| (*gain, run.outcome)).collect();
    let limited = verdicts.iter().find(|(_, o)| matches!(o, Outcome::Limited { .. })).map(|(gain, _)| *gain);
    let Some(first) = grid.iter().position(|(_, run)| !run.outcome.is_stable()) else {
        return Ok(Edge {
            critical_gain: None,
            at_least: search.highest,
            flickers: None,
            outcome_beyond: None,
            frequency_hz: None,
            limited_from: None,
            returns_to_stable: None,
            evaluations: grid.len(),
            reason: format!("stable at every gain up to {}", search.highest),
            grid: verdicts,
        });
    };
    let returns_to_stable = verdicts[first..].iter().find(|(_, o)| o.is_stable()).map(|(gain, _)| *gain);
    let below = if first > 0 { grid[first - 1].0 } else { 0.0 };
    let mut bracket = Bracket { low: below, high: grid[first].0, beyond: grid[first].1.clone(), evaluations: grid.len() };
    bracket.narrow(scenario, search, options, cancel)?;
    let flickers = match search.around && bracket.low > 0.0 && bracket.beyond.is_unstable() {
        true => bracket.look_around(below, scenario, options, cancel)?,
        false => None,
    };
    let (critical_gain, limited_from, reason) = bracket.says(&grid[first..], flickers, limited, search);
    Ok(Edge {
        critical_gain,
        at_least: bracket.low,
        flickers,
        frequency_hz: bracket.beyond.frequency_hz.filter(|_| critical_gain.is_some()),
        outcome_beyond: Some(bracket.beyond.outcome),
        limited_from,
        returns_to_stable,
        evaluations: bracket.evaluations,
        reason,
        grid: verdicts,
    })
}

/// Runs at the gains of the grid, up to where they are not stable any more unless all of it is wanted. Where its lowest gain is not stable it also
/// runs below the grid; in the order of the gains.
fn grid(
    scenario: &Scenario,
    search: &Search,
    options: &RunOptions,
    done: &(dyn Fn(usize, usize) + Sync),
    cancel: &AtomicBool,
) -> Result<Vec<(f64, Run)>, ResimulateError> {
    let gains = search.grid()?;
    let mut grid: Vec<(f64, Run)> = Vec::new();
    let at_once = if search.whole_grid { gains.len() } else { AT_ONCE };
    for some in gains.chunks(at_once) {
        let before = grid.len();
        for run in sweep(scenario, some, options, &|n| done(before + n, gains.len()), cancel)? {
            grid.push(run.ok_or(ResimulateError::Cancelled)?);
        }
        if grid.iter().any(|(_, run)| !run.outcome.is_stable()) {
            break;
        }
    }
    // Nothing more is learned below where nothing is judged.
    let lost = |grid: &[(f64, Run)]| grid.first().is_some_and(|(_, run)| !run.outcome.is_stable() && !is_unjudged(&run.outcome));
    if !lost(&grid) {
        return Ok(grid);
    }
    for some in search.below().chunks(AT_ONCE) {
        let before = grid.len();
        let mut below = Vec::new();
        for run in sweep(scenario, some, options, &|n| done(before + n, gains.len().max(before + some.len())), cancel)? {
            below.push(run.ok_or(ResimulateError::Cancelled)?);
        }
        below.reverse();
        below.append(&mut grid);
        grid = below;
        if !lost(&grid) {
            break;
        }
    }
    Ok(grid)
}

/// Between which gains (mu*lambda) the loop stops being stable.
struct Bracket {
    /// The highest known to be stable; 0 where none is.
    low: f64,
    /// The lowest known not to be.
    high: f64,
    /// What it does there.
    beyond: Run,
    /// Runs that were needed.
    evaluations: usize,
}

impl Bracket {
    /// Narrows it to the tolerance.
    fn narrow(&mut self, scenario: &Scenario, search: &Search, options: &RunOptions, cancel: &AtomicBool) -> Result<(), ResimulateError> {
        while self.low > 0.0 && self.high > (1.0 + search.tolerance) * self.low {
            // Two gains at a time: one for each core at least.
            let third = (self.high / self.low).powf(1.0 / 3.0);
            let between = [self.low * third, self.low * third * third];
            let runs = between.par_iter().map(|gain| scenario.run(scenario.gain(*gain), options, cancel)).collect::<Result<Vec<_>, _>>()?;
            self.evaluations += runs.len();
            for (gain, run) in between.into_iter().zip(runs) {
                if !run.outcome.is_stable() {
                    (self.high, self.beyond) = (gain, run);
                    break;
                }
                self.low = gain;
            }
        }
        Ok(())
    }

    /// Looks at gains about it, above `below`, the gain of the grid under it. Where the verdict flickers there it goes to the lowest gain that
    /// is not stable, and the answer is this one and the highest that is.
    fn look_around(
        &mut self,
        below: f64,
        scenario: &Scenario,
        options: &RunOptions,
        cancel: &AtomicBool,
    ) -> Result<Option<[f64; 2]>, ResimulateError> {
        let middle = (self.low * self.high).sqrt();
        let probe = |factor: &f64| Ok((middle * factor, scenario.run(scenario.gain(middle * factor), options, cancel)?));
        let probes = AROUND.par_iter().map(probe).collect::<Result<Vec<(f64, Run)>, ResimulateError>>()?;
        self.evaluations += probes.len();
        let stable = || probes.iter().filter(|(_, run)| run.outcome.is_stable()).map(|(gain, _)| *gain);
        let highest_stable = stable().fold(self.low, f64::max);
        let lowest = probes.iter().find(|(gain, run)| *gain < middle && run.is_unstable());
        let first = lowest.map_or(middle, |(gain, _)| *gain);
        let flickers = (lowest.is_some() || highest_stable > middle).then_some([first, highest_stable]);
        if let Some((gain, run)) = lowest {
            self.low = stable().filter(|g| g < gain).fold(below, f64::max).min(*gain);
            (self.high, self.beyond) = (*gain, run.clone());
        }
        Ok(flickers)
    }

    /// The critical gain, from where on a clamp or the travel limits it, and why, in a sentence. `from` is the grid from the first gain on that
    /// is not stable, `limited` the lowest in it at which something limits.
    fn says(
        &self,
        from: &[(f64, Run)],
        flickers: Option<[f64; 2]>,
        limited: Option<f64>,
        search: &Search,
    ) -> (Option<f64>, Option<f64>, String) {
        let Bracket { low, high, beyond, .. } = self;
        let edge = match flickers {
            Some([lowest, _]) => lowest,
            None if *low > 0.0 => (low * high).sqrt(),
            None => *high,
        };
        if let Outcome::NotJudged { why } = beyond.outcome {
            let reason = match *low > 0.0 {
                true => format!("stable up to {low:.4}; above that it is not known: {why}"),
                false => format!("not known at any gain from {high} on: {why}"),
            };
            return (None, limited, reason);
        }
        if *low == 0.0 {
            let limited = if beyond.is_unstable() { limited } else { Some(*high) };
            return (None, limited, format!("{} already at {:.3e}, the lowest gain searched", beyond.outcome, from[0].0));
        }
        if beyond.is_unstable() {
            let reason = match beyond.outcome {
                Outcome::Limited { .. } => {
                    format!("{} above {edge:.4}, so large that a clamp or the end of travel limits it", beyond.beneath)
                }
                other => format!("{other} above {edge:.4}"),
            };
            return (Some(edge), limited, reason);
        }
        let later = match from.iter().find(|(_, run)| run.is_unstable()) {
            Some((gain, _)) => format!("; it oscillates from {gain:.3} on"),
            None if search.whole_grid => "; no oscillation was seen up to the highest gain".to_string(),
            None => String::new(),
        };
        (None, Some(edge), format!("a clamp or the end of travel acts first, from {edge:.4} on{later}"))
    }
}
