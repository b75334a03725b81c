//! Columns out of bags, and tables to bags and back.

#[path = "../../tests/common/naming.rs"]
mod naming;

mod common;

use backdrive_bags::{
    BagError, ColumnMap, ImportOptions, Quantity, Reader, Recorder, RecorderOptions, Signal, export_csv, import_csv, import_table,
    recording, recording_up_to, signals,
};
use backdrive_plant::model::Hold;
use backdrive_plant::recording::{ColumnRule, Piece, Source};
use naming::assert_names;
use std::path::Path;

fn write(path: &Path, text: &str) {
    std::fs::write(path, text).expect("it writes");
}

#[test]
fn signals_are_aligned_by_step() {
    let dir = tempfile::tempdir().expect("a directory");
    let path = dir.path().join("run.mcap");
    common::record(&path, 1_200);
    let reader = Reader::open(&path).expect("it opens");
    let wanted = [
        Signal::new("x", "/master/measured_js", "position[0]"),
        Signal { scale: 2.0, offset: 1.0, ..Signal::new("f", "/master/servo_jf", "effort[0]") },
        Signal::new("mu", "/scaling/gains", "mu"),
    ];
    let found = signals(&reader, &wanted).expect("they are there");
    assert_eq!(found.names, ["x", "f", "mu"]);
    assert_eq!(found.steps.as_ref().map(Vec::len), Some(1_200));
    assert!(found.alignment.by_step);
    assert_eq!(found.alignment.missing, [0, 0, 0]);
    for step in 0..1_200_u64 {
        let i = step as usize;
        let (backdrive_msgs::Message::Sample(x), backdrive_msgs::Message::Sample(f)) = (common::measured(step), common::force(step)) else {
            panic!("samples")
        };
        assert_eq!(found.t[i], step as f64 / 1000.0);
        assert_eq!(found.columns[0][i].to_bits(), x.position[0].to_bits());
        assert_eq!(found.columns[1][i], 2.0 * f.effort[0] + 1.0);
        assert_eq!(found.columns[2][i], 1.0 + (step / 500 * 500) as f64 * 1e-4, "gains hold until the next");
    }
}

#[test]
fn a_lost_message_is_a_gap_of_the_recording() {
    let dir = tempfile::tempdir().expect("a directory");
    let path = dir.path().join("run.mcap");
    let mut recorder = Recorder::create(&path, &common::header(), &RecorderOptions::default()).expect("it starts");
    for step in 2..100 {
        if step != 50 {
            recorder.push(common::MEASURED, common::measured(step), 0).expect("it writes");
        }
        recorder.push(common::FORCE, common::force(step - 2), 0).expect("it writes");
    }
    recorder.finish().expect("it finishes");
    let reader = Reader::open(&path).expect("it opens");
    let rule = |topic: &str, field: &str| {
        let source = Source::Topic { topic: topic.to_owned(), field: field.to_owned() };
        ColumnRule::of(source)
    };
    let columns =
        vec![("x".to_owned(), rule("/master/measured_js", "position[0]")), ("f".to_owned(), rule("/master/servo_jf", "effort[0]"))];
    let found = recording(&reader, Some(&["x", "f"]), &columns, &Piece::default(), &|_| Hold::Linear).expect("they are there");
    assert_eq!((found.t[0], found.t[found.len() - 1]), (0.002, 0.097), "the time that both cover");
    assert_eq!(found.len(), 95);
    assert_eq!(found.jitter.gaps.len(), 1);
    assert_eq!(found.jitter.gaps[0].after, 0.049);
    let piece = Piece { rows: Some([10, 20]), ..Piece::default() };
    assert_eq!(recording(&reader, Some(&["x", "f"]), &columns, &piece, &|_| Hold::Linear).expect("they are there").t[0], 0.012);
}

