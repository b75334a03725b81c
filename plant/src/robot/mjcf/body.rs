//! `<body>`: links, the joints that carry them, and their inertia.

use super::compiler::{Compiler, FromGeoms, SAVE_WHOLE};
use super::defaults::{ClassIndex, Defaults, Styled};
use super::geom;
use super::joint::{self, Anchored};
use super::orientation::{placement, rotation};
use crate::elements::Range;
use crate::robot::description::{Joint, JointKind, Link, LinkInertia};
use crate::robot::found::Found;
use crate::robot::inertia::Inertia;
use crate::robot::spatial::Placement;
use crate::robot::xml::Element;
use crate::tomlfile::FileError;
use nalgebra::{Matrix3, Vector3};

/// Bodies within each other, at most.
const DEEPEST: usize = 200;

/// What a body is read in.
struct Around<'a, 'd> {
    compiler: &'d Compiler,
    defaults: &'d Defaults<'a>,
}

/// A body that is to be read.
struct Open<'a> {
    element: Element<'a>,
    /// The link that it hangs on, and where what holds the body (a frame) is in it.
    parent: usize,
    frame: Placement,
    class: ClassIndex,
    /// Whether the parent moves.
    moving: bool,
    depth: usize,
}

/// What a body holds, frames opened: an element, where its frame is in the body, its class.
type Held<'a> = (Element<'a>, Placement, ClassIndex);

pub(super) fn world<'a>(section: Element<'a>, compiler: &Compiler, defaults: &Defaults<'a>, found: &mut Found) -> Result<(), FileError> {
    let around = Around { compiler, defaults };
    let class = defaults.class(section, "childclass", 0)?;
    let held = around.held(section, class)?;
    let mut open: Vec<Open> = Vec::new();
    let within = |held: &[Held<'a>], parent: usize, moving: bool, depth: usize| -> Vec<Open<'a>> {
        let bodies = held.iter().filter(|(element, ..)| element.tag() == "body").rev();
        bodies.map(|(element, frame, class)| Open { element: *element, parent, frame: *frame, class: *class, moving, depth }).collect()
    };
    if let Some((joint, ..)) = held.iter().find(|(element, ..)| matches!(element.tag(), "joint" | "freejoint")) {
        return Err(joint.error("is in <worldbody>, which does not move; put it into a <body>"));
    }
    open.extend(within(&held, 0, false, 1));
    while let Some(body) = open.pop() {
        if body.depth > DEEPEST {
            return Err(body.element.error(format!("more than {DEEPEST} bodies within each other")));
        }
        let (link, moving, held) = around.body(&body, found)?;
        open.extend(within(&held, link, moving, body.depth + 1));
    }
    Ok(())
}

