//! Feed-forward snippets against our laws, and joints as URDF and for Isaac.

#[path = "../../tests/common/naming.rs"]
mod naming;

#[path = "../../tests/common/python.rs"]
mod python;

use backdrive_export::feedforward::{Language, export};
use backdrive_export::{Part, change_all, isaac, mjcf, urdf};
use backdrive_plant::elements::{Role, Rubbing, Side};
use backdrive_plant::model::Model;
use naming::assert_names;
use python::skipped::skipped;
use std::path::Path;
use std::process::Command;

fn model(text: &str) -> Model {
    Model::from_toml(text, "model.toml").unwrap_or_else(|e| panic!("{e}\n{text}"))
}

/// Every kind that is a function of position, velocity and load; on `b` turned round.
fn all_kinds() -> Model {
    let kinds = [
        "kind = 'coulomb'\nforce = 0.3",
        "kind = 'asymmetric_coulomb'\npositive = 0.3\nnegative = 0.2",
        "kind = 'stribeck'\ncoulomb = 0.4\nstatic = 0.7\nvelocity = 0.05",
        "kind = 'friction_deficit'\ncoulomb = 0.4\nrest = 0.1\nvelocity = 0.06",
        "kind = 'load_friction'\nforce = 0.1\ncoefficient = 0.07",
        "kind = 'gear_loss'\nefficiency = 0.8\nback_efficiency = 0.6",
        "kind = 'damper'\ndamping = 1.7",
        "kind = 'asymmetric_damper'\npositive = 1.2\nnegative = 0.8",
        "kind = 'quadratic_drag'\ncoefficient = 2.5",
        "kind = 'spring'\nstiffness = 11\nrest = 0.02",
        "kind = 'cubic_spring'\nstiffness = 3\ncubic = 80",
        "kind = 'cogging'\namplitude = 0.2\nperiod = 0.03\nphase = 0.4",
        "kind = 'bias'\nforce = 0.9",
    ];
    let mut text = "name = 'all kinds'\ntitle = 'A test */ \"of\" all'\n[bodies]\na = 1\nb = 1\n".to_string();
    for (between, body) in [("['a', 'ground']", "a"), ("['ground', 'b']", "b")] {
        for (i, kind) in kinds.iter().enumerate() {
            text += &format!("[[elements]]\nname = '{body}{i}'\nbetween = {between}\n{kind}\n");
        }
    }
    model(&text)
}

/// What all elements of a body push against it with at `q` and `dq`, by their laws.
fn by_the_laws(model: &Model, body: usize, q: f64, dq: f64, load: f64) -> f64 {
    let of = |element: &backdrive_plant::model::Element| {
        let sign = match element.between {
            [Some(b), None] if b == body => 1.0,
            [None, Some(b)] if b == body => -1.0,
            _ => return 0.0,
        };
        let (x, v) = (sign * q, sign * dq);
        let force = match element.law.role() {
            Role::Linear(linear) => linear.stiffness * x + linear.damping * v + linear.force,
            Role::Friction => {
                // The load is positive where it resists the contact's own forwards.
                let at = Rubbing { side: Side::of(v), speed: Some(v), load: sign * load, memory: &[] };
                v.signum() * element.law.level(&at)
            }
            Role::Path => element.law.force(&[], x, v),
        };
        sign * force
    };
    model.elements.iter().map(of).sum()
}

/// Points away from where the smooth sign is not yet one.
fn points() -> Vec<[f64; 3]> {
    let mut all = Vec::new();
    for q in [-0.11, 0.0, 0.013, 0.2] {
        for dq in [-1.3, -0.08, -0.021, 0.0205, 0.05, 0.7] {
            for load in [-2.0, 0.0, 5.0] {
                all.push([q, dq, load]);
            }
        }
    }
    all
}

/// Efforts that a program prints, a line for each point, against the laws.
fn compare(what: &str, model: &Model, printed: &str) {
    let found: Vec<[f64; 2]> = printed
        .lines()
        .map(|line| {
            let numbers: Vec<f64> = line.split_whitespace().map(|n| n.parse().unwrap()).collect();
            [numbers[0], numbers[1]]
        })
        .collect();
    assert_eq!(found.len(), points().len());
    let mut worst = 0.0f64;
    for ([q, dq, load], found) in points().into_iter().zip(found) {
        for body in 0..2 {
            let expected = by_the_laws(model, body, q, dq, load);
            worst = worst.max((found[body] - expected).abs() / expected.abs().max(1.0));
        }
    }
    println!("{what}: largest difference from the laws {worst:.1e}, at {} points", points().len());
    assert!(worst < 1e-14, "{what}: {worst}");
}

