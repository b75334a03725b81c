//! The operator's intent from a bag that did not record it.
//!
//! Kuchenbecker & Niemeyer's x^_mu = x_m - Ghat_f F_f is where the hand alone would have taken the master. The hand that takes it there is found by
//! iteration. The recorded F_f and a hand x_u drive the master's model, and the inverse of the model's response to the hand corrects x_u by the error
//! of x_m. There is no lag, because the whole record is known, and friction and hysteresis are included, because the model has them.

use super::ResimulateError;
use crate::session::Session;
use backdrive_control::device::{self, Device, DeviceOptions};
use backdrive_control::operator::Intent;
use backdrive_nodes::graph::{DeviceFiles, Graph, NodeKind, Settings};
use backdrive_plant::elements::{Law, Side};
use backdrive_plant::linear::{LinearModel, Operating};
use backdrive_signal::statistics::rms;
use realfft::num_complex::Complex;
use realfft::{ComplexToReal, RealFftPlanner, RealToComplex};
use std::sync::Arc;

/// What a hand does up to here is recovered whole, Hz.
pub const PASS_HZ: f64 = 12.0;
/// What is faster than this is none of the hand's, Hz.
pub const STOP_HZ: f64 = 20.0;
/// A hand whose intent stays within this share of its range holds still.
pub const STILL_SHARE: f64 = 0.02;
/// For at least this long, s: shorter rests are not judged.
const STILL_S: f64 = 0.45;
/// A rest begins and ends within this time, s.
const BLEND_S: f64 = 0.02;
/// Corrections at most; they stop earlier where the error falls no more.
const PASSES: usize = 20;
/// The model's response to the hand is evaluated with this amplitude across what is not linear, as a share of the range of x_m.
const LOOK_SHARE: f64 = 0.05;
/// Amplitude at which the grip's compliance is evaluated, m or rad.
const LOOK_AT: f64 = 1e-3;
/// A record that lacks more of x_m or F_f than this share cannot be followed.
const MOST_MISSING: f64 = 0.1;

/// The hand of a session.
#[derive(Debug, Clone)]
pub struct Recovered {
    /// What the hand wanted, per axis, one row per step.
    pub intents: Vec<Intent>,
    /// RMS of the residual between x_m and the model moved by that hand, as a share of the range of x_m, per axis.
    pub residual: Vec<f64>,
    /// How far the true hand may have been from the recovered one without an effect on x_m, per axis, m or rad: the motion that dry friction holds
    /// against the grip. With friction the stability limit depends on what the hand does, so where this is large the limit is less certain.
    pub ambiguity: Vec<f64>,
    /// Time in which the hand holds still on all axes, s: only there a verdict can be drawn.
    pub still_s: f64,
}

