//! Friction of many contacts that slip one after the other: presliding hysteresis with non-local memory.

use crate::hypothesis::builder::{ElementBuilder, log};
use crate::hypothesis::{Against, Facts, Family, Hypothesis, Mark, Parameter, Physics, State};

/// Sliders that are fitted, and the word that sets the hypothesis apart: few enough to be tried at every place, then many enough for the shape of a loop.
const SLIDERS: [(usize, &str); 2] = [(3, ""), (5, "fine")];

/// Factor between the slips of what was one slider, to either side.
const APART: f64 = 1.5;

pub(super) const PHYSICS: Physics = Physics {
    name: "maxwell_slip",
    family: Family::Friction,
    words: "presliding hysteresis (Maxwell slip)",
    size: "force",
    against: Against::Displacement,
    state: State::Reversals,
    mark: Mark::Memory,
    facts: Facts {
        sliding: &["force"],
        from_level: &["force"],
        memory: true,
        refine: |coarse, values, finer| match coarse.physics == finer.physics {
            true => split(coarse, values, finer),
            false => spread(coarse, values, finer),
        },
        contains: &["coulomb"],
        ..Facts::NONE
    },
    propose: |sites| {
        let one = |site, (count, tag): (usize, &'static str)| {
            let new = ElementBuilder::new(sites, &PHYSICS, site)?;
            let (f, x) = (site.force, site.displacement);
            let (new, stated) = new.in_place_of_friction(site)?;
            let c = stated.map_or(0.1 * f, |there| there.level);
            let most = 20.0 * f.max(c);
            let mut force = log(1e-7 * f, most);
            force.neutral = stated.is_none().then_some(1e-7 * f);
            let new = new.tag(tag).list("stiffness", count, log(1e-4 * f / x, 1e6 * f / x)).list("force", count, force);
            // Equal sliders that slip after distances in even ratios.
            let start = |first: f64, last: f64| {
                let each = c / count as f64;
                let slip = |i: usize| x * first * f64::powf(last / first, i as f64 / (count - 1) as f64);
                (0..count).map(|i| each / slip(i)).chain(std::iter::repeat_n(each, count)).collect::<Vec<f64>>()
            };
            Some(new.starts(vec![start(0.003, 0.3), start(0.03, 1.0), start(0.0003, 0.03)]))
        };
        SLIDERS.iter().flat_map(|sliders| sites.near().filter_map(|site| one(site, *sliders))).collect()
    },
};

/// Values with which `finer`, this law at the same place with more sliders, nearly reproduces `coarse`: those that carry most are parted in two, one that
/// slips earlier and one that slips later. The number of sliders is the resolution of a loop, not another effect.
fn split(coarse: &Hypothesis, values: &[f64], finer: &Hypothesis) -> Option<Vec<f64>> {
    let (from, to) = (values.len() / 2, finer.parameters.len() / 2);
    if values.len() != coarse.parameters.len() || !(from < to && to <= 2 * from) {
        return None;
    }
    let mut sliders: Vec<[f64; 2]> = (0..from).map(|i| [values[i], values[from + i]]).collect();
    sliders.sort_by(|a, b| b[1].total_cmp(&a[1]));
    let halves = |[stiffness, force]: [f64; 2]| [[0.5 * APART * stiffness, 0.5 * force], [0.5 / APART * stiffness, 0.5 * force]];
    let (most, rest) = sliders.split_at(to - from);
    let all: Vec<[f64; 2]> = most.iter().flat_map(|slider| halves(*slider)).chain(rest.iter().copied()).collect();
    let lists = [0, 1].map(|key| all.iter().map(|slider| slider[key]).collect::<Vec<f64>>());
    let within = |(p, v): (&Parameter, f64)| v.clamp(p.range.0, p.range.1);
    Some(finer.parameters.iter().zip(lists.concat()).map(within).collect())
}

/// Values with which sliders pull at first loading as one bristle of `coarse` does, a force that nears its level exponentially: the corners of a
/// polygon on that curve.
fn spread(coarse: &Hypothesis, values: &[f64], finer: &Hypothesis) -> Option<Vec<f64>> {
    let number = |key: &str| coarse.parameters.iter().zip(values).find(|(p, _)| p.key == key).map(|(_, v)| *v);
    let (stiffness, level) = (number("stiffness")?, number("coulomb")?);
    let count = finer.parameters.len() / 2;
    // Corners at which even shares of the level are reached, short of it, where the last slider slips.
    let reach = |corner: usize| corner as f64 / (count as f64 + 0.25);
    let corners: Vec<[f64; 2]> = (0..=count).map(|i| [-(1.0 - reach(i)).ln() * level / stiffness, reach(i) * level]).collect();
    let slopes: Vec<f64> = corners.windows(2).map(|w| (w[1][1] - w[0][1]) / (w[1][0] - w[0][0])).chain([0.0]).collect();
    let whole = 1.0 / reach(count);
    let sliders = slopes.windows(2).zip(corners.iter().skip(1)).map(|(s, c)| [whole * (s[0] - s[1]), whole * (s[0] - s[1]) * c[0]]);
    let (stiffnesses, forces): (Vec<f64>, Vec<f64>) = sliders.map(|[k, f]| (k, f)).unzip();
    let within = |(p, v): (&Parameter, f64)| v.clamp(p.range.0, p.range.1);
    let start: Vec<f64> = finer.parameters.iter().zip(stiffnesses.into_iter().chain(forces)).map(within).collect();
    start.iter().all(|v| v.is_finite()).then_some(start)
}
