//! Sub-chains: the device with bodies locked or taken off, for identification by successive isolation
//! (Kuchenbecker & Niemeyer 2005, section III).

use crate::model::{Model, OutputKind, Place};

/// Why a sub-chain cannot be made; one sentence.
pub type IsolateError = String;

impl Model {
    /// Locks bodies to ground: elements that ended on them end on ground.
    ///
    /// An input or output on a locked body is an error, for it would be meaningless.
    pub fn lock(&mut self, names: &[String]) -> Result<(), IsolateError> {
        for name in names {
            let body = self.body_named(name)?;
            self.drop_body(body, name, false)?;
        }
        Ok(())
    }

    /// Takes every other body off, with the elements that end on it.
    ///
    /// An axis whose user's body is gone is held at the body whose position it measures.
    pub fn keep(&mut self, names: &[String]) -> Result<(), IsolateError> {
        for name in names {
            self.body_named(name)?;
        }
        let others: Vec<String> = self.bodies.iter().map(|b| b.name.clone()).filter(|n| !names.contains(n)).collect();
        for name in &others {
            let body = self.body_named(name)?;
            self.drop_body(body, name, true)?;
        }
        Ok(())
    }

    /// Index of a body by its name.
    pub fn body_named(&self, name: &str) -> Result<usize, IsolateError> {
        let known = || self.bodies.iter().map(|b| b.name.as_str());
        known().position(|n| n == name).ok_or_else(|| crate::tomlfile::unknown("body", name, known()))
    }

