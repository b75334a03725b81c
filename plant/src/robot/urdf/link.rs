//! Links of a URDF.

use super::origin::origin;
use crate::elements::Range;
use crate::robot::description::{Link, LinkInertia};
use crate::robot::found::Remarks;
use crate::robot::xml::Element;
use crate::tomlfile::FileError;
use nalgebra::Matrix3;

pub(super) fn read(element: Element, remarks: &mut Remarks) -> Result<Link, FileError> {
    let name = element.need_attribute("name")?.to_owned();
    let inertia = element.child("inertial")?.map(inertial).transpose()?;
    for child in element.children() {
        let (message, matters) = match child.tag() {
            "inertial" => continue,
            "visual" => ("pictures do not move", false),
            "collision" => ("contacts of the links with each other and with the surroundings are not computed", true),
            _ => ("not known, and not read", true),
        };
        remarks.add(format!("<{}>", child.tag()), child.line(), message, matters);
    }
    Ok(Link { name, inertia })
}

fn inertial(element: Element) -> Result<LinkInertia, FileError> {
    let place = origin(element.child("origin")?)?;
    let mass =
        element.need_child("mass", "give the link's mass, such as <mass value=\"1.2\"/>, kg")?.need_number("value", Range::NonNegative)?;
    let what = "give the link's inertia about its centre of mass: <inertia ixx= ixy= ixz= iyy= iyz= izz=/>, kg m²";
    let inertia = element.need_child("inertia", what)?;
    let number = |name: &str| inertia.need_number(name, Range::Any);
    let (xx, xy, xz) = (number("ixx")?, number("ixy")?, number("ixz")?);
    let (yy, yz, zz) = (number("iyy")?, number("iyz")?, number("izz")?);
    for (name, moment) in [("ixx", xx), ("iyy", yy), ("izz", zz)] {
        if moment < 0.0 {
            return Err(inertia.error_at(name, format!("a moment of inertia must be at least 0 kg m², is {moment}")));
        }
    }
    let own = Matrix3::new(xx, xy, xz, xy, yy, yz, xz, yz, zz);
    let turned = place.rotation * own * place.rotation.transpose();
    Ok(LinkInertia { mass, centre: place.translation, about_centre: 0.5 * (turned + turned.transpose()) })
}
