//! The loop without a dither: only the operator shook it.
//!
//! `x_m = G_u x_u + G_f F_f`, and in contact `F_f` follows `x_m`. Where the intent is all that acts, intent and force are fully coherent, and the
//! estimate of `G_f` is `1/(lambda H_se)` or nothing. Free motion breaks that: there the force is 0 and `G_u` is identified alone. So both are
//! needed, broad-band, and the intent must be recorded.

use super::AxisEstimate;
use super::dithered::{delays, on_lines};
use super::edge::Loop;
use super::local::{Columns, LocalFit, MOVED, fit, shaken};
use super::note::Note;
use super::prepared::{Column, Prepared, column, columns};
use super::{CannotTell, Frequency, FrequencyError, LevelEstimate, Options, Response, edge};
use crate::spectra::{CrossSpectra, welch};
use nalgebra::Complex;
use std::ops::Range;

/// Share of the force's power that must be independent of the intent for the two to be separable.
const LEAST_FREEDOM: f64 = 0.02;
/// By how much that part must exceed what contact alone leaves (noise that the loop has fed back).
const ABOVE_NOISE: f64 = 20.0;

/// Answers from the operator's motion, or records why not.
pub(super) fn analyse(prepared: &Prepared, options: &Options, result: &mut Frequency) -> Result<(), FrequencyError> {
    let cannot = |reason: &str, result: &mut Frequency| {
        result.cannot_tell = Some(CannotTell { reason: reason.to_string(), advice: Some(result.advice.clone()) });
        Ok(())
    };
    let session = &prepared.session;
    if options.parts.any() {
        return cannot("without a recorded dither the parts of the loop cannot be separated, so none can be exchanged", result);
    }
    if session.axes.len() != 1 {
        return cannot("without a recorded dither the loops of several axes cannot be separated", result);
    }
    let Some(intent) = session.axes.first().and_then(|a| a.intent.clone()) else {
        let reason = "no external excitation was recorded: with the operator's motion alone, force and motion give exactly 1/(lambda \
                      H_se), an infinite stability limit for any loop";
        return cannot(reason, result);
    };
    let stretches = whole_rows(prepared, &intent);
    let mut signals = prepared.signals.clone();
    signals.push(intent);
    let (intent_column, force_column) = (signals.len() - 1, column(0, Column::Force));
    let slices: Vec<&[f64]> = signals.iter().map(Vec::as_slice).collect();
    let rows: usize = stretches.iter().map(|s| s.len()).sum();
    let Some(segment) = segment(&stretches, session.period_s) else {
        return cannot("the record is too short to separate the operator's motion from the effect of the force", result);
    };
    let contact: Vec<Range<usize>> = stretches.iter().flat_map(|s| touching(&session.axes[0].contact, s)).collect();
    let spectra_of = |segment: usize| {
        let all = welch(&slices, &stretches, segment, session.period_s, 0.45 / session.period_s)?;
        let touching = welch(&slices, &contact, segment, session.period_s, 0.45 / session.period_s)?;
        Some((all, touching))
    };
    let Some((all, touching)) = spectra_of(segment) else {
        return cannot("no contact of the slave lasts long enough", result);
    };
    let shaken = shaken(&all, &[intent_column], MOVED);
    let top_hz = shaken.last().map_or(0.0, |k| all.hz[*k]);
    let apart: Vec<usize> = shaken.into_iter().filter(|k| told_apart(&all, &touching, *k, intent_column, force_column)).collect();
    let broad = apart.last().map_or(0.0, |k| all.hz[*k]);
    if apart.len() < 8 || broad < 10.0 {
        let reason = format!(
            "nothing external excited the force: the operator's intent reaches up to {top_hz:.0} Hz, and there force and intent are \
             coherent, so G_f cannot be identified from either"
        );
        return cannot(&reason, result);
    }
    let Some(found) = two_inputs(&all, &touching, options, intent_column, &apart, 1.0) else {
        return cannot("intent and force are too coherent to identify G_f", result);
    };
    let half = spectra_of(segment / 2).and_then(|(a, t)| {
        let lines: Vec<usize> = shaken_lines(&a, intent_column, broad);
        two_inputs(&a, &t, &Options { draws: 0, ..*options }, intent_column, &lines, 1.0)
    });
    let (measured, parts) = found;
    let edge = measured.edge(half.as_ref().map(|h| &h.0));
    // Nothing is known above the band of the operator.
    if edge.gain.is_none() {
        result.notes.push(Note::OperatorBand { hz: broad });
    }
    result.notes.push(Note::NoDither);
    result.delays = delays(prepared, &touching, &[true]);
    let told = measured.told();
    let pair = |l: Complex<f64>| [l.re, l.im];
    let l: Vec<[f64; 2]> = measured.nominal.iter().map(|m| pair(m[(0, 0)])).collect();
    let line = |hz: &f64| all.hz.partition_point(|f| f < &(hz - 1e-9)).min(all.hz.len() - 1);
    let axis = AxisEstimate {
        name: session.axes[0].name.clone(),
        sigma: measured.sigma.iter().map(|s| s[(0, 0)]).collect(),
        told: told.clone(),
        coherence: measured.hz.iter().map(|f| all.coherence(line(f), intent_column, force_column)).collect(),
        g_f: second_input(&measured.hz, parts.master.as_ref()),
        motion: second_input(&measured.hz, Some(&parts.motion)),
        h_se: on_lines(&measured.hz, Some(&parts.slave)),
        edge,
        l,
    };
    result.levels.push(LevelEstimate {
        amplitude_rms: 0.0,
        contact: vec![true],
        rows,
        averaging: all.averaging,
        hz: measured.hz.clone(),
        loci: edge::loci(&measured.nominal, &told).into_iter().map(|l| l.into_iter().map(pair).collect()).collect(),
        loci_hz: measured.hz.iter().zip(&told).filter(|(_, t)| **t).map(|(f, _)| *f).collect(),
        axes: vec![axis],
        edge,
        measured,
    });
    Ok(())
}

