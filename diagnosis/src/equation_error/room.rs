//! Every law that can be examined on forces along a motion, as columns (regressors) beside those of the nominal model's own parameters.

use super::explore::{Chosen, LawColumns, Same};
use super::gram::{Gram, Left, Sum};
use crate::hypothesis::{Family, ForceSpan, Hypothesis, Run, Scales, Seen, apply_edits};
use crate::output_error::simulate::predict;
use crate::output_error::structure::{Role, Structure};
use crate::physics::{self, contains};
use crate::recordings::problem::{Problem, Record};
use crate::tuning::tuning;
use backdrive_plant::model::Model;
use backdrive_plant::write::Edit;
use rayon::prelude::*;
use std::collections::HashSet;
use std::ops::Range;

/// A law, or a few that act in combination, with each choice of nonlinear parameters.
pub(crate) struct Law {
    /// Which of the hypotheses.
    pub hypotheses: Vec<usize>,
    /// The choices.
    variants: Vec<Variant>,
    /// The column of what it takes the place of.
    shift: Option<usize>,
    /// Columns of the nominal model's parameters that it replaces.
    drops: Vec<usize>,
    /// Numbers that it adds.
    pub numbers: usize,
}

struct Variant {
    spans: Vec<ForceSpan>,
    columns: Vec<usize>,
}

/// Hypotheses, which of [`Room::hypotheses`], with their parameters.
pub(crate) type Fitted = Vec<(usize, Vec<f64>)>;

/// Laws and recordings in a band.
pub(crate) struct Room {
    /// The recordings in the band.
    pub problem: Problem,
    /// Corner of the band, Hz.
    pub corner: f64,
    /// Physics at their places.
    pub hypotheses: Vec<Hypothesis>,
    /// Laws of those.
    pub laws: Vec<Law>,
    gram: Gram,
    base: Vec<Stated>,
}

/// A free parameter of the nominal model.
struct Stated {
    path: String,
    given: f64,
    /// Whether it cannot be below 0.
    positive: bool,
    /// The column of what one more of it adds.
    column: usize,
    /// The column of all that it adds as given: what is to be explained without it.
    without: usize,
}

/// How far the model moves and pushes on the recordings.
fn scales(problem: &Problem) -> Option<Scales> {
    let runs: Vec<Run> = problem.fit.iter().map(Run::from).collect();
    let largest = |output: usize| {
        let samples = problem.fit.iter().filter_map(|r| r.outputs.get(output)?.as_deref()).flatten();
        samples.fold(0.0f64, |most, y| most.max(y.abs()))
    };
    let measured: Vec<f64> = (0..problem.model.outputs.len()).map(largest).collect();
    let mut scales = Scales::of(&problem.model, &runs).ok()?.with_measured(&problem.model, &measured);
    scales.reads_drive = problem.inverse.is_some();
    Some(scales)
}

fn seen(problem: &Problem) -> Seen {
    let motions = || problem.fit.iter().filter_map(|r| r.inputs.first().map(|q| (q, r.period)));
    let (low, high) = motions().flat_map(|(q, _)| q).fold((f64::MAX, f64::MIN), |(l, h), q| (l.min(*q), h.max(*q)));
    let mut speeds: Vec<f64> = motions().flat_map(|(q, period)| q.windows(2).map(move |p| (p[1] - p[0]).abs() / period)).collect();
    speeds.sort_by(f64::total_cmp);
    Seen { travel: high - low, speeds, period: problem.fit.first().map_or(1.0, |r| r.period) }
}

/// What may be missing and can be looked at on forces.
fn hypotheses(problem: &Problem, without: &[String]) -> Option<Vec<Hypothesis>> {
    let withheld: Vec<&str> = without.iter().map(String::as_str).collect();
    let mut all = physics::without(physics::all(&problem.model, &scales(problem)?), &withheld);
    let mut classes = HashSet::new();
    all.retain(|h| {
        let is_number = h.same_as.as_ref().is_some_and(|path| problem.stated.iter().any(|s| s.path == *path));
        !is_number && classes.insert(h.class.clone())
    });
    Some(all)
}

/// Samples of the records that are compared, and the stretches that are left out in turn.
struct Compared {
    /// Which samples of each record, fitted and held out.
    which: Vec<Vec<usize>>,
    stretches: Vec<Range<usize>>,
    /// How many of the stretches are of fitted records.
    fitted: usize,
    samples: usize,
}

