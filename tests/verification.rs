//! Simulations against what others compute: SciPy, MuJoCo and, where it is at hand, an independent simulator.
//!
//! `BACKDRIVE_PYTHON` names a Python that has `tests/python/requirements.txt`; `tests/run` makes one. Without it these are
//! skipped, unless `BACKDRIVE_REQUIRE_PYTHON=1`. The independent simulator is looked for in `../shared/concealed`.

#[path = "common/python.rs"]
mod python;

use python::python;
use python::skipped::skipped;
use std::path::Path;
use std::process::Command;

/// What the Python must have.
const NEEDS: &str = "that has tests/python/requirements.txt";

/// Runs a script of `tests/python` on the program that was built, and shows its table.
fn run(script: &str, more: &[&Path]) {
    let Some(python) = python(NEEDS) else { return };
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/python").join(script);
    let output = Command::new(&python)
        .arg(path)
        .arg(env!("CARGO_BIN_EXE_backdrive"))
        .args(more)
        .env("OMP_NUM_THREADS", "1")
        .env("PYTHONDONTWRITEBYTECODE", "1")
        .output()
        .unwrap_or_else(|e| panic!("{} does not start: {e}", python.display()));
    let said = String::from_utf8_lossy(&output.stdout);
    println!("{said}");
    assert!(output.status.success(), "{script}: {}\n{said}\n{}", output.status, String::from_utf8_lossy(&output.stderr));
}

#[test]
fn agrees_with_scipy() {
    run("scipy_check.py", &[]);
}

#[test]
fn the_analysis_of_a_fleet_agrees_with_statsmodels_and_scipy() {
    run("fleet_check.py", &[]);
}

#[test]
fn presliding_hysteresis_agrees_with_relays_and_scipy() {
    run("preisach_check.py", &[]);
}

#[test]
fn the_observer_agrees_with_scipy() {
    run("observer_check.py", &[]);
}

#[test]
fn agrees_with_mujoco_on_a_chain_with_joint_friction() {
    run("mujoco_chain.py", &[]);
}

#[test]
fn agrees_with_the_independent_simulator() {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("../shared/concealed");
    if folder.join("core.py").exists() {
        run("independent_simulator.py", &[&folder]);
    } else {
        skipped(format_args!("the independent simulator is not at {}", folder.display()));
    }
}

#[test]
fn the_steering_compensator_agrees_with_scipy() {
    let models = Path::new(env!("CARGO_MANIFEST_DIR")).join("plant/models");
    run("steering_check.py", &[&models]);
}
