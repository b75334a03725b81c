//! Which effects a servo joint needs: one after another, each added only where it predicts held-out data better than without it.

use crate::fit::{BLOCKS, Fit, Problem};
use crate::physics::{ALL, BASE, Physics, Sizes, named};
use crate::record::Record;
use backdrive_diagnosis::belief::predictive::{Gain, gain};
use backdrive_diagnosis::options::Options;
use backdrive_diagnosis::output_error::work::Limit;
use backdrive_plant::servo::{Number, Numbers};
use backdrive_signal::statistics::deviation;
use rayon::prelude::*;
use std::collections::BTreeSet;

/// Steps of a fit that only screens, and of one that counts.
const SCREEN: usize = 4;
const FULL: usize = 15;
/// Effects of a round that are evaluated on held-out recordings.
const FINALISTS: usize = 3;
/// An effect has to lower the mean loss on held-out recordings by this share.
const LEAST: f64 = 0.02;
/// What shows in few recordings has to lower it by this share, and others may lose this share of what those gain.
const MUCH: f64 = 0.05;
const FEW: f64 = 0.25;
/// Errors up to this many resolutions of the position sensor are the sensor's own.
const NOISE: f64 = 1.4;
/// Two laws whose mean losses differ by less than this share do as much: the commoner one is taken.
const ALIKE: f64 = 0.05;
/// Scales of errors are renewed if their logarithms changed by this much on average.
const RESCALED: f64 = 0.2;
/// Effects that are also tried two at a time: neither alone need show.
const PAIRS: [[&str; 2]; 8] = [
    ["speed_limit", "acceleration_limit"],
    ["gravity", "load_friction"],
    ["payload", "load_friction"],
    ["coulomb", "dead_band"],
    ["gravity", "gain"],
    ["coulomb", "saturation"],
    ["coulomb", "speed_limit"],
    ["coulomb", "acceleration_limit"],
];

/// A structure with its fit and its errors on what the fit has not seen.
#[derive(Debug, Clone)]
pub struct Candidate {
    /// What was added, in its order.
    pub added: Vec<&'static str>,
    /// The fit to all records.
    pub fit: Fit,
    /// The fits without one fold each.
    pub folds: Vec<Numbers>,
    /// Mean loss by record and stretch, each from the fit that has not seen it.
    pub unseen: Vec<[f64; BLOCKS]>,
}

/// An effect that was evaluated on held-out recordings.
#[derive(Debug, Clone)]
pub struct Tried {
    /// What was added.
    pub adds: Vec<&'static str>,
    /// In whose place.
    pub drops: Option<&'static str>,
    /// Better than without it?
    pub gain: Option<Gain>,
    /// By which share it lowers the mean loss on held-out recordings.
    pub lowers: f64,
    /// Whether it was taken up.
    pub taken: bool,
}

/// What a search found.
#[derive(Debug, Clone)]
pub struct Found {
    /// Delay, second order and offset.
    pub base: Candidate,
    /// The best.
    pub best: Candidate,
    /// Of each that was added: how much better than without it, and the rivals with how much better it is than they are in its place.
    pub claims: Vec<Claim>,
    /// What was tried, in its order.
    pub tried: Vec<Tried>,
    /// Of each record the fold that its first stretch is in.
    pub folds: Vec<usize>,
}

