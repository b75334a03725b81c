//! Properties of one column of samples: constant, clipped, quantised, low-pass filtered, correlated with another.

use crate::tuning::tuning;

/// Smallest and largest sample.
pub(super) fn extremes(samples: &[f64]) -> (f64, f64) {
    samples.iter().fold((f64::INFINITY, f64::NEG_INFINITY), |(a, b), x| (a.min(*x), b.max(*x)))
}

/// Whether all samples are the same.
pub(super) fn is_constant(samples: &[f64]) -> bool {
    let (low, high) = extremes(samples);
    high <= low
}

/// Share of samples at the extremes, and these; 0 of what looks like a square wave.
pub(super) fn clipped_share(samples: &[f64]) -> (f64, f64, f64) {
    let (low, high) = extremes(samples);
    let near = 1e-4 * (high - low);
    let count = samples.len().max(1) as f64;
    let moving = samples.windows(2).filter(|w| (w[1] - w[0]).abs() > near).count() as f64 / count;
    let share = |x: f64| samples.iter().filter(|s| (**s - x).abs() < near).count() as f64 / count;
    // A square wave is at its extremes all of the time and does not count.
    if moving > tuning().recordings.moving { (share(low) + share(high), low, high) } else { (0.0, low, high) }
}

/// Ends of its range at which a signal stands for longer than a smooth one does: the level, and the share of samples there. The measure is the band next to
/// an end, of the same width. A smooth signal has two fifths as many samples there, a limited one next to none; so has one of coarse steps.
pub fn limits_reached(samples: &[f64]) -> Vec<(f64, f64)> {
    if clipped_share(samples).0 <= tuning().recordings.clipped {
        return Vec::new();
    }
    let (low, high) = extremes(samples);
    let band = (1e-4 * (high - low)).max(crate::recordings::noise::step_of(samples).unwrap_or(0.0));
    let within = |level: f64, from: f64, to: f64| samples.iter().filter(|s| (from..to).contains(&((**s - level).abs() / band))).count();
    let is_limit = |level: f64| {
        let (at, beside) = (within(level, 0.0, 0.5), within(level, 0.5, 1.5));
        let share = at as f64 / samples.len().max(1) as f64;
        (share > 0.5 * tuning().recordings.clipped && at > 4 * beside).then_some((level, share))
    };
    [low, high].into_iter().filter_map(is_limit).collect()
}

/// Whether samples lie anywhere between the steps of a grid.
pub(super) fn off_grid(samples: &[f64], step: f64) -> bool {
    let (low, high) = extremes(samples);
    // Seven digits of a file blur fine grids.
    if 1e-6 * low.abs().max(high.abs()) > 0.05 * step {
        return false;
    }
    let [distance, share] = tuning().recordings.off_grid;
    let off = samples.iter().filter(|x| ((*x / step) - (*x / step).round()).abs() > distance).count();
    off as f64 > share * samples.len() as f64
}

/// Power above three quarters of the Nyquist frequency over that of a level of white noise at the level of the quarter below it;
/// `None` for short signals. A sensor's own noise reaches up to the end.
pub(super) fn quiet_top(samples: &[f64]) -> Option<f64> {
    if samples.len() < 256 {
        return None;
    }
    let mut planner = realfft::RealFftPlanner::<f64>::new();
    let transform = planner.plan_fft_forward(samples.len());
    let n = samples.len() as f64;
    // A window, or the ends' step would fill the band.
    let mut input: Vec<f64> =
        samples.iter().enumerate().map(|(i, x)| x * (std::f64::consts::PI * (i as f64 + 0.5) / n).sin().powi(4)).collect();
    let mut output = transform.make_output_vec();
    transform.process(&mut input, &mut output).ok()?;
    let power: Vec<f64> = output.iter().map(|c| c.norm_sqr()).collect();
    let mean = |from: f64, to: f64| {
        let range = (from * power.len() as f64) as usize..(to * power.len() as f64) as usize;
        let part = power.get(range).unwrap_or(&[]);
        part.iter().sum::<f64>() / part.len().max(1) as f64
    };
    let (middle, top) = (mean(0.25, 0.5), mean(0.75, 1.0));
    (middle > 0.0).then(|| top / middle)
}

