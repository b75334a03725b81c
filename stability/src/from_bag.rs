//! A session from a bag of ours: the graph in the bag tells which topic is which signal.

use crate::bag_rows::{Place, Rows};
use crate::long_bag;
pub use crate::long_bag::MOST_ROWS;
use crate::session::{AxisSignals, Session};
use crate::unjudged::Unjudged;
use backdrive_bags::{BagError, Reader};
use backdrive_nodes::graph::Graph;
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
        /// What cannot be told without it.
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

/// The signals of a session: what they are, and what cannot be told without them.
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

    /// What cannot be told where it is missing.
    pub(crate) fn without(self) -> &'static str {
        match self {
            SignalRole::Master => "neither the induced motion nor the loop can be told, nor whether the master oscillates",
            SignalRole::Force => "neither how the master answers a force nor the loop can be told",
            SignalRole::Command => "neither how the slave answers a command nor the loop can be told",
            SignalRole::Contact => "neither what the slave touches nor the loop can be told",
            SignalRole::Slave => "the environment's impedance is told against the command in place of the slave's motion",
            SignalRole::Dither => "the master's answer to a force can be told against a recorded operator only",
            SignalRole::Intent => "the loop cannot be run again with this hand, and rest is told by the signals alone",
            SignalRole::Induced => "what was cancelled is not known from the record",
            SignalRole::SlaveForce => "the law that couples the two motors cannot be told",
            SignalRole::Sensor => "its faults are not known",
            SignalRole::Hand => "a coupling that carries the hand's force to the slave cannot be told",
        }
    }
}

impl Session {
    /// Reads a bag of ours; `graph` is the one that made it.
    ///
    /// Rows are steps, from the first that any signal has to the last. What a topic lacks is NaN and counted in the notes.
    ///
    /// A bag of more than [`MOST_ROWS`] steps (of one axis; of several as many fewer) is read in pieces of so many, one after the other, so that
    /// memory does not grow with its length. What the recording did is told of all of them ([`Session::elsewhere`]); the rows are those of
    /// the piece that did worst, of equals the first.
    ///
    /// # Errors
    /// A damaged bag; x_m, F_f, x_c or F_s missing; steps that make no rows.
    pub fn from_bag(reader: &Reader, graph: &Graph) -> Result<Session, SessionError> {
        Session::from_bag_in_pieces(reader, graph, MOST_ROWS)
    }

    /// The same with pieces of another length, rows of one axis.
    pub fn from_bag_in_pieces(reader: &Reader, graph: &Graph, most_rows: usize) -> Result<Session, SessionError> {
        let place = Place::of(reader, graph)?;
        let longest = reader.counts().iter().max().copied().unwrap_or(0);
        let most = (most_rows / place.axes.max(1)).max(1) as u64;
        if longest > most {
            return long_bag::read(reader, graph, &place, most);
        }
        let mut rows = Rows::of(&place);
        for entry in reader.messages()? {
            rows.take(&place, &entry?)?;
        }
        rows.session(reader, graph, &place)
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
