//! The operator itself: what it remembers, and its force.

use super::transition::Transition;

/// Most turning points that are remembered. Each new one lies within the last two; where there would be more, the innermost
/// two, between which hardly anything is left, are forgotten.
pub const TURNS: usize = 24;

/// Length of an operator's memory: the displacement z, how many turning points there are, and of each the displacement and the
/// force. All zero at rest.
pub const MEMORY: usize = 2 + 2 * TURNS;

/// A Preisach operator that stands alone; the element kind keeps its memory with the stepper's.
#[derive(Debug, Clone)]
pub struct Operator {
    curves: Transition,
    memory: [f64; MEMORY],
}

impl Operator {
    /// At rest.
    pub fn new(curves: impl Into<Transition>) -> Operator {
        Operator { curves: curves.into(), memory: [0.0; MEMORY] }
    }

    /// Moves the displacement to `to`, m, and gives the force there, N.
    pub fn step(&mut self, to: f64) -> f64 {
        advance(&self.curves, &mut self.memory, to);
        self.force()
    }

    /// Force, N.
    pub fn force(&self) -> f64 {
        force(&self.curves, &self.memory)
    }

    /// Displacements at the turning points that are remembered, m, outermost first.
    pub fn turning_points(&self) -> Vec<f64> {
        (0..turns(&self.memory)).map(|k| turn(&self.memory, k).0).collect()
    }
}

/// The force by the sum over all turning points, eqs (8)-(10), N: `turning_points` from the outermost to the last, in m, of a
/// path that began at rest, and `z` within the last two.
///
/// What [`Operator`] keeps up to date at each turn; this form is the one to check it against.
pub fn everett_sum(curves: &Transition, turning_points: &[f64], z: f64) -> f64 {
    let gained = |from: f64, to: f64| curves.rise(from.abs().max(to.abs()), (to - from).abs()).force * (to - from).signum();
    let Some(first) = turning_points.first() else { return 0.5 * gained(-z, z) };
    let path: Vec<f64> = turning_points.iter().copied().chain([z]).collect();
    0.5 * gained(-*first, *first) + path.windows(2).map(|w| gained(w[0], w[1])).sum::<f64>()
}

#[inline]
fn turns(memory: &[f64]) -> usize {
    memory.get(1).map_or(0, |n| *n as usize).min(TURNS)
}

/// Displacement and force at a turning point.
#[inline]
fn turn(memory: &[f64], k: usize) -> (f64, f64) {
    (memory[2 + 2 * k], memory[3 + 2 * k])
}

/// Force and slope on the virgin curve.
#[inline]
fn virgin(curves: &Transition, z: f64) -> (f64, f64) {
    let rise = curves.rise(z.abs(), 2.0 * z.abs());
    (0.5 * rise.force.copysign(z), rise.along + 0.5 * rise.outward)
}

/// Force and slope at `z` on the way from a turning point.
#[inline]
fn branch(curves: &Transition, (from, at_turn): (f64, f64), z: f64) -> (f64, f64) {
    let rise = curves.rise(from.abs().max(z.abs()), (z - from).abs());
    let outward = if z.abs() >= from.abs() { rise.outward } else { 0.0 };
    (at_turn + rise.force.copysign(z - from), rise.along + outward)
}

/// Force and slope where `level` turning points are left.
#[inline]
fn at(curves: &Transition, memory: &[f64], level: usize, z: f64) -> (f64, f64) {
    if level == 0 { virgin(curves, z) } else { branch(curves, turn(memory, level - 1), z) }
}

/// Force, N.
#[inline]
pub(crate) fn force(curves: &Transition, memory: &[f64]) -> f64 {
    memory.first().map_or(0.0, |z| at(curves, memory, turns(memory), *z).0)
}

/// Whether a way in `direction` (its sign) turns back.
#[inline]
fn turns_back(memory: &[f64], direction: f64) -> bool {
    let n = turns(memory);
    let since = if n == 0 { memory[0] } else { memory[0] - turn(memory, n - 1).0 };
    since * direction < 0.0
}

/// df/dz for a displacement that sets off in `direction` (its sign), N/m.
#[inline]
pub(crate) fn slope(curves: &Transition, memory: &[f64], direction: f64) -> f64 {
    let z = memory[0];
    if turns_back(memory, direction) { branch(curves, (z, 0.0), z).1 } else { at(curves, memory, turns(memory), z).1 }
}

/// Moves the displacement to `to` in one go: turning points that are passed are wiped out, two at a time.
#[inline]
pub(crate) fn advance(curves: &Transition, memory: &mut [f64], to: f64) {
    if memory.len() < MEMORY || to == memory[0] {
        return;
    }
    let z = memory[0];
    let direction = to - z;
    if turns_back(memory, direction) {
        let at_turn = force(curves, memory);
        let n = turns(memory);
        let n = if n == TURNS { n - 2 } else { n };
        (memory[2 + 2 * n], memory[3 + 2 * n]) = (z, at_turn);
        memory[1] = (n + 1) as f64;
    }
    let mut level = turns(memory);
    while level > 0 {
        let limit = if level == 1 { -turn(memory, 0).0 } else { turn(memory, level - 2).0 };
        if (to - limit) * direction < 0.0 {
            break;
        }
        level = level.saturating_sub(2);
    }
    memory[1] = level as f64;
    memory[0] = to;
}
