//! The observer in time, and as a node.

use super::design::stacked;
use super::system::System;
use crate::core::{Core, Events, Port, Tick};
use crate::freshness::Freshness;
use backdrive_msgs::{MAX_AXES, Sample};
use backdrive_signal::butterworth::Butterworth;
use nalgebra::DMatrix;

/// `xhat' = A xhat + B u + E fhat + K (y - C xhat)`, `fhat' = L (y - C xhat)` (Blumenschein et al., eq (3)), exact from sample to sample for
/// a known force u that is held and a measurement y that runs in a straight line.
#[derive(Debug, Clone)]
pub struct UnknownInput {
    states: usize,
    unknown: usize,
    /// While measurements come, and while there are none.
    closed: Map,
    open: Map,
    /// States that fit a first measurement, at rest otherwise.
    first: Rows,
    user_velocity: Rows,
    user_position: Option<Rows>,
    state: Vec<f64>,
    next: Vec<f64>,
    before: Vec<f64>,
    begun: bool,
    seen: bool,
}

/// A matrix, row after row.
#[derive(Debug, Clone)]
struct Rows {
    columns: usize,
    values: Vec<f64>,
}

impl Rows {
    fn of(matrix: &DMatrix<f64>) -> Rows {
        Rows { columns: matrix.ncols(), values: matrix.transpose().as_slice().to_vec() }
    }

    fn row(&self, row: usize, by: &[f64]) -> f64 {
        self.values[row * self.columns..(row + 1) * self.columns].iter().zip(by).map(|(a, b)| a * b).sum()
    }
}

/// From sample to sample: states, known forces over the period, measurement at its start and at its end.
#[derive(Debug, Clone)]
struct Map {
    states: Rows,
    forces: Rows,
    start: Rows,
    end: Rows,
}

impl Map {
    /// `f` moves the states, `b` brings in the known forces, `g` the measurements.
    fn new(f: &DMatrix<f64>, b: &DMatrix<f64>, g: &DMatrix<f64>, period_s: f64) -> Map {
        let (n, u, y) = (f.nrows(), b.ncols(), g.ncols());
        // The states with the force, the measurement and its slope, in one exponential.
        let mut all = DMatrix::zeros(n + u + 2 * y, n + u + 2 * y);
        all.view_mut((0, 0), (n, n)).copy_from(&(f * period_s));
        all.view_mut((0, n), (n, u)).copy_from(&(b * period_s));
        all.view_mut((0, n + u), (n, y)).copy_from(&(g * period_s));
        all.view_mut((n + u, n + u + y), (y, y)).copy_from(&DMatrix::identity(y, y));
        let all = all.exp();
        let block = |from: usize, width: usize| all.view((0, from), (n, width)).into_owned();
        let (held, slope) = (block(n + u, y), block(n + u + y, y));
        Map { states: Rows::of(&block(0, n)), forces: Rows::of(&block(n, u)), start: Rows::of(&(held - &slope)), end: Rows::of(&slope) }
    }
}

impl UnknownInput {
    /// The observer of a system with gains `k` (states by measured quantities) and `l` (unknown inputs by measured quantities).
    pub fn new(system: &System, k: &DMatrix<f64>, l: &DMatrix<f64>, period_s: f64) -> UnknownInput {
        let (a, c) = system.augmented();
        let (n, f, y) = system.sizes();
        let wide = |rows: &DMatrix<f64>| rows.clone().resize_horizontally(n + f, 0.0);
        let b = system.b.clone().resize_vertically(n + f, 0.0);
        let gains = stacked(k, l);
        let inverse = system.c.clone().pseudo_inverse(1e-12).unwrap_or_else(|_| DMatrix::zeros(n, y));
        UnknownInput {
            states: n,
            unknown: f,
            closed: Map::new(&(&a - &gains * &c), &b, &gains, period_s),
            open: Map::new(&a, &b, &DMatrix::zeros(n + f, y), period_s),
            first: Rows::of(&inverse),
            user_velocity: Rows::of(&wide(&system.user_velocity)),
            user_position: system.user_position.as_ref().map(|rows| Rows::of(&wide(rows))),
            state: vec![0.0; n + f],
            next: vec![0.0; n + f],
            before: vec![0.0; y],
            begun: false,
            seen: false,
        }
    }

