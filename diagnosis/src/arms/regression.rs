//! The regression of the measured torque: rows, columns, weights, and a structure fitted to them.

use crate::arms::error::ArmError;
use crate::arms::fit::{Fit, Structure, TOLERANCES, Weights};
use crate::arms::inertial::{COUNT, Parameters};
use crate::arms::layout::{Block, Layout, blocks};
use crate::arms::motion::{Motion, Rates};
use crate::arms::physics::{At, AtJoints, Physics, Sight, Term};
use crate::arms::problem::Problem;
use crate::arms::rigid::{Signals, across, difference, regressor, torques, tree_of};
use crate::arms::soft::inertia;
use crate::arms::stated::Unused;
use crate::arms::system::{Column, System, scaled_solve};
use crate::arms::usable::{Clipped, clipped, leave_out, unsigned};
use backdrive_plant::elements::Law;
use backdrive_plant::robot::Tree;
use nalgebra::{DMatrix, DVector, Vector3};
use std::cell::RefCell;
use std::collections::HashMap;
use std::ops::Range;
use std::rc::Rc;

/// Step of a numerical derivative by a joint's zero, rad or m.
const STEP: f64 = 1e-4;
/// The same for a second derivative.
const WIDE: f64 = 1e-2;

/// Rows of the regression and everything that its columns are made of.
pub struct Data<'a> {
    /// The arm and its logs.
    pub problem: &'a Problem,
    /// Corners and rates.
    pub rates: Rates,
    /// Logs for fitting, then held-out ones.
    pub motions: Vec<Motion>,
    /// How many are for fitting.
    pub fit_count: usize,
    /// Where rows are.
    pub layout: Layout,
    /// Measured torque.
    pub torque: Vec<f64>,
    /// What the file's inertial parameters take of it.
    pub nominal: Vec<f64>,
    /// Torque per size of each inertial parameter.
    pub inertial: Vec<Vec<f64>>,
    /// Stretches of all logs.
    pub blocks: Vec<Block>,
    /// Inertial parameters with which all but the regressor was computed.
    pub seen: Vec<Parameters>,
    trees: Vec<Tree>,
    pub(crate) load: Vec<Signals>,
    pub(crate) inertia: Vec<Signals>,
    by_position: Vec<Vec<Signals>>,
    curved: Vec<Vec<Signals>>,
    pub(crate) by_tilt: Vec<Vec<Signals>>,
    by_payload: Vec<Vec<Signals>>,
    cache: RefCell<HashMap<String, Vec<Column>>>,
    /// Whether rows count where a joint rests.
    whole: bool,
    /// Torque that stands at a limit, whose samples are left out.
    pub clipped: Vec<Clipped>,
    /// By joint: whether its torque was logged without its sign, so that nothing is claimed there.
    pub unsigned: Vec<bool>,
    /// Elements of the nominal model whose torque is not taken into account.
    pub unused: Vec<Unused>,
    /// By joint: what its torque is compared with, N m or N: the rms of that of the logs; of a joint without a motor of gravity's or of its inertia's.
    pub(crate) passive: Vec<Option<f64>>,
    /// Of each joint without a motor: how the size of its equation follows the inertial parameters.
    pub(crate) size: Vec<Option<DVector<f64>>>,
    /// The highest of [`TOLERANCES`] that the bodies may have.
    pub(crate) most_tolerance: usize,
}

