//! Values of options: numbers within their bounds.

use backdrive_control::coupling::LawKind;
use backdrive_nodes::graph::MAX_RATE_HZ;
use backdrive_stability::compare::Rival;
use clap::builder::{PossibleValue, PossibleValuesParser, TypedValueParser};

/// s, how long a search may take on the clock where nothing else is said: the library's own.
pub fn patience() -> f64 {
    backdrive_diagnosis::options::Options::usual_patience().as_secs_f64()
}

/// A finite number.
pub fn number(text: &str) -> Result<f64, String> {
    text.parse().ok().filter(|x: &f64| x.is_finite()).ok_or("must be a finite number".to_string())
}

/// A number of at least 0.
pub fn not_negative(text: &str) -> Result<f64, String> {
    number(text).and_then(|x| if x >= 0.0 { Ok(x) } else { Err("must be at least 0".to_string()) })
}

/// A number above 0.
pub fn positive(text: &str) -> Result<f64, String> {
    number(text).and_then(|x| if x > 0.0 { Ok(x) } else { Err("must be above 0".to_string()) })
}

/// Values of an option: the word (and, behind a bar, another for it), its help, and what it means.
pub fn choices<T: Clone + Send + Sync + 'static, const N: usize>(
    all: [(&'static str, &'static str, T); N],
) -> impl TypedValueParser<Value = T> {
    let values = all.each_ref().map(|(words, about, _)| {
        let mut words = words.split('|');
        PossibleValue::new(words.next().unwrap_or_default()).help(*about).aliases(words)
    });
    let meaning = move |given: String| {
        let found = all.iter().find(|(words, ..)| words.split('|').any(|word| word == given));
        found.map(|(.., value)| value.clone()).ok_or("is none of them")
    };
    PossibleValuesParser::new(values).try_map(meaning)
}

/// A law of a coupling.
pub fn law() -> impl TypedValueParser<Value = LawKind> {
    words(&LawKind::ALL)
}

/// What is compared: a law of a coupling, or the canceller.
pub fn rival() -> impl TypedValueParser<Value = Rival> {
    words(&Rival::all())
}

/// Values of an option: the word, and what it means.
fn words<T: Clone + Send + Sync + 'static>(all: &[(&'static str, T)]) -> impl TypedValueParser<Value = T> + use<T> {
    let values: Vec<&'static str> = all.iter().map(|(word, _)| *word).collect();
    let all = all.to_vec();
    let meaning = move |given: String| {
        let found = all.iter().find(|(word, _)| *word == given);
        found.map(|(_, value)| value.clone()).ok_or("is none of them")
    };
    PossibleValuesParser::new(values).try_map(meaning)
}

/// Steps per second.
pub fn rate(text: &str) -> Result<f64, String> {
    positive(text).and_then(|x| if x <= MAX_RATE_HZ { Ok(x) } else { Err(format!("must be at most {MAX_RATE_HZ}")) })
}
