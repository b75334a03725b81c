//! A recorded signal compared with its expected value: the size of the difference, and which simple change would explain it.

use super::shapes::{filter, renewal};
use super::ways::{MOST_LATE, MOST_LATE_S, unsteady};
use backdrive_signal::statistics::rms;
use serde::Serialize;

/// What simple thing makes the recorded signal of the predicted one.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
#[serde(tag = "as_if", rename_all = "snake_case")]
pub enum AsIf {
    /// Nothing: they agree.
    Same,
    /// It stands still from a row on.
    Dead {
        /// First row at which it stands.
        from_row: usize,
    },
    /// It does not go beyond a value.
    Railed {
        /// Lowest value that it takes; minus infinity where that is no rail.
        low: f64,
        /// Highest value that it takes; infinity where that is no rail.
        high: f64,
    },
    /// It comes in steps.
    Stepped {
        /// One step, in the signal's unit.
        step: f64,
    },
    /// A factor, a delay, or both.
    Changed {
        /// Factor; negative where the sign is turned round.
        gain: f64,
        /// Rows by which it is late.
        late: usize,
    },
    /// Every value is that of an earlier row, not always as many rows earlier.
    Unsteady {
        /// Fewest rows by which it is late.
        late: usize,
        /// Most rows more than that.
        jitter: usize,
        /// Share of the samples that never came, 0 to 1, beside those that another one overtook.
        missing: f64,
    },
    /// It is renewed at a rate of its own, slower than the graph's, and held in between.
    Held {
        /// Rows from one renewal to the next; not always a whole number.
        rows: f64,
        /// Row of one of them.
        phase: f64,
    },
    /// A low-pass lies in its way.
    Filtered {
        /// 1 or 2.
        order: usize,
        /// Corner, Hz.
        corner_hz: f64,
    },
    /// The difference is noise.
    Noisy {
        /// Standard deviation of what is added, in the signal's unit.
        deviation: f64,
    },
    /// None of these.
    Otherwise,
}

/// A comparison.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Compared {
    /// Root mean square of the difference, in the signal's unit.
    pub error: f64,
    /// The same as a share of the predicted signal's own variation.
    pub share: f64,
    /// What explains it.
    #[serde(flatten)]
    pub as_if: AsIf,
    /// Share that this leaves.
    pub left: f64,
}

/// What is known of the signal's sensor.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Sensor {
    /// A difference below this share of the signal counts as none.
    pub small: f64,
    /// Step of the sensor, in the signal's unit.
    pub resolution: f64,
    /// Standard deviation of its noise, in the signal's unit.
    pub noise: f64,
    /// Whether each value may be one that was sent at an earlier row, bit for bit: of a node that only scales.
    pub exact: bool,
}

impl Default for Sensor {
    fn default() -> Sensor {
        Sensor { small: SMALL, resolution: 0.0, noise: 0.0, exact: false }
    }
}

/// A difference below this share of the signal seldom makes a loop oscillate.
pub const SMALL: f64 = 0.02;

/// A simple thing explains a difference where it leaves no more of it than this.
const EXPLAINS: f64 = 0.1;

/// An even delay of a way leaves next to nothing.
const EXACT: f64 = 1e-3;

/// Delays that are tried row by row: the best places of a coarse look, and all up to this one.
const PLACES: usize = 6;
const NEAR: usize = 60;

/// Rows that are compared at each delay.
const LOOKED_AT: usize = 20_000;

/// A rail is where a signal stands for this share of its rows.
const RAIL_SHARE: f64 = 0.02;

/// A signal that stands still is dead where it should move by so much of what it moves in all.
const STANDS: f64 = 0.1;

