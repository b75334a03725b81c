//! The outermost layer of an MCAP file, read so that the place of every record is known and a file may end anywhere.

use crate::BagError;
use backdrive_plant::input_file;
use mcap::records::op;
use std::fs::File;
use std::io::{BufReader, Read, Seek, SeekFrom};
use std::path::{Path, PathBuf};

/// Op code and length.
const PREFIX: u64 = 9;

/// Where a record stands.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct Frame {
    /// Byte in the file at which it starts, its op code included.
    pub(crate) offset: u64,
    /// What it is.
    pub(crate) opcode: u8,
    /// Bytes of its body that are in the file.
    pub(crate) len: u64,
    /// Whether the file ends before the record does. It is then the last one.
    pub(crate) cut: bool,
}

/// Walks over the records of a file.
pub(crate) struct Frames {
    path: PathBuf,
    file: BufReader<File>,
    size: u64,
    /// Where the next record starts.
    next: u64,
    /// Where the reader stands.
    at: u64,
    done: bool,
    /// Footer and closing magic were met.
    pub(crate) closed: bool,
}

impl Frames {
    /// Errors: it cannot be read, or is no MCAP file.
    pub(crate) fn open(path: &Path) -> Result<Frames, BagError> {
        let file = input_file::open(path).map_err(BagError::io(path))?;
        let size = file.metadata().map_err(BagError::io(path))?.len();
        let mut file = BufReader::with_capacity(1 << 16, file);
        let mut magic = [0; mcap::MAGIC.len()];
        let not_mcap = || BagError::NotMcap { path: path.to_owned() };
        if size < magic.len() as u64 {
            return Err(not_mcap());
        }
        file.read_exact(&mut magic).map_err(BagError::io(path))?;
        if magic != mcap::MAGIC {
            return Err(not_mcap());
        }
        let at = magic.len() as u64;
        Ok(Frames { path: path.to_owned(), file, size, next: at, at, done: false, closed: false })
    }

    /// The next record, whose body may then be asked for; `None` at the end, wherever that is.
    pub(crate) fn next(&mut self) -> Result<Option<Frame>, BagError> {
        if self.done {
            return Ok(None);
        }
        let offset = self.next;
        let left = self.size.saturating_sub(offset);
        if left < PREFIX {
            self.done = true;
            return Ok(None);
        }
        self.seek(offset)?;
        let mut prefix = [0; PREFIX as usize];
        self.fill(&mut prefix)?;
        let [opcode, length @ ..] = prefix;
        let length = u64::from_le_bytes(length);
        let cut = length > left - PREFIX;
        let frame = Frame { offset, opcode, len: length.min(left - PREFIX), cut };
        self.next = offset + PREFIX + frame.len;
        if opcode == op::FOOTER && !cut {
            self.done = true;
            let mut magic = [0; mcap::MAGIC.len()];
            if self.size - self.next >= magic.len() as u64 {
                self.seek(self.next)?;
                self.fill(&mut magic)?;
                self.closed = magic == mcap::MAGIC;
            }
        } else if cut {
            self.done = true;
        }
        Ok(Some(frame))
    }

    /// The body of a record, up to the end of the file.
    pub(crate) fn body(&mut self, frame: &Frame) -> Result<Vec<u8>, BagError> {
        self.seek(frame.offset + PREFIX)?;
        let mut body = vec![0; frame.len as usize];
        self.fill(&mut body)?;
        Ok(body)
    }

    fn seek(&mut self, to: u64) -> Result<(), BagError> {
        if to != self.at {
            let relative = to as i64 - self.at as i64; // keeps the buffer when it can
            self.file
                .seek_relative(relative)
                .or_else(|_| self.file.seek(SeekFrom::Start(to)).map(|_| ()))
                .map_err(BagError::io(&self.path))?;
            self.at = to;
        }
        Ok(())
    }

    fn fill(&mut self, bytes: &mut [u8]) -> Result<(), BagError> {
        self.file.read_exact(bytes).map_err(BagError::io(&self.path))?;
        self.at += bytes.len() as u64;
        Ok(())
    }
}
