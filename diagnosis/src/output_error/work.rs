//! How much a search computes, counted, so that the same recordings give the same verdict on every machine, busy or not, with any number of threads.
//!
//! The unit is one step of a linear network in the stepper, about 25 ns on a laptop. A budget is only asked after all started tasks have been joined, so
//! that its answer does not depend on which of two threads was faster. Parallel tasks each count for themselves, and are added up when their group is done
//! ([`Budget::abreast`]). Seconds end a search only as a limit from outside, and then the budget remembers that they did.

use crate::tuning::tuning;
use rayon::prelude::*;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};
use std::time::Instant;

/// Steps of a linear network.
pub type Steps = u64;

/// What ends work from outside, whatever is left of a budget.
#[derive(Debug, Clone, Copy, Default)]
pub struct Limit<'a> {
    /// Set by whoever interrupts.
    pub stop: Option<&'a AtomicBool>,
    /// When the user's patience ends.
    pub deadline: Option<Instant>,
}

impl Limit<'_> {
    /// Whether something from outside ends the work now. Once it does, it does for good.
    pub fn is_over(&self) -> bool {
        self.was_stopped() || self.deadline.is_some_and(|d| Instant::now() >= d)
    }

    /// Whether somebody interrupts it, and not the clock.
    pub fn was_stopped(&self) -> bool {
        self.stop.is_some_and(|s| s.load(Ordering::Relaxed))
    }
}

/// Counts work, and determines when it has to end.
#[derive(Debug, Clone)]
pub struct Budget<'a> {
    spent: Arc<AtomicU64>,
    simulations: Arc<AtomicU64>,
    until: Steps,
    limit: Limit<'a>,
    cut: Arc<AtomicBool>,
}

impl Default for Budget<'_> {
    fn default() -> Self {
        Budget::new(Steps::MAX, Limit::default())
    }
}

impl<'a> Budget<'a> {
    /// So much work, from now on.
    pub fn new(steps: Steps, limit: Limit<'a>) -> Budget<'a> {
        Budget { spent: Arc::default(), simulations: Arc::default(), until: steps, limit, cut: Arc::default() }
    }

    /// Work done so far.
    pub fn spent(&self) -> Steps {
        self.spent.load(Ordering::Relaxed)
    }

    /// Simulations of a recording so far.
    pub fn simulations(&self) -> u64 {
        self.simulations.load(Ordering::Relaxed)
    }

    /// Count at which it is used up.
    pub fn end(&self) -> Steps {
        self.until
    }

    /// What is left.
    pub fn left(&self) -> Steps {
        self.until.saturating_sub(self.spent())
    }

    /// Counts work.
    pub fn count(&self, steps: Steps) {
        self.spent.fetch_add(steps, Ordering::Relaxed);
    }

    /// Counts a simulation of a recording.
    pub fn simulated(&self, steps: Steps) {
        self.simulations.fetch_add(1, Ordering::Relaxed);
        self.count(steps);
    }

    /// The same counter, used up no later than at this count.
    pub fn until(&self, end: Steps) -> Budget<'a> {
        Budget { until: end.min(self.until), ..self.clone() }
    }

    /// The same counter, used up at this count, be it later than before.
    pub fn extended(&self, end: Steps) -> Budget<'a> {
        Budget { until: end, ..self.clone() }
    }

    /// The same counter, used up after so much more, and no later than before.
    pub fn next(&self, steps: Steps) -> Budget<'a> {
        self.until(self.spent().saturating_add(steps))
    }

    /// Whether it is used up or something from outside ends it. To be asked only where nothing else counts on it at the same time.
    pub fn is_over(&self) -> bool {
        self.spent() > self.until || self.is_halted()
    }

    /// Whether something from outside ends it; may be asked anywhere.
    pub fn is_halted(&self) -> bool {
        let halted = self.limit.is_over();
        if halted {
            self.cut.store(true, Ordering::Relaxed);
        }
        halted
    }

    /// Whether something from outside has ended it.
    pub fn was_cut(&self) -> bool {
        self.cut.load(Ordering::Relaxed)
    }

    /// Runs tasks in parallel, each with a budget of its own that begins where this one stands. Between groups their work is added up, and none is begun
    /// once it is used up: those give `None`.
    pub fn abreast<T: Sync, R: Send>(&self, tasks: &[T], run: impl Fn(&Budget<'a>, &T) -> R + Sync) -> Vec<Option<R>> {
        let mut done = Vec::with_capacity(tasks.len());
        for group in tasks.chunks(tuning().search.abreast.max(1)) {
            if self.is_over() {
                break;
            }
            let (from, simulations) = (self.spent(), self.simulations());
            let share = if group.len() as f64 * tuning().search.of_one > 1.0 {
                (self.left() as f64 * tuning().search.of_one) as Steps
            } else {
                self.left()
            };
            let own = |task: &T| {
                let budget = Budget {
                    spent: Arc::new(AtomicU64::new(from)),
                    simulations: Arc::new(AtomicU64::new(simulations)),
                    until: from.saturating_add(share),
                    ..self.clone()
                };
                let result = run(&budget, task);
                (result, budget.spent() - from, budget.simulations() - simulations)
            };
            let results: Vec<(R, Steps, u64)> = group.par_iter().with_max_len(1).map(own).collect();
            for (result, steps, simulations) in results {
                self.count(steps);
                self.simulations.fetch_add(simulations, Ordering::Relaxed);
                done.push(Some(result));
            }
        }
        done.resize_with(tasks.len(), || None);
        done
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn tasks_count_for_themselves_and_none_begins_once_the_budget_is_used_up() {
        let budget = Budget::new(1000, Limit::default());
        let tasks: Vec<u64> = (0..100).collect();
        let run = |budget: &Budget, task: &u64| {
            // None sees what the others of its group do.
            let seen = budget.spent();
            budget.simulated(30);
            (seen, *task)
        };
        let results = budget.abreast(&tasks, run);
        // Groups of 16 take 480 each: the third begins at 960, the fourth would at 1440.
        assert_eq!(results.iter().flatten().count(), 48);
        assert!(results[..48].iter().enumerate().all(|(i, r)| *r == Some((480 * (i as u64 / 16), i as u64))));
        assert_eq!((budget.spent(), budget.simulations()), (1440, 48));
        assert!(budget.is_over() && !budget.was_cut());
    }

    #[test]
    fn one_task_of_many_gets_a_quarter_and_a_lone_one_all() {
        let budget = Budget::new(1000, Limit::default());
        assert_eq!(budget.abreast(&[0; 8], |b, _| b.left()), vec![Some(250); 8]);
        assert_eq!(budget.abreast(&[0; 4], |b, _| b.left()), vec![Some(1000); 4]);
    }

    #[test]
    fn what_ends_it_from_outside_is_remembered() {
        let stop = AtomicBool::new(false);
        let budget = Budget::new(10, Limit { stop: Some(&stop), deadline: None });
        budget.count(11);
        assert!(budget.is_over() && !budget.was_cut());
        let later = budget.extended(100);
        assert!(!later.is_over());
        stop.store(true, Ordering::Relaxed);
        assert!(later.is_over() && budget.was_cut());
        let past = Budget::new(10, Limit { stop: None, deadline: Some(Instant::now()) });
        assert!(past.is_over() && past.was_cut());
    }
}
