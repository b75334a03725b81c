//! What an input is worth when its samples stop coming.

use crate::core::Port;
use backdrive_msgs::Sample;

/// Follows one input port: whether a new sample came, and for how many steps none has.
///
/// A sample whose first axis is not measured, or is no finite number, counts as none. A node sends such a sample when its own input is missing, so
/// staleness propagates along the loop.
#[derive(Debug, Clone, Default)]
pub struct Freshness {
    newest_step: Option<u64>,
    /// Steps since the last new sample.
    pub stale_steps: u64,
}

impl Freshness {
    /// The port's sample if it is new in this step and `quantity` of its first axis is measured.
    pub fn new_sample<'a>(&mut self, port: &'a Port, quantity: impl Fn(&Sample) -> f64) -> Option<&'a Sample> {
        let fresh = port.sample.as_ref().filter(|s| self.newest_step.is_none_or(|newest| s.step > newest) && quantity(s).is_finite());
        match fresh {
            Some(sample) => {
                self.newest_step = Some(sample.step);
                self.stale_steps = 0;
            }
            None => self.stale_steps += 1,
        }
        fresh
    }

    /// Whether any sample has ever come.
    pub fn begun(&self) -> bool {
        self.newest_step.is_some()
    }
}

/// Steps without a new sample that a node bridges: at the next one the input is stale, `stale_after_s` after its last sample.
///
/// A single missing step is always bridged, because a living sender may be late by one: at low rates `stale_after_s` is two periods at least.
pub fn bridged_steps(stale_after_s: f64, period_s: f64) -> u64 {
    // A quotient just below a whole number is that number.
    let steps = (stale_after_s / period_s + 1e-6).floor() as u64;
    steps.max(2) - 1
}

/// The share of a commanded force that is applied: 1 while samples come. It begins to fall `stale_after_s` after the last one, reaches 0
/// within two periods less than twice that time, and rises again as fast when samples are back.
///
/// The two periods are for what precedes it: a step of delay in the loop, and in real time a step of waiting for the sample. So the force is
/// gone at most `2 * stale_after_s` after the last sample of a node that died, wherever in the loop that was.
#[derive(Debug, Clone)]
pub struct Authority {
    hold_steps: u64,
    steps_down: u64,
}

impl Authority {
    /// `stale_after_s` is the time from the last sample to the start of the decay, and longer than the decay takes.
    pub fn new(stale_after_s: f64, period_s: f64) -> Authority {
        Authority { hold_steps: bridged_steps(stale_after_s, period_s), steps_down: 0 }
    }

    /// The share at this step, given the steps since the last new sample.
    pub fn share(&mut self, stale_steps: u64) -> f64 {
        self.steps_down =
            if stale_steps > self.hold_steps { (self.steps_down + 1).min(self.hold_steps) } else { self.steps_down.saturating_sub(1) };
        1.0 - self.steps_down as f64 / self.hold_steps as f64
    }

    /// Whether the force is being taken away.
    pub fn is_decaying(&self) -> bool {
        self.steps_down > 0
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn force_holds_then_is_zero_within_as_long_again_and_comes_back() {
        let mut authority = Authority::new(0.010, 0.001);
        let shares: Vec<f64> = (0..60).map(|stale| authority.share(stale)).collect();
        assert!(shares[..=9].iter().all(|s| *s == 1.0));
        assert!(shares[10] < 1.0, "stale after 10 ms");
        assert!(shares[17] > 0.0);
        assert!(shares[18..].iter().all(|s| *s == 0.0), "two steps are left for the loop");
        let back: Vec<f64> = (0..10).map(|_| authority.share(0)).collect();
        assert!(back.windows(2).all(|w| w[1] >= w[0]));
        assert_eq!(back[9], 1.0);
    }

    #[test]
    fn at_every_rate_the_force_is_gone_in_twice_the_time_or_in_two_periods() {
        for stale_after_s in [0.004, 0.01, 0.05, 0.1] {
            for rate_hz in [15.0, 30.0, 60.0, 75.0, 100.0, 150.0, 200.0, 300.0, 350.0, 500.0, 999.0, 1000.0, 4000.0, 10_000.0] {
                let period_s: f64 = 1.0 / rate_hz;
                let mut authority = Authority::new(stale_after_s, period_s);
                assert_eq!(
                    (authority.share(0), authority.share(1)),
                    (1.0, 1.0),
                    "{rate_hz} Hz: a sender that is late by a step is bridged"
                );
                let zero = (2..).find(|stale| authority.share(*stale) == 0.0).unwrap() as f64;
                let most = (2.0 * stale_after_s - 2.0 * period_s).max(2.0 * period_s);
                assert!(zero * period_s <= most + 1e-9, "{rate_hz} Hz, {stale_after_s} s: zero after {} s", zero * period_s);
            }
        }
    }

    #[test]
    fn a_sample_that_measures_nothing_is_no_sample() {
        let mut freshness = Freshness::default();
        let mut sample = Sample::new(1);
        sample.step = 3;
        let port = Port { sample: Some(sample), age_steps: 0 };
        assert!(freshness.new_sample(&port, |s| s.effort[0]).is_none());
        sample.effort[0] = -1.0;
        let port = Port { sample: Some(sample), age_steps: 0 };
        assert!(freshness.new_sample(&port, |s| s.effort[0]).is_some());
        assert!(freshness.new_sample(&port, |s| s.effort[0]).is_none(), "the same sample again is not new");
        assert_eq!(freshness.stale_steps, 1);
    }
}
