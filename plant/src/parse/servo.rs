//! `[servo.JOINT]`: how a joint answers the commands of its position servo.

use crate::elements::Range;
use crate::model::Model;
use crate::servo::{FACTS, Numbers, ServoJoint};
use crate::tomlfile::{FileError, Table, unknown};

/// Reads the tables of `[servo]`; of a model with a robot each names a joint of it.
pub(super) fn read_servos(top: &mut Table, model: &mut Model) -> Result<(), FileError> {
    let Some(mut all) = top.table("servo")? else { return Ok(()) };
    for joint in all.keys() {
        if let Some(arm) = &model.arm {
            let names = || arm.tree.coordinates().iter().map(|c| c.name.as_str());
            if !names().any(|name| name == joint) {
                return Err(all.error_at(&joint, unknown("joint", &joint, names().collect::<Vec<_>>())));
            }
        }
        let mut table = all.table(&joint)?.ok_or_else(|| all.missing(&joint))?;
        let mut numbers = Numbers::default();
        for facts in &FACTS {
            let Some(value) = table.number(facts.key, Range::Any)? else { continue };
            let [least, most] = facts.range;
            if value < least || value > most {
                return Err(table.error_at(facts.key, format!("is {value}; expected {least} to {most} {}", facts.unit)));
            }
            numbers[facts.number] = value;
        }
        table.finish()?;
        model.servos.push(ServoJoint { joint, numbers });
    }
    all.finish()
}
