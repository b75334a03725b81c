//! An error is reported once, with its place and what to do; the exit code gives its sort; nothing panics and no existing file is lost.

#[path = "common/skipped.rs"]
mod skipped;
mod system;

use skipped::skipped;
use std::os::unix::process::CommandExt;
use std::path::Path;
use std::process::Command;
use system::assert_names;
use system::{Ended, Place, Running, file, graph_text};

/// One case: the command, its exit code, and the content of the error.
struct Case<'a> {
    arguments: Vec<&'a str>,
    code: i32,
    says: &'a [&'a str],
}

fn case<'a>(arguments: &[&'a str], code: i32, says: &'a [&'a str]) -> Case<'a> {
    Case { arguments: arguments.to_vec(), code, says }
}

/// The end is in order, and there is one error.
fn assert_told(what: &str, done: &Ended, code: i32, says: &[&str]) {
    assert_eq!(done.code, Some(code), "{what}: {done:?}");
    for text in says {
        assert!(done.stderr.contains(text), "{what}: standard error does not say \"{text}\": {}", done.stderr);
    }
    for text in ["panicked", "RUST_BACKTRACE", "unwrap"] {
        assert!(!done.stderr.contains(text) && !done.stdout.contains(text), "{what}: {done:?}");
    }
    let errors = done.stderr.lines().filter(|line| line.starts_with("error:")).count();
    assert_eq!(errors, 1, "{what}: {}", done.stderr);
    if code == 2 || code == 3 {
        assert_eq!(done.stdout, "", "{what}: results of nothing");
    }
}

/// Every case, and afterwards every file is unchanged, with none beside them.
fn check(place: &Place, cases: &[Case]) {
    let before = contents(place);
    for case in cases {
        let done = place.backdrive(&case.arguments);
        assert_told(&case.arguments.join(" "), &done, case.code, case.says);
        assert!(contents(place) == before, "{}: left or changed a file", case.arguments.join(" "));
    }
    place.assert_clean(&[]);
}

fn contents(place: &Place) -> Vec<(String, Vec<u8>)> {
    let entries = std::fs::read_dir(place.path(".")).unwrap().flatten();
    let ours = entries.filter(|e| e.path().is_file()).map(|e| (e.file_name().to_string_lossy().into_owned(), e.path()));
    let mut files: Vec<_> =
        ours.filter(|(name, _)| !name.starts_with("std")).map(|(name, path)| (name, std::fs::read(path).unwrap())).collect();
    files.sort();
    files
}

/// The contact graph with one thing replaced.
fn contact(place: &Place, name: &str, from: &str, to: &str) {
    let text = graph_text("launch/contact.toml");
    assert!(text.contains(from), "nothing to replace: {from}");
    place.write(name, &text.replacen(from, to, 1));
}

fn device(place: &Place, name: &str, from: &str, to: &str) {
    let text = std::fs::read_to_string(file("plant/models/rigid-mass.toml")).unwrap();
    assert!(text.contains(from), "nothing to replace: {from}");
    place.write(name, &text.replacen(from, to, 1));
}

