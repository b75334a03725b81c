//! Where the output of a verb cannot go: a full standard output, a full standard error, a reader that has enough, a file that cannot be written.

mod system;

use std::fs::File;
use std::process::{Command, Stdio};
use system::{Place, file};

/// A recording, a bag of a run, and a model to do something with.
fn made() -> Place {
    let place = Place::new();
    let contact = file("launch/contact.toml");
    let run = place.backdrive(&["run", &contact, "--transport", "inproc", "--duration", "0.3", "--bag", "short.mcap"]);
    assert!(place.path("short.mcap").is_file(), "{run:?}");
    let model = file("plant/models/rigid-mass.toml");
    for (name, seed) in [("one.csv", "1"), ("other.csv", "2")] {
        let drive = format!("multisine:rms=1,from=1,to=50,period=0.5,periods=1,seed={seed}");
        let done = place.backdrive(&["simulate", &model, &drive, "--rate", "1000", "--out", name]);
        assert_eq!(done.code, Some(0), "{done:?}");
    }
    place
}

/// A verb with what it needs, whose result goes to standard output.
fn verbs() -> Vec<Vec<String>> {
    let (contact, model) = (file("launch/contact.toml"), file("plant/models/rigid-mass.toml"));
    [
        format!("run {contact} --transport inproc --duration 0.1 --bag a.mcap"),
        format!("run {contact} --duration 0.1 --bag b.mcap --json"),
        "replay short.mcap".to_string(),
        "stability short.mcap --gain 1 --grips 1".to_string(),
        format!("fit {model} one.csv"),
        format!("diagnose one.csv other.csv --model {model} --patience 1 --out diagnosed"),
        format!("simulate {model} one.csv --out p.csv"),
        format!("model show {model}"),
        format!("model check {model}"),
        format!("check {contact}"),
        format!("graph {contact}"),
        "bag info short.mcap".to_string(),
        "bag info short.mcap --json".to_string(),
        "bag import one.csv --bag i.mcap".to_string(),
        "bag export short.mcap --csv e.csv".to_string(),
        "bag recover short.mcap --bag r.mcap".to_string(),
        "bag diff short.mcap short.mcap".to_string(),
        "doctor --listen 0".to_string(),
        "clean".to_string(),
        "completions bash".to_string(),
        "--help".to_string(),
        "--version".to_string(),
    ]
    .iter()
    .map(|line| line.split(' ').map(str::to_string).collect())
    .collect()
}

fn program(place: &Place, arguments: &[String]) -> Command {
    let mut command = place.command(env!("CARGO_BIN_EXE_backdrive"));
    command.args(arguments);
    command
}

fn full() -> Stdio {
    File::options().write(true).open("/dev/full").unwrap().into()
}

#[test]
fn a_full_standard_output_is_an_error_of_the_machine_in_every_verb() {
    let place = made();
    for verb in verbs() {
        let done = program(&place, &verb).stdout(full()).output().unwrap();
        let said = String::from_utf8_lossy(&done.stderr);
        assert_eq!(done.status.code(), Some(5), "{verb:?}: {said}");
        assert!(said.contains("error: standard output: cannot be written: No space left on device"), "{verb:?}: {said}");
        assert!(!said.contains("panicked"), "{verb:?}: {said}");
    }
}

#[test]
fn a_full_standard_error_changes_no_answer() {
    let place = made();
    for verb in verbs() {
        let open = program(&place, &verb).stderr(Stdio::null()).stdout(Stdio::null()).status().unwrap();
        for made in ["a.mcap", "b.mcap", "i.mcap", "e.csv", "r.mcap", "p.csv"] {
            let _ = std::fs::remove_file(place.path(made));
        }
        let closed = program(&place, &verb).stderr(full()).stdout(Stdio::null()).status().unwrap();
        for made in ["a.mcap", "b.mcap", "i.mcap", "e.csv", "r.mcap", "p.csv"] {
            let _ = std::fs::remove_file(place.path(made));
        }
        assert_eq!(closed.code(), open.code(), "{verb:?}");
    }
    // A failure has its exit code even where its message cannot be written.
    let wrong = ["bag".to_string(), "info".to_string(), "absent.mcap".to_string()];
    assert_eq!(program(&place, &wrong).stderr(full()).status().unwrap().code(), Some(3));
    assert_eq!(program(&place, &["no-verb".to_string()]).stderr(full()).status().unwrap().code(), Some(2));
}

#[test]
fn a_reader_that_has_enough_is_no_error() {
    let place = made();
    for verb in ["model show MODEL", "bag info short.mcap --json", "--help", "run GRAPH --transport inproc --duration 0.1 --bag c.mcap"] {
        let verb = verb.replace("MODEL", &file("plant/models/rigid-mass.toml")).replace("GRAPH", &file("launch/contact.toml"));
        let arguments: Vec<String> = verb.split(' ').map(str::to_string).collect();
        let mut child = program(&place, &arguments).stdout(Stdio::piped()).stderr(Stdio::piped()).spawn().unwrap();
        drop(child.stdout.take());
        let done = child.wait_with_output().unwrap();
        let said = String::from_utf8_lossy(&done.stderr);
        assert!(!said.contains("panicked") && !said.contains("error:"), "{verb}: {said}");
    }
}

#[test]
fn a_file_that_cannot_be_written_is_code_5_and_leaves_nothing_behind() {
    let place = made();
    let model = file("plant/models/rigid-mass.toml");
    std::fs::create_dir(place.path("folder")).unwrap();
    for line in [
        format!("simulate {model} one.csv --out /dev/full"),
        "bag export short.mcap --csv /dev/full".to_string(),
        format!("fit {model} one.csv --out /dev/full"),
        "stability short.mcap --gain 1 --grips 1 --html /dev/full".to_string(),
        format!("simulate {model} one.csv --out folder"),
        format!("simulate {model} one.csv --out /proc/nothing/here.csv"),
    ] {
        let arguments: Vec<&str> = line.split(' ').collect();
        let before = names(&place);
        let done = place.backdrive(&arguments);
        assert_eq!(done.code, Some(5), "{line}: {done:?}");
        assert_eq!(done.stderr.lines().filter(|l| l.starts_with("error:")).count(), 1, "{line}: {done:?}");
        assert_eq!(names(&place), before, "{line}");
    }
}

/// Names of everything in the folder.
fn names(place: &Place) -> Vec<String> {
    let entries = std::fs::read_dir(place.path("")).unwrap().flatten();
    let mut names: Vec<String> = entries.map(|e| e.file_name().to_string_lossy().into_owned()).filter(|n| !n.starts_with("std")).collect();
    names.sort();
    names
}
