//! What a run did: stable, a limit cycle, unstable, limited, or nothing that can be judged.
//!
//! One function, [`judge`], decides for a live run, a replay and a prediction alike. What it goes by:
//!
//! | fact | threshold |
//! |---|---|
//! | where it looks | the hand holds still and the slave touches something, for 0.3 s beyond a transient of 0.15 s |
//! | an oscillation | above 8 Hz; half its peak-to-peak in the last quarter above 2 um and four encoder steps |
//! | it dies | its last quarter below 0.7 of its first, its envelope falling by more than 0.2 per second |
//! | it grows | its last quarter above 1.5 of its first, its envelope rising by more than 0.2 per second: unstable |
//! | otherwise | a limit cycle |
//! | slow wandering | the last quarter spans more than 20 um and four encoder steps, and does not settle |
//! | limited | a clamp acted in more than 1 % of the contact, or the master left its travel |
//! | a noisy sensor | its noise adds 5 standard deviations to what an amplitude and 10 to what a span must exceed |
//! | nothing to judge | no contact, no hold, or only holds with a gap in them: not judged, which is never stable |
//! | something is missing | a gap longer than `stale_after_s`, more than 1 % of the steps, or the end of the run: what looks stable is not judged |
//! | a dither plays | what it explains (coherence) does not count: less than half of the motion unexplained is no oscillation |

use crate::oscillation::{Oscillation, oscillation};
use crate::spectra::welch;
use crate::unjudged::{Gaps, Unjudged};
use serde::Serialize;

/// One axis of a run, one value per step.
#[derive(Debug, Clone, Default)]
pub struct Trace {
    /// Time of one step, s.
    pub period_s: f64,
    /// What the hand wanted, m or rad; empty where nobody recorded it.
    pub intent: Vec<f64>,
    /// The master's measured position, m or rad.
    pub position: Vec<f64>,
    /// Force of the environment on the slave, N or N m.
    pub contact: Vec<f64>,
    /// Force applied to the master, N or N m.
    pub feedback: Vec<f64>,
    /// What was added to that force on purpose, N or N m; empty where nothing was.
    pub dither: Vec<f64>,
    /// Whether a clamp acted.
    pub clamped: Vec<bool>,
    /// The device's limits of motion, m or rad.
    pub travel: Option<[f64; 2]>,
    /// Step of the position sensor, m or rad; 0 for an ideal one.
    pub resolution: f64,
    /// Standard deviation of that sensor's noise, m or rad.
    pub noise: f64,
    /// What is missing.
    pub gaps: Gaps,
}

/// The verdict on a run.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
#[serde(tag = "outcome", rename_all = "snake_case")]
pub enum Outcome {
    /// What oscillates dies.
    Stable,
    /// It oscillates on in contact and neither grows nor dies.
    LimitCycle {
        /// Half the peak-to-peak of the master's position, m or rad.
        amplitude_m: f64,
        /// Hz.
        frequency_hz: f64,
    },
    /// It grows.
    Unstable {
        /// Exponential growth of the envelope, 1/s.
        growth_per_s: f64,
    },
    /// A clamp acted for more than 1 % of the contact, or the hand left the device's travel: never called stable.
    Limited {
        /// Share of the steps in contact in which a clamp acted.
        clamped_share: f64,
        /// Whether the master left its travel.
        beyond_travel: bool,
    },
    /// There was nothing to judge, or not enough of it: neither stable nor not.
    #[serde(rename = "cannot_tell")]
    NotJudged {
        /// Why.
        #[serde(flatten)]
        why: Unjudged,
    },
}

