//! LuGre friction with a Preisach operator for its bristles.

use super::gaussian::between_rest_and_speed;
use super::harmonic;
use super::kind::{KindOf, Parameter, Range};
use super::law::{Bristles, Linear, PathLaw, Slopes};
use super::sine::Sine;
use crate::preisach::{self, DahlLoop, MEMORY, Transition};

/// Parts of a step in which the bristles creep, at most.
const PARTS: usize = 48;

/// `f = σ0 h + σ1 dz/dt`, `dz/dt = v - α h |v|/g(v)`, `σ0 g = coulomb + (static - coulomb) exp(-(v/velocity)²)`, with
/// `h = f_p(z)/σ0` while `|z| < break_away` and `g(v) sign z` from there on: Choi, Han & Kim 2006, eqs (4)-(6).
///
/// f_p is the Preisach operator of [`crate::preisach`]. As a displacement it is f_p/σ0 (the printed h mixes a force with a
/// displacement), so σ0 is what controllers estimate, and does not change the force. The force is smooth at break-away where
/// f_p(break_away) = static.
///
/// `gate` = 0 takes α = 1 throughout, which is eq (5) to the letter and drifts under an offset load as LuGre does. Else α = 0 while
/// `|z| < gate break_away` and on the way back, as the elasto-plastic model has it (Dupont et al. 2002): what is below does not drift.
///
/// Memory: the operator's, whose displacement is z.
#[derive(Debug, Clone, PartialEq)]
pub struct PreisachLugre {
    /// N/m, σ0.
    pub stiffness: f64,
    /// N s/m, σ1.
    pub damping: f64,
    /// N, at speed.
    pub coulomb: f64,
    /// N, at rest; `static` in model files.
    pub at_rest: f64,
    /// m/s.
    pub velocity: f64,
    /// m.
    pub break_away: f64,
    /// The share of `break_away` within which bristles only bend, 0 to 1.
    pub gate: f64,
    /// Of f_p.
    pub curves: Transition,
    /// The same as rows, as a file has them.
    rows: Vec<f64>,
}

impl PreisachLugre {
    pub(super) const KIND: KindOf<PreisachLugre> = KindOf {
        name: "preisach_lugre",
        equation: "f = σ0 h(z) + σ1 dz/dt, dz/dt = v - h(z)/g(v) |v|, h = f_p(z)/σ0 to break-away, f_p a Preisach operator",
        source: "Choi, Han & Kim 2006, eqs (4)-(13); gate: Dupont, Hayward, Armstrong & Altpeter 2002",
        energy: "dissipates; nested loops close. May create some on quick reversals through σ1, as lugre does, and where f_p(break_away) \
            is above static",
        parameters: &[
            Parameter::number("stiffness", "N/m", Range::Positive, "σ0, the unit of h = f_p/σ0; the force does not depend on it"),
            Parameter::number("damping", "N s/m", Range::NonNegative, "σ1"),
            Parameter::number("coulomb", "N", Range::Positive, "level at speed"),
            Parameter::number("static", "N", Range::Positive, "level at rest"),
            Parameter::number("velocity", "m/s", Range::Positive, "Stribeck velocity"),
            Parameter::number("break_away", "m", Range::Positive, "z_ba, bristle deflection at break-away"),
            Parameter::number("loop_force", "N", Range::Positive, "f_c of the deformed Dahl curves"),
            Parameter::number("loop_slope", "N/m", Range::Positive, "s of the deformed Dahl curves"),
            Parameter::numbers("curves", "m, m, N", Range::Any, "measured loops, rows of reach, position and force on the falling branch")
                .or(0.0),
            Parameter::number(
                "gate",
                "1",
                Range::Between(0.0, 1.0),
                "share of break_away within which nothing creeps; 0 is the paper's law",
            )
            .or(0.0),
        ],
        build: PreisachLugre::new,
    };

    fn new(v: &[Vec<f64>]) -> Result<PreisachLugre, String> {
        let (coulomb, at_rest) = (v[2][0], v[3][0]);
        if at_rest < coulomb {
            return Err(format!("static ({at_rest}) must be at least coulomb ({coulomb})"));
        }
        let (rows, rest) = v[8].as_chunks::<3>();
        if !rest.is_empty() {
            return Err(format!("curves has {} numbers; expected rows of three: reach, position, force", v[8].len()));
        }
        let curves = Transition::measured(DahlLoop { force: v[6][0], slope: v[7][0] }, rows)?;
        let [stiffness, damping, velocity, break_away, gate] = [v[0][0], v[1][0], v[4][0], v[5][0], v[9][0]];
        let edge = gate * break_away;
        let at_edge = 0.5 * curves.rise(edge, 2.0 * edge).force;
        if gate < 1.0 && at_edge > coulomb {
            return Err(format!(
                "the curves reach {at_edge:.4} at the gate's end, which is above coulomb ({coulomb}): bristles there would neither bend nor creep; \
                 lower gate, or take 1, with which they bend until they break away"
            ));
        }
        Ok(PreisachLugre { stiffness, damping, coulomb, at_rest, velocity, break_away, gate, curves, rows: v[8].clone() })
    }

