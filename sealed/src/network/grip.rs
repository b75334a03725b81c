//! A hand that holds a device.

use super::data::{Body, Element, Hold, Input, InputKind, Named, Network};

/// What joins the body that a hand holds to the hand's own motion.
#[derive(Debug, Clone, PartialEq)]
pub struct Grip {
    /// The file that states this.
    pub file: Named,
    /// Its elements; their places are [`Grip::PORT`], [`Grip::HAND`] and ground.
    pub(super) elements: Vec<Element>,
}

impl Grip {
    pub(super) const PORT: usize = 0;
    pub(super) const HAND: usize = 1;
}

impl Network {
    /// The device with a hand on every axis that takes one. It adds a body `hand` that the new input `intent` moves (m, straight from sample to
    /// sample), and the grip's elements between it and the axis's user. From the second axis on all are called after it, `side_hand` and
    /// `side_intent`. A device whose own parameters hold the hand stays unchanged.
    pub fn held(&self, grip: &Grip) -> Network {
        let mut held = self.clone();
        for axis in 0..self.axes.len() {
            if !self.axes[axis].holds_user && self.axes[axis].hand.is_none() {
                held.hold(axis, grip);
            }
        }
        held
    }

    fn hold(&mut self, axis: usize, grip: &Grip) {
        let user = self.axes[axis].user;
        let signal = |name: &str| self.input(name).is_some() || self.output(name).is_some();
        let element = |element: &Element| self.element(&format!("grip_{}", element.name)).is_some();
        let prefix = if self.body("hand").is_some() || signal("intent") || grip.elements.iter().any(element) {
            format!("{}_", self.axes[axis].name)
        } else {
            String::new()
        };
        let hand = self.bodies.len();
        self.bodies.push(Body { name: format!("{prefix}hand"), inertia: 0.0 });
        for element in &grip.elements {
            let place = |place| match place {
                Some(Grip::PORT) => Some(user),
                Some(_) => Some(hand),
                None => None,
            };
            let name = format!("{prefix}grip_{}", element.name);
            self.elements.push(Element { name, between: element.between.map(place), law: element.law.clone(), of_grip: true });
        }
        self.axes[axis].hand = Some(self.inputs.len());
        self.inputs.push(Input {
            name: format!("{prefix}intent"),
            kind: InputKind::Motion,
            on: hand,
            hold: Hold::Linear,
            gain: 1.0,
            saturation: f64::INFINITY,
            delay: 0.0,
            bandwidth: f64::INFINITY,
            back_emf: 0.0,
        });
        self.grip = Some(grip.file.clone());
    }
}
