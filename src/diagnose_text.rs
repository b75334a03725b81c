//! What `backdrive diagnose` prints: a dozen lines for a person, from the same data as the verdict file.

use crate::diagnose::Found;
use crate::recordings::file_name;
use backdrive_diagnosis::audit::Weight;
use backdrive_diagnosis::intervals::Spread;
use backdrive_diagnosis::numbers::rows;
use backdrive_diagnosis::words;
use backdrive_report::{number, si};
use serde_json::Value;
use std::fmt::Write as _;

/// Remarks of the audit that are printed, at most; all are in the report.
const REMARKS: usize = 3;

/// The dozen lines.
pub fn text(found: &Found) -> String {
    let mut out = String::new();
    let mut line = |name: &str, text: String| {
        let _ = writeln!(out, "{name:<9} {text}");
    };
    let json = &found.said.json;
    line("audit", recordings(found));
    let mut cautions = found.remarks.iter().filter(|r| r.weight > Weight::Note);
    for remark in cautions.by_ref().take(REMARKS) {
        line("", remark.to_string());
    }
    match cautions.count() {
        0 => {}
        more => line("", format!("and {more} more cautions, see the report")),
    }
    line("refit", refit(found));
    let word = json["verdict"].as_str().unwrap_or("").replace('_', " ").to_uppercase();
    line("verdict", format!("{word}: {}", found.said.sentence));
    let claimed = matches!(json["verdict"].as_str(), Some("missing" | "ambiguous"));
    for finding in json["findings"].as_array().into_iter().flatten() {
        line(if claimed { "found" } else { "nearest" }, described(finding));
        let others: Vec<String> = list(&finding["alternatives"]).iter().take(3).map(with_confidence).collect();
        if !others.is_empty() {
            line("", format!("or instead {}", others.join(", ")));
        }
    }
    let place = &json["where"];
    if word != "NOTHING MISSING" && word != "PARAMETERS" && place.is_object() {
        line("where", shows(place));
    }
    // Where nothing was found all of it remains, and it is told above where it shows.
    if let Some(left) = remains(&json["remaining"]).filter(|_| !list(&json["findings"]).is_empty()) {
        line("remains", left);
    }
    let held = &json["held_out"];
    let value = |key: &str| held[key].as_f64().map_or("?".to_string(), number);
    let on = if found.problem.held_out.is_empty() { "fitted" } else { "held out" };
    line(
        on,
        format!(
            "nrmse {} as given, {} refitted, {} diagnosed; the sensors' own noise is {}",
            value("nrmse_before"),
            value("nrmse_refit"),
            value("nrmse_after"),
            value("noise_floor")
        ),
    );
    if let Some(next) = next_experiment(&json["next_experiment"]) {
        line("next", next);
    }
    if found.search.cut {
        line(
            "note",
            "the search was cut off by the clock (--patience) or interrupted: on another machine it may come to another verdict"
                .to_string(),
        );
    } else if found.search.exhausted {
        line("note", "the search ended before everything was tried; --effort gives it more".to_string());
    }
    out.trim_end().to_string()
}

/// What was recorded, in a line.
fn recordings(found: &Found) -> String {
    let problem = &found.problem;
    let all: Vec<_> = problem.fit.iter().chain(&problem.held_out).collect();
    let samples: usize = all.iter().map(|r| r.len).sum();
    let rate = all.first().map_or(0.0, |r| 1.0 / r.period);
    let measured = |output: usize| all.iter().any(|r| r.outputs.get(output).is_some_and(Option::is_some));
    let noises: Vec<String> = problem
        .model
        .outputs
        .iter()
        .zip(&found.search.floor)
        .enumerate()
        .filter(|(index, _)| measured(*index))
        .map(|(_, (output, floor))| {
            format!("{} {}", output.name, si(*floor, &backdrive_diagnosis::numbers::unit_of_output(problem, &output.kind)))
        })
        .collect();
    format!(
        "{} recordings ({} held out), {samples} samples at {}; noise of {}",
        all.len(),
        problem.held_out.len(),
        si(rate, "Hz"),
        noises.join(", ")
    )
}

