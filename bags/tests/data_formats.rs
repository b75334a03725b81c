//! Recordings in the formats of others: what pyarrow, scipy and rosbags wrote is read to the last bit, and they read what is written here, with the same types.
//!
//! `BACKDRIVE_PYTHON` names a Python that has them (`pip install numpy pandas pyarrow scipy rosbags`). Without it the tests are skipped, unless
//! `BACKDRIVE_REQUIRE_PYTHON=1`.

#[path = "../../tests/common/naming.rs"]
mod naming;

#[path = "../../tests/common/python.rs"]
mod python;

use backdrive_bags::{
    Contract, ImportOptions, LerobotOptions, MOST_BYTES, Reader, Signal, TableFormat, columns_of, export_lerobot, export_table,
    import_lerobot, import_rosbag, import_table, is_lerobot, is_rosbag, signals,
};
use backdrive_plant::model::Hold;
use naming::assert_names;
use python::python;
use serde_json::{Value, json};
use std::path::{Path, PathBuf};
use std::process::Command;

/// What the Python must have.
const NEEDS: &str = "with numpy, pandas, pyarrow, scipy and rosbags";

struct Written {
    python: PathBuf,
    folder: tempfile::TempDir,
    expected: Value,
}

impl Written {
    /// All files, by the writers of others.
    fn new() -> Option<Written> {
        let python = python(NEEDS)?;
        let folder = tempfile::tempdir().expect("a directory");
        let done = script(&python).arg("write").arg(folder.path()).output().expect("the Python of BACKDRIVE_PYTHON starts");
        assert!(done.status.success(), "{}", String::from_utf8_lossy(&done.stderr));
        let expected = std::fs::read_to_string(folder.path().join("expected.json")).expect("it is there");
        let expected = serde_json::from_str(&expected).expect("it is JSON");
        Some(Written { python, folder, expected })
    }

    fn path(&self, name: &str) -> PathBuf {
        self.folder.path().join(name)
    }

    /// What others read in a file.
    fn read(&self, file: &Path) -> Value {
        let done = script(&self.python).arg("read").arg(file).output().expect("the Python of BACKDRIVE_PYTHON starts");
        assert!(done.status.success(), "{}", String::from_utf8_lossy(&done.stderr));
        serde_json::from_slice(&done.stdout).expect("the script prints JSON")
    }
}

fn script(python: &Path) -> Command {
    let mut command = Command::new(python);
    command.arg(Path::new(env!("CARGO_MANIFEST_DIR")).join("../tests/python/data_formats.py"));
    command
}

/// The bits of a column as the script prints them.
fn bits(values: &[f64]) -> Vec<Value> {
    values.iter().map(|value| format!("{:016x}", value.to_bits()).into()).collect()
}

/// Columns of a bag by name, `t` first.
fn columns(bag: &Path) -> Vec<(String, Vec<f64>)> {
    let reader = Reader::open(bag).expect("it opens");
    // Every bit of every number, also of those that no recording may hold.
    let wanted: Vec<Signal> =
        columns_of(&reader, None).expect("it is read").into_iter().map(|signal| Signal { hold: Hold::Zero, ..signal }).collect();
    let found = signals(&reader, &wanted).expect("it is read");
    std::iter::once(("t".to_owned(), found.t)).chain(found.names.into_iter().zip(found.columns)).collect()
}

/// Holds a bag against what was written.
fn compare(bag: &Path, expected: &Value, what: &str) {
    let found = columns(bag);
    let expected = expected.as_object().expect("columns");
    for (name, told) in expected {
        let (_, values) = found.iter().find(|(found, _)| found == name).unwrap_or_else(|| panic!("{what}: {name} is missing"));
        assert_eq!(&bits(values), told[1].as_array().expect("numbers"), "{what}: {name}");
    }
    assert_eq!(found.len(), expected.len(), "{what}: {found:?}", found = found.iter().map(|(name, _)| name).collect::<Vec<_>>());
}

