//! Studies of the damper, the piezo stack, the robot's axes and the motor, where their recordings are. Where they are not, a message.

use backdrive_studies::data::Data;
use backdrive_studies::table::Report;
use backdrive_studies::{StudyError, study_named};

/// A study's report in its short form, the whole one where BACKDRIVE_LONG is 1; `None` with a message where its recordings are not here.
fn report(name: &str) -> Option<Report> {
    let out = tempfile::tempdir().unwrap();
    let long = std::env::var_os("BACKDRIVE_LONG").is_some_and(|v| v == "1");
    match study_named(name).unwrap().run(&Data::find(None), out.path(), !long) {
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
fn the_damper_has_play() {
    let Some(report) = report("brfd_friction_damper") else { return };
    assert!(report.word_named("verdict").contains("backlash at"), "{}", report.word_named("verdict"));
    let gap = report.figure_named("gap");
    assert!((2.5e-3..6.5e-3).contains(&gap), "{gap}");
    let [before, after] = ["held out before", "held out after"].map(|name| report.figure_named(name));
    assert!(after < before, "{after} {before}");
    // More tension, more friction, and more of a difference between the directions.
    let [forward, backward] = ["positive", "negative"].map(|side| report.figure_named(&format!("friction 36 lb {side}")));
    assert!(forward > 1.2e4 && backward > 1.3e4, "{forward} {backward}");
}

#[test]
fn the_piezo_stack_has_hysteresis_and_lags() {
    let Some(report) = report("piezo_p885") else { return };
    let verdict = report.word_named("verdict");
    assert!(["bouc_wen", "hysteretic_spring", "maxwell_slip", "dahl", "preisach_lugre"].iter().any(|p| verdict.contains(p)), "{verdict}");
    assert!((20.0..28.0).contains(&report.figure_named("lag at turning points")), "{}", report.figure_named("lag at turning points"));
    assert!((report.figure_named("lag") - report.figure_named("lag at turning points")).abs() < 6.0, "{}", report.figure_named("lag"));
}

#[test]
fn the_robot_s_encoders_are_read_at_different_times() {
    let Some(report) = report("kuka_kr300") else { return };
    let verdict = report.word_named("axis-1");
    assert!(verdict.contains("delay at") && !verdict.contains("series_compliance"), "{verdict}");
    let skew = report.figure_named("axis-1 skew");
    assert!((2.3..3.6).contains(&skew), "{skew}");
}

#[test]
fn the_motor_cogs_seven_times_a_turn() {
    let Some(report) = report("odrive_cogging") else { return };
    assert!(report.word_named("round-1").contains("cogging at"), "{}", report.word_named("round-1"));
    let harmonic = report.figure_named("harmonic 1");
    assert!((harmonic - 7.0).abs() < 0.2, "{harmonic}");
}
