//! Random trees read from URDF and MJCF, against what Pinocchio and MuJoCo make of the same files.
//!
//! `BACKDRIVE_PYTHON` names a Python that has `tests/python/requirements.txt`. Without it the test is skipped, unless `BACKDRIVE_REQUIRE_PYTHON=1`.

#[path = "../../tests/common/python.rs"]
mod python;
mod robot_common;

use backdrive_plant::robot::{RobotFile, Tree};
use python::python;
use robot_common::{mass_matrix, share};
use serde::Deserialize;
use std::path::Path;
use std::process::Command;

#[derive(Deserialize)]
struct Case {
    file: String,
    tool: String,
    joints: Vec<String>,
    last: String,
    q: Vec<f64>,
    v: Vec<f64>,
    a: Vec<f64>,
    tau: Vec<f64>,
    inverse: Vec<f64>,
    forward: Vec<f64>,
    mass: Vec<Vec<f64>>,
    kinetic: f64,
    potential: f64,
    tip: Tip,
}

#[derive(Deserialize)]
struct Tip {
    rotation: [[f64; 3]; 3],
    translation: [f64; 3],
}

/// The greatest of what was found in one respect.
#[derive(Default)]
struct Worst([f64; 6]);

const RESPECTS: [&str; 6] = ["inverse", "forward", "mass", "kinetic", "potential", "tip"];
/// Largest differences, as shares (of the tip: m, and of a unit vector).
const LIMITS: [f64; 6] = [1e-11; 6];

fn compare(case: &Case, folder: &Path) -> [f64; 6] {
    let file = RobotFile::load(&folder.join(&case.file)).unwrap_or_else(|e| panic!("{e}"));
    let tree = Tree::new(&file.robot).unwrap();
    assert_eq!(tree.len(), case.joints.len(), "{}", case.file);
    // Theirs by our order.
    let theirs: Vec<usize> = tree.coordinates().iter().map(|c| case.joints.iter().position(|name| *name == c.name).unwrap()).collect();
    let ours = |values: &[f64]| -> Vec<f64> { theirs.iter().map(|i| values[*i]).collect() };
    let [q, v, a, tau] = [&case.q, &case.v, &case.a, &case.tau].map(|values| ours(values));
    let mut work = tree.workspace();
    let (mut inverse, mut forward) = (vec![0.0; tree.len()], vec![0.0; tree.len()]);
    tree.inverse_dynamics(&q, &v, &a, &mut work, &mut inverse);
    tree.forward_dynamics(&q, &v, &tau, &mut work, &mut forward);
    let mass: Vec<f64> = theirs.iter().flat_map(|i| theirs.iter().map(|j| case.mass[*i][*j])).collect();
    let apart = |found: f64, expected: f64| (found - expected).abs() / expected.abs().max(1.0);
    tree.place(&q, &mut work);
    let tip = tree.link_placement(file.robot.link(&case.last).unwrap(), &work).unwrap();
    let turned = (0..3).flat_map(|i| (0..3).map(move |j| (i, j))).map(|(i, j)| (tip.rotation[(i, j)] - case.tip.rotation[i][j]).abs());
    let moved = (0..3).map(|i| (tip.translation[i] - case.tip.translation[i]).abs());
    [
        share(&inverse, &ours(&case.inverse)),
        share(&forward, &ours(&case.forward)),
        share(mass_matrix(&tree, &q).as_slice(), &mass),
        apart(tree.kinetic_energy(&q, &v, &mut work), case.kinetic),
        apart(tree.potential_energy(&q, &mut work), case.potential),
        turned.chain(moved).fold(0.0, f64::max),
    ]
}

#[test]
fn random_trees_agree_with_pinocchio_and_mujoco() {
    let Some(python) = python("that has tests/python/requirements.txt") else { return };
    let folder = tempfile::tempdir().unwrap();
    let script = Path::new(env!("CARGO_MANIFEST_DIR")).join("../tests/python/robot_trees.py");
    let output = Command::new(python).arg(script).arg(folder.path()).env("OMP_NUM_THREADS", "1").output().unwrap();
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    let cases: Vec<Case> = serde_json::from_slice(&std::fs::read(folder.path().join("expected.json")).unwrap()).unwrap();
    assert!(cases.len() >= 60);
    let mut broken = Vec::new();
    for (name, tool) in [("shared", "pinocchio"), ("shared", "mujoco"), ("wild", "mujoco")] {
        let mut worst = Worst::default();
        let mut count = 0;
        for case in cases.iter().filter(|case| case.tool == tool && case.file.starts_with(name)) {
            count += 1;
            let found = compare(case, folder.path());
            for (i, found) in found.into_iter().enumerate() {
                worst.0[i] = worst.0[i].max(found);
                if found.is_nan() || found > LIMITS[i] {
                    broken.push(format!("{}: {} differs by {found:.1e}", case.file, RESPECTS[i]));
                }
            }
        }
        let shown: Vec<String> = RESPECTS.iter().zip(worst.0).map(|(what, worst)| format!("{what} {worst:.1e}")).collect();
        println!("{name} trees against {tool}: {count} of them, largest differences: {}", shown.join(", "));
    }
    assert!(broken.is_empty(), "{}", broken.join("\n"));
}
