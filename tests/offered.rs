//! Every command that a terminal, a page or JSON offers works when it is pasted into the shell of the folder.
//!
//! The commands are collected from what the verbs print and write, and each is run as it stands, in its order, in the same folder. Of commands that
//! search for minutes (`diagnose` with more effort) the effort is reduced before they are run: what they name is checked nevertheless.

#[path = "../diagnosis/tests/arms/common/mod.rs"]
mod arms;
mod system;

use arms::{AS_STATED, Beside, set};
use serde_json::Value;
use std::collections::BTreeSet;
use std::path::Path;
use std::process::Command;
use system::{Ended, Place, file};

/// A folder that looks like the project's.
fn place() -> Place {
    let place = Place::new();
    for folder in ["launch", "plant"] {
        std::os::unix::fs::symlink(file(folder), place.path(folder)).unwrap();
    }
    place
}

/// Commands in a text of a terminal: lines of their own, behind a label, or at the end of a sentence.
fn in_text(text: &str) -> Vec<String> {
    let found = text.lines().filter_map(|line| {
        let trimmed = line.trim_start();
        let labelled = trimmed.strip_prefix("next ").or(trimmed.strip_prefix("again ")).unwrap_or(trimmed).trim_start();
        let behind = || line.split_once("clean copy: ").map(|(_, command)| command);
        Some(labelled).filter(|line| line.starts_with("backdrive ")).or_else(behind)
    });
    found.map(str::to_string).collect()
}

/// Commands on a page: blocks of code and cells of tables.
fn in_page(page: &str) -> Vec<String> {
    let plain = |text: &str| {
        let named = [("&lt;", "<"), ("&gt;", ">"), ("&quot;", "\""), ("&#39;", "'"), ("&amp;", "&")];
        named.iter().fold(text.to_string(), |text, (name, sign)| text.replace(name, sign))
    };
    let between = |begin: &str, end: &str| -> Vec<String> {
        page.split(begin).skip(1).filter_map(|rest| rest.split(end).next()).map(plain).collect()
    };
    let cells = between("<td", "</td>").into_iter().filter_map(|cell| cell.split_once('>').map(|(_, text)| text.to_string()));
    let all = between("<pre><code>", "</code></pre>").into_iter().chain(cells);
    let lines: Vec<String> = all.flat_map(|text| text.lines().map(str::to_string).collect::<Vec<_>>()).collect();
    lines.into_iter().filter(|line| line.starts_with("backdrive ")).collect()
}

/// Commands in JSON.
fn in_json(value: &Value, found: &mut Vec<String>) {
    match value {
        Value::String(text) if text.starts_with("backdrive ") => found.push(text.clone()),
        Value::Array(list) => list.iter().for_each(|one| in_json(one, found)),
        Value::Object(map) => map.values().for_each(|one| in_json(one, found)),
        _ => {}
    }
}

/// What a place offers so far.
#[derive(Default)]
struct Offers(Vec<String>);

impl Offers {
    /// Hears a command that has ended, and looks at the page that it wrote.
    fn hear(&mut self, place: &Place, ended: &Ended, page: Option<&str>) {
        match serde_json::from_str::<Value>(&ended.stdout) {
            Ok(json) => in_json(&json, &mut self.0),
            Err(_) => self.0.extend(in_text(&ended.stdout)),
        }
        self.0.extend(in_text(&ended.stderr));
        if let Some(page) = page {
            self.0.extend(in_page(&std::fs::read_to_string(place.path(page)).unwrap()));
        }
    }

    /// Runs each once, as it stands.
    fn run(&self, place: &Place) -> usize {
        let program = Path::new(env!("CARGO_BIN_EXE_backdrive")).parent().unwrap().display().to_string();
        let search = format!("{program}:{}", std::env::var("PATH").unwrap_or_default());
        let mut done = BTreeSet::new();
        for command in self.0.iter().filter(|command| done.insert((*command).clone())) {
            for placeholder in ["GRAPH", "MASTER", "MODEL", "RUN.mcap", "RECORDING", "LAMBDA", " SET ", "FILE"] {
                assert!(!command.contains(placeholder), "{command}: has a placeholder");
            }
            let short = command.split(" --effort ").next().filter(|short| short.len() < command.len());
            let run = short.map_or_else(|| command.clone(), |short| format!("{short} --effort 0.1"));
            let mut shell = Command::new("bash");
            shell.arg("-c").arg(&run).current_dir(place.path("")).env("PATH", &search).env("TMPDIR", place.path("tmp"));
            let output = shell.output().unwrap();
            let said = format!("{}{}", String::from_utf8_lossy(&output.stdout), String::from_utf8_lossy(&output.stderr));
            let code = output.status.code();
            println!("{code:?} {command}");
            assert!(matches!(code, Some(0 | 1 | 7)), "{command} ends with {code:?}:\n{said}");
        }
        done.len()
    }
}

