//! The planned motion determines what the logs leave open, and a stated payload counts.

use crate::common::{AS_STATED, Beside, TIP, along, series, set, write};
use crate::naming::assert_names;
use backdrive_diagnosis::arms::diagnose::{Found, diagnose};
use backdrive_diagnosis::arms::problem::Problem;
use backdrive_diagnosis::hypothesis::Place;
use backdrive_diagnosis::options::Options;
use backdrive_diagnosis::verdict::{NextExperiment, Parameter, Planned, Word};
use backdrive_plant::set::RecordingSet;
use std::path::Path;

fn found(folder: &Path) -> Found {
    diagnose(&Problem::open(&RecordingSet::open(folder).unwrap(), None).unwrap(), &Options::default(), None, &|_| ()).unwrap()
}

fn planned(found: &Found) -> &Planned {
    match &found.verdict.next_experiment {
        Some(NextExperiment::Planned(planned)) => planned,
        other => panic!("{other:?}"),
    }
}

/// Positions of a file at 100 Hz, as a path through them: their values and central differences, which a Fourier series of 5 harmonics is smooth enough for.
fn tracked(csv: &str) -> impl Fn(f64) -> [[f64; 2]; 3] + use<> {
    let rows: Vec<[f64; 2]> = csv
        .lines()
        .skip(1)
        .map(|line| {
            let x: Vec<f64> = line.split(',').map(|x| x.parse().unwrap()).collect();
            [x[1], x[2]]
        })
        .collect();
    move |t: f64| {
        let n = rows.len() as f64;
        // Cubic between the samples (Catmull-Rom), periodic.
        let place = (t * 100.0).rem_euclid(n);
        let (i, u) = (place.floor() as usize, place.fract());
        let at = |k: isize, j: usize| rows[(i as isize + k).rem_euclid(rows.len() as isize) as usize][j];
        let (mut q, mut v, mut a) = ([0.0; 2], [0.0; 2], [0.0; 2]);
        for j in 0..2 {
            let speed = |k: isize| 50.0 * (at(k + 1, j) - at(k - 1, j));
            let curve = |k: isize| 1e4 * (at(k + 1, j) - 2.0 * at(k, j) + at(k - 1, j));
            q[j] = at(0, j) + u * (at(1, j) - at(0, j)) - 0.5 * u * (1.0 - u) * curve(0) * 1e-4;
            v[j] = speed(0) + u * (speed(1) - speed(0));
            a[j] = curve(0) + u * (curve(1) - curve(0));
        }
        [q, v, a]
    }
}

#[test]
fn friction_under_one_load_is_left_open_and_the_planned_motion_tells() {
    let beside = Beside { dry: [0.0; 2], by_load: [0.1, 0.0], ..AS_STATED };
    let folder = tempfile::tempdir().unwrap();
    set(folder.path(), &beside, "", |_| {});
    // The upper arm held level all the time: the shoulder always carries the same.
    for (seed, name) in ["a.csv", "b.csv", "c.csv"].iter().enumerate() {
        let path = series(seed as u64 + 1, [-1.5, 0.0], 0.006);
        write(&folder.path().join(name), &along(&*path, seed as u64, &beside, 2400, 0.0));
    }
    let first = found(folder.path());
    assert!(first.verdict.audit.iter().any(|r| r.what == "load" && r.place == "shoulder"), "{:?}", first.verdict.audit);
    assert!(first.verdict.findings.iter().all(|f| f.physics != "load_friction"), "{:?}", first.verdict.findings);
    let plan = planned(&first);
    assert!(plan.separation_sd.unwrap() > 4.0, "{plan:?}");
    assert!(plan.between.iter().any(|b| b.contains("grows with the load") && b.contains("shoulder")), "{plan:?}");
    // Done by its description.
    let path = tracked(&first.experiment);
    let count = (200.0 * plan.duration_s.unwrap()) as i32;
    for (seed, name) in ["d.csv", "e.csv", "f.csv"].iter().enumerate() {
        write(&folder.path().join(name), &along(&path, 10 + seed as u64, &beside, count, 0.0));
    }
    let text = "model = \"arm.toml\"\nfit = [\"a.csv\", \"b.csv\", \"d.csv\", \"e.csv\"]\nheld_out = [\"c.csv\", \"f.csv\"]\n";
    std::fs::write(folder.path().join("set.toml"), text).unwrap();
    let second = found(folder.path());
    let finding = &second.verdict.findings[0];
    assert_eq!(
        (finding.physics.as_str(), &finding.place),
        ("load_friction", &Place::Between("shoulder".to_string(), "ground".to_string()))
    );
}