/// Finds the hand that moved the master of `graph` as the session recorded it.
///
/// # Errors
/// A master without a model or without a grip that has a hand; a session with other axes, too short, or with too much missing.
pub fn recover_intent(session: &Session, graph: &Graph) -> Result<Recovered, ResimulateError> {
    let cannot = |why: &str| ResimulateError::Intent { name: session.name.clone(), why: why.to_string() };
    let Some(Settings::Master(files)) = graph.node_of(NodeKind::Master).map(|n| &n.settings) else {
        return Err(cannot("the graph has no master"));
    };
    let Some(model) = &files.model else {
        return Err(cannot("the master is an external program; give its model with --master FILE"));
    };
    if model.axes.len() != session.axes.len() {
        return Err(cannot(&format!("the master's model has {} axes, the session {}", model.axes.len(), session.axes.len())));
    }
    let rows = session.len();
    if rows as f64 * session.period_s * PASS_HZ < 4.0 {
        return Err(cannot("the record is shorter than four periods of what a hand does (0.33 s)"));
    }
    let mut measured = Vec::new();
    let mut forces = Vec::new();
    for axis in &session.axes {
        let missing = axis.master.iter().zip(&axis.force).filter(|(x, f)| !x.is_finite() || !f.is_finite()).count();
        if missing as f64 > MOST_MISSING * rows as f64 {
            return Err(cannot(&format!("axis \"{}\" lacks x_m or F_f in {missing} of {rows} rows", axis.name)));
        }
        measured.push(filled(&axis.master));
        forces.push(filled(&axis.force));
    }
    let options = DeviceOptions { substeps: files.substeps, noise_seed: None, quantise: false };
    let device = Device::new(model, files.fragment.as_ref(), device::DeviceRole::Master, session.period_s, &options)
        .map_err(|error| ResimulateError::Device { what: "the master", error })?;
    if (0..device.axes()).any(|axis| !device.has_hand(axis)) {
        return Err(cannot("no grip with a hand is attached to the master; name it with --grip FILE"));
    }

    let filter = Filter::new(rows, session.period_s);
    let hands: Vec<Vec<Complex<f64>>> = (0..device.axes())
        .map(|axis| response_to_hand(files, axis, range(&measured[axis]), &filter.frequencies_hz))
        .collect::<Result<_, _>>()?;
    let still = vec![vec![0.0; rows]; device.axes()];
    let induced = follow(&device, &forces, &still);
    // x^_mu, low-passed to what a hand does, is where the search begins.
    let mut intents: Vec<Vec<f64>> = measured.iter().zip(&induced).map(|(x, f)| filter.low_pass(&difference(x, f))).collect();
    let mut best: Option<(f64, Vec<Vec<f64>>)> = None;
    for _ in 0..PASSES {
        let followed = follow(&device, &forces, &intents);
        let errors: Vec<Vec<f64>> = measured.iter().zip(&followed).map(|(x, y)| filter.low_pass(&difference(x, y))).collect();
        let size: f64 = errors.iter().zip(&measured).map(|(e, x)| (rms(e) / range(x).max(f64::MIN_POSITIVE)).powi(2)).sum::<f64>().sqrt();
        if !size.is_finite() {
            break;
        }
        let settled = best.as_ref().is_some_and(|(before, _)| size > 0.98 * before);
        if best.as_ref().is_none_or(|(before, _)| size < *before) {
            best = Some((size, intents.clone()));
        }
        if settled {
            break;
        }
        for ((intent, error), hand) in intents.iter_mut().zip(&errors).zip(&hands) {
            let correction = filter.through_inverse(error, hand);
            intent.iter_mut().zip(correction).for_each(|(x, c)| *x += c);
        }
    }
    let Some((_, mut intents)) = best else { return Err(cannot("the master's model diverges under the recorded force")) };
    let rests = rests(&intents, &measured, session);
    for intent in &mut intents {
        for (from, to) in &rests {
            rest(intent, *from, *to, (BLEND_S / session.period_s) as usize);
        }
    }
    let followed = follow(&device, &forces, &intents);
    let residual = measured.iter().zip(&followed).map(|(x, y)| rms(difference(x, y)) / range(x).max(f64::MIN_POSITIVE)).collect();
    let ambiguity = (0..device.axes()).map(|axis| held_by_friction(files, axis)).collect::<Result<_, _>>()?;
    let still_s = rests.iter().map(|(from, to)| (to - from) as f64 * session.period_s).sum();
    Ok(Recovered { intents: intents.iter().map(|x| recorded(x, session.period_s)).collect(), residual, ambiguity, still_s })
}