impl<'a> Data<'a> {
    /// Lays the logs out. `corner`: of the filter, Hz, where the motion shall not say it. `whole`: rows count where a joint rests, too.
    ///
    /// # Errors
    /// Where the robot cannot be computed, or the logs are too short.
    pub fn new(problem: &'a Problem, corner: Option<f64>, whole: bool) -> Result<Data<'a>, ArmError> {
        let logs: Vec<_> = problem.fit.iter().chain(&problem.held_out).collect();
        let rates = Rates::of(&logs, corner);
        let mut motions: Vec<Motion> = logs.iter().map(|log| Motion::of(log, &rates)).collect();
        let joints = problem.joints.len();
        let clipped = clipped(&logs, joints);
        for (index, (motion, log)) in motions.iter_mut().zip(&logs).enumerate() {
            let here: Vec<&Clipped> = clipped.iter().filter(|limit| limit.log == index).collect();
            leave_out(motion, log, &here, &rates);
        }
        let mut layout = Layout::new(joints);
        for (motion, log) in motions.iter().zip(&logs) {
            let count = rates.rows(&vec![0.0; motion.len()]).len();
            if count < 12 {
                let seconds = motion.len() as f64 * rates.period();
                let message =
                    format!("is {seconds:.2} s long, too short for a regression below {:.1} Hz; record some seconds more", rates.corner);
                return Err(ArmError::Log { log: log.name.clone(), message });
            }
            layout.push(count);
        }
        let fit_count = problem.fit.len();
        let blocks = blocks(&layout, fit_count, rates.row_period());
        let mut data = Data {
            problem,
            rates,
            motions,
            fit_count,
            torque: vec![0.0; layout.rows],
            nominal: vec![0.0; layout.rows],
            inertial: Vec::new(),
            layout,
            blocks,
            seen: Vec::new(),
            trees: Vec::new(),
            load: Vec::new(),
            inertia: Vec::new(),
            by_position: Vec::new(),
            curved: Vec::new(),
            by_tilt: Vec::new(),
            by_payload: Vec::new(),
            cache: RefCell::new(HashMap::new()),
            whole,
            clipped,
            unsigned: vec![false; joints],
            unused: problem.unused.clone(),
            passive: vec![None; joints],
            size: vec![None; joints],
            most_tolerance: TOLERANCES.len() - 1,
        };
        data.torque = data.column(|m| data.motions[m].torque.iter().cloned().enumerate().collect());
        let mut by_parameter = Vec::new();
        for motion in &data.motions {
            by_parameter.push(regressor(&problem.robot, &problem.bodies, motion, &[])?);
        }
        for (k, basis) in problem.bodies.basis.iter().enumerate() {
            let of_body: Vec<Vec<f64>> =
                (0..COUNT).map(|i| data.column(|m| by_parameter[m][k * COUNT + i].iter().cloned().enumerate().collect())).collect();
            let along = |direction: usize, row: usize| of_body.iter().enumerate().map(|(i, c)| c[row] * basis[(i, direction)]).sum();
            data.inertial.extend((0..COUNT).map(|b| (0..data.layout.rows).map(|row| along(b, row)).collect::<Vec<f64>>()));
        }
        data.by_payload = by_parameter.into_iter().map(|mut p| p.split_off(p.len() - COUNT)).collect();
        data.see(&problem.bodies.nominal)?;
        let (along, unused) = data.stated();
        data.unused.extend(unused);
        let all = |m: usize| data.load[m].iter().cloned().enumerate().chain(along[m].iter().cloned()).collect();
        data.nominal = data.column(all);
        data.unsigned = unsigned(&logs, &data.motions, &data.load, joints);
        data.passive = (0..joints).map(|j| problem.is_passive(j).then(|| data.passive_scale(j))).collect();
        data.size = (0..joints).map(|j| data.passive[j].and_then(|_| data.size_of(j))).collect();
        Ok(data)
    }

    /// Computes what columns are made of with these inertial parameters.
    ///
    /// # Errors
    /// Where the robot cannot be computed with them.
    pub fn see(&mut self, parameters: &[Parameters]) -> Result<(), ArmError> {
        let bare = self.problem.bodies.applied(&self.problem.robot, parameters);
        let joints = self.problem.joints.len();
        for of_motion in [&mut self.load, &mut self.inertia] {
            of_motion.clear();
        }
        for of_motion in [&mut self.by_position, &mut self.curved, &mut self.by_tilt] {
            of_motion.clear();
        }
        self.trees.clear();
        self.seen = parameters.to_vec();
        for motion in &self.motions {
            let robot = match &motion.payload {
                Some((link, payload)) => bare.with_mass_at(*link, payload.mass, payload.at),
                None => bare.clone(),
            };
            let with_gravity = |change: Vector3<f64>| {
                let mut other = robot.clone();
                other.gravity += change;
                tree_of(&other)
            };
            let (tree, weightless) = (tree_of(&robot)?, with_gravity(-robot.gravity)?);
            let load = torques(&tree, motion, &[]);
            let moved = |j: usize, step: f64| {
                let mut offsets = vec![0.0; joints];
                offsets[j] = -step;
                torques(&tree, motion, &offsets)
            };
            self.by_position.push((0..joints).map(|j| difference(&moved(j, STEP), &moved(j, -STEP), 0.5 / STEP)).collect());
            let curve = |j| {
                let half = |a: &Signals| difference(a, &load, 1.0 / (WIDE * WIDE));
                let sum = |(a, b): (Vec<f64>, Vec<f64>)| a.iter().zip(&b).map(|(x, y)| x + y).collect();
                half(&moved(j, WIDE)).into_iter().zip(half(&moved(j, -WIDE))).map(sum).collect()
            };
            self.curved.push((0..joints).map(curve).collect());
            let mut by_tilt = Vec::new();
            for direction in across(&robot.gravity) {
                by_tilt.push(difference(&torques(&with_gravity(direction * robot.gravity.norm())?, motion, &[]), &load, 1.0));
            }
            by_tilt.push(difference(&load, &torques(&weightless, motion, &[]), 1.0));
            self.by_tilt.push(by_tilt);
            self.inertia.push(inertia(&tree, motion));
            self.load.push(load);
            self.trees.push(tree);
        }
        self.cache.borrow_mut().clear();
        Ok(())
    }

    /// One column over all rows, from signals at joints of each motion.
    ///
    /// Where a joint rests, torque and columns are 0 alike.
    fn column(&self, signals: impl Fn(usize) -> Vec<(usize, Vec<f64>)>) -> Vec<f64> {
        let mut out = vec![0.0; self.layout.rows];
        for m in 0..self.motions.len() {
            for (joint, mut signal) in signals(m) {
                signal.iter_mut().zip(&self.motions[m].counts[joint]).for_each(|(x, counts)| *x *= counts);
                if !self.whole {
                    signal.iter_mut().zip(&self.motions[m].moves[joint]).for_each(|(x, moves)| *x *= moves);
                }
                let rows = self.rates.rows(&signal);
                for (place, value) in out[self.layout.of(m, joint)].iter_mut().zip(rows) {
                    *place += value;
                }
            }
        }
        out
    }

    /// Columns of a term, one for each of its linear numbers.
    pub fn columns(&self, term: &Term, slip: &[f64]) -> Vec<Column> {
        let at_slip: Vec<f64> = match term.at {
            At::Joint(j) => vec![slip[j]],
            At::Pair(j, k) => vec![slip[j], slip[k]],
            At::Base => Vec::new(),
        };
        let key = format!("{:?} {:?} {:?} {at_slip:?}", term.physics, term.at, term.shape);
        if let Some(found) = self.cache.borrow().get(&key) {
            return found.clone();
        }
        let parts: Vec<Vec<AtJoints>> = (0..self.motions.len()).map(|m| self.sight(m, slip).columns(term)).collect();
        let count = parts.first().map_or(0, Vec::len);
        let columns: Vec<Column> = (0..count).map(|c| Rc::new(self.column(|m| parts[m][c].clone()))).collect();
        self.cache.borrow_mut().insert(key, columns.clone());
        columns
    }

    /// What columns of a motion are made of.
    pub(crate) fn sight<'s>(&'s self, m: usize, slip: &'s [f64]) -> Sight<'s> {
        Sight {
            problem: self.problem,
            motion: &self.motions[m],
            rates: &self.rates,
            tree: &self.trees[m],
            load: &self.load[m],
            inertia: &self.inertia[m],
            by_position: &self.by_position[m],
            curved: &self.curved[m],
            by_tilt: &self.by_tilt[m],
            by_payload: &self.by_payload[m],
            slip,
        }
    }

    /// What the nominal model has: terms of its elements and armatures, and starting values of the friction's displacement.
    pub fn nominal_structure(&self) -> Structure {
        let problem = self.problem;
        let mut terms = Vec::new();
        let mut add = |physics: Physics, joint: usize, shape: Vec<f64>, given: usize| {
            terms.push(Term { physics, at: At::Joint(joint), shape, given: Some(given) });
        };
        for (joint, armature) in problem.armature.iter().enumerate() {
            if *armature > 0.0 {
                add(Physics::Inertia, joint, Vec::new(), usize::MAX);
            }
        }
        for (index, given) in problem.given.iter().enumerate() {
            for (physics, shape) in parts_of(&given.law) {
                add(physics, given.joint, shape, index);
            }
        }
        let mut unlike: Vec<Term> = Vec::new();
        for term in terms {
            // Two dampers at a joint are one to the regression.
            if !unlike.iter().any(|t| t.is_like(&term) && t.shape == term.shape) {
                unlike.push(term);
            }
        }
        Structure { tolerance: 0, terms: unlike, slip: (0..problem.joints.len()).map(|j| self.first_slip(j)).collect() }
    }

    /// A displacement over which friction turns that the sensor can resolve, rad or m.
    pub fn first_slip(&self, joint: usize) -> f64 {
        let logs = self.problem.fit.iter();
        let wide = crate::arms::physics::range(logs.clone().flat_map(|l| l.position[joint].iter().copied()));
        let step =
            logs.flat_map(|l| l.position[joint].windows(2).map(|w| (w[1] - w[0]).abs())).filter(|d| *d > 0.0).fold(f64::INFINITY, f64::min);
        let resolved = if step.is_finite() { 2.0 * step } else { 0.0 };
        resolved.clamp(2e-4 * wide.max(1e-9), 2e-2 * wide.max(1e-9))
    }
}

/// The terms that an element of the nominal model is to the regression; none where it has no such form.
pub fn parts_of(law: &Law) -> Vec<(Physics, Vec<f64>)> {
    let plain = |physics| (physics, Vec::new());
    match law {
        Law::Damper(_) => vec![plain(Physics::Damper)],
        Law::Coulomb(_) => vec![plain(Physics::Coulomb)],
        Law::Stribeck(s) => vec![plain(Physics::Coulomb), (Physics::Stribeck, vec![s.velocity])],
        Law::LoadFriction(_) => vec![plain(Physics::Coulomb), plain(Physics::LoadFriction)],
        Law::GearLoss(_) => vec![plain(Physics::LoadFriction)],
        Law::AsymmetricCoulomb(_) => vec![plain(Physics::Coulomb), plain(Physics::Bias)],
        Law::AsymmetricDamper(_) => vec![plain(Physics::Damper), plain(Physics::AsymmetricDamper)],
        Law::QuadraticDrag(_) => vec![plain(Physics::QuadraticDrag)],
        Law::Bias(_) => vec![plain(Physics::Bias)],
        Law::Spring(_) => vec![plain(Physics::Spring)],
        Law::Cogging(c) => vec![(Physics::Cogging, vec![c.period])],
        Law::Inerter(_) => vec![plain(Physics::Inertia)],
        Law::Dahl(d) => vec![(Physics::Presliding, vec![d.coulomb / d.stiffness])],
        _ => Vec::new(),
    }
}

impl Data<'_> {
    /// Fits a structure with these weights.
    pub fn fit(&self, structure: &Structure, weights: &Weights) -> Option<Fit> {
        let (columns, places) = self.all_columns(structure);
        let (system, values) = self.settled(&columns, structure, weights)?;
        let of_folds: Vec<Option<DVector<f64>>> = (0..system.folds.len()).map(|f| system.solve(Some(f))).collect();
        let residual = self.residual_with(&columns, values.as_slice());
        let mut unseen = residual.clone();
        for (fold, values) in of_folds.iter().enumerate() {
            let Some(values) = values else { continue };
            let sizes = self.sizes(values.as_slice());
            for block in self.blocks.iter().filter(|block| block.fold == Some(fold)) {
                for (joint, size) in sizes.iter().enumerate() {
                    let first = self.layout.of(block.motion, joint).start;
                    for row in first + block.rows.start..first + block.rows.end {
                        unseen[row] = self.left_of(&columns, values.as_slice(), row) / size;
                    }
                }
            }
        }
        let (errors, numbers, covariance) = system.errors(&values, &of_folds, structure)?;
        let occam = system.occam(&values, self.inertial.len())?;
        let of_folds = of_folds.into_iter().flatten().collect();
        let mut fit = Fit {
            structure: structure.clone(),
            values: values.iter().copied().collect(),
            errors,
            places,
            residual,
            unseen,
            numbers,
            score: 0.0,
            occam,
            covariance,
            of_folds,
        };
        fit.score = self.score(&fit, weights);
        Some(fit)
    }

