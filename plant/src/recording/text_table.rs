//! The rows of a table in text, each with the line that it stands in.

use super::separator::separator_in;
use csv::{ReaderBuilder, StringRecord, Terminator, Trim};
use std::io::{self, BufRead, Chain, Cursor, Read, Take};

/// A table in text: cells separated by commas, semicolons, tabs or spaces, lines that begin with `#` left aside, in UTF-8 with or without its mark.
pub struct TextTable<R> {
    rows: csv::Reader<Whole<R>>,
    /// Cells of the heading, once it was read.
    width: Option<usize>,
    is_utf16: bool,
}

/// What was looked at, what comes behind it, and a line feed: so every row ends with one.
type Whole<R> = Chain<Chain<Cursor<Vec<u8>>, R>, &'static [u8]>;

/// A heading and a row are searched in this number of bytes.
const MOST_LOOKED_AT: u64 = 1 << 20;

impl<R: BufRead> TextTable<R> {
    /// Begins to read; of a pipe, too.
    ///
    /// # Errors
    /// Any error of the operating system.
    pub fn new(mut text: R) -> io::Result<TextTable<R>> {
        let mut begin = beginning(&mut text.by_ref().take(MOST_LOOKED_AT))?;
        if begin.starts_with(b"\xef\xbb\xbf") {
            begin.drain(..3);
        }
        let is_utf16 = begin.starts_with(b"\xff\xfe") || begin.starts_with(b"\xfe\xff");
        // A carriage return before a line feed is trimmed off the last cell. Taken for the end of the row, as the crate would, it has lines counted one short.
        let terminator = if begin.contains(&b'\n') { Terminator::Any(b'\n') } else { Terminator::CRLF };
        let mut rows = ReaderBuilder::new();
        rows.has_headers(false).flexible(true).trim(Trim::All).comment(Some(b'#'));
        rows.delimiter(separator_in(begin.as_slice())).terminator(terminator);
        let whole = Cursor::new(begin).chain(text).chain(&b"\n"[..]);
        Ok(TextTable { rows: rows.from_reader(whole), width: None, is_utf16 })
    }

    /// The next row and its line, from 1; the heading is the first. `None` at the end.
    ///
    /// # Errors
    /// The line, and a sentence: it is no text, or has not as many cells as the heading.
    pub fn next(&mut self, row: &mut StringRecord) -> Result<Option<u64>, (u64, String)> {
        loop {
            let more = self.rows.read_record(row);
            let line = self.rows.position().line().saturating_sub(1).max(1);
            match more.map_err(|error| (line, self.told(&error)))? {
                false => return Ok(None),
                true if row.len() == 1 && row[0].is_empty() => {} // a line of spaces, or of a carriage return
                true => {
                    let width = *self.width.get_or_insert(row.len());
                    return match row.len() == width {
                        true => Ok(Some(line)),
                        false => Err((line, format!("expected {width} cells, as the heading has, found {}", row.len()))),
                    };
                }
            }
        }
    }

    fn told(&self, error: &csv::Error) -> String {
        match error.kind() {
            csv::ErrorKind::Utf8 { .. } if self.is_utf16 => "is text in UTF-16; save the table as UTF-8".to_owned(),
            csv::ErrorKind::Utf8 { .. } => "is not UTF-8 text; save the table as UTF-8".to_owned(),
            _ => error.to_string(),
        }
    }
}

/// All up to the end of the second line that has cells.
fn beginning<R: BufRead>(text: &mut Take<R>) -> io::Result<Vec<u8>> {
    let (mut begin, mut lines) = (Vec::new(), 0);
    while lines < 2 {
        let from = begin.len();
        if text.read_until(b'\n', &mut begin)? == 0 {
            break;
        }
        let line = &begin[from..];
        lines += usize::from(!line.starts_with(b"#") && !line.trim_ascii().is_empty());
    }
    Ok(begin)
}

/// A possible cause why a cell is no number, to be appended to the message: a decimal comma.
pub fn comma_remark(cell: &str) -> &'static str {
    match cell.contains(',') && cell.replacen(',', ".", 1).parse::<f64>().is_ok() {
        true => "; write decimal points in place of commas",
        false => "",
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Lines and their cells.
    type Rows = Vec<(u64, Vec<String>)>;

    fn read(text: &[u8]) -> Result<Rows, (u64, String)> {
        let mut table = TextTable::new(text).expect("bytes can be read");
        let (mut row, mut rows) = (StringRecord::new(), Vec::new());
        while let Some(line) = table.next(&mut row)? {
            rows.push((line, row.iter().map(str::to_owned).collect()));
        }
        Ok(rows)
    }

    #[test]
    fn lines_are_those_of_the_file() {
        for end in ["\n", "\r\n"] {
            for last in ["", end] {
                let lines = ["# by hand", "", "t;x", "0;1", "# a pause", "", "1;2", "\"2\";\"3\""];
                let text = lines.join(end) + last;
                let row = |line: u64, cells: [&str; 2]| (line, cells.map(str::to_owned).to_vec());
                let expected = [row(3, ["t", "x"]), row(4, ["0", "1"]), row(7, ["1", "2"]), row(8, ["2", "3"])];
                assert_eq!(read(text.as_bytes()).expect("it is a table"), expected, "{text:?}");
            }
        }
        assert_eq!(read(b"t,x\r0,1\r").expect("it is a table").len(), 2, "carriage returns alone");
        assert_eq!(read("\u{feff}# mark\nt,x\n".as_bytes()).expect("it is a table")[0].1, ["t", "x"]);
        assert!(read(b"").expect("it is empty").is_empty());
    }

    #[test]
    fn what_is_no_table_is_told_with_its_line() {
        assert_eq!(read(b"t,x\r\n0,1\r\n0,1,2\r\n").unwrap_err(), (3, "expected 2 cells, as the heading has, found 3".to_owned()));
        assert_eq!(read(b"t,x\n0,1\n1,\xb5\n").unwrap_err(), (3, "is not UTF-8 text; save the table as UTF-8".to_owned()));
        let utf16: Vec<u8> = "\u{feff}t,x\n0,1\n".encode_utf16().flat_map(u16::to_le_bytes).collect();
        assert_eq!(read(&utf16).unwrap_err(), (1, "is text in UTF-16; save the table as UTF-8".to_owned()));
        assert_eq!((comma_remark("0,5"), comma_remark("a,b")), ("; write decimal points in place of commas", ""));
    }
}