/// x_m of the model under recorded forces and a hand: at row k the force of row k-1 and the hand's motion to row k have carried the plant there, as
/// in the master's node.
fn follow(device: &Device, forces: &[Vec<f64>], hands: &[Vec<f64>]) -> Vec<Vec<f64>> {
    let (axes, rows) = (device.axes(), forces.first().map_or(0, Vec::len));
    let mut device = device.clone();
    let (mut force, mut hand) = (vec![0.0; axes], vec![0.0; axes]);
    let mut positions = vec![Vec::with_capacity(rows); axes];
    for row in 0..rows {
        (0..axes).for_each(|axis| hand[axis] = hands[axis][row]);
        if row == 0 {
            device.start(&force, &hand);
        } else {
            device.step(&force, &hand);
        }
        for axis in 0..axes {
            positions[axis].push(device.measured(axis));
            force[axis] = forces[axis][row];
        }
    }
    positions
}

/// The intent that a session recorded, per axis; where a row is missing the hand rests where it was. `None` where an axis has none.
pub fn recorded_intents(session: &Session) -> Option<Vec<Intent>> {
    let intent = |axis: &crate::session::AxisSignals| {
        let mut column = axis.intent.clone().filter(|x| x.iter().any(|x| x.is_finite()))?;
        let mut before = column.iter().copied().find(|x| x.is_finite())?;
        for x in &mut column {
            if x.is_finite() {
                before = *x;
            }
            *x = before;
        }
        Some(recorded(&column, session.period_s))
    };
    session.axes.iter().map(intent).collect()
}

/// How far the hand can move while dry friction holds the device, m or rad: all its friction at rest, against the grip.
fn held_by_friction(files: &DeviceFiles, axis: usize) -> Result<f64, ResimulateError> {
    let Some(model) = &files.model else { return Ok(0.0) };
    let at_rest = |law: &Law| [Side::Forwards, Side::Backwards].map(|side| law.unloaded_level(side, None)).into_iter().fold(0.0, f64::max);
    let friction: f64 = model.elements.iter().map(|e| at_rest(&e.law)).sum();
    let compliance =
        super::over_cancelling::compliance(files, axis, LOOK_AT).map_err(|error| ResimulateError::Linear { what: "the master", error })?;
    Ok(if friction > 0.0 { friction * compliance } else { 0.0 })
}

/// Response of x_m to the hand at each frequency, about rest.
fn response_to_hand(files: &DeviceFiles, axis: usize, range: f64, frequencies_hz: &[f64]) -> Result<Vec<Complex<f64>>, ResimulateError> {
    let linear = |error| ResimulateError::Linear { what: "the master", error };
    let Some(mut model) = files.model.clone() else { return Ok(Vec::new()) };
    let axes = model.axes.clone();
    let mut hands = Vec::new();
    for axis in &axes {
        hands.push(files.fragment.as_ref().and_then(|f| model.attach(f, axis.user, "grip").hand_input));
    }
    let (Some(Some(hand)), Some(axis)) = (hands.get(axis), axes.get(axis)) else { return Ok(Vec::new()) };
    let at = Operating::amplitude((LOOK_SHARE * range).max(1e-9));
    let response = LinearModel::new(&model, &at).map_err(linear)?.response(*hand, axis.measured, frequencies_hz).map_err(linear)?;
    Ok(response.into_iter().map(|g| Complex::new(g.re, g.im) * axis.scale).collect())
}

/// Filters without phase over a whole record.
struct Filter {
    rows: usize,
    forward: Arc<dyn RealToComplex<f64>>,
    inverse: Arc<dyn ComplexToReal<f64>>,
    frequencies_hz: Vec<f64>,
    /// Share of each line that is a hand's.
    pass: Vec<f64>,
}

impl Filter {
    fn new(rows: usize, period_s: f64) -> Filter {
        // Room after the record for the way back from its end to its start, for a transform sees a circle.
        let length = (rows + (2.0 / PASS_HZ / period_s) as usize).next_power_of_two();
        let mut planner = RealFftPlanner::new();
        let per_line = 1.0 / (length as f64 * period_s);
        let lines = ((STOP_HZ / per_line) as usize).min(length / 2);
        let pass = |hz: f64| {
            let slope = ((hz - PASS_HZ) / (STOP_HZ - PASS_HZ)).clamp(0.0, 1.0);
            0.5 + 0.5 * (std::f64::consts::PI * slope).cos()
        };
        let frequencies_hz: Vec<f64> = (0..=lines).map(|i| i as f64 * per_line).collect();
        Filter {
            rows,
            forward: planner.plan_fft_forward(length),
            inverse: planner.plan_fft_inverse(length),
            pass: frequencies_hz.iter().map(|f| pass(*f)).collect(),
            frequencies_hz,
        }
    }

