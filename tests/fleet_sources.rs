//! `backdrive fleet` over every kind of recording: CSV, bag, parquet, MAT, a LeRobot dataset, servo tables; fits of arms and servos; job files of a cluster.

mod system;

use backdrive_fleet::simulated::{Arm, JOINTS, RATE, Truth, random, unit};
use backdrive_fleet::table::{Table, read};
use backdrive_plant::servo::{Number, Numbers};
use backdrive_servo::record::Record;
use backdrive_servo::simulate::simulate;
use std::fmt::Write;
use std::path::Path;
use std::process::Stdio;
use std::time::Duration;
use system::{Ended, Place, file};

const MODEL: &str = "plant/robots/seven-joint-leader.toml";

/// The table of a run of `fleet` with these words.
fn fleet(place: &Place, words: &[&str], what: &str) -> (Ended, Table) {
    let out = format!("out-{what}-{}", words[0].replace(['/', '.'], "-"));
    let done = place.run_for(&[&["fleet"], words, &["--what", what, "--out", &out]].concat(), Duration::from_secs(300));
    let table = read(&place.path(&out).join(format!("{what}.parquet"))).unwrap_or_else(|e| panic!("{e}: {done:?}"));
    (done, table)
}

/// The log of an arm as CSV.
fn log(truth: &[Truth; JOINTS], recording: usize) -> String {
    Arm::open(Path::new(&file(MODEL))).unwrap().log(truth, RATE, &mut random(11, 0, recording))
}

#[test]
fn every_format_gives_the_same_numbers() {
    let place = Place::new();
    let model = file(MODEL);
    std::fs::create_dir_all(place.path("logs/a")).unwrap();
    place.write("logs/a/one.csv", &log(&unit(&mut random(11, 0, 0)), 1));
    let backdrive = |words: &[&str]| {
        let done = place.backdrive(words);
        assert_eq!(done.code, Some(0), "{done:?}");
    };
    backdrive(&["bag", "import", "logs/a/one.csv", "--bag", "logs/a/two.mcap"]);
    backdrive(&["bag", "export", "logs/a/two.mcap", "--to", "parquet", "--out", "logs/a/three.parquet"]);
    std::fs::rename(place.path("logs/a/two.mcap"), place.path("two.mcap")).unwrap();
    let (done, table) = fleet(&place, &["logs", "--model", &model], "triage");
    assert!(done.stdout.contains("2 of 2 recordings done, 0 of them before"), "{done:?}");
    assert!(done.stdout.contains("nothing changed on 1 units in 2 recordings that count"), "{done:?}");
    let of = |table: &Table, joint: &str, name: &str| {
        let row = table.rows.iter().find(|row| row.joint == joint).unwrap();
        row.numbers[name]
    };
    let only = |name: &str| Table { rows: table.rows.iter().filter(|row| row.recording == name).cloned().collect(), ..table.clone() };
    let (csv, parquet) = (only("a/one.csv"), only("a/three.parquet"));
    let same = |other: &Table| {
        assert_eq!(other.rows.len(), JOINTS, "{:?}", other.rows);
        for joint in csv.joints() {
            for name in ["dry", "viscous", "residual"] {
                let (a, b) = (of(&csv, joint, name), of(other, joint, name));
                assert!((b / a - 1.0).abs() < 1e-6, "{joint} {name}: {a} {b}");
            }
        }
    };
    same(&parquet);
    // A manifest names the topics of a bag, and columns; a file of MATLAB keeps the names that it was made from.
    let listed = |file: &str, signal: &dyn Fn(usize, &str) -> String| {
        let mut manifest = format!("[[recordings]]\nfile = {file:?}\nunit = \"a\"\n");
        for joint in 1..=JOINTS {
            let _ =
                write!(manifest, "[joints.joint{joint}]\nposition = {}\ntorque = {}\n", signal(joint, "position"), signal(joint, "torque"));
        }
        manifest
    };
    let topic = |joint, what: &str| format!("{{ topic = \"/recording/joint{joint}_{what}\", field = \"position[0]\" }}");
    place.write("bag.toml", &listed("two.mcap", &topic));
    same(&fleet(&place, &["bag.toml", "--model", &model], "triage").1);
    backdrive(&["bag", "export", "two.mcap", "--to", "mat", "--out", "one.mat"]);
    place.write("mat.toml", &listed("one.mat", &|joint, what| format!("\"joint{joint}.{what}\"")));
    same(&fleet(&place, &["mat.toml", "--model", &model], "triage").1);
}

/// Numbers of a servo.
fn servo(delay: f64, friction: f64) -> Numbers {
    let mut numbers = Numbers::default();
    numbers[Number::Delay] = delay;
    numbers[Number::Damping] = 0.05;
    numbers[Number::Inertia] = 6e-4;
    numbers[Number::Friction] = friction;
    numbers
}

