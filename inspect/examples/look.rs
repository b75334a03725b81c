//! Findings and responses of recordings, a line each: `cargo run --release --example look -- FILES...`.

use backdrive_inspect::{Options, Source, inspect};

fn main() -> Result<(), Box<dyn std::error::Error>> {
    for path in std::env::args().skip(1) {
        let started = std::time::Instant::now();
        let report = inspect(&[Source::Path(path.into())], &Options::default())?;
        println!("{} ({:.3} s)", report.sentence(), started.elapsed().as_secs_f64());
        for finding in &report.findings {
            println!("  {:?} {:?} {:?}: {}", finding.weight, finding.kind, finding.joint, finding.message);
        }
        for response in &report.responses {
            println!("  {} {:?} {:?}", response.joint, response.lag_ms, response.bandwidth);
        }
        report.notes.iter().for_each(|note| println!("  note {note}"));
    }
    Ok(())
}