    fn low_pass(&self, signal: &[f64]) -> Vec<f64> {
        self.each_line(signal, |_, line| line)
    }

    /// The hand's motion that moves x_m by `error`, where the response to the hand is large enough to determine it.
    fn through_inverse(&self, error: &[f64], hand: &[Complex<f64>]) -> Vec<f64> {
        const LEAST: f64 = 0.1;
        self.each_line(error, |i, line| line * hand[i].conj() / hand[i].norm_sqr().max(LEAST * LEAST))
    }

    fn each_line(&self, signal: &[f64], change: impl Fn(usize, Complex<f64>) -> Complex<f64>) -> Vec<f64> {
        let mut padded = self.forward.make_input_vec();
        padded[..self.rows].copy_from_slice(signal);
        let (last, first) = (signal[self.rows - 1], signal[0]);
        let room = (padded.len() - self.rows) as f64;
        for (i, value) in padded[self.rows..].iter_mut().enumerate() {
            let share = 0.5 - 0.5 * (std::f64::consts::PI * (i as f64 + 1.0) / (room + 1.0)).cos();
            *value = last + share * (first - last);
        }
        let scale = 1.0 / padded.len() as f64;
        let mut lines = self.forward.make_output_vec();
        let mut back = self.inverse.make_output_vec();
        // The buffers are of the planned lengths, so neither transform can fail.
        if self.forward.process(&mut padded, &mut lines).is_err() {
            return signal.to_vec();
        }
        for (i, line) in lines.iter_mut().enumerate() {
            *line = self.pass.get(i).map_or(Complex::new(0.0, 0.0), |pass| change(i, *line) * *pass * scale);
        }
        lines[0].im = 0.0;
        if let Some(last) = lines.last_mut() {
            last.im = 0.0;
        }
        if self.inverse.process(&mut lines, &mut back).is_err() {
            return signal.to_vec();
        }
        back.truncate(self.rows);
        back
    }
}

/// Rows (from, to) in which the hand holds still on all axes.
fn rests(intents: &[Vec<f64>], measured: &[Vec<f64>], session: &Session) -> Vec<(usize, usize)> {
    let rows = session.len();
    let bands: Vec<f64> = intents
        .iter()
        .zip(measured)
        .zip(&session.axes)
        .map(|((intent, measured), axis)| (STILL_SHARE * range(intent).max(range(measured))).max(4.0 * axis.resolution))
        .collect();
    let stride = ((0.005 / session.period_s) as usize).max(1);
    let least = (STILL_S / session.period_s) as usize;
    let mut rests = Vec::new();
    let mut from = 0;
    while from + least < rows {
        let mut bounds: Vec<[f64; 2]> = intents.iter().map(|x| [x[from], x[from]]).collect();
        let within = |row: usize, bounds: &mut Vec<[f64; 2]>| {
            intents.iter().zip(bounds).zip(&bands).all(|((x, [low, high]), band)| {
                (*low, *high) = (low.min(x[row]), high.max(x[row]));
                *high - *low <= *band
            })
        };
        let mut to = from + 1;
        while to < rows && within(to, &mut bounds) {
            to += 1;
        }
        if to - from >= least {
            rests.push((from, to));
            from = to;
        } else {
            from += stride;
        }
    }
    rests
}

