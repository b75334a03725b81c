//! Exported models run by MuJoCo for 10 s, beside our own simulation of them.
//!
//! `BACKDRIVE_PYTHON` names a Python that has `tests/python/requirements.txt`. Without it the test is skipped, unless `BACKDRIVE_REQUIRE_PYTHON=1`.

#[path = "../../tests/common/python.rs"]
mod python;

use backdrive_export::mjcf;
use backdrive_plant::model::{Input, InputKind, Model, OutputKind};
use backdrive_plant::stepper::{Options, simulate};
use serde_json::{Map, Value, json};
use std::path::Path;
use std::process::Command;

const PERIOD: f64 = 1e-3;
const SECONDS: f64 = 10.0;
/// Substeps of our own solution, at which it has converged.
const SUBSTEPS: usize = 20;

/// Tones with an amplitude, those of each input with another phase.
fn tones(input: usize, amplitude: f64) -> Vec<f64> {
    let count = (SECONDS / PERIOD) as usize;
    let tone = |t: f64, hz: f64, phase: f64| (2.0 * std::f64::consts::PI * hz * t + phase).sin() - phase.sin();
    let at = |i: usize| {
        let (t, phase) = (PERIOD * i as f64, 0.7 * input as f64);
        amplitude * (tone(t, 0.37, phase) + 0.7 * tone(t, 1.3, 2.0 * phase) + 0.4 * tone(t, 4.1, phase)) * (t / 0.2).min(1.0)
    };
    (0..count).map(at).collect()
}

/// Exports a model and works out what it does; its inputs have these amplitudes.
fn case(folder: &Path, name: &str, text: &str, amplitudes: &[f64]) -> Value {
    let model = Model::from_toml(text, name).unwrap_or_else(|e| panic!("{e}\n{text}"));
    let exported = mjcf::export(&model, None).unwrap();
    assert!(exported.left_out.iter().all(|left| left.kind == "motion" || !left.matters()), "{name}: {:?}", exported.left_out);
    std::fs::write(folder.join(format!("{name}.xml")), &exported.text).unwrap();
    assert_eq!(amplitudes.len(), model.inputs.len(), "{name}");
    let drives: Vec<Vec<f64>> = amplitudes.iter().enumerate().map(|(i, a)| tones(i, *a)).collect();
    let drives: Vec<&[f64]> = drives.iter().map(Vec::as_slice).collect();
    let found = simulate(&model, &drives, PERIOD, &Options { substeps: Some(SUBSTEPS), ..Options::default() }).unwrap();
    let of_kind = |kind: InputKind, name: &dyn Fn(&Input) -> String| -> Map<String, Value> {
        model.inputs.iter().zip(&drives).filter(|(i, _)| i.kind == kind).map(|(i, d)| (name(i), json!(d))).collect()
    };
    let named = |names: Vec<&String>, columns: Vec<Value>| -> Map<String, Value> { names.into_iter().cloned().zip(columns).collect() };
    json!({
        "name": name,
        "period": PERIOD,
        "inputs": of_kind(InputKind::Force, &|input| input.name.clone()),
        "led": of_kind(InputKind::Motion, &|input| model.bodies[input.on].name.clone()),
        "outputs": named(model.outputs.iter().map(|o| &o.name).collect(), found.iter().map(|f| json!(f)).collect()),
        // A sensor reads a joint's coordinate, which the pose has moved.
        "from_zero": model.outputs.iter().filter(|o| matches!(o.kind, OutputKind::Position(_))).map(|o| &o.name).collect::<Vec<_>>(),
    })
}

fn outputs(bodies: &[&str]) -> String {
    bodies.iter().map(|b| format!("[[outputs]]\nname = 'x_{b}'\nkind = 'position'\nof = '{b}'\n")).collect()
}

fn element(kind: &str, between: [&str; 2], parameters: &str) -> String {
    format!("[[elements]]\nkind = '{kind}'\nbetween = ['{}', '{}']\n{parameters}\n", between[0], between[1])
}

fn force(name: &str, on: &str, more: &str) -> String {
    format!("[[inputs]]\nname = '{name}'\nkind = 'force'\non = '{on}'\n{more}\n")
}

