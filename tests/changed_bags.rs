//! A bag that was changed after it was recorded, asked by every verb: no answer may be green that the change makes wrong, and a change that costs nothing
//! keeps its answer.

mod changed;
mod system;

use backdrive::call::call;
use backdrive::caller::Caller;
use changed::kinds::{Costs, KINDS};
use changed::{Bag, Numbers};
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;
use std::collections::BTreeMap;
use std::path::Path;
use std::sync::atomic::{AtomicUsize, Ordering};
use std::sync::{Arc, Mutex};
use system::assert_names;
use system::{Ended, Place, graph_text};

const FORCE: &str = "/master/servo_jf";

/// A contact task of 2 s at 500 Hz: free motion, impact, a sustained push, release.
fn short_graph() -> String {
    let text = graph_text("launch/contact.toml");
    let (from, to) = (text.find("waypoints = [").unwrap(), text.find("]\n\n[[nodes]]\nname = \"master\"").unwrap());
    let points = "waypoints = [ { t = 0.2, x = 0.0 }, { t = 0.6, x = 0.003 }, { t = 0.8, x = 0.003 }, { t = 0.95, x = 0.007 }, \
                  { t = 1.8, x = 0.007 }, { t = 1.95, x = 0.0 } ";
    format!("{}{points}{}", &text[..from], &text[to..])
        .replace("rate_hz = 5000", "rate_hz = 500")
        .replace("duration_s = 4.0", "duration_s = 2.0")
}

/// The base: stable, and whole.
fn base(place: &Place) -> Bag {
    place.write("short.toml", &short_graph());
    let options = ["--transport", "inproc", "--canceller", "none", "--rate", "100", "--lambda", "0.1", "--bag", "base.mcap"];
    let done = place.backdrive(&[&["run", "short.toml"], &options[..]].concat());
    assert_eq!(done.code, Some(0), "{done:?}");
    Bag::load(&place.path("base.mcap"))
}

fn info(place: &Place, bag: &str) -> [Ended; 2] {
    [&["bag", "info", bag][..], &["bag", "info", bag, "--check"]].map(|words| place.backdrive(words))
}

/// 10 % of the time is gone from the middle, from all topics.
fn with_a_hole(bag: &mut Bag) {
    let times = || bag.messages.iter().map(|m| m.header.log_time);
    let (from, to) = (times().min().unwrap(), times().max().unwrap());
    let at = |share: f64| from + ((to - from) as f64 * share) as u64;
    bag.messages.retain(|m| m.topic == "/backdrive/steps" || !(at(0.5)..at(0.6)).contains(&m.header.log_time));
}

#[test]
fn the_base_of_these_tests_is_stable_and_whole_by_every_verb_also_when_it_is_written_again() {
    let place = Place::new();
    base(&place).save(&place.path("again.mcap"));
    for bag in ["base.mcap", "again.mcap"] {
        for verb in [
            &["bag", "info"][..],
            &["bag", "info", "--check"],
            &["stability"],
            &["replay"],
            &["why"],
            &["bag", "export", "--overwrite", "--out", "t.csv"],
        ] {
            let done = place.backdrive(&[verb, &[bag]].concat());
            assert_eq!(done.code, Some(0), "{verb:?} of {bag}: {done:?}");
        }
    }
}

