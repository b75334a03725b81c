//! A node that speaks the protocol and behaves as its arguments say. Times are counted from step 0.
//!
//! `lonely` never finds its peers, `mute` never writes a word, `early` ends before it is ready. `crash MS`, `exit MS`, `fail MS` end it in the loop;
//! `once FILE` makes the next of these happen in its first life only. `deaf` does not end when asked, `stubborn` ignores SIGTERM. `chatter N` writes
//! lines, `events N` reports events, `stray` writes what is not of the protocol. `breed` leaves a child that holds its pipes, `steps N` ends it by
//! itself (at 1000 per second), `bag FILE` makes it a recorder.

use backdrive_launch::RunPaths;
use backdrive_nodes::protocol::{FromNode, NodeStatus, ToNode};
use nix::sys::signal::{SigHandler, Signal, signal};
use std::io::{BufRead, Write};
use std::path::{Path, PathBuf};
use std::sync::mpsc;
use std::time::{Duration, Instant};

type Outcome = Result<(), Box<dyn std::error::Error>>;

fn say(words: &FromNode) -> Outcome {
    let mut out = std::io::stdout().lock();
    writeln!(out, "{}", serde_json::to_string(words)?)?;
    out.flush()?;
    Ok(())
}

struct Toy {
    arguments: Vec<String>,
}

impl Toy {
    fn has(&self, name: &str) -> bool {
        self.arguments.iter().any(|a| a == name)
    }

    fn value(&self, name: &str) -> Option<&str> {
        let at = self.arguments.iter().position(|a| a == name)?;
        self.arguments.get(at + 1).map(String::as_str)
    }

    fn number(&self, name: &str) -> Option<u64> {
        self.value(name)?.parse().ok()
    }
}

fn main() -> Outcome {
    let toy = Toy { arguments: std::env::args().skip(1).collect() };
    let name = toy.value("--name").unwrap_or_default().to_string();
    let paths = RunPaths::open(Path::new(toy.value("--run").unwrap_or_default()))?;
    // As the middleware would: something in shared memory and something in the root.
    std::fs::write(format!("/dev/shm/{}{name}.data", paths.prefix()), "x")?;
    std::fs::write(paths.location().root.join(&name), "x")?;
    if toy.has("stubborn") {
        // SAFETY: ignoring a signal runs no code of ours.
        unsafe { signal(Signal::SIGTERM, SigHandler::SigIgn) }?;
    }
    if toy.has("breed") {
        // The directory among its arguments, so that a test finds it.
        std::process::Command::new("sh").args(["-c", "sleep 600; true"]).arg(paths.root()).spawn()?;
    }
    if toy.has("mute") {
        std::thread::sleep(Duration::from_secs(600));
    }
    say(&FromNode::Created)?;
    if toy.has("early") {
        eprintln!("no such device");
        std::process::exit(3);
    }
    if toy.has("lonely") {
        say(&FromNode::Waiting { missing: vec!["/slave/measured_js: no publisher".to_string()] })?;
    } else {
        say(&FromNode::Ready)?;
    }
    let (heard, words) = mpsc::channel();
    std::thread::spawn(move || {
        for line in std::io::stdin().lock().lines().map_while(Result::ok) {
            if let Ok(word) = serde_json::from_str::<ToNode>(&line) {
                let _ = heard.send(word);
            }
        }
    });
    run(&toy, &name, &words)
}

fn run(toy: &Toy, name: &str, words: &mpsc::Receiver<ToNode>) -> Outcome {
    let mut begun: Option<Instant> = None;
    let once = toy.value("once").map(PathBuf::from);
    let spared = once.as_ref().is_some_and(|f| f.exists());
    loop {
        match words.recv_timeout(Duration::from_millis(20)) {
            Ok(ToNode::Start { .. }) => {
                begun = Some(Instant::now());
                for line in 0..toy.number("chatter").unwrap_or(0) {
                    eprintln!("line {line}");
                }
                for step in 0..toy.number("events").unwrap_or(0) {
                    let (kind, text) = ("test".to_string(), format!("event {step}"));
                    say(&FromNode::Event { step, severity: 1, kind, text, value: Some(1.5) })?;
                }
                if toy.has("stray") {
                    println!("hello");
                }
            }
            Ok(ToNode::Gains { mu, lambda, .. }) => {
                let (kind, text) = ("gains".to_string(), format!("{mu} {lambda}"));
                say(&FromNode::Event { step: 0, severity: 0, kind, text, value: None })?;
            }
            Ok(ToNode::Stop) | Err(mpsc::RecvTimeoutError::Disconnected) => {
                if !toy.has("deaf") {
                    return end(toy, name, begun);
                }
                std::thread::sleep(Duration::from_millis(20));
            }
            Ok(ToNode::Canceller { .. } | ToNode::Note(_)) | Err(mpsc::RecvTimeoutError::Timeout) => {}
        }
        let Some(begun) = begun else { continue };
        let told = say(&FromNode::Status(status(toy, Some(begun))));
        if !toy.has("deaf") {
            told?;
        }
        let due = |what: &str| !spared && toy.number(what).is_some_and(|ms| begun.elapsed() >= Duration::from_millis(ms));
        if let (true, Some(once)) = (due("crash") || due("exit") || due("fail"), &once) {
            std::fs::write(once, "")?;
        }
        if due("crash") {
            eprintln!("about to crash");
            std::process::abort();
        }
        if due("exit") {
            std::process::exit(7);
        }
        if due("fail") {
            say(&FromNode::Failed { error: "the encoder is silent".to_string(), code: 5 })?;
            std::process::exit(5);
        }
        if toy.number("steps").is_some_and(|n| status(toy, Some(begun)).steps >= n) {
            return end(toy, name, Some(begun));
        }
    }
}

fn status(toy: &Toy, begun: Option<Instant>) -> NodeStatus {
    let steps = begun.map_or(0, |b| b.elapsed().as_millis() as u64).min(toy.number("steps").unwrap_or(u64::MAX));
    let mut status = NodeStatus { steps, loop_p50_us: 40.0, loop_p99_us: 90.0, peak_effort: 2.5, ..NodeStatus::default() };
    if toy.has("bag") {
        status.recorded = Some((steps, 100 * steps));
    }
    status
}

/// Writes what it knows into the bag, so that a test sees an orderly end.
fn end(toy: &Toy, name: &str, begun: Option<Instant>) -> Outcome {
    if let Some(bag) = toy.value("bag") {
        std::fs::write(bag, format!("{name} finished"))?;
    }
    // There may be no listener any more.
    let _ = say(&FromNode::Done(status(toy, begun)));
    Ok(())
}
