//! Base parameters: the combinations of inertial parameters that an arm's torque can show.
//!
//! By a QR decomposition of the regressor over random states (Gautier, Numerical calculation of the base inertial parameters of robots, J. Robotic Systems
//! 8(4), 1991). A parameter whose column depends on those before it is identifiable only together with them.

use crate::arms::error::ArmError;
use crate::arms::fit::Fit;
use crate::arms::inertial::{COUNT, NAMES, Parameters};
use crate::arms::motion::Motion;
use crate::arms::problem::Problem;
use crate::arms::regression::Data;
use crate::arms::rigid::regressor;
use crate::verdict::BaseParameter;
use nalgebra::{DMatrix, DVector};

/// States at which the regressor is evaluated.
const STATES: usize = 60;
/// Share of a column that counts as nothing.
const NOTHING: f64 = 1e-8;

/// One combination: the independent parameter, and the factors of those that go with it.
#[derive(Debug, Clone, PartialEq)]
pub struct Base {
    /// Index of the parameter, `10 k + i`.
    pub of: usize,
    /// Indices of dependent ones and their factors.
    pub with: Vec<(usize, f64)>,
}

/// The combinations of an arm.
///
/// # Errors
/// Where the robot cannot be computed.
pub fn base(problem: &Problem) -> Result<Vec<Base>, ArmError> {
    // Multiples of irrational numbers: spread over all states, and the same every time.
    let spread = |i: usize, j: usize, k: usize| 2.0 * (i as f64 * ((3 * j + k + 2) as f64).sqrt()).fract() - 1.0;
    let signals = |k: usize, size: f64| (0..problem.joints.len()).map(|j| (1..=STATES).map(|i| size * spread(i, j, k)).collect()).collect();
    let motion = Motion {
        name: String::new(),
        position: signals(0, 3.0),
        velocity: signals(1, 2.0),
        acceleration: signals(2, 5.0),
        torque: Vec::new(),
        recorded_velocity: Vec::new(),
        moves: Vec::new(),
        counts: Vec::new(),
        payload: None,
    };
    let columns: Vec<DVector<f64>> = regressor(&problem.robot, &problem.bodies, &motion, &[])?
        .iter()
        .map(|signals| DVector::from_iterator(signals.len() * STATES, signals.iter().flatten().copied()))
        .collect();
    let largest = columns.iter().map(DVector::norm).fold(0.0, f64::max);
    // From the last body inwards, so that a combination that cannot be separated is named by the body that is nearer to the base.
    let mut orthogonal: Vec<DVector<f64>> = Vec::new();
    let (mut free, mut bound) = (Vec::new(), Vec::new());
    for index in (0..columns.len()).rev() {
        let mut rest = columns[index].clone();
        for _ in 0..2 {
            for q in &orthogonal {
                let along = q.dot(&rest);
                rest -= along * q;
            }
        }
        let norm = columns[index].norm();
        if norm <= NOTHING * largest {
            continue;
        }
        if rest.norm() > NOTHING * largest.max(norm) * 10.0 {
            orthogonal.push(rest.normalize());
            free.push(index);
        } else {
            bound.push(index);
        }
    }
    free.reverse();
    let independent = DMatrix::from_fn(columns.first().map_or(0, DVector::len), free.len(), |i, j| columns[free[j]][i]);
    let svd = independent.clone().svd(true, true);
    let mut out: Vec<Base> = free.iter().map(|of| Base { of: *of, with: Vec::new() }).collect();
    for index in bound {
        let Ok(factors) = svd.solve(&columns[index], 1e-10) else { continue };
        for (j, factor) in factors.iter().enumerate() {
            if factor.abs() > 1e-6 {
                out[j].with.push((index, *factor));
            }
        }
    }
    Ok(out)
}

fn name(index: usize) -> String {
    format!("{}{}", NAMES[index % COUNT], index / COUNT + 1)
}

impl Base {
    /// Such as `Iyy2 + 0.09 m3`.
    pub fn name(&self) -> String {
        let mut out = name(self.of);
        for (index, factor) in &self.with {
            let sign = if *factor < 0.0 { '-' } else { '+' };
            let size = if (factor.abs() - 1.0).abs() < 1e-6 { String::new() } else { format!("{:.4} ", factor.abs()) };
            out += &format!(" {sign} {size}{}", name(*index));
        }
        out
    }

    /// Its value of inertial parameters.
    pub fn value(&self, parameters: &[Parameters]) -> f64 {
        let of = |index: usize| parameters.get(index / COUNT).map_or(0.0, |p| p[index % COUNT]);
        of(self.of) + self.with.iter().map(|(index, factor)| factor * of(*index)).sum::<f64>()
    }

    fn unit(&self) -> &'static str {
        match self.of % COUNT {
            0 => "kg",
            1..=3 => "kg m",
            _ => "kg m²",
        }
    }
}

/// The combinations as verdicts have them.
///
/// # Errors
/// Where the robot cannot be computed.
pub fn of_fit(data: &Data, fit: &Fit, parameters: &[Parameters]) -> Result<Vec<BaseParameter>, ArmError> {
    let all = base(data.problem)?;
    Ok(all
        .iter()
        .map(|base| {
            let value = base.value(parameters);
            let of_parameters = std::iter::once((base.of, 1.0)).chain(base.with.iter().copied());
            let factors: Vec<(usize, f64)> = of_parameters
                .flat_map(|(i, f)| (0..COUNT).map(move |b| (i / COUNT * COUNT + b, f, (i, b))))
                .map(|(at, f, (i, b))| (at, f * data.problem.bodies.basis[i / COUNT][(i % COUNT, b)]))
                .collect();
            let error = 1.96 * fit.spread(&factors);
            let ci95 = [Some(value - error), Some(value + error)];
            BaseParameter {
                name: base.name(),
                value,
                ci95,
                nominal: base.value(&data.problem.bodies.nominal),
                unit: base.unit().to_string(),
            }
        })
        .collect())
}
