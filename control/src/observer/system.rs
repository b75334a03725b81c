//! The linear system that is observed.

use backdrive_plant::linear::{LinearError, LinearModel, Operating};
use backdrive_plant::model::{InputKind, Model, OutputKind};
use nalgebra::{DMatrix, DVector};

/// `x' = A x + B u + E f`, `y = C x + D w`: Blumenschein et al., eq (2), with a diagonal D.
#[derive(Debug, Clone, PartialEq)]
pub struct System {
    /// States by states.
    pub a: DMatrix<f64>,
    /// States by known inputs (forces, N or N m).
    pub b: DMatrix<f64>,
    /// States by unknown inputs (forces, N or N m).
    pub e: DMatrix<f64>,
    /// Measured quantities by states.
    pub c: DMatrix<f64>,
    /// The diagonal of D: order of magnitude of the measurement noise, one per measured quantity, in its unit, above 0.
    pub noise: Vec<f64>,
    /// Velocity of the bodies on which the unknown inputs act, by states.
    pub user_velocity: DMatrix<f64>,
    /// Their position by states; `None` where speeds alone are measured, which do not determine it.
    pub user_position: Option<DMatrix<f64>>,
}

/// What is measured of a body's motion.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Quantity {
    /// m or rad.
    Position,
    /// m/s or rad/s.
    Velocity,
}

/// Why a model cannot be observed.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum SystemError {
    /// The model has no `[[axes]]`.
    #[error("has no [[axes]]: an observer needs the body on which the unknown force acts, and the measured signals")]
    NoAxes,
    /// A force acts on a point of a robot.
    #[error("has points of a robot ([point.{0}]): an observer knows bodies with an inertia of their own; make the joints its axes")]
    Points(String),
    /// Something is moved from outside.
    #[error("input \"{0}\" prescribes a motion; an observer's model has forces as inputs and no hand in it")]
    Moved(String),
    /// The measured output of an axis is no motion.
    #[error("output \"{0}\" is neither a position nor a velocity of a body")]
    NoMotion(String),
    /// Not as many numbers as there are measured quantities.
    #[error("{given} noise levels for {needed} measured quantities")]
    Noise {
        /// How many are there.
        given: usize,
        /// How many there have to be.
        needed: usize,
    },
    /// The measured signals do not determine the unknown force.
    #[error("the measurements do not determine the unknown force: only {rank} of {states} states are observable")]
    Unobservable {
        /// Rank of the observability matrix.
        rank: usize,
        /// States with the unknown inputs.
        states: usize,
    },
    /// The model cannot be linearised.
    #[error(transparent)]
    Linear(#[from] LinearError),
}

impl System {
    /// The test bench of eq (1): x = [dphi, w_C, w_A], u = T_A, f = T_C, y = [w_C, w_A].
    ///
    /// Inertias in kg m2 above 0, stiffness N m/rad, damping N m s/rad, noise of both speeds rad/s.
    pub fn shaft(engine: f64, dynamometer: f64, stiffness: f64, damping: f64, noise: [f64; 2]) -> System {
        let (jc, ja, c, d) = (engine, dynamometer, stiffness, damping);
        System {
            a: DMatrix::from_row_slice(3, 3, &[0.0, 1.0, -1.0, -c / jc, -d / jc, d / jc, c / ja, d / ja, -d / ja]),
            b: DMatrix::from_column_slice(3, 1, &[0.0, 0.0, 1.0 / ja]),
            e: DMatrix::from_column_slice(3, 1, &[0.0, 1.0 / jc, 0.0]),
            c: DMatrix::from_row_slice(2, 3, &[0.0, 1.0, 0.0, 0.0, 0.0, 1.0]),
            noise: noise.to_vec(),
            user_velocity: DMatrix::from_row_slice(1, 3, &[0.0, 1.0, 0.0]),
            user_position: None,
        }
    }