#[test]
fn graphs() {
    let place = Place::new();
    place.write("good.toml", &graph_text("launch/contact.toml"));
    place.write("broken.toml", "title = \"x\"\nrate_hz 5000\n");
    contact(&place, "key.toml", "rate_hz = 5000", "rate_hz = 5000\nduraton_s = 3");
    contact(&place, "kind.toml", "kind = \"slave\"", "kind = \"slavee\"");
    contact(&place, "loop.toml", "delay = 1                   # the loop", "#");
    contact(&place, "two.toml", "[[connections]]", "[[connections]]\nfrom = \"scaling.command\"\nto = \"master.force\"\n\n[[connections]]");
    contact(&place, "topic.toml", "kind = \"operator\"", "kind = \"operator\"\ntopics = { intent = \"/master/measured_js\" }");
    contact(&place, "node.toml", "from = \"operator.intent\"", "from = \"opertor.intent\"");
    contact(&place, "port.toml", "from = \"operator.intent\"", "from = \"operator.intnt\"");
    contact(&place, "unfed.toml", "[[connections]]\nfrom = \"scaling.command\"\nto = \"slave.command\"\n", "");
    contact(&place, "name.toml", "name = \"scaling\"", "name = \"slave\"");
    contact(&place, "time.toml", "{ t = 0.60,", "{ t = 0.10,");
    contact(&place, "restart.toml", "kind = \"slave\"", "kind = \"slave\"\nrestart = true");
    place.write("empty.toml", "");
    place.write("none.toml", "rate_hz = 1000\n");
    place.write("lone.toml", "rate_hz = 1000\nduration_s = 0.2\n[[nodes]]\nname = \"operator\"\nkind = \"operator\"\n");
    let mass = file("plant/models/rigid-mass.toml");
    check(
        &place,
        &[
            case(&["run", "absent.toml"], 3, &["absent.toml", "there is no such file"]),
            case(&["check", "absent.toml"], 3, &["absent.toml", "there is no such file"]),
            case(&["run", "tmp"], 3, &["tmp", "is a folder"]),
            case(&["run", "broken.toml"], 3, &["broken.toml:2", "not valid TOML"]),
            case(&["run", "empty.toml"], 3, &["empty.toml", "rate_hz"]),
            case(&["run", "none.toml"], 3, &["none.toml", "has no [[nodes]]"]),
            case(&["run", "key.toml"], 3, &["key.toml:", "unknown key \"duraton_s\"", "did you mean \"duration_s\""]),
            case(&["check", "key.toml"], 3, &["did you mean \"duration_s\""]),
            case(&["run", "kind.toml"], 3, &["kind.toml:", "did you mean \"slave\""]),
            case(&["run", "loop.toml"], 3, &["loop.toml:", "a loop without delay", "scaling.backward", "delay = 1"]),
            case(&["run", "two.toml"], 3, &["two.toml:", "master.force", "one publisher per input"]),
            case(&["run", "topic.toml"], 3, &["topic.toml:", "/master/measured_js", "and so does operator.intent"]),
            case(&["run", "node.toml"], 3, &["node.toml:", "unknown node \"opertor\"", "did you mean \"operator\""]),
            case(&["run", "port.toml"], 3, &["port.toml:", "unknown output port \"intnt\"", "did you mean \"intent\""]),
            case(&["run", "unfed.toml"], 3, &["unfed.toml:", "nothing is connected to its input \"command\""]),
            case(&["run", "name.toml"], 3, &["name.toml:", "another node has this name"]),
            case(&["run", "time.toml"], 3, &["time.toml:", "times must increase"]),
            case(&["run", "restart.toml"], 3, &["restart.toml:", "needs clock = \"realtime\""]),
            case(&["run", "lone.toml", "--master", &mass], 3, &["lone.toml", "has no master node, so --master has no effect"]),
            case(&["run", "lone.toml", "--bag", "x.mcap"], 3, &["has no recorder node, so --bag has no effect"]),
            case(&["run", "good.toml", "--out", "folder"], 3, &["no [[experiments]]", "--bag"]),
            case(&["run", "good.toml", "--clock", "realtime", "--transport", "inproc"], 3, &["lockstep"]),
        ],
    );
}

