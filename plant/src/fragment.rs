//! Attaching a grip or an environment to a body of a device.

use crate::model::{Fragment, Hold, Input, InputKind, Model, Output, OutputKind, Place};

impl Fragment {
    /// The same fragment held `factor` times as firmly: every force of it scaled, of a spring its stiffness, of a damper its damping, of friction its
    /// level. Masses stay.
    pub fn scale(&mut self, factor: f64) {
        self.network.elements.iter_mut().for_each(|element| element.law = element.law.scaled(factor));
    }

    /// The fragment by itself, its port moved from outside: input `displacement` (m or rad, hold cubic), and output `force` (N or N m), what it
    /// takes to move the port. Both come before the fragment's own.
    pub fn driven(&self) -> Model {
        let mut model = self.network.clone();
        let kind = OutputKind::Reaction(0);
        model.inputs.insert(0, Input::ideal("displacement", InputKind::Motion, 0, Hold::Cubic));
        model
            .outputs
            .insert(0, Output { name: "force".to_string(), kind, gain: 1.0, delay: 0.0, offset: 0.0, resolution: 0.0, noise: 0.0 });
        model
    }
}

/// What [`Model::attach`] added, as indices into the model it was added to.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Attached {
    /// The prefix that was used; differs from the one asked for where that was taken.
    pub prefix: String,
    /// The fragment's bodies (without its port), in its order.
    pub bodies: Vec<usize>,
    /// The fragment's elements, in its order.
    pub elements: Vec<usize>,
    /// Those of them whose first end is the port: each pushes the device's body with `-f`.
    pub port_first: Vec<usize>,
    /// Those of them whose second end is the port: each pushes the device's body with `+f`.
    pub port_second: Vec<usize>,
    /// The input, `prefix.hand`, that prescribes the operator's intent; `None` where the fragment has no hand.
    pub hand_input: Option<usize>,
}

/// Outputs whose difference is the force of a fragment on the body it is attached to.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct PortForce {
    minus: Option<usize>,
    plus: Option<usize>,
}

impl PortForce {
    /// Force of the fragment on the device's body along +x, N or N m; `outputs` are the model's, in its order.
    pub fn of(&self, outputs: &[f64]) -> f64 {
        let value = |index: Option<usize>| index.and_then(|i| outputs.get(i)).copied().unwrap_or(0.0);
        value(self.plus) - value(self.minus)
    }
}

impl Model {
    /// The model with a grip on every axis that a hand can hold, and for each of these axes the input that is its hand.
    pub fn held_by(&self, grip: &Fragment) -> (Model, Vec<(usize, usize)>) {
        let (mut held, mut hands) = (self.clone(), Vec::new());
        for (number, axis) in self.axes.iter().enumerate().filter(|(_, axis)| !axis.holds_user) {
            let name = &grip.network.name;
            let prefix = if self.axes.len() > 1 { format!("{name}{number}") } else { name.clone() };
            hands.extend(held.attach(grip, axis.user, &prefix).hand_input.map(|hand| (number, hand)));
            held.axes[number].holds_user = true;
        }
        (held, hands)
    }

    /// Scales every force between a hand that is part of the model (a body on a motion input) and what it holds; how many elements that were.
    pub fn scale_own_hand(&mut self, factor: f64) -> usize {
        let hands: Vec<usize> = self.inputs.iter().filter(|i| i.kind == InputKind::Motion).map(|i| i.on).collect();
        let of_hand = |between: &[Place; 2]| between.iter().flatten().any(|body| hands.contains(body));
        let held = self.elements.iter_mut().filter(|e| of_hand(&e.between));
        held.map(|element| element.law = element.law.scaled(factor)).count()
    }

    /// Of each axis whose user is part of the model, the input that is its hand, if it has one: a motion that drives no axis, in the order of the axes.
    pub fn own_hands(&self) -> Vec<(usize, usize)> {
        let drives = |i: usize| self.axes.iter().any(|axis| axis.feedback == i);
        let hands = (0..self.inputs.len()).filter(|i| self.inputs[*i].kind == InputKind::Motion && !drives(*i));
        let held = self.axes.iter().enumerate().filter(|(_, axis)| axis.holds_user).map(|(number, _)| number);
        held.zip(hands).collect()
    }

