//! Torque that the rigid links take along a measured motion, and its derivatives by inertial parameters, gravity and the joints' zero.

use crate::arms::error::ArmError;
use crate::arms::inertial::{Bodies, COUNT, Parameters};
use crate::arms::motion::Motion;
use backdrive_plant::robot::{Inertia, LinkInertia, Robot, Tree};
use nalgebra::{Matrix3, Vector3};

/// Signals of a motion, by joint, then by sample.
pub type Signals = Vec<Vec<f64>>;

/// A robot ready for computing, without armatures.
///
/// # Errors
/// Where it cannot be computed.
pub fn tree_of(robot: &Robot) -> Result<Tree, ArmError> {
    let mut tree = Tree::new(robot).map_err(|e| ArmError::Robot(e.to_string()))?;
    (0..tree.len()).for_each(|i| tree.set_armature(i, 0.0));
    Ok(tree)
}

/// Torques of the joints along a motion, with every coordinate less `offsets`, N m or N.
pub fn torques(tree: &Tree, motion: &Motion, offsets: &[f64]) -> Signals {
    let joints = tree.len();
    let mut work = tree.workspace();
    let mut out = vec![Vec::with_capacity(motion.len()); joints];
    let (mut q, mut v, mut a, mut f) = (vec![0.0; joints], vec![0.0; joints], vec![0.0; joints], vec![0.0; joints]);
    for i in 0..motion.len() {
        for j in 0..joints {
            q[j] = motion.position[j][i] - offsets.get(j).copied().unwrap_or(0.0);
            v[j] = motion.velocity[j][i];
            a[j] = motion.acceleration[j][i];
        }
        tree.inverse_dynamics(&q, &v, &a, &mut work, &mut f);
        for (signal, force) in out.iter_mut().zip(&f) {
            signal.push(*force);
        }
    }
    out
}

/// Difference of two signals, times a factor.
pub fn difference(a: &Signals, b: &Signals, factor: f64) -> Signals {
    a.iter().zip(b).map(|(a, b)| a.iter().zip(b).map(|(x, y)| factor * (x - y)).collect()).collect()
}

/// For every body and every parameter of it a robot in which that parameter is larger by 1 than in the one before them, all of them heavy
/// enough to be bodies.
fn probes(robot: &Robot, bodies: &Bodies) -> Result<Vec<Tree>, ArmError> {
    // Heavy enough that one unit more or less of any parameter leaves it a body.
    let heavy = |k: usize, change: Option<usize>| {
        let mut p: Parameters = [10.0, 0.0, 0.0, 0.0, 20.0, 0.0, 0.0, 20.0, 0.0, 20.0];
        if let Some(i) = change {
            p[i] += 1.0;
        }
        let mut out = robot.clone();
        for (other, link) in bodies.link.iter().enumerate() {
            out.links[*link].inertia = if other == k { crate::arms::inertial::to_link(&p) } else { Some(one()) };
        }
        tree_of(&out)
    };
    let mut trees = Vec::new();
    for k in 0..bodies.link.len() {
        trees.push(heavy(k, None)?);
        for i in 0..COUNT {
            trees.push(heavy(k, Some(i))?);
        }
    }
    Ok(trees)
}

fn one() -> LinkInertia {
    LinkInertia { mass: 1.0, centre: Vector3::zeros(), about_centre: Matrix3::identity() }
}

/// Torque per unit of each inertial parameter along a motion: for body k and parameter i the entry `10 k + i`.
///
/// Inverse dynamics is linear in the parameters (Atkeson, An & Hollerbach 1986), so that a difference of one unit is exact but for rounding.
///
/// # Errors
/// Where the robot cannot be computed.
pub fn regressor(robot: &Robot, bodies: &Bodies, motion: &Motion, offsets: &[f64]) -> Result<Vec<Signals>, ArmError> {
    let trees = probes(robot, bodies)?;
    let mut columns = Vec::with_capacity(bodies.link.len() * COUNT);
    for of_body in trees.chunks(COUNT + 1) {
        let Some((first, changed)) = of_body.split_first() else { continue };
        let without = torques(first, motion, offsets);
        for tree in changed {
            columns.push(difference(&torques(tree, motion, offsets), &without, 1.0));
        }
    }
    Ok(columns)
}

/// The inertia of a body as the spatial algebra has it; for checks.
pub fn inertia_of(p: &Parameters) -> Inertia {
    Inertia {
        mass: p[0],
        first_moment: Vector3::new(p[1], p[2], p[3]),
        rotational: Matrix3::new(p[4], p[5], p[6], p[5], p[7], p[8], p[6], p[8], p[9]),
    }
}

/// Two directions across gravity, unit vectors seen from the base; where there is no gravity, x and y.
pub fn across(gravity: &Vector3<f64>) -> [Vector3<f64>; 2] {
    let size = gravity.norm();
    if size == 0.0 {
        return [Vector3::x(), Vector3::y()];
    }
    let down = gravity / size;
    // The axis that gravity lies along least gives the first.
    let axes = [Vector3::x(), Vector3::y(), Vector3::z()];
    let along = |axis: &Vector3<f64>| axis.dot(&down).abs();
    let first = axes.iter().min_by(|a, b| along(a).total_cmp(&along(b))).copied().unwrap_or(Vector3::x());
    let first = (first - down * first.dot(&down)).normalize();
    [first, down.cross(&first)]
}
