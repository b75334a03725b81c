//! The ball-screw axis in whole runs: as a slave under each controller, and as a master.

mod system;

use backdrive_bags::{Reader, Signal, signals};
use std::path::Path;
use system::{Place, file, graph_text};

/// Columns of a bag, in the order of `wanted`: (topic, field).
fn columns(bag: &Path, wanted: &[(&str, &str)]) -> Vec<Vec<f64>> {
    let reader = Reader::open(bag).unwrap();
    assert!(reader.completeness().unwrap().is_complete());
    let wanted: Vec<Signal> = wanted.iter().enumerate().map(|(i, (topic, field))| Signal::new(&format!("s{i}"), topic, field)).collect();
    let found = signals(&reader, &wanted).unwrap();
    found.columns
}

fn rms(x: impl Iterator<Item = f64>) -> f64 {
    let (sum, n) = x.fold((0.0, 0), |(sum, n), x| (sum + x * x, n + 1));
    (sum / f64::from(n)).sqrt()
}

/// RMS distances of tip and command before the buffer, in presliding and in sliding, rad; the largest force felt at the handle, N.
fn follow(place: &Place, seconds: &str, change: &dyn Fn(String) -> String) -> ([f64; 2], f64) {
    let text = change(graph_text("launch/ball-screw-slave.toml"));
    std::fs::write(place.path("slave.toml"), text).unwrap();
    let ended = place.backdrive(&["run", "slave.toml", "--json", "--duration", seconds, "--bag", "slave.mcap", "--overwrite"]);
    assert!(matches!(ended.code, Some(0 | 7)), "{ended:?}"); // 7: nothing is held still
    let c = columns(
        &place.path("slave.mcap"),
        &[("/controller/servo_jp", "position[0]"), ("/slave/measured_js", "position[0]"), ("/master/measured_js", "effort[0]")],
    );
    // The controller's filter lags 2/w behind the command by design.
    let late = (2000.0 * 2.0 / (std::f64::consts::TAU * 20.0)) as usize;
    let error = |from: usize, to: usize| rms((from..to).map(|k| c[0][k - late] - c[1][k]));
    ([error(800, 3000), error(3000, 6000)], c[2].iter().fold(0.0, |most: f64, f| most.max(f.abs())))
}

#[test]
fn the_axis_tracks_as_a_slave_and_better_with_its_friction_known() {
    let place = Place::new();
    let (adaptive, felt) = follow(&place, "4.2", &|text| text);
    let of = |law: &'static str| {
        move |text: String| {
            text.replace("law = \"backstepping\"", law).replace("adaptation = [40.0, 2e-5, 2e-5]", "").replace("start = 0.5", "")
        }
    };
    let without = |text: String| of("law = \"pd\"")(text).replace("switching = 5.0", "").replace("boundary = 2.0", "");
    let (pd, _) = follow(&place, "3.1", &without);
    let (known, _) = follow(&place, "3.1", &of("law = \"sliding_mode\"\nfriction = \"feedforward\""));
    println!(
        "rms error, presliding and sliding, rad: back-stepping {adaptive:?}, pd {pd:?}, sliding mode with feedforward {known:?}; felt {felt} N"
    );
    for phase in 0..2 {
        assert!(adaptive[phase] < 0.5 * pd[phase], "{adaptive:?} {pd:?}");
        assert!(known[phase] < 0.5 * pd[phase], "{known:?} {pd:?}");
    }
    assert!(adaptive[0] < 3e-3 && adaptive[1] < 0.02, "{adaptive:?}");
    assert!(felt > 0.1, "the buffer is felt: {felt} N");
}

#[test]
fn the_axis_leads_as_a_master() {
    let place = Place::new();
    let graph = file("launch/ball-screw-master.toml");
    let ended = place.backdrive(&["run", &graph, "--json", "--bag", "master.mcap"]);
    assert!(matches!(ended.code, Some(0 | 7)), "{ended:?}"); // 7: nothing is held still
    assert_eq!(ended.json()["outcome"], "stable", "{ended:?}");
    let c = columns(
        &place.path("master.mcap"),
        &[("/master/measured_js", "position[0]"), ("/slave/measured_js", "position[0]"), ("/slave/measured_js", "effort[0]")],
    );
    let deepest = c[1].iter().fold(0.0_f64, |most, x| most.max(*x));
    assert!(deepest > 0.005 && deepest < 0.0066, "{deepest}");
    assert!(c[2].iter().any(|f| *f < -1.0), "the wall pushes back");
    assert!(c[0].iter().any(|x| *x > 0.5));
}

#[test]
fn a_slave_that_is_driven_by_a_force_is_told_what_it_needs() {
    let place = Place::new();
    let says = |name: &str, change: &dyn Fn(String) -> String, words: &[&str]| {
        std::fs::write(place.path(name), change(graph_text("launch/ball-screw-slave.toml"))).unwrap();
        let ended = place.backdrive(&["check", name]);
        assert_eq!(ended.code, Some(3), "{ended:?}");
        for word in words {
            assert!(ended.stderr.contains(word), "{word}: {}", ended.stderr);
        }
    };
    let drive = "[[connections]]\nfrom = \"controller.force\"\nto = \"slave.force\"\n";
    let replace = |from: &'static str, to: &'static str| {
        move |text: String| {
            assert!(text.contains(from), "{from}");
            text.replace(from, to)
        }
    };
    says("undriven.toml", &replace(drive, ""), &["undriven.toml:", "node \"slave\"", "driven by a force", "controller"]);
    let both = "[[connections]]\nfrom = \"scaling.command\"\nto = \"slave.command\"\n\n[[connections]]\nfrom = \"controller.force\"\nto = \"slave.force\"\n";
    says("both.toml", &replace(drive, both), &["takes no command"]);
    says("law.toml", &replace("law = \"backstepping\"", "law = \"backsteping\""), &["law.toml:", "did you mean \"backstepping\""]);
    let ignorant = |text: String| text.lines().filter(|l| !l.contains("what it knows")).map(|l| format!("{l}\n")).collect();
    says("ignorant.toml", &ignorant, &["ignorant.toml:", "needs model"]);
    let rigid = |text: String| {
        let at = text.find("model = ").filter(|at| text[*at..].contains("what it knows")).unwrap();
        let known = text.match_indices("ball-screw-preisach.toml").next().unwrap().0;
        format!("{}ball-screw.toml{}", &text[..known.max(at)], &text[known + "ball-screw-preisach.toml".len()..])
    };
    says("sliders.toml", &rigid, &["sliders.toml:", "lugre or preisach_lugre"]);
}
