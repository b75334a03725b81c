//! Laws that are known, in sessions that are simulated.
