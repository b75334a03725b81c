//! Why a run or a recording was not judged: then it is neither stable nor not.

use serde::Serialize;

/// What keeps a verdict back. None of these is ever a reason to call a loop stable.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(tag = "why", rename_all = "snake_case")]
pub enum Unjudged {
    /// There is no sample of the master, or none of what the slave touches.
    Empty,
    /// No force comes back to the hand: there is no loop that could be unstable.
    NoFeedback,
    /// The slave never touched anything, so a loop that only contact closes never was.
    NoContact,
    /// The loop was closed, but never while the hand held still for long enough.
    NoHold,
    /// Nothing stirs the coupled pair above the frequencies of a hand, so nothing shows that a disturbance dies.
    NotShaken,
    /// How fast an oscillation of the coupled pair dies is not known well enough to say that it does.
    NoDecay,
    /// Samples of the loop are missing or stale: in one gap longer than the loop bridges, or over more than 1 % of the steps.
    Gaps {
        /// Steps without a fresh sample of every signal of the loop.
        steps: usize,
        /// Of this number.
        of: usize,
    },
    /// It ends before the graph's `duration_s`.
    CutShort {
        /// Steps that are there.
        steps: usize,
        /// Of this number.
        of: usize,
    },
    /// The bag was never closed, and its graph has no duration: how much is missing behind its end is not known.
    NotClosed,
    /// A node died or failed while it ran.
    NodeDied,
    /// The recording contradicts itself, or differs from what its graph computes.
    Contradictory,
    /// The models in the bag do not do what was recorded.
    ModelsApart,
    /// Messages were lost.
    Lost {
        /// How many.
        messages: u64,
    },
}

impl Unjudged {
    /// What to do about it, as a sentence.
    pub fn advice(&self) -> &'static str {
        match self {
            Unjudged::Empty => "Record the master's measured topic and the slave's, whose effort is the contact force.",
            Unjudged::NoContact => {
                "Record a push: let the hand press the slave against its environment and hold still for a second (launch/contact.toml \
                 does), or make the run longer."
            }
            Unjudged::NoFeedback => "Judge a gain above 0 (`backdrive stability BAG --gain 0.3`), or run with --lambda above 0.",
            Unjudged::NoHold => {
                "Let the hand hold still while the loop is closed (in contact, where only contact closes it) for one or two seconds. The \
                 minimum is 0.5 s, and 16 steps after the first 0.15 s."
            }
            Unjudged::NotShaken => "Move faster, reverse sharply and touch something, to excite the pair above 8 Hz.",
            Unjudged::NoDecay => "Record longer, with more sharp contacts: ten seconds or more.",
            Unjudged::Gaps { .. } => {
                "Record again with every node running and nothing lost; `backdrive doctor` reports what delays messages on this machine."
            }
            Unjudged::CutShort { .. } => "Let the run go to its end, or ask for a shorter one with --duration.",
            Unjudged::NotClosed => {
                "Record again and let the run end normally or by Ctrl-C; `backdrive bag recover` makes a clean copy of the available \
                 data, but does not restore what is missing."
            }
            Unjudged::Contradictory => {
                "Find out what changed the bag: the notes give topic, factor and time. Count its messages with `backdrive bag info \
                    --check`, or record again."
            }
            Unjudged::ModelsApart => "Find out with `backdrive why` or `backdrive diagnose` what its models leave out.",
            Unjudged::NodeDied => "Find out why the node ended (above), and run again.",
            Unjudged::Lost { .. } => "Run again at a lower rate or with fewer topics, or on a machine with more processors free.",
        }
    }

    /// Whether something is missing that there should be: then the rest may look stable and prove nothing. Without contact or a hold nothing is
    /// missing, but nothing was shown either.
    pub fn is_loss(&self) -> bool {
        !matches!(self, Unjudged::NoFeedback | Unjudged::NoContact | Unjudged::NoHold | Unjudged::NotShaken | Unjudged::NoDecay)
    }
}

