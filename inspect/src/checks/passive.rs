//! Joints that move without a command, or without a torque.

use super::effort::explained;
use super::motion::{excitation, of, title};
use crate::advice;
use crate::finding::{Finding, FindingKind};
use crate::joints::Joint;
use crate::numeric::{extremes, median, neighbour_correlation, span};
use crate::recording::Recording;

/// What names and units say is this sure at least.
const NAMED: f64 = 0.8;
/// A joint moves where it does so this many times beyond noise and step, and by this share of what the other joints move.
const MOVES: f64 = 30.0;
const OF_OTHERS: f64 = 0.15;
/// A command that moves by less than this share of its joint is none.
const NO_COMMAND: f64 = 0.02;
/// A torque whose neighbours correlate by less than this is noise, and motion explains less than this share of it.
const WHITE: f64 = 0.3;
const UNEXPLAINED: f64 = 0.1;

fn is_signed(values: &[f64]) -> bool {
    extremes(values).is_some_and(|(low, high)| low < 0.0 && high > 0.0)
}

/// Finds them.
pub fn check(recording: &Recording, joints: &[Joint], out: &mut Vec<Finding>) {
    let spans: Vec<f64> = joints.iter().filter_map(|joint| of(recording, joint.position)).map(|signal| span(&signal.even)).collect();
    let usual = median(&spans);
    for joint in joints {
        let Some(position) = of(recording, joint.position) else { continue };
        let moved = span(&position.even);
        if position.sure < NAMED {
            continue;
        }
        if excitation(position) < MOVES || moved < OF_OTHERS * usual {
            continue;
        }
        let new = |name: &str, message: String| {
            Finding::new(FindingKind::Passive, &recording.file, &[name, &position.name], message).at(&joint.name)
        };
        if let Some(command) =
            joint.command.map(|place| &recording.signals[place]).filter(|command| span(&command.even) < NO_COMMAND * moved)
        {
            let message = format!(
                "{} moves by {moved:.3} while {:?} does not: another input drives the joint, or another column is its command",
                title(joint),
                command.name
            );
            out.push(new(&command.name, message).todo("name the column of the command that was sent, or omit the command of this joint"));
        }
        for place in joint.drives() {
            let drive = &recording.signals[place];
            let is_still = span(&drive.values) == 0.0;
            let zero = advice::table_name(&joint.name);
            if is_still {
                let value = drive.values.first().copied().unwrap_or(0.0);
                let message = format!(
                    "{:?} is constant at {value} while {} moves: the joint has no motor, or the column is wrong",
                    drive.name,
                    title(joint)
                );
                out.push(new(&drive.name, message).todo(format!("[joints.{zero}]\ntorque = 0   # if it has no motor")));
            } else if is_signed(&drive.values)
                && neighbour_correlation(&drive.even) < WHITE
                && explained(recording, joint, place).is_some_and(|share| share < UNEXPLAINED)
            {
                let message = format!(
                    "{:?} is only noise while {} moves: the joint has no motor, or the sensor is not connected",
                    drive.name,
                    title(joint)
                );
                out.push(new(&drive.name, message).todo(format!("[joints.{zero}]\ntorque = 0   # if it has no motor")).sure(0.9));
            }
        }
    }
}
