//! Recordings and sets: what is read, and how the wrong ones are refused.

#[path = "../../tests/common/naming.rs"]
mod naming;

#[path = "../../tests/common/skipped.rs"]
mod skipped;

use backdrive_plant::model::{Hold, Model};
use backdrive_plant::recording::{
    Cell, ColumnRule, Columns, Frame, Piece, Recording, Source, TableSource, read_csv, read_headings, signals_of, write_csv,
};
use backdrive_plant::set::{Condition, Initial, RecordingSet};
use backdrive_plant::tomlfile::FileError;
use naming::assert_names;
use skipped::skipped;
use std::path::{Path, PathBuf};
use tempfile::TempDir;

fn folder(files: &[(&str, &str)]) -> TempDir {
    let dir = tempfile::tempdir().unwrap();
    for (name, text) in files {
        std::fs::write(dir.path().join(name), text).unwrap();
    }
    dir
}

fn read_text(text: &str, signals: Option<&[&str]>, columns: &Columns, piece: &Piece) -> Result<Recording, FileError> {
    let dir = folder(&[("x.csv", text)]);
    read_csv(&dir.path().join("x.csv"), signals, columns, piece)
}

/// The message without the folder, which differs from run to run.
fn message<T: std::fmt::Debug>(result: Result<T, FileError>) -> String {
    let error = result.unwrap_err();
    let name = Path::new(&error.path).file_name().map(|n| n.to_string_lossy().into_owned()).unwrap_or_default();
    let shown = FileError { path: name, ..error }.to_string();
    // Messages that name the folder itself.
    shown.split(" in /").next().unwrap_or(&shown).to_string()
}

#[test]
fn reads_by_name_with_other_names_and_units() {
    let text = "time_ms, disp_in ,note, force\n0,1,a,2\n2,2,,3\n5,3,b,4\n";
    let column = |name: &str, heading: &str, scale: f64, offset: f64| {
        (name.to_string(), ColumnRule { scale: Some(scale), offset, ..ColumnRule::of(Source::Column(heading.into())) })
    };
    let columns = vec![column("t", "time_ms", 1e-3, 0.0), column("position", "disp_in", 0.0254, 1.0)];
    let r = read_text(text, Some(&["force", "position"]), &columns, &Piece::default()).unwrap();
    assert_eq!(r.t, [0.0, 0.002, 0.005]);
    assert!((r.period - 0.0025).abs() < 1e-15);
    assert!((r.jitter.largest - 5e-4).abs() < 1e-12 && r.jitter.gaps.is_empty());
    assert_eq!(r.signal("position").unwrap(), [1.0254, 1.0508, 1.0762]);
    assert_eq!(r.need_signal("force").unwrap(), [2.0, 3.0, 4.0]);
    assert!(r.need_signal("speed").unwrap_err().to_string().ends_with("has no signal \"speed\"; it has force, position"));
    let all = read_text("t,a,b\n0,1,2\n1,3,4\n", None, &Columns::new(), &Piece::default()).unwrap();
    assert_eq!(all.signals, [("a".to_string(), vec![1.0, 3.0]), ("b".to_string(), vec![2.0, 4.0])]);
}

const MOTOR: &str = "name = 'm'\nmotion = 'rotation'\n[bodies]\nrotor = 1e-4\n[[inputs]]\nname = 'torque'\nkind = 'force'\non = 'rotor'\n\
                     [[outputs]]\nname = 'angle'\nkind = 'position'\nof = 'rotor'\n";

