//! The coupling of two devices, recovered from a recording: which law moves the two motors, with its gains.
//!
//! Each side by itself: the force of its motor is compared with what a controller may use, both positions and the measured forces. Candidates are the
//! laws of bilateral control (Lawrence 1993; Hokayem and Spong 2006): position error with or without its rate, damping of the own motion,
//! compensation of friction, reflected force, and four channels. Every candidate is fitted with the filter of its speeds and its delays as parameters
//! of the fit, and predicts held-out blocks of time. The simplest one wins that predicts no worse than the best.
//!
//! The band ends where the motion no longer determines the force (coherence), because above that a law would be fitted to the rounding of encoders.

mod choose;
mod filter;
mod fit;
mod law;
mod prepared;
mod types;
mod words;

#[cfg(test)]
mod tests;

pub use law::{Law, Running, Seen, Term};
pub use types::{Coupling, Estimate, Gain, Kind, NoCoupling, Rival, SideLaw, Signals};

pub(crate) use filter::BothWays;

use choose::choose;
use prepared::Side;

/// Recovers the laws of both motors.
///
/// # Errors
/// Too little of it, or nothing moves.
pub fn identify(signals: &Signals) -> Result<Coupling, NoCoupling> {
    let (master, slave) = (Side::of(signals, true)?, Side::of(signals, false)?);
    let (master, slave) = rayon::join(|| choose(&master), || choose(&slave));
    let (master, slave) = (master.ok_or(NoCoupling::NoMotion { master: true })?, slave.ok_or(NoCoupling::NoMotion { master: false })?);
    Ok(Coupling { kind: Kind::of(&master.law, &slave.law), master, slave })
}

impl Kind {
    /// Of two laws.
    pub fn of(master: &Law, slave: &Law) -> Kind {
        let has = |law: &Law, term: Term| law.terms.iter().any(|(t, _)| *t == term);
        let position = |law: &Law| has(law, Term::Position);
        let force = |law: &Law| has(law, Term::OtherForce);
        let looks = |law: &Law| position(law) || force(law);
        match (position(master), force(master), position(slave), force(slave)) {
            _ if !looks(master) && !looks(slave) => Kind::Uncoupled,
            _ if !looks(master) || !looks(slave) => Kind::OneWay,
            (true, false, true, false) => Kind::PositionError,
            (false, true, true, false) => Kind::ForceReflection,
            (true, _, true, _) => Kind::FourChannel,
            _ => Kind::Other,
        }
    }
}
