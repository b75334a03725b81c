//! Columns out of bags, and tables to bags and back.

mod common;

use backdrive_bags::{
    BagError, ColumnMap, ImportOptions, Quantity, Reader, Recorder, RecorderOptions, Signal, export_csv, import_csv, recording,
    recording_up_to, signals,
};
use backdrive_plant::model::Hold;
use backdrive_plant::recording::{ColumnRule, Piece, Source};
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
    assert!(says(Signal::new("x", "/slave", "position[0]")).contains("/master/measured_js"));
    assert!(says(Signal::new("x", "/master/measured_js", "torque[0]")).contains("position"));
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
        variable: None,
        overwrite: false,
    };
    import_csv(&table, &bag, &options).expect("it imports");
    let reader = Reader::open(&bag).expect("it opens");
    assert_eq!(reader.header().map(|header| header.rate_hz), Some(1000.0));
    let wanted = [Signal::new("x", "/master/measured_js", "position[1]"), Signal::new("f", "/master/measured_js", "effort[0]")];
    let found = signals(&reader, &wanted).expect("they are there");
    assert_eq!(found.columns, [vec![0.0254, 2.0 * 0.0254, 3.0 * 0.0254], vec![5.0, 6.0, 7.0]]);
    options.overwrite = true;
    options.columns[1] = map("g", Quantity::Effort, 0, 1.0);
    assert!(import_csv(&table, &bag, &options).expect_err("no such column").to_string().contains("disp_in"));
    options.columns[1] = map("f", Quantity::Position, 1, 1.0);
    assert!(import_csv(&table, &bag, &options).expect_err("twice the same place").to_string().contains("both go to"));
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
        ("t,x\n1e300,1\n", "no time"),
    ] {
        write(&table, text);
        let error = import_csv(&table, &bag, &ImportOptions::default()).expect_err(text).to_string();
        assert!(error.contains(says), "{error}");
        assert!(!bag.exists(), "no bag is begun");
    }
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
