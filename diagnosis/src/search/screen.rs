//! Which hypotheses could explain the residual of a fit: their effects, as residuals see them, held against it.

use crate::hypothesis::Hypothesis;
use crate::output_error::evaluator::Evaluator;
use crate::output_error::fit::{Fit, dot};
use crate::output_error::structure::{Role, Structure};
use crate::output_error::work::Steps;
use crate::tuning::tuning;
use backdrive_plant::set::Initial;
use nalgebra::{DMatrix, DVector};
use rayon::prelude::*;
use std::collections::HashSet;

/// What a hypothesis could explain.
#[derive(Debug, Clone)]
pub struct Promise {
    /// Its place in the list of hypotheses.
    pub hypothesis: usize,
    /// Values to start a fit from.
    pub values: Vec<f64>,
    /// Share of the cost that it would remove, to first order and with every free parameter adjusted.
    pub share: f64,
    /// Its effects, with what the free parameters can do taken out.
    columns: Vec<Vec<f64>>,
}

/// What is left of columns when everything that the fit's parameters can do is taken out.
pub(crate) struct Projector {
    columns: Vec<Vec<f64>>,
    factor: Option<nalgebra::Cholesky<f64, nalgebra::Dyn>>,
}

impl Projector {
    pub(crate) fn new(jacobian: &[Vec<f64>], stride: usize) -> Projector {
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

    pub(crate) fn apply(&self, column: &mut [f64]) {
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
        Some(neutral) if neutral.is_infinite() => (v / tuning().screening.weak).clamp(p.range.0, p.range.1),
        Some(neutral) => (neutral + tuning().screening.weak * (v - neutral)).clamp(p.range.0, p.range.1),
        None => *v,
    };
    hypothesis.parameters.iter().zip(values).map(one).collect()
}

/// The recordings with the largest residuals, in their order.
pub fn worst_records(evaluator: &Evaluator, residuals: &[f64], count: usize) -> Vec<usize> {
    let mut costs = vec![0.0; evaluator.records.len()];
    for (r, _, range) in evaluator.layout() {
        costs[r] += residuals.get(range).map_or(0.0, |part| dot(part, part));
    }
    let mut order: Vec<usize> = (0..costs.len()).collect();
    order.sort_by(|a, b| costs[*b].total_cmp(&costs[*a]));
    order.truncate(count);
    order.sort_unstable();
    order
}

/// The change of a base's residuals by each hypothesis, so that it can be compared with the residual of any later fit. With the model coupled to the
/// measured motion, this change hardly depends on the rest of the model.
pub struct Screen {
    stride: usize,
    effects: Vec<Effect>,
}

/// A start of a hypothesis and its effect in full and weakened, of length 1.
struct Effect {
    hypothesis: usize,
    values: [Vec<f64>; 2],
    columns: [Option<Vec<f64>>; 2],
    /// Length of the weakened effect before it was brought to 1, noise standard deviations.
    length: f64,
}

/// A start of a hypothesis: its place in the list, and values.
type Start<'h> = (usize, &'h Vec<f64>);

/// A base with its fit, and the hypotheses beside it.
struct Beside<'b, 'a> {
    evaluator: &'b Evaluator<'a>,
    base: &'b Structure,
    fit: &'b Fit,
    hypotheses: &'b [Hypothesis],
    stride: usize,
    /// Values of the base: stated parameters, those of its own effects, those of single records.
    stated: Vec<f64>,
    added: Vec<Vec<f64>>,
    own: Vec<(Role, f64)>,
}

impl<'b, 'a> Beside<'b, 'a> {
    fn new(evaluator: &'b Evaluator<'a>, base: &'b Structure, fit: &'b Fit, hypotheses: &'b [Hypothesis]) -> Beside<'b, 'a> {
        let stride = fit.residuals.len().div_ceil(tuning().screening.residuals).max(1);
        let (stated, added, own) =
            (base.stated_of(evaluator.problem, &fit.values), base.added_of(&fit.values), base.of_records(&fit.values));
        Beside { evaluator, base, fit, hypotheses, stride, stated, added, own }
    }

