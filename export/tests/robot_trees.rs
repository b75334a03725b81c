//! Robots written as URDF and MJCF: what is read again is the same robot, and MuJoCo and Pinocchio find the same torques for a motion.
//!
//! `BACKDRIVE_PYTHON` names a Python that has `tests/python/requirements.txt`. Without it the second half is skipped, unless `BACKDRIVE_REQUIRE_PYTHON=1`.

#[path = "../../tests/common/naming.rs"]
mod naming;

#[path = "../../tests/common/python.rs"]
mod python;

use backdrive_export::{mjcf, urdf};
use backdrive_plant::elements::Law;
use backdrive_plant::model::Model;
use backdrive_plant::robot::{JointKind, Robot, RobotFile, Tree};
use naming::assert_names;
use serde_json::{Value, json};
use std::path::Path;
use std::process::Command;

const TREES: u64 = 50;

/// Numbers that are the same every time (xorshift64).
struct Random(u64);

impl Random {
    fn next(&mut self) -> f64 {
        self.0 ^= self.0 << 13;
        self.0 ^= self.0 >> 7;
        self.0 ^= self.0 << 17;
        (self.0 >> 11) as f64 / (1u64 << 53) as f64
    }

    fn within(&mut self, low: f64, high: f64) -> f64 {
        low + (high - low) * self.next()
    }

    fn one<T: Copy>(&mut self, of: &[T]) -> T {
        of[(self.next() * of.len() as f64) as usize % of.len()]
    }

    fn three(&mut self, size: f64) -> String {
        let mut one = || self.within(-size, size);
        format!("{} {} {}", one(), one(), one())
    }
}

/// A link that a body can be: a box.
fn link(name: &str, mass: f64, centre: &str) -> String {
    let (a, b, c) = (0.08f64, 0.11f64, 0.29f64);
    let [x, y, z] = [b * b + c * c, a * a + c * c, a * a + b * b].map(|s| mass * s / 12.0);
    format!(
        "<link name='{name}'><inertial><origin xyz='{centre}' rpy='0.1 -0.2 0.4'/><mass value='{mass}'/>\
         <inertia ixx='{x}' ixy='0' ixz='0' iyy='{y}' iyz='0' izz='{z}'/></inertial></link>\n"
    )
}

fn joint(name: &str, kind: &str, ends: [&str; 2], origin: [&str; 2], more: &str) -> String {
    format!(
        "<joint name='{name}' type='{kind}'><parent link='{}'/><child link='{}'/><origin xyz='{}' rpy='{}'/>{more}</joint>\n",
        ends[0], ends[1], origin[0], origin[1]
    )
}

