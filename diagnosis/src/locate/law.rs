//! A law that an estimated force may follow: on which variable it depends, in which form, and how well it explains the force.

use serde::Serialize;

/// What a force is tabulated against. `x` and `v` are across the place; a reversal is a turning point of `x`.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Variable {
    /// Nothing: a constant.
    Constant,
    /// Direction of motion since the last reversal.
    Direction,
    /// v.
    Velocity,
    /// x.
    Displacement,
    /// dv/dt.
    Acceleration,
    /// x, apart for each direction.
    DisplacementByDirection,
    /// Distance since the last reversal, apart for each direction.
    SinceReversal,
    /// Time since the last reversal, apart for each direction.
    TimeSinceReversal,
    /// x modulo the period that explains most.
    Ripple,
    /// The command at an input, or the reading at an output.
    Signal,
    /// Its rate of change.
    SignalRate,
    /// Time in the recordings.
    Time,
}

/// How a force follows a variable.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Form {
    /// In proportion: one parameter.
    Proportional,
    /// As a polynomial of third order; over velocity with one of second order for each direction that differ only in their even terms' sign:
    /// `c0 + c1 sign(v) + c2 v + c3 v |v|`.
    Smooth,
    /// By its mean in each bin.
    Binned,
}

/// A point of a binned curve.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Point {
    /// Mean of the variable in the bin.
    pub at: f64,
    /// Direction of motion for which it holds: 1, -1, or 0 for both.
    pub direction: i8,
    /// Mean force, N or N m (or the unit of the signal).
    pub mean: f64,
    /// Standard deviation within the bin.
    pub spread: f64,
    /// Samples.
    pub count: usize,
}

/// A law that a latent force may follow.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Law {
    /// On what it depends.
    pub variable: Variable,
    /// How.
    pub form: Form,
    /// Numbers that it has.
    pub numbers: usize,
    /// Share of the force's mean square that it explains.
    pub share: f64,
    /// The same on parts of the recordings that it was not fitted to.
    pub held_out_share: f64,
    /// F statistic against no law, with as many degrees of freedom as there are independent samples.
    pub f_statistic: f64,
    /// Probability of so large a statistic where there is no law.
    pub p_value: f64,
    /// Gain in log-likelihood of the recordings over the smoother without a law. Half the logarithm of the independent samples is subtracted for each
    /// parameter of the law. `None` where it was not computed.
    pub evidence: Option<f64>,
    /// The curve; of a proportional law the bins that it runs through.
    pub curve: Vec<Point>,
    /// Force at each sample of all runs, one after the other.
    #[serde(skip)]
    pub fitted: Vec<f64>,
}
