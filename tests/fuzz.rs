//! Fuzz targets, one for every parser of outside bytes: whole files with bytes, numbers, lines and lengths changed at random go straight into the parser. None may
//! panic, stand still, or take more memory than an import allows.
//!
//! A second a target by default, four with BACKDRIVE_LONG=1; BACKDRIVE_FUZZ_SECONDS sets another time, BACKDRIVE_FUZZ_SEED another
//! seed than 1, and BACKDRIVE_FUZZ_ONLY names the one target to run.
//! `tests/mutated.rs` sends such files through whole commands.

#[path = "common/mutation.rs"]
mod mutation;
mod system;

use backdrive_bags::{
    Contract, ImportOptions, LerobotOptions, Reader, Schema, TableFormat, columns_of, export_lerobot, export_table, import_lerobot,
    import_table, signals,
};
use backdrive_nodes::graph::{Graph, Overrides};
use backdrive_plant::model::Model;
use backdrive_plant::recording::{Columns, Piece, read_csv, read_headings};
use backdrive_plant::set::RecordingSet;
use backdrive_stability::roles::Roles;
use mutation::mutate;
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;
use std::alloc::{GlobalAlloc, Layout, System};
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::path::Path;
use std::sync::Mutex;
use std::sync::atomic::{AtomicUsize, Ordering};
use std::time::{Duration, Instant};
use system::{Place, file, graph_text};

/// Memory that an import here may take for numbers, bytes; three times as much is the documented peak.
const MOST_BYTES: u64 = 64 << 20;
/// Peak that is a failure, bytes.
const PEAK: usize = 3 * MOST_BYTES as usize + (64 << 20);
/// Time that one file may take on a busy machine.
const PATIENCE: Duration = Duration::from_secs(60);

/// Counts the bytes in use.
struct Counting;

static NOW: AtomicUsize = AtomicUsize::new(0);
static HIGHEST: AtomicUsize = AtomicUsize::new(0);

// SAFETY: every call goes to the system's allocator unchanged.
unsafe impl GlobalAlloc for Counting {
    unsafe fn alloc(&self, layout: Layout) -> *mut u8 {
        let now = NOW.fetch_add(layout.size(), Ordering::Relaxed) + layout.size();
        HIGHEST.fetch_max(now, Ordering::Relaxed);
        unsafe { System.alloc(layout) }
    }

    unsafe fn dealloc(&self, pointer: *mut u8, layout: Layout) {
        NOW.fetch_sub(layout.size(), Ordering::Relaxed);
        unsafe { System.dealloc(pointer, layout) }
    }
}

#[global_allocator]
static ALLOCATOR: Counting = Counting;

/// What a parser makes of a damaged file at a path: whether it took it.
type Parse = Box<dyn Fn(&Path) -> bool>;

/// A parser and whole files for it.
struct Target {
    name: &'static str,
    /// Where the damaged file goes, in a folder of its own.
    at: &'static str,
    corpus: Vec<Vec<u8>>,
    is_text: bool,
    parse: Parse,
}

fn target(name: &'static str, at: &'static str, corpus: Vec<Vec<u8>>, is_text: bool, parse: impl Fn(&Path) -> bool + 'static) -> Target {
    Target { name, at, corpus, is_text, parse: Box::new(parse) }
}

fn read(path: &Path) -> Vec<u8> {
    std::fs::read(path).unwrap()
}

fn text_of(path: &Path) -> String {
    String::from_utf8_lossy(&read(path)).into_owned()
}

fn import(path: &Path) -> bool {
    let options = ImportOptions { overwrite: true, most_bytes: MOST_BYTES, ..ImportOptions::default() };
    import_table(path, &path.with_extension("imported.mcap"), &options).is_ok()
}

/// Reads a bag as commands do: its summary, every message, every number.
fn read_bag(path: &Path) -> bool {
    let Ok(reader) = Reader::open(path) else { return false };
    let info = backdrive_bags::check(path).is_ok();
    let columns = columns_of(&reader, None).and_then(|wanted| signals(&reader, &wanted)).is_ok();
    info && columns
}

