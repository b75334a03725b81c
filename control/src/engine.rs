//! A combustion engine as a Hammerstein system: a static map of pedal and speed, then a first-order lag that depends on the operating point.

use crate::core::{Core, Events, Port, Tick};
use crate::freshness::Freshness;
use backdrive_msgs::{MAX_AXES, Sample};
use std::f64::consts::TAU;

/// A function of pedal and speed by its values on a grid, linear in between and constant beyond it.
#[derive(Debug, Clone, PartialEq)]
pub struct Grid {
    pedals: Vec<f64>,
    speeds: Vec<f64>,
    /// Pedals of the first speed, then of the second.
    values: Vec<f64>,
}

/// Why numbers are no grid.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum GridError {
    /// Not as many values as there are points.
    #[error("{given} values for {pedals} pedals times {speeds} speeds")]
    Size {
        /// Values that are there.
        given: usize,
        /// Pedals.
        pedals: usize,
        /// Speeds.
        speeds: usize,
    },
    /// An axis that does not rise, or has no point.
    #[error("the {0} must rise from point to point, and there must be at least one")]
    Order(&'static str),
    /// A number that is none.
    #[error("every number must be finite")]
    NotFinite,
}

impl Grid {
    /// `values` has the pedals (0 to 1) of the first speed (rad/s), then of the second.
    ///
    /// # Errors
    /// When sizes do not fit, an axis does not rise, or a number is not finite.
    pub fn new(pedals: Vec<f64>, speeds: Vec<f64>, values: Vec<f64>) -> Result<Grid, GridError> {
        if pedals.iter().chain(&speeds).chain(&values).any(|v| !v.is_finite()) {
            return Err(GridError::NotFinite);
        }
        for (what, axis) in [("pedals", &pedals), ("speeds", &speeds)] {
            if axis.is_empty() || axis.windows(2).any(|pair| pair[1] <= pair[0]) {
                return Err(GridError::Order(what));
            }
        }
        if values.len() != pedals.len() * speeds.len() {
            return Err(GridError::Size { given: values.len(), pedals: pedals.len(), speeds: speeds.len() });
        }
        Ok(Grid { pedals, speeds, values })
    }

    /// The same value everywhere.
    pub fn constant(value: f64) -> Grid {
        Grid { pedals: vec![0.0], speeds: vec![0.0], values: vec![value] }
    }

    /// The value at a pedal (0 to 1) and a speed (rad/s), bilinear.
    pub fn at(&self, pedal: f64, speed: f64) -> f64 {
        let (i, p) = between(&self.pedals, pedal);
        let (j, s) = between(&self.speeds, speed);
        let value = |i: usize, j: usize| {
            let (i, j) = (i.min(self.pedals.len() - 1), j.min(self.speeds.len() - 1));
            self.values[j * self.pedals.len() + i]
        };
        let along = |j: usize| value(i, j) + p * (value(i + 1, j) - value(i, j));
        along(j) + s * (along(j + 1) - along(j))
    }

    /// Its pedals, 0 to 1.
    pub fn pedals(&self) -> &[f64] {
        &self.pedals
    }

    /// Its speeds, rad/s.
    pub fn speeds(&self) -> &[f64] {
        &self.speeds
    }

    /// Its values: the pedals of the first speed, then of the second.
    pub fn values(&self) -> &[f64] {
        &self.values
    }
}

/// Index of the point before, and the share of the way to the next one, 0 to 1.
fn between(axis: &[f64], at: f64) -> (usize, f64) {
    let after = axis.iter().position(|x| *x > at).unwrap_or(axis.len());
    if after == 0 {
        return (0, 0.0);
    }
    if after == axis.len() {
        return (axis.len() - 1, 0.0);
    }
    (after - 1, (at - axis[after - 1]) / (axis[after] - axis[after - 1]))
}

/// How combustion makes the torque uneven: a sine of the crank angle in proportion to the torque, over what friction takes at rest of the pedal.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Ripple {
    /// Firings per revolution: 2 of a four-stroke engine with four cylinders.
    pub per_revolution: f64,
    /// Amplitude as a share of the lagged torque, no unit.
    pub share: f64,
}

/// The engine: Blumenschein et al., Fig. 2.
#[derive(Debug, Clone, PartialEq)]
pub struct Engine {
    /// T_Cstat, N m.
    pub map: Grid,
    /// Time constant of the lag, s, above 0.
    pub lag: Grid,
    torque: f64,
}

impl Engine {
    /// An engine that gives no torque yet. Time constants below 1 us are taken as 1 us.
    pub fn new(map: Grid, lag: Grid) -> Engine {
        Engine { map, lag, torque: 0.0 }
    }

    /// T_Cstat(alpha, w_C), N m, of a pedal from 0 to 1 and a speed, rad/s.
    pub fn static_torque(&self, pedal: f64, speed: f64) -> f64 {
        self.map.at(pedal, speed)
    }

    /// The lag's time constant at an operating point, s: linear between the points at which it is given.
    pub fn time_constant(&self, pedal: f64, speed: f64) -> f64 {
        self.lag.at(pedal, speed).max(1e-6)
    }

    /// Advances by one period at an operating point that is held over it, and gives the torque, N m: exact for a first-order lag.
    pub fn step(&mut self, pedal: f64, speed: f64, period_s: f64) -> f64 {
        let wanted = self.static_torque(pedal, speed);
        self.torque = wanted + (self.torque - wanted) * (-period_s / self.time_constant(pedal, speed)).exp();
        self.torque
    }

    /// The torque without noise, N m.
    pub fn torque(&self) -> f64 {
        self.torque
    }
}

/// Inputs `pedal` (position, 0 to 1), `measured` (velocity of the crankshaft); outputs `torque` (effort on the shaft, ripple included, from this
/// step to the next), `static` (effort = T_Cstat).
pub struct EngineNode {
    engine: Engine,
    ripple: Ripple,
    pedal: Freshness,
    speed: Freshness,
    held: [f64; 2],
    angle: f64,
}

impl EngineNode {
    /// An engine at rest.
    pub fn new(engine: Engine, ripple: Ripple) -> EngineNode {
        EngineNode { engine, ripple, pedal: Freshness::default(), speed: Freshness::default(), held: [0.0; 2], angle: 0.0 }
    }
}

impl Core for EngineNode {
    fn step(&mut self, tick: &Tick, inputs: &[Port], outputs: &mut [Sample], _events: &mut Events) {
        if let Some(sample) = self.pedal.new_sample(&inputs[0], |s| s.position[0]) {
            self.held[0] = sample.position[0].clamp(0.0, 1.0);
        }
        if let Some(sample) = self.speed.new_sample(&inputs[1], |s| s.velocity[0]) {
            self.held[1] = sample.velocity[0];
        }
        let [pedal, speed] = self.held;
        let torque = self.engine.step(pedal, speed, tick.period_s);
        self.angle = (self.angle + speed * tick.period_s) % TAU;
        // Combustion alone is uneven: what the pedal adds to the dragged engine's torque.
        let fired = torque - self.engine.static_torque(0.0, speed);
        let uneven = self.ripple.share * fired * (self.ripple.per_revolution * self.angle).sin();
        let (on_shaft, stationary) = outputs.split_at_mut(1);
        for axis in 0..on_shaft[0].len().min(MAX_AXES) {
            on_shaft[0].effort[axis] = torque + uneven;
            stationary[0].effort[axis] = self.engine.static_torque(pedal, speed);
        }
    }
}
