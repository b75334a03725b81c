//! What each element, input, output and body is in MuJoCo's XML.

#[path = "../../tests/common/naming.rs"]
mod naming;

use backdrive_export::{Change, Exported, Part, change_all, mjcf};
use backdrive_plant::elements::Law;
use backdrive_plant::model::Model;
use backdrive_plant::robot::{RobotFile, Tree};
use nalgebra::DMatrix;
use naming::assert_names;

fn model(text: &str) -> Model {
    Model::from_toml(text, "model.toml").unwrap_or_else(|e| panic!("{e}\n{text}"))
}

fn exported(text: &str) -> Exported {
    mjcf::export(&model(text), None).unwrap()
}

fn at_a_millisecond(text: &str) -> Exported {
    mjcf::export(&model(text), Some(1e-3)).unwrap()
}

/// Attributes of the one element with this tag, and name where one is given.
fn attributes(text: &str, tag: &str, name: Option<&str>) -> Vec<(String, String)> {
    let document = roxmltree::Document::parse(text).unwrap();
    let is = |n: &roxmltree::Node| n.has_tag_name(tag) && name.is_none_or(|name| n.attribute("name") == Some(name));
    let node = document.descendants().find(is).unwrap_or_else(|| panic!("no <{tag}> {name:?}\n{text}"));
    node.attributes().map(|a| (a.name().to_string(), a.value().to_string())).collect()
}

fn has(found: &[(String, String)], wanted: &[(&str, &str)]) {
    for (name, value) in wanted {
        let there = found.iter().find(|(n, _)| n == name).map(|(_, v)| v.as_str());
        assert_eq!(there, Some(*value), "{name} of {found:?}");
    }
}

const BODIES: &str = "name = 'test'\n[bodies]\na = 2.0\nb = 0.5\n[[inputs]]\nname = 'push'\nkind = 'force'\non = 'a'\n";

/// A model of two bodies with an element.
fn with(between: &str, element: &str) -> Exported {
    exported(&format!("{BODIES}[[elements]]\nname = 'e'\nbetween = {between}\n{element}\n"))
}

#[test]
fn elements_to_ground_are_attributes_of_the_joint() {
    let joint = |element: &str, wanted: &[(&str, &str)]| {
        for between in ["['a', 'ground']", "['ground', 'a']"] {
            let found = with(between, element);
            assert!(found.left_out.is_empty(), "{element}: {:?}", found.left_out);
            has(&attributes(&found.text, "joint", Some("a")), wanted);
        }
    };
    joint("kind = 'spring'\nstiffness = 30", &[("stiffness", "30"), ("springref", "0")]);
    joint("kind = 'damper'\ndamping = 1.5", &[("damping", "1.5")]);
    joint("kind = 'inerter'\ninertance = 0.25", &[("armature", "0.25")]);
    joint("kind = 'coulomb'\nforce = 0.7", &[("frictionloss", "0.7"), ("solimpfriction", "0.9999 0.9999 0.001 0.5 2")]);
    joint("kind = 'quadratic_drag'\ncoefficient = 4", &[("damping", "0 4")]);
    joint("kind = 'cubic_spring'\nstiffness = 3\ncubic = 900", &[("stiffness", "3 0 900"), ("springref", "0")]);
    joint("kind = 'asymmetric_coulomb'\npositive = 3\nnegative = 1", &[("frictionloss", "2")]);
    // Turned round, a rest is on the other side.
    let rest = |between: &str| with(between, "kind = 'spring'\nstiffness = 30\nrest = 0.1").text;
    has(&attributes(&rest("['a', 'ground']"), "joint", Some("a")), &[("springref", "0.1")]);
    has(&attributes(&rest("['ground', 'a']"), "joint", Some("a")), &[("springref", "-0.1")]);
}

