//! Inertias, stiffness and damping of the shaft.

use crate::fit::{Fitted, positive};
use crate::numbers::Bench;
use crate::record::{BenchError, Record};
use crate::simulate::closed_loop;
use backdrive_control::observer::Shaft;
use backdrive_signal::butterworth::{Butterworth, both_ways};
use nalgebra::{Complex, DMatrix, DVector};
use realfft::RealFftPlanner;

/// Corner of the low-pass that all signals of J_A go through, Hz: above it the derivative is noise.
const CORNER_HZ: f64 = 8.0;

/// J_A, kg m2, by least squares on `J_A w_A' = T_A + T_S` with a constant torque for what the sensors are off by. The derivative is a high-pass:
/// all signals go through the same low-pass forward and backward, the speed through a difference too.
///
/// # Errors
/// When the speed does not change.
pub fn inertia_of_dynamometer(record: &Record) -> Result<f64, BenchError> {
    let smoothed = |column: &[f64]| both_ways(&Butterworth::new(2, CORNER_HZ, record.period_s), column.iter().copied());
    let (speed, torque, shaft) = (smoothed(&record.dyno_speed), smoothed(&record.torque), smoothed(&record.shaft_torque));
    // The torque of step k is held until k+1, the shaft's is taken at the middle of that time too.
    let rows: Vec<[f64; 2]> =
        (0..record.len() - 1).map(|k| [(speed[k + 1] - speed[k]) / record.period_s, torque[k] + 0.5 * (shaft[k] + shaft[k + 1])]).collect();
    let n = rows.len() as f64;
    let (ma, mt) = (rows.iter().map(|r| r[0]).sum::<f64>() / n, rows.iter().map(|r| r[1]).sum::<f64>() / n);
    let (above, below) = rows.iter().fold((0.0, 0.0), |(x, y), r| (x + (r[0] - ma) * (r[1] - mt), y + (r[0] - ma).powi(2)));
    let found: f64 = above / below;
    if found.is_finite() && found > 0.0 {
        Ok(found)
    } else {
        Err(BenchError::Poor { step: "J_A", what: "the dynamometer's speed does not change with its torque; excite it".to_string() })
    }
}

/// The response of the engine's speed to the dynamometer's torque, (Hz, complex rad/s per N m). It uses what is common with the added torque, which
/// is independent of all noise, so that the speed control does not bias it. Hann windows of four seconds, half of each shared.
pub fn response(record: &Record, from_hz: f64, to_hz: f64) -> Vec<(f64, Complex<f64>)> {
    let length = (4.0 / record.period_s).round() as usize;
    if record.len() < length {
        return Vec::new();
    }
    let fft = RealFftPlanner::<f64>::new().plan_fft_forward(length);
    let window = |k: usize| 0.5 - 0.5 * (std::f64::consts::TAU * k as f64 / length as f64).cos();
    let spectrum = |column: &[f64]| {
        let mean = column.iter().sum::<f64>() / length as f64;
        let mut input: Vec<f64> = column.iter().enumerate().map(|(k, v)| (v - mean) * window(k)).collect();
        let mut output = fft.make_output_vec();
        // Lengths are those of the plan, so it cannot fail.
        let _ = fft.process(&mut input, &mut output);
        output
    };
    let mut sums = vec![(Complex::new(0.0, 0.0), Complex::new(0.0, 0.0)); length / 2 + 1];
    for start in (0..=record.len() - length).step_by(length / 2) {
        let piece = |column: &[f64]| spectrum(&column[start..start + length]);
        let (added, torque, speed) = (piece(&record.added), piece(&record.torque), piece(&record.engine_speed));
        for (line, sum) in sums.iter_mut().enumerate() {
            sum.0 += Complex::new(speed[line].re, speed[line].im) * Complex::new(added[line].re, -added[line].im);
            sum.1 += Complex::new(torque[line].re, torque[line].im) * Complex::new(added[line].re, -added[line].im);
        }
    }
    let step = 1.0 / (length as f64 * record.period_s);
    let most = sums.iter().map(|s| s.1.norm()).fold(0.0, f64::max);
    let lines = sums.iter().enumerate().map(|(line, sum)| (line as f64 * step, sum));
    // A line without excitation is not used.
    lines.filter(|(hz, sum)| (from_hz..=to_hz).contains(hz) && sum.1.norm() > 1e-6 * most).map(|(hz, sum)| (hz, sum.0 / sum.1)).collect()
}

