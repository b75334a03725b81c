//! The one error that every file of ours is refused with.

use std::fmt;

/// What is wrong in a file, and where.
///
/// Renders as `models/x.toml:14: elements[2] "cable": unknown key "stifness"; did you mean "stiffness"?`.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct FileError {
    /// The file, as the user named it.
    pub path: String,
    /// Line, from 1; `None` where the error is not in one line (a missing file).
    pub line: Option<usize>,
    /// Dotted path of the key, or the column of a table; empty where the error is about the file as a whole.
    pub key: String,
    /// What was found, what was expected, and where it helps what to do.
    pub message: String,
}

impl FileError {
    /// An error about a whole file.
    pub fn whole(path: impl Into<String>, message: impl Into<String>) -> Self {
        FileError { path: path.into(), line: None, key: String::new(), message: message.into() }
    }

    /// An error at a line (from 1) of a file.
    pub fn at(path: impl Into<String>, line: usize, key: impl Into<String>, message: impl Into<String>) -> Self {
        FileError { path: path.into(), line: Some(line), key: key.into(), message: message.into() }
    }
}

impl fmt::Display for FileError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(&self.path)?;
        if let Some(line) = self.line {
            write!(f, ":{line}")?;
        }
        f.write_str(": ")?;
        if !self.key.is_empty() {
            write!(f, "{}: ", self.key)?;
        }
        f.write_str(&self.message)
    }
}

impl std::error::Error for FileError {}

/// The candidate nearest to `word` in spelling, if one is near enough to be worth suggesting.
pub fn nearest<'a>(word: &str, candidates: impl IntoIterator<Item = &'a str>) -> Option<&'a str> {
    let lower = word.to_lowercase();
    candidates
        .into_iter()
        .map(|candidate| {
            (strsim::damerau_levenshtein(&lower, &candidate.to_lowercase()), strsim::jaro_winkler(&lower, candidate), candidate)
        })
        // A third of the letters may be wrong, or the beginnings agree well (`damp` for `damping`).
        .filter(|(edits, likeness, candidate)| *edits <= (candidate.chars().count() / 3) || *likeness >= 0.82)
        .min_by(|a, b| (a.0, -a.1).partial_cmp(&(b.0, -b.1)).unwrap_or(std::cmp::Ordering::Equal))
        .map(|(_, _, candidate)| candidate)
}

/// `unknown element kind "sprng"; did you mean "spring"?`, or the list of what there is where nothing is near.
pub fn unknown<'a>(what: &str, word: &str, candidates: impl IntoIterator<Item = &'a str> + Clone) -> String {
    match nearest(word, candidates.clone()) {
        Some(near) => format!("unknown {what} \"{word}\"; did you mean \"{near}\"?"),
        None => {
            let all: Vec<&str> = candidates.into_iter().collect();
            if all.is_empty() {
                format!("unknown {what} \"{word}\"; there is none here")
            } else {
                format!("unknown {what} \"{word}\"; there is {}", all.join(", "))
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn suggests_what_is_near_and_nothing_else() {
        assert_eq!(nearest("stifness", ["damping", "stiffness"]), Some("stiffness"));
        assert_eq!(nearest("damp", ["damping", "stiffness"]), Some("damping"));
        assert_eq!(nearest("hnadle", ["handle", "motor"]), Some("handle"));
        assert_eq!(nearest("colour", ["damping", "stiffness"]), None);
    }
}