#[test]
fn elements_between_bodies_and_dead_bands_are_tendons() {
    let tendon = |between: &str, element: &str, wanted: &[(&str, &str)]| {
        let found = with(between, element);
        assert!(found.left_out.is_empty(), "{element}: {:?}", found.left_out);
        has(&attributes(&found.text, "fixed", Some("e")), wanted);
        found.text
    };
    let text = tendon("['a', 'b']", "kind = 'spring'\nstiffness = 30\nrest = 0.1", &[("stiffness", "30"), ("springlength", "0.1 0.1")]);
    assert_names(&text, &["<joint joint=\"a\" coef=\"1\"/><joint joint=\"b\" coef=\"-1\"/>"]);
    tendon("['a', 'b']", "kind = 'damper'\ndamping = 2", &[("damping", "2"), ("stiffness", "0")]);
    tendon("['a', 'b']", "kind = 'coulomb'\nforce = 2", &[("frictionloss", "2")]);
    tendon("['a', 'b']", "kind = 'inerter'\ninertance = 2", &[("armature", "2")]);
    tendon(
        "['a', 'ground']",
        "kind = 'contact'\nstiffness = 30\ngap = 0.1",
        &[("stiffness", "30"), ("springlength", "-10000000000.0 0.1")],
    );
    tendon("['a', 'b']", "kind = 'hunt_crossley'\nstiffness = 30\nexponent = 2", &[("stiffness", "0 30")]);
    tendon("['a', 'b']", "kind = 'backlash'\ngap = 0.2\nstiffness = 30", &[("stiffness", "30"), ("springlength", "-0.1 0.1")]);
    let slip = "kind = 'maxwell_slip'\nstiffness = [100, 50]\nforce = [1, 2]";
    let text = tendon("['a', 'ground']", slip, &[("stiffness", "100"), ("springyield", "0.01")]);
    has(&attributes(&text, "fixed", Some("e_2")), &[("stiffness", "50"), ("springyield", "0.04")]);
}

#[test]
fn inertia_between_two_bodies_counts_where_they_are_one_tree() {
    let text = with("['a', 'b']", "kind = 'inerter'\ninertance = 2").text;
    let document = roxmltree::Document::parse(&text).unwrap();
    let b = document.descendants().find(|n| n.has_tag_name("body") && n.attribute("name") == Some("b")).unwrap();
    assert_eq!(b.parent().and_then(|p| p.attribute("name")), Some("a"), "{text}");
    has(&attributes(&text, "joint", Some("a")), &[("armature", "2")]);
    has(&attributes(&text, "joint", Some("b")), &[("armature", "0.5")]);
    // A rotor is in no tree with the arm; a joint is in one with those that it carries.
    let arm = |between: &str| {
        exported(&format!(
            "[robot]\nxml = '''{URDF}'''\n[bodies]\nrotor = 0.1\n[[elements]]\nname = 'e'\nkind = 'inerter'\nbetween = {between}\ninertance = 2\n"
        ))
        .left_out
        .into_iter()
        .filter(|left| left.matters())
        .collect::<Vec<_>>()
    };
    assert_eq!(arm("['shoulder', 'elbow']"), []);
    assert_eq!(arm("['rotor', 'elbow']")[0].kind, "inerter");
}

#[test]
fn springs_in_one_place_add_up_about_their_common_rest() {
    let second = "[[elements]]\nname = 'f'\nkind = 'spring'\nbetween = ['a', 'ground']\nstiffness = 10\nrest = 0.4\n";
    let found = with("['a', 'ground']", &format!("kind = 'spring'\nstiffness = 30\n{second}"));
    has(&attributes(&found.text, "joint", Some("a")), &[("stiffness", "40"), ("springref", "0.1")]);
    // A cubic one about another place does not.
    let found = with("['a', 'ground']", &format!("kind = 'cubic_spring'\ncubic = 30\n{second}"));
    has(&attributes(&found.text, "joint", Some("a")), &[("stiffness", "0 0 30")]);
    has(&attributes(&found.text, "fixed", Some("f")), &[("stiffness", "10"), ("springlength", "0.4 0.4")]);
}

