//! One judgement of a run, for live runs, replays, predictions, bags and other people's recordings alike: [`judge`]. Its criteria:
//!
//! | fact | threshold |
//! |---|---|
//! | where it looks | the hand holds still and the loop is closed, for 0.3 s and 16 samples beyond a transient of 0.15 s |
//! | the loop is closed | while the slave touches something; always, where the law reflects motion (every coupling but `direct`) |
//! | a fast oscillation | above 8 Hz; half its peak-to-peak in the last quarter above 2 um and four encoder steps |
//! | it dies | its last quarter below 0.7 of its first, its envelope falling by more than 0.2 per second; and its last quarter below 0.94 of the third, or its later half falling as fast |
//! | it grows | its last quarter above 1.5 of its first, its envelope rising by more than 0.2 per second: unstable |
//! | otherwise | a limit cycle |
//! | the hand was not recorded | it counts as holding on while the slave touches something, losses of 50 ms bridged; only what is above 10.4 Hz is the loop's, or regular in the forces above 8 Hz |
//! | slow motion | the last quarter spans more than 20 um and four encoder steps, and does not settle; four swings or more die or grow as above, by their later half |
//! | forces | where the position shows nothing, and four steps of its sensor are more than 20 um or less than the slave's motion. The force swings regularly (sizes and periods vary by less than 0.35), by more than 5 % of its largest in the hold, 1 % of its largest in the run, and 0.05 N (0.005 N m) |
//! | limited | a clamp acted in more than 1 % of the contact (of a loop that is always closed: or of the holds), or the master left its travel; of a loop that is always closed a limit cycle comes first |
//! | a noisy sensor | its noise adds 5 standard deviations to what an amplitude and 10 to what a span must exceed |
//! | the hand never holds still | of a loop that is always closed: whether every oscillation that the motion stirs dies (`moving`) |
//! | nothing to judge | no contact, no hold, or only holds with a gap in them: not judged, which is never stable |
//! | something is missing | a gap longer than `stale_after_s`, more than 1 % of the steps, or the end of the run: what looks stable is not judged |
//! | a dither plays | what it explains (coherence) does not count: less than half of the motion unexplained is no oscillation |

mod dither;
mod holds;
mod rest;
mod swings;

use crate::moving::{self, Decay, Pair};
use crate::oscillation::oscillation;
use crate::outcome::{Closes, LOWEST_HZ, Outcome, Trace};
use crate::unjudged::Unjudged;
use dither::of_one_level;
use holds::holds;
use rest::{judge_fast, judge_hold};
use swings::Swings;

/// More of the closed loop's steps than this at a clamp, and the clamp decides.
const MOST_CLAMPED: f64 = 0.01;

/// Judges a run by what the master does while the hand holds still and the loop is closed.
pub fn judge(trace: &Trace) -> Outcome {
    judge_with_decay(trace).0
}

/// The same, with the mode that is least sure to die where it was judged while the hand moved.
pub fn judge_with_decay(trace: &Trace) -> (Outcome, Option<Decay>) {
    let ran_away = [&trace.position, &trace.contact].into_iter().any(|signal| is_lost(signal));
    let span = trace.travel.map_or(1.0, |[low, high]| high - low);
    let largest = trace.position.iter().fold(0.0_f64, |m, x| m.max(x.abs()));
    if ran_away || largest > 10.0 * span {
        return (Outcome::Unstable { growth_per_s: runaway_growth(trace) }, None);
    }
    let always = trace.closes == Closes::Always;
    let touched = trace.contact.iter().any(|f| f.is_finite() && *f != 0.0);
    let in_contact = share_clamped(trace, (0..trace.contact.len()).filter(|i| trace.contact[*i] != 0.0));
    let clamped_share = if always { in_contact.max(share_clamped_at_rest(trace)) } else { in_contact };
    let beyond_travel = trace.travel.is_some_and(|[low, high]| trace.position.iter().any(|x| *x < low || *x > high));
    let limited = (clamped_share > MOST_CLAMPED || beyond_travel).then_some(Outcome::Limited { clamped_share, beyond_travel });
    if let Some(limited) = limited.filter(|_| !always) {
        return (limited, None);
    }
    let (judged, decay) = while_closed(trace, always);
    let fault = trace.gaps.fault(trace.position.len(), trace.period_s);
    let nothing = || match touched || always {
        _ if trace.position.is_empty() => Unjudged::Empty,
        true => Unjudged::NoHold,
        false => Unjudged::NoContact,
    };
    let judged = judged.unwrap_or_else(|| Outcome::NotJudged { why: nothing() }).held_back(fault);
    let shakes = judged.is_unstable();
    (limited.filter(|_| !shakes).unwrap_or(judged), decay)
}

