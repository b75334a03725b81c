//! Fits by simulation error: bounded, damped Gauss-Newton steps (Levenberg-Marquardt) with secant updates of the derivatives.

use crate::output_error::derivatives::{secant, to_external};
use crate::output_error::effort::Effort;
use crate::output_error::evaluator::Evaluator;
use crate::output_error::normal_equations::normal_equations;
use crate::output_error::structure::{FreeParameter, Role, Structure};
use crate::output_error::work::Steps;
use crate::tuning::tuning;
use nalgebra::{DMatrix, DVector};

/// A fitted structure.
#[derive(Debug, Clone)]
pub struct Fit {
    /// Values of [`Structure::free`], as they stand in the model.
    pub values: Vec<f64>,
    /// Sum of the squared normalised residuals (linear beyond a bound, where robust), and of the priors.
    pub cost: f64,
    /// Normalised residuals, measured less predicted over the noise standard deviation: record by record, output by output.
    pub residuals: Vec<f64>,
    /// Derivatives of the residuals by each parameter in the fit's own unit, where the last step began.
    pub jacobian: Vec<Vec<f64>>,
    /// Predicted decrease of the cost by the next Gauss-Newton step.
    pub predicted_decrease: f64,
    /// Steps taken.
    pub steps: usize,
}

impl Evaluator<'_> {
    /// Fits a structure from `start` on; `None` where it cannot be simulated there.
    pub fn fit(&self, structure: &Structure, start: &[f64], effort: Effort) -> Option<Fit> {
        self.fit_from_derivatives(structure, start, effort, None)
    }

    /// The same with derivatives that another fit found, of this structure or of one that shares its first parameters: good enough for the first steps.
    ///
    /// Derivatives are carried along by secant updates. They are recomputed when a step disappoints, every few steps, and before the fit reports
    /// convergence.
    pub fn fit_from_derivatives(
        &self,
        structure: &Structure,
        start: &[f64],
        effort: Effort,
        known: Option<(&Structure, &Fit)>,
    ) -> Option<Fit> {
        let mut descent = Descent::from(self, structure, start, known)?;
        loop {
            let next = descent.next_step();
            self.budget.count(algebra(descent.residuals.len(), descent.own.len()));
            if self.budget.is_over() || descent.steps >= effort.steps || descent.weak >= tuning().fit.weak_steps {
                return Some(descent.end(next.predicted_decrease));
            }
            if next.predicted_decrease < descent.enough(effort) {
                if descent.age == 0 || effort.tolerance > 1.0 {
                    return Some(descent.end(next.predicted_decrease));
                }
                descent.renew();
                continue;
            }
            match descent.try_steps(&next) {
                Some(trial) => descent.take(trial, &next, effort),
                None if !descent.widen() => return Some(descent.end(next.predicted_decrease)),
                None => {}
            }
        }
    }

    /// Derivatives at the start, those by parameters that another fit has in common from that one.
    fn first_jacobian(&self, structure: &Structure, own: &[f64], residuals: &[f64], known: Option<(&Structure, &Fit)>) -> Vec<Vec<f64>> {
        let Some((other, fit)) = known else {
            let moving: Vec<usize> = (0..own.len()).filter(|j| self.moves(&structure.free[*j])).collect();
            return self.all_columns(structure, own, residuals, &moving, self.stretch);
        };
        let still = vec![0.0; residuals.len()];
        let column = |number: &FreeParameter| {
            if !self.moves(number) {
                return Some(&still);
            }
            let place = other.free.iter().position(|n| n.role == number.role);
            place.and_then(|p| fit.jacobian.get(p)).filter(|c| c.len() == residuals.len())
        };
        let missing: Vec<usize> = (0..own.len()).filter(|j| column(&structure.free[*j]).is_none()).collect();
        let mut new = self.derivatives(structure, own, residuals, &missing, self.stretch).into_iter();
        structure.free.iter().map(|n| column(n).cloned().or_else(|| new.next()).unwrap_or_else(|| vec![0.0; residuals.len()])).collect()
    }

    /// The best of fits from several starts.
    pub fn best_of(&self, structure: &Structure, starts: &[Vec<f64>], effort: Effort) -> Option<Fit> {
        starts.iter().filter_map(|start| self.fit(structure, start, effort)).min_by(|a, b| a.cost.total_cmp(&b.cost))
    }
}

