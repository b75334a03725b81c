//! Signals that say nothing: dead, at their rail, clipped, or not moving with the sensor that measures the same.
//!
//! Nothing here knows a model, so it serves for any recording, and for columns that were not requested. Its criteria:
//!
//! | fault | rule | reason |
//! |---|---|---|
//! | constant | every sample is the same | whatever it measures, its noise would show |
//! | within its resolution | three values at most, all within a thousandth of the largest | a converter flickers by one step to either side of a value that does not move; a signal that switches has values far apart |
//! | clipped | it stops dead at one and the same extreme value, three times at least, for a hundredth of the time | a signal that reverses slows down first, and takes an extreme value once. A signal that a converter clips arrives at full speed and stays |
//! | does not follow | it explains less than a tenth of what the other sensor of the same quantity moves | two sensors of one quantity are in proportion |

use crate::grid::step_of;
use backdrive_signal::statistics::rms;
use serde::Serialize;

/// A column of a recording.
#[derive(Debug, Clone)]
pub struct Column<'a> {
    /// What it is called.
    pub name: String,
    /// Its samples, in any unit; NaN where there is none.
    pub values: &'a [f64],
    /// Whether it is a position: then it may come to rest at a stop, and its extremes are not judged.
    pub position: bool,
    /// The signal that it measures too, sample by sample; `None` where there is none or none is stated.
    pub twin: Option<Twin<'a>>,
}

/// The other sensor of the same quantity.
#[derive(Debug, Clone, Copy)]
pub struct Twin<'a> {
    /// What it is called.
    pub name: &'a str,
    /// Its samples.
    pub values: &'a [f64],
}

/// What is wrong with a signal.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct SensorFault {
    /// What the signal is called.
    pub signal: String,
    /// What is wrong.
    #[serde(flatten)]
    pub fault: Fault,
}

/// Faults of a signal that is without information always or at times.
#[derive(Debug, Clone, PartialEq, Serialize)]
#[serde(tag = "fault", rename_all = "snake_case")]
pub enum Fault {
    /// Every sample is the same.
    Constant {
        /// In the signal's unit.
        value: f64,
    },
    /// It flickers about one value by a step of its converter and never leaves it.
    WithinResolution {
        /// Mean, in the signal's unit.
        value: f64,
        /// From the smallest to the largest sample, in the signal's unit.
        range: f64,
    },
    /// It stops dead at one extreme value again and again.
    Clipped {
        /// In the signal's unit.
        at: f64,
        /// Share of the samples that are there, 0 to 1.
        share: f64,
    },
    /// It does not move with the other sensor of the same quantity.
    DoesNotFollow {
        /// The other sensor.
        twin: String,
        /// Share of the other's variance that it explains, 0 to 1.
        explains: f64,
    },
}

impl SensorFault {
    /// Whether the signal has no information at all.
    pub fn is_dead(&self) -> bool {
        !matches!(self.fault, Fault::Clipped { .. } | Fault::DoesNotFollow { .. })
    }
}

impl std::fmt::Display for SensorFault {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let signal = &self.signal;
        match &self.fault {
            Fault::Constant { value } => {
                write!(f, "{signal} is dead: it is constant at {value} (saturation, cable, or an unused channel)")
            }
            Fault::WithinResolution { value, range } => {
                write!(f, "{signal} is dead: it stays at {value:.6} within {range:.2e}, the resolution of its converter")
            }
            Fault::Clipped { at, share } => {
                write!(f, "{signal} is clipped: {:.1} % of its samples are at {at:.6}, where it stops abruptly each time", 100.0 * share)
            }
            Fault::DoesNotFollow { twin, explains } => {
                write!(f, "{signal} does not follow {twin}, which measures the same quantity: it explains {:.1} % of it", 100.0 * explains)
            }
        }
    }
}