#[test]
fn a_constant_force_is_an_actuator_without_a_command() {
    for (between, force) in [("['a', 'ground']", "-3"), ("['ground', 'a']", "3")] {
        let found = with(between, "kind = 'bias'\nforce = 3");
        has(&attributes(&found.text, "general", Some("e")), &[("joint", "a"), ("biasprm", &format!("{force} 0 0")), ("gainprm", "0")]);
    }
    let found = with("['a', 'b']", "kind = 'bias'\nforce = 3");
    has(&attributes(&found.text, "general", Some("e")), &[("tendon", "e"), ("biasprm", "-3 0 0")]);
    assert_names(&found.text, &["<fixed name=\"e\">"]);
}

#[test]
fn what_has_no_word_is_told_with_what_stands_in_its_place() {
    let cases = [
        ("kind = 'stribeck'\ncoulomb = 1\nstatic = 2\nvelocity = 0.1", Some("coulomb")),
        ("kind = 'friction_deficit'\ncoulomb = 2\nrest = 1\nvelocity = 0.1", Some("coulomb")),
        ("kind = 'load_friction'\nforce = 1\ncoefficient = 0.1", Some("coulomb")),
        ("kind = 'gear_loss'\nefficiency = 0.9\nback_efficiency = 0.8", None),
        ("kind = 'warm_friction'\nforce = 1\nhalf_heat = 2\ncooling_time = 3", Some("coulomb")),
        ("kind = 'dahl'\nstiffness = 100\ncoulomb = 1", Some("maxwell_slip")),
        ("kind = 'lugre'\nstiffness = 1000\ndamping = 1\ncoulomb = 1\nstatic = 2\nvelocity = 0.1", Some("coulomb")),
        ("kind = 'asymmetric_damper'\npositive = 3\nnegative = 1", Some("damper")),
        ("kind = 'contact'\nstiffness = 3\ndamping = 1", Some("contact")),
        ("kind = 'hunt_crossley'\nstiffness = 3\ndamping = 1\nexponent = 2", Some("hunt_crossley")),
        ("kind = 'hunt_crossley'\nstiffness = 3", None),
        ("kind = 'backlash'\ngap = 0.1\nstiffness = 3\ndamping = 1", Some("backlash")),
        ("kind = 'bouc_wen'\nstiffness = 10\nratio = 0.3\namplitude = 1\nbeta = 1\ngamma = 1\nexponent = 1", Some("maxwell_slip")),
        (
            "kind = 'hysteretic_spring'\nstiffness_positive = 90\nstiffness_negative = 110\noffset_positive = 3\noffset_negative = -1\nbandwidth = 50",
            Some("spring"),
        ),
        ("kind = 'cogging'\namplitude = 3\nperiod = 0.1", None),
    ];
    for (element, instead) in cases {
        let text = format!("{BODIES}[[elements]]\nname = 'e'\nbetween = ['a', 'ground']\n{element}\n");
        let found = exported(&text);
        let [left] = found.left_out.as_slice() else { panic!("{element}: {:?}", found.left_out) };
        assert_eq!((left.part, left.name.as_str()), (Part::Element, "e"));
        assert!(!left.why.is_empty() && !left.why.ends_with('.'), "{left:?}");
        let changed = change_all(&model(&text), &found.left_out);
        match (instead, &left.changes[0]) {
            (Some(kind), Change::Law(0, law)) => assert_eq!(law.kind().name, kind),
            (None, Change::NoElement(0)) => assert!(matches!(&changed.elements[0].law, Law::Damper(d) if d.damping == 0.0)),
            other => panic!("{element}: {other:?}"),
        }
        // What stands in its place is exported whole.
        assert!(mjcf::export(&changed, None).unwrap().left_out.is_empty(), "{element}");
    }
}

