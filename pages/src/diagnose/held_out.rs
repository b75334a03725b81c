//! Measured beside predicted, and the residual.

use super::phrases::adds;
use crate::parts::file_name;
use backdrive_diagnosis::belief::compare::{Predicted, density, predictions, qualities};
use backdrive_diagnosis::belief::parameters::unit_of_output;
use backdrive_diagnosis::diagnose::Diagnosis;
use backdrive_diagnosis::output_error::candidate::Candidate;
use backdrive_diagnosis::recordings::problem::Record;
use backdrive_report::{Cell, Colour, Dash, Figure, Page, Plot, Series, Table, Tone, number, percent};

/// Pairs of record and output that are drawn at once; the rest is folded away.
const DRAWN: usize = 3;
/// Share of a record that a zoom shows.
const ZOOM: usize = 24;

/// Predictions of one record by the three models.
struct Three<'a> {
    record: &'a Record,
    given: Option<&'a Predicted>,
    refitted: Option<&'a Predicted>,
    /// `None` where nothing was added to the refitted model.
    diagnosed: Option<&'a Predicted>,
}

pub(super) fn section(page: &mut Page, found: &Diagnosis, best: &Candidate) {
    let (problem, search) = (&found.problem, &found.search);
    let records = if problem.held_out.is_empty() { &problem.fit } else { &problem.held_out };
    let nominal = &search.nominal.structure;
    let stated: Vec<f64> = problem.stated.iter().map(|s| s.given).collect();
    let given = predictions(problem, records, nominal, &nominal.values(problem, &stated, &[], &[]));
    let refitted = predictions(problem, records, nominal, &search.nominal.fit.values);
    let diagnosed = if adds(best) { predictions(problem, records, &best.structure, &best.fit.values) } else { None };
    let mut pairs: Vec<(usize, usize)> = Vec::new();
    for (r, record) in records.iter().enumerate() {
        pairs.extend(record.outputs.iter().enumerate().filter(|o| o.1.is_some()).map(|(o, _)| (r, o)));
    }
    let draw = |page: &mut Page, (r, output): (usize, usize)| {
        let of = |all: &'_ Option<Vec<Predicted>>| all.as_ref().and_then(|a| a.get(r)).cloned();
        let (given, refitted, diagnosed) = (of(&given), of(&refitted), of(&diagnosed));
        let three = Three { record: &records[r], given: given.as_ref(), refitted: refitted.as_ref(), diagnosed: diagnosed.as_ref() };
        figures(page, found, &three, output);
    };
    pairs.iter().take(DRAWN).for_each(|pair| draw(page, *pair));
    if pairs.len() > DRAWN {
        page.details(&format!("{} more", pairs.len() - DRAWN), |inside| pairs[DRAWN..].iter().for_each(|pair| draw(inside, *pair)));
    }
    let mut table = Table::new(["record", "output", "as given", "refitted", "diagnosed", "residual, in noise sd", "fitted"]);
    let sets = [(problem.fit.as_slice(), true), (problem.held_out.as_slice(), false)];
    for (records, fitted) in sets {
        let quality = |structure, values: &[f64]| {
            predictions(problem, records, structure, values).map(|p| qualities(problem, records, &p, &search.noise_sd, fitted))
        };
        let given = quality(nominal, &nominal.values(problem, &stated, &[], &[]));
        let refitted = quality(nominal, &search.nominal.fit.values);
        let diagnosed = quality(&best.structure, &best.fit.values);
        let Some(last) = &diagnosed else { continue };
        for (i, q) in last.iter().enumerate() {
            let of = |all: &Option<Vec<backdrive_diagnosis::belief::compare::Quality>>| {
                all.as_ref().and_then(|a| a.get(i)).map_or("–".to_string(), |q| percent(q.nrmse))
            };
            let tone = if q.floors < 1.15 { Tone::Good } else { Tone::Warning };
            table.push([
                Cell::from(file_name(&q.record)),
                q.output.clone().into(),
                of(&given).into(),
                of(&refitted).into(),
                (if adds(best) { percent(q.nrmse) } else { "–".to_string() }).into(),
                Cell::tone(number(q.floors), tone),
                (if fitted { "yes" } else { "held out" }).into(),
            ]);
        }
    }
    page.table(table.caption(&format!(
        "Rms errors as shares of each signal's standard deviation; {} is 1 in the last column but one.",
        search.noise()
    )));
}

