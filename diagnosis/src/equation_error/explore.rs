//! Every law, every pair, and of the best of those every third: what each predicts of stretches that were left out, in all bands, and which is enough.

use super::gram::Left;
use crate::tuning::tuning;
use rayon::prelude::*;
use statrs::distribution::{ContinuousCDF, Normal};
use std::collections::BTreeMap;

/// A law with a choice of its nonlinear parameters: which of the laws, which of its variants.
pub(crate) type Chosen = (usize, usize);

/// What a law has in common with another one.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Same {
    /// It is the same, or contains it.
    Law,
    /// It belongs to the same family.
    Kind,
}

/// Laws that can be compared on the force along a motion in a band: of one body, or of a joint of an arm.
pub(crate) trait LawColumns: Sync {
    /// How many laws there are, the same in all bands.
    fn count(&self) -> usize;
    /// Numbers that a law adds.
    fn numbers(&self, law: usize) -> usize;
    /// Whether two laws may be looked at together.
    fn go_together(&self, a: usize, b: usize) -> bool;
    /// The choice of a law's nonlinear parameters with the least residual beside others; `None` where all are out of their range.
    fn best_beside(&self, others: &[Chosen], law: usize) -> Option<Chosen>;
    /// What laws leave of stretches that were left out.
    fn left(&self, laws: &[Chosen]) -> Option<Left>;
    /// The mean product of that of two structures, stretch by stretch, force squared.
    fn mean_product(&self, a: &Left, b: &Left) -> Vec<f64>;
    /// Whether a law is, or contains, another one, or its kind.
    fn is_same(&self, law: usize, other: usize, same: Same) -> bool;
    /// A law that is the same force as one of `laws` beside the rest of them, so that no motion separates the two.
    fn same_force(&self, laws: &[usize], law: usize) -> Option<usize>;

    /// The mean square of what is left, stretch by stretch, force squared.
    fn mean_square(&self, left: &Left) -> Vec<f64> {
        self.mean_product(left, left).into_iter().map(|x| x.max(0.0)).collect()
    }

    /// What laws leave of stretches that were left out: mean squares, force squared.
    fn left_out(&self, laws: &[Chosen]) -> Option<Vec<f64>> {
        self.left(laws).map(|left| self.mean_square(&left))
    }
}

/// Laws that were looked at together, in all bands.
#[derive(Debug, Clone)]
pub(crate) struct Looked {
    /// Which laws.
    pub laws: Vec<usize>,
    /// The choices of their nonlinear parameters in each band.
    pub chosen: Vec<Vec<Chosen>>,
    /// What is left of each stretch that was left out, over what the nominal model leaves on average: the geometric mean over the bands.
    pub errors: Vec<f64>,
    /// Numbers that they add.
    pub numbers: usize,
    /// What is left of stretches that were left out, in each band.
    left: Vec<Left>,
}

impl Looked {
    /// Mean over the stretches.
    pub fn mean(&self) -> f64 {
        self.errors.iter().sum::<f64>() / self.errors.len().max(1) as f64
    }

    /// Their cost: their number of parameters, and for each law that it was picked among a dozen.
    pub fn cost(&self) -> f64 {
        self.numbers as f64 + tuning().equation_error.picked * self.laws.len() as f64
    }
}

/// What was looked at, and which is enough.
pub(crate) struct Explored {
    /// All, what is left of left-out stretches in rising order.
    pub all: Vec<Looked>,
    /// The simplest that predicts alike: its place among them.
    pub enough: usize,
}

impl Explored {
    /// The simplest that predicts alike.
    pub fn best(&self) -> &Looked {
        &self.all[self.enough]
    }

    /// The nominal model.
    pub fn nothing(&self) -> &Looked {
        self.all.iter().find(|l| l.laws.is_empty()).unwrap_or(&self.all[self.enough])
    }
}