/// An arm's model that names the file beside it.
fn robot(path: &Path) -> bool {
    let name = path.file_name().unwrap().to_string_lossy();
    let text = format!("name = \"arm\"\n[robot]\nfile = \"{name}\"\n");
    Model::from_toml_in(&text, "arm.toml", path.parent()).is_ok()
}

/// A small arm as MJCF.
const MJCF: &str = r#"<mujoco model="arm">
  <compiler angle="radian"/>
  <worldbody>
    <body name="upper" pos="0 0 0.1">
      <joint name="shoulder" type="hinge" axis="0 1 0" range="-1 1" damping="0.1" frictionloss="0.05" armature="0.01"/>
      <inertial pos="0 0 0.1" mass="1.2" diaginertia="0.01 0.01 0.002"/>
      <body name="lower" pos="0 0 0.2">
        <joint name="elbow" type="hinge" axis="0 1 0"/>
        <inertial pos="0 0 0.1" mass="0.8" fullinertia="0.01 0.01 0.001 0 0 0"/>
      </body>
    </body>
  </worldbody>
</mujoco>
"#;

/// A bag of somebody else's with JSON messages.
fn json_bag() -> Vec<u8> {
    let mut bytes = Vec::new();
    let mut mcap = mcap::WriteOptions::new().create(std::io::Cursor::new(&mut bytes)).unwrap();
    let channel_id = mcap.add_channel(0, "/joint_states", "json", &std::collections::BTreeMap::new()).unwrap();
    for i in 0..40_u32 {
        let text = format!("{{\"name\": [\"j1\", \"j2\"], \"position\": [{i}, 0.5], \"deep\": {{\"effort\": {i}.25}}, \"ok\": true}}");
        let time = u64::from(i) * 1_000_000;
        let header = mcap::records::MessageHeader { channel_id, sequence: i, log_time: time, publish_time: time };
        mcap.write_to_known_channel(&header, text.as_bytes()).unwrap();
    }
    mcap.finish().unwrap();
    drop(mcap);
    bytes
}

/// Types of messages in protobuf: name, descriptors, and a message of each.
fn protobuf_types() -> Vec<(String, Vec<u8>, Vec<u8>)> {
    let reader = Reader::open(Path::new(&file("tests/cases/protobuf/joints.mcap"))).unwrap();
    let first = |channel: u16| {
        let mut entries = reader.messages().unwrap().map(Result::unwrap);
        entries.find(|entry| entry.topic.channel == channel).unwrap().payload
    };
    reader.topics().iter().map(|topic| (topic.type_name.clone(), topic.schema.clone(), first(topic.channel))).collect()
}

/// A definition of a message with everything that a definition can hold.
const DEFINITION: &str = "std_msgs/Header header\nuint8 KIND=3\nstring[] name\nfloat64[] position\nfloat32[3] fixed\nbool[<=4] few\nOwn[] own\n\
                          ================================================================================\nMSG: std_msgs/Header\n\
                          builtin_interfaces/Time stamp\nstring frame_id\n\
                          ================================================================================\nMSG: builtin_interfaces/Time\nint32 sec\nuint32 nanosec\n\
                          ================================================================================\nMSG: pkg/Own\nint16 value\nwstring text\n";

