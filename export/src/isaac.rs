//! Isaac Lab 2.3 on Isaac Sim 5: the joints of a robot as an actuator configuration.
//!
//! `isaaclab.actuators.ActuatorBaseCfg` (<https://isaac-sim.github.io/IsaacLab/v2.3.2/source/api/lab/isaaclab.actuators.html>) gives, by joint and in rad:
//! - `armature`, added to the inertia in joint space, kg m² or kg;
//! - `friction` and `dynamic_friction`, dry friction at rest and in motion. From Isaac Sim 5.0 on they are efforts, N m or N (PhysX 5.6
//!   `PxJointFrictionParams`); in 4.5 they were shares of the force that the joint transmits, so these values are wrong there;
//! - `viscous_friction`, N m s/rad or N s/m. In USD itself (`physxJointAxis:angular:viscousFrictionCoefficient`) it is per degree: Isaac Lab converts;
//! - `effort_limit_sim` and `velocity_limit_sim`, of the solver.
//!
//! `stiffness` and `damping` there are gains of a drive to a commanded position and are 0, so that commands are efforts.

use crate::joint_terms::{JointTerms, Knows, joint_terms};
use crate::{ExportError, Exported, of_robot};
use backdrive_plant::model::Model;
use backdrive_plant::robot::Joint;

/// A joint's name, its description in the file, and its present terms.
type Row<'a> = (&'a str, &'a Joint, JointTerms);

/// The joints of a model's robot as a Python file with one `ImplicitActuatorCfg`.
///
/// # Errors
/// Where the model has no robot.
pub fn export(model: &Model) -> Result<Exported, ExportError> {
    let Some(arm) = &model.arm else {
        return Err(ExportError::new(
            "Isaac's parameters are those of a robot's joints, and this model has no [robot]; --to mjcf takes networks of one axis",
        ));
    };
    let held = of_robot(model)?;
    let mut notes = Vec::new();
    let knows = Knows { target: "Isaac", armature: true, rest: true };
    let (terms, mut left_out) = joint_terms(model, arm, knows);
    left_out.extend(held);
    for left in left_out.iter_mut().filter(|left| left.kind == "delay") {
        left.why = "an implicit actuator has no delay; a DelayedPDActuatorCfg has one, in physics steps".to_owned();
    }
    let rows: Vec<Row> = arm
        .tree
        .coordinates()
        .iter()
        .zip(terms)
        .filter_map(|(c, terms)| arm.robot.joints.get(c.joint).map(|joint| (c.name.as_str(), joint, terms)))
        .collect();
    notes.extend([
        "friction and dynamic_friction are efforts (N m, N) from Isaac Sim 5.0 on; in Isaac Sim 4.5 they are unitless and mean something else".to_owned(),
        "links, their inertia and gravity come from the robot's own USD or URDF".to_owned(),
    ]);
    Ok(Exported { text: python(model, &rows), left_out, notes })
}

/// A text as Python writes it: JSON's strings are Python's.
fn quoted(text: &str) -> String {
    serde_json::Value::from(text).to_string()
}

/// A name as a regular expression that fits nothing else.
fn pattern(name: &str) -> String {
    let mut out = String::new();
    for c in name.chars() {
        if !c.is_alphanumeric() && c != '_' {
            out.push('\\');
        }
        out.push(c);
    }
    quoted(&out)
}

fn python(model: &Model, rows: &[Row]) -> String {
    let column = |name: &str, value: &dyn Fn(&Row) -> Option<f64>| {
        let said: Vec<String> = rows.iter().filter_map(|row| Some(format!("        {}: {:?},\n", pattern(row.0), value(row)?))).collect();
        if said.is_empty() { String::new() } else { format!("    {name}={{\n{}    }},\n", said.concat()) }
    };
    let finite = |x: f64| Some(x).filter(|x| x.is_finite());
    let title = if model.title.is_empty() { &model.name } else { &model.title };
    [
        format!(
            "# Joints of {}, for Isaac Lab 2.3 on Isaac Sim 5: N m, rad and s (N, m and s where a joint slides).\n",
            title.replace(['\n', '\r'], " ")
        ),
        "# Commands are efforts: the drive's stiffness and damping are 0.\n".to_owned(),
        "from isaaclab.actuators import ImplicitActuatorCfg\n\nJOINTS = ImplicitActuatorCfg(\n".to_owned(),
        format!("    joint_names_expr=[{}],\n", rows.iter().map(|row| pattern(row.0)).collect::<Vec<_>>().join(", ")),
        "    stiffness=0.0,\n    damping=0.0,\n".to_owned(),
        column("armature", &|row| Some(row.2.armature)),
        column("friction", &|row| Some(row.2.at_rest)),
        column("dynamic_friction", &|row| Some(row.2.friction)),
        column("viscous_friction", &|row| Some(row.2.damping)),
        column("effort_limit_sim", &|row| finite(row.2.effort.min(row.1.limits.effort.unwrap_or(f64::INFINITY)))),
        column("velocity_limit_sim", &|row| row.1.limits.velocity.and_then(finite)),
        ")\n".to_owned(),
    ]
    .concat()
}
