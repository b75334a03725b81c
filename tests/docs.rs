//! The tutorial and the how-to, done step by step: every block of commands in order, with the program on the path. Their output and exit codes are
//! compared with the page.

#[path = "common/skipped.rs"]
mod skipped;
mod system;

use skipped::skipped;
use std::path::Path;
use std::process::Command;
use system::assert_names;
use system::{Place, file};

/// Commands that a reader is to type, and what the page shows for them.
struct Block {
    commands: String,
    /// Lines of the output, in any order; `...` stands for anything.
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

/// Whether a line is that of the page, `...` standing for anything.
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
    if !is_long() {
        return skipped("searches of half a minute; BACKDRIVE_LONG=1 runs it");
    }
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
    if !is_long() {
        return skipped("searches of half a minute; BACKDRIVE_LONG=1 runs it");
    }
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

#[test]
fn an_inspection_says_what_its_page_says() {
    follow(&Place::new(), "docs/inspect.md");
}

#[test]
fn servo_joints_are_diagnosed_as_their_page_says() {
    follow(&Place::new(), "docs/servo.md");
}

fn is_long() -> bool {
    std::env::var("BACKDRIVE_LONG").as_deref() == Ok("1")
}

/// A command that a page shows, and what its line states about running it.
struct Shown {
    command: String,
    /// Runs with BACKDRIVE_LONG=1 only: `<!-- long -->`.
    is_long: bool,
}

/// The commands between backquotes in the guide's list, in their order, without those of items that end in `<!-- not run: why -->`.
fn fourteen() -> Vec<Shown> {
    let text = std::fs::read_to_string(file("docs/guide.md")).unwrap();
    let list = text.split("## Fourteen things").nth(1).unwrap().split("\n## ").next().unwrap();
    let mut items: Vec<String> = Vec::new();
    for line in list.lines() {
        match line.split_once(". **").filter(|(number, _)| number.parse::<u8>().is_ok()) {
            Some(_) => items.push(line.to_string()),
            None => items.iter_mut().last().into_iter().for_each(|item| *item += line),
        }
    }
    assert_eq!(items.len(), 14);
    let run = items.iter().filter(|item| !item.contains("<!-- not run: "));
    run.flat_map(|item| {
        let commands = item.split('`').skip(1).step_by(2).filter(|span| span.starts_with("backdrive ")).map(str::to_string);
        let is_long = item.contains("<!-- long -->");
        commands.map(move |command| Shown { command, is_long }).collect::<Vec<_>>()
    })
    .collect()
}

/// The commands of the gallery that need no Python, in their order; those that take longer are long.
fn gallery() -> Vec<Shown> {
    let lines = blocks("docs/gallery/README.md").into_iter().flat_map(|block| {
        // What follows a heredoc's begin is another program's.
        let shell: Vec<String> = block.commands.lines().take_while(|line| !line.starts_with("python ")).map(str::to_string).collect();
        shell
    });
    let long = |command: &str| ["identify", "--sweep", "diagnose", "compare", "--gain 0.3"].iter().any(|word| command.contains(word));
    lines.filter(|line| line.starts_with("backdrive ")).map(|command| Shown { is_long: long(&command), command }).collect()
}

/// Runs commands of a page in order in one folder. Each must be taken as it stands: exit codes 0, 1 and 7 are answers.
fn run_in_order(shown: Vec<Shown>) -> Vec<(String, i32)> {
    let place = Place::new();
    for folder in ["launch", "plant"] {
        std::os::unix::fs::symlink(file(folder), place.path(folder)).unwrap();
    }
    let program = Path::new(env!("CARGO_BIN_EXE_backdrive")).parent().unwrap().display().to_string();
    let search = format!("{program}:{}", std::env::var("PATH").unwrap_or_default());
    let is_long = is_long();
    let mut codes = Vec::new();
    for Shown { command, .. } in shown.into_iter().filter(|shown| is_long || !shown.is_long) {
        let mut shell = Command::new("bash");
        shell.arg("-c").arg(&command).current_dir(place.path("")).env("PATH", &search).env("TMPDIR", place.path("tmp"));
        let output = shell.output().unwrap();
        let said = format!("{}{}", String::from_utf8_lossy(&output.stdout), String::from_utf8_lossy(&output.stderr));
        println!("{command}\n{said}");
        let code = output.status.code().unwrap_or(-1);
        assert!([0, 1, 7].contains(&code), "{command} ends with {code}:\n{said}");
        codes.push((command, code));
    }
    codes
}

#[test]
fn the_readme_s_two_doors_work_as_they_stand() {
    let lines = std::fs::read_to_string(file("README.md")).unwrap().lines().count();
    assert!(lines <= 100, "{lines} lines: a stranger reads it in a minute");
    assert_eq!(blocks("README.md").len(), 2);
    follow(&Place::new(), "README.md");
}

#[test]
fn every_command_of_the_guide_s_list_works_in_its_order_in_one_folder() {
    let codes = run_in_order(fourteen());
    assert!(codes.len() >= 7, "{codes:?}");
    let code = |begin: &str| codes.iter().find(|(command, _)| command.starts_with(begin)).unwrap_or_else(|| panic!("{begin}: {codes:?}")).1;
    // The question why concerns the run that oscillates, not an earlier one.
    assert_eq!((code("backdrive run launch/contact.toml --lambda 6"), code("backdrive why shaking.mcap")), (1, 1));
    assert_eq!(code("backdrive run shaking.mcap --lambda 1"), 0);
}

#[test]
fn every_command_of_the_gallery_works_in_its_order_in_one_folder() {
    let codes = run_in_order(gallery());
    assert!(codes.len() >= 6, "{codes:?}");
}

#[test]
fn two_runs_of_one_graph_keep_both_recordings() {
    let place = Place::new();
    for folder in ["launch", "plant"] {
        std::os::unix::fs::symlink(file(folder), place.path(folder)).unwrap();
    }
    let run = |more: &[&str]| {
        let ended = place.backdrive(&[&["run", "launch/contact.toml", "--transport", "inproc", "--duration", "2.4"], more].concat());
        assert!(matches!(ended.code, Some(0 | 1)), "{ended:?}");
        ended.stdout
    };
    assert_names(run(&[]), &["/contact.mcap (complete)"]);
    let first = std::fs::read(place.path("contact.mcap")).unwrap();
    let second = run(&["--lambda", "6", "--canceller", "none"]);
    assert_names(&second, &["/contact-2.mcap (complete)", "backdrive why contact-2.mcap"]);
    assert_eq!(std::fs::read(place.path("contact.mcap")).unwrap(), first);
    // What is named on the command line is still not replaced without being asked to.
    let named = place.backdrive(&["run", "launch/contact.toml", "--transport", "inproc", "--bag", "contact.mcap"]);
    named.ends(3, &["--overwrite"]);
    // A bag runs again with all that it was run with.
    let again = place.backdrive(&["run", "contact-2.mcap", "--lambda", "0.3", "--bag", "again.mcap"]);
    assert_eq!(again.code, Some(0), "{again:?}");
    let model = |bag: &str| {
        let reader = backdrive_bags::Reader::open(&place.path(bag)).unwrap();
        reader.header().unwrap().graph_toml.clone()
    };
    let canceller = |text: &str| text.split("kind = \"canceller\"").nth(1).unwrap().split("[[").next().unwrap().trim().to_string();
    assert_eq!(canceller(&model("again.mcap")), canceller(&model("contact-2.mcap")));
    assert_names(model("again.mcap"), &["duration_s = 2.4"]);
}
