//! What the table of a triage shows of the fleet: parameters of each unit, what changed on which unit since when, and which units differ.

pub mod change;
pub mod common;
pub mod moderated;
pub mod observations;
pub mod odd;
pub mod pooled;
pub mod statistics;
mod types;
mod words;

pub use types::{Analysis, Change, LeftOut, Odd, OfFleet};
pub use words::{amount, sentence_of_change, sentence_of_odd};

use crate::date::Date;
use crate::parameter::{self, Parameter};
use crate::table::Table;
use change::{Found, change, scatter, successive};
use common::common;
use moderated::{Prior, prior};
use observations::{Observations, accepted};
use pooled::pooled;
use statistics::{Group, adjusted, median};
use std::collections::BTreeMap;

/// False discovery rate where nothing else is asked: of the units that are named, one in a hundred is wrong on average.
pub const FALSE_DISCOVERIES: f64 = 0.01;

/// A change below this share of the fleet's level counts as none: it depends on the motions more than on the device.
const LEAST_SHARE: f64 = 0.02;
/// The same of a torque scale, and of a lag in s.
const LEAST_GAIN: f64 = 0.005;
/// See [`LEAST_GAIN`].
const LEAST_LAG: f64 = 0.5e-3;

/// One parameter of one joint, prepared.
struct Prepared {
    joint: String,
    parameter: Parameter,
    observations: Observations,
    values: BTreeMap<String, Vec<f64>>,
    shift: Vec<(Date, f64)>,
    is_removed: bool,
    correlation: f64,
    /// How values of a unit scatter in the fleet.
    prior: Option<Prior>,
    /// The size up to which a change counts as none.
    least: f64,
}

struct Candidate {
    prepared: usize,
    unit: String,
    found: Found,
    dates: Vec<Date>,
}

/// Analyses a table of a triage.
pub fn analyse(table: &Table, false_discoveries: f64) -> Analysis {
    let accepted = accepted(table);
    let mut all = Vec::new();
    for joint in table.joints() {
        for parameter in parameter::ALL {
            let observations = Observations::of(table, joint, parameter.name, &accepted);
            if observations.count() > 0 {
                all.push(prepared(joint, parameter, observations));
            }
        }
    }
    let least: Vec<f64> = all.iter().map(|of| least_of(of, &all)).collect();
    all.iter_mut().zip(least).for_each(|(of, least)| of.least = least);
    let mut candidates = Vec::new();
    for (index, of) in all.iter().enumerate() {
        for unit in of.observations.units.keys() {
            candidates.extend(candidate(of, index, unit));
        }
    }
    let q = adjusted(&candidates.iter().map(|candidate| candidate.found.p).collect::<Vec<_>>());
    let mut changes = Vec::new();
    let mut since: BTreeMap<(usize, String), Date> = BTreeMap::new();
    for (candidate, q) in candidates.iter().zip(&q).filter(|(_, q)| **q <= false_discoveries) {
        since.insert((candidate.prepared, candidate.unit.clone()), candidate.dates[candidate.found.at]);
        changes.push(changed(&all[candidate.prepared], &candidate.unit, &candidate.found, &candidate.dates, *q));
    }
    let together = together(&all, false_discoveries);
    sort(&mut changes);
    let mut parameters = Vec::new();
    let mut beside = Vec::new();
    for (index, of) in all.iter().enumerate() {
        let Some(pooled) = pooled(&groups(of, index, &since)) else { continue };
        beside.extend(odd::beside(&pooled).into_iter().map(|one| (index, one)));
        parameters.push(OfFleet {
            joint: of.joint.clone(),
            parameter: of.parameter.name,
            unit: of.parameter.unit(of.observations.is_servo),
            covariate: of.observations.covariate.clone(),
            pooled,
        });
    }
    let q = adjusted(&beside.iter().map(|(_, one)| one.p).collect::<Vec<_>>());
    let mut odd: Vec<Odd> = Vec::new();
    for ((index, one), q) in beside.iter().zip(&q).filter(|(_, q)| **q <= false_discoveries) {
        let of = &all[*index];
        let mut odd_one = Odd {
            unit: one.unit.clone(),
            joint: of.joint.clone(),
            parameter: of.parameter.name,
            value: one.value,
            fleet: one.fleet,
            ci95: one.interval,
            q: *q,
            sentence: String::new(),
        };
        odd_one.sentence = sentence_of_odd(&odd_one, of.parameter, of.observations.is_servo);
        odd.push(odd_one);
    }
    odd.sort_by(|a, b| a.q.total_cmp(&b.q).then_with(|| (&a.unit, &a.joint).cmp(&(&b.unit, &b.joint))));
    let notes = notes(table, &all);
    let recordings = table.rows.iter().map(|row| &row.recording).collect::<std::collections::BTreeSet<_>>().len();
    Analysis {
        recordings,
        units: table.units().len(),
        false_discoveries,
        changes,
        together,
        odd,
        parameters,
        left_out: left_out(table, &accepted),
        notes,
    }
}

