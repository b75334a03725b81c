//! Pure cores: what the nodes of a graph compute, without clock, I/O or allocation while stepping.

pub mod canceller;
pub mod changing_grip;
pub mod controller;
pub mod core;
pub mod coupling;
pub mod cycle;
pub mod device;
pub mod dynamometer;
pub mod engine;
pub mod exciter;
pub mod freshness;
pub mod guard;
pub mod hand;
pub mod live_margin;
pub mod margins;
pub mod master;
pub mod mechanism;
mod motor;
pub mod observer;
pub mod operator;
pub mod rig;
pub mod scaling;
pub mod shaft;
pub mod slave;
pub mod speed_control;