/// Those that are fitted, then those that no fit sees.
fn records(problem: &Problem) -> impl Iterator<Item = &Record> {
    problem.fit.iter().chain(&problem.held_out)
}

impl Compared {
    fn of(problem: &Problem, corner: f64, seen: &Seen) -> Compared {
        let tuning = &tuning().equation_error;
        let period = problem.fit.first().map_or(1.0, |r| r.period);
        let every = ((1.0 / (period * tuning.compared * corner)) as usize).max(1);
        let at_rest = tuning.at_rest * seen.speed(0.9);
        let (mut which, mut stretches, mut fitted, mut at) = (Vec::new(), Vec::new(), 0, 0);
        for (index, record) in records(problem).enumerate() {
            let motion = record.inputs.first().map_or(&[][..], Vec::as_slice);
            // Dry friction of a body at rest is anything up to its level, whatever its law.
            let moves = |i: &usize| {
                let (before, after) = (motion.get(i.saturating_sub(1)), motion.get(i + 1));
                before.zip(after).is_none_or(|(before, after)| (after - before).abs() > 2.0 * period * at_rest)
            };
            let own: Vec<usize> = (0..record.len).step_by(every).filter(moves).collect();
            let (len, n) = (own.len(), tuning.stretches);
            stretches.extend((0..n).map(|k| at + k * len / n..at + (k + 1) * len / n).filter(|range| !range.is_empty()));
            at += len;
            which.push(own);
            if index < problem.fit.len() {
                fitted = stretches.len();
            }
        }
        Compared { which, stretches, fitted, samples: at }
    }

    /// Those of a signal of a record.
    fn taken(&self, record: usize, signal: &[f64]) -> Vec<f64> {
        self.which.get(record).into_iter().flatten().filter_map(|i| signal.get(*i)).copied().collect()
    }

    /// Forces of a model along all records.
    fn forces(&self, problem: &Problem, model: &Model) -> Option<Vec<f64>> {
        let mut all = Vec::with_capacity(self.samples);
        for (index, record) in records(problem).enumerate() {
            all.extend(self.taken(index, &predict(model, record, problem.coarse_substeps())?));
        }
        Some(all)
    }
}

impl Room {
    /// All that can be looked at in a band; `None` where the nominal model cannot be run along the motion.
    pub fn of(problem: &Problem, corner: f64, without: &[String]) -> Option<Room> {
        let problem = super::band::in_band(problem, corner);
        let seen = seen(&problem);
        let compared = Compared::of(&problem, corner, &seen);
        let nominal = Structure::new(&problem, &problem.fit, Vec::new());
        let given: Vec<f64> = problem.stated.iter().map(|s| s.given).collect();
        let start = nominal.values(&problem, &given, &[], &[]);
        let model = nominal.model(&problem, &start)?;
        let there = compared.forces(&problem, &model)?;
        let measured = records(&problem).enumerate().flat_map(|(index, r)| {
            let force = r.outputs.iter().flatten().next().map_or(&[][..], Vec::as_slice);
            compared.taken(index, force)
        });
        let minus = |a: &[f64], b: &[f64]| -> Vec<f64> { a.iter().zip(b).map(|(a, b)| a - b).collect() };
        let mut columns: Vec<Vec<f64>> = vec![measured.zip(&there).map(|(y, p)| y - p).collect()];
        let mut base: Vec<Stated> = Vec::new();
        for (number, value) in nominal.free.iter().zip(&start) {
            let Role::Stated(stated) = number.role else { continue };
            let step = if *value == 0.0 { number.step } else { 1e-3 * value.abs() };
            let mut moved = start.clone();
            let at = nominal.free.iter().position(|n| n.role == number.role)?;
            *moved.get_mut(at)? += step;
            let Some(forces) = nominal.model(&problem, &moved).and_then(|m| compared.forces(&problem, &m)) else { continue };
            let column: Vec<f64> = minus(&forces, &there).into_iter().map(|d| d / step).collect();
            if column.iter().any(|x| *x != 0.0) {
                let stated = problem.stated.get(stated)?;
                let without = column.iter().map(|x| x * value).collect();
                base.push(Stated {
                    path: stated.path.clone(),
                    given: *value,
                    positive: stated.log,
                    column: columns.len(),
                    without: columns.len() + 1,
                });
                columns.extend([column, without]);
            }
        }
        let hypotheses = hypotheses(&problem, without)?;
        let mut laws: Vec<Law> = Vec::new();
        for (index, h) in hypotheses.iter().enumerate() {
            let spans = (h.physics.facts.spans)(h, &seen);
            if spans.is_empty() {
                continue;
            }
            let without = if h.replaces.is_empty() { model.clone() } else { without_elements(&model, &h.replaces)? };
            let rest = if h.replaces.is_empty() { there.clone() } else { compared.forces(&problem, &without)? };
            let shift = (!h.replaces.is_empty()).then(|| {
                columns.push(minus(&there, &rest));
                columns.len() - 1
            });
            let is_dropped = |path: &str| h.replaces.iter().any(|name| path.starts_with(&format!("elements.{name}.")));
            let drops = base.iter().filter(|number| is_dropped(&number.path)).map(|number| number.column).collect();
            let of = |values: &Vec<f64>| Some(minus(&compared.forces(&problem, &h.apply(&model, values).ok()?)?, &rest));
            let forces: Vec<Option<Vec<Vec<f64>>>> = spans.par_iter().map(|span| span.values.iter().map(of).collect()).collect();
            let mut variants = Vec::new();
            for (span, forces) in spans.into_iter().zip(forces) {
                let Some(forces) = forces.filter(|all| all.iter().all(|f| f.iter().any(|x| *x != 0.0))) else { continue };
                variants.push(Variant { columns: (columns.len()..columns.len() + forces.len()).collect(), spans: vec![span] });
                columns.extend(forces);
            }
            laws.push(Law { hypotheses: vec![index], variants, shift, drops, numbers: h.parameters.len() + h.physics.facts.fixed });
        }
        with_their_zero(&hypotheses, &mut laws);
        let gram = Gram::of(&columns, &compared.stretches, compared.fitted);
        Some(Room { problem, corner, hypotheses, laws, gram, base })
    }

