//! A node in any language: a program that reads a step's inputs from its standard input and writes its outputs to its standard output.
//!
//! Joining a run (shared memory or DDS, lockstep, deadlines, recording, the end) stays here; the program has the [`Core`] alone. First it is given one line
//! of JSON ([`About`]), then a frame for every step, which it answers by one. Frames are packed little-endian numbers, in the order of the ports:
//!
//! - asked: step (u64), time (f64, s); for each input its age in steps (u64), then position, velocity and effort of every axis (f64)
//! - answered: for each output position, velocity and effort of every axis (f64)
//!
//! What was not measured is NaN. Standard error is the run's. The program ends when its standard input does.

use crate::join::{fail, join_run};
use backdrive_control::core::{Core, Events, Port, Tick};
use backdrive_msgs::{NOT_MEASURED, Sample};
use backdrive_nodes::graph::{Graph, Node, StageKind};
use backdrive_nodes::protocol::FromNode;
use serde::Serialize;
use std::io::{BufReader, Read, Write};
use std::path::Path;
use std::process::{Child, ChildStdin, ChildStdout, Command, ExitCode, Stdio};
use std::time::Duration;

/// Exit code of a run whose node failed.
const NODE_FAILED: u8 = 6;
/// Time that a program has to end after its standard input did.
const GRACE: Duration = Duration::from_millis(500);

/// The first line that a program is given.
#[derive(Debug, Serialize)]
pub struct About<'a> {
    /// Version of the frames.
    pub version: u32,
    /// Name of the node.
    pub node: &'a str,
    /// Its kind.
    pub kind: &'a str,
    /// Which stage of the kind; each has a process of its own.
    pub stage: &'a str,
    /// Time of one step, s.
    pub period_s: f64,
    /// Names of the axes.
    pub axes: &'a [String],
    /// Names of the inputs.
    pub inputs: Vec<&'a str>,
    /// Names of the outputs.
    pub outputs: Vec<&'a str>,
    /// The frame of a step, as a format of Python's `struct`.
    pub asked: String,
    /// The frame of its answer.
    pub answered: String,
}

impl<'a> About<'a> {
    fn of(graph: &Graph, node: &'a Node, stage: &'a StageKind) -> About<'a> {
        let numbers = "d".repeat(3 * node.axes);
        About {
            version: 1,
            node: &node.name,
            kind: node.kind.name(),
            stage: stage.name,
            period_s: graph.period_s(),
            axes: &node.axis_names,
            inputs: stage.inputs.iter().map(|port| port.name).collect(),
            outputs: stage.outputs.iter().map(|port| port.name).collect(),
            asked: format!("<Qd{}", format!("Q{numbers}").repeat(stage.inputs.len())),
            answered: format!("<{}", numbers.repeat(stage.outputs.len())),
        }
    }
}

/// Joins a run as a node whose cores are a program, and runs it to its end.
pub fn step_program(words: &[String], run: &Path, name: &str) -> ExitCode {
    let Some((program, arguments)) = words.split_first() else {
        return fail("no program is named: command = [\"backdrive\", \"step\", \"python3\", \"my_node.py\"]".to_string(), 2);
    };
    join_run(run, name, |graph, node| {
        let core = |stage: &StageKind| -> Result<Box<dyn Core>, String> {
            Ok(Box::new(Stepped::start(program, arguments, &About::of(graph, node, stage), node.axes)?))
        };
        node.kind.stages().iter().map(core).collect()
    })
}

/// A program that is stepped.
struct Stepped {
    program: String,
    child: Child,
    asks: Option<ChildStdin>,
    answers: BufReader<ChildStdout>,
    axes: usize,
    frame: Vec<u8>,
    answer: Vec<u8>,
}