impl Outcome {
    /// The word for scripts.
    pub fn word(&self) -> &'static str {
        match self {
            Outcome::Stable => "stable",
            Outcome::LimitCycle { .. } => "limit_cycle",
            Outcome::Unstable { .. } => "unstable",
            Outcome::Limited { .. } => "limited",
            Outcome::NotJudged { .. } => "cannot_tell",
        }
    }

    /// Whether it was seen to be stable: what was not judged is not.
    pub fn is_stable(&self) -> bool {
        *self == Outcome::Stable
    }

    /// Whether it oscillated or ran away.
    pub fn is_unstable(&self) -> bool {
        matches!(self, Outcome::LimitCycle { .. } | Outcome::Unstable { .. })
    }

    /// The same, but not judged in the place of stable where something keeps a green answer back. What speaks against the loop stands.
    pub fn held_back(self, by: Option<Unjudged>) -> Outcome {
        match (self, by) {
            (Outcome::Stable, Some(why)) => Outcome::NotJudged { why },
            // That something is lost says more than that nothing was touched in what is left.
            (Outcome::NotJudged { why: before }, Some(why)) if !before.is_loss() && why.is_loss() => Outcome::NotJudged { why },
            (outcome, _) => outcome,
        }
    }

    /// How bad it is, for several axes: the worst counts. An axis that touched nothing says nothing of one that did, but one of which
    /// something is missing takes a green answer from all.
    pub(crate) fn rank(&self) -> u8 {
        match self {
            Outcome::NotJudged { why } if !why.is_loss() => 0,
            Outcome::Stable => 1,
            Outcome::NotJudged { .. } => 2,
            Outcome::Limited { .. } => 3,
            Outcome::LimitCycle { .. } => 4,
            Outcome::Unstable { .. } => 5,
        }
    }

    /// The worst of several axes.
    pub fn worst(outcomes: impl IntoIterator<Item = Outcome>) -> Option<Outcome> {
        outcomes.into_iter().max_by_key(Outcome::rank)
    }
}

impl std::fmt::Display for Outcome {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self {
            Outcome::Stable => write!(f, "stable"),
            Outcome::LimitCycle { amplitude_m, frequency_hz } => {
                write!(f, "limit cycle of {:.3} mm at {frequency_hz:.1} Hz", amplitude_m * 1e3)
            }
            Outcome::Unstable { growth_per_s } => write!(f, "unstable, grows by {growth_per_s:.2} per second"),
            Outcome::Limited { clamped_share, beyond_travel } => {
                let travel = if *beyond_travel { "; the master left its travel" } else { "" };
                write!(f, "limited: a clamp acted in {:.1} % of the contact{travel}", clamped_share * 100.0)
            }
            Outcome::NotJudged { why } => write!(f, "it cannot be told whether it is stable: {why}"),
        }
    }
}

/// An oscillation whose last quarter is larger than its first by this factor grows.
const GROWS: f64 = 1.5;
/// Slower than this is the hand moving, not the loop oscillating, Hz.
pub(crate) const LOWEST_HZ: f64 = 8.0;
/// The first part of a hold is the transient of getting there, s.
const TRANSIENT_S: f64 = 0.15;
/// Of the spectra that tell a dither's share, s.
const SEGMENT_S: f64 = 0.5;
/// A hold must last this long beyond its transient to be judged, s.
const LEAST_HOLD_S: f64 = 0.3;
/// An oscillation below this is not felt and not counted, m or rad.
pub(crate) const LEAST_AMPLITUDE: f64 = 2e-6;

/// Half the span of thousands of samples of noise stays below this, standard deviations.
pub(crate) const NOISE: f64 = 5.0;

/// A master that moves less than this while the hand holds still is at rest, m or rad.
const WANDER: f64 = 20e-6;

/// Judges a run by what the master does while the hand holds still and the slave is in contact.
pub fn judge(trace: &Trace) -> Outcome {
    let finite = trace.position.iter().chain(&trace.contact).position(|x| !x.is_finite());
    let span = trace.travel.map_or(1.0, |[low, high]| high - low);
    let largest = trace.position.iter().fold(0.0_f64, |m, x| m.max(x.abs()));
    if finite.is_some() || largest > 10.0 * span {
        return Outcome::Unstable { growth_per_s: runaway_growth(trace) };
    }
    let contact: Vec<usize> = (0..trace.contact.len()).filter(|i| trace.contact[*i] != 0.0).collect();
    let clamped = contact.iter().filter(|i| trace.clamped.get(**i).copied().unwrap_or(false)).count();
    let clamped_share = if contact.is_empty() { 0.0 } else { clamped as f64 / contact.len() as f64 };
    let beyond_travel = trace.travel.is_some_and(|[low, high]| trace.position.iter().any(|x| *x < low || *x > high));
    if clamped_share > 0.01 || beyond_travel {
        return Outcome::Limited { clamped_share, beyond_travel };
    }
    let pieces = holds(trace).into_iter().flat_map(|hold| of_one_level(trace, hold));
    let judged = Outcome::worst(pieces.filter_map(|(from, to)| judge_hold(trace, from, to)));
    let fault = trace.gaps.fault(trace.position.len(), trace.period_s);
    let nothing = || match contact.is_empty() {
        _ if trace.position.is_empty() => Unjudged::Empty,
        true => Unjudged::NoContact,
        false => Unjudged::NoHold,
    };
    judged.unwrap_or_else(|| Outcome::NotJudged { why: nothing() }).held_back(fault)
}

