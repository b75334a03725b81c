//! Bags of other people: their types, their chunking, their clocks.

#[path = "../../tests/common/naming.rs"]
mod naming;

mod common;

use backdrive_bags::{ImportOptions, Reader, Signal, export_csv, import_csv, info, recover, signals};
use backdrive_plant::model::Hold;
use mcap::records::MessageHeader;
use naming::assert_names;
use std::collections::BTreeMap;
use std::path::Path;

const HEADER: &str = "================================================================================\nMSG: std_msgs/Header\n\
    builtin_interfaces/Time stamp\nstring frame_id\n\
    ================================================================================\nMSG: builtin_interfaces/Time\nint32 sec\nuint32 nanosec\n";
const WRENCH: &str = "std_msgs/Header header\ngeometry_msgs/Wrench wrench\n\
    ================================================================================\nMSG: geometry_msgs/Wrench\nVector3 force\nVector3 torque\n\
    ================================================================================\nMSG: geometry_msgs/Vector3\nfloat64 x\nfloat64 y\nfloat64 z\n";
const JOINTS: &str = "std_msgs/Header header\nstring[] name\nfloat64[] position\nfloat64[] velocity\nfloat64[] effort\n";

/// Little-endian CDR, counted from behind the encapsulation header.
struct Cdr(Vec<u8>);

impl Cdr {
    fn header(ns: u64, frame: &str) -> Cdr {
        let mut cdr = Cdr(vec![0, 1, 0, 0]);
        cdr.0.extend(((ns / 1_000_000_000) as i32).to_le_bytes());
        cdr.0.extend(((ns % 1_000_000_000) as u32).to_le_bytes());
        cdr.text(frame);
        cdr
    }

    fn align(&mut self, to: usize) {
        while !(self.0.len() - 4).is_multiple_of(to) {
            self.0.push(0);
        }
    }

    fn text(&mut self, text: &str) {
        self.align(4);
        self.0.extend((text.len() as u32 + 1).to_le_bytes());
        self.0.extend(text.as_bytes());
        self.0.push(0);
    }

    fn numbers(&mut self, counted: bool, values: &[f64]) {
        if counted {
            self.align(4);
            self.0.extend((values.len() as u32).to_le_bytes());
        }
        for value in values {
            self.align(8);
            self.0.extend(value.to_le_bytes());
        }
    }
}

/// Forces at 1000 Hz, joints at 250 Hz and half a period off, a topic that is no CDR.
fn write(path: &Path, options: mcap::WriteOptions) {
    let file = std::io::BufWriter::new(std::fs::File::create(path).expect("it can be created"));
    let mut out = options.create(file).expect("it starts");
    let channel = |out: &mut mcap::Writer<_>, topic: &str, schema: &str, encoding: &str, text: &str| {
        let schema = out.add_schema(schema, encoding, text.as_bytes()).expect("a schema");
        let message = if encoding == "ros2msg" { "cdr" } else { "json" };
        out.add_channel(schema, topic, message, &BTreeMap::new()).expect("a channel")
    };
    let force = channel(&mut out, "/ft_sensor", "geometry_msgs/msg/WrenchStamped", "ros2msg", &format!("{WRENCH}{HEADER}"));
    let joints = channel(&mut out, "/joint_states", "sensor_msgs/msg/JointState", "ros2msg", &format!("{JOINTS}{HEADER}"));
    let notes = channel(&mut out, "/notes", "note", "jsonschema", "{}");
    let begin = 1_700_000_000_000_000_000_u64;
    for k in 0..1000_u64 {
        let mut send = |channel_id, time: u64, data: &[u8]| {
            let header = MessageHeader { channel_id, sequence: k as u32, log_time: time + 300_000, publish_time: time };
            out.write_to_known_channel(&header, data).expect("it writes");
        };
        let time = begin + k * 1_000_000;
        let mut wrench = Cdr::header(time, "tool0");
        wrench.numbers(false, &[k as f64, 0.0, -1.0, 0.0, 0.0, 0.5]);
        send(force, time, &wrench.0);
        if k % 4 == 0 {
            let time = time + 500_000;
            let mut state = Cdr::header(time, "base");
            state.align(4);
            state.0.extend(2_u32.to_le_bytes());
            state.text("shoulder");
            state.text("elbow");
            state.numbers(true, &[(k as f64 + 0.5) * 1e-3, 2.0]);
            state.numbers(true, &[]);
            state.numbers(true, &[0.25, 0.5]);
            send(joints, time, &state.0);
        }
        if k == 7 {
            send(notes, time, b"{\"text\": \"hello\"}");
        }
    }
    out.finish().expect("it finishes");
}

