//! The law that moves one motor of a coupled pair, as numbers and in time.

use super::filter::FilteredRate;
use serde::Serialize;
use std::collections::VecDeque;

/// A part of a law: what its coefficient multiplies.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, PartialOrd, Ord, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Term {
    /// How far the other side is ahead, N/m or N m/rad.
    Position,
    /// How much faster the other side is, behind the filter of speeds, N s/m or N m s/rad.
    Rate,
    /// Damping of the own motion: against the own speed behind that filter, N s/m or N m s/rad.
    Damping,
    /// Compensation of friction: in the direction of the own speed, N or N m.
    Friction,
    /// The force measured at the other side, no unit.
    OtherForce,
    /// The force measured at the own side, no unit.
    OwnForce,
}

impl Term {
    /// As in JSON and in a sentence.
    pub fn name(self) -> &'static str {
        match self {
            Term::Position => "position",
            Term::Rate => "rate",
            Term::Damping => "damping",
            Term::Friction => "friction",
            Term::OtherForce => "other_force",
            Term::OwnForce => "own_force",
        }
    }

    /// Whether its input is a measured force.
    pub fn is_force(self) -> bool {
        matches!(self, Term::OtherForce | Term::OwnForce)
    }

    /// Whether its input is a speed, so that it depends on how speeds are filtered.
    pub fn is_speed(self) -> bool {
        matches!(self, Term::Rate | Term::Damping | Term::Friction)
    }
}

/// The law of one motor: the sum of its terms and an offset, clamped.
#[derive(Debug, Clone, PartialEq)]
pub struct Law {
    /// Terms with their coefficients, SI units.
    pub terms: Vec<(Term, f64)>,
    /// Added, N or N m.
    pub offset: f64,
    /// Time constant of the first-order filter of speeds, s.
    pub filter_s: f64,
    /// Delay of the motions in the law, s.
    pub delay_s: f64,
    /// Delay of the forces in the law, s.
    pub force_delay_s: f64,
    /// Speed above which the sign of a speed is sure, m/s or rad/s.
    pub sure_speed: f64,
    /// Largest force, N or N m; `None` where no clamp is known.
    pub limit: Option<f64>,
}

impl Law {
    /// A term's coefficient; 0 where the law has none.
    pub fn coefficient(&self, term: Term) -> f64 {
        self.terms.iter().find(|(t, _)| *t == term).map_or(0.0, |(_, c)| *c)
    }
}

/// The inputs of a law in one step.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct Seen {
    /// Own position, m or rad.
    pub own: f64,
    /// The other side's position in own units, m or rad.
    pub other: f64,
    /// Force measured at the own side, N or N m.
    pub own_force: f64,
    /// Force measured at the other side, N or N m.
    pub other_force: f64,
}

/// A law in time: a function of what it has seen, without clock or I/O.
#[derive(Debug, Clone)]
pub struct Running {
    law: Law,
    period_s: f64,
    error_rate: FilteredRate,
    own_rate: FilteredRate,
    seen: VecDeque<Seen>,
    longest: usize,
}

impl Running {
    /// A law that has seen nothing yet, at a sample time, s.
    pub fn new(law: &Law, period_s: f64) -> Running {
        let filter = law.filter_s.max(1e-9);
        let longest = (law.delay_s.max(law.force_delay_s).max(0.0) / period_s).ceil() as usize + 2;
        Running {
            law: law.clone(),
            period_s,
            error_rate: FilteredRate::new(filter, period_s),
            own_rate: FilteredRate::new(filter, period_s),
            seen: VecDeque::with_capacity(longest + 1),
            longest,
        }
    }

    /// The motor's force at the next step, N or N m.
    pub fn step(&mut self, seen: Seen) -> f64 {
        if self.seen.len() == self.longest {
            self.seen.pop_back();
        }
        self.seen.push_front(seen);
        let moved = self.before(self.law.delay_s);
        let felt = self.before(self.law.force_delay_s);
        let error = moved.other - moved.own;
        let (rate, speed) = (self.error_rate.step(error), self.own_rate.step(moved.own));
        let mut force = self.law.offset;
        for (term, coefficient) in &self.law.terms {
            force += coefficient
                * match term {
                    Term::Position => error,
                    Term::Rate => rate,
                    Term::Damping => -speed,
                    Term::Friction => direction(speed, self.law.sure_speed),
                    Term::OtherForce => felt.other_force,
                    Term::OwnForce => felt.own_force,
                };
        }
        self.law.limit.map_or(force, |limit| force.clamp(-limit, limit))
    }

    /// What was seen so long before, straight between steps; what lies ahead is taken to be as now.
    fn before(&self, delay_s: f64) -> Seen {
        let rows = (delay_s / self.period_s).max(0.0);
        let (whole, part) = (rows.floor() as usize, rows.fract());
        let at = |row: usize| self.seen.get(row.min(self.seen.len().saturating_sub(1))).copied().unwrap_or_default();
        let (late, early) = (at(whole), at(whole + 1));
        let mix = |a: f64, b: f64| a + (b - a) * part;
        Seen {
            own: mix(late.own, early.own),
            other: mix(late.other, early.other),
            own_force: mix(late.own_force, early.own_force),
            other_force: mix(late.other_force, early.other_force),
        }
    }
}

/// Direction of a speed, -1 to 1, without a jump at rest.
pub(super) fn direction(speed: f64, sure: f64) -> f64 {
    (speed / sure.max(f64::MIN_POSITIVE)).tanh()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_law_in_time_is_late_filters_its_rate_and_is_clamped() {
        let law = Law {
            terms: vec![(Term::Position, 10.0), (Term::Rate, 0.1), (Term::OtherForce, 0.5)],
            offset: 0.2,
            filter_s: 1e-9,
            delay_s: 2e-3,
            force_delay_s: 1e-3,
            sure_speed: 1e-3,
            limit: Some(3.0),
        };
        let mut running = Running::new(&law, 1e-3);
        let ramp = |k: i32| Seen { own: 0.0, other: 1e-3 * f64::from(k), own_force: 0.0, other_force: f64::from(k) };
        let told: Vec<f64> = (0..8).map(|k| running.step(ramp(k))).collect();
        // At step 5: position of step 3, its rate of 1 per second, force of step 4.
        assert!((told[5] - (0.2 + 10.0 * 3e-3 + 0.1 + 0.5 * 4.0)).abs() < 1e-9, "{told:?}");
        assert_eq!(told[7], 3.0);
    }
}
