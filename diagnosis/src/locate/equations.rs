//! State equations of the deviation from the simulated nominal model, driven by an unknown at one channel.

use super::channel::Channel;
use backdrive_plant::elements::Role;
use backdrive_plant::linear::{LinearModel, Operating};
use backdrive_plant::model::{Model, OutputKind};
use nalgebra::{DMatrix, DVector};

/// The deviation of a channel in continuous time: `s' = A s + B n`, `y = H s + D n`. The state s holds positions and velocities of the free
/// bodies, then the unknown and its derivatives; n are the forces of the nonlinear elements beyond their linear part.
pub(super) struct Equations {
    pub a: DMatrix<f64>,
    pub b: DMatrix<f64>,
    pub h: DMatrix<f64>,
    pub d: DMatrix<f64>,
    /// Index of the unknown in the state. Its columns of `a` and `h` are also what a known value of it does.
    pub unknown: usize,
    /// Order of the unknown: the unknown and its derivatives are so many states, and white noise drives the last. Behind them stand the force errors.
    pub order: usize,
    /// Standard deviation of each force error, N; see [`Linearisation::with_force_errors`].
    pub force_errors: Vec<f64>,
    /// Position and velocity of every body as rows over the state.
    pub position: Vec<DVector<f64>>,
    pub velocity: Vec<DVector<f64>>,
}

/// The linear part of a model, and the elements that are not linear.
pub(super) struct Linearisation<'a> {
    pub model: &'a Model,
    pub linear: LinearModel<'a>,
    /// Elements whose force is not linear.
    pub nonlinear: Vec<usize>,
    /// Inverse of the inertia matrix of the free bodies.
    inverse_inertia: DMatrix<f64>,
}

/// What the equations are built from: rows over the state, for every body of the model.
struct Rows {
    /// Index of the unknown in the state, its order, and the length of the state.
    unknown: usize,
    order: usize,
    size: usize,
    position: Vec<DVector<f64>>,
    velocity: Vec<DVector<f64>>,
    acceleration: Vec<DVector<f64>>,
    /// Force of each nonlinear element on each body per newton: a row for each body, a column for each element.
    force_of_element: DMatrix<f64>,
    /// Acceleration of each body per newton of each nonlinear element.
    acceleration_by_element: DMatrix<f64>,
}

impl Rows {
    fn zero(&self) -> DVector<f64> {
        DVector::zeros(self.size)
    }

    fn unit(&self, state: usize) -> DVector<f64> {
        DVector::from_fn(self.size, |k, _| f64::from(u8::from(k == state)))
    }
}

/// Sign of an element's force on a body: it pulls its first end backwards and its second end forwards.
fn force_sign(ends: [Option<usize>; 2], body: usize) -> f64 {
    match ends {
        [Some(a), _] if a == body => -1.0,
        [_, Some(b)] if b == body => 1.0,
        _ => 0.0,
    }
}

/// Force on a body per newton of the unknown.
fn unknown_force(channel: Channel, body: usize) -> f64 {
    match channel {
        Channel::Force(ends) => force_sign(ends, body),
        Channel::Motion(_) | Channel::Sensor(_) => 0.0,
    }
}

