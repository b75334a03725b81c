//! A model as a linear system about rest: modes, poles, frequency responses.
//!
//! Elements that are not linear are replaced by their equivalent for a sine of a stated amplitude ([`Operating`]), so one model gives a stiff linkage
//! at small amplitude and a soft one at large. A delay acts on frequency responses and not on poles.

pub use crate::elements::DryFriction as Friction;

use crate::elements::{Linear, Sine};
use crate::model::{InputKind, Model, OutputKind, Place};
use nalgebra::{Complex, DMatrix, DVector, Schur, SymmetricEigen};
use std::borrow::Cow;
use std::f64::consts::TAU;

/// Below this a force at a point has no lever on a joint, m or 1: rounding leaves that much.
const NO_LEVER: f64 = 1e-9;

/// The sine at which elements that are not linear are evaluated.
#[derive(Debug, Clone, PartialEq)]
pub struct Operating {
    /// Amplitude of the displacement across each such element, m or rad, above 0.
    pub amplitude: f64,
    /// Its frequency, Hz, above 0; matters only to elements whose force depends on velocity, to viscoelastic ones (in modes and poles; responses have
    /// them at each frequency), and to [`Friction::Viscous`].
    pub frequency_hz: f64,
    /// How dry friction enters.
    pub friction: Friction,
    /// Displacement about which an element is evaluated, by index, m or rad; 0 where none is given. A wall that is 5 mm away is free space unless its
    /// displacement is put beyond 5 mm here.
    pub about: Vec<(usize, f64)>,
}

impl Operating {
    /// So small an amplitude (1e-9 m or rad) that hysteresis and presliding show their steepest stiffness.
    pub fn small() -> Operating {
        Operating::amplitude(1e-9)
    }

    /// A sine of this amplitude, m or rad, at 10 Hz, friction ignored, about rest.
    pub fn amplitude(amplitude: f64) -> Operating {
        Operating { amplitude, frequency_hz: 10.0, friction: Friction::Ignored, about: Vec::new() }
    }
}

/// Why a model cannot be treated as a linear system.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum LinearError {
    /// Amplitude or frequency of the operating sine is not above 0.
    #[error("the operating amplitude and frequency must be above 0 and finite, are {amplitude} and {frequency_hz} Hz")]
    Operating {
        /// m or rad.
        amplitude: f64,
        /// Hz.
        frequency_hz: f64,
    },
    /// The inertia of the free bodies is not positive definite.
    #[error("body \"{body}\" has neither inertia nor an inerter")]
    NoInertia {
        /// Its name.
        body: String,
    },
    /// A frequency at which the response is infinite: 0 Hz of a body that nothing holds.
    #[error("the response at {frequency_hz} Hz is infinite: the device is not restrained")]
    Infinite {
        /// Hz.
        frequency_hz: f64,
    },
    /// The eigenvalue iteration did not converge.
    #[error("the eigenvalues of this model cannot be found; its parameters may differ by too many orders of magnitude")]
    NotConverged,
    /// No such input or output.
    #[error("the model has no {what} number {index}")]
    NoSuch {
        /// `input` or `output`.
        what: &'static str,
        /// The index that was asked for.
        index: usize,
    },
}

/// A model as `M x'' + C x' + K x = F`, with the motion of prescribed bodies given.
#[derive(Debug, Clone, PartialEq)]
pub struct LinearModel<'a> {
    model: &'a Model,
    at: Operating,
    /// Inertia with inerters, kg, all bodies; here and below, what a point of a robot has is that of the joints that carry it.
    pub inertia: DMatrix<f64>,
    /// Damping with back-EMF, N s/m, all bodies.
    pub damping: DMatrix<f64>,
    /// Stiffness, N/m, all bodies.
    pub stiffness: DMatrix<f64>,
    /// Bodies that no motion input prescribes, but for points of a robot, which go with its joints.
    pub free: Vec<usize>,
    /// Displacement of every body per displacement of each, at a robot's pose: 1 of itself, of a point its row of the Jacobian.
    with: DMatrix<f64>,
    /// What each element is taken as.
    pub elements: Vec<Linear>,
}

