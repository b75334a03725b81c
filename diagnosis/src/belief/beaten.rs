//! Why each structure that was fitted is not the one that is claimed.

use super::choice::{chosen, evidence, unseen_evidence};
use crate::output_error::candidate::{Candidate, advantage_over};
use crate::search::Search;

/// A structure that was fitted to its end, beside the claimed one.
#[derive(Debug, Clone, PartialEq)]
pub struct Beaten {
    /// What it adds, such as `coulomb@drum-ground`; `nominal` where that is nothing.
    pub name: String,
    /// Free parameters.
    pub parameters: usize,
    /// Residual, root mean square, noise standard deviations.
    pub residual: f64,
    /// The same on the held-out recordings; `None` where it was not held against them.
    pub unseen: Option<f64>,
    /// By how much the fits prefer the claimed structure: difference of the information criterion with effective samples.
    pub by_fits: f64,
    /// By how much the unseen recordings prefer it.
    pub by_unseen: f64,
    /// Why it lost.
    pub why: Why,
}

/// Why a structure lost.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Why {
    /// It did not: it is what the verdict is built on.
    Claimed,
    /// It explains less.
    ExplainsLess,
    /// It fits better and predicts unseen recordings worse.
    PredictsWorse,
    /// It is not worth its parameters: a simpler one does as well.
    NotWorthIts,
    /// It does better, and not surely enough, or not by enough, to be claimed.
    NotSure,
}

impl Why {
    /// For a reader.
    pub fn text(self) -> &'static str {
        match self {
            Why::Claimed => "claimed",
            Why::ExplainsLess => "explains less",
            Why::PredictsWorse => "fits better, predicts worse",
            Why::NotWorthIts => "no better than a law with fewer parameters",
            Why::NotSure => "better, but not significantly enough to be claimed",
        }
    }
}

/// All structures that were fitted, the claimed one first, then by how far they are behind.
pub fn beaten(search: &Search) -> Vec<Beaten> {
    let best = chosen(search);
    let of = |c: &Candidate| {
        let (by_fits, by_unseen) = (advantage_over(c, best, search.samples), unseen_evidence(search, c, best));
        let why = match () {
            () if std::ptr::eq(c, best) => Why::Claimed,
            () if evidence(search, c, best) <= 0.0 && c.structure.free.len() >= best.structure.free.len() => Why::NotWorthIts,
            () if c.fit.cost < best.fit.cost && by_unseen > 0.0 => Why::PredictsWorse,
            () if c.fit.cost < best.fit.cost => Why::NotSure,
            () => Why::ExplainsLess,
        };
        Beaten {
            name: c.structure.name(),
            parameters: c.structure.free.len(),
            residual: (c.fit.cost / search.samples.max(1) as f64).sqrt(),
            unseen: c.unseen.as_ref().map(|u| u.mean_square.sqrt()),
            by_fits,
            by_unseen,
            why,
        }
    };
    let mut all: Vec<Beaten> = search.found.iter().chain(std::iter::once(&search.nominal)).map(of).collect();
    let behind = |b: &Beaten| if b.why == Why::Claimed { f64::NEG_INFINITY } else { b.by_fits + b.by_unseen };
    all.sort_by(|a, b| behind(a).total_cmp(&behind(b)));
    all
}
