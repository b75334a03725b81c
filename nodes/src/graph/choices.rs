//! Choices that a graph file states by a word, and that the command line changes.

/// Where the canceller takes the firmness of the grip from.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Hand {
    /// The grip file.
    AsModelled,
    /// The canceller estimates it while the loop runs.
    Estimated,
}

/// What the sensors of a device add to what they measure.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Sensors {
    /// The rounding and noise of the model file.
    AsModelled,
    /// Nothing.
    Ideal,
}

/// Whether a device's limits of force, rate, speed and travel act.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Limits {
    /// As the model file states them.
    Enforced,
    /// None acts.
    Ignored,
}

impl Hand {
    /// Each with its word in a graph file.
    pub const ALL: [(&'static str, Hand); 2] = [("as_modelled", Hand::AsModelled), ("estimated", Hand::Estimated)];

    /// Its word in a graph file.
    pub fn word(self) -> &'static str {
        Hand::ALL[self as usize].0
    }
}

impl Sensors {
    /// Each with its word in a graph file.
    pub const ALL: [(&'static str, Sensors); 2] = [("as_modelled", Sensors::AsModelled), ("ideal", Sensors::Ideal)];

    /// Its word in a graph file.
    pub fn word(self) -> &'static str {
        Sensors::ALL[self as usize].0
    }
}

impl Limits {
    /// Each with its word in a graph file.
    pub const ALL: [(&'static str, Limits); 2] = [("enforced", Limits::Enforced), ("ignored", Limits::Ignored)];

    /// Its word in a graph file.
    pub fn word(self) -> &'static str {
        Limits::ALL[self as usize].0
    }
}
