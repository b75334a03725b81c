//! What goes wrong on an emulated wire on purpose.

use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use std::str::FromStr;

/// What happens to an answer.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Fault {
    /// It does not come.
    Silent,
    /// One of its bytes has a flipped bit.
    Corrupt,
    /// It comes 20 ms late.
    Late,
    /// It comes twice.
    Twice,
    /// It has the address of nobody who was asked.
    OtherId,
    /// Its checksum is wrong.
    Checksum,
    /// The pty is closed: the cable is pulled.
    Closed,
}

impl Fault {
    /// Names on the command line and in files.
    pub const ALL: [(&'static str, Fault); 7] = [
        ("silent", Fault::Silent),
        ("corrupt", Fault::Corrupt),
        ("late", Fault::Late),
        ("twice", Fault::Twice),
        ("other_id", Fault::OtherId),
        ("checksum", Fault::Checksum),
        ("closed", Fault::Closed),
    ];

    /// Its name.
    pub fn name(self) -> &'static str {
        Fault::ALL[self as usize].0
    }
}

/// A fault, how often, and from when to when.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Planned {
    fault: Fault,
    /// Share of answers, 0 to 1.
    share: f64,
    from_s: f64,
    to_s: f64,
}

/// Why faults cannot be read.
#[derive(Debug, thiserror::Error, PartialEq, Eq)]
#[error("fault \"{word}\": {what}; write such as corrupt=0.01, late=0.1@2..5 (share, and seconds from..to), or closed@3")]
pub struct FaultError {
    word: String,
    what: String,
}

/// Faults that are planned, and how often each happened.
#[derive(Debug, Clone)]
pub struct Faults {
    planned: Vec<Planned>,
    random: ChaCha8Rng,
    counts: [u64; Fault::ALL.len()],
}

impl Faults {
    /// Those of words such as `corrupt=0.01`, `late=0.1@2..5`, `closed@3`.
    ///
    /// # Errors
    /// The first word that is none.
    pub fn of<S: AsRef<str>>(words: &[S], seed: u64) -> Result<Faults, FaultError> {
        let planned = words.iter().map(|word| word.as_ref().parse()).collect::<Result<Vec<Planned>, FaultError>>()?;
        Ok(Faults { planned, random: ChaCha8Rng::seed_from_u64(seed ^ 0x5eed), counts: [0; Fault::ALL.len()] })
    }

    /// What happens to an answer at this time, s since the start.
    pub fn next(&mut self, at_s: f64) -> Option<Fault> {
        let mut happens = None;
        for planned in &self.planned {
            // Drawn for each, so that one does not change the others.
            let drawn: f64 = self.random.random();
            if (planned.from_s..planned.to_s).contains(&at_s) && drawn < planned.share {
                happens = happens.or(Some(planned.fault));
            }
        }
        if let Some(fault) = happens {
            self.counts[fault as usize] += 1;
        }
        happens
    }

    /// A random index below `count`.
    pub fn any_of(&mut self, count: usize) -> usize {
        self.random.random_range(0..count.max(1))
    }

    /// Whether the pty shall be closed at this time.
    pub fn closes(&mut self, at_s: f64) -> bool {
        let closes = self.planned.iter().any(|p| p.fault == Fault::Closed && (p.from_s..p.to_s).contains(&at_s));
        self.counts[Fault::Closed as usize] += u64::from(closes);
        closes
    }

    /// How often each fault happened, without those that never did.
    pub fn counts(&self) -> Vec<(&'static str, u64)> {
        Fault::ALL.iter().map(|(name, fault)| (*name, self.counts[*fault as usize])).filter(|(_, n)| *n > 0).collect()
    }
}

impl FromStr for Planned {
    type Err = FaultError;

    fn from_str(word: &str) -> Result<Planned, FaultError> {
        let wrong = |what: &str| FaultError { word: word.to_string(), what: what.to_string() };
        let (rest, when) = word.split_once('@').map_or((word, None), |(rest, when)| (rest, Some(when)));
        let (name, share) = rest.split_once('=').map_or((rest, None), |(name, share)| (name, Some(share)));
        let fault = Fault::ALL.iter().find(|(known, _)| *known == name.trim()).map(|(_, fault)| *fault);
        let known: Vec<&str> = Fault::ALL.iter().map(|(name, _)| *name).collect();
        let fault = fault.ok_or_else(|| wrong(&format!("known are {}", known.join(", "))))?;
        let number = |text: &str| text.trim().parse::<f64>().ok().filter(|n| n.is_finite() && *n >= 0.0);
        let share = match share {
            None => 1.0,
            Some(text) => number(text).filter(|n| *n <= 1.0).ok_or_else(|| wrong("the share of answers is from 0 to 1"))?,
        };
        let (from_s, to_s) = match when.map(|when| when.split_once("..").map_or((when, None), |(from, to)| (from, Some(to)))) {
            None => (0.0, f64::INFINITY),
            Some((from, to)) => {
                let from = number(from).ok_or_else(|| wrong("the time is in seconds"))?;
                let to = to.map_or(Some(f64::INFINITY), number).ok_or_else(|| wrong("the time is in seconds"))?;
                (from, to)
            }
        };
        Ok(Planned { fault, share, from_s, to_s })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn faults_happen_in_their_time_and_at_their_share() {
        let mut faults = Faults::of(&["corrupt=0.25@1..2", "closed@3"], 1).unwrap();
        assert!((0..100).all(|_| faults.next(0.5).is_none()) && !faults.closes(2.9));
        let hits = (0..4000).filter(|_| faults.next(1.5) == Some(Fault::Corrupt)).count();
        assert!((900..1100).contains(&hits), "{hits} of 4000");
        assert!(faults.closes(3.0));
        assert_eq!(faults.counts(), [("corrupt", hits as u64), ("closed", 1)]);
    }

    #[test]
    fn words_that_are_none_are_refused() {
        for word in ["corupt=0.1", "late=2", "late=0.1@x", "silent=-1"] {
            assert!(Faults::of(&[word], 1).unwrap_err().to_string().contains(word));
        }
    }
}
