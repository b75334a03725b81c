//! Commands that sentences about a bag offer.

use std::path::{Path, PathBuf};

/// A word of a command line, in quotes where a shell would read it otherwise.
pub fn shell_word(word: &str) -> String {
    match word.chars().all(|c| c.is_alphanumeric() || "-_./:,=+@%".contains(c)) && !word.is_empty() {
        true => word.to_string(),
        false => format!("'{}'", word.replace('\'', "'\\''")),
    }
}

/// The command that saves what is whole of a bag, into a file beside it that does not exist.
pub fn recover_command(bag: &Path) -> String {
    let stem = bag.file_stem().map_or_else(String::new, |s| s.to_string_lossy().into_owned());
    format!("backdrive bag recover {} --bag {}", path_word(bag), path_word(&free(bag, &format!("{stem}-saved"), ".mcap")))
}

/// A path beside another one that is not taken: `NAME`, or `NAME-2`, `NAME-3` and so on, each with its ending.
pub(crate) fn free(beside: &Path, name: &str, ending: &str) -> PathBuf {
    let numbered = (2_u32..).map(|number| beside.with_file_name(format!("{name}-{number}{ending}")));
    let first = beside.with_file_name(format!("{name}{ending}"));
    std::iter::once(first.clone()).chain(numbered).find(|path| path.symlink_metadata().is_err()).unwrap_or(first)
}

/// A path as a word. A name that begins with a dash is no option.
pub(crate) fn path_word(path: &Path) -> String {
    let text = path.display().to_string();
    shell_word(&if text.starts_with('-') { format!("./{text}") } else { text })
}

/// A sentence for a bag that was not closed, with the command that saves what there is; `None` for one that was.
pub(crate) fn end_missing(bag: &Path, was_closed: bool) -> Option<String> {
    let sentence =
        || format!("the file was not closed, so its end is missing; `{}` makes a clean copy of what there is", recover_command(bag));
    (!was_closed).then(sentence)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_bag_is_recovered_into_a_name_that_is_free_whatever_it_is_called() {
        let folder = tempfile::tempdir().unwrap();
        let at = |name: &str| folder.path().join(name);
        let (bag, saved) = (at("it's a bag.mcap"), at("it's a bag-saved.mcap"));
        let quoted = |path: &Path| format!("'{}'", path.display().to_string().replace('\'', "'\\''"));
        assert_eq!(recover_command(&bag), format!("backdrive bag recover {} --bag {}", quoted(&bag), quoted(&saved)));
        std::fs::write(&saved, "").unwrap();
        assert!(recover_command(&bag).ends_with(&quoted(&at("it's a bag-saved-2.mcap"))), "{}", recover_command(&bag));
        assert_eq!(recover_command(Path::new("-run.mcap")), "backdrive bag recover ./-run.mcap --bag ./-run-saved.mcap");
        let error = crate::BagError::Damaged { path: bag.clone(), offset: 7, what: "a record is cut off".to_string() }.to_string();
        assert!(error.ends_with(&format!("{}` recovers the intact part", recover_command(&bag))), "{error}");
    }
}