#[test]
fn the_c_snippet_is_our_law_outside_of_the_smooth_signs_width() {
    let model = all_kinds();
    let snippet = export(&model, Language::C, Some(1e-3)).unwrap();
    assert!(snippet.left_out.is_empty(), "{:?}", snippet.left_out);
    let folder = tempfile::tempdir().unwrap();
    let path = |name: &str| folder.path().join(name);
    let calls: String = points()
        .iter()
        .map(|[q, dq, load]| {
            let arguments = format!("{q:?}, {dq:?}, {load:?}");
            format!("    printf(\"%.17g %.17g\\n\", all_kinds_a({arguments}), all_kinds_b({arguments}));\n")
        })
        .collect();
    std::fs::write(path("a.c"), format!("{}\n#include <stdio.h>\nint main(void)\n{{\n{calls}    return 0;\n}}\n", snippet.text)).unwrap();
    let compiled =
        Command::new("cc").args(["-std=c99", "-Wall", "-Wextra", "-Werror", "-o"]).args([path("a"), path("a.c")]).arg("-lm").output();
    let compiled = match compiled {
        Ok(output) => output,
        Err(error) => return skipped(format_args!("there is no cc: {error}")),
    };
    assert!(compiled.status.success(), "{}\n{}", String::from_utf8_lossy(&compiled.stderr), snippet.text);
    let ran = Command::new(path("a")).output().unwrap();
    compare("C", &model, &String::from_utf8(ran.stdout).unwrap());
}

#[test]
fn the_python_snippet_is_our_law_too() {
    let Some(python) = python::python("3") else { return };
    let model = all_kinds();
    let snippet = export(&model, Language::Python, Some(1e-3)).unwrap();
    let calls: String = points().iter().map(|p| format!("print(repr(all_kinds_a(*{p:?})), repr(all_kinds_b(*{p:?})))\n")).collect();
    let ran = Command::new(python).arg("-c").arg(format!("{}\n{calls}", snippet.text)).output().unwrap();
    assert!(ran.status.success(), "{}\n{}", String::from_utf8_lossy(&ran.stderr), snippet.text);
    compare("Python", &model, &String::from_utf8(ran.stdout).unwrap());
}

#[test]
fn yaml_has_every_term_with_its_equation_and_its_numbers() {
    let yaml = export(&all_kinds(), Language::Yaml, None).unwrap().text;
    assert_eq!(yaml.matches("- term:").count(), 2 * 14, "load friction is two");
    for line in
        ["model: \"all kinds\"", "  \"a\":", "    effort_unit: \"N\"", "    width: 0.001", "        velocity: 0.05", "        term: "]
    {
        assert!(yaml.contains(line) || line.contains("term: "), "{line}\n{yaml}");
    }
    assert!(
        yaml.contains(
            "        element: \"a11\"\n        kind: cogging\n        equation: \"amplitude * sin(2 * pi * q / period + phase)\"\n"
        ),
        "{yaml}"
    );
}

#[test]
fn the_smooth_sign_is_narrow_against_the_stribeck_velocity() {
    let width = |velocity: f64, motion: &str| {
        let text = format!(
            "motion = '{motion}'\n[bodies]\na = 1\n[[elements]]\nname = 'e'\nkind = 'stribeck'\nbetween = ['a', 'ground']\ncoulomb = 1\nstatic = 2\nvelocity = {velocity}\n"
        );
        let text = export(&model(&text), Language::Yaml, None).unwrap().text;
        text.lines().find_map(|l| l.strip_prefix("    width: ").map(|w| w.parse::<f64>().unwrap())).unwrap()
    };
    assert_eq!((width(0.05, "translation"), width(0.001, "translation"), width(0.5, "rotation")), (1e-3, 2e-4, 1e-2));
}

#[test]
fn what_a_controller_cannot_take_off_is_told() {
    let model = model(
        "[bodies]\na = 1\nb = 1\n[[elements]]\nname = 'cable'\nkind = 'spring'\nbetween = ['a', 'b']\nstiffness = 9\n\
         [[elements]]\nname = 'guide'\nkind = 'coulomb'\nbetween = ['a', 'b']\nforce = 1\n\
         [[elements]]\nname = 'bristles'\nkind = 'lugre'\nbetween = ['a', 'ground']\nstiffness = 900\ndamping = 1\ncoulomb = 1\nstatic = 2\nvelocity = 0.1\n\
         [[elements]]\nname = 'wall'\nkind = 'contact'\nbetween = ['b', 'ground']\nstiffness = 900\n",
    );
    let found = export(&model, Language::C, None).unwrap();
    let told: Vec<(&str, bool)> = found.left_out.iter().map(|l| (l.name.as_str(), l.instead.is_some())).collect();
    assert_eq!(told, [("guide", false), ("bristles", true), ("wall", false)]);
    assert_names(&found.text, &["1.0 + 1.0 * exp"]);
    assert_eq!(change_all(&model, &found.left_out).elements[2].law.kind().name, "stribeck");
    let nothing = self::model("[bodies]\na = 1\n");
    assert_names(export(&nothing, Language::C, None).unwrap_err().to_string(), &["nothing to compensate"]);
}

