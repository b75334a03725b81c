//! Derivatives of the residuals by the parameters of a fit, in parallel. They are integrated along with the motion (forward mode) where a parameter is one
//! of a nonlinear model's bodies or elements, else computed by differences of simulations.

use crate::output_error::evaluator::{Evaluator, residuals_in};
use crate::output_error::structure::{FreeParameter, Role, Structure};
use crate::tuning::tuning;
use backdrive_plant::elements;
use backdrive_plant::model::Model;
use backdrive_plant::stepper::LANES;
use nalgebra::DMatrix;
use rayon::prelude::*;
use std::collections::BTreeMap;
use std::ops::Range;

/// Weights of an unknown input that are moved at the same time: which unknown input, which record, and the remainder of their number divided by
/// `fit.knots_apart`.
type Set = (usize, usize, usize);

/// Weights that are moved together, and which of the parameters they are.
type Together = (Set, Vec<usize>);

/// Parameters that are carried along together: which columns they are, and the models a step further.
type Group<'g> = (&'g [usize], &'g [(Model, f64)]);

/// A parameter moved: all values as they stand in the model, the model, and the difference taken in the fit's own unit.
type Moved = (Vec<f64>, Model, f64);

impl Evaluator<'_> {
    /// Derivatives of the residuals by each parameter in the fit's own unit.
    pub fn jacobian(&self, structure: &Structure, own: &[f64], residuals: &[f64]) -> Vec<Vec<f64>> {
        self.columns(structure, own, residuals, &(0..own.len()).collect::<Vec<_>>(), 1.0)
    }

    /// The same by some of the parameters, with `stretch` times their differences.
    pub(crate) fn columns(&self, structure: &Structure, own: &[f64], residuals: &[f64], which: &[usize], stretch: f64) -> Vec<Vec<f64>> {
        let spans = self.spans();
        let mut jobs: Vec<(usize, usize)> = Vec::new();
        // Weights of unknown inputs that are far from each other are moved at the same time.
        let mut together: BTreeMap<Set, Vec<usize>> = BTreeMap::new();
        for (at, j) in which.iter().enumerate() {
            match (&structure.free[*j].role, &structure.free[*j].records) {
                (Role::Knot(unknown, knot, r), _) => together.entry((*unknown, *r, knot % tuning().fit.knots_apart)).or_default().push(at),
                (_, Some(of)) => jobs.extend(of.iter().map(|r| (at, *r))),
                (_, None) => jobs.extend((0..self.records.len()).map(|r| (at, r))),
            }
        }
        let moved: Vec<Option<Moved>> = which.iter().map(|j| self.moved(structure, own, *j, stretch)).collect();
        let difference = |(j, r): &(usize, usize)| {
            if self.budget.is_halted() {
                return None;
            }
            let (values, model, step) = moved.get(*j)?.as_ref()?;
            let mut part = self.record_residuals(structure, model, values, *r)?;
            let before = residuals.get(spans[*r].clone())?;
            part.iter_mut().zip(before).for_each(|(a, b)| *a = (*a - b) / step);
            Some(part)
        };
        let parts: Vec<Option<Vec<f64>>> = jobs.par_iter().map(difference).collect();
        let mut jacobian = vec![vec![0.0; residuals.len()]; which.len()];
        for ((j, r), part) in jobs.iter().zip(parts) {
            if let Some(part) = part {
                jacobian[*j][spans[*r].clone()].copy_from_slice(&part);
            }
        }
        let together: Vec<Together> = together.into_iter().collect();
        let parts = self.knots(structure, own, residuals, which, (&together, &spans), stretch);
        for (((_, r, _), ats), columns) in together.iter().zip(parts) {
            for (at, column) in ats.iter().zip(columns.unwrap_or_default()) {
                jacobian[*at][spans[*r].clone()].copy_from_slice(&column);
            }
        }
        jacobian
    }

    /// The same by the quickest way that there is: carried along with the motion where that can be done and narrow differences do not mislead.
    pub(crate) fn derivatives(
        &self,
        structure: &Structure,
        own: &[f64],
        residuals: &[f64],
        which: &[usize],
        stretch: f64,
    ) -> Vec<Vec<f64>> {
        let mut found = if stretch == 1.0 { self.carried(structure, own, residuals.len(), which) } else { vec![None; which.len()] };
        let missing: Vec<usize> = which.iter().zip(&found).filter(|(_, column)| column.is_none()).map(|(j, _)| *j).collect();
        let columns = self.columns(structure, own, residuals, &missing, stretch);
        found.iter_mut().filter(|column| column.is_none()).zip(columns).for_each(|(place, column)| *place = Some(column));
        found.into_iter().flatten().collect()
    }

    /// Derivatives that are integrated along with the motion, in no more substeps than a descent direction needs. `None` for parameters that belong to an
    /// input, an output or a single record. `None` for all parameters where the model is linear, and where it cannot be simulated.
    fn carried(&self, structure: &Structure, own: &[f64], residuals: usize, which: &[usize]) -> Vec<Option<Vec<f64>>> {
        let mut found = vec![None; which.len()];
        let values = to_external(structure, own);
        let Some(model) = structure.model(self.problem, &values) else { return found };
        if model.elements.iter().all(|e| matches!(e.law.role(), elements::Role::Linear(_))) || self.budget.is_halted() {
            return found;
        }
        let mut lanes: Vec<(usize, (Model, f64))> = Vec::new();
        for (at, j) in which.iter().enumerate() {
            let number = &structure.free[*j];
            if number.coarse || !matches!(number.role, Role::Stated(_) | Role::Added(..)) {
                continue;
            }
            let (moved, step) = moved_values(structure, own, *j, tuning().fit.carried);
            if let Some(moved) = structure.model(self.problem, &moved).filter(|m| m.inputs == model.inputs && m.outputs == model.outputs) {
                lanes.push((at, (moved, step)));
            }
        }
        if lanes.is_empty() {
            return found;
        }
        // Groups of equal size.
        let size = lanes.len().div_ceil(lanes.len().div_ceil(LANES));
        let (places, lanes): (Vec<usize>, Vec<(Model, f64)>) = lanes.into_iter().unzip();
        let groups: Vec<Group> = places.chunks(size).zip(lanes.chunks(size)).collect();
        let spans = self.spans();
        let jobs: Vec<(usize, usize)> = (0..self.records.len()).flat_map(|r| (0..groups.len()).map(move |g| (r, g))).collect();
        let few = self.substeps.min(self.problem.middle_substeps().max(tuning().fit.carried_substeps));
        let coarser = Evaluator { substeps: few, ..self.clone() };
        let one = |(r, g): &(usize, usize)| coarser.record_derivatives(structure, (&model, groups[*g].1), &values, *r);
        let parts: Vec<Option<Vec<Vec<f64>>>> = jobs.par_iter().map(one).collect();
        for (g, (places, _)) in groups.iter().enumerate() {
            let mine = || jobs.iter().zip(&parts).filter(move |((_, of), _)| *of == g);
            if mine().any(|(_, part)| part.is_none()) {
                continue;
            }
            for (lane, at) in places.iter().enumerate() {
                let mut column = vec![0.0; residuals];
                for ((r, _), part) in mine() {
                    if let Some(derivatives) = part.as_ref().and_then(|part| part.get(lane)) {
                        column[spans[*r].clone()].copy_from_slice(derivatives);
                    }
                }
                found[*at] = Some(column);
            }
        }
        found
    }

    /// Where the residuals of each record stand, all outputs together.
    fn spans(&self) -> Vec<Range<usize>> {
        let next = |at: &mut usize, record| {
            let from = *at;
            *at += residuals_in(record);
            Some(from..*at)
        };
        self.records.iter().scan(0, next).collect()
    }

    /// One parameter moved; `None` for a weight of an unknown input, which are moved together, and where no model can be made.
    fn moved(&self, structure: &Structure, own: &[f64], j: usize, stretch: f64) -> Option<Moved> {
        if matches!(structure.free[j].role, Role::Knot(..)) {
            return None;
        }
        let (values, step) = moved_values(structure, own, j, stretch);
        Some((values.clone(), structure.model(self.problem, &values)?, step))
    }

    /// Derivatives by the weights of unknown inputs (Curtis, Powell & Reid 1974). The effect of a weight is over when the next one that is moved with it
    /// begins, except for what the device never forgets.
    fn knots(
        &self,
        structure: &Structure,
        own: &[f64],
        residuals: &[f64],
        which: &[usize],
        (together, spans): (&[Together], &[Range<usize>]),
        stretch: f64,
    ) -> Vec<Option<Vec<Vec<f64>>>> {
        let Some(model) = structure.model(self.problem, &to_external(structure, own)).filter(|_| !together.is_empty()) else {
            return Vec::new();
        };
        let one = |((unknown, r, _), ats): &Together| {
            if self.budget.is_halted() {
                return None;
            }
            let (mut values, mut steps) = (to_external(structure, own), Vec::new());
            for at in ats.iter() {
                let (changed, step) = moved_values(structure, own, which[*at], stretch);
                values[which[*at]] = changed[which[*at]];
                steps.push(step);
            }
            let part = self.record_residuals(structure, &model, &values, *r)?;
            let record = self.records.get(*r)?;
            let before = residuals.get(spans[*r].clone())?;
            let mut columns = vec![vec![0.0; part.len()]; ats.len()];
            for ((at, step), column) in ats.iter().zip(&steps).zip(&mut columns) {
                let Role::Knot(_, knot, _) = structure.free[which[*at]].role else { continue };
                let window = self.problem.unknown.get(*unknown)?.window(knot, tuning().fit.knots_apart, record);
                for from in (0..part.len()).step_by(record.len.max(1)) {
                    for i in window.start + from..window.end + from {
                        column[i] = (part[i] - before[i]) / step;
                    }
                }
            }
            Some(columns)
        };
        together.par_iter().map(one).collect()
    }

    /// Whether a parameter moves in this fit.
    pub(crate) fn moves(&self, number: &FreeParameter) -> bool {
        number.records.is_some() || !self.own_only && self.only.as_ref().is_none_or(|only| only.contains(&number.role))
    }

    /// Derivatives by all parameters, 0 by those that do not move.
    pub(crate) fn all_columns(
        &self,
        structure: &Structure,
        own: &[f64],
        residuals: &[f64],
        which: &[usize],
        stretch: f64,
    ) -> Vec<Vec<f64>> {
        let mut all = vec![Vec::new(); own.len()];
        for (j, column) in which.iter().zip(self.derivatives(structure, own, residuals, which, stretch)) {
            all[*j] = column;
        }
        all.iter_mut().filter(|c| c.is_empty()).for_each(|c| c.resize(residuals.len(), 0.0));
        all
    }
}