struct Found {
    motion: LocalFit,
    master: Option<LocalFit>,
    slave: LocalFit,
}

fn shaken_lines(spectra: &CrossSpectra, intent: usize, broad: f64) -> Vec<usize> {
    shaken(spectra, &[intent], MOVED).into_iter().filter(|k| spectra.hz[*k] <= broad).collect()
}

/// `L` from `x_c/mu = C_u x_u + C F_f` over all rows, and `F_s = H_se x_c` over those in contact.
fn two_inputs(
    all: &CrossSpectra,
    touching: &CrossSpectra,
    options: &Options,
    intent: usize,
    lines: &[usize],
    narrow: f64,
) -> Option<(Loop, Found)> {
    let keep = |spectra: &CrossSpectra| {
        let pick: Vec<usize> = lines.iter().copied().filter(|k| *k < spectra.hz.len()).collect();
        CrossSpectra {
            hz: pick.iter().map(|k| spectra.hz[*k]).collect(),
            lines: pick.iter().map(|k| spectra.lines[*k].clone()).collect(),
            averaging: spectra.averaging,
        }
    };
    let (all, touching) = (keep(all), keep(touching));
    let inputs = [intent, column(0, Column::Force)];
    let of = |output: Column| {
        fit(&all, Columns { outputs: &[column(0, output)], inputs: &inputs, instruments: &inputs, least_power: MOVED }, narrow)
    };
    let motion = of(Column::Motion)?;
    let commands = columns(1, Column::Command);
    // Reflected force per unit gain on command over mu: H_se with what lies behind it.
    let back = Columns {
        outputs: &columns(1, Column::Reflected),
        inputs: &columns(1, Column::Motion),
        instruments: &columns(1, Column::Motion),
        least_power: MOVED,
    };
    let back = fit(&touching, back, narrow)?;
    let slave = fit(
        &touching,
        Columns { outputs: &columns(1, Column::Contact), inputs: &commands, instruments: &commands, least_power: MOVED },
        narrow,
    )?;
    let whole = Loop::measured(&motion, options.draws, options.seed);
    let back = Loop::measured(&back, options.draws, options.seed + 1);
    // Of the two inputs only the force belongs to the loop.
    let measured = back.combine(&whole, |b, c| b * c.columns(1, 1));
    Some((measured, Found { motion, master: of(Column::Master), slave }))
}

fn second_input(hz: &[f64], found: Option<&LocalFit>) -> Response {
    let mut response = on_lines(hz, found);
    let Some(found) = found else { return response };
    let sigma = found.sigma();
    for (i, f) in hz.iter().enumerate() {
        if let Some(j) = found.hz.iter().position(|h| (h - f).abs() < 1e-6 * f) {
            let value = found.value[j][(0, 1)];
            (response.value[i], response.sigma[i]) = ([value.re, value.im], sigma[j][(0, 1)]);
        }
    }
    response
}

/// Whether force and intent are separable at a line: by free motion, and not by noise that went round the loop.
fn told_apart(all: &CrossSpectra, touching: &CrossSpectra, line: usize, intent: usize, force: usize) -> bool {
    let left = |s: &CrossSpectra| {
        let m = &s.lines[line];
        let of_intent = if m[(intent, intent)].re > 0.0 { m[(force, intent)].norm_sqr() / m[(intent, intent)].re } else { 0.0 };
        (m[(force, force)].re, m[(force, force)].re - of_intent)
    };
    if line >= touching.lines.len() {
        return false;
    }
    let ((power, free), (_, noise)) = (left(all), left(touching));
    let share = touching.averaging.averages / all.averaging.averages.max(1e-9);
    power > 0.0 && free > LEAST_FREEDOM * power && free > ABOVE_NOISE * share.min(1.0) * noise
}

/// Rows of constant gain in which nothing is missing or clamped.
fn whole_rows(prepared: &Prepared, intent: &[f64]) -> Vec<Range<usize>> {
    let session = &prepared.session;
    let mut stretches: Vec<Range<usize>> = Vec::new();
    for row in 0..session.len() {
        let axis = &session.axes[0];
        let finite = [axis.master[row], axis.force[row], axis.command[row], axis.contact[row], intent[row], session.gain(row)];
        let same = row == 0 || session.gain(row - 1) == session.gain(row);
        let good = finite.iter().all(|x| x.is_finite()) && !axis.clamped.get(row).copied().unwrap_or(false) && session.gain(row) != 0.0;
        match stretches.last_mut() {
            Some(last) if good && same && last.end == row => last.end = row + 1,
            _ if good => stretches.push(row..row + 1),
            _ => {}
        }
    }
    stretches
}

/// The parts of a stretch in which the slave touches.
fn touching(contact: &[f64], stretch: &Range<usize>) -> Vec<Range<usize>> {
    let mut parts: Vec<Range<usize>> = Vec::new();
    for row in stretch.clone().filter(|row| contact[*row] != 0.0) {
        match parts.last_mut() {
            Some(last) if last.end == row => last.end = row + 1,
            _ => parts.push(row..row + 1),
        }
    }
    parts
}

/// Segments of at most 2 s, at least eight in the record.
fn segment(stretches: &[Range<usize>], period_s: f64) -> Option<usize> {
    let all = |segment: usize| stretches.iter().map(|s| s.len()).filter(|n| *n >= segment).sum::<usize>();
    [2.0, 1.0, 0.5, 0.25].iter().map(|s| (s / period_s).round() as usize).find(|segment| all(*segment) >= 8 * segment)
}
