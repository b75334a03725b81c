//! Bags and tables through the command line.

mod system;

use nix::sys::signal::Signal;
use system::assert_names;
use system::{PATIENCE, Place, file, kill, samples, until};

#[test]
fn what_is_in_a_bag() {
    let place = Place::new();
    let graph = file("launch/contact.toml");
    assert_eq!(place.backdrive(&["run", &graph, "--transport", "inproc", "--duration", "0.5", "--bag", "run.mcap"]).code, Some(7));
    let found = place.backdrive(&["bag", "info", "run.mcap", "--json"]).json();
    assert_eq!(
        (&found["clock"], &found["rate_hz"], &found["complete"], &found["lost"]),
        (&"lockstep".into(), &5000.0.into(), &true.into(), &0.into())
    );
    assert_eq!((&found["profile"], &found["ended_cleanly"]), (&"ros2".into(), &true.into()));
    let files = found["files"].as_array().unwrap();
    assert!(files.iter().any(|f| f.as_str().unwrap().ends_with("impulse-engine.toml")), "{files:?}");
    let measured = found["topics"].as_array().unwrap().iter().find(|t| t["name"] == "/master/measured_js").unwrap();
    assert_eq!((&measured["type_name"], &measured["messages"]), (&"sensor_msgs/msg/JointState".into(), &2500.into()));
    let told = place.backdrive(&["bag", "info", "run.mcap"]);
    told.answers(0, &["/slave/measured_js"]);
}

#[test]
fn to_a_table_and_back() {
    let place = Place::new();
    let graph = file("launch/contact.toml");
    assert_eq!(place.backdrive(&["run", &graph, "--transport", "inproc", "--duration", "1.2", "--bag", "run.mcap"]).code, Some(7));
    let topics = ["--topic", "/master/measured_js", "--topic", "/slave/measured_js"];
    let done = place.backdrive(&[&["bag", "export", "run.mcap", "--csv", "run.csv"], &topics[..]].concat());
    assert_eq!(done.code, Some(0), "{done:?}");
    let table = std::fs::read_to_string(place.path("run.csv")).unwrap();
    let heading = table.lines().next().unwrap();
    let column =
        |part: &str| heading.split(',').find(|c| c.contains("/slave") && c.contains(part)).unwrap_or_else(|| panic!("{part}: {heading}"));
    let map = format!("{}=/slave/measured_js.effort[0]", column("effort"));
    let done = place.backdrive(&["bag", "import", "run.csv", "--bag", "back.mcap", "--map", &map]);
    assert_eq!(done.code, Some(0), "{done:?}");
    let (was, is) = (samples(&place.path("run.mcap"), "/slave/measured_js"), samples(&place.path("back.mcap"), "/slave/measured_js"));
    assert_eq!(was.len(), is.len());
    assert!(was.iter().any(|s| s.effort[0] < -1.0));
    for (a, b) in was.iter().zip(&is) {
        assert_eq!(a.effort[0].to_bits(), b.effort[0].to_bits(), "step {}", a.step);
    }
}

#[test]
fn several_tables_become_a_folder_of_bags() {
    let place = Place::new();
    for name in ["one.csv", "two.csv"] {
        place.write(name, "t,x\n0,1\n0.001,2\n0.002,3\n");
    }
    let done = place.backdrive(&["bag", "import", "one.csv", "two.csv", "--bag", "folder"]);
    assert_eq!(done.code, Some(0), "{done:?}");
    for name in ["folder/one.mcap", "folder/two.mcap"] {
        assert_eq!(samples(&place.path(name), "/recording/x").iter().map(|s| s.position[0]).collect::<Vec<_>>(), [1.0, 2.0, 3.0]);
    }
}

#[test]
fn a_table_comes_through_a_pipe() {
    let place = Place::new();
    let program = env!("CARGO_BIN_EXE_backdrive");
    let line = format!("printf 't,x\\n0,1\\n0.001,2\\n' | {program} bag import /dev/stdin --bag piped.mcap");
    let done = place.command("sh").args(["-c", &line]).output().unwrap();
    assert!(done.status.success(), "{done:?}");
    assert_eq!(samples(&place.path("piped.mcap"), "/recording/x").iter().map(|s| s.position[0]).collect::<Vec<_>>(), [1.0, 2.0]);
}

