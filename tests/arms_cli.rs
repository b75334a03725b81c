//! `backdrive diagnose` on a two-joint arm whose logs are made here. What is found is reported in text, verdict and page, from tables and from bags alike;
//! what nothing explains is called so. Options without meaning and wrong input are reported in one sentence.

#[path = "../diagnosis/tests/arms/common/mod.rs"]
mod logs;
mod system;

use logs::{AS_STATED, Beside, set};
use serde_json::Value;
use system::Place;
use system::assert_names;

fn verdict(place: &Place, folder: &str) -> Value {
    serde_json::from_str(&std::fs::read_to_string(place.path(folder).join("verdict.json")).unwrap()).unwrap()
}

#[test]
fn friction_that_was_left_out_is_told_in_text_and_page_and_from_bags_too() {
    let place = Place::new();
    set(&place.path(""), &Beside { dry: [0.2, 0.3], ..AS_STATED }, "", |_| {});
    let done = place.backdrive(&["diagnose", ".", "--out", "out", "--effort", "2", "--without", "maxwell_slip", "--explain"]);
    assert_eq!(done.code, Some(1), "{done:?}");
    for note in ["note: --effort has no effect for an arm", "note: --without maxwell_slip has no effect for an arm"] {
        assert!(done.stderr.contains(note), "{done:?}");
    }
    for said in ["MISSING", "dry friction at the elbow", "worth", "out: verdict.json, model.diagnosed.toml, next-motion.csv, report.html"] {
        assert!(done.stdout.contains(said), "\"{said}\": {done:?}");
    }
    let found = verdict(&place, "out");
    assert_eq!(found["findings"][0]["physics"], "coulomb", "{found:#}");
    let elbow = &found["arm"]["joints"][1];
    // What remains while the joint moves is what the torque's noise of 0.01/√3 N m leaves, to within a third.
    let (moving, noise) = (elbow["moving"].as_f64().unwrap(), elbow["noise"].as_f64().unwrap());
    assert!(moving < 1.5 * noise && noise < 1.5 * moving && elbow.get("shows").is_none(), "{elbow}");

    let page = std::fs::read_to_string(place.path("out/report.html")).unwrap();
    let sentence = found["sentence"].as_str().unwrap();
    for said in [
        sentence,
        "What remains of each joint&#39;s torque",
        "Torque on a held-out log",
        "Friction of each joint",
        "closed loop, diagnosed",
        "base parameter",
        "Next recording",
        "--effort has no effect for an arm",
        "c.csv",
    ] {
        assert!(page.contains(said), "the page does not say \"{said}\"");
    }
    // Torque and friction of two joints, the bars, the motion to record next; each has its values in a table for readers without scripts.
    assert!(page.matches("<figure").count() >= 5, "{}", page.matches("<figure").count());

    // The same logs as bags, and the page in another folder: the same is found.
    let done = place.backdrive(&["bag", "import", "a.csv", "b.csv", "c.csv", "--bag", "bags"]);
    assert_eq!(done.code, Some(0), "{done:?}");
    let topic = |column: &str| format!("{{ topic = '/recording/{column}', field = 'position[0]' }}");
    let joint =
        |name: &str, n: usize| format!("[joints.{name}]\nposition = {}\ntorque = {}\n", topic(&format!("q{n}")), topic(&format!("tau{n}")));
    let files = "model = 'arm.toml'\nfit = ['bags/a.mcap', 'bags/b.mcap']\nheld_out = ['bags/c.mcap']\n";
    place.write("bags.toml", &format!("{files}{}{}", joint("shoulder", 1), joint("elbow", 2)));
    let done = place.backdrive(&["diagnose", "bags.toml", "--out", "from-bags", "--html", "page.html", "--json"]);
    assert_eq!(done.code, Some(1), "{done:?}");
    assert!(place.path("page.html").exists() && !place.path("from-bags/report.html").exists());
    let again = done.json();
    assert_eq!(again["findings"][0]["physics"], "coulomb", "{again:#}");
    let force = |v: &Value| v["findings"][0]["parameters"]["force"]["value"].as_f64().unwrap();
    assert!((force(&found) - force(&again)).abs() < 1e-6, "{} {}", force(&found), force(&again));

    // A topic that is not there is reported with joint, file and key.
    place.write("bags.toml", &format!("{files}{}{}", joint("shoulder", 1), joint("elbow", 9)));
    let done = place.backdrive(&["diagnose", "bags.toml", "--out", "no", "--no-report"]);
    assert_eq!(done.code, Some(3), "{done:?}");
    assert_names(&done.stderr, &["bags/a.mcap: [joints.elbow] position", "/recording/q9"]);
}

