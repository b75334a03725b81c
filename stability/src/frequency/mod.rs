//! Is the loop stable? From its frequency response, from the data alone.
//!
//! Force is fed back, so force and motion are correlated both ways round the loop: what the dither `d` (recorded, exogenous)
//! has in common with each of them tells them apart. With `F_f = d + r`, `r` the reflected part, the loop is
//! `L = S_rd / S_fd`, per unit of gain; it holds every hop, delay and sampler as it was. The gain on the edge is where an
//! eigenvalue of `k L(jw)` passes through `+1`.

mod answer;
mod delays;
mod edge;
mod local;
mod rows;
mod swap;
mod undithered;

#[cfg(test)]
mod tests;

pub use answer::{FrequencyAnswer, Verdict};
pub use delays::{Delays, Hop};
pub use edge::Edge;
pub use rows::RowCount;
pub use swap::{PartError, Parts};

use crate::session::Session;
use crate::spectra::{Averaging, CrossSpectra, Window, by_periods, repeats_after, welch};
use backdrive_control::margins::critical_factor;
use edge::Loop;
use local::{Columns, DITHERED, LocalFit, MOVED, fit};
use nalgebra::{Complex, DMatrix};
use rows::{Rows, State, Stretch};
use serde::Serialize;
use std::ops::Range;

/// The dither that is advised where nothing better is known.
const DEFAULT_DITHER: &str = "multisine:peak=0.05,from=1,to=500,period=2";
/// Segment lengths to choose from, s.
const SEGMENTS_S: [f64; 9] = [4.0, 3.0, 2.0, 1.5, 1.0, 0.7, 0.5, 0.35, 0.25];
/// Independent segments that are enough: neighbouring lines are averaged too.
const ENOUGH_AVERAGES: f64 = 2.5;
/// Levels or gains whose edges differ by less are not told apart.
const SAME_EDGE: f64 = 0.05;

/// What to ask for.
#[derive(Debug, Clone, Copy)]
pub struct Options<'a> {
    /// Draws from which intervals are made.
    pub draws: usize,
    /// Of the draws: the same record gives the same answer.
    pub seed: u64,
    /// Parts to exchange.
    pub parts: Parts<'a>,
}

impl Default for Options<'_> {
    fn default() -> Self {
        Options { draws: 400, seed: 1, parts: Parts::default() }
    }
}

/// The frequency-domain answer of a session, for any gain: [`Frequency::at`].
#[derive(Debug, Clone, Serialize)]
pub struct Frequency {
    /// One estimate for each amplitude of the dither, and for each set of axes that touch.
    pub levels: Vec<LevelEstimate>,
    /// The edge from each recorded gain alone, where there are several.
    pub gains: Vec<GainEstimate>,
    /// The edge from all of it: an interval over the amplitudes where it depends on them.
    pub edge: Edge,
    /// Edges at different amplitudes differ by more than their uncertainty: friction, hysteresis or backlash.
    pub amplitude_dependent: bool,
    /// Edges from different recorded gains differ by more than their uncertainty.
    pub gains_disagree: bool,
    /// Gains are multiples of the recorded one, for nobody recorded it and the signals do not tell.
    pub relative: bool,
    /// What delays the loop beside its devices.
    pub delays: Delays,
    /// Where each factor of the loop comes from.
    pub provenance: Provenance,
    /// Which rows were used, and why others were not.
    pub rows: RowCount,
    /// The method and its numbers, for a reader.
    pub method: String,
    /// What a reader has to know.
    pub notes: Vec<String>,
    /// Why nothing can be told.
    pub cannot_tell: Option<CannotTell>,
    /// What to record for a better answer.
    pub advice: String,
}

/// Why the record does not tell.
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
pub struct CannotTell {
    /// In a sentence.
    pub reason: String,
    /// What to record instead.
    pub advice: Option<String>,
}

/// `measured`, or `from model`.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
pub struct Provenance {
    /// The master, from F_f to x_m.
    pub master: &'static str,
    /// The canceller.
    pub canceller: &'static str,
    /// Slave and environment, from x_c to F_s.
    pub slave: &'static str,
}