    /// Advances by one period: the known forces were held over it, and this is measured now. Without a measurement it goes on by its model.
    /// The first measurement is where it begins.
    pub fn step(&mut self, known: &[f64], measured: Option<&[f64]>) {
        if !self.begun {
            let Some(first) = measured else { return };
            for (row, state) in self.state.iter_mut().take(self.states).enumerate() {
                *state = self.first.row(row, first);
            }
            self.before.copy_from_slice(first);
            (self.begun, self.seen) = (true, true);
            return;
        }
        // A line needs both its ends; after a gap the measurement is taken as held.
        let map = if measured.is_some() { &self.closed } else { &self.open };
        if let Some(now) = measured.filter(|_| !self.seen) {
            self.before.copy_from_slice(now);
        }
        for (row, next) in self.next.iter_mut().enumerate() {
            *next = map.states.row(row, &self.state) + map.forces.row(row, known);
            if let Some(now) = measured {
                *next += map.start.row(row, &self.before) + map.end.row(row, now);
            }
        }
        if let Some(now) = measured {
            self.before.copy_from_slice(now);
        }
        self.seen = measured.is_some();
        std::mem::swap(&mut self.state, &mut self.next);
    }

    /// Number of unknown inputs.
    pub fn unknown(&self) -> usize {
        self.unknown
    }

    /// The estimate of an unknown input, N or N m.
    pub fn force(&self, which: usize) -> f64 {
        self.state[self.states + which]
    }

    /// The estimated velocity of the body that an unknown input acts on, m/s or rad/s.
    pub fn velocity(&self, which: usize) -> f64 {
        self.user_velocity.row(which, &self.state)
    }

    /// Its estimated position, m or rad; NaN where speeds alone are measured.
    pub fn position(&self, which: usize) -> f64 {
        self.user_position.as_ref().map_or(f64::NAN, |rows| rows.row(which, &self.state))
    }

    /// Whether the state is finite.
    pub fn is_finite(&self) -> bool {
        self.state.iter().all(|x| x.is_finite())
    }
}

/// Inputs: `measured` (motion where the known force acts; its effort is that force), `user` (motion where the unknown force acts), `force` (the known
/// force, instead of the effort of `measured`). Outputs: `estimate` (motion where the unknown force acts, effort = that force), `filtered` (effort =
/// that force behind a Butterworth filter).
///
/// The effort of a sample holds until the next one. At a sample without a measurement the model runs on, and nothing is put out.
pub struct ObserverNode {
    observer: UnknownInput,
    filters: Vec<Butterworth>,
    /// Whether `measured` and `user` are velocities; `None` where `user` is not connected.
    velocity: [Option<bool>; 2],
    force_port: bool,
    fresh: [Freshness; 3],
    known: [f64; MAX_AXES],
    was_finite: bool,
}

impl ObserverNode {
    /// `velocity` states for `measured` and `user` whether their velocity is measured (else their position), `None` for a `user` that is not there;
    /// `force_port` states whether `force` is. A filter of 0 Hz lets everything pass.
    pub fn new(observer: UnknownInput, velocity: [Option<bool>; 2], force_port: bool, filter: (usize, f64), period_s: f64) -> ObserverNode {
        let filters = vec![Butterworth::new(filter.0, filter.1, period_s); observer.unknown()];
        ObserverNode { observer, filters, velocity, force_port, fresh: Default::default(), known: [0.0; MAX_AXES], was_finite: true }
    }
}

impl Core for ObserverNode {
    fn step(&mut self, tick: &Tick, inputs: &[Port], outputs: &mut [Sample], events: &mut Events) {
        let axes = self.observer.unknown();
        let mut values = [0.0; 2 * MAX_AXES];
        let mut count = 0;
        let mut whole = true;
        for (port, velocity) in self.velocity.iter().enumerate() {
            let Some(velocity) = *velocity else { continue };
            let read = |s: &Sample, axis: usize| if velocity { s.velocity[axis] } else { s.position[axis] };
            match self.fresh[port].new_sample(&inputs[port], |s| read(s, 0)) {
                Some(sample) => (0..axes).for_each(|axis| values[count + axis] = read(sample, axis)),
                None => whole = false,
            }
            count += axes;
        }
        whole &= values[..count].iter().all(|v| v.is_finite());
        self.observer.step(&self.known[..axes], whole.then_some(&values[..count]));
        let port = if self.force_port { 2 } else { 0 };
        if let Some(sample) = self.fresh[2].new_sample(&inputs[port], |s| s.effort[0]) {
            for axis in 0..axes {
                self.known[axis] = if sample.effort[axis].is_finite() { sample.effort[axis] } else { 0.0 };
            }
        }
        let finite = self.observer.is_finite();
        if !finite && self.was_finite {
            events.push("state_not_finite", tick.time_s, 2);
        }
        self.was_finite = finite;
        if !whole || !finite {
            return;
        }
        let (estimate, filtered) = outputs.split_at_mut(1);
        for axis in 0..axes {
            estimate[0].position[axis] = self.observer.position(axis);
            estimate[0].velocity[axis] = self.observer.velocity(axis);
            estimate[0].effort[axis] = self.observer.force(axis);
            filtered[0].effort[axis] = self.filters[axis].step(self.observer.force(axis));
        }
    }
}