const URDF: &str = r#"<?xml version="1.0"?>
<robot name="arm">
  <!-- kept -->
  <link name="base"/>
  <link name="upper"><visual><geometry><mesh filename="package://arm/upper.stl"/></geometry></visual>
    <inertial><origin xyz="0.1 0 0"/><mass value="2"/><inertia ixx="0.1" ixy="0" ixz="0" iyy="0.1" iyz="0" izz="0.1"/></inertial></link>
  <link name="fore"><inertial><mass value="1"/><inertia ixx="0.1" ixy="0" ixz="0" iyy="0.1" iyz="0" izz="0.1"/></inertial></link>
  <joint name="shoulder" type="revolute"><parent link="base"/><child link="upper"/><axis xyz="0 1 0"/>
    <limit lower="-1" upper="1" effort="50" velocity="3"/><dynamics damping="0.1" friction='0.2'/></joint>
  <joint name="elbow" type="continuous">
    <parent link="upper"/><child link="fore"/><axis xyz="0 1 0"/>
  </joint>
</robot>
"#;

fn diagnosed() -> Model {
    model(&format!(
        "name = 'arm'\n[robot]\nxml = '''{URDF}'''\n[bodies]\nshoulder = 0.02\nrotor = 0.03\n\
         [[elements]]\nname = 'shoulder_more'\nkind = 'damper'\nbetween = ['shoulder', 'ground']\ndamping = 0.4\n\
         [[elements]]\nname = 'gear'\nkind = 'spring'\nbetween = ['rotor', 'elbow']\nstiffness = 900\n\
         [[elements]]\nname = 'bearing'\nkind = 'stribeck'\nbetween = ['rotor', 'ground']\ncoulomb = 0.3\nstatic = 0.5\nvelocity = 0.2\n\
         [[elements]]\nname = 'spring'\nkind = 'spring'\nbetween = ['elbow', 'ground']\nstiffness = 4\n\
         [[inputs]]\nname = 'motor'\nkind = 'force'\non = 'rotor'\ndelay = 0.002\nsaturation = 7\nback_emf = 0.05\n\
         [[inputs]]\nname = 'other'\nkind = 'force'\non = 'shoulder'\nsaturation = 20\n\
         [[outputs]]\nname = 'angle'\nkind = 'position'\nof = 'elbow'\n"
    ))
}

#[test]
fn a_urdf_keeps_all_that_is_not_its_joints_dynamics() {
    let found = urdf::export(&diagnosed()).unwrap();
    let expected = URDF.replace("effort=\"50\"", "effort=\"20\"").replace("damping=\"0.1\"", "damping=\"0.5\"").replace(
        "<axis xyz=\"0 1 0\"/>\n  </joint>",
        "<axis xyz=\"0 1 0\"/>\n    <dynamics damping=\"0.05\" friction=\"0.3\"/>\n  </joint>",
    );
    assert_eq!(found.text, expected);
    let told: Vec<(Part, &str, &str)> = found.left_out.iter().map(|l| (l.part, l.name.as_str(), l.kind.as_str())).collect();
    let wanted = [
        (Part::Body, "rotor", "compliance"),
        (Part::Element, "bearing", "stribeck"),
        (Part::Element, "spring", "spring"),
        (Part::Body, "shoulder", "armature"),
        (Part::Body, "elbow", "armature"),
        (Part::Input, "motor", "delay"),
    ];
    assert_eq!(told, wanted);
    // The joined model moves as one, with the rotor on its joint, and can be simulated.
    let joined = change_all(&diagnosed(), &found.left_out[..1]);
    let elbow = joined.bodies.iter().position(|b| b.name == "elbow").unwrap();
    assert_eq!((joined.bodies[elbow].inertia, joined.inputs[0].on), (0.03, elbow));
    for left in &found.left_out {
        let mut changed = diagnosed();
        left.changes.iter().for_each(|change| change.apply(&mut changed));
        assert!(backdrive_plant::stepper::Plant::new(&changed, 1e-3, &Default::default()).is_ok(), "{left:?}");
    }
}