/// A converter that flickers takes at most this number of values.
const FLICKER_VALUES: usize = 3;
/// And these lie within this share of the largest.
const FLICKER_SHARE: f64 = 1e-3;
/// A clipped signal stands at its extreme for at least this share of the samples.
const LEAST_CLIPPED: f64 = 0.01;
/// And comes there at least so often.
const LEAST_ARRIVALS: usize = 3;
/// And stays for at least this number of samples each time.
const LEAST_STAY: usize = 3;
/// Two sensors of the same quantity share at least so much of their variance.
const LEAST_EXPLAINED: f64 = 0.1;
/// Von Neumann's ratio (half the mean squared difference of neighbours over the variance) below which a signal moves; 1 of white noise.
const MOVES: f64 = 0.1;

/// What is wrong with each column; those with which nothing is are left out.
pub fn faults(columns: &[Column]) -> Vec<SensorFault> {
    let found = columns.iter().filter_map(|column| Some(SensorFault { signal: column.name.clone(), fault: fault(column)? }));
    found.collect()
}

fn fault(column: &Column) -> Option<Fault> {
    let values: Vec<f64> = column.values.iter().copied().filter(|x| x.is_finite()).collect();
    let first = *values.first()?;
    let (low, high) = values.iter().fold((first, first), |(l, h), x| (l.min(*x), h.max(*x)));
    if high <= low {
        return (values.len() > 1).then_some(Fault::Constant { value: first });
    }
    if high - low <= FLICKER_SHARE * high.abs().max(low.abs()) && distinct(&values) <= FLICKER_VALUES {
        let value = values.iter().sum::<f64>() / values.len() as f64;
        return Some(Fault::WithinResolution { value, range: high - low });
    }
    let clipped = [low, high].into_iter().filter(|at| *at != 0.0 && !column.position).filter_map(|at| clipped(&values, at));
    // The rail at which it is more of the time.
    let worst = clipped.max_by(|a, b| a.1.total_cmp(&b.1)).map(|(at, share)| Fault::Clipped { at, share });
    worst.or_else(|| apart(column))
}

/// How many different values there are, up to one more than matter.
fn distinct(values: &[f64]) -> usize {
    let mut seen: Vec<f64> = Vec::new();
    for value in values {
        if !seen.contains(value) {
            seen.push(*value);
        }
        if seen.len() > FLICKER_VALUES {
            break;
        }
    }
    seen.len()
}

/// Where a signal is clipped at an extreme value: that value, and the share of the samples that are there.
fn clipped(values: &[f64], at: f64) -> Option<(f64, f64)> {
    let step = step_of(values);
    let there = |x: f64| (x - at).abs() <= 1.01 * step;
    let share = values.iter().filter(|x| there(**x)).count() as f64 / values.len() as f64;
    if share < LEAST_CLIPPED {
        return None;
    }
    // As fast as in other places, and by more than the rounding of a slow signal.
    let moves: Vec<f64> = values.windows(2).filter_map(|w| Some((w.first()? - w.get(1)?).abs())).filter(|d| *d > 1.01 * step).collect();
    let typical = rms(&moves);
    let (mut arrivals, mut row) = (0, 0);
    while let Some(rest) = values.get(row..) {
        let Some(next) = rest.iter().position(|x| there(*x)) else { break };
        let stay = rest.get(next..).unwrap_or_default().iter().take_while(|x| there(**x)).count();
        let before = (row + next).checked_sub(1).and_then(|i| values.get(i));
        let abrupt = before.is_some_and(|x| (x - at).abs() > 2.0 * step && (x - at).abs() >= 0.5 * typical);
        arrivals += usize::from(abrupt && stay >= LEAST_STAY);
        row += next + stay;
    }
    (arrivals >= LEAST_ARRIVALS).then_some((at, share))
}

/// A sensor that does not move with its twin, while that one moves.
fn apart(column: &Column) -> Option<Fault> {
    let twin = column.twin?;
    let pairs: Vec<(f64, f64)> =
        column.values.iter().copied().zip(twin.values.iter().copied()).filter(|(a, b)| a.is_finite() && b.is_finite()).collect();
    if pairs.len() < 100 {
        return None;
    }
    let n = pairs.len() as f64;
    let (ma, mb) = (pairs.iter().map(|p| p.0).sum::<f64>() / n, pairs.iter().map(|p| p.1).sum::<f64>() / n);
    let sum = |f: &dyn Fn(f64, f64) -> f64| pairs.iter().map(|(a, b)| f(a - ma, b - mb)).sum::<f64>();
    let (aa, bb, ab) = (sum(&|a, _| a * a), sum(&|_, b| b * b), sum(&|a, b| a * b));
    let jumps: f64 = pairs.windows(2).filter_map(|w| Some((w.get(1)?.1 - w.first()?.1).powi(2))).sum();
    if bb <= 0.0 || 0.5 * jumps / bb > MOVES {
        return None;
    }
    let explains = if aa > 0.0 { ab * ab / (aa * bb) } else { 0.0 };
    (explains < LEAST_EXPLAINED).then(|| Fault::DoesNotFollow { twin: twin.name.to_owned(), explains })
}

