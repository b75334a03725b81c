//! One process: started, heard, and always reaped. A process that has ended but is not reaped keeps its
//! locks, and the middleware takes it for alive.

use crate::error::LaunchError;
use backdrive_nodes::protocol::{FromNode, ToNode};
use nix::sys::prctl::set_pdeathsig;
use nix::sys::signal::{Signal, killpg};
use nix::unistd::{Pid, getpid, getppid};
use std::os::unix::process::ExitStatusExt;
use std::process::{ExitStatus, Stdio};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::Duration;
use tokio::io::{AsyncBufReadExt, AsyncRead, AsyncWriteExt, BufReader};
use tokio::process::{Child as Process, ChildStdin, Command};
use tokio::sync::mpsc;
use tokio::task::JoinHandle;

/// Longest line that is heard whole, bytes; the rest of a longer one is dropped.
const LONGEST_LINE: usize = 64 << 10;

/// How long the pipes of a process that has ended are read on. They stay open longer if it left children.
const LAST_WORDS: Duration = Duration::from_secs(1);

/// What is heard of a process.
#[derive(Debug)]
pub(crate) enum Heard {
    /// A message of the protocol.
    Said(FromNode),
    /// A line on standard output that is none.
    Stray(String),
    /// A line on standard error.
    Wrote(String),
    /// It is gone, and reaped. The last that is heard.
    Ended(End),
}

/// A [`Heard`], and of whom.
#[derive(Debug)]
pub(crate) struct Notice {
    /// Index of the node.
    pub node: usize,
    /// Which of its lives: a late message of a dead process is not its successor's.
    pub life: u32,
    /// What was heard.
    pub heard: Heard,
}

/// How a process ended.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct End {
    /// Exit code, if it had one.
    pub code: Option<i32>,
    /// Signal, if one killed it.
    pub signal: Option<i32>,
}

impl End {
    fn of(status: std::io::Result<ExitStatus>) -> End {
        status.map_or(End { code: None, signal: None }, |s| End { code: s.code(), signal: s.signal() })
    }

    /// Such as `ended with exit code 3`.
    pub fn words(self) -> String {
        match (self.code, self.signal) {
            (Some(0), _) => "ended without saying that it was done".to_string(),
            (Some(code), _) => format!("ended with exit code {code}"),
            (None, Some(number)) => {
                let signal = Signal::try_from(number).ok();
                let name = signal.map(|s| format!(" ({})", s.as_str())).unwrap_or_default();
                let hint = match signal {
                    Some(Signal::SIGBUS) => "; /dev/shm may be full",
                    Some(Signal::SIGKILL) => "; if it was not killed by a user, the machine ran out of memory",
                    _ => "",
                };
                format!("was killed by signal {number}{name}{hint}")
            }
            (None, None) => "has ended, and the system does not report how".to_string(),
        }
    }
}

/// A process that was started.
pub(crate) struct Child {
    pid: Pid,
    // False from the moment it is reaped: its id may be another's then.
    alive: Arc<AtomicBool>,
    to: mpsc::Sender<String>,
    task: JoinHandle<()>,
}

/// What to start.
pub(crate) struct Spawn<'a> {
    /// Name of the node.
    pub name: &'a str,
    /// Index of the node.
    pub node: usize,
    /// Which of its lives.
    pub life: u32,
    /// Program and arguments.
    pub argv: &'a [String],
    /// What it gets when the supervisor dies, however that dies.
    pub orphaned: Signal,
}

impl Child {
    /// Starts it. It is in a process group of its own, so that Ctrl-C on the terminal reaches the supervisor alone, and
    /// dies with the thread that calls this.
    pub fn spawn(spawn: &Spawn<'_>, notices: mpsc::Sender<Notice>) -> Result<Child, LaunchError> {
        let failed = |program: &str, reason: &dyn std::fmt::Display| LaunchError::Spawn {
            node: spawn.name.to_string(),
            program: program.to_string(),
            reason: reason.to_string(),
        };
        let (program, arguments) = spawn.argv.split_first().ok_or_else(|| failed("", &"no program is named"))?;
        let mut command = Command::new(program);
        command.args(arguments).stdin(Stdio::piped()).stdout(Stdio::piped()).stderr(Stdio::piped()).process_group(0).kill_on_drop(true);
        let (supervisor, orphaned) = (getpid(), spawn.orphaned);
        // SAFETY: between fork and exec the closure only makes two system calls, and allocates nothing.
        unsafe {
            command.pre_exec(move || {
                set_pdeathsig(orphaned)?;
                // The supervisor may have died before the line above.
                if getppid() == supervisor { Ok(()) } else { Err(std::io::Error::from_raw_os_error(nix::libc::ESRCH)) }
            });
        }
        let mut process = command.spawn().map_err(|e| failed(program, &e))?;
        let pipes = (process.stdin.take(), process.stdout.take(), process.stderr.take(), process.id());
        let (Some(stdin), Some(stdout), Some(stderr), Some(id)) = pipes else { return Err(failed(program, &"it has no pipes")) };
        let pid = Pid::from_raw(id as i32);
        let alive = Arc::new(AtomicBool::new(true));
        let (to, lines) = mpsc::channel(64);
        tokio::spawn(speak(stdin, lines));
        let ear = Ear { node: spawn.node, life: spawn.life, notices };
        let task = tokio::spawn(attend(process, pid, Arc::clone(&alive), stdout, stderr, ear));
        Ok(Child { pid, alive, to, task })
    }

