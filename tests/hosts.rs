//! Graphs on two hosts, which here are two network namespaces.

#[path = "common/naming.rs"]
mod naming;

mod netns;

use backdrive_bags::{CLOCK_OFFSET, ClockOffset, DiffOptions, Reader, diff};
use backdrive_msgs::Message;
use naming::assert_names;
use netns::skipped::skipped;
use netns::{ADDRESSES, Hosts, Link};
use serde_json::Value;
use std::io::{Read, Write};
use std::ops::{Deref, DerefMut};
use std::os::unix::fs::OpenOptionsExt;
use std::panic::{AssertUnwindSafe, catch_unwind, resume_unwind};
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Stdio};
use std::time::{Duration, Instant};

const HOSTS: [&str; 2] = ["desk", "robot"];

fn is_long() -> bool {
    std::env::var("BACKDRIVE_LONG").as_deref() == Ok("1")
}

fn graph() -> PathBuf {
    PathBuf::from(env!("CARGO_MANIFEST_DIR")).join("launch/contact-hosts.toml")
}

/// Two hosts on one machine share its processors with whatever else it does: of three attempts in real time one has to be whole.
fn one_of_three(attempt: impl Fn()) {
    for number in 1..=3 {
        match catch_unwind(AssertUnwindSafe(&attempt)) {
            Ok(()) => return,
            Err(why) if number == 3 => resume_unwind(why),
            Err(_) => eprintln!("attempt {number} of 3 failed; once more"),
        }
    }
}

/// A process that does not outlive its test.
struct Running(Child);

impl Deref for Running {
    type Target = Child;
    fn deref(&self) -> &Child {
        &self.0
    }
}

impl DerefMut for Running {
    fn deref_mut(&mut self) -> &mut Child {
        &mut self.0
    }
}

impl Drop for Running {
    fn drop(&mut self) {
        let _ = self.0.kill();
        let _ = self.0.wait();
    }
}

/// What the hosts know each other by, for its user alone.
fn secret(folder: &Path, digits: &str) -> PathBuf {
    let path = folder.join(format!("{digits}.secret"));
    let mut file = std::fs::OpenOptions::new().write(true).create(true).truncate(true).mode(0o600).open(&path).unwrap();
    file.write_all(digits.repeat(64 / digits.len()).as_bytes()).unwrap();
    path
}

/// `backdrive run` on one of the hosts.
fn run_on(hosts: &Hosts, host: usize, folder: &Path, more: &[&str]) -> Running {
    run_with(hosts, host, folder, "a1", more)
}

/// The same with a secret of these digits.
fn run_with(hosts: &Hosts, host: usize, folder: &Path, digits: &str, more: &[&str]) -> Running {
    let mut command = hosts.on(host, env!("CARGO_BIN_EXE_backdrive"));
    command
        .arg("run")
        .arg(graph())
        .arg("--secret")
        .arg(secret(folder, digits))
        .args(["--host", HOSTS[host], "--json", "--bag"])
        .arg(folder.join("run.mcap"))
        .args(more);
    command.env_remove("ROS_DOMAIN_ID").env("TMPDIR", folder);
    spawn(command)
}

/// On a busy machine a part of the samples comes late: then the run is not judged, and reports this. It is never judged unstable.
fn assert_stable_or_too_late(host: &str, report: &Value, code: Option<i32>, told: &str) {
    let judged = (code, report["outcome"].as_str(), report["outcome_detail"]["why"].as_str());
    let expected = [(Some(0), Some("stable"), None), (Some(7), Some("cannot_tell"), Some("gaps"))];
    assert!(expected.contains(&judged), "{host}: {judged:?} {report} {told}");
}

fn spawn(mut command: Command) -> Running {
    Running(command.stdout(Stdio::piped()).stderr(Stdio::piped()).spawn().unwrap())
}

