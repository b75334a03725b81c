//! The regression of one joint: least squares, with standard errors that hold for correlated residuals.

use super::joints::{JointData, LEAST_ROWS};
use crate::parameter::{EFFECTS, GAIN, LAG, REGRESSED};
use backdrive_diagnosis::arms::physics::direction;
use backdrive_signal::derivative;
use backdrive_signal::statistics::rms;
use nalgebra::{DMatrix, DVector};

/// A column that the others explain but for this share of its size is left out: its standard error would be twenty times that of the column alone.
const OWN_SHARE: f64 = 0.05;
/// Stribeck speed, as a share of the joint's usual one.
const STRIBECK: f64 = 0.15;
/// Parts of the recording that are left out in turn for the jackknife.
const FOLDS: usize = 8;

/// What a regression gave.
pub struct Regressed {
    /// Value and standard error of each of [`REGRESSED`]; `None` where the motion does not determine it.
    pub parameters: [Option<(f64, f64)>; REGRESSED.len()],
    /// Size and standard error of each of [`EFFECTS`], added alone; `None` where the motion does not determine it.
    pub effects: [Option<(f64, f64)>; EFFECTS.len()],
    /// Rms of the residual, in the unit of the effort.
    pub residual: f64,
    /// Rms of the effort about its mean.
    pub effort: f64,
    /// Rms of the velocity, rad/s or m/s.
    pub speed: f64,
    /// Rows that counted.
    pub rows: usize,
}

/// Regresses the effort of a joint.
pub fn regress(joint: &JointData) -> Regressed {
    let masked = |signal: &[f64]| -> Vec<f64> {
        let counted: Vec<f64> = signal.iter().zip(&joint.counts).map(|(x, counts)| x * counts).collect();
        joint.rates.rows(&counted)
    };
    let none = vec![0.0; joint.effort.len()];
    let load = joint.load.as_deref();
    let links = load.unwrap_or(&none);
    let late: Vec<f64> = derivative(links, joint.rates.period()).iter().map(|x| -x).collect();
    // Of a servo the links take no torque of the effort itself: it is a displacement in proportion to their torque.
    let taken = if joint.is_servo { &none } else { links };
    let own: Vec<f64> = joint.effort.iter().zip(taken).map(|(effort, links)| effort - links).collect();
    let left = masked(&own);
    let one = vec![1.0; left.len().max(joint.effort.len())];
    let friction = direction(joint.position.iter().copied(), joint.turn);
    let signals: [&[f64]; REGRESSED.len()] = [&friction, &joint.velocity, &one[..joint.effort.len()], links, &joint.acceleration, &late];
    let mut columns: Vec<(Option<usize>, Vec<f64>)> = Vec::new();
    for (index, signal) in signals.iter().enumerate() {
        let needs_links = REGRESSED[index] == GAIN || REGRESSED[index] == LAG;
        // The error of a servo's position is a lag by itself.
        if needs_links && (load.is_none() || joint.is_servo && REGRESSED[index] == LAG) {
            continue;
        }
        columns.push((Some(index), masked(signal)));
        if REGRESSED[index].name == "constant" && load.is_none() && joint.is_servo {
            // Gravity without a model: a sine of the joint's own angle.
            for wave in [f64::sin, f64::cos] {
                columns.push((None, masked(&joint.position.iter().map(|q| wave(*q)).collect::<Vec<f64>>())));
            }
        }
    }
    let columns = independent(columns);
    let rows = masked(&one[..joint.effort.len()]).iter().filter(|x| **x > 0.5).count();
    let mut out = Regressed {
        parameters: [None; REGRESSED.len()],
        effects: [None; EFFECTS.len()],
        residual: rms(&left),
        effort: spread(&joint.effort),
        speed: rms(&joint.velocity),
        rows,
    };
    if rows < LEAST_ROWS || columns.is_empty() {
        return out;
    }
    let Some((values, errors, residual)) = solved(&columns, &left) else { return out };
    out.residual = residual;
    for (place, signal) in effects(joint, &friction, load).into_iter().enumerate() {
        let Some(signal) = signal else { continue };
        let mut with = columns.clone();
        with.push((None, masked(&signal)));
        let with = independent(with);
        if with.len() > columns.len() {
            out.effects[place] = solved(&with, &left).map(|(values, errors, _)| (values[columns.len()], errors[columns.len()]));
        }
    }
    for (place, (index, _)) in columns.iter().enumerate() {
        if let Some(index) = index {
            out.parameters[*index] = Some((values[place], errors[place]));
        }
    }
    out
}

