//! Which hypotheses could explain what a fit leaves over: their effects, as residuals see them, held against it.

use crate::fit::{Evaluator, Fit, dot};
use crate::hypothesis::Hypothesis;
use crate::structure::Structure;
use nalgebra::{DMatrix, DVector};
use rayon::prelude::*;

/// What a hypothesis could explain.
#[derive(Debug, Clone)]
pub struct Promise {
    /// Its place in the list of hypotheses.
    pub hypothesis: usize,
    /// Values to start a fit from.
    pub values: Vec<f64>,
    /// Share of the cost that it would take, to first order and with every free number adjusted.
    pub share: f64,
    /// Its effects, with what the free numbers can do taken out.
    columns: Vec<Vec<f64>>,
}

/// Residuals kept for screening, at most.
const KEPT: usize = 16_000;
/// Strength of a weak effect beside a full one.
const WEAK: f64 = 0.15;

/// What is left of columns when everything that the fit's numbers can do is taken out.
struct Projector {
    columns: Vec<Vec<f64>>,
    factor: Option<nalgebra::Cholesky<f64, nalgebra::Dyn>>,
}

impl Projector {
    fn new(jacobian: &[Vec<f64>], stride: usize) -> Projector {
        Projector::of(jacobian.iter().map(|c| c.iter().step_by(stride).copied().collect()).collect())
    }

    fn of(mut columns: Vec<Vec<f64>>) -> Projector {
        columns.retain_mut(|column| {
            let size = dot(column, column).sqrt();
            column.iter_mut().for_each(|x| *x /= size);
            size > 0.0 && size.is_finite()
        });
        let n = columns.len();
        let gram = DMatrix::from_fn(n, n, |i, j| dot(&columns[i], &columns[j]) + if i == j { 1e-9 } else { 0.0 });
        Projector { columns, factor: gram.cholesky() }
    }

    fn apply(&self, column: &mut [f64]) {
        let Some(factor) = &self.factor else { return };
        let products = DVector::from_iterator(self.columns.len(), self.columns.iter().map(|c| dot(c, column)));
        for (weight, own) in factor.solve(&products).iter().zip(&self.columns) {
            column.iter_mut().zip(own).for_each(|(x, y)| *x -= weight * y);
        }
    }
}

/// Values between none and all of an effect.
fn weakened(hypothesis: &Hypothesis, values: &[f64]) -> Vec<f64> {
    let one = |(p, v): (&crate::hypothesis::Parameter, &f64)| match p.neutral {
        Some(neutral) if neutral.is_infinite() => (v / WEAK).clamp(p.range.0, p.range.1),
        Some(neutral) => (neutral + WEAK * (v - neutral)).clamp(p.range.0, p.range.1),
        None => *v,
    };
    hypothesis.parameters.iter().zip(values).map(one).collect()
}

/// The recordings that a fit explains worst, in their order.
pub fn worst_records(evaluator: &Evaluator, fit: &Fit, count: usize) -> Vec<usize> {
    let mut costs = vec![0.0; evaluator.records.len()];
    for (r, _, range) in evaluator.layout() {
        costs[r] += fit.residuals.get(range).map_or(0.0, |part| dot(part, part));
    }
    let mut order: Vec<usize> = (0..costs.len()).collect();
    order.sort_by(|a, b| costs[*b].total_cmp(&costs[*a]));
    order.truncate(count);
    order.sort_unstable();
    order
}