#[test]
fn models() {
    let place = Place::new();
    place.write("graph.toml", &graph_text("launch/contact.toml"));
    device(&place, "negative.toml", "handle = ", "handle = -");
    device(&place, "free.toml", "[bodies]", "[bodies]\nloose = 0.0");
    device(&place, "key.toml", "measured = ", "mesured = ");
    let at = |path: &str| file(path);
    let (slave, master, two) = (at("plant/models/slave.toml"), at("plant/models/impulse-engine.toml"), at("plant/models/two-axis.toml"));
    let (grip, two_slave) = (at("plant/grips/normal.toml"), at("plant/models/slave-two-axis.toml"));
    for transport in ["iceoryx2", "inproc"] {
        let run = |option: &'static str, file: &str| -> Vec<String> {
            ["run", "graph.toml", "--transport", transport, "--canceller", "none", option, file].map(str::to_string).to_vec()
        };
        let told: [(Vec<String>, &[&str]); 10] = [
            (run("--master", "negative.toml"), &["negative.toml:", "bodies.handle: must be at least 0, is -"]),
            (run("--master", "free.toml"), &["free.toml:", "bodies.loose", "a free body without inertia"]),
            (run("--master", "key.toml"), &["key.toml:", "measured"]),
            (run("--master", "absent.toml"), &["absent.toml", "there is no such file"]),
            (run("--grip", "strange"), &["strange", "there is no such file"]),
            (run("--grip", &slave), &["slave.toml", "expected a fragment"]),
            (run("--master", &grip), &["normal.toml", "is a fragment"]),
            (run("--master", &slave), &["graph.toml", "node \"master\"", "as a master its feedback must be a force input"]),
            (run("--slave", &master), &["graph.toml", "node \"slave\"", "as a slave its feedback must be a motion input"]),
            (run("--slave", &two_slave), &["graph.toml:", "axes"]),
        ];
        let cases: Vec<Case> =
            told.iter().map(|(words, says)| case(&words.iter().map(String::as_str).collect::<Vec<_>>(), 3, says)).collect();
        check(&place, &cases);
    }
    check(
        &place,
        &[
            case(&["run", "graph.toml", "--master", &two], 3, &["graph.toml:", "master has 2 axes and canceller has 1"]),
            case(&["model", "check", "negative.toml"], 3, &["negative.toml:", "must be at least 0"]),
            case(&["model", "check", "free.toml"], 3, &["free.toml:", "a free body without inertia"]),
            case(&["model", "show", "absent.toml"], 3, &["there is no such file"]),
            case(&["model", "show", &master, "--amplitude", "0"], 2, &["--amplitude must be above 0"]),
        ],
    );
}

#[test]
fn arguments() {
    let place = Place::new();
    place.write("graph.toml", &graph_text("launch/contact.toml"));
    let with = |option: &'static str, value: &'static str| ["run", "graph.toml", option, value];
    check(
        &place,
        &[
            case(&with("--lambda", "-1"), 2, &["'-1' for '--lambda", "must be at least 0"]),
            case(&with("--mu", "-0.5"), 2, &["--mu", "must be at least 0"]),
            case(&with("--lambda", "nan"), 2, &["--lambda", "must be a finite number"]),
            case(&with("--lambda", "much"), 2, &["--lambda", "must be a finite number"]),
            case(&with("--high-pass", "-1"), 2, &["--high-pass", "must be at least 0"]),
            case(&with("--rate", "20000"), 2, &["--rate", "must be at most 10000"]),
            case(&with("--rate", "0"), 2, &["--rate", "must be above 0"]),
            case(&with("--duration", "-3"), 2, &["--duration", "must be above 0"]),
            case(&with("--duration", "inf"), 2, &["--duration", "must be a finite number"]),
            case(&with("--seed", "x"), 2, &["--seed"]),
            case(&with("--clock", "sundial"), 2, &["--clock", "lockstep", "realtime"]),
            case(&with("--sensors", "good"), 2, &["--sensors", "ideal"]),
            case(&with("--lamda", "1"), 2, &["--lamda", "--lambda"]),
            case(&with("--dither", "nonsense"), 3, &["dither", "nonsense", "multisine"]),
            case(&with("--dither", "multisine:peak=x,from=1,to=500,period=2"), 3, &["dither", "peak", "expected a number"]),
            case(&with("--dither", "sweep:amplitude=1"), 3, &["dither", "missing key \"from\""]),
            case(&with("--bag", "absent/x.mcap"), 5, &["absent/x.mcap", "cannot be written", "No such file"]),
            case(&with("--bag", "/dev/null"), 5, &["/dev/null", "cannot be written", "name a file"]),
            case(&with("--bag", "tmp"), 5, &["tmp", "cannot be written", "directory"]),
            // A slip must not cost a file that is no bag.
            case(&with("--bag", "graph.toml"), 3, &["graph.toml", "exists and is not a bag"]),
        ],
    );
    assert_eq!(place.backdrive(&["frobnicate"]).code, Some(2));
    assert_eq!(place.backdrive(&[]).code, Some(2));
}

