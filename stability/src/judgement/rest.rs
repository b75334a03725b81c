//! Whether a loop comes to rest while the hand holds still: by the master's position, and by the forces where the sensor's step hides the motion.

use super::dither::{dithered, judge_drift};
use super::swings::{Course, DIES, GROWS, STEADY_PER_S, Swings, WANDER};
use crate::oscillation::{Oscillation, oscillation, without_slow_motion};
use crate::outcome::{LEAST_AMPLITUDE, LOWEST_HZ, NOISE, Outcome, Trace, Unit};

/// A line this far above the lowest frequency is none of a quick hand's.
const BEYOND_THE_HAND: f64 = 1.3;
/// What falls by a factor of `DIES` over three quarters falls by 0.89 in one; what falls by less than this in the last one stays.
const STAYS: f64 = 0.94;
/// A motion of less than this many steps of the sensor may be its rounding.
const STEPS: f64 = 4.0;
/// A force that swings by less than this share of its largest in the hold is not felt to (differences of force that are just noticed: 7 %; Pang, Tan
/// and Durlach 1991).
const FELT_SHARE: f64 = 0.05;
/// A force of less is not felt at all, N, peak to peak (fingertips: 0.02 to 0.06 N; Jones and Tan 2013).
const LEAST_FORCE: f64 = 0.05;
/// Of a knob or lever of an axis that turns, m: a torque is felt as this makes it a force.
const LEVER: f64 = 0.1;
/// Nor is one of less than this share of the largest of the whole run, which is what keeps the rounding of a force about 0 from counting.
const LEAST_SHARE: f64 = 0.01;

/// What the loop does in a hold; `None` where the hold is too short for what can be asked of it.
pub(super) fn judge_hold(trace: &Trace, from: usize, to: usize) -> Option<Outcome> {
    if dithered(trace, from, to).is_some_and(|unexplained| unexplained < 0.5) {
        return Some(judge_drift(trace, from, to));
    }
    let found = oscillation(&trace.position[from..to], trace.period_s, LOWEST_HZ);
    let fast = found.as_ref().map_or(Outcome::Stable, |found| judge_fast(found, trace));
    // Where the hand's intent was not recorded, slow motion is the hand's own, and a quick hand has lines at the lowest frequency of interest.
    if trace.intent.is_empty() {
        let by_hand = found?.frequency_hz < BEYOND_THE_HAND * LOWEST_HZ;
        let by_position = if by_hand { Outcome::Stable } else { fast };
        return Some(if by_position == Outcome::Stable { judge_force(trace, from, to) } else { by_position });
    }
    let slow = judge_slow(trace, from, to);
    // The ends of a slow drift have lines at every frequency, the strongest of them at the lowest.
    let spills_over = found.is_some_and(|f| f.frequency_hz < 1.5 * LOWEST_HZ) && slow != Outcome::Stable;
    let by_position = if fast == Outcome::Stable || spills_over { slow } else { fast };
    Some(if by_position == Outcome::Stable { judge_force(trace, from, to) } else { by_position })
}

/// Up to this level the position shows nothing, m or rad: half a peak-to-peak.
fn floor(trace: &Trace) -> f64 {
    LEAST_AMPLITUDE.max(STEPS * trace.resolution) + NOISE * trace.noise
}

pub(super) fn judge_fast(found: &Oscillation, trace: &Trace) -> Outcome {
    let grows = found.amplitude > GROWS * found.amplitude_before && found.growth_per_s > STEADY_PER_S;
    // What falls from a large beginning to a level at which it stays does not die.
    let stays = found.amplitude >= STAYS * found.amplitude_third && found.later_growth_per_s >= -STEADY_PER_S;
    let dies = found.amplitude < DIES * found.amplitude_before && found.growth_per_s < -STEADY_PER_S && !stays;
    if found.amplitude <= floor(trace) || dies {
        Outcome::Stable
    } else if grows {
        Outcome::Unstable { growth_per_s: found.growth_per_s }
    } else {
        Outcome::LimitCycle { amplitude_m: found.amplitude, frequency_hz: found.frequency_hz, unit: trace.unit }
    }
}

