//! Structures tried, wave by wave: single effects, pairs, more of them, and the other laws and places that the best of each could be.

use super::view::View;
use super::wave::Wave;
use super::{AT_FLOOR, COARSE, Candidate, MIDDLE, NOMINAL_END, Settings, Tried, Work, distinct_structures, done, key_of, polished, sort};
use crate::fit::Evaluator;
use crate::hypothesis::{Family, Hypothesis};
use crate::race::{Course, NEAR, Seed, distinct};
use crate::simulate::FINEST;
use std::collections::HashSet;

/// What the best of many hypotheses takes from a cost of white noise by chance, squares of the noise.
const CHANCE: f64 = 25.0;
/// Share of what is left over, in squares, that too few substeps may make up.
pub(super) const BLUR: f64 = 0.02;
/// Share of the time for screening beside a structure that was found.
const ANEW: f64 = 0.06;
/// Works the cost of the best up to which a law leaves less than twice as much over.
const TWICE: f64 = 4.0;
/// Share of the time for numbers that come back.
const REVIVING: f64 = 0.2;
/// Ripples that stand alone in the spectrum of their force which are fitted without the path that leads the others.
const RIPPLES: usize = 4;

/// What is tried, and what was found.
pub(super) struct Trials<'s, 'a> {
    /// What structures are fitted against, and from where.
    pub course: Course<'s>,
    /// What screening sees: from the base along the measured path, then from others.
    pub views: &'s [View<'a>],
    /// What screening promised.
    pub tried: &'s [Tried],
    /// Ripples that stand alone, and where they start.
    pub ripples: &'s [(usize, Vec<f64>)],
    /// Whether the nominal model stays far from the noise.
    pub far: bool,
    /// How much time there is.
    pub work: &'s Work<'s>,
    /// What was found, best first.
    pub found: Vec<Candidate>,
    singles: std::vec::IntoIter<Seed>,
    plain: std::vec::IntoIter<Seed>,
    /// Effects at once.
    effects: usize,
    /// Substeps that blur less than what is left over.
    fine: usize,
    /// The best whose relatives were tried.
    related: String,
    /// The law that other places were tried for.
    moved_about: String,
    /// Whether the work did not suffice for something that was wanted.
    pub left_out: bool,
}

