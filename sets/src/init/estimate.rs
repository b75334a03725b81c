//! Parameters to start from: inertia, damping and stiffness of one body, from what drives it and what it does.
//!
//! The equation of motion f = m x'' + b x' + k x + c is multiplied by a bump g that vanishes at both ends together with its slope.
//! Integration by parts gives
//!
//! ```text
//! ∫g f = m ∫g''x - b ∫g'x + k ∫g x + c ∫g
//! ```
//!
//! This is linear in the unknowns, and nothing measured is differentiated (Shinbrot 1957, modulating functions). One such row for every place of
//! the bump, and least squares.

use nalgebra::{DMatrix, DVector};

/// What drives a body, and its motion, on one even grid.
pub struct Shown<'a> {
    /// Sample time, s.
    pub period: f64,
    /// N or N m.
    pub force: &'a [f64],
    /// What was measured of the motion.
    pub motion: Measured<'a>,
}

/// A measured motion.
pub enum Measured<'a> {
    /// m or rad.
    Position(&'a [f64]),
    /// m/s or rad/s.
    Velocity(&'a [f64]),
}

/// Numbers of one body.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Numbers {
    /// kg or kg m².
    pub inertia: f64,
    /// N s/m or N m s/rad.
    pub damping: f64,
    /// N/m or N m/rad; 0 where none was asked for.
    pub stiffness: f64,
}

/// Half widths of the bump, samples: which of them shows the motion best depends on how fast it is.
const WIDTHS: [usize; 7] = [5, 12, 30, 70, 160, 400, 1000];
/// Rows of one recording, at most.
const ROWS: usize = 2000;

/// Numbers that explain the recordings best; `None` where nothing that a body can be does.
pub fn estimate(shown: &[Shown], with_spring: bool) -> Option<Numbers> {
    let tried = WIDTHS.iter().filter_map(|width| at_width(shown, *width, with_spring));
    let best = tried.filter(|(_, n)| n.inertia > 0.0 && n.stiffness >= 0.0).min_by(|a, b| a.0.total_cmp(&b.0))?.1;
    // A bearing that drives is friction's or noise's doing: one that takes a second to stop is a start.
    let damping = if best.damping > 0.0 { best.damping } else { best.inertia };
    Some(Numbers { damping, ..best })
}

/// Share of the force that remains unexplained, and the parameters.
fn at_width(shown: &[Shown], width: usize, with_spring: bool) -> Option<(f64, Numbers)> {
    let unknowns = if with_spring { 4 } else { 3 };
    let (mut rows, mut right) = (Vec::new(), Vec::new());
    for one in shown {
        let count = one.force.len();
        if count < 4 * width {
            continue;
        }
        let stride = (width / 2).max(count / ROWS).max(1);
        let bump = Bump::new(width, one.period);
        for centre in (width..count - width).step_by(stride) {
            let integral = |weights: &[f64], samples: &[f64]| -> f64 {
                samples.get(centre - width..=centre + width).unwrap_or_default().iter().zip(weights).map(|(x, w)| x * w).sum::<f64>()
                    * one.period
            };
            let position: Vec<f64>;
            let (inertia, damping, spring) = match one.motion {
                Measured::Position(x) => {
                    // About the middle of the window: far from 0 the integrals of g'' and g' are small differences.
                    let middle = x.get(centre).copied().unwrap_or(0.0);
                    position = x.get(centre - width..=centre + width).unwrap_or_default().iter().map(|x| x - middle).collect();
                    let about = |weights: &[f64]| position.iter().zip(weights).map(|(x, w)| x * w).sum::<f64>() * one.period;
                    (about(&bump.second), -about(&bump.first), about(&bump.value) + middle * bump.area)
                }
                Measured::Velocity(v) => {
                    let mut x = 0.0;
                    let run = v.iter().take(centre + width + 1).map(|v| {
                        x += v * one.period;
                        x
                    });
                    position = if with_spring { run.skip(centre - width).collect() } else { Vec::new() };
                    let spring = position.iter().zip(&bump.value).map(|(x, w)| x * w).sum::<f64>() * one.period;
                    (-integral(&bump.first, v), integral(&bump.value, v), spring)
                }
            };
            rows.extend([inertia, damping, bump.area].iter().chain(with_spring.then_some(&spring)));
            right.push(integral(&bump.value, one.force));
        }
    }
    // The decomposition below does not end on what is not finite.
    if right.len() < 3 * unknowns || !rows.iter().chain(&right).all(|x| x.is_finite()) {
        return None;
    }
    let mut matrix = DMatrix::from_row_slice(right.len(), unknowns, &rows);
    let right = DVector::from_vec(right);
    // Columns of equal size: kg and N s/m are not.
    let sizes: Vec<f64> = matrix.column_iter().map(|c| c.norm()).collect();
    for (mut column, size) in matrix.column_iter_mut().zip(&sizes) {
        if *size > 0.0 {
            column /= *size;
        }
    }
    let solved = matrix.clone().svd(true, true).solve(&right, 1e-9).ok()?;
    let rest = (&matrix * &solved - &right).norm() / right.norm();
    let value = |index: usize| match sizes.get(index) {
        Some(size) if *size > 0.0 => solved.get(index).copied().unwrap_or(0.0) / size,
        _ => 0.0,
    };
    let numbers = Numbers { inertia: value(0), damping: value(1), stiffness: if with_spring { value(3) } else { 0.0 } };
    (rest.is_finite() && numbers.inertia.is_finite()).then_some((rest, numbers))
}