#[test]
fn inputs_are_actuators_and_outputs_are_sensors_of_the_same_names() {
    let found = at_a_millisecond(
        "[bodies]\na = 2\n[[inputs]]\nname = 'push'\nkind = 'force'\non = 'a'\ngain = -2\nsaturation = 8\nback_emf = 0.5\n\
         [[inputs]]\nname = 'slow'\nkind = 'force'\non = 'a'\ndelay = 0.002\nbandwidth = 10\n\
         [[outputs]]\nname = 'x'\nkind = 'position'\nof = 'a'\ndelay = 0.001\nnoise = 0.01\n[[outputs]]\nname = 'v'\nkind = 'velocity'\nof = 'a'\n",
    );
    assert!(found.left_out.is_empty(), "{:?}", found.left_out);
    has(&attributes(&found.text, "motor", Some("push")), &[("joint", "a"), ("gear", "-2"), ("ctrlrange", "-4 4"), ("ctrllimited", "true")]);
    let lag = attributes(&found.text, "general", Some("slow"));
    has(&lag, &[("dyntype", "filterexact"), ("delay", "0.002"), ("interp", "zoh"), ("nsample", "2"), ("gear", "1")]);
    let time: f64 = lag.iter().find(|a| a.0 == "dynprm").unwrap().1.parse().unwrap();
    assert!((time * 2.0 * std::f64::consts::PI * 10.0 - 1.0).abs() < 1e-12);
    has(&attributes(&found.text, "joint", Some("a")), &[("damping", "0.5")]);
    has(&attributes(&found.text, "jointpos", Some("x")), &[("joint", "a"), ("delay", "0.001"), ("noise", "0.01")]);
    has(&attributes(&found.text, "jointvel", Some("v")), &[("joint", "a")]);
}

#[test]
fn what_a_sensor_or_a_motion_cannot_be_is_told() {
    let found = exported(
        "[bodies]\na = 2\nb = 0\n[[elements]]\nname = 'e'\nkind = 'spring'\nbetween = ['a', 'b']\nstiffness = 3\n\
         [[inputs]]\nname = 'hand'\nkind = 'motion'\non = 'b'\n[[outputs]]\nname = 'f'\nkind = 'force'\nelement = 'e'\n\
         [[outputs]]\nname = 'r'\nkind = 'reaction'\nof = 'b'\n[[outputs]]\nname = 'x'\nkind = 'position'\nof = 'a'\ngain = 2\noffset = 1\nresolution = 0.1\n\
         [[outputs]]\nname = 'acc'\nkind = 'acceleration'\nof = 'a'\n",
    );
    let told: Vec<(&str, &str, usize)> = found.left_out.iter().map(|l| (l.name.as_str(), l.kind.as_str(), l.changes.len())).collect();
    let wanted = [
        ("hand", "motion", 0),
        ("f", "force", 0),
        ("r", "reaction", 0),
        ("x", "gain", 1),
        ("x", "offset", 1),
        ("x", "resolution", 0),
        ("acc", "acceleration", 0),
    ];
    assert_eq!(told, wanted);
    // A body on prescribed motion is so heavy that nothing else moves it.
    assert_names(&found.text, &["mass=\"2000000\""]);
}

#[test]
fn a_turning_axis_is_a_hinge_with_its_travel_and_its_motors_limit() {
    let found = exported(
        "motion = 'rotation'\n[bodies]\nwheel = 0.02\n[[inputs]]\nname = 'torque'\nkind = 'force'\non = 'wheel'\n\
         [[outputs]]\nname = 'angle'\nkind = 'position'\nof = 'wheel'\n\
         [[axes]]\nname = 'x'\nuser = 'wheel'\nfeedback = 'torque'\nmeasured = 'angle'\nscale = 0.1\ntravel = [-0.05, 0.1]\nforce = 3\n",
    );
    has(&attributes(&found.text, "joint", Some("wheel")), &[("type", "hinge"), ("range", "-0.5 1"), ("limited", "true")]);
    has(&attributes(&found.text, "motor", Some("torque")), &[("ctrlrange", "-3 3")]);
    assert!(found.notes.iter().any(|note| note.contains("commands of axis x")), "{:?}", found.notes);
    has(&attributes(&found.text, "inertial", None), &[("diaginertia", "0.02 0.02 0.02")]);
}

/// The mass matrix of a robot file at a place away from zero.
fn mass(xml: &str) -> (Vec<String>, DMatrix<f64>) {
    let file = RobotFile::from_xml(xml, "robot.xml").unwrap_or_else(|e| panic!("{e}\n{xml}"));
    let tree = Tree::new(&file.robot).unwrap();
    let q: Vec<f64> = (0..tree.len()).map(|i| 0.4 - 0.3 * i as f64).collect();
    let mut matrix = DMatrix::zeros(tree.len(), tree.len());
    tree.mass_matrix(&q, &mut tree.workspace(), &mut matrix);
    (tree.coordinates().iter().map(|c| c.name.clone()).collect(), matrix)
}

