//! Model files with a robot: `[robot]`, `[joint.NAME]`, and what they are refused with.

#[path = "../../tests/common/naming.rs"]
mod naming;

mod robot_common;

use backdrive_plant::describe::{Severity, check, describe};
use backdrive_plant::elements::Law;
use backdrive_plant::linear::{LinearModel, Operating};
use backdrive_plant::model::{Model, Motion};
use backdrive_plant::stepper::{Options, Plant};
use naming::assert_names;
use robot_common::rods_urdf;
use std::path::Path;

const RODS: [(f64, f64); 2] = [(1.7, 0.6), (0.8, 0.45)];

const MJCF: &str = "<mujoco><worldbody><body name='b'><joint name='slide' type='slide' damping='2' frictionloss='3' stiffness='4' springref='0.5' armature='0.7'/>\
<geom size='0.1' mass='5'/></body></worldbody><actuator><motor name='push' joint='slide' gear='6' ctrlrange='-2 2'/></actuator></mujoco>";

const DRIVE: &str = "kind = 'fragment'
[bodies]
motor = 0.1
[[elements]]
name = 'gear'
kind = 'spring'
between = ['motor', 'port']
stiffness = 500
[[inputs]]
name = 'torque'
kind = 'force'
on = 'motor'
";

/// A folder with robots, a drive, and a model.
fn folder(model: &str) -> tempfile::TempDir {
    let folder = tempfile::tempdir().unwrap();
    let write = |name: &str, text: &str| std::fs::write(folder.path().join(name), text).unwrap();
    write("rods.urdf", &rods_urdf(&RODS));
    write("slide.xml", MJCF);
    write("drive.toml", DRIVE);
    write("model.toml", model);
    folder
}

fn load(text: &str) -> Model {
    Model::load(&folder(text).path().join("model.toml")).unwrap_or_else(|e| panic!("{e}"))
}

fn refused(text: &str, with: &str) {
    let folder = folder(text);
    let said = Model::load(&folder.path().join("model.toml")).expect_err("it is refused").to_string();
    let said = said.replace(&format!("{}/", folder.path().display()), "");
    assert!(said.contains(with), "said: {said}\nexpected: {with}");
}

const ARM: &str = "name = 'arm'
[robot]
file = 'rods.urdf'
pose = { joint1 = 0.5 }

[bodies]
joint0 = 0.05

[joint.joint0]
network = 'drive.toml'

[joint.joint1.bodies]
motor = 0.2

[[joint.joint1.elements]]
name = 'belt'
kind = 'backlash'
between = ['port', 'motor']
gap = 0.01
stiffness = 300
damping = 1

[[elements]]
name = 'bearing'
kind = 'coulomb'
between = ['joint1', 'ground']
force = 0.3

[[inputs]]
name = 'command'
kind = 'force'
on = 'joint1.motor'

[[outputs]]
name = 'shoulder'
kind = 'position'
of = 'joint0'

[[axes]]
name = 'shoulder'
user = 'joint0'
feedback = 'command'
measured = 'shoulder'
";

#[test]
fn joints_are_bodies_and_their_networks_hang_on_them() {
    let model = load(ARM);
    let bodies: Vec<(&str, f64)> = model.bodies.iter().map(|b| (b.name.as_str(), b.inertia)).collect();
    assert_eq!(bodies, [("joint0", 0.05), ("joint1", 0.0), ("joint0.motor", 0.1), ("joint1.motor", 0.2)]);
    assert_eq!(model.motion, Motion::Rotation);
    let ends: Vec<_> = model.elements.iter().map(|e| (e.name.as_str(), e.between)).collect();
    assert_eq!(ends, [("joint0.gear", [Some(2), Some(0)]), ("joint1.belt", [Some(1), Some(3)]), ("bearing", [Some(1), None])]);
    let inputs: Vec<_> = model.inputs.iter().map(|i| (i.name.as_str(), i.on)).collect();
    assert_eq!(inputs, [("joint0.torque", 2), ("command", 3)]);
    let arm = model.arm.as_ref().unwrap();
    assert_eq!((arm.bodies.as_slice(), arm.pose.as_slice()), ([0, 1].as_slice(), [0.0, 0.5].as_slice()));
    // Written out it is the same, wherever it lies.
    let again = Model::from_toml(&model.to_toml(), "arm").unwrap_or_else(|e| panic!("{e}\n{}", model.to_toml()));
    assert_eq!(again, model);
    assert!(Plant::new(&model, 1e-3, &Options::default()).is_ok());
    // Numbers have their paths.
    let mut other = model.clone();
    other.set_values_at("bodies.joint1", &[0.4]).unwrap();
    assert_eq!(other.bodies[1].inertia, 0.4);
}