#[test]
fn what_is_not_there_is_told_with_what_is() {
    let dir = tempfile::tempdir().expect("a directory");
    let path = dir.path().join("run.mcap");
    common::record(&path, 50);
    let reader = Reader::open(&path).expect("it opens");
    let says = |signal: Signal| signals(&reader, &[signal]).expect_err("it is not there").to_string();
    assert_names(says(Signal::new("x", "/slave", "position[0]")), &["/master/measured_js"]);
    assert_names(says(Signal::new("x", "/master/measured_js", "torque[0]")), &["position"]);
    let never = recording(
        &reader,
        Some(&["x"]),
        &vec![("x".to_owned(), ColumnRule::of(Source::Topic { topic: "/master/measured_js".to_owned(), field: "effort[0]".to_owned() }))],
        &Piece::default(),
        &|_| Hold::Linear,
    );
    assert!(matches!(&never, Err(BagError::Field { what, .. }) if what.contains("never measured")), "{never:?}");
}

#[test]
fn an_export_has_every_signal_bit_for_bit() {
    let dir = tempfile::tempdir().expect("a directory");
    let (path, out) = (dir.path().join("run.mcap"), dir.path().join("run.csv"));
    common::record(&path, 300);
    let reader = Reader::open(&path).expect("it opens");
    assert_eq!(export_csv(&reader, &out, None).expect("it exports"), 300);
    let text = std::fs::read_to_string(&out).expect("it reads");
    let mut lines = text.lines();
    assert_eq!(
        lines.next(),
        Some(
            "t,step,/master/measured_js.position.forward,/master/measured_js.position.side,/master/measured_js.velocity.forward,\
             /master/servo_jf.effort.forward,/master/servo_jf.effort.side,/scaling/gains.mu,/scaling/gains.lambda"
        )
    );
    for (step, line) in lines.enumerate() {
        let cells: Vec<&str> = line.split(',').collect();
        let (backdrive_msgs::Message::Sample(x), backdrive_msgs::Message::Sample(f)) =
            (common::measured(step as u64), common::force(step as u64))
        else {
            panic!("samples")
        };
        let number = |cell: &str| cell.parse::<f64>().expect("a number").to_bits();
        assert_eq!(cells[1], step.to_string());
        assert_eq!(number(cells[2]), x.position[0].to_bits());
        assert_eq!(number(cells[4]), x.velocity[0].to_bits());
        assert_eq!(number(cells[6]), f.effort[1].to_bits(), "NaN and the sign of a zero survive");
    }
    let some = dir.path().join("some.csv");
    export_csv(&reader, &some, Some(&["/master/servo_jf".to_owned()])).expect("it exports");
    assert!(
        std::fs::read_to_string(&some)
            .expect("it reads")
            .starts_with("t,step,/master/servo_jf.effort.forward,/master/servo_jf.effort.side\n")
    );
    assert!(export_csv(&reader, &out, None).is_err(), "a file that exists is not overwritten");
    assert!(export_csv(&reader, &dir.path().join("no.csv"), Some(&["/no".to_owned()])).is_err());
}

#[test]
fn a_table_comes_back_from_a_bag() {
    let dir = tempfile::tempdir().expect("a directory");
    let (table, bag) = (dir.path().join("x.csv"), dir.path().join("x.mcap"));
    write(
        &table,
        "t,force [N],motor_position,note\n0.1,1.5,-0,a\n0.30000000000000004,2.25,1e-7,b\n0.5123456789123,3,2e-7,c\n0.7,4,3e-7,d\n",
    );
    let report = import_csv(&table, &bag, &ImportOptions::default()).expect("it imports");
    assert_eq!((report.rows, report.skipped.as_slice()), (4, &["note".to_owned()][..]));
    assert_eq!(report.topics, ["/recording/force", "/recording/motor_position"]);
    let reader = Reader::open(&bag).expect("it opens");
    let found = recording(&reader, Some(&["force"]), &Vec::new(), &Piece::default(), &|_| Hold::Zero).expect("it is there");
    assert_eq!(found.t, [0.1, 0.30000000000000004, 0.5123456789123, 0.7], "times are exact");
    assert_eq!(found.signals[0].1, [1.5, 2.25, 3.0, 4.0]);
    let again = dir.path().join("again.csv");
    export_csv(&reader, &again, None).expect("it exports");
    assert_eq!(
        std::fs::read_to_string(&again).expect("it reads"),
        "t,force,motor_position\n0.1,1.5,-0.0\n0.30000000000000004,2.25,1e-7\n0.5123456789123,3.0,2e-7\n0.7,4.0,3e-7\n"
    );
}