fn judge_hold(trace: &Trace, from: usize, to: usize) -> Option<Outcome> {
    if dithered(trace, from, to).is_some_and(|unexplained| unexplained < 0.5) {
        return Some(judge_drift(trace, from, to));
    }
    let found = oscillation(&trace.position[from..to], trace.period_s, LOWEST_HZ)?;
    let (fast, slow) = (judge_fast(&found, trace), judge_slow(trace, from, to));
    // The edges of a slow wandering have lines at every frequency, the strongest of them at the lowest.
    let spills_over = found.frequency_hz < 1.5 * LOWEST_HZ && slow != Outcome::Stable;
    Some(if fast == Outcome::Stable || spills_over { slow } else { fast })
}

/// The frequency at which a run oscillated, Hz: of the strongest oscillation while the hand held still, or on the way out of all bounds; 0 where it
/// ran away without oscillating.
pub fn frequency_hz(trace: &Trace) -> f64 {
    let pieces = holds(trace).into_iter().filter_map(|(from, to)| oscillation(&trace.position[from..to], trace.period_s, LOWEST_HZ));
    let strongest = pieces.filter(|o| judge_fast(o, trace) != Outcome::Stable).max_by(|a, b| a.amplitude.total_cmp(&b.amplitude));
    if let Some(found) = strongest {
        return found.frequency_hz;
    }
    let span = trace.travel.map_or(1.0, |[low, high]| high - low);
    let from = trace.contact.iter().position(|f| *f != 0.0).unwrap_or(0).min(trace.position.len());
    let bounded: Vec<f64> = trace.position[from..].iter().copied().take_while(|x| x.is_finite() && x.abs() <= 10.0 * span).collect();
    if bounded.len() == trace.position.len() - from || bounded.len() < 2 {
        return 0.0;
    }
    // The last half of the way out: half a period lies between two of its turns.
    let last = &bounded[bounded.len() / 2..];
    let largest = last.iter().fold(0.0_f64, |m, x| m.max(x.abs()));
    let turns = turns(last, 1e-3 * largest);
    if turns < 3 { 0.0 } else { turns as f64 / (2.0 * last.len() as f64 * trace.period_s) }
}

/// Pieces of a hold in which the dither keeps its level: one whose level rises makes the master move more, which is no growth of the loop's.
fn of_one_level(trace: &Trace, (from, to): (usize, usize)) -> Vec<(usize, usize)> {
    let window = ((SEGMENT_S / trace.period_s) as usize).max(1);
    let Some(dither) = trace.dither.get(from..to).filter(|d| d.len() >= 2 * window && d.iter().any(|f| *f != 0.0)) else {
        return vec![(from, to)];
    };
    let rms = |piece: &[f64]| (piece.iter().map(|f| f * f).sum::<f64>() / piece.len() as f64).sqrt();
    let (transient, least) = ((TRANSIENT_S / trace.period_s) as usize, (LEAST_HOLD_S / trace.period_s) as usize);
    let mut pieces = Vec::new();
    let (mut start, mut level) = (from, rms(&dither[..window]));
    for (index, piece) in dither.chunks_exact(window).enumerate().skip(1) {
        let now = rms(piece);
        // As much as an oscillation must grow to count.
        if now > GROWS * level || level > GROWS * now {
            let at = from + index * window;
            // The step may lie anywhere in the window before or in this one.
            pieces.push((start, at.saturating_sub(window)));
            (start, level) = (at + transient, now);
        }
    }
    pieces.push((start, to));
    // A single window may hold the step itself.
    pieces.retain(|(from, to)| *to >= from + least + window);
    pieces
}

