//! Hidden effects: a law at a place, how it changes a device, and which names for it are right.

pub(crate) mod answer;
mod answers;
mod error;
mod physics;
pub(crate) mod site;

pub use answer::Answer;
pub use error::EffectError;
pub use physics::Physics;
pub use site::Site;

use crate::laws::{Damper, Law, Load, Spring};
use crate::network::{Body, Element, InputKind, Network, Place};
use serde::{Deserialize, Serialize};

/// A hidden effect.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Effect {
    /// What it is, with its true parameters.
    #[serde(flatten)]
    pub physics: Physics,
    /// Where it sits, as `between` or `signal`. `between` runs as in the joint that it sits in.
    #[serde(flatten)]
    pub site: Site,
    /// Elements that it takes the place of; it keeps the first one's name.
    pub replaces: Vec<String>,
    /// Whether no linear model can imitate it exactly.
    pub nonlinear: bool,
    /// Whether model files have exactly this form; where not, `accept` has the nearest names.
    pub in_formats: bool,
    /// What counts as finding it.
    pub accept: Vec<Answer>,
    /// Names of effects that count as the right family, in the vocabulary of verdicts.
    pub family: Vec<String>,
}

impl Effect {
    /// The effect with the answers that are right for it on this device.
    pub fn new(physics: Physics, site: Site, replaces: Vec<String>, network: &Network) -> Effect {
        let (nonlinear, in_formats, family) = (!physics.is_linear(), physics.is_in_formats(), answers::family(&physics));
        let accept = answers::answers(&physics, &site, !replaces.is_empty(), network);
        Effect { physics, site, replaces, nonlinear, in_formats, accept, family }
    }

    /// Puts the effect into a device. `number` sets apart the names of what it adds.
    ///
    /// # Errors
    ///
    /// [`EffectError`] where the device has no such place or the effect's parameters are out of range. The device is then half changed.
    pub fn apply(&self, network: &mut Network, number: usize) -> Result<(), EffectError> {
        let effect = self.physics.name();
        if let Some((key, value, expected)) = self.physics.unsound() {
            return Err(EffectError::Number { effect, key, value, expected });
        }
        match &self.physics {
            Physics::Law(law) => self.apply_law(law, network, number),
            Physics::Inertia { inertia } => {
                let [a, b] = self.between(network)?;
                match (a, b) {
                    (Some(body), None) | (None, Some(body)) => network.bodies[body].inertia += inertia,
                    _ => return Err(EffectError::WrongSite { effect, needed: "a body and ground" }),
                }
                Ok(())
            }
            Physics::SeriesCompliance { stiffness, damping, inertia } => {
                self.apply_compliance(network, number, *stiffness, *damping, *inertia)
            }
            Physics::Delay { delay } => self.force_input(network).map(|input| network.inputs[input].delay += delay),
            Physics::Bandwidth { bandwidth } => {
                self.force_input(network).map(|input| network.inputs[input].bandwidth = network.inputs[input].bandwidth.min(*bandwidth))
            }
            Physics::BackEmf { back_emf } => self.force_input(network).map(|input| network.inputs[input].back_emf += back_emf),
            Physics::Saturation { saturation } => {
                self.force_input(network).map(|input| network.inputs[input].saturation = network.inputs[input].saturation.min(*saturation))
            }
        }
    }

    fn missing(&self, what: &'static str, name: &str) -> EffectError {
        EffectError::Missing { effect: self.physics.name(), what, name: name.to_string() }
    }

    fn between(&self, network: &Network) -> Result<[Place; 2], EffectError> {
        let Site::Between([first, second]) = &self.site else {
            return Err(EffectError::WrongSite { effect: self.physics.name(), needed: "two bodies" });
        };
        let place = |name: &String| network.place(name).ok_or_else(|| self.missing("body", name));
        Ok([place(first)?, place(second)?])
    }

    fn force_input(&self, network: &Network) -> Result<usize, EffectError> {
        let Site::Signal(name) = &self.site else {
            return Err(EffectError::WrongSite { effect: self.physics.name(), needed: "a force input" });
        };
        network.input(name).filter(|input| network.inputs[*input].kind == InputKind::Force).ok_or_else(|| self.missing("force input", name))
    }

    fn apply_law(&self, law: &Law, network: &mut Network, number: usize) -> Result<(), EffectError> {
        let between = self.between(network)?;
        if between[0] == between[1] {
            return Err(EffectError::WrongSite { effect: self.physics.name(), needed: "two bodies" });
        }
        if let Load::Element(joint) = law.to_force().load()
            && network.element(joint).is_none()
        {
            return Err(self.missing("element", joint));
        }
        for name in &self.replaces {
            network.element(name).ok_or_else(|| self.missing("element", name))?;
        }
        let hidden = |name: &str| Element { name: name.to_string(), between, law: law.clone(), of_grip: false };
        // Elements keep their indices, since outputs read them: one that is taken away is left without force.
        for (order, name) in self.replaces.iter().enumerate() {
            if let Some(index) = network.element(name) {
                network.elements[index] = if order == 0 {
                    hidden(name)
                } else {
                    Element { law: Law::Spring(Spring { stiffness: 0.0, rest: 0.0 }), ..network.elements[index].clone() }
                };
            }
        }
        if self.replaces.is_empty() {
            network.elements.push(hidden(&format!("hidden_{number}")));
        }
        Ok(())
    }

    fn apply_compliance(
        &self,
        network: &mut Network,
        number: usize,
        stiffness: f64,
        damping: f64,
        inertia: f64,
    ) -> Result<(), EffectError> {
        let [first, second] = self.between(network)?;
        let joint: Vec<usize> = (0..network.elements.len())
            .filter(|index| {
                let between = network.elements[*index].between;
                between == [first, second] || between == [second, first]
            })
            .collect();
        if joint.is_empty() {
            let Site::Between([a, b]) = &self.site else { return Ok(()) };
            return Err(self.missing("joint", &format!("{a}-{b}")));
        }
        let middle = network.bodies.len();
        network.bodies.push(Body { name: format!("hidden_{number}"), inertia });
        for index in joint {
            for end in &mut network.elements[index].between {
                if *end == second {
                    *end = Some(middle);
                }
            }
        }
        let between = [Some(middle), second];
        let laws = [("spring", Law::Spring(Spring { stiffness, rest: 0.0 })), ("damper", Law::Damper(Damper { damping }))];
        for (name, law) in laws {
            network.elements.push(Element { name: format!("hidden_{number}_{name}"), between, law, of_grip: false });
        }
        Ok(())
    }
}