    pub(super) fn values(&self) -> Vec<Vec<f64>> {
        let DahlLoop { force, slope } = self.curves.dahl;
        let first = [self.stiffness, self.damping, self.coulomb, self.at_rest, self.velocity, self.break_away, force, slope];
        first.into_iter().map(|x| vec![x]).chain([self.rows.clone(), vec![self.gate]]).collect()
    }

    /// Steady friction level σ0 g at speed `v`, N.
    #[inline]
    pub fn level(&self, v: f64) -> f64 {
        between_rest_and_speed(self.at_rest, self.coulomb, v / self.velocity)
    }

    /// σ0 h, N, at speed `v`, m/s.
    #[inline]
    pub fn bristle_force(&self, memory: &[f64], v: f64) -> f64 {
        let z = memory.first().copied().unwrap_or(0.0);
        if z.abs() >= self.break_away && z * v > 0.0 { self.level(v).copysign(z) } else { preisach::force(&self.curves, memory) }
    }

    /// α |v|/(σ0 g), 1/(N s/m): times σ0 h it is the speed at which bristles creep back.
    #[inline]
    pub fn leak(&self, memory: &[f64], v: f64) -> f64 {
        let z = memory.first().copied().unwrap_or(0.0);
        let creeps = self.gate == 0.0 || z * v > 0.0 && z.abs() >= self.gate * self.break_away;
        if creeps { v.abs() / self.level(v) } else { 0.0 }
    }

    /// Lets the bristles creep along `way` (m, above 0) in `direction` (±1) under the level `level`, and returns the rest of the way.
    #[inline]
    fn creep(&self, memory: &mut [f64], way: f64, direction: f64, level: f64, is_last: bool) -> f64 {
        let z = memory[0];
        // dz/ds = 1 - f_p/level along the way s, with the local slope of f_p: exact for straight curves.
        let rate = 1.0 - direction * preisach::force(&self.curves, memory) / level;
        if rate == 0.0 {
            return 0.0;
        }
        let stiffness = preisach::slope(&self.curves, memory, direction * rate) / level;
        let longest = if stiffness > 0.0 { 0.1 / (stiffness * rate.abs()) } else { way };
        let part = if is_last { way } else { way.min(longest) };
        let settle = stiffness * part;
        let gain = if settle > 1e-12 { -(-settle).exp_m1() / stiffness } else { part };
        let mut deflection = (z + direction * rate * gain).max(-self.break_away).min(self.break_away);
        if self.gate > 0.0 && rate < 0.0 {
            let edge = self.gate * self.break_away;
            deflection = if direction > 0.0 { deflection.max(edge) } else { deflection.min(-edge) };
        }
        preisach::advance(&self.curves, memory, deflection);
        if deflection == z { 0.0 } else { way - part }
    }
}

impl PathLaw for PreisachLugre {
    fn memory_len(&self) -> usize {
        MEMORY
    }

    fn slopes(&self) -> Slopes {
        // Where bristles creep back they do so at up to twice the speed.
        let speed = if self.gate < 1.0 { 2.0 } else { 1.0 };
        Slopes { stiffness: speed * self.curves.steepest(), damping: 2.0 * self.damping, bounded: true }
    }

    /// Along the path: bristles bend, creep where they may, and stay where they have broken away.
    #[inline]
    fn advance(&self, memory: &mut [f64], from: f64, to: f64, dt: f64) {
        let path = to - from;
        if memory.len() < MEMORY || path == 0.0 || !path.is_finite() {
            return;
        }
        let direction = 1.0_f64.copysign(path);
        let level = self.level(if dt > 0.0 { path / dt } else { 0.0 });
        let edge = self.gate * self.break_away;
        let mut way = path.abs();
        for part in 1..=PARTS {
            let along = direction * memory[0];
            if way <= 0.0 || along >= self.break_away {
                break;
            }
            if self.gate > 0.0 && along < edge {
                let step = way.min(edge - along);
                // To the boundary exactly, so that the next part begins beyond it.
                let next = if step < way { direction * edge } else { memory[0] + direction * step };
                preisach::advance(&self.curves, memory, next);
                way -= step;
            } else {
                way = self.creep(memory, way, direction, level, part == PARTS);
            }
        }
    }

