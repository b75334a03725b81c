//! How well the device repeats itself: recordings of the same excitation, and periods of a periodic one. No model can do better than that.

use crate::recordings::problem::{Problem, Record};
use crate::tuning::tuning;
use backdrive_plant::set::Initial;

/// Two stretches under the same excitation, and how far an output is apart in them.
#[derive(Debug, Clone, PartialEq)]
pub struct Repeat {
    /// The later recording, by its place among the fitted ones.
    pub record: usize,
    /// The earlier one; the same where it is a period that is repeated.
    pub of: usize,
    /// The output, by its place in the model.
    pub output: usize,
    /// Standard deviation of one of them, in the output's unit.
    pub apart: f64,
    /// Length of the period, s; `None` where whole recordings repeat each other.
    pub period: Option<f64>,
}

/// Every repetition among the recordings that are fitted.
pub fn repeats(problem: &Problem) -> Vec<Repeat> {
    let mut all = Vec::new();
    for (i, a) in problem.fit.iter().enumerate() {
        // What begins anywhere does something else under the same excitation.
        let before = if problem.initial == Initial::Free { &[] } else { &problem.fit[..i] };
        for (j, b) in before.iter().enumerate() {
            all.extend(recordings(a, b).into_iter().map(|(output, apart)| Repeat { record: i, of: j, output, apart, period: None }));
        }
        all.extend(periods(a, &problem.lag).into_iter().map(|(output, apart, period)| Repeat {
            record: i,
            of: i,
            output,
            apart,
            period: Some(period),
        }));
    }
    all
}

/// What the device does not repeat at each output, noise standard deviations, the noise itself included; 1 where nothing was repeated.
pub fn floors(problem: &Problem, noise_sd: &[f64]) -> Vec<f64> {
    let all = repeats(problem);
    let of = |(output, noise_sd): (usize, &f64)| {
        let own: Vec<f64> = all.iter().filter(|r| r.output == output).map(|r| (r.apart / noise_sd).powi(2)).collect();
        if own.is_empty() { 1.0 } else { (own.iter().sum::<f64>() / own.len() as f64).sqrt().max(1.0) }
    };
    noise_sd.iter().enumerate().map(of).collect()
}

/// Two recordings of the same excitation: how far each output is apart. Empty where they are of different excitations. Samples are compared by
/// their times.
fn recordings(a: &Record, b: &Record) -> Vec<(usize, f64)> {
    let on = |samples: &[f64]| at_times_of(a, b, samples);
    let (long, short) = (a.period * a.len as f64, b.period * b.len as f64);
    let moves = a.inputs.iter().any(|input| input.iter().any(|x| *x != input[0]));
    if (long / short - 1.0).abs() > 0.01 || !moves {
        return Vec::new();
    }
    let same = |(x, y): (&Vec<f64>, &Vec<f64>)| is_repeated(x, &on(y));
    if !a.inputs.iter().zip(&b.inputs).all(same) {
        return Vec::new();
    }
    let both = a.outputs.iter().zip(&b.outputs).enumerate();
    both.filter_map(|(o, (x, y))| Some((o, deviation(x.as_deref()?, &on(y.as_deref()?))))).collect()
}

/// Periods of a recording with periodic inputs: the difference of each output from one period to the next. Also their length, s, where that is constant.
/// The first period, in which the device approaches its periodic motion, does not count, nor does a difference that still falls. For a position that
/// nothing holds, which may drift between periods, the displacement over `lag` samples is compared.
fn periods(record: &Record, lag: &[usize]) -> Vec<(usize, f64, f64)> {
    let Some(length) = period_of(record) else { return Vec::new() };
    let of = |(o, samples): (usize, &Option<Vec<f64>>)| {
        let later = samples.as_deref()?.get(length..)?;
        let lag = lag.get(o).copied().unwrap_or(0);
        let displaced: Vec<f64> = match lag {
            0 => later.to_vec(),
            lag => later.iter().skip(lag).zip(later).map(|(now, then)| now - then).collect(),
        };
        // Both ends of a displacement have the noise of a sample.
        let ends = if lag > 0 { std::f64::consts::SQRT_2 } else { 1.0 };
        // Each period beside the one before.
        let whole: Vec<&[f64]> = displaced.chunks_exact(length).collect();
        let apart: Vec<f64> = whole.windows(2).map(|pair| deviation(pair[1], pair[0]) / ends).collect();
        let [.., before, last] = apart.as_slice() else { return None };
        // What still falls is the device coming to its rhythm.
        (*last >= tuning().recordings.settles * before)
            .then(|| (o, apart.iter().copied().fold(f64::INFINITY, f64::min), length as f64 * record.period))
    };
    record.outputs.iter().enumerate().filter_map(of).collect()
}

