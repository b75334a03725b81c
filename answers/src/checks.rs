//! What is asked, checked: values of options, and options and keys of a set that mean something else for one device than for another, or nothing. None is
//! passed over in silence.

use crate::asked::Asked;
use crate::error::AnswerError;
use backdrive_diagnosis::arms::physics::ALL as OF_ARMS;
use backdrive_diagnosis::physics::{PHYSICS, physics_named};
use backdrive_plant::set::{Initial, RecordingSet};
use backdrive_servo::physics::ALL as OF_SERVOS;
use std::ops::RangeInclusive;
use std::path::Path;

/// The name of an effect that some device may have.
///
/// # Errors
/// There is no such effect: a sentence with those that there are.
pub fn effect(name: &str) -> Result<String, String> {
    if let Some(known) = physics_named(name) {
        return Ok(known.name.to_string());
    }
    let of_arms = || OF_ARMS.iter().map(|p| p.facts().name);
    let of_servos = || OF_SERVOS.iter().map(|p| p.name);
    if of_arms().chain(of_servos()).any(|known| known == name) {
        return Ok(name.to_string());
    }
    let known = PHYSICS.iter().map(|p| p.name).collect::<Vec<_>>();
    let more = |names: Vec<&'static str>| names.into_iter().filter(|n| !known.contains(n)).collect::<Vec<_>>().join(", ");
    let (arms, servos) = (more(of_arms().collect()), more(of_servos().collect()));
    Err(format!("no such effect; there are {}; for arms also {arms}; for position servos also {servos}", known.join(", ")))
}

/// Refuses options with values that they cannot have for any device.
///
/// # Errors
/// An effect is unknown, or a number is beyond its bounds.
pub(crate) fn refuse_wrong(asked: &Asked) -> Result<(), AnswerError> {
    let usage = |message: String| Err(AnswerError::Usage(message));
    let options = &asked.options;
    if let Some((name, why)) = options.without.iter().find_map(|name| Some((name, effect(name).err()?))) {
        return usage(format!("without {name}: {why}"));
    }
    match (options.effects, options.effort) {
        (Some(effects), _) if !EFFECTS.contains(&effects) => {
            usage(format!("effects is {effects}, and must be {} to {}", EFFECTS.start(), EFFECTS.end()))
        }
        (_, Some(effort)) if !(effort.is_finite() && effort > 0.0) => usage(format!("effort is {effort}, and must be above 0")),
        _ => Ok(()),
    }
}

/// How many effects may be missing at once.
const EFFECTS: RangeInclusive<usize> = 1..=8;

/// Refuses effects to leave out that a device of one axis cannot have.
///
/// # Errors
/// When one is an effect of arms or of servo joints only.
pub(crate) fn refuse_of_one_axis(asked: &Asked) -> Result<(), AnswerError> {
    match asked.options.without.iter().find(|name| physics_named(name).is_none()) {
        Some(name) => Err(AnswerError::Usage(format!("--without {name}: it is only for arms, and this model has no [robot]; omit it"))),
        None => Ok(()),
    }
}

/// What a reader should know of the options that have no effect for an arm.
///
/// # Errors
/// When an option or a key of the set would change what the logs are of, which a diagnosis of an arm cannot take into account.
pub(crate) fn of_arm(asked: &Asked, set: &RecordingSet) -> Result<Vec<String>, AnswerError> {
    if let Some(grip) = gripped(asked) {
        return Err(AnswerError::Usage(format!(
            "--grip {}: the diagnosis of an arm does not model a hand; omit the option, and record the arm without a hand",
            grip.display()
        )));
    }
    let file = set.folder.join("set.toml");
    if let Some((input, _)) = set.unknown.first() {
        return Err(AnswerError::Input(format!(
            "{}, unknown.{input}: an arm is diagnosed from the torque of every joint, and none may be unknown; omit the key",
            file.display()
        )));
    }
    let conditions = set.files.iter().find_map(|(name, rules)| Some((name, &rules.condition.first()?.0)));
    if let Some((name, path)) = conditions {
        return Err(AnswerError::Input(format!(
            "{}, files.\"{name}\".condition.{path}: all logs of an arm are fitted with the same parameters; diagnose those with another \
             {path} in a separate set",
            file.display()
        )));
    }
    let mut out = Vec::new();
    if asked.options.effort.is_some() {
        out.push("--effort has no effect for an arm: every effect is tried at every joint".to_string());
    }
    for name in &asked.ignore_signal {
        out.push(format!("--ignore-signal {name} has no effect for an arm: only the columns of its joints are read from its logs"));
    }
    let of_arms: Vec<&str> = OF_ARMS.iter().map(|p| p.facts().name).collect();
    for name in asked.options.without.iter().filter(|name| !of_arms.contains(&name.as_str())) {
        out.push(format!("--without {name} has no effect for an arm, whose search has {}", of_arms.join(", ")));
    }
    for name in &set.ignore {
        out.push(format!(
            "{}, ignore: \"{name}\" has no effect for an arm: only the columns of its joints are read from its logs",
            file.display()
        ));
    }
    if set.initial == Initial::Free {
        out.push(format!("{}, initial: has no effect for an arm, which may start in any state", file.display()));
    }
    if set.mixed_rates {
        out.push(format!("{}, mixed_rates: has no effect for an arm: all its logs are resampled to the slowest", file.display()));
    }
    Ok(out)
}

