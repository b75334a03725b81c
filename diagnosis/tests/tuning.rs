//! The tuning table: its page, and its evidence.

use backdrive_diagnosis::tuning::document::tuning_page;
use backdrive_diagnosis::tuning::{Evidence, Tuning, tuning};
use std::collections::HashSet;

#[test]
fn the_printed_table_has_every_entry_and_the_page_names_the_command_and_every_group() {
    let printed = tuning_page();
    let file = concat!(env!("CARGO_MANIFEST_DIR"), "/../docs/tuning.md");
    let page = std::fs::read_to_string(file).unwrap_or_default();
    assert!(
        page.contains("\ncargo run -p backdrive-diagnosis --example tuning\n") && page.contains("\n## How much verdicts depend on it\n")
    );
    for row in Tuning::default().rows() {
        let (group, entry) = row.name.split_once('.').unwrap_or_default();
        let section = printed.split(&format!("\n## {group}\n")).nth(1).and_then(|rest| rest.split("\n## ").next()).unwrap_or_default();
        assert!(
            section.contains(&format!("\n| `{entry}` | {} | {} | {} | ", row.value, row.unit, row.decides)),
            "{} is not printed",
            row.name
        );
        assert!(page.contains(&format!("\n| `{group}` | ")), "docs/tuning.md does not name the group {group}");
    }
    assert!(printed.contains("\n## steps\n") && page.contains("\n| `steps` | "));
}

#[test]
fn every_entry_has_a_unit_a_reason_and_a_name_of_its_own() {
    let rows = Tuning::default().rows();
    let mut names = HashSet::new();
    for row in &rows {
        let (_, why) = row.evidence.kind_and_reason();
        assert!(!row.unit.is_empty() && !row.decides.is_empty() && !why.is_empty(), "{row:?}");
        assert!(names.insert(row.name.clone()), "{} stands twice", row.name);
        if let Evidence::Measured(text) = row.evidence {
            assert!(text.contains('`'), "{}: a measurement names its command", row.name);
        }
        // "as other" and "see other" name an entry that is there.
        for other in why
            .split_whitespace()
            .map(|w| w.trim_matches([',', ';', '.', ':']).trim_end_matches("'s"))
            .filter(|w| w.contains('.') && !w.starts_with('`'))
        {
            let is_entry = rows.iter().any(|r| r.name == other);
            let groups = ["noise", "fit", "coupling", "screening", "search", "intervals", "claim", "audit", "locate", "experiment"];
            assert!(is_entry || !groups.iter().any(|g| other.starts_with(&format!("{g}."))), "{}: there is no entry {other}", row.name);
        }
    }
}

#[test]
fn an_entry_can_be_changed_for_a_study_before_the_table_is_in_use_and_not_after() {
    let mut changed = Tuning::default();
    let before = changed.claim.alike;
    changed.quantity("claim.alike").unwrap().times(2.0);
    changed.quantity("noise.blocks").unwrap().set(8.0);
    changed.quantity("fit.middle").unwrap().set(3.0);
    assert_eq!((changed.claim.alike, changed.noise.blocks, changed.fit.middle.steps), (2.0 * before, [8; 4], 3));
    assert!(changed.quantity("claim.nothing").is_none() && changed.quantity("tie").is_none());
    assert_eq!(*tuning(), Tuning::default());
    assert!(changed.adopt().is_err());
}
