//! Drift in a tenth of simulated units: how soon it is found, and what is named wrongly.

use super::processor::processor_s;
use backdrive_fleet::analysis::{FALSE_DISCOVERIES, analyse};
use backdrive_fleet::date::Date;
use backdrive_fleet::manifest::{Entry, Manifest, Source};
use backdrive_fleet::simulated::{Arm, JOINTS, RATE, normal, random, unit};
use backdrive_fleet::store::{Store, Version, Work, run};
use backdrive_fleet::table::{Table, write};
use backdrive_fleet::what::What;
use rand::RngExt;
use std::collections::{BTreeMap, BTreeSet};
use std::path::Path;
use std::sync::atomic::AtomicBool;

/// A drift that is simulated.
pub struct Drift {
    joint: usize,
    is_dry: bool,
    from: usize,
    /// Of a step its share; of a ramp the share a recording.
    share: f64,
    is_ramp: bool,
}

/// The drifts of a seed.
pub fn drifts(seed: u64, units: usize, recordings: usize) -> BTreeMap<usize, Drift> {
    let drifting = (0..units / 10).map(|k| 10 * k + (seed as usize + 3 * k) % 10);
    let of = |u: usize| {
        let mut of_unit = random(seed, u, 0);
        unit(&mut of_unit);
        let is_ramp = of_unit.random_bool(0.5);
        let share = if is_ramp { of_unit.random_range(0.02..0.04) } else { of_unit.random_range(0.15..0.4) };
        let from = of_unit.random_range(recordings * 3 / 10..recordings * 7 / 10);
        (u, Drift { joint: of_unit.random_range(0..JOINTS), is_dry: of_unit.random_bool(0.7), from, share, is_ramp })
    };
    drifting.map(of).collect()
}

/// Makes the logs of one unit after the other, answers for them, and judges the table after each date.
pub fn exam(seed: u64, units: usize, recordings: usize) {
    let model = Path::new(env!("CARGO_MANIFEST_DIR")).join("../plant/robots/seven-joint-leader.toml");
    let arm = Arm::open(&model).expect("the model is there");
    let folder = tempfile::tempdir().expect("a folder for logs");
    let kept = tempfile::tempdir().expect("a folder for answers");
    let store = Store::open(kept.path()).expect("the folder is there");
    let drifts = drifts(seed, units, recordings);
    let (mut cpu, mut entries) = (0.0, Vec::new());
    for u in 0..units {
        let own = unit(&mut random(seed, u, 0));
        let mut here = Vec::new();
        for r in 0..recordings {
            let mut of_recording = random(seed, u, r + 1);
            let temperature = 25.0 + 5.0 * (r as f64 * 0.3).sin() + 3.0 * normal(&mut of_recording);
            let mut truth = own;
            for (j, joint) in truth.iter_mut().enumerate() {
                joint.dry *= 1.0 + 0.02 * normal(&mut of_recording);
                joint.viscous *= (1.0 + 0.02 * normal(&mut of_recording)) * (1.0 - 0.01 * (temperature - 25.0));
                // A change of firmware on all units.
                joint.gain *= if r >= recordings * 6 / 10 { 1.03 } else { 1.0 };
                if let Some(drift) = drifts.get(&u).filter(|drift| drift.joint == j && r >= drift.from) {
                    let share = if drift.is_ramp { drift.share * (r - drift.from + 1) as f64 } else { drift.share };
                    let number = if drift.is_dry { &mut joint.dry } else { &mut joint.viscous };
                    *number *= 1.0 + share;
                }
            }
            let date = Date(1_772_323_200 + 3 * 86_400 * r as i64); // 1 March 2026, then every third day
            let path = folder.path().join(format!("{u:03}-{r:03}.csv"));
            std::fs::write(&path, arm.log(&truth, RATE, &mut of_recording)).expect("a log is written");
            here.push(Entry {
                name: format!("unit-{u:03}/{}.csv", date.iso()),
                source: Source::File(path),
                unit: format!("{u:03}"),
                date: Some(date),
                temperature: Some(temperature),
                since_start: None,
                model: Some(model.clone()),
            });
        }
        let manifest = Manifest { name: "exam".to_string(), settings: String::new(), roles: None, entries: here };
        let work = Work { manifest: &manifest, what: What::Triage, shard: (1, 1), jobs: 1, version: Version("exam".to_string()) };
        let before = processor_s();
        let done = run(&work, &store, &|_| {}, &AtomicBool::new(false)).expect("the recordings are answered");
        cpu += processor_s() - before;
        assert!(done.failed.is_empty(), "{:?}", done.failed);
        for entry in &manifest.entries {
            let Source::File(path) = &entry.source else { continue };
            std::fs::remove_file(path).expect("a log is removed");
        }
        entries.extend(manifest.entries);
        if u % 20 == 19 {
            eprintln!("{} units, {:.4} s of processor time a recording", u + 1, cpu / ((u + 1) * recordings) as f64);
        }
    }
    let manifest = Manifest { name: "exam".to_string(), settings: String::new(), roles: None, entries };
    let work = Work { manifest: &manifest, what: What::Triage, shard: (1, 1), jobs: 1, version: Version("exam".to_string()) };
    let (table, missing) = store.table(&work).expect("the keys are there");
    assert_eq!(missing, 0);
    let table = table.expect("the table is whole");
    if let Some(out) = std::env::var_os("BACKDRIVE_EXAM_TABLE") {
        write(&table, std::fs::File::create(out).expect("the table is written")).expect("the table is written");
    }
    println!("recordings {}, processor time {:.4} s each, {:.0} s in all", units * recordings, cpu / (units * recordings) as f64, cpu);
    judge(&table, &drifts, recordings);
}

