//! Delay and lost motion of a position servo: its answer to the recorded commands, simulated and fitted.
//!
//! In the regression a delay and a damping are one lag. They differ in time: a delay moves everything, a damping rounds it. So a second order with delay,
//! offset, dry friction, play and weight is fitted by output error ([`backdrive_servo::fit`]), and standard errors are those of leaving out stretches
//! (jackknife). Half of a play has the effect of dry friction, to within the noise of a usual sensor. So only their sum is given, the lost motion at a
//! reversal; which of them it is a diagnosis of many recordings finds.

use backdrive_diagnosis::recordings::noise::{step_of, white};
use backdrive_plant::servo::{Number, Numbers};
use backdrive_servo::fit::Problem;
use backdrive_servo::record::Record;
use backdrive_signal::statistics::{deviation, rms};

/// What is fitted.
const FREE: [Number; 8] =
    [Number::Delay, Number::Inertia, Number::Damping, Number::Offset, Number::Friction, Number::Play, Number::MomentCos, Number::MomentSin];
/// Shares of the lag that are a delay at the start.
const SHARES: [f64; 4] = [0.1, 0.4, 0.7, 0.95];
/// Steps of the fits from each start, and of the one from the better one.
const SCREEN: usize = 4;
const FULL: usize = 20;
/// Samples, at the least: a quarter is left out in turn.
const LEAST: usize = 64;
/// A motion smaller than this many resolutions of the sensor determines nothing.
const RESOLVED: f64 = 20.0;
/// Resolution of delays, s: what a computer's clock gives.
const OF_TIME: f64 = 1e-4;

/// Where the fit starts, by the regression.
pub struct Start {
    /// Lag behind the command, s.
    pub lag: f64,
    /// Half of the dead zone at a reversal, rad or m.
    pub dead_zone: f64,
}

/// Values with standard errors; `None` where the motion does not determine them.
pub struct Response {
    /// Delay, s.
    pub delay: Option<(f64, f64)>,
    /// Width of the hysteresis between command and position: play, twice the dry friction over the servo's stiffness, and dead band, rad or m.
    pub lost_motion: Option<(f64, f64)>,
}

/// Fits the answer of one joint to its commands.
pub fn response(record: &Record, start: &Start) -> Response {
    let none = Response { delay: None, lost_motion: None };
    let resolution = step_of(&record.position).unwrap_or(0.0).max(white(&record.position).unwrap_or(0.0)).max(1e-9);
    let error: Vec<f64> = record.command.iter().zip(&record.position).map(|(u, q)| u - q).collect();
    if record.t.len() < LEAST || deviation(&record.position) < RESOLVED * resolution {
        return none;
    }
    let problem = Problem::new(vec![record], rms(&error).max(resolution));
    let lag = start.lag.max(1e-3);
    let from = |share: f64| {
        let mut numbers = Numbers::default();
        numbers[Number::Delay] = share * lag;
        numbers[Number::Damping] = (1.0 - share) * lag;
        numbers[Number::Inertia] = (0.3 * (1.0 - share) * lag).powi(2);
        numbers[Number::Friction] = 0.5 * start.dead_zone;
        numbers[Number::Play] = start.dead_zone;
        problem.fit(&FREE, &numbers, SCREEN, None)
    };
    let Some(better) = SHARES.map(from).into_iter().min_by(|a, b| a.cost.total_cmp(&b.cost)) else { return none };
    let fit = problem.fit(&FREE, &better.numbers, FULL, None);
    let folds = problem.leave_out(&fit);
    let estimate = |of: &dyn Fn(&Numbers) -> f64, floor: f64, most: f64| {
        let each: Vec<f64> = folds.iter().map(of).collect();
        let count = each.len().max(1) as f64;
        let mean = each.iter().sum::<f64>() / count;
        // At its bound a parameter of every fold is the same; it is known no better than the sensor resolves.
        let sd = (each.iter().map(|x| (x - mean).powi(2)).sum::<f64>() * (count - 1.0) / count).sqrt().hypot(floor);
        let value = of(&fit.numbers);
        (value.is_finite() && sd <= most).then_some((value, sd))
    };
    let lost = |numbers: &Numbers| 2.0 * numbers[Number::Friction] + numbers[Number::Play];
    let most = lost(&fit.numbers).max(2.0 * start.dead_zone).max(4.0 * resolution);
    Response { delay: estimate(&|numbers| numbers[Number::Delay], OF_TIME, lag), lost_motion: estimate(&lost, resolution, most) }
}

#[cfg(test)]
mod tests {
    use super::*;
    use backdrive_servo::simulate::simulate;
    use rand::SeedableRng;
    use rand_distr::{Distribution, StandardNormal};

    /// A record of half a minute at 50 samples per second of a servo with these parameters.
    fn record(delay: f64, play: f64, seed: u64) -> Record {
        let mut numbers = Numbers::default();
        numbers[Number::Delay] = delay;
        numbers[Number::Damping] = 0.04;
        numbers[Number::Inertia] = 4e-4;
        numbers[Number::Friction] = 0.004;
        numbers[Number::Play] = play;
        let t: Vec<f64> = (0..1500).map(|i| 0.02 * f64::from(i)).collect();
        let shift = seed as f64;
        // With some motion at 1.5 and 2.7 Hz: slower ones show the sum of delay and damping alone.
        let waves = [(0.5, 1.1), (0.2, 3.7), (0.05, 9.3), (0.02, 17.0)];
        let command: Vec<f64> = t.iter().map(|t| waves.iter().map(|(size, w)| size * (w * (t + shift)).sin()).sum()).collect();
        let mut record = Record { name: "r".to_string(), position: command.clone(), t, command, gravity: Vec::new() };
        let mut random = rand_chacha::ChaCha8Rng::seed_from_u64(seed);
        let mut noise = || -> f64 { StandardNormal.sample(&mut random) };
        record.position = simulate(&numbers, &record, 5).iter().map(|q| q + 2e-4 * noise()).collect();
        record
    }

    #[test]
    fn delay_and_lost_motion_are_those_that_were_simulated() {
        for (delay, play, seed) in [(0.03, 0.0, 1), (0.06, 0.02, 2), (0.03, 0.03, 3), (0.09, 0.005, 4)] {
            let record = record(delay, play, seed);
            let found = response(&record, &Start { lag: 0.04 + delay, dead_zone: 0.004 + 0.5 * play });
            let (at, sd) = found.delay.unwrap();
            assert!((at - delay).abs() < 0.003 + 3.0 * sd && sd < 0.01, "delay {delay}: {at} +- {sd}");
            let (at, sd) = found.lost_motion.unwrap();
            let lost = play + 2.0 * 0.004;
            assert!((at - lost).abs() < 0.02 * lost + 3.0 * sd && sd < 0.002, "lost motion {lost}: {at} +- {sd}");
        }
    }

    #[test]
    fn a_joint_that_rests_determines_neither() {
        let mut record = record(0.03, 0.0, 5);
        let mut random = rand_chacha::ChaCha8Rng::seed_from_u64(6);
        record.position.iter_mut().for_each(|q| {
            let e: f64 = StandardNormal.sample(&mut random);
            *q = 2e-4 * e
        });
        let found = response(&record, &Start { lag: 0.0, dead_zone: 0.0 });
        assert!(found.delay.is_none() && found.lost_motion.is_none());
    }
}
