//! Arms as masters and slaves of whole runs: the two examples, over both transports and again from their bags, and what is refused.

mod system;

use backdrive_bags::Reader;
use backdrive_nodes::graph::{Graph, Overrides};
use backdrive_plant::model::Model;
use std::path::Path;
use system::assert_names;
use system::{Place, file, graph_text, samples};

/// A run over both transports and from its bag again, bit for bit; its messages on the master's and the slave's topics.
fn one_answer(place: &Place, graph: &str) {
    for (transport, bag) in [("inproc", "here.mcap"), ("iceoryx2", "apart.mcap")] {
        let done = place.backdrive(&["run", graph, "--transport", transport, "--bag", bag, "--duration", "2.1", "--json"]);
        assert_eq!(done.code, Some(0), "{done:?}");
        assert_eq!(done.json()["lost"], 0, "{done:?}");
    }
    let again = place.backdrive(&["replay", "apart.mcap", "--bag", "again.mcap"]);
    assert_eq!(again.code, Some(0), "{again:?}");
    for (a, b) in [("here.mcap", "apart.mcap"), ("apart.mcap", "again.mcap")] {
        let same = place.backdrive(&["bag", "diff", a, b]);
        assert_eq!(same.code, Some(0), "{a} {b}: {same:?}");
    }
}

#[test]
fn the_three_joint_arms_are_one_answer_and_judged_stable() {
    let place = Place::new();
    one_answer(&place, &file("launch/three-joint.toml"));
    let [master, slave] = ["/master/measured_js", "/slave/measured_js"].map(|topic| samples(&place.path("here.mcap"), topic));
    assert!(master.iter().chain(&slave).all(|s| s.axes == 3));
    let last = &slave[4000];
    // It pushes the wall ahead, and slides along it: nothing stands in its way there.
    assert!(last.effort[0] < -2.0 && last.effort[1] == 0.0 && last.effort[2] == 0.0, "{:?}", last.effort);
    assert!(last.position[1] > 0.02 && last.position[2] > 0.01, "{:?}", last.position);
    // What comes back is lambda times that.
    let force = master[4000].effort[0];
    assert!((force / (0.15 * last.effort[0]) - 1.0).abs() < 0.05, "{force} {}", last.effort[0]);

    let asked = place.backdrive(&["stability", "here.mcap", "--grips", "1", "--json"]);
    let json = asked.json();
    assert_eq!((asked.code, &json["verdict"]), (Some(0), &"stable".into()), "{asked:?}");
    let together = &json["axes_together"];
    assert_eq!((&together["encirclements"], &together["touched"][0]), (&0.into(), &"x".into()), "{together}");
    assert_eq!(together["alone"].as_array().map(Vec::len), Some(3), "{together}");
}

#[test]
fn leader_and_follower_are_one_answer_and_torque_comes_back_to_every_joint() {
    let place = Place::new();
    one_answer(&place, &file("launch/leader-follower.toml"));
    let [master, slave] = ["/master/measured_js", "/slave/measured_js"].map(|topic| samples(&place.path("here.mcap"), topic));
    assert!(master.iter().chain(&slave).all(|s| s.axes == 7));
    // In the hold.
    let touching = &slave[2000];
    // A wall ahead of the tip turns the joints whose axes lie across, and no joint whose axis points at it.
    let torque: Vec<f64> = touching.effort[..7].to_vec();
    assert!(torque[1].abs() > 0.5 && torque[3].abs() > 0.1, "{torque:?}");
    let largest = torque.iter().fold(0.0_f64, |most, t| most.max(t.abs()));
    assert!(torque[6].abs() < 0.1 * largest, "{torque:?}");
    let reflected = master.iter().map(|s| s.effort[1].abs()).fold(0.0, f64::max);
    assert!(reflected > 0.1, "{reflected}");
    let shown = place.backdrive(&["bag", "info", "here.mcap"]);
    assert_eq!(shown.code, Some(0), "{shown:?}");
}

