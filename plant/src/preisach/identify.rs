//! Transition curves from measured loops.

use super::dahl_loop::DahlLoop;
use nalgebra::{Matrix2, Vector2};

/// A measured closed loop, moved to the middle and made the same in both directions.
#[derive(Debug, Clone, PartialEq)]
pub struct MeasuredLoop {
    /// Half the stroke, m.
    pub reach: f64,
    /// (position m, force N) of the falling branch, from `reach` downwards; the rising one turned over is in it.
    pub falling: Vec<(f64, f64)>,
}

impl MeasuredLoop {
    /// From the samples of one closed cycle: displacement, m, and friction force, N, equally long. Friction that depends on the speed has
    /// to be taken off, or the cycle to be slow.
    ///
    /// # Errors
    /// One sentence where the samples are no cycle.
    pub fn from_cycle(position: &[f64], force: &[f64]) -> Result<MeasuredLoop, String> {
        if position.len() != force.len() || position.len() < 8 {
            return Err(format!("a cycle needs 8 samples or more of both, not {} and {}", position.len(), force.len()));
        }
        if !position.iter().chain(force).all(|x| x.is_finite()) {
            return Err("the cycle has samples that are not numbers".to_owned());
        }
        let by = |a: &usize, b: &usize| position[*a].total_cmp(&position[*b]);
        let (Some(low), Some(high)) = ((0..position.len()).min_by(by), (0..position.len()).max_by(by)) else {
            return Err("the cycle is empty".to_owned());
        };
        let reach = 0.5 * (position[high] - position[low]);
        if reach <= 0.0 {
            return Err("the displacement does not move".to_owned());
        }
        let n = position.len();
        // Falls from the highest to the lowest sample, round the end of the cycle where need be.
        let span = (low + n - high) % n;
        let middle = 0.5 * (position[high] + position[low]);
        // Both branches have the same mean about the middle, but for the sign.
        let part = |k: usize| {
            let (a, b) = ((high + k) % n, (high + k + 1) % n);
            0.5 * (force[a] + force[b]) * (position[b] - position[a]).abs()
        };
        let level = (0..n).map(part).sum::<f64>() / (0..n).map(|k| (position[(k + 1) % n] - position[k]).abs()).sum::<f64>();
        let mut falling: Vec<(f64, f64)> = (0..n)
            .map(|k| {
                let i = (high + k) % n;
                let (q, f) = (position[i] - middle, force[i] - level);
                if k <= span { (q, f) } else { (-q, -f) }
            })
            .collect();
        falling.sort_by(|a, b| b.0.total_cmp(&a.0));
        Ok(MeasuredLoop { reach, falling })
    }

    /// Rows for a file of curves: (reach, position, force) at `points` (2 or more) places evenly spread over the stroke, by the means of the
    /// samples around each. Falls throughout, as a file has to.
    pub fn rows(&self, points: usize) -> Vec<[f64; 3]> {
        let points = points.max(2);
        let step = 2.0 * self.reach / (points - 1) as f64;
        let mut rows: Vec<[f64; 3]> = Vec::with_capacity(points);
        for k in 0..points {
            let q = self.reach - step * k as f64;
            let near = self.falling.iter().filter(|s| (s.0 - q).abs() <= 0.5 * step);
            // A straight line through the samples: at the ends they lie on one side.
            let (mut n, mut sx, mut sf, mut sxx, mut sxf) = (0.0, 0.0, 0.0, 0.0, 0.0);
            for (x, f) in near.map(|s| (s.0 - q, s.1)) {
                (n, sx, sf, sxx, sxf) = (n + 1.0, sx + x, sf + f, sxx + x * x, sxf + x * f);
            }
            let spread: f64 = n * sxx - sx * sx;
            if n < 1.0 {
                continue;
            }
            let force = if spread > 1e-12 * n * n * step * step { (sf * sxx - sx * sxf) / spread } else { sf / n };
            if rows.last().is_none_or(|last| force < last[2]) {
                rows.push([self.reach, q, force]);
            }
        }
        rows
    }
}

/// A fit of the deformed Dahl model to loops.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Fit {
    /// The parameters.
    pub dahl: DahlLoop,
    /// Root of the mean squared difference to the loops, N.
    pub rms: f64,
}

/// The deformed Dahl loops nearest to measured ones, by least squares over all samples (Levenberg 1944) in the logarithms of both numbers.
///
/// # Errors
/// One sentence where the loops cannot say.
pub fn fit(loops: &[MeasuredLoop]) -> Result<Fit, String> {
    let count: usize = loops.iter().map(|l| l.falling.len()).sum();
    let top = loops.iter().flat_map(|l| &l.falling).fold(0.0_f64, |top, s| top.max(s.1.abs()));
    let reach = loops.iter().fold(0.0_f64, |reach, l| reach.max(l.reach));
    if count < 2 || top <= 0.0 || reach <= 0.0 {
        return Err("the loops have no samples, no stroke or no force".to_owned());
    }
    let model = |p: &Vector2<f64>| DahlLoop { force: p.x.exp(), slope: p.y.exp() };
    let cost = |p: &Vector2<f64>| {
        let dahl = model(p);
        loops.iter().flat_map(|l| l.falling.iter().map(move |s| (dahl.falling(s.0, l.reach) - s.1).powi(2))).sum::<f64>()
    };
    let mut at = Vector2::new((1.2 * top).ln(), (4.0 * top / reach).ln());
    let (mut best, mut damping) = (cost(&at), 1e-3);
    for _ in 0..200 {
        let (mut normal, mut right) = (Matrix2::zeros(), Vector2::zeros());
        let step = 1e-6;
        let [base, up_force, up_slope] = [at, at + Vector2::new(step, 0.0), at + Vector2::new(0.0, step)].map(|p| model(&p));
        for l in loops {
            for (q, f) in &l.falling {
                let value = base.falling(*q, l.reach);
                let row = Vector2::new(up_force.falling(*q, l.reach) - value, up_slope.falling(*q, l.reach) - value) / step;
                normal += row * row.transpose();
                right += row * (f - value);
            }
        }
        let damped = normal + Matrix2::from_diagonal(&(normal.diagonal() * damping));
        let Some(change) = damped.lu().solve(&right) else { break };
        let next = at + change;
        let now = cost(&next);
        if now.is_finite() && now <= best {
            let done = change.norm() < 1e-10;
            (at, best, damping) = (next, now, damping * 0.2);
            if done {
                break;
            }
        } else {
            damping *= 8.0;
            if damping > 1e12 {
                break;
            }
        }
    }
    let dahl = model(&at);
    if !(dahl.force.is_finite() && dahl.slope.is_finite()) {
        return Err("the loops have no finite force and slope".to_owned());
    }
    Ok(Fit { dahl, rms: (best / count as f64).sqrt() })
}
