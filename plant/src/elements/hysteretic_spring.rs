//! Hysteretic spring after Kuchenbecker and Niemeyer.

use super::decay::decay;
use super::harmonic;
use super::kind::{KindOf, Parameter, Range};
use super::law::{Linear, PathLaw, Slopes};
use super::sine::Sine;

/// Force that follows one of two lines, one for each direction, through a first-order filter along the path:
/// `dF/d|x| = bandwidth (line - F)` with `line = offset± + stiffness± x ± stiffness±/bandwidth`. Memory: F, N.
///
/// Their eqs (2)-(3) are its implicit Euler steps: with X = |x_i - x_(i-1)|,
/// `F_i = (γX line_i + F_(i-1)) / (1 + γX)`. The terms ±k/γ take away the filter's lag behind a ramp.
#[derive(Debug, Clone, PartialEq)]
pub struct HystereticSpring {
    /// N/m, slope of the rising line.
    pub stiffness_positive: f64,
    /// N/m, slope of the falling line.
    pub stiffness_negative: f64,
    /// N, of the rising line at x = 0.
    pub offset_positive: f64,
    /// N, of the falling line at x = 0, with its sign.
    pub offset_negative: f64,
    /// rad/m, γ.
    pub bandwidth: f64,
}

impl HystereticSpring {
    pub(super) const KIND: KindOf<HystereticSpring> = KindOf {
        name: "hysteretic_spring",
        equation: "dF/d|x| = γ (line - F), line = f+ + k+ x + k+/γ rising, f- + k- x - k-/γ falling",
        source: "Kuchenbecker & Niemeyer 2005, eqs (2)-(3) in the limit of small steps",
        energy: "dissipates while the rising line is above the falling one; creates some on cycles past their crossing x* = (f- - f+)/(k+ \
            - k-)",
        parameters: &[
            Parameter::number("stiffness_positive", "N/m", Range::NonNegative, "k+, slope of the rising line"),
            Parameter::number("stiffness_negative", "N/m", Range::NonNegative, "k-, slope of the falling line"),
            Parameter::number("offset_positive", "N", Range::Any, "f+, rising line at x = 0"),
            Parameter::number("offset_negative", "N", Range::Any, "f-, falling line at x = 0, with its sign"),
            Parameter::number("bandwidth", "rad/m", Range::Positive, "γ"),
        ],
        build: |v| {
            Ok(HystereticSpring {
                stiffness_positive: v[0][0],
                stiffness_negative: v[1][0],
                offset_positive: v[2][0],
                offset_negative: v[3][0],
                bandwidth: v[4][0],
            })
        },
    };

    pub(super) fn values(&self) -> Vec<Vec<f64>> {
        [self.stiffness_positive, self.stiffness_negative, self.offset_positive, self.offset_negative, self.bandwidth]
            .map(|v| vec![v])
            .to_vec()
    }

    /// Displacement at which the two lines cross and past which a cycle creates energy, m; `None` when they are parallel.
    pub fn crossing(&self) -> Option<f64> {
        let slopes = self.stiffness_positive - self.stiffness_negative;
        (slopes != 0.0).then(|| (self.offset_negative - self.offset_positive) / slopes)
    }
}

impl PathLaw for HystereticSpring {
    fn memory_len(&self) -> usize {
        1
    }

    fn slopes(&self) -> Slopes {
        let line = self.stiffness_positive.max(self.stiffness_negative);
        let reversal = self.bandwidth * (self.offset_positive - self.offset_negative).abs();
        Slopes { stiffness: line + reversal, damping: 0.0, bounded: true }
    }

    /// Exact: the distance of F from the line falls by exp(-γ |dx|).
    #[inline]
    fn advance(&self, memory: &mut [f64], from: f64, to: f64, _dt: f64) {
        let [force] = memory else { return };
        let path = to - from;
        if path == 0.0 {
            return;
        }
        let (offset, stiffness) =
            if path > 0.0 { (self.offset_positive, self.stiffness_positive) } else { (self.offset_negative, self.stiffness_negative) };
        *force = offset + stiffness * to + (*force - offset - stiffness * from) * decay(self.bandwidth * path.abs());
    }

    #[inline]
    fn force(&self, memory: &[f64], _x: f64, _v: f64) -> f64 {
        memory.first().copied().unwrap_or(0.0)
    }

    fn stored(&self, memory: &[f64], _x: f64) -> f64 {
        // Unloading follows about the mean line.
        let force = memory.first().copied().unwrap_or(0.0);
        let stiffness = 0.5 * (self.stiffness_positive + self.stiffness_negative);
        if stiffness > 0.0 { 0.5 * force * force / stiffness } else { 0.0 }
    }

    fn linearised(&self, at: &Sine) -> Linear {
        harmonic::of_path(self, at)
    }

