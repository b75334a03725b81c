//! Position forward, measured contact force back: plain scaling, as two sides of a link.
//!
//! Packets: forward the position that the slave shall have; back the force of the environment on the slave as effort. It is passive
//! with no delay at all, and only where the slave is where it shall be.

use super::side::{Far, Near, Own, Packet};

/// The side at the master: it plays the newest contact force.
#[derive(Debug, Default)]
pub(super) struct NearSide {
    contact: f64,
}

impl Near for NearSide {
    fn step(&mut self, own: &Own, heard: Option<&Packet>, _period_s: f64) -> (f64, Packet) {
        if let Some(heard) = heard {
            self.contact = heard.effort;
        }
        (self.contact, Packet { position: own.position, ..Packet::default() })
    }
}

/// The side at the slave: it follows the newest position.
#[derive(Debug, Default)]
pub(super) struct FarSide {
    command: Option<f64>,
}

impl Far for FarSide {
    fn step(&mut self, own: &Own, heard: Option<&Packet>, _period_s: f64) -> (f64, Packet) {
        if let Some(heard) = heard {
            self.command = Some(heard.position);
        }
        (self.command.unwrap_or(own.position), Packet { position: own.position, effort: own.force, ..Packet::default() })
    }
}
