//! A motor turned slowly: cogging, one harmonic of the turn after the other.

use crate::run::{Ask, diagnose, parameter, percent, said};
use crate::table::Report;
use crate::{Context, Study, StudyError, csv_columns};
use backdrive_diagnosis::verdict::MODEL_FILE;
use std::f64::consts::TAU;

pub(crate) const STUDY: Study = Study {
    name: "odrive_cogging",
    about: "an outrunner motor: the periods of its cogging, against the map of its maker",
    needs: ("odrive_cogging", &["slow2.csv", "slow2_slower.csv", "cogging_maps.csv"]),
    run,
};

/// Encoder counts in a turn.
const COUNTS: f64 = 8192.0;
/// Torque constant, N m/A: 0.4 A for 15 rad/s2 at 0.00025 kg m2, of the author's notes.
const TORQUE: f64 = 15.0 * 2.5e-4 / 0.4;
/// What the rotor does before this time brings it to its start, s.
const START: f64 = 1.0;
/// Which run of which file becomes which recording: all without compensation, and with the other motor in the same state as for the map.
const RUNS: [(&str, f64, &str); 4] = [
    ("slow2.csv", 3.0, "slow-3.csv"),
    ("slow2.csv", 4.0, "slow-4.csv"),
    ("slow2.csv", 5.0, "slow-5.csv"),
    ("slow2_slower.csv", 3.0, "slower-3.csv"),
];
/// Diagnoses one after the other, each from the model of the one before, at most.
const ROUNDS: usize = 6;
/// Harmonics of a turn that the map is searched for, at most.
const HIGHEST: usize = 100;
/// What is withheld: the rotor sits in ball bearings, so nothing gives between it and its friction. Friction that gives (presliding) stays in.
const WITHOUT: &[&str] = &["series_compliance"];
/// How far from a whole number of periods in a turn a period may be.
const WHOLE: f64 = 0.15;

/// A ripple that was named: periods in a turn, amplitude in A.
#[derive(Debug, Clone, Copy)]
struct Ripple {
    harmonic: f64,
    amplitude: f64,
}

fn run(context: &Context) -> Result<Report, StudyError> {
    for (theirs, run, ours) in RUNS {
        let columns = csv_columns::read_at_least(&context.data.join(theirs), &["run", "time_s", "pos_counts", "iq_A"], 1000)?;
        let rows: Vec<usize> = (0..columns[0].len()).filter(|i| columns[0][*i] == run && columns[1][*i] >= START).collect();
        let of = |c: usize, scale: f64| -> Vec<f64> { rows.iter().map(|i| scale * columns[c][*i]).collect() };
        csv_columns::write(&context.out.join(ours), &["t", "angle", "torque"], &[&of(1, 1.0), &of(2, TAU / COUNTS), &of(3, TORQUE)])?;
    }
    let maps =
        csv_columns::read_at_least(&context.data.join("cogging_maps.csv"), &["iq_A_a_4_interp", "iq_A_iso_16_interp"], COUNTS as usize)?;

    let mut report = Report::new("Outrunner motor, from a rotor with friction, one diagnosis after the other");
    let mut ripples: Vec<Ripple> = Vec::new();
    let mut model = "model.toml".to_string();
    let (mut first, mut last) = (f64::NAN, f64::NAN);
    for round in 1..=if context.quick { 1 } else { ROUNDS } {
        let name = format!("round-{round}");
        let found = diagnose(
            context,
            &Ask {
                name: &name,
                set: "set.toml",
                model: &model,
                without: WITHOUT,
                effects: 2,
                effort: if context.quick { 0.6 } else { 1.25 },
            },
        )?;
        let verdict = &found.verdict;
        report.word(&name, &said(verdict));
        report.line(&format!("round {round}"), said(verdict), "", "", None);
        if round == 1 {
            first = percent(verdict.held_out.nrmse_refit);
        }
        last = percent(verdict.held_out.nrmse_after);
        if let (Some((period, _)), Some((amplitude, _))) =
            (parameter(verdict, "cogging", "period"), parameter(verdict, "cogging", "amplitude"))
        {
            ripples.push(Ripple { harmonic: TAU / period, amplitude: amplitude.abs() / TORQUE });
        }
        if verdict.findings.is_empty() {
            break;
        }
        model = format!("{name}/{}", MODEL_FILE);
    }
    // The map's own harmonics, strongest first, and with the other motor taken away.
    let (with, alone) = (harmonics(&maps[0]), harmonics(&maps[1]));
    let mut order: Vec<usize> = (1..=HIGHEST).collect();
    order.sort_by(|a, b| with[*b].total_cmp(&with[*a]));
    for (place, ripple) in ripples.iter().enumerate() {
        let whole = ripple.harmonic.round().max(0.0) as usize;
        let near = (ripple.harmonic - whole as f64).abs() < WHOLE * (ripple.harmonic / 7.0).max(1.0);
        let strongest = order.iter().take(8).any(|h| *h == whole);
        report.figure(&format!("harmonic {}", place + 1), ripple.harmonic);
        report.figure(&format!("amplitude {}", place + 1), ripple.amplitude);
        report.line(
            &format!("cogging {}", place + 1),
            format!("{:.2} periods in a turn, {:.2} A", ripple.harmonic, ripple.amplitude),
            match (with.get(whole), alone.get(whole)) {
                (Some(a), Some(b)) => format!("{whole}: {a:.2} A (other motor taken away: {b:.2} A)"),
                _ => String::new(),
            },
            "G. Chen, map a_4 and iso_16",
            Some(near && strongest),
        );
    }
    let list = order.iter().take(8).map(|h| format!("{h} ({:.2} A)", with[*h])).collect::<Vec<_>>().join(", ");
    report.notes.push(format!("The map's strongest harmonics of a turn: {list}."));
    report.notes.push("The map holds the rotor still at each place; here it turns, and slips from one place to the next.".to_string());
    report.figure("held out before", first);
    report.figure("held out after", last);
    report.line("nrmse, held out", format!("{last:.1} % (friction alone, refitted: {first:.1} %)"), "", "", Some(last < 0.6 * first));
    Ok(report)
}

/// Amplitude of each harmonic of a turn, from a map of equal steps over one turn.
fn harmonics(map: &[f64]) -> Vec<f64> {
    let n = map.len().max(1) as f64;
    let one = |h: usize| {
        let (mut c, mut s) = (0.0, 0.0);
        for (i, x) in map.iter().enumerate() {
            let angle = TAU * h as f64 * i as f64 / n;
            c += x * angle.cos();
            s += x * angle.sin();
        }
        2.0 * c.hypot(s) / n
    };
    (0..=HIGHEST).map(one).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn harmonics_of_a_drawn_map_are_those_drawn() {
        let map: Vec<f64> =
            (0..8192).map(|i| TAU * f64::from(i) / 8192.0).map(|a| 0.8 * (7.0 * a + 0.3).sin() + 0.2 * (28.0 * a).cos()).collect();
        let found = harmonics(&map);
        assert!((found[7] - 0.8).abs() < 1e-9 && (found[28] - 0.2).abs() < 1e-9 && found[12] < 1e-9);
    }
}
