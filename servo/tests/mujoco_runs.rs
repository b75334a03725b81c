//! Exported servo joints run by MuJoCo from their commands, beside our free run: with a weight, drag, a limit and a delay, and at rest under a load.
//!
//! `BACKDRIVE_PYTHON` names a Python that has `tests/python/requirements.txt`. Without it the test is skipped, unless `BACKDRIVE_REQUIRE_PYTHON=1`.

#[path = "../../tests/common/naming.rs"]
mod naming;

#[path = "../../tests/common/python.rs"]
mod python;

use backdrive_export::mjcf;
use backdrive_plant::model::Model;
use backdrive_servo::gravity;
use backdrive_servo::record::Record;
use backdrive_servo::simulate::simulate;
use naming::assert_names;
use serde_json::{Value, json};
use std::path::Path;
use std::process::Command;

/// Substeps of our own run, at which it has converged.
const SUBSTEPS: usize = 40;

const ARM: &str = r#"<robot name="pendulum">
  <link name="base"/>
  <link name="upper"><inertial><origin xyz="0.1 0 0.02"/><mass value="0.4"/><inertia ixx="1e-4" iyy="8e-4" izz="8e-4" ixy="0" ixz="0" iyz="0"/></inertial></link>
  <joint name="lift" type="continuous"><parent link="base"/><child link="upper"/><axis xyz="0 1 0"/><origin xyz="0 0 0.1"/></joint>
</robot>"#;

fn moving(t: f64) -> f64 {
    let one = |a: f64, f: f64, p: f64| a * ((std::f64::consts::TAU * f * t + p).sin() - p.sin());
    one(0.3, 0.23, 0.4) + one(0.12, 0.71, 1.9) + one(0.04, 1.7, 0.2)
}

fn record(model: &Model, joint: &str, of: &dyn Fn(f64) -> f64, start: f64) -> Record {
    let t: Vec<f64> = (0..1000).map(|i| 0.02 * f64::from(i)).collect();
    let command: Vec<f64> = t.iter().map(|t| of(*t)).collect();
    let mut record = Record { name: joint.to_string(), position: vec![start; t.len()], t, command, gravity: Vec::new() };
    if let Some(arm) = &model.arm {
        record.gravity = gravity::columns(&arm.tree, &[&record.position], 0);
    }
    record.position = simulate(&model.servos.iter().find(|s| s.joint == joint).unwrap().numbers, &record, SUBSTEPS);
    record
}

fn case(folder: &Path, name: &str, model: &Model, records: &[Record], rests: &[&str]) -> Value {
    let exported = mjcf::export(model, None).unwrap();
    assert!(exported.left_out.iter().all(|left| !left.matters()), "{name}: {:?}", exported.left_out);
    std::fs::write(folder.join(format!("{name}.xml")), &exported.text).unwrap();
    let joint = |r: &Record| (r.name.clone(), json!({ "command": r.command, "position": r.position }));
    let joints: serde_json::Map<String, Value> = records.iter().map(joint).collect();
    json!({ "name": name, "t": records[0].t, "joints": joints, "rests": rests })
}

fn model(text: &str, folder: &Path) -> Model {
    let file = folder.join("model.toml");
    std::fs::write(&file, text).unwrap();
    Model::load(&file).unwrap()
}

const ALONE: &str = "name = 'alone'
[servo.elbow]\ndelay = 0.015\ninertia = 1.2e-3\ndamping = 0.07\noffset = 0.004\nfriction = 0.02\nmoment_cos = 0.05\nmoment_sin = -0.02
[servo.wrist]\ndelay = 0.02\ninertia = 8e-4\ndamping = 0.05\nratio = 1.02\nfriction = 0.01\nlimit = 0.06\ndrag = 0.004
[servo.held]\ninertia = 9e-4\ndamping = 0.06\nfriction = 0.05\nmoment_cos = 0.04\n";

const WEIGHED: &str = "name = 'weighed'\n[robot]\nfile = 'arm.urdf'\n
[servo.lift]\ndelay = 0.012\ninertia = 2e-3\ndamping = 0.08\noffset = 0.01\nfriction = 0.03\ngravity = 0.07\n";

#[test]
fn mujoco_moves_exported_servo_joints_as_we_do_to_two_percent_and_they_hold() {
    let Some(python) = python::python("that has tests/python/requirements.txt") else { return };
    let folder = tempfile::tempdir().unwrap();
    std::fs::write(folder.path().join("arm.urdf"), ARM).unwrap();
    let alone = model(ALONE, folder.path());
    let weighed = model(WEIGHED, folder.path());
    let records = [
        record(&alone, "elbow", &moving, 0.0),
        record(&alone, "wrist", &|t| 1.4 * moving(t + 0.3) - 1.4 * moving(0.3), 0.0),
        record(&alone, "held", &|_| 0.0, 0.0),
    ];
    let lift = [record(&weighed, "lift", &moving, 0.0)];
    let cases = [case(folder.path(), "alone", &alone, &records, &["held"]), case(folder.path(), "weighed", &weighed, &lift, &[])];
    std::fs::write(folder.path().join("cases.json"), serde_json::to_string(&cases).unwrap()).unwrap();
    let script = Path::new(env!("CARGO_MANIFEST_DIR")).join("../tests/python/servo_exports.py");
    let mut command = Command::new(python);
    let output = command.arg(script).arg(folder.path()).env("OMP_NUM_THREADS", "1").env("PYTHONDONTWRITEBYTECODE", "1").output().unwrap();
    println!("{}", String::from_utf8_lossy(&output.stdout));
    assert!(output.status.success(), "{}\n{}", String::from_utf8_lossy(&output.stdout), String::from_utf8_lossy(&output.stderr));
}

#[test]
fn what_mujoco_has_no_attribute_for_is_listed() {
    let folder = tempfile::tempdir().unwrap();
    let text = "name = 'all'\n[servo.a]\nfriction = 0.02\nfriction_at_rest = 0.01\ndead_band = 0.01\nspeed = 2.0\ndelay = -0.01\n";
    let exported = mjcf::export(&model(text, folder.path()), None).unwrap();
    let kinds: Vec<&str> = exported.left_out.iter().map(|l| l.kind.as_str()).collect();
    assert_eq!(kinds, ["delay", "friction_at_rest", "dead_band", "speed"]);
    assert!(exported.left_out.iter().all(backdrive_export::LeftOut::matters));
}

#[test]
fn a_robot_without_a_known_gain_is_written_joint_by_joint() {
    let folder = tempfile::tempdir().unwrap();
    std::fs::write(folder.path().join("arm.urdf"), ARM).unwrap();
    let exported = mjcf::export(&model(&WEIGHED.replace("gravity = 0.07", ""), folder.path()), None).unwrap();
    assert!(exported.left_out.iter().any(|l| l.kind == "links"), "{:?}", exported.left_out);
    assert!(!exported.text.contains("upper"), "{}", exported.text);
    assert_names(&exported.text, &["biasprm=\"0.01 -1 0\""]);
}
