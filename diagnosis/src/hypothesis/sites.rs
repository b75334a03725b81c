//! The places of a device where an effect may be missing.

use super::scales::Scales;
use backdrive_plant::elements::{Law, Role};
use backdrive_plant::model::{Element, InputKind, Model, OutputKind, Place};

/// How two places belong together.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Reach {
    /// A body and ground.
    Ground,
    /// Two bodies that an element joins.
    Joint,
    /// Two bodies with one body between them.
    Apart,
}

/// A pair of places, with what moves and pushes there.
#[derive(Debug, Clone)]
pub(crate) struct Site {
    pub ends: [Place; 2],
    pub between: [String; 2],
    pub reach: Reach,
    /// Indices of the elements there.
    pub elements: Vec<usize>,
    /// Amplitude of the sine of the same rms, and peak, of displacement, m or rad.
    pub displacement: f64,
    pub displacement_peak: f64,
    /// The same of speed and acceleration.
    pub speed: f64,
    pub speed_peak: f64,
    pub acceleration: f64,
    /// Typical force, N or N m.
    pub force: f64,
}

/// The places of a model, with its scales.
pub(crate) struct Sites<'a> {
    pub model: &'a Model,
    pub scales: &'a Scales,
    pub pairs: Vec<Site>,
    kin: Vec<Kin>,
}

/// What an element is to others in the same place.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Kin {
    /// Level of a dry friction at speed, N or N m; `None` of what is none.
    pub level: Option<f64>,
    /// Whether it holds the joint, as a spring does.
    pub holds: bool,
}

/// A dry friction that the model has at a site.
#[derive(Debug, Clone, Copy)]
pub(crate) struct DryFriction {
    /// Its place among the model's elements.
    pub index: usize,
    /// Its kind.
    pub kind: &'static str,
    /// Its level at speed, N or N m.
    pub level: f64,
    /// Whether it has one level at any speed and no memory: a special case of the others.
    plain: bool,
}

impl DryFriction {
    /// Whether it has one level at any speed and no memory.
    pub fn is_plain(&self) -> bool {
        self.plain
    }

    /// The level with which a richer law changes nothing, if there is one: only a plain level is a special case of the others.
    pub fn neutral(&self) -> Option<f64> {
        self.plain.then_some(self.level)
    }
}

impl<'a> Sites<'a> {
    pub fn of(model: &'a Model, scales: &'a Scales, kin: impl Fn(&Law) -> Kin) -> Sites<'a> {
        let n = model.bodies.len();
        let joined = |a: usize, b: usize| model.elements.iter().any(|e| e.between == [Some(a), Some(b)] || e.between == [Some(b), Some(a)]);
        let mut pairs = Vec::new();
        let mut add = |ends: [Place; 2], reach: Reach| {
            if is_seen(model, ends)
                && let Some(site) = Site::new(model, scales, ends, reach)
            {
                pairs.push(site);
            }
        };
        for a in 0..n {
            add([Some(a), None], Reach::Ground);
        }
        for (reach, wanted) in [(Reach::Joint, true), (Reach::Apart, false)] {
            for a in 0..n {
                for b in a + 1..n {
                    let apart = || (0..n).any(|c| c != a && c != b && joined(a, c) && joined(c, b));
                    if joined(a, b) == wanted && (wanted || apart()) {
                        add(ends_as_written(model, a, b), reach);
                    }
                }
            }
        }
        Sites { model, scales, pairs, kin: model.elements.iter().map(|e| kin(&e.law)).collect() }
    }

    /// Bodies against ground, and joints.
    pub fn near(&self) -> impl Iterator<Item = &Site> {
        self.pairs.iter().filter(|s| s.reach != Reach::Apart)
    }

    pub fn elements_at<'s>(&'s self, site: &'s Site) -> impl Iterator<Item = (usize, &'a Element)> + 's {
        site.elements.iter().map(|i| (*i, &self.model.elements[*i]))
    }

    /// The first element of one of these kinds at a site.
    pub fn first_of(&self, site: &Site, kinds: &[&str]) -> Option<(usize, &'a Element)> {
        self.elements_at(site).find(|(_, e)| kinds.contains(&e.law.kind().name))
    }

    pub fn has(&self, site: &Site, kinds: &[&str]) -> bool {
        self.first_of(site, kinds).is_some()
    }

    /// The first dry friction at a site.
    pub fn dry_friction(&self, site: &Site) -> Option<DryFriction> {
        self.elements_at(site).find_map(|(index, element)| {
            let (level, kind) = (self.kin[index].level?, element.law.kind().name);
            // One parameter is its level.
            let plain = element.law.kind().parameters.len() == 1;
            Some(DryFriction { index, kind, level, plain })
        })
    }

    /// Whether a friction there jumps with the sign of the velocity.
    pub fn has_set_valued(&self, site: &Site) -> bool {
        self.elements_at(site).any(|(_, e)| matches!(e.law.role(), Role::Friction))
    }

    /// Whether a friction there is loaded by a joint: between two bodies by what holds these two, between a body and ground by what holds the body.
    pub fn is_loaded(&self, site: &Site) -> bool {
        if site.reach != Reach::Ground {
            return self.holding(site).is_some();
        }
        let tied = |e: &Element| e.between.iter().flatten().any(|body| site.ends.contains(&Some(*body)));
        self.model.elements.iter().zip(&self.kin).any(|(e, kin)| kin.holds && tied(e))
    }

    /// The first element that holds the joint, as a spring does.
    pub fn holding(&self, site: &Site) -> Option<(usize, &'a Element)> {
        self.elements_at(site).find(|(index, _)| self.kin[*index].holds)
    }
}