impl std::fmt::Display for Unjudged {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self {
            Unjudged::Empty => write!(f, "the master and the contact force were never sampled at the same time"),
            Unjudged::NoContact => write!(f, "the slave was never in contact, so the loop was never closed"),
            Unjudged::NoFeedback => write!(f, "lambda is 0: no force is reflected to the hand, so there is no loop that could be unstable"),
            Unjudged::NoHold => write!(f, "the loop was closed, but never while the hand held still for 0.45 s and 16 steps"),
            Unjudged::NotShaken => write!(f, "nothing excites the pair above 8 Hz, so it is not shown that oscillations decay"),
            Unjudged::NoDecay => {
                write!(f, "the decay rate of the least damped oscillation is too uncertain to show that it decays")
            }
            Unjudged::Gaps { steps, of } => {
                write!(f, "{steps} of {of} steps lack a new sample of some signal of the loop, so the loop was open or unknown there")
            }
            Unjudged::CutShort { steps, of } => write!(f, "it ends after {steps} of the {of} steps of the graph"),
            Unjudged::NotClosed => write!(f, "the bag was cut off, and it is not known how much is missing at its end"),
            Unjudged::Contradictory => write!(f, "the recording contradicts itself or its graph (see the notes)"),
            Unjudged::ModelsApart => write!(f, "the models in the bag do not reproduce the recording"),
            Unjudged::NodeDied => write!(f, "a node died while it ran"),
            Unjudged::Lost { messages } => write!(f, "{messages} messages were lost"),
        }
    }
}

/// Rows at which something is missing, and how the loop bridges it.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Gaps {
    /// Whether a row lacks a fresh sample of a signal of the loop; empty where none does.
    pub at: Vec<bool>,
    /// Longest gap that the loop bridges by holding its last force, s: the graph's `stale_after_s`. Beyond it the nodes let the force go, so
    /// that it is another loop.
    pub bridged_s: f64,
    /// Rows that there should be; 0 where this is not stated.
    pub planned: usize,
}

/// Of a graph that does not say its own.
pub const BRIDGED_S: f64 = 0.02;
/// More of the rows than this must not be missing, as no more may be clamped.
const MOST_MISSING: f64 = 0.01;

impl Gaps {
    /// The rows in gaps longer than what is bridged, as pieces.
    pub fn long(&self, period_s: f64) -> Vec<std::ops::Range<usize>> {
        let least = (self.bridged_s / period_s) as usize;
        let mut found = Vec::new();
        let mut start = None;
        for row in 0..=self.at.len() {
            match (self.at.get(row).copied().unwrap_or(false), start) {
                (true, None) => start = Some(row),
                (false, Some(from)) => {
                    if row - from > least {
                        found.push(from..row);
                    }
                    start = None;
                }
                _ => {}
            }
        }
        found
    }

    /// Why nothing that looks stable in `rows` rows proves that it is; `None` where they are whole.
    pub fn fault(&self, rows: usize, period_s: f64) -> Option<Unjudged> {
        if self.planned > rows.max(self.at.len()) {
            return Some(Unjudged::CutShort { steps: rows, of: self.planned });
        }
        let of = self.at.len().max(rows);
        let steps = self.at.iter().filter(|g| **g).count();
        let most = MOST_MISSING * of as f64;
        (steps as f64 > most || !self.long(period_s).is_empty()).then_some(Unjudged::Gaps { steps, of })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_short_gap_is_bridged_and_a_long_one_or_many_are_not() {
        let gaps = |at: &dyn Fn(usize) -> bool| Gaps { at: (0..10_000).map(at).collect(), bridged_s: 0.02, planned: 10_000 };
        assert_eq!(gaps(&|_| false).fault(10_000, 1e-3), None);
        assert_eq!(gaps(&|row| (500..520).contains(&row)).fault(10_000, 1e-3), None);
        let long = gaps(&|row| (500..521).contains(&row));
        assert_eq!(long.long(1e-3), vec![500..521; 1]);
        assert_eq!(long.fault(10_000, 1e-3), Some(Unjudged::Gaps { steps: 21, of: 10_000 }));
        assert_eq!(gaps(&|row| row % 50 == 0).fault(10_000, 1e-3), Some(Unjudged::Gaps { steps: 200, of: 10_000 }));
        let short = Gaps { at: Vec::new(), bridged_s: 0.02, planned: 10_000 };
        assert_eq!(short.fault(4, 1e-3), Some(Unjudged::CutShort { steps: 4, of: 10_000 }));
        assert_eq!(Gaps::default().fault(4, 1e-3), None);
    }
}
