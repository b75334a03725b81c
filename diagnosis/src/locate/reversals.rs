//! Reversals of a motion: its turning points, and what lies between them.

/// Turning points and what lies between them.
#[derive(Default)]
pub(super) struct Reversals {
    /// Samples at which x turns.
    pub at: Vec<usize>,
    /// Direction, distance (m) and time (s) since the last one, at each sample.
    pub direction: Vec<i8>,
    pub distance: Vec<f64>,
    pub time: Vec<f64>,
}

impl Reversals {
    /// Turning points of a motion `x` from which it moves away by more than `threshold`; `starts` are the first samples of the runs.
    pub fn of(x: &[f64], starts: &[usize], period: f64, threshold: f64) -> Reversals {
        let n = x.len();
        let mut all = Reversals { at: Vec::new(), direction: vec![0; n], distance: vec![0.0; n], time: vec![0.0; n] };
        if n == 0 {
            return all;
        }
        let bounds: Vec<usize> = starts.iter().copied().chain(std::iter::once(n)).collect();
        for run in bounds.windows(2) {
            let (begin, end) = (run[0], run[1]);
            // The extreme since the last turning point, and the direction towards it.
            let (mut extreme, mut direction) = (begin, 0i8);
            let mut turns = Vec::new();
            for k in begin..end {
                let away = (x[k] - x[extreme]) * f64::from(direction);
                if direction == 0 {
                    if (x[k] - x[begin]).abs() > threshold {
                        direction = if x[k] > x[begin] { 1 } else { -1 };
                        turns.push((begin, direction));
                        extreme = k;
                    }
                } else if away >= 0.0 {
                    extreme = k;
                } else if -away > threshold {
                    direction = -direction;
                    turns.push((extreme, direction));
                    extreme = k;
                }
            }
            for (i, (turn, direction)) in turns.iter().enumerate() {
                let since = *turn;
                let until = turns.get(i + 1).map_or(end, |t| t.0);
                for k in since..until {
                    all.direction[k] = *direction;
                    all.distance[k] = (x[k] - x[since]).abs();
                    all.time[k] = (k - since) as f64 * period;
                }
                if i > 0 {
                    all.at.push(since);
                }
            }
        }
        all
    }
}