#[test]
fn a_heading_may_name_its_unit_and_so_may_a_rule() {
    let text = "t [ms],angle [deg],torque [mN m],speed [furlong]\n0,0,1000,1\n2,180,2000,2\n4,360,3000,3\n";
    let r = read_text(text, None, &Columns::new(), &Piece::default()).unwrap();
    assert_eq!(r.t, [0.0, 0.002, 0.004]);
    assert!((r.signal("angle").unwrap()[1] - std::f64::consts::PI).abs() < 1e-12);
    assert_eq!(r.signal("torque").unwrap(), [1.0, 2.0, 3.0]);
    let model = Model::from_toml(MOTOR, "motor.toml").unwrap();
    assert_eq!(r.check_units(&model), Ok(()));

    // The set takes precedence over the heading; a current becomes a torque by its constant, a count an angle by its size.
    let set = "[columns]\nt = { column = 'time', unit = 'us' }\ntorque = { column = 'i', unit = 'mA', scale = 0.05 }\n\
               angle = { column = 'encoder', unit = 'counts', scale = 1.5e-3 }\n";
    let text = "time,i,encoder\n0,1000,0\n100,2000,1000\n200,3000,2000\n";
    let dir = folder(&[("set.toml", set), ("x.csv", text)]);
    let set = RecordingSet::open(dir.path()).unwrap();
    let r = set.read_table("x.csv", &["torque", "angle"]).unwrap();
    assert!((r.period - 1e-4).abs() < 1e-15);
    assert!((r.signal("torque").unwrap()[1] - 0.1).abs() < 1e-15 && (r.signal("angle").unwrap()[1] - 1.5).abs() < 1e-12);
    assert_eq!(r.check_units(&model), Ok(()));
}

/// Headings and separators as the client of Universal Robots (`record.py` with `csv_writer.py`) and libfranka (`logToCSV`) write them.
#[test]
fn logs_of_robots_controllers_are_read_where_columns_name_them() {
    let ur = "timestamp actual_q_0 actual_q_1 actual_qd_0 actual_qd_1 actual_current_0 actual_current_1\n\
              100.002 0.1 -1.5 0.01 0.02 0.5 -2.0\n100.004 0.2 -1.4 0.01 0.02 0.6 -2.5\n100.006 0.3 -1.3 0.01 0.02 0.7 -3.0\n";
    let franka = "duration, success rate, q[0], q[1],q_d[0], q_d[1],dq[0], dq[1],tau_J[0], tau_J[1],sent commands\n\
                  0,1,0.1,-1.5,0,0,0.01,0.02,5,-20,none\n1,1,0.2,-1.4,0,0,0.01,0.02,6,-25,none\n2,1,0.3,-1.3,0,0,0.01,0.02,7,-30,none\n";
    let set_of_ur = "[columns]\nt = 'timestamp'\n\
                     [joints]\nbase = { position = 'actual_q_0', velocity = 'actual_qd_0', current = 'actual_current_0', torque_constant = 10.0 }\n\
                     shoulder = { position = 'actual_q_1', velocity = 'actual_qd_1', current = 'actual_current_1', torque_constant = 10.0 }\n";
    let set_of_franka = "[columns]\nt = { column = 'duration', unit = 'ms' }\n\
                         [joints]\nbase = { position = 'q[0]', velocity = 'dq[0]', torque = 'tau_J[0]' }\n\
                         shoulder = { position = 'q[1]', velocity = 'dq[1]', torque = 'tau_J[1]' }\n";
    for (set, text, period) in [(set_of_ur, ur, 2e-3), (set_of_franka, franka, 1e-3)] {
        let dir = folder(&[("set.toml", set), ("x.csv", text)]);
        let set = RecordingSet::open(dir.path()).unwrap();
        let signals: Vec<String> = set.joints.iter().flat_map(|j| [j.position(), j.velocity(), j.torque()]).collect();
        let r = set.read_table("x.csv", &signals.iter().map(String::as_str).collect::<Vec<_>>()).unwrap();
        assert!((r.period - period).abs() < 1e-9, "{}", r.period);
        assert_eq!(r.signal("shoulder.position").unwrap(), [-1.5, -1.4, -1.3]);
        assert_eq!(r.signal("base.torque").unwrap(), [5.0, 6.0, 7.0]);
        assert_eq!(r.signal("shoulder.torque").unwrap(), [-20.0, -25.0, -30.0]);
    }
}

