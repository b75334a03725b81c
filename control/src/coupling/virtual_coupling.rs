//! Virtual coupling: a spring and a damper between the master's motion and what is touched, with damping injected at the master.
//!
//! Colgate & Schenkel, "Passivity of a class of sampled-data systems", J. Robotic Systems 14, 1997; Adams & Hannaford, "Stable haptic interaction
//! with virtual environments", IEEE Trans. Robotics and Automation 15, 1999 (impedance display with an environment that takes positions and gives
//! forces). The spring bounds the stiffness that the master can display, whatever the slave touches. A coupling K + B s, sampled with period T, is
//! passive on a device of damping b where b > K T/2 + |B|.
//!
//! The coupling sits at the slave, where the environment answers at once; its point moves so that coupling and contact force are equal. What a delay
//! of the link adds, K times the round trip at low frequency, is injected as damping at the master. That damper is sampled too, so it does not
//! replace the device's own b at high frequency, and too much of it makes the device oscillate. By default the coupling is therefore as soft as the
//! round trip requires.
//!
//! Packets: forward position and velocity; back the force of the coupling as effort, and the slave's position.

use super::side::{Conditions, Far, Near, Own, Packet};

/// Settings; all of the slave's units.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Settings {
    /// Stiffness K of the coupling, N/m or N m/rad; where `None` 2000, or less where the damping to inject would be above 80.
    pub stiffness: Option<f64>,
    /// Its damping B, N s/m or N m s/rad.
    pub damping: f64,
    /// Damping at the master, N s/m or N m s/rad; K (T/2 + round trip) where `None`.
    pub injection: Option<f64>,
}

impl Settings {
    /// For a hand-held device in translation.
    pub const DEFAULT: Settings = Settings { stiffness: None, damping: 30.0, injection: None };

    /// The stiffness in force, N/m or N m/rad.
    pub fn stiffness_for(&self, conditions: &Conditions) -> f64 {
        self.stiffness.unwrap_or_else(|| STIFFEST.min(MOST_INJECTION / conditions.answer_s()))
    }

    /// Damping b that a device needs for the coupling to be passive on it without a delay, K T/2 + |B|, N s/m or N m s/rad.
    pub fn least_device_damping(&self, conditions: &Conditions) -> f64 {
        0.5 * self.stiffness_for(conditions) * conditions.period_s + self.damping.abs()
    }

    /// The injected damping in force.
    pub fn injection_for(&self, conditions: &Conditions) -> f64 {
        self.injection.unwrap_or_else(|| self.stiffness_for(conditions) * conditions.answer_s())
    }
}

/// Stiffness by default where the round trip allows it, N/m.
const STIFFEST: f64 = 2000.0;

/// Most damping that is injected by default, N s/m: a hand-held master does not shake with it.
const MOST_INJECTION: f64 = 80.0;

/// The side at the master.
#[derive(Debug)]
pub struct NearSide {
    injection: f64,
    coupling: f64,
}

impl NearSide {
    /// At rest.
    pub fn new(settings: &Settings, conditions: &Conditions) -> NearSide {
        NearSide { injection: settings.injection_for(conditions), coupling: 0.0 }
    }
}

impl Near for NearSide {
    fn step(&mut self, own: &Own, heard: Option<&Packet>, _period_s: f64) -> (f64, Packet) {
        self.coupling = heard.map_or(self.coupling, |h| h.effort);
        (self.coupling - self.injection * own.velocity, Packet { position: own.position, velocity: own.velocity, effort: 0.0 })
    }
}

/// The side at the slave: the coupling.
#[derive(Debug, Clone)]
pub struct FarSide {
    stiffness: f64,
    damping: f64,
    point: Option<f64>,
    master: Option<Packet>,
}

impl FarSide {
    /// With its point where the master is when it is first heard of.
    pub fn new(settings: &Settings, conditions: &Conditions) -> FarSide {
        FarSide { stiffness: settings.stiffness_for(conditions), damping: settings.damping, point: None, master: None }
    }
}

impl Far for FarSide {
    fn step(&mut self, own: &Own, heard: Option<&Packet>, period_s: f64) -> (f64, Packet) {
        self.master = heard.copied().or(self.master);
        let Some(master) = self.master else {
            return (own.position, Packet { position: own.position, ..Packet::default() });
        };
        let before = self.point.unwrap_or(master.position);
        // K (x_m - x - T v) + B (v_m - v) + F = 0 for the velocity v of the point.
        let drive = self.stiffness * (master.position - before) + self.damping * master.velocity;
        let velocity = (drive + own.force) / (self.damping + period_s * self.stiffness);
        let point = before + period_s * velocity;
        self.point = Some(point);
        let coupling = self.stiffness * (master.position - point) + self.damping * (master.velocity - velocity);
        (point, Packet { position: own.position, velocity: own.velocity, effort: -coupling })
    }
}
