//! The banded rotary friction device: from a stiff linkage and the same friction either way to the play and the friction of each direction.

use crate::run::{Ask, LIKELY, diagnose, diagnosed_model, errors_of, findings, instead, parameter, percent, refit, refitted, said, write};
use crate::table::Report;
use crate::{Context, Study, StudyError, csv_columns};
use backdrive_diagnosis::output_error::evaluator::Evaluator;
use backdrive_diagnosis::output_error::structure::{Role, Structure};
use backdrive_diagnosis::recordings::problem::Problem;
use backdrive_diagnosis::tuning::tuning;
use backdrive_diagnosis::verdict::MODEL_FILE;
use backdrive_plant::model::Model;
use backdrive_signal::statistics::middle;

pub(crate) const STUDY: Study = Study {
    name: "brfd_friction_damper",
    about: "a band-brake damper: its play, and a friction that depends on the direction",
    needs: ("brfd_friction_damper", &FILES_NEEDED),
    run,
};

/// What the recordings are called by their authors, and here.
const FILES: [(&str, &str); 11] = [
    ("d2_0.25Hz30lbtension0.5amplitude.csv", "0.25Hz-0.5in.csv"),
    ("d2_0.25Hz30lbtension1amplitude.csv", "0.25Hz-1in.csv"),
    ("d2_0.5Hz30lbtension0.5amplitude.csv", "0.5Hz-0.5in.csv"),
    ("d2_0.5Hz30lbtension1amplitude.csv", "0.5Hz-1in.csv"),
    ("d2_0.25Hz30lbtension1.5amplitude.csv", "0.25Hz-1.5in.csv"),
    ("d2_0.5Hz30lbtension1.5amplitude.csv", "0.5Hz-1.5in.csv"),
    ("d2_1Hz30lbtension0.5amplitude.csv", "1Hz-0.5in.csv"),
    ("d2_1Hz30lbtension1amplitude.csv", "1Hz-1in.csv"),
    ("d2_1Hz30lbtension1.5amplitude.csv", "1Hz-1.5in.csv"),
    ("d2_ImperialValleyDBE.csv", "imperial-valley.csv"),
    ("d2_0.5Hz36lbtension1amplitude.csv", TIGHTER),
];
const FILES_NEEDED: [&str; 11] = {
    let mut names = [""; 11];
    let mut i = 0;
    while i < 11 {
        names[i] = FILES[i].0;
        i += 1;
    }
    names
};
/// The record with more tension in the band: its friction is another, all else is the same.
const TIGHTER: &str = "0.5Hz-1in-36lb.csv";
/// Records that are fitted.
const FITTED: usize = 4;
/// Sample rate of the recordings, Hz, and samples that are taken together: the band's chatter is above what is modelled.
const RATE: f64 = 1024.0;
/// See [`RATE`].
const TOGETHER: usize = 8;
/// SI of their units.
const INCH: f64 = 0.0254;
/// Newton per kilopound.
const KIP: f64 = 4448.2216;
/// Below this share of its peak the force counts as none, for the dead zone read off the loops.
const DEAD: f64 = 0.12;
/// Where their figures stand.
const SOURCE: &str = "read off the same records";

