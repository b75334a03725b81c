//! Which joint of MuJoCo each body of a model is.

use backdrive_plant::model::{InputKind, Model, Motion, OutputKind};
use backdrive_plant::robot::{Joint, JointKind};

/// How much heavier than all else a joint is that the program leads.
const HEAVY: f64 = 1e6;

/// The joints of a model, by body.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Layout {
    /// Names of the joints, which are those of the bodies.
    pub names: Vec<String>,
    /// Turning or sliding.
    pub kinds: Vec<JointKind>,
    /// Coordinate where the body's position is 0, m or rad.
    pub pose: Vec<f64>,
    /// The joint of the robot, as an index into `Robot::joints`; `None` for a body of the network alone.
    pub in_robot: Vec<Option<usize>>,
    /// Inertia of each body, kg or kg m²; of one that the program leads a great one.
    pub inertia: Vec<f64>,
    /// Limits of motion that the model's axes state, m or rad.
    pub travel: Vec<Option<[f64; 2]>>,
}

impl Layout {
    pub(super) fn of(model: &Model) -> Layout {
        let count = model.bodies.len();
        let kind = if model.motion == Motion::Rotation { JointKind::Revolute } else { JointKind::Prismatic };
        let mut layout = Layout {
            names: model.bodies.iter().map(|b| b.name.clone()).collect(),
            kinds: vec![kind; count],
            pose: vec![0.0; count],
            in_robot: vec![None; count],
            inertia: model.bodies.iter().map(|b| b.inertia).collect(),
            travel: vec![None; count],
        };
        if let Some(arm) = &model.arm {
            for ((coordinate, body), pose) in arm.tree.coordinates().iter().zip(&arm.bodies).zip(&arm.pose) {
                if *body < count {
                    layout.kinds[*body] = coordinate.kind;
                    layout.pose[*body] = *pose;
                    layout.in_robot[*body] = Some(coordinate.joint);
                }
            }
        }
        let all: f64 = layout.inertia.iter().sum();
        let heavy = HEAVY * if all > 0.0 { all } else { 1.0 };
        for input in model.inputs.iter().filter(|i| i.kind == InputKind::Motion) {
            if let Some(inertia) = layout.inertia.get_mut(input.on) {
                *inertia = heavy;
            }
        }
        layout.read_travel(model);
        layout
    }

    fn read_travel(&mut self, model: &Model) {
        for axis in &model.axes {
            let (Some(travel), Some(output)) = (axis.travel, model.outputs.get(axis.measured)) else { continue };
            let OutputKind::Position(body) = output.kind else { continue };
            let per = axis.scale * output.gain;
            let [a, b] = travel.map(|x| x / per - output.offset);
            if a.is_finite() && b.is_finite() && a != b && self.in_robot.get(body) == Some(&None) {
                self.travel[body] = Some([a.min(b), a.max(b)]);
            }
        }
    }

    /// Whether any joint is the robot's and not at its reference when positions are 0.
    pub(super) fn is_posed(&self, joints: &[Joint]) -> bool {
        let reference = |joint: usize| joints.get(joint).map_or(0.0, |j| j.reference);
        self.in_robot.iter().zip(&self.pose).any(|(joint, pose)| joint.is_some_and(|joint| *pose != reference(joint)))
    }
}
