//! Names that a target accepts.

use std::collections::BTreeSet;

/// A name as an identifier of C and Python: letters, digits and underscores, unlike those in `taken`, to which it is added.
pub(crate) fn identifier(name: &str, taken: &mut BTreeSet<String>) -> String {
    let mut word: String = name.chars().map(|c| if c.is_ascii_alphanumeric() { c } else { '_' }).collect();
    if word.chars().next().is_none_or(|c| c.is_ascii_digit()) {
        word.insert(0, '_');
    }
    unlike(word, taken)
}

/// A name unlike those in `taken`, to which it is added.
pub(crate) fn unlike(name: String, taken: &mut BTreeSet<String>) -> String {
    let free = (1..).map(|n| if n == 1 { name.clone() } else { format!("{name}_{n}") }).find(|n| !taken.contains(n)).unwrap_or(name);
    taken.insert(free.clone());
    free
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_become_identifiers_that_differ() {
        let mut taken = BTreeSet::new();
        let all: Vec<String> = ["drum", "grip.spring", "grip spring", "2nd", "Ölmotor"].iter().map(|n| identifier(n, &mut taken)).collect();
        assert_eq!(all, ["drum", "grip_spring", "grip_spring_2", "_2nd", "_lmotor"]);
    }
}
