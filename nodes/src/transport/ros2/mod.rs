//! ROS 2 over DDS: the same graph between hosts, with standard messages that any ROS tool and any vendor's DDS sees.
//!
//! In lockstep everything is reliable, because nothing may be lost. In real time samples are best effort: a lost one is never waited for, and a late
//! one is dropped by its sequence number, because its successor is there. Gains, events, status and margin are reliable, and their last few are kept
//! for those that join late. The types on the wire are those of [`backdrive_msgs::ros::live`].
//!
//! Every message of a run is tagged with a key of the run, in the text of standard messages that holds step and sequence, and a node of the run takes
//! nothing else ([`Identity`]). Any ROS tool can still listen.
//!
//! The middleware finds the others by multicast, and on one host without it. Where multicast is not available, a [`Courier`] informs the named peers
//! by unicast.

mod clock;
mod courier;
mod delivery;
mod identity;
mod inbox;
mod key;
mod network;
mod node;
mod order;
pub mod overheard;
mod participant;
mod raw;
mod receiving;
mod refusals;
mod sending;
mod shared;
mod talk;

pub use courier::Courier;
pub use delivery::Delivery;
pub use identity::{Identity, Known, Member};
pub use key::Key;
pub use network::{Interface, MAX_DOMAIN, Network, NetworkError, interfaces};
pub use node::Ros2;
pub use talk::Talk;
