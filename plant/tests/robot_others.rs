//! Random trees read from URDF and MJCF, against what Pinocchio and MuJoCo make of the same files, and arms in motion, held and pushed at points too, against
//! MuJoCo.
//!
//! `BACKDRIVE_PYTHON` names a Python that has `tests/python/requirements.txt`. Without it the test is skipped, unless `BACKDRIVE_REQUIRE_PYTHON=1`.

#[path = "../../tests/common/python.rs"]
mod python;
mod robot_common;

use backdrive_plant::model::Model;
use backdrive_plant::robot::{RobotFile, Tree, Twist};
use backdrive_plant::stepper::{Options, simulate};
use nalgebra::Vector3;
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
    /// Three rows of velocity, three of turning.
    jacobian: Vec<Vec<f64>>,
}

#[derive(Deserialize)]
struct Tip {
    rotation: [[f64; 3]; 3],
    translation: [f64; 3],
}

/// The greatest of what was found in one respect.
#[derive(Default)]
struct Worst([f64; 7]);

const RESPECTS: [&str; 7] = ["inverse", "forward", "mass", "kinetic", "potential", "tip", "jacobian"];
/// Largest differences, as shares (of the tip: m, and of a unit vector).
const LIMITS: [f64; 7] = [1e-11; 7];

fn compare(case: &Case, folder: &Path) -> [f64; 7] {
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
    let mut columns = vec![Twist::default(); tree.len()];
    tree.jacobian(file.robot.link(&case.last).unwrap(), &Vector3::zeros(), &work, &mut columns);
    let of_column = |(column, i): (&Twist, &usize)| {
        let rows: Vec<f64> = column.linear.iter().chain(column.angular.iter()).copied().collect();
        rows.iter().zip(&case.jacobian).fold(0.0, |most: f64, (row, theirs)| most.max((row - theirs[*i]).abs()))
    };
    let turned = (0..3).flat_map(|i| (0..3).map(move |j| (i, j))).map(|(i, j)| (tip.rotation[(i, j)] - case.tip.rotation[i][j]).abs());
    let moved = (0..3).map(|i| (tip.translation[i] - case.tip.translation[i]).abs());
    [
        share(&inverse, &ours(&case.inverse)),
        share(&forward, &ours(&case.forward)),
        share(mass_matrix(&tree, &q).as_slice(), &mass),
        apart(tree.kinetic_energy(&q, &v, &mut work), case.kinetic),
        apart(tree.potential_energy(&q, &mut work), case.potential),
        turned.chain(moved).fold(0.0, f64::max),
        columns.iter().zip(&theirs).map(of_column).fold(0.0, f64::max),
    ]
}

/// What a script draws and works out, in a folder; `None` without a Python.
fn drawn(script: &str) -> Option<tempfile::TempDir> {
    let python = python("that has tests/python/requirements.txt")?;
    let folder = tempfile::tempdir().unwrap();
    let script = Path::new(env!("CARGO_MANIFEST_DIR")).join("../tests/python").join(script);
    let mut command = Command::new(python);
    let output = command.arg(script).arg(folder.path()).env("OMP_NUM_THREADS", "1").env("PYTHONDONTWRITEBYTECODE", "1").output().unwrap();
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    Some(folder)
}

#[test]
fn random_trees_agree_with_pinocchio_and_mujoco() {
    let Some(folder) = drawn("robot_trees.py") else { return };
    let cases: Vec<Case> = serde_json::from_slice(&std::fs::read(folder.path().join("expected.json")).unwrap()).unwrap();
    assert_eq!(cases.len(), 100);
    let mut broken = Vec::new();
    for (name, tool) in [("shared", "pinocchio"), ("shared", "mujoco"), ("wild", "mujoco"), ("saved", "mujoco")] {
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

#[derive(Deserialize)]
struct Moved {
    name: String,
    push: Vec<Vec<f64>>,
    steps: Vec<f64>,
    /// At each of MuJoCo's steps, of each joint.
    positions: Vec<Vec<Vec<f64>>>,
}

/// Largest difference of any joint, as a share of its range.
fn apart(found: &[Vec<f64>], expected: &[Vec<f64>]) -> f64 {
    let of = |(found, expected): (&Vec<f64>, &Vec<f64>)| {
        let range = |f: fn(f64, f64) -> f64| expected.iter().copied().reduce(f).unwrap();
        let largest = found.iter().zip(expected).fold(0.0, |most: f64, (a, b)| most.max((a - b).abs()));
        largest / (range(f64::max) - range(f64::min))
    };
    found.iter().zip(expected).map(of).fold(0.0, f64::max)
}

#[test]
fn arms_move_as_mujoco_moves_them() {
    let Some(folder) = drawn("robot_motions.py") else { return };
    let cases: Vec<Moved> = serde_json::from_slice(&std::fs::read(folder.path().join("expected.json")).unwrap()).unwrap();
    let mut broken = Vec::new();
    for case in &cases {
        let model = Model::load(&folder.path().join(format!("{}.toml", case.name))).unwrap_or_else(|e| panic!("{e}"));
        let run = |substeps: Option<usize>| simulate(&model, &case.push, 1e-3, &Options { substeps, ..Options::default() }).unwrap();
        let theirs = case.positions.last().unwrap();
        let [coarse, fine] = [4, 16].map(|substeps| apart(&run(Some(substeps)), theirs));
        let chosen = apart(&run(None), theirs);
        println!(
            "{}: ours from MuJoCo at {:.0e} s: as chosen {chosen:.1e}, 250 us {coarse:.1e}, 62.5 us {fine:.1e}",
            case.name,
            case.steps.last().unwrap()
        );
        if case.name == "rubbing" {
            // MuJoCo comes to our solution as its step shrinks.
            let exact = run(Some(64));
            let distances: Vec<f64> = case.positions.iter().map(|theirs| apart(&exact, theirs)).collect();
            println!("{}: MuJoCo from ours at 16 us, at its steps {:?}: {distances:?}", case.name, case.steps);
            if !(distances[0] > 2.0 * distances[1] && distances[1] > 2.0 * distances[2] && distances[2] < 1e-3) {
                broken.push(format!("{}: {distances:?}", case.name));
            }
        } else if !(fine < 1e-5 && coarse / fine > 12.0 && chosen < 1e-3) {
            broken.push(format!("{}: {chosen} {coarse} {fine}", case.name));
        }
    }
    assert!(broken.is_empty(), "{}", broken.join("\n"));
}

#[derive(Deserialize)]
struct Held {
    push: Vec<Vec<f64>>,
    /// Of each joint, then of each point, at every millisecond.
    positions: Vec<Vec<f64>>,
}

#[test]
fn an_arm_held_and_pushed_at_points_moves_as_mujoco_says() {
    let Some(folder) = drawn("robot_points.py") else { return };
    let case: Held = serde_json::from_slice(&std::fs::read(folder.path().join("expected.json")).unwrap()).unwrap();
    let model = Model::load(&folder.path().join("arm.toml")).unwrap_or_else(|e| panic!("{e}"));
    let run = |substeps: Option<usize>| simulate(&model, &case.push, 1e-3, &Options { substeps, ..Options::default() }).unwrap();
    let [coarse, fine] = [4, 16].map(|substeps| apart(&run(Some(substeps)), &case.positions));
    let chosen = apart(&run(None), &case.positions);
    println!("points: ours from MuJoCo: as chosen {chosen:.1e}, 250 us {coarse:.1e}, 62.5 us {fine:.1e}");
    assert!(fine < 1e-5 && coarse / fine > 12.0 && chosen < 1e-3, "{chosen} {coarse} {fine}");
}
