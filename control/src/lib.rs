//! Pure cores: what the nodes of a graph compute, without clock, I/O or allocation while stepping.

pub mod core;
