//! Where the rows of a regression are, and the stretches in which predictions are compared.

use std::ops::Range;

/// Folds of the blocks: the number of times that a part of the logs is left out of a fit and predicted.
const FOLDS: usize = 8;
/// Blocks in which predictions are compared, at most, over all logs.
const BLOCKS: usize = 48;

/// Rows of a motion and a joint are neighbours; this holds their places.
#[derive(Debug, Clone, PartialEq)]
pub struct Layout {
    /// First row and number of rows of a joint, of each motion.
    motions: Vec<(usize, usize)>,
    /// Joints.
    pub joints: usize,
    /// Rows in all.
    pub rows: usize,
}

impl Layout {
    /// Of no motions yet.
    pub fn new(joints: usize) -> Layout {
        Layout { motions: Vec::new(), joints, rows: 0 }
    }

    /// Adds a motion with this number of rows for each joint.
    pub fn push(&mut self, count: usize) {
        self.motions.push((self.rows, count));
        self.rows += count * self.joints;
    }

    /// How many motions there are.
    pub fn motions(&self) -> usize {
        self.motions.len()
    }

    /// Rows of a joint in a motion.
    pub fn of(&self, motion: usize, joint: usize) -> Range<usize> {
        let (first, count) = self.motions[motion];
        first + joint * count..first + (joint + 1) * count
    }

    /// Number of rows that a joint has in a motion.
    pub fn count(&self, motion: usize) -> usize {
        self.motions[motion].1
    }
}

/// A stretch of a log: the motion, its rows (of every joint), and the fold that it is left out in.
#[derive(Debug, Clone, PartialEq)]
pub struct Block {
    /// Index of the motion.
    pub motion: usize,
    /// Rows within a joint.
    pub rows: Range<usize>,
    /// The fold; of held-out logs none.
    pub fold: Option<usize>,
}

/// Stretches of all motions; the first `fit_count` of these are for fitting.
pub fn blocks(layout: &Layout, fit_count: usize, row_period: f64) -> Vec<Block> {
    let all: usize = (0..fit_count).map(|m| layout.count(m)).sum();
    // Not shorter than what a filter smears, and long beside what one reversal is.
    let least = (1.0 / row_period).ceil() as usize;
    let length = (all / BLOCKS).max(least).max(4);
    let mut out = Vec::new();
    for m in 0..layout.motions.len() {
        let count = layout.count(m);
        let pieces = (count / length).max(1);
        for p in 0..pieces {
            out.push(Block { motion: m, rows: p * count / pieces..(p + 1) * count / pieces, fold: None });
        }
    }
    let of_fit = out.iter().filter(|b| b.motion < fit_count).count();
    let folds = FOLDS.min(of_fit);
    for (i, block) in out.iter_mut().filter(|b| b.motion < fit_count).enumerate() {
        block.fold = Some(i * folds / of_fit);
    }
    out
}
