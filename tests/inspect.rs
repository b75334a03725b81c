//! `backdrive inspect` as a process: exit codes, JSON, formats, and errors that name file, column and row.

mod system;

use serde_json::Value;
use std::fmt::Write as _;
use system::Place;
use system::assert_names;

/// A joint that follows its command 60 ms late; `position` changes what is logged of it.
fn joint(position: impl Fn(usize, f64) -> f64) -> String {
    let wave = |t: f64| 0.5 * (1.3 * t).sin() + 0.2 * (3.1 * t).sin();
    let mut text = "t,elbow.command,elbow.position,wrist.command,wrist.position\n".to_string();
    for i in 0..2000 {
        let t = f64::from(i) * 0.01;
        // A sensor's noise, of no generator.
        let noise = 1e-4 * (f64::from(i) * 12.9898).sin().fract();
        let (u, y) = (wave(t), wave(t - 0.06) + noise);
        let (v, z) = (0.7 * (2.3 * t).cos(), 0.7 * (2.3 * (t - 0.06)).cos() + noise);
        let _ = writeln!(text, "{t:.2},{u:.5},{:.6},{v:.5},{z:.6}", position(i as usize, y));
    }
    text
}

fn kinds(report: &Value) -> Vec<String> {
    let of = |finding: &Value| finding["kind"].as_str().unwrap_or_default().to_string();
    report["findings"].as_array().unwrap().iter().filter(|finding| finding["weight"] == "wrong").map(of).collect()
}

fn inspected(place: &Place, files: &[&str], code: i32) -> Value {
    let done = place.backdrive(&[&["inspect"], files, &["--json"]].concat());
    assert_eq!(done.code, Some(code), "{files:?}: {done:?}");
    serde_json::from_str(&done.stdout).unwrap_or_else(|e| panic!("{e}: {done:?}"))
}

#[test]
fn a_clean_recording_ends_with_0_and_its_joints_have_their_lag() {
    let place = Place::new();
    place.write("clean.csv", &joint(|_, y| y));
    let report = inspected(&place, &["clean.csv"], 0);
    assert!(kinds(&report).is_empty(), "{report}");
    let lag = &report["responses"][0]["lag_ms"];
    assert!((lag["value"].as_f64().unwrap() - 60.0).abs() < 2.0 && lag["low"].as_f64().unwrap() <= 60.5, "{lag}");
    assert_eq!(report["signals"][0]["quantity"], "command");
}

#[test]
fn what_is_wrong_ends_with_1_and_says_what_to_paste() {
    let place = Place::new();
    place.write("turned.csv", &joint(|_, y| -y));
    let done = place.backdrive(&["inspect", "turned.csv", "--html", "page.html"]);
    assert_eq!(done.code, Some(1), "{done:?}");
    assert_names(&done.stdout, &["[joints.elbow]", "column = \"elbow.position\", scale = -1"]);
    let page = std::fs::read_to_string(place.path("page.html")).unwrap();
    assert_names(&page, &["scale = -1", "application/json"]);
    place.write("degrees.csv", &joint(|_, y| y.to_degrees()));
    assert_eq!(kinds(&inspected(&place, &["degrees.csv"], 1)), ["wrong_unit"]);
    place.write("dead.csv", &joint(|i, y| if i > 900 && i < 1000 { 0.123 } else { y }));
    let report = inspected(&place, &["dead.csv"], 1);
    assert_eq!(kinds(&report), ["frozen"]);
    // The heading is line 1, the first row line 2.
    assert_eq!(report["findings"][0]["rows"], serde_json::json!([903, 1001]));
}