/// Standard output as JSON, the end, and its standard error.
fn end(mut child: Running, limit: Duration) -> (Value, Option<i32>, String) {
    let begun = Instant::now();
    // Both at once: a pipe without a reader stops its writer.
    fn all(mut from: impl Read + Send + 'static) -> std::thread::JoinHandle<String> {
        std::thread::spawn(move || {
            let mut text = String::new();
            let _ = from.read_to_string(&mut text);
            text
        })
    }
    let (text, told) = (all(child.stdout.take().unwrap()), all(child.stderr.take().unwrap()));
    while child.try_wait().unwrap().is_none() {
        if begun.elapsed() > limit {
            let _ = child.kill();
            let _ = child.wait();
            panic!("it does not end: {}", told.join().unwrap());
        }
        std::thread::sleep(Duration::from_millis(20));
    }
    let (text, code) = (text.join().unwrap(), child.wait().unwrap().code());
    (serde_json::from_str(text.lines().last().unwrap_or_default()).unwrap_or(Value::Null), code, told.join().unwrap())
}

/// Nothing that goes to the group leaves either host.
fn without_multicast(hosts: &Hosts) {
    for host in 0..2 {
        hosts.ip(host, &["link", "set", "veth0", "multicast", "off"]);
        hosts.ip(host, &["route", "del", "224.0.0.0/4", "dev", "veth0"]);
    }
}

/// What a host gets instead.
fn by_address(host: usize) -> [&'static str; 4] {
    ["--peer", ADDRESSES[1 - host], "--interface", "veth0"]
}

fn bag(folder: &Path, host: usize) -> Reader {
    Reader::open(&folder.join(format!("run-{}.mcap", HOSTS[host]))).unwrap()
}

/// Kinds and texts of the events in a bag.
fn events(reader: &Reader) -> Vec<(String, String, f64)> {
    let messages = reader.messages().unwrap().map(|e| e.unwrap().message(reader.path()).unwrap());
    let events = messages.filter_map(|m| if let Some(Message::Event(e)) = m { Some(e) } else { None });
    events.map(|e| (e.kind.as_str().to_string(), e.text.as_str().to_string(), e.value)).collect()
}

#[test]
fn the_contact_task_in_real_time_loses_nothing_on_a_clean_link() {
    one_of_three(|| {
        let Some(hosts) = Hosts::joined() else { return };
        let folder = tempfile::tempdir().unwrap();
        let is_full = std::env::var("BACKDRIVE_FULL").as_deref() == Ok("1");
        let seconds = match (is_full, is_long()) {
            (true, _) => "60",
            (false, true) => "10",
            (false, false) => "5",
        };
        // Found by address, for a sample that goes to the group is heard by every node of both hosts, wanted or not: that is
        // three quarters of two processors instead of a third.
        without_multicast(&hosts);
        let runs = [0, 1].map(|host| run_on(&hosts, host, folder.path(), &[&["--duration", seconds], &by_address(host)[..]].concat()));
        for (host, run) in runs.into_iter().enumerate() {
            let (report, code, told) = end(run, Duration::from_secs(180));
            assert_stable_or_too_late(HOSTS[host], &report, code, &told);
            assert_eq!((report["lost"].as_u64(), report["complete"].as_bool()), (Some(0), Some(true)), "{}: {told}", HOSTS[host]);
            assert!(report["peak_contact_force_n"].as_f64().unwrap() > 1.0);
            // Both bags hold every topic of both hosts, whole.
            let bag = bag(folder.path(), host);
            let samples = |topic: &str| bag.completeness().unwrap().topics.iter().find(|t| t.topic == topic).unwrap().written;
            let steps = seconds.parse::<u64>().unwrap() * 1000;
            assert_eq!((samples("/slave/measured_js"), samples("/master/measured_js")), (steps, steps), "{}", HOSTS[host]);
            // The clocks are one clock here: their offset is 0 within what is claimed, and what is claimed is worth something.
            let offsets: Vec<ClockOffset> = events(&bag)
                .iter()
                .filter(|(kind, ..)| kind == CLOCK_OFFSET)
                .map(|(_, text, _)| ClockOffset::parse(text).unwrap())
                .collect();
            assert!(offsets.len() >= 4, "{offsets:?}");
            for offset in offsets {
                assert!(offset.offset_ns.abs() <= offset.uncertainty_ns && offset.uncertainty_ns < 5_000_000, "{offset:?}");
            }
            eprintln!("{}: p50 {} us, p99 {} us", HOSTS[host], report["loop_p50_us"], report["loop_p99_us"]);
        }
        // One bag of both.
        let merged = folder.path().join("merged.mcap");
        let status = Command::new(env!("CARGO_BIN_EXE_backdrive"))
            .args(["bag", "merge"])
            .args([folder.path().join("run-desk.mcap"), folder.path().join("run-robot.mcap")])
            .arg("--bag")
            .arg(&merged)
            .arg("--json")
            .output()
            .unwrap();
        let report: Value = serde_json::from_slice(&status.stdout).unwrap();
        assert!(status.status.success(), "{report}");
        let one = bag(folder.path(), 0).counts().iter().sum::<u64>();
        assert!(report["in_both"].as_u64().unwrap() > one * 9 / 10 && report["messages"].as_u64().unwrap() >= one, "{report}");
        assert!(Reader::open(&merged).unwrap().completeness().unwrap().is_complete());
    });
}

