//! Recordings of any length in bounded memory: what is judged of a long bag, in pieces and whole, and what reading it takes.

mod system;

use backdrive_bags::{Entry, Reader, Recorder, RecorderOptions};
use backdrive_msgs::{Message, Sample};
use backdrive_nodes::graph::{Files, Graph, Overrides};
use backdrive_stability::outcome::Outcome;
use backdrive_stability::session::Session;
use backdrive_stability::verdict::recorded_outcome;
use std::path::{Path, PathBuf};
use std::process::Command;
use system::{Place, file};

const VICTIM: &str = "BACKDRIVE_TEST_LONG_BAG";

/// Four seconds in contact with a wall; `change` sees every sample with its topic before it is written.
fn record(place: &Place, bag: &str, change: impl Fn(&str, &mut Sample)) -> PathBuf {
    let graph = file("launch/push-and-hold.toml");
    let master = file("plant/models/impulse-engine-linear.toml");
    if !place.path("run.mcap").exists() {
        let done = place.backdrive(&["run", &graph, "--transport", "inproc", "--duration", "4", "--master", &master, "--bag", "run.mcap"]);
        assert_eq!(done.code, Some(0), "{done:?}");
    }
    let (from, to) = (place.path("run.mcap"), place.path(bag));
    let reader = Reader::open(&from).unwrap();
    let header = reader.header().unwrap().clone();
    let mut recorder = Recorder::create(&to, &header, &RecorderOptions::lockstep()).unwrap();
    for entry in reader.messages().unwrap() {
        let entry: Entry = entry.unwrap();
        let Some(mut message) = entry.message(&from).unwrap() else { continue };
        if let Message::Sample(sample) = &mut message {
            change(&entry.topic.name, sample);
        }
        recorder.push(header.topic(&entry.topic.name).unwrap(), message, 0).unwrap();
    }
    recorder.finish().unwrap();
    to
}

fn graph_of(reader: &Reader) -> Graph {
    let header = reader.header().unwrap();
    Graph::from_text(&header.graph_toml, reader.path(), &Overrides::default(), &Files::Bag(&header.files)).unwrap()
}

#[test]
fn a_long_bag_is_judged_in_all_its_pieces_and_its_rows_are_those_of_the_worst() {
    let place = Place::new();
    // 20000 steps. The oscillation is near the end only, and not in the first pieces.
    let calm = record(&place, "calm.mcap", |_, _| {});
    let shaken = record(&place, "shaken.mcap", |topic, sample| {
        if topic == "/master/measured_js" && sample.step >= 12_000 {
            sample.position[0] += 5e-4 * (std::f64::consts::TAU * 60.0 * sample.step as f64 / 5000.0).sin();
        }
    });
    let whole = |bag: &Path| {
        let reader = Reader::open(bag).unwrap();
        Session::from_bag(&reader, &graph_of(&reader)).unwrap()
    };
    let pieces = |bag: &Path, most: usize| {
        let reader = Reader::open(bag).unwrap();
        Session::from_bag_in_pieces(&reader, &graph_of(&reader), most).unwrap()
    };
    let (all, part) = (whole(&calm), pieces(&calm, 8_000));
    assert_eq!((all.len(), all.elsewhere), (20_000, None));
    let from =
        (0..all.len()).find(|from| all.axes[0].master[*from..].starts_with(&part.axes[0].master)).expect("its rows are rows of the bag");
    assert_eq!((from % 8_000, part.len()), (0, 10_000.min(20_000 - from)), "a piece and its overlap");
    assert_eq!(part.axes[0].contact, all.axes[0].contact[from..from + part.len()]);
    assert_eq!(part.lambda, all.lambda[from..from + part.len()]);
    assert_eq!(recorded_outcome(&part).map(|o| o.word()), recorded_outcome(&all).map(|o| o.word()));
    assert!(part.notes.iter().any(|note| note.contains("too long to analyse at once")), "{:?}", part.notes);

    let part = pieces(&shaken, 8_000);
    assert!(
        matches!(part.elsewhere, Some(Outcome::LimitCycle { frequency_hz, .. }) if (frequency_hz - 60.0).abs() < 2.0),
        "{:?}",
        part.elsewhere
    );
    let shakes = part.axes[0].master.windows(2).map(|x| (x[1] - x[0]).abs()).fold(0.0, f64::max);
    assert!(shakes > 3e-5, "its rows are of a piece that shakes: {shakes}");
    // A piece that is calm does not hide that another is not.
    let calm_rows = Session { elsewhere: part.elsewhere, ..pieces(&calm, 8_000) };
    assert_eq!(recorded_outcome(&calm_rows).map(|o| o.word()), Some("limit_cycle"));
    // A bag of which the end is missing is not called stable, in pieces either.
    let bytes = std::fs::read(&calm).unwrap();
    let cut = place.path("cut.mcap");
    std::fs::write(&cut, &bytes[..bytes.len() * 9 / 10]).unwrap();
    assert_eq!(recorded_outcome(&pieces(&cut, 8_000)).map(|o| o.word()), Some("cannot_tell"));
}

