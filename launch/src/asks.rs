//! What may be asked of a run from outside its supervisor: a socket in the run directory, which only its user can reach. One JSON object a line, and
//! one answer for each.

use crate::paths::RunPaths;
use serde::{Deserialize, Serialize};
use std::io::{BufRead, BufReader, Write};
use std::os::unix::fs::PermissionsExt;
use std::os::unix::net::UnixStream;
use std::time::Duration;
use tokio::io::{AsyncBufReadExt, AsyncWriteExt};
use tokio::net::UnixListener;
use tokio::sync::{mpsc, oneshot};

/// Longest text of a remark, bytes: that of an event.
pub const MOST_TEXT: usize = 128;

/// Longest line that is read, bytes.
const MOST_LINE: u64 = 4096;

/// Questions that may wait for the supervisor.
const QUEUE: usize = 64;

/// How long a supervisor may take for an answer; it looks at least every 50 ms.
const PATIENCE: Duration = Duration::from_secs(2);

/// What is asked. `by` names who asks, for the recording.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(tag = "ask", rename_all = "snake_case", deny_unknown_fields)]
pub enum Ask {
    /// Change the gains.
    Gains {
        /// Position scale, no unit.
        mu: f64,
        /// Force scale, no unit.
        lambda: f64,
        /// Ramp, s, not negative.
        ramp_s: f64,
        /// Who asks.
        by: String,
    },
    /// Leave the canceller out of the loop, or take it back.
    Canceller {
        /// Whether it subtracts.
        on: bool,
        /// Time over which it fades, s, not negative.
        ramp_s: f64,
        /// Who asks.
        by: String,
    },
    /// Remove the reflected force, and end the run.
    Stop {
        /// Position scale at which the force is removed; without it the run ends at once.
        mu: Option<f64>,
        /// Who asks.
        by: String,
    },
    /// Put an event into the recording.
    Note {
        /// 0 info, 1 warning, 2 error.
        severity: u32,
        /// Machine-readable name, at most 32 bytes.
        kind: String,
        /// At most [`MOST_TEXT`] bytes are kept.
        text: String,
        /// A number that belongs to it.
        value: Option<f64>,
    },
}

/// Whether it is done, and a sentence.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct Answer {
    /// Whether it is done.
    pub done: bool,
    /// What was done, or why not.
    pub text: String,
}

/// A question, and where its answer goes.
pub(crate) type Asked = (Ask, oneshot::Sender<Answer>);

/// The line to a living run.
pub struct AskLine {
    reader: BufReader<UnixStream>,
}

impl AskLine {
    /// Opens the line to a run.
    ///
    /// # Errors
    /// The run has ended, or is of a version without such a line.
    pub fn open(paths: &RunPaths) -> std::io::Result<AskLine> {
        let stream = UnixStream::connect(paths.asks())?;
        stream.set_read_timeout(Some(PATIENCE))?;
        stream.set_write_timeout(Some(PATIENCE))?;
        Ok(AskLine { reader: BufReader::new(stream) })
    }

    /// Asks, and waits for the answer.
    ///
    /// # Errors
    /// The run has ended meanwhile, or gives no answer within 2 s.
    pub fn ask(&mut self, ask: &Ask) -> std::io::Result<Answer> {
        let mut line = serde_json::to_string(ask)?;
        line.push('\n');
        self.reader.get_mut().write_all(line.as_bytes())?;
        let mut answer = String::new();
        match self.reader.read_line(&mut answer)? {
            0 => Err(std::io::Error::new(std::io::ErrorKind::UnexpectedEof, "the run has ended")),
            _ => Ok(serde_json::from_str(&answer)?),
        }
    }
}

/// Listens in the run directory; `None`, with the reason, where that cannot be done: then nothing can be asked of the run.
pub(crate) fn listen(paths: &RunPaths) -> Result<mpsc::Receiver<Asked>, String> {
    let path = paths.asks();
    let listener = UnixListener::bind(&path).map_err(|e| format!("{}: {e}", path.display()))?;
    // The directory is closed to others already.
    std::fs::set_permissions(&path, std::fs::Permissions::from_mode(0o600)).map_err(|e| format!("{}: {e}", path.display()))?;
    let (asked, asks) = mpsc::channel(QUEUE);
    tokio::spawn(async move {
        while let Ok((stream, _)) = listener.accept().await {
            let asked = asked.clone();
            tokio::spawn(serve(stream, asked));
        }
    });
    Ok(asks)
}

async fn serve(stream: tokio::net::UnixStream, asked: mpsc::Sender<Asked>) {
    let (reader, mut writer) = stream.into_split();
    let mut reader = tokio::io::BufReader::new(reader);
    loop {
        let mut line = Vec::new();
        let mut limited = tokio::io::AsyncReadExt::take(&mut reader, MOST_LINE);
        match limited.read_until(b'\n', &mut line).await {
            Ok(0) | Err(_) => return,
            Ok(_) if line.last() != Some(&b'\n') => return,
            Ok(_) => {}
        }
        let answer = match serde_json::from_slice::<Ask>(&line) {
            Err(e) => Answer { done: false, text: format!("not understood: {e}") },
            Ok(ask) => {
                let (reply, answer) = oneshot::channel();
                if asked.send((ask, reply)).await.is_err() {
                    return;
                }
                answer.await.unwrap_or(Answer { done: false, text: "the run ends".to_string() })
            }
        };
        let Ok(mut text) = serde_json::to_vec(&answer) else { return };
        text.push(b'\n');
        if writer.write_all(&text).await.is_err() {
            return;
        }
    }
}