#[test]
fn a_payload_that_is_said_tells_torque_constants_from_masses() {
    // Both torques are read 15 % too large.
    let beside = Beside { gain: [1.15; 2], ..AS_STATED };
    let folder = tempfile::tempdir().unwrap();
    set(folder.path(), &beside, "", |_| {});
    // Without one the masses are as likely to be wrong, and one is asked for.
    let first = found(folder.path());
    assert!(first.verdict.findings.iter().all(|f| f.physics != "gain"), "{:?}", first.verdict.findings);
    let plan = planned(&first);
    let payload = plan.payload.as_ref().unwrap();
    assert!(plan.separation_sd.unwrap() > 4.0 && plan.between[0].contains("torque constants"), "{plan:?}");
    assert_eq!((payload.at_m, payload.link.as_str()), (TIP, "fore"));
    let (path, count) = (tracked(&first.experiment), (200.0 * plan.duration_s.unwrap()) as i32);
    for (seed, name) in ["d.csv", "e.csv", "f.csv"].iter().enumerate() {
        write(&folder.path().join(name), &along(&path, 20 + seed as u64, &beside, count, payload.mass_kg));
    }
    let rule = |name: &str| format!("[files.\"{name}\"]\npayload = {{ mass = {:?}, at = {:?} }}\n", payload.mass_kg, payload.at_m);
    let text = format!(
        "model = \"arm.toml\"\nfit = [\"a.csv\", \"d.csv\", \"e.csv\"]\nheld_out = [\"c.csv\", \"f.csv\"]\n{}{}{}",
        rule("d.csv"),
        rule("e.csv"),
        rule("f.csv")
    );
    std::fs::write(folder.path().join("set.toml"), text).unwrap();
    let found = found(folder.path());
    let [gain] = found.verdict.findings.as_slice() else { panic!("{:?}", found.verdict.findings) };
    assert_eq!((gain.physics.as_str(), &gain.place), ("gain", &Place::Signal("torque of all joints".to_string())));
    let Parameter::One(e) = &gain.parameters["gain"] else { panic!("{gain:?}") };
    assert!((e.value - 1.15).abs() < 0.02, "{gain:?}");
    // If the payload is not stated, masses and torque constants have one common factor, and no file's parameters are right.
    std::fs::write(folder.path().join("set.toml"), "model = \"arm.toml\"\nfit = [\"d.csv\", \"e.csv\"]\nheld_out = [\"f.csv\"]\n").unwrap();
    let silent =
        diagnose(&Problem::open(&RecordingSet::open(folder.path()).unwrap(), None).unwrap(), &Options::default(), None, &|_| ()).unwrap();
    assert_ne!(silent.verdict.word, Word::NothingMissing);
}

#[test]
fn a_payload_of_no_link_is_refused_by_name() {
    let folder = tempfile::tempdir().unwrap();
    set(folder.path(), &AS_STATED, "[files.\"a.csv\"]\npayload = { mass = 1.0, at = [0, 0, 0], link = \"hand\" }\n", |_| {});
    let error = Problem::open(&RecordingSet::open(folder.path()).unwrap(), None).unwrap_err().to_string();
    assert_names(&error, &["files.a.csv.payload", "\"hand\"", "base, upper"]);
}