/// g = (1 - s²)³ over -1 < s < 1, and its derivatives by time.
struct Bump {
    value: Vec<f64>,
    first: Vec<f64>,
    second: Vec<f64>,
    area: f64,
}

impl Bump {
    fn new(width: usize, period: f64) -> Bump {
        let half = width as f64 * period;
        let places: Vec<f64> = (0..=2 * width).map(|i| i as f64 / width as f64 - 1.0).collect();
        let value: Vec<f64> = places.iter().map(|s| (1.0 - s * s).powi(3)).collect();
        let first = places.iter().map(|s| -6.0 * s * (1.0 - s * s).powi(2) / half).collect();
        let second = places.iter().map(|s| (1.0 - s * s) * (30.0 * s * s - 6.0) / (half * half)).collect();
        let area = value.iter().sum::<f64>() * period;
        Bump { value, first, second, area }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Samples of a motion of two sines, and the force that it takes.
    fn driven(m: f64, b: f64, k: f64, step: f64) -> (Vec<f64>, Vec<f64>, Vec<f64>) {
        let (mut x, mut v, mut f) = (Vec::new(), Vec::new(), Vec::new());
        for i in 0..4000 {
            let t = f64::from(i) * 1e-3;
            let sines = [(0.3, 9.0), (0.05, 60.0)];
            let sum = |of: &dyn Fn(f64, f64) -> f64| sines.iter().map(|(a, w)| of(*a, *w)).sum::<f64>();
            let place = sum(&|a, w| a * (w * t).sin());
            let speed = sum(&|a, w| a * w * (w * t).cos());
            f.push(m * sum(&|a, w| -a * w * w * (w * t).sin()) + b * speed + k * place + 0.01);
            x.push(if step > 0.0 { (place / step).round() * step } else { place });
            v.push(speed);
        }
        (x, v, f)
    }

    #[test]
    fn numbers_of_a_body_come_back_from_position_or_velocity() {
        let (m, b, k) = (2e-3, 8e-3, 0.4);
        let (x, v, force) = driven(m, b, k, 1e-3);
        for (motion, with_spring) in [(Measured::Position(&x), true), (Measured::Velocity(&v), true)] {
            let n = estimate(&[Shown { period: 1e-3, force: &force, motion }], with_spring).unwrap();
            let near = |found: f64, meant: f64| (found / meant - 1.0).abs() < 0.05;
            assert!(near(n.inertia, m) && near(n.damping, b) && near(n.stiffness, k), "{n:?}");
        }
        let (x, _, force) = driven(m, b, 0.0, 1e-3);
        let n = estimate(&[Shown { period: 1e-3, force: &force, motion: Measured::Position(&x) }], false).unwrap();
        assert!((n.inertia / m - 1.0).abs() < 0.05 && n.stiffness == 0.0, "{n:?}");
    }

    #[test]
    fn of_what_does_not_move_nothing_is_estimated() {
        let still = [0.0; 500];
        assert_eq!(estimate(&[Shown { period: 1e-3, force: &still, motion: Measured::Position(&still) }], true), None);
        assert_eq!(estimate(&[], false), None);
        // A force that pushes backwards is a wrong sign, and no negative mass.
        let (x, _, force) = driven(2e-3, 8e-3, 0.0, 0.0);
        let turned: Vec<f64> = force.iter().map(|f| -f).collect();
        assert_eq!(estimate(&[Shown { period: 1e-3, force: &turned, motion: Measured::Position(&x) }], false), None);
    }
}