fn prepared(joint: &str, parameter: Parameter, observations: Observations) -> Prepared {
    let common = common(&observations);
    let dates = common.days.iter().map(|(first, _)| Date(first * 86_400));
    let mut of = Prepared {
        joint: joint.to_string(),
        parameter,
        shift: dates.zip(common.shift.iter().copied()).collect(),
        is_removed: common.is_removed,
        values: common.values,
        observations,
        correlation: 0.0,
        prior: None,
        least: 0.0,
    };
    // The median over the units: that of one unit is hardly known.
    let each: Vec<f64> = of
        .observations
        .units
        .keys()
        .filter_map(|unit| dated(&of, unit))
        .filter_map(|(values, time, variance, _)| successive(&values, &time, &variance))
        .collect();
    of.correlation = median(&each).max(0.0);
    let scatters = of.observations.units.keys().filter_map(|unit| dated(&of, unit));
    of.prior = prior(&scatters.filter_map(|(values, _, variance, _)| scatter(&values, &variance, of.correlation)).collect::<Vec<_>>());
    of
}

/// The size up to which a change counts as none; a constant torque is compared with the dry friction of its joint.
fn least_of(of: &Prepared, all: &[Prepared]) -> f64 {
    let level = |name: &str| {
        let of = all.iter().find(|other| other.joint == of.joint && other.parameter.name == name);
        of.map_or(0.0, |of| median(&of.values.values().map(|values| median(values).abs()).collect::<Vec<_>>()))
    };
    match of.parameter.name {
        "constant" => LEAST_SHARE * level("dry"),
        "gain" if !of.observations.is_servo => LEAST_GAIN,
        "lag" | "delay" => LEAST_LAG,
        own => LEAST_SHARE * level(own),
    }
}

type Dated = (Vec<f64>, Vec<f64>, Vec<f64>, Vec<Date>);

/// Values of a unit with dates: values, days, variances with what recordings of a unit differ by, dates.
fn dated(of: &Prepared, unit: &str) -> Option<Dated> {
    let observations = of.observations.units.get(unit)?;
    let values = of.values.get(unit)?;
    let with: Vec<(f64, f64, Date)> =
        observations.iter().zip(values).filter_map(|(o, value)| Some((*value, o.variance, o.date?))).collect();
    // Squares of successive differences are twice the variance, and a change is in one of them only.
    let steps: Vec<f64> = with.windows(2).map(|w| (w[1].0 - w[0].0).powi(2)).collect();
    // The median of a χ² with one degree of freedom is 0.4549.
    let whole = median(&steps) / (2.0 * 0.4549);
    let known = median(&with.iter().map(|w| w.1).collect::<Vec<_>>());
    let within = (whole - known).max(0.0);
    Some((
        with.iter().map(|w| w.0).collect(),
        with.iter().map(|w| w.2.0 as f64 / 86_400.0).collect(),
        with.iter().map(|w| w.1 + within).collect(),
        with.iter().map(|w| w.2).collect(),
    ))
}

fn candidate(of: &Prepared, index: usize, unit: &str) -> Option<Candidate> {
    let (values, time, variance, dates) = dated(of, unit)?;
    let found = change(&values, &time, &variance, of.correlation, of.least, of.prior)?;
    Some(Candidate { prepared: index, unit: unit.to_string(), found, dates })
}

fn changed(of: &Prepared, unit: &str, found: &Found, dates: &[Date], q: f64) -> Change {
    let date = |index: usize| dates.get(index).map_or_else(String::new, |date| date.iso());
    let mut out = Change {
        unit: unit.to_string(),
        joint: of.joint.clone(),
        parameter: of.parameter.name,
        shape: found.shape,
        since: date(found.at),
        possible: found.possible.map(date),
        before: found.before,
        effect: found.effect,
        ci95: found.interval,
        recordings: dates.len() - found.at,
        p: found.p,
        q,
        sentence: String::new(),
    };
    out.sentence = sentence_of_change(&out, of.parameter, of.observations.is_servo);
    out
}