/// An undamped mode.
#[derive(Debug, Clone, PartialEq)]
pub struct Mode {
    /// Square of its angular frequency, (rad/s)²; below 0 where a negative stiffness drives it away from rest.
    pub omega_squared: f64,
    /// Motion of every body (0 for prescribed ones), the largest being 1.
    pub shape: Vec<f64>,
}

impl Mode {
    /// Frequency, Hz; 0 for a body that nothing holds, and for a mode that is driven away.
    pub fn frequency_hz(&self) -> f64 {
        self.omega_squared.max(0.0).sqrt() / TAU
    }
}

/// A pole, or a pair of conjugate ones, given once.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Pole {
    /// rad/s; the one with positive imaginary part of a pair.
    pub value: Complex<f64>,
}

impl Pole {
    /// Its magnitude, Hz.
    pub fn frequency_hz(&self) -> f64 {
        self.value.norm() / TAU
    }

    /// Damping ratio; 1 for a decaying real pole, negative for a growing one; 0 at rest (a pole at 0).
    pub fn damping_ratio(&self) -> f64 {
        let norm = self.value.norm();
        if norm == 0.0 { 0.0 } else { -self.value.re / norm }
    }
}

impl<'a> LinearModel<'a> {
    /// Linearises a model at an operating sine.
    pub fn new(model: &'a Model, at: &Operating) -> Result<LinearModel<'a>, LinearError> {
        let good = |x: f64| x.is_finite() && x > 0.0;
        if !good(at.amplitude) || !good(at.frequency_hz) {
            return Err(LinearError::Operating { amplitude: at.amplitude, frequency_hz: at.frequency_hz });
        }
        let n = model.bodies.len();
        let mut inertia = DMatrix::from_diagonal(&DVector::from_iterator(n, model.bodies.iter().map(|b| b.inertia)));
        let mut damping = DMatrix::zeros(n, n);
        let mut stiffness = DMatrix::zeros(n, n);
        let mut elements = Vec::with_capacity(model.elements.len());
        let with = with_points(model);
        let join = |matrix: &mut DMatrix<f64>, between: [Place; 2], value: f64| join(&with, matrix, between, value);
        for (index, element) in model.elements.iter().enumerate() {
            let linear = element.law.linearised(&sine_across(index, at, at.frequency_hz));
            join(&mut inertia, element.between, linear.inertance);
            join(&mut damping, element.between, linear.damping);
            join(&mut stiffness, element.between, linear.stiffness);
            elements.push(linear);
        }
        if let Some(arm) = &model.arm {
            inertia += arm.inertia_at_pose(n);
            stiffness += arm.gravity_stiffness_at_pose(n);
        }
        let prescribed = |body: usize| model.inputs.iter().any(|i| i.kind == InputKind::Motion && i.on == body);
        for input in &model.inputs {
            // The force lost is proportional to the velocity of the driven body: a damper to ground.
            if input.kind == InputKind::Force {
                damping[(input.on, input.on)] += input.back_emf;
            }
        }
        let free = (0..n).filter(|body| !prescribed(*body) && !model.is_point(*body)).collect();
        Ok(LinearModel { model, at: at.clone(), inertia, damping, stiffness, free, with, elements })
    }

    fn of_free(&self, all: &DMatrix<f64>) -> DMatrix<f64> {
        DMatrix::from_fn(self.free.len(), self.free.len(), |i, j| all[(self.free[i], self.free[j])])
    }

    /// Undamped modes of the free bodies, prescribed ones held, slowest first.
    pub fn modes(&self) -> Result<Vec<Mode>, LinearError> {
        let lower = self.inertia_factor()?;
        let whitened = lower.solve_lower_triangular(&self.of_free(&self.stiffness)).ok_or(LinearError::NotConverged)?;
        let whitened = lower.solve_lower_triangular(&whitened.transpose()).ok_or(LinearError::NotConverged)?;
        let symmetric = (&whitened + whitened.transpose()) * 0.5;
        if symmetric.is_empty() {
            return Ok(Vec::new());
        }
        let eigen = SymmetricEigen::try_new(symmetric, 1e-14, 10_000).ok_or(LinearError::NotConverged)?;
        let largest = eigen.eigenvalues.amax();
        let mut modes = Vec::with_capacity(self.free.len());
        for (value, vector) in eigen.eigenvalues.iter().zip(eigen.eigenvectors.column_iter()) {
            let moved = lower.tr_solve_lower_triangular(&vector).ok_or(LinearError::NotConverged)?;
            let scale = moved.iter().fold(0.0_f64, |best, x| if x.abs() > best.abs() { *x } else { best });
            let mut shape = vec![0.0; self.model.bodies.len()];
            for (body, x) in self.free.iter().zip(moved.iter()) {
                shape[*body] = x / scale;
            }
            let shape = (&self.with * DVector::from_vec(shape)).as_slice().to_vec();
            // What rounding leaves of a rigid mode is 0.
            let omega_squared = if value.abs() < 1e-12 * largest { 0.0 } else { *value };
            modes.push(Mode { omega_squared, shape });
        }
        modes.sort_by(|a, b| a.omega_squared.total_cmp(&b.omega_squared));
        Ok(modes)
    }

    fn inertia_factor(&self) -> Result<DMatrix<f64>, LinearError> {
        let inertia = self.of_free(&self.inertia);
        if let Some(i) = (0..self.free.len()).find(|i| inertia[(*i, *i)] <= 0.0) {
            return Err(self.no_inertia(i));
        }
        let factor = inertia.clone().cholesky().map(|c| c.l());
        factor.ok_or_else(|| {
            // Bodies that only an inerter between them gives inertia can move together without any.
            let own = |i: &usize| self.model.bodies[self.free[*i]].inertia;
            let lightest = (0..self.free.len()).min_by(|a, b| own(a).total_cmp(&own(b))).unwrap_or(0);
            self.no_inertia(lightest)
        })
    }

    fn no_inertia(&self, free: usize) -> LinearError {
        let body = self.free.get(free).and_then(|b| self.model.bodies.get(*b));
        LinearError::NoInertia { body: body.map(|b| b.name.clone()).unwrap_or_default() }
    }

    /// Poles of the free bodies, prescribed ones held, slowest first; of a pair only the one above the real axis.
    pub fn poles(&self) -> Result<Vec<Pole>, LinearError> {
        let n = self.free.len();
        if n == 0 {
            return Ok(Vec::new());
        }
        let lower = self.inertia_factor()?;
        let solve = |m: DMatrix<f64>| {
            let half = lower.solve_lower_triangular(&m)?;
            lower.tr_solve_lower_triangular(&half)
        };
        let per_inertia = |m: &DMatrix<f64>| solve(self.of_free(m)).ok_or(LinearError::NotConverged);
        let (k, c) = (per_inertia(&self.stiffness)?, per_inertia(&self.damping)?);
        // Time in units of the fastest mode: positions and velocities become of one size.
        let omega = k.amax().sqrt().max(c.amax()).max(f64::MIN_POSITIVE);
        let a = DMatrix::from_fn(2 * n, 2 * n, |i, j| match (i < n, j < n) {
            (true, true) => 0.0,
            (true, false) => f64::from(u8::from(j - n == i)),
            (false, true) => -k[(i - n, j)] / omega / omega,
            (false, false) => -c[(i - n, j - n)] / omega,
        });
        let schur = Schur::try_new(a, f64::EPSILON, 100_000).ok_or(LinearError::NotConverged)?;
        let mut poles: Vec<Pole> = schur
            .complex_eigenvalues()
            .iter()
            .map(|s| s * omega)
            .filter(|s| s.im >= 0.0)
            // A double pole at 0 comes out as a pair of the size of the square root of rounding.
            .map(|s| if s.norm() < 1e-7 * omega { Complex::new(0.0, 0.0) } else { s })
            .map(|value| Pole { value })
            .collect();
        poles.sort_by(|a, b| a.value.norm().total_cmp(&b.value.norm()));
        Ok(poles)
    }

    /// Response of an output to an input (indices) at each frequency, Hz: the output's unit per the input's,
    /// with what actuation (gain, delay, bandwidth, back-EMF) and sensor (gain, delay) do. Saturation, offset,
    /// resolution and noise are not linear and stay out; every other input is 0.
    pub fn response(&self, input: usize, output: usize, frequencies_hz: &[f64]) -> Result<Vec<Complex<f64>>, LinearError> {
        self.model.inputs.get(input).ok_or(LinearError::NoSuch { what: "input", index: input })?;
        self.model.outputs.get(output).ok_or(LinearError::NoSuch { what: "output", index: output })?;
        frequencies_hz.iter().map(|f| self.at_frequency(*f).response_at(input, output, *f)).collect()
    }

    /// The same from several inputs to several outputs (rows) at one frequency, Hz.
    pub fn responses(&self, inputs: &[usize], outputs: &[usize], frequency_hz: f64) -> Result<DMatrix<Complex<f64>>, LinearError> {
        let there = self.at_frequency(frequency_hz);
        let mut matrix = DMatrix::zeros(outputs.len(), inputs.len());
        for (column, input) in inputs.iter().enumerate() {
            self.model.inputs.get(*input).ok_or(LinearError::NoSuch { what: "input", index: *input })?;
            let answer = there.answer_at(*input, frequency_hz)?;
            for (row, output) in outputs.iter().enumerate() {
                self.model.outputs.get(*output).ok_or(LinearError::NoSuch { what: "output", index: *output })?;
                matrix[(row, column)] = there.read(*output, &answer, frequency_hz);
            }
        }
        Ok(matrix)
    }

    /// Force on a body per force of an element, N per N or N m per N; for an element at a point of a robot its effect on a joint at the pose, `Jᵀ`. 0
    /// where it does not reach the body, or there is no such element.
    pub fn force_share(&self, element: usize, body: usize) -> f64 {
        let share = |place: Place| match place {
            Some(end) if end == body => 1.0,
            Some(end) => self.with[(end, body)],
            None => 0.0,
        };
        let lever = self.model.elements.get(element).map_or(0.0, |element| share(element.between[1]) - share(element.between[0]));
        if lever.abs() > NO_LEVER { lever } else { 0.0 }
    }

    /// With the stiffness and damping that viscoelastic elements have at a frequency, Hz.
    fn at_frequency(&self, frequency_hz: f64) -> Cow<'_, LinearModel<'a>> {
        let mut there = Cow::Borrowed(self);
        for (index, element) in self.model.elements.iter().enumerate().filter(|(_, element)| element.law.is_viscoelastic()) {
            let (before, now) = (self.elements[index], element.law.linearised(&sine_across(index, &self.at, frequency_hz)));
            let there = there.to_mut();
            join(&self.with, &mut there.stiffness, element.between, now.stiffness - before.stiffness);
            join(&self.with, &mut there.damping, element.between, now.damping - before.damping);
            there.elements[index] = now;
        }
        there
    }

    fn response_at(&self, input: usize, output: usize, frequency_hz: f64) -> Result<Complex<f64>, LinearError> {
        Ok(self.read(output, &self.answer_at(input, frequency_hz)?, frequency_hz))
    }

    /// How the bodies move with an input.
    fn answer_at(&self, input: usize, frequency_hz: f64) -> Result<Answer, LinearError> {
        let input = &self.model.inputs[input];
        let s = Complex::new(0.0, TAU * frequency_hz);
        let mut drive = Complex::new(input.gain, 0.0) * (-s * input.delay).exp();
        if input.bandwidth.is_finite() {
            drive /= Complex::new(1.0, 0.0) + s / (TAU * input.bandwidth);
        }
        let n = self.model.bodies.len();
        let dynamic = |i: usize, j: usize| self.dynamic(i, j, s);
        let mut motion = DVector::from_element(n, Complex::new(0.0, 0.0));
        let mut force = motion.clone();
        match input.kind {
            InputKind::Force => force.iter_mut().enumerate().for_each(|(body, force)| *force = drive * self.with[(input.on, body)]),
            InputKind::Motion => motion[input.on] = drive,
        }
        if !self.free.is_empty() {
            let matrix = DMatrix::from_fn(self.free.len(), self.free.len(), |i, j| dynamic(self.free[i], self.free[j]));
            let push = DVector::from_iterator(
                self.free.len(),
                self.free.iter().map(|i| force[*i] - (0..n).map(|j| dynamic(*i, j) * motion[j]).sum::<Complex<f64>>()),
            );
            let infinite = || LinearError::Infinite { frequency_hz };
            let moved = matrix.lu().solve(&push).filter(|x| x.iter().all(|x| x.re.is_finite() && x.im.is_finite()));
            for (body, x) in self.free.iter().zip(moved.ok_or_else(infinite)?.iter()) {
                motion[*body] = *x;
            }
        }
        for body in (0..n).filter(|body| self.model.is_point(*body)) {
            motion[body] = (0..n).map(|joint| motion[joint] * self.with[(body, joint)]).sum();
        }
        Ok(Answer { motion, force })
    }

    fn dynamic(&self, i: usize, j: usize, s: Complex<f64>) -> Complex<f64> {
        s * s * self.inertia[(i, j)] + s * self.damping[(i, j)] + self.stiffness[(i, j)]
    }

    /// The value of an output in that response.
    fn read(&self, output: usize, Answer { motion, force }: &Answer, frequency_hz: f64) -> Complex<f64> {
        let (output, s) = (&self.model.outputs[output], Complex::new(0.0, TAU * frequency_hz));
        let at = |place: Place| place.map_or(Complex::new(0.0, 0.0), |body| motion[body]);
        let read = match &output.kind {
            OutputKind::Position(body) => motion[*body],
            OutputKind::Velocity(body) => s * motion[*body],
            OutputKind::Acceleration(body) => s * s * motion[*body],
            OutputKind::Force(elements) => elements
                .iter()
                .map(|e| {
                    let (linear, between) = (&self.elements[*e], self.model.elements[*e].between);
                    (s * s * linear.inertance + s * linear.damping + linear.stiffness) * (at(between[0]) - at(between[1]))
                })
                .sum(),
            OutputKind::Reaction(body) => {
                (0..motion.len()).map(|j| self.dynamic(*body, j, s) * motion[j]).sum::<Complex<f64>>() - force[*body]
            }
        };
        read * output.gain * (-s * output.delay).exp()
    }
}

/// How the bodies move with an input, and what pushes at them.
struct Answer {
    motion: DVector<Complex<f64>>,
    force: DVector<Complex<f64>>,
}

/// The sine that an element sees, by its index.
fn sine_across(element: usize, at: &Operating, frequency_hz: f64) -> Sine {
    let about = at.about.iter().find(|a| a.0 == element).map_or(0.0, |a| a.1);
    Sine { about, amplitude: at.amplitude, frequency_hz, friction: at.friction }
}

/// Displacement of every body per displacement of each: itself, or of a point of a robot the joints, at the pose.
fn with_points(model: &Model) -> DMatrix<f64> {
    let n = model.bodies.len();
    let mut with = DMatrix::identity(n, n);
    if let Some(arm) = &model.arm {
        for (point, row) in arm.points.iter().zip(arm.gradients_at_pose(n)) {
            with.row_mut(point.body).copy_from_slice(&row);
        }
    }
    with
}

/// Adds a coefficient between two places to a matrix over the bodies: `value gᵀ g` with g the derivative of the displacement across them.
fn join(with: &DMatrix<f64>, matrix: &mut DMatrix<f64>, between: [Place; 2], value: f64) {
    if value == 0.0 {
        return;
    }
    let share = |place: Place, body: usize| place.map_or(0.0, |end| with[(end, body)]);
    let across: Vec<f64> = (0..matrix.nrows()).map(|body| share(between[0], body) - share(between[1], body)).collect();
    for (i, a) in across.iter().enumerate().filter(|(_, a)| **a != 0.0) {
        for (j, b) in across.iter().enumerate().filter(|(_, b)| **b != 0.0) {
            matrix[(i, j)] += value * a * b;
        }
    }
}

/// Response of an output to an input, both by name, about rest: [`LinearModel::response`] in one call.
///
/// `None` where the model has no such input or output.
pub fn frequency_response(
    model: &Model,
    at: &Operating,
    input: &str,
    output: &str,
    frequencies_hz: &[f64],
) -> Option<Result<Vec<Complex<f64>>, LinearError>> {
    let input = model.inputs.iter().position(|i| i.name == input)?;
    let output = model.outputs.iter().position(|o| o.name == output)?;
    Some(LinearModel::new(model, at).and_then(|linear| linear.response(input, output, frequencies_hz)))
}

/// `count` frequencies from `from` to `to`, Hz, evenly spaced in their logarithm.
pub fn log_frequencies(from: f64, to: f64, count: usize) -> Vec<f64> {
    let last = count.saturating_sub(1).max(1) as f64;
    (0..count).map(|i| from * (to / from).powf(i as f64 / last)).collect()
}
