//! Units and signs: the measured signals compared with the predictions of the nominal model, as given.

use super::remark::{Remark, Weight, file_name};
use crate::output_error::simulate::predict;
use crate::recordings::problem::Problem;
use crate::tuning::tuning;
use backdrive_plant::model::{Motion, OutputKind};

/// Factors of measured over predicted that units make, and what the measured values then are in.
fn known(kind: &OutputKind, motion: Motion) -> &'static [(f64, &'static str)] {
    match (kind, motion) {
        (OutputKind::Position(_), Motion::Translation) => {
            &[(1e3, "mm"), (1e6, "micrometres"), (100.0, "cm"), (39.37, "inches"), (1e-3, "km")]
        }
        (OutputKind::Velocity(_), Motion::Translation) => &[(1e3, "mm/s"), (100.0, "cm/s"), (39.37, "inches/s")],
        (OutputKind::Acceleration(_), Motion::Translation) => &[(1e3, "mm/s²")],
        (OutputKind::Position(_) | OutputKind::Acceleration(_), Motion::Rotation) => &[(57.296, "degrees"), (1e3, "thousandths")],
        (OutputKind::Velocity(_), Motion::Rotation) => &[(57.296, "degrees/s"), (1e3, "thousandths")],
        (OutputKind::Force(_) | OutputKind::Reaction(_), _) => &[(1e3, "thousandths of the unit"), (1e-3, "thousands of the unit")],
    }
}

/// One remark for each output whose sign or unit looks wrong.
pub(super) fn remarks(problem: &Problem) -> Vec<Remark> {
    let mut all = Vec::new();
    let predicted: Vec<_> = problem.fit.iter().map(|r| predict(&problem.model, r, 16)).collect();
    for (index, output) in problem.model.outputs.iter().enumerate() {
        let mut of_records = Vec::new();
        for (record, predicted) in problem.fit.iter().zip(&predicted) {
            let (Some(predicted), Some(Some(samples))) = (predicted, record.outputs.get(index)) else { continue };
            let place = crate::output_error::evaluator::measured(record).position(|o| o == index).unwrap_or(0);
            let Some(column) = predicted.get(place * record.len..(place + 1) * record.len) else { continue };
            let lag = problem.lag.get(index).copied().unwrap_or(0);
            of_records.push((factor(samples, column, lag), record));
        }
        let sure = |f: &(f64, f64)| f.1.abs() > tuning().recordings.unit_correlates;
        if of_records.is_empty() || !of_records.iter().all(|(f, _)| sure(f)) {
            continue;
        }
        let factors: Vec<f64> = of_records.iter().map(|(f, _)| f.0).collect();
        let size = factors.iter().map(|f| f.abs().ln()).sum::<f64>() / factors.len() as f64;
        let size = size.exp();
        let least = of_records.iter().map(|(f, _)| f.1.abs()).fold(1.0, f64::min);
        let alike = factors.iter().all(|f| (f.abs() / size).max(size / f.abs()) < tuning().recordings.unit_alike);
        let remark = |weight, about, text| Remark { weight, records: Vec::new(), signal: output.name.clone(), about, text };
        if factors.iter().all(|f| *f < 0.0) {
            let text = format!(
                "has the opposite sign of the model (correlation -{least:.2}): set scale = -1.0 for it under [columns] of set.toml, or \
                    for an input"
            );
            all.push(remark(Weight::Caution, "sign", text));
        }
        if !alike || size < tuning().recordings.unit_far && size > 1.0 / tuning().recordings.unit_far {
            continue;
        }
        let near = |f: f64| (size / f).max(f / size) < tuning().recordings.unit_near;
        let text = match known(&output.kind, problem.model.motion).iter().find(|k| near(k.0)) {
            Some((f, unit)) => format!(
                "is {} times the model's output, at a correlation of {least:.2}: its values look like {unit}; set scale = {} for it under \
                    [columns] of set.toml",
                rounded(size),
                rounded(1.0 / f)
            ),
            None => format!(
                "is {} times the model's output, at a correlation of {least:.2}: a unit is wrong, here or at an input; set scale = ... \
                    under [columns] of set.toml",
                rounded(size)
            ),
        };
        let found = of_records.first().map(|(_, r)| file_name(&r.name).to_string());
        let far = !(0.1 / tuning().recordings.unit_far..=10.0 * tuning().recordings.unit_far).contains(&size);
        let weight = if far { Weight::Unusable } else { Weight::Caution };
        all.push(Remark { records: found.filter(|_| of_records.len() == 1).into_iter().collect(), ..remark(weight, "unit", text) });
    }
    all
}

fn rounded(x: f64) -> f64 {
    backdrive_plant::write::round_significant(x, 3)
}

/// Measured over predicted by least squares, and their correlation; of differences over `lag` samples where that is not 0.
pub(super) fn factor(measured: &[f64], predicted: &[f64], lag: usize) -> (f64, f64) {
    let centred = |x: &[f64]| -> Vec<f64> {
        let x: Vec<f64> = if lag > 0 { x.iter().skip(lag).zip(x).map(|(a, b)| a - b).collect() } else { x.to_vec() };
        let mean = x.iter().sum::<f64>() / x.len().max(1) as f64;
        x.iter().map(|x| x - mean).collect()
    };
    let (y, p) = (centred(measured), centred(predicted));
    let sum = |a: &[f64], b: &[f64]| a.iter().zip(b).map(|(a, b)| a * b).sum::<f64>();
    let (yp, pp, yy) = (sum(&y, &p), sum(&p, &p), sum(&y, &y));
    if pp > 0.0 && yy > 0.0 { (yp / pp, yp / (pp * yy).sqrt()) } else { (0.0, 0.0) }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_factor_and_its_correlation_are_found() {
        let p: Vec<f64> = (0..1000).map(|i| (f64::from(i) * 0.01).sin()).collect();
        let y: Vec<f64> = p.iter().map(|p| 3.0 - 1e3 * p).collect();
        let (f, c) = factor(&y, &p, 0);
        assert!((f + 1e3).abs() < 1e-6 && (c + 1.0).abs() < 1e-9, "{f} {c}");
        let drifting: Vec<f64> = y.iter().enumerate().map(|(i, y)| y + 1e-3 * i as f64).collect();
        assert!((factor(&drifting, &p, 20).0 + 1e3).abs() < 1.0);
        assert_eq!(factor(&[1.0; 10], &p[..10], 0), (0.0, 0.0));
    }
}