impl<'s, 'a> Trials<'s, 'a> {
    /// Nothing tried yet.
    pub fn new(
        course: Course<'s>,
        views: &'s [View<'a>],
        tried: &'s [Tried],
        ripples: &'s [(usize, Vec<f64>)],
        far: bool,
        work: &'s Work<'s>,
    ) -> Trials<'s, 'a> {
        let none = || Vec::new().into_iter();
        let (singles, plain) = (none(), none());
        let (related, moved_about) = (String::new(), String::new());
        let mut all = Trials {
            course,
            views,
            tried,
            ripples,
            far,
            work,
            found: Vec::new(),
            singles,
            plain,
            effects: 1,
            fine: COARSE,
            related,
            moved_about,
            left_out: false,
        };
        all.singles = all.promising().into_iter();
        all.plain = all.of_one_number().into_iter();
        all
    }

    /// Tries all, as far as there is time and something left to explain.
    pub fn run(&mut self, settings: &Settings, report: &(dyn Fn(&str) + Sync)) {
        use Wave::*;
        let mut waves = vec![Ripples, First, GivenBack, Laws, Singles, Plain, Relatives, Elsewhere, Relatives];
        if !self.is_quiet() {
            waves.extend([Finer, Pairs, Laws, Exchanges, Richer, MoreSingles, MorePairs, Laws, Exchanges, Elsewhere]);
            for _ in 2..settings.effects {
                waves.extend([More, Anew, Exchanges]);
            }
            waves.extend([Elsewhere, Relatives]);
        }
        for wave in waves {
            if self.is_wanted(wave) {
                report(wave.name());
                let seeds = self.seeds(wave);
                self.race(wave, seeds);
            }
        }
    }

    /// At the floor only what promises more than chance is worth a fit.
    fn is_quiet(&self) -> bool {
        self.course.nominal.is_white() || self.course.nominal.levels.iter().all(|l| *l < AT_FLOOR)
    }

    /// Share of the misfit that the best of many hypotheses promises by chance.
    fn chance(&self) -> f64 {
        CHANCE * self.course.nominal.correlation_time / self.samples() as f64
    }

    fn samples(&self) -> usize {
        self.course.nominal.fit.residuals.len()
    }

    fn is_guided(&self) -> bool {
        self.course.along.is_some()
    }

    fn is_done(&self) -> bool {
        done(&self.found, self.course.nominal, self.samples())
    }

    fn best(&self) -> String {
        self.found.first().map_or_else(String::new, |c| key_of(&c.structure.added))
    }

    /// Single effects, what promises most first.
    fn promising(&self) -> Vec<Seed> {
        let (quiet, chance) = (self.is_quiet(), self.chance());
        let mut singles: Vec<Seed> = Vec::new();
        for rank in 0..16 {
            for view in self.views {
                let mut used = HashSet::new();
                let Some(promise) = view.simple.iter().filter(|p| used.insert(p.hypothesis)).nth(rank) else { continue };
                // Those that promise little beside the best wait.
                let top = view.simple.first().map_or(0.0, |p| p.share);
                let wanted = if quiet {
                    rank < 8 && promise.share > chance
                } else {
                    rank < 3 || rank < if self.is_guided() { 14 } else { 8 } && promise.share > 0.5 * top
                };
                if wanted {
                    singles.push(view.seed(vec![(promise.hypothesis, promise.values.clone())]));
                }
            }
        }
        distinct(&mut singles);
        singles
    }

    /// To first order a law may do no more than the nominal model's numbers do together, so that screening sees nothing of it, and still be what is
    /// missing: where little is left over those of one number are fitted whatever they promise.
    fn of_one_number(&self) -> Vec<Seed> {
        let Some(view) = self.views.first().filter(|_| !self.far) else { return Vec::new() };
        let one = |(index, h): (usize, &Hypothesis)| {
            let start = h.starts.first().filter(|start| start.len() == 1)?;
            Some(view.seed(vec![(index, start.clone())]))
        };
        self.course.hypotheses.iter().enumerate().filter_map(one).collect()
    }

    fn is_wanted(&mut self, wave: Wave) -> bool {
        // They are rivals of the best however little it leaves over, and so are laws of one number where it took more.
        let takes_more = |c: &Candidate| c.structure.numbers.len() > self.course.nominal.structure.numbers.len() + 1;
        let of_the_best = matches!(wave, Wave::GivenBack | Wave::Relatives | Wave::Elsewhere)
            || wave == Wave::Plain && self.found.first().is_some_and(takes_more);
        if !of_the_best && self.is_done() {
            return false;
        }
        if self.work.is_past(if of_the_best { 0.85 } else { 0.7 }) {
            self.left_out |= !self.is_done();
            return false;
        }
        if wave == Wave::Elsewhere {
            let law = simplest(&self.found, self.samples()).map_or_else(String::new, |c| key_of(&c.structure.added));
            if law == self.moved_about {
                return false;
            }
            self.moved_about = law;
        }
        wave != Wave::Relatives || self.related != self.best()
    }

    /// What a wave tries.
    fn seeds(&mut self, wave: Wave) -> Vec<Seed> {
        let (course, views, guided, samples) = (self.course, self.views, self.is_guided(), self.samples());
        let Some(view) = views.first() else { return Vec::new() };
        let (hypotheses, found) = (course.hypotheses, &self.found);
        match wave {
            // Along the measured path a ripple slides out of phase.
            Wave::Ripples if guided => {
                let beside = (&course.nominal.structure, &course.nominal.fit.values[..]);
                let seed = |ripple: &(usize, Vec<f64>)| Seed::beside(course.evaluator.problem, beside, vec![ripple.clone()], false);
                self.ripples.iter().take(RIPPLES).map(seed).collect()
            }
            Wave::Ripples => Vec::new(),
            // Those that promise most first: where one of them reaches the floor, the rest have nothing left to explain.
            Wave::First => self.singles.by_ref().take(if guided { 30 } else { 4 }).collect(),
            // Near the noise, where what numbers have taken on is all that a law does.
            Wave::GivenBack if self.far => Vec::new(),
            Wave::GivenBack => course.given_back(&view.simple, self.chance()),
            // Where one law helps another one may be the right one: every law there, from every start.
            Wave::Laws => {
                // Along the measured path what is far off was tried already.
                let near = |c: &&Candidate| !guided || c.fit.cost < NEAR * samples as f64;
                let mut seeds = found.first().filter(near).map_or_else(Vec::new, |best| course.laws(&best.structure, &best.fit.values));
                if !guided {
                    // Without one each costs a fit: those that promise most.
                    let own = |s: &Seed| -> f64 {
                        let promised = |h: &usize| self.tried.iter().find(|t| t.id == hypotheses[*h].id).map_or(0.0, |t| t.promised);
                        s.effects.iter().map(|(h, _)| promised(h)).sum()
                    };
                    seeds.sort_by(|a, b| own(b).total_cmp(&own(a)));
                    distinct(&mut seeds);
                    seeds.truncate(6);
                }
                seeds
            }
            Wave::Singles => self.singles.by_ref().take(if guided { 30 } else { 5 }).collect(),
            Wave::Plain => self.plain.by_ref().collect(),
            Wave::MoreSingles => self.singles.by_ref().collect(),
            // The place that a law was found at first may be a neighbour of its own.
            Wave::Elsewhere => simplest(found, samples).map_or_else(Vec::new, |law| course.elsewhere(law)),
            // How finely a law is drawn is no physics: that comes before another effect.
            Wave::Finer => course.finer(found),
            // A law that wins with more numbers has to win over its simpler relatives, whatever these promised; and far from the noise, where fits were cut
            // short, the first that came near may not be the one.
            Wave::Relatives => course.relatives(found, self.is_done()),
            Wave::Richer => {
                // In the place of what is the best of its kind.
                let best = distinct_structures(found, 1).next().map(|c| &c.structure.added[0]);
                let like = |h: &Hypothesis| {
                    best.is_some_and(|b| b.place.same(&h.place) && matches!(b.physics.family, Family::Friction | Family::Hysteresis))
                };
                let rich = view.rich.iter().find(|p| like(&hypotheses[p.hypothesis]));
                rich.map(|p| view.seed(vec![(p.hypothesis, p.values.clone())])).into_iter().collect()
            }
            Wave::Pairs => {
                self.effects = 2;
                let mut seeds: Vec<Seed> = views.iter().flat_map(|view| view.pairs(hypotheses, 5)).collect();
                for base in distinct_structures(found, 1).take(3) {
                    seeds.extend(course.extensions(view, base, 4));
                }
                seeds
            }
            Wave::MorePairs => distinct_structures(found, 1).take(5).flat_map(|base| course.extensions(view, base, 7)).collect(),
            // A first step may have been the wrong one.
            Wave::Exchanges => {
                let best = found.iter().find(|c| c.structure.added.len() == self.effects);
                best.map_or_else(Vec::new, |best| course.exchanges(view, best, 4))
            }
            Wave::More => {
                self.effects += 1;
                distinct_structures(found, self.effects - 1).take(3).flat_map(|base| course.extensions(view, base, 5)).collect()
            }
            Wave::Anew => {
                let fewer = || distinct_structures(found, self.effects - 1);
                let best = fewer().next();
                // The first step to it may have been the wrong one: so from the best without that, too.
                let without = |first: &Hypothesis| fewer().find(|c| c.structure.added.iter().all(|h| h.physics != first.physics));
                let late = self.work.is_past(0.5);
                let other = best.and_then(|b| b.structure.added.first()).filter(|_| !late).and_then(without);
                // And far from the noise from what does nearly as well with fewer numbers: it leaves more open.
                let has_fewer = |c: &&Candidate| best.is_some_and(|b| c.structure.numbers.len() < b.structure.numbers.len());
                let is_other = |c: &Candidate| other.is_some_and(|o| std::ptr::eq(o, c));
                let plain = simplest_of(fewer(), samples).filter(has_fewer).filter(|c| !is_other(c));
                let mut seeds = Vec::new();
                self.fine = COARSE;
                for base in best.into_iter().chain(other).chain(plain) {
                    let substeps = substeps_for(&view.evaluator, base);
                    self.fine = self.fine.max(substeps);
                    seeds.extend(course.anew(&Evaluator { substeps, ..view.evaluator.clone() }, base, self.work.share(ANEW)));
                }
                seeds
            }
        }
    }

    /// Fits them, and keeps what is worth it.
    fn race(&mut self, wave: Wave, mut seeds: Vec<Seed>) {
        let (evaluator, hypotheses) = (self.course.evaluator, self.course.hypotheses);
        let samples = self.samples();
        // Some start anew beside the numbers of the best, even those whose own race went wrong.
        let anew = matches!(wave, Wave::GivenBack | Wave::Relatives | Wave::Elsewhere | Wave::Finer);
        if !anew {
            distinct(&mut seeds);
        }
        let known: HashSet<String> = self.found.iter().map(|c| key_of(&c.structure.added)).collect();
        seeds.retain(|s| anew || !known.contains(&key_of(s.effects.iter().map(|(h, _)| &hypotheses[*h]))));
        // Where it leaves much over, another effect may be what is missing: other laws in its place have their share of the time, and no more.
        let more_to_come = self.found.first().is_none_or(|c| c.fit.cost > NEAR * samples as f64);
        // A simpler law that does as well is worth a little more than the time.
        let of_the_best = matches!(wave, Wave::Elsewhere | Wave::Relatives);
        let budget = if of_the_best { self.work.up_to(0.92) } else { evaluator.budget.clone() };
        let held_against = evaluator.within(budget.next(self.work.share(if more_to_come { wave.aside() } else { 1.0 })));
        let course = Course { evaluator: &held_against, ..self.course };
        // What only shows beside a law that was found shows little along the path of the nominal model.
        let raced = match wave {
            Wave::Anew => Course { along: None, coarse: self.fine, ..course }.race(seeds, wave.keep()),
            Wave::Finer | Wave::Ripples | Wave::Elsewhere | Wave::Relatives => Course { along: None, ..course }.race(seeds, wave.keep()),
            _ => course.race(seeds, wave.keep()),
        };
        self.found.extend(raced);
        sort(&mut self.found, samples);
        let comes_near = self.found.first().is_some_and(|c| c.levels.iter().all(|l| *l < NOMINAL_END));
        if wave == Wave::Finer && comes_near && !self.work.is_past(0.6) {
            // Before others are tried from the numbers of the best; where it leaves much over, more is missing than a mass.
            let evaluator = evaluator.within(self.work.up_to(0.75).next(self.work.share(REVIVING)));
            let back = polished(&evaluator, self.course.revived(&self.found));
            self.found.extend(back);
            sort(&mut self.found, samples);
        }
        if wave == Wave::Relatives {
            self.related = self.best();
        }
    }
}