/// Confidence in one effect.
#[derive(Debug, Clone)]
pub struct Claim {
    /// Its name.
    pub name: &'static str,
    /// Against the structure without it.
    pub without: Option<Gain>,
    /// Against others in its place.
    pub rivals: Vec<(&'static str, Option<Gain>)>,
}

/// What the records hold.
pub fn sizes(records: &[&Record]) -> Sizes {
    let mut lags = Vec::new();
    let (mut speed, mut acceleration, mut weight) = (0.0f64, 0.0f64, 0.0f64);
    for r in records {
        lags.extend(r.command.iter().zip(&r.position).map(|(c, p)| (c - p).abs()));
        // Over three samples, for the steps of an encoder.
        let rates: Vec<f64> = (3..r.t.len()).map(|i| (r.position[i] - r.position[i - 3]) / (r.t[i] - r.t[i - 3])).collect();
        speed = rates.iter().fold(speed, |most, x| most.max(x.abs()));
        acceleration = (3..rates.len()).fold(acceleration, |most, i| most.max((rates[i] - rates[i - 3]).abs() / (r.t[i] - r.t[i - 3])));
        weight = r.gravity.iter().fold(weight, |most, [a, b, c]| most.max(a.hypot(*b) + c.abs()));
    }
    lags.sort_by(f64::total_cmp);
    let at = |share: f64| lags.get(((lags.len().max(1) - 1) as f64 * share) as usize).copied().unwrap_or(0.0);
    Sizes { lag: at(0.9).max(1e-6), largest_lag: at(1.0).max(1e-6), speed: speed.max(1e-3), acceleration: acceleration.max(1e-2), weight }
}

/// The first search of one joint. `floor`: what the position sensor resolves, rad.
fn begin<'a>(records: &[&'a Record], floor: f64, options: &'a Options, limit: Limit<'a>) -> (Searcher<'a>, Candidate, Candidate) {
    let size = sizes(records);
    let problem = Problem::new(records.to_vec(), size.lag.max(floor));
    let free: Vec<Number> = BASE.to_vec();
    let first = starts(records).into_iter().map(|start| problem.fit(&free, &start, FULL, None));
    let base = first.min_by(|a, b| a.cost.total_cmp(&b.cost));
    let base = base.unwrap_or_else(|| problem.fit(&free, &Numbers::default(), 0, None));
    let mut searcher = Searcher { problem, size, floor, tried: Vec::new(), options, limit };
    searcher.rescale(&base.numbers);
    let base = searcher.candidate(Vec::new(), &base.numbers);
    let best = searcher.onward(base.clone());
    (searcher, base, best)
}

/// Examines each joint again with the effects of the others: joints of one arm often have the same servos. An effect that a joint takes over has to predict
/// its own held-out recordings. What ends it from outside keeps what every joint has by then.
pub fn search_all(joints: &[(Vec<&Record>, f64)], options: &Options, limit: Limit) -> Vec<Found> {
    let mut all: Vec<(Searcher, Candidate, Candidate)> =
        joints.par_iter().map(|(records, floor)| begin(records, *floor, options, limit)).collect();
    let first: Vec<Candidate> = all.iter().map(|(_, _, best)| best.clone()).collect();
    all.par_iter_mut()
        .enumerate()
        .map(|(index, (searcher, base, best))| {
            for other in first.iter().enumerate().filter(|(k, _)| *k != index).map(|(_, other)| other) {
                *best = searcher.adopted(best, other);
            }
            let (best, claims) = searcher.ended(best.clone());
            let folds = searcher.problem.folds.iter().map(|f| f[0]).collect();
            Found { base: base.clone(), best, claims, tried: std::mem::take(&mut searcher.tried), folds }
        })
        .collect()
}

/// Where the first fit starts: lags of several sizes, as delay and as damping.
fn starts(records: &[&Record]) -> Vec<Numbers> {
    let lag = (0..30).map(|k| 0.01 * f64::from(k)).min_by(|a, b| late(records, *a).total_cmp(&late(records, *b))).unwrap_or(0.05).max(0.01);
    [0.1, 0.5, 0.8]
        .iter()
        .map(|share| {
            let mut n = Numbers::default();
            n[Number::Delay] = share * lag;
            n[Number::Damping] = (1.0 - share) * lag;
            n[Number::Inertia] = (0.3 * n[Number::Damping]).powi(2).max(1e-5);
            n
        })
        .collect()
}

/// Mean square of what a constant delay leaves.
fn late(records: &[&Record], delay: f64) -> f64 {
    records
        .iter()
        .map(|r| {
            let mut at = 0;
            let squares = r.t.iter().zip(&r.position).map(|(t, p)| {
                while at + 1 < r.t.len() && r.t[at + 1] <= t - delay {
                    at += 1;
                }
                (r.command[at] - p).powi(2)
            });
            squares.sum::<f64>() / r.t.len().max(1) as f64
        })
        .sum()
}

