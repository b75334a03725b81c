//! The operator as the double integral that defines it: a grid of relays.

use super::transition::Transition;

/// Relays on a grid of thresholds: eq (7) by brute force, slow, and all that [`super::operator::Operator`] has to agree with.
#[derive(Debug, Clone)]
pub struct Relays {
    /// (α up, β down, weight N, state ±1).
    relays: Vec<(f64, f64, f64, f64)>,
}

impl Relays {
    /// `grid` relays per side for displacements within `±reach` (m, above 0), weighted by the curves' mixed differences over the cells.
    pub fn new(curves: &Transition, reach: f64, grid: usize) -> Relays {
        let edge = |i: usize| reach * (2.0 * i as f64 / grid as f64 - 1.0);
        let rise = |i: usize, j: usize| {
            let (high, low) = (edge(i), edge(j));
            if i > j { curves.rise(high.abs().max(low.abs()), high - low).force } else { 0.0 }
        };
        let mut relays = Vec::with_capacity(grid * (grid + 1) / 2);
        for i in 0..grid {
            for j in 0..=i {
                // The cell between up-thresholds i and i + 1 and down-thresholds j and j + 1; half of one on the diagonal.
                let weight = rise(i + 1, j) - rise(i, j) - rise(i + 1, j + 1) + rise(i, j + 1);
                let middle = |k: usize| 0.5 * (edge(k) + edge(k + 1));
                let (up, down) = (middle(i), middle(j));
                relays.push((up, down, weight, if up + down > 0.0 { -1.0 } else { 1.0 }));
            }
        }
        // At rest, relays on the line α = -β are as many up as down.
        for (index, relay) in relays.iter_mut().filter(|r| (r.0 + r.1).abs() < 1e-12 * reach).enumerate() {
            relay.3 = if index % 2 == 0 { 1.0 } else { -1.0 };
        }
        Relays { relays }
    }

    /// Moves the displacement to `z`, m, and gives the force, N.
    pub fn step(&mut self, z: f64) -> f64 {
        let mut sum = 0.0;
        for (up, down, weight, state) in &mut self.relays {
            if z >= *up {
                *state = 1.0;
            } else if z <= *down {
                *state = -1.0;
            }
            sum += *weight * *state;
        }
        0.5 * sum
    }
}
