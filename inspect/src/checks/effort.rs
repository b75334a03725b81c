//! A torque or a current beside the motion that it makes: its lag and its sign.
//!
//! The torque is regressed on what any joint asks for: inertia, viscous and dry friction, weight and a spring. The lag is where that explains most.

use super::motion::{excitation, of};
use crate::advice;
use crate::finding::{Finding, FindingKind};
use crate::joints::Joint;
use crate::numeric::{deviation, extremes};
use crate::recording::Recording;
use backdrive_diagnosis::recordings::follow::student;
use backdrive_diagnosis::recordings::kinematics::Band;
use backdrive_signal::derivative;
use nalgebra::{SMatrix, SVector};

/// Terms of the regression: acceleration, velocity, direction, position, its sine and cosine, a constant.
const TERMS: usize = 7;
/// Lags that are tried, s.
const EARLY_S: f64 = 0.08;
const LATE_S: f64 = 0.2;
/// Corner of the filter, Hz: dry friction changes sign within a few samples, and that shows a lag.
const CORNER_HZ: f64 = 15.0;
/// Blocks of the jackknife.
const BLOCKS: usize = 8;
/// Share of the torque that motion explains, from which on a lag is claimed; and by which factor the rest grows without the lag.
const EXPLAINED: f64 = 0.7;
const WORSE: f64 = 1.35;
/// Half of the interval is at most this share of the lag: hysteresis and play look like a lag that differs from stroke to stroke.
const KNOWN: f64 = 0.3;
/// A lag of a drive's electronics is some ms; from here on it turns friction into damping and inertia.
const LAG_S: f64 = 0.010;
/// Share from which on a sign is claimed.
const SIGN: f64 = 0.7;
/// Velocity at which dry friction is drawn to turn, as a share of the largest.
const TURNS: f64 = 0.05;

/// Finds what is wrong.
pub fn check(recording: &Recording, joints: &[Joint], out: &mut Vec<Finding>) {
    for joint in joints {
        for place in joint.drives() {
            one(recording, joint, place, out);
        }
    }
}

fn one(recording: &Recording, joint: &Joint, place: usize, out: &mut Vec<Finding>) {
    let Some(work) = Regression::new(recording, joint, place) else { return };
    let Some(best) = work.best(None) else { return };
    let (drive, position) = (&recording.signals[place], joint.position.map_or("", |place| recording.signals[place].name.as_str()));
    let names = [drive.name.as_str(), position];
    let new = |kind: FindingKind, message: String| Finding::new(kind, &recording.file, &names, message).at(&joint.name);
    let signed = extremes(&drive.values).is_some_and(|(low, high)| low < 0.0 && high > 0.0);
    if best.explained > SIGN && signed && work.is_against(best.lag) {
        let message = format!(
            "{:?} is opposite to both the acceleration and the velocity of {position:?}: it has the wrong sign, or is the torque of the \
                load",
            names[0]
        );
        out.push(new(FindingKind::WrongSign, message).todo(advice::entry(recording, joint, place, "scale = -1")).sure(0.9));
    }
    let Some(wide) = work.uncertainty() else { return };
    let (lag, wide) = (best.lag * work.period, wide * work.period);
    let rest = |share: f64| (1.0 - share).max(1e-9);
    let needed = rest(best.at_once) > WORSE * rest(best.explained);
    if best.explained > EXPLAINED
        && needed
        && lag > LAG_S.max(0.8 * recording.period)
        && wide < KNOWN * lag
        && !work.is_at_the_end(best.lag)
    {
        let message = format!(
            "{:?} lags the motion of {position:?} by {:.0} ms (95 % interval ±{:.0} ms): a filter, or an older sample",
            names[0],
            1e3 * lag,
            1e3 * wide
        );
        let todo = format!(
            "shift its column by {:.0} samples before the import (times of this column minus {:.4} s)",
            -lag / recording.period,
            lag
        );
        out.push(new(FindingKind::EffortLag, message).todo(todo).sure(0.95));
    }
}

/// Share of a torque that the motion of its joint explains, at the best lag; `None` where it is not known.
pub fn explained(recording: &Recording, joint: &Joint, place: usize) -> Option<f64> {
    Regression::new(recording, joint, place)?.best(None).map(|best| best.explained)
}

struct Best {
    lag: f64,
    explained: f64,
    at_once: f64,
}

/// Sums of a block: the terms with each other, the torque with itself, and with each term at each lag.
struct Block {
    xx: SMatrix<f64, TERMS, TERMS>,
    xy: Vec<SVector<f64, TERMS>>,
    y: f64,
    yy: f64,
    count: f64,
}

struct Regression {
    blocks: Vec<Block>,
    first: i64,
    period: f64,
}

