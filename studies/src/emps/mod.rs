//! EMPS: a ball-screw axis, the field's reference benchmark. What its published models leave out, from motion in to reaction out.

mod null;
mod open_loop;
mod pipeline;
mod prepare;

use crate::run::{Ask, LIKELY, diagnose, diagnosed_model, findings, instead, parameter, refit, refitted, said};
use crate::table::Report;
use crate::{Context, Study, StudyError};
use backdrive_diagnosis::verdict::Verdict;
use backdrive_plant::model::Model;
use pipeline::{Error, Form};
use prepare::Record;

pub(crate) const STUDY: Study = Study {
    name: "emps",
    about: "a ball-screw axis, the field's reference benchmark: what its published models leave out",
    needs: ("emps", &["emps_train.csv", "emps_test_pulses.csv"]),
    run,
};

/// Where the published numbers stand.
const PAPER: &str = "Janot, Gautier & Brunot 2019";
/// Bar on the error of the found model on the held-out record, %.
const BAR: f64 = 2.9;

fn run(context: &Context) -> Result<Report, StudyError> {
    let train = Record::read(&context.data.join("emps_train.csv"))?;
    let pulses = Record::read(&context.data.join("emps_test_pulses.csv"))?;
    train.write_strokes(context.out, "train")?;
    pulses.write_strokes(context.out, "pulses")?;
    train.write_whole(context.out, "train")?;
    pulses.write_whole(context.out, "pulses")?;
    let mut report = Report::new("EMPS, motion in, reaction out");
    published(&mut report, &train, &pulses)?;
    numbers(&mut report, context)?;
    if context.quick {
        return Ok(report);
    }
    let symmetric = Ask { name: "symmetric", set: "set.toml", model: "symmetric.toml", without: &[], effects: 4, effort: 6.25 };
    told(&mut report, context, &symmetric, &train, &pulses)?;
    let linear = Ask { name: "linear", model: "linear.toml", ..symmetric.clone() };
    told(&mut report, context, &linear, &train, &pulses)?;
    let found = diagnosed_model(context, &symmetric)?;
    open_loop::run(&mut report, context, &found, &train, &pulses)?;
    null::run(&mut report, context, &found, &train, &pulses)?;
    Ok(report)
}

/// The published forms on the published pipeline, fitted to the training record, frozen on the other one.
fn published(report: &mut Report, train: &Record, pulses: &Record) -> Result<(), StudyError> {
    for (form, what, least, most, own) in
        [(Form::Symmetric, "symmetric form", 5.6, 6.0, "4.08 / 5.98 %"), (Form::Asymmetric, "asymmetric form", 4.86, 5.06, "3.11 / 4.96 %")]
    {
        let (numbers, here) = pipeline::regressed(train, form)?;
        let there = pipeline::error_of(pulses, form, &numbers);
        report.figure(&format!("{what} error"), there);
        report.line(
            &format!("force error, {what}, training / pulses"),
            format!("{here:.2} / {there:.2} %"),
            own,
            &format!("{PAPER}; the second of the asymmetric form recomputed"),
            Some((least..=most).contains(&there)),
        );
    }
    Ok(())
}

/// The published structures fitted by simulation error beside the published numbers.
fn numbers(report: &mut Report, context: &Context) -> Result<(), StudyError> {
    let shared = [("mass", "bodies.carriage", 95.1089, 95.154)];
    let symmetric = [("viscous friction", "elements.viscous.damping", 203.5034), ("Coulomb friction", "elements.friction.force", 20.3935)];
    let asymmetric = [
        ("viscous friction +", "elements.viscous.positive", 166.71),
        ("viscous friction -", "elements.viscous.negative", 240.42),
        ("Coulomb friction +", "elements.friction.positive", 20.144),
        ("Coulomb friction -", "elements.friction.negative", 20.628),
    ];
    for (name, model, rest) in
        [("symmetric", "symmetric.toml", symmetric.as_slice()), ("asymmetric", "asymmetric.toml", asymmetric.as_slice())]
    {
        let folder = format!("refit-{name}");
        let found = refit(context, &Ask { name: &folder, set: "whole.toml", model, without: &[], effects: 1, effort: 0.85 })?;
        let mass = shared.map(|(what, path, a, b)| (what, path, if name == "symmetric" { a } else { b }));
        for (what, path, published) in mass.iter().chain(rest) {
            let value = refitted(&found, path);
            let off = 100.0 * (value / published - 1.0);
            report.figure(&format!("{name} {what}"), value);
            let measured = format!("{value:.2} ({off:+.2} %)");
            report.line(&format!("{what}, {name} structure"), measured, format!("{published}"), PAPER, Some(off.abs() <= 1.0));
        }
    }
    Ok(())
}