/// Compares.
pub fn compare(recorded: &[f64], predicted: &[f64], sensor: &Sensor, period_s: f64) -> Option<Compared> {
    let rows = recorded.len().min(predicted.len());
    let (recorded, predicted) = (&recorded[..rows], &predicted[..rows]);
    let both: Vec<usize> = (0..rows).filter(|r| recorded[*r].is_finite() && predicted[*r].is_finite()).collect();
    if both.len() < 64 {
        return None;
    }
    let size = spread(both.iter().map(|r| predicted[*r]));
    let moved = spread(both.iter().map(|r| recorded[*r]));
    let error = rms(both.iter().map(|r| recorded[*r] - predicted[*r]));
    let floor = (sensor.resolution * sensor.resolution / 12.0 + sensor.noise * sensor.noise).sqrt();
    let scale = size.max(moved).max(f64::MIN_POSITIVE);
    let share = error / scale;
    let said = |as_if: AsIf, left: f64| Some(Compared { error, share, as_if, left });
    let missing = missing_share(recorded, predicted);
    // What is renewed at a rate of its own is not lost at random.
    if error > 0.0 || missing > 0.0 {
        let found = renewal(recorded, predicted).map(|r| (r, share_left(recorded, &r.of(predicted), scale)));
        if let Some((renewed, left)) = found.filter(|(_, left)| *left <= SMALL.max(EXPLAINS * share).min(0.5 * share.max(missing))) {
            return said(AsIf::Held { rows: renewed.rows, phase: renewed.phase }, left);
        }
    }
    // Values on a sensor's grid come again: an even delay that explains all of them is no jitter.
    if sensor.exact && error > 0.0 && missing < SMALL {
        let (gain, late, left) = changed(recorded, predicted, scale, period_s);
        if late > 0 && gain == 1.0 && left <= EXACT * share {
            return said(AsIf::Changed { gain, late }, left);
        }
    }
    // A loss may be small beside a signal that rests, and is there nevertheless.
    if sensor.exact
        && (error > 0.0 || missing > 0.0)
        && let Some((late, jitter, lost)) = unsteady(recorded, predicted, period_s)
        && (jitter > 0 || lost >= SMALL)
    {
        return said(AsIf::Unsteady { late, jitter, missing: lost }, 0.0);
    }
    if (share <= sensor.small || error <= 3.0 * floor) && missing < SMALL {
        // Steps are small beside the signal, and its differences are not.
        let steps = if error > 3.0 * floor { stepped(recorded, predicted, &both, sensor) } else { None };
        return match steps {
            Some(step) => said(AsIf::Stepped { step }, 0.0),
            None => said(AsIf::Same, share),
        };
    }
    if let Some(from_row) = dead_from(recorded, predicted, (STANDS * size).max(10.0 * floor)) {
        return said(AsIf::Dead { from_row }, 0.0);
    }
    if let Some((low, high, left)) = rails(recorded, predicted, &both, scale, floor) {
        return said(AsIf::Railed { low, high }, left);
    }
    if let Some(step) = stepped(recorded, predicted, &both, sensor) {
        return said(AsIf::Stepped { step }, 0.0);
    }
    let (gain, late, left) = changed(recorded, predicted, scale, period_s);
    let good = (SMALL.max(3.0 * floor / scale)).max(EXPLAINS * share).min(0.5 * share);
    let is_changed = left <= good && (late > 0 || (gain - 1.0).abs() > SMALL);
    // A low-pass is late too: it is told from a delay by what it leaves.
    if (!is_changed || late > 0 && left > 0.1 * good)
        && let Some((found, rest)) = filter(recorded, predicted, scale, period_s)
        && rest <= good
        && (!is_changed || rest < 0.5 * left)
    {
        return said(AsIf::Filtered { order: found.order, corner_hz: found.corner_hz }, rest);
    }
    if is_changed {
        return said(AsIf::Changed { gain, late }, left);
    }
    let differences: Vec<f64> = both.iter().map(|r| recorded[*r] - predicted[*r]).collect();
    if is_white(&differences) {
        return said(AsIf::Noisy { deviation: error }, 0.0);
    }
    said(AsIf::Otherwise, share)
}

/// What is left of the difference to a changed prediction, as a share of the signal's size.
fn share_left(recorded: &[f64], made: &[f64], scale: f64) -> f64 {
    rms(recorded.iter().zip(made).filter(|(r, m)| r.is_finite() && m.is_finite()).map(|(r, m)| r - m)) / scale
}

fn spread(values: impl Iterator<Item = f64> + Clone) -> f64 {
    let (mut sum, mut count) = (0.0, 0.0);
    for x in values.clone() {
        sum += x;
        count += 1.0;
    }
    if count == 0.0 {
        return 0.0;
    }
    let mean = sum / count;
    rms(values.map(|x| x - mean))
}

/// Share of the rows at which an output was due and none came.
fn missing_share(recorded: &[f64], predicted: &[f64]) -> f64 {
    let (mut missing, mut count) = (0.0, 0.0);
    for (r, p) in recorded.iter().zip(predicted) {
        if p.is_finite() {
            count += 1.0;
            missing += f64::from(u8::from(!r.is_finite()));
        }
    }
    if count > 0.0 { missing / count } else { 0.0 }
}