#[test]
fn cells_are_separated_as_others_do_it() {
    let dir = tempfile::tempdir().expect("a directory");
    let (table, bag) = (dir.path().join("x.csv"), dir.path().join("x.mcap"));
    for separator in [",", ";", "\t", " "] {
        write(&table, &["t,x,y", "0,1,4", "0.5,2,5"].join("\n").replace(',', separator));
        let options = ImportOptions { overwrite: true, ..ImportOptions::default() };
        import_csv(&table, &bag, &options).unwrap_or_else(|error| panic!("{separator:?}: {error}"));
        let found =
            signals(&Reader::open(&bag).expect("it opens"), &[Signal::new("y", "/recording/y", "position[0]")]).expect("it is there");
        assert_eq!(found.columns, [vec![4.0, 5.0]], "{separator:?}");
    }
}

#[test]
fn columns_go_where_they_are_sent() {
    let dir = tempfile::tempdir().expect("a directory");
    let (table, bag) = (dir.path().join("x.csv"), dir.path().join("x.mcap"));
    write(&table, "time_s,disp_in,f\n0,1,5\n0.001,2,6\n0.002,3,7\n");
    let map = |column: &str, quantity, axis, scale| ColumnMap {
        column: column.to_owned(),
        topic: "/master/measured_js".to_owned(),
        quantity,
        axis,
        scale,
        offset: 0.0,
    };
    let mut options = ImportOptions {
        time: "time_s".to_owned(),
        columns: vec![map("disp_in", Quantity::Position, 1, 0.0254), map("f", Quantity::Effort, 0, 1.0)],
        overwrite: false,
        ..ImportOptions::default()
    };
    import_csv(&table, &bag, &options).expect("it imports");
    let reader = Reader::open(&bag).expect("it opens");
    assert_eq!(reader.header().map(|header| header.rate_hz), Some(1000.0));
    let wanted = [Signal::new("x", "/master/measured_js", "position[1]"), Signal::new("f", "/master/measured_js", "effort[0]")];
    let found = signals(&reader, &wanted).expect("they are there");
    assert_eq!(found.columns, [vec![0.0254, 2.0 * 0.0254, 3.0 * 0.0254], vec![5.0, 6.0, 7.0]]);
    options.overwrite = true;
    options.columns[1] = map("g", Quantity::Effort, 0, 1.0);
    assert_names(import_csv(&table, &bag, &options).expect_err("no such column").to_string(), &["disp_in"]);
    options.columns[1] = map("f", Quantity::Position, 1, 1.0);
    assert!(import_csv(&table, &bag, &options).expect_err("twice the same place").to_string().contains("both map to"));
}

