//! The hidden plant in a process of its own, the only one that reads the truth before the verdict, and the other end of its pipes.
//!
//! The process first writes one line, [`GREETING`] and how many axes the device has. Then it reads, for every sample, a force
//! and a hand's position of every axis (all forces first; f64, little endian) and answers with a [`Reading`] of every axis (its
//! fields in their order). The first sample is where the hand starts, and its force is not used; with every further one the
//! device moves on by one period. It ends when its input ends.

use crate::master::{Reading, SealedMaster};
use std::io::{self, BufRead, BufReader, Read, Write};
use std::process::{Child, ChildStdin, ChildStdout, Command, Stdio};

/// The process's first output; the number is the version of the protocol.
pub const GREETING: &str = "backdrive-sealed 1";

/// A device of more axes than this is a mistake of the other end.
const AXES_AT_MOST: usize = 64;

/// Bytes of a number.
const NUMBER: usize = 8;

/// Numbers of a [`Reading`].
const FIELDS: usize = 4;

/// Serves a device until `input` ends.
///
/// # Errors
///
/// Input or output fails, ends in the middle of a sample, or carries what is not a finite number.
pub fn serve(mut master: SealedMaster, mut input: impl Read, mut output: impl Write) -> io::Result<()> {
    let axes = master.axes();
    writeln!(output, "{GREETING} {axes}")?;
    output.flush()?;
    let mut asked = vec![0; 2 * axes * NUMBER];
    let mut answer = Vec::with_capacity(FIELDS * axes * NUMBER);
    let mut values = vec![0.0; 2 * axes];
    let mut is_started = false;
    while fill(&mut input, &mut asked)? {
        for (value, bytes) in values.iter_mut().zip(asked.chunks_exact(NUMBER)) {
            *value = number(bytes);
        }
        let (force, hand) = values.split_at(axes);
        let moved = if is_started { master.step(force, hand) } else { master.start(hand) };
        moved.map_err(|error| io::Error::new(io::ErrorKind::InvalidData, error))?;
        is_started = true;
        answer.clear();
        for reading in (0..axes).filter_map(|axis| master.reading(axis)) {
            for value in [reading.measured, reading.position, reading.velocity, reading.force] {
                answer.extend_from_slice(&value.to_le_bytes());
            }
        }
        output.write_all(&answer)?;
        output.flush()?;
    }
    Ok(())
}

/// Fills the buffer; `false` where the input ended before its first byte.
fn fill(input: &mut impl Read, buffer: &mut [u8]) -> io::Result<bool> {
    let mut filled = 0;
    while filled < buffer.len() {
        match input.read(&mut buffer[filled..]) {
            Ok(0) if filled == 0 => return Ok(false),
            Ok(0) => return Err(io::ErrorKind::UnexpectedEof.into()),
            Ok(count) => filled += count,
            Err(error) if error.kind() == io::ErrorKind::Interrupted => {}
            Err(error) => return Err(error),
        }
    }
    Ok(true)
}

fn number(bytes: &[u8]) -> f64 {
    let mut eight = [0; NUMBER];
    eight.copy_from_slice(bytes);
    f64::from_le_bytes(eight)
}

/// Why the other process does not answer.
#[derive(Debug, thiserror::Error)]
pub enum RemoteError {
    /// It cannot be started.
    #[error("the hidden plant \"{program}\" cannot be started: {error}")]
    Start {
        /// The program.
        program: String,
        /// The system's message.
        error: io::Error,
    },
    /// Its first output was something else. Why it ended stands in its own error output.
    #[error("the hidden plant started with \"{0}\" instead of the expected line; see its error output")]
    Greeting(String),
    /// It ended or a pipe broke.
    #[error("the hidden plant does not answer any more: {0}")]
    Pipe(#[from] io::Error),
}

/// The hidden plant of another process, as its driver sees it.
pub struct RemoteMaster {
    child: Child,
    /// `None` once the process has been asked to end.
    input: Option<ChildStdin>,
    output: BufReader<ChildStdout>,
    asked: Vec<u8>,
    answer: Vec<u8>,
    readings: Vec<Reading>,
}

impl RemoteMaster {
    /// Starts the process; `command` is the program with its arguments. Its error output stays where the command sends it.
    ///
    /// # Errors
    ///
    /// [`RemoteError`].
    pub fn start_process(mut command: Command) -> Result<RemoteMaster, RemoteError> {
        let program = command.get_program().to_string_lossy().into_owned();
        let mut child =
            command.stdin(Stdio::piped()).stdout(Stdio::piped()).spawn().map_err(|error| RemoteError::Start { program, error })?;
        let (Some(input), Some(output)) = (child.stdin.take(), child.stdout.take()) else {
            return Err(RemoteError::Pipe(io::ErrorKind::BrokenPipe.into()));
        };
        let mut master = RemoteMaster {
            child,
            input: Some(input),
            output: BufReader::new(output),
            asked: Vec::new(),
            answer: Vec::new(),
            readings: Vec::new(),
        };
        let mut greeting = String::new();
        (&mut master.output).take(256).read_line(&mut greeting)?;
        let greeting = greeting.trim_end();
        let axes: Option<usize> = greeting.strip_prefix(GREETING).and_then(|rest| rest.trim().parse().ok());
        let Some(axes) = axes.filter(|axes| (1..=AXES_AT_MOST).contains(axes)) else {
            return Err(RemoteError::Greeting(greeting.to_string()));
        };
        let nothing = Reading { measured: f64::NAN, position: f64::NAN, velocity: f64::NAN, force: f64::NAN };
        master.readings = vec![nothing; axes];
        master.answer = vec![0; FIELDS * axes * NUMBER];
        Ok(master)
    }

    /// How many axes it has.
    pub fn axes(&self) -> usize {
        self.readings.len()
    }

    /// One sample, as [`SealedMaster::step`]; the first one as [`SealedMaster::start`]. Every axis at that sample.
    ///
    /// # Errors
    ///
    /// [`RemoteError::Pipe`].
    pub fn step(&mut self, force: &[f64], hand: &[f64]) -> Result<&[Reading], RemoteError> {
        self.asked.clear();
        for values in [force, hand] {
            for axis in 0..self.readings.len() {
                self.asked.extend_from_slice(&values.get(axis).copied().unwrap_or(0.0).to_le_bytes());
            }
        }
        let input = self.input.as_mut().ok_or(io::Error::from(io::ErrorKind::BrokenPipe))?;
        input.write_all(&self.asked)?;
        input.flush()?;
        self.output.read_exact(&mut self.answer)?;
        for (reading, bytes) in self.readings.iter_mut().zip(self.answer.chunks_exact(FIELDS * NUMBER)) {
            let mut fields = bytes.chunks_exact(NUMBER).map(number);
            let mut next = || fields.next().unwrap_or(f64::NAN);
            *reading = Reading { measured: next(), position: next(), velocity: next(), force: next() };
        }
        Ok(&self.readings)
    }
}

impl Drop for RemoteMaster {
    /// Ends the process and waits for it.
    fn drop(&mut self) {
        drop(self.input.take());
        // Its input has ended, so it ends; there is no receiver for its status.
        let _ = self.child.wait();
    }
}