/// A random tree with every type of joint, and an axis of any length and direction, or none.
fn drawn(seed: u64) -> String {
    let mut random = Random(0x9E37_79B9_7F4A_7C15 ^ (seed + 1).wrapping_mul(0xBF58_476D_1CE4_E5B9));
    let joints = 3 + (random.next() * 6.0) as usize;
    let mut text = format!("<robot name='tree{seed}'><link name='l0'/>\n");
    for i in 0..joints {
        let kind = if i == 0 { "revolute" } else { random.one(&["revolute", "continuous", "prismatic", "fixed"]) };
        let parent = if random.next() < 0.3 { (random.next() * (i + 1) as f64) as usize } else { i };
        let (mass, centre) = (random.within(0.1, 3.0), random.three(0.2));
        text += &link(&format!("l{}", i + 1), mass, &centre);
        let axis = match random.one(&[0, 1, 2, 3, 4]) {
            0 => String::new(),
            1 => "<axis xyz='0 -1 0'/>".to_owned(),
            2 => "<axis xyz='0 0 1'/>".to_owned(),
            3 => format!("<axis xyz='{}'/>", random.three(5.0)),
            _ => format!("<axis xyz='{}'/>", random.three(1e-3)),
        };
        let (low, effort) = (random.within(-3.0, 0.0), random.within(1.0, 90.0));
        let limit = match (kind, random.next() < 0.7) {
            ("fixed", _) => String::new(),
            ("continuous", false) => String::new(),
            ("continuous", true) => format!("<limit effort='{effort}' velocity='7'/>"),
            (_, true) => format!("<limit lower='{low}' upper='{}' effort='{effort}' velocity='2.5'/>", low + 2.0),
            (_, false) => "<limit lower='0' upper='0' effort='10' velocity='1'/>".to_owned(),
        };
        let dynamics = match kind != "fixed" && random.next() < 0.5 {
            true => format!("<dynamics damping='{}' friction='{}'/>", random.within(0.0, 1.0), random.within(0.0, 1.0)),
            false => String::new(),
        };
        // Roll and yaw are not determined each by itself where the pitch is a right angle.
        let quarter = std::f64::consts::FRAC_PI_2;
        let pitch = random.one(&[quarter, -quarter, 0.0, 1.1, -3.0]);
        let rpy = format!("{} {pitch} {}", random.within(-3.0, 3.0), random.within(-3.0, 3.0));
        let (ends, xyz) = ([format!("l{parent}"), format!("l{}", i + 1)], random.three(0.4));
        text += &joint(&format!("j{i}"), kind, [&ends[0], &ends[1]], [&xyz, &rpy], &format!("{axis}{limit}{dynamics}"));
    }
    text + "</robot>\n"
}

fn read(text: &str) -> Robot {
    RobotFile::from_xml(text, "r").unwrap_or_else(|e| panic!("{e}\n{text}")).robot
}

/// The torques of a motion, by the tree alone.
fn torques(robot: &Robot, state: &[Vec<f64>; 3]) -> Vec<f64> {
    let mut tree = Tree::new(robot).unwrap();
    (0..tree.len()).for_each(|i| tree.set_armature(i, 0.0));
    let mut out = vec![0.0; tree.len()];
    tree.inverse_dynamics(&state[0], &state[1], &state[2], &mut tree.workspace(), &mut out);
    out
}

fn motion(joints: usize, seed: u64) -> [Vec<f64>; 3] {
    let mut random = Random(77 + 31 * seed);
    [1.5, 2.0, 5.0].map(|size| (0..joints).map(|_| random.within(-size, size)).collect())
}

fn moving(robot: &Robot) -> usize {
    robot.joints.iter().filter(|joint| joint.kind != JointKind::Fixed).count()
}

fn assert_same(a: &Robot, b: &Robot, text: &str) {
    assert_eq!((a.links.len(), a.joints.len()), (b.links.len(), b.joints.len()), "{text}");
    for (x, y) in a.links.iter().zip(&b.links) {
        assert_eq!((&x.name, x.inertia.is_some()), (&y.name, y.inertia.is_some()), "{text}");
        let (Some(x), Some(y)) = (&x.inertia, &y.inertia) else { continue };
        assert_eq!((x.mass, x.centre), (y.mass, y.centre), "{text}");
        assert!((x.about_centre - y.about_centre).amax() <= 1e-15 * x.about_centre.amax(), "{text}");
    }
    for (x, y) in a.joints.iter().zip(&b.joints) {
        let (ends, kinds) = (|j: &backdrive_plant::robot::Joint| (j.name.clone(), j.parent, j.child), (x.kind, y.kind));
        assert_eq!((ends(x), x.limits, x.damping, x.friction), (ends(y), y.limits, y.damping, y.friction), "{text}");
        assert_eq!(kinds.0, kinds.1, "{text}");
        let off = (x.origin.rotation - y.origin.rotation).amax().max((x.origin.translation - y.origin.translation).amax());
        assert!(off < 1e-14, "{}: its origin is off by {off:e}\n{text}", x.name);
        assert!(x.kind == JointKind::Fixed || (x.axis - y.axis).amax() < 1e-15, "{}: {} {}\n{text}", x.name, x.axis, y.axis);
    }
}