    /// A model file's system, linearised, dry friction left out: what it takes is part of the unknown force.
    ///
    /// Per axis the known input is the force of its feedback, the unknown one a force on its user's body. Measured are, per axis, first its
    /// measured output as `measured` (of a position output the velocity too), then, where `user` is given, the motion of the user's body.
    /// `noise` has one number per measured quantity, in that order: all axes of the first, then all of the second.
    ///
    /// Where speeds alone are measured, positions are replaced by the displacements that matter (row echelon form of the stiffness): for two
    /// machines on a shaft the twist, and the states are those of [`System::shaft`].
    ///
    /// # Errors
    /// When the model has no axes, moves a body from outside, measures no motion, or does not determine the unknown force.
    pub fn of_model(
        model: &Model,
        at: &Operating,
        measured: Quantity,
        user: Option<Quantity>,
        noise: &[f64],
    ) -> Result<System, SystemError> {
        if model.axes.is_empty() {
            return Err(SystemError::NoAxes);
        }
        if let Some(input) = model.inputs.iter().find(|i| i.kind == InputKind::Motion) {
            return Err(SystemError::Moved(input.name.clone()));
        }
        if let Some(point) = (0..model.bodies.len()).find(|body| model.is_point(*body)) {
            return Err(SystemError::Points(model.place_name(Some(point)).to_owned()));
        }
        let linear = LinearModel::new(model, at)?;
        let (bodies, axes) = (model.bodies.len(), model.axes.len());
        let lightest = || {
            let own = |i: &usize| model.bodies[*i].inertia;
            let lightest = (0..bodies).min_by(|a, b| own(a).total_cmp(&own(b))).unwrap_or(0);
            LinearError::NoInertia { body: model.bodies[lightest].name.clone() }
        };
        let per_inertia = linear.inertia.clone().cholesky().ok_or_else(lightest)?.inverse();

        // Rows over positions and over velocities.
        let (mut over_x, mut over_v) = (Vec::new(), Vec::new());
        for axis in &model.axes {
            let output = &model.outputs[axis.measured];
            let (body, quantity) = match (&output.kind, measured) {
                (OutputKind::Position(body), quantity) => (*body, quantity),
                (OutputKind::Velocity(body), _) => (*body, Quantity::Velocity),
                _ => return Err(SystemError::NoMotion(output.name.clone())),
            };
            let row = DVector::from_fn(bodies, |i, _| if i == body { axis.scale * output.gain } else { 0.0 });
            put(&mut over_x, &mut over_v, row, quantity);
        }
        for axis in model.axes.iter().filter(|_| user.is_some()) {
            let row = DVector::from_fn(bodies, |i, _| f64::from(u8::from(i == axis.user)));
            put(&mut over_x, &mut over_v, row, user.unwrap_or(Quantity::Velocity));
        }
        if noise.len() != over_x.len() {
            return Err(SystemError::Noise { given: noise.len(), needed: over_x.len() });
        }
        let speeds_alone = over_x.iter().all(|row: &DVector<f64>| row.amax() == 0.0);
        // Displacements q = `chosen` x, and the force of the springs on the bodies by q.
        let (chosen, springs) =
            if speeds_alone { echelon(&linear.stiffness) } else { (DMatrix::identity(bodies, bodies), linear.stiffness.clone()) };
        let (q, n) = (chosen.nrows(), chosen.nrows() + bodies);

        let mut a = DMatrix::zeros(n, n);
        a.view_mut((0, q), (q, bodies)).copy_from(&chosen);
        a.view_mut((q, 0), (bodies, q)).copy_from(&(-&per_inertia * springs));
        a.view_mut((q, q), (bodies, bodies)).copy_from(&(-&per_inertia * &linear.damping));
        let push = |axis: usize, body: usize, gain: f64, into: &mut DMatrix<f64>| {
            into.view_mut((q, axis), (bodies, 1)).copy_from(&(per_inertia.column(body) * gain));
        };
        let (mut b, mut e) = (DMatrix::zeros(n, axes), DMatrix::zeros(n, axes));
        let (mut user_velocity, mut user_position) = (DMatrix::zeros(axes, n), DMatrix::zeros(axes, n));
        for (index, axis) in model.axes.iter().enumerate() {
            let input = &model.inputs[axis.feedback];
            push(index, input.on, input.gain, &mut b);
            push(index, axis.user, 1.0, &mut e);
            user_velocity[(index, q + axis.user)] = 1.0;
            if !speeds_alone {
                user_position[(index, axis.user)] = 1.0;
            }
        }
        let mut c = DMatrix::zeros(over_x.len(), n);
        for (row, (x, v)) in over_x.iter().zip(&over_v).enumerate() {
            if !speeds_alone {
                c.view_mut((row, 0), (1, bodies)).copy_from(&x.transpose());
            }
            c.view_mut((row, q), (1, bodies)).copy_from(&v.transpose());
        }
        let system = System { a, b, e, c, noise: noise.to_vec(), user_velocity, user_position: (!speeds_alone).then_some(user_position) };
        system.is_observable()?;
        Ok(system)
    }

