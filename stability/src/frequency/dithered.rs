//! The loop measured by its dither: spectra over the usable rows, the loop with its uncertainty, as recorded or with parts exchanged.

use super::edge::{self, Loop};
use super::local::{Columns, DITHERED, LocalFit, MOVED, fit};
use super::note::Note;
use super::prepared::{Column, Prepared, column, columns};
use super::rows::{Rows, State, Stretch};
use super::{
    AxisEstimate, CannotTell, Delays, Frequency, FrequencyError, GainEstimate, LevelEstimate, Options, Response, delays as hops, swap,
};
use crate::spectra::{CrossSpectra, Window, by_periods, repeats_after, welch};
use nalgebra::{Complex, DMatrix};
use std::ops::Range;

/// Segment lengths to choose from, s.
const SEGMENTS_S: [f64; 9] = [4.0, 3.0, 2.0, 1.5, 1.0, 0.7, 0.5, 0.35, 0.25];
/// Independent segments that are enough: neighbouring lines are averaged too.
const ENOUGH_AVERAGES: f64 = 2.5;

/// The answer from a recorded dither.
pub(super) fn dithered(prepared: &Prepared, options: &Options, result: &mut Frequency) -> Result<(), FrequencyError> {
    let rows = &prepared.rows;
    let mut groups: Vec<State> = rows.stretches.iter().map(|s| State { gain: 0, ..s.state.clone() }).collect();
    groups.sort();
    groups.dedup();
    let most = groups.iter().map(|g| rows_of(rows, |s| same_group(s, g))).max().unwrap_or(0);
    for group in &groups {
        // What is touched for a moment only is no state of its own.
        if (rows_of(rows, |s| same_group(s, group)) as f64) < 0.1 * most as f64 {
            continue;
        }
        let stretches: Vec<Range<usize>> = select(rows, |s| same_group(s, group));
        let contact: Vec<bool> = (0..prepared.session.axes.len()).map(|i| group.contact & (1 << i) != 0).collect();
        let amplitude = rows.levels.get(group.level).copied().unwrap_or(0.0);
        match estimate(prepared, &stretches, options)? {
            Some((mut level, spectra)) => {
                (level.contact, level.amplitude_rms) = (contact, amplitude);
                if result.delays == Delays::default() {
                    result.delays = delays(prepared, &spectra, &level.contact);
                }
                result.levels.push(level);
            }
            None => result.notes.push(Note::DitherTooShort { rms: amplitude }),
        }
    }
    if rows.gains.len() > 1 {
        for gain in 0..rows.gains.len() {
            let stretches = select(rows, |s| s.gain == gain);
            let used = stretches.iter().map(|s| s.len()).sum();
            if let Some((level, _)) = estimate(prepared, &stretches, options)? {
                let (mu, lambda) = rows.gains[gain];
                result.gains.push(GainEstimate { mu, lambda, rows: used, edge: level.edge });
            }
        }
    }
    if result.levels.is_empty() {
        let c = rows.count;
        let reason = if c.used == 0 {
            format!(
                "no row has contact, dither, a hand at rest and no clamp. Of {} rows {} are without contact, in {} the hand moves, in {} \
                 a clamp acts, in {} there is no dither, in {} the loop settles, in {} a sample is missing",
                c.all, c.free, c.moving, c.clamped, c.quiet, c.settling, c.missing
            )
        } else {
            let longest = rows.stretches.iter().map(|s| s.rows.len()).max().unwrap_or(0) as f64 * prepared.session.period_s;
            format!("the longest stretch of undisturbed contact lasts {longest:.2} s, too short for a frequency response")
        };
        result.cannot_tell = Some(CannotTell { reason, advice: Some(result.advice.clone()) });
    }
    Ok(())
}

fn same_group(state: &State, group: &State) -> bool {
    state.contact == group.contact && state.level == group.level
}

fn select(rows: &Rows, of: impl Fn(&State) -> bool) -> Vec<Range<usize>> {
    rows.stretches.iter().filter(|s| of(&s.state)).map(|s: &Stretch| s.rows.clone()).collect()
}

fn rows_of(rows: &Rows, of: impl Fn(&State) -> bool) -> usize {
    select(rows, of).iter().map(|s| s.len()).sum()
}

pub(super) fn delays(prepared: &Prepared, spectra: &CrossSpectra, contact: &[bool]) -> Delays {
    let Some(axis) = contact.iter().position(|c| *c) else { return Delays::default() };
    let force = hops::hop(spectra, column(axis, Column::Contact), column(axis, Column::Reflected));
    // Where something is cancelled the command is not the measured motion, scaled and late.
    let cancelled = prepared.session.axes[axis].induced.is_some();
    let motion =
        hops::hop(spectra, column(axis, Column::Master), column(axis, Column::Command)).filter(|m| !cancelled && m.coherence > 0.99);
    let loop_s = force.map(|f| f.delay_s + motion.map_or(0.0, |m| m.delay_s));
    Delays { force, motion, loop_s }
}

