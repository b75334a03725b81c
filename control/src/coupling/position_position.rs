//! Position-position: each side pulls its device to where the other was when last heard, and damps its own.
//!
//! Master: F = K (x_s(t - T2) - x_m) - B v_m. Slave: F = K (x_m(t - T1) - x_s) - B v_s, on an inertia that stands for it. With B >= K (T1 + T2)/2 at
//! both sides its energy stays bounded by the energy from hand and environment, for every delay up to these, constant or varying. Sources: Lee &
//! Spong ("Passive bilateral teleoperation with constant time delay", IEEE Trans. Robotics 22, 2006) and Nuño, Basañez & Ortega ("Passivity-based
//! control for bilateral teleoperation: a tutorial", Automatica 47, 2011: P+d controllers, 4 B_m B_s > (T1 + T2)^2 K^2). No force is measured and
//! positions never drift; moving freely is as heavy as the damping.
//!
//! Packets: position and velocity of the own device, both ways.

use super::proxy::Proxy;
use super::side::{Conditions, Far, Near, Own, Packet};

/// Settings; all of the slave's units.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Settings {
    /// Stiffness K between the two, N/m or N m/rad.
    pub stiffness: f64,
    /// Damping B at each side, N s/m or N m s/rad; what stability needs and 10 % more, and at least critical, where `None`.
    pub damping: Option<f64>,
    /// Inertia that stands for the slave, kg or kg m2.
    pub mass: f64,
}

impl Settings {
    /// For a hand-held device in translation.
    pub const DEFAULT: Settings = Settings { stiffness: 1000.0, damping: None, mass: 0.2 };

    /// The least damping that is passive with delays whose sum is `round_trip_s`, N s/m or N m s/rad.
    pub fn least_damping(&self, round_trip_s: f64) -> f64 {
        0.5 * self.stiffness * round_trip_s
    }

    /// The damping in force.
    pub fn damping_for(&self, conditions: &Conditions) -> f64 {
        let critical = 2.0 * (self.stiffness * self.mass).sqrt();
        self.damping.unwrap_or_else(|| critical.max(1.1 * self.least_damping(conditions.round_trip_s)))
    }
}

/// The side at the master.
#[derive(Debug)]
pub struct NearSide {
    stiffness: f64,
    damping: f64,
    other: Option<f64>,
}

impl NearSide {
    /// At rest; there is no spring before the first packet.
    pub fn new(settings: &Settings, conditions: &Conditions) -> NearSide {
        NearSide { stiffness: settings.stiffness, damping: settings.damping_for(conditions), other: None }
    }
}

impl Near for NearSide {
    fn step(&mut self, own: &Own, heard: Option<&Packet>, _period_s: f64) -> (f64, Packet) {
        self.other = heard.map(|h| h.position).or(self.other);
        let pull = self.other.map_or(0.0, |other| self.stiffness * (other - own.position));
        (pull - self.damping * own.velocity, Packet { position: own.position, velocity: own.velocity, effort: 0.0 })
    }
}

/// The side at the slave.
#[derive(Debug)]
pub struct FarSide {
    stiffness: f64,
    proxy: Proxy,
    other: Option<f64>,
    began: bool,
}

impl FarSide {
    /// At rest where the slave is at its first step.
    pub fn new(settings: &Settings, conditions: &Conditions) -> FarSide {
        let proxy = Proxy::new(settings.mass, settings.damping_for(conditions));
        FarSide { stiffness: settings.stiffness, proxy, other: None, began: false }
    }
}

impl Far for FarSide {
    fn step(&mut self, own: &Own, heard: Option<&Packet>, period_s: f64) -> (f64, Packet) {
        if !self.began {
            self.proxy.position = own.position;
            self.began = true;
        }
        self.other = heard.map(|h| h.position).or(self.other);
        if let Some(other) = self.other {
            // The spring at the end of the step, which depends on the velocity that it causes.
            let (a, c) = self.proxy.answer(period_s);
            let stretched = other - self.proxy.position - period_s * (a + c * own.force);
            let pull = self.stiffness * stretched / (1.0 + self.stiffness * period_s * c);
            self.proxy.advance(pull + own.force, period_s);
        }
        (self.proxy.position, Packet { position: self.proxy.position, velocity: self.proxy.velocity, effort: 0.0 })
    }
}