/// What a reader should know of the options that have no effect for servo joints.
///
/// # Errors
/// When a grip is asked for: a hand on a servo joint is not modelled.
pub(crate) fn of_servo(asked: &Asked) -> Result<Vec<String>, AnswerError> {
    if let Some(grip) = gripped(asked) {
        let message = format!("--grip {}: a hand on a servo joint is not modelled; omit the option", grip.display());
        return Err(AnswerError::Usage(message));
    }
    let mut out = Vec::new();
    if asked.options.effort.is_some() {
        out.push("--effort has no effect for servo joints: every effect is tried at every joint".to_string());
    }
    for name in &asked.ignore_signal {
        out.push(format!("--ignore-signal {name} has no effect for servo joints: only commands and positions are read"));
    }
    let of_servos: Vec<&str> = OF_SERVOS.iter().map(|p| p.name).collect();
    for name in asked.options.without.iter().filter(|name| !of_servos.contains(&name.as_str())) {
        out.push(format!("--without {name} has no effect for servo joints, whose search has {}", of_servos.join(", ")));
    }
    Ok(out)
}

/// The grip, where one is asked for.
fn gripped(asked: &Asked) -> Option<&Path> {
    asked.grip.as_deref().filter(|grip| *grip != Path::new("none"))
}

#[cfg(test)]
mod tests {
    use super::*;
    use backdrive_diagnosis::options::Options;
    use std::path::PathBuf;

    fn asked(options: Options) -> Asked {
        Asked { options, ..Asked::default() }
    }

    #[test]
    fn values_that_no_device_takes_are_wrong_usage() {
        assert!(refuse_wrong(&asked(Options::default())).is_ok());
        let magic = Options { without: vec!["magic".to_string()], ..Options::default() };
        let many = Options { effects: Some(9), ..Options::default() };
        let none = Options { effort: Some(0.0), ..Options::default() };
        for (options, word) in [(magic, "magic"), (many, "1 to 8"), (none, "above 0")] {
            match refuse_wrong(&asked(options)) {
                Err(AnswerError::Usage(message)) => assert!(message.contains(word), "{message}"),
                other => panic!("{other:?}"),
            }
        }
    }

    #[test]
    fn an_effect_of_arms_is_refused_of_one_axis_and_without_effect_for_servo_joints() {
        let payload = || asked(Options { without: vec!["gravity_direction".to_string()], ..Options::default() });
        assert!(matches!(refuse_of_one_axis(&payload()), Err(AnswerError::Usage(_))));
        let notes = of_servo(&payload()).unwrap();
        assert!(notes.len() == 1 && notes[0].starts_with("--without gravity_direction has no effect for servo joints"), "{notes:?}");
        let grip = Asked { grip: Some(PathBuf::from("grip.toml")), ..Asked::default() };
        assert!(matches!(of_servo(&grip), Err(AnswerError::Usage(_))));
        let no_hand = Asked { grip: Some(PathBuf::from("none")), ..Asked::default() };
        assert_eq!(of_servo(&no_hand).unwrap(), Vec::<String>::new());
    }
}
