//! What a coupled pair does while the hand moves: whether every oscillation that the motion stirs up dies, and how fast.
//!
//! A pair of motors that act on each other's positions is a closed loop all the time, and its hand need never hold still. What the hand does is slow and
//! unknown; what the loop makes of it above that is a sum of its modes. They are identified by an autoregressive model of the motion (output-only modal
//! analysis; Neumaier and Schneider 2001), of the order that Schwarz's criterion selects. The interval of each decay follows from the covariance of the model's
//! coefficients, a sandwich over twenty blocks of time. Derivatives propagate it to the pole. The same is done in bands, one above the other, of the coupling
//! error and of the master.
//!
//! | fact | threshold |
//! |---|---|
//! | a mode | above 8 Hz, in a band in which the motion is above the floor of `outcome` |
//! | it dies | as fast as in a hold: to 0.7 in 0.225 s, 1.6 per second, with all of its 95 % interval |
//! | it does not | its decay lies below that, and its interval below twice that: a limit cycle; with all of its interval below -0.2: unstable |
//! | a line goes on | a sinusoid seen in four pieces of a second in a row (`line.rs`): a limit cycle, or unstable where it grows by more than 0.2 per second |
//! | otherwise | not judged |

mod line;

use crate::coupling::BothWays;
use crate::outcome::{LEAST_AMPLITUDE, LOWEST_HZ, NOISE, Outcome, Unit};
use crate::unjudged::Unjudged;
use line::{Line, WANDERS_HZ, line};
use nalgebra::{Complex, DMatrix, DVector};
use serde::Serialize;
use statrs::distribution::{ContinuousCDF, StudentsT};

/// How fast the slowest mode of a coupled pair dies.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Decay {
    /// Hz.
    pub frequency_hz: f64,
    /// Decay of its envelope, 1/s; negative where it grows.
    pub per_s: f64,
    /// 95 % interval, 1/s.
    pub ci95: [f64; 2],
    /// Amplitude of the motion in its band, m or rad.
    pub amplitude: f64,
    /// Whether it was seen in the difference of the positions, or in the master's own motion.
    pub of_error: bool,
}

/// Decay above which an oscillation dies, 1/s: to 0.7 in the three quarters of the shortest hold, as in `outcome`.
const DIES: f64 = 1.6;
/// Envelope growing faster than this grows, 1/s, as in `outcome`.
const GROWS: f64 = 0.2;
/// Blocks of time that count as independent.
const BLOCKS: usize = 20;
/// Highest order of a model.
const MOST_ORDER: usize = 12;
/// A band reaches from where the one below ends to this share of its sample rate; the decimation filter is flat up to there.
const UPPER: f64 = 0.35;
/// Sample rate of the lowest band, Hz, and the factor from band to band.
const LOWEST_RATE_HZ: f64 = 200.0;
const STEP: f64 = 4.0;
/// Fewest samples of a band.
const LEAST_SAMPLES: usize = 200;

/// The motions of a pair, rows `period_s` apart.
#[derive(Debug, Clone, Copy)]
pub struct Pair<'a> {
    /// x_m, m or rad.
    pub master: &'a [f64],
    /// x_s, m or rad.
    pub slave: &'a [f64],
    /// Position scale: the slave is at `mu` times the master.
    pub mu: f64,
    /// Time of one row, s.
    pub period_s: f64,
    /// Step of the master's position sensor, m or rad.
    pub resolution: f64,
    /// Standard deviation of its noise, m or rad.
    pub noise: f64,
    /// In what positions are counted.
    pub unit: Unit,
}

