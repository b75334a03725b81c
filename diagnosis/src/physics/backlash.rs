//! A joint with play: it stands in the place of the joint's spring and damper.

use crate::hypothesis::builder::{ElementBuilder, even, first_value};
use crate::hypothesis::{Against, Facts, Family, Hypothesis, Mark, Parameter, Physics, State};

/// The word that sets a play with round edges apart.
const ROUND: &str = "round";

pub(super) const PHYSICS: Physics = Physics {
    name: "backlash",
    family: Family::Contact,
    words: "backlash",
    size: "gap",
    against: Against::Displacement,
    state: State::Contact,
    mark: Mark::Gap,
    facts: Facts {
        memory: true,
        holds: true,
        refine: |coarse, values, finer| (coarse.physics == finer.physics).then(|| blunted(values, finer)).flatten(),
        // With no gap it is a spring and a damper.
        contains: &["spring"],
        ..Facts::NONE
    },
    propose: |sites| {
        let one = |site, round: bool| {
            // Play without a shaft is nothing.
            let (index, spring) = sites.first_of(site, &["spring"])?;
            let damper = sites.first_of(site, &["damper"]);
            let new = ElementBuilder::new(sites, &PHYSICS, site)?.replacing(index).removing(damper.map(|(i, _)| i));
            let (k, b) = (first_value(&spring.law).max(0.0), damper.map_or(0.0, |(_, d)| first_value(&d.law).max(0.0)));
            let (x, typical) = (site.displacement, site.force / site.displacement);
            let new = new
                .number("gap", even(0.0, 4.0 * site.displacement_peak, 0.0))
                .number("stiffness", even(0.0, 1000.0 * k.max(typical), k))
                .number("damping", even(0.0, 1000.0 * b.max(site.force / site.speed), b));
            let new = if round { new.tag(ROUND).number("rounding", even(0.0, 4.0 * site.displacement_peak, 0.0)) } else { new };
            // The spring as refitted has the joint's deflection at the forces that act: of that a gap takes a share, and the shaft is as much stiffer.
            let shared = |share: f64| vec![2.0 * share * site.displacement_peak, k / (1.0 - share), b];
            let mut starts = vec![vec![0.2 * x, k, b], shared(0.5), vec![0.02 * x, k, b], shared(0.8), vec![x, k, b]];
            if round {
                starts.iter_mut().for_each(|start| start.push(BLUNT * start[0]));
            }
            Some(new.starts(starts))
        };
        [false, true].into_iter().flat_map(|round| sites.near().filter_map(move |site| one(site, round))).collect()
    },
};

/// Rounding that a fit starts from, in a gap.
const BLUNT: f64 = 0.2;

/// A sharp play as fitted, its edges a little blunt: how sharp they are is how finely it is resolved, and no other physics.
fn blunted(values: &[f64], finer: &Hypothesis) -> Option<Vec<f64>> {
    let [gap, ..] = values else { return None };
    let start: Vec<f64> = values.iter().copied().chain(std::iter::once(BLUNT * gap)).collect();
    let within = |(p, v): (&Parameter, f64)| v.clamp(p.range.0, p.range.1);
    (start.len() == finer.parameters.len()).then(|| finer.parameters.iter().zip(start).map(within).collect())
}
