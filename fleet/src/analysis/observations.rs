//! The estimates of one parameter of one joint over the fleet: by unit and date, without what temperature or warm-up explain.

use crate::date::Date;
use crate::table::Table;
use serde::Serialize;
use std::collections::BTreeMap;

/// Time constants of warm-up that are tried, s.
const WARM_UP: [f64; 6] = [60.0, 120.0, 300.0, 600.0, 1200.0, 2400.0];
/// Recordings that a slope takes at the least, beside one for each unit.
const LEAST_FREE: usize = 8;

/// An estimate from one recording.
#[derive(Debug, Clone, PartialEq)]
pub struct Observation {
    /// Its recording.
    pub recording: String,
    /// When it was made.
    pub date: Option<Date>,
    /// The estimate.
    pub value: f64,
    /// Its variance by the recording alone.
    pub variance: f64,
    temperature: Option<f64>,
    since_start: Option<f64>,
}

/// The estimates of one parameter of one joint.
#[derive(Debug, Clone)]
pub struct Observations {
    /// By unit, in the order of dates, then of recordings.
    pub units: BTreeMap<String, Vec<Observation>>,
    /// What was removed of the values.
    pub covariate: Option<Covariate>,
    /// Whether the joint was recorded by commands and positions.
    pub is_servo: bool,
}

/// How a parameter follows temperature or time since start, the same on every unit.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Covariate {
    /// `temperature` or `since_start`.
    pub by: &'static str,
    /// Change per °C; of time since start the value at the start less that when warm.
    pub slope: f64,
    /// Its standard error.
    pub sd: f64,
    /// Of time since start: the time constant, s.
    pub time_constant: Option<f64>,
}

impl Observations {
    /// Of a table; `accepted` decides by index which rows count.
    pub fn of(table: &Table, joint: &str, parameter: &str, accepted: &[bool]) -> Observations {
        let mut units: BTreeMap<String, Vec<Observation>> = BTreeMap::new();
        let mut is_servo = false;
        for (row, _) in table.rows.iter().zip(accepted).filter(|(row, accepted)| **accepted && row.joint == joint) {
            let Some((value, sd)) = row.estimate(parameter) else { continue };
            is_servo |= row.is_servo();
            units.entry(row.unit.clone()).or_default().push(Observation {
                recording: row.recording.clone(),
                date: row.date,
                value,
                variance: (sd * sd).max(f64::MIN_POSITIVE),
                temperature: row.temperature,
                since_start: row.since_start,
            });
        }
        for of_unit in units.values_mut() {
            of_unit.sort_by(|a, b| a.date.cmp(&b.date).then_with(|| a.recording.cmp(&b.recording)));
        }
        let mut out = Observations { units, covariate: None, is_servo };
        out.covariate = out.by_temperature().or_else(|| out.by_warm_up());
        out
    }

    /// Recordings in all.
    pub fn count(&self) -> usize {
        self.units.values().map(Vec::len).sum()
    }

    fn by_temperature(&mut self) -> Option<Covariate> {
        let x = self.covariates(&|observation| observation.temperature)?;
        let (slope, sd, _) = self.slope(&x)?;
        self.remove(&x, slope);
        Some(Covariate { by: "temperature", slope, sd, time_constant: None })
    }

    fn by_warm_up(&mut self) -> Option<Covariate> {
        let fit = |tau: f64| {
            let x = self.covariates(&|observation| observation.since_start.map(|t| (-t.max(0.0) / tau).exp()))?;
            let (slope, sd, left) = self.slope(&x)?;
            Some((left, tau, x, slope, sd))
        };
        let (_, tau, x, slope, sd) = WARM_UP.into_iter().filter_map(fit).min_by(|a, b| a.0.total_cmp(&b.0))?;
        self.remove(&x, slope);
        Some(Covariate { by: "since_start", slope, sd, time_constant: Some(tau) })
    }

    /// A covariate of every recording; `None` where one of them has none.
    fn covariates(&self, of: &dyn Fn(&Observation) -> Option<f64>) -> Option<Vec<Vec<f64>>> {
        self.units.values().map(|unit| unit.iter().map(of).collect()).collect()
    }

    /// The slope within units, its standard error, and the squares that are left. Levels of units do not enter.
    fn slope(&self, x: &[Vec<f64>]) -> Option<(f64, f64, f64)> {
        let free = self.count().checked_sub(self.units.len() + 1).filter(|free| *free >= LEAST_FREE)?;
        let centred = |values: Vec<f64>| {
            let mean = values.iter().sum::<f64>() / values.len().max(1) as f64;
            values.into_iter().map(move |value| value - mean)
        };
        let (mut xx, mut xy, mut yy) = (0.0, 0.0, 0.0);
        for (unit, x) in self.units.values().zip(x) {
            let y = centred(unit.iter().map(|observation| observation.value).collect());
            for (x, y) in centred(x.clone()).zip(y) {
                xx += x * x;
                xy += x * y;
                yy += y * y;
            }
        }
        if xx <= 1e-12 * x.iter().flatten().map(|x| x * x).sum::<f64>() || xx == 0.0 {
            return None;
        }
        let left = (yy - xy * xy / xx).max(0.0);
        Some((xy / xx, (left / free as f64 / xx).sqrt(), left))
    }

    /// Takes the covariate out: values are those at its mean over all recordings.
    fn remove(&mut self, x: &[Vec<f64>], slope: f64) {
        let mean = x.iter().flatten().sum::<f64>() / self.count().max(1) as f64;
        for (unit, x) in self.units.values_mut().zip(x) {
            for (observation, x) in unit.iter_mut().zip(x) {
                observation.value -= slope * (x - mean);
            }
        }
    }
}

/// Rows that count: those with an answer and without a problem of their own. A problem that most recordings of a joint have is none that
/// distinguishes them.
pub fn accepted(table: &Table) -> Vec<bool> {
    let mut kinds: BTreeMap<(&str, &str), usize> = BTreeMap::new();
    let mut all: BTreeMap<&str, usize> = BTreeMap::new();
    let audit = |row: &'_ crate::table::TableRow| row.words.get("audit").cloned().unwrap_or_default();
    let audits: Vec<String> = table.rows.iter().map(audit).collect();
    for (row, audit) in table.rows.iter().zip(&audits) {
        *kinds.entry((&row.joint, audit)).or_default() += 1;
        *all.entry(&row.joint).or_default() += 1;
    }
    let of = |(row, audit): (&crate::table::TableRow, &String)| {
        let clean = audit.is_empty() || audit == "clean" || audit == "not checked";
        let usual = kinds.get(&(row.joint.as_str(), audit.as_str())).is_some_and(|count| 2 * count > all[row.joint.as_str()]);
        row.error.is_empty() && !row.joint.is_empty() && (clean || usual)
    };
    table.rows.iter().zip(&audits).map(of).collect()
}