#[test]
fn lockstep_across_hosts_is_lockstep_in_one_process() {
    let Some(hosts) = Hosts::joined() else { return };
    let folder = tempfile::tempdir().unwrap();
    let seconds = if is_long() { "4" } else { "1" };
    let options = ["--clock", "lockstep", "--duration", seconds];
    let runs = [0, 1].map(|host| run_on(&hosts, host, folder.path(), &options));
    for (host, run) in runs.into_iter().enumerate() {
        let (report, code, told) = end(run, Duration::from_secs(300));
        // A second is over before the hand holds still.
        assert_eq!((code, report["complete"].as_bool()), (Some(if is_long() { 0 } else { 7 }), Some(true)), "{}: {told}", HOSTS[host]);
        eprintln!("{}: {} steps/s", HOSTS[host], report["steps_per_s"]);
    }
    let here = folder.path().join("here.mcap");
    let alone = Command::new(env!("CARGO_BIN_EXE_backdrive"))
        .arg("run")
        .arg(graph())
        .args(["--transport", "inproc", "--json", "--bag"])
        .arg(&here)
        .args(options)
        .output()
        .unwrap();
    assert!(matches!(alone.status.code(), Some(0 | 7)), "{}", String::from_utf8_lossy(&alone.stderr));
    let here = Reader::open(&here).unwrap();
    for host in 0..2 {
        let report = diff(&bag(folder.path(), host), &here, &DiffOptions::default()).unwrap();
        assert!(report.same, "{}: {report}", HOSTS[host]);
    }
}

#[test]
fn without_multicast_hosts_find_each_other_by_address() {
    if !is_long() {
        return skipped("the contact task over a clean link finds its hosts so, too; BACKDRIVE_LONG=1 runs it");
    }
    one_of_three(|| {
        let Some(hosts) = Hosts::joined() else { return };
        without_multicast(&hosts);
        let folder = tempfile::tempdir().unwrap();
        let runs = [0, 1].map(|host| run_on(&hosts, host, folder.path(), &[&["--duration", "1"], &by_address(host)[..]].concat()));
        for (host, run) in runs.into_iter().enumerate() {
            let (report, _, told) = end(run, Duration::from_secs(120));
            assert_eq!((report["lost"].as_u64(), report["complete"].as_bool()), (Some(0), Some(true)), "{}: {told}", HOSTS[host]);
        }
    });
}

#[test]
fn who_is_missing_is_said_with_the_reason() {
    if !is_long() {
        return skipped("a quarter of a minute of waiting; BACKDRIVE_LONG=1 runs it");
    }
    let Some(hosts) = Hosts::joined_at_leisure() else { return };
    let folder = tempfile::tempdir().unwrap();
    // One in another domain, in which the other's announcements are overheard.
    let runs = [0, 1].map(|host| run_on(&hosts, host, folder.path(), &["--domain", ["3", "4"][host]]));
    std::thread::sleep(Duration::from_secs(14));
    for (host, run) in runs.into_iter().enumerate() {
        // Ctrl-C, to the program in the namespace.
        let pid = run.id().to_string();
        Command::new("kill").args(["-INT", &pid]).status().unwrap();
        let (_, code, told) = end(run, Duration::from_secs(30));
        assert_eq!(code, Some(130), "{told}");
        let other = HOSTS[1 - host];
        assert!(told.contains(&format!("host {other}: does not respond in ROS domain {}", ["3", "4"][host])), "{told}");
        let hint = format!("{} announces itself in ROS domain {}", ADDRESSES[1 - host], ["4", "3"][host]);
        assert!(told.contains(&hint), "{told}");
    }
}