/// A message of [`DEFINITION`]: little endian, numbers at multiples of their size behind the first four bytes.
fn cdr_message() -> Vec<u8> {
    let mut bytes: Vec<u8> = vec![0, 1, 0, 0];
    let mut put = |size: usize, data: &[u8]| {
        bytes.resize((bytes.len() - 4).next_multiple_of(size) + 4, 0);
        bytes.extend(data);
    };
    put(4, &2_i32.to_le_bytes());
    put(4, &5_u32.to_le_bytes());
    for text in [&b"a\0"[..], b"", b"j1\0", b"j2\0"] {
        // The empty one stands for the list's own length.
        let length = if text.is_empty() { 2 } else { text.len() as u32 };
        put(4, &length.to_le_bytes());
        put(1, text);
    }
    put(4, &2_u32.to_le_bytes());
    [0.5_f64, -1.0].iter().for_each(|x| put(8, &x.to_le_bytes()));
    [1.0_f32, 2.0, 3.0].iter().for_each(|x| put(4, &x.to_le_bytes()));
    put(4, &2_u32.to_le_bytes());
    put(1, &[1, 0]);
    put(4, &1_u32.to_le_bytes());
    put(2, &7_i16.to_le_bytes());
    put(4, &2_u32.to_le_bytes());
    put(2, &[b'o', 0, b'k', 0]);
    bytes
}

