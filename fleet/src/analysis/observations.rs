//! The estimates of one parameter of one joint over the fleet: by unit and date, without what temperature or warm-up explain.

use crate::date::Date;
use crate::table::Table;
use serde::Serialize;
use std::collections::BTreeMap;

/// Time constants of warm-up that are tried, s.
const WARM_UP: [f64; 6] = [60.0, 120.0, 300.0, 600.0, 1200.0, 2400.0];
/// Recordings that a slope takes at the least, beside one for each unit.
const LEAST_FREE: usize = 8;

/// Sweeps over units and dates that take both levels out: far more than the few that converge.
const SWEEPS: usize = 20;
/// Share of the covariate's squares within units that has to differ between units of one date.
const LEAST_OWN: f64 = 0.05;

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

    /// The slope, its standard error, and a measure of what is left. Levels of units and of dates do not enter. So a change of the whole fleet is not
    /// taken for an effect of the weather. Where units of one date do not differ in the covariate, successive recordings of a unit are compared.
    fn slope(&self, x: &[Vec<f64>]) -> Option<(f64, f64, f64)> {
        let (mut xs, mut ys, mut unit_of, mut day_of) = (Vec::new(), Vec::new(), Vec::new(), Vec::new());
        let mut days: BTreeMap<i64, usize> = BTreeMap::new();
        for (index, (unit, x)) in self.units.values().zip(x).enumerate() {
            for (observation, x) in unit.iter().zip(x) {
                let next = days.len();
                day_of.push(observation.date.map(|date| *days.entry(date.days()).or_insert(next)));
                unit_of.push(Some(index));
                xs.push(*x);
                ys.push(observation.value);
            }
        }
        let squares = |values: &[f64]| values.iter().map(|x| x * x).sum::<f64>();
        let mut within = xs.clone();
        centre(&mut within, &unit_of);
        if squares(&within) <= 1e-12 * squares(&xs) || self.count() < self.units.len() + 1 + LEAST_FREE {
            return None;
        }
        let (mut x_own, mut y_own) = (xs.clone(), ys.clone());
        for _ in 0..SWEEPS {
            for values in [&mut x_own, &mut y_own] {
                centre(values, &unit_of);
                centre(values, &day_of);
            }
        }
        let free = xs.len().saturating_sub(self.units.len() + days.len());
        if free >= LEAST_FREE && squares(&x_own) > LEAST_OWN * squares(&within) {
            let xx = squares(&x_own);
            let slope = x_own.iter().zip(&y_own).map(|(x, y)| x * y).sum::<f64>() / xx;
            let left = (squares(&y_own) - slope * slope * xx).max(0.0);
            return Some((slope, (left / free as f64 / xx).sqrt(), left));
        }
        self.by_successive(x)
    }

    /// The slope by differences of successive recordings, least absolute deviations: a step is in one difference only.
    fn by_successive(&self, x: &[Vec<f64>]) -> Option<(f64, f64, f64)> {
        let mut ratios: Vec<(f64, f64, f64)> = Vec::new();
        for (unit, x) in self.units.values().zip(x) {
            for (pair, x) in unit.windows(2).zip(x.windows(2)) {
                let (dx, dy) = (x[1] - x[0], pair[1].value - pair[0].value);
                if dx != 0.0 {
                    ratios.push((dy / dx, dx, dy));
                }
            }
        }
        ratios.sort_by(|a, b| a.0.total_cmp(&b.0));
        let half = 0.5 * ratios.iter().map(|(_, dx, _)| dx.abs()).sum::<f64>();
        let mut sum = 0.0;
        let (slope, ..) = *ratios.iter().find(|(_, dx, _)| {
            sum += dx.abs();
            sum >= half
        })?;
        let left: Vec<f64> = ratios.iter().map(|(_, dx, dy)| dy - slope * dx).collect();
        let xx: f64 = ratios.iter().map(|(_, dx, _)| dx * dx).sum();
        // Least absolute deviations have √(π/2) times the error of least squares where residuals are normal.
        let sd = (std::f64::consts::FRAC_PI_2 / xx).sqrt() * super::statistics::robust_deviation(&left);
        Some((slope, sd, left.iter().map(|x| x.abs()).sum()))
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

/// Takes the mean of each group out; a value without a group stays.
fn centre(values: &mut [f64], group: &[Option<usize>]) {
    let count = group.iter().flatten().max().map_or(0, |most| most + 1);
    let mut sums = vec![(0.0, 0.0); count];
    for (value, group) in values.iter().zip(group) {
        if let Some(sum) = group.and_then(|group| sums.get_mut(group)) {
            sum.0 += value;
            sum.1 += 1.0;
        }
    }
    for (value, group) in values.iter_mut().zip(group) {
        if let Some((sum, count)) = group.and_then(|group| sums.get(group)) {
            *value -= sum / count;
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
