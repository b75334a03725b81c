//! Two sets of bags of a loop: what changed between them, stated or not, and what that does to the stability limit.

use super::bounds::Bounds;
use super::compare::{short, single};
use super::graphs::{Stated, differ, keys};
use super::types::{Check, Kind, Outcome};
use crate::table::{Table, TableRow};
use backdrive_bags::Reader;
use backdrive_why::cause_kind::CauseKind;
use backdrive_why::seen::{Seen, seen};
use std::collections::{BTreeMap, BTreeSet};
use std::path::{Path, PathBuf};
use std::sync::atomic::AtomicBool;

/// The check that no model of a loop got worse.
const MODELS: &str = "models";
/// Changes that a sentence lists; the others are counted.
const LISTED: usize = 6;

/// The loops of one side: a row for each, and the bag whose limit is the lowest.
pub(super) struct Loops<'a> {
    /// The rows.
    pub table: &'a Table,
    /// The bags by the names of their recordings.
    pub bags: &'a BTreeMap<String, PathBuf>,
}

/// What a bag shows of its loop.
struct Shown {
    keys: BTreeMap<String, String>,
    seen: Vec<Seen>,
}

/// Checks of the loops: what changed, verdict, stability limit, and the margin to it.
pub(super) fn loops(old: &Loops, new: &Loops, bounds: &Bounds, notes: &mut Vec<String>) -> Vec<Check> {
    let (Some(a), Some(b)) = (worst(old.table), worst(new.table)) else { return Vec::new() };
    let mut out = Vec::new();
    let mut changes: Vec<String> = Vec::new();
    let shown = |side: &Loops, row: &TableRow| side.bags.get(&row.recording).and_then(|bag| shown(bag));
    if let (Some(before), Some(after)) = (shown(old, a), shown(new, b)) {
        let stated = differ(&before.keys, &after.keys);
        changes.extend(stated.iter().map(Stated::words));
        out.extend(stated.iter().map(|one| of_stated(one, bounds)));
        for one in unstated(&before.seen, &after.seen) {
            if one.quantity != MODELS {
                changes.push(one.sentence.trim_start_matches("loop: ").to_string());
            }
            out.push(one);
        }
        let same_place =
            |now: &&Seen| before.seen.iter().any(|was| (was.kind, &was.place) == (now.kind, &now.place) && was.evidence != now.evidence);
        for now in after.seen.iter().filter(same_place) {
            let was = before.seen.iter().find(|was| (was.kind, &was.place) == (now.kind, &now.place)).map_or("", |was| &was.evidence);
            notes.push(format!("both sides differ from their graphs; old: {was}; new: {}", now.evidence));
        }
    } else {
        out.extend(by_models(old.table, new.table));
    }
    out.push(of_verdict(old.table, new.table));
    out.push(of_limit(a, b, bounds, &changes));
    out.extend(of_margin(a, b, bounds, &changes));
    out
}

/// The row with the lowest limit, else the first one.
fn worst(table: &Table) -> Option<&TableRow> {
    let of = |row: &&TableRow| limit(row).unwrap_or(f64::INFINITY);
    table.rows.iter().min_by(|a, b| of(a).total_cmp(&of(b)))
}

fn limit(row: &TableRow) -> Option<f64> {
    row.numbers.get("critical_gain").or_else(|| row.numbers.get("critical_gain_at_least")).copied()
}

/// Whether the limit was not reached, so that it is at least this.
fn is_open(row: &TableRow) -> bool {
    !row.numbers.contains_key("critical_gain")
}

fn shown(bag: &Path) -> Option<Shown> {
    let reader = Reader::open_begun(bag).ok()?;
    let keys = keys(&reader)?;
    // A bag that was judged can be read; where a node cannot be run alone nothing is known besides the graph.
    let seen = seen(bag, &AtomicBool::new(false)).unwrap_or_default();
    Some(Shown { keys, seen })
}

/// A change that the graphs state. A rate is judged by its bound; other stated changes are judged by what they do to limit and margin.
fn of_stated(one: &Stated, bounds: &Bounds) -> Check {
    let number = |text: &Option<String>| text.as_ref().and_then(|text| text.parse::<f64>().ok());
    let (old, new) = (number(&one.old), number(&one.new));
    let bound = bounds.of("loop", "rate").map_or(0.02, |(_, bound)| bound);
    let is_beyond = match (old, new) {
        (Some(a), Some(b)) if a > 0.0 && b > 0.0 => (b / a).ln().abs() > (1.0 + bound).ln(),
        _ => true,
    };
    let outcome = if one.kind == Kind::Rate && is_beyond { Outcome::Failed } else { Outcome::Passed };
    Check { old, new, ..single(one.kind, "loop", &one.key, outcome, format!("loop: the graphs state {}", one.words())) }
}

/// Differences from its own graph that only one side has: nobody has stated them.
fn unstated(old: &[Seen], new: &[Seen]) -> Vec<Check> {
    let only = |these: &[Seen], others: &[Seen]| -> Vec<Seen> {
        these.iter().filter(|one| others.iter().all(|other| (other.kind, &other.place) != (one.kind, &one.place))).cloned().collect()
    };
    let check =
        |one: Seen, outcome, when: &str| single(kind_of(one.kind), "loop", &one.place, outcome, format!("loop: {}{when}", one.evidence));
    let added = only(new, old).into_iter().map(|one| check(one, Outcome::Failed, ""));
    let removed = only(old, new).into_iter().map(|one| check(one, Outcome::Passed, ", in the old recordings only"));
    let mut out: Vec<Check> = added.chain(removed).collect();
    if !out.iter().any(|check| check.outcome == Outcome::Failed) {
        out.push(single(Kind::Physics, "loop", MODELS, Outcome::Passed, "loop: every model fits as before".to_string()));
    }
    out
}

