//! Transparency: what the hand feels of what the slave touches, and how well each follows the other.
//!
//! The transmitted impedance Z_t = -S_{r,F_f-d} / (jw S_{r,x_m}) is compared with mu lambda Z_e, Z_e = -S_{r,F_s} / (jw S_{r,x_s}). Here r is an
//! exogenous signal, the dither d or else the operator's intent: correlating with r removes what the loop feeds back from both. Their distance is
//! Lawrence's (1993): the mean of |ln |Z_t / (mu lambda Z_e)|| over the band in which all four correlate with r.

use crate::master_run::{Wanted, run_master};
use crate::phases::{contacts, holds};
use crate::session::{AxisSignals, Session};
use crate::spectra::{Averaging, welch};
use backdrive_nodes::graph::Graph;
use backdrive_signal::statistics::{correlation, rms_of_finite};
use nalgebra::Complex;
use serde::Serialize;
use std::f64::consts::TAU;
use std::ops::Range;

/// Transparency of one axis. Values that cannot be determined are `None`, and the notes give the reason.
#[derive(Debug, Clone, PartialEq, Serialize, Default)]
pub struct Transparency {
    /// Name of the axis.
    pub name: String,
    /// Transmitted against environment impedance.
    pub impedance: Option<Impedance>,
    /// RMS of x_s - mu x_m (where x_s was not recorded: of x_c - mu x_m) in free motion, m.
    pub position_free_rms: Option<f64>,
    /// The same in contact, m.
    pub position_contact_rms: Option<f64>,
    /// RMS of F_f - d - lambda F_s in contact, N.
    pub force_contact_rms: Option<f64>,
    /// RMS of lambda F_s in contact, N: the reference of the former.
    pub reflected_rms: Option<f64>,
    /// rms_of_finite(x_mf) / rms_of_finite(x_mu) in contact: what the reflected force does to the master over what the hand does, by the master's model.
    pub induced_ratio: Option<f64>,
    /// How well the canceller predicted the induced motion after the first contact.
    pub cancellation: Option<Cancellation>,
    /// Why something is not there, and what to know of what is.
    pub notes: Vec<String>,
}

/// Transmitted against environment impedance.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Impedance {
    /// The exogenous signal: `dither` or `operator`.
    pub against: String,
    /// Lowest and highest frequency used, Hz.
    pub band_hz: [f64; 2],
    /// Least coherence with the exogenous signal of a frequency that is used.
    pub least_coherence: f64,
    /// How the spectra were averaged.
    pub averaging: Averaging,
    /// Lawrence's error: the mean of |ln |Z_t / (mu lambda Z_e)|| over the frequencies used; 0 is ideal.
    pub error: f64,
    /// Frequencies used, Hz.
    pub frequency_hz: Vec<f64>,
    /// |Z_t|, N s/m.
    pub transmitted: Vec<f64>,
    /// mu lambda |Z_e|, N s/m.
    pub environment: Vec<f64>,
    /// Phase of Z_t / (mu lambda Z_e), rad.
    pub phase: Vec<f64>,
}

/// How well the canceller predicted the induced motion.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Cancellation {
    /// Time of the first contact, s.
    pub contact_s: f64,
    /// Time from there that was evaluated, s.
    pub window_s: f64,
    /// 1 - rms_of_finite(x_mf - x^_mf) / rms_of_finite(x_mf): 1 is perfect, 0 as good as none, below 0 worse.
    pub quality: f64,
    /// Correlation coefficient of x_mf and x^_mf; `None` where one of them does not move.
    pub correlation: Option<f64>,
}

/// The paper's window after contact, s.
const WINDOW_S: f64 = 0.05;
/// Frequencies at which less coheres are not used.
const LEAST_COHERENCE: f64 = 0.8;
/// Segments that a coherence needs to mean something.
const LEAST_SEGMENTS: usize = 6;
/// A frequency at which the exogenous signal has less than this share of its peak power is not used.
const LEAST_POWER: f64 = 1e-6;

