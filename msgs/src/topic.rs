//! Topic names and the kind of message each carries.

/// What a topic carries.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, serde::Serialize, serde::Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Kind {
    /// [`crate::Sample`]
    Sample,
    /// [`crate::Gains`]
    Gains,
    /// [`crate::Event`]
    Event,
    /// [`crate::Status`]
    Status,
    /// [`crate::Margin`]
    Margin,
}

/// A topic: an absolute ROS name such as `/master/measured_js`, and what it carries.
#[derive(Debug, Clone, PartialEq, Eq, Hash, serde::Serialize, serde::Deserialize)]
pub struct Topic {
    /// Absolute name.
    pub name: String,
    /// What it carries.
    pub kind: Kind,
}
