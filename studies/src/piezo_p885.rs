//! A piezo stack: from a spring to rate-independent hysteresis, and a lag beside it that no amplitude changes.

use crate::run::{Ask, diagnose, diagnosed_model, findings, percent, said};
use crate::table::Report;
use crate::{Context, Study, StudyError, csv_columns};
use backdrive_plant::stepper::{Options, simulate};

pub(crate) const STUDY: Study = Study {
    name: "piezo_p885",
    about: "a piezo actuator: hysteresis that does not depend on the rate, told apart from a delay",
    needs: ("piezo_p885", &["model.csv", "test.csv"]),
    run,
};

/// Sample time, s.
const PERIOD: f64 = 0.005;
/// Effects whose force depends on the path and not on the time.
const HYSTERESIS: [&str; 5] = ["bouc_wen", "hysteretic_spring", "maxwell_slip", "dahl", "preisach_lugre"];
/// Effects that let the displacement lag behind the drive.
const LAG: [&str; 3] = ["delay", "bandwidth", "damper"];

fn run(context: &Context) -> Result<Report, StudyError> {
    let train = csv_columns::read_at_least(&context.data.join("model.csv"), &["u_V", "y_um"], 1000)?;
    let ramps = csv_columns::read_at_least(&context.data.join("test.csv"), &["u_V", "y_um"], 1000)?;
    let effort = if context.quick { 1.05 } else { 6.25 };
    let ask = Ask { name: "", set: "set.toml", model: "model.toml", without: &[], effects: 3, effort };
    let found = diagnose(context, &ask)?;
    let verdict = &found.verdict;
    let model = diagnosed_model(context, &ask)?;

    let mut report = Report::new("Piezo stack P-885.91, from a linear spring");
    let words = said(verdict);
    report.word("verdict", &words);
    let named = findings(verdict);
    let has = |all: &[&str]| named.iter().any(|(p, _)| all.contains(&p.as_str()));
    let both = has(&HYSTERESIS) && has(&LAG);
    report.line("verdict", words, "hysteresis with minor loops, and a delay", "Aye & Ang 2018", Some(both));

    // A force that depends on the path only turns with its drive: what comes later at the turning points is no hysteresis.
    let small = turning_lags(&ramps[0], &ramps[1], 0.25);
    let large = turning_lags(&train[0], &train[1], 1.0);
    let mean_ms = |lags: &[f64]| 1e3 * PERIOD * lags.iter().sum::<f64>() / lags.len().max(1) as f64;
    let (fine, coarse) = (mean_ms(&small), mean_ms(&large));
    let predicted = |drive: &[f64]| {
        let all = simulate(&model, &[drive], PERIOD, &Options::default()).map_err(|e| StudyError::Diagnosis(e.to_string()))?;
        all.into_iter().next().ok_or_else(|| StudyError::Diagnosis("the model has no output".to_string()))
    };
    let ours = mean_ms(&turning_lags(&train[0], &predicted(&train[0])?, 1.0));
    let ours_fine = mean_ms(&turning_lags(&ramps[0], &predicted(&ramps[0])?, 0.25));
    report.figure("lag", ours);
    report.figure("lag at turning points", coarse);
    report.line(
        "lag at the turning points, 1 Hz",
        format!("{ours:.1} ms at 3.6 V, {ours_fine:.1} ms where the swing is below a quarter of that"),
        format!("{coarse:.1} ms, {fine:.1} ms"),
        "the same records",
        Some((ours - coarse).abs() < 3.0),
    );
    let transport = 1e3 * model.inputs.iter().map(|i| i.delay).chain(model.outputs.iter().map(|o| o.delay)).sum::<f64>();
    report.figure("delay", transport);
    let shift = format!("{:.0} ms: one sample, by which their script shifts", 1e3 * PERIOD);
    report.line("of that, pure delay", format!("{transport:.1} ms"), shift, "Aye & Ang 2018, Step02_ChkCurves.m", None);
    let (before, after) = (percent(verdict.held_out.nrmse_refit), percent(verdict.held_out.nrmse_after));
    report.figure("held out before", before);
    report.figure("held out after", after);
    let measured = format!("{after:.1} % (spring refitted: {before:.1} %)");
    report.line("nrmse, ramps of amplitude, unseen", measured, "", "", Some(after < 0.4 * before));
    report.notes.push(
        "A delay alone would make the loop of a sine an ellipse whose width grows with the rate and whose relative width does not depend on the \
         amplitude; a path-dependent force turns with its drive. The jump from 0 V at the start of each record tells a delay from a first-order lag."
            .to_string(),
    );
    Ok(report)
}

/// Samples by which a signal turns later than its drive, at the drive's turning points; only where the drive swings by less than a share of
/// its largest swing, 1 for all.
fn turning_lags(drive: &[f64], signal: &[f64], share: f64) -> Vec<f64> {
    let (low, high) = drive.iter().fold((f64::INFINITY, f64::NEG_INFINITY), |(l, h), x| (l.min(*x), h.max(*x)));
    let tops = turns(drive);
    let others = turns(signal);
    let mut lags = Vec::new();
    for pair in tops.windows(2) {
        let [before, here] = [pair[0], pair[1]];
        let swing = (drive[here.1] - drive[before.1]).abs();
        if before.2 == here.2 || swing > share * (high - low) * 1.001 || swing < 0.02 * (high - low) {
            continue;
        }
        let next = others.iter().filter(|o| o.2 == here.2 && (o.0 - here.0) > -2.0 && (o.0 - here.0) < 15.0).map(|o| o.0 - here.0);
        lags.extend(next.min_by(f64::total_cmp));
    }
    lags
}

/// Turning points of a signal that waves once in 200 samples: place by a parabola through 31 samples, its sample, whether it is a top.
fn turns(x: &[f64]) -> Vec<(f64, usize, bool)> {
    const HALF: usize = 15;
    const AROUND: usize = 50;
    let mut all: Vec<(f64, usize, bool)> = Vec::new();
    for k in AROUND..x.len().saturating_sub(AROUND) {
        let near = &x[k - AROUND..=k + AROUND];
        let top = near.iter().all(|y| *y <= x[k]);
        if !top && !near.iter().all(|y| *y >= x[k]) {
            continue;
        }
        // Even sums of a parabola's normal equations about its middle.
        let (mut s2, mut s4, mut y0, mut y1, mut y2) = (0.0, 0.0, 0.0, 0.0, 0.0);
        for (i, y) in x[k - HALF..=k + HALF].iter().enumerate() {
            let w = i as f64 - HALF as f64;
            s2 += w * w;
            s4 += w.powi(4);
            y0 += y;
            y1 += w * y;
            y2 += w * w * y;
        }
        let count = (2 * HALF + 1) as f64;
        let curve = (y2 - s2 * y0 / count) / (s4 - s2 * s2 / count);
        let place = -y1 / s2 / (2.0 * curve);
        let apart = all.last().is_none_or(|a| k - a.1 > AROUND);
        if apart && curve != 0.0 && place.abs() < HALF as f64 {
            all.push((k as f64 + place, k, top));
        }
    }
    all
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_lag_of_a_late_sine_is_found_at_its_turning_points() {
        let wave = |late: f64| -> Vec<f64> { (0..2000).map(|i| ((f64::from(i) - late) * std::f64::consts::TAU / 200.0).sin()).collect() };
        let lags = turning_lags(&wave(0.0), &wave(4.6), 1.0);
        assert!(lags.len() > 10, "{lags:?}");
        assert!(lags.iter().all(|l| (l - 4.6).abs() < 0.05), "{lags:?}");
    }
}
