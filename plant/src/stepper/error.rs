//! Why a model cannot be stepped.

/// Why a model cannot be stepped.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum CompileError {
    /// The sample period is no period.
    #[error("the sample period must be above 0 s, not {0}")]
    Period(f64),
    /// Substeps were asked for, but none.
    #[error("the number of substeps must be from 1 to 100000, not {0}")]
    Substeps(usize),
    /// Nothing resists the body's acceleration.
    #[error("body `{0}` moves freely but has no inertia; give it one, an inerter, or a motion input")]
    Massless(String),
    /// A number that is none, or is out of its range.
    #[error("{place}: {key} must be {expected}, not {value}")]
    Number {
        /// Such as "body `drum`".
        place: String,
        /// The key.
        key: &'static str,
        /// What it may be.
        expected: &'static str,
        /// What it is.
        value: f64,
    },
    /// A number of an element that is out of range or does not go with another.
    #[error("element `{element}`: {reason}")]
    Element {
        /// The element.
        element: String,
        /// One sentence.
        reason: String,
    },
    /// A place, an element or an input that the model does not have.
    #[error("{0} names something that the model does not have")]
    Dangling(String),
    /// An input that a point cannot have.
    #[error(
        "input `{input}` acts on `{point}`, a point of the robot: it can push there, and neither prescribe a motion nor lose force by back-EMF"
    )]
    AtPoint {
        /// The input.
        input: String,
        /// The point.
        point: String,
    },
    /// Two motion inputs on one body.
    #[error("inputs `{first}` and `{second}` both prescribe the motion of body `{body}`")]
    MovedTwice {
        /// The body.
        body: String,
        /// An input.
        first: String,
        /// Another.
        second: String,
    },
    /// A reaction is only there where a motion input is.
    #[error("output `{output}` reads the reaction of body `{body}`, which has no motion input")]
    NoReaction {
        /// The output.
        output: String,
        /// The body.
        body: String,
    },
    /// Nothing determines the motion.
    #[error("the equations of motion are singular; a negative stiffness or damping is too large")]
    Singular,
    /// A column of samples is missing.
    #[error("there are no samples for input `{0}`")]
    MissingInput(String),
    /// More than the stepper holds.
    #[error("{count} {what}; at most {limit} are possible")]
    TooMany {
        /// Such as "bodies".
        what: &'static str,
        /// How many.
        count: usize,
        /// How many are possible.
        limit: usize,
    },
}