#[test]
fn what_a_file_says_of_a_joint_becomes_elements() {
    let model = load("[robot]\nfile = 'slide.xml'\nactuators = true\npose = { slide = 0.2 }\n");
    assert_eq!((model.motion, model.bodies[0].inertia), (Motion::Translation, 0.7));
    let laws: Vec<(&str, Vec<Vec<f64>>)> = model.elements.iter().map(|e| (e.name.as_str(), e.law.values())).collect();
    let of = |values: &[f64]| values.iter().map(|v| vec![*v]).collect::<Vec<_>>();
    assert_eq!(laws, [("slide_damping", of(&[2.0])), ("slide_friction", of(&[3.0])), ("slide_spring", of(&[4.0, 0.5 - 0.2]))]);
    assert!(matches!(model.elements[1].law, Law::Coulomb(_)));
    assert_eq!((model.inputs[0].name.as_str(), model.inputs[0].gain, model.inputs[0].saturation), ("push", 6.0, 12.0));
    assert_eq!(Model::from_toml(&model.to_toml(), "model").unwrap(), model);
    let bare = load("[robot]\nfile = 'slide.xml'\npassive = false\n");
    assert!(bare.elements.is_empty() && bare.inputs.is_empty());
}

#[test]
fn about_its_pose_an_arm_is_a_linear_system() {
    // A rod that hangs down is a pendulum, with its armature.
    let text = "[robot]\nfile = 'rods.urdf'\npose = { joint0 = -1.5707963267948966 }\n[bodies]\njoint0 = 0.05\n[[elements]]\nkind = 'spring'\nbetween = ['joint1', 'ground']\nstiffness = 1e9\n";
    let model = load(text);
    let modes = LinearModel::new(&model, &Operating::small()).unwrap().modes().unwrap();
    let ((m1, l1), (m2, l2)) = (RODS[0], RODS[1]);
    let inertia = 0.05 + m1 * l1 * l1 / 3.0 + m2 * (l1 * l1 + l1 * l2 + l2 * l2 / 3.0);
    let torque = 9.81 * (m1 * 0.5 * l1 + m2 * (l1 + 0.5 * l2));
    assert!((modes[0].omega_squared - torque / inertia).abs() < 1e-6 * torque / inertia, "{} {}", modes[0].omega_squared, torque / inertia);
}

#[test]
fn what_is_wrong_is_said_with_its_line() {
    refused("[robot]\nfile = 'none.urdf'\n", "model.toml:2: robot.file: \"none.urdf\": there is no such file");
    refused("[robot]\nfil = 'rods.urdf'\n", "unknown key \"fil\"; did you mean \"file\"?");
    refused("[robot]\nfile = 'rods.urdf'\nbase = 1\n", "robot.base: expected a list of numbers");
    refused("[robot]\nfile = 'rods.urdf'\ngravity = [0, 1]\n", "model.toml:3: robot.gravity: expected three numbers");
    refused(
        "[robot]\nfile = 'rods.urdf'\npose = { joint7 = 1 }\n",
        "robot.pose.joint7: unknown joint \"joint7\"; did you mean \"joint0\"?",
    );
    refused(
        "[robot]\nfile = 'rods.urdf'\n[joint.jonit0]\nnetwork = 'drive.toml'\n",
        "joint.jonit0: unknown joint \"jonit0\"; did you mean \"joint0\"?",
    );
    refused("[robot]\nfile = 'rods.urdf'\n[joint.joint0]\nnetwork = 'rods.urdf'\n", "rods.urdf:1: is not valid TOML");
    refused("[robot]\nfile = 'rods.urdf'\n[joint.joint0]\nnetwork = 'model.toml'\n", "is the model of a device, expected a fragment");
    refused("[bodies]\na = 1\n[joint.a]\nnetwork = 'drive.toml'\n", "only a model with a [robot] has joints");
    refused(&ARM.replace("'port', 'motor'", "'port', 'motr'"), "unknown body \"motr\"; did you mean \"motor\"?");
    refused(&ARM.replace("['joint1', 'ground']", "['joint2', 'ground']"), "unknown body \"joint2\"");
    refused(&ARM.replace("file = 'rods.urdf'", "file = 'rods.urdf'\nxml = '<robot/>'"), "has both \"file\" and \"xml\"");
    refused("[robot]\nxml = '<robot name=\"x\"/>'\n", "model.toml robot.xml:1: <robot name=\"x\">: has no <link>");
    let said = Model::from_toml("[robot]\nfile = 'rods.urdf'\n", "x.toml").unwrap_err().to_string();
    assert!(said.contains("this model is not in a folder"), "{said}");
    assert!(Model::load(Path::new("/nowhere/model.toml")).is_err());
}

