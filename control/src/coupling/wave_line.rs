//! One direction of a wave line: what carries a wave over a link that delays, jitters and loses, without adding energy.
//!
//! A wave u has the power u^2/2. Sent are the wave, its time integral and the integral of its power. The receiver plays the integral out, so that a
//! lost packet loses no displacement, and never more energy than has arrived. This is passive for every delay, jitter and loss (Niemeyer & Slotine,
//! "Towards force-reflecting teleoperation over the internet", ICRA 1998). With a constant delay and no loss it is the line of Anderson & Spong 1989:
//! what comes out is what went in, one delay later.

use super::side::Packet;

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
}

impl Receiver {
    /// The wave of this step: what is outstanding of the integral, all at once where the energy that has arrived allows it, else evenly over
    /// the fewest steps for which it does.
    ///
    /// An integral I played evenly over n steps of T costs I^2/(2 n T). What was sent as n equal waves has just that energy, however
    /// many of its packets come at once.
    pub fn receive(&mut self, heard: Option<&Packet>, period_s: f64) -> f64 {
        if let Some(heard) = heard {
            self.arrived = Sender { integral: heard.position, energy: heard.effort };
        }
        let outstanding = self.outstanding();
        let at_once = outstanding / period_s;
        let cost = 0.5 * outstanding * at_once;
        let reserve = self.reserve().max(0.0);
        let wave = if cost > reserve { at_once * reserve / cost } else { at_once };
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