/// Whether a signal leaves all numbers. One that nobody measured, or not from the beginning, does not.
fn is_lost(signal: &[f64]) -> bool {
    let measured = signal.iter().position(|x| !x.is_nan()).unwrap_or(signal.len());
    signal[measured..].iter().any(|x| !x.is_finite())
}

/// Share of these steps in which a clamp acted.
fn share_clamped(trace: &Trace, steps: impl Iterator<Item = usize>) -> f64 {
    let (all, clamped) = steps
        .fold((0_usize, 0_usize), |(all, clamped), i| (all + 1, clamped + usize::from(trace.clamped.get(i).copied().unwrap_or(false))));
    clamped as f64 / all.max(1) as f64
}

/// Of a loop that is always closed: of the steps in which the hand holds still, which leaves out a knock at the start; of all of them where it
/// never does.
fn share_clamped_at_rest(trace: &Trace) -> f64 {
    let holds = if trace.intent.is_empty() { Vec::new() } else { holds(trace) };
    match holds.is_empty() {
        true => share_clamped(trace, 0..trace.position.len()),
        false => share_clamped(trace, holds.into_iter().flat_map(|(from, to)| from..to)),
    }
}

/// By its holds; of a pair whose hand never holds still, or whose hand was not recorded, by what it does while the hand moves.
fn while_closed(trace: &Trace, always: bool) -> (Option<Outcome>, Option<Decay>) {
    let known = !trace.intent.is_empty();
    if known || !always {
        let pieces = holds(trace).into_iter().flat_map(|hold| of_one_level(trace, hold));
        let judged = Outcome::worst(pieces.filter_map(|(from, to)| judge_hold(trace, from, to)));
        if judged.is_some() || !always {
            return (judged, None);
        }
    }
    if trace.slave.is_empty() {
        return (None, None);
    }
    let pair = Pair {
        master: &trace.position,
        slave: &trace.slave,
        mu: trace.mu,
        period_s: trace.period_s,
        resolution: trace.resolution,
        noise: trace.noise,
        unit: trace.unit,
    };
    let (outcome, decay) = moving::judge(&pair);
    (Some(outcome), decay)
}