#[test]
fn tables() {
    let place = Place::new();
    place.write("nan.csv", "t,motor_position,feedback_force\n0,0,0\n0.001,nan,1\n0.002,0,1\n");
    place.write("empty.csv", "");
    for name in ["text.parquet", "text.mat", "text.bag", "text.db3"] {
        place.write(name, "t,x\n0,1\n");
    }
    place.write("stub.parquet", "PAR1");
    place.write("stub.mat", "MATLAB 5.0 MAT-file");
    place.write("stub.db3", "SQLite format 3\0");
    std::fs::create_dir(place.path("nothing")).unwrap();
    place.write("heading.csv", "t,motor_position\n");
    place.write("back.csv", "t,x\n0,1\n0.001,2\n0.0005,3\n");
    place.write("untimed.csv", "time,x\n0,1\n");
    place.write("ragged.csv", "t,x\n0,1\n0.001\n");
    contact(&place, "played.toml", "kind = \"scaling\"", "kind = \"scaling\"\ndither = \"recorded:file=back.csv,column=x\"");
    let model = file("plant/models/impulse-engine.toml");
    check(
        &place,
        &[
            case(&["bag", "import", "absent.csv", "--bag", "x.mcap"], 3, &["absent.csv", "there is no such file or folder"]),
            case(&["bag", "import", "empty.csv", "--bag", "x.mcap"], 3, &["empty.csv", "is empty", "heading"]),
            case(&["bag", "import", "heading.csv", "--bag", "x.mcap"], 3, &["heading.csv", "no rows"]),
            case(&["bag", "import", "back.csv", "--bag", "x.mcap"], 3, &["back.csv, line 4", "time goes back from 0.001 to 0.0005"]),
            case(&["bag", "import", "untimed.csv", "--bag", "x.mcap"], 3, &["untimed.csv", "no column \"t\"", "time"]),
            case(&["bag", "import", "ragged.csv", "--bag", "x.mcap"], 3, &["ragged.csv, line 3"]),
            case(&["bag", "import", "nan.csv", "--bag", "x.mcap", "--map", "motor_position"], 2, &["--map", "COLUMN=TOPIC.FIELD[AXIS]"]),
            case(&["bag", "import", "nan.csv", "--bag", "x.mcap"], 3, &["nan.csv, line 3", "motor_position", "expected a number"]),
            case(&["bag", "import", "nan.csv", "--bag", "back.csv"], 3, &["back.csv", "exists and is not a bag"]),
            case(&["bag", "import", "text.parquet", "--bag", "x.mcap"], 3, &["text.parquet", "not a parquet file", "PAR1"]),
            case(&["bag", "import", "stub.parquet", "--bag", "x.mcap"], 3, &["stub.parquet", "not a whole parquet file"]),
            case(&["bag", "import", "text.mat", "--bag", "x.mcap"], 3, &["text.mat", "version 5", "-v7"]),
            case(&["bag", "import", "stub.mat", "--bag", "x.mcap"], 3, &["stub.mat", "ends at byte 19"]),
            case(&["bag", "import", "text.bag", "--bag", "x.mcap"], 3, &["text.bag", "#ROSBAG V2.0"]),
            case(&["bag", "import", "text.db3", "--bag", "x.mcap"], 3, &["text.db3", "SQLite format 3"]),
            case(&["bag", "import", "stub.db3", "--bag", "x.mcap"], 3, &["stub.db3", "rosbag2"]),
            case(&["bag", "import", "absent.bag", "--bag", "x.mcap"], 3, &["absent.bag", "there is no such file"]),
            case(&["bag", "import", "nothing", "--bag", "x.mcap"], 3, &["nothing", "neither a LeRobot dataset"]),
            case(&["bag", "import", "nan.csv", "--bag", "x.mcap", "--episode", "1"], 2, &["--episode", "LeRobot"]),
            case(&["bag", "import", "nan.csv", "--bag", "x.mcap", "--variable", "log"], 3, &["nan.csv", "not a MATLAB file"]),
            case(&["bag", "import", "back.csv", "back.csv", "--bag", "x"], 2, &["would both become"]),
            case(&["simulate", &model, "nan.csv", "--out", "x.csv"], 3, &["nan.csv:3", "motor_position", "expected a number"]),
            case(&["simulate", &model, "empty.csv", "--out", "x.csv"], 3, &["empty.csv", "is empty"]),
            case(&["simulate", &model, "absent.csv", "--out", "x.csv"], 3, &["absent.csv", "there is no such file"]),
            case(&["simulate", &model, "sweep:amplitude=2", "--out", "x.csv"], 3, &["missing key \"from\""]),
            case(&["run", "played.toml"], 3, &["played.toml", "back.csv:4", "t does not rise"]),
        ],
    );
}