#[cfg(test)]
mod tests {
    use super::*;
    use rand::SeedableRng;
    use rand_distr::{Distribution, StandardNormal};

    fn noise(seed: u64) -> Vec<f64> {
        let mut random = rand_chacha::ChaCha8Rng::seed_from_u64(seed);
        (0..4000).map(|_| StandardNormal.sample(&mut random)).collect()
    }

    fn sine(rate: f64) -> Vec<f64> {
        (0..4000).map(|i| 10.0 * (f64::from(i) * rate).sin()).collect()
    }

    fn of(values: &[f64]) -> Option<Fault> {
        fault(&Column { name: "s".into(), values, position: false, twin: None })
    }

    #[test]
    fn a_dead_gauge_is_told_with_and_without_flicker() {
        assert_eq!(of(&[9.999847; 500]), Some(Fault::Constant { value: 9.999847 }));
        let flicker: Vec<f64> = noise(1).iter().map(|e| if *e > 2.0 { 9.999542 } else { 9.999847 }).collect();
        assert!(matches!(of(&flicker), Some(Fault::WithinResolution { .. })));
        // A switch is no flicker.
        let switch: Vec<f64> = noise(1).iter().map(|e| f64::from(u8::from(*e > 0.0))).collect();
        assert_eq!(of(&switch), None);
    }

    #[test]
    fn a_rail_is_told_from_peaks_a_square_and_a_rest() {
        let step = |x: f64| (x / 0.005).round() * 0.005;
        let clipped: Vec<f64> = sine(0.013).iter().zip(noise(2)).map(|(x, e)| step((x + 0.01 * e).min(8.0))).collect();
        let Some(Fault::Clipped { at, share }) = of(&clipped) else { panic!("{:?}", of(&clipped)) };
        assert!((at - 8.0).abs() < 1e-9 && (0.15..0.25).contains(&share), "{at} {share}");
        // A rail with a flicker of one step, left for a moment now and then.
        let railed: Vec<f64> =
            (0..4000).zip(noise(3)).map(|(i, e)| if i % 800 < 40 { 6.0 } else { 10.0 - if e > 1.5 { 0.005 } else { 0.0 } }).collect();
        assert!(matches!(of(&railed), Some(Fault::Clipped { share, .. }) if share > 0.9), "{:?}", of(&railed));
        let rounded: Vec<f64> = sine(0.013).iter().map(|x| step(*x)).collect();
        assert_eq!(of(&rounded), None);
        // A force that is exactly nothing in free motion is no rail at 0.
        let contact: Vec<f64> = sine(0.013).iter().map(|x| x.min(0.0)).collect();
        assert_eq!(of(&contact), None);
        // A lever that strikes a stop and stays there.
        let stop = Column { name: "x".into(), values: &clipped, position: true, twin: None };
        assert_eq!(fault(&stop), None);
    }

    #[test]
    fn a_second_gauge_follows_or_does_not() {
        let force = sine(0.013);
        let (good, bad): (Vec<f64>, Vec<f64>) = (force.iter().zip(noise(4)).map(|(f, e)| 5.0 - 0.1 * f + 0.3 * e).collect(), noise(5));
        let check =
            |values: &[f64]| fault(&Column { name: "b".into(), values, position: false, twin: Some(Twin { name: "F_h", values: &force }) });
        assert_eq!(check(&good), None);
        assert!(matches!(check(&bad), Some(Fault::DoesNotFollow { explains, .. }) if explains < 0.05));
    }
}