    /// Adds a fragment's bodies, elements, inputs and outputs, its port being body `user` of this model.
    ///
    /// Names are prefixed: `grip.spring`. Where `prefix` is taken already, `prefix2`, `prefix3`, ... is
    /// used. A hand that the fragment does not move itself gets a motion input `prefix.hand` (hold linear).
    pub fn attach(&mut self, fragment: &Fragment, user: usize, prefix: &str) -> Attached {
        let prefix = self.free_prefix(prefix);
        let named = |name: &str| format!("{prefix}.{name}");
        let network = &fragment.network;
        // Body 0 of a fragment is its port, so body i > 0 comes to lie at `first_body + i - 1`.
        let first_body = self.bodies.len();
        let body = |index: usize| if index == 0 { user } else { first_body + index - 1 };
        let first_element = self.elements.len();

        let mut attached = Attached { prefix: prefix.clone(), ..Attached::default() };
        for b in network.bodies.iter().skip(1) {
            attached.bodies.push(self.bodies.len());
            self.bodies.push(crate::model::Body { name: named(&b.name), inertia: b.inertia });
        }
        for e in &network.elements {
            let index = self.elements.len();
            attached.elements.push(index);
            match e.between {
                [Some(0), _] => attached.port_first.push(index),
                [_, Some(0)] => attached.port_second.push(index),
                _ => {}
            }
            let between = e.between.map(|place: Place| place.map(body));
            self.elements.push(crate::model::Element { name: named(&e.name), between, law: e.law.clone() });
        }
        for i in &network.inputs {
            if i.kind == InputKind::Motion && Some(i.on) == fragment.hand {
                attached.hand_input = Some(self.inputs.len());
            }
            self.inputs.push(Input { name: named(&i.name), on: body(i.on), ..i.clone() });
        }
        for o in &network.outputs {
            let kind = match &o.kind {
                OutputKind::Position(b) => OutputKind::Position(body(*b)),
                OutputKind::Velocity(b) => OutputKind::Velocity(body(*b)),
                OutputKind::Acceleration(b) => OutputKind::Acceleration(body(*b)),
                OutputKind::Reaction(b) => OutputKind::Reaction(body(*b)),
                OutputKind::Force(elements) => OutputKind::Force(elements.iter().map(|e| first_element + e).collect()),
            };
            self.outputs.push(Output { name: named(&o.name), kind, ..o.clone() });
        }
        if let (Some(hand), None) = (fragment.hand, attached.hand_input) {
            attached.hand_input = Some(self.inputs.len());
            self.inputs.push(Input::ideal(&named("hand"), InputKind::Motion, body(hand), Hold::Linear));
        }
        attached
    }

    /// Adds the outputs from which the force of an attached fragment on its body is read, named
    /// `prefix.port_force` (and `prefix.port_force_second`, where elements end on the port with their second end).
    pub fn add_port_force(&mut self, attached: &Attached) -> PortForce {
        let mut add = |elements: &[usize], suffix: &str| {
            (!elements.is_empty()).then(|| {
                let name = format!("{}.{suffix}", attached.prefix);
                self.outputs.push(Output {
                    name,
                    kind: OutputKind::Force(elements.to_vec()),
                    gain: 1.0,
                    delay: 0.0,
                    offset: 0.0,
                    resolution: 0.0,
                    noise: 0.0,
                });
                self.outputs.len() - 1
            })
        };
        PortForce { minus: add(&attached.port_first, "port_force"), plus: add(&attached.port_second, "port_force_second") }
    }

    fn free_prefix(&self, wanted: &str) -> String {
        let taken = |prefix: &str| {
            let names = self.bodies.iter().map(|b| &b.name).chain(self.elements.iter().map(|e| &e.name));
            let names = names.chain(self.inputs.iter().map(|i| &i.name)).chain(self.outputs.iter().map(|o| &o.name));
            names.into_iter().any(|name| name.strip_prefix(prefix).is_some_and(|rest| rest.starts_with('.')))
        };
        if !taken(wanted) {
            return wanted.to_string();
        }
        (2..).map(|n| format!("{wanted}{n}")).find(|prefix| !taken(prefix)).unwrap_or_else(|| wanted.to_string())
    }
}
