//! What is looked for in a recording; one file a kind of check.

mod cells;
mod clock;
mod command;
mod effort;
mod exchanged;
mod flat;
mod limits;
mod motion;
mod passive;
mod repeated;
mod sampling;
mod sessions;
mod spikes;
mod units;
mod velocity;

pub use sessions::zeros;

use crate::finding::Finding;
use crate::joints::Joint;
use crate::recording::Recording;

/// All checks of one recording. Outliers are taken out of its even samples.
pub fn all(recording: &mut Recording, joints: &[Joint]) -> Vec<Finding> {
    let mut out = Vec::new();
    clock::check(recording, &mut out);
    cells::check(recording, &mut out);
    spikes::check(recording, &mut out);
    repeated::check(recording, &mut out);
    flat::check(recording, joints, &mut out);
    limits::check(recording, joints, &mut out);
    sampling::check(recording, &mut out);
    units::check(recording, joints, &mut out);
    passive::check(recording, joints, &mut out);
    exchanged::check(recording, joints, &mut out);
    command::check(recording, joints, &mut out);
    velocity::check(recording, joints, &mut out);
    effort::check(recording, joints, &mut out);
    out
}
