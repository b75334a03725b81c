//! Places that the sensors cannot tell apart: frequency responses of the outputs to a force at each.

use super::equations::Equations;
use nalgebra::{Complex, DMatrix, DVector};
use std::f64::consts::TAU;

/// Power of a force in a few bands: frequency, Hz, and mean square in the band.
pub(super) type Spectrum = Vec<(f64, f64)>;

/// Response of each output row to a unit force of a channel at a frequency, Hz; `None` where the equations are singular at it.
pub(super) fn response(equations: &Equations, frequency_hz: f64) -> Option<DVector<Complex<f64>>> {
    let unknown = equations.unknown;
    let s = Complex::new(0.0, TAU * frequency_hz);
    let complex = |x: f64| Complex::new(x, 0.0);
    // s x = A x + (column of the unknown and its derivatives), over the bodies' states alone.
    let matrix = DMatrix::from_fn(unknown, unknown, |i, j| if i == j { s } else { complex(0.0) } - complex(equations.a[(i, j)]));
    let order = equations.order;
    let derivative = |m: usize| s.powu(m as u32);
    let right = DVector::from_fn(unknown, |i, _| (0..order).map(|m| derivative(m) * equations.a[(i, unknown + m)]).sum::<Complex<f64>>());
    let state = if unknown == 0 { right } else { matrix.lu().solve(&right)? };
    let row = |r: usize| {
        let of_state: Complex<f64> = (0..unknown).map(|j| state[j] * equations.h[(r, j)]).sum();
        of_state + (0..order).map(|m| derivative(m) * equations.h[(r, unknown + m)]).sum::<Complex<f64>>()
    };
    let read = DVector::from_fn(equations.h.nrows(), |r, _| row(r));
    read.iter().all(|c| c.re.is_finite() && c.im.is_finite()).then_some(read)
}

/// Normalised residual that remains where a force at one place is explained by a force of the same course, of any size, at another. It is the root of the
/// mean square over samples and outputs, in noise standard deviations. `own` and `other` are responses at the frequencies of the spectrum.
pub(super) fn distance(spectrum: &Spectrum, own: &[DVector<Complex<f64>>], other: &[DVector<Complex<f64>>], noise: &[f64]) -> f64 {
    let (mut both, mut square, mut all) = (Complex::new(0.0, 0.0), 0.0, 0.0);
    for ((_, power), (a, b)) in spectrum.iter().zip(own.iter().zip(other)) {
        for ((a, b), noise) in a.iter().zip(b.iter()).zip(noise) {
            let weight = power / (noise * noise);
            both += b.conj() * a * weight;
            square += b.norm_sqr() * weight;
            all += a.norm_sqr() * weight;
        }
    }
    let explained = if square > 0.0 { both.re * both.re / square } else { 0.0 };
    ((all - explained).max(0.0) / noise.len().max(1) as f64).sqrt()
}

/// Power of columns of force in bands a sixth of an octave wide.
pub(super) fn spectrum(columns: &[(&[f64], f64)]) -> Spectrum {
    let mut bands: Vec<(f64, f64)> = Vec::new();
    let mut planner = realfft::RealFftPlanner::<f64>::new();
    let total: usize = columns.iter().map(|c| c.0.len()).sum();
    for (column, period) in columns {
        let n = column.len();
        if n < 16 {
            continue;
        }
        let transform = planner.plan_fft_forward(n);
        let mean = column.iter().sum::<f64>() / n as f64;
        let mut samples: Vec<f64> = column.iter().map(|x| x - mean).collect();
        let mut lines = transform.make_output_vec();
        if transform.process(&mut samples, &mut lines).is_err() {
            continue;
        }
        for (k, line) in lines.iter().enumerate().skip(1) {
            let f = k as f64 / (n as f64 * period);
            let power = 2.0 * line.norm_sqr() / (n as f64 * total as f64);
            let centre = 2f64.powf((6.0 * f.log2()).round() / 6.0);
            match bands.iter_mut().find(|b| (b.0 - centre).abs() < 1e-9 * centre) {
                Some(band) => band.1 += power,
                None => bands.push((centre, power)),
            }
        }
    }
    bands
}