    fn drop_body(&mut self, body: usize, name: &str, with_elements: bool) -> Result<(), IsolateError> {
        if let Some(input) = self.inputs.iter().find(|i| i.on == body) {
            return Err(format!("body \"{name}\" is driven by the input \"{}\" and cannot be locked or taken off", input.name));
        }
        if self.arm.as_ref().is_some_and(|arm| arm.bodies.contains(&body)) {
            return Err(format!(
                "\"{name}\" is a joint of the robot and cannot be locked or taken off; make its type fixed in the robot file"
            ));
        }
        if self.is_point(body) {
            return Err(format!("\"{name}\" is a point of the robot and cannot be locked or taken off; leave the point out of the file"));
        }
        let renumber = |b: usize| if b > body { b - 1 } else { b };
        let kept: Vec<bool> = self.elements.iter().map(|e| !(with_elements && e.between.contains(&Some(body)))).collect();
        let new_index = |old: usize| kept[..old].iter().filter(|k| **k).count();
        for output in &mut self.outputs {
            output.kind = match &output.kind {
                OutputKind::Position(b) | OutputKind::Velocity(b) | OutputKind::Acceleration(b) | OutputKind::Reaction(b) if *b == body => {
                    return Err(format!("the output \"{}\" reads body \"{name}\", which is locked or taken off", output.name));
                }
                OutputKind::Position(b) => OutputKind::Position(renumber(*b)),
                OutputKind::Velocity(b) => OutputKind::Velocity(renumber(*b)),
                OutputKind::Acceleration(b) => OutputKind::Acceleration(renumber(*b)),
                OutputKind::Reaction(b) => OutputKind::Reaction(renumber(*b)),
                OutputKind::Force(elements) => match elements.iter().find(|e| !kept[**e]) {
                    Some(gone) => {
                        let element = &self.elements[*gone].name;
                        return Err(format!("the output \"{}\" reads element \"{element}\", which went with body \"{name}\"", output.name));
                    }
                    None => OutputKind::Force(elements.iter().map(|e| new_index(*e)).collect()),
                },
            };
        }
        for axis in &mut self.axes {
            axis.touches = axis.touches.iter().filter(|e| kept[**e]).map(|e| new_index(*e)).collect();
        }
        let mut index = 0;
        self.elements.retain(|_| {
            index += 1;
            kept[index - 1]
        });
        let place = |p: Place| p.filter(|b| *b != body).map(renumber);
        for element in &mut self.elements {
            element.between = element.between.map(place);
        }
        // What now joins ground to ground does nothing.
        let idle: Vec<bool> = self.elements.iter().map(|e| e.between == [None, None]).collect();
        let read = self.outputs.iter().any(|o| matches!(&o.kind, OutputKind::Force(list) if list.iter().any(|e| idle[*e])))
            || self.axes.iter().any(|axis| axis.touches.iter().any(|e| idle[*e]));
        if !read && idle.contains(&true) {
            let new_index = |old: usize| idle[..old].iter().filter(|k| !**k).count();
            for output in &mut self.outputs {
                if let OutputKind::Force(elements) = &mut output.kind {
                    elements.iter_mut().for_each(|e| *e = new_index(*e));
                }
            }
            self.axes.iter_mut().flat_map(|axis| &mut axis.touches).for_each(|e| *e = new_index(*e));
            let mut index = 0;
            self.elements.retain(|_| {
                index += 1;
                !idle[index - 1]
            });
        }
        for input in &mut self.inputs {
            input.on = renumber(input.on);
        }
        self.bodies.remove(body);
        if let Some(arm) = &mut self.arm {
            arm.bodies.iter_mut().for_each(|joint| *joint = renumber(*joint));
            arm.points.iter_mut().for_each(|point| point.body = renumber(point.body));
        }
        for axis in &mut self.axes {
            axis.user = if axis.user == body {
                match self.outputs[axis.measured].kind {
                    OutputKind::Position(b) => b,
                    _ => self.inputs[axis.feedback].on,
                }
            } else {
                renumber(axis.user)
            };
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use crate::model::Model;

    const CHAIN: &str = r#"
name = "chain"
[bodies]
motor = 0.01
drum = 0.02
handle = 0.04
[[elements]]
name = "friction"
kind = "coulomb"
between = ["drum", "ground"]
force = 0.1
[[elements]]
name = "cable"
kind = "spring"
between = ["motor", "drum"]
stiffness = 100.0
[[elements]]
name = "linkage"
kind = "spring"
between = ["drum", "handle"]
stiffness = 10.0
[[inputs]]
name = "force"
kind = "force"
on = "motor"
[[outputs]]
name = "position"
kind = "position"
of = "motor"
[[outputs]]
name = "cable_force"
kind = "force"
element = "cable"
[[axes]]
name = "x"
user = "handle"
feedback = "force"
measured = "position"
"#;

    fn names(model: &Model) -> (Vec<&str>, Vec<&str>) {
        (model.bodies.iter().map(|b| b.name.as_str()).collect(), model.elements.iter().map(|e| e.name.as_str()).collect())
    }

    #[test]
    fn sub_chains_keep_what_belongs_to_them() {
        let whole = Model::from_toml(CHAIN, "chain.toml").unwrap();
        let mut locked = whole.clone();
        locked.keep(&["motor".into(), "drum".into()]).unwrap();
        assert_eq!(names(&locked), (vec!["motor", "drum"], vec!["friction", "cable"]));
        locked.lock(&["drum".into()]).unwrap();
        assert_eq!(names(&locked), (vec!["motor"], vec!["cable"]));
        assert_eq!(locked.elements[0].between, [Some(0), None]);
        assert_eq!(locked.axes[0].user, 0);
        assert_eq!(locked.outputs[1].kind, crate::model::OutputKind::Force(vec![0]));
    }

    #[test]
    fn what_is_read_or_driven_stays() {
        let mut whole = Model::from_toml(CHAIN, "chain.toml").unwrap();
        assert!(whole.clone().lock(&["motor".into()]).unwrap_err().contains("driven by"));
        assert!(whole.clone().keep(&["motor".into()]).unwrap_err().contains("cable_force"));
        assert!(whole.lock(&["drumm".into()]).unwrap_err().contains("drum"));
    }
}