fn kind_of(kind: CauseKind) -> Kind {
    match kind {
        CauseKind::Delay | CauseKind::Loss | CauseKind::Rate | CauseKind::Clock | CauseKind::TwoPublishers => Kind::Rate,
        CauseKind::GainTooHigh => Kind::Gain,
        CauseKind::FilterLag
        | CauseKind::CoarseSensor
        | CauseKind::DeadSensor
        | CauseKind::RailedSensor
        | CauseKind::ScaledSensor
        | CauseKind::WrongSign
        | CauseKind::LateSensor => Kind::Sensor,
        CauseKind::Grip | CauseKind::Inertia | CauseKind::TorqueConstant | CauseKind::Servo | CauseKind::Environment => Kind::Parameter,
        _ => Kind::Physics,
    }
}

/// Of recordings of others, which hold no graph: the parts whose models do not fit any more.
fn by_models(old: &Table, new: &Table) -> Vec<Check> {
    let parts = |table: &Table| -> BTreeSet<String> {
        let texts = table.rows.iter().filter_map(|row| row.words.get("disagreeing_models"));
        texts.flat_map(|text| text.split(", ")).filter(|part| !part.is_empty()).map(str::to_string).collect()
    };
    let added: Vec<String> = parts(new).difference(&parts(old)).cloned().collect();
    let (outcome, sentence) = match added.is_empty() {
        true => (Outcome::Passed, "loop: every model fits as before".to_string()),
        false => (
            Outcome::Failed,
            format!("loop: the model of {} does not fit any more: `backdrive why` finds what it lacks", added.join(" and ")),
        ),
    };
    vec![single(Kind::Physics, "loop", MODELS, outcome, sentence)]
}

fn of_verdict(old: &Table, new: &Table) -> Check {
    let words = |table: &Table| -> BTreeSet<String> { table.rows.iter().filter_map(|row| row.words.get("verdict").cloned()).collect() };
    let (before, after) = (words(old), words(new));
    let bad = |words: &BTreeSet<String>| words.iter().any(|word| ["unstable", "limit_cycle", "limited"].contains(&word.as_str()));
    let list = |words: &BTreeSet<String>| words.iter().cloned().collect::<Vec<_>>().join(" and ");
    let outcome = match (bad(&before), bad(&after)) {
        (false, true) => Outcome::Failed,
        _ if after.contains("cannot_tell") && !before.contains("cannot_tell") => Outcome::Uncertain,
        _ => Outcome::Passed,
    };
    single(Kind::Stability, "loop", "verdict", outcome, format!("loop: {} -> {}", list(&before), list(&after)))
}

fn of_limit(a: &TableRow, b: &TableRow, bounds: &Bounds, changes: &[String]) -> Check {
    let bound = bounds.of("loop", "critical_gain").map_or(0.1, |(_, bound)| bound);
    let (old, new) = (limit(a), limit(b));
    let outcome = match (old, new) {
        // A limit that was not reached may be above the old one.
        (Some(old), Some(new)) if new < old * (1.0 - bound) && is_open(b) => Outcome::Uncertain,
        (Some(old), Some(new)) if new < old * (1.0 - bound) => Outcome::Failed,
        (Some(_), None) => Outcome::Uncertain,
        _ => Outcome::Passed,
    };
    let said = |row: &TableRow| match limit(row) {
        Some(x) if is_open(row) => format!("at least {}", short(x)),
        Some(x) => short(x),
        None => "not known".to_string(),
    };
    let percent = match (old, new) {
        (Some(old), Some(new)) if !is_open(a) && !is_open(b) => {
            format!(" ({:+.0} %; bound -{:.0} %)", 100.0 * (new / old - 1.0), 100.0 * bound)
        }
        _ => String::new(),
    };
    let sentence = format!("loop: stability limit mu*lambda {} -> {}{percent}{}", said(a), said(b), because(outcome, changes));
    Check { old, new, bound: old.map(|old| bound * old), ..single(Kind::Stability, "loop", "critical_gain", outcome, sentence) }
}

/// The limit over the gain of the recording: a higher gain does not move the limit, and takes of the margin.
fn of_margin(a: &TableRow, b: &TableRow, bounds: &Bounds, changes: &[String]) -> Option<Check> {
    let margin = |row: &TableRow| Some(limit(row)? / row.numbers.get("gain").copied().filter(|gain| *gain > 0.0)?);
    let (old, new) = (margin(a)?, margin(b)?);
    let bound = bounds.of("loop", "gain_margin").map_or(0.2, |(_, bound)| bound);
    let outcome = match new < old * (1.0 - bound) {
        true if is_open(b) => Outcome::Uncertain,
        true => Outcome::Failed,
        false => Outcome::Passed,
    };
    let db = |x: f64| 20.0 * x.log10();
    let least = |row: &TableRow| if is_open(row) { "at least " } else { "" };
    let sentence = format!(
        "loop: gain margin {}{:.1} -> {}{:.1} dB (bound {:.1} dB less){}",
        least(a),
        db(old),
        least(b),
        db(new),
        -db(1.0 - bound),
        because(outcome, changes)
    );
    let check = single(Kind::Gain, "loop", "gain_margin", outcome, sentence);
    Some(Check { old: Some(old), new: Some(new), bound: Some(bound * old), ..check })
}

/// What changed, beside a check that failed.
fn because(outcome: Outcome, changes: &[String]) -> String {
    if outcome == Outcome::Passed || changes.is_empty() {
        return String::new();
    }
    let mut listed = changes.iter().take(LISTED).cloned().collect::<Vec<_>>().join("; ");
    if changes.len() > LISTED {
        listed.push_str(&format!("; and {} more", changes.len() - LISTED));
    }
    format!("; changed: {listed}")
}
