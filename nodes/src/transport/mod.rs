//! How messages get from one node to another. An adapter per transport, one conformance suite for all.

mod bell;
mod board;
mod error;
pub mod iceoryx2;
pub mod inproc;
mod location;
mod ports;
pub mod ros2;

pub use error::TransportError;
pub use location::Location;
pub(crate) use location::name_hash;
pub(crate) use ports::capacity;
pub use ports::{MAX_LISTENERS, Publisher, Subscriber, Transport};

use error::{check_layout, wrong_kind};
