//! A URDF with what its joints are now, and everything else as it was.

use crate::ExportError;
use crate::joint_terms::JointTerms;
use crate::xml::{Edits, number};
use backdrive_plant::robot::Robot;
use roxmltree::{Document, Node};

/// `terms` by joint of the robot; `None` for a joint that does not move.
pub(super) fn patched(xml: &str, robot: &Robot, terms: &[Option<JointTerms>]) -> Result<String, ExportError> {
    let document = Document::parse(xml).map_err(ExportError::new)?;
    let mut edits = Edits::default();
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
        if let (Some(limit), true) = (child("limit"), terms.effort.is_finite()) {
            edits.set(limit, "effort", &number(terms.effort));
        }
    }
    Ok(edits.done(xml))
}