/// What the test below starts: it reads a bag in pieces and prints its peak memory, kB.
#[test]
#[ignore = "only of use as the process that is measured"]
fn victim() {
    let Some(path) = std::env::var_os(VICTIM).map(PathBuf::from) else { return };
    let reader = Reader::open(&path).unwrap();
    let session = Session::from_bag_in_pieces(&reader, &graph_of(&reader), 10_000).unwrap();
    assert!(recorded_outcome(&session).is_some());
    let status = std::fs::read_to_string("/proc/self/status").unwrap();
    println!("{}", status.lines().find(|line| line.starts_with("VmHWM")).unwrap());
}

/// Peak memory of reading a bag that repeats a run N times, kB.
fn peak_kb(place: &Place, times: u64) -> u64 {
    let from = place.path("run.mcap");
    let reader = Reader::open(&from).unwrap();
    let header = reader.header().unwrap().clone();
    let to = place.path(&format!("{times}.mcap"));
    let mut recorder = Recorder::create(&to, &header, &RecorderOptions::lockstep()).unwrap();
    for time in 0..times {
        for entry in reader.messages().unwrap() {
            let entry = entry.unwrap();
            let Some(Message::Sample(mut sample)) = entry.message(&from).unwrap() else { continue };
            (sample.step, sample.sequence) = (sample.step + 20_000 * time, sample.sequence + 20_000 * time);
            sample.stamp_ns += 4_000_000_000 * time as i64;
            recorder.push(header.topic(&entry.topic.name).unwrap(), Message::Sample(sample), 0).unwrap();
        }
    }
    assert_eq!(recorder.finish().unwrap().lost(), 0);
    let child = Command::new(std::env::current_exe().unwrap())
        .args(["--exact", "victim", "--ignored", "--nocapture"])
        .env(VICTIM, &to)
        .output()
        .unwrap();
    let text = String::from_utf8_lossy(&child.stdout).into_owned();
    let line = text.lines().find_map(|line| line.split_once("VmHWM:")).unwrap_or_else(|| panic!("{text}{child:?}"));
    line.1.trim().trim_end_matches(" kB").parse().unwrap()
}

fn memory_does_not_grow(short: u64, long: u64) {
    let place = Place::new();
    record(&place, "calm.mcap", |_, _| {});
    let (few, many) = (peak_kb(&place, short), peak_kb(&place, long));
    println!("{few} kB of {} s, {many} kB of {} s", 4 * short, 4 * long);
    // Kept whole, each step more would take 250 bytes and more; a quarter of it is what allocators differ by.
    let whole_kb = (long - short) * 20_000 * 250 / 1000;
    assert!(many < few + whole_kb / 4, "{few} kB of {} s, {many} kB of {} s", 4 * short, 4 * long);
}

#[test]
fn memory_does_not_grow_with_the_bag() {
    // From 120 000 steps on, two of what is held at once, the peak is reached.
    memory_does_not_grow(8, 16);
}

#[test]
#[ignore = "an hour at 5 kHz: minutes"]
fn memory_does_not_grow_up_to_an_hour() {
    memory_does_not_grow(15, 900);
}
