//! What is searched, and what is found.

use super::law::{Law, Term};
use crate::session::Session;
use serde::Serialize;

/// The signals of a coupled pair of one axis, one value per row.
#[derive(Debug, Clone, Copy)]
pub struct Signals<'a> {
    /// Time of one row, s.
    pub period_s: f64,
    /// Position scale: the slave is to be at mu times the master's position.
    pub mu: f64,
    /// x_m, m or rad.
    pub master: &'a [f64],
    /// x_s, m or rad.
    pub slave: &'a [f64],
    /// Force of the master's motor, N or N m.
    pub master_force: &'a [f64],
    /// Force of the slave's motor, N or N m.
    pub slave_force: &'a [f64],
    /// F_s, force of the environment on the slave, N or N m.
    pub contact: Option<&'a [f64]>,
    /// F_h, force of the hand on the master, N or N m.
    pub hand: Option<&'a [f64]>,
    /// Step of the position sensors, m or rad; 0 where there is none or it is not known.
    pub resolution: f64,
}

impl<'a> Signals<'a> {
    /// Of an axis of a session; `None` where the slave's motion or its motor's force was not recorded.
    pub fn of(session: &'a Session, axis: usize) -> Option<Signals<'a>> {
        let signals = session.axes.get(axis)?;
        let mu = session.mu.iter().copied().find(|m| m.is_finite() && *m != 0.0).unwrap_or(1.0);
        Some(Signals {
            period_s: session.period_s,
            mu,
            master: &signals.master,
            slave: signals.slave.as_deref()?,
            master_force: &signals.force,
            slave_force: signals.slave_force.as_deref()?,
            contact: Some(&signals.contact),
            hand: signals.hand.as_deref(),
            resolution: signals.resolution,
        })
    }

    /// Number of rows that all have.
    pub fn len(&self) -> usize {
        [self.master, self.slave, self.master_force, self.slave_force].iter().map(|c| c.len()).min().unwrap_or(0)
    }

    /// Whether there is no row.
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }
}

/// Why no coupling can be identified.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum NoCoupling {
    /// Too little of it.
    #[error("{seconds:.2} s of complete rows are too short to identify a law")]
    TooShort {
        /// s.
        seconds: f64,
    },
    /// Nothing moves.
    #[error("the {}'s motor does nothing, or nothing moves", if *.master { "master" } else { "slave" })]
    NoMotion {
        /// Of the master, or of the slave.
        master: bool,
    },
}

/// A number with its 95 % interval.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Estimate {
    /// SI units.
    pub value: f64,
    /// 95 % interval; as wide as the value itself where the fit stands at the end of what is looked through.
    pub ci95: [f64; 2],
}

/// A term that a law has.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Gain {
    /// What the coefficient multiplies.
    pub term: Term,
    /// Its coefficient.
    #[serde(flatten)]
    pub estimate: Estimate,
}

/// Another law, and how well it predicts.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Rival {
    /// Its terms.
    pub terms: Vec<Term>,
    /// Share of the force's variance that it leaves in time that the fit has not seen.
    pub unexplained: f64,
}

/// The law of one motor, recovered.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct SideLaw {
    /// Its terms with their coefficients.
    pub gains: Vec<Gain>,
    /// Added, N or N m.
    pub offset: Estimate,
    /// Time constant of the filter of speeds, s; `None` where the law uses no speed.
    pub filter_s: Option<Estimate>,
    /// Delay of the motion in the law, s; `None` where it uses no motion.
    pub delay_s: Option<Estimate>,
    /// Delay of the measured force in the law, s; `None` where it uses none.
    pub force_delay_s: Option<Estimate>,
    /// Largest force, N or N m; `None` where no clamp acted.
    pub limit: Option<f64>,
    /// Share of the force's variance that it leaves in time that the fit has not seen.
    pub unexplained: f64,
    /// RMS of what it leaves there, N or N m.
    pub left: f64,
    /// Upper end of the band in which the motion determines the force, Hz: higher frequencies are not used.
    pub band_hz: f64,
    /// Other laws, the best first.
    pub rivals: Vec<Rival>,
    /// The law in numbers.
    #[serde(skip)]
    pub law: Law,
}

/// What couples two devices.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Kind {
    /// Each motor acts on how far the other side is away: position error, both ways.
    PositionError,
    /// The slave follows the master's position, and the master is given the force measured at the slave.
    ForceReflection,
    /// Both motors act on positions and on measured forces.
    FourChannel,
    /// One of the motors uses nothing of the other side.
    OneWay,
    /// Neither uses the other side.
    Uncoupled,
    /// Another combination.
    Other,
}

impl Kind {
    /// In words.
    pub fn text(self) -> &'static str {
        match self {
            Kind::PositionError => "position error, both ways",
            Kind::ForceReflection => "position to the slave, measured force to the master",
            Kind::FourChannel => "positions and measured forces",
            Kind::OneWay => "one way only",
            Kind::Uncoupled => "none: neither motor depends on the other side",
            Kind::Other => "of another kind",
        }
    }
}

/// The coupling of a pair, recovered from a recording.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Coupling {
    /// Of which kind.
    pub kind: Kind,
    /// The law of the master's motor.
    pub master: SideLaw,
    /// The law of the slave's motor.
    pub slave: SideLaw,
}