/// Half a minute of two servo joints at 50 samples per second.
fn commands(numbers: &Numbers, seed: usize) -> String {
    let mut random = random(13, seed, 0);
    let t: Vec<f64> = (0..1500).map(|i| 0.02 * f64::from(i)).collect();
    let joint = |phase: f64| {
        let waves = [(0.5, 1.1), (0.2, 3.7), (0.05, 9.3), (0.02, 17.0)];
        let command: Vec<f64> = t.iter().map(|t| waves.iter().map(|(size, w)| size * (w * (t + phase)).sin()).sum()).collect();
        Record { name: "r".to_string(), t: t.clone(), position: command.clone(), command, gravity: Vec::new() }
    };
    let joints = [joint(seed as f64), joint(2.0 * seed as f64 + 1.0)];
    let moved: Vec<Vec<f64>> = joints.iter().map(|record| simulate(numbers, record, 5)).collect();
    let mut out = String::from("t,elbow.command,elbow.position,wrist.command,wrist.position\n");
    for i in 0..t.len() {
        let _ = write!(out, "{:.3}", t[i]);
        for (record, moved) in joints.iter().zip(&moved) {
            let _ = write!(out, ",{:.6},{:.6}", record.command[i], moved[i] + 2e-4 * backdrive_fleet::simulated::normal(&mut random));
        }
        out.push('\n');
    }
    out
}

#[test]
fn servo_tables_and_a_lerobot_dataset_have_delay_and_lost_motion() {
    let place = Place::new();
    std::fs::create_dir_all(place.path("logs/a")).unwrap();
    for (day, delay) in [(1, 0.03), (2, 0.06)] {
        place.write(&format!("logs/a/2026-11-0{day}.csv"), &commands(&servo(delay, 0.004), day));
    }
    let (done, table) = fleet(&place, &["logs"], "triage");
    assert_eq!(done.code, Some(0), "{done:?}");
    assert_eq!(table.rows.len(), 4);
    for row in &table.rows {
        let expected = if row.recording.contains("11-01") { 0.03 } else { 0.06 };
        let (delay, sd) = row.estimate("delay").unwrap();
        assert!((delay - expected).abs() < 0.002 + 3.0 * sd && sd < 0.005, "{row:?}");
        let (lost, sd) = row.estimate("lost_motion").unwrap();
        assert!((lost - 0.008).abs() < 4e-4 + 3.0 * sd && sd < 0.002, "{row:?}");
    }
    for day in [1, 2] {
        let (from, to) = (format!("logs/a/2026-11-0{day}.csv"), format!("{day}.mcap"));
        assert_eq!(place.backdrive(&["bag", "import", &from, "--bag", &to]).code, Some(0));
    }
    let done = place.backdrive(&["bag", "export", "1.mcap", "2.mcap", "--to", "lerobot", "--out", "set", "--task", "wave"]);
    assert_eq!(done.code, Some(0), "{done:?}");
    let (done, set) = fleet(&place, &["set"], "triage");
    assert!(done.stdout.contains("2 of 2 recordings done"), "{done:?}");
    let delays: Vec<f64> = set.rows.iter().filter(|row| row.joint == "elbow").map(|row| row.numbers["delay"]).collect();
    assert!((delays[0] - 0.03).abs() < 0.003 && (delays[1] - 0.06).abs() < 0.003, "{delays:?}");
    // The same dataset listed in a manifest beside other recordings.
    place.write("fleet.toml", "[[folders]]\npath = \"set\"\nunit = \"so101\"\n[[folders]]\npath = \"logs\"\n");
    let (_, both) = fleet(&place, &["fleet.toml"], "triage");
    assert_eq!(both.units(), ["a", "so101"]);
    // The gate names the delay.
    std::fs::create_dir_all(place.path("new")).unwrap();
    std::fs::create_dir_all(place.path("old")).unwrap();
    place.write("new/one.csv", &commands(&servo(0.06, 0.004), 3));
    place.write("old/one.csv", &commands(&servo(0.03, 0.004), 4));
    let done = place.run_for(&["gate", "old", "new"], Duration::from_secs(100));
    assert!(done.code == Some(1) && done.stdout.contains("elbow: delay 0.03"), "{done:?}");
}