/// The signals of [`EFFECTS`], each 1 at the joint's usual speed or load.
fn effects(joint: &JointData, friction: &[f64], load: Option<&[f64]>) -> [Option<Vec<f64>>; EFFECTS.len()] {
    let speed = rms(&joint.velocity);
    if speed <= 0.0 {
        return [None, None, None, None];
    }
    let share = |v: &f64| v / speed;
    let stribeck = friction.iter().zip(&joint.velocity).map(|(s, v)| s * (-(share(v) / STRIBECK).powi(2)).exp()).collect();
    let usual = load.map(rms).filter(|usual| *usual > 0.0);
    let by_load = load.zip(usual).map(|(load, usual)| friction.iter().zip(load).map(|(s, load)| s * load.abs() / usual).collect());
    let drag = joint.velocity.iter().map(|v| share(v) * share(v).abs()).collect();
    let asymmetric = joint.velocity.iter().map(|v| share(v).abs()).collect();
    [Some(stribeck), by_load, Some(drag), Some(asymmetric)]
}

fn spread(samples: &[f64]) -> f64 {
    let mean = samples.iter().sum::<f64>() / samples.len().max(1) as f64;
    rms(samples.iter().map(|x| x - mean))
}

/// The columns, in order, without those that the ones before them explain.
fn independent(columns: Vec<(Option<usize>, Vec<f64>)>) -> Vec<(Option<usize>, Vec<f64>)> {
    let mut basis: Vec<Vec<f64>> = Vec::new();
    let mut out = Vec::new();
    for (index, column) in columns {
        let size = norm(&column);
        let mut own = column.clone();
        for other in &basis {
            let along: f64 = own.iter().zip(other).map(|(a, b)| a * b).sum();
            own.iter_mut().zip(other).for_each(|(a, b)| *a -= along * b);
        }
        let left = norm(&own);
        if size > 0.0 && left > OWN_SHARE * size {
            own.iter_mut().for_each(|x| *x /= left);
            basis.push(own);
            out.push((index, column));
        }
    }
    out
}

fn norm(values: &[f64]) -> f64 {
    values.iter().map(|x| x * x).sum::<f64>().sqrt()
}

/// Values, standard errors and the rms of the residual. An error is the larger one of that of least squares with correlated residuals and that of the
/// jackknife over parts of the recording.
fn solved(columns: &[(Option<usize>, Vec<f64>)], left: &[f64]) -> Option<(Vec<f64>, Vec<f64>, f64)> {
    let (rows, count) = (left.len(), columns.len());
    let size: Vec<f64> = columns.iter().map(|(_, column)| norm(column).max(f64::MIN_POSITIVE)).collect();
    let part = |from: usize, to: usize| {
        let matrix = DMatrix::from_fn(to - from, count, |i, j| columns[j].1[from + i] / size[j]);
        let right = DVector::from_column_slice(&left[from..to]);
        (matrix.tr_mul(&matrix), matrix.tr_mul(&right))
    };
    let folds: Vec<_> = (0..FOLDS).map(|f| part(f * rows / FOLDS, (f + 1) * rows / FOLDS)).collect();
    let (mut gram, mut right) = (DMatrix::zeros(count, count), DVector::zeros(count));
    for (matrix, vector) in &folds {
        gram += matrix;
        right += vector;
    }
    let factor = gram.clone().cholesky()?;
    let values = factor.solve(&right);
    let residual: Vec<f64> =
        (0..rows).map(|i| left[i] - columns.iter().enumerate().map(|(j, (_, c))| c[i] / size[j] * values[j]).sum::<f64>()).collect();
    let free = rows.saturating_sub(count).max(1) as f64;
    let square = residual.iter().map(|x| x * x).sum::<f64>() / free * correlation_time(&residual);
    let inverse = factor.inverse();
    let mut jackknife = vec![0.0; count];
    let without: Vec<DVector<f64>> =
        folds.iter().filter_map(|(m, r)| (&gram - m).cholesky().map(|factor| factor.solve(&(&right - r)))).collect();
    let folds = without.len() as f64;
    for (j, sum) in jackknife.iter_mut().enumerate() {
        let mean = without.iter().map(|v| v[j]).sum::<f64>() / folds.max(1.0);
        *sum = without.iter().map(|v| (v[j] - mean).powi(2)).sum::<f64>() * (folds - 1.0).max(0.0) / folds.max(1.0);
    }
    let errors = (0..count).map(|j| (square * inverse[(j, j)]).max(jackknife[j]).sqrt() / size[j]).collect();
    Some((values.iter().zip(&size).map(|(v, s)| v / s).collect(), errors, rms(&residual)))
}

