//! Columns of two joints that are exchanged.

use super::motion::{band_of, excitation, of};
use crate::advice;
use crate::finding::{Finding, FindingKind};
use crate::joints::Joint;
use crate::numeric::thinned;
use crate::quantity::Quantity;
use crate::recording::Recording;
use backdrive_diagnosis::recordings::follow::follow;

/// Rate at which joints are compared, Hz, and lags that are tried, s.
const COARSE_HZ: f64 = 25.0;
const LATE_S: f64 = 0.6;
/// A joint does not follow its own partner below the first share of variance, and follows the other's above the second.
const NOT_ITS_OWN: f64 = 0.6;
const THE_OTHERS: f64 = 0.85;

/// Finds them: by commands and positions, and by velocities and positions.
pub fn check(recording: &Recording, joints: &[Joint], out: &mut Vec<Finding>) {
    if joints.len() < 2 {
        return;
    }
    let band = band_of(recording);
    let stride = ((1.0 / (COARSE_HZ * band.period)) as usize).max(1);
    let coarse = |values: Vec<f64>| thinned(&values, stride);
    let late = (LATE_S / (band.period * stride as f64)) as i64;
    let moving = |place: Option<usize>| of(recording, place).filter(|signal| excitation(signal) > 10.0);
    let commands: Vec<Option<Vec<f64>>> =
        joints.iter().map(|joint| moving(joint.command).map(|signal| coarse(band.smooth(&signal.even)))).collect();
    let positions: Vec<Option<Vec<f64>>> =
        joints.iter().map(|joint| moving(joint.position).map(|signal| coarse(band.smooth(&signal.even)))).collect();
    let rates: Vec<Option<Vec<f64>>> =
        joints.iter().map(|joint| moving(joint.position).map(|signal| coarse(band.rate(&signal.even)))).collect();
    let told: Vec<Option<Vec<f64>>> =
        joints.iter().map(|joint| moving(joint.velocity).map(|signal| coarse(band.smooth(&signal.even)))).collect();
    pairs(recording, joints, (&commands, &positions, (-1, late)), Quantity::Position, out);
    if !out.iter().any(|finding| finding.kind == FindingKind::JointsExchanged) {
        pairs(recording, joints, (&rates, &told, (-2, 2)), Quantity::Velocity, out);
    }
}

/// Inputs, outputs and lags to compare them with.
type Compared<'a> = (&'a [Option<Vec<f64>>], &'a [Option<Vec<f64>>], (i64, i64));

fn pairs(recording: &Recording, joints: &[Joint], (inputs, outputs, lags): Compared, of: Quantity, out: &mut Vec<Finding>) {
    let explained = |a: usize, b: usize| -> Option<f64> {
        let (u, y) = (inputs[a].as_ref()?, outputs[b].as_ref()?);
        Some(follow(u, y, lags).filter(|found| found.gain > 0.0).map_or(0.0, |found| found.explained))
    };
    let own: Vec<Option<f64>> = (0..joints.len()).map(|joint| explained(joint, joint)).collect();
    let is_off = |joint: usize| own[joint].is_some_and(|own| own < NOT_ITS_OWN);
    for a in 0..joints.len() {
        for b in a + 1..joints.len() {
            let is_off = is_off(a) && is_off(b);
            if !is_off || !explained(a, b).zip(explained(b, a)).is_some_and(|(ab, ba)| ab.min(ba) > THE_OTHERS) {
                continue;
            }
            let place = |joint: &Joint| if of == Quantity::Velocity { joint.velocity } else { joint.position };
            let (Some(first), Some(second)) = (place(&joints[a]), place(&joints[b])) else { continue };
            let (x, y) = (&recording.signals[first], &recording.signals[second]);
            let partner = if of == Quantity::Velocity { "position" } else { "command" };
            let message = format!(
                "{:?} follows the {partner} of {}, and {:?} that of {}: the columns of the two joints are exchanged",
                x.name,
                joints[b].title(),
                y.name,
                joints[a].title()
            );
            let key = of.key().unwrap_or("position");
            let todo = format!(
                "[joints.{}]\n{key} = {}\n[joints.{}]\n{key} = {}",
                advice::table_name(joints[a].title()),
                advice::source(recording, y, ""),
                advice::table_name(joints[b].title()),
                advice::source(recording, x, "")
            );
            let finding = Finding::new(FindingKind::JointsExchanged, &recording.file, &[&x.name, &y.name], message);
            out.push(finding.at(&format!("{} and {}", joints[a].title(), joints[b].title())).todo(todo));
        }
    }
}
