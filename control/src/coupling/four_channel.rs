//! Four channels: positions and forces both ways.
//!
//! Lawrence, "Stability and transparency in bilateral teleoperation", IEEE Trans. Robotics and Automation 9, 1993, with the choice that is
//! transparent: C1 = Z_s + C_s, C2 = C3 = 1, C4 = -(Z_m + C_m). The slave's side is exact, for the inertia that stands for the slave is the law's
//! own: x_s = x_m + d, where M d'' + B d' + K d = F_hand + F_environment. At the master C_m = B + K/s acts between the positions, and the term of its
//! inertia Z_m = m s needs the slave's acceleration. That is not differentiated but computed from forces: a_s = a_m + d'' with m a_m = F_hand + F,
//! for which the hand's force is known here. The source is Hashtrudi-Zaad & Salcudean ("Transparency in time-delayed systems and the effect of local
//! force feedback", IEEE Trans. Robotics and Automation 18, 2002). As F then depends on the F of the step before, only a share of the inertia may be
//! taken away, below 1. Without `master_mass` the term is left out, and the hand feels the master's inertia.
//!
//! With ideal parts and no delay the impedance that the hand feels is that of the environment and of the remaining inertia. With a delay it is not passive.
//!
//! Packets: forward position, acceleration (as velocity) and force of the hand; back x_s + (B/K) v_s as position, the slave's
//! acceleration (as velocity) and the force of the environment.

use super::proxy::Proxy;
use super::side::{Far, Near, Own, Packet};

/// Settings; all of the slave's units but the master's inertia.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Settings {
    /// Stiffness of the position controllers, N/m or N m/rad, above 0.
    pub stiffness: f64,
    /// Their damping, N s/m or N m s/rad; critical where `None`.
    pub damping: Option<f64>,
    /// Inertia that stands for the slave, kg or kg m2.
    pub mass: f64,
    /// Inertia of the master, kg or kg m2 at the master; 0 where it is not to be taken away.
    pub master_mass: f64,
    /// Share of the master's inertia that is taken away, from 0 to below 1.
    pub compensation: f64,
}

impl Settings {
    /// For a hand-held device in translation.
    pub const DEFAULT: Settings = Settings { stiffness: 2000.0, damping: None, mass: 0.2, master_mass: 0.0, compensation: 0.8 };

    fn damping(&self) -> f64 {
        self.damping.unwrap_or(2.0 * (self.stiffness * self.mass).sqrt())
    }
}

/// The side at the master.
#[derive(Debug)]
pub struct NearSide {
    settings: Settings,
    slave: Option<Packet>,
}

impl NearSide {
    /// At rest; nothing pulls before the first packet.
    pub fn new(settings: &Settings) -> NearSide {
        NearSide { settings: *settings, slave: None }
    }
}

impl Near for NearSide {
    fn step(&mut self, own: &Own, heard: Option<&Packet>, _period_s: f64) -> (f64, Packet) {
        let Settings { stiffness, master_mass, compensation, .. } = self.settings;
        self.slave = heard.copied().or(self.slave);
        let Some(slave) = self.slave else {
            return (0.0, Packet { position: own.position, velocity: 0.0, effort: own.force });
        };
        let here = own.position + self.settings.damping() / stiffness * own.velocity;
        let pull = slave.effort - stiffness * (here - slave.position);
        let (force, acceleration) = match master_mass > 0.0 && own.power_scale > 0.0 {
            true => {
                let inertia = master_mass / own.power_scale;
                let force = pull + compensation * inertia * slave.velocity;
                (force, (own.force + force) / inertia)
            }
            false => (pull, 0.0),
        };
        (force, Packet { position: own.position, velocity: acceleration, effort: own.force })
    }
}

/// The side at the slave.
#[derive(Debug)]
pub struct FarSide {
    settings: Settings,
    /// How far the slave is ahead of the master, as a mass on a spring and a damper.
    ahead: Proxy,
    master: Option<Packet>,
}

impl FarSide {
    /// Where the master is.
    pub fn new(settings: &Settings) -> FarSide {
        FarSide { settings: *settings, ahead: Proxy::new(settings.mass, settings.damping()), master: None }
    }
}

impl Far for FarSide {
    fn step(&mut self, own: &Own, heard: Option<&Packet>, period_s: f64) -> (f64, Packet) {
        self.master = heard.copied().or(self.master);
        let Settings { stiffness, .. } = self.settings;
        let position = own.position + self.settings.damping() / stiffness * own.velocity;
        let Some(master) = self.master else {
            return (own.position, Packet { position, velocity: 0.0, effort: own.force });
        };
        let force = master.effort + own.force;
        let before = self.ahead.velocity;
        let (a, c) = self.ahead.answer(period_s);
        let pull = -stiffness * (self.ahead.position + period_s * (a + c * force)) / (1.0 + stiffness * period_s * c);
        self.ahead.advance(force + pull, period_s);
        let acceleration = master.velocity + (self.ahead.velocity - before) / period_s;
        (master.position + self.ahead.position, Packet { position, velocity: acceleration, effort: own.force })
    }
}