#[test]
fn bags() {
    let place = Place::new();
    place.write("graph.toml", &graph_text("launch/contact.toml"));
    assert_eq!(place.backdrive(&["run", "graph.toml", "--transport", "inproc", "--bag", "good.mcap", "--duration", "2"]).code, Some(0));
    let whole = std::fs::read(place.path("good.mcap")).unwrap();
    std::fs::write(place.path("cut.mcap"), &whole[..whole.len() / 2]).unwrap();
    std::fs::write(place.path("stub.mcap"), &whole[..100]).unwrap();
    let mut damaged = whole.clone();
    // Inside the second compressed chunk.
    let chunks = whole.windows(4).enumerate().filter(|(_, bytes)| *bytes == [0x04, 0x22, 0x4d, 0x18]);
    let inside = chunks.map(|(at, _)| at + 1000).nth(1).unwrap();
    damaged[inside..inside + 64].fill(0x55);
    std::fs::write(place.path("damaged.mcap"), damaged).unwrap();
    std::fs::write(place.path("zero.mcap"), b"").unwrap();
    place.write("table.csv", "t,x\n0,1\n0.001,2\n0.002,3\n");
    assert_eq!(place.backdrive(&["bag", "import", "table.csv", "--bag", "foreign.mcap"]).code, Some(0));
    place.write("lone.toml", "rate_hz = 1000\nduration_s = 0.2\n[[nodes]]\nname = \"exciter\"\nkind = \"exciter\"\nforce = \"steps:amplitude=1,hold=0.1\"\n[[nodes]]\nname = \"recorder\"\nkind = \"recorder\"\n");
    assert_eq!(place.backdrive(&["run", "lone.toml", "--transport", "inproc", "--bag", "lone.mcap"]).code, Some(0));
    let no_bag: &[&str] = &["graph.toml", "is not an MCAP file"];
    check(
        &place,
        &[
            case(&["bag", "info", "absent.mcap"], 3, &["absent.mcap: there is no such file"]),
            case(&["bag", "export", "absent.mcap", "--out", "x.csv"], 3, &["absent.mcap: there is no such file"]),
            case(&["bag", "recover", "absent.mcap", "--bag", "x.mcap"], 3, &["absent.mcap: there is no such file"]),
            case(&["bag", "merge", "good.mcap", "absent.mcap", "--bag", "x.mcap"], 3, &["absent.mcap: there is no such file"]),
            case(&["bag", "diff", "good.mcap", "absent.mcap"], 3, &["absent.mcap: there is no such file"]),
            case(&["bag", "play", "absent.mcap"], 3, &["absent.mcap: there is no such file"]),
            case(&["replay", "absent.mcap"], 3, &["absent.mcap: there is no such file"]),
            case(&["bag", "info", "."], 3, &["is a folder, expected a file"]),
            case(&["bag", "export", "good.mcap", "--out", "good.mcap", "--overwrite"], 3, &["good.mcap", "which is an input"]),
            case(&["bag", "import", "table.csv", "absent.csv", "--bag", "x"], 3, &["absent.csv: there is no such file"]),
            case(&["bag", "info", "graph.toml"], 3, no_bag),
            case(&["replay", "graph.toml"], 3, no_bag),
            case(&["bag", "export", "graph.toml", "--csv", "x.csv"], 3, no_bag),
            case(&["bag", "diff", "good.mcap", "graph.toml"], 3, no_bag),
            case(&["bag", "play", "graph.toml"], 3, no_bag),
            case(&["bag", "recover", "graph.toml", "--bag", "x.mcap"], 3, no_bag),
            case(&["bag", "info", "zero.mcap"], 3, &["zero.mcap", "is not an MCAP file"]),
            case(&["replay", "foreign.mcap"], 3, &["foreign.mcap", "no graph to run"]),
            case(&["replay", "lone.mcap"], 3, &["lone.mcap", "no operator"]),
            case(&["replay", "stub.mcap"], 3, &["stub.mcap"]),
            case(
                &["replay", "damaged.mcap"],
                3,
                &["damaged.mcap, byte", "`backdrive bag recover damaged.mcap --bag damaged-saved.mcap` recovers the intact part"],
            ),
            case(&["replay", "good.mcap", "--bag", "good.mcap"], 3, &["good.mcap", "is the bag that is replayed"]),
            case(&["replay", "good.mcap", "--bag", "./tmp/../good.mcap"], 3, &["good.mcap", "is the bag that is replayed"]),
            case(&["replay", "good.mcap", "--bag", "graph.toml"], 3, &["graph.toml", "exists and is not a bag"]),
            case(&["bag", "export", "good.mcap", "--csv", "x.csv", "--topic", "/nope"], 3, &["has no topic /nope", "/master/measured_js"]),
            case(&["bag", "recover", "cut.mcap", "--bag", "cut.mcap"], 3, &["cut.mcap", "is the bag that is read"]),
            case(&["bag", "diff", "good.mcap", "good.mcap", "--tolerance", "x"], 2, &["--tolerance", "TOPIC=VALUE"]),
            case(&["bag", "play", "good.mcap", "--speed", "0"], 2, &["--speed must be above 0"]),
        ],
    );

    // Cut off behind its header, its graph, and all its files.
    let first_chunk = whole.windows(4).position(|bytes| bytes == [0x04, 0x22, 0x4d, 0x18]).unwrap();
    let model = system::file("plant/models/rigid-mass.toml");
    for length in [100, first_chunk / 2, first_chunk] {
        std::fs::write(place.path("begun.mcap"), &whole[..length]).unwrap();
        for words in [
            &["stability"][..],
            &["why"],
            &["replay"],
            &["inspect"],
            &["bag", "export", "--out", "x.csv"],
            &["simulate", &model, "--out", "x.csv"],
            &["diagnose", "--model", &model, "--out", "x"],
            &["init", ".", "--yes", "--recording"],
        ] {
            let told = place.backdrive(&[words, &["begun.mcap"]].concat());
            let says = "begun.mcap: the file was not closed and is cut off before its first message";
            let says = if words[0] == "bag" { says.trim_start_matches("begun.mcap: ") } else { says };
            assert!(told.code == Some(3) && told.stderr.contains(says), "{words:?} {length}: {told:?}");
        }
        let told = place.backdrive(&["bag", "info", "begun.mcap"]);
        assert!(told.code == Some(4) && told.stdout.contains("cut off before its first message; record it again"), "{told:?}");
    }

    // A bag that was cut off is still a bag.
    let told = place.backdrive(&["bag", "info", "cut.mcap"]);
    assert_eq!(told.code, Some(4), "{told:?}");
    assert_names(&told.stdout, &["backdrive bag recover cut.mcap --bag cut-saved.mcap"]);
    let told = place.backdrive(&["bag", "info", "damaged.mcap", "--check"]);
    told.answers(4, &["byte"]);
    let told = place.backdrive(&["replay", "cut.mcap", "--json"]);
    assert_eq!(told.code, Some(7), "{told:?}");
    assert_names(&told.stderr, &["cut.mcap", "bag recover"]);
    let steps = told.json()["steps"].as_u64().unwrap();
    assert!((1000..10_000).contains(&steps), "{steps}");
    for bag in ["cut", "damaged"] {
        let (from, to) = (format!("{bag}.mcap"), format!("{bag}-saved.mcap"));
        let told = place.backdrive(&["bag", "recover", &from, "--bag", &to]);
        assert!(told.code == Some(4) && place.path(&to).is_file(), "{told:?}");
        // What could not be saved is still missing from it.
        assert_eq!(place.backdrive(&["bag", "info", &to]).code, Some(4));
    }
    let told = place.backdrive(&["replay", "cut-saved.mcap"]);
    assert!(told.code == Some(7) && !told.stderr.contains("not closed"), "{told:?}");
    assert_eq!(std::fs::read(place.path("good.mcap")).unwrap(), whole);
}