#[test]
fn every_format_gives_the_same_findings() {
    let place = Place::new();
    place.write("turned.csv", &joint(|_, y| -y));
    let told = kinds(&inspected(&place, &["turned.csv"], 1));
    assert_eq!(told, ["wrong_sign"]);
    let made = place.backdrive(&["bag", "import", "turned.csv", "--bag", "turned.mcap"]);
    assert_eq!(made.code, Some(0), "{made:?}");
    for (format, file) in [("parquet", "turned.parquet"), ("mat", "turned.mat")] {
        let made = place.backdrive(&["bag", "export", "turned.mcap", "--to", format, "--out", file]);
        assert_eq!(made.code, Some(0), "{made:?}");
        assert_eq!(kinds(&inspected(&place, &[file], 1)), told, "{file}");
    }
    assert_eq!(kinds(&inspected(&place, &["turned.mcap"], 1)), told);
    std::fs::create_dir(place.path("folder")).unwrap();
    std::fs::rename(place.path("turned.mcap"), place.path("folder/turned.mcap")).unwrap();
    assert_eq!(kinds(&inspected(&place, &["folder"], 1)), told);
    // Without heading and times.
    let bare: String = joint(|_, y| -y).lines().skip(1).map(|line| format!("{}\n", line.split_once(',').unwrap().1)).collect();
    place.write("bare.csv", &bare);
    let columns = "elbow.command,elbow.position,wrist.command,wrist.position";
    assert_eq!(kinds(&inspected(&place, &["bare.csv", "--columns", columns, "--rate", "100"], 1)), told);
}

#[test]
fn a_zero_that_differs_between_files_is_found() {
    let place = Place::new();
    place.write("a.csv", &joint(|_, y| y));
    place.write("b.csv", &joint(|_, y| y + 0.3));
    let report = inspected(&place, &["a.csv", "b.csv"], 1);
    assert_eq!(kinds(&report), ["zero_shifted"]);
    assert_names(report["findings"][0]["todo"].as_str().unwrap(), &["offset = -0.3"]);
}

#[test]
fn errors_and_missing_values_name_file_column_and_row() {
    let place = Place::new();
    let absent = place.backdrive(&["inspect", "absent.csv"]);
    absent.ends(3, &["absent.csv"]);
    place.write("words.csv", "a,b\nx,y\nz,w\n");
    let words = place.backdrive(&["inspect", "words.csv"]);
    words.ends(3, &["words.csv"]);
    let text = joint(|_, y| y)
        .lines()
        .enumerate()
        .map(|(i, line)| if i == 500 { format!("{},,,,\n", line.split(',').next().unwrap()) } else { format!("{line}\n") })
        .collect::<String>();
    place.write("holes.csv", &text);
    let report = inspected(&place, &["holes.csv"], 1);
    assert!(kinds(&report).iter().all(|kind| kind == "missing"), "{report}");
    let first = &report["findings"][0];
    assert_eq!((&first["rows"][0], &first["signals"][0]), (&501.into(), &"elbow.command".into()));
}

#[test]
fn of_a_bag_whose_end_is_missing_it_is_said_with_the_command_that_saves_the_rest() {
    let place = Place::new();
    place.write("clean.csv", &joint(|_, y| y));
    assert_eq!(place.backdrive(&["bag", "import", "clean.csv", "--bag", "whole.mcap"]).code, Some(0));
    let bytes = std::fs::read(place.path("whole.mcap")).unwrap();
    let says = "so its end is missing; `backdrive bag recover cut.mcap --bag cut-saved.mcap` makes a clean copy of what there is";
    std::fs::write(place.path("cut.mcap"), &bytes[..bytes.len() * 9 / 10]).unwrap();
    let done = place.backdrive(&["inspect", "cut.mcap"]);
    assert!(format!("{}{}", done.stdout, done.stderr).contains(says), "{done:?}");
    let saved = place.backdrive(&["bag", "recover", "cut.mcap", "--bag", "cut-saved.mcap"]);
    assert!(matches!(saved.code, Some(0 | 4)), "{saved:?}");
    let again = place.backdrive(&["inspect", "cut-saved.mcap"]);
    assert!(matches!(again.code, Some(0 | 1)) && !again.stdout.contains("bag recover"), "{again:?}");
}
