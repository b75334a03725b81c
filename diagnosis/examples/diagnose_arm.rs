//! Diagnoses a set as `backdrive diagnose` does: `diagnose_arm SET OUT`. Smaller to build than the whole command line; `score_arms.py` takes either.
use backdrive_diagnosis::arms::diagnose::{EXPERIMENT_FILE, diagnose};
use backdrive_diagnosis::arms::problem::Problem;
use backdrive_diagnosis::options::Options;
use backdrive_plant::set::RecordingSet;
use std::path::PathBuf;

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let mut args = std::env::args().skip(1);
    let (Some(set), Some(out)) = (args.next(), args.next()) else { return Err("usage: diagnose_arm SET OUT [CORNER_HZ]".into()) };
    let out = PathBuf::from(out);
    let options = Options { corner_hz: args.next().and_then(|c| c.parse().ok()), ..Options::default() };
    let problem = Problem::open(&RecordingSet::open(set.as_ref())?, None)?;
    let found = diagnose(&problem, &options, None, &|_| ())?;
    std::fs::create_dir_all(&out)?;
    std::fs::write(out.join("verdict.json"), serde_json::to_string_pretty(&found.verdict)? + "\n")?;
    std::fs::write(out.join("model.diagnosed.toml"), &found.model)?;
    std::fs::write(out.join(EXPERIMENT_FILE), &found.experiment)?;
    println!("{:?}: {}", found.verdict.word, found.verdict.sentence);
    if let Some(arm) = &found.verdict.arm {
        for j in &arm.joints {
            println!("{j:?}");
        }
    }
    for t in &found.tried {
        println!("tried {} {:?}: worth {:.1}, unseen {:?}, taken {}", t.physics, t.place, t.worth, t.unseen, t.taken);
    }
    for note in &found.notes {
        println!("note: {note}");
    }
    Ok(())
}
