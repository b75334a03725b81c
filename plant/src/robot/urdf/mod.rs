//! URDF: the robots of ROS. What of the format describes bodies, joints, inertias and the joints' friction is read; the rest is remarked upon.
//!
//! The format is that of <https://wiki.ros.org/urdf/XML>. Frames: a link's is that of the joint which carries it; `rpy` are turns about the fixed x, y and z
//! axes, in this order.

mod joint;
mod link;
mod origin;

use super::description::{Link, Robot};
use super::found::Found;
use super::xml::Element;
use crate::tomlfile::FileError;

/// The name that a joint may give the world by, without a link of that name (Drake reads files so).
const WORLD: &str = "world";

pub(super) fn read(root: Element) -> Result<Found, FileError> {
    let mut found =
        Found { robot: Robot { name: root.attribute("name").unwrap_or_default().to_owned(), ..Robot::default() }, ..Found::default() };
    for element in root.children_named("link") {
        let link = link::read(element, &mut found.remarks)?;
        if found.robot.link(&link.name).is_some() {
            return Err(element.error("another link has this name; names must be unique"));
        }
        found.robot.links.push(link);
        found.link_lines.push(element.line());
    }
    if found.robot.links.is_empty() {
        return Err(root.error("has no <link>; a robot has at least its base"));
    }
    let joints = || root.children_named("joint");
    let named_world = |joint: Element| joint.children_named("parent").any(|parent| parent.attribute("link") == Some(WORLD));
    if found.robot.link(WORLD).is_none() && joints().any(named_world) {
        found.robot.links.insert(0, Link { name: WORLD.to_owned(), inertia: None });
        found.link_lines.insert(0, root.line());
    }
    base_first(root, &mut found)?;
    for element in joints() {
        let joint = joint::read(element, &found.robot, &mut found.remarks)?;
        if found.robot.joint(&joint.name).is_some() {
            return Err(element.error("another joint has this name; names must be unique"));
        }
        found.robot.joints.push(joint);
        found.joint_lines.push(element.line());
    }
    for element in root.children() {
        let (message, matters) = match element.tag() {
            "link" | "joint" => continue,
            "material" => ("colours do not move", false),
            "transmission" => ("not read: motors and gears are the network of a joint in the model file", true),
            "gazebo" => ("ignored: it is for one particular simulator", true),
            "sensor" => ("ignored: measured signals are outputs of the model file", false),
            _ => ("not known, and not read", true),
        };
        found.remarks.add(format!("<{}>", element.tag()), element.line(), message, matters);
    }
    Ok(found)
}

/// Puts the one link first that no joint carries.
fn base_first(root: Element, found: &mut Found) -> Result<(), FileError> {
    let carried: Vec<&str> =
        root.children_named("joint").flat_map(|j| j.children_named("child")).filter_map(|c| c.attribute("link")).collect();
    let base = found.robot.links.iter().position(|link| !carried.contains(&link.name.as_str()));
    let Some(base) = base else {
        return Err(root.error(
            "every link is the child of a joint: the links form a loop, and a tree with one base is expected; leave one joint out",
        ));
    };
    let link = found.robot.links.remove(base);
    found.robot.links.insert(0, link);
    let line = found.link_lines.remove(base);
    found.link_lines.insert(0, line);
    Ok(())
}
