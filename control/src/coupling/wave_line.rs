//! One direction of a wave line: what carries a wave over a link that delays, jitters and loses, without adding energy.
//!
//! A wave u has the power u^2/2. Sent are the wave, its time integral and the integral of its power. The receiver plays the
//! integral out, so that a lost packet loses no way, and never more energy than has arrived: passive for every delay, jitter and
//! loss (Niemeyer & Slotine, "Towards force-reflecting teleoperation over the internet", ICRA 1998). With a constant delay and no
//! loss it is the line of Anderson & Spong 1989: what comes out is what went in, one delay later.

use super::{Heard, Packet};

/// The sending end.
#[derive(Debug, Clone, Default)]
pub struct Sender {
    integral: f64,
    energy: f64,
}

impl Sender {
    /// Sends the wave of this step: position carries its integral, velocity the wave, effort the energy sent until now.
    pub fn send(&mut self, wave: f64, period_s: f64) -> Packet {
        self.integral += wave * period_s;
        self.energy += 0.5 * wave * wave * period_s;
        Packet { position: self.integral, velocity: wave, effort: self.energy }
    }
}

/// The receiving end.
#[derive(Debug, Clone, Default)]
pub struct Receiver {
    arrived: Sender,
    played: Sender,
    /// Steps over which what has arrived is still to be played.
    steps: u64,
}

impl Receiver {
    /// The wave of this step. What came for several steps at once is played over as many steps.
    pub fn receive(&mut self, heard: Option<&Heard>, period_s: f64) -> f64 {
        if let Some(heard) = heard {
            self.arrived = Sender { integral: heard.packet.position, energy: heard.packet.effort };
            self.steps = self.steps.max(heard.steps);
        }
        let wanted = (self.arrived.integral - self.played.integral) / (self.steps.max(1) as f64 * period_s);
        let most = (2.0 * self.reserve().max(0.0) / period_s).sqrt();
        self.steps = self.steps.saturating_sub(1);
        let wave = wanted.clamp(-most, most);
        self.played.send(wave, period_s);
        wave
    }

    /// Energy that has arrived and was not given out, J.
    pub fn reserve(&self) -> f64 {
        self.arrived.energy - self.played.energy
    }

    /// Integral of the wave that has arrived and was not played.
    pub fn outstanding(&self) -> f64 {
        self.arrived.integral - self.played.integral
    }
}
