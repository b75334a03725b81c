//! What stands between the cells of a table in text.

use std::io::{BufRead, BufReader};
use std::path::Path;

/// How tables of others separate their cells, the commonest first. Spaces come last, for headings have them in their names, too.
const SEPARATORS: [u8; 4] = [b',', b';', b'\t', b' '];

/// What stands between the cells of a file: a comma, a semicolon, a tab or a space; the first of these that its heading and its first row have equally often.
/// A comma where none does, and where the file cannot be read: who reads all of it says what is wrong.
pub fn separator_of(path: &Path) -> u8 {
    std::fs::File::open(path).map_or(SEPARATORS[0], |file| separator_in(BufReader::new(file)))
}

/// The same of a text.
pub(super) fn separator_in(text: impl BufRead) -> u8 {
    let mut lines = text.lines().map_while(Result::ok).filter(|line| !line.starts_with('#') && !line.trim().is_empty());
    let (Some(heading), Some(first)) = (lines.next(), lines.next()) else { return SEPARATORS[0] };
    let count = |line: &str, separator: u8| line.trim().bytes().filter(|byte| *byte == separator).count();
    let parts = |separator: &u8| count(&heading, *separator) > 0 && count(&heading, *separator) == count(&first, *separator);
    SEPARATORS.into_iter().find(parts).unwrap_or(SEPARATORS[0])
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_first_that_heading_and_row_have_equally_often() {
        let of = |text: &str| separator_in(text.as_bytes()) as char;
        assert_eq!(of("t,x\n0,1\n"), ',');
        assert_eq!(of("# by hand; twice\nt;x [m]\n\n0;1\n"), ';');
        assert_eq!(of("t\tx\n0\t1\n"), '\t');
        assert_eq!(of("timestamp actual_q_0 actual_q_1\n0.002 1 2\n"), ' ');
        // Names with spaces are no columns.
        assert_eq!(of("duration, success rate, q[0], q[1]\n0,1,0.1,0.2\n"), ',');
        assert_eq!(of("time s;motor position\n0;1\n"), ';');
        // Nothing fits: the reader of the whole file says so.
        assert_eq!(of("motor position\n1\n"), ',');
        assert_eq!(of("t,x\n0\n"), ',');
        assert_eq!(of(""), ',');
    }
}
