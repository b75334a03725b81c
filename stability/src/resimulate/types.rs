//! What a run at a gain is asked and what it did.

use crate::outcome::Outcome;
use crate::session::Session;
use backdrive_nodes::build::BuildError;
use backdrive_nodes::sequence::SequenceError;

/// Why a loop cannot be re-simulated.
#[derive(Debug, thiserror::Error)]
pub enum ResimulateError {
    /// A part of the loop is missing.
    #[error("{graph}: has no {kind} node, so there is no loop to re-simulate")]
    NoLoop {
        /// Path of the graph or bag.
        graph: String,
        /// Name of the node kind.
        kind: &'static str,
    },
    /// Nothing would move.
    #[error("{graph}: has no operator, so no hand would move the master; record one, or add it to the graph")]
    NoOperator {
        /// Path of the graph or bag.
        graph: String,
    },
    /// A part of the loop is a program of the user's own.
    #[error("node \"{node}\" is an external program, which cannot be re-simulated; give its model with {option} FILE")]
    OwnProgram {
        /// The node.
        node: String,
        /// The option that puts a model in its place.
        option: &'static str,
    },
    /// The length of the run is not known.
    #[error("{graph}: has no duration_s, so the length of the run must be given with --duration")]
    NoLength {
        /// Path of the graph or bag.
        graph: String,
    },
    /// A gain that is none.
    #[error("mu = {mu}, lambda = {lambda}: gains must be finite, and a product is reached by lambda only where mu is not 0")]
    Gain {
        /// Position scale.
        mu: f64,
        /// Force scale.
        lambda: f64,
    },
    /// A search over no range.
    #[error("a search from {lowest} to {highest} with a tolerance of {tolerance}: bounds and tolerance must be above 0 and in order")]
    Search {
        /// Lowest gain.
        lowest: f64,
        /// Highest gain.
        highest: f64,
        /// Relative width of the bracket at the end.
        tolerance: f64,
    },
    /// A node cannot be built.
    #[error(transparent)]
    Build(#[from] BuildError),
    /// The nodes cannot be joined.
    #[error(transparent)]
    Sequence(#[from] SequenceError),
    /// The master cannot be treated as a linear system.
    #[error("{what}: {error}")]
    Linear {
        /// Which device.
        what: &'static str,
        /// Why.
        error: backdrive_plant::linear::LinearError,
    },
    /// A device cannot be simulated.
    #[error("{what}: {error}")]
    Device {
        /// Which device.
        what: &'static str,
        /// Why.
        error: backdrive_control::device::DeviceError,
    },
    /// The intent cannot be recovered.
    #[error("{name}: the operator's intent cannot be recovered: {why}")]
    Intent {
        /// The session.
        name: String,
        /// Why, and what to do.
        why: String,
    },
    /// A program of the user's own does not start.
    #[error("node \"{node}\": {why}")]
    Own {
        /// The node.
        node: String,
        /// Why.
        why: String,
    },
    /// It was stopped before it was done.
    #[error("stopped before it was done")]
    Cancelled,
}

/// Position and force scale of a run.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Gain {
    /// Position scale, master to slave.
    pub mu: f64,
    /// Force scale, slave to master.
    pub lambda: f64,
}

impl Gain {
    /// mu*lambda.
    pub fn product(&self) -> f64 {
        self.mu * self.lambda
    }
}

/// How a run differs from the recording.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct RunOptions {
    /// Factor on every force of the master's grip: its stiffness and damping.
    pub grip_scale: f64,
    /// Whether the recorded dither is played. It is what the recording needed, not what a user runs.
    pub keep_dither: bool,
    /// Seed of noise and impairments; the graph's own where `None`.
    pub seed: Option<u64>,
    /// Whether the run's signals are kept.
    pub keep_signals: bool,
}

impl Default for RunOptions {
    fn default() -> RunOptions {
        RunOptions { grip_scale: 1.0, keep_dither: false, seed: None, keep_signals: false }
    }
}

/// What a run did.
#[derive(Debug, Clone)]
pub struct Run {
    /// The gain it ran at.
    pub gain: Gain,
    /// The verdict.
    pub outcome: Outcome,
    /// The verdict as it would be if clamps and travel did not count: whether a limited run oscillates as well.
    pub beneath: Outcome,
    /// The frequency at which it oscillated, Hz, where it is not stable; 0 where it ran away without oscillating.
    pub frequency_hz: Option<f64>,
    /// Time in contact, s.
    pub contact_s: f64,
    /// Time in contact while the hand held still, s: the verdict is drawn from its longer pieces.
    pub judged_s: f64,
    /// Steps done; fewer than the scenario has where the master left all bounds.
    pub steps: u64,
    /// The signals, where they were asked for.
    pub signals: Option<Session>,
}

impl Run {
    /// Whether the loop oscillated or ran away, be it against a clamp.
    pub fn is_unstable(&self) -> bool {
        match self.outcome {
            Outcome::Stable | Outcome::NotJudged { .. } => false,
            Outcome::LimitCycle { .. } | Outcome::Unstable { .. } => true,
            Outcome::Limited { .. } => self.beneath.is_unstable(),
        }
    }
}
