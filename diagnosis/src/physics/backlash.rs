//! A joint with backlash: it replaces the joint's spring and damper, or holds a load that the model does not have.

use crate::hypothesis::builder::{ElementBuilder, any, even, first_value, hung, log};
use crate::hypothesis::sites::{Reach, Site, Sites};
use crate::hypothesis::{Against, Facts, Family, Hypothesis, Mark, Parameter, Physics, State};
use backdrive_plant::model::InputKind;

/// The word that distinguishes a backlash with a rounded contact law.
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
        scanned: true,
        refine: |coarse, values, finer| match (coarse.physics == finer.physics, coarse.physics.name) {
            (true, _) => blunted(values, finer),
            (false, "series_compliance") => loosened(values, finer),
            (false, _) => None,
        },
        // With no gap it is a spring and a damper, or a load behind them.
        contains: &["spring", "series_compliance"],
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
            // The joint of a model without play hardly opens; a play is at most as wide as its ends move.
            let moves = site.ends.iter().filter(|end| end.is_some()).map(|end| reversal(sites, *end));
            let widest = moves.fold(f64::INFINITY, f64::min).max(4.0 * site.displacement_peak);
            // Sides that lose nothing bounce, and where they meet next hangs on everything: a start has a damping ratio of a few per cent at least.
            let masses = site.ends.iter().flatten().map(|body| sites.model.bodies[*body].inertia).filter(|m| *m > 0.0);
            let (own, b) = (b, b.max(LOSS * (k * masses.fold(f64::INFINITY, f64::min)).sqrt()));
            let b = if b.is_finite() { b } else { own };
            let new = new
                .number("gap", even(0.0, widest, 0.0))
                .number("stiffness", even(0.0, 1000.0 * k.max(typical), k))
                .number("damping", even(0.0, 1000.0 * b.max(site.force / site.speed), own));
            let new = if round { new.tag(ROUND).number("rounding", even(0.0, widest, 0.0)) } else { new };
            // The spring as refitted has the joint's deflection at the forces that act: of that a gap takes a share, and the shaft is as much stiffer.
            let shared = |share: f64| vec![2.0 * share * site.displacement_peak, k / (1.0 - share), b];
            let mut starts = vec![vec![0.2 * x, k, b], shared(0.5), vec![0.02 * x, k, b], shared(0.8), vec![x, k, b]];
            if round {
                starts.iter_mut().for_each(|start| start.push(BLUNT * start[0]));
            }
            Some(new.starts(starts))
        };
        let joints = [false, true].into_iter().flat_map(|round| sites.near().filter_map(move |site| one(site, round)));
        joints.chain(sites.pairs.iter().filter_map(|site| behind(sites, site))).collect()
    },
};

/// A load that the model does not have, behind a play: of a body that nothing but ground holds and no input moves.
fn behind(sites: &Sites, site: &Site) -> Option<Hypothesis> {
    let (Some(body), true) = (site.ends[0], site.reach == Reach::Ground) else { return None };
    let model = sites.model;
    let joined = model.elements.iter().any(|e| e.between.contains(&Some(body)) && e.between.iter().flatten().count() == 2);
    let moved = model.inputs.iter().any(|i| i.kind == InputKind::Motion && i.on == body);
    let own = model.bodies[body].inertia;
    if joined || moved || own <= 0.0 {
        return None;
    }
    let (moves, force) = (reversal(sites, Some(body)), site.force);
    // As stiff as lets its sides give way by a hundredth of the motion, or by far less.
    let soft = force / moves;
    let keys =
        [("gap", any(0.0, moves)), ("stiffness", log(soft, 1e7 * soft)), ("damping", any(0.0, 1000.0 * (100.0 * soft * own).sqrt()))];
    let start = |share: f64, stiff: f64| {
        let k = stiff * soft;
        vec![OPEN * moves, k, LOSS * (k * share * own).sqrt(), share * own]
    };
    hung(
        sites,
        &PHYSICS,
        &site.between[0],
        &keys,
        log(1e-2 * own, 100.0 * own),
        vec![start(0.5, FIRM), start(0.8, FIRM), start(0.5, 10.0), start(0.5, 100.0), start(0.8, 100.0), start(0.5, 1e4)],
    )
}

/// How far a body moves between two reversals, at most: a motor that turns on and on crosses its play when it is turned round. Of an oscillation it is the amplitude.
fn reversal(sites: &Sites, body: Option<usize>) -> f64 {
    let [x, v, a] = sites.scales.motion([body, None]);
    let turned = v.rms * v.rms / a.rms;
    if turned.is_finite() { x.peak.min(2.0 * turned) } else { x.peak }
}

/// Twice the damping ratio of the sides that a fit starts from, at least.
const LOSS: f64 = 0.1;

/// Rounding that a fit starts from, in a gap.
const BLUNT: f64 = 0.2;

/// Share of what its body moves that a load's play is at first, and how much firmer its sides are than the force over that motion.
const OPEN: f64 = 0.05;
const FIRM: f64 = 1e3;

/// A load behind a compliance as fitted, with a play that opens as far as the spring gave way and sides twice as firm. `None` where `finer` is no load behind a play.
fn loosened(values: &[f64], finer: &Hypothesis) -> Option<Vec<f64>> {
    let ([stiffness, damping, inertia], [open, firm, ..]) = (values, finer.starts.first()?.as_slice()) else { return None };
    let force = open / OPEN * firm / FIRM;
    let start = [force / stiffness, 2.0 * stiffness, *damping, *inertia];
    let within = |(p, v): (&Parameter, f64)| v.clamp(p.range.0, p.range.1);
    (finer.parameters.last()?.key == "inertia").then(|| finer.parameters.iter().zip(start).map(within).collect())
}

/// A sharp backlash as fitted, its contact slightly rounded. Its sharpness is a matter of resolution, not another effect.
fn blunted(values: &[f64], finer: &Hypothesis) -> Option<Vec<f64>> {
    let [gap, ..] = values else { return None };
    let start: Vec<f64> = values.iter().copied().chain(std::iter::once(BLUNT * gap)).collect();
    let within = |(p, v): (&Parameter, f64)| v.clamp(p.range.0, p.range.1);
    (start.len() == finer.parameters.len()).then(|| finer.parameters.iter().zip(start).map(within).collect())
}