/// Compares all structures of at most `most` laws. `all_laws`: laws that are looked at in the whole device. `None` if the nominal parameters are not identifiable.
pub(crate) fn explore<R: LawColumns>(rooms: &[R], most: usize, all_laws: usize) -> Option<Explored> {
    let scales: Vec<f64> = rooms.iter().map(|room| Some(mean(&room.left_out(&[])?)).filter(|m| *m > 0.0)).collect::<Option<_>>()?;
    let laws: Vec<usize> = (0..rooms.first()?.count()).collect();
    let look = |laws: Vec<usize>, before: &[Vec<Chosen>]| {
        let chosen: Option<Vec<Vec<Chosen>>> =
            rooms.iter().enumerate().map(|(r, room)| chosen(room, before.get(r).map_or(&[], Vec::as_slice), &laws)).collect();
        let chosen = chosen?;
        let left = rooms.iter().zip(&chosen).map(|(room, chosen)| room.left(chosen)).collect::<Option<_>>()?;
        Some(looked(rooms, &scales, &vec![SMALLEST; rooms.len()], Looked { laws, chosen, errors: Vec::new(), numbers: 0, left }))
    };
    let mut all: BTreeMap<Vec<usize>, Looked> = BTreeMap::new();
    all.insert(Vec::new(), look(Vec::new(), &[])?);
    let mut before: Vec<Looked> = all.values().cloned().collect();
    for count in 1..=most {
        let mut next: BTreeMap<Vec<usize>, &Looked> = BTreeMap::new();
        for l in &before {
            for law in laws.iter().filter(|law| l.laws.iter().all(|other| rooms[0].go_together(*other, **law))) {
                let mut names = l.laws.clone();
                names.push(*law);
                names.sort_unstable();
                next.entry(names).or_insert(l);
            }
        }
        let found: Vec<Looked> =
            next.into_iter().collect::<Vec<_>>().into_par_iter().filter_map(|(names, from)| look(names, &from.chosen)).collect();
        before = found.clone();
        all.extend(found.into_iter().map(|l| (l.laws.clone(), l)));
        if count >= 2 {
            before.sort_by(|a, b| a.mean().total_cmp(&b.mean()));
            before.truncate(tuning().equation_error.extended);
        }
    }
    // Where a drive rests and logs zeros there is no error at all. A residual far below that of the best structure carries no information on any structure.
    let best = all.values().min_by(|a, b| a.mean().total_cmp(&b.mean()))?.clone();
    let floor = |((room, scale), left): ((&R, &f64), &Left)| tuning().equation_error.floor * mean(&room.mean_square(left)) / scale;
    let floors: Vec<f64> = rooms.iter().zip(&scales).zip(&best.left).map(floor).collect();
    let mut all: Vec<Looked> = all.into_values().map(|l| looked(rooms, &scales, &floors, l)).collect();
    all.sort_by(|a, b| a.mean().total_cmp(&b.mean()));
    let enough = enough(rooms, &all, all_laws);
    Some(Explored { all, enough })
}

fn mean(x: &[f64]) -> f64 {
    x.iter().sum::<f64>() / x.len().max(1) as f64
}

/// Values of this size are within rounding errors and carry no information.
const SMALLEST: f64 = 1e-12;

/// The same with its errors and number of parameters, from its residual.
fn looked<R: LawColumns>(rooms: &[R], scales: &[f64], floors: &[f64], mut l: Looked) -> Looked {
    let mut errors: Vec<f64> = Vec::new();
    for (((room, scale), floor), left) in rooms.iter().zip(scales).zip(floors).zip(&l.left) {
        let own = room.mean_square(left);
        errors.resize(own.len(), 0.0);
        errors.iter_mut().zip(own).for_each(|(sum, e)| *sum += (e / scale).max(floor.max(SMALLEST)).ln() / rooms.len() as f64);
    }
    l.numbers = l.laws.iter().map(|law| rooms.first().map_or(0, |room| room.numbers(*law))).sum();
    l.errors = errors.into_iter().map(f64::exp).collect();
    l
}

/// The choices of the nonlinear parameters of laws in a band, from those of some of them on.
fn chosen<R: LawColumns>(room: &R, before: &[Chosen], laws: &[usize]) -> Option<Vec<Chosen>> {
    let mut chosen: Vec<Chosen> = before.to_vec();
    for law in laws {
        if !chosen.iter().any(|(other, _)| other == law) {
            chosen.push(room.best_beside(&chosen, *law)?);
        }
    }
    for _ in 0..if chosen.len() > 1 { 2 } else { 0 } {
        let last = chosen.clone();
        for at in 0..chosen.len() {
            let rest: Vec<Chosen> = chosen.iter().enumerate().filter(|(i, _)| *i != at).map(|(_, l)| *l).collect();
            if let Some(better) = room.best_beside(&rest, chosen[at].0) {
                chosen[at] = better;
            }
        }
        if chosen == last {
            break;
        }
    }
    chosen.sort_unstable();
    Some(chosen)
}