    #[inline]
    fn force(&self, memory: &[f64], _x: f64, v: f64) -> f64 {
        let bristle_force = self.bristle_force(memory, v);
        bristle_force + self.damping * (v - self.leak(memory, v) * bristle_force)
    }

    fn bristles(&self, memory: &[f64], v: f64) -> Option<Bristles> {
        let force = self.bristle_force(memory, v);
        Some(Bristles { force, stiffness: self.stiffness, damping: self.damping, leak: self.leak(memory, v) })
    }

    /// What comes back on the way to no force, along a curve that nothing interrupts.
    fn stored(&self, memory: &[f64], _x: f64) -> f64 {
        let force = preisach::force(&self.curves, memory).abs();
        let reach = memory.first().map_or(0.0, |z| z.abs());
        let DahlLoop { force: f_c, slope } = self.curves.dahl;
        let a = f_c + self.curves.dahl.reversal_force(reach).max(force);
        if force >= a {
            return 0.0;
        }
        let way = a * force / (slope * (a - force));
        (force - a) * way + a * a / slope * (slope * way / a).ln_1p()
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

    fn law(gate: f64) -> PreisachLugre {
        let curves = DahlLoop { force: 0.35, slope: 2.0 };
        let at_rest = curves.reversal_force(0.5);
        PreisachLugre::new(
            &[2.0, 0.0, 0.9 * at_rest, at_rest, 0.1, 0.5, 0.35, 2.0]
                .map(|x| vec![x])
                .into_iter()
                .chain([vec![], vec![gate]])
                .collect::<Vec<_>>(),
        )
        .unwrap()
    }

    fn along(law: &PreisachLugre, memory: &mut [f64], way: &[f64], parts: u32, speed: f64) {
        for w in way.windows(2) {
            for i in 0..parts {
                let at = |i: u32| w[0] + (w[1] - w[0]) * f64::from(i) / f64::from(parts);
                law.advance(memory, at(i), at(i + 1), (at(i + 1) - at(i)).abs() / speed);
            }
        }
    }

    #[test]
    fn steady_force_is_the_stribeck_curve() {
        for (gate, speed) in [(0.0, 0.05), (0.0, 1.0), (0.6, 0.2), (1.0, 0.05), (1.0, 2.0)] {
            let law = law(gate);
            let mut memory = vec![0.0; MEMORY];
            along(&law, &mut memory, &[0.0, -30.0], 3000, speed);
            let (force, level) = (law.force(&memory, 0.0, -speed), law.level(speed));
            assert!((force + level).abs() < 1e-9, "gate {gate}, {speed} m/s: {force} {level}");
        }
    }

    #[test]
    fn creeping_does_not_depend_on_the_steps() {
        let law = law(0.0);
        let end = |parts: u32| {
            let mut memory = vec![0.0; MEMORY];
            along(&law, &mut memory, &[0.0, 0.3, -0.1, 0.25, 0.05], parts, 1e-3);
            law.force(&memory, 0.0, 1e-3)
        };
        let (coarse, fine, finest) = (end(4), end(64), end(4096));
        assert!((coarse - finest).abs() < 2e-4, "{coarse} {finest}");
        assert!((fine - finest).abs() < 1e-5 && (coarse - finest).abs() > 2.0 * (fine - finest).abs(), "{fine} {finest}");
    }

    #[test]
    fn a_gate_keeps_the_bristles_from_creeping_and_the_paper_does_not() {
        for (gate, drifts) in [(0.0, true), (1.0, false)] {
            let law = law(gate);
            let mut memory = vec![0.0; MEMORY];
            along(&law, &mut memory, &[0.0, 0.3, 0.1, 0.3], 500, 1e-3);
            let before = memory[0];
            along(&law, &mut memory, &[0.3, 0.1, 0.3], 500, 1e-3);
            assert_eq!((memory[0] - before).abs() > 1e-3, drifts, "gate {gate}: {}", memory[0] - before);
        }
    }

    #[test]
    fn what_is_stored_comes_back() {
        let law = law(1.0);
        let mut memory = vec![0.0; MEMORY];
        along(&law, &mut memory, &[0.0, 0.3], 1000, 1e-3);
        let (stored, mut back) = (law.stored(&memory, 0.3), 0.0);
        let mut x = 0.3;
        while law.force(&memory, x, 0.0) > 0.0 {
            let before = law.force(&memory, x, 0.0);
            law.advance(&mut memory, x, x - 1e-5, 1e-2);
            x -= 1e-5;
            back += 1e-5 * 0.5 * (before + law.force(&memory, x, 0.0)).max(0.0);
        }
        assert!((back / stored - 1.0).abs() < 1e-3, "{back} {stored}");
    }
}
