//! What an element's law is in MuJoCo: attributes that joints and tendons have in common.
//!
//! MuJoCo 4.0, XML reference, `joint` and `tendon`: a spring `-(a x + b x² + c x³)` outside of a dead band, elastic until it yields; a damper
//! `-(a v + b v |v| + c v³)`; dry friction; inertia.

use backdrive_plant::elements::{Backlash, BoucWen, Contact, Coulomb, Damper, HuntCrossley, Law, MaxwellSlip, Spring};

/// An end of a dead band that is never reached, m or rad.
pub(super) const NEVER: f64 = 1e10;

/// Attributes that joints and tendons have in common, and a constant force. `x` and `v` are across the element.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub(super) struct Passive {
    /// Of `x`, `x²` and `x³`, N/m, N/m² and N/m³.
    pub stiffness: [f64; 3],
    /// Between which displacements the spring is slack, m.
    pub slack: [f64; 2],
    /// Stretch at which the spring gives way, m; 0 where it never does.
    pub yields: f64,
    /// Of `v`, `v |v|` and `v³`, N s/m and so on.
    pub damping: [f64; 3],
    /// N.
    pub friction: f64,
    /// kg.
    pub inertia: f64,
    /// N, positive as an element's force is.
    pub constant: f64,
}

impl Passive {
    /// Whether it has a spring.
    pub(super) fn has_spring(&self) -> bool {
        self.stiffness != [0.0; 3]
    }

    /// Whether a joint can have it: a spring with one rest, which does not yield.
    pub(super) fn fits_a_joint(&self) -> bool {
        self.slack[0] == self.slack[1] && self.yields == 0.0
    }
}

/// A law in MuJoCo's attributes, exactly: the parts add up. `None` where there are none.
pub(super) fn exactly(law: &Law) -> Option<Vec<Passive>> {
    let none = Passive::default();
    let one = match law {
        Law::Spring(l) => Passive { stiffness: [l.stiffness, 0.0, 0.0], slack: [l.rest; 2], ..none },
        Law::Damper(l) => Passive { damping: [l.damping, 0.0, 0.0], ..none },
        Law::Inerter(l) => Passive { inertia: l.inertance, ..none },
        Law::Coulomb(l) => Passive { friction: l.force, ..none },
        // Between -c- and c+ at rest, as the sum is.
        Law::AsymmetricCoulomb(l) => {
            Passive { friction: 0.5 * (l.positive + l.negative), constant: 0.5 * (l.positive - l.negative), ..none }
        }
        Law::QuadraticDrag(l) => Passive { damping: [0.0, l.coefficient, 0.0], ..none },
        Law::CubicSpring(l) => Passive { stiffness: [l.stiffness, 0.0, l.cubic], ..none },
        Law::Bias(l) => Passive { constant: l.force, ..none },
        Law::Contact(l) if l.damping == 0.0 => Passive { stiffness: [l.stiffness, 0.0, 0.0], slack: [-NEVER, l.gap], ..none },
        Law::HuntCrossley(l) if l.damping == 0.0 => {
            let mut stiffness = [0.0; 3];
            let power = [1.0, 2.0, 3.0].iter().position(|n| *n == l.exponent)?;
            stiffness[power] = l.stiffness;
            Passive { stiffness, slack: [-NEVER, l.gap], ..none }
        }
        Law::Backlash(l) if l.damping == 0.0 && l.rounding == 0.0 => {
            Passive { stiffness: [l.stiffness, 0.0, 0.0], slack: [-0.5 * l.gap, 0.5 * l.gap], ..none }
        }
        Law::MaxwellSlip(l) => {
            let sliders = l.stiffness.iter().zip(&l.force).filter(|(_, force)| **force > 0.0);
            return Some(sliders.map(|(k, f)| Passive { stiffness: [*k, 0.0, 0.0], yields: f / k, ..none }).collect());
        }
        _ => return None,
    };
    Some(vec![one])
}