#[test]
fn a_bad_table_is_told_with_its_line() {
    let dir = tempfile::tempdir().expect("a directory");
    let (table, bag) = (dir.path().join("x.csv"), dir.path().join("x.mcap"));
    for (text, says) in [
        ("t,x\n0,1\n0.2,2\n0.1,3\n", "line 4: time goes back from 0.2 to 0.1"),
        ("t,x\n0,1\n0.2,2\n0.2,3\n", "line 4"),
        ("t,x\n0,1\nzero,2\n", "line 3: column \"t\": \"zero\""),
        ("x,y\n0,1\n", "there is no column \"t\"; there is x, y"),
        ("t,x\n0,1\n1,2,3\n", "line 3"),
        ("t,x\n1e300,1\n", "is not a time in s"),
        // Comments, empty lines and carriage returns count.
        ("# by hand\n\nt,x\n0,1\n# a pause\n0.2,2\n0.1,3\n", "line 7: time goes back"),
        ("t,x\r\n0,1\r\n0.2,2\r\n0.1,3\r\n", "line 4: time goes back"),
        ("t,x\r\n0,1\r\n1,2,3\r\n", "line 3: expected 2 cells, as the heading has, found 3"),
        ("t;x\n0,1;1\n0,2;2\n", "line 2: column \"t\": \"0,1\" is not a number; write decimal points"),
        (
            "t;x\n0;1,5\n1;2,5\n",
            "no numeric column besides the times; column \"x\" holds something that is not a number, first in line 2: \"1,5\"; write \
                decimal points",
        ),
        ("time, s;x, mm\n0,1;1,5\n0,2;2,5\n", "there is no column \"t\", and none with numbers; there is time, x"),
        ("# t x\n0 1\n1 2\n", "there is no heading"),
        ("t,x,t\n0,1,5\n1,2,6\n", "line 1: two columns are called \"t\""),
        ("t,q[0],q(0)\n0,1,5\n1,2,6\n", "both map to position[0] of /recording/q_0_; give their topics with --map"),
        ("t [mm],x\n0,1\n1,2\n", "is in mm, a length"),
        (
            "t,x\n0,1\n1000000,2\n2000000,3\n",
            "usually 1000000.0 s apart, which is implausible: state their unit, in the heading or as --time \"t [ns]\"",
        ),
        ("t,x\n3e9,1\n", "is not a time in s"),
    ] {
        write(&table, text);
        let error = import_csv(&table, &bag, &ImportOptions::default()).expect_err(text).to_string();
        assert!(error.contains(says), "{error}");
        assert!(!bag.exists(), "no bag is begun");
    }
}

#[test]
fn a_table_that_is_no_utf_8_is_told_with_its_line() {
    let dir = tempfile::tempdir().expect("a directory");
    let (table, bag) = (dir.path().join("x.csv"), dir.path().join("x.mcap"));
    let utf16: Vec<u8> = "\u{feff}t,x\n0,1\n".encode_utf16().flat_map(u16::to_le_bytes).collect();
    let cases: [(&[u8], &str); 5] = [
        (b"t;Gr\xf6\xdfe [mm]\n0;1\n", "line 1: is not UTF-8 text; save the table as UTF-8"),
        (b"t,x,note\n0,1,a\n1,2,\xb5\n", "line 3: is not UTF-8 text"),
        (&utf16, "line 1: is text in UTF-16; save the table as UTF-8"),
        (b"PK\x03\x04\x14\0", "is a zip archive; of a workbook of Excel, save the table as CSV"),
        (b"\x28\xb5\x2f\xfd\0\0", "is compressed by zstd; unpack it with `zstd -d`"),
    ];
    for (bytes, says) in cases {
        std::fs::write(&table, bytes).expect("it writes");
        let error = import_table(&table, &bag, &ImportOptions::default()).expect_err(says).to_string();
        assert_names(&error, &[says, "x.csv"]);
    }
    write(&table, "\u{feff}t,x\n0,1\n1,2\n");
    assert_eq!(import_table(&table, &bag, &ImportOptions::default()).expect("a mark is none of the heading").rows, 2);
}