/// Whether the master comes to rest while the hand holds still. A loop of a low rate oscillates slowly. One whose canceller subtracts too much at DC,
/// or that sticks and slips, drifts and may never oscillate at a frequency of its own. With the hand still any frequency is the loop's.
fn judge_slow(trace: &Trace, from: usize, to: usize) -> Outcome {
    let piece = &trace.position[from..to];
    let quarter = piece.len() / 4;
    let (third, last) = (range(&piece[2 * quarter..3 * quarter]), range(&piece[3 * quarter..]));
    let floor = WANDER.max(STEPS * trace.resolution) + 2.0 * NOISE * trace.noise;
    let later = &piece[quarter..];
    let swings = Swings::of(later, floor, trace.period_s);
    let turns = swings.turns();
    if last <= floor || (last < 0.5 * third && turns == 0) {
        return Outcome::Stable;
    }
    if turns == 0 && last > 1.5 * third {
        let time = quarter as f64 * trace.period_s;
        return Outcome::Unstable { growth_per_s: (last / third.max(floor)).ln() / time };
    }
    let amplitude_m = 0.5 * range(later);
    if swings.oscillates() {
        return match swings.course() {
            Course::Dies => Outcome::Stable,
            Course::GoesOn => Outcome::LimitCycle { amplitude_m: 0.5 * last, frequency_hz: swings.frequency_hz(), unit: trace.unit },
            Course::Grows(growth_per_s) => Outcome::Unstable { growth_per_s },
        };
    }
    let time = (piece.len() - quarter) as f64 * trace.period_s;
    Outcome::LimitCycle { amplitude_m, frequency_hz: (turns.max(1) as f64) / (2.0 * time), unit: trace.unit }
}

/// Whether a force swings on though the position shows no motion that its sensor's step would not make: a motion below a step is not known to be
/// none. At rest the rounded position stands still, and so does every force.
fn judge_force(trace: &Trace, from: usize, to: usize) -> Outcome {
    if trace.dither.get(from..to).is_some_and(|d| d.iter().any(|f| *f != 0.0)) {
        return Outcome::Stable;
    }
    // A fine sensor hides nothing of a master that moves; a slave may shake while dry friction holds the master.
    let quarter = (to - from) / 4;
    if floor(trace) <= WANDER && moved(&trace.slave, to - quarter..to) / mu(trace) <= floor(trace) {
        return Outcome::Stable;
    }
    let judged = [&trace.contact, &trace.feedback].into_iter().map(|force| judge_one_force(trace, force, from, to));
    Outcome::worst(judged).unwrap_or(Outcome::Stable)
}

fn judge_one_force(trace: &Trace, force: &[f64], from: usize, to: usize) -> Outcome {
    let Some(piece) = force.get(from..to) else { return Outcome::Stable };
    let largest = |f: &[f64]| f.iter().filter(|f| f.is_finite()).fold(0.0_f64, |m, f| m.max(f.abs()));
    let felt = match trace.unit {
        Unit::Metre => LEAST_FORCE,
        Unit::Radian => LEAST_FORCE * LEVER,
        Unit::Unknown => 0.0,
    };
    let floor = (FELT_SHARE * largest(piece)).max(LEAST_SHARE * largest(force)).max(felt);
    let alone = trace.intent.is_empty().then(|| without_slow_motion(piece, trace.period_s, LOWEST_HZ));
    let piece = alone.as_deref().unwrap_or(piece);
    let quarter = piece.len() / 4;
    let late = &piece[quarter..];
    if floor <= 0.0 || range(&piece[3 * quarter..]) <= floor {
        return Outcome::Stable;
    }
    let swings = Swings::of(late, floor, trace.period_s);
    // Noise of the sensors swings a force too, but never regularly.
    if !swings.oscillates() || swings.last_row() < late.len() - quarter || !swings.regular() {
        return Outcome::Stable;
    }
    let last = to - quarter..to;
    match swings.course() {
        Course::Dies => Outcome::Stable,
        Course::GoesOn => {
            let amplitude_m = moved(&trace.position, last.clone()).max(moved(&trace.slave, last) / mu(trace));
            Outcome::LimitCycle { amplitude_m, frequency_hz: swings.frequency_hz(), unit: trace.unit }
        }
        Course::Grows(growth_per_s) => Outcome::Unstable { growth_per_s },
    }
}

/// Half of what a signal spans in some rows; 0 of rows that it does not have.
fn moved(signal: &[f64], rows: std::ops::Range<usize>) -> f64 {
    signal.get(rows).map_or(0.0, |rows| 0.5 * range(rows))
}

fn mu(trace: &Trace) -> f64 {
    trace.mu.abs().max(f64::MIN_POSITIVE)
}

fn range(piece: &[f64]) -> f64 {
    let (low, high) = piece.iter().fold((f64::INFINITY, f64::NEG_INFINITY), |(l, h), x| (l.min(*x), h.max(*x)));
    if high >= low { high - low } else { 0.0 }
}