#[test]
fn a_unit_that_is_not_known_or_does_not_go_with_the_signal_is_told() {
    let read = |text: &str| read_text(text, Some(&["torque", "angle"]), &Columns::new(), &Piece::default());
    let told = message(read("t,torque [furlong],angle\n0,1,2\n1,2,3\n"));
    assert!(told.starts_with("x.csv:1: torque [furlong]: unknown unit \"furlong\"; known are s, ms"), "{told}");
    assert_names(&told, &["\"torque\"", "[columns]"]);
    let told = message(read("t [mm],torque,angle\n0,1,2\n1,2,3\n"));
    assert_eq!(told, "x.csv:1: t [mm]: is in mm, a length (m), expected a time such as s or ms");
    let model = Model::from_toml(MOTOR, "motor.toml").unwrap();
    for (text, unit) in
        [("t,torque [A],angle\n0,1,2\n1,2,3\n", "in A, a current (A)"), ("t,torque,angle [mm]\n0,1,2\n1,2,3\n", "in mm, a length (m)")]
    {
        let told = read(text).unwrap().check_units(&model).unwrap_err().to_string();
        assert_names(&told, &[unit, "set scale under [columns]"]);
    }
    let dir = folder(&[("set.toml", "[columns]\nx = { column = 'y', unit = 'mmm' }\n"), ("x.csv", "t,y\n0,1\n1,2\n")]);
    let told = message(RecordingSet::open(dir.path()));
    assert!(told.starts_with("set.toml:2: columns.x.unit: unknown unit \"mmm\""), "{told}");
}

#[test]
fn takes_a_piece_and_the_rows_that_belong_together() {
    let text = "t,run,who,y\n0,1,a,10\n1,1,b,11\n0,2,a,12\n1,2,a,13\n2,2,b,14\n3,2,a,15\n";
    let piece = |rows: Option<[usize; 2]>, keep: Vec<(&str, Cell)>| Piece {
        rows,
        keep: keep.into_iter().map(|(c, v)| (c.to_string(), v)).collect(),
    };
    let y = |p: &Piece| read_text(text, Some(&["y"]), &Columns::new(), p).map(|r| r.signals[0].1.clone());
    assert_eq!(y(&piece(None, vec![("run", Cell::Number(2.0))])).unwrap(), [12.0, 13.0, 14.0, 15.0]);
    assert_eq!(y(&piece(Some([2, 5]), vec![])).unwrap(), [12.0, 13.0, 14.0]);
    assert_eq!(y(&piece(Some([2, 6]), vec![("who", Cell::Text("a".into()))])).unwrap(), [12.0, 13.0, 15.0]);
    assert_eq!(message(y(&piece(Some([2, 7]), vec![]))), "x.csv: rows [2, 7] reach beyond its 6 rows of data");
    assert_eq!(message(y(&piece(None, vec![("run", Cell::Number(3.0))]))), "x.csv: no row has the values that where asks for");
    assert_eq!(message(y(&piece(None, vec![("rnu", Cell::Number(3.0))]))), "x.csv:1: where: unknown column \"rnu\"; did you mean \"run\"?");
}

#[test]
fn wrong_recordings_are_refused_at_their_line() {
    let none = Columns::new();
    let read = |text: &str| message(read_text(text, Some(&["y"]), &none, &Piece::default()));
    assert_eq!(read(""), "x.csv:1: is empty, expected a heading such as t,force,position");
    assert_eq!(
        read("t,y\n0,1\n1,nan\n"),
        "x.csv:3: y: expected a number, found \"nan\"; leave such rows out, or give a piece without them with rows"
    );
    assert_eq!(read("t,y\n0,1\n1,abc\n"), "x.csv:3: y: expected a number, found \"abc\"");
    assert_eq!(read("t,y\n0,1\n1,\n"), "x.csv:3: y: expected a number, found an empty cell");
    assert_eq!(read("t,y\n0,1\n1\n"), "x.csv:3: expected 2 cells, as the heading has, found 1");
    assert_eq!(
        read("t,y\n0,1\n2,1\n1,1\n"),
        "x.csv:4: t: time does not rise: 1 s after 2 s; from a file with several runs, set.toml selects one with where or rows"
    );
    assert_eq!(read("t,y\n0,1\n0,1\n"), "x.csv:3: t: time does not rise: 0 s after 0 s");
    assert_eq!(read("t,y\n0,1\n"), "x.csv: needs at least 2 rows of data, has 1");
    assert_eq!(read("t,y,y\n0,1,1\n1,1,1\n"), "x.csv:1: y: two columns have this heading");
    assert_eq!(read("time,x\n0,1\n1,1\n"), "x.csv:1: unknown column \"t\"; there is time, x ([columns] t = \"...\" names the column)");
    let rule = |source: Source| vec![("y".to_string(), ColumnRule::of(source))];
    let with = |columns: &Columns| message(read_text("t,x\n0,1\n1,1\n", Some(&["y"]), columns, &Piece::default()));
    assert_eq!(with(&rule(Source::Column("xx".into()))), "x.csv:1: [columns] y: unknown column \"xx\"; did you mean \"x\"?");
    assert_eq!(
        with(&rule(Source::Topic { topic: "/a".into(), field: "b".into() })),
        "x.csv:1: [columns] reads \"y\" from the topic /a, but a CSV file has columns"
    );
    assert_eq!(message(read_csv(Path::new("none.csv"), None, &none, &Piece::default())), "none.csv: there is no such file");
}