#[test]
fn a_bag_with_a_hole_is_whole_by_no_verb_and_what_is_missing_is_said() {
    let place = Place::new();
    let mut bag = base(&place);
    with_a_hole(&mut bag);
    bag.save(&place.path("filtered.mcap"));
    bag.forget_completeness();
    bag.save(&place.path("hole.mcap"));
    // A filter may also leave the record of completeness unchanged: the messages win.
    for name in ["hole.mcap", "filtered.mcap"] {
        for done in info(&place, name) {
            assert_eq!(done.code, Some(4), "{name}: {done:?}");
            assert_names(&done.stdout, &["INCOMPLETE", "/master/servo_jf: 20 of 200"]);
        }
        let done = place.backdrive(&["bag", "export", name, "--out", "e.csv", "--overwrite"]);
        done.ends(4, &["20 of 200"]);
        for verb in ["stability", "replay", "why"] {
            let done = place.backdrive(&[verb, name]);
            assert_eq!(done.code, Some(7), "{verb} {name}: {done:?}");
        }
        let saved = place.backdrive(&["bag", "recover", name, "--bag", "saved.mcap", "--overwrite"]);
        assert_eq!(saved.code, Some(4), "{saved:?}");
        assert_eq!(place.backdrive(&["bag", "info", "saved.mcap"]).code, Some(4));
        let merged = place.backdrive(&["bag", "merge", name, name, "--bag", "merged.mcap", "--overwrite"]);
        assert_eq!(merged.code, Some(4), "{merged:?}");
        assert_eq!(place.backdrive(&["bag", "info", "merged.mcap"]).code, Some(4));
    }
}

#[test]
fn a_force_command_that_its_graph_does_not_make_is_named_with_factor_and_time() {
    let place = Place::new();
    let bag = base(&place);
    let was = bag.values(FORCE, Numbers::Effort);
    type Change<'a> = &'a dyn Fn(usize, f64) -> f64;
    let late = |index: usize, _: f64| was[index.saturating_sub(5)];
    let changes: [(Change, &str); 5] = [
        (&|_, f| 1000.0 * f, "1000.0000 times"),
        (&|_, f| -f, "-1.0000 times"),
        (&late, "50.0 ms behind"),
        (&|_, _| 0.0, "constant, unlike"),
        (&|_, _| f64::NAN, "has no message"),
    ];
    for (change, how) in changes {
        let mut bag = bag.clone();
        bag.numbers(FORCE, Numbers::Effort, change);
        bag.save(&place.path("changed.mcap"));
        for verb in ["stability", "replay", "why"] {
            let done = place.backdrive(&[verb, "changed.mcap"]);
            let said = format!("{}{}", done.stdout, done.stderr);
            assert_eq!(done.code, Some(7), "{how}: {verb}: {done:?}");
            assert!(said.contains(FORCE) && said.contains(how), "{how}: {verb}: {done:?}");
            assert!(!said.contains("no oscillation:"), "{how}: {verb}: {done:?}");
        }
    }
    let mut without = bag.clone();
    without.keep(|topic, _, _| topic != FORCE);
    without.save(&place.path("without.mcap"));
    for verb in ["stability", "replay", "why"] {
        let done = place.backdrive(&[verb, "without.mcap"]);
        assert!(done.code == Some(7) && format!("{}{}", done.stdout, done.stderr).contains(FORCE), "{verb}: {done:?}");
    }
}

/// The push of the base once more at the end of a recording that is longer than what is looked at at once: the push is from 60 s to 62.2 s.
fn long_base(place: &Place) -> Bag {
    let again = "{ t = 1.95, x = 0.0 }, { t = 60.0, x = 0.0 }, { t = 60.2, x = 0.007 }, { t = 62.0, x = 0.007 }, { t = 62.2, x = 0.0 }";
    let text = short_graph().replace("{ t = 1.95, x = 0.0 }", again).replace("duration_s = 2.0", "duration_s = 64.0");
    place.write("long.toml", &text.replace("rate_hz = 500", "rate_hz = 1000").replace("lambda = 0.3", "lambda = 0.1"));
    let done = place.backdrive(&["run", "long.toml", "--transport", "inproc", "--bag", "long.mcap"]);
    assert_eq!(done.code, Some(0), "{done:?}");
    Bag::load(&place.path("long.mcap"))
}

