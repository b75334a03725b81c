//! The result of the energy method.

use serde::Serialize;

/// The energy method's verdict on the session's own gain.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum EnergyVerdict {
    /// The displayed environment never gave more than it took and gives nothing while the hand holds still: stable.
    Passive,
    /// It gives energy all the time while the hand holds still.
    Active,
    /// Neither.
    CannotTell,
}

/// The energy method's answer.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct EnergyAnswer {
    /// Of the worst axis.
    pub verdict: EnergyVerdict,
    /// Why, in a sentence or two.
    pub reason: String,
    /// One per axis of the session.
    pub axes: Vec<AxisEnergy>,
}

/// Energies of one axis.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct AxisEnergy {
    /// Name of the axis.
    pub name: String,
    /// Verdict on this axis.
    pub verdict: EnergyVerdict,
    /// Why.
    pub reason: String,
    /// Times of every series below, s; one in several rows, and the last.
    pub time_s: Vec<f64>,
    /// The master's port: what the displayed environment took, without the dither's work.
    pub master: PortEnergy,
    /// The slave's port: what the real environment took.
    pub slave: PortEnergy,
    /// What the channel between them took, at the master's scale: the master's port less (lambda/mu) times the slave's. Ideal: 0.
    pub two_port: PortEnergy,
    /// What the dither put into the master, J; `None` without a dither.
    pub dither_work_j: Option<f64>,
    /// Time in contact while the hand held still, transients left out, s.
    pub hold_s: f64,
    /// Rows without a value, which count as no work.
    pub missing_rows: usize,
    /// Energy that the master's elements absorbed, by the model; empty where it cannot be computed.
    pub elements: Vec<ElementEnergy>,
    /// RMS of the model's position against the measured one over the latter's RMS; `None` without a model run.
    pub model_misfit: Option<f64>,
    /// Why there are no elements; `None` where there are.
    pub elements_reason: Option<String>,
    /// The classical bounds; `None` where they cannot be computed.
    pub bounds: Option<Bounds>,
    /// Why there are none; `None` where there are.
    pub bounds_reason: Option<String>,
}

/// A passivity observer.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct PortEnergy {
    /// At the end, J.
    pub final_j: f64,
    /// Least, J.
    pub minimum_j: f64,
    /// When, s.
    pub minimum_at_s: f64,
    /// What the position sensor's rounding may have made of it by the end, J (three standard deviations of independent roundings).
    pub rounding_j: f64,
    /// Its trend while the hand held still in contact; `None` without such a hold.
    pub hold: Option<Trend>,
    /// By [`AxisEnergy::time_s`], J.
    pub energy_j: Vec<f64>,
}

/// A mean power and its 95 % interval, W.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Trend {
    /// Mean, W (J/s).
    pub mean_w: f64,
    /// Half the width of its interval, from the scatter of eight pieces of the hold, W.
    pub half_width_w: f64,
}

/// What an element of the master took.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct ElementEnergy {
    /// Name in the model.
    pub name: String,
    /// Kind in the model.
    pub kind: String,
    /// Whether it is dry friction or hysteresis, not a damper.
    pub friction: bool,
    /// At the end, J.
    pub final_j: f64,
    /// While the hand held still in contact, W; `None` without such a hold.
    pub hold_w: Option<f64>,
    /// By [`AxisEnergy::time_s`], J.
    pub energy_j: Vec<f64>,
}

/// Bounds on the stiffness that the master displays at DC, K = mu lambda K_e.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Bounds {
    /// Static stiffness of slave and environment, K_e = -dF_s/dx_c, N/m.
    pub environment_n_per_m: f64,
    /// Where it is from.
    pub environment_from: String,
    /// K at the session's gain, N/m.
    pub displayed_n_per_m: f64,
    /// Viscous damping of the master's own elements to ground, back-EMF among them, b, N s/m.
    pub damping_ns_per_m: f64,
    /// That of the grip, N s/m: it is not in b.
    pub grip_damping_ns_per_m: f64,
    /// Coulomb friction of the master's own elements to ground, f_c, N.
    pub coulomb_n: f64,
    /// Step of the position sensor, Delta, m.
    pub encoder_step_m: f64,
    /// Delay of the loop beyond the hold's T/2, t_d, s: of the connections; the slave's own lag comes on top.
    pub delay_s: f64,
    /// Colgate & Schenkel 1997, b > K (T/2 + t_d) + |B| with B = 0: the largest K, N/m.
    pub colgate_n_per_m: f64,
    /// The gain mu*lambda that it allows.
    pub colgate_gain: f64,
    /// The same with the grip's damping added to b.
    pub colgate_gain_with_grip: f64,
    /// Whether the session's gain is within.
    pub within_colgate: bool,
    /// Abbott & Okamura 2005, K <= min(2 b/(T + 2 t_d), 2 f_c/Delta): the largest K, N/m.
    pub abbott_n_per_m: f64,
    /// The gain mu*lambda that it allows.
    pub abbott_gain: f64,
    /// 2 f_c/Delta alone, N/m; `None` for an ideal sensor, where it is no bound.
    pub abbott_friction_n_per_m: Option<f64>,
    /// Whether the session's gain is within.
    pub within_abbott: bool,
    /// What to know beside them.
    pub notes: Vec<String>,
}