fn run(context: &Context) -> Result<Report, StudyError> {
    let mut dead = Vec::new();
    for (theirs, ours) in FILES {
        let columns = csv_columns::read_at_least(&context.data.join(theirs), &["disp_in", "force_kip"], 4096)?;
        let mean = |c: &[f64], scale: f64| -> Vec<f64> {
            c.chunks_exact(TOGETHER).map(|b| scale * b.iter().sum::<f64>() / TOGETHER as f64).collect()
        };
        let (x, f) = (mean(&columns[0], INCH), mean(&columns[1], KIP));
        let t: Vec<f64> = (0..x.len()).map(|i| (i * TOGETHER) as f64 / RATE).collect();
        csv_columns::write(&context.out.join(ours), &["t", "displacement", "force"], &[&t, &x, &f])?;
        if FILES[..FITTED].iter().any(|file| file.1 == ours) {
            dead.extend(dead_zones(&x, &f));
        }
    }
    let effort = if context.quick { 1.05 } else { 6.25 };
    let ask = Ask { name: "", set: "set.toml", model: "model.toml", without: &[], effects: 3, effort };
    let found = diagnose(context, &ask)?;
    let verdict = &found.verdict;
    let model = diagnosed_model(context, &ask)?;

    let mut report = Report::new("Banded rotary friction device, from a stiff linkage and symmetric friction");
    let named = findings(verdict);
    let words = said(verdict);
    report.word("verdict", &words);
    let has = |physics: &str| named.iter().any(|(p, _)| p == physics);
    let both = has("backlash") && has("asymmetric_coulomb");
    report.line("verdict", words, "play, friction by direction, compliance", "Coble et al. 2022", Some(both));
    let others = instead(verdict, LIKELY);
    report.word("instead", &others.join(" "));
    let text = if others.is_empty() { "nothing".to_string() } else { others.join(", ") };
    report.line("or instead", text, "", "", None);
    let middle = middle(&mut dead).unwrap_or(f64::NAN);
    if let Some((gap, [low, high])) = parameter(verdict, "backlash", "gap") {
        report.figure("gap", gap);
        let measured = format!("{:.2} mm ({:.2} to {:.2})", 1e3 * gap, 1e3 * low, 1e3 * high);
        let published = format!("{:.2} mm with the force below {:.0} % of its peak", 1e3 * middle, 100.0 * DEAD);
        report.line("play", measured, published, SOURCE, Some((0.5..2.0).contains(&(gap / middle))));
    }
    for (record, condition) in [(None, "30 lb"), (Some(TIGHTER), "36 lb")] {
        let (friction, quality) = match record {
            None => (friction_of(&model), None),
            Some(file) => {
                let (friction, nrmse) = with_own_friction(context, &model, file)?;
                (friction, Some(nrmse))
            }
        };
        let levels = plateaus(context, record.unwrap_or("0.25Hz-1in.csv"))?;
        report.figure(&format!("friction {condition} positive"), friction[0]);
        report.figure(&format!("friction {condition} negative"), friction[1]);
        let measured = format!("{:.1} / {:.1} kN", 1e-3 * friction[0], 1e-3 * friction[1]);
        let published = format!("{:.1} / {:.1} kN, mid-stroke medians", 1e-3 * levels[0], 1e-3 * levels[1]);
        let near = (0..2).all(|i| (friction[i] / levels[i] - 1.0).abs() < 0.1);
        report.line(&format!("friction forward / backward, {condition}"), measured, published, SOURCE, Some(near));
        if let Some(nrmse) = quality {
            report.figure("nrmse 36 lb", nrmse);
            report.line("36 lb, its friction free", format!("{:.1} %", 100.0 * nrmse), "", "", None);
        }
    }
    rival(&mut report, context, middle)?;
    let (before, after) = (percent(verdict.held_out.nrmse_refit), percent(verdict.held_out.nrmse_after));
    report.figure("held out before", before);
    report.figure("held out after", after);
    let measured = format!("{after:.1} % (nominal refitted: {before:.1} %)");
    report.line("nrmse, held out, mean of six", measured, "", "", Some(after < before));
    let problem = Problem::open(&context.out.join("set.toml"), Some(&context.out.join(MODEL_FILE)))
        .map_err(|e| StudyError::Diagnosis(e.to_string()))?;
    for (records, fitted) in [(&problem.fit, true), (&problem.held_out, false)] {
        for (name, nrmse) in errors_of(&problem, records)? {
            let what = format!("nrmse, {name}{}", if fitted { ", fitted" } else { "" });
            report.figure(&what, nrmse);
            report.line(&what, format!("{:.1} %", 100.0 * nrmse), "", "", None);
        }
    }
    report.notes.push(
        "What is left over is the band's stick-slip: bursts at 5 to 30 Hz that differ from one cycle to the next, so that no model follows them."
            .to_string(),
    );
    Ok(report)
}

/// The play and the friction of each direction that are known to be there, fitted instead of the named effects.
fn rival(report: &mut Report, context: &Context, dead_zone: f64) -> Result<(), StudyError> {
    let ask = Ask { name: "play", set: "set.toml", model: "play.toml", without: &[], effects: 1, effort: 0.85 };
    let found = refit(context, &ask)?;
    let [gap, forward, backward] =
        ["elements.linkage.gap", "elements.band.positive", "elements.band.negative"].map(|path| refitted(&found, path));
    let unseen = found.verdict.held_out.nrmse_refit.unwrap_or(f64::NAN);
    for (name, value) in [("rival gap", gap), ("rival forward", forward), ("rival backward", backward), ("rival held out", unseen)] {
        report.figure(name, value);
    }
    let dead = format!("{:.2} mm with the force below {:.0} % of its peak", 1e3 * dead_zone, 100.0 * DEAD);
    report.line(
        "a play fitted in its place: gap",
        format!("{:.2} mm", 1e3 * gap),
        dead,
        SOURCE,
        Some((0.5..2.0).contains(&(gap / dead_zone))),
    );
    let levels = plateaus(context, "0.25Hz-1in.csv")?;
    report.line(
        "with it, friction forward / backward",
        format!("{:.1} / {:.1} kN", 1e-3 * forward, 1e-3 * backward),
        format!("{:.1} / {:.1} kN, mid-stroke medians", 1e-3 * levels[0], 1e-3 * levels[1]),
        SOURCE,
        Some((forward / levels[0] - 1.0).abs() < 0.1 && (backward / levels[1] - 1.0).abs() < 0.1),
    );
    report.line("with it, nrmse, held out, mean of six", format!("{:.1} %", 100.0 * unseen), "", "", None);
    Ok(())
}