/// Correlation time of residuals, rows, at least 1: autocorrelations are summed up to the first one that is that of noise.
fn correlation_time(residual: &[f64]) -> f64 {
    let energy: f64 = residual.iter().map(|x| x * x).sum();
    if energy <= 0.0 {
        return 1.0;
    }
    let noise = 2.0 / (residual.len() as f64).sqrt();
    let of_lag = |lag: usize| residual[lag..].iter().zip(residual).map(|(a, b)| a * b).sum::<f64>() / energy;
    1.0 + 2.0 * (1..residual.len() / 8).map(of_lag).take_while(|correlation| *correlation >= noise).sum::<f64>()
}

#[cfg(test)]
mod tests {
    use super::*;
    use rand::SeedableRng;
    use rand_distr::{Distribution, StandardNormal};

    fn noise(count: usize, seed: u64) -> Vec<f64> {
        let mut random = rand_chacha::ChaCha8Rng::seed_from_u64(seed);
        (0..count).map(|_| StandardNormal.sample(&mut random)).collect()
    }

    #[test]
    fn least_squares_of_a_line_is_that_of_the_closed_form() {
        let x: Vec<f64> = (0..200).map(|i| f64::from(i) / 100.0 - 1.0).collect();
        let y: Vec<f64> = x.iter().zip(noise(200, 1)).map(|(x, e)| 2.0 + 3.0 * x + 0.1 * e).collect();
        let columns = vec![(Some(0), x.clone()), (Some(1), vec![1.0; 200])];
        let (values, errors, residual) = solved(&columns, &y).unwrap();
        let (mx, my) = (x.iter().sum::<f64>() / 200.0, y.iter().sum::<f64>() / 200.0);
        let sxx: f64 = x.iter().map(|x| (x - mx).powi(2)).sum();
        let slope = x.iter().zip(&y).map(|(x, y)| (x - mx) * (y - my)).sum::<f64>() / sxx;
        assert!((values[0] - slope).abs() < 1e-12 && (values[1] - (my - slope * mx)).abs() < 1e-12);
        // At least that of white noise, σ/√Σ(x - mean)², and not much more.
        let white = residual / sxx.sqrt();
        assert!(errors[0] > 0.95 * white && errors[0] < 2.5 * white, "{} {white}", errors[0]);
    }

    #[test]
    fn errors_cover_the_truth_where_residuals_are_correlated() {
        let x: Vec<f64> = (0..800).map(|i| (f64::from(i) * 0.05).sin()).collect();
        let mut beyond = 0;
        for seed in 0..200 {
            let mut state = 0.0;
            let y: Vec<f64> = noise(800, seed)
                .iter()
                .zip(&x)
                .map(|(e, x)| {
                    state = 0.8 * state + e;
                    x + state
                })
                .collect();
            let (values, errors, _) = solved(&[(Some(0), x.clone())], &y).unwrap();
            beyond += usize::from((values[0] - 1.0).abs() > 2.0 * errors[0]);
        }
        // 5 % of 200 are 10; a binomial count above 22 has a probability below 0.0003.
        assert!(beyond <= 22, "{beyond} of 200 beyond two standard errors");
    }

    #[test]
    fn a_column_that_another_one_explains_is_left_out() {
        let x: Vec<f64> = (0..100).map(|i| f64::from(i % 7) - 3.0).collect();
        let near: Vec<f64> = x.iter().zip(noise(100, 3)).map(|(x, e)| 2.0 * x + 1e-3 * e).collect();
        let kept = independent(vec![(Some(0), x), (Some(1), near), (Some(2), vec![0.0; 100])]);
        assert_eq!(kept.iter().map(|(index, _)| *index).collect::<Vec<_>>(), [Some(0)]);
    }
}