/// One output of a record, and what the three models predict.
struct Columns<'a> {
    measured: &'a [f64],
    given: Option<Vec<f64>>,
    refitted: Option<Vec<f64>>,
    diagnosed: Option<Vec<f64>>,
    label: &'a str,
    unit: String,
}

fn columns<'a>(found: &'a Diagnosis, three: &Three<'a>, output: usize) -> Option<Columns<'a>> {
    let measured = three.record.outputs.get(output)?.as_ref()?;
    let shown = found.problem.model.outputs.get(output)?;
    let column = |p: Option<&Predicted>| p.and_then(|p| p.get(output)).and_then(|c| c.clone());
    Some(Columns {
        measured,
        given: column(three.given),
        refitted: column(three.refitted),
        diagnosed: column(three.diagnosed),
        label: &shown.name,
        unit: unit_of_output(&found.problem, &shown.kind),
    })
}

/// The whole record, with its residual folded.
fn figures(page: &mut Page, found: &Diagnosis, three: &Three, output: usize) {
    let Some(Columns { measured, given, refitted, diagnosed, label, unit }) = columns(found, three, output) else { return };
    let period = three.record.period;
    let time: Vec<f64> = (0..measured.len()).map(|k| k as f64 * period).collect();
    let last = diagnosed.as_ref().or(refitted.as_ref());
    let (from, to) = widest(measured, refitted.as_deref().filter(|_| diagnosed.is_some()).or(given.as_deref()), last.map(Vec::as_slice));
    let span = (from as f64 * period, to as f64 * period);
    let name = file_name(&three.record.name);

    let mut whole = Plot::new(&format!("{name}: {label}")).x_axis("time", "s").y_axis(label, &unit);
    whole = whole.region(span.0, span.1, Tone::Limited, "where the models differ most");
    if let Some(refitted) = &refitted {
        whole =
            whole.series(Series::line("parameters refitted", &time, refitted).colour(Colour::Nth(0)).dash(Dash::Solid).outside_limits());
    }
    if let Some(diagnosed) = &diagnosed {
        whole = whole.series(Series::line("diagnosed", &time, diagnosed).colour(Colour::Nth(1)).dash(Dash::Solid).outside_limits());
    }
    // Last, so that it lies above the predictions.
    whole = whole.series(Series::line("measured", &time, measured).colour(Colour::Ink).dash(Dash::Dotted));
    page.figure(whole, "");
    page.details(&format!("Residual of {name}, {label}"), |inside| residual(inside, found, three, output, (from, to)));
}