#[test]
fn tables_come_and_go_with_their_types() {
    let Some(written) = Written::new() else { return };
    let expected = &written.expected["typed"];
    for name in ["typed-snappy.parquet", "typed-zstd.parquet", "typed-gzip.parquet", "typed-none.parquet", "typed.mat", "packed.mat"] {
        let bag = written.path(&format!("{name}.mcap"));
        let report = import_table(&written.path(name), &bag, &ImportOptions::default()).expect(name);
        assert!(report.clock.is_empty() && report.skipped.is_empty(), "{name}: {report:?}");
        let mut all = expected.clone();
        if name.ends_with(".mat") {
            // Beside them a matrix, which becomes a column for each of its own.
            all.as_object_mut().expect("columns").extend(written.expected["matrix"].as_object().expect("columns").clone());
            assert_names(&report.notes[0], &["name (", "log ("]);
        }
        compare(&bag, &all, name);
        let reader = Reader::open(&bag).expect("it opens");
        for (format, ending) in [(TableFormat::Parquet, "parquet"), (TableFormat::Mat, "mat")] {
            let out = written.path(&format!("{name}-back.{ending}"));
            export_table(&reader, &out, format, None).expect("it is written");
            let mut back = written.read(&out);
            let columns = back.as_object_mut().expect("columns");
            // MATLAB has no brackets in its names.
            let names = columns.remove("names").unwrap_or_default();
            for name in ["q[0]", "q[1]"].into_iter().filter(|_| ending == "mat" && name.ends_with(".mat")) {
                let plain = name.replace(['[', ']'], "_");
                assert!(
                    names.as_array().is_some_and(|names| names.iter().any(|line| line == &Value::from(format!("{plain} = {name}")))),
                    "{names}"
                );
                let column = columns.remove(&plain).expect("it is there");
                columns.insert(name.to_owned(), column);
            }
            assert!(back == all, "{name} as {ending}: types or bits differ");
            // And here again, with the names of before.
            let again = written.path(&format!("{name}-{ending}-again.mcap"));
            import_table(&out, &again, &ImportOptions::default()).expect("it is imported");
            compare(&again, &all, &format!("{name} as {ending}, again"));
        }
    }
}

#[test]
fn odd_columns_of_parquet_are_told() {
    let Some(written) = Written::new() else { return };
    let bag = written.path("stamps.mcap");
    let report = import_table(&written.path("stamps.parquet"), &bag, &ImportOptions::default()).expect("it is imported");
    assert_eq!(report.skipped, ["words", "lists", "big"]);
    assert_names(&report.notes[0], &["\"t\"", "1700000000123456789"]);
    assert!(
        report.notes[1].contains("\"words\" holds text") && report.notes[3].contains("\"big\" holds whole numbers beyond 2^53"),
        "{report:?}"
    );
    compare(&bag, &written.expected["stamps"], "stamps");
    let error =
        import_table(&written.path("late.parquet"), &written.path("late.mcap"), &ImportOptions::default()).expect_err("a value is missing");
    assert_names(error.to_string(), &["late.parquet", "row 1", "\"late\""]);
    let asked = ImportOptions { time: "words".to_owned(), ..ImportOptions::default() };
    let error = import_table(&written.path("stamps.parquet"), &written.path("no.mcap"), &asked).expect_err("no time").to_string();
    assert_names(&error, &["\"words\""]);
    let asked = ImportOptions { time: "when".to_owned(), ..ImportOptions::default() };
    let error = import_table(&written.path("stamps.parquet"), &written.path("no.mcap"), &asked).expect_err("no time").to_string();
    assert!(
        error.contains("there is no column \"when\"; there is t, half") || error.contains("there is no column \"when\"; there is half"),
        "{error}"
    );
}