/// The loop at one amplitude of the dither.
#[derive(Debug, Clone, Serialize)]
pub struct LevelEstimate {
    /// RMS of the dither, root of the sum over the axes, N or N m; 0 where the operator shook it.
    pub amplitude_rms: f64,
    /// Which axes touched.
    pub contact: Vec<bool>,
    /// Rows used.
    pub rows: usize,
    /// Segments, window, averages.
    pub averaging: Averaging,
    /// The lines, Hz.
    pub hz: Vec<f64>,
    /// Each axis, the loops of the others open.
    pub axes: Vec<AxisEstimate>,
    /// Loci of the eigenvalues of the loop per unit gain at the lines that tell something; of one axis its `l`. `[re, im]`.
    pub loci: Vec<Vec<[f64; 2]>>,
    /// The lines of the loci, Hz.
    pub loci_hz: Vec<f64>,
    /// Edge of all loops together.
    pub edge: Edge,
    #[serde(skip)]
    measured: Loop,
}

/// One axis of a level.
#[derive(Debug, Clone, Serialize)]
pub struct AxisEstimate {
    /// Name of the axis.
    pub name: String,
    /// Loop per unit of mu*lambda, `[re, im]`, at each line.
    pub l: Vec<[f64; 2]>,
    /// Standard deviation of each component of `l`.
    pub sigma: Vec<f64>,
    /// Whether `l` stands out of its uncertainty: `|l|` at least 4 sigma.
    pub told: Vec<bool>,
    /// Coherence of the dither with the reflected force.
    pub coherence: Vec<f64>,
    /// G_f, from F_f to x_m, m/N or rad/(N m).
    pub g_f: Response,
    /// From F_f to x_c over mu: G_f less what was cancelled.
    pub motion: Response,
    /// H_se, from x_c to F_s, N/m or N m/rad.
    pub h_se: Response,
    /// Edge of this loop alone.
    pub edge: Edge,
}

/// A response at the lines of its level; NaN where it has none.
#[derive(Debug, Clone, Default, Serialize)]
pub struct Response {
    /// `[re, im]`.
    pub value: Vec<[f64; 2]>,
    /// Standard deviation of each component.
    pub sigma: Vec<f64>,
}

/// The edge from one recorded gain.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct GainEstimate {
    /// Position scale.
    pub mu: f64,
    /// Force scale.
    pub lambda: f64,
    /// Rows used.
    pub rows: usize,
    /// What they say.
    pub edge: Edge,
}

