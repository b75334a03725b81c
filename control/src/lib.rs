//! Pure cores: what the nodes of a graph compute, without clock, I/O or allocation while stepping.

pub mod canceller;
pub mod core;
pub mod device;
pub mod exciter;
pub mod freshness;
pub mod guard;
pub mod live_margin;
pub mod margins;
pub mod master;
pub mod mechanism;
pub mod operator;
pub mod scaling;
pub mod slave;