#[test]
fn fits_of_arms_and_servos_find_what_their_models_state() {
    let place = Place::new();
    let own = unit(&mut random(11, 0, 0));
    std::fs::create_dir_all(place.path("logs/a")).unwrap();
    place.write("logs/a/one.csv", &log(&own, 1));
    let (done, table) = fleet(&place, &["logs", "--model", &file(MODEL)], "fit");
    assert_eq!((done.code, table.rows.len()), (Some(0), JOINTS), "{done:?}");
    assert!(table.rows.iter().all(|row| row.numbers["nrmse"] < 1.0), "{:?}", table.rows);
    for (row, truth) in table.rows.iter().zip(&own) {
        if let Some((damping, sd)) = row.estimate("damper") {
            assert!((damping - truth.viscous).abs() < 0.5 * truth.viscous + 4.0 * sd, "{row:?} {truth:?}");
        }
    }
    place.write("servo.toml", "[servo.elbow]\ndelay = 0.01\ninertia = 1e-3\ndamping = 0.03\nfriction = 0.001\n");
    std::fs::create_dir_all(place.path("servos/a")).unwrap();
    place.write("servos/a/one.csv", &commands(&servo(0.03, 0.004), 1));
    let (done, table) = fleet(&place, &["servos", "--model", "servo.toml"], "fit");
    assert_eq!(done.code, Some(0), "{done:?}");
    let elbow = table.rows.iter().find(|row| row.joint == "elbow").unwrap();
    let (delay, _) = elbow.estimate("delay").unwrap();
    let (friction, _) = elbow.estimate("friction").unwrap();
    assert!((delay - 0.03).abs() < 0.002 && (friction - 0.004).abs() < 4e-4, "{elbow:?}");
}

#[test]
fn recordings_without_an_answer_are_counted_as_such() {
    let place = Place::new();
    std::fs::create_dir_all(place.path("logs/a")).unwrap();
    place.write("logs/a/one.csv", "t,x\n0,1\n1,2\n");
    place.write("logs/a/two.csv", "t,x\n0,1\n1,3\n");
    let done = place.run_for(&["fleet", "logs", "--model", &file(MODEL), "--out", "out"], Duration::from_secs(100));
    assert_eq!(done.code, Some(3), "{done:?}");
    assert!(done.stdout.contains("2 of 2 recordings done, none of them with an answer"), "{done:?}");
    assert!(!done.stdout.contains("answered") && !done.stdout.contains("nothing changed"), "{done:?}");
}

/// Runs a program of the examples with `backdrive` in its path.
fn with_program(place: &Place, program: &str, words: &[&str], variables: &[(&str, &str)]) -> String {
    let mut command = place.command(program);
    let folder = Path::new(env!("CARGO_BIN_EXE_backdrive")).parent().unwrap();
    let path = format!("{}:{}", folder.display(), std::env::var("PATH").unwrap_or_default());
    command.args(words).env("PATH", path).envs(variables.iter().copied()).stdout(Stdio::piped()).stderr(Stdio::piped());
    let done = command.output().unwrap();
    assert!([Some(0), Some(1)].contains(&done.status.code()), "{done:?}");
    String::from_utf8_lossy(&done.stdout).into_owned()
}

#[test]
fn job_files_of_clusters_run_every_shard() {
    let place = Place::new();
    let model = file(MODEL);
    let arm = Arm::open(Path::new(&model)).unwrap();
    std::fs::create_dir_all(place.path("logs/a")).unwrap();
    for recording in 0..3 {
        let text = arm.log(&unit(&mut random(11, 0, 0)), RATE, &mut random(11, 0, recording + 1));
        place.write(&format!("logs/a/2026-11-0{}.csv", recording + 1), &text);
    }
    let whole = |out: &str| std::fs::read(place.path(out).join("triage.parquet")).ok();
    // Slurm: each index of the array by itself, as `sbatch` would start it.
    let slurm = file("examples/fleet/slurm.sh");
    assert!(std::fs::read_to_string(&slurm).unwrap().contains("#SBATCH --array="));
    for task in ["1", "2", "3"] {
        assert_eq!(whole("slurm"), None);
        let variables = [("SLURM_ARRAY_TASK_ID", task), ("SLURM_ARRAY_TASK_COUNT", "3"), ("SLURM_CPUS_PER_TASK", "1")];
        with_program(&place, &slurm, &["logs", "slurm", "--model", &model], &variables);
    }
    // Kubernetes: the command line of the container for each index.
    let text = std::fs::read_to_string(file("examples/fleet/kubernetes.yaml")).unwrap();
    let folded: Vec<&str> =
        text.lines().skip_while(|line| line.trim() != "- >-").skip(1).take_while(|line| line.starts_with("              ")).collect();
    let line = folded.iter().map(|line| line.trim()).collect::<Vec<_>>().join(" ");
    let count: usize = text.lines().find_map(|line| line.trim().strip_prefix("completions: ")).unwrap().parse().unwrap();
    assert!(line.contains(&format!("/{count}\"")), "the line has the number of completions: {line}");
    let line = line.replace(&format!("/{count}\""), "/3\"").replace("/data/fleet.toml", "logs").replace("/data/out", "kubernetes");
    let line = line.replace("--jobs 1", &format!("--jobs 1 --model {model}"));
    for index in ["0", "1", "2"] {
        assert_eq!(whole("kubernetes"), None);
        with_program(&place, "/bin/sh", &["-c", &line], &[("JOB_COMPLETION_INDEX", index)]);
    }
    assert!(whole("slurm").is_some() && whole("slurm") == whole("kubernetes"));
}
