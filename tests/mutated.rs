//! Files that are damaged at random, through every verb that reads them: an answer or an error with a documented exit code, within seconds
//! and a gigabyte, and never a panic. BACKDRIVE_LONG=1 tries 800 of them.

#[path = "common/mutation.rs"]
mod mutation;
mod system;

use mutation::mutate;
use nix::sys::resource::{Resource, setrlimit};
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;
use std::os::unix::process::CommandExt;
use std::path::Path;
use std::process::Stdio;
use std::sync::Mutex;
use std::sync::atomic::{AtomicUsize, Ordering};
use std::time::{Duration, Instant};
use system::{Place, file, graph_text};

/// Processor time that a verb may take, s: another program on the machine must not fail this test.
const SECONDS: u64 = 10;
/// Wall-clock time that one may take where it waits for something that never comes.
const PATIENCE: Duration = Duration::from_secs(90);
/// Address space, which stacks of threads take without using it, bytes.
const ADDRESSES: u64 = 8 << 30;
/// Memory in use, KiB.
const MOST_KIB: u64 = 1 << 20;

const EXCITATION: &str = "sweep:amplitude=1,from=1,to=20,duration=0.2";

/// Which topic of a bag of ours is which.
const ROLES: &str = r#"axes = ["x"]

[signals]
x_m = "/master/measured_js.position[0]"
F_f = { topic = "/master/servo_jf", field = "effort[0]", scale = 1.0, offset = 0.0 }
x_c = "/slave/servo_jp.position[0]"
F_s = { topic = "/slave/measured_js", field = "effort[0]", hold = "zero" }

[gains]
mu = 1.0
lambda = 0.3

[resample]
rate_hz = 1000
"#;

/// A kind of file: its name, what is in it, and the verbs that read it, in which FILE stands for it.
struct Kind {
    name: &'static str,
    whole: Vec<u8>,
    verbs: Vec<Vec<String>>,
}

fn kinds(place: &Place) -> Vec<Kind> {
    let model = file("plant/models/impulse-engine.toml");
    let rigid = file("plant/models/rigid-mass.toml");
    let done = place.backdrive(&["run", &file("launch/contact.toml"), "--transport", "inproc", "--duration", "0.4", "--bag", "whole.mcap"]);
    assert!(done.code.is_some_and(|code| code < 8) && place.path("whole.mcap").exists(), "{done:?}");
    let done = place.backdrive(&["simulate", &rigid, EXCITATION, "--rate", "1000", "--noise", "1", "--out", "whole.csv"]);
    assert_eq!(done.code, Some(0), "{done:?}");
    let whole = place.path("whole.mcap").display().to_string();
    let table = place.path("whole.csv").display().to_string();
    let set =
        format!("model = \"{rigid}\"\nfit = [\"{table}\"]\nheld_out = []\n[columns]\nfeedback_force = {{ column = \"feedback_force\" }}\n");
    let read = |path: &str| std::fs::read(path).unwrap();
    let verbs = |all: &[&[&str]]| all.iter().map(|v| v.iter().map(|w| w.to_string()).collect()).collect();
    let name = |name, whole, all: &[&[&str]]| Kind { name, whole, verbs: verbs(all) };
    vec![
        name(
            "model.toml",
            read(&model),
            &[
                &["model", "check", "FILE"],
                &["model", "show", "FILE"],
                &["simulate", "FILE", EXCITATION, "--rate", "1000", "--out", "out.csv"],
            ],
        ),
        name(
            "rigid.toml",
            read(&rigid),
            &[&["fit", "FILE", &table, "--patience", "0.2"], &["diagnose", &table, "--model", "FILE", "--patience", "0.2", "--out", "out"]],
        ),
        name(
            "grip.toml",
            read(&file("plant/grips/normal.toml")),
            &[&["model", "check", "FILE"], &["simulate", &rigid, EXCITATION, "--rate", "1000", "--grip", "FILE", "--out", "out.csv"]],
        ),
        name(
            "graph.toml",
            graph_text("launch/contact.toml").into_bytes(),
            &[
                &["check", "FILE"],
                &["graph", "FILE"],
                &["run", "FILE", "--transport", "inproc", "--clock", "lockstep", "--duration", "0.02", "--bag", "out.mcap"],
            ],
        ),
        name("set.toml", set.into_bytes(), &[&["fit", &rigid, "FILE", "--patience", "0.2"], &["simulate", &rigid, "FILE", "--out", "out"]]),
        name(
            "table.csv",
            read(&table),
            &[
                &["bag", "import", "FILE", "--bag", "out.mcap"],
                &["fit", &rigid, "FILE", "--patience", "0.2"],
                &["diagnose", "FILE", "--model", &rigid, "--patience", "0.2", "--out", "out"],
                &["simulate", &rigid, "FILE", "--out", "out.csv"],
            ],
        ),
        name("roles.toml", ROLES.as_bytes().to_vec(), &[&["stability", &whole, "--roles", "FILE", "--gain", "0.1", "--grips", "1"]]),
        name(
            "bag.mcap",
            read(&whole),
            &[
                &["bag", "info", "FILE"],
                &["bag", "export", "FILE", "--csv", "out.csv"],
                &["bag", "recover", "FILE", "--bag", "out.mcap"],
                &["bag", "diff", "FILE", &whole],
                &["replay", "FILE", "--duration", "0.02"],
                &["stability", "FILE", "--gain", "0.1", "--grips", "1"],
            ],
        ),
    ]
}