#[test]
fn a_base_on_the_ceiling_is_gravity_turned_round() {
    let gravity = |keys: &str| load(&format!("[robot]\nfile = 'rods.urdf'\n{keys}")).arm.unwrap().robot.gravity;
    let near =
        |found: nalgebra::Vector3<f64>, expected: [f64; 3]| assert!((found - nalgebra::Vector3::from(expected)).norm() < 1e-12, "{found}");
    near(gravity(""), [0.0, 0.0, -9.81]);
    near(gravity("base = [3.141592653589793, 0, 0]"), [0.0, 0.0, 9.81]);
    // Rolled by a quarter: the base's y axis points up, its z axis along the world's -y.
    near(gravity("base = [1.5707963267948966, 0, 0]\ngravity = [1, 0, -9]"), [1.0, -9.0, 0.0]);
}

#[test]
fn a_joint_can_not_be_locked_but_other_bodies_can() {
    let mut model = load(ARM);
    let said = model.lock(&["joint1".to_string()]).unwrap_err();
    assert_names(&said, &["\"joint1\""]);
    model.inputs.clear();
    model.axes.clear();
    model.lock(&["joint0.motor".to_string()]).unwrap();
    assert_eq!(model.bodies.len(), 3);
    assert_eq!(model.arm.as_ref().unwrap().bodies, [0, 1]);
    assert!(Plant::new(&model, 1e-3, &Options::default()).is_ok());
}

#[test]
fn the_robots_of_this_folder_can_be_shown_and_moved() {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("robots/two-joint-arm.toml");
    let model = Model::load(&path).unwrap_or_else(|e| panic!("{e}"));
    let shown = describe(&model, &Operating::small());
    let text = shown.to_string();
    for line in [
        "robot two-joint-arm: 2 joints move 3 kg, gravity (0, 0, -9.81) m/s²",
        "shoulder  revolute  upper_arm  0.4 rad",
        "[shoulder] joint of the robot",
        "[elbow.rotor] 0.06 kg m²",
        "note: robot file: line 25 and 1 more: <limit>: read, but nothing stops a joint at its limits",
    ] {
        assert!(text.contains(line), "{line}\n{text}");
    }
    assert_eq!(shown.not_linear, None);
    assert!(check(&model, &Operating::small()).iter().all(|remark| remark.severity != Severity::Error));
    assert_eq!(Model::from_toml(&model.to_toml(), "again").unwrap(), model);
    // After its release it swings and comes to rest.
    let mut plant = Plant::new(&model, 1e-3, &Options::default()).unwrap();
    (0..6000).for_each(|_| plant.step(&[]));
    assert!(
        plant.is_finite() && plant.velocity(0).abs() < 1e-6 && plant.position(0).abs() > 0.01,
        "{} {}",
        plant.position(0),
        plant.velocity(0)
    );
}

#[test]
fn a_slide_is_told_in_metres_and_a_hinge_in_radians() {
    let mjcf = "<mujoco><worldbody><body name='a'><joint name='lift' type='slide'/><geom size='0.1'/><body name='b'><joint name='turn' axis='0 1 0' armature='2'/>\
                <geom size='0.1' pos='0.2 0 0'/></body></body></worldbody></mujoco>";
    let text = format!(
        "[robot]\nxml = \"\"\"{mjcf}\"\"\"\n[bodies]\nnut = 3\n[[elements]]\nname = 'screw'\nkind = 'spring'\nbetween = ['nut', 'lift']\nstiffness = 10\n\
         [[elements]]\nname = 'shaft'\nkind = 'spring'\nbetween = ['turn', 'ground']\nstiffness = 20\n"
    );
    let shown = describe(&Model::from_toml(&text, "mixed").unwrap(), &Operating::small());
    let units: Vec<&str> = shown.bodies.iter().map(|b| b.unit.as_str()).collect();
    assert_eq!(units, ["kg", "kg m²", "kg"]);
    let of = |name: &str| shown.elements.iter().find(|e| e.name == name).unwrap().parameters[0].unit.clone();
    assert_eq!((of("screw").as_str(), of("shaft").as_str()), ("N/m", "N m/rad"));
    assert_eq!(shown.robot.unwrap().joints[0].unit, "m");
    assert_names(&shown.diagram, &["[turn]", "2 kg m²"]);
}
