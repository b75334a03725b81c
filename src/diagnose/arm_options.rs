//! Options and keys of a set that mean something else for an arm than for a device of one axis, or nothing: none is passed over in silence.

use crate::cli;
use crate::failure::{Failure, code};
use backdrive_diagnosis::arms::physics::ALL;
use backdrive_plant::set::{Initial, RecordingSet};
use std::path::Path;

/// What a reader should know of the options that have no effect.
///
/// # Errors
/// When an option or a key of the set would change what the logs are of, which a diagnosis of an arm cannot take into account.
pub fn notes(options: &cli::Diagnose, set: &RecordingSet) -> Result<Vec<String>, Failure> {
    let usage = |message: String| Failure { code: code::USAGE, message };
    if let Some(grip) = options.grip.as_deref().filter(|g| *g != Path::new("none")) {
        return Err(usage(format!(
            "--grip {}: a hand on an arm is not modelled by its diagnosis; leave the option out, and record the arm without a hand",
            grip.display()
        )));
    }
    let file = set.folder.join("set.toml");
    if let Some((input, _)) = set.unknown.first() {
        return Err(Failure::input(format!(
            "{}, unknown.{input}: an arm is diagnosed from the torque of every joint, and none may be unknown; leave the key out",
            file.display()
        )));
    }
    let conditions = set.files.iter().find_map(|(name, rules)| Some((name, &rules.condition.first()?.0)));
    if let Some((name, path)) = conditions {
        return Err(Failure::input(format!(
            "{}, files.\"{name}\".condition.{path}: logs of an arm are all fitted with the same numbers; diagnose those with another {path} in a set \
             of their own",
            file.display()
        )));
    }
    let mut out = Vec::new();
    if options.effort.is_some() {
        out.push("--effort does nothing for an arm: every physics is tried at every joint, and the search ends by itself".to_string());
    }
    for name in &options.ignore_signal {
        out.push(format!("--ignore-signal {name} does nothing for an arm: of its logs only the columns of its joints are read"));
    }
    for name in options.without.iter().filter(|name| !ALL.iter().any(|p| p.facts().name == name.as_str())) {
        let of_arms: Vec<&str> = ALL.iter().map(|p| p.facts().name).collect();
        out.push(format!("--without {name} does nothing for an arm, whose search has {}", of_arms.join(", ")));
    }
    for name in &set.ignore {
        out.push(format!(
            "{}, ignore: \"{name}\" does nothing for an arm: of its logs only the columns of its joints are read",
            file.display()
        ));
    }
    if set.initial == Initial::Free {
        out.push(format!("{}, initial: does nothing for an arm, which may start in any state", file.display()));
    }
    if set.mixed_rates {
        out.push(format!("{}, mixed_rates: does nothing for an arm: all its logs are laid on the grid of the slowest", file.display()));
    }
    Ok(out)
}
