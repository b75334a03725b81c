//! Where things are: `pos`, and one of the ways to say how they are turned.

use super::compiler::Compiler;
use super::defaults::Styled;
use crate::robot::spatial::Placement;
use crate::tomlfile::FileError;
use nalgebra::{Matrix3, Quaternion, Rotation3, Unit, UnitQuaternion, Vector3};

/// Ways to say how something is turned.
const WAYS: [&str; 5] = ["quat", "axisangle", "euler", "xyaxes", "zaxis"];

/// Shortest vector that has a direction.
const SHORTEST: f64 = 1e-9;

pub(super) fn placement(of: &Styled, compiler: &Compiler) -> Result<Placement, FileError> {
    let translation = of.array::<3>("pos")?.map_or_else(Vector3::zeros, Vector3::from);
    Ok(Placement { rotation: rotation(of, compiler)?, translation })
}

pub(super) fn rotation(of: &Styled, compiler: &Compiler) -> Result<Matrix3<f64>, FileError> {
    // An orientation of the element itself precedes one of its class in another notation.
    let own: Vec<&str> = WAYS.into_iter().filter(|way| of.element.attribute(way).is_some()).collect();
    if let [first, second, ..] = own.as_slice() {
        return Err(of.element.error(format!("has both {first} and {second}; expected one way to state its orientation")));
    }
    let Some(way) = own.first().copied().or_else(|| WAYS.into_iter().find(|way| of.text(way).is_some())) else {
        return Ok(Matrix3::identity());
    };
    let direction = |v: Vector3<f64>| -> Result<Unit<Vector3<f64>>, FileError> {
        Unit::try_new(v, SHORTEST).ok_or_else(|| of.element.error_at(way, "must have a direction, has a vector of length 0"))
    };
    let numbers = of.numbers(way)?.unwrap_or_default();
    let rotation = match (way, numbers.as_slice()) {
        ("quat", &[w, x, y, z]) => {
            let unit = Unit::try_new(Quaternion::new(w, x, y, z), SHORTEST);
            UnitQuaternion::to_rotation_matrix(unit.ok_or_else(|| of.element.error_at("quat", "must not be 0"))?)
        }
        ("axisangle", &[x, y, z, angle]) => Rotation3::from_axis_angle(&direction(Vector3::new(x, y, z))?, angle * compiler.angle),
        ("euler", &[a, b, c]) => {
            let mut turned = Rotation3::identity();
            for (axis, angle) in compiler.euler.iter().zip([a, b, c]) {
                let about = match axis.to_ascii_lowercase() {
                    'x' => Vector3::x_axis(),
                    'y' => Vector3::y_axis(),
                    _ => Vector3::z_axis(),
                };
                let turn = Rotation3::from_axis_angle(&about, angle * compiler.angle);
                turned = if axis.is_lowercase() { turned * turn } else { turn * turned };
            }
            turned
        }
        ("xyaxes", &[a, b, c, d, e, f]) => {
            let x = direction(Vector3::new(a, b, c))?.into_inner();
            let y = Vector3::new(d, e, f);
            let y = direction(y - x * x.dot(&y))?.into_inner();
            Rotation3::from_matrix_unchecked(Matrix3::from_columns(&[x, y, x.cross(&y)]))
        }
        ("zaxis", &[x, y, z]) => {
            let z = direction(Vector3::new(x, y, z))?;
            let across = Vector3::z().cross(&z);
            match Unit::try_new(across, 1e-10) {
                Some(about) => Rotation3::from_axis_angle(&about, across.norm().atan2(z.z)),
                None if z.z > 0.0 => Rotation3::identity(),
                None => Rotation3::from_axis_angle(&Vector3::x_axis(), std::f64::consts::PI),
            }
        }
        (_, numbers) => {
            let expected = match way {
                "euler" | "zaxis" => 3,
                "xyaxes" => 6,
                _ => 4,
            };
            return Err(of.element.error_at(way, format!("expected {expected} numbers, found {}", numbers.len())));
        }
    };
    Ok(rotation.into_inner())
}
