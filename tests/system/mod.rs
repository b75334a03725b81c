//! Whole runs of the program, each in a folder of its own: files, run directories and shared memory of one test are not another's.

#![allow(dead_code)] // each test program uses its own part

#[path = "../common/naming.rs"]
pub mod naming;

use backdrive_bags::Reader;
use backdrive_msgs::{Message, Sample};
use std::fs::File;
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Stdio};
use std::sync::{Mutex, MutexGuard, PoisonError};
use std::time::{Duration, Instant};

pub use naming::assert_names;

/// What Rust writes where a program panics.
pub const PANIC: &str = "panicked";

/// How long anything may take before a test gives up.
pub const PATIENCE: Duration = Duration::from_secs(90);

/// Runs with deadlines go one after the other.
pub fn alone() -> MutexGuard<'static, ()> {
    static ONE: Mutex<()> = Mutex::new(());
    ONE.lock().unwrap_or_else(PoisonError::into_inner)
}

/// A file of the workspace.
pub fn file(path: &str) -> String {
    Path::new(env!("CARGO_MANIFEST_DIR")).join(path).display().to_string()
}

/// A graph file's text, with the files that it names where they are.
pub fn graph_text(path: &str) -> String {
    let text = std::fs::read_to_string(file(path)).unwrap();
    text.replace("\"../plant/", &format!("\"{}/", file("plant")))
}

/// The folder of one test.
pub struct Place {
    folder: tempfile::TempDir,
}

/// A command that has ended.
#[derive(Debug)]
pub struct Ended {
    pub code: Option<i32>,
    pub stdout: String,
    pub stderr: String,
}

impl Ended {
    pub fn json(&self) -> serde_json::Value {
        serde_json::from_str(&self.stdout).unwrap_or_else(|e| panic!("no JSON ({e}): {self:?}"))
    }

    /// It ended with this code, and its messages on standard error name these.
    #[track_caller]
    pub fn ends(&self, code: i32, named: &[&str]) {
        assert_eq!(self.code, Some(code), "{self:?}");
        assert_names(&self.stderr, named);
    }

    /// It ended with this code, and its answer on standard output names these.
    #[track_caller]
    pub fn answers(&self, code: i32, named: &[&str]) {
        assert_eq!(self.code, Some(code), "{self:?}");
        assert_names(&self.stdout, named);
    }
}

/// A process of a run.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Process {
    pub pid: i32,
    pub node: String,
}

impl Place {
    pub fn new() -> Place {
        let folder = tempfile::tempdir().unwrap();
        std::fs::create_dir(folder.path().join("tmp")).unwrap();
        Place { folder }
    }

    pub fn path(&self, name: &str) -> PathBuf {
        self.folder.path().join(name)
    }

    pub fn write(&self, name: &str, text: &str) -> PathBuf {
        let path = self.path(name);
        std::fs::write(&path, text).unwrap();
        path
    }

    /// A command in this folder.
    pub fn command(&self, program: &str) -> Command {
        let mut command = Command::new(program);
        command.current_dir(self.folder.path()).env("TMPDIR", self.path("tmp")).stdin(Stdio::null());
        command
    }

    /// Runs the program to its end.
    pub fn backdrive(&self, arguments: &[&str]) -> Ended {
        let mut command = self.command(env!("CARGO_BIN_EXE_backdrive"));
        command.args(arguments);
        Running::start(self, command).end()
    }

    /// The same for what may take longer.
    pub fn run_for(&self, arguments: &[&str], patience: Duration) -> Ended {
        self.start(arguments).end_within(patience)
    }

    /// Starts the program.
    pub fn start(&self, arguments: &[&str]) -> Running {
        let mut command = self.command(env!("CARGO_BIN_EXE_backdrive"));
        command.args(arguments);
        Running::start(self, command)
    }

    /// Names of the runs that have a directory here.
    pub fn runs(&self) -> Vec<String> {
        let homes = std::fs::read_dir(self.path("tmp")).unwrap().flatten();
        let inside = homes.flat_map(|home| std::fs::read_dir(home.path()).into_iter().flatten().flatten());
        inside.map(|run| run.file_name().to_string_lossy().into_owned()).collect()
    }

    /// The nodes that live in runs of this folder.
    pub fn processes(&self) -> Vec<Process> {
        let tmp = self.path("tmp").display().to_string();
        let mut found = Vec::new();
        for entry in std::fs::read_dir("/proc").unwrap().flatten() {
            let Some(pid) = entry.file_name().to_str().and_then(|name| name.parse().ok()) else { continue };
            let Ok(line) = std::fs::read(entry.path().join("cmdline")) else { continue };
            let words: Vec<String> = line.split(|b| *b == 0).map(|w| String::from_utf8_lossy(w).into_owned()).collect();
            let after = |flag: &str| words.iter().position(|w| w == flag).and_then(|i| words.get(i + 1));
            if after("--run").is_some_and(|run| run.starts_with(&tmp)) {
                found.push(Process { pid, node: after("--name").cloned().unwrap_or_default() });
            }
        }
        found
    }