    /// The effect by which a law is named.
    pub fn named(&self, law: usize) -> &Hypothesis {
        &self.hypotheses[self.laws[law].hypotheses[0]]
    }

    fn sum(&self, laws: &[Chosen]) -> Sum {
        let law = |(law, _): &Chosen| &self.laws[*law];
        let target = std::iter::once(0).chain(laws.iter().filter_map(|chosen| law(chosen).shift)).collect();
        let dropped = |column: &usize| laws.iter().any(|chosen| law(chosen).drops.contains(column));
        let own = laws.iter().flat_map(|(law, variant)| self.laws[*law].variants[*variant].columns.iter().copied());
        let base = self.base.iter().map(|number| number.column);
        self.within_reason(Sum { target, by: base.filter(|column| !dropped(column)).chain(own).collect() })
    }

    /// The same without parameters of the nominal model that would come out below 0 and cannot: a falling friction is not a negative viscous one.
    fn within_reason(&self, mut sum: Sum) -> Sum {
        loop {
            let Some((factors, _)) = self.gram.fit(&sum) else { return sum };
            let is_wrong = |number: &&Stated| {
                let at = sum.by.iter().position(|column| *column == number.column);
                number.positive && at.and_then(|at| factors.get(at)).is_some_and(|factor| number.given + factor < 0.0)
            };
            let Some(wrong) = self.base.iter().find(is_wrong) else { return sum };
            sum.by.retain(|column| *column != wrong.column);
            sum.target.push(wrong.without);
        }
    }

    /// What laws leave, force squared, and the parameters of the hypotheses of each; `None` where one of those is out of its range.
    pub fn fit(&self, laws: &[Chosen]) -> Option<(f64, Fitted)> {
        let sum = self.sum(laws);
        let (factors, left) = self.gram.fit(&sum)?;
        let own: usize = laws.iter().map(|(law, variant)| self.laws[*law].variants[*variant].columns.len()).sum();
        let mut factors = factors.get(sum.by.len() - own..)?;
        let mut all = Vec::new();
        for (law, variant) in laws {
            let (law, variant) = (&self.laws[*law], &self.laws[*law].variants[*variant]);
            for (h, span) in law.hypotheses.iter().zip(&variant.spans) {
                let (now, rest) = factors.split_at_checked(span.values.len())?;
                factors = rest;
                let values = (span.sum)(now, &span.values);
                let hypothesis = &self.hypotheses[*h];
                let inside = |(p, v): (&crate::hypothesis::Parameter, &f64)| v.is_finite() && (p.range.0..=p.range.1).contains(v);
                if !hypothesis.parameters.iter().zip(&values).all(inside) || !self.is_written_so(hypothesis, &values) {
                    return None;
                }
                all.push((*h, values));
            }
        }
        Some((left, all))
    }