/// Linear elements of every kind, with all that an actuator and a sensor can do.
fn linear() -> String {
    "[bodies]\na = 0.3\nb = 0.8\nc = 0.2\n".to_string()
        + &element("spring", ["a", "b"], "stiffness = 400\nrest = 0.01")
        + &element("damper", ["a", "b"], "damping = 0.4")
        + &element("spring", ["b", "ground"], "stiffness = 90\nrest = -0.02")
        + &element("damper", ["ground", "b"], "damping = 1.1")
        + &element("inerter", ["b", "c"], "inertance = 0.15")
        + &element("spring", ["c", "b"], "stiffness = 250")
        + &element("damper", ["c", "ground"], "damping = 0.6")
        + &element("bias", ["a", "ground"], "force = 0.4")
        + &force("slow", "a", "gain = -0.8\ndelay = 0.0043\nbandwidth = 6\nback_emf = 0.7")
        + &force("limited", "c", "saturation = 1.2\ndelay = 0.002")
        + &outputs(&["a", "b", "c"])
        + "[[outputs]]\nname = 'v_c'\nkind = 'velocity'\nof = 'c'\ndelay = 0.003\n"
}

/// A hand that moves what it holds.
fn held() -> String {
    "[bodies]\nhandle = 0.3\nhand = 0\n".to_string()
        + &element("spring", ["handle", "hand"], "stiffness = 200")
        + &element("damper", ["handle", "hand"], "damping = 3")
        + &element("coulomb", ["handle", "ground"], "force = 0.4")
        + "[[inputs]]\nname = 'intent'\nkind = 'motion'\non = 'hand'\nhold = 'linear'\n"
        + &force("push", "handle", "")
        + &outputs(&["handle"])
}

/// Dry friction to ground and between bodies.
fn rubbing() -> String {
    "[bodies]\na = 0.3\nb = 0.8\n".to_string()
        + &element("spring", ["a", "b"], "stiffness = 300")
        + &element("damper", ["a", "b"], "damping = 2")
        + &element("coulomb", ["a", "b"], "force = 0.3")
        + &element("asymmetric_coulomb", ["b", "ground"], "positive = 0.9\nnegative = 0.4")
        + &element("spring", ["b", "ground"], "stiffness = 60")
        + &element("damper", ["b", "ground"], "damping = 0.5")
        + &force("push", "a", "")
        + &outputs(&["a", "b"])
}

/// Springs that are not in proportion, drag, dead bands and sliders.
fn bent() -> String {
    "motion = 'rotation'\n[bodies]\na = 0.02\nb = 0.05\n".to_string()
        + &element("backlash", ["a", "b"], "gap = 0.05\nstiffness = 60")
        + &element("damper", ["a", "b"], "damping = 0.05")
        + &element("cubic_spring", ["b", "ground"], "stiffness = 4\ncubic = 30")
        + &element("quadratic_drag", ["b", "ground"], "coefficient = 0.05")
        + &element("damper", ["b", "ground"], "damping = 0.08")
        + &element("damper", ["a", "ground"], "damping = 0.05")
        + &element("maxwell_slip", ["b", "ground"], "stiffness = [20, 8, 3]\nforce = [0.1, 0.2, 0.3]")
        + &element("contact", ["b", "ground"], "stiffness = 80\ngap = 0.12")
        + &element("hunt_crossley", ["ground", "b"], "stiffness = 900\nexponent = 2\ngap = 0.1")
        + &force("torque", "a", "")
        + &outputs(&["a", "b"])
}

const TWO: &str = r#"<robot name="two"><link name="base"/>
<link name="upper"><inertial><origin xyz="0.15 0 0"/><mass value="2"/><inertia ixx="0.002" ixy="0" ixz="0" iyy="0.02" iyz="0" izz="0.02"/></inertial></link>
<link name="fore"><inertial><origin xyz="0.12 0.02 0"/><mass value="1"/><inertia ixx="0.001" ixy="0" ixz="0" iyy="0.008" iyz="0" izz="0.008"/></inertial></link>
<joint name="shoulder" type="revolute"><parent link="base"/><child link="upper"/><origin xyz="0 0 0.4"/><axis xyz="0 1 0"/>
  <limit lower="-3" upper="3" effort="80" velocity="9"/><dynamics damping="1.5" friction="0.8"/></joint>
<joint name="elbow" type="continuous"><parent link="upper"/><child link="fore"/><origin xyz="0.3 0 0" rpy="0.4 0 0"/><axis xyz="0 1 0"/>
  <dynamics damping="0.6" friction="0.3"/></joint></robot>"#;

