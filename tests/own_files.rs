//! Files as people have them: units in every usual place, tables without a heading or times, NumPy archives, matrices, MCAP with JSON or protobuf.
//! What is read is read in its units, and what is not read is refused in one line that explains what to do.

mod system;

use backdrive_plant::model::Model;
use std::collections::BTreeMap;
use std::fmt::Write;
use system::{Ended, Place, file, samples};
use system::{PANIC, assert_names};

const INERTIA: f64 = 1e-3;

/// Angle, rad, and torque, N m, of a body of [`INERTIA`] with 0.01 N m s/rad, at a time.
fn swing(amplitude: f64, t: f64) -> (f64, f64) {
    let sines = [(0.4, 6.0), (0.1, 17.0)];
    let sum = |of: &dyn Fn(f64, f64) -> f64| amplitude * sines.iter().map(|(a, w)| of(*a, *w)).sum::<f64>();
    let (speed, change) = (sum(&|a, w| a * w * (w * t).cos()), sum(&|a, w| -a * w * w * (w * t).sin()));
    (sum(&|a, w| a * (w * t).sin()), INERTIA * change + 0.01 * speed)
}

/// Two recordings at 500 Hz in `mine/`: time, torque and angle, times these factors, below this heading if there is one.
fn recorded(place: &Place, heading: &str, second: f64, radian: f64) {
    std::fs::create_dir_all(place.path("mine")).unwrap();
    for (name, amplitude) in [("a", 1.0), ("b", 0.7)] {
        let mut text = if heading.is_empty() { String::new() } else { format!("{heading}\n") };
        for row in 0..1500 {
            let t = f64::from(row) * 0.002;
            let (angle, torque) = swing(amplitude, t);
            let time = if second > 0.0 { format!("{},", second * t) } else { String::new() };
            writeln!(text, "{time}{torque},{}", radian * angle).unwrap();
        }
        place.write(&format!("mine/{name}.csv"), &text);
    }
}

const TURNS: [&str; 6] = ["--motion", "rotation", "--driven", "force", "--yes", "--overwrite"];

fn init(place: &Place, more: &[&str]) -> Ended {
    place.backdrive(&[&["init", "mine"], &TURNS[..], more].concat())
}

fn is_right(place: &Place, done: &Ended) {
    assert_eq!(done.code, Some(0), "{done:?}");
    let inertia = Model::load(&place.path("mine/model.toml")).unwrap().bodies[0].inertia;
    assert!((inertia / INERTIA - 1.0).abs() < 0.05, "{inertia}: {done:?}");
    assert_names(&done.stdout, &["500 Hz"]);
}

fn is_refused(done: &Ended, code: i32, says: &[&str]) {
    assert_eq!(done.code, Some(code), "{done:?}");
    assert!(says.iter().all(|words| done.stderr.contains(words)), "{says:?}: {done:?}");
    assert_eq!(done.stderr.trim_end().lines().count(), 1, "{done:?}");
}

#[test]
fn units_are_read_in_every_usual_place() {
    let place = Place::new();
    let degrees = 180.0 / std::f64::consts::PI;
    for heading in [
        "time (ms),tau_1 (Nm),q1 (deg)",
        "Time(ms),tau_1(N m),q1(degrees)",
        "time[ms],tau_1[Nm],q1[deg]",
        "time / ms,tau_1 / Nm,q1 / °",
        "time/ms,tau_1/Nm,q1/deg",
        "time_ms,tau_1 (N*m),q1_deg",
    ] {
        recorded(&place, heading, 1000.0, degrees);
        let done = init(&place, &["--drive", heading.split(',').nth(1).unwrap(), "--position", heading.split(',').nth(2).unwrap()]);
        is_right(&place, &done);
        assert!(!done.stdout.contains("assumed"), "{done:?}");
    }
}

