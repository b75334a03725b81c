//! Joints of a URDF.

use super::origin::{number_or, origin};
use crate::elements::Range;
use crate::robot::description::{Joint, JointKind, Limits, Robot};
use crate::robot::found::Remarks;
use crate::robot::xml::Element;
use crate::tomlfile::{FileError, unknown};
use nalgebra::Vector3;

/// Types of the format that can be read.
const TYPES: [(&str, JointKind); 4] = [
    ("revolute", JointKind::Revolute),
    ("continuous", JointKind::Revolute),
    ("prismatic", JointKind::Prismatic),
    ("fixed", JointKind::Fixed),
];

pub(super) fn read(element: Element, robot: &Robot, remarks: &mut Remarks) -> Result<Joint, FileError> {
    let name = element.need_attribute("name")?;
    let word = element.need_attribute("type")?;
    let kind = match TYPES.iter().find(|(known, _)| *known == word) {
        Some((_, kind)) => *kind,
        None if word == "floating" || word == "planar" => {
            let message = format!(
                "a {word} joint moves in several directions at once, and a joint here has one; fix the base, or write it as several prismatic and revolute joints"
            );
            return Err(element.error_at("type", message));
        }
        None => return Err(element.error_at("type", unknown("joint type", word, TYPES.iter().map(|t| t.0)))),
    };
    if let Some(mimic) = element.child("mimic")? {
        let leader = mimic.attribute("joint").unwrap_or("another");
        let message = format!(
            "ties this joint to joint \"{leader}\", which a tree cannot represent. Remove <mimic> to let it move independently (a stiff \
             spring between the two joints in the model file can tie them), or make its type \"fixed\""
        );
        return Err(mimic.error(message));
    }
    let link = |tag: &'static str| -> Result<usize, FileError> {
        let end = element.need_child(tag, &format!("name the link, such as <{tag} link=\"{}\"/>", robot.links[0].name))?;
        let wanted = end.need_attribute("link")?;
        robot.link(wanted).ok_or_else(|| end.error_at("link", unknown("link", wanted, robot.links.iter().map(|l| l.name.as_str()))))
    };
    let mut joint = Joint::new(name, kind, link("parent")?, link("child")?);
    joint.origin = origin(element.child("origin")?)?;
    if kind == JointKind::Fixed {
        return Ok(joint);
    }
    joint.axis = axis(element)?;
    let dynamics = element.child("dynamics")?;
    joint.damping = number_or(dynamics, "damping", Range::NonNegative, 0.0)?;
    joint.friction = number_or(dynamics, "friction", Range::NonNegative, 0.0)?;
    joint.limits = limits(element, word)?;
    for child in element.children() {
        let (message, matters) = match child.tag() {
            "parent" | "child" | "origin" | "axis" | "dynamics" | "mimic" => continue,
            "limit" if word == "continuous" => continue,
            "limit" => ("read, but nothing stops a joint at its limits; add contacts to its network where it comes to them", true),
            "calibration" => ("not read: it does not move", false),
            "safety_controller" => ("not read: it is part of a controller", false),
            _ => ("not known, and not read", true),
        };
        remarks.add(format!("<{}>", child.tag()), child.line(), message, matters);
    }
    Ok(joint)
}

fn axis(joint: Element) -> Result<Vector3<f64>, FileError> {
    let Some(element) = joint.child("axis")? else { return Ok(Vector3::x()) };
    element.need_attribute("xyz")?;
    let axis = element.vector("xyz")?.unwrap_or_else(Vector3::x);
    if axis.norm() < 1e-9 {
        return Err(element.error_at("xyz", "must have a direction, is (0, 0, 0)"));
    }
    Ok(axis.normalize())
}

fn limits(joint: Element, word: &str) -> Result<Limits, FileError> {
    let Some(element) = joint.child("limit")? else { return Ok(Limits::default()) };
    let (lower, upper) = (element.number("lower", Range::Any)?, element.number("upper", Range::Any)?);
    let range = match (lower, upper) {
        _ if word == "continuous" => None,
        (None, None) => None,
        (lower, upper) => Some([lower.unwrap_or(0.0), upper.unwrap_or(0.0)]),
    };
    if let Some([lower, upper]) = range.filter(|[lower, upper]| lower > upper) {
        return Err(element.error_at("lower", format!("must be at most \"upper\", which is {upper}, is {lower}")));
    }
    Ok(Limits { range, effort: element.number("effort", Range::NonNegative)?, velocity: element.number("velocity", Range::NonNegative)? })
}