/// Changes of the common shift itself.
fn together(all: &[Prepared], false_discoveries: f64) -> Vec<Change> {
    let mut found = Vec::new();
    for (index, of) in all.iter().enumerate() {
        let level = median(&of.values.values().map(|values| median(values)).collect::<Vec<_>>());
        let values: Vec<f64> = of.shift.iter().map(|(_, shift)| level + shift).collect();
        let time: Vec<f64> = of.shift.iter().map(|(date, _)| date.days() as f64).collect();
        let even = vec![1.0; values.len()];
        let correlation = successive(&values, &time, &even).unwrap_or(0.0);
        if let Some(change) = change(&values, &time, &even, correlation, of.least, None) {
            found.push((index, change));
        }
    }
    let q = adjusted(&found.iter().map(|(_, found)| found.p).collect::<Vec<_>>());
    let named = found.iter().zip(&q).filter(|(_, q)| **q <= false_discoveries).map(|((index, found), q)| {
        let dates: Vec<Date> = all[*index].shift.iter().map(|(date, _)| *date).collect();
        changed(&all[*index], "all units", found, &dates, *q)
    });
    let mut out: Vec<Change> = named.collect();
    sort(&mut out);
    out
}

/// Those of a unit and a joint stand together, and within them as well as among them the clearest comes first.
fn sort(changes: &mut [Change]) {
    let mut best: BTreeMap<(String, String), f64> = BTreeMap::new();
    for change in changes.iter() {
        let least = best.entry((change.unit.clone(), change.joint.clone())).or_insert(f64::INFINITY);
        *least = least.min(change.p);
    }
    changes.sort_by(|a, b| {
        let (ka, kb) = ((a.unit.clone(), a.joint.clone()), (b.unit.clone(), b.joint.clone()));
        best[&ka]
            .total_cmp(&best[&kb])
            .then_with(|| ka.cmp(&kb))
            .then_with(|| a.p.total_cmp(&b.p))
            .then_with(|| a.parameter.cmp(b.parameter))
    });
}

/// Estimates by unit; of a unit with a change those since then.
fn groups(of: &Prepared, index: usize, since: &BTreeMap<(usize, String), Date>) -> BTreeMap<String, Group> {
    let of_unit = |(unit, all): (&String, &Vec<observations::Observation>)| {
        let from = since.get(&(index, unit.clone()));
        let counted = all.iter().filter(|o| from.is_none_or(|from| o.date.is_none_or(|date| date >= *from)));
        (unit.clone(), counted.map(|o| (o.value, o.variance)).unzip())
    };
    of.observations.units.iter().map(of_unit).collect()
}

fn left_out(table: &Table, accepted: &[bool]) -> Vec<LeftOut> {
    let mut out: Vec<LeftOut> = Vec::new();
    for (row, _) in table.rows.iter().zip(accepted).filter(|(_, accepted)| !**accepted) {
        let why = match row.error.is_empty() {
            false => row.error.clone(),
            true => format!("{}: {}", row.joint, row.words.get("audit").map_or("", String::as_str)),
        };
        match out.last_mut().filter(|last| last.recording == row.recording) {
            Some(last) => last.why = format!("{}; {why}", last.why),
            None => out.push(LeftOut { recording: row.recording.clone(), unit: row.unit.clone(), why }),
        }
    }
    out
}

fn notes(table: &Table, all: &[Prepared]) -> Vec<String> {
    let mut notes = Vec::new();
    let undated =
        table.rows.iter().filter(|row| row.date.is_none()).map(|row| &row.recording).collect::<std::collections::BTreeSet<_>>().len();
    if undated > 0 {
        notes.push(format!(
            "{undated} recordings have no date, so no change is sought in them: state date in the manifest, or in the file's name"
        ));
    }
    if !all.is_empty() && all.iter().all(|of| !of.is_removed) {
        notes.push(format!(
            "what all units do together is not removed: that takes at least {} units with recordings of the same days. A change may then be one of the whole fleet",
            common::LEAST_UNITS + 1
        ));
    }
    let most = all.iter().flat_map(|of| of.observations.units.values().map(Vec::len)).max().unwrap_or(0);
    if most < change::LEAST_ALL {
        notes.push(format!("no unit has {} recordings, which a change point takes", change::LEAST_ALL));
    }
    notes
}