#[test]
fn what_is_easily_taken_for_something_else_is_not() {
    let Some(written) = Written::new() else { return };
    let bag = written.path("odd.mcap");
    let import = |name: &str| import_table(&written.path(name), &bag, &ImportOptions { overwrite: true, ..ImportOptions::default() });
    for unit in ["ns", "us", "ms"] {
        // Parquet has whole numbers for durations; what makes them such stands in Arrow's schema.
        let report = import(&format!("durations-{unit}.parquet")).expect(unit);
        assert_eq!((report.rows, report.skipped.as_slice()), (100, &["words".to_owned()][..]));
        let found = columns(&bag);
        assert_eq!((found[0].1[99], found[1].1[99]), (0.198, 49.5), "{unit}");
    }
    let says = |name: &str| import(name).expect_err(name).to_string();
    assert_names(says("words.parquet"), &["words.parquet", "a, b"]);
    assert!(says("twice.parquet").contains("both map to"));
    let report = import("odd.parquet").expect("it is imported");
    assert_eq!((report.topics.as_slice(), report.skipped.len()), (&["/recording/few".to_owned()][..], 4), "{report:?}");
    assert!(
        report.notes[0].contains("\"decimal\" holds decimal fractions") && report.notes[2].contains("\"when\" holds points in time"),
        "{report:?}"
    );
    assert_eq!(columns(&bag)[1].1[..2], [1.5, 2.5], "a dictionary of numbers");
}

#[test]
fn joints_that_change_their_places_are_told_and_read_by_their_names() {
    let Some(written) = Written::new() else { return };
    // The folder has lost what describes it.
    std::fs::remove_file(written.path("joints/metadata.yaml")).expect("it is there");
    let bag = written.path("joints.mcap");
    let report = import_rosbag(&written.path("joints"), &bag, false, MOST_BYTES).expect("it is imported");
    assert!(
        report.topics[0].notes[0].contains("message 2 has other joints") && report.topics[0].notes[0].contains("position[pan]"),
        "{report:?}"
    );
    let reader = Reader::open(&bag).expect("it opens");
    let of = |field: &str| signals(&reader, &[Signal::new("x", "/joint_states", field)]);
    let error = of("position[0]").expect_err("it is now one, now the other").to_string();
    assert_names(&error, &["pan, l.elbow; gripper", "position[pan]"]);
    let elbow = of("position[l.elbow]").expect("it is there");
    assert_eq!(elbow.columns[0], (0..30).map(|row| -2.0 * f64::from(row)).collect::<Vec<_>>());
    assert_eq!(of("position[gripper]").expect("it is there").columns[0][3], 107.0);
    let names: Vec<String> = columns_of(&reader, None).expect("it is read").into_iter().map(|signal| signal.field).collect();
    assert_eq!(names, ["position[pan]", "position[l.elbow]", "position[gripper]"]);
}

#[test]
fn the_fields_of_a_structure_are_columns() {
    let Some(written) = Written::new() else { return };
    let options = ImportOptions { time: "time".to_owned(), variable: Some("log".to_owned()), ..ImportOptions::default() };
    for name in ["typed.mat", "packed.mat"] {
        let bag = written.path("log.mcap");
        import_table(&written.path(name), &bag, &ImportOptions { overwrite: true, ..options.clone() }).expect("it is imported");
        let mut all = written.expected["matrix"].clone();
        all.as_object_mut().expect("columns").insert("t".to_owned(), written.expected["typed"]["t"].clone());
        compare(&bag, &all, name);
    }
    let says = |options: ImportOptions| {
        import_table(&written.path("typed.mat"), &written.path("no.mcap"), &options).expect_err("it is wrong").to_string()
    };
    assert_names(says(ImportOptions { variable: Some("logs".to_owned()), ..options.clone() }), &["logs: ", "t, "]);
    assert_names(says(ImportOptions { variable: Some("gain".to_owned()), ..options.clone() }), &["gain: "]);
    assert_names(says(ImportOptions { time: "t".to_owned(), ..options }), &["t: ", "time"]);
}

