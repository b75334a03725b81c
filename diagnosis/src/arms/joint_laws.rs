//! Every law that the torque of one joint may hold, as columns (regressors) beside those of its links and of the elements that the model has there.

use crate::arms::fit::{Structure, TOLERANCES, Weights};
use crate::arms::offers::PRESLIDING;
use crate::arms::physics::{At, Physics, Term};
use crate::arms::regression::Data;
use crate::equation_error::explore::{Chosen, LawColumns, Same};
use crate::equation_error::gram::{Gram, Left, Sum};
use crate::hypothesis::Family;
use crate::tuning::tuning;
use nalgebra::DMatrix;
use std::ops::Range;

/// Of the variance that the file leaves a change of the bodies, the share that the logs have to determine for it to be a column.
const DETERMINED: f64 = 0.03;
/// How far the factor of what is linear only at its own shape may be from 1.
const UNIT: Range<f64> = 0.5..2.0;

/// The shortest stretch that is left out, s.
const SHORTEST: f64 = 1.0;
/// Shapes of a law that are fitted.
const FITTED: usize = 3;

/// A law at a joint: terms with each choice of their shapes.
pub(crate) struct JointLaw {
    /// The terms of each choice, the one that names the law last.
    pub variants: Vec<Vec<Term>>,
    /// The columns of each.
    columns: Vec<Vec<usize>>,
    numbers: usize,
}

impl JointLaw {
    /// Its name in a verdict.
    pub fn name(&self) -> &'static str {
        let both = self.variants.first().is_some_and(|terms| terms.len() > 1);
        match self.named().map(|t| t.physics) {
            Some(Physics::Coulomb) if both => "asymmetric_coulomb",
            Some(physics) => physics.facts().name,
            None => "",
        }
    }

    /// The effect by which it is named.
    pub fn named(&self) -> Option<&Term> {
        self.variants.first().and_then(|terms| terms.last())
    }
}

/// Laws at a joint and the rows of its torque in a band.
pub(crate) struct JointRoom {
    /// The laws.
    pub laws: Vec<JointLaw>,
    gram: Gram,
    base: Vec<usize>,
    /// Columns of the base whose factor cannot be below 0.
    positive: Vec<usize>,
    /// Stretches of the fitted logs.
    pub stretches: usize,
    /// The viscous friction of the base.
    damper: Option<usize>,
}

/// Rows of a joint over all logs, and the stretches of these that are left out in turn.
struct Rows {
    of_joint: Vec<Range<usize>>,
    stretches: Vec<Range<usize>>,
    /// How many of the stretches are of fitted logs.
    fitted: usize,
    /// How many rows are.
    seen: usize,
}

impl Rows {
    fn of(data: &Data, joint: usize) -> Rows {
        let mut at = 0;
        let (mut stretches, mut fitted, mut seen) = (Vec::new(), 0, 0);
        let of_joint: Vec<Range<usize>> = (0..data.motions.len()).map(|m| data.layout.of(m, joint)).collect();
        for (m, rows) in of_joint.iter().enumerate() {
            let len = rows.len();
            // Not shorter than what a filter smears, and long beside what one reversal is.
            let seconds = len as f64 * data.rates.row_period();
            let n = tuning().equation_error.stretches.min((seconds / SHORTEST) as usize).max(1);
            stretches.extend((0..n).map(|k| at + k * len / n..at + (k + 1) * len / n).filter(|range| !range.is_empty()));
            at += len;
            if m < data.fit_count {
                (fitted, seen) = (stretches.len(), at);
            }
        }
        Rows { of_joint, stretches, fitted, seen }
    }

    fn taken(&self, column: &[f64]) -> Vec<f64> {
        self.of_joint.iter().flat_map(|rows| column.get(rows.clone()).into_iter().flatten().copied()).collect()
    }
}