fn targets(place: &Place) -> Vec<Target> {
    let done = place.backdrive(&["run", &file("launch/contact.toml"), "--transport", "inproc", "--duration", "0.1", "--bag", "whole.mcap"]);
    assert!(place.path("whole.mcap").exists(), "{done:?}");
    let bag = place.path("whole.mcap");
    let reader = Reader::open(&bag).unwrap();
    let table = |name: &str, format: TableFormat| {
        let path = place.path(name);
        export_table(&reader, &path, format, None).unwrap();
        read(&path)
    };
    let csv = table("whole.csv", TableFormat::Csv);
    let parquet = table("whole.parquet", TableFormat::Parquet);
    let mat = table("whole.mat", TableFormat::Mat);
    let rows = "t [ms];q1 (deg);tau [N m]\n0;1.5;0.1\n1;1.6;0.1\n2;1.7;0.2\n3;1.8;0.1\n".as_bytes().to_vec();
    import_table(&place.path("whole.csv"), &place.path("arm.mcap"), &ImportOptions::default()).unwrap();
    let text = "t,a.position,a.command\n0,0.1,0.1\n0.02,0.1,0.1\n0.04,0.2,0.3\n";
    std::fs::write(place.path("episode.csv"), text).unwrap();
    import_table(&place.path("episode.csv"), &place.path("episode.mcap"), &ImportOptions::default()).unwrap();
    let dataset = place.path("dataset");
    export_lerobot(&[Reader::open(&place.path("episode.mcap")).unwrap()], &dataset, &Contract::default(), "task").unwrap();
    let lerobot = |at: &'static str| {
        let whole = dataset.clone();
        let parse = move |path: &Path| {
            // The rest of the dataset stands beside the damaged file.
            let folder = path.ancestors().nth(at.split('/').count()).unwrap();
            for other in ["meta/info.json", "data/chunk-000/file-000.parquet"].iter().filter(|other| **other != at) {
                let to = folder.join(other);
                std::fs::create_dir_all(to.parent().unwrap()).unwrap();
                std::fs::copy(whole.join(other), to).unwrap();
            }
            let options = LerobotOptions { overwrite: true, most_bytes: MOST_BYTES, ..LerobotOptions::default() };
            import_lerobot(folder, &folder.join("bags"), &options).is_ok()
        };
        target(
            if at.ends_with("json") { "lerobot info" } else { "lerobot data" },
            at,
            vec![read(&dataset.join(at))],
            at.ends_with("json"),
            parse,
        )
    };
    let urdf = |name: &str| read(Path::new(&file(&format!("plant/robots/{name}"))));
    let model = |name: &str| read(Path::new(&file(&format!("plant/{name}"))));
    let set = "model = \"m.toml\"\nfit = [\"a.csv\"]\nheld_out = [\"b.csv\"]\ninitial = \"free\"\n[columns]\nf = { column = \"x\", scale = 2.0, unit = \"mm\" }\n\
               [files.\"a.csv\"]\nrows = [1, 20]\n[joints.elbow]\nposition = \"q\"\ntorque = \"tau\"\n";
    let roles = "axes = [\"x\"]\n[signals]\nx_m = \"/m.position[0]\"\nF_f = { topic = \"/f\", field = \"effort[0]\", scale = 1.0, offset = 0.0 }\n\
                 x_c = \"/c.position[0]\"\nF_s = { topic = \"/s\", field = \"effort[0]\", hold = \"zero\" }\n[gains]\nmu = 1.0\nlambda = 0.3\n[resample]\nrate_hz = 1000\n";
    let protobuf = protobuf_types();
    let names: Vec<String> = protobuf.iter().map(|(name, ..)| name.clone()).collect();
    let schemas: Vec<Schema> = protobuf.iter().map(|(name, schema, _)| Schema::protobuf(name, schema).unwrap()).collect();
    vec![
        target("mcap", "bag.mcap", vec![read(&bag), read(&place.path("episode.mcap"))], false, read_bag),
        target("cdr definition", "own.msg", vec![DEFINITION.into()], true, |path| Schema::parse("pkg/msg/Mine", &text_of(path)).is_ok()),
        target("protobuf schema", "types.bin", protobuf.iter().map(|(_, schema, _)| schema.clone()).collect(), false, move |path| {
            names.iter().any(|name| Schema::protobuf(name, &read(path)).is_ok())
        }),
        target("protobuf message", "payload", protobuf.iter().map(|(.., payload)| payload.clone()).collect(), false, move |path| {
            let payload = read(path);
            let read = |schema: &Schema| {
                let numbers = schema.numbers(&payload)?;
                schema.joint_names(&payload)?;
                numbers.iter().try_for_each(|path| schema.read(&schema.find(path)?, &payload).map(|_| ()))
            };
            schemas.iter().map(read).filter(Result::is_ok).count() > 0
        }),
        target("cdr message", "payload", vec![cdr_message(), (0..255).cycle().take(400).collect()], false, |path| {
            let schema = Schema::parse("pkg/msg/Mine", DEFINITION).unwrap();
            let payload = read(path);
            schema.numbers(&payload).is_ok() & schema.joint_names(&payload).is_ok()
        }),
        target("csv import", "table.csv", vec![csv, rows.clone()], true, import),
        target("csv recording", "table.csv", vec![rows], true, |path| {
            let headings = read_headings(path).is_ok();
            headings & read_csv(path, None, &Columns::default(), &Piece::default()).is_ok()
        }),
        target("parquet", "table.parquet", vec![parquet], false, import),
        target("mat", "table.mat", vec![mat], false, import),
        target("npz", "table.npz", vec![read(Path::new(&file("tests/cases/npz/log.npz")))], false, import),
        target("mcap with json", "bag.mcap", vec![json_bag()], false, read_bag),
        lerobot("meta/info.json"),
        lerobot("data/chunk-000/file-000.parquet"),
        target("model", "model.toml", vec![model("models/impulse-engine.toml"), model("models/rigid-mass.toml")], true, |path| {
            Model::from_toml(&text_of(path), "model.toml").is_ok()
        }),
        target(
            "graph",
            "graph.toml",
            vec![graph_text("launch/contact.toml").into(), graph_text("launch/three-joint.toml").into()],
            true,
            |path| Graph::load(path, &Overrides::default()).is_ok(),
        ),
        target("set", "set.toml", vec![set.into()], true, |path| {
            // What it names stands beside it: else the first key ends the reading.
            for beside in ["m.toml", "a.csv", "b.csv"].map(|name| path.with_file_name(name)).iter().filter(|file| !file.exists()) {
                std::fs::write(beside, "").unwrap();
            }
            RecordingSet::open(path).is_ok()
        }),
        target("roles", "roles.toml", vec![roles.into()], true, |path| Roles::from_toml(&text_of(path), "roles.toml").is_ok()),
        target(
            "contract",
            "contract.toml",
            vec!["measured = \"observation.state\"\nangle = \"deg\"\n[joints]\na = \"b\"\n".into()],
            true,
            |path| Contract::read(path).is_ok(),
        ),
        target("urdf", "arm.urdf", vec![urdf("two-joint-arm.urdf"), urdf("seven-joint-arm.urdf")], true, robot),
        target("mjcf", "arm.xml", vec![MJCF.into()], true, robot),
    ]
}