#[test]
fn what_is_offered_after_runs_and_answers_works_as_it_stands() {
    let place = place();
    std::fs::create_dir(place.path("out")).unwrap();
    let mut offers = Offers::default();
    let mut ask = |arguments: &[&str], page: Option<&str>| {
        let html: Vec<&str> = page.map(|page| vec!["--html", page]).unwrap_or_default();
        let ended = place.backdrive(&[arguments, &html].concat());
        assert!(matches!(ended.code, Some(0 | 1 | 4 | 7)), "{arguments:?}: {ended:?}");
        offers.hear(&place, &ended, page);
    };
    let run = ["run", "launch/contact.toml", "--transport", "inproc", "--duration", "2.4"];
    let none = ["--canceller", "none", "--lambda", "6"];
    ask(&[&run[..], &none, &["--bag", "out/it's shaking.mcap"]].concat(), Some("run.html"));
    ask(
        &[&run[..], &["--master", "plant/models/rigid-mass.toml", "--canceller", "none", "--bag", "calm.mcap"]].concat(),
        Some("calm.html"),
    );
    ask(&["why", "out/it's shaking.mcap"], Some("why.html"));
    ask(&["why", "out/it's shaking.mcap", "--json"], None);
    ask(&["stability", "out/it's shaking.mcap"], Some("shaking.html"));
    // What the question changed stands in the answer's commands too.
    ask(&["stability", "calm.mcap", "--gain", "1", "--grip", "plant/grips/firm.toml", "--json"], Some("firm.html"));
    ask(&["replay", "out/it's shaking.mcap", "--lambda", "3", "--limits", "ignored"], Some("replay.html"));
    let firm = offers.0.iter().filter(|c| c.contains("--html") && c.starts_with("backdrive replay calm.mcap"));
    assert!(firm.clone().count() > 0 && firm.clone().all(|c| c.contains("--grip plant/grips/firm.toml")), "{:?}", offers.0);
    assert!(offers.0.iter().any(|c| c.contains("--limits ignored") && c.contains("--bag")), "{:?}", offers.0);
    assert!(offers.0.iter().any(|c| c.contains("'out/it'\\''s shaking.mcap'")), "{:?}", offers.0);
    let ran = offers.run(&place);
    assert!(ran >= 10, "{ran}: {:?}", offers.0);
}

#[test]
fn what_is_offered_after_a_damaged_bag_works_as_it_stands() {
    let place = place();
    let whole = place.backdrive(&["run", "launch/contact.toml", "--transport", "inproc", "--duration", "2.4", "--bag", "whole.mcap"]);
    assert_eq!(whole.code, Some(0), "{whole:?}");
    let bytes = std::fs::read(place.path("whole.mcap")).unwrap();
    std::fs::write(place.path("cut.mcap"), &bytes[..bytes.len() * 3 / 4]).unwrap();
    let mut offers = Offers::default();
    for arguments in [&["replay", "cut.mcap"][..], &["stability", "cut.mcap"]] {
        offers.hear(&place, &place.backdrive(arguments), None);
    }
    let recover: Vec<String> = offers.0.iter().filter(|c| c.starts_with("backdrive bag recover cut.mcap --bag ")).cloned().collect();
    assert!(!recover.is_empty(), "{:?}", offers.0);
    let program = Path::new(env!("CARGO_BIN_EXE_backdrive")).parent().unwrap().display().to_string();
    let search = format!("{program}:{}", std::env::var("PATH").unwrap_or_default());
    let recovered = place.command("bash").env("PATH", search).args(["-c", &recover[0]]).output();
    let code = recovered.unwrap().status.code();
    // A part of a bag that was cut is lost, and the exit code shows this.
    assert!(matches!(code, Some(0 | 4)), "{code:?}");
}