/// Transparency of every axis. `graph` is the one that made the session, where it is ours: the induced motion comes from its master.
pub fn transparency(session: &Session, graph: Option<&Graph>) -> Vec<Transparency> {
    let runs = match graph {
        None => Err("there is no model of the master".to_owned()),
        Some(graph) => run_master(session, graph, Wanted { force: true, energy: false })
            .and_then(|with| Ok((with, run_master(session, graph, Wanted { force: false, energy: false })?))),
    };
    let one = |(index, axis): (usize, &AxisSignals)| {
        let mut found = tracking(session, axis);
        match impedance(session, axis) {
            Ok(impedance) => found.impedance = Some(impedance),
            Err(why) => found.notes.push(format!("the transmitted impedance is not known: {why}")),
        }
        match &runs {
            Err(why) => found.notes.push(format!("the induced motion is not known: {why}")),
            Ok((with, without)) => match (with.position.get(index), without.position.get(index)) {
                (Some(with), Some(without)) => induced(session, axis, with, without, &mut found),
                _ => found.notes.push("the induced motion is not known: the master's model has no such axis".to_owned()),
            },
        }
        found
    };
    session.axes.iter().enumerate().map(one).collect()
}

fn at(column: &[f64], row: usize) -> f64 {
    column.get(row).copied().unwrap_or(f64::NAN)
}

/// F_f without the dither.
fn reflected(axis: &AxisSignals, row: usize) -> f64 {
    let dither = axis.dither.as_ref().map_or(0.0, |d| at(d, row));
    at(&axis.force, row) - if dither.is_finite() { dither } else { 0.0 }
}

fn tracking(session: &Session, axis: &AxisSignals) -> Transparency {
    let mut touches = vec![false; session.len()];
    for row in contacts(axis, session.period_s).into_iter().flatten() {
        if let Some(touches) = touches.get_mut(row) {
            *touches = true;
        }
    }
    let tip = axis.slave.as_ref().unwrap_or(&axis.command);
    let (contact, free): (Vec<usize>, Vec<usize>) = (0..session.len()).partition(|row| touches.get(*row).copied().unwrap_or(false));
    let position = |rows: &[usize]| rms_of_finite(rows.iter().map(|row| at(tip, *row) - at(&session.mu, *row) * at(&axis.master, *row)));
    let felt = |row: usize| at(&session.lambda, row) * at(&axis.contact, row);
    let mut found = Transparency {
        name: axis.name.clone(),
        position_free_rms: position(&free),
        position_contact_rms: position(&contact),
        force_contact_rms: rms_of_finite(contact.iter().map(|row| reflected(axis, *row) - felt(*row))),
        reflected_rms: rms_of_finite(contact.iter().map(|row| felt(*row))),
        ..Transparency::default()
    };
    if axis.slave.is_none() {
        found.notes.push("x_s was not recorded: positions are compared with the command x_c".to_owned());
    }
    if contact.is_empty() {
        found.notes.push("there was no contact".to_owned());
    }
    found
}

fn induced(session: &Session, axis: &AxisSignals, with: &[f64], without: &[f64], found: &mut Transparency) {
    let touching = contacts(axis, session.period_s);
    let induced = |row: usize| at(with, row) - at(without, row);
    let rows = || touching.iter().flat_map(|r| r.clone());
    if let (Some(by_force), Some(by_hand)) = (rms_of_finite(rows().map(induced)), rms_of_finite(rows().map(|row| at(without, row))))
        && by_hand > 0.0
    {
        found.induced_ratio = Some(by_force / by_hand);
    }
    let Some(first) = touching.first().map(|r| r.start) else { return };
    let Some(predicted) = &axis.induced else {
        found.notes.push("nothing was cancelled, or the cancelled motion was not recorded".to_owned());
        return;
    };
    let rows = (WINDOW_S / session.period_s).round() as usize;
    let pairs: Vec<(f64, f64)> = (first..(first + rows).min(session.len()))
        .map(|row| (induced(row), at(predicted, row)))
        .filter(|(x, p)| x.is_finite() && p.is_finite())
        .collect();
    let size = rms_of_finite(pairs.iter().map(|p| p.0)).unwrap_or(0.0);
    if size == 0.0 || pairs.len() < 2 {
        found.notes.push("no force moved the master within 50 ms of the first contact: there was nothing to cancel".to_owned());
        return;
    }
    let left = rms_of_finite(pairs.iter().map(|p| p.0 - p.1)).unwrap_or(f64::NAN);
    found.cancellation = Some(Cancellation {
        contact_s: first as f64 * session.period_s,
        window_s: pairs.len() as f64 * session.period_s,
        quality: 1.0 - left / size,
        correlation: correlated(&pairs),
    });
}