/// The part where the models differ most, and the residual in time and frequency.
fn residual(page: &mut Page, found: &Diagnosis, three: &Three, output: usize, (from, to): (usize, usize)) {
    let Some(Columns { measured, given, refitted, diagnosed, label, unit }) = columns(found, three, output) else { return };
    let period = three.record.period;
    let time: Vec<f64> = (0..measured.len()).map(|k| k as f64 * period).collect();
    let name = file_name(&three.record.name);
    let part = |x: &[f64]| x.get(from..to).unwrap_or(&[]).to_vec();
    let near = part(&time);
    let mut zoom = Plot::new("Where the models differ most").x_axis("time", "s").y_axis(label, &unit);
    if let Some(given) = &given {
        zoom = zoom.series(Series::line("as given", &near, &part(given)).colour(Colour::Muted).dash(Dash::Dotted).outside_limits());
    }
    if let Some(refitted) = &refitted {
        zoom = zoom.series(Series::line("parameters refitted", &near, &part(refitted)).colour(Colour::Nth(0)).dash(Dash::Dashed));
    }
    if let Some(diagnosed) = &diagnosed {
        zoom = zoom.series(Series::line("diagnosed", &near, &part(diagnosed)).colour(Colour::Nth(1)).dash(Dash::Solid));
    }
    zoom = zoom.series(Series::line("measured", &near, &part(measured)).colour(Colour::Ink).dash(Dash::Dotted));
    page.figure(zoom, "");

    let floor = found.search.noise_sd.get(output).copied().unwrap_or(0.0);
    let error = |p: &Option<Vec<f64>>| p.as_ref().map(|p| measured.iter().zip(p).map(|(y, p)| y - p).collect::<Vec<f64>>());
    let (e_given, e_refitted, e_diagnosed) = (error(&given), error(&refitted), error(&diagnosed));
    let mut left = Plot::new("Residual, in time").x_axis("time", "s").y_axis("measured minus predicted", &unit);
    let mut spectrum = Plot::new("Residual, by frequency").x_axis("frequency", "Hz").y_axis("density", &per_hertz(&unit)).x_log().y_log();
    let looks = [
        ("as given", &e_given, Colour::Muted, true),
        ("parameters refitted", &e_refitted, Colour::Nth(0), false),
        ("diagnosed", &e_diagnosed, Colour::Nth(1), false),
    ];
    for (name, error, colour, only_frequency) in looks {
        let Some(error) = error else { continue };
        if !only_frequency {
            left = left.series(Series::line(name, &time, error).colour(colour).dash(Dash::Solid));
        }
        let (hz, power) = density(error, period);
        spectrum = spectrum.series(Series::line(name, &hz, &power).colour(colour).dash(Dash::Solid));
    }
    let noise = 2.0 * floor * floor * period;
    spectrum = spectrum.horizontal(noise, "sensor's noise", Tone::Good);
    page.figure(
        Figure::beside([left, spectrum]),
        &format!("{name}, {label}. Sensor noise alone would be flat at the line: {} rms.", backdrive_report::si(floor, &unit)),
    );
}

/// Unit of a density of what has this unit.
fn per_hertz(unit: &str) -> String {
    if unit.chars().all(char::is_alphabetic) { format!("{unit}²/Hz") } else { format!("({unit})²/Hz") }
}

/// The part of a record in which one prediction is further from the measurement than the other one: first and last sample.
fn widest(measured: &[f64], worse: Option<&[f64]>, better: Option<&[f64]>) -> (usize, usize) {
    let n = measured.len();
    let size = (n / ZOOM).max(40).min(n.max(1));
    let square = |p: Option<&[f64]>, k: usize| p.and_then(|p| p.get(k)).zip(measured.get(k)).map_or(0.0, |(p, y)| (y - p) * (y - p));
    let gain: Vec<f64> = (0..n).map(|k| square(worse, k) - square(better, k)).collect();
    let mut sum: f64 = gain.iter().take(size).sum();
    let (mut best, mut at) = (sum, 0);
    for k in size..n {
        sum += gain[k] - gain[k - size];
        if sum > best {
            (best, at) = (sum, k + 1 - size);
        }
    }
    (at, at + size)
}

#[cfg(test)]
mod tests {
    use super::widest;

    #[test]
    fn the_zoom_shows_where_the_models_part() {
        let measured = vec![0.0; 2400];
        let mut worse = measured.clone();
        worse[1500..1550].fill(1.0);
        let (from, to) = widest(&measured, Some(&worse), Some(&measured));
        assert!(from <= 1500 && to >= 1550 && to - from == 100, "{from} {to}");
        assert_eq!(widest(&[], None, None), (0, 1));
    }
}
