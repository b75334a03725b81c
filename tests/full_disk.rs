//! A disk that is full: what a verb writes is under its name whole or not at all, and the verb ends with 5 and one line.

mod system;
#[path = "common/skipped.rs"]
mod told;

use std::process::Command;
use system::{Ended, Place, Running, file};
use system::{PANIC, assert_names};
use told::skipped;

/// Sizes of a disk, kB: one page is the smallest that there is. More of them with `BACKDRIVE_LONG=1`.
fn sizes() -> &'static [u32] {
    if std::env::var("BACKDRIVE_LONG").is_ok_and(|v| v == "1") { &[4, 8, 16, 32, 64, 128, 256] } else { &[4, 64] }
}

/// Runs a command whose disk `disk` has so little room, and a line of shell before and after it; what the disk holds afterwards: names and sizes.
fn on_a_disk(place: &Place, kilobytes: u32, prepare: &str, command: &str, after: &str) -> Option<(Ended, Vec<String>)> {
    // SAFETY: has no preconditions and cannot fail.
    let root = unsafe { nix::libc::geteuid() } == 0;
    let rights = if root { &["--mount"][..] } else { &["--mount", "--map-root-user"] };
    if !Command::new("unshare").args(rights).arg("true").output().is_ok_and(|p| p.status.success()) {
        skipped("unshare and mount are not allowed here");
        return None;
    }
    let script = format!(
        "mkdir -p disk; mount -t tmpfs -o size={kilobytes}k none disk || exit 77; {prepare}\n\
         \"$0\" {command}; code=$?; {after}\n\
         find disk -mindepth 1 -printf '%P %s\\n' | sort > names; exit $code"
    );
    let mut unshare = place.command("unshare");
    unshare.args(rights).args(["sh", "-c", &script, env!("CARGO_BIN_EXE_backdrive")]);
    let done = Running::start(place, unshare).end();
    if done.code == Some(77) {
        skipped("mount is not allowed here");
        return None;
    }
    let names = std::fs::read_to_string(place.path("names")).unwrap();
    Some((done, names.lines().map(str::to_string).collect()))
}

/// A recording, a bag, and a model to do something with.
fn made() -> Place {
    let place = Place::new();
    let contact = file("launch/contact.toml");
    let run = place.backdrive(&["run", &contact, "--transport", "inproc", "--duration", "0.4", "--bag", "short.mcap"]);
    assert!(place.path("short.mcap").is_file(), "{run:?}");
    std::fs::copy(place.path("short.mcap"), place.path("other.mcap")).unwrap();
    let model = file("plant/models/rigid-mass.toml");
    for (name, seed) in [("one.csv", "1"), ("other.csv", "2")] {
        let drive = format!("multisine:rms=1,from=1,to=50,period=1,periods=4,seed={seed}");
        let done = place.backdrive(&["simulate", &model, &drive, "--rate", "1000", "--out", name]);
        assert_eq!(done.code, Some(0), "{done:?}");
    }
    place
}

/// Every verb that writes, into the folder `disk`; a verb that needs many seconds is not here.
fn verbs() -> Vec<String> {
    let model = file("plant/models/rigid-mass.toml");
    vec![
        "bag import one.csv --bag disk/i.mcap".to_string(),
        "bag import one.csv other.csv --bag disk/several".to_string(),
        "bag recover short.mcap --bag disk/r.mcap".to_string(),
        "bag merge short.mcap other.mcap --bag disk/m.mcap".to_string(),
        "bag export short.mcap --csv disk/e.csv".to_string(),
        "bag export short.mcap --out disk/e.parquet".to_string(),
        "bag export short.mcap --out disk/e.mat".to_string(),
        "replay short.mcap --bag disk/p.mcap".to_string(),
        "replay short.mcap --html disk/p.html".to_string(),
        "stability short.mcap --gain 1 --grips 1 --html disk/s.html".to_string(),
        format!("simulate {model} one.csv --out disk/s.csv"),
        format!("fit {model} one.csv --out disk/f.toml"),
        format!("diagnose one.csv other.csv --model {model} --patience 1 --out disk/diagnosed"),
        format!("export {model} --to mjcf --out disk/m.xml"),
        "init disk/init --recording one.csv --yes".to_string(),
        "man --out disk/man".to_string(),
    ]
}

