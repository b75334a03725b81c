//! The verdict file's JSON Schema, from the types and their documentation.

use super::types::Verdict;

/// JSON Schema (2020-12) of verdict files, those of earlier versions among them, as text that ends with a line break.
///
/// # Errors
/// Never in practice: when the schema is no JSON.
pub fn schema() -> Result<String, serde_json::Error> {
    Ok(serde_json::to_string_pretty(&schemars::schema_for!(Verdict))? + "\n")
}