    /// A node's process.
    pub fn process(&self, node: &str) -> Option<i32> {
        self.processes().into_iter().find(|p| p.node == node).map(|p| p.pid)
    }

    /// Asserts that nothing of these runs is left: no process, no directory, no shared memory.
    pub fn assert_clean(&self, runs: &[String]) {
        until("all processes to be gone", || self.processes().is_empty());
        assert_eq!(self.runs(), Vec::<String>::new(), "run directories");
        for run in runs {
            assert_eq!(shared_memory_of(run), Vec::<PathBuf>::new(), "shared memory of {run}");
        }
    }
}

/// Files of a run in shared memory.
pub fn shared_memory_of(run: &str) -> Vec<PathBuf> {
    let files = std::fs::read_dir("/dev/shm").into_iter().flatten().flatten();
    files.map(|f| f.path()).filter(|f| f.to_string_lossy().contains(&format!("bd{run}_"))).collect()
}

/// A command that runs. Its output goes to files, so that it never waits for a reader.
pub struct Running {
    pub child: Child,
    stdout: PathBuf,
    stderr: PathBuf,
}

impl Running {
    pub fn start(place: &Place, mut command: Command) -> Running {
        static COUNT: std::sync::atomic::AtomicU32 = std::sync::atomic::AtomicU32::new(0);
        let number = COUNT.fetch_add(1, std::sync::atomic::Ordering::SeqCst);
        let (stdout, stderr) = (place.path(&format!("stdout-{number}")), place.path(&format!("stderr-{number}")));
        command.stdout(File::create(&stdout).unwrap()).stderr(File::create(&stderr).unwrap());
        Running { child: command.spawn().unwrap(), stdout, stderr }
    }

    pub fn pid(&self) -> i32 {
        self.child.id() as i32
    }

    /// Waits for its end; kills it where that does not come.
    pub fn end(self) -> Ended {
        self.end_within(PATIENCE)
    }

    /// The same with another patience.
    pub fn end_within(mut self, patience: Duration) -> Ended {
        let begun = Instant::now();
        let status = loop {
            if let Some(status) = self.child.try_wait().unwrap() {
                break status;
            }
            if begun.elapsed() > patience {
                let _ = self.child.kill();
                let _ = self.child.wait();
                panic!("does not end; standard error so far: {}", std::fs::read_to_string(&self.stderr).unwrap_or_default());
            }
            std::thread::sleep(Duration::from_millis(5));
        };
        let read = |path: &Path| String::from_utf8_lossy(&std::fs::read(path).unwrap_or_default()).into_owned();
        Ended { code: status.code(), stdout: read(&self.stdout), stderr: read(&self.stderr) }
    }
}

impl Drop for Running {
    /// A test that fails leaves no run behind.
    fn drop(&mut self) {
        let _ = self.child.kill();
        let _ = self.child.wait();
    }
}

/// Waits until something is so.
pub fn until(what: &str, mut so: impl FnMut() -> bool) {
    let begun = Instant::now();
    while !so() {
        assert!(begun.elapsed() < PATIENCE, "waited in vain for {what}");
        std::thread::sleep(Duration::from_millis(10));
    }
}

/// Waits until a bag that is being written holds this number of messages of a topic.
pub fn until_recorded(bag: &Path, topic: &str, messages: u64) {
    until(&format!("{messages} messages of {topic}"), || {
        Reader::open(bag).is_ok_and(|r| r.topics().iter().zip(r.counts()).any(|(t, count)| t.name == topic && *count >= messages))
    });
}

pub fn kill(pid: i32, signal: nix::sys::signal::Signal) {
    nix::sys::signal::kill(nix::unistd::Pid::from_raw(pid), signal).unwrap();
}

/// Every message of a bag that can be read, with its topic.
pub fn messages(bag: &Path) -> Vec<(String, Message)> {
    let reader = Reader::open(bag).unwrap();
    let entries = reader.messages().unwrap().map_while(Result::ok);
    entries.filter_map(|e| Some((e.topic.name.clone(), e.message(bag).unwrap()?))).collect()
}

/// The samples of a topic.
pub fn samples(bag: &Path, topic: &str) -> Vec<Sample> {
    let all = messages(bag).into_iter().filter(|(name, _)| name == topic);
    all.filter_map(|(_, m)| if let Message::Sample(sample) = m { Some(sample) } else { None }).collect()
}

/// The events of a node: step, kind and value.
pub fn events(bag: &Path, node: &str) -> Vec<(u64, String, f64)> {
    let topic = format!("/{node}/events");
    let all = messages(bag).into_iter().filter(|(name, _)| *name == topic);
    all.filter_map(|(_, m)| if let Message::Event(e) = m { Some((e.step, e.kind.as_str().to_string(), e.value)) } else { None }).collect()
}