/// Spectra of the usable rows: over whole periods where the dither has them, else over segments of a length chosen from the record.
fn spectra(prepared: &Prepared, stretches: &[Range<usize>], halved: bool) -> Option<CrossSpectra> {
    let period_s = prepared.session.period_s;
    let signals: Vec<&[f64]> = prepared.signals.iter().map(Vec::as_slice).collect();
    let highest = 0.45 / period_s;
    let longest = stretches.iter().max_by_key(|s| s.len())?;
    if let Some(period) = common_period(prepared, longest).filter(|p| longest.len() >= 2 * p) {
        let whole: Vec<Range<usize>> = stretches.iter().filter(|s| s.len() >= period).cloned().collect();
        return by_periods(&signals, &whole, period, period_s, highest);
    }
    let all: usize = stretches.iter().map(|s| s.len()).sum();
    let share = |segment: usize| {
        let used: usize = stretches.iter().map(|s| s.len()).filter(|n| *n >= segment).sum();
        used as f64 / all.max(1) as f64
    };
    let rows = |length_s: f64| (length_s / period_s).round() as usize;
    // Averages of segments that overlap by half, nearly 2 for each length; used rows count.
    let averages =
        |segment: usize| stretches.iter().filter(|s| s.len() >= segment).map(|s| 1.9 * s.len() as f64 / segment as f64 - 0.9).sum::<f64>();
    let fits = |segment: usize| share(segment) >= 0.6;
    let segment = SEGMENTS_S.iter().map(|s| rows(*s)).find(|s| fits(*s) && averages(*s) >= ENOUGH_AVERAGES);
    let segment = segment.or_else(|| SEGMENTS_S.iter().map(|s| rows(*s)).find(|s| fits(*s)))?;
    welch(&signals, stretches, if halved { segment / 2 } else { segment }, period_s, highest)
}

/// The rows after which the dithers of all axes repeat.
fn common_period(prepared: &Prepared, stretch: &Range<usize>) -> Option<usize> {
    let shaken = prepared.session.axes.iter().enumerate().map(|(i, _)| &prepared.signals[column(i, Column::Dither)][stretch.clone()]);
    let mut common = None;
    for d in shaken.filter(|d| d.iter().any(|x| *x != 0.0)) {
        let period = repeats_after(d)?;
        match common {
            None => common = Some(period),
            Some(before) if before == period => {}
            Some(_) => return None,
        }
    }
    common
}

/// The loop over some rows; `None` where they are too few.
fn estimate(
    prepared: &Prepared,
    stretches: &[Range<usize>],
    options: &Options,
) -> Result<Option<(LevelEstimate, CrossSpectra)>, FrequencyError> {
    let Some(full) = spectra(prepared, stretches, false) else { return Ok(None) };
    let Some(measured) = loop_of(prepared, stretches, &full, options, 1.0)? else { return Ok(None) };
    // The same with half the resolution: segments of half the length, or, where whole periods leave no leakage, half the windows.
    let other = match full.averaging.window {
        Window::Hann => match spectra(prepared, stretches, true) {
            Some(half) => loop_of(prepared, stretches, &half, &Options { draws: 0, ..*options }, 1.0)?,
            None => None,
        },
        Window::Periods => loop_of(prepared, stretches, &full, &Options { draws: 0, ..*options }, 2.0)?,
    };
    let axes = prepared.session.axes.len();
    let told = measured.told();
    let single = |axis: usize| {
        let (alone, alone_other) = (measured.single(axis), other.as_ref().map(|o| o.single(axis)));
        let pair = |l: &DMatrix<Complex<f64>>| [l[(0, 0)].re, l[(0, 0)].im];
        let response = |from: Column, to: Column, instrument: Column| {
            let (outputs, inputs, instruments) = (&[column(axis, to)], &[column(axis, from)], &[column(axis, instrument)]);
            let columns = Columns { outputs, inputs, instruments, least_power: DITHERED };
            let found = fit(&full, columns, 1.0);
            on_lines(&measured.hz, found.as_ref())
        };
        let coherence = |hz: &f64| {
            let line = full.hz.partition_point(|f| f < &(hz - 1e-9)).min(full.hz.len() - 1);
            full.coherence(line, column(axis, Column::Dither), column(axis, Column::Reflected))
        };
        AxisEstimate {
            name: prepared.session.axes[axis].name.clone(),
            l: alone.nominal.iter().map(pair).collect(),
            sigma: alone.sigma.iter().map(|s| s[(0, 0)]).collect(),
            told: alone.told(),
            coherence: alone.hz.iter().map(coherence).collect(),
            g_f: response(Column::Force, Column::Master, Column::Dither),
            motion: response(Column::Force, Column::Motion, Column::Dither),
            h_se: response(Column::Command, Column::Contact, Column::Dither),
            edge: alone.edge(alone_other.as_ref()),
        }
    };
    let edge = measured.edge(other.as_ref());
    let pairs = |locus: Vec<Complex<f64>>| locus.into_iter().map(|l| [l.re, l.im]).collect();
    let level = LevelEstimate {
        amplitude_rms: 0.0,
        contact: Vec::new(),
        rows: stretches.iter().map(|s| s.len()).sum(),
        averaging: full.averaging,
        hz: measured.hz.clone(),
        axes: (0..axes).map(single).collect(),
        loci: edge::loci(&measured.nominal, &told).into_iter().map(pairs).collect(),
        loci_hz: measured.hz.iter().zip(&told).filter(|(_, t)| **t).map(|(f, _)| *f).collect(),
        edge,
        measured,
    };
    Ok(Some((level, full)))
}