fn share(a: &[f64], b: &[f64]) -> f64 {
    let size = a.iter().fold(1e-12, |m: f64, x| m.max(x.abs()));
    a.iter().zip(b).map(|(x, y)| (x - y).abs()).fold(0.0, f64::max) / size
}

#[test]
fn fifty_random_trees_that_are_written_and_read_again_are_the_same_robots() {
    for seed in 0..TREES {
        let text = drawn(seed);
        let robot = read(&text);
        let written = urdf::robot_as_urdf(&robot);
        assert_same(&robot, &read(&written), &written);
        assert_same(&robot, &read(&urdf::robot_as_urdf(&read(&written))), &written);
        let state = motion(moving(&robot), seed);
        let off = share(&torques(&robot, &state), &torques(&read(&written), &state));
        assert!(off < 1e-9, "{off:e}\n{written}");
    }
}

#[test]
fn new_inertias_leave_everything_else_of_a_urdf() {
    for seed in 0..TREES {
        let text = drawn(seed)
            .replace("<link name='l0'/>", "<!-- kept --><link name='l0'><visual><geometry><sphere radius='1'/></geometry></visual></link>");
        let robot = read(&text);
        assert_eq!(urdf::with_inertias(&text, &robot, &robot).unwrap(), text);
        let mut heavier = robot.clone();
        heavier.links.iter_mut().filter_map(|link| link.inertia.as_mut()).for_each(|inertia| inertia.mass *= 1.25);
        heavier.links[0].inertia = None;
        let written = urdf::with_inertias(&text, &robot, &heavier).unwrap();
        assert_same(&heavier, &read(&written), &written);
        for kept in ["<!-- kept -->", "<visual>", "<axis", "<limit"] {
            assert_eq!(written.matches(kept).count(), text.matches(kept).count(), "{kept}\n{written}");
        }
        // And put where there was none.
        let back = urdf::with_inertias(&written, &heavier, &robot).unwrap();
        assert_same(&robot, &read(&back), &back);
    }
}

#[test]
fn joints_that_a_tree_of_single_axes_has_not_are_refused_in_words() {
    for kind in ["floating", "planar"] {
        let text =
            format!("<robot name='r'><link name='a'/><link name='b'/>{}</robot>", joint("j", kind, ["a", "b"], ["0 0 0", "0 0 0"], ""));
        let error = RobotFile::from_xml(&text, "r.urdf").unwrap_err().to_string();
        assert!(error.contains(&format!("a {kind} joint moves in several directions")), "{error}");
    }
    let mimic = panda().replace("<!-- finger -->", "<mimic joint='finger1'/>");
    let error = RobotFile::from_xml(&mimic, "panda.urdf").unwrap_err().to_string();
    assert_names(&error, &["\"finger1\"", "<mimic>"]);
}

const TURNS: &str =
    "<axis xyz='0 0 1'/><limit lower='-2.9' upper='2.9' effort='87' velocity='2.2'/><dynamics damping='0.3' friction='0.1'/>";
const ALONG_Y: &str = "<axis xyz='0 1 0'/><limit lower='-2.5' upper='2.6' effort='24' velocity='30'/><dynamics damping='0.01'/>";

/// A chain: links of these names, a mass each (0: no inertial), each on a joint of this type with these words.
fn chain(first: &str, parts: &[(&str, f64, &str, &str, &str)]) -> String {
    let mut text = format!("<robot name='{first}'><link name='{first}'/>\n");
    let mut parent = first;
    for (index, (name, mass, kind, rpy, more)) in parts.iter().enumerate() {
        text += &if *mass > 0.0 { link(name, *mass, "0.01 -0.03 0.12") } else { format!("<link name='{name}'/>\n") };
        let xyz = format!("0.0{index} -0.02 0.21");
        text += &joint(&format!("{name}_joint"), kind, [parent, name], [&xyz, rpy], more);
        parent = name;
    }
    text + "</robot>"
}