#[test]
fn an_unknown_unit_is_asked_for_by_name() {
    let place = Place::new();
    let grads = 200.0 / std::f64::consts::PI;
    recorded(&place, "time (ms),tau (Nm),q (grad)", 1000.0, grads);
    let of = ["--drive", "tau", "--position", "q"];
    is_refused(&init(&place, &of), 2, &["give --position-unit", "\"grad\"", "is not known"]);
    recorded(&place, "time (h),tau (Nm),q (rad)", 1.0 / 3600.0, 1.0);
    is_refused(&init(&place, &of), 2, &["give --time-unit", "\"h\" of its heading is not known"]);
    // A stated unit is accepted.
    recorded(&place, "time (s),tau (Nm),q (gon)", 1.0, 1.0);
    is_right(&place, &init(&place, &[&of[..], &["--position-unit", "rad"]].concat()));
    // A bag keeps such numbers unchanged, and reports this.
    let done = place.backdrive(&["bag", "import", "mine/a.csv", "--time", "time", "--bag", "a.mcap"]);
    done.ends(0, &["gon"]);
}

#[test]
fn without_units_degrees_are_no_radians_and_milliseconds_no_seconds() {
    let place = Place::new();
    let of = ["--drive", "tau", "--position", "q"];
    recorded(&place, "t,tau,q", 1.0, 180.0 / std::f64::consts::PI);
    is_refused(&init(&place, &of), 2, &["the unit of q is not stated", "--position-unit deg", "q [deg]"]);
    is_right(&place, &init(&place, &[&of[..], &["--position-unit", "deg"]].concat()));
    recorded(&place, "t,tau,q", 1000.0, 1.0);
    is_refused(&init(&place, &of), 2, &["the unit of t is not stated", "2.00 s apart", "--time-unit ms"]);
    // An assumption is reported, and nothing is called fine.
    recorded(&place, "t,tau,q", 1.0, 1.0);
    let done = init(&place, &of);
    is_right(&place, &done);
    assert!(
        done.stdout.contains("assumed: tau in N m (--drive-unit), q in rad (--position-unit)") && !done.stdout.contains("passed"),
        "{done:?}"
    );
    // The same through a bag: what the table stated is known of the bag, and what it did not is not.
    for (heading, says) in [("t,tau [Nm],q [rad]", None), ("t,tau [Nm],q", Some("assumed: q in rad"))] {
        recorded(&place, heading, 1.0, 1.0);
        std::fs::create_dir_all(place.path("again")).unwrap();
        for name in ["a", "b"] {
            let (table, bag) = (format!("mine/{name}.csv"), format!("again/{name}.mcap"));
            assert_eq!(place.backdrive(&["bag", "import", &table, "--bag", &bag, "--overwrite"]).code, Some(0));
        }
        let done = place.backdrive(&[&["init", "again"], &TURNS[..], &of].concat());
        assert!(done.code == Some(0) && says.map_or(!done.stdout.contains("assumed"), |says| done.stdout.contains(says)), "{done:?}");
    }
}

