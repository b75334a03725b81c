//! What a sample carries beside its values, and what may be wrong with a payload.

/// What is wrong with a payload.
#[derive(Debug, thiserror::Error)]
pub enum RosError {
    /// It does not start with the encapsulation header of plain CDR.
    #[error("payload starts with {found:02x?}, expected the CDR encapsulation header 00 01 00 00 (or 00 00 00 00, big endian)")]
    Encapsulation {
        /// Its first bytes, at most four.
        found: Vec<u8>,
    },
    /// Its CDR does not hold the expected fields.
    #[error("payload is not a {type_name}: {source}")]
    Cdr {
        /// ROS name of the expected type.
        type_name: &'static str,
        /// The CDR reader's error.
        source: cdr_encoding::Error,
    },
    /// A JointState of somebody else, or one of ours whose step is not stated.
    #[error("JointState with header.frame_id {frame_id:?} was not sent by backdrive: read its fields by name instead")]
    Foreign {
        /// The frame id, cut to 64 bytes.
        frame_id: String,
    },
    /// A JointState of ours whose parts contradict each other.
    #[error("JointState does not fit its header.frame_id: {what}")]
    Inconsistent {
        /// What contradicts what.
        what: String,
    },
}

/// Content of a sample that a `JointState` has no field for.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Facts {
    /// As [`crate::Sample::layout`].
    pub layout: u32,
    /// As [`crate::Sample::source`].
    pub source: u32,
    /// As [`crate::Sample::step`].
    pub step: u64,
    /// As [`crate::Sample::sequence`].
    pub sequence: u64,
    /// As [`crate::Sample::flags`].
    pub flags: u32,
    /// As [`crate::Sample::stamp_ns`], where it is known apart from the header, which holds no time before 1901 or after 2038.
    pub stamp_ns: Option<i64>,
}
