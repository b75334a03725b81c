//! Signals that belong to one joint.

use crate::quantity::{Quantity, Side};
use crate::recording::Recording;

/// The signals of a joint, by their places in the recording.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Joint {
    /// Its name; empty where nothing names it.
    pub name: String,
    /// What it is to do: its command, or the position of its leader.
    pub command: Option<usize>,
    /// Whether that is the position of a leader, which may be scaled on purpose.
    pub is_led: bool,
    /// Position.
    pub position: Option<usize>,
    /// Velocity.
    pub velocity: Option<usize>,
    /// Torque or force.
    pub effort: Option<usize>,
    /// Current.
    pub current: Option<usize>,
}

impl Joint {
    /// Its torque and its current, as far as they are there.
    pub fn drives(&self) -> impl Iterator<Item = usize> {
        [self.effort, self.current].into_iter().flatten()
    }

    /// A name for tables.
    pub fn title(&self) -> &str {
        if self.name.is_empty() { "joint" } else { &self.name }
    }
}

/// Groups signals by the name of their joint and their side; what is without a joint's name goes to the only joint there is.
pub fn joints(recording: &Recording) -> Vec<Joint> {
    let mut out: Vec<(String, Option<Side>, Joint)> = Vec::new();
    for (place, signal) in recording.signals.iter().enumerate() {
        if signal.even.is_empty() || !(signal.quantity.is_measured() || signal.quantity == Quantity::Command) {
            continue;
        }
        let at = out.iter().position(|(joint, side, _)| *joint == signal.joint && *side == signal.side).unwrap_or_else(|| {
            out.push((signal.joint.clone(), signal.side, Joint::default()));
            out.len() - 1
        });
        let joint = &mut out[at].2;
        let slot = match signal.quantity {
            Quantity::Command => &mut joint.command,
            Quantity::Position => &mut joint.position,
            Quantity::Velocity => &mut joint.velocity,
            Quantity::Effort => &mut joint.effort,
            Quantity::Current => &mut joint.current,
            _ => continue,
        };
        slot.get_or_insert(place);
    }
    let with_position = || (0..out.len()).filter(|at| out[*at].2.position.is_some());
    if let (Some(only), 1) = (with_position().next(), with_position().count()) {
        let orphans: Vec<Joint> = out.iter().filter(|(_, _, joint)| joint.position.is_none()).map(|(_, _, joint)| joint.clone()).collect();
        let joint = &mut out[only].2;
        for orphan in orphans {
            joint.command = joint.command.or(orphan.command);
            joint.velocity = joint.velocity.or(orphan.velocity);
            joint.effort = joint.effort.or(orphan.effort);
            joint.current = joint.current.or(orphan.current);
        }
        out = vec![out.swap_remove(only)];
    }
    // A follower's command is its leader's position.
    let leaders: Vec<(String, Option<usize>)> =
        out.iter().filter(|(_, side, _)| *side == Some(Side::Leader)).map(|(name, _, joint)| (name.clone(), joint.position)).collect();
    for (name, side, joint) in &mut out {
        let word = match side {
            Some(Side::Leader) => "leader",
            Some(Side::Follower) => "follower",
            None => "",
        };
        joint.name = [word, name].into_iter().filter(|part| !part.is_empty()).collect::<Vec<_>>().join(" ");
        if *side == Some(Side::Follower) && joint.command.is_none() {
            joint.command = leaders.iter().find(|(leader, _)| leader == name).and_then(|(_, position)| *position);
            joint.is_led = joint.command.is_some();
        }
    }
    out.into_iter()
        .map(|(_, _, joint)| joint)
        .filter(|joint| joint.position.is_some() || joint.command.is_some() || joint.velocity.is_some())
        .collect()
}
