//! The text of the model and of the set.

use super::estimate::Numbers;
use super::options::{Attached, Driven, Start};
use super::plan::{Plan, Signal};
use backdrive_plant::recording::{ColumnRule, Source};
use backdrive_plant::write::{key, number, round_significant, string};
use std::f64::consts::TAU;
use std::fmt::Write;

/// What was seen in the recordings, beside the answers.
pub struct Seen {
    /// Numbers to start from.
    pub numbers: Numbers,
    /// Where they are from, in words.
    pub from: &'static str,
    /// Step of the position's encoder, m or rad; 0 where none shows.
    pub resolution: f64,
    /// How recordings begin.
    pub start: Start,
    /// Names of the recordings that are fitted.
    pub fit: Vec<String>,
    /// And of the one that is not, where there are several.
    pub held_out: Vec<String>,
    /// What makes an answer doubtful, in a sentence.
    pub doubt: Option<String>,
}

/// Damping ratio that a joint is given to start with.
const JOINT_DAMPING: f64 = 0.05;

/// A line with its comment.
fn line(out: &mut String, text: &str, comment: &str) {
    let _ = writeln!(out, "{text:<32} # {comment}");
}

/// An element between two places, with its one parameter.
fn element(out: &mut String, name: &str, kind: &str, between: [&str; 2], (key, value, unit): (&str, f64, &str)) {
    let _ = writeln!(out, "[[elements]]\nname = \"{name}\"\nkind = \"{kind}\"\nbetween = [\"{}\", \"{}\"]", between[0], between[1]);
    line(out, &format!("{key} = {}", rounded(value)), unit);
    out.push('\n');
}

fn rounded(x: f64) -> String {
    number(round_significant(x, 3))
}

/// The model file.
pub fn model(plan: &Plan, seen: &Seen, name: &str) -> String {
    let mut out = String::new();
    let Numbers { inertia, damping, stiffness } = seen.numbers;
    let (mass, damps, holds) = plan.motion.pick(("kg", "N s/m", "N/m"), ("kg m^2", "N m s/rad", "N m/rad"));
    let (length, force) = plan.motion.pick(("m", "N"), ("rad", "N m"));
    let body = if plan.driven == Driven::Current { "motor" } else { "body" };
    let has_load = plan.attached == Attached::Load;
    let _ = writeln!(
        out,
        "# The nominal model of the device, written by `backdrive init`: bodies, and what acts between them. SI units.\n# Every number is \
         a start value ({}): `backdrive fit` and `backdrive diagnose` refit all of them.",
        seen.from
    );
    let _ = writeln!(out, "name   = {}\nmotion = \"{}\"\n\n[bodies]", string(name), plan.motion.pick("translation", "rotation"));
    let share = if has_load { 0.5 * inertia } else { inertia };
    line(&mut out, &format!("{body} = {}", rounded(share)), mass);
    if has_load {
        line(&mut out, &format!("load = {}", rounded(share)), &format!("{mass}; equal inertias are a guess"));
    }
    if plan.hand {
        line(&mut out, "hand = 0.0", "moved by the user");
    }
    out.push('\n');
    element(&mut out, "bearing", "damper", [body, "ground"], ("damping", damping, damps));
    if plan.attached == Attached::Spring && !plan.hand {
        element(&mut out, "spring", "spring", [body, "ground"], ("stiffness", stiffness, holds));
    }
    if has_load {
        // Two equal bodies J/2 on a joint k ring at omega² = k (2/J + 2/J).
        let joint = 0.25 * inertia * (TAU * plan.resonance).powi(2);
        element(&mut out, "joint", "spring", [body, "load"], ("stiffness", joint, holds));
        let lost = 2.0 * JOINT_DAMPING * (joint * 0.25 * inertia).sqrt();
        element(&mut out, "joint_damping", "damper", [body, "load"], ("damping", lost, damps));
    }
    if plan.hand {
        let held = if has_load { "load" } else { body };
        if plan.attached == Attached::Spring {
            element(&mut out, "spring", "spring", [body, "ground"], ("stiffness", 0.5 * stiffness, holds));
        }
        let grip = if plan.attached == Attached::Spring { 0.5 * stiffness } else { stiffness };
        element(&mut out, "grip", "spring", [held, "hand"], ("stiffness", grip, holds));
        element(&mut out, "grip_damping", "damper", [held, "hand"], ("damping", damping, damps));
    }
    let _ = writeln!(
        out,
        "# Add effects that you know already, such as dry friction; `diagnose` searches for those that are missing here:\n# \
         [[elements]]\n# name = \"friction\"\n# kind = \"coulomb\"\n# between = [\"{body}\", \"ground\"]\n# force = \
         0.01                     # {force}\n"
    );
    let _ = writeln!(out, "[[inputs]]\nname = {}", string(&plan.drive.name));
    match plan.driven {
        Driven::Motion => {
            line(&mut out, "kind = \"motion\"", "the recording prescribes the motion of this body");
            let _ = writeln!(out, "on   = \"{body}\"");
        }
        Driven::Force | Driven::Current => {
            let _ = writeln!(out, "kind = \"force\"\non   = \"{body}\"");
            line(&mut out, "hold = \"zero\"", "a servo holds it from sample to sample; \"linear\" for a measured force");
        }
    }
    if plan.hand {
        line(&mut out, "\n[[inputs]]\nname = \"hand\"\nkind = \"motion\"", "not measured: see [unknown] in set.toml");
        let _ = writeln!(out, "on   = \"hand\"");
    }
    let mut output = |signal: &Signal, kind: &str, of: &str, more: Option<(String, String)>| {
        let _ = writeln!(out, "\n[[outputs]]\nname = {}\nkind = \"{kind}\"\n{of}", string(&signal.name));
        if let Some((text, comment)) = more {
            line(&mut out, &text, &comment);
        }
    };
    let of_body = format!("of   = \"{body}\"");
    if let Some(position) = &plan.position {
        let step =
            (seen.resolution > 0.0).then(|| (format!("resolution = {}", number(seen.resolution)), format!("{length}: the encoder's step")));
        output(position, "position", &of_body, step);
    }
    if let Some(velocity) = &plan.velocity {
        output(velocity, "velocity", &of_body, None);
    }
    if let Some(measured) = &plan.force {
        match plan.driven {
            Driven::Motion => output(measured, "reaction", &of_body, None),
            Driven::Force | Driven::Current => output(measured, "force", "element = [\"joint\", \"joint_damping\"]", None),
        }
    }
    if let (Some(position), true) = (&plan.position, plan.driven != Driven::Motion) {
        let held = if has_load { "load" } else { body };
        let _ = writeln!(
            out,
            "\n# For a graph (launch/), where this model is a master or what the canceller knows of one:\n# [[axes]]\n# name     = \"axis\"\n# user     = \"{held}\"\n\
             # feedback = {}\n# measured = {}\n# travel   = [-0.05, 0.05]          # {length}",
            string(&plan.drive.name),
            string(&position.name)
        );
    }
    out
}

