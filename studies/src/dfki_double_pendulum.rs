//! A two-joint arm under gravity, joint by joint. The rigid arm's torque is computed here from the published model and handed over as a known load, and
//! the diagnosis reports what the joint has besides.
//!
//! The library's models are chains of one axis whose inertia does not depend on where they stand, so a joint cannot have the arm in its model.

use crate::run::{Ask, LIKELY, diagnose, diagnosed_model, errors_of, findings, instead, parameter, percent, read, said, total, write};
use crate::table::Report;
use crate::{Context, Study, StudyError, csv_columns};
use backdrive_diagnosis::recordings::problem::Problem;
use backdrive_diagnosis::verdict::{MODEL_FILE, Verdict};
use backdrive_signal::derivative;
use backdrive_signal::low_pass::LowPass;

pub(crate) const STUDY: Study = Study {
    name: "dfki_double_pendulum",
    about: "a two-joint arm under gravity, joint by joint: what it has besides its published rigid body",
    needs: ("dfki_double_pendulum", &["055032.csv", "055640.csv", "060143.csv", "060245.csv", "061157.csv", PUBLISHED]),
    run,
};

/// The published model whose rigid body is taken as known.
const PUBLISHED: &str = "published_model_1.0.yml";
/// The long record, of which either half is a recording.
const LONG: &str = "061157";
/// The short ones, whose torque is a command (it has no noise, and in two of them it is 0 for the second half): they are evaluated afterwards.
const SHORT: [&str; 4] = ["060143", "060245", "055640", "055032"];
/// Rate of the even grid, Hz; corner of the zero-phase filter on every column, Hz; every so manieth sample is kept; samples left out at either end.
const RATE: f64 = 1000.0;
/// See [`RATE`].
const CORNER: f64 = 10.0;
/// See [`RATE`].
const KEPT: usize = 10;
/// See [`RATE`].
const ENDS: usize = 100;
/// Laws of dry friction, and the parameter that is its size.
const DRY: [(&str, &str); 8] = [
    ("coulomb", "force"),
    ("dahl", "coulomb"),
    ("lugre", "coulomb"),
    ("maxwell_slip", "force"),
    ("stribeck", "coulomb"),
    ("friction_deficit", "coulomb"),
    ("asymmetric_coulomb", "positive"),
    ("preisach_lugre", "coulomb"),
];

/// Parameters of the published model: masses, lengths, inertias about the joints, centres of mass, friction.
struct Arm {
    inertia: [f64; 2],
    mass: [f64; 2],
    centre: [f64; 2],
    length: f64,
    gravity: f64,
    viscous: [f64; 2],
    dry: [f64; 2],
}

impl Arm {
    /// From the authors' file.
    fn read(path: &std::path::Path) -> Result<Arm, StudyError> {
        let text = read(path)?;
        let value = |key: &str| {
            let line = text.lines().filter_map(|line| line.split_once(':')).find(|(name, _)| name.trim() == key);
            let number = line.and_then(|(_, number)| number.trim().parse::<f64>().ok());
            number.ok_or_else(|| StudyError::File(format!("{}: has no number {key}", path.display())))
        };
        let pair = |a: &str, b: &str| Ok::<[f64; 2], StudyError>([value(a)?, value(b)?]);
        Ok(Arm {
            inertia: pair("I1", "I2")?,
            mass: pair("m1", "m2")?,
            centre: pair("r1", "r2")?,
            length: value("l1")?,
            gravity: value("g")?,
            viscous: pair("b1", "b2")?,
            dry: pair("cf1", "cf2")?,
        })
    }

    /// Torques that the rigid arm takes at both joints: angles (of the second relative to the first, both hanging at 0), speeds, accelerations.
    fn torques(&self, q: [f64; 2], v: [f64; 2], a: [f64; 2]) -> [f64; 2] {
        let [i1, i2] = self.inertia;
        let coupled = self.mass[1] * self.length * self.centre[1];
        let (sine, cosine) = q[1].sin_cos();
        let far = self.gravity * self.mass[1] * self.centre[1] * (q[0] + q[1]).sin();
        let near = self.gravity * (self.mass[0] * self.centre[0] + self.mass[1] * self.length) * q[0].sin();
        let shared = i2 + coupled * cosine;
        let first = (i1 + i2 + self.mass[1] * self.length * self.length + 2.0 * coupled * cosine) * a[0] + shared * a[1]
            - coupled * sine * (2.0 * v[0] * v[1] + v[1] * v[1])
            + near
            + far;
        let second = shared * a[0] + i2 * a[1] + coupled * sine * v[0] * v[0] + far;
        [first, second]
    }
}