fn seconds() -> f64 {
    let asked = std::env::var("BACKDRIVE_FUZZ_SECONDS").ok().and_then(|text| text.parse().ok());
    let long = std::env::var("BACKDRIVE_LONG").as_deref() == Ok("1");
    asked.unwrap_or(if long { 4.0 } else { 1.0 })
}

/// What is parsed now, and since when.
static AT_WORK: Mutex<Option<(String, Instant)>> = Mutex::new(None);

#[test]
fn no_parser_panics_stands_still_or_takes_more_memory_than_allowed() {
    let place = Place::new();
    let mut targets = targets(&place);
    if let Ok(only) = std::env::var("BACKDRIVE_FUZZ_ONLY") {
        targets.retain(|target| target.name == only);
    }
    let seed: u64 = std::env::var("BACKDRIVE_FUZZ_SEED").ok().and_then(|text| text.parse().ok()).unwrap_or(1);
    std::thread::spawn(|| {
        loop {
            std::thread::sleep(Duration::from_millis(500));
            let at_work = AT_WORK.lock().unwrap().clone();
            if let Some((case, since)) = at_work.filter(|(_, since)| since.elapsed() > PATIENCE) {
                eprintln!("{case}: stands still for {:?}", since.elapsed());
                std::process::abort();
            }
        }
    });
    let mut failures = Vec::new();
    for target in &targets {
        let folder = place.path(&format!("fuzz-{}", target.name.replace(' ', "-")));
        let path = folder.join(target.at);
        std::fs::create_dir_all(path.parent().unwrap()).unwrap();
        // Of a message there may be bytes that are none beside one that is.
        let take = |whole: &Vec<u8>| {
            std::fs::write(&path, whole).unwrap();
            (target.parse)(&path)
        };
        let took: Vec<bool> = target.corpus.iter().map(take).collect();
        let enough = if target.name == "cdr message" { took[0] } else { took.iter().all(|took| *took) };
        assert!(enough, "{}: a whole file is refused", target.name);
        let (until, mut cases, mut taken, mut highest) = (Instant::now() + Duration::from_secs_f64(seconds()), 0_u64, 0_u64, 0_usize);
        while Instant::now() < until || cases < 20 {
            let mut random = ChaCha8Rng::seed_from_u64(seed.wrapping_mul(1_000_003).wrapping_add(cases));
            let whole = &target.corpus[cases as usize % target.corpus.len()];
            let damaged = mutate(whole, target.is_text, &mut random);
            std::fs::write(&path, &damaged).unwrap();
            *AT_WORK.lock().unwrap() = Some((format!("{} case {cases} of seed {seed}", target.name), Instant::now()));
            let before = NOW.load(Ordering::Relaxed);
            HIGHEST.store(before, Ordering::Relaxed);
            let result = catch_unwind(AssertUnwindSafe(|| (target.parse)(&path)));
            let peak = HIGHEST.load(Ordering::Relaxed).saturating_sub(before);
            *AT_WORK.lock().unwrap() = None;
            highest = highest.max(peak);
            match result {
                Ok(took) => taken += u64::from(took),
                Err(_) => failures.push(format!("{} case {cases} of seed {seed}: panicked", target.name)),
            }
            if peak > PEAK {
                failures.push(format!("{} case {cases} of seed {seed}: took {} MiB", target.name, peak >> 20));
            }
            cases += 1;
        }
        println!("{}: {cases} files, {taken} taken, at most {:.1} MiB", target.name, highest as f64 / f64::from(1 << 20));
    }
    assert!(failures.is_empty(), "{}", failures.join("\n"));
}