/// What a pair did, and the mode that is least sure to die where one was seen.
pub fn judge(pair: &Pair) -> (Outcome, Option<Decay>) {
    let Pair { mu, period_s, unit, .. } = *pair;
    let no = |why: Unjudged| (Outcome::NotJudged { why }, None);
    let master = without_holes(pair.master);
    let error: Vec<f64> = master.iter().zip(without_holes(pair.slave)).map(|(m, s)| mu * m - s).collect();
    if master.iter().chain(&error).any(|x| !x.is_finite()) || master.is_empty() {
        return no(Unjudged::Empty);
    }
    let floor = LEAST_AMPLITUDE.max(4.0 * pair.resolution) + NOISE * pair.noise;
    let mut seen: Vec<Decay> = Vec::new();
    let mut shaken = false;
    let of_master = line(&master, period_s, LOWEST_HZ, floor);
    let of_error = line(&error, period_s, LOWEST_HZ, floor);
    // An amplitude is the master's, where the same line is seen in it.
    let same = |a: &Line, b: &Line| (a.frequency_hz - b.frequency_hz).abs() <= WANDERS_HZ;
    let line = match (of_error, of_master) {
        (Some(error), Some(master)) if same(&error, &master) || master.amplitude > error.amplitude => Some(master),
        (error, master) => error.or(master),
    };
    for (signal, of_error) in [(&error, true), (&master, false)] {
        for band in bands(period_s) {
            let samples = decimated(signal, band.every);
            if samples.len() < LEAST_SAMPLES {
                continue;
            }
            let amplitude = amplitude_in(signal, &band, period_s);
            if amplitude <= floor {
                continue;
            }
            shaken = true;
            let found = modes(&samples, &band, period_s).unwrap_or_default();
            seen.extend(found.into_iter().map(|m| Decay { amplitude, of_error, ..m }));
        }
    }
    if let Some(line) = line {
        let outcome = match line.growth_per_s > GROWS {
            true => Outcome::Unstable { growth_per_s: line.growth_per_s },
            false => Outcome::LimitCycle { amplitude_m: line.amplitude, frequency_hz: line.frequency_hz, unit },
        };
        return (outcome, None);
    }
    if !shaken {
        return no(Unjudged::NotShaken);
    }
    // What surely grows comes first, then what surely does not die, then what is least sure to.
    let grows = |m: &Decay| m.ci95[1] < -GROWS;
    let goes_on = |m: &Decay| m.per_s < DIES && m.ci95[1] < 2.0 * DIES;
    let rank = |m: &Decay| (!grows(m), !goes_on(m));
    let Some(worst) = seen.into_iter().min_by(|a, b| rank(a).cmp(&rank(b)).then(a.ci95[0].total_cmp(&b.ci95[0]))) else {
        // Nothing oscillates at all: what there is dies without a turn.
        return (Outcome::Stable, None);
    };
    let outcome = if worst.ci95[0] >= DIES {
        Outcome::Stable
    } else if grows(&worst) {
        Outcome::Unstable { growth_per_s: -worst.per_s }
    } else if goes_on(&worst) {
        Outcome::LimitCycle { amplitude_m: worst.amplitude, frequency_hz: worst.frequency_hz, unit }
    } else {
        Outcome::NotJudged { why: Unjudged::NoDecay }
    };
    (outcome, Some(worst))
}

/// A band of frequencies, and every so manieth sample for it.
#[derive(Debug, Clone, Copy)]
struct Band {
    every: usize,
    from_hz: f64,
    to_hz: f64,
}

fn bands(period_s: f64) -> Vec<Band> {
    let mut all = Vec::new();
    let (mut rate, mut from_hz) = (LOWEST_RATE_HZ, LOWEST_HZ);
    loop {
        let every = ((1.0 / (rate * period_s)).round() as usize).max(1);
        let to_hz = UPPER / (every as f64 * period_s);
        if to_hz > from_hz {
            all.push(Band { every, from_hz, to_hz });
            from_hz = to_hz;
        }
        if every == 1 {
            return all;
        }
        rate *= STEP;
    }
}

/// Every so manieth sample of a signal whose faster part is taken out before.
fn decimated(signal: &[f64], every: usize) -> Vec<f64> {
    let smooth = if every > 1 { low_pass(signal, 0.45 / every as f64) } else { signal.to_vec() };
    // Differences, for positions wander.
    let kept: Vec<f64> = smooth.iter().step_by(every).copied().collect();
    kept.windows(2).filter_map(|w| Some(w.get(1)? - w.first()?)).collect()
}

/// A low-pass by a windowed sinc (Blackman), its corner as a share of the sample rate. It is twelve of its periods long to either side, so that it is
/// flat up to four fifths of its corner.
fn low_pass(signal: &[f64], corner: f64) -> Vec<f64> {
    use std::f64::consts::PI;
    let half = (12.0 / corner).ceil() as i64;
    let tap = |i: i64| {
        let x = i as f64;
        let sinc = if i == 0 { 2.0 * corner } else { (2.0 * PI * corner * x).sin() / (PI * x) };
        let turn = PI * (x / half as f64 + 1.0);
        sinc * (0.42 - 0.5 * turn.cos() + 0.08 * (2.0 * turn).cos())
    };
    let taps: Vec<f64> = (-half..=half).map(tap).collect();
    let sum: f64 = taps.iter().sum();
    let last = signal.len() as i64 - 1;
    let at = |row: i64| signal.get(row.clamp(0, last) as usize).copied().unwrap_or(0.0);
    (0..=last).map(|row| taps.iter().zip(-half..).map(|(t, i)| t * at(row + i)).sum::<f64>() / sum).collect()
}