#[test]
fn a_cut_link_a_killed_and_a_restarted_host_and_the_force_decays_and_comes_back() {
    if !is_long() {
        return skipped("half a minute in real time; BACKDRIVE_LONG=1 runs it");
    }
    one_of_three(|| {
        let Some(hosts) = Hosts::relayed(Link::default()) else { return };
        let folder = tempfile::tempdir().unwrap();
        let desk = run_on(&hosts, 0, folder.path(), &["--duration", "24"]);
        let mut robot = run_on(&hosts, 1, folder.path(), &["--duration", "24"]);
        // The push lasts from 1 s to 3 s of the run; later nothing is touched, but commands go on.
        until_running(folder.path());
        std::thread::sleep(Duration::from_millis(2000));
        hosts.relay().set(Link { cut: true, ..Link::default() });
        std::thread::sleep(Duration::from_millis(1500));
        hosts.relay().set(Link::default());
        std::thread::sleep(Duration::from_millis(2500));
        // Killed with all its nodes, and started again as if nothing had been.
        let pid = robot.id();
        Command::new("kill").args(["-KILL", &pid.to_string()]).status().unwrap();
        robot.wait().unwrap();
        std::thread::sleep(Duration::from_millis(1000));
        std::fs::rename(folder.path().join("run-robot.mcap"), folder.path().join("killed.mcap")).unwrap();
        let robot = run_on(&hosts, 1, folder.path(), &["--duration", "24"]);
        let (_, _, desk_told) = end(desk, Duration::from_secs(120));
        let (_, _, robot_told) = end(robot, Duration::from_secs(120));
        let (desk, robot) = (events(&bag(folder.path(), 0)), events(&bag(folder.path(), 1)));
        let count = |all: &[(String, String, f64)], kind: &str| all.iter().filter(|(k, ..)| k == kind).count();
        // The desk: the link, the host, the force; twice each.
        for kind in ["host_lost", "host_back", "force_stale", "force_back"] {
            assert!(count(&desk, kind) >= 2, "{kind}: {desk:?}\n{desk_told}");
        }
        assert!(count(&robot, "joined_late") >= 1, "{robot:?}\n{robot_told}");
        // What the killed host had recorded can be saved, and shows the cut.
        let saved = folder.path().join("saved.mcap");
        backdrive_bags::recover(&folder.path().join("killed.mcap"), &saved, false).unwrap();
        let killed = events(&Reader::open(&saved).unwrap());
        assert!(count(&killed, "slave_holds") >= 1 && count(&killed, "slave_follows") >= 1, "{killed:?}");
        // The desk ran on to its end, at its rate.
        let bag = bag(folder.path(), 0);
        let measured = bag.completeness().unwrap().topics.iter().find(|t| t.topic == "/master/measured_js").unwrap().clone();
        assert_eq!((measured.written, measured.lost), (24_000, 0));
    });
}