/// Why MuJoCo cannot have a law exactly, and what is nearest to it, with what that is in words.
pub(super) fn nearest(law: &Law) -> (String, Option<(Law, String)>) {
    let coulomb = |force: f64, what: &str| Some((Law::Coulomb(Coulomb { force }), format!("Coulomb friction of {what}")));
    let only = "MuJoCo's dry friction has one level";
    match law {
        Law::Stribeck(l) => (format!("{only}, which does not fall with speed"), coulomb(l.coulomb, "its level at speed")),
        Law::FrictionDeficit(l) => (format!("{only}, which does not rise with speed"), coulomb(l.coulomb, "its level at speed")),
        Law::LoadFriction(l) => (format!("{only}, which no load changes"), coulomb(l.force, "its level without load")),
        Law::GearLoss(_) => (format!("{only}, which no load changes"), None),
        Law::WarmFriction(l) => (format!("{only}, which does not fall as it warms"), coulomb(l.force, "its level when cold")),
        Law::Dahl(l) => {
            let slider = MaxwellSlip::new(vec![l.stiffness], vec![l.coulomb]).ok();
            let instead = slider.map(|slip| (Law::MaxwellSlip(slip), "a spring of its stiffness that gives way at its level".to_owned()));
            ("MuJoCo's springs give way at once, bristles bit by bit".to_owned(), instead)
        }
        Law::Lugre(l) => (format!("{only} and no bristles"), coulomb(l.coulomb, "its level at speed")),
        Law::PreisachLugre(l) => (format!("{only} and no bristles"), coulomb(l.coulomb, "its level at speed")),
        Law::AsymmetricDamper(l) => {
            let damping = 0.5 * (l.positive + l.negative);
            let instead = (Law::Damper(Damper { damping }), "a damper of the mean of both directions".to_owned());
            ("MuJoCo's dampers are alike in both directions".to_owned(), Some(instead))
        }
        Law::Contact(l) => {
            let law = Law::Contact(Contact { damping: 0.0, ..l.clone() });
            ("MuJoCo's dampers act before touch as well".to_owned(), Some((law, "the same contact without its damping".to_owned())))
        }
        Law::HuntCrossley(l) if [1.0, 2.0, 3.0].contains(&l.exponent) => {
            let law = Law::HuntCrossley(HuntCrossley { damping: 0.0, ..l.clone() });
            ("MuJoCo's dampers do not grow with depth".to_owned(), Some((law, "the same contact without its damping".to_owned())))
        }
        Law::HuntCrossley(_) => ("MuJoCo's springs are polynomials, so that the exponent has to be 1, 2 or 3".to_owned(), None),
        Law::Backlash(l) => {
            let law = Law::Backlash(Backlash { damping: 0.0, rounding: 0.0, ..l.clone() });
            (
                "MuJoCo's dead bands are sharp, and its dampers act inside them".to_owned(),
                Some((law, "a sharp gap without damping".to_owned())),
            )
        }
        Law::BoucWen(l) => ("MuJoCo's springs give way at once, and not bit by bit".to_owned(), bouc_wen(l)),
        Law::HystereticSpring(l) => {
            let stiffness = 0.5 * (l.stiffness_positive + l.stiffness_negative);
            let offset = 0.5 * (l.offset_positive + l.offset_negative);
            let law = Law::Spring(Spring { stiffness, rest: if stiffness == 0.0 { 0.0 } else { -offset / stiffness } });
            ("MuJoCo has no such memory of the path".to_owned(), Some((law, "the spring midway between its two lines".to_owned())))
        }
        Law::Cogging(_) => ("no spring of MuJoCo repeats with position".to_owned(), None),
        other => (format!("MuJoCo has no {}", other.kind().name.replace('_', " ")), None),
    }
}

/// Yields that are never reached, as a multiple of what an ordinary one is, m or rad.
const NEVER_YIELDS: f64 = 1e9;

/// A spring that is the elastic share, and one beside it that gives way where z comes to its bound.
fn bouc_wen(l: &BoucWen) -> Option<(Law, String)> {
    let bound = (l.amplitude / (l.beta + l.gamma)).powf(1.0 / l.exponent);
    let (slips, stays) = ((1.0 - l.ratio) * l.stiffness * l.amplitude, l.ratio * l.stiffness);
    let springs = [(slips, (1.0 - l.ratio) * l.stiffness * bound), (stays, stays * NEVER_YIELDS)];
    let (stiffness, force) = springs.into_iter().filter(|(k, _)| *k > 0.0).unzip();
    let law = MaxwellSlip::new(stiffness, force).ok()?;
    Some((Law::MaxwellSlip(law), "its elastic part, in parallel with a spring that yields at its bound".to_owned()))
}
