//! Hidden effects: physics at a place, how it changes a device, and which names for it are right.

mod answers;
mod sound;

pub use answers::Answer;

use crate::laws::{Damper, Law, Spring};
use crate::network::{Body, Element, GROUND, InputKind, Network, Place};
use serde::{Deserialize, Serialize};

/// Physics that is hidden. In a truth file it is `physics`, its name, and `parameters`, its true numbers.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(tag = "physics", content = "parameters", rename_all = "snake_case")]
pub enum Physics {
    /// More inertia on a body.
    Inertia {
        /// kg.
        inertia: f64,
    },
    /// A body in between that gives a joint a second spring: what joined the two before stays on the first one's side.
    SeriesCompliance {
        /// N/m, of the second spring.
        stiffness: f64,
        /// N s/m, beside it.
        damping: f64,
        /// kg, of the body in between.
        inertia: f64,
    },
    /// Dead time of an actuator.
    Delay {
        /// s.
        delay: f64,
    },
    /// First-order lag of an actuator.
    Bandwidth {
        /// Hz.
        bandwidth: f64,
    },
    /// Force that a motor loses to its speed.
    BackEmf {
        /// N per m/s.
        back_emf: f64,
    },
    /// Limit of an actuator's force.
    Saturation {
        /// N.
        saturation: f64,
    },
    /// A law of force between two places.
    #[serde(untagged)]
    Law(Law),
}

impl Physics {
    /// Its name, which for a law is the law's kind.
    pub fn name(&self) -> &'static str {
        match self {
            Physics::Law(law) => law.kind(),
            Physics::Inertia { .. } => "inertia",
            Physics::SeriesCompliance { .. } => "series_compliance",
            Physics::Delay { .. } => "delay",
            Physics::Bandwidth { .. } => "bandwidth",
            Physics::BackEmf { .. } => "back_emf",
            Physics::Saturation { .. } => "saturation",
        }
    }

    /// Whether a linear model can imitate it exactly, from wherever it rests.
    pub fn is_linear(&self) -> bool {
        match self {
            Physics::Law(law) => matches!(law, Law::Spring(_) | Law::Damper(_) | Law::Inerter(_) | Law::Bias(_)),
            Physics::Saturation { .. } => false,
            _ => true,
        }
    }

    /// Whether model files have exactly this form. The others are the hidden plant's own.
    pub fn is_in_formats(&self) -> bool {
        let own = matches!(self, Physics::Law(Law::BristleField(_) | Law::RoundedGap(_) | Law::WarmFriction(_) | Law::LoadFriction(_)));
        !own
    }
}

/// Where an effect sits.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Site {
    /// Between two bodies, or a body and `ground`.
    Between([String; 2]),
    /// At an input or an output.
    Signal(String),
}

impl Site {
    /// Whether one end is ground.
    fn is_at_ground(&self) -> bool {
        matches!(self, Site::Between(ends) if ends.iter().any(|end| end == GROUND))
    }

    /// Whether both are the same place, whichever end is named first.
    pub(crate) fn is_same_place(&self, other: &Site) -> bool {
        match (self, other) {
            (Site::Between([a, b]), Site::Between([c, d])) => (a == c && b == d) || (a == d && b == c),
            (Site::Signal(a), Site::Signal(b)) => a == b,
            _ => false,
        }
    }
}

/// A hidden effect.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Effect {
    /// What it is, with its true numbers.
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
    /// Names of physics that count as the right family, in the vocabulary of verdicts.
    pub family: Vec<String>,
}

/// An effect that does not fit the device.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum EffectError {
    /// The place or an element that the effect names is not there.
    #[error("effect \"{effect}\": the device has no {what} \"{name}\"; is this the truth of another device?")]
    Missing {
        /// Name of the physics.
        effect: &'static str,
        /// `body`, `element`, `force input` or `joint`.
        what: &'static str,
        /// The name.
        name: String,
    },
    /// The physics needs another sort of place.
    #[error("effect \"{effect}\" cannot sit there: it needs {needed}")]
    WrongSite {
        /// Name of the physics.
        effect: &'static str,
        /// `two bodies`, `a body and ground` or `a force input`.
        needed: &'static str,
    },
    /// A number is out of range.
    #[error("effect \"{effect}\": {key} = {value} is out of range, expected {expected}")]
    Number {
        /// Name of the physics.
        effect: &'static str,
        /// The number's name.
        key: &'static str,
        /// Its value.
        value: f64,
        /// What it must be.
        expected: &'static str,
    },
}

impl Effect {
    /// The effect with the answers that are right for it on this device.
    pub fn new(physics: Physics, site: Site, replaces: Vec<String>, network: &Network) -> Effect {
        let (nonlinear, in_formats, family) = (!physics.is_linear(), physics.is_in_formats(), answers::family(&physics));
        let mut effect = Effect { physics, site, replaces, nonlinear, in_formats, accept: Vec::new(), family };
        effect.accept = answers::answers(&effect, network);
        effect
    }

    /// Puts the effect into a device. `number` sets apart the names of what it adds.
    ///
    /// # Errors
    ///
    /// [`EffectError`] where the device has no such place or the effect's numbers are out of range. The device is then half changed.
    pub fn apply(&self, network: &mut Network, number: usize) -> Result<(), EffectError> {
        let effect = self.physics.name();
        if let Some((key, value, expected)) = sound::unsound(&self.physics) {
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
        if let Law::LoadFriction(friction) = law
            && network.element(&friction.joint).is_none()
        {
            return Err(self.missing("element", &friction.joint));
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
