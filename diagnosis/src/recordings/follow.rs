//! How one signal follows another: lag, factor, and the share of its variance that the other explains.

use backdrive_signal::statistics::mean;
/// How one signal follows another.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Follow {
    /// Samples by which it is late; negative where it is early.
    pub lag: f64,
    /// Its size as a multiple of the other's.
    pub gain: f64,
    /// Share of its variance that the other explains, 0 to 1.
    pub explained: f64,
    /// Share that it explains without lag.
    pub at_once: f64,
}

/// Sums over a block of samples, for each lag.
struct Block {
    yy: f64,
    uu: Vec<f64>,
    uy: Vec<f64>,
}

/// Sums from which a lag is found, block by block; each block has an offset of its own, so that drifts and steady errors do not count.
pub struct Profile {
    first: i64,
    blocks: Vec<Block>,
}

/// Blocks that a recording is cut into, each an independent measurement of the lag.
const BLOCKS: usize = 12;
/// Fewest samples of a block.
const LEAST_BLOCK: usize = 24;

impl Profile {
    /// The sums of `y(i)` against `u(i - lag)`, lags from `lags.0` to `lags.1` samples, over the samples that `keep` names.
    pub fn new(u: &[f64], y: &[f64], lags: (i64, i64), keep: Option<&[bool]>) -> Profile {
        let length = u.len().min(y.len());
        let (first, last) = lags;
        let (from, to) = (last.max(0) as usize, length.saturating_sub((-first).max(0) as usize));
        let size = (to.saturating_sub(from) / BLOCKS).max(LEAST_BLOCK);
        let mut blocks = Vec::new();
        let mut start = from;
        while start + size <= to {
            blocks.extend(Profile::block(u, y, first..=last, start..start + size, keep));
            start += size;
        }
        Profile { first, blocks }
    }

    fn block(
        u: &[f64],
        y: &[f64],
        lags: std::ops::RangeInclusive<i64>,
        rows: std::ops::Range<usize>,
        keep: Option<&[bool]>,
    ) -> Option<Block> {
        let rows: Vec<usize> = rows.filter(|row| keep.is_none_or(|keep| keep.get(*row) == Some(&true))).collect();
        if rows.len() < LEAST_BLOCK / 2 {
            return None;
        }
        let count = rows.len() as f64;
        let middle = rows.iter().map(|row| y[*row]).sum::<f64>() / count;
        let yy = rows.iter().map(|row| (y[*row] - middle).powi(2)).sum();
        let (mut uu, mut uy) = (Vec::new(), Vec::new());
        let whole = rows.windows(2).all(|w| w[1] == w[0] + 1);
        for lag in lags {
            let (mut sum, mut square, mut product) = (0.0, 0.0, 0.0);
            let mut add = |x: f64, y: f64| {
                sum += x;
                square += x * x;
                product += x * (y - middle);
            };
            let shift = |row: usize| (row as i64 - lag) as usize;
            match (whole, rows.first(), rows.last()) {
                (true, Some(a), Some(b)) => {
                    let (u, y) = (u.get(shift(*a)..=shift(*b))?, y.get(*a..=*b)?);
                    u.iter().zip(y).for_each(|(x, y)| add(*x, *y));
                }
                _ => rows.iter().for_each(|row| add(u[shift(*row)], y[*row])),
            }
            uu.push((square - sum * sum / count).max(0.0));
            uy.push(product);
        }
        Some(Block { yy, uu, uy })
    }

    /// The best lag over all blocks but `skip`; `None` where nothing moves.
    pub fn best(&self, skip: Option<usize>) -> Option<Follow> {
        self.best_of(skip, &|_, _| true)
    }

    /// The best lag from `lags.0` to `lags.1` samples at which the gain has this sign.
    pub fn within(&self, lags: (i64, i64), sign: f64) -> Option<Follow> {
        self.best_of(None, &|lag, gain| (lags.0..=lags.1).contains(&lag) && gain * sign > 0.0)
    }

