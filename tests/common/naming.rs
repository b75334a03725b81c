//! What a message has to name for its reader: the file, the key, the value. The words around them are free.

/// Asserts that a text names all of these.
#[track_caller]
pub fn assert_names(text: impl AsRef<str>, things: &[&str]) {
    let text = text.as_ref();
    for thing in things {
        assert!(text.contains(thing), "does not name {thing:?}:\n{text}");
    }
}
