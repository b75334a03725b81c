//! The signals at the lines of the dither, window by window.

use nalgebra::Complex;

/// Lines at most.
pub const MAX_LINES: usize = 40;

/// The signals that are demodulated.
pub(super) const DITHER: usize = 0;

pub(super) const SENT: usize = 1;

pub(super) const FELT: usize = 2;

pub(super) type Lines = [f64; MAX_LINES];

/// Goertzel's recursion of the three signals at all lines over one window.
#[derive(Debug, Clone)]
pub(super) struct Window {
    pub(super) at: usize,
    newest: [Lines; 3],
    pub(super) before: [Lines; 3],
    pub(super) square_sum: f64,
}

impl Window {
    pub(super) const EMPTY: Window = Window { at: 0, newest: [[0.0; MAX_LINES]; 3], before: [[0.0; MAX_LINES]; 3], square_sum: 0.0 };

    pub(super) fn clear(&mut self) {
        *self = Window::EMPTY;
    }

    pub(super) fn take(&mut self, weight: f64, differences: [f64; 3], twice_cosine: &Lines) {
        for (signal, difference) in differences.into_iter().enumerate() {
            let (newest, before) = (&mut self.newest[signal], &mut self.before[signal]);
            let weighted = weight * difference;
            for line in 0..MAX_LINES {
                let next = weighted + twice_cosine[line] * newest[line] - before[line];
                before[line] = newest[line];
                newest[line] = next;
            }
        }
        self.at += 1;
    }

    /// Up to a turn that is the same for all three signals.
    pub(super) fn amplitude(&self, signal: usize, line: usize, turn: Complex<f64>) -> Complex<f64> {
        Complex::new(self.newest[signal][line], 0.0) - turn.conj() * self.before[signal][line]
    }
}

/// A window that is over.
#[derive(Debug, Clone)]
pub(super) struct Taken {
    pub(super) amplitudes: [[Complex<f64>; MAX_LINES]; 3],
    /// Power of the felt force over all lines beside the dither's; 0 for none.
    pub(super) power: f64,
}