/// Peak of the memory in use, KiB, of a process that lives.
fn peak_kib(pid: u32) -> u64 {
    let status = std::fs::read_to_string(format!("/proc/{pid}/status")).unwrap_or_default();
    let line = status.lines().find_map(|l| l.strip_prefix("VmHWM:")).unwrap_or("");
    line.trim().trim_end_matches("kB").trim().parse().unwrap_or(0)
}

/// How a verb takes a file: its exit code, or what is wrong with its end.
fn taken(place: &Place, folder: &Path, verb: &[String]) -> Result<i32, String> {
    let mut command = place.command(env!("CARGO_BIN_EXE_backdrive"));
    let log = folder.join("stderr");
    command.args(verb).current_dir(folder).stdin(Stdio::null()).stdout(Stdio::null()).stderr(std::fs::File::create(&log).unwrap());
    // SAFETY: two system calls between fork and exec.
    unsafe {
        command.pre_exec(|| {
            setrlimit(Resource::RLIMIT_AS, ADDRESSES, ADDRESSES)?;
            setrlimit(Resource::RLIMIT_CPU, SECONDS, SECONDS)?;
            Ok(())
        });
    }
    let (mut child, began, mut peak) = (command.spawn().unwrap(), Instant::now(), 0);
    let status = loop {
        peak = peak.max(peak_kib(child.id()));
        if let Some(status) = child.try_wait().unwrap() {
            break status;
        }
        if began.elapsed() > PATIENCE {
            let _ = child.kill();
            let _ = child.wait();
            return Err(format!("did not end within {PATIENCE:?}"));
        }
        std::thread::sleep(Duration::from_millis(5));
    };
    let told = String::from_utf8_lossy(&std::fs::read(&log).unwrap()).into_owned();
    if told.contains("panicked") {
        return Err(told);
    }
    if peak > MOST_KIB {
        return Err(format!("took {} MiB", peak >> 10));
    }
    let ended = || format!("ended with {status} after {:.1} s: {told}", began.elapsed().as_secs_f64());
    status.code().filter(|code| *code < 8).ok_or_else(ended)
}

#[test]
fn damaged_files_end_in_an_answer_or_an_error_within_seconds_and_a_gigabyte() {
    let long = std::env::var("BACKDRIVE_LONG").as_deref() == Ok("1");
    let count = if long { 800 } else { 100 };
    let place = Place::new();
    let kinds = kinds(&place);
    for kind in &kinds {
        for (index, verb) in kind.verbs.iter().enumerate() {
            let folder = place.path(&format!("whole-{}-{index}", kind.name));
            std::fs::create_dir(&folder).unwrap();
            std::fs::write(folder.join(kind.name), &kind.whole).unwrap();
            let verb: Vec<String> = verb.iter().map(|w| if w == "FILE" { kind.name.to_string() } else { w.clone() }).collect();
            let code = taken(&place, &folder, &verb);
            let told = std::fs::read_to_string(folder.join("stderr")).unwrap();
            assert!(matches!(code, Ok(0 | 1 | 7)), "{} of a whole file: {code:?}: {told}", verb.join(" "));
        }
    }
    let (next, codes, failures) = (AtomicUsize::new(0), Mutex::new([0; 8]), Mutex::new(Vec::new()));
    let work = || {
        while let Some(index) = Some(next.fetch_add(1, Ordering::Relaxed)).filter(|i| *i < count) {
            let kind = &kinds[index % kinds.len()];
            let verb = &kind.verbs[index / kinds.len() % kind.verbs.len()];
            // The file can be had again from the number of its case alone.
            let mut random = ChaCha8Rng::seed_from_u64(index as u64);
            let folder = place.path(&format!("case-{index}"));
            std::fs::create_dir(&folder).unwrap();
            std::fs::write(folder.join(kind.name), mutate(&kind.whole, kind.name != "bag.mcap", &mut random)).unwrap();
            let verb: Vec<String> = verb.iter().map(|w| if w == "FILE" { kind.name.to_string() } else { w.clone() }).collect();
            match taken(&place, &folder, &verb) {
                Err(told) => failures.lock().unwrap().push(format!("case {index}: {}: {told}", verb.join(" "))),
                Ok(code) => {
                    codes.lock().unwrap()[code as usize] += 1;
                    std::fs::remove_dir_all(&folder).unwrap();
                }
            }
        }
    };
    std::thread::scope(|scope| {
        scope.spawn(work);
        scope.spawn(work);
    });
    let failures = failures.into_inner().unwrap();
    assert!(failures.is_empty(), "{} of {count}:\n{}", failures.len(), failures.join("\n"));
    // It would prove little if all of them were refused at the door, or none.
    let codes = codes.into_inner().unwrap();
    println!("exit codes 0 to 7: {codes:?}");
    assert!(codes[0] + codes[1] + codes[7] > count / 10 && codes[3] > count / 10, "exit codes 0 to 7: {codes:?}");
}