#[test]
fn a_device_that_does_something_else_late_in_a_recording_is_told_by_every_verb() {
    let place = Place::new();
    let bag = long_base(&place);
    let path = place.path("changed.mcap");
    let kept_back = |bag: &Bag| {
        bag.save(&path);
        let reader = backdrive_bags::Reader::open(&path).unwrap();
        let graph = backdrive_nodes::graph::Graph::load(&place.path("long.toml"), &backdrive_nodes::graph::Overrides::default()).unwrap();
        backdrive_stability::bag_gate::held_back(&reader, &graph, false).unwrap().0
    };
    assert_eq!(kept_back(&bag), None);
    let measured = [
        ("/master/measured_js", Numbers::Position),
        ("/master/measured_js", Numbers::Effort),
        ("/slave/measured_js", Numbers::Position),
        ("/slave/measured_js", Numbers::Effort),
    ];
    for (topic, numbers) in measured {
        for (from, factor) in [(41_000, 1.5), (61_000, -1.0)] {
            let mut bag = bag.clone();
            bag.numbers(topic, numbers, |index, x| if index >= from { factor * x } else { x });
            assert!(kept_back(&bag).is_some(), "{topic} {numbers:?} times {factor} from {from} on");
        }
    }
    // Without contact: the rows in contact are all as they were.
    let mut moved = bag.clone();
    moved.numbers("/slave/measured_js", Numbers::Position, |index, x| if (20_000..50_000).contains(&index) { x + 0.002 } else { x });
    moved.save(&path);
    for verb in ["stability", "replay", "why"] {
        let done = place.backdrive(&[verb, "changed.mcap"]);
        assert_eq!(done.code, Some(7), "{verb}: {done:?}");
        if verb == "stability" {
            assert_names(&done.stdout, &["slave"]);
        }
    }
}

#[test]
fn a_contradiction_behind_the_first_forty_thousand_steps_is_named_with_its_time() {
    let place = Place::new();
    let bag = long_base(&place);
    // What keeps a green answer back of every verb.
    let said = |bag: &Bag| -> (bool, Vec<String>) {
        let path = place.path("changed.mcap");
        bag.save(&path);
        let reader = backdrive_bags::Reader::open(&path).unwrap();
        let graph = backdrive_nodes::graph::Graph::load(&place.path("long.toml"), &backdrive_nodes::graph::Overrides::default()).unwrap();
        let (why, notes) = backdrive_stability::bag_gate::held_back(&reader, &graph, true).unwrap();
        (why.is_some(), notes.into_iter().filter(|note| note.contains("contradicts its graph")).collect())
    };
    assert_eq!(said(&bag), (false, Vec::new()));
    for (from, to) in [(60_000, 64_000), (1000, 64_000)] {
        let mut bag = bag.clone();
        bag.numbers(FORCE, Numbers::Effort, |index, f| if (from..to).contains(&index) { 2.0 * f } else { f });
        let (kept_back, lines) = said(&bag);
        let [line] = lines.as_slice() else { panic!("{lines:?}") };
        assert!(kept_back && line.contains(FORCE), "{line}");
        assert_names(line, &["2.0000 times"]);
        let time = |word: &str| -> f64 {
            let rest = line.split(word).nth(1).unwrap_or_else(|| panic!("{line}"));
            rest.split(' ').next().and_then(|x| x.parse().ok()).unwrap_or_else(|| panic!("{line}"))
        };
        let (begins, ends) = (time(", from "), time(" s to "));
        assert!((from as f64 * 1e-3..from as f64 * 1e-3 + 0.4).contains(&begins) && (61.9..64.0).contains(&ends), "{line}");
    }
}