/// How much better one structure predicts left-out stretches than another.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Better {
    /// Mean of the logarithm of the ratio of the errors, stretch by stretch.
    pub mean: f64,
    /// Standard error of that.
    pub error: f64,
    /// By how much the mean error of the other is larger, in that of the better.
    pub share: f64,
}

impl Better {
    /// In its own standard errors.
    pub fn in_errors(&self) -> f64 {
        self.mean / self.error.max(1e-9)
    }
}

/// How much better `second` predicts than `first`.
pub(crate) fn better(first: &Looked, second: &Looked) -> Better {
    let ratios: Vec<f64> = first.errors.iter().zip(&second.errors).map(|(a, b)| (a / b).ln()).collect();
    let (n, mean) = (ratios.len().max(1) as f64, mean(&ratios));
    let variance = ratios.iter().map(|x| (x - mean) * (x - mean)).sum::<f64>() / n;
    Better { mean, error: (variance / n).sqrt(), share: first.mean() / second.mean().max(f64::MIN_POSITIVE) - 1.0 }
}

/// How surely what a richer structure has more of the force is in what a simpler one leaves of left-out stretches, in standard errors.
///
/// After Clark and West (2007): the mean product of the two, each stretch in its own error. A comparison of errors alone is lost by a richer structure
/// whose parameters are hardly known, also where it is the right one.
fn shows<R: LawColumns>(rooms: &[R], simple: &Looked, rich: &Looked) -> f64 {
    let mut products: Vec<f64> = Vec::new();
    for ((room, simple), rich) in rooms.iter().zip(&simple.left).zip(&rich.left) {
        let [own, other, both] = [(simple, simple), (rich, rich), (simple, rich)].map(|(a, b)| room.mean_product(a, b));
        let floor = (tuning().equation_error.floor * mean(&other)).max(f64::MIN_POSITIVE);
        products.resize(own.len(), 0.0);
        for (sum, ((own, other), both)) in products.iter_mut().zip(own.into_iter().zip(other).zip(both)) {
            *sum += (own - both) / (own.max(floor) * other.max(floor)).sqrt();
        }
    }
    let square: f64 = products.iter().map(|x| x * x).sum();
    products.iter().sum::<f64>() / square.sqrt().max(f64::MIN_POSITIVE)
}

/// Standard errors that one of many laws needs, so that by chance as few are found in a device of many joints as in one of a dozen laws (Bonferroni).
fn of_many(errors: f64, all_laws: usize) -> f64 {
    let normal = Normal::standard();
    let times = all_laws as f64 / tuning().equation_error.dozen;
    if times <= 1.0 { errors } else { -normal.inverse_cdf(normal.cdf(-errors) / times) }
}

/// The simplest that predicts left-out stretches alike, of those whose laws all predict better beside the others.
fn enough<R: LawColumns>(rooms: &[R], all: &[Looked], all_laws: usize) -> usize {
    let tuning = &tuning().equation_error;
    let [sure, shown] = [tuning.sure, tuning.shown].map(|errors| of_many(errors, all_laws));
    let priced = |l: &Looked| l.mean() * (1.0 + tuning.worth * l.cost());
    let Some((at, best)) = all.iter().enumerate().min_by(|a, b| priced(a.1).total_cmp(&priced(b.1))) else { return 0 };
    let is_enough = |simple: &Looked, rich: &Looked| {
        let gain = better(simple, rich);
        let numbers = rich.numbers.saturating_sub(simple.numbers) as f64;
        let surely = gain.mean >= sure * gain.error || shows(rooms, simple, rich) >= shown;
        !surely || gain.share < tuning.least_gain.max(tuning.worth * numbers)
    };
    let is_needed = |l: &Looked, law: &usize| {
        let is_rest = |other: &&Looked| {
            other.laws.len() + 1 == l.laws.len() && !other.laws.contains(law) && other.laws.iter().all(|o| l.laws.contains(o))
        };
        all.iter().find(is_rest).is_none_or(|rest| !is_enough(rest, l))
    };
    let mut simpler: Vec<(usize, &Looked)> = all.iter().enumerate().filter(|(_, l)| l.cost() < best.cost()).collect();
    simpler.sort_by(|a, b| a.1.cost().total_cmp(&b.1.cost()).then(a.1.mean().total_cmp(&b.1.mean())));
    simpler.into_iter().find(|(_, l)| is_enough(l, best) && l.laws.iter().all(|law| is_needed(l, law))).map_or(at, |(index, _)| index)
}
