//! The network as a drawing of lines.

use super::robot::motions;
use crate::model::{InputKind, Model, Motion, OutputKind, Place};

/// Draws the network downwards, from the first driven body on: each body, what ties it to ground, what pushes
/// and reads it, and the elements that lead to the next. Branches are set in.
pub fn diagram(model: &Model) -> String {
    let (drawn, tied) = (vec![false; model.bodies.len()], vec![false; model.elements.len()]);
    let mut drawing = Drawing { model, motions: motions(model), drawn, tied, lines: Vec::new() };
    // A prescribed body comes first: it is where the motion enters.
    let driven = model.inputs.iter().filter(|i| i.kind == InputKind::Motion).chain(&model.inputs).map(|i| i.on);
    let starts: Vec<usize> = driven.chain(0..model.bodies.len()).collect();
    for start in starts {
        if !drawing.drawn[start] {
            if !drawing.lines.is_empty() {
                drawing.lines.push(String::new());
            }
            drawing.body(start, "");
        }
    }
    let mut text = drawing.lines.join("\n");
    text.push('\n');
    text
}

struct Drawing<'a> {
    model: &'a Model,
    motions: Vec<Motion>,
    drawn: Vec<bool>,
    tied: Vec<bool>,
    lines: Vec<String>,
}

impl Drawing<'_> {
    fn body(&mut self, body: usize, indent: &str) {
        self.drawn[body] = true;
        let unit = super::units::unit_for(self.motions[body], "kg");
        let b = &self.model.bodies[body];
        let is_joint = self.model.arm.as_ref().is_some_and(|arm| arm.bodies.contains(&body));
        let inertia = match (is_joint, b.inertia) {
            (false, _) if self.model.is_point(body) => "point of the robot".to_string(),
            (true, 0.0) => "joint of the robot".to_string(),
            (true, armature) => format!("joint of the robot, armature {armature} {unit}"),
            (false, inertia) => format!("{inertia} {unit}"),
        };
        self.lines.push(format!("{indent}[{}] {inertia}{}", b.name, self.notes(body)));
        let to_ground = self.between(Some(body), None);
        if !to_ground.is_empty() {
            self.lines.push(format!("{indent}  |-- ground: {}", self.names(&to_ground)));
        }
        let neighbours: Vec<usize> =
            (0..self.model.bodies.len()).filter(|other| !self.between(Some(body), Some(*other)).is_empty()).collect();
        // Set in where the chain branches, so that each branch stands under its body.
        let ahead = neighbours.iter().filter(|n| !self.drawn[**n]).count();
        for other in neighbours {
            let ties = self.between(Some(body), Some(other));
            if ties.is_empty() || ties.iter().all(|t| self.tied[*t]) {
                continue;
            }
            for tie in &ties {
                self.tied[*tie] = true;
            }
            if self.drawn[other] {
                self.lines.push(format!("{indent}  |-- back to [{}]: {}", self.model.bodies[other].name, self.names(&ties)));
            } else {
                self.lines.push(format!("{indent}  |"));
                self.lines.push(format!("{indent}  +== {}", self.names(&ties)));
                self.lines.push(format!("{indent}  |"));
                let below = if ahead > 1 { format!("{indent}  |   ") } else { indent.to_string() };
                self.body(other, &below);
            }
        }
    }

    fn between(&self, a: Place, b: Place) -> Vec<usize> {
        let ends = |between: [Place; 2]| between == [a, b] || between == [b, a];
        (0..self.model.elements.len()).filter(|e| a != b && ends(self.model.elements[*e].between)).collect()
    }

    fn names(&self, elements: &[usize]) -> String {
        let one = |e: &usize| {
            let element = &self.model.elements[*e];
            format!("{} ({})", element.name, element.law.kind().name)
        };
        elements.iter().map(one).collect::<Vec<_>>().join(", ")
    }

    /// What pushes, moves, reads and holds a body.
    fn notes(&self, body: usize) -> String {
        let mut notes = String::new();
        for input in self.model.inputs.iter().filter(|i| i.on == body) {
            match input.kind {
                InputKind::Force => notes.push_str(&format!("   <== force {}", input.name)),
                InputKind::Motion => notes.push_str(&format!("   <== moved by {}", input.name)),
            }
        }
        for output in &self.model.outputs {
            let what = match output.kind {
                OutputKind::Position(of) if of == body => "position",
                OutputKind::Velocity(of) if of == body => "velocity",
                OutputKind::Acceleration(of) if of == body => "acceleration",
                OutputKind::Reaction(of) if of == body => "reaction",
                _ => continue,
            };
            notes.push_str(&format!("   ==> {what} {}", output.name));
        }
        for axis in self.model.axes.iter().filter(|a| a.user == body) {
            notes.push_str(&format!("   (axis {}: user)", axis.name));
        }
        notes
    }
}