/// The force of the wall on the joints is J^T F: the power that the joints give is that of the tip on the wall.
#[test]
fn what_the_wall_takes_is_what_the_joints_give() {
    let place = Place::new();
    let short = ["--transport", "inproc", "--bag", "arm.mcap", "--duration", "0.9"];
    let done = place.backdrive(&[&["run", &file("launch/leader-follower.toml")], &short[..]].concat());
    // So short a hold is not judged.
    assert_eq!(done.code, Some(7), "{done:?}");
    let slave = samples(&place.path("arm.mcap"), "/slave/measured_js");
    let (mut given, mut pushed) = (0.0, 0.0_f64);
    for pair in slave.windows(2) {
        for axis in 0..7 {
            let torque = 0.5 * (pair[0].effort[axis] + pair[1].effort[axis]);
            given -= torque * (pair[1].position[axis] - pair[0].position[axis]);
        }
        pushed = pushed.max(pair[1].effort[1].abs());
    }
    // In the hold the wall holds k x²/2, and what its damper took is little: F = k x, with the lever of the second joint known from the pose.
    let model = Model::load(Path::new(&file("plant/robots/seven-joint-follower.toml"))).unwrap();
    let arm = model.arm.as_ref().unwrap();
    let row = &arm.gradients_at_pose(model.bodies.len())[0];
    let last = slave.last().unwrap();
    let lever = row[arm.bodies[1]];
    let force = -last.effort[1] / lever;
    let held = 0.5 * force * force / 5000.0;
    assert!(force > 1.0 && (given / held - 1.0).abs() < 0.25, "{given} J given, {held} J held by {force} N");
}

#[test]
fn a_bag_of_arms_needs_no_other_file() {
    let place = Place::new();
    for name in ["three-joint-haptic", "three-joint-slave"] {
        for end in ["toml", "urdf"] {
            std::fs::copy(file(&format!("plant/robots/{name}.{end}")), place.path(&format!("{name}.{end}"))).unwrap();
        }
    }
    let text = graph_text("launch/three-joint.toml").replace(&format!("{}/", file("plant/robots")), "");
    let graph = place.write("own.toml", &text).display().to_string();
    let done = place.backdrive(&["run", &graph, "--transport", "inproc", "--bag", "own.mcap", "--duration", "0.6"]);
    assert_eq!(done.code, Some(7), "{done:?}");
    let held = Reader::open(&place.path("own.mcap")).unwrap();
    let files = &held.header().unwrap().files;
    let model = files.iter().find(|(name, _)| name.ends_with("three-joint-haptic.toml")).unwrap();
    let alone = Model::from_toml(&model.1, "held.toml").unwrap();
    assert_eq!(alone.bodies, Model::load(&place.path("three-joint-haptic.toml")).unwrap().bodies);
    for name in ["three-joint-haptic", "three-joint-slave"] {
        for end in ["toml", "urdf"] {
            std::fs::remove_file(place.path(&format!("{name}.{end}"))).unwrap();
        }
    }
    let again = place.backdrive(&["replay", "own.mcap", "--bag", "again.mcap"]);
    assert_eq!(again.code, Some(7), "{again:?}");
    assert_eq!(place.backdrive(&["bag", "diff", "own.mcap", "again.mcap"]).code, Some(0));
}