fn panda() -> String {
    let turn = ["0 0 0", "-1.5708 0 0", "1.5708 0 0", "1.5708 0 0", "-1.5708 0 0", "1.5708 0 0", "1.5708 0 0"];
    let names: Vec<String> = (1..8).map(|i| format!("link{i}")).collect();
    let mut parts: Vec<(&str, f64, &str, &str, &str)> =
        names.iter().zip(turn).map(|(name, rpy)| (name.as_str(), 2.4, "revolute", rpy, TURNS)).collect();
    parts.push(("link8", 0.0, "fixed", "0 0 0", ""));
    parts.push(("hand", 0.73, "fixed", "0 0 -0.785398", ""));
    let fingers = ["0 1 0", "0 -1 0"].iter().enumerate().map(|(i, axis)| {
        let more = format!(
            "<axis xyz='{axis}'/><limit lower='0' upper='0.04' effort='20' velocity='0.2'/>{}",
            if i == 1 { "<!-- finger -->" } else { "" }
        );
        let name = format!("finger{}", i + 1);
        link(&format!("{name}_link"), 0.015, "0 0.01 0.02")
            + &joint(&name, "prismatic", ["hand", &format!("{name}_link")], ["0 0 0.058", "0 0 0"], &more)
    });
    chain("panda_link0", &parts).replace("</robot>", &(fingers.collect::<String>() + "</robot>"))
}

