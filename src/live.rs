//! `backdrive live`: a window on a run in progress, or on bags.

use crate::failure::Failure;
use crate::{cli, interrupt, output, progress};
use backdrive_launch::alive::find;
use backdrive_live::LiveError;
use backdrive_live::bag::Window;
use backdrive_live::run::{Live, Options};
use serde_json::json;
use std::path::Path;
use std::sync::Arc;

impl From<LiveError> for Failure {
    fn from(error: LiveError) -> Failure {
        match error {
            LiveError::Input(message) => Failure::input(message),
            LiveError::Machine(message) => Failure::machine(message),
        }
    }
}

/// Serves the page until the run has ended, or Ctrl-C.
pub fn live(options: &cli::Live) -> Result<u8, Failure> {
    let stop = interrupt::heard()?;
    let words: Vec<&Path> = options.what.iter().map(AsRef::as_ref).collect();
    // What is no file may be the name of a run.
    if words.is_empty() || words.len() == 1 && !words[0].exists() && is_name(words[0]) {
        let paths = find(words.first().and_then(|name| name.to_str()))?;
        let asked = Options { address: Some(options.address), most_lambda: options.most_lambda, why: None };
        let live = Live::open(&paths, &asked, Arc::new(|said: &str| output::note(said)))?;
        if let Some([control, watch]) = live.urls() {
            if options.json {
                output::line(json!({ "run": paths.id(), "page": control, "to_watch": watch }))?;
            } else {
                output::line(format_args!("page     {control}\nto watch {watch}"))?;
            }
        }
        live.wait(&stop);
        return Ok(0);
    }
    if options.most_lambda.is_some() {
        return Err(Failure::input("--most-lambda is for a run in progress; omit it with bags"));
    }
    let window = progress::busy("reading", || Window::open(&words, options.address))?;
    match options.json {
        true => output::line(json!({ "bags": options.what, "page": window.url() }))?,
        false => output::line(format_args!("page     {}", window.url()))?,
    }
    window.wait(&stop);
    Ok(0)
}

/// Whether a word can be the beginning of a run's name.
fn is_name(word: &Path) -> bool {
    word.to_str().is_some_and(|word| word.len() <= 20 && word.bytes().all(|b| b.is_ascii_digit() || (b'a'..=b'f').contains(&b)))
}
