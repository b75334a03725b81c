//! The sentences of a verdict.

use crate::arms::judge::AGAINST;
use crate::verdict::{ArmJoint, ArmPart, Finding, Remaining, Where, Word};

/// The remaining residual, and the joint at which it is largest.
pub(crate) fn remaining(arm: &ArmPart) -> Remaining {
    let of = |f: fn(&ArmJoint) -> f64| arm.joints.iter().map(|j| f(j).powi(2)).sum::<f64>().sqrt();
    let share = |x: f64| (of(|j| j.refit) > 0.0).then(|| x / of(|j| j.refit));
    let above = |j: &ArmJoint| Some(j.moving? / j.noise.filter(|n| *n > 0.0)?);
    let worst = arm.joints.iter().filter(|j| j.shows.is_some()).max_by(|a, b| a.moving.unwrap_or(0.0).total_cmp(&b.moving.unwrap_or(0.0)));
    Remaining {
        share: share(of(|j| j.diagnosed)),
        floor_share: share(of(|j| j.noise.unwrap_or(0.0))),
        noise_sd: arm.joints.iter().filter_map(above).reduce(f64::max),
        not_repeated: None,
        shows: worst.and_then(|j| j.shows.clone()),
        looks_like: None,
    }
}

/// Of a joint at which much remains that nothing explains: how much, and where it shows.
pub fn unexplained(joint: &ArmJoint) -> Option<String> {
    let Where { band_hz: [_, high], state, .. } = joint.shows.as_ref()?;
    let state = state.as_deref().unwrap_or_default();
    let (share, noise) = (joint.moving?, joint.noise?);
    Some(format!(
        "at {} {:.1} % of the torque during motion (sensor noise: {:.1} %): {state}; 90 % of its power is below {}",
        joint.joint,
        100.0 * share,
        100.0 * noise,
        hertz(*high)
    ))
}

fn hertz(f: f64) -> String {
    if f < 1.0 { format!("{f:.2} Hz") } else { format!("{f:.1} Hz") }
}

/// The verdict in a sentence.
pub(crate) fn sentence(word: Word, findings: &[Finding], arm: &ArmPart, held: bool, unsigned: &[&str]) -> String {
    // What a simulation or held-out torque speaks against is not asserted beside others.
    let against = |f: &&Finding| f.confidence <= 0.5 || f.closed_loop.is_some_and(|ratio| ratio > AGAINST);
    let asserted: Vec<&Finding> = match findings.iter().all(|f| against(&f)) {
        true => findings.iter().collect(),
        false => findings.iter().filter(|f| !against(f)).collect(),
    };
    let named: Vec<String> = asserted.iter().map(|f| format!("{} {}", words(&f.physics), crate::verdict::words::place(&f.place))).collect();
    let unseen = if held { "held-out" } else { "fitted" };
    let left: Vec<String> = arm.joints.iter().map(|j| format!("{:.1} %", 100.0 * j.diagnosed)).collect();
    let before: Vec<String> = arm.joints.iter().map(|j| format!("{:.1} %", 100.0 * j.refit)).collect();
    let tail = format!("of the {unseen} torque {} remain unexplained, by joint", left.join(", "));
    let open: Vec<String> = arm.joints.iter().filter_map(unexplained).collect();
    let mut besides = if open.is_empty() { String::new() } else { format!(" No tested effect explains {}.", open.join("; ")) };
    if !unsigned.is_empty() {
        besides += &format!(" Nothing is claimed at {}: its torque was logged without its sign.", unsigned.join(", "));
    }
    match word {
        Word::Missing => format!("The model leaves out {}; {tail} (without: {}).{besides}", named.join(", "), before.join(", ")),
        Word::Ambiguous => {
            let other = findings.first().and_then(|f| f.alternatives.first());
            let named = named.join(", ");
            let open = match other {
                Some(a) => {
                    let other = format!("{} {}", words(&a.physics), crate::verdict::words::place(&a.place));
                    format!("leaves out {named}, or {other} instead of the first, which these logs do not separate")
                }
                None => format!("may leave out {named}, but held-out torque or a closed-loop simulation does not confirm it"),
            };
            format!("The model {open}; {tail} (without: {}).{besides}", before.join(", "))
        }
        Word::Unexplained => format!("An effect is missing that none of the tested effects explains: {}.", open.join("; ")),
        Word::Parameters => format!("No effect is missing; the model's parameters are wrong, and refitted {tail}."),
        Word::CannotTell if !unsigned.is_empty() => {
            let which = unsigned.join(", ");
            format!(
                "It is not known what is missing: the torque of {which} was logged without its sign. Log the signed torque or current; \
                    {tail}."
            )
        }
        Word::CannotTell => format!("The search was interrupted before anything was found; {tail}."),
        Word::NothingMissing => {
            let noise: Vec<String> = arm.joints.iter().filter_map(|j| Some(format!("{:.1} %", 100.0 * j.noise?))).collect();
            format!("No effect that these logs would show is missing; {tail} (sensor noise: {}).", noise.join(", "))
        }
    }
}

/// An effect of an arm in words.
pub fn words(name: &str) -> String {
    crate::arms::physics::ALL
        .iter()
        .map(|p| p.facts())
        .find(|f| f.name == name)
        .map(|f| f.words)
        .or_else(|| crate::physics::physics_named(name).map(|p| p.words))
        .map_or_else(|| name.replace('_', " "), str::to_string)
}