/// A fit on its way.
struct Descent<'e, 'a> {
    evaluator: &'e Evaluator<'a>,
    structure: &'e Structure,
    /// Mean and standard deviation before data of each parameter, in the fit's own unit.
    priors: Vec<Option<(f64, f64)>>,
    /// Parameters that this fit may move.
    moving: Vec<usize>,
    /// Their values in the fit's own unit.
    own: Vec<f64>,
    residuals: Vec<f64>,
    cost: f64,
    jacobian: Vec<Vec<f64>>,
    /// Steps since the derivatives were computed.
    age: usize,
    lambda: f64,
    /// Factor on the differences: a slip that begins a step earlier or later makes narrow ones rough.
    stretch: f64,
    steps: usize,
    /// Steps in a row that hardly lowered a large cost.
    weak: usize,
}

/// The normal equations where a fit stands.
struct Next {
    matrix: DMatrix<f64>,
    slope: DVector<f64>,
    /// Parameters that have an effect and are not pushed against a bound.
    free: Vec<usize>,
    /// Predicted decrease of the cost by the undamped step.
    predicted_decrease: f64,
}

/// Where a step that lowers the cost leads.
struct Trial {
    own: Vec<f64>,
    residuals: Vec<f64>,
    cost: f64,
}

impl<'e, 'a> Descent<'e, 'a> {
    fn from(
        evaluator: &'e Evaluator<'a>,
        structure: &'e Structure,
        start: &[f64],
        known: Option<(&Structure, &Fit)>,
    ) -> Option<Descent<'e, 'a>> {
        let numbers = &structure.free;
        let own: Vec<f64> = numbers.iter().zip(start).map(|(n, v)| n.to_internal(*v)).collect();
        // A weight on which a part of a recording carries no information stays where it is.
        let centred = |(n, x): (&FreeParameter, &f64)| {
            n.prior.map(|(centre, spread)| (if matches!(n.role, Role::Knot(..)) { *x } else { centre }, spread))
        };
        let priors: Vec<Option<(f64, f64)>> = numbers.iter().zip(&own).map(centred).collect();
        let residuals = evaluator.residuals(structure, &to_external(structure, &own))?;
        let cost = evaluator.cost(&residuals) + cost_of_priors(&priors, &own);
        let jacobian = evaluator.first_jacobian(structure, &own, &residuals, known);
        let moving = (0..own.len()).filter(|j| evaluator.moves(&numbers[*j])).collect();
        let (age, lambda, stretch) = (usize::from(known.is_some()), tuning().fit.damping, evaluator.stretch);
        Some(Descent { evaluator, structure, priors, moving, own, residuals, cost, jacobian, age, lambda, stretch, steps: 0, weak: 0 })
    }

    /// The normal equations here, priors included.
    fn next_step(&self) -> Next {
        let weights = self.evaluator.weights(&self.residuals);
        let (mut matrix, mut slope) = normal_equations(&self.jacobian, &self.residuals, weights.as_deref());
        for (j, prior) in self.priors.iter().enumerate() {
            if let Some((centre, spread)) = *prior {
                matrix[(j, j)] += 1.0 / (spread * spread);
                slope[j] += (self.own[j] - centre) / (spread * spread);
            }
        }
        let is_free = |j: &usize| may_move(&self.structure.free[*j], self.own[*j], slope[*j], matrix[(*j, *j)]);
        let free: Vec<usize> = self.moving.iter().copied().filter(is_free).collect();
        let step = step_of(&matrix, &slope, &free, 1e-9);
        let predicted_decrease = step.map_or(0.0, |step| free.iter().zip(&step).map(|(j, s)| -slope[*j] * s).sum());
        Next { matrix, slope, free, predicted_decrease }
    }

    /// Mean squared residual.
    fn unit(&self) -> f64 {
        self.cost / self.residuals.len().max(1) as f64
    }

    fn is_far(&self) -> bool {
        self.unit() > tuning().noise.near
    }

    /// Predicted decrease below which the fit has converged: far from the noise, a share of the cost decides nothing.
    fn enough(&self, effort: Effort) -> f64 {
        let share = if self.is_far() { tuning().fit.relative_tolerance * self.cost } else { 0.0 };
        (effort.tolerance * self.unit()).max(share)
    }

    /// Recomputes the derivatives.
    fn renew(&mut self) {
        self.jacobian = self.evaluator.all_columns(self.structure, &self.own, &self.residuals, &self.moving, self.stretch);
        self.age = 0;
    }