impl JointRoom {
    /// All laws of a pool that act at a joint. `base`: what the joint has besides: elements of the model, and effects of the arm as a whole.
    pub fn of(data: &Data, base: &Structure, pool: &[Term], joint: usize, weights: &Weights) -> JointRoom {
        let rows = Rows::of(data, joint);
        let left: Vec<f64> = data.torque.iter().zip(&data.nominal).map(|(y, p)| y - p).collect();
        let mut columns = vec![rows.taken(&left)];
        let variance = weights.sd[joint].powi(2) * weights.time[joint];
        let tolerance = TOLERANCES.get(base.tolerance).copied().unwrap_or(1.0);
        columns.extend(determined(data, &rows, tolerance, variance));
        let bodies = 1..columns.len();
        let (mut positive, mut damper) = (Vec::new(), None);
        let add = |term: &Term, columns: &mut Vec<Vec<f64>>| -> Option<Vec<usize>> {
            let own: Vec<Vec<f64>> = data.columns(term, &base.slip).iter().map(|c| rows.taken(c)).collect();
            let shows = own.iter().all(|c| c.iter().take(rows.seen).any(|x| *x != 0.0));
            (shows && !own.is_empty()).then(|| {
                let first = columns.len();
                columns.extend(own);
                (first..columns.len()).collect()
            })
        };
        for term in &base.terms {
            let Some(own) = add(term, &mut columns) else { continue };
            if term.physics.facts().positive {
                positive.extend(own.first());
            }
            if term.physics == Physics::Damper && term.at == At::Joint(joint) {
                damper = own.first().copied();
            }
        }
        let base_columns = (1..columns.len()).collect();
        let mut laws = Vec::new();
        for variants in laws_at(data, base, pool, joint) {
            let numbers = variants.first().map_or(0, |terms| terms.iter().map(|t| t.physics.facts().numbers).sum());
            let (mut own, mut kept) = (Vec::new(), Vec::new());
            for terms in variants {
                let of_terms: Option<Vec<Vec<usize>>> = terms.iter().map(|term| add(term, &mut columns)).collect();
                if let Some(of_terms) = of_terms {
                    own.push(of_terms.concat());
                    kept.push(terms);
                }
            }
            laws.push(JointLaw { variants: kept, columns: own, numbers });
        }
        let mut gram = Gram::of(&columns, &rows.stretches, rows.fitted);
        for column in bodies {
            gram.expect_near_zero(column, tolerance, variance);
        }
        JointRoom { laws, gram, base: base_columns, positive, stretches: rows.fitted, damper }
    }

    fn sum(&self, laws: &[Chosen]) -> Sum {
        let own = laws.iter().flat_map(|(law, variant)| self.laws[*law].columns[*variant].iter().copied());
        let mut sum = Sum { target: vec![0], by: self.base.iter().copied().chain(own).collect() };
        // A falling friction is not a negative viscous one.
        loop {
            let Some((factors, _)) = self.gram.fit(&sum) else { return sum };
            let is_wrong = |(column, factor): (&usize, &f64)| self.positive.contains(column) && *factor < 0.0;
            let Some(wrong) = sum.by.iter().zip(&factors).position(is_wrong) else { return sum };
            sum.by.remove(wrong);
        }
    }

    /// What laws leave, torque squared; `None` where a parameter is none that the law can have.
    fn fit(&self, laws: &[Chosen]) -> Option<f64> {
        let sum = self.sum(laws);
        let (factors, left) = self.gram.fit(&sum)?;
        let of = |column: usize| sum.by.iter().position(|c| *c == column).and_then(|at| factors.get(at)).copied();
        for (law, variant) in laws {
            let mut own = self.laws[*law].columns[*variant].iter();
            let terms = self.laws[*law].variants.get(*variant)?;
            for term in terms {
                let value = of(*own.next()?)?;
                let more = crate::arms::physics::columns_of(term).saturating_sub(1);
                own.by_ref().take(more).for_each(drop);
                let facts = term.physics.facts();
                let unit = match (term.physics, term.shape.first()) {
                    (Physics::Compliance, Some(stiffness)) => stiffness * value,
                    (Physics::Backlash, Some(gap)) => value / gap,
                    _ => 1.0,
                };
                let level = self.damper.and_then(of).unwrap_or(0.0);
                let is_wrong = facts.positive && value <= 0.0
                    || term.physics == Physics::LoadFriction && value >= 1.0
                    || term.physics == Physics::AsymmetricDamper && value.abs() > level
                    || !UNIT.contains(&unit);
                if is_wrong {
                    return None;
                }
            }
        }
        Some(left)
    }

    fn family(&self, law: usize) -> Option<Family> {
        self.laws[law].named().map(|t| t.physics.facts().family)
    }

    fn terms(&self, law: usize) -> &[Term] {
        self.laws[law].variants.first().map_or(&[], Vec::as_slice)
    }

    fn has(&self, law: usize, physics: Physics) -> bool {
        self.laws[law].named().is_some_and(|t| t.physics == physics)
    }
}

impl LawColumns for JointRoom {
    fn count(&self) -> usize {
        self.laws.len()
    }

    fn numbers(&self, law: usize) -> usize {
        self.laws[law].numbers
    }

    /// One dry friction, one spring or constant, one gear.
    fn go_together(&self, a: usize, b: usize) -> bool {
        let (Some(x), Some(y)) = (self.laws[a].named(), self.laws[b].named()) else { return false };
        let both = |is: &dyn Fn(&Term) -> bool| is(x) && is(y);
        let rubs = |t: &Term| t.physics.facts().family == Family::Friction;
        let has_constant = |law: usize| self.terms(law).iter().any(|t| matches!(t.physics, Physics::Bias | Physics::Spring));
        let is_gear = |t: &Term| matches!(t.physics, Physics::Compliance | Physics::Backlash | Physics::Delay);
        let exclude = x.is_like(y) || both(&rubs) || both(&is_gear) || has_constant(a) && has_constant(b);
        a != b && !exclude
    }

