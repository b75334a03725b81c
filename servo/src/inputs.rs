//! What is wrong with commands and positions before any fit: each in one sentence, with what to do.

use crate::error::ServoError;
use crate::problem::Joint;
use crate::record::Record;
use backdrive_signal::statistics::deviation;

/// Lags are looked for up to this share of a record.
const LAGS: f64 = 0.5;
/// A response that comes later than this, s, is none of a servo.
const LATEST: f64 = 1.0;

/// What a joint can be used for.
#[derive(Debug, Clone, PartialEq)]
pub enum Use {
    /// Its commands move it.
    Good,
    /// It has no information, for this reason.
    Still(String),
}

/// Examines a joint.
///
/// # Errors
/// Where its command is none.
pub fn looked_at(joint: &Joint) -> Result<Use, ServoError> {
    let name = &joint.name;
    let all: Vec<&Record> = joint.fit.iter().chain(&joint.held_out).collect();
    let wrong = |record: &Record, message: String| Err(ServoError::wrong(format!("{}: {name}.command", record.name), message));
    let moves = |x: &[f64]| range(x) > 1e-6;
    let commanded: Vec<&Record> = all.iter().copied().filter(|r| moves(&r.command)).collect();
    if commanded.is_empty() {
        return Ok(Use::Still("its command is constant in all recordings: record motions of this joint".to_string()));
    }
    if !all.iter().any(|r| moves(&r.position)) {
        return Ok(Use::Still("it is commanded and never moves: check that its torque is on and which column is its position".to_string()));
    }
    let moving: Vec<&Record> = commanded.iter().copied().filter(|r| moves(&r.position)).collect();
    for record in &moving {
        if let Some(ahead) = same(record) {
            let what = match ahead {
                0 => "is the position itself, in all samples".to_string(),
                n => format!("is the position of {n} samples later, in all samples"),
            };
            return wrong(
                record,
                format!(
                    "{what}: the dataset logs states as actions, so the servo cannot be identified from it; record the commands that \
                    were sent"
                ),
            );
        }
    }
    let Some(longest) = moving.iter().max_by(|a, b| deviation(&a.command).total_cmp(&deviation(&b.command))) else { return Ok(Use::Good) };
    let (c, p) = (deviation(&longest.command), deviation(&longest.position));
    let ratio = c / p.max(1e-12);
    if (ratio / 57.29577951308232).ln().abs() < 0.25 {
        return wrong(
            longest,
            format!(
                "varies {ratio:.0} times as much as the position: it is in degrees; write command = {{ column = \"...\", unit = \"deg\" \
                    }} in [joints.{name}]"
            ),
        );
    }
    if (ratio * 57.29577951308232).ln().abs() < 0.25 {
        let position = format!("{}: {name}.position", longest.name);
        return Err(ServoError::wrong(
            position,
            format!(
                "varies {:.0} times as much as the command: it is in degrees; write position = {{ column = \"...\", unit = \"deg\" }} in \
                    [joints.{name}]",
                1.0 / ratio
            ),
        ));
    }
    let (lag, explained) = best_lag(longest, &longest.command);
    let integrated = running_sum(longest);
    let (_, by_integral) = best_lag(longest, &integrated);
    if explained < 0.5 && by_integral > 0.8 {
        return wrong(
            longest,
            format!(
                "is a goal velocity: its integral follows the position ({:.0} %), and the signal itself does not; name the column of the \
                    goal position",
                100.0 * by_integral
            ),
        );
    }
    if explained > 0.5 && lag < -0.1 {
        return wrong(
            longest,
            format!(
                "lags the position that responds to it by {:.2} s: its times are wrong; shift them with t in [columns], or record with \
                    one clock",
                -lag
            ),
        );
    }
    if explained > 0.5 && lag > LATEST {
        return wrong(
            longest,
            format!(
                "leads the position by {lag:.2} s, more than any servo needs: command and position have different clocks; record both \
                    with one clock"
            ),
        );
    }
    if explained < 0.2 {
        return wrong(
            longest,
            format!(
                "explains {:.0} % of the position at any lag up to half the recording: it lags by more than that, or belongs to another \
                    joint; check the column and the clock",
                100.0 * explained.max(0.0)
            ),
        );
    }
    Ok(Use::Good)
}

fn range(x: &[f64]) -> f64 {
    let (low, high) = x.iter().fold((f64::INFINITY, f64::NEG_INFINITY), |(l, h), v| (l.min(*v), h.max(*v)));
    if high >= low { high - low } else { 0.0 }
}

/// How many samples the position is behind an equal command, where they are equal.
fn same(record: &Record) -> Option<usize> {
    let tolerance = 1e-6 * range(&record.position).max(1e-9);
    (0..=3).find(|n| {
        let pairs = record.command.iter().zip(record.position.iter().skip(*n));
        let (mut count, mut equal) = (0usize, 0usize);
        for (c, p) in pairs {
            count += 1;
            equal += usize::from((c - p).abs() <= tolerance);
        }
        count > 10 && equal * 1000 >= count * 995
    })
}

/// The lag of the position behind a signal, s, and which share of its variance that signal explains there.
fn best_lag(record: &Record, signal: &[f64]) -> (f64, f64) {
    let n = record.t.len();
    let step = (record.t[n - 1] - record.t[0]) / (n.max(2) - 1) as f64;
    // Some 2000 samples say as much.
    let stride = (n / 2000).max(1);
    let most = (LAGS * n as f64) as i64;
    let (mut best, mut near) = ((0.0, 0.0f64), (0.0, 0.0f64));
    let mut lag = -most;
    while lag <= most {
        let (mut count, mut sx, mut sy, mut sxx, mut syy, mut sxy) = (0.0, 0.0, 0.0, 0.0, 0.0, 0.0);
        let mut i = 0usize;
        while i < n {
            let j = i as i64 - lag;
            if let Some(x) = usize::try_from(j).ok().and_then(|j| signal.get(j)) {
                let y = record.position[i];
                count += 1.0;
                sx += x;
                sy += y;
                sxx += x * x;
                syy += y * y;
                sxy += x * y;
            }
            i += stride;
        }
        let (vx, vy, c) = (sxx - sx * sx / count, syy - sy * sy / count, sxy - sx * sy / count);
        // A lag at which little is left to compare explains nothing.
        let share = if vx > 0.0 && vy > 0.0 && c > 0.0 { c * c / (vx * vy) } else { 0.0 };
        let time = lag as f64 * step;
        if share > best.1 + 1e-9 {
            best = (time, share);
        }
        if (-0.1..=LATEST).contains(&time) && share > near.1 + 1e-9 {
            near = (time, share);
        }
        // Every lag that a servo may have is tried.
        let is_near = ((lag as f64) * step + 0.2).abs() < LATEST + 0.5;
        lag += if is_near { 1 } else { 1.max(most / 500) };
    }
    // A motion that repeats itself explains as much some periods later.
    if near.1 > 0.8 * best.1 { near } else { best }
}

fn running_sum(record: &Record) -> Vec<f64> {
    let mut sum = 0.0;
    record
        .t
        .windows(2)
        .zip(&record.command)
        .map(|(t, c)| {
            let now = sum;
            sum += c * (t[1] - t[0]);
            now
        })
        .collect()
}
