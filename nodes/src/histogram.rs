//! Durations counted into fixed buckets: recording one neither allocates nor branches far.

/// Buckets per octave are 2^5, so a quantile is right within about 3 %.
const FINE_BITS: u32 = 5;
const FINE: u64 = 1 << FINE_BITS;
/// Up to 2^40 ns, about 18 minutes.
const BUCKETS: usize = (40 - FINE_BITS as usize + 1) << FINE_BITS;

/// Counts of durations, ns.
#[derive(Debug, Clone)]
pub struct Histogram {
    counts: Box<[u32; BUCKETS]>,
    total: u64,
}

impl Default for Histogram {
    fn default() -> Histogram {
        Histogram { counts: Box::new([0; BUCKETS]), total: 0 }
    }
}

impl Histogram {
    /// Counts one duration, ns.
    #[inline]
    pub fn record(&mut self, ns: u64) {
        self.counts[bucket(ns)] += 1;
        self.total += 1;
    }

    /// The duration, ns, that a share `q` (0 to 1) of those recorded does not exceed; 0 when there are none.
    pub fn quantile(&self, q: f64) -> f64 {
        let rank = (q * self.total as f64).ceil().max(1.0) as u64;
        let mut seen = 0;
        for (i, count) in self.counts.iter().enumerate() {
            seen += u64::from(*count);
            if seen >= rank {
                return middle(i);
            }
        }
        0.0
    }

    /// Forgets all.
    pub fn clear(&mut self) {
        self.counts.fill(0);
        self.total = 0;
    }
}

fn bucket(ns: u64) -> usize {
    if ns < FINE {
        return ns as usize;
    }
    let octave = ns.ilog2() - FINE_BITS;
    let index = (u64::from(octave) << FINE_BITS) + (ns >> octave);
    (index as usize).min(BUCKETS - 1)
}

fn middle(bucket: usize) -> f64 {
    let (octave, fine) = (bucket as u64 >> FINE_BITS, bucket as u64 & (FINE - 1));
    match octave {
        0 => fine as f64,
        _ => ((FINE + fine) as f64 + 0.5) * f64::from(1u32 << (octave - 1).min(31)),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn quantiles_are_within_three_percent() {
        let mut histogram = Histogram::default();
        assert_eq!(histogram.quantile(0.5), 0.0);
        (1..=100_000).for_each(|ns| histogram.record(ns));
        for q in [0.01, 0.5, 0.9, 0.99] {
            let (got, expected) = (histogram.quantile(q), q * 100_000.0);
            assert!((got / expected - 1.0).abs() < 0.032, "{q}: {got}");
        }
        histogram.record(u64::MAX);
    }
}