#[test]
fn bags_of_any_making_are_summed_up_and_read_by_field() {
    let dir = tempfile::tempdir().expect("a directory");
    let options = mcap::WriteOptions::new;
    let makings = [
        ("zstd", options().compression_threads(0)),
        ("lz4", options().compression(Some(mcap::Compression::Lz4))),
        ("plain", options().compression(None)),
        ("unchunked", options().use_chunks(false)),
        ("no summary", options().emit_summary_records(false).emit_summary_offsets(false)),
        ("no checksums", options().calculate_chunk_crcs(false).compression(Some(mcap::Compression::Lz4))),
    ];
    for (name, options) in makings {
        let path = dir.path().join(name);
        write(&path, options.profile("ros2").library("somebody"));
        let summary = info(&path).expect(name);
        assert_eq!((summary.messages, summary.lost, summary.complete, summary.ended_cleanly), (1_251, None, None, true), "{name}");
        assert_eq!((summary.library.as_str(), summary.damage.as_deref()), ("somebody", None), "{name}");
        let joints = summary.topics.iter().find(|topic| topic.name == "/joint_states").expect("it is there");
        assert!(joints.messages == 250 && joints.rate_hz.is_some_and(|rate| (rate - 250.0).abs() < 1e-9), "{name}: {joints:?}");
        assert_names(summary.to_string(), &["/ft_sensor"]);

        let reader = Reader::open(&path).expect(name);
        let wanted = [
            Signal { scale: 2.0, ..Signal::new("force", "/ft_sensor", "wrench.force.x") },
            Signal::new("x", "/joint_states", "position[0]"),
            Signal { hold: Hold::Zero, ..Signal::new("when", "/joint_states", "header.stamp") },
        ];
        let found = signals(&reader, &wanted).expect(name);
        assert!(!found.alignment.by_step && found.steps.is_none());
        // Rows are the wrenches between the first and the last joint state: k = 1 .. 996.
        assert_eq!((found.t.len(), found.t[0]), (996, 0.0), "{name}");
        for (row, t) in found.t.iter().enumerate() {
            assert!((t - row as f64 * 1e-3).abs() < 1e-12, "{t} s: stamps near the present keep their ns");
            assert_eq!(found.columns[0][row], 2.0 * (row as f64 + 1.0));
            assert!((found.columns[1][row] - (row as f64 + 1.0) * 1e-3).abs() < 1e-12, "{name}: interpolated");
        }
        assert_eq!((found.alignment.gaps, found.alignment.disordered), (0, 0));
        assert!(found.alignment.jitter_s < 1e-12);

        let error = signals(&reader, &[Signal::new("x", "/notes", "text")]).expect_err("it is JSON").to_string();
        assert_names(&error, &["json"]);
        let saved = dir.path().join(format!("{name} saved"));
        assert_eq!(recover(&path, &saved, false).expect(name).messages, 1_251);
        assert_eq!(info(&saved).expect(name).topics, summary.topics);
        let half = std::fs::read(&path).expect("it reads");
        let cut = dir.path().join(format!("{name} cut"));
        std::fs::write(&cut, &half[..half.len() / 2]).expect("it writes");
        let summary = info(&cut).expect(name);
        assert!(!summary.ended_cleanly && summary.damage.is_none(), "{name}: {summary}");
    }
}

#[test]
fn other_peoples_numbers_can_be_exported() {
    let dir = tempfile::tempdir().expect("a directory");
    let (path, out) = (dir.path().join("x.mcap"), dir.path().join("x.csv"));
    write(&path, mcap::WriteOptions::new().compression(None));
    let reader = Reader::open(&path).expect("it opens");
    let topics = ["/ft_sensor".to_owned(), "/joint_states".to_owned()];
    export_csv(&reader, &out, Some(&topics)).expect("it exports");
    let text = std::fs::read_to_string(&out).expect("it reads");
    assert!(text.starts_with("t,/ft_sensor.wrench.force.x,/ft_sensor.wrench.force.y,"), "{}", &text[..200]);
    assert!(text.lines().next().is_some_and(|line| line.ends_with("/joint_states.effort[0],/joint_states.effort[1]")));
    // And a table of somebody else's numbers makes a bag.
    let bag = dir.path().join("again.mcap");
    import_csv(&out, &bag, &ImportOptions::default()).expect("it imports");
    let again = Reader::open(&bag).expect("it opens");
    let wanted = [Signal::new("force", "/recording/_ft_sensor_wrench_force_x", "position[0]")];
    let expected = [Signal::new("force", "/ft_sensor", "wrench.force.x"), Signal::new("x", "/joint_states", "position[0]")];
    assert_eq!(signals(&again, &wanted).expect("there").columns[0], signals(&reader, &expected).expect("there").columns[0]);
}
