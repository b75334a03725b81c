//! What a column more costs does not grow with the columns that are there.

mod system;

use nix::sys::resource::{UsageWho, getrusage};
use system::Place;

/// Processor time of the programs that this test has run, s.
fn of_children() -> f64 {
    let used = getrusage(UsageWho::RUSAGE_CHILDREN).unwrap();
    let seconds = |time: nix::sys::time::TimeVal| time.tv_sec() as f64 + time.tv_usec() as f64 * 1e-6;
    seconds(used.user_time()) + seconds(used.system_time())
}

#[test]
fn an_import_costs_in_proportion_to_its_columns() {
    let place = Place::new();
    let import = |columns: usize| {
        let heading: String = (0..columns).map(|column| format!(",c{column}")).collect();
        let rows: String = (0..3).map(|row| format!("{}{}\n", f64::from(row) * 1e-3, ",1.5".repeat(columns))).collect();
        place.write("table.csv", &format!("t{heading}\n{rows}"));
        let before = of_children();
        let done = place.backdrive(&["bag", "import", "table.csv", "--bag", "out.mcap", "--overwrite"]);
        assert_eq!(done.code, Some(0), "{done:?}");
        of_children() - before
    };
    // The least of three: another program on the machine only adds.
    let least = |columns: usize| (0..3).map(|_| import(columns)).fold(f64::INFINITY, f64::min);
    let (few, many) = (least(10_000), least(40_000));
    assert!(many < 8.0 * few, "four times the columns took {:.1} times the processor time: {few:.3} s, {many:.3} s", many / few);
}