/// The row from which on the recorded signal stands still to its end, for a quarter of the record at least, while the other moves.
fn dead_from(recorded: &[f64], predicted: &[f64], least: f64) -> Option<usize> {
    let last = recorded.iter().rev().find(|x| x.is_finite())?;
    let from = recorded.iter().rposition(|x| x.is_finite() && x != last).map_or(0, |r| r + 1);
    let long = recorded.len() - from >= recorded.len() / 4;
    let moves = spread(predicted[from..].iter().copied().filter(|x| x.is_finite())) > least;
    (long && moves).then_some(from)
}

/// Values at which the recorded signal stands while the predicted one goes beyond.
fn rails(recorded: &[f64], predicted: &[f64], both: &[usize], scale: f64, floor: f64) -> Option<(f64, f64, f64)> {
    let (mut low, mut high) = (f64::INFINITY, f64::NEG_INFINITY);
    for r in both {
        low = low.min(recorded[*r]);
        high = high.max(recorded[*r]);
    }
    let near = (0.002 * (high - low)).max(2.0 * floor);
    let at = |value: f64, beyond: &dyn Fn(f64) -> bool| {
        let standing = both.iter().filter(|r| (recorded[**r] - value).abs() <= near && beyond(predicted[**r])).count();
        standing as f64 >= RAIL_SHARE * both.len() as f64
    };
    let margin = 10.0 * near;
    let is_high = at(high, &|p| p > high + margin);
    let is_low = at(low, &|p| p < low - margin);
    if !(is_high || is_low) {
        return None;
    }
    let (low, high) = (if is_low { low } else { f64::NEG_INFINITY }, if is_high { high } else { f64::INFINITY });
    let left = rms(both.iter().map(|r| recorded[*r] - predicted[*r].clamp(low, high))) / scale;
    let before = rms(both.iter().map(|r| recorded[*r] - predicted[*r])) / scale;
    (left <= SMALL.max(EXPLAINS * before).min(0.5 * before)).then_some((low, high, left))
}

/// Whether the recorded values lie on a grid that is coarser than the sensor's, and the difference is what rounding to it makes.
fn stepped(recorded: &[f64], predicted: &[f64], both: &[usize], sensor: &Sensor) -> Option<f64> {
    let mut values: Vec<f64> = both.iter().map(|r| recorded[*r]).collect();
    values.sort_by(f64::total_cmp);
    let span = values.last()? - values.first()?;
    let tiny = 1e-9 * span.max(f64::MIN_POSITIVE);
    values.dedup_by(|a, b| (*a - *b).abs() <= tiny);
    if values.len() < 3 || values.len() > both.len() / 4 {
        return None;
    }
    let mut gaps: Vec<f64> = values.windows(2).map(|w| w[1] - w[0]).collect();
    gaps.sort_by(f64::total_cmp);
    let step = gaps[gaps.len() / 4];
    let on_grid = values.iter().filter(|x| ((*x / step).round() * step - *x).abs() < 0.02 * step).count();
    let worst = both.iter().map(|r| (recorded[*r] - predicted[*r]).abs());
    let close = worst.filter(|e| *e <= 0.75 * step).count();
    let is_grid = on_grid as f64 > 0.95 * values.len() as f64;
    (is_grid && step > 3.0 * sensor.resolution && close as f64 > 0.9 * both.len() as f64).then_some(step)
}

