//! Two levers of a real force-reflecting teleoperator, of which nothing is stated but an inertia. The study finds what they have besides, which gauge
//! is dead, how late the hand's torque is recorded, which law couples them and whether they were stable with it. It then re-simulates the sessions
//! with what was found.

mod again;
mod environment;
mod record;
mod sessions;

use crate::run::{Ask, LIKELY, diagnose, diagnosed_model, findings, instead, parameter, percent, remarks, said, solved, total};
use crate::table::Report;
use crate::{Context, Study, StudyError, csv_columns};
use again::{Levers, again};
use backdrive_diagnosis::verdict::Verdict;
use backdrive_plant::model::Model;
use backdrive_signal::low_pass::LowPass;
use record::{ENDS, FILES, Record, SAME, mean};
use sessions::judge;

pub(crate) const STUDY: Study = Study {
    name: "tue_bilateral",
    about: "a teleoperator from a stated inertia alone: friction, a dead gauge, the law that couples its levers, its sessions run again",
    needs: ("tue_bilateral", &FILES),
    run,
};

/// Their columns.
const COLUMNS: [&str; 10] = [
    "master_position [rad]",
    "slave_position [rad]",
    "minus_hand_torque [N m]",
    "minus_master_torque [N m]",
    "slave_torque [N m]",
    "master_gauge_a [V]",
    "master_gauge_b [V]",
    "slave_gauge_a [V]",
    "slave_gauge_b [V]",
    "environment_torque [N m]",
];
/// Sample rate, Hz; corner of the zero-phase filter on positions and torques, Hz; decimation of the samples, and the number of samples omitted at either
/// end.
const RATE: f64 = 2000.0;
/// See [`RATE`].
const CORNER: f64 = 100.0;
/// See [`RATE`].
const KEPT: usize = 5;
/// Laws of dry friction, and the parameter that is its size.
const DRY: [(&str, &str); 7] = [
    ("coulomb", "force"),
    ("dahl", "coulomb"),
    ("lugre", "coulomb"),
    ("maxwell_slip", "force"),
    ("stribeck", "coulomb"),
    ("friction_deficit", "coulomb"),
    ("preisach_lugre", "coulomb"),
];
/// Source of the figures that were not published.
const SOURCE: &str = "regression of the same records";

/// What the records say by themselves.
#[derive(Default)]
struct Known {
    /// Motor torque per difference of the positions, N m/rad, by the gains a, b, c.
    coupling: [Vec<f64>; 3],
    /// Time constant by which the recorded torque of the hand follows its gauge, s.
    lags: Vec<f64>,
    /// Dry friction, N m, and viscous friction, N m s/rad, of the slave in free motion.
    friction: Vec<[f64; 2]>,
    /// The records at their own rate.
    records: Vec<Record>,
}

fn run(context: &Context) -> Result<Report, StudyError> {
    let mut known = Known::default();
    for file in FILES {
        prepare(context, file, &mut known)?;
    }
    let mut report = Report::new("TU/e bilateral teleoperator, from the stated inertia alone");
    for (gain, all) in ["a", "b", "c"].iter().zip(&known.coupling) {
        let stiffness = mean(all);
        report.figure(&format!("coupling {gain}"), stiffness);
        report.line(
            &format!("motor torque by difference of position, gains {gain}"),
            format!("{stiffness:.2} N m/rad"),
            "unpublished",
            SOURCE,
            None,
        );
    }
    let lag = mean(&known.lags);
    report.figure("lag of the recorded torque", lag);
    report.line("recorded hand torque behind its gauge", format!("{:.2} ms, first order", 1e3 * lag), "unpublished", SOURCE, None);
    gauges(&mut report, context)?;
    let judged = judge(&mut report, context)?;
    let mut halves = slave(&mut report, context, &known)?;
    if !context.quick {
        halves.extend(master(&mut report, context, &known, "master", "the recorded torque")?);
        let (by_gauge, gain) = gauge(&mut report, context, &known)?;
        halves.extend(by_gauge);
        let levers = Levers { master: lever(context, "gauge")?, slave: lever(context, "slave")? };
        again(&mut report, &known.records, &judged, &levers, gain)?;
    }
    let halved = halves.iter().filter(|h| **h).count();
    report.figure("halved", halved as f64 / halves.len().max(1) as f64);
    report.line(
        "unseen records whose torque residual is at least halved, of all levers and ways",
        format!("{halved} of {}", halves.len()),
        "80 %",
        "wanted, against inertia alone, refitted",
        Some(halved * 10 >= halves.len() * 8),
    );
    Ok(report)
}