fn correlated(pairs: &[(f64, f64)]) -> Option<f64> {
    let (x, y): (Vec<f64>, Vec<f64>) = pairs.iter().copied().unzip();
    Some(correlation(&x, &y)).filter(|r| r.is_finite())
}

fn impedance(session: &Session, axis: &AxisSignals) -> Result<Impedance, String> {
    let period_s = session.period_s;
    let (against, exogenous, pieces) = match (&axis.dither, &axis.intent) {
        (Some(dither), _) => ("dither", dither, holds(axis, period_s)),
        (None, Some(intent)) => ("operator", intent, contacts(axis, period_s)),
        (None, None) => return Err("neither a dither nor the operator's intent was recorded".to_owned()),
    };
    if pieces.is_empty() {
        return Err(if against == "dither" { "the hand never held still in contact" } else { "there was no contact" }.to_owned());
    }
    let tip = axis.slave.as_ref().unwrap_or(&axis.command);
    let force: Vec<f64> = (0..session.len()).map(|row| reflected(axis, row)).collect();
    let gains = || session.mu.iter().zip(&session.lambda).map(|(m, l)| m * l);
    const FORCE: usize = 1;
    const MASTER: usize = 2;
    const CONTACT: usize = 3;
    const TIP: usize = 4;
    let columns: [&[f64]; 5] = [exogenous, &force, &axis.master, &axis.contact, tip];
    let pieces = whole_pieces(&pieces, &columns, &gains().collect::<Vec<f64>>());
    let longest = pieces.iter().map(|p| p.end - p.start).max().unwrap_or(0);
    let most = ((1.0 / period_s) as usize).max(16);
    // As long as possible up to 1 s, but enough of them to estimate the coherence.
    let count = |length: usize| pieces.iter().map(|p| (p.end - p.start).saturating_sub(length / 2) / (length / 2).max(1)).sum::<usize>();
    let mut length = longest.min(most);
    while length >= 16 && count(length) < LEAST_SEGMENTS * 2 {
        length = length * 3 / 4;
    }
    if length < 16 {
        return Err("the contact at one gain without lost rows is too short".to_owned());
    }
    let gain = pieces.first().and_then(|p| gains().nth(p.start)).unwrap_or(f64::NAN);
    let nothing = || "no segment is complete".to_owned();
    let spectra = welch(&columns, &pieces, length, period_s, 0.5 / period_s).ok_or_else(nothing)?;
    let power = |line: usize| spectra.lines.get(line).map_or(0.0, |s| s[(0, 0)].re);
    let peak = (0..spectra.lines.len()).map(power).fold(0.0, f64::max);
    if peak <= 0.0 {
        return Err(format!("the {against} has no power there"));
    }
    let mut found = Impedance {
        against: against.to_owned(),
        band_hz: [0.0; 2],
        least_coherence: 1.0,
        averaging: spectra.averaging,
        error: 0.0,
        frequency_hz: Vec::new(),
        transmitted: Vec::new(),
        environment: Vec::new(),
        phase: Vec::new(),
    };
    let mut best = (0.0, [0.0; 4]);
    // The lowest line holds what the window leaves of the mean.
    for (line, (hz, s)) in spectra.hz.iter().zip(&spectra.lines).enumerate().skip(1) {
        if power(line) < LEAST_POWER * peak {
            continue;
        }
        let coherences = [FORCE, MASTER, CONTACT, TIP].map(|c| spectra.coherence(line, 0, c));
        let coherence = coherences.into_iter().fold(1.0, f64::min);
        if coherence > best.0 {
            best = (coherence, coherences);
        }
        if coherence < LEAST_COHERENCE {
            continue;
        }
        let jw = Complex::new(0.0, TAU * hz);
        let transmitted = -s[(FORCE, 0)] / (jw * s[(MASTER, 0)]);
        let environment = -s[(CONTACT, 0)] / (jw * s[(TIP, 0)]) * Complex::new(gain, 0.0);
        let ratio = transmitted / environment;
        if !(ratio.norm().is_finite() && ratio.norm() > 0.0) {
            continue;
        }
        found.error += ratio.norm().ln().abs();
        found.least_coherence = found.least_coherence.min(coherence);
        found.frequency_hz.push(*hz);
        found.transmitted.push(transmitted.norm());
        found.environment.push(environment.norm());
        found.phase.push(ratio.arg());
    }
    let (Some(low), Some(high)) = (found.frequency_hz.first().copied(), found.frequency_hz.last().copied()) else {
        let [force, master, contact, tip] = best.1;
        // A canceller that is right keeps the dither from the slave.
        let why = if against == "dither" && contact < master { "; the cancelled motion never reaches the slave" } else { "" };
        return Err(format!(
            "at no frequency are all forces and motions coherent with the {against} (at least {LEAST_COHERENCE}); best: F_f {force:.2}, \
             x_m {master:.2}, F_s {contact:.2}, x_s {tip:.2}{why}"
        ));
    };
    found.band_hz = [low, high];
    found.error /= found.frequency_hz.len() as f64;
    Ok(found)
}