fn run(context: &Context) -> Result<Report, StudyError> {
    let arm = Arm::read(&context.data.join(PUBLISHED))?;
    for name in SHORT {
        prepare(context, &arm, name, false)?;
    }
    prepare(context, &arm, LONG, true)?;
    let mut report = Report::new("Two-joint arm, joint by joint, from its published rigid body");
    let joints = if context.quick { 2..=2 } else { 1..=2 };
    for joint in joints {
        told(&mut report, context, &arm, joint)?;
    }
    Ok(report)
}

/// The diagnosis of a joint.
fn told(report: &mut Report, context: &Context, arm: &Arm, joint: usize) -> Result<(), StudyError> {
    let (name, set, model) = (format!("joint-{joint}"), format!("set-{joint}.toml"), format!("joint-{joint}.toml"));
    let effort = if context.quick { 0.85 } else { 3.0 };
    let ask = Ask { name: &name, set: &set, model: &model, without: &[], effects: 3, effort };
    let found = diagnose(context, &ask)?;
    let verdict = &found.verdict;
    report.word(&name, &said(verdict));
    let dry = friction(verdict);
    report.line(&format!("joint {joint}"), said(verdict), "dry friction, and on joint 1 viscous", PUBLISHED, Some(dry.is_some()));
    let sure: Vec<String> = verdict.findings.iter().map(|f| format!("{:.2}", f.confidence)).collect();
    report.line(&format!("joint {joint}, confidence"), sure.join(", "), "", "", None);
    let others = instead(verdict, LIKELY);
    report.line(
        &format!("joint {joint}, or instead"),
        if others.is_empty() { "nothing".to_string() } else { others.join(", ") },
        "",
        "",
        None,
    );
    let shown = |value: Option<f64>, unit: &str| value.map_or("not named".to_string(), |v| format!("{v:.3} {unit}"));
    let value = |path: [f64; 2]| path.get(joint - 1).copied().unwrap_or(f64::NAN);
    report.figure(&format!("{name} friction"), dry.unwrap_or(f64::NAN));
    let published = value(arm.dry);
    report.line(
        &format!("joint {joint}, dry friction"),
        shown(dry, "N m"),
        format!("{published:.3} N m"),
        PUBLISHED,
        Some(dry.is_some_and(|d| (d / published - 1.0).abs() < 0.3)),
    );
    let damping = parameter(verdict, "damper", "damping").map(|p| p.0);
    report.figure(&format!("{name} damping"), damping.unwrap_or(f64::NAN));
    report.line(
        &format!("joint {joint}, viscous friction"),
        shown(damping, "N m s/rad"),
        format!("{:.3} N m s/rad", value(arm.viscous)),
        PUBLISHED,
        None,
    );
    let gain = gain(verdict);
    report.figure(&format!("{name} gain"), gain.unwrap_or(f64::NAN));
    report.line(
        &format!("joint {joint}, torque read by torque of the rigid arm"),
        shown(gain, ""),
        "1; on a sister rig the torque constant was off by a factor near 1.3",
        "the authors",
        None,
    );
    let rotor = diagnosed_model(context, &ask)?.values_at("bodies.joint").ok().and_then(|v| v.first().copied()).unwrap_or(f64::NAN);
    report.figure(&format!("{name} rotor"), rotor);
    report.line(&format!("joint {joint}, rotor at the joint"), format!("{:.2} g m²", 1e3 * rotor), "2.19 g m²", PUBLISHED, None);
    let (before, after) = (percent(verdict.held_out.nrmse_refit), percent(verdict.held_out.nrmse_after));
    report.figure(&format!("{name} held out before"), before);
    report.figure(&format!("{name} held out after"), after);
    let measured = format!("{after:.1} % (rigid body alone: {before:.1} %)");
    report.line(&format!("joint {joint}, nrmse, held out"), measured, "", "", Some(after < before));
    for (record, before, after) in beyond(context, joint)? {
        report.figure(&format!("{record} before"), before);
        report.figure(&format!("{record} after"), after);
        report.line(
            &format!("nrmse, {record}, whose torque is a command"),
            format!("{after:.1} % (rigid body alone: {before:.1} %)"),
            "",
            "",
            None,
        );
    }
    Ok(())
}