    /// Of many shapes those are fitted that take most of what the others leave.
    fn best_beside(&self, others: &[Chosen], law: usize) -> Option<Chosen> {
        let one = |variant: usize| {
            let laws: Vec<Chosen> = others.iter().copied().chain([(law, variant)]).collect();
            Some(((law, variant), self.fit(&laws)?))
        };
        let own = &self.laws[law].columns;
        let order = if own.len() > FITTED { self.gram.ranked(&self.sum(others), own) } else { (0..own.len()).collect() };
        order.into_iter().filter_map(one).take(FITTED).min_by(|a, b| a.1.total_cmp(&b.1)).map(|(chosen, _)| chosen)
    }

    fn left(&self, laws: &[Chosen]) -> Option<Left> {
        self.gram.left(&self.sum(laws))
    }

    fn mean_product(&self, a: &Left, b: &Left) -> Vec<f64> {
        self.gram.mean_product(a, b)
    }

    fn is_same(&self, law: usize, other: usize, same: Same) -> bool {
        let (Some(own), Some(there)) = (self.laws[law].named(), self.laws[other].named()) else { return false };
        let holds = own.physics == Physics::Bias && there.physics == Physics::Spring;
        holds
            || match same {
                Same::Law => own.is_like(there) && self.laws[law].numbers == self.laws[other].numbers,
                Same::Kind => self.family(law) == self.family(other),
            }
    }

    /// Beside a spring of free zero dry friction by direction is dry friction.
    fn same_force(&self, laws: &[usize], law: usize) -> Option<usize> {
        let holds = laws.iter().any(|other| self.has(*other, Physics::Spring));
        (holds && self.has(law, Physics::Coulomb)).then_some(law)
    }
}

/// The changes of the bodies that the torque of a joint shows, where the file leaves them this tolerance.
fn determined(data: &Data, rows: &Rows, tolerance: f64, variance: f64) -> Vec<Vec<f64>> {
    let all: Vec<Vec<f64>> = data.inertial.iter().map(|c| rows.taken(c)).filter(|c| c.iter().any(|x| *x != 0.0)).collect();
    let part = DMatrix::from_fn(rows.seen, all.len(), |row, column| all[column][row]);
    let eigen = (part.tr_mul(&part)).symmetric_eigen();
    let shows = |k: &usize| eigen.eigenvalues[*k] * tolerance * tolerance > DETERMINED * variance;
    let along = |k: usize| {
        let factors = eigen.eigenvectors.column(k);
        let rows = all.first().map_or(0, Vec::len);
        (0..rows).map(|row| all.iter().zip(factors.iter()).map(|(c, f)| c[row] * f).sum()).collect()
    };
    (0..all.len()).filter(shows).map(along).collect()
}

/// The laws of a pool that act at a joint, each with its choices of shapes.
fn laws_at(data: &Data, base: &Structure, pool: &[Term], joint: usize) -> Vec<Vec<Vec<Term>>> {
    let is_there = |physics: Physics| base.terms.iter().any(|t| t.physics == physics && t.at == At::Joint(joint));
    let level = |physics: Physics| {
        let term = Term::new(physics, At::Joint(joint), Vec::new());
        (!is_there(physics) && pool.iter().any(|t| t.is_like(&term))).then_some(term)
    };
    let mut out: Vec<Vec<Vec<Term>>> = Vec::new();
    for term in pool.iter().filter(|t| acts_at(t, joint) && !base.terms.iter().any(|own| own.is_like(t))) {
        let is_sharp = term.physics == Physics::Presliding && term.shape.first().is_some_and(|d| *d < PRESLIDING * data.first_slip(joint));
        if is_sharp {
            continue;
        }
        let with = match term.physics {
            Physics::Stribeck | Physics::LoadFriction => level(Physics::Coulomb),
            Physics::AsymmetricDamper => level(Physics::Damper),
            _ => None,
        };
        if term.physics == Physics::LoadFriction && with.is_some() {
            out.push(vec![vec![term.clone()]]);
        }
        // Friction by direction is one law, and no more than one of many.
        if let Some(constant) = level(Physics::Bias).filter(|_| term.physics == Physics::Coulomb) {
            out.push(vec![vec![constant, term.clone()]]);
        }
        let terms: Vec<Term> = with.into_iter().chain([term.clone()]).collect();
        let is_other_shape = |variants: &&mut Vec<Vec<Term>>| {
            variants.first().and_then(|v| Some((v.len(), v.last()?))).is_some_and(|(count, own)| {
                count == terms.len() && own.is_like(term) && own.shape.len() == term.shape.len() && !term.shape.is_empty()
            })
        };
        match out.iter_mut().find(is_other_shape) {
            Some(variants) => variants.push(terms),
            None => out.push(vec![terms]),
        }
    }
    out
}

/// Whether a term is a law of this joint's own torque. Others are of the bodies, of what they are read with, or of two joints: several torques show those, or
/// only what is known of the bodies speaks for them.
pub(crate) fn acts_at(term: &Term, joint: usize) -> bool {
    term.at == At::Joint(joint) && !matches!(term.physics, Physics::Inertia | Physics::Gain | Physics::Offset)
}