#[test]
fn a_heading_that_is_asked_for_whole_names_its_unit_all_the_same() {
    let dir = tempfile::tempdir().expect("a directory");
    let (table, bag) = (dir.path().join("x.csv"), dir.path().join("x.mcap"));
    write(&table, "time [ms],x [mm],y\n0,1,nan\n2,2,\n4,3,1\n");
    let map = |column: &str, scale| ColumnMap {
        column: column.to_owned(),
        topic: "/m".to_owned(),
        quantity: Quantity::Position,
        axis: 0,
        scale,
        offset: 0.0,
    };
    for (time, column, scale, last) in
        [("time [ms]", "x [mm]", 1.0, 3.0 * 1e-3), ("time", "x", 1.0, 3.0 * 1e-3), ("time", "x [mm]", 0.5, 1.5), ("time", "x", 0.5, 1.5)]
    {
        // What is not asked for, y, may hold anything.
        let options =
            ImportOptions { time: time.to_owned(), columns: vec![map(column, scale)], overwrite: true, ..ImportOptions::default() };
        import_csv(&table, &bag, &options).expect("it imports");
        let found = signals(&Reader::open(&bag).expect("it opens"), &[Signal::new("x", "/m", "position[0]")]).expect("it is there");
        assert_eq!((found.t[2], found.columns[0][2]), (4.0 * 1e-3, last), "{time} {column} {scale}");
    }
    // A unit may be given where the heading has none.
    write(&table, "t,x\n0,1\n1000000,2\n2000000,3\n");
    import_csv(&table, &bag, &ImportOptions { time: "t [ns]".to_owned(), overwrite: true, ..ImportOptions::default() })
        .expect("it imports");
    let found = signals(&Reader::open(&bag).expect("it opens"), &[Signal::new("x", "/recording/x", "position[0]")]).expect("it is there");
    assert_eq!(found.t, [0.0, 1e6 * 1e-9, 2e6 * 1e-9]);
}

/// An element of a MATLAB file.
fn element(kind: u32, data: &[u8]) -> Vec<u8> {
    let mut bytes = [kind.to_le_bytes(), (data.len() as u32).to_le_bytes()].concat();
    bytes.extend(data);
    bytes.resize(bytes.len().next_multiple_of(8), 0);
    bytes
}

#[test]
fn a_lone_matrix_of_a_matlab_file_is_refused_with_what_to_do_or_read() {
    let dir = tempfile::tempdir().expect("a directory");
    let (table, bag) = (dir.path().join("x.mat"), dir.path().join("x.mcap"));
    // Five rows of time, angle and torque, column by column.
    let values: Vec<u8> = (0..15).flat_map(|place| (f64::from(place % 5) * [0.5, 2.0, -1.0][place as usize / 5]).to_le_bytes()).collect();
    let size = [5_u32.to_le_bytes(), 3_u32.to_le_bytes()].concat();
    let mut file = b"MATLAB 5.0 MAT-file".to_vec();
    file.resize(124, b' ');
    file.extend([0, 1, b'I', b'M']);
    file.extend(element(14, &[element(6, &[6, 0, 0, 0, 0, 0, 0, 0]), element(5, &size), element(1, b"X"), element(9, &values)].concat()));
    std::fs::write(&table, file).expect("it writes");
    let import = |options: ImportOptions| import_table(&table, &bag, &ImportOptions { overwrite: true, ..options });
    let names = |names: &[&str]| Some(names.iter().map(|name| (*name).to_owned()).collect::<Vec<_>>());
    let error = import(ImportOptions::default()).expect_err("nothing is called t").to_string();
    for says in ["X is a matrix of 3 columns, X[0] to X[2]", "as --time \"X[0]\"", "--rate HZ"] {
        assert!(error.contains(says), "{error}");
    }
    let error = import(ImportOptions { headings: names(&["t", "q"]), ..ImportOptions::default() }).expect_err("too few").to_string();
    assert_names(&error, &["--columns", "X[0], X[1], X[2]"]);
    let at = |topic: &str| signals(&Reader::open(&bag).expect("it opens"), &[Signal::new("x", topic, "position[0]")]).expect("it is there");
    for (options, topic, times) in [
        (ImportOptions { time: "X[0]".to_owned(), ..ImportOptions::default() }, "/recording/X_1_", 0.5),
        (ImportOptions { time: "X[0] [ms]".to_owned(), ..ImportOptions::default() }, "/recording/X_1_", 0.5e-3),
        (ImportOptions { headings: names(&["t", "q", "tau"]), ..ImportOptions::default() }, "/recording/q", 0.5),
        (ImportOptions { rate_hz: Some(100.0), ..ImportOptions::default() }, "/recording/X_1_", 0.01),
    ] {
        import(options).expect("it imports");
        let found = at(topic);
        assert_eq!(found.columns[0], [0.0, 2.0, 4.0, 6.0, 8.0]);
        assert!((found.t[3] - 3.0 * times).abs() < 1e-12, "{topic}: {:?}", found.t);
    }
}

