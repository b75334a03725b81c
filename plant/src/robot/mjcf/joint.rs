//! `<joint>`.

use super::compiler::{Compiler, SAVE_WHOLE};
use super::defaults::Styled;
use crate::elements::Range;
use crate::robot::description::{Joint, JointKind, Limits};
use crate::robot::found::Remarks;
use crate::robot::spatial::Placement;
use crate::tomlfile::{FileError, unknown};
use nalgebra::Vector3;

/// A joint, and where its anchor is in its body, m.
pub(super) struct Anchored {
    pub(super) joint: Joint,
    pub(super) anchor: Vector3<f64>,
}

/// `frame` is where the joint's own frame is in its body.
pub(super) fn read(of: &Styled, name: &str, compiler: &Compiler, frame: &Placement, remarks: &mut Remarks) -> Result<Anchored, FileError> {
    let word = of.text("type").map_or("hinge", |(_, word)| word);
    let kind = match word {
        "hinge" => JointKind::Revolute,
        "slide" => JointKind::Prismatic,
        "ball" | "free" => {
            let message = format!(
                "a {word} joint moves in several directions at once, and a joint here has one; fix the body, or write it as hinges and slides"
            );
            return Err(of.element.error_at("type", message));
        }
        _ => return Err(of.element.error_at("type", unknown("joint type", word, ["hinge", "slide"]))),
    };
    let angle = if kind == JointKind::Revolute { compiler.angle } else { 1.0 };
    let axis = of.array::<3>("axis")?.map_or_else(Vector3::z, Vector3::from);
    if axis.norm() < 1e-9 {
        return Err(of.element.error_at("axis", "must have a direction, is (0, 0, 0)"));
    }
    let anchor = frame.point(&of.array::<3>("pos")?.map_or_else(Vector3::zeros, Vector3::from));
    let mut joint = Joint::new(name, kind, 0, 0);
    joint.axis = frame.rotation * axis.normalize();
    joint.reference = angle * of.number("ref", Range::Any)?.unwrap_or(0.0);
    joint.armature = of.number("armature", Range::NonNegative)?.unwrap_or(0.0);
    joint.damping = first(of, "damping", remarks)?;
    joint.friction = of.number("frictionloss", Range::NonNegative)?.unwrap_or(0.0);
    joint.stiffness = first(of, "stiffness", remarks)?;
    joint.rest = angle * of.number("springref", Range::Any)?.unwrap_or(0.0);
    if of.numbers("springdamper")?.is_some_and(|numbers| numbers.iter().any(|n| *n > 0.0)) {
        return Err(of
            .element
            .error_at("springdamper", format!("spring and damper for a time constant are not worked out here: {SAVE_WHOLE}")));
    }
    joint.limits = limits(of, angle, compiler, remarks)?;
    for name in ["actuatorfrcrange", "springyield", "plugin"] {
        if of.text(name).is_some() {
            remarks.add(format!("<joint {name}>"), of.element.line(), "not read", true);
        }
    }
    if of.text("actuatorgravcomp").is_some_and(|(_, text)| text == "true") {
        remarks.add("<joint actuatorgravcomp>", of.element.line(), "not read", true);
    }
    Ok(Anchored { joint, anchor })
}

/// The first of a polynomial's coefficients, which is the linear one.
fn first(of: &Styled, name: &str, remarks: &mut Remarks) -> Result<f64, FileError> {
    let numbers = of.numbers(name)?.unwrap_or_default();
    let linear = numbers.first().copied().unwrap_or(0.0);
    if linear < 0.0 {
        return Err(of.element.error_at(name, format!("must be at least 0, is {linear}")));
    }
    if numbers.iter().skip(1).any(|n| *n != 0.0) {
        let message = "only the first number is read; a nonlinear part can be an element of the joint's network";
        remarks.add(format!("<joint {name}>"), of.element.line(), message, true);
    }
    Ok(linear)
}

fn limits(of: &Styled, angle: f64, compiler: &Compiler, remarks: &mut Remarks) -> Result<Limits, FileError> {
    if !of.limited("limited", "range", compiler.autolimits)? {
        return Ok(Limits::default());
    }
    let [low, high] = of.array::<2>("range")?.unwrap_or([0.0; 2]);
    if low >= high {
        return Err(of.element.error_at("range", format!("expected the lower limit first, found {low} and {high}")));
    }
    let message = "read, but nothing stops a joint at its limits; add contacts to its network where it comes to them";
    remarks.add("<joint range>", of.element.line(), message, true);
    Ok(Limits { range: Some([angle * low, angle * high]), ..Limits::default() })
}
