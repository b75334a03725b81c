//! Creep: a spring that goes on yielding under a constant force.

use super::decay::decay;
use super::kind::{KindOf, Parameter, Range};
use super::law::{Linear, PathLaw, Slopes};
use super::sine::Sine;
use nalgebra::{DMatrix, SymmetricEigen};
use std::f64::consts::TAU;

/// A spring in series with Kelvin-Voigt elements: `x = F/stiffness + Σ x_i`, `time_i dx_i/dt = F/creep_stiffness_i - x_i`. Under a constant force
/// `x = F/stiffness + Σ F/creep_stiffness_i (1 - exp(-t/time_i))`.
///
/// It is the same as a spring beside Maxwell elements, `F = k x + Σ f_j`, `df_j/dt = k_j v - f_j/τ_j`, each of which is advanced exactly.
/// Memory: every f_j, N.
#[derive(Debug, Clone, PartialEq)]
pub struct Creep {
    /// N/m, at once.
    pub stiffness: f64,
    /// N/m, of each retarded spring.
    pub creep_stiffness: Vec<f64>,
    /// s, in which each yields.
    pub time: Vec<f64>,
    /// N/m, after a long time.
    relaxed: f64,
    /// k_j, N/m, and 1/τ_j, 1/s.
    branches: Vec<(f64, f64)>,
}

impl Creep {
    pub(super) const KIND: KindOf<Creep> = KindOf {
        name: "creep",
        equation: "x = F/k + Σ x_i, τ_i dx_i/dt = F/k_i - x_i",
        source: "Kelvin-Voigt chain; Ferry 1980, as relaxations (generalised Maxwell)",
        energy: "dissipates, creates none",
        parameters: &[
            Parameter::number("stiffness", "N/m", Range::Positive, "k, at once"),
            Parameter::numbers("creep_stiffness", "N/m", Range::Positive, "k_i, of each retarded spring"),
            Parameter::numbers("time", "s", Range::Positive, "τ_i, in which each yields"),
        ],
        build: |v| Creep::new(v[0][0], v[1].clone(), v[2].clone()),
    };

    /// From a stiffness (N/m), stiffnesses of retarded springs (N/m) and their times (s), all above 0.
    ///
    /// # Errors
    /// When the lists are empty or of different length.
    pub fn new(stiffness: f64, creep_stiffness: Vec<f64>, time: Vec<f64>) -> Result<Creep, String> {
        let n = creep_stiffness.len();
        if n != time.len() {
            return Err(format!("creep_stiffness has {n} numbers and time has {}; they must be equally long", time.len()));
        }
        if n == 0 {
            return Err("creep_stiffness and time must not be empty".to_owned());
        }
        // With z_i = √(k_i τ_i) x_i and b_i = 1/√(k_i τ_i): dz/dt = -(diag(1/τ) + k b bᵀ) z + k b x, F = k (x - b·z).
        let b: Vec<f64> = creep_stiffness.iter().zip(&time).map(|(k, tau)| 1.0 / (k * tau).sqrt()).collect();
        let rates = DMatrix::from_fn(n, n, |i, j| stiffness * b[i] * b[j] + if i == j { 1.0 / time[i] } else { 0.0 });
        let eigen = SymmetricEigen::try_new(rates, f64::EPSILON, 10_000).ok_or("its parameters differ by too many orders of magnitude")?;
        let branch = |(rate, vector): (&f64, nalgebra::DVectorView<f64>)| {
            let share: f64 = vector.iter().zip(&b).map(|(v, b)| v * b).sum();
            (stiffness * stiffness * share * share / rate, *rate)
        };
        let branches: Vec<(f64, f64)> = eigen.eigenvalues.iter().zip(eigen.eigenvectors.column_iter()).map(branch).collect();
        let relaxed = 1.0 / (1.0 / stiffness + creep_stiffness.iter().map(|k| 1.0 / k).sum::<f64>());
        Ok(Creep { stiffness, creep_stiffness, time, relaxed, branches })
    }

    pub(super) fn values(&self) -> Vec<Vec<f64>> {
        vec![vec![self.stiffness], self.creep_stiffness.clone(), self.time.clone()]
    }
}

impl PathLaw for Creep {
    fn memory_len(&self) -> usize {
        self.branches.len()
    }

    fn slopes(&self) -> Slopes {
        Slopes { stiffness: self.stiffness, damping: 0.0, bounded: true }
    }

    /// Exact at constant speed.
    #[inline]
    fn advance(&self, memory: &mut [f64], from: f64, to: f64, dt: f64) {
        let path = to - from;
        for (force, (stiffness, rate)) in memory.iter_mut().zip(&self.branches) {
            let left = decay(rate * dt);
            // Of a path that takes no time the whole force stays.
            let kept = if dt > 0.0 { (1.0 - left) / (rate * dt) } else { 1.0 };
            *force = *force * left + stiffness * path * kept;
        }
    }

    #[inline]
    fn force(&self, memory: &[f64], x: f64, _v: f64) -> f64 {
        self.relaxed * x + memory.iter().sum::<f64>()
    }

    fn stored(&self, memory: &[f64], x: f64) -> f64 {
        let branches = memory.iter().zip(&self.branches).map(|(force, (stiffness, _))| 0.5 * force * force / stiffness);
        0.5 * self.relaxed * x * x + branches.sum::<f64>()
    }

    /// Exact at every amplitude: `k + Σ k_j iw/(iw + 1/τ_j)`.
    fn linearised(&self, at: &Sine) -> Linear {
        let omega = TAU * at.frequency_hz;
        let mut linear = Linear { stiffness: self.relaxed, ..Linear::default() };
        for (stiffness, rate) in &self.branches {
            let share = stiffness / (omega * omega + rate * rate);
            linear.stiffness += share * omega * omega;
            linear.damping += share * rate;
        }
        linear
    }

    fn is_viscoelastic(&self) -> bool {
        true
    }

    fn creates_energy(&self, _amplitude: f64, _unit: &str) -> Option<String> {
        None
    }
}