/// The ends in the order that the file gives them.
fn ends_as_written(model: &Model, a: usize, b: usize) -> [Place; 2] {
    let written = model.elements.iter().map(|e| e.between).find(|ends| ends.contains(&Some(a)) && ends.contains(&Some(b)));
    written.unwrap_or([Some(a), Some(b)])
}

impl Site {
    /// `None` where nothing moves.
    fn new(model: &Model, scales: &Scales, ends: [Place; 2], reach: Reach) -> Option<Site> {
        let [x, v, a] = scales.motion(ends);
        let force = scales.force(model, ends);
        let moves = [x.rms, v.rms, a.rms, force].iter().all(|s| s.is_finite() && *s > 0.0);
        let same = |other: &[Place; 2]| *other == ends || *other == [ends[1], ends[0]];
        moves.then(|| Site {
            ends,
            between: ends.map(|end| model.place_name(end).to_string()),
            reach,
            elements: (0..model.elements.len()).filter(|i| same(&model.elements[*i].between)).collect(),
            displacement: x.rms * std::f64::consts::SQRT_2,
            displacement_peak: x.peak,
            speed: v.rms * std::f64::consts::SQRT_2,
            speed_peak: v.peak,
            acceleration: a.rms * std::f64::consts::SQRT_2,
            force: force * std::f64::consts::SQRT_2,
        })
    }

    /// `drum_ground`, for names.
    pub fn label(&self) -> String {
        format!("{}_{}", self.between[0], self.between[1])
    }
}

/// Whether a force between two places shows in any output: whether it moves a free body that an output depends on, or
/// loads a body whose reaction is read.
pub(crate) fn is_seen(model: &Model, ends: [Place; 2]) -> bool {
    let is_moved = |body: usize| model.inputs.iter().any(|i| i.kind == InputKind::Motion && i.on == body);
    let mut reached = vec![false; model.bodies.len()];
    let mut front: Vec<usize> = ends.into_iter().flatten().collect();
    while let Some(body) = front.pop() {
        if std::mem::replace(&mut reached[body], true) || is_moved(body) {
            continue;
        }
        front.extend(model.elements.iter().filter(|e| e.between.contains(&Some(body))).flat_map(|e| e.between).flatten());
    }
    let free = |body: usize| reached[body] && !is_moved(body);
    model.outputs.iter().any(|output| match &output.kind {
        OutputKind::Position(body) | OutputKind::Velocity(body) | OutputKind::Acceleration(body) => free(*body),
        OutputKind::Force(elements) => {
            elements.iter().filter_map(|e| model.elements.get(*e)).any(|e| e.between.into_iter().flatten().any(free))
        }
        OutputKind::Reaction(body) => reached[*body],
    })
}