#[test]
fn an_import_tells_what_is_wrong_with_the_clock() {
    let place = Place::new();
    let table = |times: &[f64]| times.iter().fold("t,x\n".to_owned(), |text, t| format!("{text}{t:?},1\n"));
    place.write("gap.csv", &table(&[0.0, 0.001, 0.002, 0.003, 0.008, 0.009]));
    let done = place.backdrive(&["bag", "import", "gap.csv", "--bag", "gap.mcap"]);
    assert_eq!(done.code, Some(0), "{done:?}");
    assert_names(&done.stderr, &["gap.csv", "rows 4 and 5"]);
    place.write("twice.csv", &table(&[0.0, 0.001, 0.001]));
    let done = place.backdrive(&["bag", "import", "twice.csv", "--bag", "twice.mcap"]);
    assert!(done.code == Some(3) && done.stderr.contains("is in two rows") && !place.path("twice.mcap").exists(), "{done:?}");
    place.write("back.csv", &table(&[0.0, 0.002, 0.001]));
    let done = place.backdrive(&["bag", "import", "back.csv", "--bag", "back.mcap"]);
    done.ends(3, &["0.002", "0.001"]);
}

#[test]
fn a_table_goes_through_every_format_and_comes_back() {
    let place = Place::new();
    let rows: String = (0..500).map(|k| format!("{:?},{:?},{:?}\n", k as f64 * 0.01, (k as f64 * 0.1).sin(), -0.5 * k as f64)).collect();
    place.write("arm.csv", &format!("t,elbow.position,elbow.effort\n{rows}"));
    assert_eq!(place.backdrive(&["bag", "import", "arm.csv", "--bag", "arm.mcap"]).code, Some(0));
    for (format, out) in [("parquet", "arm.parquet"), ("mat", "arm.mat"), ("csv", "back.csv")] {
        let done = place.backdrive(&["bag", "export", "arm.mcap", "--to", format, "--out", out]);
        assert_eq!((done.code, done.stdout.as_str()), (Some(0), format!("{out}: 500 rows\n").as_str()), "{done:?}");
        assert_eq!(done.stderr.contains("\"elbow.position\" is now elbow_position"), format == "mat", "{done:?}");
        assert_eq!(place.backdrive(&["bag", "import", out, "--bag", "again.mcap", "--overwrite"]).code, Some(0));
        let same = place.backdrive(&["bag", "diff", "arm.mcap", "again.mcap"]);
        assert_eq!(same.code, Some(0), "{format}: {same:?}");
        let refused = place.backdrive(&["bag", "export", "arm.mcap", "--to", format, "--out", out]);
        refused.ends(3, &["--overwrite"]);
    }
    let done = place.backdrive(&["bag", "export", "arm.mcap", "again.mcap", "--to", "lerobot", "--out", "set", "--task", "wave"]);
    assert_eq!((done.code, done.stdout.as_str()), (Some(0), "set: 2 episodes, 1000 rows at 100 Hz, joints elbow\n"), "{done:?}");
    let done = place.backdrive(&["bag", "import", "set", "--episode", "1", "--bag", "episodes"]);
    done.answers(0, &["set/episode_000001: 500 rows, 2 topics"]);
    let values = |bag: &str, topic: &str| samples(&place.path(bag), topic).iter().map(|s| s.position[0]).collect::<Vec<_>>();
    assert_eq!(values("episodes/episode_000001.mcap", "/recording/elbow_effort"), values("arm.mcap", "/recording/elbow_effort"));
    for (was, is) in
        values("arm.mcap", "/recording/elbow_position").iter().zip(values("episodes/episode_000001.mcap", "/recording/elbow_position"))
    {
        assert!((was - is).abs() <= 4e-16 * was.abs(), "{was} became {is}: degrees and back");
    }
    // For a file that is no recording, the error names the command that makes it one.
    place.write("m.toml", "name = \"arm\"\n[bodies]\nlink = 1.0\n");
    for (paths, command) in [
        (&["arm.parquet"][..], "`backdrive bag import arm.parquet --bag arm-2.mcap` makes it one"),
        (&["back.csv", "arm.mat"], "`backdrive bag import arm.mat --bag arm-2.mcap` makes it one"),
        (&["set"], "`backdrive bag import set --bag set-bags` makes it one"),
    ] {
        let told = place.backdrive(&[&["fit", "m.toml"], paths].concat());
        assert!(told.code == Some(3) && told.stderr.contains(command), "{told:?}");
    }
    // A dataset is replaced only where that was asked for, and nothing else ever.
    let refused = place.backdrive(&["bag", "export", "arm.mcap", "--to", "lerobot", "--out", "set"]);
    refused.ends(3, &["--overwrite"]);
    assert_eq!(place.backdrive(&["bag", "export", "arm.mcap", "--to", "lerobot", "--out", "set", "--overwrite"]).code, Some(0));
    place.write("gap.csv", "t,j.position\n0,1\n0.01,2\n0.02,3\n0.06,4\n");
    assert_eq!(place.backdrive(&["bag", "import", "gap.csv", "--bag", "gap.mcap"]).code, Some(0));
    let refused = place.backdrive(&["bag", "export", "gap.mcap", "--to", "lerobot", "--out", "gap"]);
    refused.ends(3, &["gap.mcap", "row 4"]);
    let refused = place.backdrive(&["bag", "export", "arm.mcap", "--to", "lerobot", "--out", "episodes", "--overwrite"]);
    assert!(
        refused.code == Some(3)
            && refused.stderr.contains("is not a LeRobot dataset")
            && place.path("episodes/episode_000001.mcap").exists(),
        "{refused:?}"
    );
}