/// Robots in the shapes of public ones, with masses of their own.
fn foreign() -> Vec<(&'static str, String)> {
    let ur: Vec<(&str, f64, &str, &str, &str)> = vec![
        ("base_link", 0.0, "fixed", "0 0 0", ""),
        ("base_link_inertia", 4.0, "fixed", "0 0 3.141592653589793", ""),
        ("shoulder", 7.7, "revolute", "0 0 0", TURNS),
        ("upper_arm", 13.0, "revolute", "1.570796327 0 0", TURNS),
        ("forearm", 3.9, "revolute", "0 0 0", TURNS),
        ("wrist_1", 1.9, "revolute", "0 0 0", TURNS),
        ("wrist_2", 1.9, "revolute", "1.570796327 0 0", TURNS),
        ("wrist_3", 0.2, "revolute", "1.570796326589793 3.141592653589793 3.141592653589793", TURNS),
        ("flange", 0.0, "fixed", "0 -1.570796 -1.570796", ""),
        ("tool0", 0.0, "fixed", "1.570796 0 1.570796", ""),
    ];
    let so101: Vec<(&str, f64, &str, &str, &str)> = vec![
        ("base", 0.15, "fixed", "0 0 0", ""),
        (
            "pan",
            0.1,
            "revolute",
            "3.14159 4.18253e-17 -3.14159",
            "<axis xyz='0 0 1'/><limit effort='10' velocity='10' lower='-1.91986' upper='1.91986'/>",
        ),
        (
            "lift",
            0.103,
            "revolute",
            "-1.5708 -1.5708 0",
            "<axis xyz='0 0 1'/><limit effort='10' velocity='10' lower='-1.74533' upper='1.74533'/>",
        ),
        (
            "elbow",
            0.104,
            "revolute",
            "-3.63608e-16 8.74301e-16 1.5708",
            "<axis xyz='0 0 1'/><limit effort='10' velocity='10' lower='-1.69' upper='1.69'/>",
        ),
        ("gripper_frame", 0.0, "fixed", "0 3.14159 0", ""),
    ];
    let leg: Vec<(&str, f64, &str, &str, &str)> = vec![
        ("imu", 0.0, "fixed", "0 0 0", ""),
        ("hip", 0.68, "revolute", "0 0 0", "<axis xyz='1 0 0'/><limit lower='-1.05' upper='1.05' effort='23.7' velocity='30.1'/>"),
        ("thigh", 1.15, "revolute", "0 0 0", ALONG_Y),
        ("calf", 0.15, "revolute", "0 0 0", ALONG_Y),
        ("foot", 0.04, "fixed", "0 0 0", ""),
    ];
    let furuta: Vec<(&str, f64, &str, &str, &str)> = vec![
        (
            "arm",
            0.3,
            "revolute",
            "0 0 0",
            "<axis xyz='0 0 1'/><limit lower='-2' upper='2' effort='0.5' velocity='20'/><dynamics damping='0.002'/>",
        ),
        (
            "pendulum",
            0.12,
            "continuous",
            "0 1.570796 0",
            "<axis xyz='-1 0 0'/><limit effort='0' velocity='50'/><dynamics damping='0.0005'/>",
        ),
    ];
    let slides = |axis: &str| {
        format!("<axis xyz='{axis}'/><limit lower='-0.4' upper='0.6' effort='300' velocity='1'/><dynamics damping='20' friction='4'/>")
    };
    let (x, y, z) = (slides("2 0 0"), slides("0 -1 0"), slides("0 0 1"));
    let gantry: Vec<(&str, f64, &str, &str, &str)> = vec![
        ("bridge", 12.0, "prismatic", "0 0 0", &x),
        ("between", 0.0, "prismatic", "0 0 0", &y),
        ("column", 5.0, "prismatic", "0 0 0.3", &z),
    ];
    let turns = "<axis xyz='0 0 1'/><limit effort='39' velocity='0.87'/>";
    let kinova: Vec<(&str, f64, &str, &str, &str)> = vec![
        ("base_link", 1.6, "fixed", "0 0 0", ""),
        ("shoulder_link", 1.3, "continuous", "3.1416 2.7629e-18 -4.9305e-36", turns),
        ("half_arm", 1.1, "revolute", "1.5708 2.1343e-17 -1.1102e-16", TURNS),
        ("forearm", 0.9, "continuous", "-1.5708 1.2326e-32 -2.9122e-16", "<axis xyz='0.6 0 -0.8'/>"),
        ("world", 0.4, "continuous", "0 0 0", ""),
        ("end_effector", 0.0, "fixed", "3.1416 0 0", ""),
    ];
    let zero = "<inertial><origin xyz='0.01 0 0'/><mass value='0'/><inertia ixx='0' ixy='0' ixz='0' iyy='0' iyz='0' izz='0'/></inertial>";
    let xacro = chain(
        "base_footprint",
        &[
            ("base_link", 2.0, "fixed", "0 0 0", ""),
            ("carrier", 0.0, "revolute", "0 0 0", ALONG_Y),
            ("body", 1.0, "fixed", "0 0 0.3", ""),
            ("wrist", 0.0, "revolute", "0 0.2 0", "<axis xyz='0 1 0'/><limit lower='0' upper='0' effort='3' velocity='3'/>"),
            ("weight", 0.0, "fixed", "0 0 0", ""),
            ("ball", 0.0, "fixed", "0 0 0", ""),
            ("tool0", 0.0, "fixed", "0 0 0", ""),
        ],
    )
    .replace(
        "<link name='weight'/>",
        &format!("<link name='weight'>{zero}<visual><geometry><sphere radius='0.1'/></geometry></visual></link>"),
    )
    .replace("<link name='ball'/>", &format!("<link name='ball'>{}</link>", zero.replace("mass value='0'", "mass value='0.2'")));
    vec![
        ("ur", chain("world", &ur)),
        ("panda", panda()),
        ("so101", chain("base_root", &so101)),
        ("leg", chain("trunk", &leg)),
        ("furuta", chain("stand", &furuta)),
        ("gantry", chain("frame", &gantry)),
        ("kinova", chain("root", &kinova)),
        ("xacro", xacro),
    ]
}