/// The audit's result on the gauges.
fn gauges(report: &mut Report, context: &Context) -> Result<(), StudyError> {
    for lever in ["master", "slave"] {
        let (set, model) = (format!("set-{lever}-gauges.toml"), format!("{lever}-gauges.toml"));
        let ask = Ask { name: &format!("{lever}-gauges"), set: &set, model: &model, without: &[], effects: 1, effort: 0.1 };
        let all = remarks(context, &ask)?;
        let dead: Vec<String> = all.iter().filter(|r| r.about == "constant" || r.about == "saturated").map(|r| format!("{r}")).collect();
        let text = if dead.is_empty() { "nothing".to_string() } else { dead.join("; ") };
        report.word(&format!("{lever} gauges"), &text);
        let (published, met) = match lever {
            "master" => ("gauge a stands at its rail, 10 V, in all records", dead.len() == 1 && text.contains("gauge_a")),
            _ => ("gauge b moves a sixth as far as gauge a, and is not dead", dead.is_empty()),
        };
        report.line(&format!("audit of the {lever}'s gauges: dead or at a rail"), text, published, "the same records", Some(met));
    }
    Ok(())
}

/// The slave in free motion.
fn slave(report: &mut Report, context: &Context, known: &Known) -> Result<Vec<bool>, StudyError> {
    let effort = if context.quick { 0.85 } else { 3.0 };
    let ask = Ask { name: "slave", set: "set-slave.toml", model: "slave.toml", without: &[], effects: 3, effort };
    let found = diagnose(context, &ask)?;
    told(report, context, &ask, &found.verdict, "dry and viscous friction")?;
    let [dry, viscous] = [0, 1].map(|i| mean(&known.friction.iter().map(|f| f[i]).collect::<Vec<f64>>()));
    let measured = friction(&found.verdict);
    report.figure("slave friction", measured.unwrap_or(f64::NAN));
    report.line(
        "slave, dry friction",
        shown(measured, 1e3, "mN m"),
        format!("{:.1} mN m", 1e3 * dry),
        SOURCE,
        Some(measured.is_some_and(|m| (m / dry - 1.0).abs() < 0.3)),
    );
    let damping = parameter(&found.verdict, "damper", "damping").map(|p| p.0);
    report.figure("slave damping", damping.unwrap_or(f64::NAN));
    report.line("slave, viscous friction", shown(damping, 1e3, "mN m s/rad"), format!("{:.1} mN m s/rad", 1e3 * viscous), SOURCE, None);
    Ok(halved(&found.verdict))
}

/// The master by the torque of its gauge, and the gain by which the gauge is off.
fn gauge(report: &mut Report, context: &Context, known: &Known) -> Result<(Vec<bool>, f64), StudyError> {
    let halved = master(report, context, known, "gauge", "the gauge itself")?;
    let ask = Ask { name: "gauge", set: "set-gauge.toml", model: "master.toml", without: &[], effects: 4, effort: 1.5 };
    let model = diagnosed_model(context, &ask)?;
    Ok((halved, model.outputs.first().map_or(1.0, |o| o.gain)))
}

/// A diagnosed lever.
fn lever(context: &Context, name: &str) -> Result<Model, StudyError> {
    diagnosed_model(context, &Ask { name, set: "", model: "", without: &[], effects: 0, effort: 0.0 })
}

/// For each held-out record, whether the residual of the diagnosed model is at most half of that of the inertia alone, refitted.
fn halved(verdict: &Verdict) -> Vec<bool> {
    let errors = verdict.held_out.per_record.iter();
    errors.filter_map(|r| Some(r.nrmse_after? <= 0.5 * r.nrmse_refit?)).collect()
}

