//! Backlash: a damped shaft behind a gap.

use super::decay::decay;
use super::harmonic;
use super::kind::{KindOf, Parameter, Range};
use super::law::{Linear, PathLaw, Slopes};
use super::sine::Sine;

/// Shaft with a total gap: `f = k (x - xb) + c (v - dxb/dt)`, xb the position inside the gap, `|xb| <= gap/2`.
/// Memory: xb, m.
///
/// Where contact begins gradually (a lining, a band that wraps, teeth that are not parallel) the ends of the gap are round: `f = k s(x) + c s'(x) v`
/// with `s = x + (√((x - α)² + w²) - √((x + α)² + w²))/2`. This goes over from 0 to `x ∓ α` within some w of either end of the gap, and has no
/// memory.
#[derive(Debug, Clone, PartialEq)]
pub struct Backlash {
    /// m, total: 2α.
    pub gap: f64,
    /// N/m, of the shaft.
    pub stiffness: f64,
    /// N s/m, of the shaft.
    pub damping: f64,
    /// m, over which touch sets in: w. With 0 the ends of the gap are sharp.
    pub rounding: f64,
}

impl Backlash {
    pub(super) const KIND: KindOf<Backlash> = KindOf {
        name: "backlash",
        equation: "f = k (x - xb) + c (v - dxb/dt); dxb/dt = v + (k/c)(x - xb) inside |xb| < α, held at ±α while it pushes; \
                   with rounding w, f = k s + c v ds/dx, s = x + (√((x - α)² + w²) - √((x + α)² + w²))/2",
        source: "Nordin, Galic & Gutman 1997",
        energy: "dissipates, creates none; pushes only",
        parameters: &[
            Parameter::number("gap", "m", Range::NonNegative, "2α"),
            Parameter::number("stiffness", "N/m", Range::NonNegative, "k"),
            Parameter::number("damping", "N s/m", Range::NonNegative, "c").or(0.0),
            Parameter::number("rounding", "m", Range::NonNegative, "w, over which touch sets in").or(0.0),
        ],
        build: |v| Ok(Backlash { gap: v[0][0], stiffness: v[1][0], damping: v[2][0], rounding: v[3][0] }),
    };

    pub(super) fn values(&self) -> Vec<Vec<f64>> {
        vec![vec![self.gap], vec![self.stiffness], vec![self.damping], vec![self.rounding]]
    }

    /// Distances of x from either end of the gap, and their roundings.
    fn edges(&self, x: f64) -> [(f64, f64); 2] {
        [x - 0.5 * self.gap, x + 0.5 * self.gap].map(|u| (u, u.hypot(self.rounding)))
    }

    fn is_round(&self) -> bool {
        self.rounding > 0.0
    }
}

impl PathLaw for Backlash {
    fn memory_len(&self) -> usize {
        1
    }

    fn slopes(&self) -> Slopes {
        Slopes { stiffness: self.stiffness, damping: self.damping, bounded: true }
    }

    /// Inside the gap the shaft relaxes, `d(x - xb)/dt = -(k/c)(x - xb)`, and its position follows exactly.
    /// Without damping it is relaxed at once, which is a dead zone.
    #[inline]
    fn advance(&self, memory: &mut [f64], from: f64, to: f64, dt: f64) {
        let [gap_position] = memory else { return };
        let half_gap = 0.5 * self.gap;
        if half_gap <= 0.0 || self.is_round() {
            *gap_position = 0.0;
            return;
        }
        if self.damping <= 0.0 || dt <= 0.0 {
            *gap_position = to.min(half_gap).max(-half_gap);
            return;
        }
        let pushes = |side: f64| side * (self.stiffness * (to - side * half_gap) + self.damping * (to - from) / dt) >= 0.0;
        if (*gap_position >= half_gap && pushes(1.0)) || (*gap_position <= -half_gap && pushes(-1.0)) {
            return;
        }
        let shaft_twist = (from - *gap_position) * decay(self.stiffness * dt / self.damping);
        *gap_position = (to - shaft_twist).min(half_gap).max(-half_gap);
    }

    #[inline]
    fn force(&self, memory: &[f64], x: f64, v: f64) -> f64 {
        if self.is_round() {
            let [near, far] = self.edges(x);
            let (twist, touch) = (x + 0.5 * (near.1 - far.1), 1.0 + 0.5 * (near.0 / near.1 - far.0 / far.1));
            return self.stiffness * twist + self.damping * touch * v;
        }
        let half_gap = 0.5 * self.gap;
        let gap_position = memory.first().copied().unwrap_or(0.0);
        if half_gap <= 0.0 {
            self.stiffness * x + self.damping * v
        } else if gap_position >= half_gap {
            (self.stiffness * (x - half_gap) + self.damping * v).max(0.0)
        } else if gap_position <= -half_gap {
            (self.stiffness * (x + half_gap) + self.damping * v).min(0.0)
        } else {
            0.0
        }
    }

