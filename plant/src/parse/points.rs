//! `[point.NAME]`: points of a robot's links, which are bodies of the network.

use crate::elements::Range;
use crate::model::{Body, Model};
use crate::robot::Point;
use crate::tomlfile::{self, FileError, Table};
use nalgebra::Vector3;

/// Directions of a point that names none, and what they add to its name.
const DIRECTIONS: [(&str, [f64; 3]); 3] = [("x", [1.0, 0.0, 0.0]), ("y", [0.0, 1.0, 0.0]), ("z", [0.0, 0.0, 1.0])];

/// Reads all points. With an `axis` a point is one body of its name, without one it is three: NAME.x, NAME.y and NAME.z.
pub(super) fn read_points(top: &mut Table, model: &mut Model) -> Result<(), FileError> {
    let Some(mut points) = top.table("point")? else { return Ok(()) };
    if model.arm.is_none() {
        return Err(points.error("only a model with a [robot] has points: places on its links"));
    }
    for name in points.keys() {
        let Some(mut table) = points.table(&name)? else { continue };
        read_point(&mut table, &name, model)?;
        table.finish()?;
    }
    points.finish()
}

fn read_point(table: &mut Table, name: &str, model: &mut Model) -> Result<(), FileError> {
    let link = table.need_string("link")?;
    let at = match table.numbers("at", Range::Any)?.as_deref() {
        None => Vector3::zeros(),
        Some(&[x, y, z]) => Vector3::new(x, y, z),
        Some(_) => return Err(table.error_at("at", "expected three numbers, m: the point in the frame of its link")),
    };
    let axis = match table.numbers("axis", Range::Any)?.as_deref() {
        None => None,
        Some(&[x, y, z]) => {
            Some(unit(Vector3::new(x, y, z)).ok_or_else(|| table.error_at("axis", "is not a direction: its three numbers are 0"))?)
        }
        Some(_) => {
            return Err(table.error_at("axis", "expected three numbers: a direction in the frame of the robot's base, of any length"));
        }
    };
    let Some(arm) = &model.arm else { return Ok(()) };
    let Some(link) = arm.robot.link(&link) else {
        return Err(table.error_at("link", tomlfile::unknown("link", &link, arm.robot.links.iter().map(|l| l.name.as_str()))));
    };
    let bodies: Vec<(String, Vector3<f64>)> = match axis {
        Some(axis) => vec![(name.to_owned(), axis)],
        None => DIRECTIONS.iter().map(|(suffix, axis)| (format!("{name}.{suffix}"), Vector3::from(*axis))).collect(),
    };
    for (body, axis) in bodies {
        if model.bodies.iter().any(|known| known.name == body) {
            return Err(table.error(format!("a joint or another point is called \"{body}\" already; choose another name")));
        }
        let point = Point { body: model.bodies.len(), link, at, axis };
        model.bodies.push(Body { name: body, inertia: 0.0 });
        model.arm.iter_mut().for_each(|arm| arm.points.push(point.clone()));
    }
    Ok(())
}

/// The direction of a vector; one that is written as a unit vector stays what it is to the last bit. `None` where there is none.
fn unit(vector: Vector3<f64>) -> Option<Vector3<f64>> {
    let largest = vector.amax();
    match (vector.norm() - 1.0).abs() < 1e-12 {
        true => Some(vector),
        false if largest > 0.0 => Some((vector / largest).normalize()),
        false => None,
    }
}