    /// Steps with growing damping, until one lowers the cost.
    fn try_steps(&mut self, next: &Next) -> Option<Trial> {
        let tries = if self.age > 0 { 2 } else { 6 };
        for _ in 0..tries {
            let step = step_of(&next.matrix, &next.slope, &next.free, self.lambda)?;
            let mut own = self.own.clone();
            for (j, s) in next.free.iter().zip(&step) {
                let number = &self.structure.free[*j];
                let (low, high) = number.bounds();
                let longest = if number.log { tuning().fit.longest_log } else { tuning().fit.longest * (high - low) };
                own[*j] = (self.own[*j] + s.clamp(-longest, longest)).clamp(low, high);
            }
            if let Some(residuals) = self.evaluator.residuals(self.structure, &to_external(self.structure, &own)) {
                let cost = self.evaluator.cost(&residuals) + cost_of_priors(&self.priors, &own);
                if cost < self.cost {
                    return Some(Trial { own, residuals, cost });
                }
            }
            self.lambda = (self.lambda * tuning().fit.more_damping).min(1e9);
        }
        None
    }

    /// Goes to where a step leads.
    fn take(&mut self, trial: Trial, next: &Next, effort: Effort) {
        let tuning = &tuning().fit;
        let decrease = self.cost - trial.cost;
        let ratio = decrease / next.predicted_decrease.max(1e-300);
        self.lambda = if ratio > 0.5 { self.lambda * tuning.less_damping } else { self.lambda * tuning.keep_damping }.max(1e-9);
        // Far from the noise and hardly moving: other structures deserve the work.
        self.weak = if decrease < tuning.weak_decrease * self.cost && self.is_far() { self.weak + 1 } else { 0 };
        let fresh = ratio < tuning.as_predicted || self.age >= tuning.secant_steps;
        if !fresh {
            secant(&mut self.jacobian, &self.residuals, &trial.residuals, &self.own, &trial.own, &next.matrix);
        }
        (self.own, self.residuals, self.cost) = (trial.own, trial.residuals, trial.cost);
        self.steps += 1;
        if fresh && self.steps < effort.steps {
            self.renew();
        } else {
            self.age += 1;
        }
    }

    /// After no step has lowered the cost: fresh derivatives, over wider differences where they were fresh. Whether there are any wider ones.
    fn widen(&mut self) -> bool {
        if self.age == 0 {
            if self.stretch >= self.evaluator.widest {
                return false;
            }
            self.stretch *= tuning().fit.wider;
        }
        self.renew();
        self.lambda = self.lambda.min(1e-1);
        true
    }

    fn end(self, predicted_decrease: f64) -> Fit {
        let values = to_external(self.structure, &self.own);
        Fit { values, cost: self.cost, residuals: self.residuals, jacobian: self.jacobian, predicted_decrease, steps: self.steps }
    }
}

fn cost_of_priors(priors: &[Option<(f64, f64)>], own: &[f64]) -> f64 {
    let one = |(p, x): (&Option<(f64, f64)>, &f64)| p.map_or(0.0, |(centre, spread)| ((x - centre) / spread).powi(2));
    priors.iter().zip(own).map(one).sum()
}

/// What the normal equations of a step take: about 200 products in the time of a step of a linear network.
fn algebra(residuals: usize, numbers: usize) -> Steps {
    (residuals * numbers * (numbers + 1) / 2 / 200) as Steps
}

/// Whether a parameter has an effect and is not pushed against its bound.
fn may_move(number: &FreeParameter, own: f64, slope: f64, curvature: f64) -> bool {
    let (low, high) = number.bounds();
    let edge = tuning().fit.at_bound * (high - low);
    curvature > 0.0 && !(own <= low + edge && slope > 0.0) && !(own >= high - edge && slope < 0.0)
}

/// Sum of products, in eight chains so that it is not the latency of one that counts.
pub fn dot(a: &[f64], b: &[f64]) -> f64 {
    let mut sums = [0.0; 8];
    let (a8, b8) = (a.chunks_exact(8), b.chunks_exact(8));
    let tail: f64 = a8.remainder().iter().zip(b8.remainder()).map(|(x, y)| x * y).sum();
    for (x, y) in a8.zip(b8) {
        for k in 0..8 {
            sums[k] += x[k] * y[k];
        }
    }
    sums.iter().sum::<f64>() + tail
}

/// Damped step of the free parameters, scaled by their own curvature.
fn step_of(matrix: &DMatrix<f64>, slope: &DVector<f64>, free: &[usize], lambda: f64) -> Option<Vec<f64>> {
    let scale: Vec<f64> = free.iter().map(|j| matrix[(*j, *j)].sqrt()).collect();
    let scaled = DMatrix::from_fn(free.len(), free.len(), |a, b| {
        matrix[(free[a], free[b])] / (scale[a] * scale[b]) + if a == b { lambda.max(1e-11) } else { 0.0 }
    });
    let right = DVector::from_iterator(free.len(), free.iter().zip(&scale).map(|(j, s)| -slope[*j] / s));
    let solution = scaled.cholesky()?.solve(&right);
    Some(solution.iter().zip(&scale).map(|(x, s)| x / s).collect())
}
