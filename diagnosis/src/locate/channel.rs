//! Where something unknown may act: candidates, and how each enters the equations of the deviation from the nominal model.

use crate::hypothesis::is_seen;
use backdrive_plant::linear::{LinearModel, Operating};
use backdrive_plant::model::{InputKind, Model, OutputKind};
use nalgebra::{DMatrix, DVector};

/// Where the unknown acts.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) enum Channel {
    /// A force between two places, positive as an element's: it pushes the first end backwards.
    Force([Option<usize>; 2]),
    /// An error of a motion input, in its unit.
    Motion(usize),
    /// An error of an output, in its unit.
    Sensor(usize),
}

/// Every place whose force shows in an output: bodies against ground, joints, motion inputs, outputs.
pub(super) fn channels(model: &Model) -> Vec<Channel> {
    let mut ends: Vec<[Option<usize>; 2]> = (0..model.bodies.len()).map(|b| [Some(b), None]).collect();
    for element in &model.elements {
        let [a, b] = element.between;
        let known = ends.iter().any(|e| *e == [a, b] || *e == [b, a]);
        if !known {
            ends.push([a, b]);
        }
    }
    let forces = ends.into_iter().filter(|e| is_seen(model, *e)).map(Channel::Force);
    let moved = model.inputs.iter().enumerate().filter(|(_, i)| i.kind == InputKind::Motion);
    let motions = moved.filter(|(_, i)| is_seen(model, [Some(i.on), None]) || joins_free(model, i.on)).map(|(i, _)| Channel::Motion(i));
    forces.chain(motions).chain((0..model.outputs.len()).map(Channel::Sensor)).collect()
}

fn joins_free(model: &Model, body: usize) -> bool {
    model.elements.iter().any(|e| e.between.contains(&Some(body)) && is_seen(model, e.between))
}

/// A channel's deviation equations in continuous time: `s' = A s + B n`, `y = H s + D n`, with s the free bodies' positions and
/// velocities and then the unknown with its derivatives, and n the forces of the nonlinear elements beyond the linear ones.
pub(super) struct Equations {
    pub a: DMatrix<f64>,
    pub b: DMatrix<f64>,
    pub h: DMatrix<f64>,
    pub d: DMatrix<f64>,
    /// What a known value of the unknown does, beside the state: columns of `a` and `h` at the unknown itself.
    pub value: usize,
    /// States of the unknown and its derivatives; what comes behind them are other unknowns.
    pub chain: usize,
    /// Standard deviation of the errors that stand behind them, N.
    pub errors: Vec<f64>,
    /// Rows of position and of velocity of every body.
    pub position: Vec<DVector<f64>>,
    pub velocity: Vec<DVector<f64>>,
}

/// The linear part of a model, and the elements that are not.
pub(super) struct Split<'a> {
    pub model: &'a Model,
    pub linear: LinearModel<'a>,
    /// Elements whose force is not linear.
    pub nonlinear: Vec<usize>,
    inverse: DMatrix<f64>,
}

impl<'a> Split<'a> {
    /// `amplitude` (m) is that of the displacements across the nonlinear elements.
    pub fn of(model: &'a Model, amplitude: f64) -> Option<Split<'a>> {
        use backdrive_plant::elements::Role;
        let at = Operating::amplitude(if amplitude > 0.0 && amplitude.is_finite() { amplitude } else { 1e-3 });
        let linear = LinearModel::new(model, &at).ok()?;
        let nonlinear = (0..model.elements.len()).filter(|e| !matches!(model.elements[*e].law.role(), Role::Linear(_))).collect();
        let free = &linear.free;
        let inertia = DMatrix::from_fn(free.len(), free.len(), |i, j| linear.inertia[(free[i], free[j])]);
        let inverse = if free.is_empty() { inertia } else { inertia.try_inverse()? };
        Some(Split { model, linear, nonlinear, inverse })
    }

    /// The same with an error of every nonlinear element's force, beyond what is known of it, as another unknown: it stays about 0 with the
    /// standard deviation `sizes` (N) and is forgotten at `rate` (1/s).
    pub fn loosened(&self, equations: &Equations, sizes: &[f64], rate: f64) -> Equations {
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
            value: equations.value,
            chain: equations.chain,
            errors: sizes.to_vec(),
            position: equations.position.clone(),
            velocity: equations.velocity.clone(),
        }
    }