/// The frequency at which a run oscillated, Hz: of the strongest oscillation while the hand held still, or on the way out of all bounds; 0 where it
/// ran away without oscillating.
pub fn frequency_hz(trace: &Trace) -> f64 {
    let pieces = holds(trace).into_iter().filter_map(|(from, to)| oscillation(&trace.position[from..to], trace.period_s, LOWEST_HZ));
    let strongest = pieces.filter(|o| judge_fast(o, trace) != Outcome::Stable).max_by(|a, b| a.amplitude.total_cmp(&b.amplitude));
    if let Some(found) = strongest {
        return found.frequency_hz;
    }
    // Slower than that, or seen in the forces alone.
    let judged = holds(trace).into_iter().filter_map(|(from, to)| judge_hold(trace, from, to));
    if let Some(Outcome::LimitCycle { frequency_hz, .. }) = Outcome::worst(judged) {
        return frequency_hz;
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
    let turns = Swings::of(last, 1e-3 * largest, trace.period_s).turns();
    if turns < 3 { 0.0 } else { turns as f64 / (2.0 * last.len() as f64 * trace.period_s) }
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
    use crate::unjudged::Gaps;

    #[test]
    fn a_force_that_nobody_measured_is_no_runaway() {
        let calm = Trace { contact: vec![f64::NAN; 10_000], ..trace(|t| 0.006 * t.min(1.0)) };
        assert!(!judge(&calm).is_unstable(), "{:?}", judge(&calm));
        let mut lost = calm.clone();
        lost.position[9_000] = f64::INFINITY;
        assert!(judge(&lost).is_unstable());
    }

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
            ..Trace::default()
        }
    }

    fn sine(t: f64) -> f64 {
        (2.0 * std::f64::consts::PI * 60.0 * t).sin()
    }

    #[test]
    fn a_dying_ringing_is_stable_and_a_standing_one_is_a_limit_cycle() {
        assert_eq!(judge(&trace(|t| 0.005 + 1e-3 * (-8.0 * t).exp() * sine(t))), Outcome::Stable);
        let Outcome::LimitCycle { amplitude_m, frequency_hz, .. } = judge(&trace(|t| 0.005 + 2e-4 * sine(t))) else { panic!() };
        assert!((amplitude_m - 2e-4).abs() < 1e-5 && (frequency_hz - 60.0).abs() < 0.2);
        let Outcome::Unstable { growth_per_s } = judge(&trace(|t| 0.005 + 1e-5 * (1.5 * t).exp() * sine(t))) else { panic!() };
        assert!((growth_per_s - 1.5).abs() < 0.1);
    }

    #[test]
    fn what_falls_to_a_level_at_which_it_stays_is_a_limit_cycle() {
        let Outcome::LimitCycle { amplitude_m, .. } = judge(&trace(|t| 0.005 + (2e-4 + 2e-3 * (-8.0 * t).exp()) * sine(t))) else {
            panic!()
        };
        assert!((amplitude_m - 2e-4).abs() < 1e-5, "{amplitude_m}");
        assert_eq!(judge(&trace(|t| 0.005 + 2e-3 * (-0.6 * t).exp() * sine(t))), Outcome::Stable);
    }

    #[test]
    fn a_law_that_reflects_motion_is_judged_in_free_motion() {
        let free = |position: &dyn Fn(f64) -> f64| {
            let whole = trace(position);
            Trace { closes: Closes::Always, contact: vec![0.0; 10_000], unit: crate::outcome::Unit::Radian, ..whole }
        };
        assert_eq!(judge(&free(&|_| 0.005)), Outcome::Stable);
        let cycle = judge(&free(&|t| 0.005 + 2e-4 * sine(t)));
        assert_eq!(cycle.to_string(), "limit cycle of ±0.200 mrad at 60.0 Hz");
        // At its motor's limit it is never stable, and the oscillating signal is more informative than the limit.
        let clamped = |position: &dyn Fn(f64) -> f64| judge(&Trace { clamped: vec![true; 10_000], ..free(position) }).word();
        assert_eq!((clamped(&|_| 0.005), clamped(&|t| 0.005 + 2e-4 * sine(t))), ("limited", "limit_cycle"));
    }

    #[test]
    fn a_force_that_swings_regularly_is_a_limit_cycle_whatever_the_encoder_hides() {
        let coarse = |force: &dyn Fn(f64) -> f64| {
            let contact = (0..10_000).map(|i| -1.0 + force(f64::from(i) * 2e-4)).collect();
            judge(&Trace { resolution: 1e-3, contact, ..trace(|t| 0.005 + 2e-4 * sine(t)) })
        };
        let Outcome::LimitCycle { frequency_hz, .. } = coarse(&|t| 0.3 * sine(t)) else { panic!() };
        assert!((frequency_hz - 60.0).abs() < 0.5, "{frequency_hz}");
        assert_eq!(coarse(&|_| 0.0), Outcome::Stable);
        assert_eq!(coarse(&|t| 0.3 * (-8.0 * t).exp() * sine(t)), Outcome::Stable);
        // Noise of a force sensor: white, by the mixing function of SplitMix64 (Steele, Lea and Flood 2014).
        let noise = |t: f64| {
            let mut x = ((t / 2e-4).round() as u64 + 1).wrapping_mul(0x9e37_79b9_7f4a_7c15);
            x = (x ^ (x >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
            x = (x ^ (x >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
            (x ^ (x >> 31)) as f64 / u64::MAX as f64 - 0.5
        };
        assert_eq!(coarse(&|t| 0.3 * noise(t)), Outcome::Stable);
    }

    #[test]
    fn at_a_low_rate_the_loop_s_own_slow_oscillation_is_judged() {
        let slow = |position: &dyn Fn(f64) -> f64| {
            let rows = 40;
            judge(&Trace {
                period_s: 1.0 / 20.0,
                intent: vec![0.006; rows],
                position: (0..rows).map(|i| position(i as f64 / 20.0)).collect(),
                contact: vec![-1.0; rows],
                clamped: vec![false; rows],
                ..trace(|_| 0.005)
            })
        };
        let wave = |t: f64| (std::f64::consts::TAU * 3.3 * t).sin();
        assert_eq!(slow(&|t| 0.005 + 1e-3 * wave(t)).word(), "limit_cycle");
        assert_eq!(slow(&|t| 0.005 + 1e-3 * (-1.5 * t).exp() * wave(t)).word(), "stable");
        assert_eq!(slow(&|t| 0.005 + 1e-4 * (0.9 * t).exp() * wave(t)).word(), "unstable");
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
