//! Bouc-Wen hysteresis.

use super::harmonic;
use super::kind::{KindOf, Parameter, Range};
use super::law::{Linear, PathLaw, Slopes};
use super::sine::Sine;

/// `f = a k x + (1 - a) k z`, `dz/dt = A v - β |v| |z|^(n-1) z - γ v |z|^n`. Memory: z, m.
#[derive(Debug, Clone, PartialEq)]
pub struct BoucWen {
    /// N/m, k.
    pub stiffness: f64,
    /// a, share of the stiffness that is elastic.
    pub ratio: f64,
    /// A, kept at 1 when fitted.
    pub amplitude: f64,
    /// β, 1/m^n.
    pub beta: f64,
    /// γ, 1/m^n.
    pub gamma: f64,
    /// n.
    pub exponent: f64,
    /// Largest z, m.
    settled: f64,
    /// Stages per metre of path, 1/m.
    stage_density: f64,
}

/// Longest stage, as a share of the distance over which the memory settles.
const SHARE_PER_STAGE: f64 = 0.2;
/// Stages at most: after a path that long it has settled to 1e-8.
const STAGES_AT_MOST: f64 = 100.0;
/// Slope of z, as a share of that at z = 0, below which it no longer moves but for rounding.
const SETTLED: f64 = 1e-13;
/// How far apart two displacements may be for one's power to give the other's by five terms, as a share over the exponent.
const NEAR: f64 = 0.01;

impl BoucWen {
    pub(super) const KIND: KindOf<BoucWen> = KindOf {
        name: "bouc_wen",
        equation: "f = a k x + (1 - a) k z, dz/dt = A v - β |v| |z|^(n-1) z - γ v |z|^n",
        source: "Bouc 1967, Wen 1976",
        energy: "dissipates, creates none while -β <= γ <= β and 0 <= a <= 1",
        parameters: &[
            Parameter::number("stiffness", "N/m", Range::NonNegative, "k"),
            Parameter::number("ratio", "-", Range::Between(0.0, 1.0), "a"),
            Parameter::number("amplitude", "-", Range::Positive, "A"),
            Parameter::number("beta", "1/m^n", Range::Any, "β; β + γ must be above 0"),
            Parameter::number("gamma", "1/m^n", Range::Any, "γ"),
            Parameter::number("exponent", "-", Range::Between(1.0, 20.0), "n"),
        ],
        build: |v| {
            let [stiffness, ratio, amplitude, beta, gamma, exponent] = [v[0][0], v[1][0], v[2][0], v[3][0], v[4][0], v[5][0]];
            BoucWen::new(stiffness, ratio, amplitude, beta, gamma, exponent)
        },
    };

    /// From k (N/m), a, A, β and γ (1/mⁿ) and n, as the kind's parameters.
    ///
    /// # Errors
    /// When β + γ is not above 0: z would grow without bound.
    pub fn new(stiffness: f64, ratio: f64, amplitude: f64, beta: f64, gamma: f64, exponent: f64) -> Result<BoucWen, String> {
        if beta + gamma <= 0.0 {
            return Err(format!("beta + gamma must be above 0, not {}; else z grows without bound", beta + gamma));
        }
        let settled = (amplitude / (beta + gamma)).powf(1.0 / exponent);
        let stage_density = amplitude * exponent * (1.0 + (beta - gamma).abs() / (beta + gamma)) / (settled * SHARE_PER_STAGE);
        Ok(BoucWen { stiffness, ratio, amplitude, beta, gamma, exponent, settled, stage_density })
    }

    pub(super) fn values(&self) -> Vec<Vec<f64>> {
        [self.stiffness, self.ratio, self.amplitude, self.beta, self.gamma, self.exponent].map(|v| vec![v]).to_vec()
    }

    /// |z|ⁿ.
    #[inline]
    fn power(&self, magnitude: f64) -> f64 {
        if self.exponent == 1.0 {
            magnitude
        } else if self.exponent == 2.0 {
            magnitude * magnitude
        } else {
            magnitude.powf(self.exponent)
        }
    }