/// Where a dither plays: the share of the motion's power that it does not explain, 0 to 1.
fn dithered(trace: &Trace, from: usize, to: usize) -> Option<f64> {
    let dither = trace.dither.get(from..to).filter(|d| d.iter().any(|f| *f != 0.0))?;
    let columns = [dither, &trace.position[from..to]];
    let segment = (to - from).div_ceil(4).min((SEGMENT_S / trace.period_s) as usize);
    let spectra = welch(&columns, std::slice::from_ref(&(0..to - from)), segment, trace.period_s, 0.5 / trace.period_s)?;
    let averages = spectra.averaging.averages.max(1.5);
    let (mut all, mut unexplained) = (0.0, 0.0);
    for (line, matrix) in spectra.lines.iter().enumerate().filter(|(line, _)| spectra.hz[*line] >= LOWEST_HZ) {
        let power = matrix[(1, 1)].re;
        all += power;
        // Few averages make chance look like coherence.
        unexplained += power * ((1.0 - spectra.coherence(line, 0, 1)) * averages / (averages - 1.0)).min(1.0);
    }
    (all > 0.0).then(|| unexplained / all)
}

/// Whether a master that a dither shakes runs away underneath: the mean of each quarter lies farther from the one before.
fn judge_drift(trace: &Trace, from: usize, to: usize) -> Outcome {
    let piece = &trace.position[from..to];
    let quarter = piece.len() / 4;
    let mean = |i: usize| piece[i * quarter..(i + 1) * quarter].iter().sum::<f64>() / quarter as f64;
    let (second, third) = ((mean(2) - mean(1)).abs(), (mean(3) - mean(2)).abs());
    if third > WANDER.max(4.0 * trace.resolution) + 2.0 * NOISE * trace.noise
        && third > 1.5 * second
        && (mean(3) > mean(2)) == (mean(2) > mean(1))
    {
        let time = quarter as f64 * trace.period_s;
        return Outcome::Unstable { growth_per_s: (third / second.max(WANDER)).ln() / time };
    }
    Outcome::Stable
}

/// Whether the master comes to rest while the hand holds still: a loop whose canceller takes out too much at DC, or
/// sticks and slips, wanders slowly and may never oscillate at a frequency of its own.
fn judge_slow(trace: &Trace, from: usize, to: usize) -> Outcome {
    let piece = &trace.position[from..to];
    let quarter = piece.len() / 4;
    let range = |piece: &[f64]| {
        let (low, high) = piece.iter().fold((f64::INFINITY, f64::NEG_INFINITY), |(l, h), x| (l.min(*x), h.max(*x)));
        high - low
    };
    let (third, last) = (range(&piece[2 * quarter..3 * quarter]), range(&piece[3 * quarter..]));
    let floor = WANDER.max(4.0 * trace.resolution) + 2.0 * NOISE * trace.noise;
    let turns = turns(&piece[quarter..], floor);
    if last <= floor || (last < 0.5 * third && turns == 0) {
        return Outcome::Stable;
    }
    let whole = range(&piece[quarter..]);
    if turns == 0 && last > 1.5 * third {
        let time = quarter as f64 * trace.period_s;
        return Outcome::Unstable { growth_per_s: (last / third.max(floor)).ln() / time };
    }
    let time = (piece.len() - quarter) as f64 * trace.period_s;
    Outcome::LimitCycle { amplitude_m: 0.5 * whole, frequency_hz: (turns.max(1) as f64) / (2.0 * time) }
}

/// How often a signal turns back by more than `least`.
fn turns(signal: &[f64], least: f64) -> usize {
    let (mut turns, mut rising, mut low, mut high) = (0, None, signal[0], signal[0]);
    for x in signal {
        (low, high) = (low.min(*x), high.max(*x));
        match rising {
            None if high - low > least => rising = Some(*x == high),
            Some(true) if high - x > least => (turns, rising, low) = (turns + 1, Some(false), *x),
            Some(false) if x - low > least => (turns, rising, high) = (turns + 1, Some(true), *x),
            _ => {}
        }
    }
    turns
}

