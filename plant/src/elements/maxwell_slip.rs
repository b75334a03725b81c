//! Maxwell slip: spring-sliders in parallel.

use super::harmonic;
use super::kind::{KindOf, Parameter, Range};
use super::law::{Linear, PathLaw, Slopes};
use super::sine::Sine;

/// `f = Σ k_i z_i`, each spring deflection z_i following x and slipping at `|k_i z_i| = force_i`. Memory: every z_i, m.
#[derive(Debug, Clone, PartialEq)]
pub struct MaxwellSlip {
    /// N/m, of each spring.
    pub stiffness: Vec<f64>,
    /// N, of each slider.
    pub force: Vec<f64>,
    /// m, the deflection at which each slips.
    slip: Vec<f64>,
}

impl MaxwellSlip {
    pub(super) const KIND: KindOf<MaxwellSlip> = KindOf {
        name: "maxwell_slip",
        equation: "f = Σ k_i z_i, dz_i = dx within |z_i| <= f_i/k_i",
        source: "Iwan 1966; Lampaert, Swevers & Al-Bender 2002; presliding hysteresis with non-local memory",
        energy: "dissipates, creates none; nested loops close (Masing, wiping out)",
        parameters: &[
            Parameter::numbers("stiffness", "N/m", Range::Positive, "k_i, one for each spring"),
            Parameter::numbers("force", "N", Range::NonNegative, "f_i, one for each slider"),
        ],
        build: |v| MaxwellSlip::new(v[0].clone(), v[1].clone()),
    };

    /// From stiffnesses, N/m, above 0, and slip forces, N, at least 0.
    ///
    /// # Errors
    /// When the lists are empty, of different length, or hold a number that cannot be.
    pub fn new(stiffness: Vec<f64>, force: Vec<f64>) -> Result<MaxwellSlip, String> {
        if stiffness.len() != force.len() {
            return Err(format!("stiffness has {} numbers and force has {}; they must be equally long", stiffness.len(), force.len()));
        }
        if stiffness.is_empty() {
            return Err("stiffness and force must not be empty".to_owned());
        }
        if let Some(bad) = stiffness.iter().find(|k| !(k.is_finite() && **k > 0.0)) {
            return Err(format!("every stiffness must be above 0, not {bad}"));
        }
        if let Some(bad) = force.iter().find(|f| !(f.is_finite() && **f >= 0.0)) {
            return Err(format!("every force must be at least 0, not {bad}"));
        }
        let slip = stiffness.iter().zip(&force).map(|(k, f)| f / k).collect();
        Ok(MaxwellSlip { stiffness, force, slip })
    }

    pub(super) fn values(&self) -> Vec<Vec<f64>> {
        vec![self.stiffness.clone(), self.force.clone()]
    }
}

impl PathLaw for MaxwellSlip {
    fn memory_len(&self) -> usize {
        self.stiffness.len()
    }

    fn slopes(&self) -> Slopes {
        Slopes { stiffness: self.stiffness.iter().sum(), damping: 0.0, bounded: true }
    }

    /// Exact for any monotone path.
    #[inline]
    fn advance(&self, memory: &mut [f64], from: f64, to: f64, _dt: f64) {
        let path = to - from;
        for (deflection, slip) in memory.iter_mut().zip(&self.slip) {
            // Not clamp: it would panic where a caller's slip is not a number.
            *deflection = (*deflection + path).min(*slip).max(-*slip);
        }
    }

    #[inline]
    fn force(&self, memory: &[f64], _x: f64, _v: f64) -> f64 {
        // Four sums, so that the additions need not wait for each other.
        let mut sums = [0.0; 4];
        let (springs, rest_springs) = self.stiffness.as_chunks::<4>();
        let (deflections, rest_deflections) = memory.as_chunks::<4>();
        for (k, z) in springs.iter().zip(deflections) {
            for lane in 0..4 {
                sums[lane] += k[lane] * z[lane];
            }
        }
        let rest: f64 = rest_springs.iter().zip(rest_deflections).map(|(k, z)| k * z).sum();
        (sums[0] + sums[1]) + (sums[2] + sums[3]) + rest
    }

    fn stored(&self, memory: &[f64], _x: f64) -> f64 {
        self.stiffness.iter().zip(memory).map(|(k, z)| 0.5 * k * z * z).sum()
    }

    fn linearised(&self, at: &Sine) -> Linear {
        harmonic::of_path(self, at)
    }

    fn creates_energy(&self, _amplitude: f64, _unit: &str) -> Option<String> {
        None
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn along(law: &MaxwellSlip, memory: &mut [f64], way: &[f64]) -> f64 {
        let mut last = way[0];
        for &x in way {
            law.advance(memory, last, x, 1e-3);
            last = x;
        }
        law.force(memory, last, 0.0)
    }

    fn sliders() -> MaxwellSlip {
        let n = 61;
        MaxwellSlip::new(vec![50.0; n], (0..n).map(|i| 0.002 + 0.0016 * i as f64).collect()).unwrap()
    }

    fn virgin(law: &MaxwellSlip, x: f64) -> f64 {
        law.stiffness.iter().zip(&law.force).map(|(k, f)| (k * x).min(*f)).sum()
    }

    #[test]
    fn masing_branch_is_the_virgin_curve_twice_as_large() {
        let law = sliders();
        let mut memory = vec![0.0; law.memory_len()];
        let top = along(&law, &mut memory, &[0.0, 1e-3]);
        assert!((top - virgin(&law, 1e-3)).abs() < 1e-14);
        let low = along(&law, &mut memory, &[1e-3, 4e-4]);
        assert!((top - low - 2.0 * virgin(&law, 3e-4)).abs() < 1e-13);
    }

    #[test]
    fn a_closed_inner_loop_is_forgotten() {
        let law = sliders();
        let mut memory = vec![0.0; law.memory_len()];
        let before = along(&law, &mut memory, &[0.0, 8.0e-4]);
        let after = along(&law, &mut memory, &[8.0e-4, 7.5e-4, 8.0e-4]);
        assert!((after - before).abs() < 1e-14);
    }

    #[test]
    fn lists_must_agree() {
        assert!(MaxwellSlip::new(vec![1.0], vec![]).is_err());
        assert!(MaxwellSlip::new(vec![], vec![]).is_err());
        assert!(MaxwellSlip::new(vec![0.0], vec![1.0]).is_err());
    }
}