    fn stored(&self, memory: &[f64], x: f64) -> f64 {
        if self.is_round() {
            // The integral of √(u² + w²).
            let area = |(u, root): (f64, f64)| 0.5 * (u * root + self.rounding * self.rounding * (u / self.rounding).asinh());
            let up_to = |x: f64| self.edges(x).map(area);
            let ([near, far], [near_0, far_0]) = (up_to(x), up_to(0.0));
            return self.stiffness * (0.5 * x * x + 0.5 * (near - near_0 - far + far_0));
        }
        let shaft_twist = x - memory.first().copied().unwrap_or(0.0);
        0.5 * self.stiffness * shaft_twist * shaft_twist
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
    fn gap_position_stays_in_the_gap_and_the_force_pushes_only() {
        let law = Backlash { gap: 2e-3, stiffness: 1e4, damping: 5.0, rounding: 0.0 };
        let mut memory = [0.0];
        let at = |i: i32| 3e-3 * (0.01 * f64::from(i)).sin();
        for i in 0..5000 {
            law.advance(&mut memory, at(i), at(i + 1), 1e-4);
            assert!(memory[0].abs() <= 1e-3);
            let force = law.force(&memory, at(i + 1), (at(i + 1) - at(i)) / 1e-4);
            assert!(force * at(i + 1) >= 0.0);
        }
    }

    #[test]
    fn little_damping_is_a_dead_zone() {
        let dead_zone = |x: f64| if x.abs() > 1e-3 { 1e4 * (x - 1e-3f64.copysign(x)) } else { 0.0 };
        let mut worst = [0.0f64; 3];
        for (case, damping) in [1.0, 1e-2, 1e-4].into_iter().enumerate() {
            let law = Backlash { gap: 2e-3, stiffness: 1e4, damping, rounding: 0.0 };
            let mut memory = [0.0];
            let at = |i: i32| 3e-3 * (1e-3 * f64::from(i)).sin();
            for i in 0..10_000 {
                law.advance(&mut memory, at(i), at(i + 1), 1e-4);
                let force = law.force(&memory, at(i + 1), (at(i + 1) - at(i)) / 1e-4);
                worst[case] = worst[case].max((force - dead_zone(at(i + 1))).abs());
            }
        }
        assert!(worst[0] > worst[1] && worst[1] > worst[2] && worst[2] < 1e-4 * 20.0, "{worst:?}");
    }

    #[test]
    fn no_gap_is_a_spring_and_a_damper() {
        let law = Backlash { gap: 0.0, stiffness: 100.0, damping: 2.0, rounding: 0.0 };
        assert_eq!(law.force(&[0.0], -0.1, 0.5), -9.0);
        // For any rounding of a gap of zero width.
        let law = Backlash { rounding: 1e-3, ..law };
        assert!((law.force(&[0.0], -0.1, 0.5) + 9.0).abs() < 1e-12);
    }

    #[test]
    fn round_edges_go_over_from_nothing_to_the_shaft() {
        let sharp = Backlash { gap: 2e-3, stiffness: 1e4, damping: 0.0, rounding: 0.0 };
        let pull = |law: &Backlash, x: f64| {
            let mut memory = [0.0];
            law.advance(&mut memory, 0.0, x, 1e-3);
            law.force(&memory, x, 0.0)
        };
        let mut last = f64::INFINITY;
        for rounding in [1e-3, 1e-4, 1e-5] {
            let round = Backlash { rounding, ..sharp.clone() };
            let off = |x: f64| (pull(&round, x) - pull(&sharp, x)).abs() / 1e4;
            // Half of the rounding at one end of the gap, w²/(4 u) at u from it and less beyond, for √(u² + w²) - u < w²/(2 u).
            let worst = (-50..=50).map(|i| off(1e-4 * f64::from(i))).fold(0.0, f64::max);
            assert!(worst <= 0.5 * rounding && worst < last && off(5e-3) < rounding * rounding / 4.0 / 4e-3, "{rounding}: {worst}");
            last = worst;
        }
    }

    #[test]
    fn a_round_edge_stores_what_its_force_does() {
        let law = Backlash { gap: 2e-3, stiffness: 1e4, damping: 0.0, rounding: 4e-4 };
        for x in [-3e-3, 5e-4, 2.5e-3] {
            let steps = 20_000;
            let at = |i: i32| x * (f64::from(i) + 0.5) / f64::from(steps);
            let work: f64 = (0..steps).map(|i| law.force(&[0.0], at(i), 0.0) * x / f64::from(steps)).sum();
            assert!((law.stored(&[0.0], x) / work - 1.0).abs() < 1e-6, "{x}");
        }
    }
}
