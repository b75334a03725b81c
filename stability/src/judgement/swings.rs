//! The swings of a signal: from turn to turn, whatever its frequency is.

/// An oscillation that becomes larger by this factor grows.
pub(super) const GROWS: f64 = 1.5;
/// One that becomes smaller by this factor dies.
pub(super) const DIES: f64 = 0.7;
/// Growth or decay of an envelope that is slower than this is none, 1/s.
pub(super) const STEADY_PER_S: f64 = 0.2;
/// Fewer swings than this are a motion, not an oscillation: two periods.
pub(super) const OSCILLATES: usize = 4;
/// Of the amplitudes of a narrow band of noise the coefficient of variation is 0.52 (Rayleigh), of an oscillation's 0.
const REGULAR: f64 = 0.35;

/// A master that moves less than this while the hand holds still is at rest, m or rad.
pub(super) const WANDER: f64 = 20e-6;

/// The way from one turn to the next.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Swing {
    /// Row of its end.
    at: usize,
    /// Its size, in the signal's unit.
    size: f64,
}

/// The swings of a signal that are larger than a floor.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Swings {
    all: Vec<Swing>,
    turns: usize,
    period_s: f64,
}

/// What becomes of an oscillation.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) enum Course {
    Dies,
    GoesOn,
    /// By so much, 1/s.
    Grows(f64),
}

impl Swings {
    /// Of a signal that turns back by more than `least`.
    pub(super) fn of(signal: &[f64], least: f64, period_s: f64) -> Swings {
        let Some(first) = signal.first() else { return Swings { all: Vec::new(), turns: 0, period_s } };
        let (mut low, mut high) = ((0, *first), (0, *first));
        let (mut rising, mut turns) = (None, Vec::new());
        for (row, x) in signal.iter().enumerate() {
            if *x < low.1 {
                low = (row, *x);
            }
            if *x > high.1 {
                high = (row, *x);
            }
            match rising {
                None if high.1 - low.1 > least => rising = Some(high.0 > low.0),
                Some(true) if high.1 - x > least => {
                    turns.push(high);
                    (rising, low) = (Some(false), (row, *x));
                }
                Some(false) if x - low.1 > least => {
                    turns.push(low);
                    (rising, high) = (Some(true), (row, *x));
                }
                _ => {}
            }
        }
        let swing = |pair: &[(usize, f64)]| match pair {
            [(_, from), (at, to)] => Some(Swing { at: *at, size: (to - from).abs() }),
            _ => None,
        };
        Swings { all: turns.windows(2).filter_map(swing).collect(), turns: turns.len(), period_s }
    }

    /// How often it turns back.
    pub(super) fn turns(&self) -> usize {
        self.turns
    }

    /// Whether it turns back often enough to be an oscillation.
    pub(super) fn oscillates(&self) -> bool {
        self.all.len() >= OSCILLATES
    }

    /// Hz; 0 of less than two swings.
    pub(super) fn frequency_hz(&self) -> f64 {
        match self.all.as_slice() {
            [first, .., last] if last.at > first.at => (self.all.len() - 1) as f64 / (2.0 * (last.at - first.at) as f64 * self.period_s),
            _ => 0.0,
        }
    }

    /// The row at which the last one ends.
    pub(super) fn last_row(&self) -> usize {
        self.all.last().map_or(0, |s| s.at)
    }

    /// What becomes of it. A large beginning that falls to a level at which it stays does not die: the later half alone has to.
    pub(super) fn course(&self) -> Course {
        let half = self.all.get(self.all.len() / 2..).filter(|half| half.len() >= OSCILLATES);
        let (piece, share) = half.map_or((self.all.as_slice(), 1.0), |half| (half, 0.5));
        let (Some(first), Some(last)) = (piece.first(), piece.last()) else { return Course::Dies };
        let per_s = self.slope(piece);
        let factor = (per_s * (last.at - first.at) as f64 * self.period_s).exp();
        if per_s < -STEADY_PER_S && factor < DIES.powf(share) {
            Course::Dies
        } else if per_s > STEADY_PER_S && factor > GROWS.powf(share) {
            Course::Grows(per_s)
        } else {
            Course::GoesOn
        }
    }

    /// Slope of the logarithm of the sizes by time, 1/s, by least squares.
    fn slope(&self, piece: &[Swing]) -> f64 {
        let n = piece.len() as f64;
        let points = || piece.iter().map(|s| (s.at as f64 * self.period_s, s.size.ln()));
        let (mt, my) = points().fold((0.0, 0.0), |(a, b), (t, y)| (a + t / n, b + y / n));
        let (up, down) = points().fold((0.0, 0.0), |(a, b), (t, y)| (a + (t - mt) * (y - my), b + (t - mt).powi(2)));
        if down > 0.0 { up / down } else { 0.0 }
    }

    /// Whether sizes and periods of the later half vary by little, which those of noise do not.
    pub(super) fn regular(&self) -> bool {
        let late = self.all.get(self.all.len() / 2..).unwrap_or_default();
        let sizes: Vec<f64> = late.iter().map(|s| s.size).collect();
        let periods: Vec<f64> = late.windows(3).filter_map(|w| Some((w.get(2)?.at - w.first()?.at) as f64)).collect();
        late.len() >= OSCILLATES && variation(&sizes) < REGULAR && variation(&periods) < REGULAR
    }
}

/// Coefficient of variation.
fn variation(values: &[f64]) -> f64 {
    let n = values.len().max(1) as f64;
    let mean = values.iter().sum::<f64>() / n;
    (values.iter().map(|x| (x - mean).powi(2)).sum::<f64>() / n).sqrt() / mean
}

#[cfg(test)]
mod tests {
    use super::*;

    fn swings(of: impl Fn(f64) -> f64, rows: u32, period_s: f64) -> Swings {
        Swings::of(&(0..rows).map(|i| of(f64::from(i) * period_s)).collect::<Vec<_>>(), 0.05, period_s)
    }

    #[test]
    fn a_few_periods_at_a_few_samples_each_are_enough() {
        let found = swings(|t| (std::f64::consts::TAU * 5.9 * t).sin(), 30, 1.0 / 15.0);
        assert!(found.oscillates() && found.course() == Course::GoesOn, "{found:?}");
        assert!((found.frequency_hz() - 5.9).abs() < 0.3, "{}", found.frequency_hz());
        let wave = |t: f64| (std::f64::consts::TAU * 2.0 * t).sin();
        assert_eq!(swings(|t| (-t).exp() * wave(t), 100, 0.02).course(), Course::Dies);
        let Course::Grows(per_s) = swings(|t| 0.2 * (0.8 * t).exp() * wave(t), 100, 0.02).course() else { panic!() };
        assert!((per_s - 0.8).abs() < 0.1, "{per_s}");
        assert!(!swings(|t| t, 100, 0.02).oscillates());
        assert!(!swings(|_| 0.0, 0, 0.02).oscillates());
    }

    #[test]
    fn what_falls_to_a_level_and_stays_there_goes_on() {
        let found = swings(|t| (0.2 + (-8.0 * t).exp()) * (std::f64::consts::TAU * 10.0 * t).sin(), 1000, 2e-3);
        assert_eq!(found.course(), Course::GoesOn);
        assert!(found.regular());
    }
}
