//! The correlation method: gain and phase at one frequency, of a recording or of a model that a sine moves.
//!
//! Ljung, System Identification, section 6.2: a signal is correlated with the sine and the cosine of the frequency that was played. What a nonlinear
//! device answers at other frequencies, its harmonics, falls out; what stays depends on the amplitude.

use crate::model::Model;
use crate::stepper::{CompileError, Options, Plant, Segment};
use nalgebra::{Complex, Matrix3, Vector3};
use std::f64::consts::TAU;

/// Phasor `X` of a signal at a frequency: `x(t) = Re(X exp(j 2 pi f t))` beside an offset and the harmonics, t = 0 at the first sample.
///
/// `period_s` is the time between samples, s. The offset is fitted along, so that a stretch that is no whole number of samples per cycle gives no
/// bias. `None` where the stretch is shorter than half a cycle or holds fewer than 4 samples, or where a sample is no finite number.
pub fn fundamental(samples: &[f64], frequency_hz: f64, period_s: f64) -> Option<Complex<f64>> {
    let cycles = samples.len() as f64 * period_s * frequency_hz;
    if samples.len() < 4 || cycles.is_nan() || cycles < 0.5 {
        return None;
    }
    let (mut normal, mut right) = (Matrix3::zeros(), Vector3::zeros());
    for (index, value) in samples.iter().enumerate() {
        let (sin, cos) = (TAU * frequency_hz * period_s * index as f64).sin_cos();
        let row = Vector3::new(cos, -sin, 1.0);
        normal += row * row.transpose();
        right += row * *value;
    }
    let found = normal.cholesky()?.solve(&right);
    found.iter().all(|v| v.is_finite()).then(|| Complex::new(found[0], found[1]))
}

/// Admittance `F/(s x)`, N s/m, from the phasors of force (N) and displacement (m) over the same stretch.
pub fn admittance(force: Complex<f64>, displacement: Complex<f64>, frequency_hz: f64) -> Complex<f64> {
    force / (displacement * Complex::new(0.0, TAU * frequency_hz))
}

/// How finely and for how long a model is moved by a sine.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Resolution {
    /// Steps in a cycle, at least.
    pub steps_per_cycle: usize,
    /// Steps per second, at least, Hz: what is faster than the sine (a resonance that a gap sets off) has to be seen.
    pub rate_hz: f64,
    /// Time before the measured cycles, s; rounded up to whole cycles.
    pub settle_s: f64,
    /// Cycles that are measured, at least 1.
    pub cycles: usize,
}

/// Signals of a model that a sine moves: the displacement of its input and one output, over the measured cycles.
#[derive(Debug, Clone, PartialEq)]
pub struct Answer {
    /// Time between samples, s.
    pub period_s: f64,
    /// The input, `amplitude sin(2 pi f t)`.
    pub moved: Vec<f64>,
    /// The output.
    pub output: Vec<f64>,
}

/// Moves a model by `amplitude sin(2 pi f t)` on motion input `input`, from rest, and keeps output `output` (indices) over the measured cycles.
///
/// Between samples the input is the cubic with the sine's values and slopes. Every other input stays at 0.
///
/// # Errors
/// When the model cannot be stepped.
pub fn answer(
    model: &Model,
    [input, output]: [usize; 2],
    frequency_hz: f64,
    amplitude: f64,
    resolution: &Resolution,
) -> Result<Answer, CompileError> {
    let steps = resolution.steps_per_cycle.max((resolution.rate_hz / frequency_hz).ceil() as usize).max(8);
    let period_s = 1.0 / (frequency_hz * steps as f64);
    let mut plant = Plant::new(model, period_s, &Options { substeps: Some(1), ..Options::default() })?;
    plant.reset();
    let mut inputs = vec![Segment::default(); model.inputs.len()];
    let mut outputs = vec![0.0; model.outputs.len()];
    let settle = (resolution.settle_s * frequency_hz).ceil().max(0.0) as usize * steps;
    let measured = resolution.cycles.max(1) * steps;
    let at = |index: usize| {
        let (sin, cos) = (TAU * (index % steps) as f64 / steps as f64).sin_cos();
        (amplitude * sin, amplitude * TAU * frequency_hz * cos)
    };
    let mut found = Answer { period_s, moved: Vec::with_capacity(measured), output: Vec::with_capacity(measured) };
    for index in 0..settle + measured {
        if index >= settle {
            plant.outputs(&mut outputs);
            found.moved.push(at(index).0);
            found.output.push(outputs.get(output).copied().unwrap_or(f64::NAN));
        }
        if let Some(segment) = inputs.get_mut(input) {
            *segment = hermite(at(index), at(index + 1), period_s);
        }
        plant.step(&inputs);
    }
    Ok(found)
}

/// The cubic with these values and slopes at its ends.
fn hermite((from, slope): (f64, f64), (to, slope_to): (f64, f64), h: f64) -> Segment {
    let rise = (to - from) / h;
    Segment { c: [from, slope, (3.0 * rise - 2.0 * slope - slope_to) / h, (slope + slope_to - 2.0 * rise) / (h * h)] }
}

/// Admittance of a model, friction and gaps included, at a frequency (Hz) and an amplitude of its motion input (m), N s/m.
///
/// # Errors
/// When the model cannot be stepped.
pub fn admittance_of(
    model: &Model,
    ports: [usize; 2],
    frequency_hz: f64,
    amplitude: f64,
    resolution: &Resolution,
) -> Result<Complex<f64>, CompileError> {
    let found = answer(model, ports, frequency_hz, amplitude, resolution)?;
    let phasor = |samples: &[f64]| fundamental(samples, frequency_hz, found.period_s);
    let nothing = Complex::new(f64::NAN, f64::NAN);
    Ok(match (phasor(&found.output), phasor(&found.moved)) {
        (Some(force), Some(displacement)) => admittance(force, displacement, frequency_hz),
        _ => nothing,
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_phasor_is_found_beside_an_offset_at_any_length() {
        let (f, h) = (3.0, 0.013);
        let wanted = Complex::new(0.4, -1.3);
        let samples: Vec<f64> = (0..61).map(|k| 7.0 + (wanted * Complex::new(0.0, TAU * f * h * f64::from(k)).exp()).re).collect();
        assert!((fundamental(&samples, f, h).unwrap() - wanted).norm() < 1e-12);
    }

    #[test]
    fn what_cannot_be_told_is_none() {
        assert_eq!(fundamental(&[1.0; 3], 1.0, 0.3), None);
        assert_eq!(fundamental(&[1.0; 10], 0.01, 0.1), None);
        assert_eq!(fundamental(&[f64::NAN; 100], 1.0, 0.1), None);
        assert_eq!(fundamental(&[1.0; 100], f64::NAN, 0.1), None);
    }

    #[test]
    fn a_damper_behind_a_moved_body_is_its_own_admittance() {
        let text = "[bodies]\nram = 0\n[[elements]]\nkind='damper'\nbetween=['ram','ground']\ndamping=40\n\
                    [[inputs]]\nname='x'\nkind='motion'\non='ram'\n[[outputs]]\nname='F'\nkind='reaction'\nof='ram'\n";
        let model = Model::from_toml(text, "x").unwrap();
        let resolution = Resolution { steps_per_cycle: 64, rate_hz: 10.0, settle_s: 0.5, cycles: 2 };
        let found = admittance_of(&model, [0, 0], 2.0, 1e-3, &resolution).unwrap();
        assert!((found - Complex::new(40.0, 0.0)).norm() < 1e-9, "{found}");
    }
}
