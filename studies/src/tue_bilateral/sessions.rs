//! Each record as a session: whether the pair was stable at its own gains, which of its sensors say nothing, and which law couples its motors.

use super::record::{FILES, SAME, mean};
use crate::table::Report;
use crate::{Context, StudyError};
use backdrive_stability::coupling::{Coupling, Estimate, Kind, Law, Term};
use backdrive_stability::resimulate::Gain;
use backdrive_stability::resimulate::edge::Search;
use backdrive_stability::roles::Roles;
use backdrive_stability::session::Session;
use backdrive_stability::verdict::{Answer, Question, Swapped, Word, answer};
use statrs::distribution::{ContinuousCDF, StudentsT};
use std::collections::BTreeMap;
use std::sync::atomic::AtomicBool;

/// Place of the gains that were not published.
const UNPUBLISHED: &str = "unpublished";
/// Records of the short part: one of each gains.
const SHORT: [&str; 3] = ["m2_a_spring.csv", "m2_b_foam.csv", "m2_c_rigid.csv"];

/// A record as a session.
pub(super) struct Judged {
    /// Such as `b_spring`.
    pub(super) name: String,
    pub(super) coupling: Coupling,
}

/// Judges the records, of the short part a few.
pub(super) fn judge(report: &mut Report, context: &Context) -> Result<Vec<Judged>, StudyError> {
    let roles = Roles::load(&context.folder.join("roles.toml")).map_err(|e| StudyError::File(e.to_string()))?;
    let (mut judged, mut stable, mut words, mut faults) = (Vec::new(), 0, Vec::new(), BTreeMap::<String, usize>::new());
    let files: Vec<&str> = if context.quick { SHORT.to_vec() } else { FILES.to_vec() };
    for file in &files {
        let session = Session::from_roles(&context.data.join(file), &roles).map_err(|e| StudyError::File(e.to_string()))?;
        let found = asked(&session)?;
        let name = file.strip_prefix(SAME).unwrap_or(file).trim_end_matches(".csv").to_string();
        stable += usize::from(found.verdict == Word::Stable);
        for fault in &found.sensors {
            *faults.entry(fault.signal.clone()).or_default() += 1;
        }
        let Some(axis) = found.coupled.into_iter().next() else { continue };
        let mode = axis.slowest_mode.map_or("no oscillation".to_string(), |m| {
            format!("{:.0} Hz dies by {:.0}/s ({:.0} to {:.0})", m.frequency_hz, m.per_s, m.ci95[0], m.ci95[1])
        });
        words.push(format!("{name}: {}, {mode}", found.verdict.text()));
        if let Some(coupling) = axis.coupling {
            judged.push(Judged { name, coupling });
        }
    }
    report.figure("judged stable", stable as f64 / files.len() as f64);
    let bar = Some(stable == files.len());
    report.line(
        "records judged stable at their own gains, while the hand moves",
        format!("{stable} of {}", files.len()),
        "all",
        "each was used",
        bar,
    );
    report.notes.push(format!("Slowest oscillation of each record above 8 Hz, with its 95 % interval. {}.", words.join("; ")));
    let told: Vec<String> = faults.iter().map(|(signal, count)| format!("{signal} in {count}")).collect();
    report.word("faulty sensors", &told.join(", "));
    report.line(
        &format!("sensors that say nothing, of {} records", files.len()),
        if told.is_empty() { "none".to_string() } else { told.join(", ") },
        "gauge a of the master stands at its rail",
        "the same records",
        Some(faults.get("master_gauge_a") == Some(&files.len())),
    );
    let kinds = judged.iter().filter(|j| j.coupling.kind == Kind::PositionError).count();
    report.figure("position error", kinds as f64 / files.len() as f64);
    report.line(
        "records whose coupling is named position error, both ways",
        format!("{kinds} of {}", files.len()),
        "position error: the two torques are equal",
        "the same records",
        Some(kinds == files.len()),
    );
    for group in ["a", "b", "c"] {
        gains(report, group, &judged);
    }
    let left = judged.iter().flat_map(|j| [j.coupling.master.unexplained, j.coupling.slave.unexplained]).fold(0.0, f64::max);
    report.figure("coupling unexplained", left);
    report.line("motor torque that the law leaves in unseen time, the worst", format!("{:.1e} of its variance", left), "", "", None);
    Ok(judged)
}