    /// Its process id.
    pub fn pid(&self) -> i32 {
        self.pid.as_raw()
    }

    /// Sends it words. One that does not listen is not waited for.
    pub fn tell(&self, words: &ToNode) {
        if let Ok(line) = serde_json::to_string(words) {
            let _ = self.to.try_send(line + "\n");
        }
    }

    /// Sends a signal to it and to what it has started.
    pub fn signal(&self, signal: Signal) {
        if self.alive.load(Ordering::SeqCst) {
            let _ = killpg(self.pid, signal);
        }
    }

    /// Kills it if it still lives, and waits until it is reaped.
    pub async fn end(mut self) {
        self.signal(Signal::SIGKILL);
        let _ = (&mut self.task).await;
    }
}

/// Writes lines to a process until it is gone or there is nothing left to send.
async fn speak(mut stdin: ChildStdin, mut lines: mpsc::Receiver<String>) {
    while let Some(line) = lines.recv().await {
        if stdin.write_all(line.as_bytes()).await.is_err() {
            return;
        }
    }
}

struct Ear {
    node: usize,
    life: u32,
    notices: mpsc::Sender<Notice>,
}

impl Ear {
    async fn tell(&self, heard: Heard) {
        // There is no listener any more when the supervisor has given up; the pipes are read on nevertheless.
        let _ = self.notices.send(Notice { node: self.node, life: self.life, heard }).await;
    }
}

async fn attend(
    mut process: Process,
    pid: Pid,
    alive: Arc<AtomicBool>,
    stdout: impl AsyncRead + Unpin,
    stderr: impl AsyncRead + Unpin,
    ear: Ear,
) {
    let said = async {
        let mut lines = Lines::new(stdout);
        while let Some(line) = lines.next().await {
            match serde_json::from_str(&line) {
                Ok(message) => ear.tell(Heard::Said(message)).await,
                Err(_) => ear.tell(Heard::Stray(line)).await,
            }
        }
    };
    let wrote = async {
        let mut lines = Lines::new(stderr);
        while let Some(line) = lines.next().await {
            ear.tell(Heard::Wrote(line)).await;
        }
    };
    let hearing = async { tokio::join!(said, wrote) };
    tokio::pin!(hearing);
    let mut deaf = false;
    let status = loop {
        tokio::select! {
            status = process.wait() => break status,
            _ = &mut hearing, if !deaf => deaf = true,
        }
    };
    alive.store(false, Ordering::SeqCst);
    if !deaf && tokio::time::timeout(LAST_WORDS, &mut hearing).await.is_err() {
        // What it has started still holds its pipes, and so its group: the id is not reused yet.
        let _ = killpg(pid, Signal::SIGKILL);
        let _ = tokio::time::timeout(LAST_WORDS, &mut hearing).await;
    }
    ear.tell(Heard::Ended(End::of(status))).await;
}

/// Lines of any bytes: what is no UTF-8 is replaced, control characters and the excess of long lines are dropped.
struct Lines<R> {
    reader: BufReader<R>,
}

impl<R: AsyncRead + Unpin> Lines<R> {
    fn new(reader: R) -> Lines<R> {
        Lines { reader: BufReader::new(reader) }
    }

    async fn next(&mut self) -> Option<String> {
        let mut line = Vec::new();
        loop {
            let read = self.reader.fill_buf().await.unwrap_or_default();
            if read.is_empty() {
                return (!line.is_empty()).then(|| clean(&line));
            }
            let end = read.iter().position(|&b| b == b'\n');
            let text = &read[..end.unwrap_or(read.len())];
            line.extend_from_slice(&text[..text.len().min(LONGEST_LINE - line.len())]);
            let used = end.map_or(read.len(), |e| e + 1);
            self.reader.consume(used);
            if end.is_some() {
                return Some(clean(&line));
            }
        }
    }
}

/// Colours are kept; what moves the cursor by itself is not, for it would spoil the status line.
fn clean(bytes: &[u8]) -> String {
    String::from_utf8_lossy(bytes).chars().filter(|c| !c.is_control() || matches!(c, '\t' | '\u{1b}')).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[tokio::test]
    async fn lines_of_any_bytes() {
        let long = "x".repeat(LONGEST_LINE + 5);
        let bytes = [b"one\r\n\n\xff two\n".as_slice(), long.as_bytes(), b"\nlast"].concat();
        let mut lines = Lines::new(bytes.as_slice());
        assert_eq!(lines.next().await.as_deref(), Some("one"));
        assert_eq!(lines.next().await.as_deref(), Some(""));
        assert_eq!(lines.next().await.as_deref(), Some("\u{fffd} two"));
        assert_eq!(lines.next().await.map(|l| l.len()), Some(LONGEST_LINE));
        assert_eq!(lines.next().await.as_deref(), Some("last"));
        assert_eq!(lines.next().await, None);
    }

    #[test]
    fn says_how_it_ended() {
        assert_eq!(End { code: Some(3), signal: None }.words(), "ended with exit code 3");
        assert_eq!(End { code: None, signal: Some(11) }.words(), "was killed by signal 11 (SIGSEGV)");
        assert!(End { code: None, signal: Some(7) }.words().contains("/dev/shm"));
    }
}