/// Two joints with armature, damping, friction and springs.
fn two_joints() -> String {
    format!("[robot]\nxml = '''{TWO}'''\npose = {{ shoulder = 0.4, elbow = 0.9 }}\n[bodies]\nshoulder = 0.15\nelbow = 0.06\n")
        + &element("spring", ["shoulder", "ground"], "stiffness = 18\nrest = -0.2")
        + &element("spring", ["elbow", "ground"], "stiffness = 6")
        + &force("m0", "shoulder", "gain = 3")
        + &force("m1", "elbow", "delay = 0.004")
        + &outputs(&["shoulder", "elbow"])
}

const THREE: &str = r#"<mujoco model="three"><compiler angle="degree"/>
<default><joint damping="0.4" armature="0.02"/><motor ctrlrange="-1 1"/></default>
<option gravity="0 0 -9.81"/>
<worldbody><body name="l0" pos="0 0 0.5">
  <joint name="j0" axis="0 0 1"/><geom type="capsule" fromto="0 0 0 0.25 0 0" size="0.04"/>
  <body name="l1" pos="0.25 0 0"><joint name="j1" axis="0 1 0" stiffness="12" springref="-20" ref="10"/><geom type="capsule" fromto="0 0 0 0.25 0 0.05" size="0.03"/>
    <body name="l2" pos="0.25 0 0.05" euler="0 30 0"><joint name="j2" type="slide" axis="1 0 0" range="-0.5 0.5" limited="false"/>
      <geom type="box" size="0.1 0.03 0.03"/></body></body></body></worldbody>
<actuator><motor joint="j0"/></actuator></mujoco>"#;

/// Three joints, two of them behind soft gears, with friction on either side; or none.
fn three_joints(friction: bool) -> String {
    let mut text = format!("[robot]\nxml = '''{THREE}'''\n[bodies]\nr0 = 0.05\nr1 = 0.03\n");
    for (rotor, joint) in [("r0", "j0"), ("r1", "j1")] {
        text += &element("spring", [rotor, joint], "stiffness = 300");
        text += &element("damper", [rotor, joint], "damping = 0.6");
        text += &element("damper", [rotor, "ground"], "damping = 0.3");
        if friction {
            text += &element("coulomb", [rotor, "ground"], "force = 0.5");
            text += &element("coulomb", [joint, "ground"], "force = 0.3");
        }
    }
    text += &element("spring", ["j2", "ground"], "stiffness = 150");
    text += &element("damper", ["j2", "ground"], "damping = 6");
    text + &force("m0", "r0", "") + &force("m1", "r1", "saturation = 4") + &force("m2", "j2", "") + &outputs(&["j0", "j1", "j2", "r0"])
}

#[test]
fn mujoco_moves_exported_models_as_we_do_to_one_percent() {
    let Some(python) = python::python("that has tests/python/requirements.txt") else { return };
    let folder = tempfile::tempdir().unwrap();
    let file = |path: &str| std::fs::read_to_string(Path::new(env!("CARGO_MANIFEST_DIR")).join("..").join(path)).unwrap();
    let cases = [
        case(folder.path(), "linear", &linear(), &[1.0, 1.0]),
        case(folder.path(), "rubbing", &rubbing(), &[2.0]),
        case(folder.path(), "held", &held(), &[0.02, 0.5]),
        case(folder.path(), "chain", &file("benches/mujoco_chain/chain.toml"), &[2.0]),
        case(folder.path(), "bent", &bent(), &[0.9]),
        case(folder.path(), "two-joints", &two_joints(), &[2.0, 3.0]),
        case(folder.path(), "three-joints", &three_joints(false), &[2.0, 3.0, 15.0]),
        case(folder.path(), "three-joints-rubbing", &three_joints(true), &[2.0, 3.0, 15.0]),
    ];
    std::fs::write(folder.path().join("cases.json"), serde_json::to_string(&cases).unwrap()).unwrap();
    let script = Path::new(env!("CARGO_MANIFEST_DIR")).join("../tests/python/exported_models.py");
    let mut command = Command::new(python);
    let output = command.arg(script).arg(folder.path()).env("OMP_NUM_THREADS", "1").env("PYTHONDONTWRITEBYTECODE", "1").output().unwrap();
    println!("{}", String::from_utf8_lossy(&output.stdout));
    assert!(output.status.success(), "{}\n{}", String::from_utf8_lossy(&output.stdout), String::from_utf8_lossy(&output.stderr));
}