    fn creates_energy(&self, amplitude: f64, unit: &str) -> Option<String> {
        // The lines cross where the falling one is the steeper: cycles beyond create energy.
        let crossing = self.crossing()?;
        if self.stiffness_positive < self.stiffness_negative && crossing > amplitude {
            return Some(format!("creates energy in cycles beyond {crossing:.4} {unit}, where its two lines cross"));
        }
        (crossing.abs() <= amplitude)
            .then(|| format!("creates energy in cycles about 0 already: its two lines cross at {crossing:.4} {unit}"))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn spring(k: f64, f: f64) -> HystereticSpring {
        HystereticSpring { stiffness_positive: k, stiffness_negative: k, offset_positive: f, offset_negative: -f, bandwidth: 8500.0 }
    }

    /// Steady cycle between -a and a: (peak force, energy per cycle).
    fn cycle(law: &HystereticSpring, a: f64, steps: i32) -> (f64, f64) {
        let at = |i: i32| a * (std::f64::consts::TAU * f64::from(i) / f64::from(steps)).sin();
        let mut memory = [0.0];
        let (mut peak, mut energy) = (0.0f64, 0.0);
        for i in 0..6 * steps {
            let before = memory[0];
            law.advance(&mut memory, at(i), at(i + 1), 1e-4);
            if i >= 5 * steps {
                peak = peak.max(memory[0]);
                energy += 0.5 * (before + memory[0]) * (at(i + 1) - at(i));
            }
        }
        (peak, energy)
    }

    #[test]
    fn ramp_error_falls_exponentially_and_without_offset() {
        let law = HystereticSpring { offset_negative: 0.0, stiffness_negative: 4000.0, ..spring(3900.0, 0.465) };
        let mut memory = [0.0];
        let step = 1.7e-5;
        let mut error: f64 = -0.465;
        for i in 0..100 {
            law.advance(&mut memory, step * f64::from(i), step * f64::from(i + 1), 1e-4);
            let next = memory[0] - 0.465 - 3900.0 * step * f64::from(i + 1);
            assert!((next - error * (-8500.0 * step).exp()).abs() < 1e-12);
            error = next;
        }
        assert!(error.abs() < 1e-6);
    }

    /// papers.md check 1: the steps of eqs (2)-(3) shrink the error by exactly 1/(1 + γX); this law is their limit.
    #[test]
    fn equations_2_and_3_converge_to_this_law() {
        let law = spring(3950.0, 0.465);
        let (k, f, gamma) = (3950.0, 0.465, 8500.0);
        let mut last_error = f64::INFINITY;
        for steps in [100, 1000, 10_000] {
            let x = |i: i32| 3e-4 * f64::from(i) / f64::from(steps);
            let (mut discrete, mut memory) = (0.0, [0.0]);
            for i in 1..=steps {
                let path = x(i) - x(i - 1);
                let before = discrete - f - k * x(i - 1);
                discrete = (gamma * path * (f + k * x(i) + k / gamma) + discrete) / (1.0 + gamma * path);
                let after = discrete - f - k * x(i);
                assert!((after - before / (1.0 + gamma * path)).abs() < 1e-12);
                law.advance(&mut memory, x(i - 1), x(i), 1e-3);
            }
            let error = (discrete - memory[0]).abs();
            assert!(error < 0.15 * last_error);
            last_error = error;
        }
    }

    #[test]
    fn peak_and_loop_area_match_the_closed_forms() {
        for (a, peak_excess, area) in [(1e-4, 0.321347, 3.477774e-5), (1e-3, 0.465000, 1.641176e-3)] {
            let (peak, energy) = cycle(&spring(3950.0, 0.465), a, 20_000);
            assert!((peak - 3950.0 * a - peak_excess).abs() < 2e-6, "{peak}");
            assert!((energy / area - 1.0).abs() < 1e-3, "{energy}");
        }
    }

    #[test]
    fn small_cycles_show_twice_the_stiffness() {
        let a = 1e-6;
        let (peak, _) = cycle(&spring(3950.0, 0.465), a, 2000);
        assert!((peak / a / 7902.5 - 1.0).abs() < 0.01);
    }

    #[test]
    fn same_path_gives_the_same_bits_at_any_speed() {
        let law = spring(3950.0, 0.465);
        let run = |dt: f64| {
            let mut memory = [0.0];
            for i in 0..1000 {
                law.advance(&mut memory, 1e-3 * (0.01 * f64::from(i)).sin(), 1e-3 * (0.01 * f64::from(i + 1)).sin(), dt);
            }
            memory[0].to_bits()
        };
        assert!([1e-4, 1e-3, 1.0].iter().all(|dt| run(*dt) == run(1e-5)));
    }

    #[test]
    fn inner_loop_is_not_wiped_out() {
        let law = HystereticSpring { stiffness_positive: 3900.0, stiffness_negative: 4000.0, ..spring(0.0, 0.465) };
        let mut memory = [0.0];
        law.advance(&mut memory, 0.0, 8.0e-4, 1.0);
        let before = memory[0];
        law.advance(&mut memory, 8.0e-4, 7.5e-4, 1.0);
        law.advance(&mut memory, 7.5e-4, 8.0e-4, 1.0);
        println!("inner loop returns {} N low", before - memory[0]);
        assert!(((before - memory[0]) / 0.196 - 1.0).abs() < 0.02, "{}", before - memory[0]);
    }

    #[test]
    fn cycles_past_the_crossing_create_energy() {
        let law = HystereticSpring { stiffness_positive: 3900.0, stiffness_negative: 4000.0, ..spring(0.0, 0.465) };
        assert!((law.crossing().unwrap() - 9.3e-3).abs() < 1e-9);
        let work = |centre: f64| {
            let at = |i: i32| centre + 1e-3 * (f64::from(i) * std::f64::consts::TAU / 2000.0).sin();
            let mut memory = [3950.0 * centre];
            (0..8000).fold(0.0, |sum, i| {
                let before = memory[0];
                law.advance(&mut memory, at(i), at(i + 1), 1e-3);
                if i < 6000 { 0.0 } else { sum + 0.5 * (before + memory[0]) * (at(i + 1) - at(i)) }
            })
        };
        assert!(work(7e-3) > 0.0 && work(11e-3) < 0.0);
        // Check 6: where the energy of a cycle changes its sign, the lines cross.
        let (mut low, mut high) = (7e-3, 11e-3);
        for _ in 0..20 {
            let middle = 0.5 * (low + high);
            if work(middle) > 0.0 { low = middle } else { high = middle }
        }
        assert!((low / 9.3e-3 - 1.0).abs() < 0.01, "{low}");
    }
}