#[test]
fn gaps_and_jitter_are_reported_and_filled() {
    let t = vec![0.0, 1.0, 2.1, 3.0, 6.0, 7.0];
    let r = Recording::new("r", t, vec![("y".into(), vec![0.0, 1.0, 2.0, 3.0, 6.0, 7.0])]).unwrap();
    assert_eq!(r.jitter.gaps.len(), 1);
    assert_eq!((r.jitter.gaps[0].after, r.jitter.gaps[0].missing), (3.0, 2));
    assert!(!r.is_regular(0.5));
    let even = r.regular_for(&Model::default()).unwrap();
    assert_eq!((even.len(), even.period), (8, 1.0));
    assert_eq!(even.signal("y").unwrap()[5], 5.0);
    // Jitter alone moves no sample: a zero hold would otherwise give the one before.
    let r = Recording::new("r", vec![0.0, 0.9, 2.1, 3.0], vec![("y".into(), vec![0.0, 1.0, 2.0, 3.0])]).unwrap();
    let even = r.regular_for(&Model::default()).unwrap();
    assert_eq!((even.t, even.signals), (vec![0.0, 1.0, 2.0, 3.0], r.signals));
    let fine = Recording::new("r", vec![0.0, 1.0, 2.0], vec![("u".into(), vec![0.0, 1.0, 2.0])]).unwrap();
    assert_eq!(fine.onto_grid(0.5, |_| Hold::Zero).unwrap().signals[0].1, [0.0, 0.0, 1.0, 1.0, 2.0]);
}

#[test]
fn what_is_written_reads_back_the_same() {
    let dir = folder(&[]);
    let path = dir.path().join("out.csv");
    let y = vec![1.0 / 3.0, -2e-17, 1e22];
    let r =
        Recording::new(path.display().to_string(), vec![0.0, 0.1, 0.2], vec![("y".into(), y), ("u".into(), vec![0.0, -0.0, 5.0])]).unwrap();
    write_csv(&r, &path).unwrap();
    assert_eq!(read_csv(&path, None, &Columns::new(), &Piece::default()).unwrap(), r);
}

const DATA: &str = "t,y\n0,1\n1,1\n2,2\n";