    /// The base with one hypothesis, and its values.
    fn with(&self, index: usize, values: &[f64]) -> (Structure, Vec<f64>) {
        let problem = self.evaluator.problem;
        let structure =
            Structure::new(problem, self.evaluator.records, [self.base.added.clone(), vec![self.hypotheses[index].clone()]].concat());
        let values = structure.values(problem, &self.stated, &[self.added.clone(), vec![values.to_vec()]].concat(), &self.own);
        (structure, values)
    }

    /// What a simulation of a recording computes, by a sample of the hypotheses: nonlinear ones are slower than a linear base.
    fn cost_of_a_simulation(&self) -> Steps {
        let (evaluator, problem) = (self.evaluator, self.evaluator.problem);
        let before = evaluator.budget.spent();
        let sample: Vec<usize> = (0..self.hypotheses.len()).step_by((self.hypotheses.len() / 8).max(1)).collect();
        sample.par_iter().for_each(|index| {
            let first = self.hypotheses[*index].starts.first().cloned().unwrap_or_default();
            let (structure, values) = self.with(*index, &first);
            if let Some(model) = structure.model(problem, &values) {
                let _ = evaluator.record_residuals(&structure, &model, &values, 0);
            }
        });
        (evaluator.budget.spent() - before) / sample.len().max(1) as Steps
    }

