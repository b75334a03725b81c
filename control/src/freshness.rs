//! What an input is worth when its samples stop coming.

use crate::core::Port;
use backdrive_msgs::Sample;

/// Follows one input port: whether a new sample came, and for how many steps none has.
///
/// A sample whose first axis is not measured, or is no finite number, counts as none: that is how a node says that it has
/// nothing to say because its own input is missing, so that staleness travels along the loop.
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

/// The share of a commanded force that is applied: 1 while samples come; from `hold_steps` after the last
/// one it falls to 0 within as many steps, and rises again as fast when they are back.
#[derive(Debug, Clone)]
pub struct Authority {
    hold_steps: u64,
    steps_down: u64,
}

impl Authority {
    /// `stale_after_s` is the time from the last sample to the start of the decay, and the time the decay takes.
    pub fn new(stale_after_s: f64, period_s: f64) -> Authority {
        Authority { hold_steps: ((stale_after_s / period_s).round() as u64).max(1), steps_down: 0 }
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
        let mut authority = Authority::new(0.020, 0.001);
        let shares: Vec<f64> = (0..60).map(|stale| authority.share(stale)).collect();
        assert!(shares[..=20].iter().all(|s| *s == 1.0));
        assert!(shares[21] < 1.0);
        assert_eq!(shares[40], 0.0);
        assert!(shares[40..].iter().all(|s| *s == 0.0));
        let back: Vec<f64> = (0..21).map(|_| authority.share(0)).collect();
        assert!(back.windows(2).all(|w| w[1] >= w[0]));
        assert_eq!(back[20], 1.0);
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