#[test]
fn played_to_its_end_or_until_it_is_stopped() {
    let place = Place::new();
    let graph = file("launch/contact.toml");
    assert_eq!(place.backdrive(&["run", &graph, "--transport", "inproc", "--duration", "0.5", "--bag", "run.mcap"]).code, Some(7));
    let done = place.backdrive(&["bag", "play", "run.mcap", "--speed", "5"]);
    assert_eq!(done.code, Some(0), "{done:?}");
    let sent = place.backdrive(&["bag", "info", "run.mcap", "--json"]).json()["messages"].as_u64().unwrap();
    assert!(done.stdout.contains(&format!("{sent} messages sent")), "{done:?}");
    place.assert_clean(&[]);

    let play = place.start(&["bag", "play", "run.mcap", "--speed", "0.01"]);
    until("the run of the player", || place.runs().len() == 1 && system::shared_memory_of(&place.runs()[0]).len() > 20);
    let runs = place.runs();
    kill(play.pid(), Signal::SIGINT);
    let done = play.end();
    assert_eq!(done.code, Some(130), "{done:?}");
    place.assert_clean(&runs);
}

#[test]
fn clean_removes_what_dead_runs_left_and_no_more() {
    let place = Place::new();
    let graph = file("launch/contact.toml");
    assert_eq!(place.backdrive(&["clean"]).stdout, "nothing to remove\n");
    let options = ["--clock", "realtime", "--rate", "200", "--duration", "60"];
    let start = |bag: &str| place.start(&[&["run", graph.as_str(), "--bag", bag], &options[..]].concat());
    let alive = start("alive.mcap");
    system::until_recorded(&place.path("alive.mcap"), "/master/measured_js", 1);
    let (living, nodes) = (place.runs(), place.processes());
    let mut dead = start("dead.mcap");
    system::until_recorded(&place.path("dead.mcap"), "/master/measured_js", 1);
    let died: Vec<String> = place.runs().into_iter().filter(|r| !living.contains(r)).collect();
    assert_eq!((living.len(), died.len()), (1, 1));
    // All of it is killed at once: a node that lives on removes the run itself.
    kill(dead.pid(), Signal::SIGSTOP);
    place.processes().iter().filter(|p| !nodes.contains(p)).for_each(|p| kill(p.pid, Signal::SIGKILL));
    dead.child.kill().unwrap();
    dead.child.wait().unwrap();
    until("its nodes to be gone", || place.processes().len() == 6);
    let done = place.backdrive(&["clean"]);
    assert_eq!(done.code, Some(0), "{done:?}");
    assert!(done.stdout.contains(&format!("{} is running and was not touched", living[0])), "{done:?}");
    assert_names(&done.stdout, &["removed ", &died[0]]);
    assert_eq!(place.runs(), living);
    assert!(system::shared_memory_of(&died[0]).is_empty() && !system::shared_memory_of(&living[0]).is_empty());
    kill(alive.pid(), Signal::SIGINT);
    assert_eq!(alive.end().code, Some(130));
    place.assert_clean(&living);
}