    /// Residuals of a fit that was made on other rows of the same logs.
    pub fn residual_of(&self, fit: &Fit) -> Vec<f64> {
        let (columns, _) = self.all_columns(&fit.structure);
        self.residual_with(&columns, &fit.values)
    }

    /// Inertial parameters of a fit, by body.
    pub fn parameters(&self, fit: &Fit) -> Vec<Parameters> {
        let bodies = &self.problem.bodies;
        (0..bodies.nominal.len()).map(|k| bodies.changed(k, &fit.values[k * COUNT..(k + 1) * COUNT])).collect()
    }

    pub(crate) fn all_columns(&self, structure: &Structure) -> (Vec<Column>, Vec<Range<usize>>) {
        let mut columns: Vec<Column> = self.inertial.iter().map(|c| Rc::new(c.clone())).collect();
        let mut places = Vec::new();
        for term in &structure.terms {
            let first = columns.len();
            columns.extend(self.columns(term, &structure.slip));
            places.push(first..columns.len());
        }
        (columns, places)
    }

    /// Mean squared residual of a joint over the logs for fitting (or those held out), N² m² or N².
    pub fn mean_square(&self, residual: &[f64], joint: usize, held_out: bool) -> f64 {
        let motions = if held_out { self.fit_count..self.motions.len() } else { 0..self.fit_count };
        let (mut sum, mut count) = (0.0, 0usize);
        for m in motions {
            let rows = self.layout.of(m, joint);
            count += rows.len();
            sum += residual[rows].iter().map(|x| x * x).sum::<f64>();
        }
        sum / count.max(1) as f64
    }

