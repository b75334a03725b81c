//! Exams of the fleet and of the gate, on simulated arms whose truth is known.
//!
//! `fleet_exam drift SEED UNITS RECORDINGS`: drift in a tenth of the units; how soon each is found, how many are named wrongly, and the processor time.
//! `BACKDRIVE_EXAM_TABLE=FILE` keeps the table, and `fleet_exam judge SEED UNITS RECORDINGS TABLE` judges it again. `fleet_exam gate SEED CASES`: seeded
//! changes, half of them harmless.

mod exam;

use exam::{drift, gate};

fn main() {
    let words: Vec<String> = std::env::args().skip(1).collect();
    let number = |place: usize, usual: u64| words.get(place).map_or(usual, |word| word.parse().expect("a number"));
    match words.first().map(String::as_str) {
        Some("drift") => drift::exam(number(1, 1), number(2, 200) as usize, number(3, 50) as usize),
        Some("judge") => {
            let table = backdrive_fleet::table::read(std::path::Path::new(words.get(4).expect("a table"))).expect("a table");
            let (seed, units, recordings) = (number(1, 1), number(2, 200) as usize, number(3, 50) as usize);
            drift::judge(&table, &drift::drifts(seed, units, recordings), recordings);
        }
        Some("gate") => gate::exam(number(1, 1), number(2, 120) as usize),
        _ => eprintln!("fleet_exam drift SEED UNITS RECORDINGS | judge SEED UNITS RECORDINGS TABLE | gate SEED CASES"),
    }
}