#[test]
fn no_verb_leaves_half_a_file_on_a_full_disk() {
    let place = made();
    let mut refused = 0;
    for verb in verbs() {
        let mut whole: Option<Vec<String>> = None;
        for size in [&[1 << 16], sizes()].concat() {
            let prepare = if verb.starts_with("init") { "mkdir disk/init" } else { "" };
            let Some((done, names)) = on_a_disk(&place, size, prepare, &verb, "") else { return };
            assert!(!done.stderr.contains(PANIC), "{verb}: {done:?}");
            let kept: Vec<&String> = names.iter().filter(|line| line.contains(".backdrive-")).collect();
            assert!(kept.is_empty(), "{verb} on {size} kB: what is unfinished is left: {names:?}");
            match (&whole, done.code) {
                // The first has all the room that it wants.
                (None, code) => {
                    assert!(matches!(code, Some(0 | 1 | 7)), "{verb}: {done:?}");
                    whole = Some(names);
                }
                (Some(whole), Some(5)) => {
                    refused += 1;
                    assert_eq!(done.stderr.lines().filter(|l| l.starts_with("error:")).count(), 1, "{verb} on {size} kB: {done:?}");
                    assert_names(&done.stderr, &["No space left on device"]);
                    // Of several files those are there that were whole before the disk was full, each as on a large disk.
                    for line in names.iter().filter(|line| !whole.contains(line)) {
                        let (name, _) = line.rsplit_once(' ').unwrap();
                        assert!(is_folder_in(whole, name), "{verb} on {size} kB: {name} is there and not whole: {names:?}, not {whole:?}");
                    }
                }
                (Some(_), code) => assert!(matches!(code, Some(0 | 1 | 7)), "{verb} on {size} kB: {done:?}"),
            }
        }
    }
    assert!(refused >= 15, "the disk was full {refused} times");
    println!("{refused} refused");
}

/// Whether a name is that of a folder, whose size depends on its content.
fn is_folder_in(whole: &[String], name: &str) -> bool {
    whole.iter().any(|line| line.starts_with(&format!("{name}/")))
}

#[test]
fn what_was_there_before_is_there_after_a_disk_was_full() {
    let place = made();
    for verb in ["bag import one.csv --bag disk/b.mcap --overwrite", "replay short.mcap --bag disk/b.mcap --overwrite"] {
        // A small bag, and a disk that has no room for a second one.
        let prepare =
            "\"$0\" bag import two.csv --bag disk/b.mcap; head -c 200000 /dev/zero > disk/filler 2>/dev/null; cp disk/b.mcap was.mcap";
        std::fs::write(place.path("two.csv"), "t,x\n0,1\n0.001,2\n0.002,3\n").unwrap();
        let Some((done, names)) = on_a_disk(&place, 64, prepare, verb, "") else { return };
        assert_eq!(done.code, Some(5), "{verb}: {done:?}");
        let was = std::fs::metadata(place.path("was.mcap")).unwrap().len();
        assert!(names.contains(&format!("b.mcap {was}")), "{verb}: {names:?}, was {was}");
    }
}

/// A run records under the bag's own name: what the disk took can be recovered.
#[test]
fn what_a_run_has_recorded_until_the_disk_was_full_can_be_recovered() {
    let place = made();
    let contact = file("launch/contact.toml");
    for transport in ["inproc", "iceoryx2"] {
        let command = format!("run {contact} --transport {transport} --duration 1 --bag disk/run.mcap --json");
        // The disk is gone with the process: the bag is copied before.
        let Some((done, _)) = on_a_disk(&place, 600, "", &command, "cp disk/run.mcap kept.mcap") else { return };
        assert_eq!(done.code, Some(5), "{transport}: {done:?}");
        assert_names(&done.stderr, &["No space left on device"]);
        done.json();
        let recovered = place.backdrive(&["bag", "recover", "kept.mcap", "--bag", "saved.mcap", "--overwrite"]);
        assert_eq!(recovered.code, Some(4), "{transport}: {recovered:?}");
        assert_eq!(place.backdrive(&["bag", "info", "saved.mcap", "--json"]).json()["ended_cleanly"], true);
    }
}
