//! A run while a dither plays: what it explains of the motion is none of the loop's.

use super::holds::{LEAST_HOLD_S, TRANSIENT_S};
use super::swings::{GROWS, WANDER};
use crate::outcome::{LOWEST_HZ, NOISE, Outcome, Trace};
use crate::spectra::welch;
use backdrive_signal::statistics::rms;

/// Of the spectra that give a dither's share, s.
const SEGMENT_S: f64 = 0.5;

/// Pieces of a hold in which the dither keeps its level: one whose level rises makes the master move more, which is no growth of the loop's.
pub(super) fn of_one_level(trace: &Trace, (from, to): (usize, usize)) -> Vec<(usize, usize)> {
    let window = ((SEGMENT_S / trace.period_s) as usize).max(1);
    let Some(dither) = trace.dither.get(from..to).filter(|d| d.len() >= 2 * window && d.iter().any(|f| *f != 0.0)) else {
        return vec![(from, to)];
    };
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
pub(super) fn dithered(trace: &Trace, from: usize, to: usize) -> Option<f64> {
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

/// Whether the mean position of a master with dither runs away: the mean of each quarter lies farther from the one before.
pub(super) fn judge_drift(trace: &Trace, from: usize, to: usize) -> Outcome {
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