impl Stepped {
    fn start(program: &str, arguments: &[String], about: &About, axes: usize) -> Result<Stepped, String> {
        let mut command = Command::new(program);
        command.args(arguments).stdin(Stdio::piped()).stdout(Stdio::piped());
        let mut child = command.spawn().map_err(|e| format!("{program}: cannot be started: {e}"))?;
        let (Some(asks), Some(answers)) = (child.stdin.take(), child.stdout.take()) else {
            return Err(format!("{program}: has no standard input or output"));
        };
        let answer = vec![0; 8 * 3 * axes * about.outputs.len()];
        let frame = Vec::with_capacity(16 + (8 + 24 * axes) * about.inputs.len());
        let mut out =
            Stepped { program: program.to_string(), child, asks: Some(asks), answers: BufReader::new(answers), axes, frame, answer };
        let mut line = serde_json::to_vec(about).map_err(|e| e.to_string())?;
        line.push(b'\n');
        out.ask(&line).map_err(|e| out.ended(&e))?;
        Ok(out)
    }

    fn ask(&mut self, bytes: &[u8]) -> std::io::Result<()> {
        let asks = self.asks.as_mut().ok_or_else(|| std::io::Error::from(std::io::ErrorKind::BrokenPipe))?;
        asks.write_all(bytes)?;
        asks.flush()
    }

    /// Why a program does not answer.
    fn ended(&mut self, error: &std::io::Error) -> String {
        self.asks = None;
        let began = std::time::Instant::now();
        while began.elapsed() < GRACE {
            if let Ok(Some(status)) = self.child.try_wait() {
                return format!("{}: ended before the run did ({status}); see what it wrote to standard error", self.program);
            }
            std::thread::sleep(Duration::from_millis(5));
        }
        format!("{}: does not answer: {error}", self.program)
    }

    fn exchange(&mut self) -> std::io::Result<()> {
        let frame = std::mem::take(&mut self.frame);
        let asked = self.ask(&frame);
        self.frame = frame;
        asked?;
        self.answers.read_exact(&mut self.answer)
    }
}

impl Core for Stepped {
    fn step(&mut self, tick: &Tick, inputs: &[Port], outputs: &mut [Sample], _events: &mut Events) {
        self.frame.clear();
        self.frame.extend(tick.step.to_le_bytes());
        self.frame.extend(tick.time_s.to_le_bytes());
        let nothing = Sample::new(self.axes);
        for port in inputs {
            self.frame.extend(port.age_steps.to_le_bytes());
            let sample = port.sample.as_ref().unwrap_or(&nothing);
            for values in [&sample.position, &sample.velocity, &sample.effort] {
                for axis in 0..self.axes {
                    let value = values.get(axis).copied().filter(|_| axis < sample.len()).unwrap_or(NOT_MEASURED);
                    self.frame.extend(value.to_le_bytes());
                }
            }
        }
        if let Err(error) = self.exchange() {
            // A core cannot fail, and a node without its core must not go on: the supervisor hears why, and ends the run.
            let why = self.ended(&error);
            let _ = self.child.kill();
            let line = serde_json::to_string(&FromNode::Failed { error: why, code: NODE_FAILED }).unwrap_or_default();
            // Past the lock of standard output, which the thread that reports holds.
            let _ = nix::unistd::write(std::io::stdout(), format!("{line}\n").as_bytes());
            std::process::exit(i32::from(NODE_FAILED));
        }
        let mut numbers = self.answer.chunks_exact(8).map(|bytes| f64::from_le_bytes(bytes.try_into().unwrap_or_default()));
        for sample in outputs.iter_mut() {
            for values in [&mut sample.position, &mut sample.velocity, &mut sample.effort] {
                for value in values.iter_mut().take(self.axes) {
                    *value = numbers.next().unwrap_or(NOT_MEASURED);
                }
            }
        }
    }
}

impl Drop for Stepped {
    fn drop(&mut self) {
        // The end of its input is the end of the program; one that goes on is killed.
        self.asks = None;
        let began = std::time::Instant::now();
        while began.elapsed() < GRACE && matches!(self.child.try_wait(), Ok(None)) {
            std::thread::sleep(Duration::from_millis(5));
        }
        let _ = self.child.kill();
        let _ = self.child.wait();
    }
}