/// A run whose bag meets the end of the room.
fn assert_cut_off(place: &Place, what: &str, done: &Ended, bag: &Path, says: &str) {
    assert_told(what, done, 5, &[says, "bag recover"]);
    let saved = place.path(&format!("{what}-saved.mcap"));
    let told = place.backdrive(&["bag", "recover", &bag.display().to_string(), "--bag", &saved.display().to_string()]);
    assert_eq!(told.code, Some(4), "{told:?}");
    let rows = system::samples(&saved, "/master/measured_js");
    assert!(rows.len() > 1000 && rows.iter().enumerate().all(|(k, s)| s.step == k as u64), "{what}: {} steps saved", rows.len());
}

#[test]
fn a_full_disk() {
    let place = Place::new();
    place.write("graph.toml", &graph_text("launch/contact.toml"));
    for transport in ["inproc", "iceoryx2"] {
        let done = place.backdrive(&["run", "graph.toml", "--transport", transport, "--bag", "/dev/full", "--duration", "0.5"]);
        assert_told(transport, &done, 5, &["/dev/full", "No space left on device"]);
    }
    // A size that a user's files may not exceed.
    let mut command = place.command(env!("CARGO_BIN_EXE_backdrive"));
    command.args(["run", "graph.toml", "--transport", "inproc", "--bag", "limited.mcap"]);
    // SAFETY: between fork and exec only a system call.
    unsafe {
        command.pre_exec(|| Ok(nix::sys::resource::setrlimit(nix::sys::resource::Resource::RLIMIT_FSIZE, 1 << 20, 1 << 20)?));
    }
    let done = Running::start(&place, command).end();
    assert_cut_off(&place, "limited", &done, &place.path("limited.mcap"), "File too large");

    // A small disk, where mounting one is allowed.
    std::fs::create_dir(place.path("disk")).unwrap();
    let script = "mount -t tmpfs -o size=1m none disk || exit 77; \"$0\" run graph.toml --bag disk/run.mcap; code=$?; cp disk/run.mcap kept.mcap; exit $code";
    let Some(done) = privileged(&place, script) else { return };
    assert_cut_off(&place, "disk", &done, &place.path("kept.mcap"), "No space left on device");
    assert!(done.stdout.contains("cut off"), "{done:?}");
    place.assert_clean(&[]);
}

