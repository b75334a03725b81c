//! Axes of an industrial robot with an encoder at the motor and one at the arm: they differ because they are read at different times, not
//! because the gear bends.

use crate::run::{Ask, diagnose, findings, parameter, said};
use crate::table::Report;
use crate::{Context, Study, StudyError, csv_columns};
use backdrive_diagnosis::belief::choice::chosen;
use backdrive_diagnosis::belief::compare::{predictions, qualities};
use backdrive_diagnosis::diagnose::Diagnosis;
use backdrive_diagnosis::output_error::structure::Structure;
use backdrive_signal::low_pass::LowPass;

pub(crate) const STUDY: Study = Study {
    name: "kuka_kr300",
    about: "axes of an industrial robot with two encoders: a timing skew that looks like flexibility",
    needs: ("kuka_kr300", &["traj_A.csv", "traj_B.csv", "traj_C.csv"]),
    run,
};

/// Axes with a second encoder, and their gear ratios.
const RATIOS: [f64; 3] = [256.857, 267.429, 252.333];
/// Sample rate, Hz; corner of the zero-phase filter on every column, Hz; every so manieth sample is kept.
const RATE: f64 = 250.0;
/// See [`RATE`].
const CORNER: f64 = 12.0;
/// See [`RATE`].
const KEPT: usize = 2;
/// Effects that would be flexibility of the joint.
const FLEXIBLE: [&str; 7] = ["series_compliance", "cubic_spring", "hysteretic_spring", "bouc_wen", "backlash", "contact", "hunt_crossley"];

fn run(context: &Context) -> Result<Report, StudyError> {
    let mut report = Report::new("KUKA KR300, motor angle in, arm angle out (axis 1: and torque)");
    let axes = if context.quick { 1..=1 } else { 1..=3 };
    for axis in axes {
        let mut skews = Vec::new();
        for run in ["A", "B", "C"] {
            skews.push(prepare(context, axis, run)?);
        }
        let skew = skews.iter().sum::<f64>() / skews.len() as f64;
        let (name, set, model) = (format!("axis-{axis}"), format!("set-{axis}.toml"), format!("axis-{axis}.toml"));
        let effort = if context.quick { 0.85 } else { 3.75 };
        let found = diagnose(context, &Ask { name: &name, set: &set, model: &model, without: &[], effects: 3, effort })?;
        let named = findings(&found.verdict);
        let words = said(&found.verdict);
        report.word(&name, &words);
        let at_arm = |place: &str| !["rotor-ground", "arm-ground", "ground-arm"].contains(&place);
        let first = named.first().is_some_and(|(p, _)| p == "delay");
        let flexible = named.iter().any(|(p, place)| FLEXIBLE.contains(&p.as_str()) && at_arm(place));
        report.line(
            &format!("axis {axis}"),
            words,
            "timing skew, not flexibility",
            "the encoders' difference against speed",
            Some(first && !flexible),
        );
        let delay = parameter(&found.verdict, "delay", "delay");
        let (value, [low, high]) = delay.unwrap_or((f64::NAN, [f64::NAN; 2]));
        // A late arm and a motor that is ahead are one skew.
        report.figure(&format!("{name} skew"), 1e3 * value.abs());
        let measured =
            if delay.is_some() { format!("{:.2} ms ({:.2} to {:.2})", 1e3 * value, 1e3 * low, 1e3 * high) } else { "none".to_string() };
        let near = (value.abs() / skew - 1.0).abs() < 0.25;
        report.line(
            &format!("axis {axis}, skew"),
            measured,
            format!("{:.2} ms", 1e3 * skew),
            "regression of the difference on speed",
            Some(near),
        );
        let (nominal, best) = (&found.search.nominal, chosen(&found.search));
        let before = unseen(&found, &nominal.structure, &nominal.fit.values)?;
        let after = unseen(&found, &best.structure, &best.fit.values)?;
        for (output, before, after) in before.iter().zip(&after).map(|(b, a)| (&b.0, 100.0 * b.1, 100.0 * a.1)) {
            report.figure(&format!("{name} {output} before"), before);
            report.figure(&format!("{name} {output} after"), after);
            let measured = format!("{after:.3} % (refitted without: {before:.3} %)");
            let bar = (output == "arm_angle").then_some(after < 0.7 * before);
            report.line(&format!("axis {axis}, nrmse of {output}, unseen runs"), measured, "", "", bar);
        }
    }
    report.notes.push(
        "A spring whose arm has only viscous friction is a first-order lag, which no recording tells from a delay of the encoder: only what is \
         known of the arm does. So its inertia and friction are held at the published numbers, and on axes 2 and 3, where no torque without \
         gravity is at hand, its stiffness too."
            .to_string(),
    );
    Ok(report)
}