fn asked(session: &Session) -> Result<Answer, StudyError> {
    let question = Question {
        session,
        recorded: None,
        asked: None,
        swapped: Swapped::default(),
        intents: None,
        script: None,
        gain: Gain { mu: 1.0, lambda: 1.0 },
        grips: Vec::new(),
        search: Search::default(),
    };
    answer(&question, &|_, _, _| (), &AtomicBool::new(false)).map_err(|e| StudyError::File(format!("{}: {e}", session.name)))
}

/// The gains of one setting: mean of its records, both motors, with the interval that they scatter by.
fn gains(report: &mut Report, group: &str, judged: &[Judged]) {
    let of = |pick: &dyn Fn(&Coupling) -> [Option<f64>; 2]| {
        let records = judged.iter().filter(|j| j.name.starts_with(group));
        let all: Vec<f64> = records.filter_map(|j| pick(&j.coupling)[0].zip(pick(&j.coupling)[1])).map(|(m, s)| 0.5 * (m + s)).collect();
        (mean(&all), half_width(&all))
    };
    let term = |term: Term| {
        of(&move |c: &Coupling| [&c.master, &c.slave].map(|side| side.gains.iter().find(|g| g.term == term).map(|g| g.estimate.value)))
    };
    let time = |pick: fn(&Coupling) -> [Option<Estimate>; 2]| of(&move |c: &Coupling| pick(c).map(|e| e.map(|e| e.value)));
    let (stiffness, damping) = (term(Term::Position), term(Term::Rate));
    let filter = time(|c| [c.master.filter_s, c.slave.filter_s]);
    let delay = time(|c| [c.master.delay_s, c.slave.delay_s]);
    let shown = |(value, half): (f64, Option<f64>), scale: f64, digits: usize| match half {
        Some(half) => format!("{:.digits$} ± {:.digits$}", scale * value, scale * half),
        None => format!("{:.digits$}", scale * value),
    };
    report.figure(&format!("gain {group}"), stiffness.0);
    report.figure(&format!("rate gain {group}"), damping.0);
    report.figure(&format!("speed filter {group}"), filter.0);
    report.line(
        &format!("coupling, gains {group}: by position, by speed; filter of speeds, delay"),
        format!(
            "{} N m/rad, {} mN m s/rad; {} ms, {} ms",
            shown(stiffness, 1.0, 4),
            shown(damping, 1e3, 2),
            shown(filter, 1e3, 3),
            shown(delay, 1e3, 3)
        ),
        UNPUBLISHED,
        "95 % by the scatter of the records",
        None,
    );
}

/// Half of the 95 % interval of the mean of some values; `None` for fewer than two.
fn half_width(values: &[f64]) -> Option<f64> {
    let n = values.len() as f64;
    let about = mean(values);
    let deviation = (values.iter().map(|x| (x - about).powi(2)).sum::<f64>() / (n - 1.0)).sqrt();
    let t = StudentsT::new(0.0, 1.0, n - 1.0).ok()?.inverse_cdf(0.975);
    (values.len() > 1).then(|| t * deviation / n.sqrt())
}

/// The laws of master and slave of a record, as the other records of the same gains have them: means of their parameters.
pub(super) fn laws_without(judged: &[Judged], name: &str) -> Option<[Law; 2]> {
    let group = name.get(..1)?;
    let others: Vec<&Coupling> = judged.iter().filter(|j| j.name.starts_with(group) && j.name != name).map(|j| &j.coupling).collect();
    let side = |pick: fn(&Coupling) -> &Law| {
        let all: Vec<&Law> = others.iter().map(|c| pick(c)).collect();
        let first = (*all.first()?).clone();
        let of = |value: &dyn Fn(&Law) -> f64| mean(&all.iter().map(|law| value(law)).collect::<Vec<f64>>());
        let terms = first.terms.iter().map(|(term, _)| (*term, of(&|law| law.coefficient(*term)))).collect();
        let (filter_s, delay_s, offset) = (of(&|l| l.filter_s), of(&|l| l.delay_s), of(&|l| l.offset));
        Some(Law { terms, filter_s, delay_s, offset, ..first })
    };
    Some([side(|c| &c.master.law)?, side(|c| &c.slave.law)?])
}
