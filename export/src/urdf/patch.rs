//! A URDF with the present joints, and everything else unchanged.

use super::write::UNSAID;
use crate::ExportError;
use crate::joint_terms::JointTerms;
use crate::xml::{Edits, number};
use backdrive_plant::robot::Robot;
use roxmltree::{Document, Node};

/// `terms` by joint of the robot; `None` for a joint that does not move.
pub(super) fn patched(xml: &str, robot: &Robot, terms: &[Option<JointTerms>], notes: &mut Vec<String>) -> Result<String, ExportError> {
    let document = Document::parse(xml).map_err(ExportError::new)?;
    let (mut edits, mut unsaid) = (Edits::default(), Vec::new());
    for node in document.root_element().children().filter(|n| n.has_tag_name("joint")) {
        let Some(index) = node.attribute("name").and_then(|name| robot.joint(name)) else { continue };
        let (Some(Some(terms)), Some(joint)) = (terms.get(index), robot.joints.get(index)) else { continue };
        let child = |tag: &str| node.children().find(|n: &Node| n.has_tag_name(tag));
        let wanted = [("damping", terms.damping, joint.damping), ("friction", terms.friction, joint.friction)];
        match child("dynamics") {
            Some(dynamics) => {
                wanted.iter().filter(|(_, is, was)| is != was).for_each(|(name, is, _)| edits.set(dynamics, name, &number(*is)));
            }
            None if wanted.iter().any(|(_, is, was)| is != was) => {
                let text = format!("<dynamics damping=\"{}\" friction=\"{}\"/>", number(terms.damping), number(terms.friction));
                edits.append(node, &format!("  {text}\n  "));
            }
            None => {}
        }
        // Other readers refuse a joint of these types that does not state both.
        let has_to = matches!(node.attribute("type"), Some("revolute" | "prismatic"));
        let effort = terms.effort;
        match child("limit") {
            Some(limit) => {
                if effort.is_finite() {
                    edits.set(limit, "effort", &number(effort));
                }
                for (name, value) in [("effort", UNSAID[1]), ("velocity", UNSAID[2])] {
                    if has_to && limit.attribute(name).is_none() && !(name == "effort" && effort.is_finite()) {
                        edits.set(limit, name, &number(value));
                        unsaid.push(joint.name.clone());
                    }
                }
            }
            None if has_to => {
                let effort = if effort.is_finite() { effort } else { UNSAID[1] };
                let text = format!("<limit effort=\"{}\" velocity=\"{}\"/>", number(effort), number(UNSAID[2]));
                edits.append(node, &format!("  {text}\n  "));
                unsaid.push(joint.name.clone());
            }
            None => {}
        }
    }
    unsaid.dedup();
    if !unsaid.is_empty() {
        notes.push(format!(
            "a URDF has to state the effort and speed of a joint: where the file does not, they are {:e}: {}",
            UNSAID[1],
            unsaid.join(", ")
        ));
    }
    Ok(edits.done(xml))
}
