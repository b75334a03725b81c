//! Machines as they were logged, force in and motion out, from the model that a user writes first: a body with viscous friction.
//!
//! What is found stands beside least squares with inertia, viscous and dry friction and a constant, in the same band of frequencies.

use crate::run::{Ask, diagnose, said, solved, write};
use crate::table::Report;
use crate::{Context, Study, StudyError, csv_columns};
use backdrive_diagnosis::belief::choice::chosen;
use backdrive_diagnosis::belief::compare::predictions;
use backdrive_diagnosis::diagnose::Diagnosis;
use backdrive_diagnosis::recordings::problem::Record;
use backdrive_diagnosis::verdict::{Finding, Parameter};
use backdrive_signal::derivative;
use backdrive_signal::low_pass::LowPass;
use backdrive_signal::statistics::{deviation, rms};
use std::f64::consts::PI;
use std::path::Path;

pub(crate) const STUDY: Study = Study {
    name: "machines",
    about: "real machines as they were logged, force in and motion out, beside a model by least squares",
    needs: ("tue_bilateral", &["m2_a_spring.csv", "m2_a_free_motion.csv", "m2_c_foam.csv", "m2_c_rigid.csv", "m2_b_foam2.csv"]),
    run,
};

/// A machine: where its recordings are, and what is known of it.
struct Machine {
    name: &'static str,
    /// The folder in the data folder.
    folder: &'static str,
    files: &'static [&'static str],
    /// The first files that are fitted; the rest are held out.
    fitted: usize,
    time: Time,
    /// The column of the position, and its factor to rad or m.
    position: (&'static str, f64),
    /// Columns of the forces on the body, and their factors to N m or N.
    forces: &'static [(&'static str, f64)],
    motion: &'static str,
    /// Inertia that a user would write, kg m^2 or kg.
    inertia: f64,
    /// Viscous friction that a user would write.
    damping: f64,
    known: &'static str,
    source: &'static str,
    /// Whether the short part runs it.
    is_quick: bool,
}

/// The time source of a recording.
enum Time {
    /// A column, s.
    Column(&'static str),
    /// Evenly at this rate, Hz.
    Rate(f64),
}

const fn kuka(name: &'static str, position: &'static str, torque: &'static [(&'static str, f64)], is_quick: bool) -> Machine {
    Machine {
        name,
        folder: "kuka_kr300",
        files: &["traj_A.csv", "traj_B.csv", "traj_C.csv"],
        fitted: 2,
        time: Time::Rate(250.0),
        position: (position, PI / 180.0),
        forces: torque,
        motion: "rotation",
        inertia: 1.0,
        damping: 1.0,
        known: "dry friction; size not published",
        source: "",
        is_quick,
    }
}

const MACHINES: [Machine; 5] = [
    Machine {
        name: "lever in a hand",
        folder: "tue_bilateral",
        files: &[
            "m2_a_spring.csv",
            "m2_a_free_motion.csv",
            "m2_c_foam.csv",
            "m2_c_rigid.csv",
            "m2_b_foam2.csv",
            "m2_c_free_motion.csv",
            "m2_b_spring.csv",
        ],
        fitted: 4,
        time: Time::Rate(2000.0),
        position: ("master_position [rad]", 1.0),
        forces: &[("minus_hand_torque [N m]", 1.0), ("minus_master_torque [N m]", -1.0)],
        motion: "rotation",
        inertia: 1.0 / 631.36,
        damping: 0.01,
        known: "dry friction, about 25 mN m",
        source: "regression in the data's README",
        is_quick: false,
    },
    Machine {
        name: "EMPS",
        folder: "emps",
        files: &["emps_train.csv", "emps_test_pulses.csv"],
        fitted: 1,
        time: Time::Column("time_s"),
        position: ("q_m", 1.0),
        forces: &[("force_N", 1.0)],
        motion: "translation",
        inertia: 100.0,
        damping: 200.0,
        known: "dry friction, 20.4 N",
        source: "Janot, Gautier & Brunot 2019",
        is_quick: false,
    },
    kuka("KUKA axis 1", "posmot_deg_1", &[("torque_abs_Nm_1", 1.0)], false),
    kuka("KUKA axis 4", "posmot_deg_4", &[("torque_abs_Nm_4", 1.0)], false),
    kuka("KUKA axis 6", "posmot_deg_6", &[("torque_abs_Nm_6", 1.0)], true),
];

