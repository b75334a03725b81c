//! Writes `docs/verdict.schema.json`, the JSON Schema of verdict files, from the types of the diagnosis:
//!
//!     cargo run --example verdict_schema
//!
//! `tests/verdict_schema.rs` fails where the file differs from the schema of the types.

use std::error::Error;
use std::path::Path;

fn main() -> Result<(), Box<dyn Error>> {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("docs/verdict.schema.json");
    std::fs::write(&path, backdrive_diagnosis::verdict::schema()?)?;
    println!("wrote {}", path.display());
    Ok(())
}
