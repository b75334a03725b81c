//! An extended Kalman filter with the engine's own model in it, to compare the observer with.

use crate::engine::Engine;
use nalgebra::{SMatrix, SVector};

/// Twist, w_C, w_A, T_C, and the error of the engine's map, N m.
const STATES: usize = 5;

/// The shaft of Blumenschein et al., eq (1).
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Shaft {
    /// J_C, kg m2.
    pub engine: f64,
    /// J_A, kg m2.
    pub dynamometer: f64,
    /// c, N m/rad.
    pub stiffness: f64,
    /// d, N m s/rad.
    pub damping: f64,
}

/// The filter: the shaft driven by a Hammerstein engine whose map has an error torque that is a random walk.
///
/// The observer needs the engine's inertia alone; this one its map, its lag and the pedal too.
#[derive(Debug, Clone)]
pub struct ExtendedKalman {
    shaft: Shaft,
    engine: Engine,
    state: SVector<f64, STATES>,
    covariance: SMatrix<f64, STATES, STATES>,
    process: SMatrix<f64, STATES, STATES>,
    noise: f64,
    period_s: f64,
}

impl ExtendedKalman {
    /// `speed_noise` is the deviation of a measured speed, rad/s; `walk` what the map's error changes by in a second (N m, deviation);
    /// `ripple` the torque's own white disturbance (N m per root s).
    pub fn new(shaft: Shaft, engine: Engine, speed_noise: f64, walk: f64, ripple: f64, period_s: f64) -> ExtendedKalman {
        let mut process = SMatrix::zeros();
        process[(3, 3)] = ripple * ripple * period_s;
        process[(4, 4)] = walk * walk * period_s;
        let start = SVector::from([1e-3, 1.0, 1.0, 100.0, 100.0]);
        ExtendedKalman {
            shaft,
            engine,
            state: SVector::zeros(),
            covariance: SMatrix::from_diagonal(&start.component_mul(&start)),
            process,
            noise: speed_noise * speed_noise,
            period_s,
        }
    }

    fn rate(&self, x: &SVector<f64, STATES>, torque: f64, pedal: f64) -> SVector<f64, STATES> {
        let s = &self.shaft;
        let twisting = s.stiffness * x[0] + s.damping * (x[1] - x[2]);
        let lag = self.engine.time_constant(pedal, x[1]);
        SVector::from([
            x[1] - x[2],
            (x[3] - twisting) / s.engine,
            (torque + twisting) / s.dynamometer,
            (self.engine.static_torque(pedal, x[1]) + x[4] - x[3]) / lag,
            0.0,
        ])
    }

    /// One period under a dynamometer torque (N m) and pedal (0 to 1) held over it, then the two measured speeds, rad/s. Gives T_C, N m.
    pub fn step(&mut self, torque: f64, pedal: f64, speeds: [f64; 2]) -> f64 {
        let h = self.period_s;
        let advance = |x: &SVector<f64, STATES>| {
            // Heun's method: the torsional mode is slow beside a period.
            let first = self.rate(x, torque, pedal);
            let second = self.rate(&(x + first * h), torque, pedal);
            x + (first + second) * (0.5 * h)
        };
        let ahead = advance(&self.state);
        let mut slope = SMatrix::<f64, STATES, STATES>::zeros();
        for j in 0..STATES {
            let mut moved = self.state;
            let step = 1e-6 * moved[j].abs().max(1.0);
            moved[j] += step;
            slope.set_column(j, &((advance(&moved) - ahead) / step));
        }
        let mut covariance = slope * self.covariance * slope.transpose() + self.process;
        let mut state = ahead;
        // The two measurements one after the other: their noises are independent.
        for (index, speed) in [(1, speeds[0]), (2, speeds[1])] {
            let column: SVector<f64, STATES> = covariance.column(index).into_owned();
            let gain = column / (covariance[(index, index)] + self.noise);
            state += gain * (speed - state[index]);
            covariance -= gain * column.transpose();
        }
        self.state = state;
        self.covariance = (covariance + covariance.transpose()) * 0.5;
        self.state[3]
    }
}
