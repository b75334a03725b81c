//! `diagnose SET --out DIR [--without KIND] [--tuning NAME=VALUE]...`: a verdict and a diagnosed model for a set.
//!
//! `--tuning claim.alike=4` or `--tuning claim.alike=x2` changes an entry of the tuning table, to see how much verdicts depend on it;
//! `diagnose --list-tuning` lists them.

use backdrive_diagnosis::diagnose::diagnose;
use backdrive_diagnosis::options::Options;
use backdrive_diagnosis::output_error::candidate::advantage_over;
use backdrive_diagnosis::recordings::problem::Problem;
use backdrive_diagnosis::tuning::Tuning;
use backdrive_diagnosis::verdict::{EXPERIMENT_FILE, MODEL_FILE, VERDICT_FILE, rival_file};
use std::path::{Path, PathBuf};
use std::time::Instant;

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let args: Vec<String> = std::env::args().skip(1).collect();
    let after = |key: &str| args.iter().position(|a| a == key).and_then(|i| args.get(i + 1)).cloned();
    let set = args.first().ok_or("usage: diagnose SET --out DIR [--without KIND] [-v]")?;
    let out = PathBuf::from(after("--out").unwrap_or_else(|| "diagnosis".to_string()));
    let talk = args.iter().any(|a| a == "-v");
    let mut tuning = Tuning::default();
    if set == "--list-tuning" {
        tuning.rows().iter().for_each(|row| println!("{}\t{}\t{}", row.name, row.value, row.unit));
        return Ok(());
    }
    for (_, change) in args.iter().zip(args.iter().skip(1)).filter(|(key, _)| *key == "--tuning") {
        let (name, value) = change.split_once('=').ok_or("--tuning takes NAME=VALUE, such as claim.alike=4 or claim.alike=x2")?;
        let entry = tuning.quantity(name).ok_or_else(|| format!("there is no tuning entry {name}: --list-tuning lists them"))?;
        match value.strip_prefix('x') {
            Some(factor) => entry.times(factor.parse()?),
            None => entry.set(value.parse()?),
        }
    }
    tuning.adopt().map_err(|_| "the tuning is in use already")?;
    let began = Instant::now();
    let problem = Problem::open(Path::new(set), after("--model").as_deref().map(Path::new))?;
    let options = Options { without: after("--without").into_iter().collect(), ..Default::default() };
    let options = match after("--effort").and_then(|p| p.parse().ok()) {
        effort @ Some(_) => Options { effort, ..options },
        None => options,
    };
    let said = diagnose(problem, &options, None, &|what| {
        if talk {
            eprintln!("{:.2} s {what}", began.elapsed().as_secs_f64());
        }
    })?;
    std::fs::create_dir_all(&out)?;
    std::fs::write(out.join(VERDICT_FILE), serde_json::to_string_pretty(&said.verdict)?)?;
    std::fs::write(out.join(MODEL_FILE), &said.files.model)?;
    for (number, rival) in said.files.rivals.iter().enumerate() {
        std::fs::write(out.join(rival_file(number + 1)), rival)?;
    }
    if let Some(experiment) = &said.files.experiment {
        std::fs::write(out.join(EXPERIMENT_FILE), experiment)?;
    }
    let seconds = began.elapsed().as_secs_f64();
    std::fs::write(out.join("time.txt"), format!("{seconds:.2}\n"))?;
    println!("{set}: {} ({seconds:.1} s)", said.verdict.sentence);
    let found = &said.search;
    if talk {
        let n = found.samples as f64;
        eprintln!(
            "{} hypotheses, {} simulations; noise_sd {:.3?}, as given {:.3?}",
            found.hypotheses, found.simulations, found.noise_sd, found.levels_given
        );
        for entry in &found.journal {
            eprintln!("   {:<44} {:?} -> {} {:.3}", entry.step, entry.outcome, entry.best, entry.residual);
        }
        let nominal = &found.nominal;
        eprintln!(
            "nominal: {:.4} {:.3?} correlation {:.1} slow {:.1}",
            nominal.fit.cost / n,
            nominal.levels,
            nominal.correlation_time,
            nominal.whiteness_statistic
        );
        for t in found.tried.iter().take(10) {
            eprintln!("   promised {:.3} taken {:.3?} {}", t.promised, t.taken, t.id);
        }
        for (physics, place, figures) in backdrive_diagnosis::verdict::figures_of(found) {
            let list: Vec<String> = figures.list().iter().map(|x| format!("{x:.4}")).collect();
            eprintln!("figures\t{physics}\t{place}\t{}", list.join("\t"));
        }
        let held = |c: &backdrive_diagnosis::output_error::candidate::Candidate| {
            let (n, b) = (nominal.unseen.as_ref(), backdrive_diagnosis::belief::choice::chosen(found).unseen.as_ref());
            c.unseen.as_ref().map(|u| (u.mean_square.sqrt(), n.and_then(|n| n.gain_over(u)), b.and_then(|b| u.gain_over(b))))
        };
        eprintln!("unseen nominal {:.3?}", held(nominal));
        for c in &found.found {
            if let Some(h) = held(c) {
                eprintln!("unseen {:.3?} {}", h, c.structure.name());
            }
        }
        for c in &found.found {
            let (cost, ahead) = (c.fit.cost / n, advantage_over(nominal, c, found.samples));
            let values = c.structure.added_of(&c.fit.values);
            eprintln!(
                "{:<62} {cost:.4} {:.3?} correlation {:.1} slow {:.1} ahead {ahead:.1} steps {} predicted_decrease {:.2} {values:.4?}",
                c.structure.name(),
                c.levels,
                c.correlation_time,
                c.whiteness_statistic,
                c.fit.steps,
                c.fit.predicted_decrease
            );
        }
    }
    Ok(())
}
