//! What two viewers cost a loop: times of a step and losses beside those of a run that nobody looks at. `BACKDRIVE_FULL=1` runs it.

use super::Run;
use super::viewer::Viewer;
use serde_json::{Value, json};

/// Rounds, each with and without viewers, one after the other so that the machine is the same for both.
const ROUNDS: usize = 5;

fn run(viewers: usize) -> Value {
    let mut run = Run::start("launch/contact.toml", &["--rate", "2000", "--duration", "6"], viewers > 0);
    let threads: Vec<_> = (0..viewers)
        .map(|_| {
            let page = run.pages[0].clone();
            std::thread::spawn(move || Viewer::open(&page).until("end"))
        })
        .collect();
    run.lines.clear();
    let (_, result, ..) = run.end();
    threads.into_iter().for_each(|t| drop(t.join()));
    result
}

#[test]
fn two_viewers_cost_the_loop_next_to_nothing() {
    if std::env::var_os("BACKDRIVE_FULL").is_none() {
        eprintln!("skipped: BACKDRIVE_FULL=1 runs it");
        return;
    }
    let mut ratios = Vec::new();
    for round in 0..ROUNDS {
        let (without, with) = (run(0), run(2));
        let of = |result: &Value, key: &str| result[key].as_f64().unwrap();
        for key in ["loop_p50_us", "loop_p99_us", "missed_deadlines"] {
            eprintln!("round {round}: {key} {:.1} without, {:.1} with two viewers", of(&without, key), of(&with, key));
        }
        assert_eq!((&without["lost"], &with["lost"]), (&json!(0), &json!(0)));
        ratios.push(of(&with, "loop_p50_us") / of(&without, "loop_p50_us"));
    }
    ratios.sort_by(f64::total_cmp);
    // Times depend on what else the machine does: the median of rounds is bounded, and that widely.
    assert!(ratios[ROUNDS / 2] < 1.5, "{ratios:?}");
}