const URDF: &str = r#"<robot name="two"><link name="base"/>
<link name="upper"><inertial><origin xyz="0.2 0 0.1"/><mass value="2"/><inertia ixx="0.01" ixy="0.001" ixz="0" iyy="0.02" iyz="0" izz="0.02"/></inertial></link>
<link name="dummy"/>
<link name="fore"><inertial><origin xyz="0 0.2 0"/><mass value="1"/><inertia ixx="0.01" ixy="0" ixz="0" iyy="0.005" iyz="0" izz="0.01"/></inertial></link>
<joint name="shoulder" type="continuous"><parent link="base"/><child link="upper"/><origin xyz="0 0 0.3" rpy="0.1 0.2 0.3"/><axis xyz="0 0 1"/>
  <dynamics damping="0.4" friction="0.1"/></joint>
<joint name="slider" type="prismatic"><parent link="upper"/><child link="dummy"/><origin xyz="0.4 0 0"/><axis xyz="1 0 0"/>
  <limit lower="-0.2" upper="0.3" effort="50" velocity="1"/></joint>
<joint name="elbow" type="revolute"><parent link="dummy"/><child link="fore"/><origin rpy="0 -1 0"/><axis xyz="0 1 0"/>
  <limit lower="-1" upper="2" effort="10" velocity="3"/></joint></robot>"#;

#[test]
fn a_urdf_robot_becomes_the_same_tree_with_the_joints_of_the_model() {
    let text = format!(
        "[robot]\nxml = '''{URDF}'''\npose = {{ elbow = 0.5 }}\n[bodies]\nrotor = 0.003\n\
         [[elements]]\nname = 'gear'\nkind = 'spring'\nbetween = ['rotor', 'elbow']\nstiffness = 200\n\
         [[elements]]\nname = 'e'\nkind = 'spring'\nbetween = ['elbow', 'ground']\nstiffness = 5\nrest = 0.1\n\
         [[elements]]\nname = 'c'\nkind = 'coulomb'\nbetween = ['slider', 'ground']\nforce = 2\n\
         [[inputs]]\nname = 'm'\nkind = 'force'\non = 'rotor'\n[[outputs]]\nname = 'angle'\nkind = 'position'\nof = 'elbow'\n"
    );
    let found = exported(&text);
    let told: Vec<&str> = found.left_out.iter().map(|left| left.name.as_str()).collect();
    assert_eq!(told, ["largest speed of slider, elbow"]);
    has(&attributes(&found.text, "joint", Some("shoulder")), &[("type", "hinge"), ("damping", "0.4"), ("frictionloss", "0.1")]);
    has(&attributes(&found.text, "joint", Some("slider")), &[("frictionloss", "2"), ("range", "-0.2 0.3"), ("actuatorfrcrange", "-50 50")]);
    // Of coordinates, which are 0.5 where the model's position is 0.
    has(&attributes(&found.text, "joint", Some("elbow")), &[("stiffness", "5"), ("springref", "0.6")]);
    has(&attributes(&found.text, "fixed", Some("gear")), &[("springlength", "-0.5 -0.5")]);
    has(&attributes(&found.text, "joint", Some("rotor")), &[("armature", "0.003")]);
    has(&attributes(&found.text, "key", Some("pose")), &[("qpos", "0 0 0.5 0")]);
    // The massless link moves, and a rotor stands beside the arm.
    assert!(found.notes.iter().any(|note| note.contains("dummy has 1e-9 kg")), "{:?}", found.notes);
    assert_names(&found.text, &["mass=\"1e-9\""]);
    let ((names, ours), (their_names, theirs)) = (mass(URDF), mass(&found.text));
    assert_eq!(their_names[..3], names);
    assert!((theirs.view((0, 0), (3, 3)) - &ours).amax() < 1e-8 * ours.amax(), "{theirs}{ours}");
}