/// Holds the intent at its mean in a rest, with smooth ends.
fn rest(intent: &mut [f64], from: usize, to: usize, blend: usize) {
    let mean = intent[from..to].iter().sum::<f64>() / (to - from) as f64;
    let blend = blend.clamp(1, (to - from) / 4);
    for row in from..to {
        let inside = (row - from).min(to - 1 - row);
        let share = if inside >= blend { 1.0 } else { 0.5 - 0.5 * (std::f64::consts::PI * inside as f64 / blend as f64).cos() };
        // Exactly the same value in every row: that is how a verdict knows that the hand holds still.
        intent[row] = if share == 1.0 { mean } else { intent[row] + share * (mean - intent[row]) };
    }
}

fn recorded(positions: &[f64], period_s: f64) -> Intent {
    let last = positions.len() - 1;
    let velocity = |row: usize| {
        let (before, after) = (row.saturating_sub(1), (row + 1).min(last));
        (positions[after] - positions[before]) / ((after - before).max(1) as f64 * period_s)
    };
    Intent::Recorded((0..positions.len()).map(|row| [positions[row], velocity(row)]).collect())
}

/// The column with its gaps filled in straight lines.
fn filled(column: &[f64]) -> Vec<f64> {
    let known: Vec<usize> = (0..column.len()).filter(|row| column[*row].is_finite()).collect();
    let mut next = 0;
    (0..column.len())
        .map(|row| {
            while known.get(next).is_some_and(|k| *k < row) {
                next += 1;
            }
            match (next.checked_sub(1).and_then(|n| known.get(n)), known.get(next)) {
                (_, Some(after)) if *after == row => column[row],
                (Some(before), Some(after)) => {
                    let share = (row - before) as f64 / (after - before) as f64;
                    column[*before] + share * (column[*after] - column[*before])
                }
                (Some(only), None) | (None, Some(only)) => column[*only],
                (None, None) => 0.0,
            }
        })
        .collect()
}

fn difference(a: &[f64], b: &[f64]) -> Vec<f64> {
    a.iter().zip(b).map(|(a, b)| a - b).collect()
}

fn range(signal: &[f64]) -> f64 {
    let (low, high) = signal.iter().fold((f64::INFINITY, f64::NEG_INFINITY), |(l, h), x| (l.min(*x), h.max(*x)));
    if high > low { high - low } else { 0.0 }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn gaps_are_bridged() {
        let nan = f64::NAN;
        assert_eq!(filled(&[nan, 1.0, nan, nan, 4.0, nan]), [1.0, 1.0, 2.0, 3.0, 4.0, 4.0]);
        assert_eq!(filled(&[nan, nan]), [0.0, 0.0]);
    }

    #[test]
    fn the_filter_passes_the_hand_without_phase_and_nothing_faster() {
        let period = 1e-3;
        let filter = Filter::new(4000, period);
        let wave = |hz: f64| -> Vec<f64> {
            let window = |t: f64| (std::f64::consts::PI * t / 4.0).sin().powi(2);
            (0..4000).map(|i| i as f64 * period).map(|t| window(t) * (std::f64::consts::TAU * hz * t).sin()).collect()
        };
        let worst = |a: &[f64], b: &[f64]| difference(a, b).iter().fold(0.0_f64, |m, x| m.max(x.abs()));
        assert!(worst(&filter.low_pass(&wave(8.0)), &wave(8.0)) < 1e-3);
        assert!(rms(filter.low_pass(&wave(60.0))) < 1e-3);
    }

    #[test]
    fn a_rest_is_one_value_and_its_ends_are_smooth() {
        let mut intent: Vec<f64> = (0..1000).map(|i| 1.0 + 0.01 * f64::from(i % 2)).collect();
        rest(&mut intent, 100, 900, 20);
        assert!(intent[120..880].iter().all(|x| *x == intent[120]) && (intent[120] - 1.005).abs() < 1e-12);
        assert!(intent[99..130].windows(2).all(|w| (w[1] - w[0]).abs() <= 0.0101));
    }
}
