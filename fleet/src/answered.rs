//! The answer to one recording as a value: a row for each joint, and the verdict.

use serde::{Deserialize, Serialize};
use serde_json::{Value, json};
use std::collections::BTreeMap;

/// The answer to one recording. It depends on the recording, the model and the options, and on nothing else.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Answered {
    /// In a sentence.
    pub sentence: String,
    /// Why there is no answer.
    pub error: Option<String>,
    /// A row for each joint; of an answer with an error one without a joint.
    pub rows: Vec<Row>,
    /// The verdict.
    pub verdict: Value,
}

/// What is known of one joint of one recording.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Row {
    /// The joint; `device` of one axis, `loop` of a stability.
    pub joint: String,
    /// Numbers by column, all finite, in SI units.
    pub numbers: BTreeMap<String, f64>,
    /// Texts by column.
    pub words: BTreeMap<String, String>,
}

impl Row {
    /// Without values.
    pub fn of(joint: &str) -> Row {
        Row { joint: joint.to_string(), numbers: BTreeMap::new(), words: BTreeMap::new() }
    }

    /// Adds a number; one that is not finite is left out.
    pub fn number(&mut self, column: &str, value: f64) {
        if value.is_finite() {
            self.numbers.insert(column.to_string(), value);
        }
    }

    /// Adds a text.
    pub fn word(&mut self, column: &str, text: &str) {
        self.words.insert(column.to_string(), text.to_string());
    }
}

impl Answered {
    /// No answer, as a row that states why.
    pub fn failed(why: String) -> Answered {
        let verdict = json!({ "error": why });
        Answered { sentence: format!("no answer: {why}"), rows: vec![Row::of("")], error: Some(why), verdict }
    }
}