    /// Rows of a joint that count as independent ones.
    fn independent(&self, weights: &Weights, joint: usize) -> f64 {
        let rows: usize = (0..self.fit_count).map(|m| self.layout.count(m)).sum();
        (rows as f64 / weights.time[joint]).max(4.0)
    }

    /// Twice the negative log evidence, except for a constant: `Σ n_j ln(mean square_j)` with independent rows `n_j`. The inertial parameters, whose prior
    /// is known, add the exact Gaussian factor `δᵀ P δ + ln det(H) - ln det(P)`; all other parameters add `ln(Σ n_j)` each (Schwarz 1978).
    fn score(&self, fit: &Fit, weights: &Weights) -> f64 {
        let joints = 0..self.layout.joints;
        let total: f64 = joints.clone().map(|j| self.independent(weights, j)).sum();
        let misfit = |j| self.independent(weights, j) * self.mean_square(&fit.residual, j, false).max(f64::MIN_POSITIVE).ln();
        let shapes = |(t, p): (&Term, &Range<usize>)| if t.given.is_none() { t.physics.facts().numbers.max(p.len()) } else { p.len() };
        let numbers: usize = fit.structure.terms.iter().zip(&fit.places).map(shapes).sum();
        joints.map(misfit).sum::<f64>() + fit.occam + numbers as f64 * total.ln()
    }

