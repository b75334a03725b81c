//! What is done to a connection on purpose: delay, jitter and loss, as a function of (seed, step) alone,
//! so that a run with them can be repeated bit for bit over any transport.

use crate::stage::Impairment;
use backdrive_msgs::Sample;

/// Longest delay and jitter together, steps: 10 s at 10 kHz, 25 MB of samples.
pub const MAX_STEPS: u64 = 100_000;

/// Samples on their way through an impaired connection.
#[derive(Debug)]
pub(crate) struct Line {
    /// Steps that every sample takes.
    pub delay: u64,
    jitter: u64,
    loss: f64,
    seed: u64,
    /// By step of delivery, modulo the length: the newest of those due then.
    slots: Vec<Option<(u64, Sample)>>,
    next: u64,
    newest: Option<Sample>,
}

impl Line {
    /// A line for a graph of this rate.
    pub fn new(impairment: &Impairment, rate_hz: f64) -> Line {
        let steps = |seconds: f64| (seconds * rate_hz).round().clamp(0.0, MAX_STEPS as f64) as u64;
        let (delay, jitter) = (steps(impairment.delay_s), steps(impairment.jitter_s));
        let slots = vec![None; (delay + jitter + 2) as usize];
        Line { delay, jitter, loss: impairment.loss, seed: impairment.seed, slots, next: 0, newest: None }
    }

    /// Sends a sample that the receiver would otherwise have at step `due`.
    pub fn insert(&mut self, sample: &Sample, due: u64) {
        let lost = unit(mix(self.seed, sample.step, 0)) < self.loss;
        if lost {
            return;
        }
        // Every whole number of steps from 0 to jitter is as likely as any other.
        let further = ((self.jitter + 1) as f64 * unit(mix(self.seed, sample.step, 1))) as u64;
        let due = (due + self.delay + further).max(self.next);
        let length = self.slots.len() as u64;
        let slot = &mut self.slots[(due % length) as usize];
        let overtaken = matches!(slot, Some((at, other)) if *at == due && other.step > sample.step);
        if !overtaken {
            *slot = Some((due, *sample));
        }
    }

    /// What has come out by `step`: the newest by its own step; one that was overtaken is dropped.
    pub fn take(&mut self, step: u64) -> Option<&Sample> {
        let length = self.slots.len() as u64;
        // After a jump only one round of the slots can hold anything.
        let from = self.next.max((step + 1).saturating_sub(length));
        for at in from..=step {
            if let Some((due, sample)) = self.slots[(at % length) as usize].take_if(|(due, _)| *due <= step) {
                debug_assert!(due <= step);
                if self.newest.is_none_or(|n| sample.step > n.step) {
                    self.newest = Some(sample);
                }
            }
        }
        self.next = self.next.max(step + 1);
        self.newest.as_ref()
    }
}

/// splitmix64 of (seed, step, which draw): stateless, so that a draw does not depend on what arrived before.
fn mix(seed: u64, step: u64, draw: u64) -> u64 {
    let mut z = seed ^ (step * 2 + draw + 1).wrapping_mul(0x9e37_79b9_7f4a_7c15);
    for _ in 0..2 {
        z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        z ^= z >> 31;
    }
    z
}

/// Uniform in [0, 1).
fn unit(bits: u64) -> f64 {
    (bits >> 11) as f64 / (1u64 << 53) as f64
}

#[cfg(test)]
mod tests {
    use super::*;

    fn run(impairment: Impairment, steps: u64) -> Vec<Option<u64>> {
        let mut line = Line::new(&impairment, 1000.0);
        (0..steps)
            .map(|k| {
                let sample = Sample { step: k, ..Sample::new(1) };
                line.insert(&sample, k);
                line.take(k).map(|s| s.step)
            })
            .collect()
    }

    #[test]
    fn a_pure_delay_is_exact() {
        let out = run(Impairment { delay_s: 0.005, jitter_s: 0.0, loss: 0.0, seed: 1 }, 100);
        for (k, step) in out.iter().enumerate() {
            assert_eq!(*step, (k as u64).checked_sub(5));
        }
    }

    #[test]
    fn jitter_never_goes_back_and_stays_within_its_bound() {
        let out = run(Impairment { delay_s: 0.005, jitter_s: 0.003, loss: 0.0, seed: 7 }, 5000);
        let mut distinct = std::collections::BTreeSet::new();
        for (k, step) in out.iter().enumerate().skip(20) {
            let age = k as u64 - step.expect("something has arrived");
            assert!((5..=8).contains(&age), "step {k}: {age}");
            distinct.insert(age);
        }
        assert!(distinct.len() >= 3);
        assert!(out.windows(2).all(|w| w[0] <= w[1]));
    }

    #[test]
    fn the_share_lost_is_the_share_asked_for_and_the_seed_decides_which() {
        let lossy = |seed| run(Impairment { delay_s: 0.0, jitter_s: 0.0, loss: 0.2, seed }, 20_000);
        let fresh = |out: &[Option<u64>]| out.iter().enumerate().filter(|(k, s)| **s == Some(*k as u64)).count();
        let (first, again, other) = (lossy(1), lossy(1), lossy(2));
        assert_eq!(first, again);
        assert_ne!(first, other);
        assert!((fresh(&first) as f64 / 20_000.0 - 0.8).abs() < 0.02);
        assert!(
            lossy(3).len() == 20_000
                && run(Impairment { delay_s: 0.0, jitter_s: 0.0, loss: 1.0, seed: 1 }, 100).iter().all(Option::is_none)
        );
    }
}