/// The master in a hand, its torque as recorded or from the gauge.
fn master(report: &mut Report, context: &Context, known: &Known, name: &str, from: &str) -> Result<Vec<bool>, StudyError> {
    let set = format!("set-{name}.toml");
    let ask = Ask { name, set: &set, model: "master.toml", without: &[], effects: 4, effort: 1.5 };
    let found = diagnose(context, &ask)?;
    let late = name == "master";
    told(report, context, &ask, &found.verdict, if late { "dry and viscous friction, and a lag" } else { "dry and viscous friction" })?;
    let measured = friction(&found.verdict);
    report.figure(&format!("{name} friction"), measured.unwrap_or(f64::NAN));
    report.line(&format!("{name}, dry friction"), shown(measured, 1e3, "mN m"), "about 25 mN m", "rough regression, unpublished", None);
    // A lag of the first order at low frequencies is a delay of its time constant.
    let bandwidth = parameter(&found.verdict, "bandwidth", "bandwidth").map(|(hz, _)| 1.0 / (std::f64::consts::TAU * hz));
    let lag = parameter(&found.verdict, "delay", "delay").map(|p| p.0).or(bandwidth);
    report.figure(&format!("{name} lag"), lag.unwrap_or(f64::NAN));
    let truth = mean(&known.lags);
    let (published, met) = if late {
        (format!("{:.2} ms, as it follows its own gauge", 1e3 * truth), Some(lag.is_some_and(|l| (0.5..2.0).contains(&(l.abs() / truth)))))
    } else {
        ("that of the motor's command, unpublished".to_string(), None)
    };
    report.line(&format!("{name}, hand torque from {from}: lag"), shown(lag, 1e3, "ms"), published, "the same records", met);
    Ok(halved(&found.verdict))
}

/// The lines that every diagnosis has.
fn told(report: &mut Report, context: &Context, ask: &Ask, verdict: &Verdict, known: &str) -> Result<(), StudyError> {
    let name = ask.name;
    report.word(name, &said(verdict));
    let named = findings(verdict);
    let dry = named.iter().any(|(p, place)| DRY.iter().any(|d| d.0 == p) && place.contains("lever"));
    let viscous = named.iter().any(|(p, _)| p == "damper" || p == "asymmetric_damper");
    report.line(name, said(verdict), known, "rough regression", Some(dry && viscous));
    let sure: Vec<String> = verdict.findings.iter().map(|f| format!("{:.2}", f.confidence)).collect();
    report.line(&format!("{name}, confidence"), sure.join(", "), "", "", None);
    let others = instead(verdict, LIKELY);
    report.line(&format!("{name}, or instead"), if others.is_empty() { "nothing".to_string() } else { others.join(", ") }, "", "", None);
    let inertia = diagnosed_model(context, ask)?.values_at("bodies.lever").ok().and_then(|v| v.first().copied()).unwrap_or(f64::NAN);
    report.figure(&format!("{name} inertia"), inertia);
    report.line(
        &format!("{name}, inertia"),
        format!("{:.3} g m²", 1e3 * inertia),
        "1.584 g m²",
        "stated by the authors, from a slope of a frequency response",
        None,
    );
    let (before, after) = (percent(verdict.held_out.nrmse_refit), percent(verdict.held_out.nrmse_after));
    report.figure(&format!("{name} held out before"), before);
    report.figure(&format!("{name} held out after"), after);
    let measured = format!("{after:.1} % (inertia alone, refitted: {before:.1} %)");
    report.line(&format!("{name}, nrmse, held out"), measured, "", "", Some(after < 0.5 * before));
    Ok(())
}

/// Size of the dry friction that a verdict names, of several laws together: the mean of both directions where they differ; a hysteretic spring without
/// stiffness slides at its offsets.
fn friction(verdict: &Verdict) -> Option<f64> {
    let side = |key: &str| total(verdict, "hysteretic_spring", key);
    let sliding = || Some(0.5 * (side("offset_positive")? - side("offset_negative")?));
    let way = |key: &str| total(verdict, "asymmetric_coulomb", key);
    let lopsided = || Some(0.5 * (way("positive")? + way("negative")?));
    let all: Vec<f64> = DRY.iter().filter_map(|(physics, key)| total(verdict, physics, key)).chain(sliding()).chain(lopsided()).collect();
    if all.is_empty() { None } else { Some(all.iter().sum()) }
}

fn shown(value: Option<f64>, scale: f64, unit: &str) -> String {
    value.map_or("not named".to_string(), |v| format!("{:.2} {unit}", scale * v))
}

