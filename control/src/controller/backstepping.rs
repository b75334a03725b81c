//! Adaptive back-stepping sliding mode: Choi, Han & Kim 2006, eqs (19)-(31).

use super::{AxisModel, Bristles, ControllerError, Reference, State, switching_sign};

/// Gains of [`Backstepping`].
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Gains {
    /// k of the surface `S = k ξ1 + ξ2`, 1/s, at least 0.
    pub surface: f64,
    /// c of the virtual control `a = -c ξ1`, 1/s, at least 0.
    pub stabilising: f64,
    /// D of `S' = -D S - K sgn S`, 1/s, at least 0.
    pub reaching: f64,
    /// K, m/s² or rad/s², at least 0.
    pub switching: f64,
    /// Width of the layer in which sgn is a straight line, m/s or rad/s; 0 for none.
    pub boundary: f64,
    /// γ0, γ1 and γ12: how fast σ0, σ1 and σ12 = σ1 + σ2 are adapted, at least 0; 0 keeps one as it starts. In the units that make eq
    /// (30) a rate of each.
    pub adaptation: [f64; 3],
    /// Share of the model's σ0, σ1 and σ12 from which the estimates start, at least 0.
    pub start: f64,
}

/// Estimates of the friction's numbers.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Estimates {
    /// σ0, N/m or N m/rad.
    pub stiffness: f64,
    /// σ1, N s/m or N m s/rad.
    pub damping: f64,
    /// σ12, N s/m or N m s/rad.
    pub viscous: f64,
}

/// `u = J (k ξ1' + q_r'' - a' + D S + K sgn S) + σ0 h + σ12 q' - σ1 h f`, with the estimates of eq (30): eq (31).
///
/// With ξ1 = q_r - q, ξ2 = q_r' - q' - a. The bristles are not measured: h and f are those of the model's `lugre` or `preisach_lugre`,
/// run open loop along the measured position. The third law of eq (30) carries the minus that eq (29) asks for. Estimates do not
/// fall below 0, which takes nothing from V' <= 0 while the true ones are not below it either.
#[derive(Debug, Clone)]
pub struct Backstepping {
    gains: Gains,
    model: AxisModel,
    estimates: Estimates,
    before: Option<f64>,
}

impl Backstepping {
    /// For an axis as `model` has it.
    ///
    /// # Errors
    /// Where the model has no `lugre` and no `preisach_lugre` on the driven body.
    pub fn new(gains: Gains, model: AxisModel) -> Result<Backstepping, ControllerError> {
        let Some(bristles) = model.bristles(0.0) else {
            let reason = "law \"backstepping\" needs a lugre or preisach_lugre element between the driven body and ground".to_owned();
            return Err(ControllerError::Model { model: "of the controller".to_owned(), axis: 0, reason });
        };
        let estimates = Estimates {
            stiffness: gains.start * bristles.stiffness,
            damping: gains.start * bristles.damping,
            viscous: gains.start * (bristles.damping + model.viscous),
        };
        Ok(Backstepping { gains, model, estimates, before: None })
    }

    /// What it has learnt so far.
    pub fn estimates(&self) -> Estimates {
        self.estimates
    }

    /// S, m/s or rad/s.
    pub fn surface(&self, reference: &Reference, state: &State) -> f64 {
        let error = reference.position - state.position;
        let xi2 = reference.velocity - state.velocity + self.gains.stabilising * error;
        self.gains.surface * error + xi2
    }

    /// Eqs (27) and (31) with these bristles and estimates, N or N m.
    pub fn command(&self, reference: &Reference, state: &State, bristles: &Bristles, estimates: &Estimates) -> f64 {
        let Gains { surface: k, stabilising: c, reaching, switching, boundary, .. } = self.gains;
        let surface = self.surface(reference, state);
        let error_rate = reference.velocity - state.velocity;
        let rate = reaching * surface + switching * switching_sign(surface, boundary);
        let deflection = bristles.force / bristles.stiffness;
        // ξ1' = ξ2 - c ξ1 = q_r' - q', and a' = -c ξ1'.
        self.model.inertia * (k * error_rate + reference.acceleration + c * error_rate + rate)
            + estimates.stiffness * deflection
            + estimates.viscous * state.velocity
            - estimates.damping * bristles.leak * bristles.force
    }

    /// Rates of the estimates, eq (30), per second.
    pub fn rates(&self, surface: f64, velocity: f64, bristles: &Bristles) -> Estimates {
        let by = surface / self.model.inertia;
        let [stiffness, damping, viscous] = self.gains.adaptation;
        Estimates {
            stiffness: stiffness * by * bristles.force / bristles.stiffness,
            damping: -damping * by * bristles.leak * bristles.force,
            viscous: viscous * by * velocity,
        }
    }

    /// Force on the motor, N or N m; bristles and estimates go on by one step.
    pub fn effort(&mut self, reference: &Reference, state: &State, period_s: f64) -> f64 {
        let from = self.before.replace(state.position).unwrap_or(0.0);
        self.model.advance(from, state.position, period_s);
        let bristles = self.model.bristles(state.velocity).unwrap_or_default();
        if bristles.stiffness <= 0.0 {
            return 0.0;
        }
        let rates = self.rates(self.surface(reference, state), state.velocity, &bristles);
        let step = |estimate: f64, rate: f64| (estimate + rate * period_s).max(0.0);
        self.estimates = Estimates {
            stiffness: step(self.estimates.stiffness, rates.stiffness),
            damping: step(self.estimates.damping, rates.damping),
            viscous: step(self.estimates.viscous, rates.viscous),
        };
        self.command(reference, state, &bristles, &self.estimates)
    }
}