impl<'a> Around<'a, '_> {
    /// Everything in a body or the world, with frames opened.
    fn held(&self, element: Element<'a>, class: ClassIndex) -> Result<Vec<Held<'a>>, FileError> {
        let mut found = Vec::new();
        let mut open: Vec<(Element<'a>, Placement, ClassIndex, usize)> =
            element.children().map(|e| (e, Placement::default(), class, 0)).collect();
        open.reverse();
        while let Some((element, frame, class, depth)) = open.pop() {
            match element.tag() {
                "frame" if depth < DEEPEST => {
                    let here = frame.then(&placement(&self.defaults.styled(element, class, &[])?, self.compiler)?);
                    let class = self.defaults.class(element, "childclass", class)?;
                    let mut inside: Vec<_> = element.children().map(|e| (e, here, class, depth + 1)).collect();
                    inside.reverse();
                    open.extend(inside);
                }
                "include" | "replicate" | "attach" | "composite" | "flexcomp" | "frame" => {
                    return Err(element.error(format!("<{}> is not opened here: {SAVE_WHOLE}", element.tag())));
                }
                _ => found.push((element, frame, class)),
            }
        }
        Ok(found)
    }

    /// Reads a body: the index of its link, whether it moves, and what it holds.
    fn body(&self, open: &Open<'a>, found: &mut Found) -> Result<(usize, bool, Vec<Held<'a>>), FileError> {
        let element = open.element;
        let name = match element.attribute("name") {
            Some(_) => element.need_attribute("name")?.to_owned(),
            None => format!("body{}", found.robot.links.len()),
        };
        if found.robot.link(&name).is_some() {
            return Err(element.error("another body has this name; names must be unique"));
        }
        let place = open.frame.then(&placement(&self.defaults.styled(element, open.class, &[])?, self.compiler)?);
        let class = self.defaults.class(element, "childclass", open.class)?;
        let held = self.held(element, class)?;
        if element.attribute("mocap") == Some("true") {
            found.remarks.add("<body mocap>", element.line(), "stands still here", true);
        }
        if element.number("gravcomp", Range::Any)?.is_some_and(|share| share != 0.0) {
            found.remarks.add(
                "<body gravcomp>",
                element.line(),
                "gravity is not compensated here; a bias in the joint's network can do it at one pose",
                true,
            );
        }
        let joints = self.joints(&name, &held, found)?;
        let moving = open.moving || !joints.is_empty();
        let link = carry(found, open, &name, &place, joints);
        if moving {
            found.robot.links[link].inertia = self.inertia(element, &held, found)?;
        }
        for (child, ..) in &held {
            let (message, matters) = match child.tag() {
                "geom" => ("contacts of the bodies with each other and with the surroundings are not computed", true),
                "site" | "camera" | "light" => ("not read: it does not move", false),
                "body" | "joint" | "inertial" => continue,
                "plugin" => ("plugins are not read", true),
                _ => ("not known, and not read", true),
            };
            found.remarks.add(format!("<{}>", child.tag()), child.line(), message, matters);
        }
        Ok((link, moving, held))
    }

    fn joints(&self, body: &str, held: &[Held<'a>], found: &mut Found) -> Result<Vec<(Anchored, usize)>, FileError> {
        let mut joints: Vec<(Anchored, usize)> = Vec::new();
        for (element, frame, class) in held {
            if element.tag() == "freejoint" {
                return Err(element.error("a body that floats is not computed; leave the joint out, and the body is fixed where it is"));
            }
            if element.tag() != "joint" {
                continue;
            }
            let name = match (element.attribute("name"), joints.len()) {
                (Some(_), _) => element.need_attribute("name")?.to_owned(),
                (None, 0) => format!("{body}_joint"),
                (None, count) => format!("{body}_joint{}", count + 1),
            };
            if found.robot.joint(&name).is_some() || joints.iter().any(|(other, _)| other.joint.name == name) {
                return Err(element.error(format!("another joint is called \"{name}\"; names must be unique")));
            }
            let of = self.defaults.styled(*element, *class, &["joint"])?;
            joints.push((joint::read(&of, &name, self.compiler, frame, &mut found.remarks)?, element.line()));
        }
        Ok(joints)
    }

    fn inertia(&self, element: Element<'a>, held: &[Held<'a>], found: &mut Found) -> Result<Option<LinkInertia>, FileError> {
        let inertial = element.child("inertial")?;
        match (inertial, self.compiler.from_geoms) {
            (Some(inertial), FromGeoms::Auto | FromGeoms::Never) => self.inertial(&self.defaults.styled(inertial, 0, &[])?).map(Some),
            (None, FromGeoms::Never) => Ok(None),
            (replaced, _) => {
                if let Some(inertial) = replaced {
                    found.remarks.add("<inertial>", inertial.line(), "not read: inertiafromgeom=\"true\" takes inertia from geoms", false);
                }
                self.inertia_of_geoms(held)
            }
        }
    }

    fn inertial(&self, of: &Styled) -> Result<LinkInertia, FileError> {
        let element = of.element;
        let mass = element.need_number("mass", Range::NonNegative)?;
        let centre = element.need_attribute("pos").and_then(|text| element.as_array::<3>("pos", text))?;
        let own = match (of.array::<3>("diaginertia")?, of.array::<6>("fullinertia")?) {
            (Some(_), Some(_)) => return Err(element.error("has both diaginertia and fullinertia; expected one of them")),
            (Some(moments), None) => Matrix3::from_diagonal(&Vector3::from(moments)),
            (None, Some([xx, yy, zz, xy, xz, yz])) => Matrix3::new(xx, xy, xz, xy, yy, yz, xz, yz, zz),
            (None, None) => return Err(element.error("has no inertia: give diaginertia or fullinertia, kg m²")),
        };
        let rotation = rotation(of, self.compiler)?;
        let turned = rotation * own * rotation.transpose();
        Ok(LinkInertia { mass, centre: Vector3::from(centre), about_centre: 0.5 * (turned + turned.transpose()) })
    }

    fn inertia_of_geoms(&self, held: &[Held<'a>]) -> Result<Option<LinkInertia>, FileError> {
        let mut sum = Inertia::default();
        for (element, frame, class) in held.iter().filter(|(element, ..)| element.tag() == "geom") {
            sum += geom::inertia(&self.defaults.styled(*element, *class, &["geom"])?, self.compiler, frame)?;
        }
        if sum.mass == 0.0 {
            return Ok(None);
        }
        let centre = sum.first_moment / sum.mass;
        let cross = centre.cross_matrix();
        let about_centre = sum.rotational + sum.mass * (cross * cross);
        Ok(Some(LinkInertia { mass: sum.mass, centre, about_centre: 0.5 * (about_centre + about_centre.transpose()) }))
    }
}

/// Adds a body and the joints that carry it: one after the other, with links of no mass between them; the index of its link.
fn carry(found: &mut Found, open: &Open, name: &str, place: &Placement, joints: Vec<(Anchored, usize)>) -> usize {
    let mut push = |mut joint: Joint, line: usize, link: &str| -> usize {
        let child = found.robot.links.len();
        joint.child = child;
        found.robot.joints.push(joint);
        found.joint_lines.push(line);
        found.robot.links.push(Link { name: link.to_owned(), inertia: None });
        found.link_lines.push(open.element.line());
        child
    };
    // Where the body's frame is in the link that comes last.
    let (mut parent, mut body) = (open.parent, *place);
    let count = joints.len();
    for (index, (Anchored { mut joint, anchor }, line)) in joints.into_iter().enumerate() {
        joint.parent = parent;
        joint.origin = body.then(&Placement::at(anchor));
        body = Placement::at(-anchor);
        let is_body = index + 1 == count && anchor == Vector3::zeros();
        let link = if is_body { name.to_owned() } else { format!("{name}:{}", joint.name) };
        parent = push(joint, line, &link);
        if is_body {
            return parent;
        }
    }
    let mut weld = Joint::new(&format!("{name}:weld"), JointKind::Fixed, parent, 0);
    weld.origin = body;
    push(weld, open.element.line(), name)
}
