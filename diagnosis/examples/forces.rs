//! The figures of a diagnosis on forces along a measured motion, for those who calibrate its confidence. For every set it prints a line of JSON with each
//! law that is claimed and its figures. `cargo run --release --example forces -- SET.toml...`; `tests/concealed/calibrate_forces.py` reads it.

use backdrive_diagnosis::equation_error::figures_of;
use backdrive_diagnosis::recordings::problem::Problem;
use std::path::Path;

fn main() -> Result<(), Box<dyn std::error::Error>> {
    for set in std::env::args().skip(1) {
        let problem = Problem::open(Path::new(&set), None)?;
        let found = figures_of(&problem).into_iter();
        let laws: Vec<_> =
            found.map(|(physics, [law, kind])| serde_json::json!({ "physics": physics, "law": law.list(), "kind": kind.list() })).collect();
        println!("{}", serde_json::json!({ "set": set, "claimed": laws }));
    }
    Ok(())
}