/// What refitting the parameters alone does.
fn refit(found: &Found) -> String {
    let search = &found.search;
    let level = |levels: &[f64]| levels.iter().fold(0.0f64, |a, b| a.max(*b));
    let spread = Spread::of(&search.nominal);
    let mut moved = rows(&found.problem, &search.nominal, &spread);
    moved.retain(|r| r.determined && r.moved_sd.is_some_and(f64::is_finite));
    moved.sort_by(|a, b| b.moved_sd.unwrap_or(0.0).abs().total_cmp(&a.moved_sd.unwrap_or(0.0).abs()));
    let most = moved.first().filter(|r| r.moved_sd.is_some_and(|s| s.abs() > 2.0)).map_or(String::new(), |r| {
        let given = r.given.unwrap_or(f64::NAN);
        format!("; {} moved most, {} to {} ({:.0} sd)", r.name, number(given), si(r.value, &r.unit), r.moved_sd.unwrap_or(0.0).abs())
    });
    format!(
        "residual {} times the sensor noise as given, {} with the parameters refitted{most}; {}",
        number(level(&search.levels_given)),
        number(level(&search.nominal.levels)),
        found.per_record.sentence()
    )
}

fn list(value: &Value) -> &[Value] {
    value.as_array().map_or(&[], Vec::as_slice)
}

/// `dry friction at the drum`.
pub fn named(finding: &Value) -> String {
    format!("{} {}", words::physics(finding["physics"].as_str().unwrap_or("")), words::place(finding))
}

/// `well supported (97 %)`, in words and percent.
pub fn confidence(finding: &Value) -> String {
    let share = finding["confidence"].as_f64().unwrap_or(0.0);
    let word = match share {
        s if s > 0.95 => "well supported",
        s if s > 0.8 => "supported",
        s if s > 0.4 => "weakly supported",
        s if s > 0.05 => "hardly supported",
        _ => "not supported by what remains",
    };
    format!("{word} ({})", words::share(share))
}

fn with_confidence(finding: &Value) -> String {
    format!("{} ({})", named(finding), words::share(finding["confidence"].as_f64().unwrap_or(0.0)))
}

/// A parameter of a verdict: value and interval, or lists of them.
pub fn parameter(value: &Value) -> String {
    let unit = value["unit"].as_str().unwrap_or("");
    let one = |v: &Value, ci: &Value| {
        let number_of = |x: &Value| x.as_f64().unwrap_or(f64::NAN);
        format!("{} (95 %: {} to {})", si(number_of(v), unit), si(number_of(&ci[0]), unit), si(number_of(&ci[1]), unit))
    };
    match &value["value"] {
        Value::Array(values) => {
            let intervals = list(&value["ci95"]);
            values.iter().zip(intervals).map(|(v, ci)| one(v, ci)).collect::<Vec<_>>().join("; ")
        }
        v => one(v, &value["ci95"]),
    }
}

fn described(finding: &Value) -> String {
    let parameters: Vec<String> = finding["parameters"]
        .as_object()
        .map(|all| all.iter().map(|(key, value)| format!("{} {}", key.replace('_', " "), parameter(value))).collect())
        .unwrap_or_default();
    let replaced: Vec<&str> = list(&finding["replaces"]).iter().filter_map(Value::as_str).collect();
    let instead = if replaced.is_empty() { String::new() } else { format!(", in place of {}", replaced.join(" and ")) };
    format!("{}{instead}: {}; {}", named(finding), parameters.join(", "), confidence(finding))
}