    /// Whether the best lag is the first or the last that was tried: then it is none.
    pub fn is_at_the_end(&self, found: &Follow) -> bool {
        let last = self.first + self.blocks.first().map_or(0, |block| block.uu.len() as i64) - 1;
        found.lag <= self.first as f64 || found.lag >= last as f64
    }

    fn best_of(&self, skip: Option<usize>, allowed: &dyn Fn(i64, f64) -> bool) -> Option<Follow> {
        let used = || self.blocks.iter().enumerate().filter(|(place, _)| Some(*place) != skip).map(|(_, block)| block);
        let yy: f64 = used().map(|block| block.yy).sum();
        let count = self.blocks.first()?.uu.len();
        if yy <= 0.0 {
            return None;
        }
        let at = |lag: usize| {
            let (uu, uy) = used().fold((0.0, 0.0), |(a, b), block| (a + block.uu[lag], b + block.uy[lag]));
            (if uu > 0.0 { uy * uy / (uu * yy) } else { 0.0 }, if uu > 0.0 { uy / uu } else { 0.0 })
        };
        let scores: Vec<(f64, f64)> = (0..count).map(at).collect();
        let best = (0..count)
            .filter(|lag| allowed(*lag as i64 + self.first, scores[*lag].1))
            .max_by(|a, b| scores[*a].0.total_cmp(&scores[*b].0))?;
        let mut lag = best as f64;
        if best > 0 && best + 1 < count {
            let (a, b, c) = (scores[best - 1].0, scores[best].0, scores[best + 1].0);
            let bend = a - 2.0 * b + c;
            if bend < 0.0 {
                lag += (0.5 * (a - c) / bend).clamp(-0.5, 0.5);
            }
        }
        let at_once = usize::try_from(-self.first).ok().and_then(|zero| scores.get(zero)).map_or(0.0, |score| score.0);
        let (explained, gain) = scores[best];
        Some(Follow { lag: lag + self.first as f64, gain, explained, at_once })
    }

    /// The half-width of the 95 % interval of the lag, samples, by the jackknife over blocks with Student's t; `None` for fewer than three blocks that move.
    pub fn uncertainty(&self) -> Option<f64> {
        let moving: Vec<usize> = (0..self.blocks.len()).filter(|place| self.blocks[*place].yy > 0.0).collect();
        if moving.len() < 3 {
            return None;
        }
        let lags: Vec<f64> = moving.iter().filter_map(|skip| self.best(Some(*skip))).map(|follow| follow.lag).collect();
        let count = lags.len() as f64;
        let middle = mean(&lags);
        let variance = (count - 1.0) / count * lags.iter().map(|lag| (lag - middle).powi(2)).sum::<f64>();
        Some(variance.sqrt() * student(count - 1.0))
    }
}

/// The 97.5 % point of Student's distribution.
pub fn student(freedom: f64) -> f64 {
    use statrs::distribution::{ContinuousCDF, StudentsT};
    StudentsT::new(0.0, 1.0, freedom.max(1.0)).map_or(1.96, |t| t.inverse_cdf(0.975))
}

/// How `y` follows `u` with lags between these, samples.
pub fn follow(u: &[f64], y: &[f64], lags: (i64, i64)) -> Option<Follow> {
    Profile::new(u, y, lags, None).best(None)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_lag_between_samples_is_found_with_gain_and_sign() {
        let wave = |t: f64| (0.07 * t).sin() + 0.5 * (0.023 * t).cos();
        let u: Vec<f64> = (0..1500).map(|i| wave(f64::from(i))).collect();
        let y: Vec<f64> = (0..1500).map(|i| 3.0 - 0.8 * wave(f64::from(i) - 4.3)).collect();
        let profile = Profile::new(&u, &y, (-10, 20), None);
        let found = profile.best(None).unwrap();
        assert!((found.lag - 4.3).abs() < 0.1 && (found.gain + 0.8).abs() < 0.01 && found.explained > 0.999, "{found:?}");
        assert!(profile.uncertainty().unwrap() < 0.2);
        assert!(follow(&u, &vec![1.0; 1500], (-10, 10)).is_none());
    }
}
