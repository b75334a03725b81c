//! A ring of processes that write to the next one's pipe what they have read from their own.

use super::Result;
use super::children::Process;
use super::stopwatch::{Figures, Stopwatch, warm_up};
use std::fs::File;
use std::io::{Read, Write};
use std::os::fd::AsFd;
use std::process::{ExitCode, Stdio};

/// Passes on messages of `size` bytes until there are no more.
pub fn relay(size: usize) -> Result<ExitCode> {
    // Without the buffers of the standard library.
    let mut input = File::from(std::io::stdin().as_fd().try_clone_to_owned()?);
    let mut output = File::from(std::io::stdout().as_fd().try_clone_to_owned()?);
    let mut bytes = vec![0; size];
    while input.read_exact(&mut bytes).is_ok() {
        output.write_all(&bytes)?;
    }
    Ok(ExitCode::SUCCESS)
}

/// This process and `processes - 1` relays, which are this program with the arguments `pipe SIZE`.
pub fn ring(processes: usize, size: usize, loops: u64) -> Result<Figures> {
    let (mut relays, mut input, size_text) = (Vec::new(), Stdio::piped(), size.to_string());
    let mut last = None;
    for _ in 1..processes {
        relays.push(Process::start(&["pipe", &size_text], input)?);
        let stdout = relays.last_mut().ok_or("no relay")?.take_stdout()?;
        // Handed on to the next relay, or kept if there is none.
        (input, last) = (Stdio::from(stdout.as_fd().try_clone_to_owned()?), Some(stdout));
    }
    let mut first = relays.first_mut().ok_or("a ring has two processes or more")?.take_stdin()?;
    let mut last = last.ok_or("no relay")?;
    drop(input);
    let (mut watch, mut bytes) = (Stopwatch::new(loops), vec![0; size]);
    watch.look();
    for _ in 0..warm_up(loops) + loops {
        first.write_all(&bytes)?;
        last.read_exact(&mut bytes)?;
        watch.look();
    }
    drop(first);
    relays.iter_mut().try_for_each(Process::end)?;
    Ok(watch.figures())
}