/// Damping d and natural frequency (rad/s) of the torsional mode by matching the poles of `w_C/T_A`: the measured response is fitted by
/// `(b_1 s + b_0) / (s (s^2 + a_1 s + a_0))` (Sanathanan and Koerner 1963), and `a_1 = d (1/J_C + 1/J_A)`.
///
/// # Errors
/// When the response shows no damped mode.
pub fn damping_by_poles(record: &Record, engine: f64, dynamometer: f64) -> Result<(f64, f64), BenchError> {
    let poor = || BenchError::Poor {
        step: "damping",
        what: "the response w_C/T_A shows no torsional mode; excite the bench up to 60 Hz".to_string(),
    };
    let lines = response(record, 12.0, 60.0);
    if lines.len() < 8 {
        return Err(poor());
    }
    // In units of about one: frequencies over 200 rad/s. The torque of a sample acts half a period later on average.
    let unit = 200.0;
    let mut poles = [0.0, 1.0];
    for _ in 0..30 {
        let mut rows = DMatrix::zeros(2 * lines.len(), 4);
        let mut right = DVector::zeros(2 * lines.len());
        for (index, (hz, h)) in lines.iter().enumerate() {
            let omega = std::f64::consts::TAU * hz;
            let s = Complex::new(0.0, omega / unit);
            let h = h * Complex::new(0.0, 0.5 * omega * record.period_s).exp() * unit;
            let weight = 1.0 / ((s * s + s * poles[0] + poles[1]) * s).norm();
            let cells = [s, Complex::new(1.0, 0.0), -h * s * s, -h * s];
            for (column, cell) in cells.iter().enumerate() {
                rows[(2 * index, column)] = cell.re * weight;
                rows[(2 * index + 1, column)] = cell.im * weight;
            }
            let value = h * s * s * s * weight;
            (right[2 * index], right[2 * index + 1]) = (value.re, value.im);
        }
        let found = rows.svd(true, true).solve(&right, 1e-12).map_err(|_| poor())?;
        poles = [found[2], found[3]];
    }
    let (rate, frequency) = (poles[0] * unit, (poles[1].max(0.0)).sqrt() * unit);
    let damping = rate / (1.0 / engine + 1.0 / dynamometer);
    if damping.is_finite() && damping > 0.0 && frequency > 0.0 { Ok((damping, frequency)) } else { Err(poor()) }
}

/// J_C, c and d so that the bench in closed loop, dragged (pedal at 0), has the measured engine speed: output error, every fourth step.
///
/// # Errors
/// When the fit does not converge.
pub fn refine(bench: &Bench, record: &Record) -> Result<(Shaft, Fitted), BenchError> {
    let start = bench.shaft;
    let with = |values: &[f64]| Shaft { engine: values[0], stiffness: values[1], damping: values[2], ..start };
    let fitted = positive(&[start.engine, start.stiffness, start.damping], 15, |values| {
        let found = closed_loop(&Bench { shaft: with(values), ..bench.clone() }, record);
        found.engine_speed.iter().zip(&record.engine_speed).step_by(4).map(|(a, b)| a - b).collect()
    });
    let fitted = fitted
        .ok_or(BenchError::Poor { step: "refinement", what: "the closed loop does not depend on the shaft's numbers".to_string() })?;
    Ok((with(&fitted.values), fitted))
}