/// When, at which frequencies and in which state.
pub fn shows(place: &Value) -> String {
    let mut parts = Vec::new();
    if let Some(state) = place["state"].as_str() {
        parts.push(state.to_string());
    }
    if let [low, high] = list(&place["band_hz"])
        && let (Some(low), Some(high)) = (low.as_f64(), high.as_f64())
    {
        parts.push(format!("{} to {}", si(low, "Hz"), si(high, "Hz")));
    }
    if let Some(time) = list(&place["time"]).first()
        && let (Some(from), Some(to)) = (time[0].as_f64(), time[1].as_f64())
    {
        parts.push(format!("most at {} to {} s", number(from), number(to)));
    }
    parts.join("; ")
}

/// What the explanation leaves over, beside what was found; `None` where that is the sensors' noise.
pub fn remains(left: &Value) -> Option<String> {
    let place = left["where"].is_object().then(|| shows(&left["where"]))?;
    let share = left["share"].as_f64().map_or(String::new(), |s| {
        let floor = left["floor_share"].as_f64().map_or(String::new(), |f| format!(" (the sensors' noise would be {})", words::share(f)));
        format!("{} of the residual with the parameters refitted{floor}; ", words::share(s))
    });
    let like = left["looks_like"].as_str().map_or(String::new(), |like| format!("; looks most like {like}"));
    Some(format!("{share}{place}{like}"))
}

/// What to record next, however the verdict says it.
pub fn next_experiment(value: &Value) -> Option<String> {
    let text = match value {
        Value::Null => return None,
        Value::String(text) => text.clone(),
        Value::Object(all) => {
            let say = ["reason", "why", "text", "separates"].iter().find_map(|key| all.get(*key).and_then(Value::as_str));
            let file = ["file", "excitation"].iter().find_map(|key| all.get(*key).and_then(Value::as_str));
            match (say, file) {
                (Some(say), Some(file)) => format!("{say} ({})", file_name(file)),
                (Some(one), None) | (None, Some(one)) => one.to_string(),
                (None, None) => value.to_string(),
            }
        }
        other => other.to_string(),
    };
    Some(text)
}

#[cfg(test)]
mod tests {
    use super::*;
    use serde_json::json;

    #[test]
    fn a_finding_reads_as_a_line() {
        let finding = json!({
            "physics": "coulomb", "between": ["drum", "ground"], "confidence": 0.97, "replaces": [],
            "parameters": { "force": { "value": 0.101, "ci95": [0.098, 0.104], "unit": "N" } },
        });
        assert_eq!(described(&finding), "dry friction at the drum: force 101 mN (95 %: 98.0 mN to 104 mN); well supported (97 %)");
        let slip = json!({ "value": [1.0, 2.0], "ci95": [[0.5, 1.5], [1.0, 3.0]], "unit": "N" });
        assert_eq!(parameter(&slip), "1.00 N (95 %: 500 mN to 1.50 N); 2.00 N (95 %: 1.00 N to 3.00 N)");
    }

    #[test]
    fn what_remains_is_told_only_where_it_is_more_than_noise() {
        let noise = json!({ "share": 0.03, "floor_share": 0.03, "noise_sd": 1.01, "where": null, "looks_like": null });
        assert_eq!((remains(&noise), remains(&Value::Null)), (None, None));
        let left = json!({ "share": 0.31, "floor_share": 0.06, "noise_sd": 5.2, "where": { "time": [[1.0, 1.2]], "band_hz": [20.0, 90.0] },
            "looks_like": "backlash between motor and drum" });
        let said = "31 % of the residual with the parameters refitted (the sensors' noise would be 6 %); 20.0 Hz to 90.0 Hz; most at 1.00 to 1.20 s; \
                    looks most like backlash between motor and drum";
        assert_eq!(remains(&left).as_deref(), Some(said));
    }

    #[test]
    fn the_next_experiment_may_be_a_sentence_or_a_file() {
        assert_eq!(next_experiment(&Value::Null), None);
        let both = json!({ "file": "out/next.toml", "reason": "slower reversals" });
        assert_eq!(next_experiment(&both).as_deref(), Some("slower reversals (next.toml)"));
    }
}