#[test]
fn tables_without_a_heading_or_times_are_named_and_timed_by_options() {
    let place = Place::new();
    recorded(&place, "", 0.0, 180.0 / std::f64::consts::PI);
    let of = ["--drive", "tau", "--position", "q"];
    let import = |more: &[&str]| place.backdrive(&[&["bag", "import", "mine/a.csv", "--bag", "a.mcap", "--overwrite"], more].concat());
    for done in [init(&place, &of), import(&[])] {
        is_refused(&done, 3, &["there is no heading", "--columns", "--rate"]);
    }
    let named = ["--columns", "tau (Nm),q (deg)", "--rate", "500"];
    let done = import(&named);
    done.answers(0, &["1500 rows", "2 topics"]);
    let found = samples(&place.path("a.mcap"), "/recording/q");
    assert!((found[700].position[0] - swing(1.0, 1.4).0).abs() < 1e-9 && found[700].stamp_ns == 1_400_000_000);
    let done = init(&place, &[&of[..], &named].concat());
    is_right(&place, &done);
    assert_names(std::fs::read_to_string(place.path("mine/set.toml")).unwrap(), &["bags/a.mcap"]);
    assert!(place.path("mine/bags/b.mcap").exists());
    let told = place.backdrive(&["fit", "mine/model.toml", "mine", "--out", "fitted.toml"]);
    assert_eq!(told.code, Some(0), "{told:?}");
    // A wrong number of names, times that are there already, and a heading that is there.
    for done in [init(&place, &["--columns", "tau,q,r", "--rate", "500"]), import(&["--columns", "tau,q,r", "--rate", "500"])] {
        is_refused(&done, 3, &["--columns names 3 columns (tau, q, r), and the table has 2"]);
    }
    for rate in ["0", "-5", "nan", "1e400"] {
        assert_eq!(import(&["--columns", "tau,q", "--rate", rate]).code, Some(2), "{rate}");
    }
    recorded(&place, "tau (Nm),q(deg)", 0.0, 180.0 / std::f64::consts::PI);
    is_refused(&init(&place, &of), 2, &["give --time", "--rate HZ"]);
    is_refused(&import(&[]), 3, &["there is no column \"t\"", "--rate HZ"]);
    is_refused(&import(&named), 3, &["the table has a heading already (tau (Nm), q(deg)); leave --columns out"]);
    assert_eq!(import(&["--rate", "500"]).code, Some(0));
    is_right(&place, &init(&place, &[&of[..], &["--rate", "500"]].concat()));
    recorded(&place, "t,tau,q", 1.0, 1.0);
    is_refused(&import(&["--rate", "500"]), 3, &["there is a column \"t\" with the times"]);
}

#[test]
fn a_numpy_archive_is_read_by_the_names_of_its_arrays() {
    let place = Place::new();
    std::fs::create_dir_all(place.path("mine")).unwrap();
    std::fs::copy(file("tests/cases/npz/log.npz"), place.path("mine/log.npz")).unwrap();
    let done = place.backdrive(&["bag", "import", "mine/log.npz", "--bag", "log.mcap"]);
    done.answers(0, &["400 rows", "8 topics"]);
    assert_names(&done.stderr, &["who (text)", "gain"]);
    let at = |topic: &str| samples(&place.path("log.mcap"), &format!("/recording/{topic}"))[100].position[0];
    let (angle, torque) = swing(1.0, 0.5);
    for (topic, meant) in [
        ("position", angle),
        ("torque", torque),
        ("both_0_", angle),
        ("both_1_", torque),
        ("fortran_1_", torque),
        ("count", 100.0),
        ("big", 100.0),
    ] {
        assert!((at(topic) - meant).abs() < 1e-7, "{topic}: {} {meant}", at(topic));
    }
    let done = init(&place, &["--drive", "torque", "--drive-unit", "N m", "--position", "position", "--position-unit", "rad"]);
    done.answers(0, &["200 Hz"]);
    // One array of everything.
    std::fs::copy(file("tests/cases/npz/one.npy"), place.path("one.npy")).unwrap();
    let import = |more: &[&str]| place.backdrive(&[&["bag", "import", "one.npy", "--bag", "one.mcap", "--overwrite"], more].concat());
    is_refused(&import(&[]), 3, &["one is a matrix of 3 columns", "--time \"one[0]\"", "--rate HZ"]);
    assert_eq!(import(&["--time", "one[0]"]).code, Some(0));
    assert_eq!(import(&["--columns", "t,q,tau"]).code, Some(0));
    assert_eq!(samples(&place.path("one.mcap"), "/recording/tau").len(), 50);
    // Cut anywhere it is refused, and no bag is begun.
    let whole = std::fs::read(place.path("mine/log.npz")).unwrap();
    for part in [3, 10, 50, 90, 99] {
        std::fs::write(place.path("cut.npz"), &whole[..whole.len() * part / 100]).unwrap();
        let done = place.backdrive(&["bag", "import", "cut.npz", "--bag", "cut.mcap"]);
        assert!(done.code == Some(3) && !done.stderr.contains(PANIC) && !place.path("cut.mcap").exists(), "{part}: {done:?}");
    }
}