/// Fewest substeps per sample with which a simulation errs by less than a structure leaves over.
fn substeps_for(evaluator: &Evaluator, candidate: &Candidate) -> usize {
    let of = |substeps: usize| Evaluator { substeps, ..evaluator.clone() }.residuals(&candidate.structure, &candidate.fit.values);
    let Some(exact) = of(FINEST) else { return MIDDLE };
    let size: f64 = exact.iter().map(|x| x * x).sum();
    let errs = |substeps: &usize| {
        let off = of(*substeps).map_or(f64::INFINITY, |r| r.iter().zip(&exact).map(|(a, b)| (a - b) * (a - b)).sum());
        off > BLUR * size
    };
    [COARSE, MIDDLE, 2 * MIDDLE, 4 * MIDDLE].into_iter().find(|s| !errs(s)).unwrap_or(FINEST)
}

/// The best, or far from the noise, where the law is open as well as its place, what does nearly as well with the fewest numbers.
fn simplest(found: &[Candidate], samples: usize) -> Option<&Candidate> {
    let effects = found.first()?.structure.added.len();
    simplest_of(found.iter().filter(|c| c.structure.added.len() == effects), samples)
}

/// The same of some candidates, best first.
fn simplest_of<'c>(candidates: impl Iterator<Item = &'c Candidate>, samples: usize) -> Option<&'c Candidate> {
    let mut candidates = candidates.peekable();
    let best = candidates.peek().copied()?;
    if best.fit.cost < NEAR * samples as f64 {
        return Some(best);
    }
    candidates.filter(|c| c.fit.cost < TWICE * best.fit.cost).min_by_key(|c| c.structure.numbers.len())
}
