//! What couples master and slave over a link: laws that are rivals of plain scaling with a canceller.
//!
//! A law has two sides. The side at the master ([`Near`]) receives the motion of the master and computes the reflected force. The side at the slave
//! ([`Far`]) receives the contact force and computes the command for the slave. They know of each other only by the [`Packet`]s that cross the link,
//! so that delay, jitter and loss act on these and on nothing else.
//!
//! Everything here is in the slave's units: the node ([`node`]) multiplies the master's motion by mu before it hands it to a law,
//! and the law's force by lambda behind it. Power at the master is then lambda/mu times power here, so that a law that is passive
//! here is passive with any scales above 0 (Niemeyer & Slotine 2004, section 4). A force that acts along +x is positive.
//!
//! | law | file | source |
//! |---|---|---|
//! | position forward, force back | `direct.rs` | as plain scaling |
//! | wave variables | `wave.rs`, `wave_line.rs` | Niemeyer & Slotine 1991, 1998, 2004 |
//! | time-domain passivity | `passivity.rs` | Hannaford & Ryu 2002; Ryu, Artigas & Preusche 2010 |
//! | position-position | `position_position.rs` | Lee & Spong 2006; Nuño, Basañez & Ortega 2011 |
//! | four channels | `four_channel.rs` | Lawrence 1993; Hashtrudi-Zaad & Salcudean 2002 |
//! | virtual coupling | `virtual_coupling.rs` | Colgate & Schenkel 1997; Adams & Hannaford 1999 |

mod direct;
pub mod four_channel;
pub mod node;
pub mod passivity;
pub mod position_position;
mod proxy;
mod side;
#[cfg(test)]
mod tests;
mod velocity;
pub mod virtual_coupling;
pub mod wave;
pub mod wave_line;

pub use side::{Conditions, Far, Near, Own, Packet};

use serde::Serialize;

/// A law with its settings.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Law {
    /// Position forward, measured force back.
    Direct,
    /// Wave variables.
    Wave(wave::Settings),
    /// Passivity observer and controller at both ports.
    Passivity(passivity::Settings),
    /// Both positions are sent, a spring pulls them together.
    PositionPosition(position_position::Settings),
    /// Positions and forces both ways.
    FourChannel(four_channel::Settings),
    /// Spring and damper in front of what is touched, damping at the master.
    VirtualCoupling(virtual_coupling::Settings),
}

/// Which law it is.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum LawKind {
    /// Position forward, measured force back.
    Direct,
    /// Wave variables.
    Wave,
    /// Passivity observer and controller at both ports.
    Passivity,
    /// Both positions are sent, a spring pulls them together.
    PositionPosition,
    /// Positions and forces both ways.
    FourChannel,
    /// Spring and damper in front of what is touched, damping at the master.
    VirtualCoupling,
}

impl LawKind {
    /// All of them with their names, in graph files and on the command line.
    pub const ALL: [(&'static str, LawKind); 6] = [
        ("direct", LawKind::Direct),
        ("wave", LawKind::Wave),
        ("passivity", LawKind::Passivity),
        ("position_position", LawKind::PositionPosition),
        ("four_channel", LawKind::FourChannel),
        ("virtual_coupling", LawKind::VirtualCoupling),
    ];

    /// Its name in graph files.
    pub fn name(self) -> &'static str {
        LawKind::ALL.iter().find(|(_, kind)| *kind == self).map_or("", |(name, _)| name)
    }

    /// The law at its defaults.
    pub fn usual(self) -> Law {
        match self {
            LawKind::Direct => Law::Direct,
            LawKind::Wave => Law::Wave(wave::Settings::DEFAULT),
            LawKind::Passivity => Law::Passivity(passivity::Settings::DEFAULT),
            LawKind::PositionPosition => Law::PositionPosition(position_position::Settings::DEFAULT),
            LawKind::FourChannel => Law::FourChannel(four_channel::Settings::DEFAULT),
            LawKind::VirtualCoupling => Law::VirtualCoupling(virtual_coupling::Settings::DEFAULT),
        }
    }
}

impl Law {
    /// Which law it is.
    pub fn kind(&self) -> LawKind {
        match self {
            Law::Direct => LawKind::Direct,
            Law::Wave(_) => LawKind::Wave,
            Law::Passivity(_) => LawKind::Passivity,
            Law::PositionPosition(_) => LawKind::PositionPosition,
            Law::FourChannel(_) => LawKind::FourChannel,
            Law::VirtualCoupling(_) => LawKind::VirtualCoupling,
        }
    }

    /// Its name in graph files.
    pub fn name(&self) -> &'static str {
        self.kind().name()
    }

    /// Whether it needs to know the force of the hand on the master.
    pub fn needs_hand(&self) -> bool {
        matches!(self, Law::FourChannel(_))
    }

    /// The side at the master.
    pub fn near(&self, conditions: &Conditions) -> Box<dyn Near> {
        match self {
            Law::Direct => Box::new(direct::NearSide::default()),
            Law::Wave(settings) => Box::new(wave::NearSide::new(settings)),
            Law::Passivity(settings) => Box::new(passivity::NearSide::new(settings, conditions)),
            Law::PositionPosition(settings) => Box::new(position_position::NearSide::new(settings, conditions)),
            Law::FourChannel(settings) => Box::new(four_channel::NearSide::new(settings)),
            Law::VirtualCoupling(settings) => Box::new(virtual_coupling::NearSide::new(settings, conditions)),
        }
    }

    /// The side at the slave.
    pub fn far(&self, conditions: &Conditions) -> Box<dyn Far> {
        match self {
            Law::Direct => Box::new(direct::FarSide::default()),
            Law::Wave(settings) => Box::new(wave::FarSide::new(settings)),
            Law::Passivity(settings) => Box::new(passivity::FarSide::new(settings, conditions)),
            Law::PositionPosition(settings) => Box::new(position_position::FarSide::new(settings, conditions)),
            Law::FourChannel(settings) => Box::new(four_channel::FarSide::new(settings)),
            Law::VirtualCoupling(settings) => Box::new(virtual_coupling::FarSide::new(settings, conditions)),
        }
    }
}
