//! Where a fit of a joint with a body in it starts. A model without that body has already made the joint as soft, and its ends as heavy, as both springs
//! and the body together look from outside (static condensation: Guyan 1965). With these absorbed values the body would count twice. So a start
//! re-initialises them: the joint's own spring is stiffer, the ends are lighter, and slow motion is the same as before.

use super::types::{Form, Hypothesis};
use crate::physics::physics_named;
use crate::recordings::problem::Stated;
use crate::tuning::tuning;
use backdrive_plant::model::{InputKind, Model};

/// A start of a joint with a body in it.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Condensed {
    /// Paths of parameters that the model states, and their values at this start, SI units.
    pub stated: Vec<(String, f64)>,
    /// Values of the hypothesis.
    pub values: Vec<f64>,
}

impl Hypothesis {
    /// Starts of a hypothesis that puts a body into a joint; none of any other. `stated` gives the value of a parameter of the model by its path.
    /// `absorbed` states whether that value is a fitted one, which is restored to what it was before it absorbed the body, or one that knows nothing of the
    /// body.
    pub(crate) fn condensed(&self, model: &Model, stated: &dyn Fn(&str) -> Option<f64>, absorbed: bool) -> Vec<Condensed> {
        let Form::Series { joint, .. } = &self.form else { return Vec::new() };
        let ends = joint.each_ref().map(|name| model.bodies.iter().position(|b| b.name == *name));
        let springs = springs(model, ends, stated);
        let stiffness: f64 = springs.iter().map(|(_, k)| k).sum();
        // A body that an input moves has no inertia to give, and neither has ground.
        let moved = |body: usize| model.inputs.iter().any(|i| i.kind == InputKind::Motion && i.on == body);
        let inertia = |end: Option<usize>| {
            let path = format!("bodies.{}", model.bodies.get(end?)?.name);
            let own = stated(&path).filter(|own| *own > 0.0 && end.is_some_and(|body| !moved(body)))?;
            Some((path, own))
        };
        let ends = ends.map(inertia);
        let lightest = ends.iter().flatten().map(|(_, own)| *own).fold(f64::INFINITY, f64::min);
        // Where no spring holds the joint, nothing was absorbed that would have to be re-initialised.
        if !lightest.is_finite() || stiffness <= 0.0 {
            return Vec::new();
        }
        let mut starts = Vec::new();
        for part in tuning().search.condensed_inertia {
            let inertia = part * lightest;
            for softness in tuning().search.condensed_softness {
                let (near, far) = match absorbed {
                    // Both springs in a row are as soft as the joint was.
                    true => (stiffness / (1.0 - softness), stiffness / softness),
                    false => (stiffness, stiffness * (1.0 - softness) / softness),
                };
                let damping = 2.0 * tuning().search.condensed_damping * ((near + far) * inertia).sqrt();
                let mut given = Vec::new();
                for (path, own) in springs.iter().filter(|_| absorbed) {
                    given.push((path.clone(), own * near / stiffness));
                }
                // The body moves with each end as far as that end's spring holds it.
                for (end, share) in ends.iter().filter(|_| absorbed).zip([near, far].map(|k| k / (near + far))) {
                    if let Some((path, own)) = end {
                        given.push((path.clone(), (own - share * inertia).max(0.1 * own)));
                    }
                }
                let values = [far, damping, inertia].iter().zip(&self.parameters).map(|(x, p)| x.clamp(p.range.0, p.range.1)).collect();
                starts.push(Condensed { stated: given, values });
            }
        }
        starts
    }
}

/// Stiffnesses that hold a joint, by path and fitted value.
fn springs(model: &Model, ends: [Option<usize>; 2], stated: &dyn Fn(&str) -> Option<f64>) -> Vec<(String, f64)> {
    let holds = |name: &str| physics_named(name).is_some_and(|p| p.facts.holds);
    let there = model.elements.iter().filter(|e| e.between == ends || e.between == [ends[1], ends[0]]).filter(|e| holds(e.law.kind().name));
    let path = |name: &str| format!("elements.{name}.stiffness");
    there.filter_map(|e| Some((path(&e.name), stated(&path(&e.name)).filter(|k| *k > 0.0)?))).collect()
}

impl Hypothesis {
    /// Whether fits of it start from sizes all over its range: not where it is another resolved more finely.
    pub(crate) fn is_scanned(&self) -> bool {
        self.physics.facts.scanned && !self.id.contains(':')
    }

    /// The starts that are scanned: all of a body that the model lacks, for nothing is known of it; else the first.
    pub(crate) fn scanned_from(&self) -> impl Iterator<Item = &Vec<f64>> {
        let count = if matches!(self.form, Form::Hung { .. }) { usize::MAX } else { 1 };
        self.starts.iter().take(count)
    }

    /// Stated values beside a start of this hypothesis: the body that it hangs on has its inertia of what was stated for both.
    pub(crate) fn given_back(&self, paths: &[Stated], stated: &[f64], values: &[f64]) -> Vec<f64> {
        let mut given = stated.to_vec();
        if let (Form::Hung { on, .. }, Some(inertia)) = (&self.form, values.last())
            && let Some(at) = paths.iter().position(|s| s.path == format!("bodies.{on}"))
            && let Some(own) = given.get_mut(at)
        {
            *own = (*own - inertia).max(LEAST_LEFT * *own);
        }
        given
    }
}

/// Share of an inertia that is left to a body at least when another takes of it.
const LEAST_LEFT: f64 = 0.1;
