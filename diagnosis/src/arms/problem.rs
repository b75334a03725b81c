//! A model with a robot, and the logs that it is compared with.

use crate::arms::error::ArmError;
use crate::arms::inertial::Bodies;
use crate::arms::log::{Log, joints_of, read_log};
use crate::arms::stated::{Stated, Unused};
use backdrive_plant::elements::Law;
use backdrive_plant::model::Model;
use backdrive_plant::recording::JointColumns;
use backdrive_plant::robot::{Robot, Tree};
use backdrive_plant::set::RecordingSet;
use std::path::{Path, PathBuf};

/// An element of the nominal model that acts on one joint against ground.
#[derive(Debug, Clone, PartialEq)]
pub struct Given {
    /// Its name in the model.
    pub name: String,
    /// Index in the model's elements.
    pub element: usize,
    /// The coordinate that it acts on.
    pub joint: usize,
    /// 1 where the joint is its first end, -1 where it is the second.
    pub sign: f64,
    /// Its law.
    pub law: Law,
}

/// A model with a robot and its logs.
#[derive(Debug, Clone)]
pub struct Problem {
    /// The nominal model.
    pub model: Model,
    /// Its file.
    pub model_file: PathBuf,
    /// The robot.
    pub robot: Robot,
    /// The same ready for computing, without armatures.
    pub tree: Tree,
    /// Its moving bodies.
    pub bodies: Bodies,
    /// Names of the joints, in the order of the coordinates.
    pub joints: Vec<String>,
    /// Inertia that turns with each joint alone, kg m² or kg: armature, and bodies of its network.
    pub armature: Vec<f64>,
    /// Whether the network of a joint has a motor behind a gear.
    pub geared: Vec<bool>,
    /// Elements between a joint (or a body of its network) and ground.
    pub given: Vec<Given>,
    /// Elements between two joints, whose torque is computed along the motion.
    pub stated: Vec<Stated>,
    /// Elements whose torque is not taken into account.
    pub unused: Vec<Unused>,
    /// What of the model the regression takes as rigid or leaves aside, in sentences.
    pub notes: Vec<String>,
    /// Where the joints stand in the files.
    pub columns: Vec<JointColumns>,
    /// Logs that a fit may see.
    pub fit: Vec<Log>,
    /// Logs that no fit may see.
    pub held_out: Vec<Log>,
}

impl Problem {
    /// Opens the logs of a set with its model, or another one.
    ///
    /// # Errors
    /// Where a file cannot be read, the model has no robot, or a log is of no use.
    pub fn open(set: &RecordingSet, model: Option<&Path>) -> Result<Problem, ArmError> {
        let mut set = set.clone();
        let model_file = model.map(Path::to_path_buf).or_else(|| set.model.clone()).unwrap_or_default();
        let model = Model::load(&model_file)?;
        let Some(arm) = model.arm.clone() else { return Err(ArmError::NoRobot(model_file.display().to_string())) };
        let first = set.fit.first().or(set.held_out.first()).cloned().ok_or(ArmError::NoLogs)?;
        let coordinates = arm.tree.coordinates();
        let columns = joints_of(&mut set, coordinates, &first)?;
        let read = |names: &[String]| names.iter().map(|name| read_log(&set, name, &columns, coordinates)).collect::<Result<Vec<_>, _>>();
        let (mut fit, mut held_out) = (read(&set.fit)?, read(&set.held_out)?);
        set.check_conditions(&model)?;
        for log in fit.iter_mut().chain(&mut held_out) {
            log.payload = set.rules_of(&log.name).payload.and_then(|payload| Some((arm.link_of(&payload).ok()?, payload)));
        }
        Problem::new(model, model_file, columns, fit, held_out)
    }

    /// From a model and its logs.
    ///
    /// # Errors
    /// Where the model has no robot, or nothing is to be fitted.
    pub fn new(
        model: Model,
        model_file: PathBuf,
        columns: Vec<JointColumns>,
        fit: Vec<Log>,
        held_out: Vec<Log>,
    ) -> Result<Problem, ArmError> {
        let Some(arm) = model.arm.clone() else { return Err(ArmError::NoRobot(model_file.display().to_string())) };
        if fit.is_empty() {
            return Err(ArmError::NoLogs);
        }
        let joints: Vec<String> = arm.tree.coordinates().iter().map(|c| c.name.clone()).collect();
        let bodies = Bodies::of(&arm.robot, &arm.tree);
        // What hangs on a joint is named after it: "elbow.rotor".
        let of_body = |body: usize| {
            let name = &model.bodies.get(body)?.name;
            joints.iter().position(|j| name == j || name.strip_prefix(j.as_str()).is_some_and(|rest| rest.starts_with('.')))
        };
        let mut armature = vec![0.0; joints.len()];
        let mut notes = Vec::new();
        for (index, body) in model.bodies.iter().enumerate() {
            match of_body(index) {
                Some(joint) => armature[joint] += body.inertia,
                None => notes.push(format!("body \"{}\" is attached to no joint and is ignored by the regression", body.name)),
            }
        }
        let (mut given, mut stated, mut unused) = (Vec::new(), Vec::new(), Vec::new());
        let mut geared = vec![false; joints.len()];
        for (index, element) in model.elements.iter().enumerate() {
            let (name, law) = (element.name.clone(), element.law.clone());
            let ends: Vec<(usize, f64)> =
                element.between.into_iter().zip([1.0, -1.0]).filter_map(|(end, sign)| Some((end?, sign))).collect();
            let on: Vec<(usize, f64)> = ends.iter().filter_map(|(body, sign)| Some((of_body(*body)?, *sign))).collect();
            match on.as_slice() {
                [(joint, sign)] if ends.len() == 1 => given.push(Given { name, element: index, joint: *joint, sign: *sign, law }),
                [(a, _), (b, _)] if a == b => {
                    geared[*a] = true;
                    notes.push(format!("the regression treats \"{name}\" as rigid; the simulation includes it"));
                }
                [_, _] => stated.push(Stated { name, ends: on, law }),
                _ if ends.is_empty() => {}
                _ => {
                    let bodies: Vec<&str> =
                        ends.iter().filter(|(body, _)| of_body(*body).is_none()).map(|(body, _)| model.place_name(Some(*body))).collect();
                    let why = format!("it acts on {}, which is no joint, and whose motion is not logged", bodies.join(" and "));
                    unused.push(Unused { name, kind: law.kind().name.to_string(), why });
                }
            }
        }
        let (robot, tree) = (arm.robot.clone(), arm.tree.clone());
        Ok(Problem {
            model,
            model_file,
            robot,
            tree,
            bodies,
            joints,
            armature,
            geared,
            given,
            stated,
            unused,
            notes,
            columns,
            fit,
            held_out,
        })
    }

    /// Whether a joint has no motor, as the set states it.
    pub fn is_passive(&self, joint: usize) -> bool {
        self.columns.get(joint).is_some_and(|columns| columns.is_passive)
    }

    /// Names of the joints without a motor.
    pub fn passive(&self) -> Vec<&str> {
        self.joints.iter().enumerate().filter(|(j, _)| self.is_passive(*j)).map(|(_, name)| name.as_str()).collect()
    }
}