const MJCF: &str = r#"<mujoco model="arm">
  <compiler angle="degree"/>
  <default><joint damping="0.3"/><default class="wrist"><joint frictionloss="0.2"/></default></default>
  <worldbody>
    <!-- the stand -->
    <geom type="box" size="0.1 0.1 0.1"/>
    <body name="upper" pos="0 0 0.4">
      <joint name="shoulder" axis="0 1 0" range="-90 90" springref="45" stiffness="3"/>
      <geom type="capsule" fromto="0 0 0 0.3 0 0" size="0.03"/>
      <body name="fore" pos="0.3 0 0">
        <joint class="wrist" axis="0 1 0"/>
        <geom type="capsule" fromto="0 0 0 0.3 0 0" size="0.02"/>
      </body>
    </body>
  </worldbody>
  <actuator><motor name="m" joint="shoulder" gear="5"/></actuator>
  <keyframe><key name="home" qpos="0 0"/></keyframe>
</mujoco>"#;

#[test]
fn an_mjcf_robot_is_changed_where_its_joints_are_others_and_nowhere_else() {
    let text = format!(
        "[robot]\nxml = '''{MJCF}'''\n[[elements]]\nname = 'more'\nkind = 'damper'\nbetween = ['fore_joint', 'ground']\ndamping = 0.5\n\
         [[elements]]\nname = 'spring'\nkind = 'spring'\nbetween = ['fore_joint', 'ground']\nstiffness = 2\nrest = {}\n",
        30f64.to_radians()
    );
    let found = exported(&text);
    assert!(found.left_out.is_empty());
    let fore = attributes(&found.text, "joint", Some("fore_joint"));
    has(&fore, &[("damping", "0.8"), ("stiffness", "2"), ("class", "wrist")]);
    let rest: f64 = fore.iter().find(|a| a.0 == "springref").unwrap().1.parse().unwrap();
    assert!((rest - 30.0).abs() < 1e-12, "in degrees, as the file is");
    assert!(fore.iter().all(|(name, _)| name != "frictionloss" && name != "armature"), "{fore:?}");
    assert_names(&found.text, &["<joint name=\"shoulder\" axis=\"0 1 0\" range=\"-90 90\" springref=\"45\" stiffness=\"3\"/>"]);
    assert_names(&found.text, &["<!-- the stand -->", "<motor name=\"m\"", "name=\"home\""]);
    assert_eq!(mass(&found.text), (vec!["shoulder".to_string(), "fore_joint".to_string()], mass(MJCF).1));
    // Read again it is the same model.
    let again = model(&format!("[robot]\nxml = '''{}'''\n", found.text));
    let robot = &again.arm.as_ref().unwrap().robot;
    assert!((robot.joints[1].damping - 0.8).abs() < 1e-15 && (robot.joints[1].rest - 30f64.to_radians()).abs() < 1e-12);
}

#[test]
fn inputs_of_the_model_take_the_place_of_an_mjcfs_actuators() {
    let found = exported(&format!(
        "[robot]\nxml = '''{MJCF}'''\nactuators = true\n[bodies]\nrotor = 0.1\n[[elements]]\nname = 'gear'\nkind = 'spring'\nbetween = ['rotor', 'shoulder']\nstiffness = 9\n"
    ));
    assert_eq!(found.text.matches("name=\"m\"").count(), 1, "{}", found.text);
    has(&attributes(&found.text, "motor", Some("m")), &[("gear", "5"), ("joint", "shoulder")]);
    assert!(!found.text.contains("home") && found.notes.iter().any(|note| note.contains("key frames")), "{:?}", found.notes);
    has(&attributes(&found.text, "joint", Some("rotor")), &[("armature", "0.1"), ("type", "hinge"), ("limited", "false")]);
}

#[test]
fn what_cannot_be_exported_says_why() {
    assert_names(mjcf::export(&Model::default(), None).unwrap_err().to_string(), &["model of nothing"]);
    let heavy = model("[bodies]\na = 0\n[[elements]]\nname = 'e'\nkind = 'inerter'\nbetween = ['a', 'ground']\ninertance = 1\n");
    assert!(mjcf::export(&heavy, None).is_ok());
}
