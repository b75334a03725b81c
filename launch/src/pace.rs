//! Limits how fast lines come, so that one talkative node cannot hide the others.

use std::time::{Duration, Instant};

/// Lets `burst` lines through at once and `per_s` lines per second after that, and counts those it holds back.
#[derive(Debug)]
pub(crate) struct Pace {
    per_s: f64,
    burst: f64,
    left: f64,
    last: Instant,
    held: u64,
}

impl Pace {
    pub fn new(per_s: f64, burst: f64, now: Instant) -> Pace {
        Pace { per_s, burst, left: burst, last: now, held: 0 }
    }

    /// `None`: hold this line back. `Some(n)`: show it, and say that n were held back before it.
    pub fn pass(&mut self, now: Instant) -> Option<u64> {
        let passed = now.saturating_duration_since(self.last);
        self.last = now;
        self.left = (self.left + passed.as_secs_f64() * self.per_s).min(self.burst);
        if self.left < 1.0 {
            self.held += 1;
            return None;
        }
        self.left -= 1.0;
        Some(std::mem::take(&mut self.held))
    }

    /// Lines held back since the last one that passed, if it has been quiet for a second: so that the last ones are shown too.
    pub fn settle(&mut self, now: Instant) -> Option<u64> {
        let quiet = now.saturating_duration_since(self.last) > Duration::from_secs(1);
        (quiet && self.held > 0).then(|| std::mem::take(&mut self.held))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn holds_back_and_counts() {
        let start = Instant::now();
        let mut pace = Pace::new(2.0, 3.0, start);
        let passed = (0..10).filter(|_| pace.pass(start).is_some()).count();
        assert_eq!(passed, 3);
        assert_eq!(pace.settle(start), None);
        assert_eq!(pace.pass(start + Duration::from_secs(1)), Some(7));
        assert_eq!(pace.settle(start + Duration::from_secs(9)), None);
    }

    #[test]
    fn the_last_held_lines_are_told_when_it_is_quiet() {
        let start = Instant::now();
        let mut pace = Pace::new(1.0, 1.0, start);
        assert_eq!(pace.pass(start), Some(0));
        assert_eq!(pace.pass(start), None);
        assert_eq!(pace.settle(start + Duration::from_secs(2)), Some(1));
        assert_eq!(pace.settle(start + Duration::from_secs(4)), None);
    }
}