/// The force's dead zone after each reversal, m: how far the rod goes while the force is below a share of its peak.
fn dead_zones(x: &[f64], f: &[f64]) -> Vec<f64> {
    let peak = f.iter().fold(0.0f64, |a, b| a.max(b.abs()));
    let mut found = Vec::new();
    let mut from: Option<usize> = None;
    for i in 1..x.len() {
        let inside = f[i].abs() < DEAD * peak;
        match (inside, from) {
            (true, None) => from = Some(i),
            (false, Some(start)) => {
                // Only what leads from one direction's force to the other's is a reversal's dead zone.
                if start > 0 && f[start - 1] * f[i] < 0.0 {
                    found.push((x[i] - x[start]).abs());
                }
                from = None;
            }
            _ => {}
        }
    }
    found
}

/// Median force in the middle of the strokes, forward and backward, N, both positive.
fn plateaus(context: &Context, file: &str) -> Result<[f64; 2], StudyError> {
    let columns = csv_columns::read(&context.out.join(file), &["displacement", "force"])?;
    let (x, f) = (&columns[0], &columns[1]);
    let reach = x.iter().fold(0.0f64, |a, b| a.max(b.abs()));
    let mut levels = [Vec::new(), Vec::new()];
    for i in 1..x.len().saturating_sub(1) {
        if x[i].abs() < 0.3 * reach {
            let speed = x[i + 1] - x[i - 1];
            if speed.abs() > 0.02 * reach {
                let side = usize::from(speed < 0.0);
                levels[side].push(f[i] * speed.signum());
            }
        }
    }
    Ok([0, 1].map(|side| middle(&mut levels[side]).unwrap_or(f64::NAN)))
}

/// Paths of the band's friction forward and backward.
fn friction_paths(model: &Model) -> [&'static str; 2] {
    let path = "elements.band.positive";
    match model.values_at(path) {
        Ok(_) => [path, "elements.band.negative"],
        Err(_) => ["elements.band.force"; 2],
    }
}

fn friction_of(model: &Model) -> [f64; 2] {
    friction_paths(model).map(|path| model.values_at(path).ok().and_then(|v| v.first().copied()).unwrap_or(f64::NAN))
}

/// The band's friction as one record alone has it, all else as in the model, and the error that is left.
fn with_own_friction(context: &Context, model: &Model, file: &str) -> Result<([f64; 2], f64), StudyError> {
    let paths = friction_paths(model);
    let mut keys: Vec<&str> = paths.to_vec();
    keys.dedup();
    let condition = keys.iter().map(|k| format!("\"{k}\" = \"free\"")).collect::<Vec<_>>().join(", ");
    let fitted: Vec<String> = FILES[..FITTED].iter().map(|f| format!("\"{}\"", f.1)).collect();
    let text = format!(
        "model    = \"{}\"\nfit      = [{}]\nheld_out = [\"{file}\"]\ninitial  = \"rest\"\n\n[files.\"{file}\"]\ncondition = {{ {condition} }}\n",
        MODEL_FILE,
        fitted.join(", ")
    );
    let set = context.out.join("set-36lb.toml");
    write(&set, &text)?;
    let opened = Problem::open(&set, None).map_err(|e| StudyError::Diagnosis(e.to_string()))?;
    let fixed = Problem { stated: Vec::new(), ..opened };
    let own = Structure::new(&fixed, &fixed.held_out, Vec::new());
    let start = own.values(&fixed, &[], &[], &[]);
    let failed = || StudyError::Diagnosis(format!("{file}: the model cannot be simulated"));
    let fit = Evaluator::on(&fixed, &fixed.held_out).fit(&own, &start, tuning().fit.to_the_end).ok_or_else(failed)?;
    let value = |path: &str| {
        let at = own.free.iter().position(|n| matches!(&n.role, Role::Condition(p, _) if p == path));
        at.and_then(|i| fit.values.get(i).copied()).unwrap_or(f64::NAN)
    };
    let nrmse = errors_of(&fixed, &fixed.held_out)?.first().map_or(f64::NAN, |e| e.1);
    Ok((paths.map(value), nrmse))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_dead_zone_of_a_drawn_loop_is_as_wide_as_drawn() {
        // 0 to 10 and back, the force 5 but for 2 behind each reversal.
        let mut x: Vec<f64> = (0..=100).map(|i| 0.1 * f64::from(i)).collect();
        let back: Vec<f64> = x.iter().rev().copied().collect();
        x.extend(back);
        let f: Vec<f64> = (0..x.len())
            .map(|i| match i {
                0..=20 => 0.0,
                21..=100 => 5.0,
                101..=121 => 0.0,
                _ => -5.0,
            })
            .collect();
        let found = dead_zones(&x, &f);
        assert_eq!(found.len(), 1, "{found:?}");
        assert!((found[0] - 2.0).abs() < 0.2, "{found:?}");
    }
}