/// The shortest period after which all inputs repeat themselves, samples; at least three of them are in the recording.
fn period_of(record: &Record) -> Option<usize> {
    let moving = record.inputs.iter().find(|x| x.iter().any(|v| *v != x[0]))?;
    let stride = (record.len / 2000).max(1);
    let coarse: Vec<f64> = moving.iter().step_by(stride).copied().collect();
    let apart = |x: &[f64], lag: usize| distance(&x[lag..], x) / x.len().saturating_sub(lag).max(1) as f64;
    let power = coarse.iter().map(|x| x * x).sum::<f64>() / coarse.len().max(1) as f64;
    // Shorter periods than some twenty samples are what a sample can hardly resolve.
    const FEWEST: usize = 20;
    let candidates = (FEWEST.div_ceil(stride)..coarse.len() / 3).filter(|lag| apart(&coarse, *lag) < 0.01 * power);
    let exact = |lag: usize| {
        // A slow input is nearly its own a few samples later; after none it is so exactly, which is no period.
        let near = (lag * stride).saturating_sub(stride).max(FEWEST)..=((lag + 1) * stride).max(FEWEST);
        near.min_by(|a, b| apart(moving, *a).total_cmp(&apart(moving, *b)))
    };
    let all = |length: &usize| record.inputs.iter().all(|x| is_repeated(&x[*length..], x));
    candidates.take(50).filter_map(exact).find(all)
}

/// Samples of another recording at the times of this one, linear between them.
fn at_times_of(own: &Record, other: &Record, samples: &[f64]) -> Vec<f64> {
    let ratio = own.period / other.period;
    let at = |i: usize| {
        let place = i as f64 * ratio;
        let (k, part) = (place.floor() as usize, place.fract());
        let here = samples.get(k).or(samples.last()).copied().unwrap_or(0.0);
        here + part * (samples.get(k + 1).copied().unwrap_or(here) - here)
    };
    (0..own.len).map(at).collect()
}

/// Whether an input is the same a second time; one that is 0 throughout is no evidence against it.
fn is_repeated(x: &[f64], y: &[f64]) -> bool {
    let square: f64 = x.iter().map(|x| x * x).sum();
    distance(x, y) <= tuning().recordings.repeated * square
}

fn distance(x: &[f64], y: &[f64]) -> f64 {
    x.iter().zip(y).map(|(x, y)| (x - y) * (x - y)).sum()
}

/// Standard deviation of each of two that should be the same.
fn deviation(x: &[f64], y: &[f64]) -> f64 {
    (distance(x, y) / (2 * x.len().min(y.len()).max(1)) as f64).sqrt()
}

#[cfg(test)]
mod tests {
    use super::*;
    use backdrive_plant::model::Model;
    use backdrive_plant::recording::Recording;

    const CART: &str = "name = 'cart'\n[bodies]\ncart = 2.0\n[[inputs]]\nname = 'f'\nkind = 'force'\non = 'cart'\n\
                        [[outputs]]\nname = 'x'\nkind = 'position'\nof = 'cart'\n";

    fn record(count: usize, period: f64, f: impl Fn(f64) -> f64, x: impl Fn(f64) -> f64) -> Record {
        let t: Vec<f64> = (0..count).map(|i| period * i as f64).collect();
        let of = |signal: &dyn Fn(f64) -> f64| t.iter().map(|t| signal(*t)).collect::<Vec<f64>>();
        let signals = vec![("f".to_string(), of(&f)), ("x".to_string(), of(&x))];
        Record::new(&Recording::new("r", t.clone(), signals).unwrap(), &Model::from_toml(CART, "cart.toml").unwrap(), Vec::new()).unwrap()
    }

    #[test]
    fn recordings_of_different_periods_are_compared_by_their_times() {
        let push = |t: f64| (3.0 * t).sin() * (-0.5 * t).exp();
        let (a, b) = (record(2000, 2e-3, push, |t| t.sin()), record(1000, 4e-3, push, |t| t.sin() + 0.02));
        let found = recordings(&a, &b);
        assert!((found[0].1 - 0.02 / 2.0f64.sqrt()).abs() < 2e-4, "{found:?}");
        // Another excitation, and another length, repeat nothing.
        assert!(recordings(&a, &record(2000, 2e-3, |t| push(1.1 * t), f64::sin)).is_empty());
        assert!(recordings(&a, &record(1500, 2e-3, push, f64::sin)).is_empty());
    }

    #[test]
    fn periods_of_a_periodic_excitation_are_compared_after_the_first() {
        let drift =
            record(4000, 1e-3, |t| (std::f64::consts::TAU * t / 0.5).sin(), |t| t.mul_add(0.01, (std::f64::consts::TAU * t / 0.5).cos()));
        let found = periods(&drift, &[0]);
        assert!((found[0].2 - 0.5).abs() < 2e-3, "{found:?}");
        assert!((found[0].1 - 0.005 / 2.0f64.sqrt()).abs() < 1e-4, "{found:?}");
        // A drift of what nothing holds is no lack of repetition.
        assert!(periods(&drift, &[20]).iter().all(|found| found.1 < 1e-3));
        assert!(periods(&record(4000, 1e-3, |t| (t * t).sin(), f64::sin), &[0]).is_empty());
        // For a long and slow input no period of any length is reported.
        assert!(periods(&record(60_000, 1e-3, |t| (0.02 * t).sin(), f64::sin), &[0]).iter().all(|found| found.2 > 0.0));
        // A rhythm that it comes to over many periods is no lack of repetition either.
        let settling = |t: f64| (std::f64::consts::TAU * t / 0.5).cos() + 0.2 * (-t).exp();
        assert!(periods(&record(4000, 1e-3, |t| (std::f64::consts::TAU * t / 0.5).sin(), settling), &[0]).is_empty());
    }
}
