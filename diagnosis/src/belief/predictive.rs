//! Which of two explanations predicts recordings better, block by block, and by how much more than that varies.

use crate::tuning::tuning;

/// How much better one explanation predicts than another.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Gain {
    /// Mean over the blocks of the logarithm of the ratio of their mean squared errors, the other's over its own: positive where it predicts better.
    pub mean: f64,
    /// Standard error of that mean, from the scatter of the blocks; neighbouring blocks may be correlated.
    pub error: f64,
    /// Share of what the blocks say that speaks for it, 0 to 1: the gains over gains and losses.
    pub share: f64,
}

impl Gain {
    /// The gain in its own standard errors.
    pub fn in_errors(&self) -> f64 {
        if self.error > 0.0 { self.mean / self.error } else { 0.0 }
    }

    /// Whether it predicts better by more than that varies from block to block. What shows in a few blocks only (an impact, a reversal) has a wide
    /// standard error; there it is enough that hardly a block speaks against it.
    pub fn is_sure(&self) -> bool {
        self.mean > 0.0 && (self.in_errors() > tuning().claim.sure || self.share > tuning().claim.one_sided)
    }
}

/// Compares mean squared errors by block, in lists of neighbours. `None` for fewer than four blocks.
pub fn gain(base: &[Vec<f64>], better: &[Vec<f64>]) -> Option<Gain> {
    let ratio = |(a, b): (&f64, &f64)| (a.max(f64::MIN_POSITIVE) / b.max(f64::MIN_POSITIVE)).ln();
    let lists: Vec<Vec<f64>> = base.iter().zip(better).map(|(a, b)| a.iter().zip(b).map(ratio).collect()).collect();
    let count = lists.iter().map(Vec::len).sum::<usize>();
    if count < 4 {
        return None;
    }
    let mean = lists.iter().flatten().sum::<f64>() / count as f64;
    let off: Vec<Vec<f64>> = lists.iter().map(|list| list.iter().map(|x| x - mean).collect()).collect();
    let own: f64 = off.iter().flatten().map(|x| x * x).sum();
    let neighbours: f64 = off.iter().flat_map(|list| list.windows(2).map(|pair| pair[0] * pair[1])).sum();
    let variance = (own + 2.0 * neighbours.max(0.0)) / (count * (count - 1)) as f64;
    let (gains, losses) = lists.iter().flatten().fold((0.0, 0.0), |(up, down), x| (up + x.max(0.0), down + (-x).max(0.0)));
    Some(Gain { mean, error: variance.sqrt(), share: gains / (gains + losses).max(f64::MIN_POSITIVE) })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_gain_in_every_block_is_sure_and_one_in_a_single_block_is_not() {
        let base = vec![vec![4.0; 16], vec![4.0; 16]];
        let all: Vec<Vec<f64>> =
            base.iter().map(|l| l.iter().enumerate().map(|(i, x)| x / (2.0 + 0.1 * (i % 3) as f64)).collect()).collect();
        let everywhere = gain(&base, &all).unwrap();
        assert!((everywhere.mean - 2.1f64.ln()).abs() < 0.01 && everywhere.in_errors() > 50.0, "{everywhere:?}");
        let mut one = base.clone();
        one[0][3] = 0.01;
        let once = gain(&base, &one).unwrap();
        assert!((once.in_errors() - 1.0).abs() < 0.05, "{once:?}");
        // Nothing speaks against that one: an impact is as short.
        assert!(once.is_sure() && everywhere.is_sure());
        one[1][3] = 100.0;
        assert!(!gain(&base, &one).unwrap().is_sure());
        assert_eq!(gain(&base, &base).unwrap().in_errors(), 0.0);
        assert_eq!(gain(&[vec![1.0; 3]], &[vec![1.0; 3]]), None);
    }

    #[test]
    fn neighbours_that_go_together_count_less() {
        let base = vec![vec![1.0; 32]];
        let alternating: Vec<f64> = (0..32).map(|i| if i % 2 == 0 { 0.4 } else { 0.8 }).collect();
        let halves: Vec<f64> = (0..32).map(|i| if i < 16 { 0.4 } else { 0.8 }).collect();
        let (a, b) = (gain(&base, &[alternating]).unwrap(), gain(&base, &[halves]).unwrap());
        assert!((a.mean - b.mean).abs() < 1e-12 && b.error > 1.6 * a.error, "{a:?} {b:?}");
    }
}