/// Runs a script with mounts of its own, or reports that this is not allowed here.
fn privileged(place: &Place, script: &str) -> Option<Ended> {
    // SAFETY: has no preconditions and cannot fail.
    let root = unsafe { nix::libc::geteuid() } == 0;
    let mut command = place.command("unshare");
    command.args(if root { &["--mount"][..] } else { &["--mount", "--map-root-user"] });
    command.args(["sh", "-c", script, env!("CARGO_BIN_EXE_backdrive")]);
    let probe = Command::new("unshare").args(if root { &["--mount"][..] } else { &["--mount", "--map-root-user"] }).arg("true").output();
    if !probe.is_ok_and(|p| p.status.success()) {
        skipped("unshare and mount are not allowed here");
        return None;
    }
    let done = Running::start(place, command).end();
    if done.code == Some(77) {
        skipped("mount is not allowed here");
        return None;
    }
    Some(done)
}

#[test]
fn no_right_to_shared_memory() {
    let place = Place::new();
    place.write("graph.toml", &graph_text("launch/contact.toml"));
    let script = "mount -t tmpfs -o ro none /dev/shm || exit 77; exec \"$0\" run graph.toml --duration 0.2 --bag run.mcap";
    let Some(done) = privileged(&place, script) else { return };
    assert_told("read-only shared memory", &done, 5, &["/dev/shm", "cannot be written", "mode should be 1777"]);
    assert!(!place.path("run.mcap").exists(), "a bag of nothing");
    let script = "mount -t tmpfs -o size=1m none /dev/shm || exit 77; exec \"$0\" run graph.toml --duration 0.2 --bag run.mcap";
    let Some(done) = privileged(&place, script) else { return };
    assert_told("little shared memory", &done, 5, &["/dev/shm", "nearly full", "--shm-size"]);
    // In one process it is not needed.
    let script =
        "mount -t tmpfs -o ro none /dev/shm || exit 77; exec \"$0\" run graph.toml --duration 0.2 --transport inproc --bag run.mcap";
    let Some(done) = privileged(&place, script) else { return };
    // Nothing is touched in so short a run.
    assert_eq!(done.code, Some(7), "{done:?}");
    place.assert_clean(&[]);
}