#[test]
fn what_a_coupling_sends_over_its_link_is_held_against_what_it_was_given() {
    let place = Place::new();
    let done = place.backdrive(&[
        "run",
        &system::file("launch/coupling.toml"),
        "--rate",
        "1000",
        "--duration",
        "2",
        "--transport",
        "inproc",
        "--bag",
        "base.mcap",
    ]);
    assert!(matches!(done.code, Some(0 | 1 | 7)), "{done:?}");
    let bag = Bag::load(&place.path("base.mcap"));
    let done = place.backdrive(&["stability", "base.mcap"]);
    assert!(!format!("{}{}", done.stdout, done.stderr).contains("not checked: /coupling/to_"), "{done:?}");
    assert!(!done.stdout.contains("contradicts its graph"), "{done:?}");
    for topic in ["/coupling/to_far_js", "/coupling/to_near_js"] {
        let mut bag = bag.clone();
        bag.numbers(topic, Numbers::Position, |_, x| 3.0 * x);
        bag.save(&place.path("changed.mcap"));
        let done = place.backdrive(&["stability", "changed.mcap"]);
        let said = format!("{}{}", done.stdout, done.stderr);
        assert_eq!(done.code, Some(7), "{topic}: {done:?}");
        assert_names(&said, &[topic, "3.0000 times"]);
    }
}

#[test]
fn a_rate_that_is_none_gives_way_to_that_of_the_messages() {
    let place = Place::new();
    let bag = base(&place);
    for rate in ["NaN", "0", "-1000", "inf", "250"] {
        let mut bag = bag.clone();
        bag.record("backdrive.run").insert("rate_hz".to_owned(), rate.to_owned());
        bag.forget_completeness();
        bag.save(&place.path("rate.mcap"));
        for done in info(&place, "rate.mcap") {
            done.answers(0, &["100.000000 Hz"]);
        }
        let found = place.backdrive(&["bag", "info", "rate.mcap", "--json"]).json();
        assert!((found["rate_hz"].as_f64().unwrap() - 100.0).abs() < 1e-6, "{rate}: {found}");
        let done = place.backdrive(&["stability", "rate.mcap"]);
        assert!(done.code == Some(0) && done.stdout.contains("which counts"), "{rate}: {done:?}");
    }
    // Of a graph at another rate everything that is computed would be wrong.
    let mut other = bag.clone();
    other.graph(|text| text.replace("rate_hz = 100", "rate_hz = 200"));
    other.save(&place.path("other.mcap"));
    assert_eq!(place.backdrive(&["bag", "info", "other.mcap", "--check"]).code, Some(4));
    for verb in ["stability", "replay", "why"] {
        assert_eq!(place.backdrive(&[verb, "other.mcap"]).code, Some(7), "{verb}");
    }
}

#[test]
fn a_duration_that_is_none_or_too_short_costs_nothing_and_without_any_record_the_end_is_not_known() {
    let place = Place::new();
    let bag = base(&place);
    let mut shorter = bag.clone();
    shorter.graph(|text| text.replace("duration_s = 2.0", "duration_s = 1.0"));
    shorter.save(&place.path("shorter.mcap"));
    let done = place.backdrive(&["bag", "info", "shorter.mcap", "--check"]);
    done.answers(0, &["100 steps", "200"]);
    let mut none = bag.clone();
    none.graph(|text| text.replace("duration_s = 2.0", ""));
    none.save(&place.path("none.mcap"));
    assert_eq!(place.backdrive(&["stability", "none.mcap"]).code, Some(0));
    none.forget_completeness();
    none.save(&place.path("none.mcap"));
    for done in info(&place, "none.mcap") {
        assert_eq!(done.code, Some(4), "{done:?}");
    }
    assert_eq!(place.backdrive(&["stability", "none.mcap"]).code, Some(7));
}

