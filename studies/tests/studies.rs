//! Each study where its recordings are: what it names, and its figures with margins. Where they are not, a message and nothing else.

use backdrive_studies::data::Data;
use backdrive_studies::table::Report;
use backdrive_studies::{StudyError, study_named};

/// Whether the long parts are wanted, too.
fn long() -> bool {
    std::env::var_os("BACKDRIVE_LONG").is_some_and(|v| v == "1")
}

/// A study's report; `None` with a message where its recordings are not here.
fn report(name: &str) -> Option<Report> {
    let out = tempfile::tempdir().unwrap();
    match study_named(name).unwrap().run(&Data::find(None), out.path(), !long()) {
        Ok(report) => {
            println!("{}", report.text());
            Some(report)
        }
        Err(StudyError::NoData(message)) => {
            println!("skipped {message}");
            None
        }
        Err(error) => panic!("{error}"),
    }
}

#[test]
fn a_study_without_its_recordings_says_so() {
    let out = tempfile::tempdir().unwrap();
    let nowhere = tempfile::tempdir().unwrap();
    if std::env::var_os(backdrive_studies::data::VARIABLE).is_some() {
        println!("skipped: {} names a folder", backdrive_studies::data::VARIABLE);
        return;
    }
    for study in backdrive_studies::STUDIES.iter().filter(|s| !s.needs.1.is_empty()) {
        let result = study.run(&Data::find(Some(nowhere.path())), out.path(), true);
        assert!(matches!(result, Err(StudyError::NoData(_))), "{}", study.name);
    }
    assert!(study_named("nothing").is_err());
}

#[test]
fn emps() {
    let Some(report) = report("emps") else { return };
    // The pipeline is the field's.
    let form = |name: &str| report.figure_named(&format!("{name} form error"));
    assert!((form("asymmetric") - 4.96).abs() < 0.1, "{}", form("asymmetric"));
    assert!((5.6..=6.0).contains(&form("symmetric")), "{}", form("symmetric"));
    // The published structures have their published numbers.
    for (number, published) in [
        ("symmetric mass", 95.1089),
        ("symmetric viscous friction", 203.5034),
        ("symmetric Coulomb friction", 20.3935),
        ("asymmetric mass", 95.154),
    ] {
        let value = report.figure_named(number);
        assert!((value / published - 1.0).abs() < 0.01, "{number}: {value}");
    }
    let has = |from: &str, physics: &str| report.word_named(&format!("{from} found")).split(' ').any(|p| p == physics);
    for physics in ["asymmetric_damper", "friction_deficit", "delay"] {
        assert!(has("symmetric", physics), "{physics}: {}", report.word_named("symmetric found"));
    }
    assert!(report.figure_named("symmetric error") < 3.1, "{}", report.figure_named("symmetric error"));
    if long() {
        for physics in ["asymmetric_damper", "friction_deficit"] {
            assert!(has("linear", physics), "{physics}: {}", report.word_named("linear found"));
        }
        assert!(report.figure_named("linear error") < 3.1, "{}", report.figure_named("linear error"));
    }
}

#[test]
fn silverbox() {
    let Some(report) = report("silverbox") else { return };
    assert!(report.word_named("verdict").contains("cubic_spring"), "{}", report.word_named("verdict"));
    assert!((report.figure_named("cubic stiffness") / 3.95 - 1.0).abs() < 0.05, "{}", report.figure_named("cubic stiffness"));
    assert!(report.figure_named("arrow, whole") < 1.4, "{}", report.figure_named("arrow, whole"));
}
