//! Which hypotheses could explain what a fit leaves over: their effects, as residuals see them, held against it.

use crate::fit::{Evaluator, Fit, dot};
use crate::hypothesis::Hypothesis;
use crate::structure::Structure;
use crate::tuning::tuning;
use crate::work::Steps;
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

/// What each hypothesis does to the residuals of a base, so that it can be held against what any later fit leaves over: along the
/// measured path its effect hardly depends on what else is in the model.
pub struct Screen {
    stride: usize,
    effects: Vec<Effect>,
}

/// A start of a hypothesis and its effect in full and weakened, of length 1.
struct Effect {
    hypothesis: usize,
    values: [Vec<f64>; 2],
    columns: [Option<Vec<f64>>; 2],
    /// Length of the weakened effect before it was brought to 1, floors.
    length: f64,
}

impl Screen {
    /// Simulates every hypothesis beside a base: all starts on the two recordings that are explained worst, the best ones on all.
    /// With about so much work: where that is little, fewer starts of each are tried.
    pub fn new(evaluator: &Evaluator, base: &Structure, fit: &Fit, hypotheses: &[Hypothesis], work: Steps) -> Screen {
        let stride = fit.residuals.len().div_ceil(tuning().screening.residuals).max(1);
        let problem = evaluator.problem;
        let (stated, added, own) = (base.stated_of(problem, &fit.values), base.added_of(&fit.values), base.of_records(&fit.values));
        // What a simulation of a recording takes, by a sample of the hypotheses: nonlinear ones are slower than a linear base.
        let before = evaluator.budget.spent();
        let sample: Vec<&Hypothesis> = hypotheses.iter().step_by((hypotheses.len() / 8).max(1)).collect();
        sample.par_iter().for_each(|h| {
            let structure = Structure::new(problem, evaluator.records, [base.added.clone(), vec![(*h).clone()]].concat());
            let values =
                structure.values(problem, &stated, &[added.clone(), h.starts.first().cloned().into_iter().collect()].concat(), &own);
            if let Some(model) = structure.model(problem, &values) {
                let _ = evaluator.record_residuals(&structure, &model, &values, 0);
            }
        });
        let each = (evaluator.budget.spent() - before) / sample.len().max(1) as Steps;
        // Half of the work for either pass.
        let affordable = (work / each.max(1)) as usize / 2;
        let mut few = worst_records(evaluator, &fit.residuals, 2);
        let starts: usize = hypotheses.iter().map(|h| h.starts.len()).sum();
        if 2 * starts > affordable {
            few = worst_records(evaluator, &fit.residuals, 1);
        }
        let depth = (affordable / (few.len() * hypotheses.len().max(1))).max(1);
        let mut jobs: Vec<(usize, &Vec<f64>)> = hypotheses
            .iter()
            .enumerate()
            .filter(|(_, h)| base.added.iter().all(|b| b.compatible(h)))
            .flat_map(|(index, h)| h.starts.iter().take(depth).map(move |start| (index, start)))
            .collect();
        // First starts first: where simulations are slower than the sample, the last ones are left out.
        let rank = |(index, start): &(usize, &Vec<f64>)| hypotheses[*index].starts.iter().position(|s| std::ptr::eq(s, *start));
        jobs.sort_by_key(rank);
        let most = (affordable / (2 * evaluator.records.len()).max(1)).clamp(tuning().screening.fewest_starts, tuning().screening.starts);
        let with = |index: usize| {
            let mut with = base.added.clone();
            with.push(hypotheses[index].clone());
            Structure::new(problem, evaluator.records, with)
        };
        if evaluator.records.len() > few.len()
            && problem.initial == backdrive_plant::set::Initial::Rest
            && problem.unknown.is_empty()
            && jobs.len() > most
        {
            let layout = evaluator.layout();
            let kept: Vec<usize> = layout.iter().filter(|l| few.contains(&l.0)).flat_map(|l| l.2.clone()).step_by(stride).collect();
            let pick = |all: &[f64]| kept.iter().filter_map(|i| all.get(*i).copied()).collect::<Vec<f64>>();
            let small = Projector::of(fit.jacobian.iter().map(|c| pick(c)).collect());
            let before = pick(&fit.residuals);
            let mut left = before.clone();
            small.apply(&mut left);
            let total = dot(&left, &left);
            let first_pass = evaluator.budget.next((work as f64 * tuning().screening.first_pass) as Steps);
            let scored = first_pass.abreast(&jobs, |budget, (index, start)| {
                let evaluator = evaluator.within(budget.clone());
                let structure = with(*index);
                let values = structure.values(problem, &stated, &[added.clone(), vec![start.to_vec()]].concat(), &own);
                let model = structure.model(problem, &values)?;
                let parts: Option<Vec<Vec<f64>>> =
                    few.iter().map(|r| evaluator.record_residuals(&structure, &model, &values, *r)).collect();
                let mut column = unit(parts?.concat().into_iter().step_by(stride).zip(&before).map(|(a, b)| a - b).collect())?;
                small.apply(&mut column);
                Some((share(&[&column], &left, total), (*index, *start)))
            });
            let mut scores: Vec<(f64, (usize, &Vec<f64>))> = scored.into_iter().flatten().flatten().collect();
            scores.sort_by(|a, b| b.0.total_cmp(&a.0));
            let mut seen = vec![0; hypotheses.len()];
            scores.retain(|s| {
                seen[s.1.0] += 1;
                seen[s.1.0] <= 2
            });
            // One start of each at least: what does little beside the base may do much beside something else.
            let mut first = std::collections::HashSet::new();
            let (firsts, seconds): (Vec<_>, Vec<_>) = scores.into_iter().map(|s| s.1).partition(|job| first.insert(job.0));
            let room = most.saturating_sub(firsts.len());
            jobs = firsts.into_iter().take(most).chain(seconds.into_iter().take(room)).collect();
        }
        let second_pass = evaluator.budget.next(work);
        let effects = second_pass.abreast(&jobs, |budget, (index, start)| {
            let evaluator = evaluator.within(budget.clone());
            let structure = with(*index);
            let effect = |values: &Vec<f64>| -> Option<(Vec<f64>, f64)> {
                let all = [added.clone(), vec![values.clone()]].concat();
                let residuals = evaluator.residuals(&structure, &structure.values(problem, &stated, &all, &own))?;
                measured(residuals.iter().step_by(stride).zip(fit.residuals.iter().step_by(stride)).map(|(a, b)| a - b).collect())
            };
            let values = [start.to_vec(), weakened(&hypotheses[*index], start)];
            let (full, weak) = (effect(&values[0]), effect(&values[1]));
            // Every so manieth residual was kept.
            let length = weak.as_ref().map_or(0.0, |w| w.1 * (stride as f64).sqrt());
            Effect { hypothesis: *index, values, columns: [full.map(|e| e.0), weak.map(|e| e.0)], length }
        });
        Screen { stride, effects: effects.into_iter().flatten().collect() }
    }

    /// For each start (hypothesis, values of the weakened effect) the length of what its effect adds beyond all that the fit's numbers can do, floors.
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

    /// What each hypothesis promises of what a fit leaves over, most promising first. The fit is of the base, or of more than it.
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
                // A fit starts where the effect looks most like what is left over.
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
    // An effect that the free numbers imitate to a thousandth is not there to be seen.
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