fn list(names: &[String]) -> String {
    format!("[{}]", names.iter().map(|n| string(n)).collect::<Vec<_>>().join(", "))
}

/// A rule as `[columns]` has it.
fn rule(rule: &ColumnRule) -> String {
    let mut parts = match &rule.source {
        Source::Column(column) => vec![format!("column = {}", string(column))],
        Source::Topic { topic, field } => vec![format!("topic = {}, field = {}", string(topic), string(field))],
    };
    parts.extend(rule.unit.map(|unit| format!("unit = \"{}\"", unit.name)));
    parts.extend(rule.scale.map(|scale| format!("scale = {}", number(scale))));
    format!("{{ {} }}", parts.join(", "))
}

/// The set file, beside a model of this name.
pub fn set(plan: &Plan, seen: &Seen, model: &str) -> String {
    let mut out = String::from(
        "# Recordings of one device and how they are read, written by `backdrive init`; docs/own-recording.md lists all keys.\n",
    );
    let _ = writeln!(out, "model    = {}\nfit      = {}", string(model), list(&seen.fit));
    if !seen.held_out.is_empty() {
        line(&mut out, &format!("held_out = {}", list(&seen.held_out)), "no fit uses it: it tests the findings");
    }
    match seen.start {
        Start::Rest => {
            line(&mut out, "initial  = \"rest\"", "each begins at rest at 0; \"free\": position and velocity at the start are estimated")
        }
        Start::Free => line(&mut out, "initial  = \"free\"", "position and velocity at the start are estimated; \"rest\": at rest at 0"),
    }
    let _ = writeln!(
        out,
        "\n# The model's name of a signal, and its column. The value, converted from `unit` to SI, is multiplied by `scale`.\n[columns]"
    );
    for (name, of) in plan.columns() {
        let _ = writeln!(out, "{} = {}", key(&name), rule(&of));
    }
    if plan.hand {
        let _ = writeln!(
            out,
            "\n# The hand was not measured: its motion is estimated in every recording, up to this bandwidth.\n[unknown]\nhand = {{ \
                bandwidth_hz = 5.0 }}"
        );
    }
    if let Some(file) = seen.fit.first() {
        let _ = writeln!(
            out,
            "\n# Part of a long file, or one run of a file with several runs:\n# [files.{}]\n# rows  = [0, 20000]\n# where = {{ run = 3 }}",
            string(file)
        );
    }
    out
}