#[test]
fn what_a_bag_names_is_taken_from_the_bag_alone_and_nothing_else_is_opened() {
    let place = Place::new();
    let bag = base(&place);
    let outside = std::fs::read_to_string(system::file("plant/models/rigid-mass.toml")).unwrap();
    let outside = place.write("outside.toml", &outside).display().to_string();
    let pipe = place.path("pipe").display().to_string();
    assert!(std::process::Command::new("mkfifo").arg(&pipe).status().unwrap().success());
    for named in [outside.as_str(), "/dev/zero", &pipe, "outside.toml"] {
        let mut bag = bag.clone();
        bag.graph(|text| text.replacen("model = \"impulse-engine.toml\"", &format!("model = \"{named}\""), 1));
        bag.save(&place.path("stranger.mcap"));
        for verb in ["stability", "replay", "why"] {
            let done = place.backdrive(&[verb, "stranger.mcap"]);
            done.ends(3, &[named]);
        }
    }
    // What an attached model names is not looked for either.
    let mut inside = bag.clone();
    let model = inside.attachments.iter_mut().find(|(name, _)| name == "impulse-engine.toml").unwrap();
    model.1 = format!("name = \"x\"\nmotion = \"rotation\"\n[robot]\nfile = \"{pipe}\"\n").into_bytes();
    inside.save(&place.path("inside.mcap"));
    assert_eq!(place.backdrive(&["stability", "inside.mcap"]).code, Some(3));
    // What the user names is read from the disk, and only where it is a file.
    assert!(matches!(place.backdrive(&["stability", "base.mcap", "--master", "outside.toml"]).code, Some(0 | 1 | 7)));
    for words in [
        &["stability", "base.mcap", "--master", "pipe"][..],
        &["stability", "pipe"],
        &["bag", "info", "/dev/zero"],
        &["model", "check", "pipe"],
        &["check", "/dev/zero"],
        &["stability", "base.mcap", "--roles", "pipe"],
        &["bag", "import", "pipe", "--bag", "x.mcap"],
        &["bag", "recover", "pipe", "--bag", "x.mcap"],
    ] {
        let done = place.backdrive(words);
        done.ends(3, &[words.iter().find(|word| ["pipe", "/dev/zero"].contains(word)).unwrap()]);
    }
}

#[test]
fn attachments_that_are_missing_double_or_changed_are_noticed() {
    let place = Place::new();
    let bag = base(&place);
    let check = |bag: &Bag, path: &Path| {
        bag.save(path);
        place.backdrive(&["bag", "info", "changed.mcap"])
    };
    let path = place.path("changed.mcap");
    let mut gone = bag.clone();
    gone.attachments.retain(|(name, _)| name != "slave.toml");
    let done = check(&gone, &path);
    done.answers(4, &["slave.toml"]);
    let mut double = bag.clone();
    double.attachments.push(("slave.toml".to_owned(), b"name = \"other\"\n".to_vec()));
    let done = check(&double, &path);
    done.answers(4, &["slave.toml"]);
    assert_eq!(place.backdrive(&["stability", "changed.mcap"]).code, Some(7));
    // Another mass than the recording shows: the models do not do what was recorded.
    let mut heavier = bag.clone();
    for (_, text) in heavier.attachments.iter_mut().filter(|(name, _)| name == "impulse-engine.toml") {
        *text = String::from_utf8_lossy(text).replace("handle = 0.04", "handle = 4.0").into_bytes();
    }
    heavier.save(&path);
    for verb in ["stability", "replay"] {
        assert_eq!(place.backdrive(&[verb, "changed.mcap"]).code, Some(7), "{verb}");
    }
}

