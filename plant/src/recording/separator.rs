//! What stands between the cells of a table in text.

use std::io::BufRead;

/// How tables of others separate their cells. Tabs and semicolons come first, for where they part cells a comma may be a decimal one; spaces come last, for headings
/// have them in their names, too.
const SEPARATORS: [u8; 4] = [b'\t', b';', b',', b' '];

/// The separator between the cells of a text: a tab, a semicolon, a comma or a space. It is the first of these that its heading and its first row have
/// equally often; quoted text is ignored. A comma where none does: the reader of the whole text reports the error.
pub(super) fn separator_in(text: impl BufRead) -> u8 {
    let mut lines = text.lines().map_while(Result::ok).filter(|line| !line.starts_with('#') && !line.trim().is_empty());
    let (Some(heading), Some(first)) = (lines.next(), lines.next()) else { return b',' };
    let count = |line: &str, separator: u8| {
        let mut quoted = false;
        let mut counts = |byte: &u8| {
            quoted ^= *byte == b'"';
            *byte == separator && !quoted
        };
        line.trim().as_bytes().iter().filter(|byte| counts(byte)).count()
    };
    let parts = |separator: &u8| count(&heading, *separator) > 0 && count(&heading, *separator) == count(&first, *separator);
    SEPARATORS.into_iter().find(parts).unwrap_or(b',')
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
        // Where a comma stands in the headings and in the numbers, it is no separator; nor where it stands in quotes.
        assert_eq!(of("time, s;force, N\n0,1;2,5\n"), ';');
        assert_eq!(of("time, s\tforce, N\n0,1\t2,5\n"), '\t');
        assert_eq!(of("\"t\",\"x, filtered\"\n0, 1\n"), ',');
        // Nothing fits: the reader of the whole file reports it.
        assert_eq!(of("motor position\n1\n"), ',');
        assert_eq!(of("t,x\n0\n"), ',');
        assert_eq!(of(""), ',');
    }
}