/// The parts of pieces in which every column is a number and the gain is that of the longest such part's start.
fn whole_pieces(pieces: &[Range<usize>], columns: &[&[f64]], gains: &[f64]) -> Vec<Range<usize>> {
    let mut parts: Vec<Range<usize>> = Vec::new();
    for piece in pieces {
        let mut start = None;
        for row in piece.start..=piece.end {
            let good = row < piece.end && columns.iter().all(|c| at(c, row).is_finite()) && at(gains, row).is_finite();
            let same = start.is_none_or(|s: usize| (at(gains, row) - at(gains, s)).abs() <= 1e-9 * at(gains, s).abs());
            match start {
                None if good => start = Some(row),
                Some(from) if !good || !same => {
                    parts.push(from..row);
                    start = good.then_some(row);
                }
                _ => {}
            }
        }
    }
    let gain = parts.iter().max_by_key(|p| p.end - p.start).map_or(f64::NAN, |p| at(gains, p.start));
    parts.retain(|p| (at(gains, p.start) - gain).abs() <= 1e-9 * gain.abs());
    parts
}

#[cfg(test)]
mod tests {
    use super::*;

    const MU: f64 = 2.0;
    const LAMBDA: f64 = 0.4;

    /// A loop of scaling alone on a master of mass, spring and damper, and a slave that is where it shall be on a spring and a damper;
    /// `lag` rows of delay on F_s. The hand holds still; the dither is noise.
    fn scaling_loop(lag: usize) -> Session {
        let (period_s, rows) = (1e-3, 8000_usize);
        let (mass, damping, stiffness, k, b) = (0.05, 5.0, 400.0, 800.0, 2.0);
        let mut seed = 7_u64;
        let mut noise = || {
            seed = seed.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
            (seed >> 33) as f64 / f64::from(1_u32 << 30) - 1.0
        };
        let mut axis = AxisSignals { name: "x".into(), ..AxisSignals::default() };
        let (mut x, mut v, mut before) = (2e-3, 0.0, 2e-3);
        let mut dither = Vec::new();
        for row in 0..rows {
            let tip = MU * x;
            axis.master.push(x);
            axis.command.push(tip);
            axis.contact.push(-k * tip - b * (tip - MU * before) / period_s);
            let felt = row.checked_sub(lag).map_or(0.0, |r| axis.contact[r]);
            dither.push(0.05 * noise());
            let force = LAMBDA * felt + dither[row];
            axis.force.push(force);
            before = x;
            v += period_s / mass * (force - damping * v - stiffness * (x - 5e-3));
            x += period_s * v;
        }
        axis.slave = Some(axis.command.clone());
        axis.dither = Some(dither);
        axis.intent = Some(vec![5e-3; rows]);
        axis.clamped = vec![false; rows];
        let (mu, lambda) = (vec![MU; rows], vec![LAMBDA; rows]);
        Session {
            name: "loop".into(),
            period_s,
            axes: vec![axis],
            mu,
            lambda,
            notes: Vec::new(),
            sensors: Vec::new(),
            cut_short: None,
            parts: Vec::new(),
            elsewhere: None,
            bridged_s: crate::unjudged::BRIDGED_S,
        }
    }