#[test]
fn what_is_offered_for_recordings_of_ones_own_works_as_it_stands() {
    let place = place();
    let motor = "motion = \"rotation\"\nbodies = { rotor = 1.2e-4 }\n\
        elements = [ { name = \"bearing\", kind = \"damper\", between = [\"rotor\", \"ground\"], damping = 2e-4 },\n\
        { name = \"rubbing\", kind = \"coulomb\", between = [\"rotor\", \"ground\"], force = 4e-3 } ]\n\
        inputs = [ { name = \"torque\", kind = \"force\", on = \"rotor\" } ]\n\
        outputs = [ { name = \"angle\", kind = \"position\", of = \"rotor\", noise = 1e-4 } ]\n";
    place.write("motor.toml", motor);
    std::fs::create_dir(place.path("my motor")).unwrap();
    for (name, drive) in
        [("sweep", "sweep:amplitude=0.03,from=0.5,to=20,duration=2"), ("ramps", "triangle:amplitude=0.02,period=1,cycles=2")]
    {
        let out = format!("my motor/{name}.csv");
        let ended = place.backdrive(&["simulate", "motor.toml", drive, "--rate", "500", "--noise", "1", "--out", &out]);
        assert_eq!(ended.code, Some(0), "{ended:?}");
    }
    let mut offers = Offers::default();
    let words = "--motion rotation --driven force --drive torque --drive-unit Nm --position angle --position-unit rad --yes";
    let init: Vec<&str> = ["init", "my motor"].into_iter().chain(words.split(' ')).collect();
    let ended = place.backdrive(&init);
    assert_eq!(ended.code, Some(0), "{ended:?}");
    offers.hear(&place, &ended, None);
    assert_eq!(offers.0, ["backdrive diagnose 'my motor' --out 'my motor/diagnosis'"]);
    // So little effort that the search ends before everything was tried, and offers more.
    let ended = place.backdrive(&["diagnose", "my motor", "--effort", "0.1", "--out", "my motor/first"]);
    assert!(matches!(ended.code, Some(0 | 1 | 7)), "{ended:?}");
    offers.hear(&place, &ended, Some("my motor/first/report.html"));
    assert!(offers.0.iter().all(|c| !c.contains("--effort") || c.contains("--effort 0.2")), "{:?}", offers.0);
    // In JSON the same steps as on the terminal.
    let ended = place.backdrive(&["diagnose", "my motor", "--effort", "0.1", "--out", "my motor/first", "--json"]);
    let told = ended.json();
    assert!(told["verdict"].is_string() && told["next"].as_array().is_some_and(|steps| !steps.is_empty()), "{ended:?}");
    offers.hear(&place, &ended, None);
    // Numbers without a file, with one, and as JSON.
    let fit = ["fit", "my motor/model.toml", "my motor", "--effort", "0.1"];
    for more in [&[][..], &["--out", "my motor/fitted.toml"], &["--json"]] {
        let mut of_fit = Offers::default();
        let ended = place.backdrive(&[&fit[..], more].concat());
        assert!(matches!(ended.code, Some(0 | 1)), "{ended:?}");
        of_fit.hear(&place, &ended, None);
        let offered = |verb: &str| of_fit.0.iter().any(|command| command.starts_with(&format!("backdrive {verb}")));
        assert!(offered("diagnose 'my motor'") && offered(if more.contains(&"--out") { "simulate" } else { "fit" }), "{more:?}: {ended:?}");
        offers.0.extend(of_fit.0);
    }
    offers.run(&place);
}

#[test]
fn what_is_offered_for_an_arm_works_as_it_stands() {
    let place = place();
    std::fs::create_dir(place.path("my arm")).unwrap();
    set(&place.path("my arm"), &Beside { dry: [0.2, 0.3], ..AS_STATED }, "", |_| {});
    let mut offers = Offers::default();
    let ended = place.backdrive(&["diagnose", "my arm", "--out", "out"]);
    assert_eq!(ended.code, Some(1), "{ended:?}");
    offers.hear(&place, &ended, Some("out/report.html"));
    assert!(offers.0.iter().any(|command| command.contains("out/model.diagnosed.toml")), "{:?}", offers.0);
    assert!(offers.run(&place) >= 1, "{:?}", offers.0);
    // In JSON the same, under names that are free now.
    let mut offers = Offers::default();
    let ended = place.backdrive(&["diagnose", "my arm", "--out", "other", "--json"]);
    assert!(ended.json()["next"].as_array().is_some_and(|steps| !steps.is_empty()), "{ended:?}");
    offers.hear(&place, &ended, None);
    assert!(offers.run(&place) >= 1, "{:?}", offers.0);
}

/// A command that is put together by hand is not checked by anything.
#[test]
fn offered_commands_are_built_in_one_place() {
    let mut files = vec![std::path::PathBuf::from(file("src")), std::path::PathBuf::from(file("pages/src"))];
    let mut checked = 0;
    while let Some(path) = files.pop() {
        if path.is_dir() {
            files.extend(std::fs::read_dir(&path).unwrap().flatten().map(|entry| entry.path()));
            continue;
        }
        let text = std::fs::read_to_string(&path).unwrap();
        let name = path.display().to_string();
        // Examples of the help are run by the tests of the command line.
        if name.ends_with("src/offered.rs") || name.contains("/src/cli") {
            continue;
        }
        checked += 1;
        for line in text.lines().filter(|line| !line.trim_start().starts_with("//")) {
            let command = line.split("\"backdrive ").nth(1).and_then(|rest| rest.split('"').next());
            let built = command.is_some_and(|command| command.contains('{') || command.contains(".toml") || command.contains("--"));
            assert!(!built, "{name}: {}: build it by `Offered`", line.trim());
            assert!(!line.contains(".todo(\"") || name.ends_with("pages/src/parts.rs"), "{name}: {}: use `parts::todo`", line.trim());
        }
    }
    assert!(checked > 50, "{checked}");
}
