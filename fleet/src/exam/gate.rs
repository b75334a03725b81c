//! Seeded changes for the gate: half of them harmless, such as another motion, another temperature and changes below the bounds.

use super::processor::processor_s;
use backdrive_fleet::gate::{Bounds, Outcome, gate};
use backdrive_fleet::simulated::{Arm, JOINTS, RATE, Truth, normal, random, unit};
use rand::RngExt;
use rand_chacha::ChaCha8Rng;
use std::path::Path;

/// Recordings of each side.
const RECORDINGS: usize = 2;

/// Makes a change to one of the sides.
type Apply = Box<dyn Fn(usize, &mut Truth)>;

/// What changes between the two sides: the kind, its size, and the joint.
struct Change {
    words: String,
    apply: Apply,
    rate: f64,
}

pub fn exam(seed: u64, cases: usize) {
    let model = Path::new(env!("CARGO_MANIFEST_DIR")).join("../plant/robots/seven-joint-leader.toml");
    let arm = Arm::open(&model).expect("the model is there");
    let (mut caught, mut harmful, mut wrong, mut harmless, mut open) = (0, 0, 0, 0, 0);
    let mut longest: f64 = 0.0;
    for case in 0..cases {
        let is_harmful = case % 2 == 1;
        let mut of_case = random(seed, case, 0);
        let own = unit(&mut of_case);
        let change = if is_harmful { harm(case / 2, &mut of_case) } else { none(case / 2, &mut of_case) };
        let folder = tempfile::tempdir().expect("a folder");
        for (side, is_new) in [("old", false), ("new", true)] {
            let below = folder.path().join(side);
            std::fs::create_dir(&below).expect("a folder");
            for r in 0..RECORDINGS {
                let mut of_recording = random(seed, case, 1 + r + RECORDINGS * usize::from(is_new));
                let mut truth = own;
                for (j, joint) in truth.iter_mut().enumerate() {
                    joint.dry *= 1.0 + 0.02 * normal(&mut of_recording);
                    joint.viscous *= 1.0 + 0.02 * normal(&mut of_recording);
                    if is_new {
                        (change.apply)(j, joint);
                    }
                }
                let rate = if is_new { change.rate } else { RATE };
                std::fs::write(below.join(format!("{r}.csv")), arm.log(&truth, rate, &mut of_recording)).expect("a log");
            }
        }
        let before = processor_s();
        let found = gate(&folder.path().join("old"), &folder.path().join("new"), Some(&model), None, &Bounds::default()).expect("compared");
        longest = longest.max(processor_s() - before);
        let failed: Vec<&str> = found.with(Outcome::Failed).map(|check| check.sentence.as_str()).collect();
        let uncertain = found.with(Outcome::Uncertain).count();
        if is_harmful {
            harmful += 1;
            caught += usize::from(!failed.is_empty());
        } else {
            harmless += 1;
            wrong += usize::from(!failed.is_empty());
            open += usize::from(failed.is_empty() && uncertain > 0);
        }
        if is_harmful == failed.is_empty() || uncertain > 0 {
            let other: Vec<&str> = found.with(Outcome::Uncertain).map(|check| check.sentence.as_str()).collect();
            println!("case {case}, {}: {} failed {failed:?}, not known {other:?}", change.words, failed.len());
        }
    }
    println!(
        "caught {caught} of {harmful}; wrong {wrong} of {harmless}; harmless but not known {open}; at most {longest:.2} s of processor time a case"
    );
}

fn at(joint: usize, words: String, change: impl Fn(&mut Truth) + 'static) -> Change {
    let apply = move |j: usize, truth: &mut Truth| {
        if j == joint {
            change(truth);
        }
    };
    Change { words: format!("joint{}: {words}", joint + 1), apply: Box::new(apply), rate: RATE }
}

/// Changes of twice the bound and more.
fn harm(kind: usize, random: &mut ChaCha8Rng) -> Change {
    let joint = random.random_range(0..JOINTS);
    let share: f64 = random.random_range(0.0..1.0);
    match kind % 10 {
        0 | 1 => at(joint, format!("dry friction +{:.0} %", 30.0 + 30.0 * share), move |t| t.dry *= 1.3 + 0.3 * share),
        2 => at(joint, format!("dry friction -{:.0} %", 30.0 + 20.0 * share), move |t| t.dry *= 0.7 - 0.2 * share),
        3 => at(joint, format!("viscous friction +{:.0} %", 50.0 + 50.0 * share), move |t| t.viscous *= 1.5 + 0.5 * share),
        4 => at(joint, "constant torque of the dry friction's size".to_string(), move |t| t.constant += t.dry),
        // The joints whose links take torque enough to show a scale.
        5 => at([1, 3][joint % 2], format!("torque scale +{:.0} %", 10.0 + 5.0 * share), move |t| t.gain *= 1.1 + 0.05 * share),
        6 => at(joint, "noise of the torque three times".to_string(), |t| t.noise *= 3.0),
        7 => at(joint, "noise of the position five times".to_string(), |t| t.position_noise *= 5.0),
        8 => {
            let rate = if share < 0.5 { 80.0 } else { 125.0 };
            Change { words: format!("{rate} samples per second"), apply: Box::new(|_, _| {}), rate }
        }
        _ => at(joint, "Stribeck friction of 1.5 times the dry friction".to_string(), |t| t.stribeck = 1.5 * t.dry),
    }
}

/// Another motion each time; and changes of a third of the bound at most.
fn none(kind: usize, random: &mut ChaCha8Rng) -> Change {
    let joint = random.random_range(0..JOINTS);
    let share: f64 = random.random_range(-1.0..1.0);
    match kind % 5 {
        0 | 1 => at(joint, "only another motion".to_string(), |_| {}),
        2 => at(joint, format!("dry friction {:+.1} %", 5.0 * share), move |t| t.dry *= 1.0 + 0.05 * share),
        3 => at(joint, format!("viscous friction {:+.1} %", 8.0 * share), move |t| t.viscous *= 1.0 + 0.08 * share),
        _ => at(joint, format!("noise of the torque {:+.0} %", 20.0 * share), move |t| t.noise *= 1.0 + 0.2 * share),
    }
}