/// Amplitude of a sine with the power that the signal has in a band.
fn amplitude_in(signal: &[f64], band: &Band, period_s: f64) -> f64 {
    let below = |hz: f64| BothWays::new(hz, period_s).map_or_else(|| signal.to_vec(), |f| f.of(signal));
    let power = below(band.to_hz).iter().zip(below(band.from_hz)).map(|(a, b)| (a - b).powi(2)).sum::<f64>() / signal.len().max(1) as f64;
    (2.0 * power).sqrt()
}

/// The modes of a band that oscillate, with their intervals.
fn modes(samples: &[f64], band: &Band, period_s: f64) -> Option<Vec<Decay>> {
    let rate = 1.0 / (band.every as f64 * period_s);
    let order = order_of(samples)?;
    let coefficients = autoregression(samples, order)?;
    let covariance = covariance(samples, &coefficients)?;
    let t = StudentsT::new(0.0, 1.0, (BLOCKS - 1) as f64).map_or(2.1, |t| t.inverse_cdf(0.975));
    let found = poles(&coefficients).into_iter().filter_map(|pole| {
        let (frequency_hz, per_s) = (pole.im.atan2(pole.re) * rate / std::f64::consts::TAU, -pole.norm().ln() * rate);
        let slopes = DVector::from_iterator(order, slopes(&coefficients, pole).into_iter().map(|s| -(s / pole).re * rate));
        let half = t * (slopes.transpose() * &covariance * &slopes).get(0).copied()?.max(0.0).sqrt();
        let inside = pole.im > 0.0 && (band.from_hz..band.to_hz).contains(&frequency_hz) && half.is_finite();
        inside.then_some(Decay { frequency_hz, per_s, ci95: [per_s - half, per_s + half], amplitude: 0.0, of_error: false })
    });
    Some(found.collect())
}

/// How a pole moves with each coefficient.
fn slopes(coefficients: &[f64], pole: Complex<f64>) -> Vec<Complex<f64>> {
    let n = coefficients.len() as i32;
    let past = |i: usize| n - 1 - i as i32;
    let inner: Complex<f64> = coefficients.iter().enumerate().map(|(i, c)| pole.powi(past(i) - 1) * (c * f64::from(past(i)))).sum();
    let slope = pole.powi(n - 1) * f64::from(n) - inner;
    (0..coefficients.len()).map(|i| pole.powi(past(i)) / slope).collect()
}

/// Covariance of the coefficients: the sandwich over blocks of time, for what drives the pair is not of one size all the time.
fn covariance(samples: &[f64], coefficients: &[f64]) -> Option<DMatrix<f64>> {
    let order = coefficients.len();
    let rows = samples.len().checked_sub(order)?;
    let mut normal = DMatrix::zeros(order, order);
    let mut scores = vec![DVector::zeros(order); BLOCKS];
    for (row, window) in samples.windows(order + 1).enumerate() {
        let (past, next) = window.split_at(order);
        let past = DVector::from_iterator(order, past.iter().rev().copied());
        let error = next.first()? - past.iter().zip(coefficients).map(|(x, c)| x * c).sum::<f64>();
        normal += &past * past.transpose();
        *scores.get_mut(row * BLOCKS / rows)? += past * error;
    }
    let inverse = normal.pseudo_inverse(0.0).ok()?;
    let middle = scores.iter().map(|s| s * s.transpose()).sum::<DMatrix<f64>>() * (BLOCKS as f64 / (BLOCKS as f64 - 1.0));
    Some(&inverse * middle * &inverse)
}

/// The order that Schwarz's criterion takes.
fn order_of(samples: &[f64]) -> Option<usize> {
    let n = (samples.len().checked_sub(MOST_ORDER)?) as f64;
    let criterion = |order: usize| {
        let coefficients = autoregression(samples, order)?;
        // Over the same rows for every order.
        let errors = (MOST_ORDER..samples.len()).map(|row| {
            let predicted: f64 = coefficients.iter().enumerate().map(|(i, c)| c * samples.get(row - 1 - i).copied().unwrap_or(0.0)).sum();
            samples.get(row).copied().unwrap_or(0.0) - predicted
        });
        let power = errors.map(|e| e * e).sum::<f64>() / n;
        (power > 0.0).then(|| n * power.ln() + order as f64 * n.ln())
    };
    let all = (2..=MOST_ORDER).filter_map(|order| Some((order, criterion(order)?)));
    all.min_by(|a, b| a.1.total_cmp(&b.1)).map(|(order, _)| order)
}

/// Coefficients by which the last samples predict the next one, by least squares.
fn autoregression(samples: &[f64], order: usize) -> Option<Vec<f64>> {
    let mut normal = DMatrix::zeros(order, order);
    let mut right = DVector::zeros(order);
    for window in samples.windows(order + 1) {
        let (past, next) = window.split_at(order);
        let past = DVector::from_iterator(order, past.iter().rev().copied());
        right += &past * next.first().copied()?;
        normal += &past * past.transpose();
    }
    // The decomposition does not end on what is not finite.
    let finite = normal.iter().all(|x| x.is_finite());
    let solved = finite.then(|| normal.svd(true, true).solve(&right, 1e-14).ok())??;
    Some(solved.iter().copied().collect())
}