#[test]
fn an_estimated_hand_over_an_arm_takes_the_limit_without_and_is_then_never_worse() {
    let place = Place::new();
    let graph = place.write("arm.toml", &graph_text("launch/three-joint.toml")).display().to_string();
    let run = |lambda: &str, with: &[&str]| {
        let options = ["run", &graph, "--transport", "inproc", "--overwrite", "--lambda", lambda];
        place.backdrive(&[&options, with].concat())
    };
    let refused = run("2", &["--hand", "estimated"]);
    refused.ends(3, &["--edge-without"]);
    let long = std::env::var("BACKDRIVE_LONG").as_deref() == Ok("1");
    for lambda in if long { &["2", "2.5", "3"][..] } else { &["3"] } {
        for with in [&["--canceller", "none"][..], &["--hand", "estimated", "--edge-without", "3"]] {
            let done = run(lambda, with);
            assert!(done.code == Some(0) && done.stdout.contains("stable at mu*lambda"), "{lambda} {with:?}: {done:?}");
        }
    }
}

#[test]
fn what_an_arm_cannot_be_in_a_graph_is_said_with_its_place() {
    let place = Place::new();
    let refused = |text: String, with: &[&str]| {
        let graph = place.write("wrong.toml", &text).display().to_string();
        let done = place.backdrive(&["run", &graph, "--transport", "inproc", "--duration", "0.1", "--overwrite"]);
        assert_eq!(done.code, Some(3), "{done:?}");
        for with in with {
            assert!(done.stderr.contains(with), "\"{with}\" is not said: {}", done.stderr);
        }
    };
    let graph = graph_text("launch/three-joint.toml");
    refused(graph.replace("environment_on = \"tip.x\"", "environment_on = \"tip.w\""), &["environment_on", "tip.w", "wrong.toml"]);
    // A point on a link that is not there, with the model's file and line.
    let model = std::fs::read_to_string(file("plant/robots/three-joint-haptic.toml")).unwrap();
    let model = model.replace("file = \"", &format!("file = \"{}/", file("plant/robots")));
    let own = |text: &str| {
        place.write("own.toml", text);
        graph.replace(&format!("{}/three-joint-haptic.toml", file("plant/robots")), "own.toml")
    };
    refused(own(&model.replace("link = \"tip\"", "link = \"top\"")), &["own.toml", "point.tip.link", "unknown link \"top\""]);
    refused(own(&model.replace("link = \"tip\"", "link = \"tip\"\naxis = [0.0, 0.0, 0.0]")), &["own.toml", "point.tip.axis"]);
    // More axes than a message carries.
    let mut many = std::fs::read_to_string(file("plant/robots/seven-joint-leader.toml")).unwrap();
    many = many.replace("file = \"", &format!("file = \"{}/", file("plant/robots")));
    for extra in ["again1", "again2"] {
        many += &format!("\n[[axes]]\nname = \"{extra}\"\nuser = \"joint1\"\nfeedback = \"torque1\"\nmeasured = \"angle1\"\n");
    }
    place.write("many.toml", &many);
    let lead = graph_text("launch/leader-follower.toml").replace(&format!("{}/seven-joint-leader.toml", file("plant/robots")), "many.toml");
    refused(lead, &["\"master\" model", "9 axes", "at most 8"]);
}

#[test]
fn the_examples_say_what_they_are() {
    for (name, axes) in [("three-joint", 3), ("leader-follower", 7)] {
        let graph = Graph::load(Path::new(&file(&format!("launch/{name}.toml"))), &Overrides::default()).unwrap();
        assert!(graph.nodes.iter().filter(|n| n.name == "master" || n.name == "slave").all(|n| n.axes == axes));
    }
}

#[test]
fn an_export_says_why_points_have_no_place_in_it() {
    let place = Place::new();
    for target in ["mjcf", "urdf", "isaac", "feedforward"] {
        let done = place.backdrive(&["export", &file("plant/robots/three-joint-haptic.toml"), "--to", target]);
        assert_eq!(done.code, Some(3), "{target}: {done:?}");
        assert_names(&done.stderr, &["three-joint-haptic.toml", "tip.x"]);
    }
    // The leader has none; the output states that its weight is held.
    let done = place.backdrive(&["export", &file("plant/robots/seven-joint-leader.toml"), "--to", "urdf"]);
    assert_names(&done.stderr, &["gravity_compensated"]);
}