/// A diagnosis from one of the models, and the error of what it found.
fn told(report: &mut Report, context: &Context, ask: &Ask, train: &Record, pulses: &Record) -> Result<(), StudyError> {
    let found = diagnose(context, ask)?;
    let verdict = &found.verdict;
    let from = ask.name;
    report.word(&format!("{from} verdict"), verdict.word.name());
    let names: Vec<String> = findings(verdict).into_iter().map(|(physics, _)| physics).collect();
    report.word(&format!("{from} found"), &names.join(" "));
    report.line(&format!("verdict, from the {from} model"), said(verdict), "", "", None);
    physics(report, from, verdict);
    let model = diagnosed_model(context, ask)?;
    let Error { here, there } = errors(&model, train, pulses)?;
    report.figure(&format!("{from} error"), there);
    report.figure(&format!("{from} training error"), here);
    report.line(
        &format!("force error, found from the {from} model, training / pulses"),
        format!("{here:.2} / {there:.2} %"),
        "3.11 / 4.96 % (asymmetric form)",
        PAPER,
        Some(there <= BAR),
    );
    if let Some((error, zero)) = pipeline::error_from_its_zero(pulses, &model)? {
        report.figure(&format!("{from} error from its zero"), error);
        report.line(
            &format!("the same, pulses, with the place its encoder counts from, from the {from} model"),
            format!("{error:.2} % (at {:.2} mm)", 1e3 * zero),
            "4.96 % (asymmetric form)",
            PAPER,
            Some(error <= BAR),
        );
    }
    let mass = model.values_at("bodies.carriage").ok().and_then(|v| v.first().copied()).unwrap_or(f64::NAN);
    report.figure(&format!("{from} mass"), mass);
    report.line(
        &format!("mass, from the {from} model"),
        format!("{mass:.2} kg"),
        "95.11 kg",
        PAPER,
        Some((mass / 95.1089 - 1.0).abs() < 0.01),
    );
    Ok(())
}

fn errors(model: &Model, train: &Record, pulses: &Record) -> Result<Error, StudyError> {
    Ok(Error { here: pipeline::error_of_model(train, model)?, there: pipeline::error_of_model(pulses, model)? })
}

/// What was named, each beside what is known of it.
fn physics(report: &mut Report, from: &str, verdict: &Verdict) {
    let value = |physics: &[&str], key: &str| physics.iter().find_map(|p| parameter(verdict, p, key)).map(|(value, _)| value);
    let shown = |value: Option<f64>, scale: f64, unit: &str| value.map_or("not named".to_string(), |v| format!("{:.3} {unit}", scale * v));
    let mut line = |what: &str, measured: String, published: &str, source: &str, within: Option<bool>| {
        report.line(&format!("{what}, from the {from} model"), measured, published, source, within);
    };
    if from == "linear" {
        let coulomb = value(&["coulomb", "friction_deficit", "asymmetric_coulomb", "stribeck"], "force")
            .or_else(|| value(&["friction_deficit", "stribeck"], "coulomb"))
            .or_else(|| value(&["asymmetric_coulomb"], "positive"));
        line("Coulomb friction", shown(coulomb, 1.0, "N"), "20.39 N", PAPER, Some(coulomb.is_some()));
    }
    let sides = [value(&["asymmetric_damper"], "positive"), value(&["asymmetric_damper"], "negative")];
    let both = match sides {
        [Some(a), Some(b)] => format!("{a:.1} / {b:.1} N s/m"),
        _ => "not named".to_string(),
    };
    line("viscous friction + / -", both, "166.71 / 240.42 N s/m", PAPER, Some(sides.iter().all(Option::is_some)));
    let recomputed = "recomputed from the record, unpublished";
    let ripple = value(&["cogging"], "period");
    let size = shown(value(&["cogging"], "amplitude").map(f64::abs), 1.0, "N");
    let near = ripple.map(|p| (p / 2.5e-3 - 1.0).abs() < 0.01);
    line("ripple, period", shown(ripple, 1e3, "mm"), "2.50 mm, one turn of the screw", recomputed, Some(near == Some(true)));
    line("ripple, amplitude", size, "0.8 to 1.0 N", recomputed, None);
    let delay = value(&["delay"], "delay");
    let near = delay.map(|d| (0.5e-3..1.2e-3).contains(&d.abs()));
    line("force to motion, delay", shown(delay.map(f64::abs), 1e3, "ms"), "about 0.8 ms", recomputed, Some(near == Some(true)));
    let speed = value(&["friction_deficit"], "velocity");
    let lost = match (value(&["friction_deficit"], "coulomb"), value(&["friction_deficit"], "rest")) {
        (Some(coulomb), Some(rest)) => Some(coulomb - rest),
        _ => None,
    };
    line("friction lost near rest", shown(lost, 1.0, "N"), "9 to 12 N", recomputed, Some(lost.is_some()));
    line("below a speed of", shown(speed, 1e3, "mm/s"), "10 to 14 mm/s, by the form of the law", recomputed, None);
    let rivals = instead(verdict, LIKELY);
    let text = if rivals.is_empty() { "nothing".to_string() } else { rivals.join(", ") };
    line("hard to tell apart", text, "exponential or power law at low speed", recomputed, None);
}