/// A model's exports, and what we find for a motion of it.
fn case(folder: &Path, name: &str, xml: &str, limit: f64) -> Value {
    let model = Model::from_toml(&format!("name = '{name}'\n[robot]\nxml = '''{xml}'''\n"), name).unwrap_or_else(|e| panic!("{e}\n{xml}"));
    let arm = model.arm.as_ref().unwrap();
    for (exported, to) in [(mjcf::export(&model, None), "xml"), (urdf::export(&model), "urdf")] {
        let exported = exported.unwrap_or_else(|e| panic!("{name}: {e}"));
        assert!(exported.left_out.iter().all(|left| !left.matters()), "{name}: {:?}", exported.left_out);
        std::fs::write(folder.join(format!("{name}.{to}")), exported.text).unwrap();
    }
    std::fs::write(folder.join(format!("{name}.alone.urdf")), urdf::robot_as_urdf(&arm.robot)).unwrap();
    let state = motion(arm.tree.len(), xml.len() as u64);
    let rigid = torques(&arm.robot, &state);
    let damping = |body: usize| {
        let on = model.elements.iter().filter(|e| e.between == [Some(body), None]);
        on.map(|e| if let Law::Damper(d) = &e.law { d.damping } else { 0.0 }).sum::<f64>()
    };
    let joints: Vec<&str> = arm.tree.coordinates().iter().map(|c| c.name.as_str()).collect();
    let limits = |index: usize| arm.robot.joints[arm.tree.coordinates()[index].joint].limits;
    json!({
        "name": name, "joints": joints, "limit": limit, "q": state[0], "v": state[1], "a": state[2], "torque": rigid,
        "damping": arm.bodies.iter().map(|body| damping(*body)).collect::<Vec<f64>>(),
        "range": (0..joints.len()).map(|i| limits(i).range.filter(|[a, b]| a < b)).collect::<Vec<_>>(),
        "effort": (0..joints.len()).map(|i| limits(i).effort).collect::<Vec<_>>(),
    })
}

#[test]
fn mujoco_and_pinocchio_load_what_is_written_and_find_the_same_torques() {
    let Some(python) = python::python("that has tests/python/requirements.txt") else { return };
    let folder = tempfile::tempdir().unwrap();
    // A mass of 1e-9 kg where MuJoCo wants one, and moments of 1e-14 kg m² of a point.
    let mut cases: Vec<Value> = foreign().iter().map(|(name, xml)| case(folder.path(), name, xml, 1e-7)).collect();
    cases.extend((0..TREES).map(|seed| case(folder.path(), &format!("tree{seed}"), &drawn(seed), 1e-9)));
    std::fs::write(folder.path().join("cases.json"), serde_json::to_string(&cases).unwrap()).unwrap();
    let script = Path::new(env!("CARGO_MANIFEST_DIR")).join("../tests/python/written_robots.py");
    let mut command = Command::new(python);
    let output = command.arg(script).arg(folder.path()).env("OMP_NUM_THREADS", "1").env("PYTHONDONTWRITEBYTECODE", "1").output().unwrap();
    println!("{}", String::from_utf8_lossy(&output.stdout));
    assert!(output.status.success(), "{}\n{}", String::from_utf8_lossy(&output.stdout), String::from_utf8_lossy(&output.stderr));
}

#[test]
fn a_moment_of_inertia_that_no_body_has_is_raised_and_said() {
    let xml = chain("base", &[("rod", 1.0, "revolute", "0 0 0", TURNS)]).replace("iyy='0.0075416", "iyy='0.75416");
    let xml = xml.replace("izz='", "izz='9");
    let model = Model::from_toml(&format!("[robot]\nxml = '''{xml}'''\n"), "r").unwrap();
    let found = mjcf::export(&model, None).unwrap();
    let left = found.left_out.iter().find(|left| left.name == "rod").unwrap_or_else(|| panic!("{:?}", found.left_out));
    assert!(left.matters() && left.why.contains("no body has one that is more than the two others together"), "{left:?}");
    let mut changed = model.clone();
    left.changes.iter().for_each(|change| change.apply(&mut changed));
    assert!(changed.arm.as_ref().unwrap().robot.links[1].doubt().is_none());
}
