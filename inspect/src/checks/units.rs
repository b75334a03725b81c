//! Values that no device of the stated unit has.

use crate::advice;
use crate::finding::{Finding, FindingKind, Weight};
use crate::joints::Joint;
use crate::numeric::{quantile, span};
use crate::quantity::Quantity;
use crate::recording::Recording;
use backdrive_plant::recording::units::Kind;

/// A range of a joint that no arm has, rad: two turns. Degrees read as radians look so.
const TURNS: f64 = 12.0;
/// Joints from which on a recording is that of an arm, whose joints do not turn on and on.
const ARM: usize = 3;
/// A current that no drive of a joint takes, A: milliampere and counts look so.
const AMPERE: f64 = 100.0;

/// Finds them.
pub fn check(recording: &Recording, joints: &[Joint], out: &mut Vec<Finding>) {
    let arm = joints.iter().filter(|joint| joint.position.is_some()).count() >= ARM;
    for joint in joints {
        if let Some(place) = joint.current {
            let signal = &recording.signals[place];
            let large = quantile(&signal.even.iter().map(|x| x.abs()).collect::<Vec<f64>>(), 0.9);
            let is_stated = signal.stated.or(signal.hint).is_some_and(|unit| unit.kind == Kind::Current);
            if large > AMPERE {
                let message = format!("{:?} is above {large:.0} in a tenth of the samples: no joint draws that many ampere", signal.name);
                let entry = advice::entry(recording, joint, place, "unit = \"mA\"");
                let todo = if is_stated { entry } else { format!("{entry}   # if it is mA; counts need their scale") };
                let weight = if is_stated { Weight::Wrong } else { Weight::Note };
                let sure = if is_stated { 0.97 } else { 0.6 };
                out.push(
                    Finding::new(FindingKind::WrongUnit, &recording.file, &[&signal.name], message)
                        .at(&joint.name)
                        .weighing(weight)
                        .todo(todo)
                        .sure(sure),
                );
            }
        }
        let Some(place) = joint.position.filter(|_| arm) else { continue };
        let signal = &recording.signals[place];
        let says_unit = signal.stated.or(signal.hint).is_some();
        // A command in the same unit makes no difference visible: the range alone shows it.
        if signal.quantity == Quantity::Position && !says_unit && span(&signal.even) > TURNS {
            let turns = span(&signal.even) / std::f64::consts::TAU;
            let message = format!("{:?} spans {turns:.1} turns if it is in radians: it looks like degrees", signal.name);
            let entry = advice::entry(recording, joint, place, "unit = \"deg\"");
            out.push(Finding::new(FindingKind::WrongUnit, &recording.file, &[&signal.name], message).at(&joint.name).todo(entry).sure(0.9));
        }
    }
}