/// Bags of every kind of run.
fn bases(place: &Place) -> Vec<(&'static str, Bag)> {
    base(place);
    place.write("short.toml", &short_graph());
    let (two, three, push, coupling) = (
        system::file("launch/two-axis.toml"),
        system::file("launch/three-joint.toml"),
        system::file("launch/push-and-hold.toml"),
        system::file("launch/coupling.toml"),
    );
    let runs: [(&str, &[&str]); 7] = [
        ("contact", &["short.toml", "--transport", "inproc"]),
        ("dithered", &["short.toml", "--dither", "multisine:peak=0.05,from=1,to=100,period=1", "--transport", "inproc"]),
        ("push and hold", &[push.as_str(), "--rate", "1000", "--duration", "4", "--transport", "inproc"]),
        ("two axes", &[two.as_str(), "--rate", "1000", "--transport", "inproc"]),
        ("arm", &[three.as_str(), "--rate", "1000", "--transport", "inproc"]),
        ("coupling", &[coupling.as_str(), "--rate", "1000", "--duration", "2", "--transport", "inproc"]),
        ("real time", &["short.toml", "--clock", "realtime"]),
    ];
    let mut bases = vec![("coarse contact", Bag::load(&place.path("base.mcap")))];
    for (name, words) in runs {
        let bag = format!("{}.mcap", name.replace(' ', "-"));
        let done = place.backdrive(&[&["run"], words, &["--bag", &bag]].concat());
        assert!(matches!(done.code, Some(0 | 1 | 7)), "{name}: {done:?}");
        bases.push((name, Bag::load(&place.path(&bag))));
    }
    bases
}