    /// Number of states, of unknown inputs, of measured quantities.
    pub fn sizes(&self) -> (usize, usize, usize) {
        (self.a.nrows(), self.e.ncols(), self.c.nrows())
    }

    /// The system whose further states are the unknown inputs, held constant: (A_a, C_a) with A_a = [[A, E], [0, 0]], C_a = [C, 0].
    pub fn augmented(&self) -> (DMatrix<f64>, DMatrix<f64>) {
        let (n, f, y) = self.sizes();
        let mut a = DMatrix::zeros(n + f, n + f);
        a.view_mut((0, 0), (n, n)).copy_from(&self.a);
        a.view_mut((0, n), (n, f)).copy_from(&self.e);
        let mut c = DMatrix::zeros(y, n + f);
        c.view_mut((0, 0), (y, n)).copy_from(&self.c);
        (a, c)
    }

    /// Whether states and unknown inputs can be determined from the measured signals (rank of the observability matrix, time and columns scaled).
    ///
    /// # Errors
    /// [`SystemError::Unobservable`] where they cannot.
    pub fn is_observable(&self) -> Result<(), SystemError> {
        let (a, c) = self.augmented();
        let states = a.nrows();
        // In the time of the fastest mode the powers of A stay of one size.
        let pace = a.complex_eigenvalues().iter().fold(1.0_f64, |most, s| most.max(s.norm()));
        let mut rows = vec![c];
        for _ in 1..states {
            if let Some(last) = rows.last() {
                rows.push(last * &a / pace);
            }
        }
        let mut all = DMatrix::zeros(rows.iter().map(DMatrix::nrows).sum(), states);
        let mut at = 0;
        for block in &rows {
            all.rows_mut(at, block.nrows()).copy_from(block);
            at += block.nrows();
        }
        for mut column in all.column_iter_mut() {
            let norm = column.norm();
            if norm > 0.0 {
                column /= norm;
            }
        }
        let rank = all.rank(1e-9);
        if rank == states { Ok(()) } else { Err(SystemError::Unobservable { rank, states }) }
    }
}

fn put(over_x: &mut Vec<DVector<f64>>, over_v: &mut Vec<DVector<f64>>, row: DVector<f64>, quantity: Quantity) {
    let nothing = DVector::zeros(row.len());
    let (x, v) = if quantity == Quantity::Position { (row, nothing) } else { (nothing, row) };
    over_x.push(x);
    over_v.push(v);
}

/// The reduced row echelon form of a symmetric matrix without its empty rows, and the matrix' columns at its pivots:
/// the matrix is their product.
fn echelon(matrix: &DMatrix<f64>) -> (DMatrix<f64>, DMatrix<f64>) {
    let (size, least) = (matrix.nrows(), 1e-12 * matrix.amax());
    let mut form = matrix.clone();
    let mut pivots = Vec::new();
    for column in 0..size {
        let row = pivots.len();
        let Some(best) = (row..size).max_by(|i, j| form[(*i, column)].abs().total_cmp(&form[(*j, column)].abs())) else { break };
        if form[(best, column)].abs() <= least {
            continue;
        }
        form.swap_rows(row, best);
        let pivot = form[(row, column)];
        form.row_mut(row).scale_mut(1.0 / pivot);
        for other in (0..size).filter(|other| *other != row) {
            let factor = form[(other, column)];
            let taken = form.row(row) * factor;
            let mut line = form.row_mut(other);
            line -= taken;
        }
        pivots.push(column);
    }
    let chosen = form.rows(0, pivots.len()).into_owned();
    (chosen, matrix.select_columns(&pivots))
}