    /// The equations of a channel whose unknown is a chain of `chain` integrators driven by white noise, for the outputs `rows`.
    pub fn equations(&self, channel: Channel, chain: usize, rows: &[usize]) -> Equations {
        let (free, bodies) = (&self.linear.free, self.model.bodies.len());
        let n = free.len();
        let size = 2 * n + chain;
        let value = 2 * n;
        let unit = |i: usize| DVector::from_fn(size, |k, _| f64::from(u8::from(k == i)));
        let zero = || DVector::zeros(size);
        let moved = match channel {
            Channel::Motion(input) => self.model.inputs.get(input).map(|i| (i.on, i.gain)),
            _ => None,
        };
        let of_body = |body: usize, derivative: usize| match free.iter().position(|f| *f == body) {
            Some(i) => unit(derivative * n + i),
            None => match moved {
                Some((on, _)) if on == body && derivative < chain => unit(value + derivative),
                _ => zero(),
            },
        };
        let position: Vec<_> = (0..bodies).map(|b| of_body(b, 0)).collect();
        let velocity: Vec<_> = (0..bodies).map(|b| of_body(b, 1)).collect();
        // Force on each body: the unknown, and the nonlinear elements.
        let push = |ends: [Option<usize>; 2], body: usize| match ends {
            [Some(a), _] if a == body => -1.0,
            [_, Some(b)] if b == body => 1.0,
            _ => 0.0,
        };
        let unknown = |body: usize| match channel {
            Channel::Force(ends) => push(ends, body),
            _ => 0.0,
        };
        let count = self.nonlinear.len();
        let by_element = DMatrix::from_fn(bodies, count, |body, e| push(self.model.elements[self.nonlinear[e]].between, body));
        let prescribed_acceleration = |body: usize| match moved {
            Some((on, _)) if on == body && chain > 2 => unit(value + 2),
            _ => zero(),
        };
        // What pushes a free body, as a row over the state; inertia of prescribed bodies through inerters included.
        let row_of_force = |body: usize| {
            let mut row = unit(value) * unknown(body);
            for j in 0..bodies {
                row -= &position[j] * self.linear.stiffness[(body, j)] + &velocity[j] * self.linear.damping[(body, j)];
                if !free.contains(&j) {
                    row -= prescribed_acceleration(j) * self.linear.inertia[(body, j)];
                }
            }
            row
        };
        let forces: Vec<DVector<f64>> = free.iter().map(|body| row_of_force(*body)).collect();
        let mut a = DMatrix::zeros(size, size);
        let mut b = DMatrix::zeros(size, count);
        let mut acceleration: Vec<DVector<f64>> = (0..bodies).map(prescribed_acceleration).collect();
        let mut acceleration_by_element = DMatrix::zeros(bodies, count);
        for i in 0..n {
            a[(i, n + i)] = 1.0;
            let mut row = zero();
            for j in 0..n {
                row += &forces[j] * self.inverse[(i, j)];
                for e in 0..count {
                    b[(n + i, e)] += self.inverse[(i, j)] * by_element[(free[j], e)];
                }
            }
            a.row_mut(n + i).copy_from(&row.transpose());
            for e in 0..count {
                acceleration_by_element[(free[i], e)] = b[(n + i, e)];
            }
            acceleration[free[i]] = row;
        }
        for link in 0..chain.saturating_sub(1) {
            a[(value + link, value + link + 1)] = 1.0;
        }
        let mut h = DMatrix::zeros(rows.len(), size);
        let mut d = DMatrix::zeros(rows.len(), count);
        for (r, output) in rows.iter().enumerate() {
            let Some(out) = self.model.outputs.get(*output) else { continue };
            let (mut row, mut by) = (zero(), DVector::zeros(count));
            match &out.kind {
                OutputKind::Position(body) => row += &position[*body],
                OutputKind::Velocity(body) => row += &velocity[*body],
                OutputKind::Acceleration(body) => {
                    row += &acceleration[*body];
                    by += acceleration_by_element.row(*body).transpose();
                }
                OutputKind::Force(elements) => {
                    for e in elements {
                        let (law, ends) = (&self.linear.elements[*e], self.model.elements[*e].between);
                        for (end, sign) in [(ends[0], 1.0), (ends[1], -1.0)] {
                            let Some(body) = end else { continue };
                            row += (&position[body] * law.stiffness + &velocity[body] * law.damping + &acceleration[body] * law.inertance)
                                * sign;
                            by += acceleration_by_element.row(body).transpose() * (law.inertance * sign);
                        }
                        if let Some(e) = self.nonlinear.iter().position(|n| n == e) {
                            by[e] += 1.0;
                        }
                    }
                }
                OutputKind::Reaction(body) => {
                    for j in 0..bodies {
                        row += &position[j] * self.linear.stiffness[(*body, j)]
                            + &velocity[j] * self.linear.damping[(*body, j)]
                            + &acceleration[j] * self.linear.inertia[(*body, j)];
                        by += acceleration_by_element.row(j).transpose() * self.linear.inertia[(*body, j)];
                    }
                    row -= unit(value) * unknown(*body);
                    by -= by_element.row(*body).transpose();
                }
            }
            row *= out.gain;
            by *= out.gain;
            if channel == Channel::Sensor(*output) {
                row += unit(value);
            }
            h.row_mut(r).copy_from(&row.transpose());
            d.row_mut(r).copy_from(&by.transpose());
        }
        Equations { a, b, h, d, value, chain, errors: Vec::new(), position, velocity }
    }
}
