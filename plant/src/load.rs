//! What loads a friction contact: the joint whose force it passes on.
//!
//! - Friction between two bodies: the springs between these two.
//! - Friction between a body and ground, as of a screw in its bearing, a gear on its shaft or a cable in its guide. The load is the force of the
//!   springs between this body and another, the first other body that the model's elements join it with. Where they join it with none, its springs to
//!   ground.
//!
//! Springs are all elements whose force depends on displacement: linear ones, those along a path, and constant forces beside them. Dampers,
//! inerters and dry friction in the joint do not count. Where there is no such joint the load is 0.

use crate::elements::{Law, Role};
use crate::model::{Element, Model, Place};

/// The elements whose forces make the load of a friction contact, by index. Each has the sign (1 or -1) that makes it positive where it resists
/// motion of the contact forwards (of the first end of `element` against the second).
pub fn joint(model: &Model, element: usize) -> Vec<(usize, f64)> {
    let Some(contact) = model.elements.get(element) else { return Vec::new() };
    let Some((near, far)) = ends(model, contact) else { return Vec::new() };
    let counts = |law: &Law| match law.role() {
        Role::Linear(linear) => linear.stiffness != 0.0 || linear.force != 0.0,
        Role::Friction => false,
        Role::Path => law.slopes().stiffness > 0.0,
    };
    // Forwards is where `near` runs ahead: what stretches then resists.
    let forwards = if contact.between[0] == near { 1.0 } else { -1.0 };
    let sign = |other: &Element| match other.between {
        [a, b] if a == near && b == far => Some(forwards),
        [a, b] if a == far && b == near => Some(-forwards),
        _ => None,
    };
    let of_joint = |(index, other): (usize, &Element)| sign(other).filter(|_| counts(&other.law)).map(|sign| (index, sign));
    model.elements.iter().enumerate().filter_map(of_joint).collect()
}

/// The end of the contact that the joint is tied to, and the place at the joint's other end.
fn ends(model: &Model, contact: &Element) -> Option<(Place, Place)> {
    let is_spring = |law: &Law| match law.role() {
        Role::Linear(linear) => linear.stiffness != 0.0,
        Role::Friction => false,
        Role::Path => law.slopes().stiffness > 0.0,
    };
    let [first, second] = contact.between;
    let (body, other) = match (first, second) {
        (Some(_), Some(_)) => return Some((first, second)),
        (Some(_), None) | (None, Some(_)) => (first.or(second), None),
        (None, None) => return None,
    };
    let beyond = |element: &Element| match element.between {
        [a, b] if a == body && b.is_some() && b != body => Some(b),
        [a, b] if b == body && a.is_some() && a != body => Some(a),
        _ => None,
    };
    let far = model.elements.iter().filter(|element| is_spring(&element.law)).find_map(beyond);
    Some((body, far.unwrap_or(other)))
}

#[cfg(test)]
mod tests {
    use super::*;

    const CHAIN: &str = "[bodies]
motor = 1
drum = 1
handle = 1
[[elements]]
name = 'cable_damping'
kind = 'damper'
between = ['drum', 'handle']
damping = 1
[[elements]]
name = 'cable'
kind = 'spring'
between = ['motor', 'drum']
stiffness = 10
[[elements]]
name = 'gap'
kind = 'backlash'
between = ['drum', 'motor']
gap = 0.1
stiffness = 5
[[elements]]
name = 'linkage'
kind = 'spring'
between = ['drum', 'handle']
stiffness = 10
[[elements]]
name = 'centring'
kind = 'spring'
between = ['ground', 'drum']
stiffness = 10
";

    fn loaded(between: &str) -> Vec<(String, f64)> {
        let text = format!("{CHAIN}[[elements]]\nname = 'f'\nkind = 'coulomb'\nforce = 1\nbetween = {between}\n");
        let model = Model::from_toml(&text, "chain").unwrap();
        joint(&model, 5).into_iter().map(|(index, sign)| (model.elements[index].name.clone(), sign)).collect()
    }

    #[test]
    fn a_body_is_loaded_by_its_first_joint_and_two_bodies_by_what_is_between_them() {
        let of = |names: &[(&str, f64)]| names.iter().map(|(n, s)| (n.to_string(), *s)).collect::<Vec<_>>();
        // The drum pulls the cable out where it runs ahead of the motor.
        assert_eq!(loaded("['drum', 'ground']"), of(&[("cable", -1.0), ("gap", 1.0)]));
        assert_eq!(loaded("['ground', 'drum']"), of(&[("cable", 1.0), ("gap", -1.0)]));
        assert_eq!(loaded("['motor', 'ground']"), of(&[("cable", 1.0), ("gap", -1.0)]));
        assert_eq!(loaded("['handle', 'ground']"), of(&[("linkage", -1.0)]));
        assert_eq!(loaded("['handle', 'drum']"), of(&[("linkage", -1.0)]));
        assert_eq!(loaded("['motor', 'handle']"), of(&[]));
    }
}