fn judge_fast(found: &Oscillation, trace: &Trace) -> Outcome {
    let floor = LEAST_AMPLITUDE.max(4.0 * trace.resolution) + NOISE * trace.noise;
    let grows = found.amplitude > GROWS * found.amplitude_before && found.growth_per_s > 0.2;
    let dies = found.amplitude < 0.7 * found.amplitude_before && found.growth_per_s < -0.2;
    if found.amplitude <= floor || dies {
        Outcome::Stable
    } else if grows {
        Outcome::Unstable { growth_per_s: found.growth_per_s }
    } else {
        Outcome::LimitCycle { amplitude_m: found.amplitude, frequency_hz: found.frequency_hz }
    }
}

/// Pieces in which the hand holds still, the slave touches something at least now and then, and no sample is missing for longer than the loop
/// bridges; transients cut off.
fn holds(trace: &Trace) -> Vec<(usize, usize)> {
    let n = trace.position.len().min(trace.contact.len());
    let mut open = vec![false; n];
    for gap in trace.gaps.long(trace.period_s) {
        open[gap.start.min(n)..gap.end.min(n)].fill(true);
    }
    let still = |i: usize| !open[i] && hand_still(trace, i);
    let (transient, least) = ((TRANSIENT_S / trace.period_s) as usize, (LEAST_HOLD_S / trace.period_s) as usize);
    let mut holds = Vec::new();
    let mut start = None;
    for i in 0..=n {
        match (i < n && still(i), start) {
            (true, None) => start = Some(i),
            (false, Some(from)) => {
                let from = from + transient;
                let touches = from < i && trace.contact[from..i].iter().any(|f| *f != 0.0);
                if touches && i - from >= least {
                    holds.push((from, i));
                }
                start = None;
            }
            _ => {}
        }
    }
    holds
}

fn hand_still(trace: &Trace, i: usize) -> bool {
    trace.intent.is_empty() || i == 0 || i >= trace.intent.len() || trace.intent[i] == trace.intent[i - 1]
}

