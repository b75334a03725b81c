//! Loops with faults on either side and on the ways, one or two at once: drawn, recorded, asked why they shake, and run again with the first remedy.
//!
//!     cargo run -p backdrive-why --example sealed_causes -- --seed 1 --count 48
//!
//! A case is a loop that is stable, and faults that make it shake and that its graph does not contain. The bag holds the graph without them. All bags are
//! recorded first; then every answer is made from its bag alone; only then is it compared with what was hidden. Every sixth case hides nothing.

mod bag;
mod draw;
mod score;

use backdrive_why::answer::Answer;
use bag::{asked, record};
use draw::{Case, drawn};
use score::Scores;
use std::sync::atomic::AtomicBool;
use std::time::Instant;

/// Faults on either side of the loop and on its ways, and two at once.
const KINDS: [&str; 24] = [
    "held",
    "torque",
    "slave play",
    "low-pass",
    "grip+delay",
    "nothing",
    "servo",
    "encoder sign",
    "motor lag",
    "low rate",
    "torque+delay",
    "nothing",
    "slave friction",
    "wall",
    "held+grip",
    "slave play+delay",
    "low-pass+torque",
    "nothing",
    "inertia+delay",
    "grip+low-pass",
    "wall+torque",
    "scale+grip",
    "servo+delay",
    "nothing",
];

static NEVER: AtomicBool = AtomicBool::new(false);

fn number(arguments: &[String], key: &str, otherwise: u64) -> u64 {
    arguments.iter().position(|a| a == key).and_then(|i| arguments.get(i + 1)).and_then(|v| v.parse().ok()).unwrap_or(otherwise)
}

fn main() {
    let arguments: Vec<String> = std::env::args().collect();
    let (seed, count) = (number(&arguments, "--seed", 1), number(&arguments, "--count", 20) as usize);
    let only = arguments.iter().position(|a| a == "--only").and_then(|i| arguments.get(i + 1)).cloned();
    let folder = std::env::temp_dir().join(format!("sealed-causes-{seed}"));
    std::fs::create_dir_all(&folder).expect("a folder for the bags");
    let wanted = |index: &usize| only.as_ref().is_none_or(|only| only == KINDS[index % KINDS.len()]);
    let cases: Vec<(usize, Case)> = (0..count)
        .filter(wanted)
        .filter_map(|index| {
            let kind = KINDS[index % KINDS.len()];
            let Some(case) = (0..40).find_map(|attempt| drawn(kind, seed, index as u64, attempt)) else {
                println!("{index:3} {kind:<16} could not be drawn");
                return None;
            };
            record(&case.declared, &case.truth, &folder.join(format!("{index:03}.mcap")));
            Some((index, case))
        })
        .collect();
    // Every verdict is written before any truth is looked at.
    let answers: Vec<(Answer, f64)> = cases
        .iter()
        .map(|(index, _)| {
            let began = Instant::now();
            let answer = asked(&folder.join(format!("{index:03}.mcap")));
            let text = serde_json::to_string_pretty(&answer).expect("an answer as text");
            std::fs::write(folder.join(format!("{index:03}.json")), text).expect("a verdict");
            (answer, began.elapsed().as_secs_f64())
        })
        .collect();
    let mut scores = Scores::default();
    for ((index, case), (answer, seconds)) in cases.iter().zip(&answers) {
        scores.add(*index, case, answer, *seconds);
    }
    scores.tell();
}