/// A bag of 400 messages on one topic, 2 ms apart.
fn foreign(place: &Place, name: &str, encoding: &str, schema: &str, message: impl Fn(f64) -> Vec<u8>) {
    let out = std::io::BufWriter::new(std::fs::File::create(place.path(name)).unwrap());
    let mut out = mcap::WriteOptions::new().compression(None).create(out).unwrap();
    let schema = out.add_schema("sensor_msgs/JointState", schema, b"{}").unwrap();
    let channel_id = out.add_channel(schema, "/joint_states", encoding, &BTreeMap::new()).unwrap();
    for k in 0..400_u32 {
        let time = 1_000_000_000_000_000_000 + u64::from(k) * 2_000_000;
        let header = mcap::records::MessageHeader { channel_id, sequence: k, log_time: time, publish_time: time };
        out.write_to_known_channel(&header, &message(f64::from(k) * 0.002)).unwrap();
    }
    out.finish().unwrap();
}

#[test]
fn json_in_an_mcap_file_is_read() {
    let place = Place::new();
    std::fs::create_dir_all(place.path("mine")).unwrap();
    foreign(&place, "mine/js.mcap", "json", "jsonschema", |t| {
        let (q, tau) = swing(1.0, t);
        format!("{{\"name\": [\"j1\"], \"position\": [{q}], \"velocity\": [NaN], \"effort\": [{tau}]}}").into_bytes()
    });
    let told = place.backdrive(&["bag", "info", "mine/js.mcap"]);
    assert!(told.code == Some(0) && !told.stdout.contains("NOT READ"), "{told:?}");
    let done = place.backdrive(&["bag", "export", "mine/js.mcap", "--out", "o.csv"]);
    assert_eq!(done.code, Some(0), "{done:?}");
    let text = std::fs::read_to_string(place.path("o.csv")).unwrap();
    let (headings, row) = (text.lines().next().unwrap().split(','), text.lines().nth(101).unwrap().split(','));
    let row: BTreeMap<&str, f64> = headings.zip(row).map(|(heading, cell)| (heading, cell.parse().unwrap())).collect();
    let (q, tau) = swing(1.0, 0.2);
    let meant = BTreeMap::from([("t", 0.2), ("/joint_states.effort[0]", tau), ("/joint_states.position[0]", q)]);
    assert!(row.len() == 3 && meant.iter().all(|(heading, value)| (row[heading] - value).abs() < 1e-9), "{row:?}");
    let done = init(&place, &["--drive", "effort", "--position", "position"]);
    is_right(&place, &done);
    assert!(!done.stdout.contains("q in rad"), "{done:?}");
}