    /// Weights from residuals.
    pub fn weights(&self, residual: &[f64]) -> Weights {
        let joints = 0..self.layout.joints;
        let floor = |j: usize| 1e-9 + 1e-6 * self.scale(j, false);
        let sd = joints.clone().map(|j| self.mean_square(residual, j, false).sqrt().max(floor(j)) * self.doubt(j)).collect();
        let time =
            joints.map(|j| (0..self.fit_count).map(|m| correlation_time(&residual[self.layout.of(m, j)])).fold(1.0, f64::max)).collect();
        Weights { sd, time }
    }

    /// By how much the weighted squared residual falls where these columns are added to a fit, to first order in everything else.
    pub fn promise(&self, system: &System, values: &DVector<f64>, columns: &[Column]) -> f64 {
        let residual = system.residual(values);
        let added: Vec<DVector<f64>> = columns.iter().map(|c| system.weighted(c)).collect();
        let cross: Vec<DVector<f64>> = added.iter().map(|c| system.matrix.tr_mul(c)).collect();
        let solved: Vec<DVector<f64>> = cross.iter().map(|c| system.factor.solve(c)).collect();
        let n = columns.len();
        let schur = DMatrix::from_fn(n, n, |i, j| {
            added[i].dot(&added[j]) - cross[i].dot(&solved[j]) + if i == j { 1e-9 * added[i].norm_squared() + 1e-300 } else { 0.0 }
        });
        let right = DVector::from_fn(n, |i, _| added[i].dot(&residual));
        schur.cholesky().map_or(0.0, |c| right.dot(&c.solve(&right)))
    }