/// Growth of a run that left all bounds: from the logarithm of its last decade of magnitude.
fn runaway_growth(trace: &Trace) -> f64 {
    let good: Vec<f64> = trace.position.iter().copied().take_while(|x| x.is_finite()).map(f64::abs).collect();
    let peak = good.iter().copied().fold(0.0, f64::max);
    let (Some(end), Some(start)) = (good.iter().position(|x| *x >= peak), good.iter().position(|x| *x >= peak / 10.0)) else {
        return f64::INFINITY;
    };
    if end > start { 10.0_f64.ln() / ((end - start) as f64 * trace.period_s) } else { f64::INFINITY }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn trace(position: impl Fn(f64) -> f64) -> Trace {
        let times = (0..10_000).map(|i| i as f64 * 2e-4);
        Trace {
            period_s: 2e-4,
            intent: vec![0.006; 10_000],
            position: times.map(position).collect(),
            contact: vec![-1.0; 10_000],
            feedback: vec![-0.3; 10_000],
            dither: Vec::new(),
            clamped: vec![false; 10_000],
            travel: Some([-0.05, 0.05]),
            resolution: 2e-6,
            noise: 0.0,
            gaps: Gaps::default(),
        }
    }

    fn sine(t: f64) -> f64 {
        (2.0 * std::f64::consts::PI * 60.0 * t).sin()
    }

    #[test]
    fn a_dying_ringing_is_stable_and_a_standing_one_is_a_limit_cycle() {
        assert_eq!(judge(&trace(|t| 0.005 + 1e-3 * (-8.0 * t).exp() * sine(t))), Outcome::Stable);
        let Outcome::LimitCycle { amplitude_m, frequency_hz } = judge(&trace(|t| 0.005 + 2e-4 * sine(t))) else { panic!() };
        assert!((amplitude_m - 2e-4).abs() < 1e-5 && (frequency_hz - 60.0).abs() < 0.2);
        let Outcome::Unstable { growth_per_s } = judge(&trace(|t| 0.005 + 1e-5 * (1.5 * t).exp() * sine(t))) else { panic!() };
        assert!((growth_per_s - 1.5).abs() < 0.1);
    }

    #[test]
    fn a_slow_wandering_is_a_limit_cycle_and_a_settling_is_stable() {
        let Outcome::LimitCycle { frequency_hz, .. } = judge(&trace(|t| 0.005 + 1e-3 * (5.0 * t).sin().signum())) else { panic!() };
        assert!((frequency_hz - 5.0 / (2.0 * std::f64::consts::PI)).abs() < 0.2, "{frequency_hz}");
        assert_eq!(judge(&trace(|t| 0.005 + 1e-3 * (-4.0 * t).exp())), Outcome::Stable);
        let Outcome::Unstable { .. } = judge(&trace(|t| 0.005 + 1e-5 * (2.0 * t).exp())) else { panic!() };
    }

    #[test]
    fn a_dither_whose_level_rises_is_no_growth_of_the_loop() {
        let level = |t: f64| [0.15, 0.4, 1.0][(t / 2.0) as usize % 3];
        // Friction takes more of a small force, so that no one response explains all levels.
        let moved = |t: f64| 0.005 + 1e-4 * (level(t) - 0.1) * (sine(t - 0.003 * level(t)) + sine(1.7 * t));
        let times = || (0..10_000).map(|i| f64::from(i) * 6e-4);
        let shaken = Trace {
            period_s: 6e-4,
            position: times().map(moved).collect(),
            dither: times().map(|t| level(t) * (sine(t) + sine(1.7 * t))).collect(),
            ..trace(|_| 0.005)
        };
        assert_eq!(judge(&shaken), Outcome::Stable);
    }

    #[test]
    fn a_run_in_which_nothing_was_touched_or_held_is_not_judged() {
        let why = |outcome: Outcome| if let Outcome::NotJudged { why } = outcome { why } else { panic!("{outcome:?}") };
        let free = Trace { contact: vec![0.0; 10_000], ..trace(|_| 0.005) };
        assert_eq!(why(judge(&free)), Unjudged::NoContact);
        let moving = Trace { intent: (0..10_000).map(f64::from).collect(), ..trace(|_| 0.005) };
        assert_eq!(why(judge(&moving)), Unjudged::NoHold);
        let mut four = trace(|_| 0.005);
        four.position.truncate(4);
        assert_eq!(why(judge(&four)), Unjudged::NoHold);
        assert_eq!(why(judge(&Trace { period_s: 2e-4, ..Trace::default() })), Unjudged::Empty);
    }

    #[test]
    fn what_is_missing_takes_a_green_answer_and_leaves_a_negative_one() {
        let cut = |position: &dyn Fn(f64) -> f64| {
            let whole = trace(position);
            judge(&Trace { gaps: Gaps { planned: 20_000, bridged_s: 0.02, ..Gaps::default() }, ..whole })
        };
        assert_eq!(cut(&|_| 0.005), Outcome::NotJudged { why: Unjudged::CutShort { steps: 10_000, of: 20_000 } });
        assert_eq!(cut(&|t| 0.005 + 2e-4 * sine(t)).word(), "limit_cycle");
        let torn = Gaps { at: (0..10_000).map(|i| (8000..8200).contains(&i)).collect(), bridged_s: 0.02, planned: 10_000 };
        let judged = judge(&Trace { gaps: torn, ..trace(|_| 0.005) });
        assert_eq!(judged, Outcome::NotJudged { why: Unjudged::Gaps { steps: 200, of: 10_000 } });
        assert_eq!(Outcome::Stable.held_back(Some(Unjudged::NodeDied)).word(), "cannot_tell");
        assert!(!judged.is_stable() && !judged.is_unstable());
    }

    #[test]
    fn a_clamped_run_is_never_stable() {
        let mut clamped = trace(|_| 0.005);
        clamped.clamped[..200].fill(true);
        assert_eq!(judge(&clamped).word(), "limited");
        assert_eq!(judge(&trace(|t| 0.06 * t)).word(), "limited");
    }

    #[test]
    fn a_run_away_is_unstable() {
        let Outcome::Unstable { growth_per_s } = judge(&trace(|t| 1e-6 * (9.0 * t).exp())) else { panic!() };
        assert!((growth_per_s - 9.0).abs() < 0.1);
        assert_eq!(judge(&trace(|t| if t > 1.0 { f64::NAN } else { 0.0 })).word(), "unstable");
    }
}