/// Largest correlation of the finest grain of `u` with that of `y` at the same sample or up to two samples before. 0 where `y` follows `u` instead, as a
/// device does.
pub(super) fn answers(u: &[f64], y: &[f64]) -> f64 {
    let grain = |x: &[f64]| -> Vec<f64> { x.windows(5).map(|w| w[0] - 4.0 * w[1] + 6.0 * w[2] - 4.0 * w[3] + w[4]).collect() };
    let (a, b) = (grain(u), grain(y));
    let size = |x: &[f64]| x.iter().map(|x| x * x).sum::<f64>().sqrt();
    let norm = size(&a) * size(&b);
    if norm <= 0.0 {
        return 0.0;
    }
    let product = |late: &[f64], early: &[f64], lag: usize| late.iter().skip(lag).zip(early).map(|(x, y)| x * y).sum::<f64>().abs() / norm;
    let answer = (0..=2).map(|lag| product(&a, &b, lag)).fold(0.0, f64::max);
    let response = (1..=3).map(|lag| product(&b, &a, lag)).fold(0.0, f64::max);
    if answer > response { answer } else { 0.0 }
}

#[cfg(test)]
mod tests {
    use super::*;
    use rand::SeedableRng;
    use rand_distr::{Distribution, StandardNormal};

    fn noise(n: usize, seed: u64) -> Vec<f64> {
        let mut random = rand_chacha::ChaCha8Rng::seed_from_u64(seed);
        (0..n).map(|_| StandardNormal.sample(&mut random)).collect()
    }

    #[test]
    fn a_force_that_answers_a_measured_noise_is_seen() {
        let e = noise(4000, 1);
        let y: Vec<f64> = e.iter().enumerate().map(|(i, e)| (i as f64 * 0.01).sin() + 0.01 * e).collect();
        let answer: Vec<f64> = y.iter().enumerate().map(|(i, y)| (i as f64 * 0.013).cos() - 50.0 * y).collect();
        let free: Vec<f64> = noise(4000, 2).iter().enumerate().map(|(i, e)| (i as f64 * 0.013).cos() + 0.1 * e).collect();
        assert!(answers(&answer, &y) > 0.9);
        assert!(answers(&free, &y) < 0.1);
        // What answers a force is the device.
        let pushed: Vec<f64> = free.iter().scan(0.0, |x, u| Some(std::mem::replace(x, 0.9 * *x + u))).collect();
        assert!(answers(&free, &pushed) < 0.1);
    }

    #[test]
    fn a_limited_force_is_told_from_a_sine_and_a_square() {
        let sine: Vec<f64> = (0..4000).map(|i| (f64::from(i) * 0.013).sin()).collect();
        let limited: Vec<f64> = sine.iter().map(|x| x.clamp(-0.8, 0.8)).collect();
        let square: Vec<f64> = sine.iter().map(|x| x.signum()).collect();
        assert!(clipped_share(&sine).0 < 0.02);
        assert!(clipped_share(&limited).0 > 0.3);
        assert_eq!(clipped_share(&square).0, 0.0);
        assert!(limits_reached(&sine).is_empty() && limits_reached(&square).is_empty());
        assert_eq!(limits_reached(&limited).iter().map(|l| l.0).collect::<Vec<_>>(), [-0.8, 0.8]);
        let one_sided: Vec<f64> = sine.iter().map(|x| x.min(0.9)).collect();
        assert_eq!(limits_reached(&one_sided).iter().map(|l| l.0).collect::<Vec<_>>(), [0.9]);
        let coarse: Vec<f64> = sine.iter().map(|x| (x / 0.05).round() * 0.05).collect();
        assert!(limits_reached(&coarse).is_empty(), "{:?}", limits_reached(&coarse));
    }

    #[test]
    fn a_filtered_signal_has_a_quiet_top() {
        let white: Vec<f64> = noise(4096, 3);
        assert!(quiet_top(&white).unwrap() > 0.5);
        let mut filtered = white.clone();
        for _ in 0..4 {
            let mut state = 0.0;
            for x in &mut filtered {
                state += 0.2 * (*x - state);
                *x = state;
            }
        }
        // Four poles at a fifth: well down, but not to nothing as a brick wall.
        assert!(quiet_top(&filtered).unwrap() < 0.2);
    }
}
