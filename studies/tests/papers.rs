//! The papers' stories: with BACKDRIVE_LONG=1 the first step of each in its short form, the whole path where BACKDRIVE_STUDIES is 1.

#[path = "../../tests/common/naming.rs"]
mod naming;

#[path = "../../tests/common/skipped.rs"]
mod skipped;

use backdrive_studies::data::Data;
use backdrive_studies::study_named;
use backdrive_studies::table::Report;
use naming::assert_names;
use skipped::skipped;

fn long() -> bool {
    std::env::var_os("BACKDRIVE_STUDIES").is_some_and(|v| v == "1")
}

/// A study's report; `None` with a message where its minute was not requested.
fn report(name: &str) -> Option<Report> {
    if !long() && std::env::var("BACKDRIVE_LONG").as_deref() != Ok("1") {
        skipped("searches of a minute; BACKDRIVE_LONG=1 runs them");
        return None;
    }
    let out = tempfile::tempdir().unwrap();
    let report = study_named(name).unwrap().run(&Data::find(None), out.path(), !long(), 1.0).unwrap();
    println!("{}", report.text());
    // What is true lies outside of what the diagnosis is given.
    let sets = walk(out.path());
    assert!(sets.iter().any(|path| path.ends_with("truth.json")));
    assert!(!sets.iter().any(|path| path.contains("/set/") && path.contains("truth")));
    Some(report)
}

/// Every file below a folder.
fn walk(folder: &std::path::Path) -> Vec<String> {
    std::fs::read_dir(folder)
        .unwrap()
        .flat_map(|entry| {
            let path = entry.unwrap().path();
            if path.is_dir() { walk(&path) } else { vec![path.display().to_string()] }
        })
        .collect()
}

fn falls(report: &Report, to: f64) {
    let [before, after] = ["before", "after"].map(|which| report.figure_named(&format!("effects-1 {which}")));
    assert!(after < to * before, "{before} -> {after}");
}

#[test]
fn the_ball_screw_remembers_every_reversal() {
    let Some(report) = report("paper_000") else { return };
    // Four sliders do not reach the noise of a device that has seven: it may be claimed or be the nearest.
    let said = report.word_named("effects-1");
    assert_names(said, &["maxwell_slip at screw-ground"]);
    falls(&report, 0.3);
}

#[test]
fn the_bench_shows_what_a_seed_hides() {
    let Some(report) = report("paper_003") else { return };
    let [hits, seeds] = ["hits", "seeds"].map(|name| report.figure_named(name));
    assert!(hits >= 0.75 * seeds, "{hits} of {seeds}");
}
