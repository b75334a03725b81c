//! Processes of this program that end with it, also where it is interrupted from the keyboard.

use super::Result;
use nix::sys::signal::{SigSet, Signal, kill};
use nix::unistd::Pid;
use std::io::{BufRead, BufReader, Write};
use std::process::{Child, ChildStdin, ChildStdout, Command, Stdio};
use std::sync::{Mutex, MutexGuard, PoisonError};

/// Those that were started and have not been waited for, and whether a signal came.
static RUNNING: Mutex<(Vec<Pid>, bool)> = Mutex::new((Vec::new(), false));

fn running() -> MutexGuard<'static, (Vec<Pid>, bool)> {
    RUNNING.lock().unwrap_or_else(PoisonError::into_inner)
}

/// From here on SIGINT, SIGTERM and SIGHUP end the children. Whoever waits for one of them then gets an error, and what it has
/// made is removed on the way out of `main`. To be called before any other thread is started.
pub fn end_with_signals() -> Result<()> {
    let signals: SigSet = [Signal::SIGINT, Signal::SIGTERM, Signal::SIGHUP].into_iter().collect();
    signals.thread_block()?;
    std::thread::spawn(move || {
        while signals.wait().is_ok() {
            let mut running = running();
            running.1 = true;
            for pid in &running.0 {
                // One that is gone already has not been waited for, so that its number still belongs to it.
                let _ = kill(*pid, Signal::SIGKILL);
            }
        }
    });
    Ok(())
}

/// Whether one of those signals came: what failed since then failed because of it.
pub fn interrupted() -> bool {
    running().1
}

/// A process of this program to which one may talk; killed where it is dropped before it has ended.
pub struct Process {
    child: Child,
    stdin: Option<ChildStdin>,
    stdout: Option<BufReader<ChildStdout>>,
    ended: bool,
}

impl Process {
    /// Runs this program with `args`; `input` is its standard input.
    pub fn start(args: &[&str], input: Stdio) -> Result<Process> {
        let mut running = running();
        if running.1 {
            return Err("interrupted".into());
        }
        let mut child = Command::new(std::env::current_exe()?).args(args).stdin(input).stdout(Stdio::piped()).spawn()?;
        running.0.push(Pid::from_raw(child.id() as i32));
        let (stdin, stdout) = (child.stdin.take(), child.stdout.take().map(BufReader::new));
        Ok(Process { child, stdin, stdout, ended: false })
    }

    /// Its standard input, where that is a pipe from here.
    pub fn take_stdin(&mut self) -> Result<ChildStdin> {
        self.stdin.take().ok_or_else(|| "standard input is not piped".into())
    }

    /// Its standard output, of which nothing may have been read.
    pub fn take_stdout(&mut self) -> Result<ChildStdout> {
        self.stdout.take().map(BufReader::into_inner).ok_or_else(|| "standard output is taken".into())
    }

    /// The next line of its output, without its end; empty after the last.
    pub fn line(&mut self) -> Result<String> {
        let mut line = String::new();
        self.stdout.as_mut().ok_or("standard output is taken")?.read_line(&mut line)?;
        Ok(line.trim_end().to_string())
    }

    pub fn say(&mut self, line: &str) -> Result<()> {
        Ok(writeln!(self.stdin.as_mut().ok_or("standard input is not piped")?, "{line}")?)
    }

    /// Closes its standard input and waits for its end.
    pub fn end(&mut self) -> Result<()> {
        self.stdin = None;
        self.wait()
    }

    /// Waits for its end.
    pub fn wait(&mut self) -> Result<()> {
        let status = self.child.wait();
        self.forget();
        match status? {
            status if status.success() => Ok(()),
            status => Err(format!("a process of the ring ended with {status}").into()),
        }
    }

    fn forget(&mut self) {
        self.ended = true;
        let pid = Pid::from_raw(self.child.id() as i32);
        running().0.retain(|p| *p != pid);
    }
}

impl Drop for Process {
    fn drop(&mut self) {
        if !self.ended {
            let _ = self.child.kill();
            let _ = self.child.wait();
            self.forget();
        }
    }
}
