//! Transition curves: how much force a way from a turning point gains.

use super::dahl_loop::DahlLoop;

/// Force gained on a way, and how it grows.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Rise {
    /// F(α, β), N, at least 0.
    pub force: f64,
    /// ∂F/∂(α - β) with constant reach, N/m.
    pub along: f64,
    /// ∂F/∂reach with constant way, N/m.
    pub outward: f64,
}

/// The family of transition curves of an operator that is the same in both directions.
///
/// A curve is known by the `reach` of its loop, the larger one of |α| and |β|, m: it is a branch of the loop between `-reach` and
/// `reach`. So measured loops, which are symmetric, are all that it takes.
#[derive(Debug, Clone, PartialEq)]
pub struct Transition {
    /// Loops wherever nothing was measured.
    pub dahl: DahlLoop,
    /// Measured loops, by their reach.
    measured: Vec<Measured>,
}

/// A measured loop as its share of the deformed Dahl model's.
#[derive(Debug, Clone, PartialEq)]
struct Measured {
    reach: f64,
    /// (way as a share of the loop's width, force gained as a share of the model's), by the way.
    shares: Vec<(f64, f64)>,
}

impl From<DahlLoop> for Transition {
    fn from(dahl: DahlLoop) -> Transition {
        Transition { dahl, measured: Vec::new() }
    }
}

impl Transition {
    /// Loops of the deformed Dahl model that are bent through measured ones.
    ///
    /// `rows` are (reach, position, force) of falling branches, m, m, N: loop after loop with rising reach, each from `position = reach`
    /// downwards. Between two loops the share of the model's force is interpolated, at equal shares of the loops' widths; below
    /// the smallest and above the largest one it stays.
    ///
    /// # Errors
    /// One sentence where rows are no falling branches in that order.
    pub fn measured(dahl: DahlLoop, rows: &[[f64; 3]]) -> Result<Transition, String> {
        let mut measured: Vec<Measured> = Vec::new();
        let mut top = [0.0; 2];
        for (index, [reach, position, force]) in rows.iter().copied().enumerate() {
            let at = |reason: &str| format!("curves, row {}: {reason}", index + 1);
            if ![reach, position, force].iter().all(|x| x.is_finite()) || reach <= 0.0 {
                return Err(at("expected numbers, and a reach above 0"));
            }
            match measured.last_mut() {
                Some(last) if last.reach == reach => {
                    let (way, gained) = (top[0] - position, top[1] - force);
                    let share = way / (2.0 * reach);
                    if share > 1.0 + 1e-9 || way <= 0.0 || last.shares.last().is_some_and(|l| share <= l.0) {
                        return Err(at("positions must fall, from the reach to its negative at most"));
                    }
                    let before = last.shares.last().map_or(0.0, |l| l.1 * model(&dahl, reach, l.0 * 2.0 * reach).force);
                    if gained <= 0.0 || gained < before {
                        return Err(at("force must fall with the position"));
                    }
                    last.shares.push((share, gained / model(&dahl, reach, way).force));
                }
                last => {
                    if last.is_some_and(|l| l.reach > reach || l.shares.is_empty()) {
                        return Err(at("a loop needs two rows or more, and the loops' reach must rise"));
                    }
                    if (position - reach).abs() > 1e-9 * reach {
                        return Err(at("a loop begins at the position that is its reach"));
                    }
                    top = [position, force];
                    measured.push(Measured { reach, shares: Vec::new() });
                }
            }
        }
        match measured.last() {
            Some(last) if last.shares.is_empty() => Err("curves: the last loop has one row; it needs two or more".to_owned()),
            _ => Ok(Transition { dahl, measured }),
        }
    }

    /// Number of measured loops.
    pub fn loops(&self) -> usize {
        self.measured.len()
    }

    /// Steepest slope of any curve, N/m.
    pub fn steepest(&self) -> f64 {
        let share = |m: &Measured| {
            let corners = m.shares.windows(2).map(|w| (w[1].1 * w[1].0 - w[0].1 * w[0].0) / (w[1].0 - w[0].0));
            corners.chain(m.shares.iter().map(|s| s.1)).fold(0.0, f64::max)
        };
        self.dahl.slope * self.measured.iter().map(share).fold(1.0, f64::max)
    }

    /// Force gained on a way of `way` (m, at least 0) on the loop of `reach` (m, at least half the way).
    #[inline]
    pub fn rise(&self, reach: f64, way: f64) -> Rise {
        let rise = model(&self.dahl, reach, way);
        if self.measured.is_empty() || reach <= 0.0 { rise } else { self.bent(rise, reach, way) }
    }

    fn bent(&self, rise: Rise, reach: f64, way: f64) -> Rise {
        let width = 2.0 * reach;
        let u = way / width;
        let above = self.measured.partition_point(|m| m.reach < reach);
        let (low, high) = (above.saturating_sub(1), above.min(self.measured.len() - 1));
        let ((a, a_u), (b, b_u)) = (self.measured[low].share(u), self.measured[high].share(u));
        let gap = self.measured[high].reach - self.measured[low].reach;
        let part = if gap > 0.0 { (reach - self.measured[low].reach) / gap } else { 0.0 };
        let (share, by_u) = (a + part * (b - a), a_u + part * (b_u - a_u));
        let by_reach = if gap > 0.0 { (b - a) / gap } else { 0.0 };
        Rise {
            force: share * rise.force,
            along: share * rise.along + rise.force * by_u / width,
            outward: share * rise.outward + rise.force * (by_reach - by_u * u / reach),
        }
    }
}

impl Measured {
    /// Share of the model's force at a share of the width, and its slope.
    fn share(&self, u: f64) -> (f64, f64) {
        let above = self.shares.partition_point(|s| s.0 < u);
        match (above.checked_sub(1).and_then(|i| self.shares.get(i)), self.shares.get(above)) {
            (Some(a), Some(b)) => {
                let slope = (b.1 - a.1) / (b.0 - a.0);
                (a.1 + slope * (u - a.0), slope)
            }
            (Some(one), None) | (None, Some(one)) => (one.1, 0.0),
            (None, None) => (1.0, 0.0),
        }
    }
}

/// The deformed Dahl loop: `F = A s d/(A + s d)`, `A = f_c + f_r(reach)`.
#[inline]
fn model(dahl: &DahlLoop, reach: f64, way: f64) -> Rise {
    let (a, gained) = (dahl.force + dahl.reversal_force(reach), dahl.slope * way);
    let share = a / (a + gained);
    let rest = gained / (a + gained);
    Rise { force: gained * share, along: dahl.slope * share * share, outward: dahl.reversal_slope(reach) * rest * rest }
}
