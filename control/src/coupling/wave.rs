//! Wave variables, with a matched slave.
//!
//! At each end force and velocity become a wave that goes and one that comes, with the wave impedance b (Niemeyer & Slotine,
//! "Stable adaptive teleoperation", IEEE J. Oceanic Eng. 16, 1991; "Telemanipulation with time delays", IJRR 23, 2004):
//! u = (b v + F)/sqrt(2b), w = (b v - F)/sqrt(2b), so that F v = (u^2 - w^2)/2 whatever the delay between.
//!
//! A spring and a damper from the line's end move the slave. With the damper equal to b ("matched") the arriving wave goes into the motion of the
//! slave, and none of it is reflected (2004, section 5). Because integrals of waves are sent ([`super::wave_line`]), what is lost on the way does not
//! make the positions drift apart; where the two began counts as the same.

use super::proxy::Proxy;
use super::side::{Far, Near, Own, Packet};
use super::wave_line::{Receiver, Sender};

/// Settings; all of the slave's units.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Settings {
    /// Wave impedance b, N s/m or N m s/rad: above it moving is heavy, below it contact is soft.
    pub impedance: f64,
    /// Stiffness of the slave's spring, N/m or N m/rad.
    pub stiffness: f64,
    /// Damping of the slave's spring, N s/m or N m s/rad; the wave impedance where `None`: matched.
    pub damping: Option<f64>,
    /// Inertia that is moved by it, kg or kg m2.
    pub mass: f64,
}

impl Settings {
    /// For a hand-held device in translation.
    pub const DEFAULT: Settings = Settings { impedance: 20.0, stiffness: 2000.0, damping: None, mass: 0.2 };
}

/// The side at the master: an end of the line that moves with the master.
#[derive(Debug)]
pub struct NearSide {
    impedance: f64,
    sender: Sender,
    receiver: Receiver,
}

impl NearSide {
    /// At rest.
    pub fn new(settings: &Settings) -> NearSide {
        NearSide { impedance: settings.impedance, sender: Sender::default(), receiver: Receiver::default() }
    }
}

impl Near for NearSide {
    fn step(&mut self, own: &Own, heard: Option<&Packet>, period_s: f64) -> (f64, Packet) {
        let root = (2.0 * self.impedance).sqrt();
        let back = self.receiver.receive(heard, period_s);
        let against = self.impedance * own.velocity - root * back;
        (-against, self.sender.send(root * own.velocity - back, period_s))
    }
}

/// The side at the slave: an end of the line, a spring with a damper, and the inertia that they move.
#[derive(Debug)]
pub struct FarSide {
    impedance: f64,
    stiffness: f64,
    damping: f64,
    stretched: f64,
    proxy: Proxy,
    began: bool,
    sender: Sender,
    receiver: Receiver,
}

impl FarSide {
    /// At rest where the slave is at its first step.
    pub fn new(settings: &Settings) -> FarSide {
        FarSide {
            impedance: settings.impedance,
            stiffness: settings.stiffness,
            damping: settings.damping.unwrap_or(settings.impedance),
            stretched: 0.0,
            proxy: Proxy::new(settings.mass, 0.0),
            began: false,
            sender: Sender::default(),
            receiver: Receiver::default(),
        }
    }

    /// Energy in the spring and the moved inertia, J.
    pub fn stored(&self) -> f64 {
        0.5 * self.stiffness * self.stretched.powi(2) + self.proxy.energy()
    }
}

impl Far for FarSide {
    fn step(&mut self, own: &Own, heard: Option<&Packet>, period_s: f64) -> (f64, Packet) {
        if !self.began {
            self.proxy.position = own.position;
            self.began = true;
        }
        let b = self.impedance;
        let wave = self.receiver.receive(heard, period_s);
        // Spring, damper, inertia and line are solved together at the end of the step, so that none of them creates energy.
        let grip = self.damping + period_s * self.stiffness;
        let (a, c) = self.proxy.answer(period_s);
        let free = a + c * own.force;
        let force = (grip * ((2.0 / b).sqrt() * wave - free) + self.stiffness * self.stretched) / (1.0 + grip / b + grip * c);
        let end = (2.0 / b).sqrt() * wave - force / b;
        self.proxy.advance(force + own.force, period_s);
        self.stretched += period_s * (end - self.proxy.velocity);
        (self.proxy.position, self.sender.send(wave - (2.0 / b).sqrt() * force, period_s))
    }
}