/// The poles of a model, one of each pair.
fn poles(coefficients: &[f64]) -> Vec<Complex<f64>> {
    let n = coefficients.len();
    let companion = DMatrix::from_fn(n, n, |i, j| match i {
        0 => coefficients.get(j).copied().unwrap_or(0.0),
        _ => f64::from(u8::from(i == j + 1)),
    });
    companion.complex_eigenvalues().iter().copied().filter(|p| p.im >= 0.0 && p.norm() > 0.0).collect()
}

/// A signal whose holes keep the value before them.
fn without_holes(signal: &[f64]) -> Vec<f64> {
    let mut before = signal.iter().copied().find(|x| x.is_finite()).unwrap_or(f64::NAN);
    let value = |x: &f64| {
        before = if x.is_finite() { *x } else { before };
        before
    };
    signal.iter().map(value).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use rand::SeedableRng;
    use rand_distr::{Distribution, StandardNormal};

    const PERIOD: f64 = 5e-4;

    /// A coupled pair whose difference has one mode, driven by a hand that moves all the time and by what it touches.
    fn pair(hz: f64, decay: f64, seconds: f64, more: impl Fn(f64) -> f64) -> [Vec<f64>; 2] {
        let mut random = rand_chacha::ChaCha8Rng::seed_from_u64(7);
        let w = std::f64::consts::TAU * hz;
        let (mut x, mut v, mut hand) = (0.0, 0.0, 0.0);
        let rows = (seconds / PERIOD) as usize;
        let (mut master, mut slave) = (Vec::new(), Vec::new());
        for row in 0..rows {
            let t = row as f64 * PERIOD;
            let white: f64 = StandardNormal.sample(&mut random);
            hand += PERIOD * 30.0 * (white * 20.0 - hand);
            v += PERIOD * (-2.0 * decay * v - (w * w + decay * decay) * x + 2.0 * hand);
            x += PERIOD * v;
            let m = 0.05 * (9.0 * t).sin() + 0.02 * (23.0 * t).sin();
            let round = |x: f64| (x / 2e-5).round() * 2e-5;
            master.push(round(m));
            slave.push(round(m - x - more(t)));
        }
        [master, slave]
    }

    fn judged([master, slave]: [Vec<f64>; 2]) -> (Outcome, Option<Decay>) {
        judge(&Pair { master: &master, slave: &slave, mu: 1.0, period_s: PERIOD, resolution: 2e-5, noise: 0.0, unit: Unit::Metre })
    }

    #[test]
    fn the_decay_of_a_known_mode_is_found_while_the_hand_moves() {
        for (hz, decay) in [(16.0, 25.0), (28.0, 40.0), (45.0, 15.0)] {
            let (outcome, found) = judged(pair(hz, decay, 5.0, |_| 0.0));
            let found = found.unwrap();
            assert_eq!(outcome, Outcome::Stable, "{found:?}");
            assert!(found.ci95[0] > DIES, "{found:?}");
            // Another mode, of the rounding, may be named as the slowest, but none that dies more slowly by much.
            assert!(found.per_s > 0.4 * decay, "{hz} {decay} {found:?}");
        }
    }

    #[test]
    fn a_limit_cycle_and_a_growing_oscillation_are_told_in_any_band() {
        for hz in [14.0, 40.0, 110.0, 330.0] {
            let line = move |t: f64| 1e-3 * (std::f64::consts::TAU * hz * t).sin();
            let (outcome, found) = judged(pair(20.0, 40.0, 5.0, line));
            let Outcome::LimitCycle { frequency_hz, .. } = outcome else { panic!("{hz}: {outcome:?} {found:?}") };
            assert!((frequency_hz - hz).abs() < 0.05 * hz, "{frequency_hz}");
        }
        let grows = |t: f64| 1e-6 * (2.0 * t).exp() * (std::f64::consts::TAU * 30.0 * t).sin();
        let (outcome, found) = judged(pair(20.0, 40.0, 5.0, grows));
        assert!(outcome.is_unstable(), "{outcome:?} {found:?}");
    }

    #[test]
    fn what_nothing_shakes_is_not_judged() {
        let n = 10_000;
        let still = || [vec![0.1; n], vec![0.1; n]];
        assert_eq!(judged(still()).0, Outcome::NotJudged { why: Unjudged::NotShaken });
        assert_eq!(judged([Vec::new(), Vec::new()]).0, Outcome::NotJudged { why: Unjudged::Empty });
    }
}