/// The factor and the delay that bring the predicted signal nearest to the recorded one, and the share that they leave. The simplest that does
/// as well is taken: a delay alone, or a factor alone.
fn changed(recorded: &[f64], predicted: &[f64], scale: f64, period_s: f64) -> (f64, usize, f64) {
    let rows = recorded.len();
    let most = MOST_LATE.min((MOST_LATE_S / period_s) as usize).min(rows / 4);
    let stride = (rows / LOOKED_AT).max(1);
    let fit = |late: usize, stride: usize| {
        let (mut xx, mut xy, mut yy, mut dd, mut count) = (0.0, 0.0, 0.0, 0.0, 0.0);
        for row in (most..rows).step_by(stride) {
            let (x, y) = (predicted[row - late], recorded[row]);
            if x.is_finite() && y.is_finite() {
                xx += x * x;
                xy += x * y;
                yy += y * y;
                dd += (y - x) * (y - x);
                count += 1.0;
            }
        }
        if count == 0.0 || xx == 0.0 {
            return (1.0, f64::INFINITY, f64::INFINITY);
        }
        let gain = xy / xx;
        let left = ((yy - gain * xy).max(0.0) / count).sqrt() / scale;
        (gain, left, (dd / count).sqrt() / scale)
    };
    let coarse = (most / 400).max(1);
    // What repeats itself fits nearly as well a period later: the best of several places is looked for, and near 0 at every row.
    let nearest = |value: &dyn Fn(usize) -> f64| {
        let mut places: Vec<(f64, usize)> = (0..=most).step_by(coarse).map(|late| (value(late), late)).collect();
        places.sort_by(|a, b| a.0.total_cmp(&b.0));
        let about = places.iter().take(PLACES).flat_map(|(_, at)| at.saturating_sub(coarse)..=(at + coarse).min(most));
        let all = about.chain(0..=NEAR.min(most));
        all.map(|late| (value(late), late)).min_by(|a, b| a.0.total_cmp(&b.0)).map_or(0, |(_, late)| late)
    };
    let alone = fit(0, 1);
    let late = nearest(&|l| fit(l, stride).2);
    let late_alone = fit(late, 1);
    let both_late = nearest(&|l| fit(l, stride).1);
    let both = fit(both_late, 1);
    let least = both.1.min(late_alone.2).min(alone.1);
    let enough = |left: f64| left <= (1.3 * least).max(0.5 * SMALL);
    if enough(late_alone.2) {
        (1.0, late, late_alone.2)
    } else if enough(alone.1) {
        (alone.0, 0, alone.1)
    } else {
        (both.0, both_late, both.1)
    }
}

/// Whether a sequence has no memory.
fn is_white(values: &[f64]) -> bool {
    let power: f64 = values.iter().map(|x| x * x).sum();
    let next: f64 = values.windows(2).map(|w| w[0] * w[1]).sum();
    power > 0.0 && (next / power).abs() < 0.2
}

#[cfg(test)]
mod tests {
    use super::super::ways::in_time;
    use super::*;

    const PERIOD_S: f64 = 2e-4;

    fn signal() -> Vec<f64> {
        (0..10_000)
            .map(|i| {
                let t = f64::from(i) * PERIOD_S;
                1e-3 * ((9.0 * t).sin() + 0.4 * (71.0 * t + t * t).sin() + 0.2 * (193.0 * t).sin())
            })
            .collect()
    }

    fn told(recorded: &[f64], exact: bool) -> AsIf {
        compare(recorded, &signal(), &Sensor { exact, ..Sensor::default() }, PERIOD_S).unwrap().as_if
    }

    #[test]
    fn a_factor_a_sign_and_a_delay_are_told_apart() {
        let x = signal();
        assert_eq!(told(&x, false), AsIf::Same);
        let AsIf::Changed { gain, late: 0 } = told(&x.iter().map(|x| -1.0 * x).collect::<Vec<_>>(), false) else { panic!() };
        assert!((gain + 1.0).abs() < 1e-9);
        let AsIf::Changed { gain, late: 0 } = told(&x.iter().map(|x| 1.4 * x).collect::<Vec<_>>(), false) else { panic!() };
        assert!((gain - 1.4).abs() < 1e-9);
        let delayed = |rows: usize| (0..x.len()).map(|i| if i < rows { x[0] } else { x[i - rows] }).collect::<Vec<_>>();
        assert_eq!(told(&delayed(60), false), AsIf::Changed { gain: 1.0, late: 60 });
        // A vibration that goes on fits nearly as well a period later.
        let shaking: Vec<f64> = (0..10_000).map(|i| (0.1 * f64::from(i)).sin() * (1.0 + 0.05 * (0.003 * f64::from(i)).sin())).collect();
        let late: Vec<f64> = (0..shaking.len()).map(|i| shaking[i.saturating_sub(8)]).collect();
        let found = compare(&late, &shaking, &Sensor::default(), PERIOD_S).unwrap();
        assert_eq!(found.as_if, AsIf::Changed { gain: 1.0, late: 8 });
        let both: Vec<f64> = delayed(33).iter().map(|x| 2.0 * x).collect();
        let AsIf::Changed { gain, late: 33 } = told(&both, false) else { panic!() };
        assert!((gain - 2.0).abs() < 1e-9);
    }