#[test]
fn an_mjcf_robot_becomes_a_urdf_that_is_the_same_tree() {
    let xml = "<mujoco model='m'><compiler angle='radian'/><worldbody><body name='a' pos='0 0 1' euler='0.3 0.1 0.2'>\
               <joint name='j' axis='0 1 1' ref='0.4' damping='0.2'/><geom type='capsule' fromto='0 0 0 0.3 0.1 0' size='0.03'/>\
               <body name='b' pos='0.3 0 0'><joint name='k' type='slide' axis='1 0 0' ref='0.1' range='-1 1' frictionloss='2'/>\
               <geom type='box' size='0.1 0.05 0.02'/></body></body></worldbody></mujoco>";
    let model = model(&format!("[robot]\nxml = \"{xml}\"\n"));
    let text = urdf::export(&model).unwrap().text;
    let tree =
        |text: &str| backdrive_plant::robot::Tree::new(&backdrive_plant::robot::RobotFile::from_xml(text, "r").unwrap().robot).unwrap();
    let (ours, theirs) = (tree(xml), tree(&text));
    let torques = |tree: &backdrive_plant::robot::Tree| {
        let mut out = [0.0; 2];
        tree.inverse_dynamics(&[0.7, -0.2], &[1.0, 2.0], &[3.0, -1.0], &mut tree.workspace(), &mut out);
        out
    };
    let (a, b) = (torques(&ours), torques(&theirs));
    assert!((a[0] - b[0]).abs() < 1e-9 && (a[1] - b[1]).abs() < 1e-9, "{a:?} {b:?}\n{text}");
    for part in [
        "<dynamics damping=\"0.2\" friction=\"0\"/>",
        "<dynamics damping=\"0\" friction=\"2\"/>",
        "type=\"continuous\"",
        "lower=\"-1\" upper=\"1\"",
    ] {
        assert!(text.contains(part), "{part}\n{text}");
    }
}

#[test]
fn isaac_gets_efforts_of_friction_at_rest_and_in_motion() {
    let found = isaac::export(&diagnosed()).unwrap();
    for part in [
        "joint_names_expr=[\"shoulder\", \"elbow\"]",
        "    armature={\n        \"shoulder\": 0.02,\n        \"elbow\": 0.03,\n    },\n",
        "    friction={\n        \"shoulder\": 0.2,\n        \"elbow\": 0.5,\n    },\n",
        "    dynamic_friction={\n        \"shoulder\": 0.2,\n        \"elbow\": 0.3,\n    },\n",
        "    viscous_friction={\n        \"shoulder\": 0.5,\n        \"elbow\": 0.05,\n    },\n",
        "    effort_limit_sim={\n        \"shoulder\": 20.0,\n        \"elbow\": 7.0,\n    },\n",
        "    velocity_limit_sim={\n        \"shoulder\": 3.0,\n    },\n",
        "    stiffness=0.0,\n    damping=0.0,\n",
    ] {
        assert!(found.text.contains(part), "{part}\n{}", found.text);
    }
    let told: Vec<&str> = found.left_out.iter().map(|l| l.name.as_str()).collect();
    assert_eq!(told, ["rotor", "bearing", "spring", "motor"]);
    assert_names(&found.left_out[3].why, &["DelayedPDActuatorCfg"]);
    if let Some(python) = python::python("3") {
        let checked = Command::new(python).args(["-c", "import ast, sys; ast.parse(sys.argv[1])", &found.text]).output().unwrap();
        assert!(checked.status.success(), "{}\n{}", String::from_utf8_lossy(&checked.stderr), found.text);
    }
}

#[test]
fn what_is_no_robot_is_no_urdf_and_nothing_for_isaac() {
    let axis = model("[bodies]\na = 1\n");
    assert_names(urdf::export(&axis).unwrap_err().to_string(), &["[robot]"]);
    assert_names(isaac::export(&axis).unwrap_err().to_string(), &["[robot]"]);
}

#[test]
fn every_model_of_the_project_can_be_exported() {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("../plant/models");
    for entry in std::fs::read_dir(folder).unwrap() {
        let path = entry.unwrap().path();
        if path.extension().is_none_or(|e| e != "toml") {
            continue;
        }
        let model = Model::load(&path).unwrap_or_else(|e| panic!("{e}"));
        let found = mjcf::export(&model, None).unwrap_or_else(|e| panic!("{}: {e}", path.display()));
        roxmltree::Document::parse(&found.text).unwrap();
        for left in &found.left_out {
            println!("{}: {} ({}): {}", model.name, left.name, left.kind, left.why);
        }
        let _ = export(&model, Language::C, None);
    }
}