    /// Whether a model can hold these values as they are: where they contradict each other, they are another law's.
    fn is_written_so(&self, hypothesis: &Hypothesis, values: &[f64]) -> bool {
        let model = &self.problem.model;
        let Some(written) = hypothesis.apply(model, values).ok().and_then(|edited| hypothesis.values_in(&edited, model)) else {
            return false;
        };
        written.iter().zip(values).all(|(a, b)| (a - b).abs() <= 1e-6 * b.abs().max(f64::MIN_POSITIVE))
    }
}

impl LawColumns for Room {
    fn count(&self) -> usize {
        self.laws.len()
    }

    fn numbers(&self, law: usize) -> usize {
        self.laws[law].numbers
    }

    /// At one place one dry friction, one constant, one hold.
    fn go_together(&self, a: usize, b: usize) -> bool {
        let own = |law: usize| self.laws[law].hypotheses.iter().map(|h| &self.hypotheses[*h]);
        let alike = |x: &Hypothesis, y: &Hypothesis| {
            let rub = |h: &Hypothesis| h.physics.family == Family::Friction;
            let lopsided = |h: &Hypothesis| h.physics.facts.twin.is_some() || h.physics.family == Family::Bias;
            x.id == y.id || x.place.same(&y.place) && rub(x) && rub(y) || lopsided(x) && lopsided(y) || !x.compatible(y)
        };
        a != b && own(a).all(|x| own(b).all(|y| !alike(x, y)))
    }

    /// A richer law at the place of one of `laws` that is the same force beside the rest of them: what it has more is a constant, and so is the free zero of a
    /// spring. No motion separates the two.
    fn same_force(&self, laws: &[usize], law: usize) -> Option<usize> {
        let own = self.named(law);
        let has_zero = |other: &usize| {
            *other != law && self.laws[*other].hypotheses.iter().skip(1).any(|h| self.hypotheses[*h].physics.family == Family::Bias)
        };
        let is_same = |other: &usize| {
            let other = self.named(*other);
            other.physics.facts.twin.is_some() && contains(other.physics, own.physics) && other.place.same(&own.place)
        };
        if laws.iter().any(has_zero) { (0..self.laws.len()).find(is_same) } else { None }
    }

    fn left(&self, laws: &[Chosen]) -> Option<Left> {
        self.gram.left(&self.sum(laws))
    }

    fn mean_product(&self, a: &Left, b: &Left) -> Vec<f64> {
        self.gram.mean_product(a, b)
    }

    fn is_same(&self, law: usize, other: usize, same: Same) -> bool {
        let contains = self.laws[other].hypotheses.contains(&self.laws[law].hypotheses[0]);
        contains
            || match same {
                Same::Law => other == law,
                Same::Kind => self.named(other).physics.family == self.named(law).physics.family,
            }
    }

    fn best_beside(&self, others: &[Chosen], law: usize) -> Option<Chosen> {
        let one = |variant: usize| {
            let laws: Vec<Chosen> = others.iter().copied().chain([(law, variant)]).collect();
            Some(((law, variant), self.fit(&laws)?.0))
        };
        (0..self.laws[law].variants.len()).filter_map(one).min_by(|a, b| a.1.total_cmp(&b.1)).map(|(chosen, _)| chosen)
    }
}

/// A spring begins at a zero of its own, so each is looked at with a constant beside it.
fn with_their_zero(hypotheses: &[Hypothesis], laws: &mut [Law]) {
    let is_constant = |law: &&Law| hypotheses[law.hypotheses[0]].physics.family == Family::Bias;
    let Some((constant, span)) = laws.iter().find(is_constant).and_then(|law| {
        let variant = law.variants.first()?;
        Some(((law.hypotheses[0], variant.columns.clone()), variant.spans.first()?.clone()))
    }) else {
        return;
    };
    for law in laws.iter_mut().filter(|law| hypotheses[law.hypotheses[0]].physics.facts.holds) {
        law.hypotheses.push(constant.0);
        law.numbers += 1;
        for variant in &mut law.variants {
            variant.columns.extend(&constant.1);
            variant.spans.push(span.clone());
        }
    }
}

fn without_elements(model: &Model, names: &[String]) -> Option<Model> {
    let mut edited = model.clone();
    let edits: Vec<Edit> = names.iter().map(|name| Edit::RemoveElement { name: name.clone() }).collect();
    apply_edits(&mut edited, &edits).ok()?;
    Some(edited)
}
