//! One law, differenced once for all lanes that leave its parameters unchanged.

use crate::elements::Law;
use crate::stepper::path::PathElement;

/// Numbers of a memory up to which a law is differenced by each of them; with more, along each lane.
pub(super) const SHARED_MEMORY: usize = 2;

/// A law's results, and how fast they change with what goes in.
#[derive(Debug, Clone, Copy)]
pub(super) struct Rates<const IN: usize, const OUT: usize> {
    at: [f64; IN],
    result: [f64; OUT],
    rates: [[f64; OUT]; IN],
}

impl<const IN: usize, const OUT: usize> Rates<IN, OUT> {
    /// Of a function about `at`, where it gives `result`; each number is moved as far as the farthest of `near` is.
    #[inline(always)]
    pub(super) fn of(
        at: [f64; IN],
        near: impl Iterator<Item = [f64; IN]>,
        result: [f64; OUT],
        mut function: impl FnMut(&[f64; IN]) -> [f64; OUT],
    ) -> Self {
        let mut farthest = [0.0f64; IN];
        for other in near {
            for i in 0..IN {
                let apart = other[i] - at[i];
                if apart.abs() > farthest[i].abs() {
                    farthest[i] = apart;
                }
            }
        }
        let mut rates = [[0.0; OUT]; IN];
        for i in (0..IN).filter(|i| farthest[*i] != 0.0) {
            let mut moved = at;
            moved[i] += farthest[i];
            let there = function(&moved);
            for k in 0..OUT {
                rates[i][k] = (there[k] - result[k]) / farthest[i];
            }
        }
        Rates { at, result, rates }
    }

    /// The results a little away.
    #[inline(always)]
    pub(super) fn at(&self, near: &[f64; IN]) -> [f64; OUT] {
        let mut result = self.result;
        for i in 0..IN {
            for k in 0..OUT {
                result[k] += self.rates[i][k] * (near[i] - self.at[i]);
            }
        }
        result
    }
}

/// A memory with zeros where it has no more numbers.
#[inline(always)]
pub(super) fn padded(memory: &[f64]) -> [f64; SHARED_MEMORY] {
    [0, 1].map(|i| memory.get(i).copied().unwrap_or(0.0))
}

/// The memory after `[from, path, memory...]`: with its start and its length a path keeps its direction, however short it is.
#[inline(always)]
pub(super) fn advanced(law: &Law, length: usize, dt: f64, [from, path, first, second]: &[f64; 4]) -> [f64; SHARED_MEMORY] {
    let mut memory = [*first, *second];
    law.advance(&mut memory[..length], *from, from + path, dt);
    memory
}

/// The mean force for `[start, half of the path, velocity, memory...]`.
#[inline(always)]
pub(super) fn pushed(law: &Law, length: usize, [start, half, velocity, first, second]: &[f64; 5]) -> [f64; 1] {
    [law.mean_force(&[*first, *second][..length], *start, start + 2.0 * half, *velocity)]
}

/// An element as it stands.
#[inline(always)]
pub(super) fn standing(path: &PathElement) -> [f64; 3] {
    let [first, second] = padded(&path.memory);
    [path.reached, first, second]
}