    /// Starts of the hypotheses that go with the base, so many of each at most. First starts come first: where simulations are slower than the sample,
    /// the last ones are left out.
    fn starts(&self, depth: usize) -> Vec<Start<'b>> {
        let hypotheses = self.hypotheses;
        let compatible = hypotheses.iter().enumerate().filter(|(_, h)| self.base.added.iter().all(|b| b.compatible(h)));
        let mut starts: Vec<Start> =
            compatible.flat_map(|(index, h)| h.starts.iter().take(depth).map(move |start| (index, start))).collect();
        let rank = |(index, start): &Start| hypotheses[*index].starts.iter().position(|s| std::ptr::eq(s, *start));
        starts.sort_by_key(rank);
        starts
    }

    /// The first of two passes: all starts on the recordings with the largest residuals. The best `most` go on, at most two of each hypothesis. Half of
    /// them are those with the largest screening value. Then comes the best of each other effect, whatever its value: what does little beside the base may
    /// do much beside another effect.
    fn first_pass(&self, starts: &[Start<'b>], few: &[usize], most: usize, work: Steps) -> Vec<Start<'b>> {
        let (evaluator, problem, stride) = (self.evaluator, self.evaluator.problem, self.stride);
        let layout = evaluator.layout();
        let kept: Vec<usize> = layout.iter().filter(|l| few.contains(&l.0)).flat_map(|l| l.2.clone()).step_by(stride).collect();
        let pick = |all: &[f64]| kept.iter().filter_map(|i| all.get(*i).copied()).collect::<Vec<f64>>();
        let projector = Projector::of(self.fit.jacobian.iter().map(|c| pick(c)).collect());
        let before = pick(&self.fit.residuals);
        let mut left = before.clone();
        projector.apply(&mut left);
        let total = dot(&left, &left);
        let budget = evaluator.budget.next((work as f64 * tuning().screening.first_pass) as Steps);
        let scored = budget.abreast(starts, |budget, (index, start)| {
            let evaluator = evaluator.within(budget.clone());
            let (structure, values) = self.with(*index, start);
            let model = structure.model(problem, &values)?;
            let parts: Option<Vec<Vec<f64>>> = few.iter().map(|r| evaluator.record_residuals(&structure, &model, &values, *r)).collect();
            let mut column = unit(parts?.concat().into_iter().step_by(stride).zip(&before).map(|(a, b)| a - b).collect())?;
            projector.apply(&mut column);
            Some((share(&[&column], &left, total), (*index, *start)))
        });
        let mut scores: Vec<(f64, Start)> = scored.into_iter().flatten().flatten().collect();
        scores.sort_by(|a, b| b.0.total_cmp(&a.0));
        let mut seen = vec![0; self.hypotheses.len()];
        scores.retain(|s| {
            seen[s.1.0] += 1;
            seen[s.1.0] <= 2
        });
        let mut first = HashSet::new();
        let (firsts, seconds): (Vec<_>, Vec<_>) = scores.into_iter().map(|s| s.1).partition(|job| first.insert(job.0));
        let kind = |job: &Start| self.hypotheses[job.0].physics.name;
        let (promising, others) = firsts.split_at(firsts.len().min(most / 2));
        let mut kinds: HashSet<&str> = promising.iter().map(kind).collect();
        let (of_a_kind, others): (Vec<_>, Vec<_>) = others.iter().copied().partition(|job| kinds.insert(kind(job)));
        promising.iter().copied().chain(of_a_kind).chain(others).chain(seconds).take(most).collect()
    }

    /// The effect of a start in full and weakened.
    fn effect(&self, evaluator: &Evaluator, (index, start): Start) -> Effect {
        let (fit, stride) = (self.fit, self.stride);
        let measured = |values: &Vec<f64>| -> Option<(Vec<f64>, f64)> {
            let (structure, values) = self.with(index, values);
            let residuals = evaluator.residuals(&structure, &values)?;
            measured(residuals.iter().step_by(stride).zip(fit.residuals.iter().step_by(stride)).map(|(a, b)| a - b).collect())
        };
        let values = [start.to_vec(), weakened(&self.hypotheses[index], start)];
        let (full, weak) = (measured(&values[0]), measured(&values[1]));
        // One residual in `stride` was kept.
        let length = weak.as_ref().map_or(0.0, |w| w.1 * (stride as f64).sqrt());
        Effect { hypothesis: index, values, columns: [full.map(|e| e.0), weak.map(|e| e.0)], length }
    }
}

impl Screen {
    /// Simulates every hypothesis beside a base: all starts on the two recordings with the largest residuals, the best ones on all.
    /// With about so much work: where that is little, fewer starts of each are tried.
    pub fn new(evaluator: &Evaluator, base: &Structure, fit: &Fit, hypotheses: &[Hypothesis], work: Steps) -> Screen {
        let beside = Beside::new(evaluator, base, fit, hypotheses);
        // Half of the work for either pass.
        let affordable = (work / beside.cost_of_a_simulation().max(1)) as usize / 2;
        let all: usize = hypotheses.iter().map(|h| h.starts.len()).sum();
        let few = worst_records(evaluator, &fit.residuals, if 2 * all > affordable { 1 } else { 2 });
        let depth = (affordable / (few.len() * hypotheses.len().max(1))).max(1);
        let mut starts = beside.starts(depth);
        let (fewest, most) = (tuning().screening.fewest_starts, tuning().screening.starts);
        let most = (affordable / (2 * evaluator.records.len()).max(1)).clamp(fewest.min(most), most);
        let problem = evaluator.problem;
        let can_be_cut = problem.initial == Initial::Rest && problem.unknown.is_empty();
        if evaluator.records.len() > few.len() && can_be_cut && starts.len() > most {
            starts = beside.first_pass(&starts, &few, most, work);
        }
        let second_pass = evaluator.budget.next(work);
        let effects = second_pass.abreast(&starts, |budget, start| beside.effect(&evaluator.within(budget.clone()), *start));
        Screen { stride: beside.stride, effects: effects.into_iter().flatten().collect() }
    }

    /// For each start (hypothesis, values of the weakened effect) the length of what its effect adds beyond all that the fit's parameters can do, noise standard deviations.
    pub fn lengths(&self, fit: &Fit) -> Vec<((usize, Vec<f64>), f64)> {
        let projector = Projector::new(&fit.jacobian, self.stride);
        let one = |effect: &Effect| {
            let mut column = effect.columns[1].clone()?;
            projector.apply(&mut column);
            let length = effect.length * dot(&column, &column).sqrt();
            (length > 0.0).then(|| ((effect.hypothesis, effect.values[1].clone()), length))
        };
        self.effects.par_iter().filter_map(one).collect()
    }

    /// What each hypothesis promises of the residual of a fit, most promising first. The fit is of the base, or of more than it.
    pub fn look(&self, fit: &Fit, wanted: &(dyn Fn(usize) -> bool + Sync)) -> Vec<Promise> {
        let projector = Projector::new(&fit.jacobian, self.stride);
        let mut left: Vec<f64> = fit.residuals.iter().step_by(self.stride).copied().collect();
        let total = dot(&left, &left);
        projector.apply(&mut left);
        let mut promises: Vec<Promise> = self
            .effects
            .par_iter()
            .filter(|e| wanted(e.hypothesis))
            .filter_map(|effect| {
                let [full, weak] = &effect.columns;
                let projected = |column: &Option<Vec<f64>>| {
                    column.clone().map(|mut c| {
                        projector.apply(&mut c);
                        c
                    })
                };
                let (full, weak) = (projected(full), projected(weak));
                let share_of = |column: &Option<Vec<f64>>| column.as_ref().map_or(0.0, |c| share(&[c], &left, total));
                // A fit starts where the effect looks most like the residual.
                let values = effect.values[usize::from(share_of(&weak) > share_of(&full))].clone();
                let columns: Vec<Vec<f64>> = [full, weak].into_iter().flatten().collect();
                let share = share(&columns.iter().collect::<Vec<_>>(), &left, total);
                (share > 0.0).then_some(Promise { hypothesis: effect.hypothesis, values, share, columns })
            })
            .collect();
        promises.sort_by(|a, b| b.share.total_cmp(&a.share));
        promises
    }
}

/// A column of length 1 and its length before.
fn measured(column: Vec<f64>) -> Option<(Vec<f64>, f64)> {
    let length = dot(&column, &column).sqrt();
    Some((unit(column)?, length))
}

/// A column of length 1; `None` where there is nothing in it.
fn unit(mut column: Vec<f64>) -> Option<Vec<f64>> {
    let size = dot(&column, &column).sqrt();
    if !(size > 0.0 && size.is_finite()) {
        return None;
    }
    column.iter_mut().for_each(|x| *x /= size);
    Some(column)
}

/// Share of `total` that columns explain of what is left.
fn share(columns: &[&Vec<f64>], left: &[f64], total: f64) -> f64 {
    let n = columns.len();
    if n == 0 || total <= 0.0 {
        return 0.0;
    }
    let size: Vec<f64> = columns.iter().map(|c| dot(c, c).sqrt().max(1e-300)).collect();
    // An effect that the free parameters imitate to a thousandth is not there to be seen.
    if size.iter().all(|s| *s < tuning().screening.imitated) {
        return 0.0;
    }
    let gram = DMatrix::from_fn(n, n, |i, j| {
        dot(columns[i], columns[j]) / (size[i] * size[j]) + if i == j { tuning().screening.ridge } else { 0.0 }
    });
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
    let stride = fit.residuals.len().div_ceil(tuning().screening.residuals).max(1);
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
    let right: Vec<f64> =
        columns.iter().zip(&size).map(|(c, s)| if *s < tuning().screening.imitated { 0.0 } else { dot(c, &left) / s }).collect();
    let mut found = Vec::new();
    for a in &firsts {
        for b in firsts.iter().filter(|b| *b > a) {
            if !compatible(promises[*a].hypothesis, promises[*b].hypothesis) {
                continue;
            }
            let own: Vec<usize> = (0..columns.len()).filter(|c| owner[*c] == *a || owner[*c] == *b).collect();
            let n = own.len();
            let at = |i: usize, j: usize| if i >= j { gram[i][j] } else { gram[j][i] };
            let matrix = DMatrix::from_fn(n, n, |i, j| at(own[i], own[j]) + if i == j { tuning().screening.pair_ridge } else { 0.0 });
            let vector = DVector::from_iterator(n, own.iter().map(|c| right[*c]));
            if let Some(factor) = matrix.cholesky() {
                found.push((*a, *b, (vector.dot(&factor.solve(&vector)) / total).clamp(0.0, 1.0)));
            }
        }
    }
    found.sort_by(|a, b| b.2.total_cmp(&a.2));
    found
}
