//! Stamps of ROS messages.

use serde::{Deserialize, Serialize};

const NS_PER_S: i64 = 1_000_000_000;

/// `builtin_interfaces/Time`.
#[derive(Serialize, Deserialize, Clone, Copy)]
pub(super) struct Time {
    sec: i32,
    nanosec: u32,
}

impl Time {
    /// The nearest time that fits: whole seconds are 32 bits wide.
    pub(super) fn from_ns(ns: i64) -> Time {
        let sec = ns.div_euclid(NS_PER_S);
        match i32::try_from(sec) {
            Ok(sec) => Time { sec, nanosec: ns.rem_euclid(NS_PER_S) as u32 },
            Err(_) if sec < 0 => Time { sec: i32::MIN, nanosec: 0 },
            Err(_) => Time { sec: i32::MAX, nanosec: NS_PER_S as u32 - 1 },
        }
    }

    pub(super) fn to_ns(self) -> i64 {
        i64::from(self.sec) * NS_PER_S + i64::from(self.nanosec)
    }
}
