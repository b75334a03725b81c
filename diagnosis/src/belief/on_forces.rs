//! How sure a law is that was chosen on forces: the probability that it, and its kind, are right.
//!
//! A logistic regression over a few figures. Its coefficients were found on laws hidden in the noise of real machines; docs/diagnosis.md describes how.

use crate::equation_error::explore::{Explored, LawColumns, Looked, Same, better};
use crate::tuning::tuning;

/// What is known of a law that was chosen.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Figures {
    /// How surely left-out stretches are predicted better with it than without, in standard errors: logarithm of 1 and that.
    pub with: f64,
    /// Share of the error without it that it takes.
    pub takes: f64,
    /// How surely they are predicted better than by the nearest structure without it, in standard errors: inverse hyperbolic sine of that.
    pub over_rival: f64,
    /// Share of the error of that structure by which it is better; below 0 where it is worse.
    pub ahead: f64,
    /// Numbers of the law.
    pub numbers: f64,
    /// Laws that are chosen beside it.
    pub beside: f64,
}

impl Figures {
    /// In the order of the coefficients.
    pub fn list(&self) -> [f64; 6] {
        [self.with, self.takes, self.over_rival, self.ahead, self.numbers, self.beside]
    }
}

/// The probability that a law, and that its kind, is right.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Belief {
    /// The law.
    pub law: f64,
    /// Some law of its kind at its place.
    pub kind: f64,
}

/// The nearest structure that has no such law: the one that is predicted worse by the fewest standard errors.
pub(crate) fn nearest<'e, R: LawColumns>(rooms: &[R], explored: &'e Explored, law: usize, same: Same) -> Option<&'e Looked> {
    let (room, best) = (rooms.first()?, explored.best());
    let richest = best.numbers + tuning().equation_error.rival_numbers;
    let rivals = explored.all.iter().filter(|l| l.numbers <= richest && !l.laws.iter().any(|other| room.is_same(law, *other, same)));
    rivals.min_by(|a, b| better(a, best).in_errors().total_cmp(&better(b, best).in_errors()))
}

/// Figures of a law of the chosen structure: for the law, and for its kind.
pub(crate) fn figures<R: LawColumns>(rooms: &[R], explored: &Explored, law: usize) -> [Figures; 2] {
    let best = explored.best();
    let rest: Vec<usize> = best.laws.iter().copied().filter(|l| *l != law).collect();
    let without = explored.all.iter().find(|l| l.laws == rest).unwrap_or(explored.nothing());
    let with = better(without, best);
    [Same::Law, Same::Kind].map(|same| {
        let over = nearest(rooms, explored, law, same).map(|rival| better(rival, best));
        let takes = |share: f64| 1.0 - 1.0 / (1.0 + share.max(-0.5));
        Figures {
            with: with.in_errors().max(0.0).ln_1p(),
            takes: takes(with.share),
            over_rival: over.map_or(20.0, |o| o.in_errors().clamp(-20.0, 20.0)).asinh(),
            ahead: over.map_or(1.0, |o| takes(o.share)),
            numbers: rooms.first().map_or(0.0, |room| room.numbers(law) as f64),
            beside: rest.len() as f64,
        }
    })
}

/// How sure a law of the chosen structure is.
pub(crate) fn belief<R: LawColumns>(rooms: &[R], explored: &Explored, law: usize) -> Belief {
    let [own, kind] = figures(rooms, explored, law);
    let tuning = &tuning().equation_error;
    let (sure, kind) = (logistic(&tuning.confidence, &own), logistic(&tuning.kind_confidence, &kind));
    // Of two laws that are the same force here one is as likely as the other.
    let law = if rooms.first().and_then(|room| room.same_force(&explored.best().laws, law)).is_some() { sure.min(0.5) } else { sure };
    Belief { law, kind: kind.max(sure) }
}

fn logistic([constant, coefficients @ ..]: &[f64; 7], figures: &Figures) -> f64 {
    let sum: f64 = coefficients.iter().zip(figures.list()).map(|(a, x)| a * x).sum();
    1.0 / (1.0 + (-(constant + sum)).exp())
}
