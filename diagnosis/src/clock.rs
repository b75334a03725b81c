//! Time as a search counts it: what this process computes, so that a busy machine makes a search longer, up to 1.4 times, before it makes it worse.

use std::ops::Add;
use std::sync::OnceLock;
use std::time::{Duration, Instant};

/// How many times longer than it was granted a search may last where others share the processors, or it cannot use them all.
const LONGEST: f64 = 1.4;

/// How long on the wall what was granted this much computing time may last.
pub fn longest(granted: Duration) -> Duration {
    granted.mul_f64(LONGEST)
}

/// A point in computing time: processor time of this process per thread of the pool, or the time on the wall divided by 1.4,
/// whichever is more. With all processors for itself it is nearly the time on the wall.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub struct Moment(Duration);

impl Moment {
    /// Now.
    pub fn now() -> Moment {
        static BEGAN: OnceLock<Instant> = OnceLock::new();
        let wall = BEGAN.get_or_init(Instant::now).elapsed().div_f64(LONGEST);
        let computed = nix::time::clock_gettime(nix::time::ClockId::CLOCK_PROCESS_CPUTIME_ID).map_or(Duration::ZERO, Duration::from);
        Moment(wall.max(computed.div_f64(rayon::current_num_threads().max(1) as f64)))
    }

    /// Time since then.
    pub fn elapsed(self) -> Duration {
        Moment::now().since(self)
    }

    /// Time from an earlier moment to this one; none where that is later.
    pub fn since(self, earlier: Moment) -> Duration {
        self.0.saturating_sub(earlier.0)
    }
}

impl Add<Duration> for Moment {
    type Output = Moment;

    fn add(self, time: Duration) -> Moment {
        Moment(self.0 + time)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn sleeping_counts_less_than_computing() {
        let (began, wall) = (Moment::now(), Instant::now());
        std::thread::sleep(Duration::from_millis(200));
        let slept = began.elapsed();
        assert!(slept < wall.elapsed(), "{slept:?}");
        // However little it computes, time passes.
        assert!(began.elapsed() >= slept && Moment::now() > began);
    }
}
