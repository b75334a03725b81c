//! All joints of an arm in time, from their commands alone. The effect of gravity on one depends on where the others are, so they are re-simulated where they
//! came to be.

use crate::error::ServoError;
use crate::fit::substeps;
use crate::gravity;
use crate::problem::Problem;
use crate::record::Record;
use crate::simulate::simulate;
use backdrive_plant::robot::Tree;
use backdrive_plant::servo::Numbers;

/// Runs after the first, in which every joint is where its command is.
const AGAIN: usize = 3;

/// Free runs of every joint of the problem in one recording: positions by joint, then by sample. A joint without numbers stays with its command, less where it began off it.
///
/// # Errors
/// Where a joint lacks the recording.
pub fn free_runs(problem: &Problem, numbers: &[Option<Numbers>], held_out: bool, index: usize) -> Result<Vec<Vec<f64>>, ServoError> {
    let records: Vec<&Record> = problem
        .joints
        .iter()
        .map(|joint| {
            let all = if held_out { &joint.held_out } else { &joint.fit };
            all.get(index).ok_or_else(|| ServoError::wrong(joint.name.clone(), "has fewer recordings than the other joints"))
        })
        .collect::<Result<_, _>>()?;
    let mut positions: Vec<Vec<f64>> = records.iter().map(|r| beside_command(r)).collect();
    let tree = problem.model.arm.as_ref().map(|arm| &arm.tree).filter(|_| problem.joints.iter().all(|j| j.is_weighed));
    for _ in 0..if tree.is_some() { AGAIN } else { 1 } {
        let at_work = positions.clone();
        for (j, record) in records.iter().enumerate() {
            let Some(numbers) = numbers.get(j).copied().flatten() else { continue };
            let mut own = (*record).clone();
            if let Some(tree) = tree {
                own.gravity = weights(tree, problem, &at_work, j);
            }
            positions[j] = simulate(&numbers, &own, substeps(&own));
        }
    }
    Ok(positions)
}

fn beside_command(record: &Record) -> Vec<f64> {
    let off = record.position.first().zip(record.command.first()).map_or(0.0, |(p, c)| p - c);
    record.command.iter().map(|c| c + off).collect()
}

fn weights(tree: &Tree, problem: &Problem, positions: &[Vec<f64>], joint: usize) -> Vec<[f64; 3]> {
    let place = |name: &str| problem.joints.iter().position(|j| j.name == name);
    let views: Vec<&[f64]> = tree.coordinates().iter().filter_map(|c| Some(positions[place(&c.name)?].as_slice())).collect();
    let own = tree.coordinates().iter().position(|c| c.name == problem.joints[joint].name);
    own.map_or(Vec::new(), |own| gravity::columns(tree, &views, own))
}