impl<'a> Linearisation<'a> {
    /// `amplitude` (m) is that of the displacements across the nonlinear elements. `None` where the inertia matrix is singular.
    pub fn of(model: &'a Model, amplitude: f64) -> Option<Linearisation<'a>> {
        let at = Operating::amplitude(if amplitude > 0.0 && amplitude.is_finite() { amplitude } else { 1e-3 });
        let linear = LinearModel::new(model, &at).ok()?;
        let nonlinear = (0..model.elements.len()).filter(|e| !matches!(model.elements[*e].law.role(), Role::Linear(_))).collect();
        let free = &linear.free;
        let inertia = DMatrix::from_fn(free.len(), free.len(), |i, j| linear.inertia[(free[i], free[j])]);
        let inverse_inertia = if free.is_empty() { inertia } else { inertia.try_inverse()? };
        Some(Linearisation { model, linear, nonlinear, inverse_inertia })
    }

    /// The same equations with an error of every nonlinear element's force as further states. Each is a first-order Markov process with the standard
    /// deviation `sizes` (N) and the corner `rate` (1/s).
    pub fn with_force_errors(&self, equations: &Equations, sizes: &[f64], rate: f64) -> Equations {
        let (n, count, rows) = (equations.a.nrows(), equations.b.ncols(), equations.h.nrows());
        let wider = |m: &DMatrix<f64>, more: &DMatrix<f64>, height: usize| {
            let mut wide = DMatrix::zeros(height, n + count);
            wide.view_mut((0, 0), m.shape()).copy_from(m);
            wide.view_mut((0, n), more.shape()).copy_from(more);
            wide
        };
        let mut a = wider(&equations.a, &equations.b, n + count);
        (n..n + count).for_each(|i| a[(i, i)] = -rate);
        Equations {
            a,
            b: equations.b.clone().resize_vertically(n + count, 0.0),
            h: wider(&equations.h, &equations.d, rows),
            d: equations.d.clone(),
            unknown: equations.unknown,
            order: equations.order,
            force_errors: sizes.to_vec(),
            position: equations.position.clone(),
            velocity: equations.velocity.clone(),
        }
    }

    /// The equations of a channel whose unknown is white noise integrated `order` times, read by the outputs `outputs` of the model.
    pub fn equations(&self, channel: Channel, order: usize, outputs: &[usize]) -> Equations {
        let mut rows = self.kinematics(channel, order);
        let (a, b) = self.dynamics(channel, &mut rows);
        let count = self.nonlinear.len();
        let mut h = DMatrix::zeros(outputs.len(), rows.size);
        let mut d = DMatrix::zeros(outputs.len(), count);
        for (r, output) in outputs.iter().enumerate() {
            let Some(out) = self.model.outputs.get(*output) else { continue };
            let (mut row, mut by_element) = self.reading(channel, &rows, &out.kind);
            row *= out.gain;
            by_element *= out.gain;
            if channel == Channel::Sensor(*output) {
                row += rows.unit(rows.unknown);
            }
            h.row_mut(r).copy_from(&row.transpose());
            d.row_mut(r).copy_from(&by_element.transpose());
        }
        let Rows { unknown, order, position, velocity, .. } = rows;
        Equations { a, b, h, d, unknown, order, force_errors: Vec::new(), position, velocity }
    }

    /// Position and velocity of every body, and the acceleration of the prescribed ones.
    fn kinematics(&self, channel: Channel, order: usize) -> Rows {
        let (free, bodies, count) = (&self.linear.free, self.model.bodies.len(), self.nonlinear.len());
        let n = free.len();
        let force_of_element = DMatrix::from_fn(bodies, count, |body, e| force_sign(self.model.elements[self.nonlinear[e]].between, body));
        let mut rows = Rows {
            unknown: 2 * n,
            order,
            size: 2 * n + order,
            position: Vec::new(),
            velocity: Vec::new(),
            acceleration: Vec::new(),
            force_of_element,
            acceleration_by_element: DMatrix::zeros(bodies, count),
        };
        let moved = match channel {
            Channel::Motion(input) => self.model.inputs.get(input).map(|i| i.on),
            Channel::Force(_) | Channel::Sensor(_) => None,
        };
        let of_unknown = |body: usize, derivative: usize| match moved {
            Some(on) if on == body && derivative < order => rows.unit(rows.unknown + derivative),
            _ => rows.zero(),
        };
        let of_body = |body: usize, derivative: usize| match free.iter().position(|f| *f == body) {
            Some(i) => rows.unit(derivative * n + i),
            None => of_unknown(body, derivative),
        };
        let position = (0..bodies).map(|b| of_body(b, 0)).collect();
        let velocity = (0..bodies).map(|b| of_body(b, 1)).collect();
        let acceleration = (0..bodies).map(|b| of_unknown(b, 2)).collect();
        (rows.position, rows.velocity, rows.acceleration) = (position, velocity, acceleration);
        rows
    }

    /// The matrices A and B; completes the accelerations in `rows`.
    fn dynamics(&self, channel: Channel, rows: &mut Rows) -> (DMatrix<f64>, DMatrix<f64>) {
        let (free, count) = (&self.linear.free, self.nonlinear.len());
        let n = free.len();
        let forces: Vec<DVector<f64>> = free.iter().map(|body| self.force_on(channel, rows, *body)).collect();
        let mut a = DMatrix::zeros(rows.size, rows.size);
        let mut b = DMatrix::zeros(rows.size, count);
        for i in 0..n {
            a[(i, n + i)] = 1.0;
            let mut row = rows.zero();
            for j in 0..n {
                row += &forces[j] * self.inverse_inertia[(i, j)];
                for e in 0..count {
                    b[(n + i, e)] += self.inverse_inertia[(i, j)] * rows.force_of_element[(free[j], e)];
                }
            }
            a.row_mut(n + i).copy_from(&row.transpose());
            for e in 0..count {
                rows.acceleration_by_element[(free[i], e)] = b[(n + i, e)];
            }
            rows.acceleration[free[i]] = row;
        }
        for link in 0..rows.order.saturating_sub(1) {
            a[(rows.unknown + link, rows.unknown + link + 1)] = 1.0;
        }
        (a, b)
    }

    /// Force on a free body as a row over the state: the unknown, springs and dampers, and the inertia of prescribed bodies that inerters couple in.
    fn force_on(&self, channel: Channel, rows: &Rows, body: usize) -> DVector<f64> {
        let mut row = rows.unit(rows.unknown) * unknown_force(channel, body);
        for j in 0..self.model.bodies.len() {
            row -= &rows.position[j] * self.linear.stiffness[(body, j)] + &rows.velocity[j] * self.linear.damping[(body, j)];
            if !self.linear.free.contains(&j) {
                row -= &rows.acceleration[j] * self.linear.inertia[(body, j)];
            }
        }
        row
    }

    /// What an output reads, before its gain: a row over the state, and one over the forces of the nonlinear elements.
    fn reading(&self, channel: Channel, rows: &Rows, kind: &OutputKind) -> (DVector<f64>, DVector<f64>) {
        let Rows { position, velocity, acceleration, acceleration_by_element, .. } = rows;
        let (mut row, mut by_element) = (rows.zero(), DVector::zeros(self.nonlinear.len()));
        match kind {
            OutputKind::Position(body) => row += &position[*body],
            OutputKind::Velocity(body) => row += &velocity[*body],
            OutputKind::Acceleration(body) => {
                row += &acceleration[*body];
                by_element += acceleration_by_element.row(*body).transpose();
            }
            OutputKind::Force(elements) => {
                for e in elements {
                    let (law, ends) = (&self.linear.elements[*e], self.model.elements[*e].between);
                    for (end, sign) in [(ends[0], 1.0), (ends[1], -1.0)] {
                        let Some(body) = end else { continue };
                        row +=
                            (&position[body] * law.stiffness + &velocity[body] * law.damping + &acceleration[body] * law.inertance) * sign;
                        by_element += acceleration_by_element.row(body).transpose() * (law.inertance * sign);
                    }
                    if let Some(e) = self.nonlinear.iter().position(|n| n == e) {
                        by_element[e] += 1.0;
                    }
                }
            }
            OutputKind::Reaction(body) => {
                for j in 0..self.model.bodies.len() {
                    row += &position[j] * self.linear.stiffness[(*body, j)]
                        + &velocity[j] * self.linear.damping[(*body, j)]
                        + &acceleration[j] * self.linear.inertia[(*body, j)];
                    by_element += acceleration_by_element.row(j).transpose() * self.linear.inertia[(*body, j)];
                }
                row -= rows.unit(rows.unknown) * unknown_force(channel, *body);
                by_element -= rows.force_of_element.row(*body).transpose();
            }
        }
        (row, by_element)
    }
}