/// Every hypothesis's best start with what it promises, most promising first.
pub fn screen(evaluator: &Evaluator, base: &Structure, fit: &Fit, hypotheses: &[Hypothesis]) -> Vec<Promise> {
    let stride = fit.residuals.len().div_ceil(KEPT).max(1);
    let projector = Projector::new(&fit.jacobian, stride);
    let mut left: Vec<f64> = fit.residuals.iter().step_by(stride).copied().collect();
    let total = dot(&left, &left);
    projector.apply(&mut left);
    let problem = evaluator.problem;
    let (stated, added) = (base.stated_of(problem, &fit.values), base.added_of(&fit.values));
    // First all starts on the two recordings that are explained worst, then the best ones on all.
    let few = worst_records(evaluator, fit, 2);
    let all: Vec<(usize, &Vec<f64>)> = hypotheses
        .iter()
        .enumerate()
        .filter(|(_, h)| base.added.iter().all(|b| b.compatible(h)))
        .flat_map(|(index, h)| h.starts.iter().map(move |start| (index, start)))
        .collect();
    let mut jobs = all;
    if evaluator.records.len() > few.len() && problem.initial == backdrive_plant::set::Initial::Rest {
        let layout = evaluator.layout();
        let kept: Vec<usize> = layout.iter().filter(|l| few.contains(&l.0)).flat_map(|l| l.2.clone()).step_by(stride).collect();
        let pick = |all: &[f64]| kept.iter().filter_map(|i| all.get(*i).copied()).collect::<Vec<f64>>();
        let small = Projector::of(fit.jacobian.iter().map(|c| pick(c)).collect());
        let mut left = pick(&fit.residuals);
        small.apply(&mut left);
        let total = dot(&left, &left);
        let mut scores: Vec<(f64, (usize, &Vec<f64>))> = jobs
            .par_iter()
            .filter_map(|(index, start)| {
                let mut with = base.added.clone();
                with.push(hypotheses[*index].clone());
                let structure = Structure::new(problem, evaluator.records, with);
                let values = structure.values(problem, &stated, &[added.clone(), vec![start.to_vec()]].concat());
                let model = structure.model(problem, &values)?;
                let parts: Option<Vec<Vec<f64>>> =
                    few.iter().map(|r| evaluator.record_residuals(&structure, &model, &values, *r)).collect();
                let joined = parts?.concat();
                let mut column: Vec<f64> = joined.into_iter().step_by(stride).zip(pick(&fit.residuals)).map(|(a, b)| a - b).collect();
                let size = dot(&column, &column).sqrt();
                if !(size > 0.0 && size.is_finite()) {
                    return None;
                }
                column.iter_mut().for_each(|x| *x /= size);
                small.apply(&mut column);
                Some((share(&[&column], &left, total), (*index, *start)))
            })
            .collect();
        scores.sort_by(|a, b| b.0.total_cmp(&a.0));
        let mut seen = vec![0; hypotheses.len()];
        scores.retain(|s| {
            seen[s.1.0] += 1;
            seen[s.1.0] <= 2
        });
        jobs = scores.into_iter().take(60).map(|s| s.1).collect();
    }
    let mut promises: Vec<Promise> = jobs
        .par_iter()
        .filter_map(|(index, start)| {
            let hypothesis = &hypotheses[*index];
            let mut with = base.added.clone();
            with.push(hypothesis.clone());
            let structure = Structure::new(problem, evaluator.records, with);
            let effect = |values: Vec<f64>| -> Option<Vec<f64>> {
                let all = [added.clone(), vec![values]].concat();
                let residuals = evaluator.residuals(&structure, &structure.values(problem, &stated, &all))?;
                let mut column: Vec<f64> =
                    residuals.iter().step_by(stride).zip(fit.residuals.iter().step_by(stride)).map(|(a, b)| a - b).collect();
                let size = dot(&column, &column).sqrt();
                if !(size > 0.0 && size.is_finite()) {
                    return None;
                }
                column.iter_mut().for_each(|x| *x /= size);
                projector.apply(&mut column);
                Some(column)
            };
            let full = effect(start.to_vec());
            let weak = effect(weakened(hypothesis, start));
            let share_of = |column: &Option<Vec<f64>>| column.as_ref().map_or(0.0, |c| share(&[c], &left, total));
            // A fit starts where the effect looks most like what is left over.
            let values = if share_of(&weak) > share_of(&full) { weakened(hypothesis, start) } else { start.to_vec() };
            let columns: Vec<Vec<f64>> = [full, weak].into_iter().flatten().collect();
            let share = share(&columns.iter().collect::<Vec<_>>(), &left, total);
            (share > 0.0).then_some(Promise { hypothesis: *index, values, share, columns })
        })
        .collect();
    promises.sort_by(|a, b| b.share.total_cmp(&a.share));
    let mut seen = vec![0; hypotheses.len()];
    // Two starts of the same hypothesis are enough.
    promises.retain(|p| {
        seen[p.hypothesis] += 1;
        seen[p.hypothesis] <= 2
    });
    promises
}

