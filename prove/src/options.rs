//! What a proof is asked for.

use std::path::PathBuf;

/// What a proof is asked for, every value resolved.
#[derive(Debug, Clone)]
pub struct Options {
    /// What is concealed is drawn from this; further cases from the numbers after it.
    pub seed: u64,
    /// Effects concealed at once.
    pub effects: usize,
    /// How many cases.
    pub cases: usize,
    /// Conceal only what no linear model can imitate.
    pub nonlinear: bool,
    /// Folder of the cases; a truth that is there already is not drawn again.
    pub out: PathBuf,
    /// The nominal master.
    pub model: PathBuf,
    /// The nominal grip.
    pub grip: PathBuf,
    /// The shape of the second-order model that is fitted for comparison.
    pub second_order: PathBuf,
    /// The session that is recorded, a graph with experiments.
    pub session: PathBuf,
    /// The task in which the gain is raised.
    pub contact: PathBuf,
    /// The same task with a hand that changes its grip while it pushes.
    pub regrip: PathBuf,
    /// Corner of the high-pass of the cancellers that do not estimate the hand, while the gain is raised, Hz.
    pub high_pass_hz: f64,
    /// How much a diagnosis searches, as a multiple of the default; more where nobody measured the hand.
    pub effort: f64,
    /// A limit on the clock for each diagnosis, s.
    pub patience_s: f64,
    /// Which cases hide what the hand wants.
    pub operator: Operator,
    /// Which cases have a nominal model that was refitted to the hidden plant.
    pub nominal: Nominal,
    /// Up to which frequency a hand moves that nobody measured, Hz.
    pub hand_bandwidth_hz: f64,
    /// Factors on the grip of the session for further runs at each gain; `None`: that grip alone, and no hand that changes it.
    pub grips: Option<Vec<f64>>,
    /// Whether the graph itself is run about the stability limits, as processes.
    pub live: bool,
    /// Whether the gain is raised at all; without, a case is concealed, recorded and diagnosed.
    pub gains: bool,
    /// The program of the hidden plant.
    pub plant: PathBuf,
    /// The program `backdrive`, whose verbs `run`, `diagnose` and `fit` do the work of a case in processes of their own.
    pub backdrive: PathBuf,
}

/// Which cases hide what the hand wants.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Operator {
    /// None.
    Shown,
    /// All.
    Hidden,
    /// Every second one.
    Half,
}

impl Operator {
    /// Whether the bags of a case hold what the hand wants, counted from 0.
    pub fn is_shown(self, case: usize) -> bool {
        match self {
            Operator::Shown => true,
            Operator::Hidden => false,
            Operator::Half => case.is_multiple_of(2),
        }
    }
}

/// Which cases have a nominal model that was refitted to the hidden plant.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Nominal {
    /// None: its parameters are off as they were drawn.
    Given,
    /// All.
    Refitted,
    /// Two of every four.
    Half,
}

impl Nominal {
    /// Whether the nominal model of a case is refitted, counted from 0.
    pub fn is_refitted(self, case: usize) -> bool {
        match self {
            Nominal::Given => false,
            Nominal::Refitted => true,
            Nominal::Half => case % 4 >= 2,
        }
    }
}