/// Written by the Python packages mcap-protobuf-support and foxglove-schemas-protobuf: 400 foxglove.JointStates at 500 Hz, `elbow` as `swing(1.0, t)` and
/// `wrist` at rest, and 100 messages of a type with nested, repeated, mapped, optional and enumerated fields.
#[test]
fn protobuf_in_an_mcap_file_is_read() {
    let place = Place::new();
    std::fs::create_dir_all(place.path("mine")).unwrap();
    std::fs::copy(file("tests/cases/protobuf/joints.mcap"), place.path("mine/joints.mcap")).unwrap();
    let told = place.backdrive(&["bag", "info", "mine/joints.mcap"]);
    assert!(told.code == Some(0) && !told.stdout.contains("NOT READ"), "{told:?}");
    let table = |topic: &str| {
        let done = place.backdrive(&["bag", "export", "mine/joints.mcap", "--topic", topic, "--out", "o.csv", "--overwrite"]);
        assert_eq!(done.code, Some(0), "{done:?}");
        let text = std::fs::read_to_string(place.path("o.csv")).unwrap();
        let headings: Vec<String> = text.lines().next().unwrap().split(',').map(str::to_owned).collect();
        let rows: Vec<BTreeMap<String, f64>> = text
            .lines()
            .skip(1)
            .map(|line| headings.iter().cloned().zip(line.split(',').map(|cell| cell.parse().unwrap_or(f64::NAN))).collect())
            .collect();
        rows
    };
    let rows = table("/joints");
    assert_eq!(rows.len(), 400);
    for (k, row) in rows.iter().enumerate() {
        let (q, tau) = swing(1.0, k as f64 * 0.002);
        // By the messages' own times, which are 3 ms before those of the recorder.
        assert!((row["t"] - k as f64 * 0.002).abs() < 1e-9, "{row:?}");
        assert!((row["/joints.joints[0].position"] - q).abs() < 1e-9 && (row["/joints.joints[0].effort"] - tau).abs() < 1e-9, "{row:?}");
        assert_eq!((row["/joints.joints[1].position"], row["/joints.joints[1].effort"]), (0.0, 0.25));
    }
    let rows = table("/rig/log");
    // `temperature` is sent in the second half only: its cells are empty before.
    assert!(rows[..50].iter().all(|row| row["/rig/log.temperature"].is_nan()) && rows[10]["/rig/log.wrench.force"] == 20.0);
    let row = &rows[60];
    let meant = [
        ("wrench.force", 120.0),
        ("wrench.torque", 0.0),
        ("currents[1]", 240.0),
        ("counts[0]", -240.0),
        ("counts[1]", 7.0),
        ("gains.k.p", 4.0),
    ];
    for (field, value) in meant.into_iter().chain([("mode", 2.0), ("temperature", 21.5), ("ok", 1.0), ("tick", 2f64.powi(40) + 240.0)]) {
        assert_eq!(row[&format!("/rig/log.{field}")], value, "{field}");
    }
    assert!((row["/rig/log.ratio"] - f64::from(0.1_f32)).abs() < 1e-12, "{row:?}");
    assert!(rows.len() == 100 && !row.keys().any(|name| name.contains("stamp") || name.contains("picture")), "{row:?}");
    let wrong = place.backdrive(&["bag", "export", "mine/joints.mcap", "--topic", "/other", "--out", "p.csv"]);
    assert_eq!(wrong.code, Some(3), "{wrong:?}");
    let done = init(&place, &["--drive", "/joints.joints[0].effort", "--position", "/joints.joints[0].position"]);
    is_right(&place, &done);
    // In a set a joint is found by its name as well.
    let set = std::fs::read_to_string(place.path("mine/set.toml")).unwrap();
    place.write("mine/set.toml", &set.replace("joints[0]", "joints[elbow]"));
    let found = place.backdrive(&["diagnose", "mine", "--effort", "0.1", "--out", "found", "--no-report", "--json"]);
    assert!(set.contains("joints[0]") && matches!(found.code, Some(0 | 1 | 7)), "{set}{found:?}");
    let inspected = place.backdrive(&["inspect", "mine/joints.mcap", "--json"]);
    let signals = inspected.json()["signals"].to_string();
    assert!(matches!(inspected.code, Some(0 | 1)) && signals.contains("joints[0].position"), "{inspected:?}");
}

#[test]
fn protobuf_without_its_descriptors_is_refused_in_one_line_by_all() {
    let place = Place::new();
    std::fs::create_dir_all(place.path("mine")).unwrap();
    foreign(&place, "mine/pb.mcap", "protobuf", "protobuf", |_| vec![9, 0, 0, 0, 0, 0, 0, 240, 63]);
    let says =
        ["topic /joint_states is not read: its messages are protobuf", "its schema is not a FileDescriptorSet", "Write its values as CSV"];
    let told = place.backdrive(&["bag", "info", "mine/pb.mcap"]);
    assert!(told.stdout.contains("NOT READ") && says.iter().all(|words| told.stdout.contains(words)), "{told:?}");
    assert!(place.backdrive(&["bag", "info", "mine/pb.mcap", "--json"]).json()["topics"][0]["unread"].as_str().unwrap().contains(says[0]));
    is_refused(&place.backdrive(&["bag", "export", "mine/pb.mcap", "--out", "o.csv"]), 3, &says);
    is_refused(&place.backdrive(&["bag", "import", "mine/pb.mcap", "--bag", "o.mcap"]), 3, &says);
    is_refused(&init(&place, &[]), 3, &says);
}
