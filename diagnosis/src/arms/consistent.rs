//! Inertial parameters that bodies can have, nearest to those of a regression.
//!
//! The pseudo-inertia of every body has to be positive definite (Wensing, Kim & Slotine, RA-L 3(1), 2018). The fit's own quadratic, in which all other
//! parameters follow, is minimised with a barrier: the logarithm of the determinants of the pseudo-inertias relative to that of the file's bodies.
//! This is the log-determinant divergence of Lee, Wensing & Park (Geometric robot dynamic identification, T-RO 36(2), 2020). Its weight is so small
//! that it acts only where the quadratic leaves the cone or is flat.

use crate::arms::fit::{Fit, Weights};
use crate::arms::inertial::{COUNT, Parameters, pseudo_inertia};
use crate::arms::regression::Data;
use nalgebra::{DMatrix, DVector, Matrix4, SVector};

/// Weight of the barrier, in the units of the weighted squared residual: far below one independent row.
const BARRIER: f64 = 1e-3;
/// Newton steps at most.
const STEPS: usize = 100;

/// The fit with inertial parameters that bodies can have; all else is fitted again beside them. The fit itself where it has them already.
pub fn consistent(data: &Data, fit: &Fit, weights: &Weights) -> Option<Fit> {
    let parameters = data.parameters(fit);
    if parameters.iter().all(is_body) {
        return Some(fit.clone());
    }
    let bodies = &data.problem.bodies;
    let count = bodies.nominal.len() * COUNT;
    let (hessian, at) = data.quadratic(&fit.structure, weights)?;
    // A start inside: the file's bodies, made a little thicker where they are flat.
    let thick = |k: usize| {
        let mut p = bodies.nominal[k];
        let mut more = 1e-4;
        while !is_body(&p) && more < 10.0 {
            p = bodies.nominal[k];
            p[0] += more * bodies.scale[k][0];
            [4, 7, 9].iter().for_each(|i| p[*i] += more * bodies.scale[k][*i]);
            more *= 2.0;
        }
        p
    };
    let start: Vec<Parameters> = (0..bodies.nominal.len()).map(thick).collect();
    let mut x = DVector::zeros(count);
    for (k, (start, nominal)) in start.iter().zip(&bodies.nominal).enumerate() {
        let change = SVector::from(*start) - SVector::from(*nominal);
        if let Some(inverse) = bodies.basis[k].try_inverse() {
            x.rows_mut(k * COUNT, COUNT).copy_from(&(inverse * change));
        }
    }
    let value = |x: &DVector<f64>| -> Option<f64> {
        let away = x - &at;
        let mut sum = 0.5 * away.dot(&(&hessian * &away));
        for k in 0..bodies.nominal.len() {
            let factor = pseudo_inertia(&body(data, x, k)).cholesky()?;
            sum -= 2.0 * BARRIER * factor.l().diagonal().iter().map(|d| d.ln()).sum::<f64>();
        }
        Some(sum)
    };
    // As far towards the least of the quadratic as bodies go, to begin with.
    let inside = x.clone();
    let mut share = 1.0;
    while share > 1e-4 && value(&(&inside + share * (&at - &inside))).is_none() {
        share *= 0.7;
    }
    let nearer = &inside + 0.9 * share * (&at - &inside);
    if value(&nearer).is_some_and(|v| value(&x).is_none_or(|w| v < w)) {
        x = nearer;
    }
    let mut now = value(&x)?;
    for _ in 0..STEPS {
        let (mut gradient, mut curvature) = (&hessian * (&x - &at), hessian.clone());
        for k in 0..bodies.nominal.len() {
            let Some(inverse) = pseudo_inertia(&body(data, &x, k)).try_inverse() else { continue };
            let units: Vec<Matrix4<f64>> =
                (0..COUNT).map(|i| inverse * pseudo_inertia(&std::array::from_fn(|j| bodies.basis[k][(j, i)]))).collect();
            for i in 0..COUNT {
                gradient[k * COUNT + i] -= BARRIER * units[i].trace();
                for j in 0..COUNT {
                    curvature[(k * COUNT + i, k * COUNT + j)] += BARRIER * (units[i] * units[j]).trace();
                }
            }
        }
        let Some(step) = solve(&curvature, &gradient) else { break };
        let expected = gradient.dot(&step);
        let mut length = 1.0;
        let mut moved = false;
        while length > 1e-12 {
            let next = &x - length * &step;
            if let Some(there) = value(&next).filter(|v| *v <= now - 1e-4 * length * expected) {
                (x, now, moved) = (next, there, true);
                break;
            }
            length *= 0.5;
        }
        if !moved || expected < 1e-9 {
            break;
        }
    }
    data.fit_beside(fit, x.as_slice(), weights)
}

/// Whether a body can have these parameters.
pub fn is_body(p: &Parameters) -> bool {
    pseudo_inertia(p).cholesky().is_some()
}

fn body(data: &Data, x: &DVector<f64>, k: usize) -> Parameters {
    data.problem.bodies.changed(k, x.rows(k * COUNT, COUNT).as_slice())
}

fn solve(matrix: &DMatrix<f64>, right: &DVector<f64>) -> Option<DVector<f64>> {
    let scale = DVector::from_fn(right.len(), |i, _| 1.0 / matrix[(i, i)].max(1e-300).sqrt());
    let scaled = DMatrix::from_fn(right.len(), right.len(), |i, j| matrix[(i, j)] * scale[i] * scale[j]);
    Some(scaled.cholesky()?.solve(&right.component_mul(&scale)).component_mul(&scale))
}