/// Size of the dry friction that a verdict names; a hysteretic spring without stiffness slides at its offsets.
fn friction(verdict: &Verdict) -> Option<f64> {
    let side = |key: &str| total(verdict, "hysteretic_spring", key);
    let sliding = || Some(0.5 * (side("offset_positive")? - side("offset_negative")?));
    DRY.iter().find_map(|(physics, key)| total(verdict, physics, key)).or_else(sliding)
}

/// Factor between the torque that was read and that of the rigid arm, where the verdict names one.
fn gain(verdict: &Verdict) -> Option<f64> {
    let place = findings(verdict).into_iter().find(|(physics, _)| physics == "gain")?.1;
    let (value, _) = parameter(verdict, "gain", "gain")?;
    if place.contains("load") || place.contains("torque") { Some(value) } else { None }
}

/// Errors in the short records, %, of the nominal and of the diagnosed model, as they are.
fn beyond(context: &Context, joint: usize) -> Result<Vec<(String, f64, f64)>, StudyError> {
    let folder = context.out.join(format!("joint-{joint}"));
    let names: Vec<String> = SHORT.iter().map(|name| format!("../joint-{joint}-{name}.csv")).collect();
    let mut errors = Vec::new();
    for model in ["model.toml", MODEL_FILE] {
        let set = folder.join("set-short.toml");
        write(&set, &format!("model = {model:?}\nfit = {:?}\nheld_out = {:?}\n", &names[..1], &names[1..]))?;
        let problem = Problem::open(&set, None).map_err(|e| StudyError::Diagnosis(e.to_string()))?;
        let mut all = errors_of(&problem, &problem.fit)?;
        all.extend(errors_of(&problem, &problem.held_out)?);
        errors.push(all);
    }
    let [before, after] = [0, 1].map(|i| errors.get(i).cloned().unwrap_or_default());
    Ok(before.into_iter().zip(after).map(|((name, before), (_, after))| (name, 100.0 * before, 100.0 * after)).collect())
}

/// Writes both joints of a record: angle, the rigid arm's torque with its sign turned, the torque that was read; everything through the same filter. Of
/// a record in two the halves.
fn prepare(context: &Context, arm: &Arm, name: &str, halves: bool) -> Result<(), StudyError> {
    let columns = csv_columns::read_at_least(&context.data.join(format!("{name}.csv")), &["time", "pos1", "pos2", "tau1", "tau2"], 1500)?;
    let filter = LowPass::butterworth(4, CORNER, RATE);
    let even: Vec<Vec<f64>> = columns[1..].iter().map(|c| filter.both_ways(&on_a_grid(&columns[0], c))).collect();
    let [q1, q2] = [0, 1].map(|i| &even[i]);
    let [v1, v2] = [q1, q2].map(|q| derivative(q, 1.0 / RATE));
    let [a1, a2] = [&v1, &v2].map(|v| derivative(v, 1.0 / RATE));
    let rigid: Vec<[f64; 2]> = (0..q1.len()).map(|i| arm.torques([q1[i], q2[i]], [v1[i], v2[i]], [a1[i], a2[i]])).collect();
    for joint in 0..2 {
        let thin = |c: &mut dyn Iterator<Item = f64>| -> Vec<f64> {
            let all: Vec<f64> = c.collect();
            all[ENDS.min(all.len())..all.len().saturating_sub(ENDS).max(ENDS.min(all.len()))].iter().step_by(KEPT).copied().collect()
        };
        let angle = thin(&mut even[joint].iter().copied());
        let load = thin(&mut rigid.iter().map(|r| -r[joint]));
        let torque = thin(&mut even[2 + joint].iter().copied());
        let n = angle.len();
        let pieces = if halves { vec![("-1", 0..n / 2), ("-2", n / 2..n)] } else { vec![("", 0..n)] };
        for (tail, piece) in pieces {
            let t: Vec<f64> = (0..piece.len()).map(|i| (i * KEPT) as f64 / RATE).collect();
            let file = context.out.join(format!("joint-{}-{name}{tail}.csv", joint + 1));
            csv_columns::write(
                &file,
                &["t", "angle", "load", "torque"],
                &[&t, &angle[piece.clone()], &load[piece.clone()], &torque[piece]],
            )?;
        }
    }
    Ok(())
}