    #[test]
    fn what_a_sensor_does_is_named() {
        let x = signal();
        let step = 2e-4;
        let AsIf::Stepped { step: found } = told(&x.iter().map(|x| (x / step).round() * step).collect::<Vec<_>>(), false) else { panic!() };
        assert!((found / step - 1.0).abs() < 1e-6);
        let AsIf::Railed { low, high } = told(&x.iter().map(|x| x.min(5e-4)).collect::<Vec<_>>(), false) else { panic!() };
        assert_eq!((low, high), (f64::NEG_INFINITY, 5e-4));
        let dead: Vec<f64> = x.iter().enumerate().map(|(i, x)| if i < 4000 { *x } else { 1e-4 }).collect();
        assert_eq!(told(&dead, false), AsIf::Dead { from_row: 4000 });
        let mut seed = 1_u64;
        let mut noise = || {
            seed = seed.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1);
            (seed >> 33) as f64 / f64::from(1_u32 << 31) - 0.5
        };
        let AsIf::Noisy { deviation } = told(&x.iter().map(|x| x + 4e-4 * noise()).collect::<Vec<_>>(), false) else { panic!() };
        assert!((deviation / (4e-4 / 12.0_f64.sqrt()) - 1.0).abs() < 0.05);
    }

    #[test]
    fn an_unsteady_way_is_told_from_the_values_themselves() {
        let x = signal();
        let mut newest = 0_usize;
        let passed: Vec<f64> = (0..x.len())
            .map(|i| {
                let late = 20 + (i * 7919) % 11;
                let from = i.saturating_sub(late);
                if i < 40 || from <= newest {
                    return f64::NAN;
                }
                newest = from;
                x[from]
            })
            .collect();
        let AsIf::Unsteady { late, jitter, missing } = told(&passed, true) else { panic!("{:?}", told(&passed, true)) };
        assert!((19..=21).contains(&late) && (5..=20).contains(&jitter), "{late} {jitter} {missing}");
    }

    #[test]
    fn samples_that_are_lost_are_counted_where_the_last_is_held_and_told_from_those_that_are_overtaken() {
        let x = signal();
        let mut seed = 3_u64;
        let mut unit = || {
            seed = seed.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
            (seed >> 33) as f64 / f64::from(1_u32 << 31)
        };
        for (jitter, loss, nothing_said) in [(0, 0.9, false), (0, 0.3, true), (12, 0.0, true), (12, 0.4, false)] {
            let mut arrives: Vec<Option<usize>> = vec![None; x.len() + jitter + 1];
            for sent in 0..x.len() {
                let at = sent + (unit() * (jitter + 1) as f64) as usize;
                if unit() >= loss {
                    arrives[at] = arrives[at].max(Some(sent));
                }
            }
            let mut newest = 0;
            let passed: Vec<f64> = (0..x.len())
                .map(|row| match arrives[row].filter(|sent| *sent > newest) {
                    Some(sent) => {
                        newest = sent;
                        x[sent]
                    }
                    None if nothing_said => f64::NAN,
                    None => x[newest],
                })
                .collect();
            let AsIf::Unsteady { late, jitter: found, missing } = told(&passed, true) else { panic!("{jitter} {loss}") };
            // More jitter and less loss look the same: what counts is how many come, and how late.
            let ((comes, mean), (true_comes, true_mean)) = (in_time(found, missing), in_time(jitter, loss));
            assert!(late <= 1 && (comes - true_comes).abs() < 0.03 && (mean - true_mean).abs() < 0.4, "{jitter} {loss}: {found} {missing}");
            assert!(jitter > 0 || (found == 0 && (missing - loss).abs() < 0.03), "{jitter} {loss}: {found} {missing}");
        }
    }

    #[test]
    fn what_is_none_of_these_is_not_named() {
        let x = signal();
        let bent: Vec<f64> = x.iter().map(|x| x + 3e-4 * (x / 3e-4).tanh()).collect();
        let other: Vec<f64> = x.iter().enumerate().map(|(i, x)| x + 5e-4 * (i as f64 * PERIOD_S * 31.0).sin()).collect();
        assert_eq!(told(&other, false), AsIf::Otherwise);
        assert!(!matches!(told(&bent, false), AsIf::Stepped { .. } | AsIf::Dead { .. } | AsIf::Noisy { .. }));
    }
}
