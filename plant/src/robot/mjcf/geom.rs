//! Inertia of simple geoms: sphere, capsule, cylinder, ellipsoid, box.

use super::compiler::{Compiler, SAVE_WHOLE};
use super::defaults::Styled;
use super::orientation::placement;
use crate::elements::Range;
use crate::robot::inertia::Inertia;
use crate::robot::spatial::Placement;
use crate::tomlfile::{FileError, unknown};
use nalgebra::{Matrix3, Rotation3, Unit, Vector3};
use std::f64::consts::PI;

/// Water, kg/m³: the density of a geom for which the file states none.
const DENSITY: f64 = 1000.0;

const SIMPLE: [&str; 5] = ["sphere", "capsule", "cylinder", "ellipsoid", "box"];

/// Half sizes, m: of a capsule and a cylinder radius, radius and half the length between its ends (without the caps).
struct Shape<'a> {
    kind: &'a str,
    half: Vector3<f64>,
}

/// Inertia of a geom about its body's origin; nothing of those that have none.
pub(super) fn inertia(geom: &Styled, compiler: &Compiler, frame: &Placement) -> Result<Inertia, FileError> {
    let group = geom.number("group", Range::Any)?.unwrap_or(0.0);
    let mass = geom.number("mass", Range::NonNegative)?;
    let density = geom.number("density", Range::NonNegative)?.unwrap_or(DENSITY);
    let kind = geom.text("type").map_or("sphere", |(_, kind)| kind);
    let weightless = mass == Some(0.0) || (mass.is_none() && density == 0.0);
    if weightless || kind == "plane" || kind == "hfield" || !(compiler.groups[0]..=compiler.groups[1]).contains(&group) {
        return Ok(Inertia::default());
    }
    if kind == "mesh" || kind == "sdf" {
        let message = format!("the inertia of a {kind} is not computed: give the body an <inertial>; {SAVE_WHOLE}");
        return Err(geom.element.error_at("type", message));
    }
    if !SIMPLE.contains(&kind) {
        return Err(geom.element.error_at("type", unknown("type of geom", kind, SIMPLE)));
    }
    if geom.text("shellinertia").is_some_and(|(_, text)| text == "true") {
        return Err(geom
            .element
            .error_at("shellinertia", format!("the inertia of a shell is not computed: give the body an <inertial>; {SAVE_WHOLE}")));
    }
    let (shape, place) = shape(geom, compiler, kind)?;
    let mass = mass.unwrap_or(density * shape.volume());
    let place = frame.then(&place);
    Ok(Inertia::new(mass, Vector3::zeros(), Matrix3::from_diagonal(&shape.moments(mass))).outside(&place))
}

fn shape<'a>(geom: &Styled, compiler: &Compiler, kind: &'a str) -> Result<(Shape<'a>, Placement), FileError> {
    let sizes = geom.numbers("size")?.unwrap_or_default();
    let size = |index: usize| -> Result<f64, FileError> {
        match sizes.get(index) {
            Some(size) if *size > 0.0 => Ok(*size),
            Some(size) => Err(geom.element.error_at("size", format!("must be above 0 m, has {size}"))),
            None => Err(geom.element.error_at("size", format!("a {kind} needs {} sizes, found {}", index + 1, sizes.len()))),
        }
    };
    let round = kind == "capsule" || kind == "cylinder";
    if let Some(ends) = geom.array::<6>("fromto")?.filter(|_| kind != "sphere") {
        let (from, to) = (Vector3::new(ends[0], ends[1], ends[2]), Vector3::new(ends[3], ends[4], ends[5]));
        let along = Unit::try_new(to - from, 1e-9).ok_or_else(|| geom.element.error_at("fromto", "its two points are the same"))?;
        // A body of revolution, or a box whose sides across are alike: how it is turned about its length decides nothing.
        let rotation =
            Rotation3::rotation_between(&Vector3::z(), &along).unwrap_or_else(|| Rotation3::from_axis_angle(&Vector3::x_axis(), PI));
        let half = Vector3::new(size(0)?, size(0)?, 0.5 * (to - from).norm());
        return Ok((Shape { kind, half }, Placement { rotation: rotation.into_inner(), translation: 0.5 * (from + to) }));
    }
    let half = match kind {
        "sphere" => Vector3::from_element(size(0)?),
        _ if round => Vector3::new(size(0)?, size(0)?, size(1)?),
        _ => Vector3::new(size(0)?, size(1)?, size(2)?),
    };
    Ok((Shape { kind, half }, placement(geom, compiler)?))
}

impl Shape<'_> {
    /// m³.
    fn volume(&self) -> f64 {
        let (x, y, z) = (self.half.x, self.half.y, self.half.z);
        let (r, length) = (x, 2.0 * z);
        match self.kind {
            "box" => 8.0 * x * y * z,
            "cylinder" => PI * r * r * length,
            "capsule" => PI * r * r * length + 4.0 / 3.0 * PI * r * r * r,
            _ => 4.0 / 3.0 * PI * x * y * z,
        }
    }

    /// About its centre, kg m².
    fn moments(&self, mass: f64) -> Vector3<f64> {
        let squares = self.half.component_mul(&self.half);
        let across = |share: f64| share * mass * Vector3::new(squares.y + squares.z, squares.x + squares.z, squares.x + squares.y);
        let (r, length) = (self.half.x, 2.0 * self.half.z);
        match self.kind {
            "box" => across(1.0 / 3.0),
            "cylinder" => {
                let tilting = mass * (3.0 * r * r + length * length) / 12.0;
                Vector3::new(tilting, tilting, 0.5 * mass * r * r)
            }
            "capsule" => {
                // Two half balls, moved apart by a cylinder.
                let caps = mass * 4.0 * r / (4.0 * r + 3.0 * length);
                let middle = mass - caps;
                let ball = 0.4 * caps * r * r;
                let apart = caps * length * (3.0 * r + 2.0 * length) / 8.0;
                let tilting = middle * (3.0 * r * r + length * length) / 12.0 + ball + apart;
                Vector3::new(tilting, tilting, 0.5 * middle * r * r + ball)
            }
            _ => across(0.2),
        }
    }
}