/// Share of `total` that columns explain of what is left.
fn share(columns: &[&Vec<f64>], left: &[f64], total: f64) -> f64 {
    let n = columns.len();
    if n == 0 || total <= 0.0 {
        return 0.0;
    }
    let size: Vec<f64> = columns.iter().map(|c| dot(c, c).sqrt().max(1e-300)).collect();
    // An effect that the free numbers imitate to a thousandth is not there to be seen.
    if size.iter().all(|s| *s < 1e-3) {
        return 0.0;
    }
    let gram = DMatrix::from_fn(n, n, |i, j| dot(columns[i], columns[j]) / (size[i] * size[j]) + if i == j { 1e-4 } else { 0.0 });
    let right = DVector::from_iterator(n, columns.iter().zip(&size).map(|(c, s)| dot(c, left) / s));
    match gram.cholesky() {
        Some(factor) => (right.dot(&factor.solve(&right)) / total).clamp(0.0, 1.0),
        None => 0.0,
    }
}

/// Pairs of hypotheses by what they promise together, most promising first: places in `promises`.
pub fn pairs(
    promises: &[Promise],
    fit: &Fit,
    jacobian: &[Vec<f64>],
    count: usize,
    compatible: impl Fn(usize, usize) -> bool,
) -> Vec<(usize, usize, f64)> {
    let stride = fit.residuals.len().div_ceil(KEPT).max(1);
    let mut left: Vec<f64> = fit.residuals.iter().step_by(stride).copied().collect();
    let total = dot(&left, &left);
    Projector::new(jacobian, stride).apply(&mut left);
    let firsts: Vec<usize> = (0..promises.len().min(count)).collect();
    // Every product once.
    let columns: Vec<&Vec<f64>> = firsts.iter().flat_map(|p| promises[*p].columns.iter()).collect();
    let owner: Vec<usize> = firsts.iter().flat_map(|p| promises[*p].columns.iter().map(move |_| *p)).collect();
    let size: Vec<f64> = columns.iter().map(|c| dot(c, c).sqrt().max(1e-300)).collect();
    let gram: Vec<Vec<f64>> =
        (0..columns.len()).into_par_iter().map(|i| (0..=i).map(|j| dot(columns[i], columns[j]) / (size[i] * size[j])).collect()).collect();
    let right: Vec<f64> = columns.iter().zip(&size).map(|(c, s)| if *s < 1e-3 { 0.0 } else { dot(c, &left) / s }).collect();
    let mut found = Vec::new();
    for a in &firsts {
        for b in firsts.iter().filter(|b| *b > a) {
            if !compatible(promises[*a].hypothesis, promises[*b].hypothesis) {
                continue;
            }
            let own: Vec<usize> = (0..columns.len()).filter(|c| owner[*c] == *a || owner[*c] == *b).collect();
            let n = own.len();
            let at = |i: usize, j: usize| if i >= j { gram[i][j] } else { gram[j][i] };
            let matrix = DMatrix::from_fn(n, n, |i, j| at(own[i], own[j]) + if i == j { 1e-3 } else { 0.0 });
            let vector = DVector::from_iterator(n, own.iter().map(|c| right[*c]));
            if let Some(factor) = matrix.cholesky() {
                found.push((*a, *b, (vector.dot(&factor.solve(&vector)) / total).clamp(0.0, 1.0)));
            }
        }
    }
    found.sort_by(|a, b| b.2.total_cmp(&a.2));
    found
}