#[test]
fn a_dataset_of_lerobot_comes_and_goes() {
    let Some(written) = Written::new() else { return };
    let (dataset, bags) = (written.path("dataset"), written.path("bags"));
    assert!(is_lerobot(&dataset) && !is_rosbag(&dataset));
    let episodes = import_lerobot(&dataset, &bags, &LerobotOptions::default()).expect("it is imported");
    assert_eq!(episodes.iter().map(|episode| episode.report.rows).collect::<Vec<_>>(), [40, 700, 5]);
    for episode in &episodes {
        assert!(episode.report.clock.is_empty() && episode.report.notes.is_empty(), "{episode:?}");
        compare(&episode.bag, &written.expected["dataset"][&episode.name], &episode.name);
    }
    // One, in other units, under other names, whose targets are those of the row before.
    let text =
        "commanded_at = \"next\"\neffort = \"\"\n[angle]\nshoulder_pan = 0.5\nelbow_flex = \"rad\"\n[joints]\nelbow_flex = \"elbow\"\n";
    std::fs::write(written.path("contract.toml"), text).expect("it writes");
    let contract = Contract::read(&written.path("contract.toml")).expect("it is read");
    let options = LerobotOptions { contract, episodes: Some(vec![2]), ..LerobotOptions::default() };
    let one = import_lerobot(&dataset, &written.path("one"), &options).expect("it is imported");
    let found = columns(&one[0].bag);
    let of = |name: &str| &found.iter().find(|(found, _)| found == name).unwrap_or_else(|| panic!("{name}: {found:?}")).1;
    assert_eq!((found.len(), of("t").len()), (5, 4));
    let all = written.read(&dataset);
    let state = all["action"][1].as_array().expect("numbers");
    let number = |value: &Value| f64::from_bits(u64::from_str_radix(value.as_str().expect("bits"), 16).expect("bits"));
    let last = number(&state[2 * 743 + 1]);
    assert_eq!(of("elbow.command")[3], last, "the last row is sent what the one before says");
    // And out again: the numbers and types of before.
    let readers: Vec<Reader> = episodes.iter().map(|episode| Reader::open(&episode.bag).expect("it opens")).collect();
    let out = written.path("out");
    std::fs::create_dir(&out).expect("a directory");
    let report = export_lerobot(&readers, &out, &Contract::default(), "wave").expect("it is exported");
    assert_eq!((report.rows, report.fps, report.notes.as_slice()), (745, 50.0, &[][..]));
    let back = written.read(&out);
    for (name, column) in all.as_object().expect("columns").iter().filter(|(name, _)| *name != "meta") {
        assert!(&back[name] == column, "{name}: types or bits differ");
    }
    let meta = &back["meta"];
    assert_eq!(json!([meta["lengths"], meta["from"], meta["to"]]), json!([[40, 700, 5], [0, 40, 740], [40, 740, 745]]));
    assert_eq!(json!([meta["tasks"][0], meta["of"][2][0], meta["info"]["fps"]]), json!(["wave", "wave", 50]));
    // Ten figures of eight features, of the whole and of three episodes, against NumPy's of the numbers as they are stored, in single precision.
    assert_eq!(meta["statistics"][0], 10 * 8 * 4, "{}", meta["statistics"]);
    assert!(meta["statistics"][1].as_f64().is_some_and(|worst| worst < 2e-6), "{}", meta["statistics"]);
    let again = import_lerobot(&out, &written.path("again"), &LerobotOptions::default()).expect("it is imported");
    compare(&again[1].bag, &written.expected["dataset"]["episode_000001"], "again");
}

