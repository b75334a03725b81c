//! What the slave meets: a spring and a damper that begin at a place and only push.

use super::record::{ENDS, Record, mean};
use crate::run::solved;
use backdrive_signal::derivative;

/// A contact: it pushes back once the slave is beyond its place.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Environment {
    /// N m/rad
    pub(super) stiffness: f64,
    /// N m s/rad
    pub(super) damping: f64,
    /// Where it begins, rad.
    pub(super) place: f64,
}

/// Places that are tried, from the lowest to the highest position of the slave.
const PLACES: usize = 200;
/// One in this number of rows is used.
const EVERY: usize = 10;

impl Environment {
    /// Torque on the slave, N m.
    pub(super) fn torque(&self, x: f64, v: f64) -> f64 {
        let depth = x - self.place;
        if depth > 0.0 { -(self.stiffness * depth + self.damping * v).max(0.0) } else { 0.0 }
    }

    /// Along the motion of a record.
    pub(super) fn along(&self, record: &Record) -> Vec<f64> {
        let speed = derivative(&record.slave, record.period_s);
        record.slave.iter().zip(&speed).map(|(x, v)| self.torque(*x, *v)).collect()
    }

    /// Of the records of one kind: the mean of their individual results. The gauge's zero is its own in each.
    pub(super) fn fit(records: &[&Record]) -> Option<Environment> {
        let all: Vec<Environment> = records.iter().filter_map(|record| best_place(record, None)).collect();
        let of = |pick: fn(&Environment) -> f64| mean(&all.iter().map(pick).collect::<Vec<f64>>());
        (!all.is_empty()).then(|| Environment {
            stiffness: of(|e| e.stiffness),
            damping: of(|e| e.damping).max(0.0),
            place: of(|e| e.place),
        })
    }

    /// The same where it stands in another record.
    pub(super) fn placed(self, record: &Record) -> Option<Environment> {
        best_place(record, Some(self))
    }
}

/// The place that leaves least of the recorded torque, with stiffness and damping by least squares where they are not given.
fn best_place(record: &Record, given: Option<Environment>) -> Option<Environment> {
    let speed = derivative(&record.slave, record.period_s);
    let inner = |column: &[f64]| -> Vec<f64> {
        column.get(ENDS..column.len().saturating_sub(ENDS)).unwrap_or_default().iter().step_by(EVERY).copied().collect()
    };
    let (x, v, force) = (inner(&record.slave), inner(&speed), inner(&record.contact));
    let (low, high) = x.iter().fold((f64::INFINITY, f64::NEG_INFINITY), |(l, h), x| (l.min(*x), h.max(*x)));
    let one = vec![1.0; x.len()];
    let tried = (0..PLACES).filter_map(|i| {
        // Nothing is known of a place below all that was reached: there it is a spring all the time, and its place that of no torque.
        let place = low - 0.5 * (high - low) + 1.5 * (high - low) * i as f64 / PLACES as f64;
        let environment = match given {
            Some(given) => Environment { place, ..given },
            None => {
                let inside = |value: f64, x: f64| if x > place { -value } else { 0.0 };
                let depth: Vec<f64> = x.iter().map(|x| inside(x - place, *x)).collect();
                let rate: Vec<f64> = x.iter().zip(&v).map(|(x, v)| inside(*v, *x)).collect();
                let found = solved(&[&depth, &rate, &one], &force).ok()?;
                Environment { stiffness: *found.first()?, damping: *found.get(1)?, place }
            }
        };
        let left: Vec<f64> = x.iter().zip(&v).zip(&force).map(|((x, v), f)| f - environment.torque(*x, *v)).collect();
        let zero = mean(&left);
        let error: f64 = left.iter().map(|r| (r - zero).powi(2)).sum();
        (environment.stiffness > 0.0 && error.is_finite()).then_some((environment, error))
    });
    tried.min_by(|a, b| a.1.total_cmp(&b.1)).map(|(environment, _)| environment)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn record(truth: Environment, middle: f64, zero: f64) -> Record {
        let n = 6000;
        let slave: Vec<f64> = (0..n).map(|row| middle + 0.05 * (6.0 * row as f64 * 5e-4).sin()).collect();
        let mut record = Record {
            name: "a_spring".to_string(),
            period_s: 5e-4,
            master: slave.clone(),
            slave,
            hand: vec![0.0; n],
            contact: vec![0.0; n],
            master_motor: vec![0.0; n],
            slave_motor: vec![0.0; n],
        };
        record.contact = truth.along(&record).iter().map(|f| f + zero).collect();
        record
    }

    #[test]
    fn a_contact_is_found_from_its_torque_with_a_zero_that_is_off() {
        let truth = Environment { stiffness: 20.0, damping: 0.02, place: 0.01 };
        let found = Environment::fit(&[&record(truth, 0.0, 0.03), &record(truth, 0.01, -0.01)]).unwrap();
        assert!((found.stiffness / 20.0 - 1.0).abs() < 0.05 && (found.place - 0.01).abs() < 2e-3, "{found:?}");
        // One that is farther away is found there with what is known of it.
        let away = Environment { place: 0.025, ..truth };
        let placed = truth.placed(&record(away, 0.0, 0.02)).unwrap();
        assert!((placed.place - 0.025).abs() < 1e-3 && placed.stiffness == 20.0, "{placed:?}");
    }

    #[test]
    fn a_spring_that_is_never_left_keeps_its_stiffness() {
        let truth = Environment { stiffness: 3.5, damping: 0.01, place: -0.2 };
        let found = Environment::fit(&[&record(truth, 0.0, 0.1)]).unwrap();
        assert!((found.stiffness / 3.5 - 1.0).abs() < 0.02, "{found:?}");
        let placed = found.placed(&record(truth, 0.03, -0.1)).unwrap();
        assert!(placed.place < -0.02, "{placed:?}");
    }
}
