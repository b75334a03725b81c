//! Small logs of real arms that were once answered wrongly, kept beside the project. Without them there is nothing to test.

#[path = "../../../tests/common/skipped.rs"]
mod skipped;

use backdrive_diagnosis::arms::diagnose::{Found, diagnose};
use backdrive_diagnosis::arms::problem::Problem;
use backdrive_diagnosis::hypothesis::Place;
use backdrive_diagnosis::options::Options;
use backdrive_diagnosis::verdict::{Estimate, Finding, Parameter};
use backdrive_plant::set::RecordingSet;
use std::path::Path;

/// The diagnosis of a set of a case; `None`, with a message, where it is not there.
fn diagnosed(case: &str, set: &str) -> Option<Found> {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../shared/cases").join(case).join(set);
    if !path.exists() {
        skipped::skipped(format!("{} is not there", path.display()));
        return None;
    }
    let problem = Problem::open(&RecordingSet::open(&path).unwrap(), None).unwrap();
    Some(diagnose(&problem, &Options::default(), None, &|_| ()).unwrap())
}

fn finding<'f>(found: &'f Found, physics: &str, joint: &str) -> &'f Finding {
    let place = Place::Between(joint.to_string(), "ground".to_string());
    let all = &found.verdict.findings;
    all.iter().find(|f| f.physics == physics && f.place == place).unwrap_or_else(|| panic!("no {physics} at {joint}: {all:?}"))
}

fn number<'f>(finding: &'f Finding, key: &str) -> &'f Estimate {
    match &finding.parameters[key] {
        Parameter::One(one) => one,
        Parameter::List(_) => panic!("{finding:?}"),
    }
}

fn sizes(found: &Found) -> impl Iterator<Item = (&Finding, &Estimate)> {
    let sure = found.verdict.findings.iter().filter(|f| f.confidence > 0.5);
    sure.flat_map(|f| {
        f.parameters.iter().filter_map(move |(key, p)| match p {
            Parameter::One(one) if key != "phase" && key != "rest" => Some((f, one)),
            _ => None,
        })
    })
}

#[test]
fn short_logs_give_the_published_friction_and_nothing_whose_interval_holds_nothing() {
    let Some(found) = diagnosed("26-arm-short-torque-driven", "setp.toml") else { return };
    // 146 and 130 mN m and 4e-3 kg m^2 are in the intervals.
    for (joint, force) in [("Joint1", 0.146), ("Joint2", 0.130)] {
        let one = number(finding(&found, "coulomb", joint), "force");
        assert!(one.ci95[0].unwrap() < force && force < one.ci95[1].unwrap(), "{one:?}");
    }
    let armature = number(finding(&found, "inertia", "Joint2"), "inertia");
    assert!(armature.ci95[0].unwrap() < 4e-3 && 4e-3 < armature.ci95[1].unwrap(), "{armature:?}");
    assert!(sizes(&found).all(|(_, one)| one.ci95[0].is_none_or(|low| low > 0.0) || one.ci95[1].is_some_and(|high| high < 0.0)));
    // Logs of which the held-out one is predicted no better give no sure claim.
    let Some(found) = diagnosed("26-arm-short-torque-driven", "set.toml") else { return };
    assert!(found.verdict.findings.iter().all(|f| f.confidence <= 0.5), "{:?}", found.verdict.findings);
}

#[test]
fn friction_that_grows_with_a_load_takes_a_load_that_changes() {
    if std::env::var("BACKDRIVE_FULL").as_deref() != Ok("1") {
        skipped::skipped("friction_that_grows_with_a_load_takes_a_load_that_changes: a minute; BACKDRIVE_FULL=1 runs it".to_string());
        return;
    }
    let Some(found) = diagnosed("27-load-friction-versus-dry", "set.toml") else { return };
    assert!(found.verdict.findings.iter().all(|f| f.physics != "load_friction"), "{:?}", found.verdict.findings);
    // By hand 0.8 N m beside 0.3 N m s/rad of viscous friction, and 0.035 kg m^2.
    let force = number(finding(&found, "coulomb", "calf"), "force").value;
    assert!((0.7..1.2).contains(&force), "{force}");
    let armature = number(finding(&found, "inertia", "calf"), "inertia");
    assert!(armature.ci95[0].unwrap() < 0.035 && 0.035 < armature.ci95[1].unwrap(), "{armature:?}");
    assert!(found.verdict.audit.iter().any(|r| r.what == "load" && r.place == "calf"), "{:?}", found.verdict.audit);
    // All three joints' torques go together, which no leg's belts do: none is asserted.
    let asserted = |f: &&Finding| f.physics.starts_with("coupl") && f.confidence > 0.5;
    assert_eq!(found.verdict.findings.iter().find(asserted), None);
    assert!(found.notes.iter().any(|note| note.contains("hip and thigh")), "{:?}", found.notes);
}