#[test]
fn a_set_says_what_no_fit_may_see() {
    let set = r#"
model    = "model.toml"
fit      = ["a.csv", "b.mcap"]
held_out = ["c.csv"]
initial  = "free"

[columns]
t = "time_s"
position = { column = "disp_in", scale = 0.0254 }
force = { topic = "/master/servo_jf", field = "effort[0]", scale = 2.0, offset = 1.0 }
speed = { scale = 0.5 }

[files."a.csv"]
rows = [10, 20]
where = { run = 3, side = "left" }
condition = { "elements.band.force" = "free", elements.oil.damping = 3 }

[sessions.tuesday]
files = ["a.csv", "c.csv"]
condition = { "inputs.position.offset" = "free" }
"#;
    let dir = folder(&[("set.toml", set), ("model.toml", ""), ("a.csv", DATA), ("b.mcap", ""), ("c.csv", DATA)]);
    let s = RecordingSet::open(dir.path()).unwrap();
    assert_eq!((s.fit.len(), s.held_out.as_slice(), s.initial), (2, ["c.csv".to_string()].as_slice(), Initial::Free));
    assert_eq!(s.model, Some(dir.path().join("model.toml")));
    assert_eq!(s.columns[2].1.source, Source::Topic { topic: "/master/servo_jf".into(), field: "effort[0]".into() });
    assert_eq!((s.columns[2].1.scale, s.columns[2].1.offset), (Some(2.0), 1.0));
    assert_eq!(s.columns[3].1.source, Source::Column("speed".into()));
    let rules = s.rules_of("a.csv");
    assert_eq!(rules.piece.rows, Some([10, 20]));
    assert_eq!(rules.piece.keep, [("run".to_string(), Cell::Number(3.0)), ("side".to_string(), Cell::Text("left".into()))]);
    assert_eq!(
        rules.condition,
        [
            ("elements.band.force".to_string(), Condition::Free),
            ("elements.oil.damping".to_string(), Condition::Value(3.0)),
            ("inputs.position.offset".to_string(), Condition::Shared(0))
        ]
    );
    assert_eq!(s.rules_of("b.mcap"), Default::default());
    assert_eq!(s.rules_of("c.csv").condition, [("inputs.position.offset".to_string(), Condition::Shared(0))]);
    assert_eq!(s.sessions, [("tuesday".to_string(), vec!["inputs.position.offset".to_string()])]);
    let refused = |s: &RecordingSet| s.check_conditions(&Model::default()).unwrap_err().to_string();
    let message = refused(&s);
    assert_names(&message, &["set.toml", "sessions.tuesday.condition.inputs.position.offset", "\"position\""]);
    let message = refused(&RecordingSet { sessions: Vec::new(), ..s.clone() });
    assert!(message.ends_with("files.a.csv.condition.elements.band.force: unknown element \"band\"; there is none here"), "{message}");
    assert_eq!(RecordingSet::open(&dir.path().join("set.toml")).unwrap(), s);

    let bare = folder(&[("b.csv", DATA), ("a.csv", DATA), ("notes.txt", "")]);
    let s = RecordingSet::open(bare.path()).unwrap();
    assert_eq!((s.fit.as_slice(), s.model.clone()), (["a.csv".to_string(), "b.csv".to_string()].as_slice(), None));
    assert_eq!(s.read_table("a.csv", &["y"]).unwrap().len(), 3);
}

#[test]
fn pieces_of_one_file_are_recordings_of_their_own() {
    let set = r#"
fit = ["slow"]
held_out = ["fast"]
files.slow = { of = "log.csv", where = { run = 1 } }
files.fast = { of = "log.csv", where = { run = 2 } }
"#;
    let log = "t,run,y\n0,1,10\n1,1,11\n0,2,12\n1,2,13\n";
    let dir = folder(&[("set.toml", set), ("log.csv", log)]);
    let s = RecordingSet::open(dir.path()).unwrap();
    assert_eq!((s.path_of("slow"), s.path_of("fast")), (dir.path().join("log.csv"), dir.path().join("log.csv")));
    let y = |piece: &str| s.read_table(piece, &["y"]).unwrap().signals[0].1.clone();
    assert_eq!((y("slow"), y("fast")), (vec![10.0, 11.0], vec![12.0, 13.0]));
    let refused = |set: &str| {
        let dir = folder(&[("set.toml", set), ("log.csv", log), ("notes.txt", "")]);
        message(RecordingSet::open(dir.path()))
    };
    assert_names(refused("fit = [\"slow\"]\nfiles.slow = { of = \"lag.csv\" }"), &["lag.csv"]);
    assert_names(refused("fit = [\"slow\"]\nfiles.slow = { of = \"notes.txt\" }"), &["notes.txt"]);
}

