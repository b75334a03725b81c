//! The signals of a session, and why a recording does not make one.

use crate::session::AxisSignals;
use crate::unjudged::Unjudged;
use backdrive_bags::{BagError, Reader};
use backdrive_plant::tomlfile::FileError;
use std::path::PathBuf;

/// Why a bag cannot be read as a session.
#[derive(Debug, thiserror::Error)]
pub enum SessionError {
    /// The bag cannot be read.
    #[error(transparent)]
    Bag(#[from] BagError),
    /// A roles file cannot be read.
    #[error(transparent)]
    Roles(#[from] FileError),
    /// A signal that no answer can do without.
    #[error("{}: {signal} is missing: {why}; without it {without}", path.display())]
    Missing {
        /// The bag.
        path: PathBuf,
        /// Such as `F_s, the force of the environment on the slave`.
        signal: &'static str,
        /// Why.
        why: String,
        /// What cannot be determined without it.
        without: &'static str,
    },
    /// The messages make no rows.
    #[error("{}: {what}", path.display())]
    Rows {
        /// The bag.
        path: PathBuf,
        /// What is wrong, and what to do.
        what: String,
    },
    /// A storage that is not read.
    #[error("{}: {what}", path.display())]
    Storage {
        /// File or folder.
        path: PathBuf,
        /// What it is, and how to convert it.
        what: String,
    },
}

/// The signals of a session: what they are, and what cannot be determined without them.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum SignalRole {
    Master,
    Force,
    Command,
    Contact,
    Slave,
    Dither,
    Intent,
    Induced,
    SlaveForce,
    Hand,
    /// Another sensor, which no answer needs.
    Sensor,
}

impl SignalRole {
    /// For messages.
    pub(crate) fn text(self) -> &'static str {
        match self {
            SignalRole::Master => "x_m, the master's measured position",
            SignalRole::Force => "F_f, the force applied to the master",
            SignalRole::Command => "x_c, the slave's commanded position",
            SignalRole::Contact => "F_s, the force of the environment on the slave",
            SignalRole::Slave => "x_s, the slave's position",
            SignalRole::Dither => "the dither",
            SignalRole::Intent => "x_u, the operator's intent",
            SignalRole::Induced => "the canceller's predicted induced motion",
            SignalRole::SlaveForce => "tau_s, the force of the slave's motor",
            SignalRole::Hand => "F_h, the force of the hand on the master",
            SignalRole::Sensor => "another sensor",
        }
    }

    /// What cannot be determined where it is missing.
    pub(crate) fn without(self) -> &'static str {
        match self {
            SignalRole::Master => "the induced motion, the loop and oscillations of the master cannot be identified",
            SignalRole::Force => "the response of the master to a force, and the loop, cannot be identified",
            SignalRole::Command => "the response of the slave to a command, and the loop, cannot be identified",
            SignalRole::Contact => "contact and the loop cannot be identified",
            SignalRole::Slave => "the environment's impedance is computed from the command instead of the slave's motion",
            SignalRole::Dither => "the master's response to a force can be identified only with a recorded operator",
            SignalRole::Intent => "the loop cannot be re-simulated with this hand, and rest is detected from the signals alone",
            SignalRole::Induced => "the cancelled motion is not known from the record",
            SignalRole::SlaveForce => "the law that couples the two motors cannot be identified",
            SignalRole::Sensor => "its faults are not known",
            SignalRole::Hand => "a coupling that transmits the hand's force to the slave cannot be identified",
        }
    }
}

/// Whether the end of a run of `planned` steps (0: until it was stopped) is not in its bag, which holds `rows` steps of it.
pub fn cut_short(reader: &Reader, planned: usize, rows: usize) -> Option<Unjudged> {
    if planned > rows {
        return Some(Unjudged::CutShort { steps: rows, of: planned });
    }
    let recovered = reader.completeness().is_some_and(|c| c.recovered);
    // A bag that was recovered and has every step of the plan is whole.
    (!reader.ended_cleanly() || (recovered && planned == 0)).then_some(Unjudged::NotClosed)
}

/// The signals that no answer can do without.
pub(crate) fn required(axis: &AxisSignals) -> [(SignalRole, &Vec<f64>); 4] {
    [
        (SignalRole::Master, &axis.master),
        (SignalRole::Force, &axis.force),
        (SignalRole::Command, &axis.command),
        (SignalRole::Contact, &axis.contact),
    ]
}