#[test]
fn on_a_link_that_reorders_and_loses_what_is_late_is_dropped_and_all_is_counted() {
    if !is_long() {
        return skipped("a run in real time over a bad link; BACKDRIVE_LONG=1 runs it");
    }
    one_of_three(|| {
        let Some(hosts) = Hosts::relayed(Link { delay_s: 2e-3, jitter_s: 4e-3, loss: 0.02, cut: false }) else { return };
        let folder = tempfile::tempdir().unwrap();
        // Far below the stability limit with this delay.
        let options = ["--duration", "6", "--lambda", "0.1"];
        let runs = [0, 1].map(|host| run_on(&hosts, host, folder.path(), &options));
        for (host, run) in runs.into_iter().enumerate() {
            let (report, code, told) = end(run, Duration::from_secs(120));
            assert!(matches!(code, Some(0 | 4 | 7)), "{}: {told}", HOSTS[host]);
            assert!(report["lost"].as_u64().unwrap() > 100, "{}: 2 % of 6000 steps of several topics: {report}", HOSTS[host]);
            let bag = bag(folder.path(), host);
            let late: f64 = events(&bag).iter().filter(|(kind, ..)| kind == "samples_late").map(|(_, _, count)| count).sum();
            assert!(late > 100.0, "{}: {late} samples came late\n{told}", HOSTS[host]);
            // What was used is in order.
            let messages = bag.messages().unwrap().map(|e| e.unwrap());
            let commands = messages.filter(|e| e.topic.name == "/slave/servo_jp").filter_map(|e| match e.message(bag.path()).unwrap() {
                Some(Message::Sample(sample)) => Some(sample.step),
                _ => None,
            });
            let steps: Vec<u64> = commands.collect();
            assert!(steps.len() > 3000 && steps.windows(2).all(|w| w[0] < w[1]), "{}: {} commands", HOSTS[host], steps.len());
            // Where more is missing than a verdict can bear it reports this.
            assert!(matches!(report["outcome"].as_str(), Some("stable" | "cannot_tell")), "{}: {report}", HOSTS[host]);
        }
    });
}

/// The process of a node of a run whose directories are in this folder.
fn pid_of(folder: &Path, node: &str) -> Option<String> {
    let runs = std::fs::read_dir(folder).ok()?.flatten().filter(|e| e.file_name().to_string_lossy().starts_with("backdrive-"));
    let pids = runs.flat_map(|home| std::fs::read_dir(home.path()).into_iter().flatten().flatten()).map(|run| run.path().join("pids"));
    let text: String = pids.filter_map(|path| std::fs::read_to_string(path).ok()).collect();
    text.lines().find(|line| line.ends_with(&format!(" {node}"))).and_then(|line| line.split(' ').next()).map(str::to_string)
}

fn until<T>(mut found: impl FnMut() -> Option<T>) -> T {
    let begun = Instant::now();
    loop {
        if let Some(found) = found() {
            return found;
        }
        assert!(begun.elapsed() < Duration::from_secs(60), "it does not come");
        std::thread::sleep(Duration::from_millis(20));
    }
}

/// Until the run of the first host writes its bag at a good pace.
fn until_running(folder: &Path) {
    until(|| std::fs::metadata(folder.join("run-desk.mcap")).ok().filter(|m| m.len() > 100_000));
}

#[test]
fn a_stopped_slave_does_no_harm_and_a_second_master_ends_the_run_on_both_hosts() {
    one_of_three(|| {
        let Some(hosts) = Hosts::joined() else { return };
        let folder = tempfile::tempdir().unwrap();
        let runs = [0, 1].map(|host| run_on(&hosts, host, folder.path(), &["--duration", "60"]));
        until_running(folder.path());
        let slave = until(|| pid_of(folder.path(), "slave"));
        Command::new("kill").args(["-STOP", &slave]).status().unwrap();
        std::thread::sleep(Duration::from_millis(1000));
        Command::new("kill").args(["-CONT", &slave]).status().unwrap();
        // The slave's middleware begins again.
        std::thread::sleep(Duration::from_millis(6000));
        // Somebody else commands the slave too, with a command of its own.
        let mut other =
            hosts.on(0, common_peer()).args(["speak", "/slave/servo_jp", "1500", "1000"]).env("ROS_DOMAIN_ID", "0").spawn().unwrap();
        let ended = runs.map(|run| end(run, Duration::from_secs(120)));
        let _ = other.kill();
        other.wait().unwrap();
        for (host, (report, code, told)) in ended.into_iter().enumerate() {
            let all = events(&bag(folder.path(), host));
            let has = |kind: &str| all.iter().any(|(k, ..)| k == kind);
            assert!(has("force_stale") && has("force_back"), "{}: {all:?}\n{told}", HOSTS[host]);
            assert_eq!(code, Some(5), "{}: {report} {told}", HOSTS[host]);
            assert!(report["refused"].as_u64().unwrap() > 0, "{}: {report}", HOSTS[host]);
            assert_names(&told, &["/slave/servo_jp", "GID "]);
        }
        // The slave's node reports it in its own host's bag.
        let bag = bag(folder.path(), 1);
        let all = events(&bag);
        assert!(all.iter().any(|(kind, text, count)| kind == "stranger" && text.contains("/slave/servo_jp") && *count >= 1.0), "{all:?}");
        // The second master's commands stand at 0.1 m: none was obeyed.
        let far = bag
            .messages()
            .unwrap()
            .map(|e| e.unwrap())
            .filter(|e| e.topic.name == "/slave/measured_js")
            .any(|e| matches!(e.message(bag.path()).unwrap(), Some(Message::Sample(s)) if s.position[0] > 0.05));
        assert!(!far, "the slave went where the second master wanted it");
    });
}