#[test]
fn no_right_to_real_time_is_told_and_does_not_stop_a_run() {
    let _alone = system::alone();
    let place = Place::new();
    place.write("graph.toml", &graph_text("launch/contact.toml"));
    let mut command = place.command(env!("CARGO_BIN_EXE_backdrive"));
    command.args(["run", "graph.toml", "--clock", "realtime", "--rate", "500", "--duration", "0.5", "--bag", "run.mcap", "--json"]);
    // SAFETY: between fork and exec only system calls.
    unsafe {
        command.pre_exec(|| {
            use nix::libc::{PR_CAPBSET_DROP, prctl};
            use nix::sys::resource::{Resource, setrlimit};
            const CAP_IPC_LOCK: u64 = 14;
            const CAP_SYS_NICE: u64 = 23;
            // Who is not root has none to drop.
            prctl(PR_CAPBSET_DROP, CAP_SYS_NICE, 0, 0, 0);
            prctl(PR_CAPBSET_DROP, CAP_IPC_LOCK, 0, 0, 0);
            setrlimit(Resource::RLIMIT_RTPRIO, 0, 0)?;
            setrlimit(Resource::RLIMIT_MEMLOCK, 65536, 65536)?;
            Ok(())
        });
    }
    let done = Running::start(&place, command).end();
    assert_eq!(done.code, Some(7), "{done:?}");
    let report = done.json();
    assert_eq!((&report["steps"], &report["lost"], &report["complete"]), (&250.into(), &0.into(), &true.into()));
    for node in ["operator", "master", "canceller", "scaling", "slave"] {
        let told = system::events(&place.path("run.mcap"), node);
        let refused = told.iter().filter(|(_, kind, _)| kind == "realtime_refused").count();
        assert_eq!(refused, 1, "{node}: {told:?}");
        assert!(done.stderr.contains(&format!("{node}: warning at step 0: SCHED_FIFO 50: ")), "{}", done.stderr);
    }
    assert_names(&done.stderr, &["RLIMIT_RTPRIO", "RLIMIT_MEMLOCK"]);
    place.assert_clean(&[]);
}
