//! Every law, every pair, and of the best of those every third: what each predicts of stretches that were left out, in all bands, and which is enough.

use super::room::{Chosen, Room};
use crate::tuning::tuning;
use rayon::prelude::*;
use std::collections::BTreeMap;

/// Laws that were looked at together, in all bands.
#[derive(Debug, Clone)]
pub(crate) struct Looked {
    /// Which of [`Room::laws`].
    pub laws: Vec<usize>,
    /// The choices of their nonlinear numbers in each band.
    pub chosen: Vec<Vec<Chosen>>,
    /// What is left of each stretch that was left out, over what the nominal model leaves on average: the geometric mean over the bands.
    pub errors: Vec<f64>,
    /// Numbers that they add.
    pub numbers: usize,
}

impl Looked {
    /// Mean over the stretches.
    pub fn mean(&self) -> f64 {
        self.errors.iter().sum::<f64>() / self.errors.len().max(1) as f64
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

/// Compares all structures of at most `most` laws. `None` if the nominal parameters are not identifiable.
pub(crate) fn explore(rooms: &[Room], most: usize) -> Option<Explored> {
    let scales: Vec<f64> = rooms.iter().map(|room| Some(mean(&room.left_out(&[])?)).filter(|m| *m > 0.0)).collect::<Option<_>>()?;
    let laws: Vec<usize> = (0..rooms.first()?.laws.len()).collect();
    let look = |laws: Vec<usize>, before: &[Vec<Chosen>]| {
        let chosen: Option<Vec<Vec<Chosen>>> =
            rooms.iter().enumerate().map(|(r, room)| chosen(room, before.get(r).map_or(&[], Vec::as_slice), &laws)).collect();
        looked(rooms, &scales, &vec![SMALLEST; rooms.len()], laws, chosen?)
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
    // Where a drive rests and logs zeros there is no error at all: what is far below what the best leaves says nothing, of whichever structure.
    let best = all.values().min_by(|a, b| a.mean().total_cmp(&b.mean()))?.clone();
    let floor = |((room, scale), chosen): ((&Room, &f64), &Vec<Chosen>)| {
        Some(tuning().equation_error.floor * mean(&room.left_out(chosen)?) / scale)
    };
    let floors: Vec<f64> = rooms.iter().zip(&scales).zip(&best.chosen).map(floor).collect::<Option<_>>()?;
    let floored = |l: Looked| looked(rooms, &scales, &floors, l.laws, l.chosen);
    let mut all: Vec<Looked> = all.into_values().collect::<Vec<_>>().into_par_iter().filter_map(floored).collect();
    all.sort_by(|a, b| a.mean().total_cmp(&b.mean()));
    let enough = enough(&all);
    Some(Explored { all, enough })
}

fn mean(x: &[f64]) -> f64 {
    x.iter().sum::<f64>() / x.len().max(1) as f64
}

/// What is as small as rounding says nothing.
const SMALLEST: f64 = 1e-12;

fn looked(rooms: &[Room], scales: &[f64], floors: &[f64], laws: Vec<usize>, chosen: Vec<Vec<Chosen>>) -> Option<Looked> {
    let mut errors: Vec<f64> = Vec::new();
    for (((room, scale), floor), chosen) in rooms.iter().zip(scales).zip(floors).zip(&chosen) {
        let own = room.left_out(chosen)?;
        errors.resize(own.len(), 0.0);
        errors.iter_mut().zip(own).for_each(|(sum, e)| *sum += (e / scale).max(floor.max(SMALLEST)).ln() / rooms.len() as f64);
    }
    let numbers = laws.iter().map(|law| rooms.first().map_or(0, |room| room.laws[*law].numbers)).sum();
    Some(Looked { laws, chosen, errors: errors.into_iter().map(f64::exp).collect(), numbers })
}

/// The choices of the nonlinear numbers of laws in a band, from those of some of them on.
fn chosen(room: &Room, before: &[Chosen], laws: &[usize]) -> Option<Vec<Chosen>> {
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

/// The simplest that predicts left-out stretches alike.
fn enough(all: &[Looked]) -> usize {
    let tuning = &tuning().equation_error;
    let priced = |l: &Looked| l.mean() * (1.0 + tuning.worth * l.numbers as f64);
    let Some((at, best)) = all.iter().enumerate().min_by(|a, b| priced(a.1).total_cmp(&priced(b.1))) else { return 0 };
    let mut simpler: Vec<(usize, &Looked)> = all.iter().enumerate().filter(|(_, l)| l.numbers < best.numbers).collect();
    simpler.sort_by(|a, b| a.1.numbers.cmp(&b.1.numbers).then(a.1.mean().total_cmp(&b.1.mean())));
    let is_enough = |l: &Looked| {
        let gain = better(l, best);
        let numbers = (best.numbers - l.numbers) as f64;
        gain.mean < tuning.sure * gain.error || gain.share < tuning.least_gain.max(tuning.worth * numbers)
    };
    simpler.into_iter().find(|(_, l)| is_enough(l)).map_or(at, |(index, _)| index)
}