/// What a round may do.
struct Move {
    adds: Vec<&'static Physics>,
    drops: Option<&'static Physics>,
}

struct Searcher<'a> {
    problem: Problem<'a>,
    size: Sizes,
    floor: f64,
    tried: Vec<Tried>,
    options: &'a Options,
    limit: Limit<'a>,
}

impl Searcher<'_> {
    /// The scale of each record's errors becomes that of a fit, where they changed much; whether they did.
    fn rescale(&mut self, numbers: &Numbers) -> bool {
        let before = self.problem.scales.clone();
        let changed = self.problem.rescale(numbers, (NOISE * self.floor).max(1e-9)) > RESCALED;
        if !changed && !self.tried.is_empty() {
            self.problem.scales = before;
        }
        changed
    }

    /// Round after round, until none is better.
    fn onward(&mut self, mut best: Candidate) -> Candidate {
        while let Some(next) = self.round(&best) {
            best = next;
            if self.rescale(&best.fit.numbers) {
                best = self.candidate(best.added.clone(), &best.fit.numbers.clone());
            }
        }
        best
    }

    /// The structure and the parameters of another joint, where they predict this one better; what is particular to a joint stays its own.
    fn adopted(&mut self, best: &Candidate, other: &Candidate) -> Candidate {
        if self.limit.is_over() {
            return best.clone();
        }
        let mut added = best.added.clone();
        added.extend(other.added.iter().filter(|name| !best.added.contains(name)));
        let mut start = other.fit.numbers;
        for n in [Number::Offset, Number::Gain, Number::MomentCos, Number::MomentSin] {
            start[n] = best.fit.numbers[n];
        }
        // Every effect that both have together, those it needs first.
        let order = |name: &&str| ALL.iter().position(|p| p.name == *name);
        added.sort_by_key(order);
        let mut kept: Vec<&'static str> = Vec::new();
        for name in added.iter().filter(|n| named(n).is_some_and(|p| p.needs.is_empty())) {
            kept.push(name);
        }
        let more: Vec<&'static str> =
            added.iter().copied().filter(|n| !kept.contains(n) && named(n).is_some_and(|p| self.may(p, &kept))).collect();
        kept.extend(more);
        if self.size.weight < 1e-6 {
            kept.retain(|name| *name != "gravity");
        }
        if !self.are_allowed(kept.len()) {
            return best.clone();
        }
        let candidate = self.candidate(kept, &start);
        if self.is_no_worse(best, &candidate) { candidate } else { best.clone() }
    }

    /// What is not worth it taken off, and how sure the rest is.
    fn ended(&mut self, mut best: Candidate) -> (Candidate, Vec<Claim>) {
        if self.rescale(&best.fit.numbers) {
            best = self.candidate(best.added.clone(), &best.fit.numbers.clone());
        }
        let (best, without) = self.simpler(best);
        let claims = without.iter().map(|(name, candidate)| self.claim(&best, name, candidate)).collect();
        (best, claims)
    }

    /// A structure fitted to all, and without each fold.
    fn candidate(&self, added: Vec<&'static str>, start: &Numbers) -> Candidate {
        let free = free_of(&added);
        candidate_of(&self.problem, added, &free, start)
    }

    /// How much better one predicts than another. Errors below what the sensor resolves are none.
    fn gain(&self, base: &Candidate, better: &Candidate) -> Option<Gain> {
        let least = |scale: &f64| (0.3 * self.floor / scale).powi(2) + 0.01;
        let by_record = |(b, scale): (&[f64; BLOCKS], &f64)| b.iter().map(|x| x + least(scale)).collect();
        let lists = |c: &Candidate| c.unseen.iter().zip(&self.problem.scales).map(by_record).collect::<Vec<Vec<f64>>>();
        gain(&lists(base), &lists(better))
    }

    fn may(&self, physics: &Physics, added: &[&str]) -> bool {
        let is_there = added.contains(&physics.name);
        let fulfilled = physics.needs.is_empty() || physics.needs.iter().any(|n| added.contains(n));
        // Friction by load is more of dry friction, not another word for it.
        let is_early = physics.name == "load_friction" && !added.contains(&"coulomb") && !added.contains(&"dead_band");
        let weightless = physics.name == "gravity" && self.size.weight < 1e-6;
        !is_there && fulfilled && !is_early && !weightless && !self.options.without.iter().any(|name| name == physics.name)
    }

    /// Whether one predicts held-out recordings better than another beyond chance: in most segments, or by much in some recordings and by little worse in
    /// none.
    fn is_better(&self, base: &Candidate, better: &Candidate) -> bool {
        let lowers = 1.0 - total(better) / total(base);
        // Below what the sensor resolves there is nothing to explain.
        let squares = base.unseen.iter().zip(&self.problem.scales).map(|(b, scale)| mean(b) * scale * scale);
        let is_noise = (squares.sum::<f64>() / self.problem.records.len().max(1) as f64).sqrt() < NOISE * self.floor;
        if !lowers.is_finite() || lowers < LEAST || is_noise {
            return false;
        }
        if self.gain(base, better).is_some_and(|g| g.is_sure()) {
            return true;
        }
        // An effect that shows in few recordings, such as a limit: what they gain is not lost in others, and no single one is all of it.
        let by_record = |c: &Candidate| -> Vec<f64> { c.unseen.iter().map(mean).collect() };
        let differences: Vec<f64> = by_record(base).iter().zip(by_record(better)).map(|(a, b)| a - b).collect();
        let gains: f64 = differences.iter().map(|d| d.max(0.0)).sum();
        let losses: f64 = differences.iter().map(|d| (-d).max(0.0)).sum();
        let most = differences.iter().fold(0.0f64, |m, d| m.max(*d));
        let rest = gains - most - losses;
        let is_no_worse = self.gain(base, better).is_none_or(|g| g.mean > 0.0);
        is_no_worse && lowers > MUCH && losses < FEW * gains && rest > 0.2 * LEAST * total(base) * self.problem.records.len() as f64
    }

    /// Whether one instead of another lowers the mean loss on held-out recordings, and is no worse in most of them.
    fn is_no_worse(&self, base: &Candidate, better: &Candidate) -> bool {
        total(better) < (1.0 - LEAST) * total(base) && self.gain(base, better).is_none_or(|g| g.mean > 0.0)
    }

    /// What a round may do, in two stages: add an effect, or two that need each other; replace one by a rival.
    fn moves(&self, best: &Candidate, stage: usize) -> Vec<Move> {
        let singles = ALL.iter().filter(|p| self.may(p, &best.added)).map(|p| Move { adds: vec![p], drops: None });
        let pairs = PAIRS.iter().filter_map(|[a, b]| {
            let (a, b) = (named(a)?, named(b)?);
            let mut with = best.added.clone();
            with.push(a.name);
            (self.may(a, &best.added) && self.may(b, &with)).then(|| Move { adds: vec![a, b], drops: None })
        });
        let swaps = best.added.iter().filter_map(|name| named(name)).flat_map(|old| {
            let kept: Vec<&str> = best.added.iter().copied().filter(|n| *n != old.name).collect();
            old.rivals
                .iter()
                .filter_map(|n| named(n))
                .filter(|new| self.may(new, &kept) && !best.added.contains(&new.name))
                .map(|new| Move { adds: vec![new], drops: Some(old) })
                .collect::<Vec<_>>()
        });
        match stage {
            0 => singles.chain(pairs).filter(|change| self.are_allowed(best.added.len() + change.adds.len())).collect(),
            _ => swaps.collect(),
        }
    }

    /// Whether as many effects may be missing at once.
    fn are_allowed(&self, effects: usize) -> bool {
        self.options.effects.is_none_or(|most| effects <= most)
    }

    /// The structure after a move, and where its fits start.
    fn moved(&self, best: &Candidate, change: &Move) -> (Vec<&'static str>, Vec<Numbers>) {
        let dropped = change.drops.map(|p| p.name);
        let mut added: Vec<&'static str> = best.added.iter().copied().filter(|n| Some(*n) != dropped).collect();
        let mut from = best.fit.numbers;
        for n in change.drops.iter().flat_map(|p| p.numbers) {
            from[*n] = n.facts().nothing;
        }
        let mut starts = vec![from];
        for physics in &change.adds {
            added.push(physics.name);
            starts = starts.iter().flat_map(|s| physics.starts(s, &self.size)).collect();
        }
        (added, starts)
    }

    /// Screens every move, and takes the best that is better beyond chance.
    fn round(&mut self, best: &Candidate) -> Option<Candidate> {
        (0..2).find_map(|stage| self.stage(best, stage))
    }

    fn stage(&mut self, best: &Candidate, stage: usize) -> Option<Candidate> {
        let moves = self.moves(best, stage);
        let mut screened: Vec<(usize, Vec<&'static str>, Fit)> = (0..moves.len())
            .into_par_iter()
            .filter_map(|index| {
                if self.limit.is_over() {
                    return None;
                }
                let (added, starts) = self.moved(best, &moves[index]);
                let free = screened(&moves[index]);
                let fits = starts.iter().map(|s| self.problem.fit(&free, s, SCREEN, None));
                Some((index, added, fits.min_by(|a, b| a.cost.total_cmp(&b.cost))?))
            })
            .filter(|(_, _, fit)| fit.cost < (1.0 - 0.5 * LEAST) * best.fit.cost)
            .collect();
        screened.sort_by(|a, b| a.2.cost.total_cmp(&b.2.cost));
        let mut taken: Option<(Candidate, f64, usize)> = None;
        for (index, added, fit) in screened.into_iter().take(FINALISTS) {
            if self.limit.is_over() {
                break;
            }
            let change = &moves[index];
            let candidate = self.candidate(added, &fit.numbers);
            let gain = self.gain(best, &candidate);
            let lowers = 1.0 - total(&candidate) / total(best);
            let names = change.adds.iter().map(|p| p.name).collect();
            self.tried.push(Tried { adds: names, drops: change.drops.map(|p| p.name), gain, lowers, taken: false });
            // A replacement has to be better only; the second effect of a pair has to be worth it as well.
            let enough = match change.drops {
                Some(_) => self.is_no_worse(best, &candidate),
                None => self.is_better(best, &candidate) && lowers > LEAST * change.adds.len() as f64,
            };
            // Of those that do as much the one that stands first in the list, the commoner law, is taken.
            let rank = |c: &Candidate| c.added.last().and_then(|n| ALL.iter().position(|p| p.name == *n)).unwrap_or(ALL.len());
            let wins = taken.as_ref().is_none_or(|(other, most, _)| match (total(&candidate) / total(other)).ln().abs() < ALIKE {
                true => rank(&candidate) < rank(other),
                false => lowers > *most,
            });
            if enough && wins {
                taken = Some((candidate, lowers, self.tried.len() - 1));
            }
        }
        let (candidate, _, index) = taken?;
        self.tried[index].taken = true;
        Some(candidate)
    }

    /// Takes off what is not worth it any more; with what remains the structures without each.
    fn simpler(&self, mut best: Candidate) -> (Candidate, Vec<(&'static str, Candidate)>) {
        loop {
            let without: Vec<(&'static str, Candidate)> = best.added.par_iter().map(|name| (*name, self.without(&best, name))).collect();
            let is_needed = |name: &str| {
                let others = || best.added.iter().filter_map(|n| named(n)).filter(|p| p.needs.contains(&name));
                others().any(|p| best.added.iter().filter(|n| p.needs.contains(n)).count() < 2)
            };
            let worth = |c: &Candidate| {
                let share = 1.0 - total(&best) / total(c);
                if self.is_better(c, &best) { share } else { share.min(0.0) }
            };
            // Friction by load is more of dry friction: alone, times a small weight with a free phase, it would be friction that varies with the angle.
            let is_kept = |name: &str| is_needed(name) || (name == "coulomb" && best.added.contains(&"load_friction"));
            let least = without.iter().filter(|(name, _)| !is_kept(name)).map(|(_, c)| (worth(c), c)).min_by(|a, b| a.0.total_cmp(&b.0));
            match least {
                Some((share, candidate)) if share < LEAST => best = candidate.clone(),
                _ => return (best, without),
            }
        }
    }

    fn without(&self, best: &Candidate, name: &str) -> Candidate {
        let added: Vec<&'static str> = best.added.iter().copied().filter(|a| *a != name).collect();
        let mut start = best.fit.numbers;
        for n in named(name).iter().flat_map(|p| p.numbers) {
            start[*n] = n.facts().nothing;
        }
        self.candidate(added, &start)
    }

    fn claim(&self, best: &Candidate, name: &'static str, without: &Candidate) -> Claim {
        let of = |rival: &&'static str| {
            let physics = named(rival)?;
            if !self.may(physics, &without.added) {
                return None;
            }
            let mut added = without.added.clone();
            added.push(physics.name);
            let free = screened(&Move { adds: vec![physics], drops: None });
            let fits = physics.starts(&without.fit.numbers, &self.size).into_iter().map(|s| self.problem.fit(&free, &s, SCREEN, None));
            let fit = fits.min_by(|a, b| a.cost.total_cmp(&b.cost))?;
            Some((physics.name, self.gain(&self.candidate(added, &fit.numbers), best)))
        };
        let rivals = named(name).iter().flat_map(|p| p.rivals).filter_map(of).collect();
        Claim { name, without: self.gain(without, best), rivals }
    }
}

/// Numbers fitted to all records and without each fold, with their errors on what a fit has not seen.
pub(crate) fn candidate_of(problem: &Problem, added: Vec<&'static str>, free: &[Number], start: &Numbers) -> Candidate {
    let fit = problem.fit(free, start, FULL, None);
    let folds = problem.leave_out(&fit);
    let by_fold: Vec<Vec<[f64; BLOCKS]>> = folds.par_iter().map(|n| problem.blocks(n)).collect();
    let unseen = (0..problem.records.len()).map(|r| std::array::from_fn(|b| by_fold[problem.folds[r][b]][r][b])).collect();
    Candidate { added, fit, folds, unseen }
}

/// The parameters that a first evaluation of a move fits: its own, and those that most often change with it.
fn screened(change: &Move) -> Vec<Number> {
    let own = change.adds.iter().flat_map(|p| p.numbers.iter().copied());
    let all: BTreeSet<Number> = own.chain([Number::Damping, Number::Offset, Number::Inertia]).collect();
    all.into_iter().collect()
}

fn mean(blocks: &[f64; BLOCKS]) -> f64 {
    blocks.iter().sum::<f64>() / BLOCKS as f64
}

/// Mean loss on what the fits have not seen.
pub fn total(candidate: &Candidate) -> f64 {
    candidate.unseen.iter().flatten().sum::<f64>() / (candidate.unseen.len() * BLOCKS).max(1) as f64
}

/// The parameters that a structure frees.
pub fn free_of(added: &[&str]) -> Vec<Number> {
    let all: BTreeSet<Number> =
        BASE.iter().copied().chain(added.iter().filter_map(|n| named(n)).flat_map(|p| p.numbers.iter().copied())).collect();
    all.into_iter().collect()
}

/// Root mean square of the error of a free run over the standard deviation of the recorded position, and the mean absolute error, rad.
pub fn scored(simulated: &[f64], recorded: &[f64]) -> (f64, f64) {
    let n = recorded.len().max(1) as f64;
    let errors = || simulated.iter().zip(recorded).map(|(s, p)| s - p);
    let rms = (errors().map(|e| e * e).sum::<f64>() / n).sqrt();
    (rms / deviation(recorded), errors().map(f64::abs).sum::<f64>() / n)
}