/// The values in the model of a fit's own.
pub(crate) fn to_external(structure: &Structure, own: &[f64]) -> Vec<f64> {
    structure.free.iter().zip(own).map(|(n, x)| n.to_external(*x)).collect()
}

/// Values with one parameter moved by its difference, away from a bound, and the difference taken in the fit's own unit.
fn moved_values(structure: &Structure, own: &[f64], j: usize, stretch: f64) -> (Vec<f64>, f64) {
    let number = &structure.free[j];
    let (low, high) = number.bounds();
    // What already spans a sample has no need of more.
    let longer = if number.coarse { stretch.clamp(-1.0, 2.0) } else { stretch };
    let mut step = (number.step * longer).clamp(-0.5 * (high - low), 0.5 * (high - low));
    if own[j] + step > high || own[j] + step < low {
        step = -step;
    }
    let moved = (own[j] + step).clamp(low, high);
    let values = structure.free.iter().enumerate().map(|(i, n)| n.to_external(if i == j { moved } else { own[i] })).collect();
    let taken = moved - own[j];
    (values, if taken == 0.0 { 1.0 } else { taken })
}

/// Updates derivatives by the secant of a step (Broyden 1965): the smallest change, with each parameter scaled by its curvature, that makes them agree
/// with what the step did.
pub(crate) fn secant(jacobian: &mut [Vec<f64>], before: &[f64], after: &[f64], from: &[f64], to: &[f64], matrix: &DMatrix<f64>) {
    let step: Vec<f64> = to.iter().zip(from).map(|(a, b)| a - b).collect();
    let scaled: Vec<f64> = step.iter().enumerate().map(|(j, s)| s * matrix[(j, j)]).collect();
    let size: f64 = step.iter().zip(&scaled).map(|(a, b)| a * b).sum();
    if !(size > 0.0 && size.is_finite()) {
        return;
    }
    let mut missed: Vec<f64> = after.iter().zip(before).map(|(a, b)| a - b).collect();
    for (column, s) in jacobian.iter().zip(&step).filter(|(_, s)| **s != 0.0) {
        missed.iter_mut().zip(column).for_each(|(m, c)| *m -= c * s);
    }
    for (column, s) in jacobian.iter_mut().zip(&scaled).filter(|(_, s)| **s != 0.0) {
        column.iter_mut().zip(&missed).for_each(|(c, m)| *c += m * s / size);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::output_error::fit::dot;
    use crate::recordings::problem::{Problem, Record};
    use backdrive_plant::recording::Recording;
    use backdrive_plant::set::Initial;

    /// A cart on a spring with grease and dry friction, whose sensor may be late.
    const CART: &str = "name = 'cart'\n[bodies]\ncart = 2.0\n[[elements]]\nname = 'spring'\nkind = 'spring'\nbetween = ['cart', 'ground']\nstiffness = 800.0\n\
                        [[elements]]\nname = 'grease'\nkind = 'damper'\nbetween = ['cart', 'ground']\ndamping = 8.0\n\
                        [[elements]]\nname = 'rub'\nkind = 'coulomb'\nbetween = ['cart', 'ground']\nforce = 3.0\n\
                        [[inputs]]\nname = 'f'\nkind = 'force'\non = 'cart'\nhold = 'linear'\n\
                        [[outputs]]\nname = 'x'\nkind = 'position'\nof = 'cart'\n";

    fn problem(text: &str) -> Problem {
        let model = Model::from_toml(text, "cart.toml").unwrap();
        let record = |frequency: f64| {
            let t: Vec<f64> = (0..1500).map(|i| 1e-3 * f64::from(i)).collect();
            let force: Vec<f64> = t.iter().map(|t| 20.0 * (frequency * t).sin() + 6.0 * (2.7 * frequency * t).sin()).collect();
            let signals = vec![("f".to_string(), force.clone()), ("x".to_string(), force.iter().map(|f| f / 900.0).collect())];
            Record::new(&Recording::new("r", t, signals).unwrap(), &model, Vec::new()).unwrap()
        };
        Problem::new(text.to_string(), "cart.toml".into(), model.clone(), vec![record(11.0), record(29.0)], Vec::new(), Initial::Rest)
            .unwrap()
    }

    /// By each parameter: carried along, where it can be, and differenced.
    type Both = (Structure, Vec<Option<Vec<f64>>>, Vec<Vec<f64>>);

    fn derivatives(problem: &Problem) -> Both {
        let structure = Structure::new(problem, &problem.fit, Vec::new());
        let values = structure.values(problem, &[], &[], &[]);
        let own: Vec<f64> = structure.free.iter().zip(&values).map(|(n, v)| n.to_internal(*v)).collect();
        let evaluator = Evaluator::new(problem);
        let residuals = evaluator.residuals(&structure, &values).unwrap();
        let which: Vec<usize> = (0..own.len()).collect();
        let carried = evaluator.carried(&structure, &own, residuals.len(), &which);
        (structure.clone(), carried, evaluator.columns(&structure, &own, &residuals, &which, 0.1))
    }

    #[test]
    fn what_is_carried_along_is_what_differences_find() {
        let (structure, carried, differences) = derivatives(&problem(CART));
        assert!(structure.free.len() >= 4);
        for ((number, carried), difference) in structure.free.iter().zip(&carried).zip(&differences) {
            let carried = carried.as_ref().expect("a number of the mechanism");
            let apart: Vec<f64> = carried.iter().zip(difference).map(|(a, b)| a - b).collect();
            assert!(dot(&apart, &apart) < 1e-4 * dot(difference, difference), "{:?}", number.role);
        }
    }

    #[test]
    fn sensors_and_linear_models_are_differenced() {
        let late = CART.replace("kind = 'position'\nof = 'cart'\n", "kind = 'position'\nof = 'cart'\ngain = 1.1\n");
        let (structure, carried, _) = derivatives(&problem(&late));
        let of_sensor = |p: &Problem, n: &FreeParameter| matches!(n.role, Role::Stated(i) if p.stated[i].path.starts_with("outputs."));
        let p = problem(&late);
        for (number, carried) in structure.free.iter().zip(&carried) {
            assert_eq!(carried.is_none(), of_sensor(&p, number), "{:?}", number.role);
        }
        let linear = CART.replace("kind = 'coulomb'", "kind = 'bias'");
        assert!(derivatives(&problem(&linear)).1.iter().all(Option::is_none));
    }
}
