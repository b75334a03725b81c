//! `<actuator>`: motors that push on a joint in proportion to their command.

use super::compiler::Compiler;
use super::defaults::{Defaults, Styled};
use crate::robot::description::Actuator;
use crate::robot::found::Found;
use crate::robot::xml::Element;
use crate::tomlfile::{FileError, unknown};

/// An attribute that a class sets for any actuator holds for every one.
const TAGS: [&str; 12] =
    ["general", "motor", "position", "velocity", "intvelocity", "damper", "cylinder", "muscle", "adhesion", "dcmotor", "pid", "plugin"];

pub(super) fn read(section: Element, compiler: &Compiler, defaults: &Defaults, found: &mut Found) -> Result<(), FileError> {
    for element in section.children() {
        let of = defaults.styled(element, 0, &TAGS)?;
        let about = format!("actuator <{}>", element.tag());
        let Some(joint) = element.attribute("joint").or_else(|| element.attribute("jointinparent")) else {
            found.remarks.add(about, element.line(), "not read: it does not act on a joint", true);
            continue;
        };
        let Some(gain) = gain(&of)? else {
            let message = "not read: it is a controller or has its own dynamics; the drive of a joint is an input of the model file";
            found.remarks.add(about, element.line(), message, true);
            continue;
        };
        let Some(joint) = found.robot.joint(joint) else {
            let all = found.robot.joints.iter().map(|j| j.name.as_str());
            return Err(element.error_at("joint", unknown("joint", joint, all)));
        };
        let name = element.attribute("name").map_or_else(|| format!("actuator{}", found.robot.actuators.len()), str::to_owned);
        if found.robot.actuators.iter().any(|other| other.name == name) {
            return Err(element.error_at("name", "another actuator has this name; names must be unique"));
        }
        for name in ["armature", "damping", "delay"] {
            if of.numbers(name)?.is_some_and(|numbers| numbers.iter().any(|n| *n != 0.0)) {
                found.remarks.add(format!("{about} {name}"), element.line(), "not read", true);
            }
        }
        let gear = of.numbers("gear")?.and_then(|gear| gear.first().copied()).unwrap_or(1.0);
        let force = largest(&of, "forcelimited", "forcerange", compiler)?;
        let command = largest(&of, "ctrllimited", "ctrlrange", compiler)?;
        if [force, command].into_iter().flatten().any(|(low, high)| -low != high) {
            let message = "its limits differ by direction; the wider one is used for both";
            found.remarks.add(about, element.line(), message, true);
        }
        let widest = |range: Option<(f64, f64)>| range.map_or(f64::INFINITY, |(low, high)| low.abs().max(high.abs()));
        let limit = gear.abs() * widest(force).min(gain.abs() * widest(command));
        found.robot.actuators.push(Actuator { name, joint, gear: gain * gear, limit: if limit.is_nan() { f64::INFINITY } else { limit } });
    }
    Ok(())
}

/// Force per unit of command before the gear; `None` for what is no plain motor.
fn gain(of: &Styled) -> Result<Option<f64>, FileError> {
    let is = |name: &str, plain: &str| of.text(name).is_none_or(|(_, text)| text == plain);
    match of.element.tag() {
        "motor" => Ok(Some(1.0)),
        "general" if is("gaintype", "fixed") && is("biastype", "none") && is("dyntype", "none") => {
            Ok(Some(of.numbers("gainprm")?.and_then(|numbers| numbers.first().copied()).unwrap_or(1.0)))
        }
        _ => Ok(None),
    }
}

/// A range where it is in force.
fn largest(of: &Styled, flag: &str, range: &str, compiler: &Compiler) -> Result<Option<(f64, f64)>, FileError> {
    if !of.limited(flag, range, compiler.autolimits)? {
        return Ok(None);
    }
    let [low, high] = of.array::<2>(range)?.unwrap_or([0.0; 2]);
    if low >= high {
        return Err(of.element.error_at(range, format!("expected the lower limit first, found {low} and {high}")));
    }
    Ok(Some((low, high)))
}