#[test]
fn what_nothing_explains_is_not_called_fine() {
    let place = Place::new();
    // An unknown torque on the elbow: two slow waves that are independent of the motion, in another phase in each log.
    set(&place.path(""), &AS_STATED, "", |columns| {
        let phase = 40.0 * columns[2][0];
        let time = columns[0].clone();
        for (torque, t) in columns[6].iter_mut().zip(time) {
            *torque += 0.3 * (2.9 * t + 2.0 * phase).sin() + 0.3 * (1.7 * t + phase).sin();
        }
    });
    let done = place.backdrive(&["diagnose", ".", "--out", "out", "--no-report"]);
    assert_eq!(done.code, Some(1), "{done:?}");
    let found = verdict(&place, "out");
    assert_eq!(found["verdict"], "unexplained", "{found:#}");
    assert_names(&done.stdout, &["UNEXPLAINED", "elbow"]);
    let joints = &found["arm"]["joints"];
    assert!(joints[0].get("shows").is_none(), "{joints}");
    let [low, high] = [0, 1].map(|i| joints[1]["shows"]["band_hz"][i].as_f64().unwrap());
    assert!(low < 0.5 && high < 1.0 && joints[1]["moving"].as_f64().unwrap() > 0.05, "{joints}");
    assert_eq!(found["remaining"]["where"], joints[1]["shows"]);
    assert!(!place.path("out/report.html").exists());
}

#[test]
fn wrong_input_is_told_with_joint_file_and_key() {
    let place = Place::new();
    let joints =
        "[joints.shoulder]\nposition = 'q1'\ntorque = 'tau1'\n[joints.elbow]\nposition = 'q2'\ncurrent = 'i2'\ntorque_constant = 0.5\n";
    set(&place.path(""), &AS_STATED, joints, |_| {});
    let failed = |args: &[&str], code: i32, said: &[&str]| {
        let done = place.backdrive(args);
        assert_eq!(done.code, Some(code), "{done:?}");
        for said in said {
            assert!(done.stderr.contains(said), "\"{said}\": {done:?}");
        }
        assert_eq!(done.stderr.trim_end().lines().filter(|l| l.starts_with("error")).count(), 1, "{done:?}");
    };
    failed(&["diagnose", ".", "--out", "out"], 3, &["a.csv", "[joints.elbow] current", "i2", "tau2"]);
    failed(&["diagnose", ".", "--out", "out", "--grip", "hand.toml"], 2, &["--grip hand.toml", "without a hand"]);
    failed(&["diagnose", ".", "--out", "out", "--without", "gravitation"], 2, &["gravity_direction", "payload"]);
    let unknown = "model = 'arm.toml'\nfit = ['a.csv']\n[unknown.hand]\nbandwidth_hz = 5.0\n";
    place.write("unknown.toml", unknown);
    failed(&["diagnose", "unknown.toml", "--out", "out"], 3, &["unknown.hand", "every joint"]);
    place.write("no-robot.toml", "name = 'arm'\n[robot]\nfile = 'none.urdf'\n");
    failed(
        &["diagnose", ".", "--model", "no-robot.toml", "--out", "out"],
        3,
        &["no-robot.toml:3: robot.file", "none.urdf", "no such file"],
    );
    failed(&["fit", "arm.toml", "."], 3, &["arm.toml: [robot]", "backdrive diagnose"]);
}

#[test]
fn what_is_written_of_a_urdf_arm_keeps_axes_and_limits() {
    let place = Place::new();
    set(&place.path(""), &Beside { dry: [0.2, 0.3], ..AS_STATED }, "", |_| {});
    let done = place.backdrive(&["diagnose", ".", "--out", "o", "--no-report"]);
    assert_eq!(done.code, Some(1), "{done:?}");
    for (target, out) in [("urdf", "x.urdf"), ("mjcf", "x.xml")] {
        let done = place.backdrive(&["export", "o/model.diagnosed.toml", "--to", target, "--out", out]);
        assert_eq!(done.code, Some(0), "{done:?}");
    }
    let read = |name: &str| std::fs::read_to_string(place.path(name)).unwrap();
    for name in ["o/model.diagnosed.toml", "x.urdf"] {
        let counts = ["<axis xyz=\"0 1 0\"", "<limit "].map(|part| read(name).matches(part).count());
        assert_eq!(counts, [2, 2], "{name}: {}", read(name));
    }
    let mjcf = read("x.xml");
    let parts = ["axis=\"0 1 0\"", "limited=\"true\" range=\"-2.5 2.5\"", "<motor name="].map(|part| mjcf.matches(part).count());
    assert_eq!(parts, [2, 2, 2], "{mjcf}");
}

#[test]
fn interrupted_it_writes_what_it_has_and_ends_with_130() {
    let place = Place::new();
    set(&place.path(""), &Beside { dry: [0.2, 0.3], ..AS_STATED }, "", |_| {});
    let set = "model = 'arm.toml'\nfit = ['a.csv', 'b.csv', 'a2.csv', 'b2.csv', 'a3.csv', 'b3.csv']\nheld_out = ['c.csv']\n";
    place.write("set.toml", set);
    for (from, to) in [("a.csv", "a2.csv"), ("b.csv", "b2.csv"), ("a.csv", "a3.csv"), ("b.csv", "b3.csv")] {
        std::fs::copy(place.path(from), place.path(to)).unwrap();
    }
    let run = place.start(&["diagnose", ".", "--out", "out", "--no-report"]);
    std::thread::sleep(std::time::Duration::from_millis(500));
    system::kill(run.pid(), nix::sys::signal::Signal::SIGINT);
    let done = run.end();
    assert_eq!(done.code, Some(130), "{done:?}");
    assert!(done.stderr.contains("stopped; the results so far are written"), "{done:?}");
    assert_eq!(verdict(&place, "out")["searched"]["cut_short"], true);
}