#[test]
fn hosts_without_the_same_secret_do_not_hear_each_other() {
    let Some(hosts) = Hosts::joined_at_leisure() else { return };
    let folder = tempfile::tempdir().unwrap();
    let runs = [0, 1].map(|host| run_with(&hosts, host, folder.path(), ["a1", "b2"][host], &["--duration", "1"]));
    std::thread::sleep(Duration::from_secs(if is_long() { 20 } else { 8 }));
    for (host, run) in runs.into_iter().enumerate() {
        Command::new("kill").args(["-INT", &run.id().to_string()]).status().unwrap();
        let (_, code, told) = end(run, Duration::from_secs(30));
        assert_eq!(code, Some(130), "{told}");
        assert!(told.contains("without this run's secret"), "{}: {told}", HOSTS[host]);
    }
    // And without any there is no beginning.
    let mut without = hosts.on(0, env!("CARGO_BIN_EXE_backdrive"));
    without.arg("run").arg(graph()).args(["--host", "desk"]).env("TMPDIR", folder.path());
    let done = without.output().unwrap();
    let told = String::from_utf8_lossy(&done.stderr).into_owned();
    assert!(done.status.code() == Some(3), "{told}");
    assert_names(&told, &["backdrive secret run.secret", "--secret"]);
}

/// The example that is a ROS 2 node of its own.
fn common_peer() -> PathBuf {
    let folder = std::env::current_exe().unwrap().parent().unwrap().parent().unwrap().join("examples");
    folder.join("ros2_peer")
}

const STEPPED_CLOCK: &str = r#"
#define _GNU_SOURCE
#include <fcntl.h>
#include <stdlib.h>
#include <sys/mman.h>
#include <sys/syscall.h>
#include <time.h>
#include <unistd.h>
static volatile long long *offset_ns;
__attribute__((constructor)) static void begin(void) {
    int fd = open(getenv("OFFSET_FILE"), O_RDONLY);
    if (fd >= 0) offset_ns = mmap(0, 8, PROT_READ, MAP_SHARED, fd, 0);
}
int clock_gettime(clockid_t clock, struct timespec *time) {
    int result = syscall(SYS_clock_gettime, clock, time);
    if (result == 0 && clock == CLOCK_REALTIME && offset_ns) {
        long long ns = time->tv_sec * 1000000000LL + time->tv_nsec + *offset_ns;
        time->tv_sec = ns / 1000000000LL;
        time->tv_nsec = ns % 1000000000LL;
    }
    return result;
}
"#;