/// A response on the lines of a loop.
pub(super) fn on_lines(hz: &[f64], found: Option<&LocalFit>) -> Response {
    let mut response = Response { value: vec![[f64::NAN; 2]; hz.len()], sigma: vec![f64::NAN; hz.len()] };
    let Some(found) = found else { return response };
    let sigma = found.sigma();
    for (i, f) in hz.iter().enumerate() {
        if let Some(j) = found.hz.iter().position(|h| (h - f).abs() < 1e-6 * f) {
            let value = found.value[j][(0, 0)];
            (response.value[i], response.sigma[i]) = ([value.re, value.im], sigma[j][(0, 0)]);
        }
    }
    response
}

/// The loop per unit gain, as recorded or with parts exchanged.
fn loop_of(
    prepared: &Prepared,
    stretches: &[Range<usize>],
    spectra: &CrossSpectra,
    options: &Options,
    narrow: f64,
) -> Result<Option<Loop>, FrequencyError> {
    let axes = prepared.session.axes.len();
    let instruments = columns(axes, Column::Dither);
    let by = |outputs: Column, inputs: Column, instruments: &[usize], least_power: f64| {
        let (outputs, inputs) = (columns(axes, outputs), columns(axes, inputs));
        fit(spectra, Columns { outputs: &outputs, inputs: &inputs, instruments, least_power }, narrow)
    };
    let of = |outputs: Column, inputs: Column, instruments: &[usize]| by(outputs, inputs, instruments, DITHERED);
    if !options.parts.any() {
        let found = of(Column::Reflected, Column::Force, &instruments);
        return Ok(found.map(|f| Loop::measured(&f, options.draws, options.seed)));
    }
    let mut motion = match of(Column::Motion, Column::Force, &instruments) {
        Some(found) => Loop::measured(&found, options.draws, options.seed),
        None => return Ok(None),
    };
    let slave = match options.parts.slave {
        Some(files) => Some(Loop::known(&motion.hz, swap::slave_response(files, &tips(prepared, stretches), &motion.hz)?)),
        // The slave side is driven by its command alone, so any signal that moves the command identifies it.
        None => by(Column::Contact, Column::Command, &columns(axes, Column::Command), MOVED)
            .map(|f| Loop::measured(&f, options.draws, options.seed + 1)),
    };
    let Some(slave) = slave else { return Ok(None) };
    if let Some(files) = options.parts.master {
        let master = Loop::known(&motion.hz, swap::master_response(files, axes, &motion.hz, prepared.session.period_s)?);
        let Some(cancelled) = of(Column::Induced, Column::Force, &instruments) else { return Ok(None) };
        let cancelled = Loop::measured(&cancelled, options.draws, options.seed);
        motion = master.combine(&cancelled, |g, estimate| g - estimate);
    }
    let contact: Vec<bool> = (0..axes).map(|i| stretches.iter().any(|s| prepared.session.axes[i].contact[s.start] != 0.0)).collect();
    let delay = delays(prepared, spectra, &contact).force.map_or(0.0, |hop| hop.delay_s);
    let mut all = slave.combine(&motion, |h, c| h * c);
    for (line, hz) in all.hz.clone().into_iter().enumerate() {
        let turn = Complex::from_polar(1.0, -std::f64::consts::TAU * hz * delay);
        all.nominal[line] *= turn;
        all.draws.iter_mut().for_each(|d| d[line] *= turn);
    }
    Ok(Some(all))
}

/// Where the tips of the slave were on average.
fn tips(prepared: &Prepared, stretches: &[Range<usize>]) -> Vec<f64> {
    let mean = |column: &[f64]| {
        let good: Vec<f64> =
            stretches.iter().flat_map(|s| column.get(s.clone()).unwrap_or(&[])).copied().filter(|x| x.is_finite()).collect();
        good.iter().sum::<f64>() / good.len().max(1) as f64
    };
    prepared.session.axes.iter().map(|a| mean(a.slave.as_ref().unwrap_or(&a.command))).collect()
}