fn run(context: &Context) -> Result<Report, StudyError> {
    let mut report = Report::new("Machines as logged, force in and motion out");
    for machine in MACHINES.iter().filter(|m| m.is_quick || !context.quick) {
        let data = context.data.parent().unwrap_or(context.data).join(machine.folder);
        if !machine.files.iter().all(|file| data.join(file).is_file()) {
            report.notes.push(format!("{}: its recordings are not here ({})", machine.name, data.display()));
            continue;
        }
        one(&mut report, context, machine, &data)?;
    }
    report.notes.push(
        "Error: rms of the held-out force that is not explained over its standard deviation, below the band's corner. Least squares: inertia, viscous and dry \
         friction and a constant, fitted to the same samples."
            .to_string(),
    );
    Ok(report)
}

/// Prepares a machine's recordings, diagnoses, and writes its lines of the table.
fn one(report: &mut Report, context: &Context, machine: &Machine, data: &Path) -> Result<(), StudyError> {
    let name = machine.name.replace(' ', "-");
    let mut listed: [Vec<String>; 2] = Default::default();
    for (number, file) in machine.files.iter().enumerate() {
        let out = format!("{name}-{file}");
        prepare(machine, &data.join(file), &context.out.join(&out))?;
        listed[usize::from(number >= machine.fitted)].push(format!("{out:?}"));
    }
    let (model, set) = (format!("{name}.toml"), format!("{name}-set.toml"));
    write(&context.out.join(&model), &nominal(machine))?;
    let [fit, held_out] = listed.map(|files| files.join(", "));
    write(&context.out.join(&set), &format!("model = {model:?}\nfit = [{fit}]\nheld_out = [{held_out}]\ninitial = \"free\"\n"))?;
    let found = diagnose(context, &Ask { name: &name, set: &set, model: &model, without: &[], effects: 4, effort: 1.0 })?;
    report.word(machine.name, &said(&found.verdict));
    report.line(machine.name, said(&found.verdict), "", "", None);
    let friction = found.verdict.findings.iter().find_map(dry_friction);
    let sure = found.verdict.findings.iter().find(|f| dry_friction(f).is_some()).map_or(f64::NAN, |f| f.family_confidence);
    report.figure(&format!("{} friction", machine.name), friction.unwrap_or(f64::NAN));
    let measured = friction.map_or("not named".to_string(), |size| format!("{size:.3e} ({sure:.2} of its kind)"));
    report.line(&format!("{}, dry friction", machine.name), measured, machine.known, machine.source, Some(friction.is_some()));
    let Some(forces) = &found.search.forces else {
        let ours = found.verdict.held_out.nrmse_after;
        report.line(&format!("{}, error of the motion", machine.name), shown(ours), "", "decided by simulation", None);
        return Ok(());
    };
    let [ours, by_hand] = errors(&found, forces.corner_hz)?;
    report.figure(&format!("{} error", machine.name), ours);
    report.figure(&format!("{} error by least squares", machine.name), by_hand);
    let source = format!("least squares, below {} Hz", forces.corner_hz);
    report.line(&format!("{}, error", machine.name), shown(Some(ours)), shown(Some(by_hand)), &source, Some(ours <= by_hand));
    Ok(())
}

fn shown(error: Option<f64>) -> String {
    error.map_or("cannot be simulated".to_string(), |error| format!("{:.1} %", 100.0 * error))
}

/// The size of dry friction that a finding states, whichever of its laws it is.
fn dry_friction(finding: &Finding) -> Option<f64> {
    let key = match finding.physics.as_str() {
        "coulomb" | "warm_friction" => "force",
        "friction_deficit" | "stribeck" | "lugre" | "dahl" => "coulomb",
        "asymmetric_coulomb" => "positive",
        _ => return None,
    };
    match finding.parameters.get(key)? {
        Parameter::One(one) => Some(one.value),
        Parameter::List(list) => list.value.first().copied(),
    }
}