/// Why a session cannot be analysed at all.
#[derive(Debug, thiserror::Error)]
pub enum FrequencyError {
    /// It has no rows, or columns of different length.
    #[error("the session \"{0}\" has no rows, or columns of different length")]
    Shape(String),
    /// A part cannot be exchanged.
    #[error(transparent)]
    Part(#[from] PartError),
}

/// The columns of an axis, in the order in which they are put before the transforms.
#[derive(Debug, Clone, Copy)]
enum Column {
    Dither,
    Force,
    /// Reflected force per unit gain.
    Reflected,
    Master,
    /// Command over mu.
    Motion,
    Command,
    Contact,
    /// What was cancelled.
    Induced,
}

const COLUMNS: usize = 8;

fn column(axis: usize, column: Column) -> usize {
    axis * COLUMNS + column as usize
}

fn columns(axes: usize, which: Column) -> Vec<usize> {
    (0..axes).map(|axis| column(axis, which)).collect()
}

/// A session with what is derived from it.
struct Prepared {
    session: Session,
    signals: Vec<Vec<f64>>,
    rows: Rows,
}

/// Analyses a session.
pub fn analyse(session: &Session, options: &Options) -> Result<Frequency, FrequencyError> {
    let mut session = session.clone();
    check_shape(&session)?;
    let mut notes = Vec::new();
    let bridged = rows::bridge(&mut session);
    let relative = complete_gains(&mut session, &mut notes);
    let mut rows = rows::usable(&session);
    rows.count.bridged = bridged;
    drop_unknown_gains(&mut rows);
    let has_dither = session.axes.iter().any(|a| a.dither.as_ref().is_some_and(|d| d.iter().any(|x| x.is_finite() && *x != 0.0)));
    if rows.hand_moves && has_dither {
        notes.push("the hand never rests in contact: all of the contact was used, and below a few Hz its motion is noise".to_string());
    }
    // The release at the end is one.
    if rows.count.contact_losses > 1 && rows.count.free > 0 {
        notes.push(format!("contact was lost {} times; rows without contact and {} ms after are left out", rows.count.contact_losses, 200));
    }
    let advice = advice(&session);
    let mut result = Frequency {
        levels: Vec::new(),
        gains: Vec::new(),
        edge: Edge::default(),
        amplitude_dependent: false,
        gains_disagree: false,
        relative,
        delays: Delays::default(),
        provenance: provenance(&options.parts),
        rows: rows.count,
        method: String::new(),
        notes,
        cannot_tell: None,
        advice,
    };
    let induced = options.parts.canceller.map(|(files, corner)| swap::induced(&session, files, corner)).transpose()?;
    let signals = signals(&session, induced.as_deref());
    let prepared = Prepared { session, signals, rows };
    if has_dither {
        dithered(&prepared, options, &mut result)?;
    } else {
        undithered::analyse(&prepared, options, &mut result)?;
    }
    result.conclude();
    Ok(result)
}

fn check_shape(session: &Session) -> Result<(), FrequencyError> {
    let n = session.len();
    let same = |a: &crate::session::AxisSignals| {
        let optional = [&a.intent, &a.dither, &a.induced].into_iter().flatten();
        [&a.master, &a.force, &a.command, &a.contact].into_iter().chain(optional).all(|c| c.len() == n)
    };
    let good = n > 0 && session.period_s > 0.0 && session.mu.len() == n && session.lambda.len() == n && session.axes.iter().all(same);
    good.then_some(()).ok_or_else(|| FrequencyError::Shape(session.name.clone()))
}

fn provenance(parts: &Parts) -> Provenance {
    let of = |there: bool| if there { "from model" } else { "measured" };
    let canceller = match parts.canceller {
        Some((files, _)) if files.model.is_none() => "none",
        canceller => of(canceller.is_some()),
    };
    Provenance { master: of(parts.master.is_some()), canceller, slave: of(parts.slave.is_some()) }
}

/// Gains that nobody recorded, from the signals; says whether they stay unknown.
fn complete_gains(session: &mut Session, notes: &mut Vec<String>) -> bool {
    let missing = |column: &[f64]| column.iter().all(|x| !x.is_finite());
    let n = session.len();
    if missing(&session.lambda) {
        let Some((lambda, lag)) = proportional(session, |a, row| a.contact[row], |a, row| a.force[row] - dither(a, row)) else {
            return unknown_gains(session, notes);
        };
        notes.push(format!("lambda was not recorded: {lambda:.4} from the signals, F_f following F_s by {lag} rows"));
        session.lambda = vec![lambda; n];
    }
    if missing(&session.mu) {
        let moved = |a: &crate::session::AxisSignals, row: usize| a.master[row] - a.induced.as_ref().map_or(0.0, |i| i[row]);
        let Some((mu, lag)) = proportional(session, moved, |a, row| a.command[row]) else { return unknown_gains(session, notes) };
        notes.push(format!("mu was not recorded: {mu:.4} from the signals, x_c following x_m by {lag} rows"));
        session.mu = vec![mu; n];
    }
    false
}

fn unknown_gains(session: &mut Session, notes: &mut Vec<String>) -> bool {
    notes.push("the gains were not recorded and the signals do not tell them: all gains are multiples of the recorded one".to_string());
    (session.mu, session.lambda) = (vec![1.0; session.len()], vec![1.0; session.len()]);
    true
}

fn dither(axis: &crate::session::AxisSignals, row: usize) -> f64 {
    axis.dither.as_ref().map_or(0.0, |d| d[row])
}

/// Factor and lag, rows, of one signal on another by least squares; `None` where it explains less than 99.8 %.
fn proportional(
    session: &Session,
    from: impl Fn(&crate::session::AxisSignals, usize) -> f64,
    to: impl Fn(&crate::session::AxisSignals, usize) -> f64,
) -> Option<(f64, usize)> {
    let mut best: Option<(f64, f64, usize)> = None;
    for lag in 0..=((0.02 / session.period_s) as usize).min(200) {
        let (mut n, mut sx, mut sy, mut sxx, mut sxy, mut syy) = (0.0, 0.0, 0.0, 0.0, 0.0, 0.0);
        for axis in &session.axes {
            for row in lag..session.len() {
                let (x, y) = (from(axis, row - lag), to(axis, row));
                // Rows without contact say nothing.
                if x.is_finite() && y.is_finite() && x != 0.0 && axis.contact[row] != 0.0 {
                    (n, sx, sy) = (n + 1.0, sx + x, sy + y);
                    (sxx, sxy, syy) = (sxx + x * x, sxy + x * y, syy + y * y);
                }
            }
        }
        // With a constant: somebody else's frames need not have their zeros in one place.
        let (xx, xy, yy) = (sxx - sx * sx / n, sxy - sx * sy / n, syy - sy * sy / n);
        if xx > 0.0 && yy > 0.0 {
            let explained = xy * xy / (xx * yy);
            if best.is_none_or(|b| explained > b.0) {
                best = Some((explained, xy / xx, lag));
            }
        }
    }
    best.filter(|b| b.0 > 0.998 && b.1 > 0.0).map(|b| (b.1, b.2))
}

/// Rows whose gain is not known go where other rows have theirs.
fn drop_unknown_gains(rows: &mut Rows) {
    let known = |gain: &(f64, f64)| gain.0.is_finite() && gain.1.is_finite() && gain.0 * gain.1 != 0.0;
    let good: Vec<bool> = rows.gains.iter().map(known).collect();
    rows.stretches.retain(|s| good.get(s.state.gain).copied().unwrap_or(false));
    rows.count.used = rows.stretches.iter().map(|s| s.rows.len()).sum();
}

/// The columns of all axes, gains divided out.
fn signals(session: &Session, induced: Option<&[Vec<f64>]>) -> Vec<Vec<f64>> {
    let n = session.len();
    let per = |x: f64, gain: f64| if gain != 0.0 && gain.is_finite() { x / gain } else { f64::NAN };
    let mut all = Vec::new();
    for (i, axis) in session.axes.iter().enumerate() {
        let d: Vec<f64> = (0..n).map(|row| dither(axis, row)).collect();
        let reflected = (0..n).map(|row| per(axis.force[row] - d[row], session.gain(row))).collect();
        let motion: Vec<f64> = match induced.and_then(|columns| columns.get(i)) {
            Some(other) => (0..n).map(|row| axis.master[row] - other[row]).collect(),
            None => (0..n).map(|row| per(axis.command[row], session.mu[row])).collect(),
        };
        let cancelled = (0..n).map(|row| axis.master[row] - motion[row]).collect();
        // In the order of `Column`.
        all.extend([d, axis.force.clone(), reflected, axis.master.clone(), motion, axis.command.clone(), axis.contact.clone(), cancelled]);
    }
    all
}

/// A dither to record with: about a tenth of the reflected force, at least the default.
fn advice(session: &Session) -> String {
    let (mut sum, mut count) = (0.0, 0_usize);
    for axis in &session.axes {
        for row in 0..session.len() {
            let reflected = axis.force[row] - dither(axis, row);
            if axis.contact[row] != 0.0 && reflected.is_finite() {
                (sum, count) = (sum + reflected * reflected, count + 1);
            }
        }
    }
    let rms = (sum / count.max(1) as f64).sqrt();
    let text = if rms > 0.5 { format!("multisine:peak={:.2},from=1,to=500,period=2", 0.1 * rms) } else { DEFAULT_DITHER.to_string() };
    format!("record again with --dither {text}, the hand pressing and at rest for 10 s")
}

/// The answer from a recorded dither.
fn dithered(prepared: &Prepared, options: &Options, result: &mut Frequency) -> Result<(), FrequencyError> {
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
            None => result.notes.push(format!("a dither of {amplitude:.3} rms acts too shortly to be estimated")),
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
                "no row has the slave in contact, the dither on, the hand at rest and nothing clamped: of {} rows {} touch nothing, in {} \
                 the hand moves, in {} a clamp acts, in {} nothing shakes, in {} the loop settles, in {} something is missing",
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

fn delays(prepared: &Prepared, spectra: &CrossSpectra, contact: &[bool]) -> Delays {
    let Some(axis) = contact.iter().position(|c| *c) else { return Delays::default() };
    let force = delays::hop(spectra, column(axis, Column::Contact), column(axis, Column::Reflected));
    // Where something is cancelled the command is not the measured motion, scaled and late.
    let cancelled = prepared.session.axes[axis].induced.is_some();
    let motion =
        delays::hop(spectra, column(axis, Column::Master), column(axis, Column::Command)).filter(|m| !cancelled && m.coherence > 0.99);
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
fn on_lines(hz: &[f64], found: Option<&LocalFit>) -> Response {
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
        // The slave side is driven by its command alone, so whatever moves the command tells it.
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

/// Whether two edges lie apart by more than their uncertainty.
fn apart(a: &Edge, b: &Edge) -> bool {
    let (Some((a_low, a_high)), Some((b_low, b_high))) = (a.interval(), b.interval()) else { return false };
    let above = |low: f64, high: Option<f64>| high.is_some_and(|high| low > high);
    if !above(a_low, b_high) && !above(b_low, a_high) {
        return false;
    }
    let value = |e: &Edge, low: f64| e.gain.unwrap_or(low);
    (value(a, a_low) / value(b, b_low)).ln().abs() > SAME_EDGE
}

impl Frequency {
    /// One answer from all levels.
    fn conclude(&mut self) {
        let pairs = |edges: &[&Edge]| (0..edges.len()).any(|i| (0..i).any(|j| apart(edges[i], edges[j])));
        let mut states: Vec<Vec<bool>> = self.levels.iter().map(|l| l.contact.clone()).collect();
        states.sort();
        states.dedup();
        self.amplitude_dependent = states.iter().any(|state| {
            let edges: Vec<&Edge> = self.levels.iter().filter(|l| &l.contact == state).map(|l| &l.edge).collect();
            pairs(&edges)
        });
        self.gains_disagree = pairs(&self.gains.iter().map(|g| &g.edge).collect::<Vec<_>>());
        if self.gains_disagree {
            self.notes.push("the recorded gains give different edges: the loop depends on its gain or its amplitude".to_string());
        }
        if self.amplitude_dependent {
            self.notes.push("the edge depends on the amplitude of the dither: friction, hysteresis or backlash in the loop".to_string());
        }
        let edges: Vec<Edge> = self.levels.iter().map(|l| l.edge).collect();
        let several = self.amplitude_dependent || states.len() > 1;
        self.edge = if several { widest(&edges) } else { sharpest(&edges) };
        if self.amplitude_dependent && states.len() == 1 {
            self.continue_to_large_amplitude();
            self.continue_to_rest();
        }
        if let Some(level) = self.levels.first() {
            self.method = describe(level);
        }
    }
}

impl Frequency {
    /// Widens the interval to where the edge goes beyond the largest dither, for an impact moves the master more than a dither may.
    ///
    /// What dry friction (and a hysteresis that has reached its limit) takes of a force of amplitude `d` is a share `c/d` of it, by
    /// its describing function: so the edge tends to its limit as `1/d`, a straight line through the two largest amplitudes.
    fn continue_to_large_amplitude(&mut self) {
        let mut levels: Vec<(f64, f64, f64)> = Vec::new();
        for level in &self.levels {
            let low = level.edge.interval().map_or(0.0, |i| i.0);
            levels.extend(level.edge.gain.or(level.edge.at_least).map(|gain| (level.amplitude_rms, gain, low)));
        }
        levels.sort_by(|a, b| a.0.total_cmp(&b.0));
        let [.., (d1, k1, _), (d2, k2, low)] = levels[..] else { return };
        if !(d2 > 1.2 * d1 && k2 > 0.0) {
            return;
        }
        // A line through two points tells no more than a factor of three.
        let limit = (k2 + (k2 - k1) * d1 / (d2 - d1)).clamp(k2 / 3.0, 3.0 * k2);
        if let Some((from, to)) = &mut self.edge.ci95 {
            *from = from.min(limit * low / k2);
            *to = to.map(|to| to.max(limit));
            self.notes.push(format!("the interval is continued to large amplitudes, where the edge tends to {limit:.3} by the describing function of dry friction"));
        }
    }
}

impl Frequency {
    /// Widens the interval to where the edge goes below the smallest dither, where something is cancelled.
    ///
    /// A master that dry friction holds does not move, and the canceller subtracts all the same: G_f is then 0, and what is left of
    /// the way from F_f to x_c is the canceller's own response, measured as the difference of the two.
    fn continue_to_rest(&mut self) {
        let largest = self.levels.iter().max_by(|a, b| a.amplitude_rms.total_cmp(&b.amplitude_rms));
        let Some((level, axis)) = largest.and_then(|level| Some((level, level.axes.first().filter(|_| level.axes.len() == 1)?))) else {
            return;
        };
        let complex = |v: &[f64; 2]| Complex::new(v[0], v[1]);
        let (mut hz, mut held) = (Vec::new(), Vec::new());
        let (mut cancelled, mut moved) = (0.0, 0.0);
        for (line, f) in level.hz.iter().enumerate().filter(|(line, _)| axis.told[*line]) {
            let (g, c) = (complex(&axis.g_f.value[line]), complex(&axis.motion.value[line]));
            if !(g.norm().is_finite() && c.norm().is_finite() && c.norm() > 0.0) {
                continue;
            }
            (cancelled, moved) = (cancelled + (c - g).norm_sqr(), moved + g.norm_sqr());
            hz.push(*f);
            held.push(complex(&axis.l[line]) * (c - g) / c);
        }
        // Where nothing is cancelled a held master opens the loop.
        if cancelled < 0.04 * moved {
            return;
        }
        let Some(edge) = critical_factor(&hz, &held) else { return };
        if let Some((from, to)) = &mut self.edge.ci95 {
            *from = from.min(0.95 * edge.factor);
            *to = to.map(|to| to.max(1.05 * edge.factor));
            self.notes.push(format!(
                "the interval is continued to rest: while dry friction holds the master the canceller subtracts all the same, and the edge is {:.3}",
                edge.factor
            ));
        }
    }
}

/// The edge told best.
fn sharpest(edges: &[Edge]) -> Edge {
    let width = |e: &Edge| match e.ci95 {
        Some((low, Some(high))) => (high / low).ln(),
        Some(_) => 1e3,
        None => 1e6 / e.at_least.unwrap_or(0.0).max(1e-6),
    };
    edges.iter().min_by(|a, b| width(a).total_cmp(&width(b))).copied().unwrap_or_default()
}

/// The lowest edge, with an interval over all of them.
fn widest(edges: &[Edge]) -> Edge {
    let low = edges.iter().filter_map(|e| e.interval()).map(|i| i.0).min_by(f64::total_cmp);
    let open = edges.iter().any(|e| e.interval().is_none_or(|i| i.1.is_none()));
    let high = edges.iter().filter_map(|e| e.interval().and_then(|i| i.1)).max_by(f64::total_cmp);
    let lowest = edges.iter().filter(|e| e.gain.is_some()).min_by(|a, b| a.gain.unwrap_or(0.0).total_cmp(&b.gain.unwrap_or(0.0)));
    match (lowest, low) {
        (Some(lowest), Some(low)) => Edge { ci95: Some((low, high.filter(|_| !open))), ..*lowest },
        _ => sharpest(edges),
    }
}

fn describe(level: &LevelEstimate) -> String {
    let a = &level.averaging;
    let cut = match a.window {
        Window::Periods => format!("{} whole periods of {:.2} s of the dither, no window", a.segments, a.segment_s),
        Window::Hann => {
            format!("{} segments of {:.2} s, Hann window, {:.0} % overlap, trend removed", a.segments, a.segment_s, a.overlap * 100.0)
        }
    };
    let by = if level.amplitude_rms > 0.0 { "the dither as instrument" } else { "intent and force as inputs" };
    format!(
        "loop by cross-spectra with {by}: {cut}, {:.1} independent averages, lines {:.2} Hz apart, locally quadratic over 6 % of the \
         frequency; a line counts where the loop is {} times its standard deviation; interval from draws of the noise, with half the \
         resolution for the bias",
        a.averages,
        a.resolution_hz,
        edge::TOLD
    )
}
