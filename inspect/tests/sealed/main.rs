//! Clean recordings of many kinds, three in four with one thing wrong: what is found, and what is found that is not there.
//!
//! Thresholds were chosen on the seeds 1 to 300, of which the usual run draws 60. `BACKDRIVE_LONG=1` draws 400 that no threshold was chosen on, and
//! `BACKDRIVE_SEEDS=FROM-TO` others. `BACKDRIVE_SEALED_OUT=DIR` also writes each draw, for `tests/python/doctor_on_sealed.py`.

mod corrupt;
mod draw;
mod real;
mod written;

use backdrive_inspect::{Finding, FindingKind, Options, Source, inspect};
use corrupt::{Corrupted, MORE, NAMES, corrupt, halves};
use draw::{Clean, Column, Random, clean};
use std::collections::BTreeMap;
use std::time::Instant;

/// What one draw gave.
struct Outcome {
    seed: u64,
    kind: &'static str,
    corruption: Option<&'static str>,
    /// Whether the corruption was named, at its column.
    found: bool,
    /// Findings that are wrong and not what was put in.
    others: Vec<Finding>,
    seconds: f64,
    said: Vec<FindingKind>,
}

fn sources(pieces: Vec<Vec<Column>>) -> Vec<Source> {
    let of = |(number, columns): (usize, Vec<Column>)| Source::Columns {
        name: format!("piece-{number}"),
        columns: columns.into_iter().map(|c| (c.heading, c.values)).collect(),
    };
    pieces.into_iter().enumerate().map(of).collect()
}

fn draw(seed: u64, real: &[Clean]) -> Outcome {
    let mut random = Random::new(seed);
    let is_real = random.chance(0.2);
    let base = if is_real && !real.is_empty() { real[random.below(real.len())].clone() } else { clean(&mut random) };
    let is_clean = random.chance(0.25);
    let corrupted = if is_clean {
        None
    } else {
        // One that fits this recording.
        (0..400).find_map(|_| {
            let all: Vec<&'static str> = NAMES.iter().chain(&MORE).copied().collect();
            let name = all[random.below(all.len())];
            corrupt(&mut random, &base, name)
        })
    };
    let pieces = match &corrupted {
        Some(Corrupted { pieces, .. }) => pieces.clone(),
        None if random.chance(0.3) => halves(&base.columns),
        None => vec![base.columns.clone()],
    };
    if let Some(folder) = written::folder().map(|folder| folder.join(seed.to_string())) {
        written::write(&folder, "clean", std::slice::from_ref(&base.columns));
        written::write(&folder, "drawn", &pieces);
        std::fs::write(folder.join("truth.txt"), corrupted.as_ref().map_or("clean", |c| c.name)).unwrap();
    }
    let samples: usize = pieces.iter().map(|piece| piece[0].values.len()).sum();
    let sources = sources(pieces);
    let started = Instant::now();
    let report = inspect(&sources, &Options::default()).unwrap_or_else(|e| panic!("seed {seed}: {e}"));
    // As long as an episode of 30 s takes.
    let seconds = started.elapsed().as_secs_f64() * 30.0 * base.rate / samples as f64;
    let is_right = |finding: &Finding| {
        corrupted.as_ref().is_some_and(|c| {
            let at = c.columns.is_empty() || c.columns.iter().any(|column| finding.signals.contains(column));
            c.accepted.contains(&finding.kind) && at
        })
    };
    let found = report.wrong().any(is_right);
    if let Some(folder) = written::folder().map(|folder| folder.join(seed.to_string())) {
        std::fs::write(folder.join("inspect.txt"), if found { "found" } else { "not found" }).unwrap();
    }
    let others = report.wrong().filter(|finding| !is_right(finding)).cloned().collect();
    let said = report.wrong().map(|finding| finding.kind).collect();
    Outcome { seed, kind: base.kind, corruption: corrupted.map(|c| c.name), found, others, seconds, said }
}

fn seeds() -> (u64, u64) {
    let asked = std::env::var("BACKDRIVE_SEEDS").ok();
    let parse = |text: &str| {
        let (from, to) = text.split_once('-')?;
        Some((from.parse().ok()?, to.parse().ok()?))
    };
    let long = std::env::var("BACKDRIVE_LONG").as_deref() == Ok("1");
    asked.as_deref().and_then(parse).unwrap_or(if long { (9001, 9400) } else { (1, 60) })
}

#[test]
fn what_was_made_wrong_is_found_and_nothing_else() {
    let real = real::clean();
    let (from, to) = seeds();
    let outcomes: Vec<Outcome> = (from..=to).map(|seed| draw(seed, &real)).collect();
    let corrupted: Vec<&Outcome> = outcomes.iter().filter(|o| o.corruption.is_some()).collect();
    let clean: Vec<&Outcome> = outcomes.iter().filter(|o| o.corruption.is_none()).collect();
    let mut by_name: BTreeMap<&str, [usize; 2]> = BTreeMap::new();
    for outcome in &corrupted {
        let counts = by_name.entry(outcome.corruption.unwrap_or_default()).or_default();
        counts[0] += usize::from(outcome.found);
        counts[1] += 1;
        if !outcome.found {
            println!("missed: seed {} {} {:?}, said {:?}", outcome.seed, outcome.kind, outcome.corruption, outcome.said);
        }
    }
    for outcome in outcomes.iter().filter(|o| !o.others.is_empty()) {
        for other in &outcome.others {
            println!("other: seed {} {} {:?}: {:?} {}", outcome.seed, outcome.kind, outcome.corruption, other.kind, other.message);
        }
    }
    for (name, [found, all]) in &by_name {
        println!("{name:20} {found} of {all}");
    }
    let share = |some: usize, all: usize| some as f64 / all.max(1) as f64;
    let recall = share(corrupted.iter().filter(|o| o.found).count(), corrupted.len());
    let false_clean = clean.iter().filter(|o| !o.others.is_empty()).count();
    let false_all = outcomes.iter().filter(|o| !o.others.is_empty()).count();
    let seconds = outcomes.iter().map(|o| o.seconds).sum::<f64>() / outcomes.len() as f64;
    if let Some(slow) = outcomes.iter().max_by(|a, b| a.seconds.total_cmp(&b.seconds)) {
        println!("slowest: seed {} {} {:?}", slow.seed, slow.kind, slow.corruption);
    }
    let worst = outcomes.iter().map(|o| o.seconds).fold(0.0, f64::max);
    println!(
        "recall {:.1} % of {}; clean recordings with a finding {false_clean} of {}; recordings with another finding {false_all} of {}; {seconds:.3} s an episode of 30 s, at most {worst:.3}",
        100.0 * recall,
        corrupted.len(),
        clean.len(),
        outcomes.len()
    );
    assert!(recall >= 0.9, "recall {recall}");
    assert!(share(false_all, outcomes.len()) <= 0.05, "{false_all} of {} recordings have another finding", outcomes.len());
}
