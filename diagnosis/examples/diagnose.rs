//! `diagnose SET --out DIR [--without KIND]...`: a verdict and a diagnosed model for a set.

use backdrive_diagnosis::{problem::Problem, search, verdict};
use std::path::{Path, PathBuf};
use std::time::Instant;

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let args: Vec<String> = std::env::args().skip(1).collect();
    let after = |key: &str| args.iter().position(|a| a == key).and_then(|i| args.get(i + 1)).cloned();
    let set = args.first().ok_or("usage: diagnose SET --out DIR [--without KIND] [-v]")?;
    let out = PathBuf::from(after("--out").unwrap_or_else(|| "diagnosis".to_string()));
    let talk = args.iter().any(|a| a == "-v");
    let began = Instant::now();
    let problem = Problem::open(Path::new(set), after("--model").as_deref().map(Path::new))?;
    let settings = search::Settings { without: after("--without").into_iter().collect(), ..Default::default() };
    let settings = match after("--effort").and_then(|p| p.parse().ok()) {
        Some(effort) => search::Settings { effort, ..settings },
        None => settings,
    };
    let found = search::search(&problem, &settings, settings.limit(None), &|what| {
        if talk {
            eprintln!("{:.2} s {what}", began.elapsed().as_secs_f64());
        }
    })?;
    let said = verdict::verdict(&problem, &found, "model.diagnosed.toml")?;
    std::fs::create_dir_all(&out)?;
    std::fs::write(out.join("verdict.json"), serde_json::to_string_pretty(&said.json)?)?;
    std::fs::write(out.join("model.diagnosed.toml"), &said.model)?;
    let seconds = began.elapsed().as_secs_f64();
    std::fs::write(out.join("time.txt"), format!("{seconds:.2}\n"))?;
    println!("{set}: {} ({seconds:.1} s)", said.sentence);
    if talk {
        let n = found.samples as f64;
        eprintln!(
            "{} hypotheses, {} simulations, {:.0} million steps{}; floor {:.3?}, as given {:.3?}",
            found.hypotheses,
            found.simulations,
            found.work as f64 / 1e6,
            if found.exhausted { ", exhausted" } else { "" },
            found.floor,
            found.levels_given
        );
        let nominal = &found.nominal;
        eprintln!(
            "nominal: {:.4} {:.3?} correlation {:.1} slow {:.1}",
            nominal.fit.cost / n,
            nominal.levels,
            nominal.correlation_time,
            nominal.slowness
        );
        for t in found.tried.iter().take(10) {
            eprintln!("   promised {:.3} taken {:.3?} {}", t.promised, t.taken, t.id);
        }
        for c in &found.found {
            let (cost, ahead) = (c.fit.cost / n, search::advantage_over(nominal, c, found.samples));
            let values = c.structure.added_of(&c.fit.values);
            eprintln!(
                "{:<62} {cost:.4} {:.3?} correlation {:.1} slow {:.1} ahead {ahead:.1} steps {} foreseen {:.2} {values:.4?}",
                c.structure.name(),
                c.levels,
                c.correlation_time,
                c.slowness,
                c.fit.steps,
                c.fit.foreseen
            );
        }
    }
    Ok(())
}
