//! Logs that differ from their description: each is reported in a sentence that names the column.

use crate::common::{AS_STATED, set};
use crate::naming::assert_names;
use backdrive_diagnosis::arms::audit::audit;
use backdrive_diagnosis::arms::diagnose::diagnose;
use backdrive_diagnosis::arms::problem::Problem;
use backdrive_diagnosis::arms::regression::Data;
use backdrive_diagnosis::options::Options;
use backdrive_plant::set::RecordingSet;

type Columns = [Vec<f64>; 7];

fn remarks(joints: &str, change: impl Fn(&mut Columns)) -> Vec<String> {
    let folder = tempfile::tempdir().unwrap();
    set(folder.path(), &AS_STATED, joints, change);
    let problem = Problem::open(&RecordingSet::open(folder.path()).unwrap(), None).unwrap();
    let data = Data::new(&problem, None, false).unwrap();
    audit(&problem, &data).iter().map(|r| format!("{}: {}", r.place, r.message)).collect()
}

fn refused(joints: &str, change: impl Fn(&mut Columns)) -> String {
    let folder = tempfile::tempdir().unwrap();
    set(folder.path(), &AS_STATED, joints, change);
    let set = match RecordingSet::open(folder.path()) {
        Ok(set) => set,
        Err(error) => return error.to_string(),
    };
    match Problem::open(&set, None) {
        Ok(problem) => diagnose(&problem, &Options::default(), None, &|_| ()).unwrap_err().to_string(),
        Err(error) => error.to_string(),
    }
}

fn says(all: &[String], words: &[&str]) -> bool {
    all.iter().any(|text| words.iter().all(|w| text.contains(w)))
}

#[test]
fn a_log_that_is_right_has_no_remark() {
    assert_eq!(remarks("", |_| {}), Vec::<String>::new());
}

#[test]
fn degrees_for_radians_are_told() {
    let all = remarks("", |c| c[1].iter_mut().for_each(|q| *q = q.to_degrees()));
    assert!(says(&all, &["shoulder.position", "looks like degrees", "unit = \"deg\""]), "{all:?}");
    // ... and read as such where the set states it.
    let joints = "[joints.shoulder]\nposition = { column = \"q1\", unit = \"deg\" }\ntorque = \"tau1\"\n[joints.elbow]\nposition = \"q2\"\ntorque = \"tau2\"\n";
    assert_eq!(remarks(joints, |c| c[1].iter_mut().for_each(|q| *q = q.to_degrees())), Vec::<String>::new());
}

#[test]
fn a_torque_of_the_opposite_sign_is_told() {
    let all = remarks("", |c| c[5].iter_mut().for_each(|t| *t = -*t));
    assert!(says(&all, &["shoulder.torque", "opposite sign"]), "{all:?}");
}

#[test]
fn swapped_columns_are_told() {
    let all = remarks("", |c| c.swap(1, 2));
    assert!(says(&all, &["shoulder", "elbow", "swapped"]), "positions: {all:?}");
}

#[test]
fn a_velocity_that_is_none_is_told() {
    let turned = remarks("", |c| c[4].iter_mut().for_each(|v| *v = -*v));
    assert!(says(&turned, &["elbow.velocity", "opposite sign of the derivative"]), "{turned:?}");
    let in_degrees = remarks("", |c| c[4].iter_mut().for_each(|v| *v = v.to_degrees()));
    assert!(says(&in_degrees, &["elbow.velocity", "57.", "another unit"]), "{in_degrees:?}");
    let other = remarks("", |c| c[4] = c[3].clone());
    assert!(says(&other, &["elbow.velocity", "not the derivative"]), "{other:?}");
}

#[test]
fn a_joint_that_never_moves_is_refused() {
    let text = refused("", |c| c[2].fill(0.3));
    assert_names(&text, &["elbow.position"]);
}

#[test]
fn what_a_set_says_of_joints_is_checked() {
    let unknown = refused("[joints.wrist]\nposition = \"q1\"\ntorque = \"tau1\"\n", |_| {});
    assert_names(&unknown, &["[joints.wrist]", "shoulder, elbow"]);
    let missing = refused("[joints.shoulder]\nposition = \"q1\"\ntorque = \"tau1\"\n", |_| {});
    assert_names(&missing, &["\"elbow\""]);
    let misspelt = refused("[joints.shoulder]\npositoin = \"q1\"\ntorque = \"tau1\"\n", |_| {});
    assert_names(&misspelt, &["\"position\""]);
    let constant = refused("[joints.shoulder]\nposition = \"q1\"\ncurrent = \"tau1\"\n", |_| {});
    assert_names(&constant, &["torque_constant"]);
    let unit = refused(
        "[joints.shoulder]\nposition = { column = \"q1\", unit = \"mm\" }\ntorque = \"tau1\"\n[joints.elbow]\nposition = \"q2\"\ntorque = \"tau2\"\n",
        |_| {},
    );
    assert_names(&unit, &["shoulder.position", "rad"]);
}

#[test]
fn a_current_times_its_constant_is_a_torque() {
    let joints = "[joints.shoulder]\nposition = \"q1\"\ncurrent = \"tau1\"\ntorque_constant = 0.5\n[joints.elbow]\nposition = \"q2\"\ntorque = \"tau2\"\n";
    assert_eq!(remarks(joints, |c| c[5].iter_mut().for_each(|t| *t *= 2.0)), Vec::<String>::new());
}