    /// The weighted squared residual (with the prior) as a quadratic of the inertial parameters alone, in their sizes, with all other parameters
    /// optimal: its matrix and its minimum.
    pub fn quadratic(&self, structure: &Structure, weights: &Weights) -> Option<(DMatrix<f64>, DVector<f64>)> {
        let (system, values) = self.system(structure, weights)?;
        let n = self.inertial.len();
        let whole = &system.total + DMatrix::from_diagonal(&system.prior);
        let own = whole.view((0, 0), (n, n)).into_owned();
        let rest = values.len() - n;
        let at = values.rows(0, n).into_owned();
        if rest == 0 {
            return Some((own, at));
        }
        let cross = whole.view((0, n), (n, rest)).into_owned();
        let others = whole.view((n, n), (rest, rest)).into_owned();
        let solved = scaled_solve(&others, &cross.transpose())?;
        Some((own - cross * solved, at))
    }

    /// A fit whose inertial parameters are set, in their sizes; all other parameters are refitted. Standard errors stay those of the fit.
    pub fn fit_beside(&self, fit: &Fit, inertial: &[f64], weights: &Weights) -> Option<Fit> {
        let (columns, _) = self.all_columns(&fit.structure);
        let n = self.inertial.len();
        let rest = columns.len() - n;
        let mut values = DVector::from_iterator(columns.len(), inertial.iter().copied().chain(std::iter::repeat_n(0.0, rest)));
        let system = self.linearised(&columns, &fit.structure, weights, values.as_slice());
        if rest > 0 {
            let whole = &system.total + DMatrix::from_diagonal(&system.prior);
            let right = (&system.total_right - &whole * &values).rows(n, rest).into_owned();
            let others = whole.view((n, n), (rest, rest)).into_owned();
            let solved = scaled_solve(&others, &DMatrix::from_column_slice(rest, 1, right.as_slice()))?;
            values.rows_mut(n, rest).copy_from(&solved);
        }
        let mut out = fit.clone();
        out.residual = self.residual_with(&columns, values.as_slice());
        out.values = values.iter().copied().collect();
        Some(out)
    }

    /// The system of a structure, for [`Data::promise`].
    pub fn system(&self, structure: &Structure, weights: &Weights) -> Option<(System, DVector<f64>)> {
        let (columns, _) = self.all_columns(structure);
        self.settled(&columns, structure, weights)
    }
}

/// Correlation time of residuals, rows, at least 1: the autocorrelation is summed up to the first lag at which it is that of noise.
pub(crate) fn correlation_time(part: &[f64]) -> f64 {
    let energy: f64 = part.iter().map(|x| x * x).sum();
    if energy <= 0.0 || part.len() < 16 {
        return 1.0;
    }
    let noise = 2.0 / (part.len() as f64).sqrt();
    let mut sum = 0.0;
    for lag in 1..part.len() / 8 {
        let correlation = part[lag..].iter().zip(part).map(|(a, b)| a * b).sum::<f64>() / energy;
        if correlation < noise {
            break;
        }
        sum += correlation;
    }
    1.0 + 2.0 * sum
}
