//! Parameters that have all but vanished, brought back.

use crate::candidate::{Candidate, distinct_structures};
use crate::race::Course;
use crate::structure::Structure;
use crate::tuning::tuning;

/// The best, and what does nearly as well with as many effects, where some of their parameters have all but vanished, and where to start: with a mass
/// shared with the neighbour that took it on, where no mass is gone with the other parameters as given. Searched in logarithms, a number near 0 moves
/// nothing any more, so that a fit that took a body's mass away does not give it back.
pub(super) fn revived(course: &Course, found: &[Candidate]) -> Vec<(Structure, Vec<f64>)> {
    let problem = course.evaluator.problem;
    let Some(best) = found.first() else { return Vec::new() };
    let near = |c: &&Candidate| c.fit.cost < tuning().search.as_good * best.fit.cost;
    let mut all = Vec::new();
    for c in distinct_structures(found, best.structure.added.len()).filter(near).take(tuning().search.revived) {
        let mut stated = c.structure.stated_of(problem, &c.fit.values);
        let mut gone: Vec<usize> = (0..stated.len())
            .filter(|i| problem.stated[*i].log && stated[*i] < tuning().search.vanished * problem.stated[*i].range.0)
            .collect();
        // A damper or a spring may vanish beside a law that was found; a body does not.
        let is_mass = |i: &usize| problem.stated[*i].body(&problem.model).is_some();
        if gone.iter().any(is_mass) {
            gone.retain(is_mass);
        }
        for &i in &gone {
            // Mass that one body lost another has taken on: the two share it as they did.
            match heir(course, &stated, i) {
                Some(heir) => {
                    let (own, other) = (problem.stated[i].given, problem.stated[heir].given);
                    let both = stated[i] + stated[heir];
                    (stated[i], stated[heir]) = (both * own / (own + other), both * other / (own + other));
                }
                None => stated[i] = problem.stated[i].given,
            }
        }
        if !gone.is_empty() {
            let added = c.structure.added_of(&c.fit.values);
            all.push((c.structure.clone(), c.structure.values(problem, &stated, &added, &c.structure.of_records(&c.fit.values))));
        }
    }
    all
}

/// Of the bodies joined to one whose mass is a stated number, the number of the mass that has grown most.
fn heir(course: &Course, stated: &[f64], gone: usize) -> Option<usize> {
    let problem = course.evaluator.problem;
    let body = problem.stated[gone].body(&problem.model);
    body?;
    let joined = |other: usize| problem.model.elements.iter().any(|e| e.between.contains(&body) && e.between.contains(&Some(other)));
    let growth = |i: &usize| stated[*i] / problem.stated[*i].given;
    let others = (0..stated.len()).filter(|i| *i != gone && problem.stated[*i].body(&problem.model).is_some_and(joined));
    others.filter(|i| growth(i) > 1.0).max_by(|a, b| growth(a).total_cmp(&growth(b)))
}