#[test]
fn columns_that_a_model_does_not_use_may_hold_anything() {
    let model = "[bodies]\nm = 1.0\n[[inputs]]\nname = \"f\"\nkind = \"force\"\non = \"m\"\n\
                 [[outputs]]\nname = \"x\"\nkind = \"position\"\nof = \"m\"\n[[outputs]]\nname = \"v\"\nkind = \"velocity\"\nof = \"m\"\n";
    let model = Model::from_toml(model, "m.toml").unwrap();
    let dir = folder(&[("a.csv", "t [ms],state,f,x [mm],note\n0,RUN,1,2,\n1,RUN,2,3,nan\n"), ("b.csv", "t,state,x\n0,RUN,1\n1,RUN,2\n")]);
    let read = |name: &str, absent: bool| {
        TableSource::File(dir.path().join(name)).read_signals_of(&model, &Columns::new(), &Piece::default(), &|_| absent)
    };
    let a = read("a.csv", false).unwrap();
    assert_eq!(a.signals, [("f".to_string(), vec![1.0, 2.0]), ("x".to_string(), vec![2e-3, 3e-3])]);
    let told = message(read("b.csv", false));
    assert!(told.starts_with("b.csv:1: unknown column \"f\"; there is t, state, x"), "{told}");
    assert_eq!(read("b.csv", true).unwrap().signals.len(), 1);
    assert_eq!(read_headings(&dir.path().join("a.csv")).unwrap(), ["t [ms]", "state", "f", "x [mm]", "note"]);
    assert_eq!(message(read_headings(&dir.path().join("c.csv"))), "c.csv: there is no such file");
}

#[test]
fn wrong_sets_are_refused() {
    let open = |set: &str| {
        let dir = folder(&[("set.toml", set), ("a.csv", DATA), ("b.csv", DATA)]);
        message(RecordingSet::open(dir.path()))
    };
    assert_eq!(open("fit = ['a.csv', 'c.csv']"), "set.toml:1: fit: there is no file \"c.csv\"");
    assert_eq!(open("model = 'm.toml'\nfit = ['a.csv']"), "set.toml:1: model: there is no file \"m.toml\"");
    assert_eq!(
        open("fit = ['a.csv']\nheld_out = ['a.csv']"),
        "set.toml:2: held_out: \"a.csv\" is in fit too; a held-out recording must not be fitted"
    );
    assert_eq!(
        open("fit = ['a.txt']"),
        "set.toml:1: fit: \"a.txt\" is not a recording; expected .csv or .mcap (`backdrive bag import` makes bags of other formats)"
    );
    assert_eq!(open("held_uot = ['a.csv']\nfit=['b.csv']"), "set.toml:1: unknown key \"held_uot\"; did you mean \"held_out\"?");
    assert_eq!(open("fit = ['a.csv']\ninitial = 'moving'"), "set.toml:2: initial: unknown value \"moving\"; expected one of rest, free");
    assert_eq!(
        open("fit = ['a.csv']\n[files.'b.csv']\nrows = [1, 2]"),
        "set.toml:2: files.b.csv: unknown file \"b.csv\"; did you mean \"a.csv\"?"
    );
    assert_eq!(
        open("[files.'b.csv']\nrows = [2, 1]"),
        "set.toml:2: files.b.csv.rows: expected two row numbers, from 0: the first that counts and the first that does not"
    );
    assert_eq!(
        open("[columns]\ny = 3"),
        "set.toml:2: columns.y: expected the heading of a column, or a table with column, or with topic and field"
    );
    assert_eq!(open("[columns]\ny = { topic = '/a' }"), "set.toml:2: columns.y: missing key \"field\"");
    assert_eq!(
        open("[sessions.b]\nfiles = ['c.csv']\ncondition = { elements.band.force = 'free' }"),
        "set.toml:2: sessions.b.files: unknown file \"c.csv\"; did you mean \"a.csv\"?"
    );
    assert_eq!(
        open("[sessions.b]\nfiles = ['b.csv', 'b.csv']\ncondition = { elements.band.force = 'free' }"),
        "set.toml:2: sessions.b.files: \"b.csv\": \"elements.band.force\" has a condition in this file, or in another session of it, already"
    );
    assert_eq!(open("[sessions.b]\nfiles = ['b.csv']"), "set.toml:1: sessions.b: missing key \"condition\"");
    assert_eq!(
        open("[files.'a.csv']\ncondition = { band = 'free' }"),
        "set.toml:2: files.a.csv.condition.band: expected the path of a parameter, such as elements.band.force"
    );
}

