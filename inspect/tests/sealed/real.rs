//! Real recordings, where they are: cut to 30 s, with the roles that are known of their columns.

use super::draw::{Clean, Column, Role};
use backdrive_bags::{ImportOptions, raw_table};
use std::path::Path;

/// Where recordings of real devices are, which are not part of the project: beside it, or in `BACKDRIVE_DATA`.
fn folder() -> std::path::PathBuf {
    let beside = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../shared/data");
    std::env::var_os("BACKDRIVE_DATA").map_or(beside, Into::into)
}

/// Files, and of each column that is used its heading here, its joint and role.
type Used = (&'static str, &'static [(&'static str, &'static str, usize, Role)]);

const FILES: &[Used] = &[
    (
        "emps/emps_train.csv",
        &[("qref_m", "qref [m]", 0, Role::Command), ("q_m", "q [m]", 0, Role::Position), ("force_N", "force [N]", 0, Role::Drive)],
    ),
    ("tue_bilateral/m2_a_rigid.csv", TUE),
    ("tue_bilateral/m2_b_free_motion.csv", TUE),
    ("tue_bilateral/m2_c_spring.csv", TUE),
    ("so101/multisine.csv", SO101),
    ("so101/chirp_sweep.csv", SO101),
    ("so101/step_response.csv", SO101),
    ("so101/friction_gravity.csv", SO101),
];

const TUE: &[(&str, &str, usize, Role)] =
    &[("master_position", "leader.position [rad]", 0, Role::Leader), ("slave_position", "follower.position [rad]", 1, Role::Position)];

const SO101: &[(&str, &str, usize, Role)] = &[
    ("shoulder_pan.command", "shoulder_pan.command", 0, Role::Command),
    ("shoulder_pan.position", "shoulder_pan.position", 0, Role::Position),
    ("elbow_flex.command", "elbow_flex.command", 1, Role::Command),
    ("elbow_flex.position", "elbow_flex.position", 1, Role::Position),
    ("wrist_flex.command", "wrist_flex.command", 2, Role::Command),
    ("wrist_flex.position", "wrist_flex.position", 2, Role::Position),
];

/// The recordings that are there.
pub fn clean() -> Vec<Clean> {
    let mut out = Vec::new();
    for (file, used) in FILES {
        let path = folder().join(file);
        if !path.exists() {
            println!("skipped: {} is not here", path.display());
            continue;
        }
        let raw = raw_table(&path, &ImportOptions::default()).unwrap_or_else(|e| panic!("{e}"));
        let Some(stream) = raw.streams.first() else { continue };
        let Some(times) = stream.columns.first().map(|c| c.values.clone()) else { continue };
        let rate = (times.len() - 1) as f64 / (times[times.len() - 1] - times[0]);
        // The first rows of EMPS stand in its file a second time, 12480 rows later, digit for digit.
        let from = if file.starts_with("emps") { 20 } else { 0 };
        let rows = from..times.len().min(from + (30.0 * rate) as usize);
        let mut columns = vec![Column { heading: "t".to_string(), joint: 0, role: Role::Time, values: times[rows.clone()].to_vec() }];
        for (name, heading, joint, role) in *used {
            let Some(column) = stream.columns.iter().find(|c| c.name == *name) else { continue };
            columns.push(Column {
                heading: (*heading).to_string(),
                joint: *joint,
                role: *role,
                values: column.values[rows.clone()].to_vec(),
            });
        }
        out.push(Clean { kind: "real", rate, columns });
    }
    out
}