/// Samples at uneven times, by straight lines on an even grid from the first to the last of them.
fn on_a_grid(times: &[f64], samples: &[f64]) -> Vec<f64> {
    let (Some(first), Some(last)) = (times.first(), times.last()) else { return Vec::new() };
    let count = ((last - first) * RATE).floor().max(0.0) as usize;
    let mut at = 0;
    let mut value = |i: usize| {
        let t = first + i as f64 / RATE;
        while at + 2 < times.len() && times[at + 1] < t {
            at += 1;
        }
        let (a, b) = (at, (at + 1).min(times.len() - 1));
        let width = times[b] - times[a];
        let share = if width > 0.0 { ((t - times[a]) / width).clamp(0.0, 1.0) } else { 0.0 };
        samples[a] + share * (samples[b] - samples[a])
    };
    (0..=count).map(&mut value).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    const ARM: Arm = Arm {
        inertia: [0.055, 0.025],
        mass: [0.6, 0.63],
        centre: [0.275, 0.166],
        length: 0.3,
        gravity: 9.81,
        viscous: [0.0; 2],
        dry: [0.0; 2],
    };

    /// Energy of the arm: what the torques put in has to be there.
    fn energy(q: [f64; 2], v: [f64; 2]) -> f64 {
        let [i1, i2] = ARM.inertia;
        let coupled = ARM.mass[1] * ARM.length * ARM.centre[1];
        let both = v[0] + v[1];
        let moving =
            0.5 * (i1 + ARM.mass[1] * ARM.length * ARM.length) * v[0] * v[0] + 0.5 * i2 * both * both + coupled * q[1].cos() * v[0] * both;
        let lifted =
            (ARM.mass[0] * ARM.centre[0] + ARM.mass[1] * ARM.length) * q[0].cos() + ARM.mass[1] * ARM.centre[1] * (q[0] + q[1]).cos();
        moving - ARM.gravity * lifted
    }

    #[test]
    fn the_arm_s_torques_do_the_work_that_its_energy_gains() {
        let at = |t: f64| {
            let q = [1.1 * (2.0 * t).sin(), 0.9 * (3.1 * t).sin() + 0.4];
            let v = [2.2 * (2.0 * t).cos(), 2.79 * (3.1 * t).cos()];
            let a = [-4.4 * (2.0 * t).sin(), -8.649 * (3.1 * t).sin()];
            (q, v, a)
        };
        let h = 1e-5;
        for i in 0..50 {
            let t = 0.05 * f64::from(i);
            let (q, v, a) = at(t);
            let torque = ARM.torques(q, v, a);
            let power = torque[0] * v[0] + torque[1] * v[1];
            let gained = |t: f64| energy(at(t).0, at(t).1);
            let rate = (gained(t + h) - gained(t - h)) / (2.0 * h);
            assert!((power - rate).abs() < 1e-6, "{t}: {power} {rate}");
        }
    }

    #[test]
    fn uneven_samples_of_a_line_lie_on_it() {
        let times: Vec<f64> = (0..200).map(|i| 0.002 * f64::from(i) + if i % 3 == 0 { 0.0007 } else { 0.0 }).collect();
        let line: Vec<f64> = times.iter().map(|t| 3.0 * t - 1.0).collect();
        let even = on_a_grid(&times, &line);
        let first = times[0];
        assert!(even.iter().enumerate().all(|(i, x)| (x - (3.0 * (first + i as f64 / RATE) - 1.0)).abs() < 1e-9));
        assert!(on_a_grid(&[], &[]).is_empty());
    }
}
