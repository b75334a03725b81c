//! A URDF with the present masses and inertias of its links, and everything else unchanged.

use super::write::inertial;
use crate::ExportError;
use crate::xml::Edits;
use backdrive_plant::robot::Robot;
use roxmltree::Document;

/// The text of a robot's URDF with the inertias of `now` where they are not those of `was`, the robot that was read from it.
/// Joints, axes, limits, shapes and comments stay.
///
/// # Errors
/// Where the text is no XML.
pub fn with_inertias(xml: &str, was: &Robot, now: &Robot) -> Result<String, ExportError> {
    let document = Document::parse(xml).map_err(ExportError::new)?;
    let mut edits = Edits::default();
    for node in document.root_element().children().filter(|n| n.has_tag_name("link")) {
        let Some(index) = node.attribute("name").and_then(|name| now.link(name)) else { continue };
        let (Some(new), Some(old)) = (now.links.get(index), was.links.get(index)) else { continue };
        if new.inertia == old.inertia {
            continue;
        }
        match (node.children().find(|n| n.has_tag_name("inertial")), &new.inertia) {
            (Some(there), Some(inertia)) => edits.replace(there.range(), inertial(inertia)),
            (Some(there), None) => edits.remove(there),
            (None, Some(inertia)) => edits.append(node, &format!("  {}\n  ", inertial(inertia))),
            (None, None) => {}
        }
    }
    Ok(edits.done(xml))
}