#[test]
fn a_wrong_dataset_is_told_with_its_file() {
    let Some(written) = Written::new() else { return };
    let (dataset, bags) = (written.path("dataset"), written.path("bags"));
    let says = |options: &LerobotOptions| import_lerobot(&dataset, &bags, options).expect_err("it is wrong").to_string();
    let named = |measured: &str| Contract { measured: Some(measured.to_owned()), ..Contract::default() };
    let told = says(&LerobotOptions { contract: named("observation.joints"), ..LerobotOptions::default() });
    assert_names(&told, &["meta/info.json", "observation.joints", "observation.state"]);
    let renamed = Contract { joints: [("elbow".to_owned(), "elbow_flex".to_owned())].into(), ..Contract::default() };
    let told = says(&LerobotOptions { contract: renamed, ..LerobotOptions::default() });
    assert_names(&told, &["\"elbow\"", "elbow_flex, shoulder_pan"]);
    assert_names(says(&LerobotOptions { episodes: Some(vec![1, 9]), ..LerobotOptions::default() }), &["episode 9"]);
    let info = std::fs::read_to_string(dataset.join("meta/info.json")).expect("it is there");
    for (from, to, expected) in [
        ("\"v3.0\"", "\"v2.1\"", "codebase_version: is \"v2.1\", expected v3.0"),
        ("\"fps\": 50", "\"fps\": 0", "fps: expected a number above 0"),
        ("[2]", "[3]", "names: has 2 names, but the shape has 3"),
        ("[2]", "[1000000000000000]", "shape: expected one number, a value a joint, from 1 to 10000"),
        ("{", "", "meta/info.json"),
    ] {
        std::fs::write(dataset.join("meta/info.json"), info.replacen(from, to, 1)).expect("it writes");
        let told = says(&LerobotOptions::default());
        assert!(told.contains(expected), "{told}");
    }
    std::fs::write(dataset.join("meta/info.json"), &info).expect("it writes");
    let file = dataset.join("data/chunk-000/file-001.parquet");
    let bytes = std::fs::read(&file).expect("it is there");
    std::fs::write(&file, &bytes[..bytes.len() - 30]).expect("it writes");
    let told = says(&LerobotOptions::default());
    assert_names(&told, &["file-001.parquet"]);
}

#[test]
fn ros_bags_of_both_generations_are_read() {
    let Some(written) = Written::new() else { return };
    for (name, expected) in
        [("sqlite", "sqlite"), ("sqlite_old", "sqlite_old"), ("ros1.bag", "ros1"), ("ros1_lz4.bag", "ros1"), ("ros1_bz2.bag", "ros1")]
    {
        let (from, bag) = (written.path(name), written.path(&format!("{name}.mcap")));
        assert!(is_rosbag(&from), "{name}");
        let report = import_rosbag(&from, &bag, false, MOST_BYTES).unwrap_or_else(|error| panic!("{name}: {error}"));
        assert_eq!((report.messages, report.topics.len()), (80, 4), "{name}: {report:?}");
        for topic in &report.topics {
            assert_eq!(topic.messages, 20);
            assert!(
                topic.clock.len() == 1 && topic.clock[0].contains("jumps once") && topic.clock[0].contains("rows 13 and 14"),
                "{name}: {topic:?}"
            );
        }
        let reader = Reader::open(&bag).expect("it opens");
        let own = report.topics.iter().find(|topic| topic.name == "/own").expect("it is there");
        assert_eq!(own.type_name, "mine_msgs/msg/Own");
        let has_definition = name != "sqlite_old";
        assert_eq!(own.notes.is_empty(), has_definition, "{name}: {own:?}");
        for (topic, field) in [
            ("/joint_states", "position[1]"),
            ("/joint_states", "velocity[0]"),
            ("/ft", "wrench.torque.x"),
            ("/excite", "data"),
            ("/own", "gain"),
        ] {
            if topic == "/own" && !has_definition {
                assert!(signals(&reader, &[Signal::new("x", topic, field)]).is_err());
                continue;
            }
            let found = signals(&reader, &[Signal::new("x", topic, field)]).unwrap_or_else(|error| panic!("{name}: {error}"));
            assert_eq!(
                &bits(&found.columns[0]),
                written.expected[expected][field][1].as_array().expect("numbers"),
                "{name}: {topic} {field}"
            );
            assert!((found.t[13] - 0.165).abs() < 1e-12, "{name}: {}", found.t[13]);
        }
        assert!(columns_of(&reader, None).expect("it is read").len() >= 11, "{name}");
        if has_definition {
            // The readers of others see the same in what was written.
            let script = Path::new(env!("CARGO_MANIFEST_DIR")).join("../tests/python/read_bag.py");
            let seen = Command::new(&written.python).arg(script).arg(&bag).output().expect("the Python of BACKDRIVE_PYTHON starts");
            assert!(seen.status.success(), "{name}: {}", String::from_utf8_lossy(&seen.stderr));
            let seen: Value = serde_json::from_slice(&seen.stdout).expect("the script prints JSON");
            assert_eq!(seen["mcap"], seen["rosbags"], "{name}");
            let state = &seen["mcap"]["/joint_states"];
            assert_eq!(
                json!([state["count"], state["frame_id"], state["names"]]),
                json!([20, "odd", ["shoulder_pan", "elbow_flex"]]),
                "{name}"
            );
            assert_eq!(seen["mcap"]["/own"]["type"], "mine_msgs/msg/Own", "{name}");
        }
    }
}