    /// The same from |z₀|ⁿ where z is close to z₀: the binomial series is quicker, and exact to 1e-13.
    #[inline]
    fn power_near(&self, magnitude: f64, (known, of_known): (f64, f64)) -> f64 {
        let n = self.exponent;
        let ratio = (magnitude - known) / known;
        // The first term left out is below n⁶/720 of the ratio's sixth power; not a number at known = 0 fails, too.
        let reach = ratio.abs() * n;
        if reach.is_nan() || reach >= NEAR {
            return self.power(magnitude);
        }
        let series = 1.0 + (n - 4.0) * ratio / 5.0;
        let series = 1.0 + (n - 3.0) * ratio / 4.0 * series;
        let series = 1.0 + (n - 2.0) * ratio / 3.0 * series;
        let series = 1.0 + (n - 1.0) * ratio / 2.0 * series;
        of_known * (1.0 + n * ratio * series)
    }

    /// dz/dx for a path in direction `sign`; `power` is |z|ⁿ.
    #[inline]
    fn slope(&self, hysteretic_displacement: f64, sign: f64, power: f64) -> f64 {
        self.amplitude - (self.beta * sign * hysteretic_displacement.signum() + self.gamma) * power
    }
}

impl PathLaw for BoucWen {
    fn memory_len(&self) -> usize {
        1
    }

    fn slopes(&self) -> Slopes {
        let steepest = self.amplitude * (1.0 + ((self.beta - self.gamma) / (self.beta + self.gamma)).abs());
        Slopes { stiffness: self.stiffness * (self.ratio + (1.0 - self.ratio) * steepest), damping: 0.0, bounded: true }
    }

    /// Runge-Kutta of fourth order along the path, in stages short against the distance over which z settles.
    #[inline]
    fn advance(&self, memory: &mut [f64], from: f64, to: f64, _dt: f64) {
        let [hysteretic_displacement] = memory else { return };
        let path = to - from;
        if path == 0.0 || !path.is_finite() {
            return;
        }
        let sign = path.signum();
        let stages = (path.abs() * self.stage_density).ceil().max(1.0);
        if stages > STAGES_AT_MOST {
            *hysteretic_displacement = self.settled * sign;
            return;
        }
        let dx = path / stages;
        let mut z = *hysteretic_displacement;
        for _ in 0..stages as usize {
            let known = (z.abs(), self.power(z.abs()));
            let slope = |z: f64| self.slope(z, sign, self.power_near(z.abs(), known));
            let first = self.slope(z, sign, known.1);
            if first.abs() <= SETTLED * self.amplitude {
                break;
            }
            let second = slope(z + 0.5 * dx * first);
            let third = slope(z + 0.5 * dx * second);
            let fourth = slope(z + dx * third);
            z += dx / 6.0 * (first + 2.0 * (second + third) + fourth);
        }
        *hysteretic_displacement = z;
    }

    fn is_costly(&self) -> bool {
        true
    }

    #[inline]
    fn force(&self, memory: &[f64], x: f64, _v: f64) -> f64 {
        let hysteretic_displacement = memory.first().copied().unwrap_or(0.0);
        self.stiffness * (self.ratio * x + (1.0 - self.ratio) * hysteretic_displacement)
    }

    fn stored(&self, memory: &[f64], x: f64) -> f64 {
        let hysteretic_displacement = memory.first().copied().unwrap_or(0.0);
        // Unloading from z with slope between A and A (1 + |...|) returns about z²/(2 A).
        0.5 * self.stiffness
            * (self.ratio * x * x + (1.0 - self.ratio) * hysteretic_displacement * hysteretic_displacement / self.amplitude)
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

    #[test]
    fn virgin_curve_for_exponent_one_is_an_exponential() {
        let law = BoucWen::new(100.0, 0.0, 1.0, 60.0, 40.0, 1.0).unwrap();
        let mut memory = [0.0];
        for i in 0..200 {
            law.advance(&mut memory, 1e-4 * f64::from(i), 1e-4 * f64::from(i + 1), 1e-3);
        }
        assert!((memory[0] - (1.0 - (-100.0f64 * 0.02).exp()) / 100.0).abs() < 1e-8);
    }

    #[test]
    fn long_path_settles_at_the_ultimate_force() {
        for exponent in [1.0, 1.5, 2.0] {
            let law = BoucWen::new(100.0, 0.1, 1.0, 60.0, 40.0, exponent).unwrap();
            let mut memory = [0.0];
            law.advance(&mut memory, 0.0, -50.0, 1.0);
            let settled = (1.0f64 / 100.0).powf(1.0 / exponent);
            assert!((memory[0] + settled).abs() < 1e-9 * settled, "{exponent}: {}", memory[0]);
        }
    }
}
