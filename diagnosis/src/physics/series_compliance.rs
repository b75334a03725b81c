//! A compliance left out: another body in a joint, behind a spring and a damper.

use crate::hypothesis::builder::{Freedom, log, series};
use crate::hypothesis::sites::Site;
use crate::hypothesis::{Against, Facts, Family, Mark, Physics, State};
use backdrive_plant::model::{Element, InputKind, Model};

pub(super) const PHYSICS: Physics = Physics {
    name: "series_compliance",
    family: Family::Compliance,
    words: "a compliance in series",
    size: "stiffness",
    against: Against::Displacement,
    state: State::WithItsVariable,
    mark: Mark::Soft,
    facts: Facts::NONE,
    propose: |sites| {
        let joints = sites.pairs.iter().filter(|site| !site.elements.is_empty());
        let one = |site: &Site| {
            let (k, b) = (site.force / site.displacement, site.force / site.speed);
            let own = site.ends.iter().flatten().map(|body| sites.model.bodies[*body].inertia).filter(|m| *m > 0.0);
            let lightest = own.fold(f64::INFINITY, f64::min);
            let m = if lightest.is_finite() { lightest } else { site.force / site.acceleration };
            let damping = Freedom { log: false, ..log(0.0, 1000.0 * b) };
            let freedoms = [log(1e-2 * k, 1e5 * k), damping, log(1e-4 * m, 100.0 * m)];
            let start = |stiffness: f64, inertia: f64| {
                // A damping ratio of 0.05.
                vec![stiffness * k, 0.1 * (stiffness * k * inertia * m).sqrt(), inertia * m]
            };
            let starts = vec![start(3.0, 0.1), start(1.0, 0.5), start(30.0, 0.1), start(0.3, 1.0)];
            // The original elements stay on the first body's side, so each side may be first.
            let [a, b] = site.between.clone();
            let joints = [([a.clone(), b.clone()], site.ends[1]), ([b, a], site.ends[0])].into_iter();
            let held = joints.filter(|(_, left)| left.is_none_or(|body| keeps_inertia(sites.model, site, body)));
            held.map(|(joint, _)| series(sites, &PHYSICS, joint, freedoms, starts.clone())).collect::<Vec<_>>()
        };
        joints.flat_map(one).collect()
    },
};

/// Whether a body still has inertia when the elements of a site are taken off it.
fn keeps_inertia(model: &Model, site: &Site, body: usize) -> bool {
    let moved = model.inputs.iter().any(|i| i.kind == InputKind::Motion && i.on == body);
    let inerter =
        |(i, e): (usize, &Element)| !site.elements.contains(&i) && e.law.kind().name == "inerter" && e.between.contains(&Some(body));
    moved || model.bodies[body].inertia > 0.0 || model.elements.iter().enumerate().any(inerter)
}