#[test]
fn a_wall_clock_that_is_stepped_by_a_minute_stops_nobody() {
    one_of_three(|| {
        let Some(hosts) = Hosts::joined() else { return };
        let folder = tempfile::tempdir().unwrap();
        let (source, library, offset) = (folder.path().join("clock.c"), folder.path().join("clock.so"), folder.path().join("offset"));
        std::fs::write(&source, STEPPED_CLOCK).unwrap();
        std::fs::write(&offset, 0_i64.to_ne_bytes()).unwrap();
        let built = Command::new("cc").args(["-shared", "-fPIC", "-O1", "-o"]).arg(&library).arg(&source).status();
        if !built.is_ok_and(|s| s.success()) {
            return skipped("there is no C compiler to make a clock that can be stepped");
        }
        // Twice the ten seconds after which a participant announces itself again, because its first message may be lost, and after which an offset is reported
        // again.
        let seconds: u64 = 24;
        let duration = seconds.to_string();
        let desk = run_on(&hosts, 0, folder.path(), &["--duration", &duration]);
        let mut robot = hosts.on(1, env!("CARGO_BIN_EXE_backdrive"));
        robot
            .arg("run")
            .arg(graph())
            .args(["--host", "robot", "--json", "--duration", &duration, "--bag"])
            .arg(folder.path().join("run.mcap"))
            .arg("--secret")
            .arg(secret(folder.path(), "a1"));
        robot.env_remove("ROS_DOMAIN_ID").env("TMPDIR", folder.path()).env("LD_PRELOAD", &library).env("OFFSET_FILE", &offset);
        let robot = spawn(robot);
        until_running(folder.path());
        std::thread::sleep(Duration::from_millis(1500));
        // In place: the file is mapped.
        let step = |ns: i64| {
            use std::os::unix::fs::FileExt;
            std::fs::File::options().write(true).open(&offset).unwrap().write_all_at(&ns.to_ne_bytes(), 0).unwrap();
        };
        step(-60_000_000_000);
        let (_, _, desk_told) = end(desk, Duration::from_secs(120));
        let (_, _, robot_told) = end(robot, Duration::from_secs(120));
        let (desk, robot) = (bag(folder.path(), 0), bag(folder.path(), 1));
        let (at_desk, at_robot) = (events(&desk), events(&robot));
        // Commands are heard again well before the end.
        let follows = at_robot.iter().rposition(|(k, ..)| k == "slave_follows");
        let holds = at_robot.iter().rposition(|(k, ..)| k == "slave_holds");
        assert!(follows >= holds, "{at_robot:?}\n{robot_told}");
        let heard = robot.completeness().unwrap().topics.iter().find(|t| t.topic == "/slave/servo_jp").unwrap().last_step.unwrap();
        assert!(heard > 1000 * seconds - 500, "the robot hears nothing after step {heard}\n{robot_told}");
        let measured = desk.completeness().unwrap().topics.iter().find(|t| t.topic == "/master/measured_js").unwrap().clone();
        // The master goes on to its end. Another test requires that nothing is lost on the way: this is about the clock.
        assert_eq!(measured.last_step, Some(1000 * seconds - 1), "{desk_told}");
        assert!(measured.lost <= 10 * seconds, "{} of {} lost\n{desk_told}", measured.lost, measured.written);
        // And the step is measured.
        let offsets = at_desk.iter().filter(|(kind, ..)| kind == CLOCK_OFFSET).filter_map(|(_, text, _)| ClockOffset::parse(text));
        let last = { offsets }.rfind(|o| o.of == "robot").unwrap();
        assert!((last.offset_ns + 60_000_000_000).abs() <= last.uncertainty_ns, "{last:?}");
    });
}

#[test]
fn a_local_graph_is_watched_over_a_bridge() {
    one_of_three(|| {
        let Some(hosts) = Hosts::joined() else { return };
        let folder = tempfile::tempdir().unwrap();
        let peer = common_peer();
        let mut heard = hosts.on(1, &peer);
        heard.args(["listen", "/slave/measured_js"]).env_remove("ROS_DOMAIN_ID");
        let heard = spawn(heard);
        let mut run = hosts.on(0, env!("CARGO_BIN_EXE_backdrive"));
        run.arg("run").arg(graph()).args(["--rate", "500", "--duration", "10", "--json", "--bag"]).arg(folder.path().join("run.mcap"));
        run.env("TMPDIR", folder.path());
        let run = spawn(run);
        until(|| std::fs::metadata(folder.path().join("run.mcap")).ok().filter(|m| m.len() > 20_000));
        let mut bridge = hosts.on(0, env!("CARGO_BIN_EXE_backdrive"));
        bridge.args(["bridge", "--json"]).env_remove("ROS_DOMAIN_ID").env("TMPDIR", folder.path());
        let bridge = spawn(bridge);
        let (_, code, told) = end(run, Duration::from_secs(60));
        assert_eq!(code, Some(0), "{told}");
        let (crossed, code, told) = end(bridge, Duration::from_secs(60));
        assert_eq!((code, crossed["out"]["lost"].as_u64()), (Some(0), Some(0)), "{crossed} {told}");
        let (heard, ..) = end(heard, Duration::from_secs(60));
        assert!(heard["/slave/measured_js"]["count"].as_u64().unwrap() > 500, "{heard}");
        assert!(crossed["out"]["messages"].as_u64().unwrap() > 9 * 500, "{crossed}");
    });
}