/// Normalised error of each output over the held-out runs.
fn unseen(found: &Diagnosis, structure: &Structure, values: &[f64]) -> Result<Vec<(String, f64)>, StudyError> {
    let records = &found.problem.held_out;
    let failed = || StudyError::Diagnosis("the model cannot be simulated on the unseen runs".to_string());
    let predicted = predictions(&found.problem, records, structure, values).ok_or_else(failed)?;
    let all = qualities(&found.problem, records, &predicted, &found.search.noise_sd, false);
    let mean = |name: &String| {
        let own: Vec<f64> = all.iter().filter(|q| q.output == *name).map(|q| q.nrmse).collect();
        own.iter().sum::<f64>() / own.len().max(1) as f64
    };
    Ok(found.problem.model.outputs.iter().map(|o| (o.name.clone(), mean(&o.name))).collect())
}

/// Writes an axis of a run: angles from the run's beginning in rad at the joint, torque in N m at the joint, everything through the same
/// filter. The skew that a regression of the encoders' difference on speed shows, s.
fn prepare(context: &Context, axis: usize, run: &str) -> Result<f64, StudyError> {
    let names = [format!("posmot_deg_{axis}"), format!("posse_deg_{axis}"), format!("torque_abs_Nm_{axis}")];
    let names: Vec<&str> = names.iter().map(String::as_str).collect();
    let mut columns = csv_columns::read_at_least(&context.data.join(format!("traj_{run}.csv")), &names, 2000)?;
    let ratio = RATIOS.get(axis - 1).copied().unwrap_or(1.0);
    let filter = LowPass::butterworth(4, CORNER, RATE);
    for (i, column) in columns.iter_mut().enumerate() {
        let (start, scale) = if i < 2 { (column.first().copied().unwrap_or(0.0), 1f64.to_radians()) } else { (0.0, ratio) };
        let own: Vec<f64> = column.iter().map(|x| (x - start) * scale).collect();
        *column = filter.both_ways(&own).into_iter().step_by(KEPT).collect();
    }
    // The device is at rest at the first sample.
    let begin = columns[0].first().copied().unwrap_or(0.0);
    columns[..2].iter_mut().flatten().for_each(|x| *x -= begin);
    let period = KEPT as f64 / RATE;
    let t: Vec<f64> = (0..columns[0].len()).map(|i| i as f64 * period).collect();
    let file = context.out.join(format!("axis-{axis}-{run}.csv"));
    csv_columns::write(&file, &["t", "motor_angle", "arm_angle", "torque"], &[&t, &columns[0], &columns[1], &columns[2]])?;
    let speed = backdrive_signal::derivative(&columns[0], period);
    let difference: Vec<f64> = columns[0].iter().zip(&columns[1]).map(|(m, a)| m - a).collect();
    Ok(slope(&speed, &difference))
}

/// Slope of a straight line through points, by least squares.
fn slope(x: &[f64], y: &[f64]) -> f64 {
    let n = x.len().max(1) as f64;
    let (mx, my) = (x.iter().sum::<f64>() / n, y.iter().sum::<f64>() / n);
    let (mut xy, mut xx) = (0.0, 0.0);
    for (a, b) in x.iter().zip(y) {
        xy += (a - mx) * (b - my);
        xx += (a - mx) * (a - mx);
    }
    xy / xx
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_slope_of_a_line_is_its_slope() {
        let x: Vec<f64> = (0..50).map(f64::from).collect();
        let y: Vec<f64> = x.iter().map(|x| 3.0 - 0.25 * x).collect();
        assert!((slope(&x, &y) + 0.25).abs() < 1e-12);
    }
}