/// The exit codes of the verbs.
struct Codes {
    judged: Vec<(&'static str, u8)>,
    counted: Vec<(&'static str, u8)>,
    diff: u8,
}

fn asked(folder: &Path, bag: &Bag, base: &Path, why: bool) -> Codes {
    let path = |name: &str| folder.join(name).display().to_string();
    bag.save(Path::new(&path("changed.mcap")));
    let (changed, table, saved, merged, both, base) =
        (path("changed.mcap"), path("table.csv"), path("saved.mcap"), path("merged.mcap"), path("both.mcap"), base.display().to_string());
    let code = |words: &[&str]| call(words, &Arc::new(Caller::default())).code;
    let mut judged = vec![("stability", code(&["stability", &changed, "--grips", "1"])), ("replay", code(&["replay", &changed]))];
    if why {
        judged.push(("why", code(&["why", &changed])));
    }
    let counted = vec![
        ("info", code(&["bag", "info", &changed])),
        ("info --check", code(&["bag", "info", &changed, "--check"])),
        ("export", code(&["bag", "export", &changed, "--overwrite", "--out", &table])),
        ("recover", code(&["bag", "recover", &changed, "--overwrite", "--bag", &saved])),
        ("info of recovered", code(&["bag", "info", &saved])),
        ("merge", code(&["bag", "merge", &changed, &changed, "--offset", "0", "--overwrite", "--bag", &merged])),
        ("merge with the base", code(&["bag", "merge", &base, &changed, "--offset", "0", "--overwrite", "--bag", &both])),
    ];
    Codes { judged, counted, diff: code(&["bag", "diff", &base, &changed]) }
}

/// What is green and must not be, or is not and was.
fn wrong(costs: Costs, codes: &Codes, base: &Codes) -> Vec<String> {
    let mut wrong = Vec::new();
    for ((verb, code), (_, was)) in codes.judged.iter().zip(&base.judged) {
        match costs {
            Costs::Nothing | Costs::Others if code != was => wrong.push(format!("{verb} ends with {code}, before with {was}")),
            Costs::Samples | Costs::Numbers | Costs::Itself if *code == 0 => wrong.push(format!("{verb} is green")),
            _ => {}
        }
    }
    for ((verb, code), (_, was)) in codes.counted.iter().zip(&base.counted) {
        let heals = *verb == "merge with the base";
        match costs {
            // Of another title it is another run.
            Costs::Nothing if code != was && !heals => wrong.push(format!("{verb} ends with {code}, before with {was}")),
            Costs::Samples | Costs::Others if *code == 0 && !heals => wrong.push(format!("{verb} is green")),
            Costs::Itself if *code == 0 && verb.starts_with("info -") => wrong.push(format!("{verb} is green")),
            Costs::Numbers if *code == 0 && heals => wrong.push(format!("{verb} is green")),
            _ => {}
        }
    }
    if matches!(costs, Costs::Samples | Costs::Others | Costs::Numbers) && codes.diff == 0 {
        wrong.push("diff finds no difference".to_owned());
    }
    wrong
}

/// 30 changed bags by default (with `BACKDRIVE_LONG=1` of more kinds), 500 with `BACKDRIVE_FULL=1`, which also asks `why` of every one; `BACKDRIVE_CASES=29,303` makes
/// these alone.
#[test]
fn no_verb_is_green_of_a_bag_whose_change_matters_and_none_loses_its_answer_by_one_that_does_not() {
    let asks = |name: &str| std::env::var(name).is_ok_and(|v| v == "1");
    let (long, full) = (asks("BACKDRIVE_LONG"), asks("BACKDRIVE_FULL"));
    let count = if full { 500 } else { 30 };
    let only: Option<Vec<usize>> =
        std::env::var("BACKDRIVE_CASES").ok().map(|list| list.split(',').map(|n| n.trim().parse().unwrap()).collect());
    let place = Place::new();
    let bases = bases(&place);
    let bases = if full || long { &bases[..] } else { &bases[..3] };
    let folder = |name: String| {
        let folder = place.path(&name);
        std::fs::create_dir(&folder).unwrap();
        folder
    };
    let before: Vec<(std::path::PathBuf, Codes)> = bases
        .iter()
        .enumerate()
        .map(|(index, (_, bag))| {
            let folder = folder(format!("base-{index}"));
            let path = folder.join("base.mcap");
            bag.save(&path);
            let codes = asked(&folder, bag, &path, full);
            (path, codes)
        })
        .collect();
    for ((name, _), (_, codes)) in bases.iter().zip(&before) {
        println!("{name}: {:?} {:?} diff {}", codes.judged, codes.counted, codes.diff);
        assert!(codes.counted.iter().all(|(_, code)| *code == 0) && codes.diff == 0, "{name}: {:?}", codes.counted);
    }
    let (next, done, failures) = (AtomicUsize::new(0), Mutex::new(BTreeMap::new()), Mutex::new(Vec::new()));
    let work = || {
        // The number of a case alone makes it again.
        while let Some(case) = Some(next.fetch_add(1, Ordering::Relaxed)).filter(|case| *case < count) {
            if only.as_ref().is_some_and(|only| !only.contains(&case)) {
                continue;
            }
            let mut random = ChaCha8Rng::seed_from_u64(case as u64);
            let at = (case / KINDS.len() + case) % bases.len();
            let ((of, bag), (base, was)) = (&bases[at], &before[at]);
            let (kind, change) = KINDS[case % KINDS.len()];
            let mut bag = bag.clone();
            let Some(costs) = (0..20).find_map(|_| change(&mut bag, &mut random)) else {
                *done.lock().unwrap().entry((kind, "means nothing there")).or_insert(0) += 1;
                continue;
            };
            let folder = folder(format!("case-{case}"));
            let codes = asked(&folder, &bag, base, full);
            let found = wrong(costs, &codes, was);
            for (verb, code) in codes.judged.iter().chain(&codes.counted) {
                let said = match code {
                    0 => "0",
                    1 => "1",
                    3 => "3",
                    4 => "4",
                    7 => "7",
                    _ => "other",
                };
                *done.lock().unwrap().entry((*verb, said)).or_insert(0) += 1;
            }
            *done.lock().unwrap().entry((kind, "asked")).or_insert(0) += 1;
            if !found.is_empty() {
                failures.lock().unwrap().push(format!("case {case}: {of}, {kind} ({costs:?}): {}", found.join("; ")));
            }
            std::fs::remove_dir_all(folder).unwrap();
        }
    };
    std::thread::scope(|scope| {
        scope.spawn(work);
        scope.spawn(work);
    });
    for ((what, how), times) in done.into_inner().unwrap() {
        println!("{what}: {how}: {times}");
    }
    let failures = failures.into_inner().unwrap();
    assert!(failures.is_empty(), "{} of {count}:\n{}", failures.len(), failures.join("\n"));
}