#[test]
fn a_host_over_shared_memory_joins_the_others_by_its_bridge() {
    one_of_three(|| {
        let Some(hosts) = Hosts::joined() else { return };
        let folder = tempfile::tempdir().unwrap();
        // A folder for each host: a bridge finds the only run of its own.
        let folders = ["desk", "robot"].map(|name| {
            let path = folder.path().join(name);
            std::fs::create_dir(&path).unwrap();
            path
        });
        let seconds = ["--duration", "5"];
        let desk = run_on(&hosts, 0, &folders[0], &[&seconds[..], &["--transport", "iceoryx2"]].concat());
        let robot = run_on(&hosts, 1, &folders[1], &seconds);
        until(|| {
            let homes =
                std::fs::read_dir(&folders[0]).ok()?.flatten().filter(|e| e.file_name().to_string_lossy().starts_with("backdrive-"));
            homes
                .flat_map(|home| std::fs::read_dir(home.path()).into_iter().flatten().flatten())
                .find(|run| run.path().join("pids").exists())
        });
        let mut bridge = hosts.on(0, env!("CARGO_BIN_EXE_backdrive"));
        bridge.args(["bridge", "--both-ways", "--json"]).env_remove("ROS_DOMAIN_ID").env("TMPDIR", &folders[0]);
        let bridge = spawn(bridge);
        let desk = end(desk, Duration::from_secs(60));
        let robot = end(robot, Duration::from_secs(60));
        let (crossed, code, told) = end(bridge, Duration::from_secs(60));
        let lost = |way: &str| crossed[way]["lost"].as_u64();
        assert_eq!((code, lost("out"), lost("in")), (Some(0), Some(0), Some(0)), "{crossed} {told}\n{}\n{}", desk.2, robot.2);
        // The wall was felt at the desk, and the slave of the robot was moved.
        for (host, (report, code, told)) in [desk, robot].into_iter().enumerate() {
            assert_stable_or_too_late(HOSTS[host], &report, code, &told);
            assert_eq!(report["lost"].as_u64(), Some(0), "{}: {told}", HOSTS[host]);
            assert!(report["peak_contact_force_n"].as_f64().unwrap() > 1.0, "{}: {report}", HOSTS[host]);
        }
    });
}

#[test]
fn the_doctor_finds_an_interface_without_multicast() {
    let Some(hosts) = Hosts::joined_at_leisure() else { return };
    let grade = || {
        let output = hosts.on(0, env!("CARGO_BIN_EXE_backdrive")).args(["doctor", "--listen", "0", "--json"]).output().unwrap();
        let findings: Value = serde_json::from_slice(&output.stdout).unwrap();
        let parts: Vec<&str> = findings.as_array().unwrap().iter().map(|f| f["part"].as_str().unwrap()).collect();
        for part in ["shared memory", "real-time", "timers", "timer slack", "interfaces", "socket buffers", "domain", "strangers"] {
            assert!(parts.contains(&part), "{part}: {parts:?}");
        }
        let multicast = findings.as_array().unwrap().iter().find(|f| f["part"] == "multicast").unwrap().clone();
        (multicast["grade"].as_str().unwrap().to_string(), multicast["advice"].as_str().unwrap().to_string())
    };
    assert_eq!(grade().0, "fine");
    hosts.ip(0, &["link", "set", "veth0", "multicast", "off"]);
    let (grade, advice) = grade();
    assert!(grade == "weak", "{grade}: {advice}");
    assert_names(&advice, &["--peer"]);
}
