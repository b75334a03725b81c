//! The tutorial and the how-to, done as they say: every block of commands in order, with the program on the path, and what the page says that they
//! say and end with compared with what they do.

mod system;

use std::path::Path;
use std::process::Command;
use system::{Place, file};

/// Commands that a reader is to type, and what the page says of them.
struct Block {
    commands: String,
    /// Lines that are said, in any order; `...` stands for anything.
    says: Vec<String>,
    /// How the last command ends.
    code: i32,
}

/// The blocks of commands of a page, each with the block of text behind it, if that comes before the next commands.
fn blocks(path: &str) -> Vec<Block> {
    let text = std::fs::read_to_string(file(path)).unwrap();
    let until = |text: &str| text.split("\n```").next().unwrap_or_default().to_string();
    text.split("```sh\n")
        .skip(1)
        .map(|rest| {
            let told = rest.split_once("```text\n").map(|(_, told)| until(told)).unwrap_or_default();
            let (codes, says): (Vec<&str>, Vec<&str>) = told.lines().partition(|line| line.starts_with("exit code "));
            let code = codes.first().map_or(0, |line| line.trim_start_matches("exit code ").parse().unwrap());
            Block { commands: until(rest), says: says.into_iter().filter(|line| *line != "...").map(str::to_string).collect(), code }
        })
        .collect()
}

/// Whether a line is as the page says, `...` standing for anything.
fn is_as_told(line: &str, told: &str) -> bool {
    let mut parts = told.split("...");
    let Some(mut rest) = line.strip_prefix(parts.next().unwrap_or_default()) else { return false };
    let parts: Vec<&str> = parts.collect();
    for (index, part) in parts.iter().enumerate() {
        let at =
            if index + 1 == parts.len() { rest.len().checked_sub(part.len()).filter(|_| rest.ends_with(part)) } else { rest.find(part) };
        let Some(at) = at else { return false };
        rest = &rest[at + part.len()..];
    }
    rest.is_empty()
}

/// Follows a page in a folder that looks like the project's, and compares.
fn follow(place: &Place, path: &str) {
    for folder in ["launch", "plant"] {
        std::os::unix::fs::symlink(file(folder), place.path(folder)).unwrap();
    }
    let program = Path::new(env!("CARGO_BIN_EXE_backdrive")).parent().unwrap().display().to_string();
    let search = format!("{program}:{}", std::env::var("PATH").unwrap_or_default());
    for block in blocks(path) {
        let mut shell = Command::new("bash");
        shell.arg("-c").arg(&block.commands).current_dir(place.path("")).env("PATH", &search).env("TMPDIR", place.path("tmp"));
        let output = shell.output().unwrap();
        let said = format!("{}{}", String::from_utf8_lossy(&output.stdout), String::from_utf8_lossy(&output.stderr));
        println!("{}\n{said}", block.commands);
        assert_eq!(output.status.code(), Some(block.code), "{path}: {}\n{said}", block.commands);
        for told in &block.says {
            assert!(
                said.lines().any(|line| is_as_told(line.trim_end(), told)),
                "{path}: {}\nsays no line \"{told}\":\n{said}",
                block.commands
            );
        }
    }
}

#[test]
fn a_line_is_compared_up_to_what_was_left_out() {
    for (told, is) in [
        ("loop     stable", true),
        ("loop ...able", true),
        ("l...o...st...", true),
        ("...stable", true),
        ("loop...", true),
        ("stable", false),
        ("loop", false),
    ] {
        assert_eq!(is_as_told("loop     stable", told), is, "{told}");
    }
    let tutorial = blocks("docs/tutorial.md");
    assert!(tutorial.len() > 6 && tutorial.iter().any(|b| b.code == 1) && tutorial.iter().all(|b| !b.commands.is_empty()));
}

#[test]
fn the_tutorial_ends_in_what_it_promises() {
    let place = Place::new();
    follow(&place, "docs/tutorial.md");
    let verdict: serde_json::Value =
        serde_json::from_str(&std::fs::read_to_string(place.path("out/diagnosis/verdict.json")).unwrap()).unwrap();
    let error = |key: &str| verdict["held_out"][key].as_f64().unwrap();
    assert!(error("nrmse_after") < 0.1 * error("nrmse_refit"), "{}", verdict["held_out"]);
    assert!(place.path("out/diagnosis/report.html").is_file() && place.path("out/stability.html").is_file());
}

#[test]
fn a_recording_of_ones_own_ends_in_what_the_page_promises() {
    let place = Place::new();
    follow(&place, "docs/own-recording.md");
    let size = |folder: &str, key: &str| {
        let text = std::fs::read_to_string(place.path(folder).join("diagnosis/verdict.json")).unwrap();
        let verdict: serde_json::Value = serde_json::from_str(&text).unwrap();
        verdict["findings"][0]["parameters"][key]["value"].as_f64().unwrap()
    };
    // What the simulated devices hide.
    let near = |found: f64, hidden: f64| (found / hidden - 1.0).abs() < 0.03;
    assert!(near(size("out/mine", "force"), 4e-3), "{}", size("out/mine", "force"));
    assert!(near(size("out/rig", "positive"), 80.0) && near(size("out/rig", "negative"), 40.0), "{}", size("out/rig", "positive"));
}