#[test]
fn what_simulate_writes_goes_through_a_bag_and_back_exactly() {
    let place = Place::new();
    let (model, grip) = (file("plant/models/impulse-engine-linear.toml"), file("plant/grips/normal.toml"));
    for (name, drive) in [("one", "sweep:amplitude=1,from=1,to=60,duration=0.4"), ("two", "multisine:rms=1,from=2,to=80,period=0.4,seed=3")]
    {
        let (csv, bag, back) = (format!("{name}.csv"), format!("{name}.mcap"), format!("{name}-back.csv"));
        let made = place.backdrive(&["simulate", &model, drive, "--grip", &grip, "--rate", "2000", "--noise", "1", "--out", &csv]);
        assert_eq!(made.code, Some(0), "{made:?}");
        assert_eq!(place.backdrive(&["bag", "import", &csv, "--bag", &bag]).code, Some(0));
        assert_eq!(place.backdrive(&["bag", "export", &bag, "--csv", &back]).code, Some(0));
        let text = |name: &str| std::fs::read_to_string(place.path(name)).unwrap();
        assert_eq!(text(&csv), text(&back));
        assert!(text(&csv).starts_with("t,") && text(&csv).lines().next().unwrap().contains("normal.hand"));
    }
    // The model takes the same signals from the bag as from the table, those with a dot in their names too.
    let of = |recording: &str, out: &str| {
        let done = place.backdrive(&["simulate", &model, recording, "--grip", &grip, "--out", out]);
        assert_eq!(done.code, Some(0), "{done:?}");
        std::fs::read(place.path(out)).unwrap()
    };
    assert_eq!(of("one.csv", "p.csv"), of("one.mcap", "q.csv"));
    let fitted = |set: [&str; 2]| {
        let done = place.run_for(&["fit", &model, set[0], set[1], "--grip", &grip, "--effort", "0.5", "--json"], PATIENCE);
        assert!([Some(0), Some(1)].contains(&done.code), "{done:?}");
        done.json()["numbers"].clone()
    };
    assert_eq!(fitted(["one.csv", "two.csv"]), fitted(["one.mcap", "two.mcap"]));
}

#[test]
fn what_is_no_number_is_refused_at_import() {
    let place = Place::new();
    for (text, says) in [
        ("t,x\n0,1\n1,nan\n2,3\n", "a.csv, line 3: column \"x\": expected a number, found \"nan\""),
        ("t,x\n0,1\n1,\n2,3\n", "a.csv, line 3: column \"x\": expected a number, found an empty cell"),
        ("t,x\n0,1\n1,inf\n2,3\n", "a.csv, line 3: column \"x\": expected a number, found \"inf\""),
    ] {
        place.write("a.csv", text);
        let done = place.backdrive(&["bag", "import", "a.csv", "--bag", "a.mcap"]);
        assert_eq!(done.code, Some(3), "{done:?}");
        assert!(done.stderr.contains(says), "{done:?}");
        assert!(!place.path("a.mcap").exists());
    }
}
