//! Time-domain passivity: energy is observed at both ports, and the output is limited to what went in at the other.
//!
//! Hannaford & Ryu, "Time-domain passivity control of haptic interfaces", IEEE Trans. Robotics and Automation 18, 2002; with a
//! delay, Ryu, Artigas & Preusche, "A passive bilateral control scheme for a teleoperator with time-varying communication delay",
//! Mechatronics 20, 2010. The energy that has gone in at a port is sent along; as it only grows, an old value is never too much.
//! So at each port, at every step: energy out <= energy that went in at the other port, as last heard, whatever the link does.
//!
//! In discrete time a force acts after it is computed: it is held over a step that begins when it arrives. Work is counted when it is done, by the
//! force that acted and its displacement. This is exact for a held force (Ryu, Kim & Hannaford, "Stability guaranteed control: time domain passivity
//! approach", IEEE Trans. Control Systems Technology 12, 2004). The next output is predicted from the present motion. Where a force acts at once
//! ([`Conditions::held_steps`] 0) the energy output never exceeds the input. Otherwise it exceeds it only by the change of the motion within these
//! steps, and that is recovered before more energy is put out.
//!
//! At the master the controller takes force away (a damper beside the port), at the slave it takes motion away (a damper in line).
//! Motion that was taken leaves the slave behind; it catches up as the energy allows (after Artigas, Ryu & Preusche 2010).
//!
//! A slave that may put out only the energy that has come in at the master cannot press before a force was felt there, and none is felt before it
//! presses. With a measured force the two therefore wait for each other. So a damper at the master collects energy from its motion (Franken,
//! Stramigioli, Misra, Secchi & Macchelli, "Bilateral telemanipulation with time delays: a two-layer approach combining passivity and transparency",
//! IEEE Trans. Robotics 27, 2011), and what it takes counts as gone in.
//!
//! Packets: forward position as position, energy in as effort; back the force of the environment as velocity, energy in as
//! effort, and the slave's position.

use super::side::{Conditions, Far, Near, Own, Packet};

/// Settings.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Settings {
    /// Time in which a slave that was held back catches up, s.
    pub catch_up_s: f64,
    /// Damping at the master that collects energy for the slave, N s/m or N m s/rad in the slave's units; 0 for none.
    pub harvest: f64,
}

impl Settings {
    /// A tenth of a second, in which no jump is felt, and a damping below that of a hand.
    pub const DEFAULT: Settings = Settings { catch_up_s: 0.1, harvest: 10.0 };
}

/// The passivity observer of one port, J.
#[derive(Debug, Clone, Default)]
pub struct Observer {
    /// Went in here.
    pub energy_in: f64,
    /// Came out here.
    pub energy_out: f64,
    /// Went in at the other port, as last heard.
    pub allowed: f64,
}

impl Observer {
    /// What may still come out, J: never below 0 but for rounding.
    pub fn budget(&self) -> f64 {
        self.allowed - self.energy_out
    }

    /// Hears how much went in at the other port.
    fn hear(&mut self, energy: f64) {
        self.allowed = self.allowed.max(energy);
    }

    /// Counts a work that was done, J, positive where it came out.
    fn count(&mut self, work: f64) {
        match work > 0.0 {
            true => self.energy_out += work,
            false => self.energy_in -= work,
        }
    }

    /// The controller: the share of a work that would come out within each of `steps` steps (J, positive) which may.
    fn share(&self, work: f64, steps: u64) -> f64 {
        let may = self.budget().max(0.0) / steps.max(1) as f64;
        if work > may { may / work } else { 1.0 }
    }
}

/// Most steps for which a force can be under way.
const MOST_HELD: usize = 64;

/// The side at the master.
#[derive(Debug)]
pub struct NearSide {
    observer: Observer,
    contact: f64,
    harvest: f64,
    /// Forces that were put out, by step.
    told: [f64; MOST_HELD],
    held: u64,
    step: u64,
}

impl NearSide {
    /// At rest.
    pub fn new(settings: &Settings, conditions: &Conditions) -> NearSide {
        let held = conditions.held_steps.min(MOST_HELD as u64 - 1);
        NearSide { observer: Observer::default(), contact: 0.0, harvest: settings.harvest, told: [0.0; MOST_HELD], held, step: 0 }
    }

    /// What it has observed.
    pub fn observer(&self) -> &Observer {
        &self.observer
    }

    fn told(&mut self, ago: u64) -> &mut f64 {
        &mut self.told[(self.step + MOST_HELD as u64 - ago) as usize % MOST_HELD]
    }
}

impl Near for NearSide {
    fn step(&mut self, own: &Own, heard: Option<&Packet>, _period_s: f64) -> (f64, Packet) {
        if let Some(heard) = heard {
            self.contact = heard.velocity;
            self.observer.hear(heard.effort);
        }
        let held = self.held;
        if held > 0 {
            let acted = *self.told(held);
            self.observer.count(acted * own.moved);
        }
        let wanted = self.contact - self.harvest * own.velocity;
        let force = wanted * self.observer.share(wanted * own.moved, held);
        *self.told(0) = force;
        self.step += 1;
        if held == 0 {
            self.observer.count(force * own.moved);
        }
        (force, Packet { position: own.position, velocity: own.velocity, effort: self.observer.energy_in })
    }
}

/// The side at the slave.
#[derive(Debug)]
pub struct FarSide {
    observer: Observer,
    catch_up_s: f64,
    at_once: bool,
    /// Where the slave shall be, and where the master was when last heard.
    command: Option<f64>,
    wanted: f64,
}

impl FarSide {
    /// At rest.
    pub fn new(settings: &Settings, conditions: &Conditions) -> FarSide {
        let at_once = conditions.held_steps == 0;
        FarSide { observer: Observer::default(), catch_up_s: settings.catch_up_s, at_once, command: None, wanted: 0.0 }
    }

    /// What it has observed.
    pub fn observer(&self) -> &Observer {
        &self.observer
    }
}

impl Far for FarSide {
    fn step(&mut self, own: &Own, heard: Option<&Packet>, period_s: f64) -> (f64, Packet) {
        let before = self.command.unwrap_or(own.position);
        let mut moved = 0.0;
        if let Some(heard) = heard {
            moved = if self.command.is_some() { heard.position - self.wanted } else { 0.0 };
            self.wanted = heard.position;
            self.observer.hear(heard.effort);
        }
        // The force came of the motion that the slave has made by now.
        if !self.at_once {
            self.observer.count(-own.force * own.moved);
        }
        let behind = self.wanted - before - moved;
        let motion = moved + behind * (period_s / self.catch_up_s).min(1.0);
        let passed = motion * self.observer.share(-own.force * motion, 1);
        if self.at_once {
            self.observer.count(-own.force * passed);
        }
        let command = before + passed;
        self.command = Some(command);
        (command, Packet { position: own.position, velocity: own.force, effort: self.observer.energy_in })
    }
}