/// Writes both levers of a record: position and torques through the same filter, the gauges in volts as they are.
fn prepare(context: &Context, file: &str, known: &mut Known) -> Result<(), StudyError> {
    let columns = csv_columns::read_at_least(&context.data.join(file), &COLUMNS, 4000)?;
    let name = file.strip_prefix(SAME).unwrap_or(file);
    let filter = LowPass::butterworth(4, CORNER, RATE);
    let smooth = |c: &[f64]| filter.both_ways(c);
    let thin = |c: &[f64]| c[ENDS..c.len().saturating_sub(ENDS)].iter().step_by(KEPT).copied().collect::<Vec<f64>>();
    let negative = |c: &[f64]| c.iter().map(|x| -x).collect::<Vec<f64>>();
    let [master, slave, hand, master_motor, slave_motor, a, b, slave_a, slave_b, met] = [0, 1, 2, 3, 4, 5, 6, 7, 8, 9].map(|i| &columns[i]);

    let (lag, [gain, offset]) = follows(b, hand)?;
    known.lags.push(lag);
    let difference: Vec<f64> = master.iter().zip(slave).map(|(m, s)| m - s).collect();
    let group = ["a", "b", "c"].iter().position(|g| name.starts_with(g)).unwrap_or(0);
    known.coupling[group].push(solved(&[&difference, &vec![1.0; difference.len()]], master_motor)?[0]);

    let gauge: Vec<f64> = b.iter().map(|v| gain * v + offset).collect();
    known.records.push(Record {
        name: name.trim_end_matches(".csv").to_string(),
        period_s: 1.0 / RATE,
        master: smooth(master),
        slave: smooth(slave),
        hand: smooth(&gauge),
        contact: negative(&smooth(met)),
        master_motor: negative(&smooth(master_motor)),
        slave_motor: smooth(slave_motor),
    });
    let own = [smooth(master), negative(&smooth(master_motor)), smooth(hand), smooth(&gauge), a.clone(), b.clone()].map(|c| thin(&c));
    let t: Vec<f64> = (0..own[0].len()).map(|i| (i * KEPT) as f64 / RATE).collect();
    let names = ["t", "position", "motor_torque", "hand_torque", "gauge_torque", "gauge_a", "gauge_b"];
    let [x, motor, torque, gauge, a, b] = &own;
    csv_columns::write(&context.out.join(format!("master-{name}")), &names, &[&t, x, motor, torque, gauge, a, b])?;

    let own = [smooth(slave), smooth(slave_motor), slave_a.clone(), slave_b.clone()].map(|c| thin(&c));
    let names = ["t", "position", "motor_torque", "gauge_a", "gauge_b"];
    let [x, motor, a, b] = &own;
    csv_columns::write(&context.out.join(format!("slave-{name}")), &names, &[&t, x, motor, a, b])?;
    if name.contains("free_motion") {
        let speed = backdrive_signal::derivative(x, KEPT as f64 / RATE);
        let acceleration = backdrive_signal::derivative(&speed, KEPT as f64 / RATE);
        let sign: Vec<f64> = speed.iter().map(|v| (v / SLOW).tanh()).collect();
        let numbers = solved(&[&acceleration, &speed, &sign, &vec![1.0; speed.len()]], motor)?;
        known.friction.push([numbers[2], numbers[1]]);
    }
    Ok(())
}

/// Speed below which the sign of a speed is not sure, rad/s.
const SLOW: f64 = 0.005;

/// Time constant, s, with which a signal follows another one through a low-pass of first order, and gain and offset between the two. The next sample
/// is a share of the last one and of the other signal.
fn follows(from: &[f64], signal: &[f64]) -> Result<(f64, [f64; 2]), StudyError> {
    let n = signal.len().saturating_sub(1);
    let numbers = solved(&[&signal[..n], &from[1..], &vec![1.0; n]], &signal[1..])?;
    let kept = numbers[0];
    Ok((-1.0 / (RATE * kept.ln()), [numbers[1] / (1.0 - kept), numbers[2] / (1.0 - kept)]))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_time_constant_of_a_drawn_lag_is_found() {
        let gauge: Vec<f64> = (0..4000).map(|i| (f64::from(i) * 0.01).sin() + 0.3 * (f64::from(i) * 0.37).sin()).collect();
        let kept = (-1.0 / (RATE * 3.7e-3)).exp();
        let mut state = 0.0;
        let torque: Vec<f64> = gauge
            .iter()
            .map(|g| {
                state = kept * state + (1.0 - kept) * (-2.0 * g + 16.9);
                state
            })
            .collect();
        let (lag, [gain, offset]) = follows(&gauge, &torque).unwrap();
        assert!((lag / 3.7e-3 - 1.0).abs() < 1e-6 && (gain + 2.0).abs() < 1e-6 && (offset - 16.9).abs() < 1e-6, "{lag} {gain} {offset}");
    }
}
