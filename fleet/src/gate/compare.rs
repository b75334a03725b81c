//! Old and new side by side: quantities of each joint, and limits of each loop.

use super::bounds::{ALL, Bounds, Of};
use super::types::{Check, Kind, Outcome};
use crate::analysis::statistics::{Group, added_variance, median, weighted_mean};
use crate::parameter::{EFFECTS, Parameter};
use crate::table::{Table, TableRow};
use std::collections::BTreeSet;

/// Standard errors beyond which a difference is no chance: 3.7 has a probability of 0.0002, and a set of seven joints has about 70 such checks.
const CLEAR: f64 = 3.7;
/// By this factor the old side has to be more certain than it takes before an uncertain new side counts: another motion alone changes errors by less.
const MARGIN: f64 = 2.0;
/// Standard error of the logarithm of a scale, such as a residual, by recording: 30 s of motion give it to about a tenth.
const OF_SCALE: f64 = 0.1;

/// Checks of every joint that both have, and of joints that only one has.
pub(super) fn joints(old: &Table, new: &Table, bounds: &Bounds) -> Vec<Check> {
    let mut out = Vec::new();
    let (before, after) = (old.joints(), new.joints());
    for joint in &before {
        if !after.contains(joint) {
            out.push(single(Kind::Sensor, joint, "presence", Outcome::Failed, format!("{joint}: is in the old recordings only")));
            continue;
        }
        let rows = |table: &'_ Table| table.rows.iter().filter(|row| row.joint == **joint).cloned().collect::<Vec<TableRow>>();
        of_joint(joint, &rows(old), &rows(new), bounds, &mut out);
    }
    for joint in after.iter().filter(|joint| !before.contains(joint)) {
        out.push(single(Kind::Sensor, joint, "presence", Outcome::Failed, format!("{joint}: is in the new recordings only")));
    }
    out
}

pub(super) fn single(kind: Kind, place: &str, quantity: &str, outcome: Outcome, sentence: String) -> Check {
    Check { kind, place: place.to_string(), quantity: quantity.to_string(), old: None, new: None, sd: None, bound: None, outcome, sentence }
}

fn of_joint(joint: &str, old: &[TableRow], new: &[TableRow], bounds: &Bounds, out: &mut Vec<Check>) {
    let dry = level(old, "dry").map_or(0.0, |(value, _)| value.abs());
    for (quantity, ..) in ALL {
        let Some((of, bound)) = bounds.of(joint, quantity) else { continue };
        let kind = kind_of(quantity);
        match kind {
            Kind::Parameter | Kind::Physics if quantity != "residual" => {
                let estimates = together(old, new, quantity);
                let Some(((a, va), (b, vb))) = estimates else { continue };
                let size = match of {
                    Of::Share => bound * a.abs(),
                    Of::Dry => bound * dry,
                    Of::Unit => bound,
                };
                out.push(judged(kind, joint, quantity, [(a, va), (b, vb)], size, old.iter().any(TableRow::is_servo)));
            }
            Kind::Stability => {}
            _ => out.extend(of_scale(kind, joint, quantity, old, new, bound)),
        }
    }
    let problems = |rows: &[TableRow]| -> BTreeSet<String> {
        // A problem that most recordings of a side have.
        let all: Vec<Vec<String>> =
            rows.iter().map(|row| row.words.get("audit").map_or(Vec::new(), |a| a.split(", ").map(str::to_string).collect())).collect();
        let names: BTreeSet<String> = all.iter().flatten().filter(|name| *name != "clean" && *name != "not checked").cloned().collect();
        names.into_iter().filter(|name| 2 * all.iter().filter(|one| one.contains(name)).count() > all.len()).collect()
    };
    let (before, after) = (problems(old), problems(new));
    let added: Vec<&String> = after.difference(&before).collect();
    let (outcome, sentence) = match added.is_empty() {
        true => (Outcome::Passed, format!("{joint}: no new problem of the recording")),
        false => {
            let names: Vec<&str> = added.iter().map(|name| name.as_str()).collect();
            (Outcome::Failed, format!("{joint}: the new recordings have a problem: {}; see `backdrive inspect`", names.join(", ")))
        }
    };
    out.push(single(Kind::Sensor, joint, "audit", outcome, sentence));
}

fn kind_of(quantity: &str) -> Kind {
    match quantity {
        "rate" => Kind::Rate,
        "critical_gain" => Kind::Stability,
        "position_noise" | "effort_noise" | "position_step" => Kind::Sensor,
        "residual" => Kind::Physics,
        other if EFFECTS.iter().any(|effect| effect.name == other) => Kind::Physics,
        _ => Kind::Parameter,
    }
}

