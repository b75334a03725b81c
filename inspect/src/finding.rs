//! What is wrong with a recording, or what should be known of it.

use serde::Serialize;

/// What a finding is about.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum FindingKind {
    /// A value never changes while its joint moves.
    Stuck,
    /// A signal stands at a limit that it would exceed.
    Clipped,
    /// A signal was logged without its sign.
    Rectified,
    /// The step of a signal is coarse beside its motion.
    Quantised,
    /// Single samples that no device can have made.
    Outliers,
    /// Values that are missing, or no numbers.
    Missing,
    /// Samples are missing: the clock jumps.
    Gap,
    /// The clock goes back.
    TimeGoesBack,
    /// Times stand in more than one row.
    DuplicateTimes,
    /// The steps of the clock are uneven.
    Jitter,
    /// A stretch repeats one value while its joint moves.
    Frozen,
    /// A stretch of rows stands in the file twice.
    Repeated,
    /// A signal was sampled at a lower rate and filled up.
    Resampled,
    /// A signal was low-pass filtered.
    Filtered,
    /// A signal is in another unit than its partner.
    WrongUnit,
    /// A signal has the opposite sign of its partner.
    WrongSign,
    /// A signal is a multiple of its partner.
    WrongScale,
    /// Two columns of a joint are exchanged.
    SwappedColumns,
    /// A command is later than the position that follows it.
    CommandLate,
    /// A velocity is late or early beside the derivative of its position.
    VelocityLag,
    /// A velocity is not the derivative of its position.
    NotTheDerivative,
    /// A torque or current lags the motion that it makes.
    EffortLag,
    /// The zero of a position differs between recordings.
    ZeroShifted,
    /// The columns of two joints are exchanged.
    JointsExchanged,
    /// A joint moves without a command or without torque.
    Passive,
    /// A joint moves at a limit of its speed while the command goes on.
    RateLimit,
    /// A command and its position are the same column.
    CommandIsPosition,
}

/// How much a finding matters.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Weight {
    /// To be known; the recording can be used.
    Note,
    /// The recording is wrong, or what is concluded from it would be.
    Wrong,
}

/// One finding.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Finding {
    /// What it is about.
    pub kind: FindingKind,
    /// How much it matters.
    pub weight: Weight,
    /// The file, with the episode of a dataset.
    pub file: String,
    /// The columns that it is about, as in the file.
    pub signals: Vec<String>,
    /// The joint, where there is one.
    pub joint: Option<String>,
    /// First and last row of the first place, from 1 (of text the line of the file); `None` where it is true of the whole file.
    pub rows: Option<[usize; 2]>,
    /// Times of these rows, s.
    pub time_s: Option<[f64; 2]>,
    /// A sentence.
    pub message: String,
    /// What to do: lines to paste into a set, or a sentence where no line does it.
    pub todo: String,
    /// Probability that it is so, 0 to 1.
    pub sure: f64,
}

impl Finding {
    /// A finding that is wrong and sure, of a whole file.
    pub fn new(kind: FindingKind, file: &str, signals: &[&str], message: impl Into<String>) -> Finding {
        Finding {
            kind,
            weight: Weight::Wrong,
            file: file.to_string(),
            signals: signals.iter().map(ToString::to_string).collect(),
            joint: None,
            rows: None,
            time_s: None,
            message: message.into(),
            todo: String::new(),
            sure: 0.99,
        }
    }

    /// With this weight.
    #[must_use]
    pub fn weighing(mut self, weight: Weight) -> Finding {
        self.weight = weight;
        self
    }

    /// At this joint.
    #[must_use]
    pub fn at(mut self, joint: &str) -> Finding {
        self.joint = Some(joint.to_string()).filter(|joint| !joint.is_empty());
        self
    }

    /// With what to do.
    #[must_use]
    pub fn todo(mut self, todo: impl Into<String>) -> Finding {
        self.todo = todo.into();
        self
    }

    /// As sure as this, 0 to 1.
    #[must_use]
    pub fn sure(mut self, sure: f64) -> Finding {
        self.sure = sure;
        self
    }
}