impl Regression {
    fn new(recording: &Recording, joint: &Joint, place: usize) -> Option<Regression> {
        let band = Band::up_to(CORNER_HZ, recording.period, recording.rate());
        let position = of(recording, joint.position).filter(|signal| excitation(signal) > 30.0)?;
        let drive = of(recording, Some(place))?;
        let (q, y) = (band.smooth(&position.even), band.smooth(&drive.even));
        let v = band.rate(&position.even);
        let a = derivative(&v, band.period);
        let (fast, quick, far) = (deviation(&v), deviation(&a), deviation(&q));
        if !(fast > 0.0 && quick > 0.0 && far > 0.0) {
            return None;
        }
        let turns = TURNS * v.iter().fold(0.0f64, |m, v| m.max(v.abs()));
        let middle = crate::numeric::mean(&q);
        let term = |i: usize| {
            SVector::<f64, TERMS>::from([
                a[i] / quick,
                v[i] / fast,
                (v[i] / turns).tanh(),
                (q[i] - middle) / far,
                q[i].sin(),
                q[i].cos(),
                1.0,
            ])
        };
        let (first, last) = (-band.samples(EARLY_S), band.samples(LATE_S));
        // A torque that is late by `lag` belongs to the motion before: y(i + lag) to the terms at i.
        let (from, to) = ((-first) as usize, q.len().min(y.len()).checked_sub(last as usize + 1)?);
        let size = to.checked_sub(from)? / BLOCKS;
        if size < 4 * TERMS {
            return None;
        }
        let mut blocks = Vec::new();
        for block in 0..BLOCKS {
            let rows = from + block * size..from + (block + 1) * size;
            let (mut xx, mut sum, mut yy) = (SMatrix::zeros(), 0.0, 0.0);
            let mut xy = vec![SVector::zeros(); (last - first + 1) as usize];
            for i in rows.clone() {
                let x = term(i);
                xx += x * x.transpose();
                sum += y[i];
                yy += y[i] * y[i];
                for (lag, xy) in (first..=last).zip(&mut xy) {
                    *xy += x * y[(i as i64 + lag) as usize];
                }
            }
            blocks.push(Block { xx, xy, y: sum, yy, count: size as f64 });
        }
        Some(Regression { blocks, first, period: band.period })
    }

    fn sums(&self, skip: Option<usize>) -> (SMatrix<f64, TERMS, TERMS>, f64, impl Fn(usize) -> SVector<f64, TERMS> + '_) {
        let used = move || self.blocks.iter().enumerate().filter(move |(place, _)| Some(*place) != skip).map(|(_, block)| block);
        let xx: SMatrix<f64, TERMS, TERMS> = used().map(|block| block.xx).sum();
        let (y, yy, count) = used().fold((0.0, 0.0, 0.0), |(a, b, c), block| (a + block.y, b + block.yy, c + block.count));
        (xx, yy - y * y / count.max(1.0), move |lag| used().map(|block| block.xy[lag]).sum())
    }

    fn best(&self, skip: Option<usize>) -> Option<Best> {
        let (xx, variance, xy) = self.sums(skip);
        let ridge = 1e-9 * xx.trace() / TERMS as f64;
        let solver = (xx + SMatrix::identity() * ridge).cholesky()?;
        if variance <= 0.0 {
            return None;
        }
        // What the constant alone explains is taken off: the share is that of the variance.
        let ones = xx[(TERMS - 1, TERMS - 1)].max(1.0);
        let share = |lag: usize| {
            let xy = xy(lag);
            (xy.dot(&solver.solve(&xy)) - xy[TERMS - 1].powi(2) / ones) / variance
        };
        let count = self.blocks.first()?.xy.len();
        let shares: Vec<f64> = (0..count).map(share).collect();
        let best = (0..count).max_by(|a, b| shares[*a].total_cmp(&shares[*b]))?;
        let mut lag = best as f64;
        if best > 0 && best + 1 < count {
            let (a, b, c) = (shares[best - 1], shares[best], shares[best + 1]);
            let bend = a - 2.0 * b + c;
            if bend < 0.0 {
                lag += (0.5 * (a - c) / bend).clamp(-0.5, 0.5);
            }
        }
        let at_once = shares.get((-self.first) as usize).copied().unwrap_or(0.0);
        Some(Best { lag: lag + self.first as f64, explained: shares[best].clamp(0.0, 1.0), at_once })
    }

    fn is_at_the_end(&self, lag: f64) -> bool {
        let last = self.first + self.blocks.first().map_or(0, |block| block.xy.len() as i64) - 1;
        lag <= self.first as f64 || lag >= last as f64
    }

    fn uncertainty(&self) -> Option<f64> {
        let lags: Vec<f64> = (0..self.blocks.len()).filter_map(|skip| self.best(Some(skip))).map(|best| best.lag).collect();
        let count = lags.len() as f64;
        if count < 3.0 {
            return None;
        }
        let middle = crate::numeric::mean(&lags);
        let variance = (count - 1.0) / count * lags.iter().map(|lag| (lag - middle).powi(2)).sum::<f64>();
        Some(variance.sqrt() * student(count - 1.0))
    }

    /// Whether the torque at this lag goes against acceleration and against friction, each far beyond what chance makes of independent blocks.
    fn is_against(&self, lag: f64) -> bool {
        let lag = (lag.round() as i64 - self.first).max(0) as usize;
        let solved: Vec<SVector<f64, TERMS>> = (0..self.blocks.len())
            .filter_map(|skip| {
                let (xx, _, xy) = self.sums(Some(skip));
                let ridge = 1e-9 * xx.trace() / TERMS as f64;
                Some((xx + SMatrix::identity() * ridge).cholesky()?.solve(&xy(lag)))
            })
            .collect();
        let below = |of: &dyn Fn(&SVector<f64, TERMS>) -> f64| {
            let values: Vec<f64> = solved.iter().map(of).collect();
            let count = values.len() as f64;
            let middle = crate::numeric::mean(&values);
            let error = ((count - 1.0) / count * values.iter().map(|x| (x - middle).powi(2)).sum::<f64>()).sqrt();
            count > 2.0 && middle + student(count - 1.0) * error < 0.0
        };
        below(&|x| x[0]) && below(&|x| x[1] + x[2])
    }
}
