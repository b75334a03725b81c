//! The verdict over many gains, in parallel.

use super::{ResimulateError, Run, RunOptions, Scenario};
use rayon::prelude::*;
use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering};

/// Runs a scenario at every gain (mu*lambda) on all cores, in the order of the list; `done` hears how many are finished.
///
/// When `cancel` is set the runs under way end, and `None` stands for every gain that has no run; the others are kept.
///
/// # Errors
/// The first run that cannot be done.
pub fn sweep(
    scenario: &Scenario,
    gains: &[f64],
    options: &RunOptions,
    done: &(dyn Fn(usize) + Sync),
    cancel: &AtomicBool,
) -> Result<Vec<Option<(f64, Run)>>, ResimulateError> {
    let finished = AtomicUsize::new(0);
    let one = |gain: &f64| match scenario.run(scenario.gain(*gain), options, cancel) {
        Ok(run) => {
            done(finished.fetch_add(1, Ordering::Relaxed) + 1);
            Ok(Some((*gain, run)))
        }
        Err(ResimulateError::Cancelled) => Ok(None),
        Err(error) => Err(error),
    };
    // One at a time: runs that leave all bounds are short, and halves of a sweep would take unlike times.
    gains.par_iter().with_max_len(1).map(one).collect()
}

/// Gains evenly spaced in their logarithm, both ends included.
pub fn log_grid(lowest: f64, highest: f64, count: usize) -> Vec<f64> {
    let span = (highest / lowest).ln();
    let at = |i: usize| if i + 1 == count && count > 1 { highest } else { lowest * (span * i as f64 / (count.max(2) - 1) as f64).exp() };
    (0..count).map(at).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_grid_has_both_ends_and_equal_ratios() {
        let grid = log_grid(0.1, 50.0, 200);
        assert_eq!((grid.len(), grid[0], grid[199]), (200, 0.1, 50.0));
        let ratio = grid[1] / grid[0];
        assert!(grid.windows(2).all(|w| (w[1] / w[0] - ratio).abs() < 1e-12));
        assert_eq!(log_grid(2.0, 3.0, 1), [2.0]);
    }
}