/// Mean and variance of both sides. What recordings of a side differ by, beyond their own errors, is estimated of both together.
fn together(old: &[TableRow], new: &[TableRow], quantity: &str) -> Option<((f64, f64), (f64, f64))> {
    let group = |rows: &[TableRow]| -> Group {
        rows.iter().filter_map(|row| row.estimate(quantity)).map(|(value, sd)| (value, (sd * sd).max(f64::MIN_POSITIVE))).unzip()
    };
    let (a, b) = (group(old), group(new));
    if a.0.is_empty() || b.0.is_empty() {
        return None;
    }
    let added = added_variance(&[a.clone(), b.clone()]);
    let of = |(values, variances): &Group| weighted_mean(values, &variances.iter().map(|v| v + added).collect::<Vec<_>>());
    Some((of(&a), of(&b)))
}

/// Median of a quantity without an error.
fn level(rows: &[TableRow], quantity: &str) -> Option<(f64, usize)> {
    let values: Vec<f64> = rows.iter().filter_map(|row| row.numbers.get(quantity).copied()).collect();
    (!values.is_empty()).then(|| (median(&values), values.len()))
}

/// Fails where the difference is beyond the bound and no chance. A quantity counts where the error of the old side allows to see a change of the bound's
/// size; it is uncertain where that of the new side does not.
fn judged(kind: Kind, joint: &str, quantity: &str, sides: [(f64, f64); 2], bound: f64, is_servo: bool) -> Check {
    let [(old, of_old), (new, of_new)] = sides;
    let sd = (of_old + of_new).sqrt();
    let off = new - old;
    let outcome = if off.abs() > bound && off.abs() > CLEAR * sd {
        Outcome::Failed
    } else if CLEAR * of_old.sqrt() > bound || CLEAR * of_new.sqrt() > bound && MARGIN * CLEAR * of_old.sqrt() > bound {
        Outcome::NotJudged
    } else if CLEAR * of_new.sqrt() > bound {
        Outcome::Uncertain
    } else {
        Outcome::Passed
    };
    let words = match Parameter::of(quantity) {
        Some(parameter) => parameter.said(is_servo).to_string(),
        None => EFFECTS.iter().find(|effect| effect.name == quantity).map_or(quantity, |effect| effect.words).to_string(),
    };
    let unit = Parameter::of(quantity).map_or(if is_servo { "rad" } else { "N m" }, |parameter| parameter.unit(is_servo));
    let percent = if old.abs() > CLEAR * sd { format!(", {:+.0} %", 100.0 * off / old.abs()) } else { String::new() };
    let mut sentence = format!(
        "{joint}: {words} {} -> {} {unit}{percent} (95 % of the difference: {} to {}; bound {})",
        short(old),
        short(new),
        short(off - 1.96 * sd),
        short(off + 1.96 * sd),
        short(bound)
    );
    if matches!(outcome, Outcome::Uncertain | Outcome::NotJudged) {
        sentence.push_str("; the recordings do not determine it: record longer, with more motion of this joint");
    }
    Check {
        kind,
        place: joint.to_string(),
        quantity: quantity.to_string(),
        old: Some(old),
        new: Some(new),
        sd: Some(sd),
        bound: Some(bound),
        outcome,
        sentence,
    }
}

/// A scale, such as a residual or a rate: its ratio is compared.
fn of_scale(kind: Kind, joint: &str, quantity: &str, old: &[TableRow], new: &[TableRow], bound: f64) -> Option<Check> {
    let column = if quantity == "rate" { "rate_hz" } else { quantity };
    let ((a, na), (b, nb)) = (level(old, column)?, level(new, column)?);
    let sd = if kind == Kind::Rate { 0.0 } else { OF_SCALE * (1.0 / na as f64 + 1.0 / nb as f64).sqrt() };
    if a <= 0.0 || b <= 0.0 {
        return None;
    }
    let ratio = (b / a).ln();
    // Less noise and a smaller residual are no failure; another rate is, in either direction.
    let worse = if kind == Kind::Rate { ratio.abs() } else { ratio };
    let is_failed = worse > (1.0 + bound).ln() && worse > CLEAR * sd;
    let words = match quantity {
        "residual" => "residual of the regression",
        "rate" => "sample rate",
        "position_noise" => "noise of the position",
        "effort_noise" => "noise of the torque",
        "position_step" => "step of the position",
        other => other,
    };
    let more = if quantity == "residual" && is_failed {
        "; an effect that the regression does not have: `backdrive diagnose` names it"
    } else {
        ""
    };
    let sentence =
        format!("{joint}: {words} {} -> {} ({:+.0} %; bound {:.0} %){more}", short(a), short(b), 100.0 * (b / a - 1.0), 100.0 * bound);
    Some(Check {
        kind,
        place: joint.to_string(),
        quantity: quantity.to_string(),
        old: Some(a),
        new: Some(b),
        sd: Some(sd * a),
        bound: Some(bound * a),
        outcome: if is_failed { Outcome::Failed } else { Outcome::Passed },
        sentence,
    })
}

/// Three significant digits.
pub(super) fn short(value: f64) -> String {
    if value == 0.0 || !value.is_finite() {
        return format!("{value}");
    }
    let place = value.abs().log10().floor() as i32;
    match place {
        -3..=5 => format!("{value:.*}", (2 - place).clamp(0, 6) as usize),
        _ => format!("{value:.2e}"),
    }
}
