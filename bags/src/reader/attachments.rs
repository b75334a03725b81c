//! The files that a bag holds.

use std::collections::HashMap;

/// Files that a bag holds.
#[derive(Debug, Default)]
pub(crate) struct Attachments {
    pub(super) texts: HashMap<String, String>,
    /// Names under which there are two that differ.
    pub(super) doubled: Vec<String>,
}

impl Attachments {
    pub(crate) fn see(&mut self, name: String, data: &[u8]) {
        let text = String::from_utf8_lossy(data).into_owned();
        match self.texts.get(&name) {
            Some(other) if *other != text => self.doubled.push(name),
            Some(_) => {}
            None => drop(self.texts.insert(name, text)),
        }
    }
}