/// As MATLAB writes a table or a string: an object, which has no size, and at the end what it holds, which has no name.
#[test]
fn objects_in_a_matlab_file_do_not_hide_its_vectors() {
    let flags = |class: u8| element(6, &[class, 0, 0, 0, 0, 0, 0, 0]);
    let size = |rows: u32| element(5, &[rows.to_le_bytes(), 1_u32.to_le_bytes()].concat());
    let vector = |name: &str, kind: u8, stored: u32, data: &[u8], rows| {
        element(14, &[flags(kind), size(rows), element(1, name.as_bytes()), element(stored, data)].concat())
    };
    let times: Vec<u8> = [0.0_f64, 0.5].iter().flat_map(|time| time.to_le_bytes()).collect();
    let object =
        [flags(17), element(1, b"remark"), element(1, b"MCOS"), element(1, b"string"), vector("", 13, 6, &[1, 0, 0, 0], 1)].concat();
    let mut file = b"MATLAB 5.0 MAT-file".to_vec();
    file.resize(124, b' ');
    file.extend([0, 1, b'I', b'M']);
    file.extend([vector("t", 6, 9, &times, 2), element(14, &object), vector("x", 6, 9, &times, 2), vector("", 9, 2, &[7, 7], 2)].concat());
    let dir = tempfile::tempdir().expect("a directory");
    let (table, bag) = (dir.path().join("x.mat"), dir.path().join("x.mcap"));
    std::fs::write(&table, file).expect("it writes");
    let report = import_table(&table, &bag, &ImportOptions::default()).expect("it imports");
    assert_eq!((report.rows, report.topics.as_slice()), (2, &["/recording/x".to_owned()][..]));
    assert_eq!(
        report.notes,
        ["omitted, because they are not numeric columns as long as t: remark (an object such as a table, a string or \
        a date)"]
    );
}

#[test]
fn a_recording_is_read_no_further_than_asked_for_and_is_the_same_up_to_there() {
    let dir = tempfile::tempdir().expect("a directory");
    let (csv, path) = (dir.path().join("x.csv"), dir.path().join("x.mcap"));
    let rows: String = (0..2_000).map(|k| format!("{},{},{}\n", k as f64 * 1e-3, (k as f64 * 0.01).sin(), k % 7)).collect();
    write(&csv, &format!("t,a,b\n{rows}"));
    import_csv(&csv, &path, &ImportOptions::default()).expect("it imports");
    let reader = Reader::open(&path).expect("it opens");
    let up_to =
        |piece: &Piece, most| recording_up_to(&reader, Some(&["a", "b"]), &Vec::new(), piece, &|_| Hold::Linear, most).expect("it reads");
    let whole = recording(&reader, Some(&["a", "b"]), &Vec::new(), &Piece::default(), &|_| Hold::Linear).expect("it reads");
    let part = up_to(&Piece::default(), 300);
    assert!((300..=301).contains(&part.t.len()), "{}", part.t.len());
    assert_eq!(part.t, whole.t[..part.t.len()]);
    for ((_, some), (_, all)) in part.signals.iter().zip(&whole.signals) {
        assert_eq!(*some, all[..some.len()]);
    }
    assert!(up_to(&Piece::default(), 2_000).signals == whole.signals, "a recording that is no longer is whole");
    // A piece that is asked for by its rows is read though it lies behind.
    let piece = Piece { rows: Some([1_000, 1_500]), ..Piece::default() };
    assert!(up_to(&piece, 300).signals[0].1 == whole.signals[0].1[1_000..1_500]);
}