/// The concealed cases and the real data are not part of the repository: without them there is nothing to check.
#[test]
fn every_concealed_set_reads() {
    let shared: PathBuf = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../shared");
    let Ok(cases) = std::fs::read_dir(shared.join("concealed/dev")) else {
        skipped("no concealed cases beside the workspace");
        return;
    };
    for (count, case) in cases.enumerate() {
        let set = RecordingSet::open(&case.unwrap().path()).unwrap_or_else(|e| panic!("{e}"));
        let model = Model::load(set.model.as_ref().unwrap()).unwrap_or_else(|e| panic!("{e}"));
        // Every set is opened; reading a few of the files is enough.
        for file in set.fit.iter().take(usize::from(count % 12 == 0)) {
            let r = set.read_table(file, &signals_of(&model)).unwrap_or_else(|e| panic!("{e}"));
            assert!(r.is_regular(0.01) && r.len() > 1000);
        }
    }
}

#[test]
fn times_that_are_even_but_for_their_rounding_stay_as_they_are_written() {
    let model = Model::load(&Path::new(env!("CARGO_MANIFEST_DIR")).join("models/impulse-engine.toml")).unwrap();
    let recording = |t: &[f64]| Recording::new("r", t.to_vec(), vec![("feedback_force".to_string(), vec![0.0; t.len()])]).unwrap();
    let written: Vec<f64> = (0..1000).map(|i| i as f64 / 1000.0).collect();
    assert_eq!(recording(&written).regular_for(&model).unwrap().t, written);
    // A logger's wandering clock is put onto an even grid.
    let wandering: Vec<f64> = written.iter().enumerate().map(|(i, t)| t + 1e-4 * (i as f64).sin()).collect();
    let even = recording(&wandering).regular_for(&model).unwrap().t;
    assert!(even != wandering && even.windows(2).all(|w| (w[1] - w[0] - even[1] + even[0]).abs() < 1e-12));
}

#[test]
fn a_set_in_memory_reads_as_its_files_do() {
    let dir = folder(&[("a.csv", "t,run,f [N],x [mm]\n0,1,1,2\n0.1,1,2,3\n0.2,2,3,4\n0.3,2,4,5\n"), ("b.csv", "t,x\n0,1\n1,2\n")]);
    let settings = "fit = [\"a.csv\", \"late\"]\nheld_out = [\"b.csv\"]\n[columns]\nangle = \"x\"\n\
                    [files.late]\nof = \"a.csv\"\nwhere = { run = 2 }\n";
    std::fs::write(dir.path().join("set.toml"), settings).unwrap();
    let of_files = RecordingSet::open(dir.path()).unwrap();
    let column = |heading: &str, values: [f64; 4]| (heading.to_string(), values.to_vec());
    let columns = |x: f64| {
        vec![
            column("t", [0.0, 0.1, 0.2, 0.3]),
            column("run", [1.0, 1.0, 2.0, 2.0]),
            column("f [N]", [1.0, 2.0, 3.0, 4.0]),
            column("x [mm]", [2.0, 3.0, x, 5.0]),
        ]
    };
    let in_memory = |x: f64| {
        let frame = Frame::new("a.csv", columns(x)).unwrap();
        RecordingSet::in_memory(settings, dir.path().to_path_buf(), vec![frame]).unwrap()
    };
    let set = in_memory(4.0);
    assert_eq!((set.paths().len(), set.is_bag("a.csv")), (1, false), "b.csv is the only file");
    for (piece, signals) in [("a.csv", ["f", "angle"]), ("late", ["f", "angle"])] {
        let (file, memory) = (of_files.read_table(piece, &signals).unwrap(), set.read_table(piece, &signals).unwrap());
        assert_eq!((file.t, file.signals, file.units), (memory.t, memory.signals, memory.units), "{piece}");
    }
    assert_eq!(set.read_table("b.csv", &["angle"]).unwrap().len(), 2);
    // A missing value is an error at its row, counted with the heading.
    let error = in_memory(f64::NAN).read_table("a.csv", &["angle"]).unwrap_err();
    assert_eq!((error.path.as_str(), error.line), ("a.csv", Some(4)), "{error}");
    let missing = set.read_table("a.csv", &["speed"]).unwrap_err();
    assert_eq!((missing.path.as_str(), missing.line), ("a.csv", Some(1)), "{missing}");
    let uneven = Frame::new("a.csv", vec![("t".to_string(), vec![0.0, 1.0]), ("x".to_string(), vec![0.0])]).unwrap_err();
    assert!(uneven.path == "a.csv" && uneven.message.contains('x'), "{uneven}");
}