    #[test]
    fn pure_scaling_transmits_mu_lambda_times_the_environment() {
        let found = transparency(&scaling_loop(0), None).remove(0);
        let impedance = found.impedance.expect("a dither is there");
        assert!(impedance.error < 1e-9 && impedance.phase.iter().all(|p| p.abs() < 1e-9), "{}", impedance.error);
        assert!(impedance.band_hz[1] > 100.0 && impedance.averaging.segments >= LEAST_SEGMENTS, "{:?}", impedance.band_hz);
        // Z_e = (k + b (1 - z^-1)/T)/jw, the damper being a backward difference.
        for (hz, z) in impedance.frequency_hz.iter().zip(&impedance.environment).filter(|(hz, _)| **hz < 100.0) {
            let jw = Complex::new(0.0, TAU * hz);
            let difference = (Complex::new(1.0, 0.0) - (-jw * 1e-3).exp()) / 1e-3;
            let exact = (difference * 2.0 + 800.0) / jw * MU * LAMBDA;
            assert!((z / exact.norm() - 1.0).abs() < 0.01, "{hz} Hz: {z} {exact}");
        }
        assert!(found.force_contact_rms.unwrap() < 1e-12 && found.position_contact_rms.unwrap() < 1e-15);
        assert!(found.reflected_rms.unwrap() > 0.1 && found.position_free_rms.is_none() && found.induced_ratio.is_none());
    }

    #[test]
    fn a_delay_turns_the_phase_and_not_the_magnitude() {
        let found = transparency(&scaling_loop(2), None).remove(0).impedance.unwrap();
        assert!(found.error < 0.05, "{}", found.error);
        for (hz, phase) in found.frequency_hz.iter().zip(&found.phase).filter(|(hz, _)| (10.0..40.0).contains(*hz)) {
            assert!((phase + TAU * hz * 2e-3).abs() < 0.1, "{hz} Hz: {phase}");
        }
    }

    #[test]
    fn without_anything_exogenous_it_is_not_told() {
        let mut session = scaling_loop(0);
        (session.axes[0].dither, session.axes[0].intent) = (None, None);
        let found = transparency(&session, None).remove(0);
        assert!(found.impedance.is_none() && found.notes.iter().any(|n| n.contains("neither a dither nor")), "{:?}", found.notes);
    }

    #[test]
    fn lost_rows_are_left_out() {
        let mut session = scaling_loop(0);
        for row in (1500..7000).step_by(1700) {
            session.axes[0].contact[row] = f64::NAN;
        }
        let impedance = transparency(&session, None).remove(0).impedance.unwrap();
        assert!(impedance.error < 1e-9);
    }
}