#[test]
fn a_file_that_was_cut_off_is_an_error_and_leaves_no_bag() {
    let Some(written) = Written::new() else { return };
    let bag = written.path("cut.mcap");
    for name in ["typed-snappy.parquet", "typed.mat", "packed.mat", "ros1.bag", "ros1_lz4.bag"] {
        let bytes = std::fs::read(written.path(name)).expect("it is there");
        let cut = written.path(&format!("cut-{name}"));
        for share in [0.0, 0.001, 0.01, 0.3, 0.7, 0.999] {
            std::fs::write(&cut, &bytes[..(bytes.len() as f64 * share) as usize]).expect("it writes");
            let error = match name.ends_with(".bag") {
                true => import_rosbag(&cut, &bag, false, MOST_BYTES).map(|report| report.messages).err(),
                false => import_table(&cut, &bag, &ImportOptions::default()).map(|report| report.rows).err(),
            };
            // A ROS bag of which only the index is cut off has all its messages.
            let Some(error) = error else {
                assert!(name.ends_with(".bag") && share > 0.99, "{name} cut to {share} is imported");
                std::fs::remove_file(&bag).expect("it is there");
                continue;
            };
            let error = error.to_string();
            assert!(error.contains(&format!("cut-{name}")), "{error}");
            assert!(!bag.exists(), "{name} cut to {share}: a bag was left behind");
        }
    }
}

/// Damage anywhere gives a sentence or another number, and never ends the program.
#[test]
fn damage_is_an_error_and_no_panic() {
    let Some(written) = Written::new() else { return };
    let bag = written.path("damaged.mcap");
    let mut state = 88172645463325252_u64;
    let mut random = move || {
        state ^= state << 13;
        state ^= state >> 7;
        state ^= state << 17;
        state
    };
    let rounds = if std::env::var("BACKDRIVE_FULL").as_deref() == Ok("1") { 2_000 } else { 60 };
    let tables = ["late.parquet", "stamps.parquet", "typed-zstd.parquet", "typed.mat", "packed.mat"];
    let bags = ["ros1.bag", "ros1_lz4.bag", "ros1_bz2.bag", "sqlite/sqlite.db3"];
    for name in tables.into_iter().chain(bags) {
        let bytes = std::fs::read(written.path(name)).expect("it is there");
        let damaged = written.path(&format!("damaged-{}", name.replace('/', "-")));
        for _ in 0..rounds {
            let mut changed = bytes.clone();
            for _ in 0..1 + random() % 4 {
                // Where the structure is, more often than among the numbers.
                let reach = if random() % 2 == 0 { bytes.len() } else { bytes.len().min(600) };
                let place = (random() as usize) % reach;
                let place = if random() % 2 == 0 { place } else { bytes.len() - 1 - place };
                changed[place] = (random() >> 20) as u8;
            }
            std::fs::write(&damaged, &changed).expect("it writes");
            let _ = match is_rosbag(&damaged) {
                true => import_rosbag(&damaged, &bag, true, MOST_BYTES).map(|report| report.messages),
                false => {
                    import_table(&damaged, &bag, &ImportOptions { overwrite: true, ..ImportOptions::default() }).map(|report| report.rows)
                }
            };
        }
    }
}