/// Judges the rows up to each date, one date after the other.
pub fn judge(table: &Table, drifts: &BTreeMap<usize, Drift>, recordings: usize) {
    let mut dates: Vec<Date> = table.rows.iter().filter_map(|row| row.date).collect();
    dates.sort();
    dates.dedup();
    let mut found: BTreeMap<usize, usize> = BTreeMap::new();
    let mut ever: BTreeSet<String> = BTreeSet::new();
    let began = processor_s();
    for (index, last) in dates.iter().enumerate().skip(8) {
        let mut then = table.clone();
        then.rows.retain(|row| row.date.is_some_and(|date| date <= *last));
        let analysis = analyse(&then, FALSE_DISCOVERIES);
        let mut wrong: BTreeSet<&str> = BTreeSet::new();
        for change in &analysis.changes {
            let unit: usize = change.unit.parse().unwrap_or(usize::MAX);
            let is_right = drifts.get(&unit).is_some_and(|drift| {
                index >= drift.from
                    && change.joint == format!("joint{}", drift.joint + 1)
                    && change.parameter == if drift.is_dry { "dry" } else { "viscous" }
            });
            if is_right {
                found.entry(unit).or_insert(index);
            }
            if drifts.get(&unit).is_none_or(|drift| index < drift.from) {
                wrong.insert(&change.unit);
                if ever.insert(change.unit.clone()) {
                    println!("wrong after {} recordings: {}, p {:.1e}, q {:.1e}", index + 1, change.sentence, change.p, change.q);
                }
            }
        }
        if index + 1 == recordings {
            println!(
                "at the end {} units are named, {} of them wrongly, {} odd ones; together: {:?}",
                analysis.changes.iter().map(|c| &c.unit).collect::<BTreeSet<_>>().len(),
                wrong.len(),
                analysis.odd.len(),
                analysis.together.iter().map(|c| &c.sentence).collect::<Vec<_>>()
            );
            for change in &analysis.changes {
                println!("  {} (p {:.0e})", change.sentence, change.p);
            }
            for odd in &analysis.odd {
                println!("  odd: {} (q {:.0e})", odd.sentence, odd.q);
            }
        }
    }
    println!("{:.1} s of processor time an analysis", (processor_s() - began) / (dates.len() - 8) as f64);
    let mut within = 0;
    for (unit, drift) in drifts {
        let kind = if drift.is_ramp {
            format!("ramp of {:.1} % a recording", 100.0 * drift.share)
        } else {
            format!("step of {:.0} %", 100.0 * drift.share)
        };
        let what = if drift.is_dry { "dry" } else { "viscous" };
        match found.get(unit) {
            Some(at) => {
                let took = at + 1 - drift.from;
                within += usize::from(took <= 10);
                println!("unit {unit:03} joint{} {what}, {kind} from {}: found after {took} recordings", drift.joint + 1, drift.from);
            }
            None => println!("unit {unit:03} joint{} {what}, {kind} from {}: not found", drift.joint + 1, drift.from),
        }
    }
    println!(
        "found within 10 recordings: {within} of {}; found at all: {}; units ever named wrongly over {} looks: {}",
        drifts.len(),
        found.len(),
        dates.len() - 8,
        ever.len()
    );
}