/// The model that a user writes first.
fn nominal(machine: &Machine) -> String {
    let Machine { motion, inertia, damping, forces, .. } = machine;
    let inputs: String = forces
        .iter()
        .map(|(column, gain)| (plain(column), gain))
        .map(|(name, gain)| format!("[[inputs]]\nname = {name:?}\nkind = \"force\"\non = \"body\"\ngain = {gain:?}\n"))
        .collect();
    format!(
        "name = \"machine\"\nmotion = {motion:?}\n[bodies]\nbody = {inertia:?}\n[[elements]]\nname = \"viscous\"\nkind = \"damper\"\n\
         between = [\"body\", \"ground\"]\ndamping = {damping:?}\n{inputs}[[outputs]]\nname = \"position\"\nkind = \"position\"\nof = \"body\"\n"
    )
}

/// The name of a column without its unit.
fn plain(column: &str) -> &str {
    column.split(' ').next().unwrap_or(column)
}

/// Writes a recording with the columns of the model.
fn prepare(machine: &Machine, from: &Path, to: &Path) -> Result<(), StudyError> {
    let mut names = vec![machine.position.0];
    names.extend(machine.forces.iter().map(|f| f.0));
    if let Time::Column(time) = machine.time {
        names.push(time);
    }
    let mut columns = csv_columns::read_at_least(from, &names, 1000)?;
    let t = match machine.time {
        Time::Column(_) => columns.pop().unwrap_or_default(),
        Time::Rate(rate) => (0..columns[0].len()).map(|row| row as f64 / rate).collect(),
    };
    columns[0].iter_mut().for_each(|q| *q *= machine.position.1);
    let mut heading = vec!["t", "position"];
    heading.extend(machine.forces.iter().map(|f| plain(f.0)));
    let all: Vec<&[f64]> = std::iter::once(t.as_slice()).chain(columns.iter().map(Vec::as_slice)).collect();
    csv_columns::write(to, &heading, &all)
}

/// Errors on the same samples of held-out recordings, in the band of the diagnosis: of what it found, and of inertia, viscous and dry friction and a constant
/// that were fitted by least squares.
fn errors(found: &Diagnosis, corner: f64) -> Result<[f64; 2], StudyError> {
    let missing = || StudyError::Diagnosis("the diagnosis kept no motion or no force of a recording".to_string());
    // A filter spoils the ends: a period of its corner is left out there.
    let kept = |record: &Record| {
        let ends = (1.0 / (corner * record.period)) as usize;
        ends..record.len.saturating_sub(ends)
    };
    let columns = |records: &[Record]| {
        let mut all = vec![Vec::new(); 5];
        for record in records {
            let motion = record.inputs.first().ok_or_else(missing)?;
            let force = record.outputs.first().and_then(Option::as_ref).ok_or_else(missing)?;
            let speed = derivative(motion, record.period);
            let signs: Vec<f64> = speed.iter().map(|v| v.signum()).collect();
            let sign = LowPass::butterworth(4, corner, 1.0 / record.period).both_ways(&signs);
            let acceleration = derivative(&speed, record.period);
            for row in kept(record) {
                let values = [acceleration[row], speed[row], sign[row], 1.0, force[row]];
                all.iter_mut().zip(values).for_each(|(column, value)| column.push(value));
            }
        }
        Ok::<_, StudyError>(all)
    };
    let (problem, best) = (&found.problem, chosen(&found.search));
    let (fitted, unseen) = (columns(&problem.fit)?, columns(&problem.held_out)?);
    let laws: Vec<&[f64]> = fitted[..4].iter().map(Vec::as_slice).collect();
    let numbers = solved(&laws, &fitted[4])?;
    let of_laws = |row: usize| numbers.iter().zip(&unseen).map(|(number, column)| number * column[row]).sum::<f64>();
    let predicted = predictions(problem, &problem.held_out, &best.structure, &best.fit.values).ok_or_else(missing)?;
    let of_diagnosis = problem.held_out.iter().zip(&predicted).flat_map(|(record, predicted)| {
        let force = predicted.first().and_then(Option::as_deref).unwrap_or_default();
        kept(record).map(|row| force[row]).collect::<Vec<f64>>()
    });
    let force = &unseen[4];
    let left =
        [rms(of_diagnosis.zip(force).map(|(ours, measured)| measured - ours)), rms((0..force.len()).map(|row| force[row] - of_laws(row)))];
    Ok(left.map(|left| left / deviation(force)))
}
