//! A velocity beside the derivative of its position.

use super::motion::{band_of, excitation, of};
use crate::advice;
use crate::finding::{Finding, FindingKind, Weight};
use crate::joints::Joint;
use crate::recording::Recording;
use backdrive_diagnosis::recordings::follow::follow;
use backdrive_diagnosis::recordings::kinematics::{Band, EXPLAINED, Kinematics};

/// Below this one it is not, where both move far beyond their noise.
const UNEXPLAINED: f64 = 0.4;
const MOVES: f64 = 30.0;
/// A factor this near to a unit's is the unit's.
const NEAR: f64 = 0.04;
/// A lag from here on is worth a note where its interval holds 0, s.
const UNSURE_S: f64 = 0.012;
/// Of exchanged columns the factor is this near to 1.
const EXCHANGED: f64 = 0.12;
/// Columns are exchanged where the residual is smaller by this factor with exchanged columns.
const BETTER: f64 = 0.3;
/// Finds what is wrong.
pub fn check(recording: &Recording, joints: &[Joint], out: &mut Vec<Finding>) {
    let band = band_of(recording);
    for joint in joints {
        let (Some(position), Some(velocity)) = (of(recording, joint.position), of(recording, joint.velocity)) else { continue };
        let Some(place) = joint.velocity else { continue };
        if excitation(position) < MOVES || excitation(velocity) < 5.0 {
            continue;
        }
        let Some(found) = Kinematics::of(&position.even, &velocity.even, &band) else { continue };
        let names = [velocity.name.as_str(), position.name.as_str()];
        let new = |kind: FindingKind, message: String| Finding::new(kind, &recording.file, &names, message).at(&joint.name);
        if let Some(turned) = exchanged(recording, joint, &band, &names, found.explained) {
            out.push(turned);
            continue;
        }
        if !found.is_explained() {
            if found.explained < UNEXPLAINED && excitation(velocity) > MOVES {
                out.push(no_derivative(recording, joint, &band, &names));
            }
            continue;
        }
        let (size, degree) = (found.gain.abs(), 180.0 / std::f64::consts::PI);
        let near = |factor: f64| (size / factor - 1.0).abs() < NEAR;
        if found.gain < 0.0 {
            let message = format!("{:?} has the opposite sign of the derivative of {:?}", names[0], names[1]);
            out.push(new(FindingKind::WrongSign, message).todo(advice::entry(recording, joint, place, "scale = -1")));
        }
        if near(degree) || near(1.0 / degree) {
            let (which, at) = if size > 1.0 { (names[0], place) } else { (names[1], joint.position.unwrap_or(place)) };
            let unit = if size > 1.0 { "unit = \"deg/s\"" } else { "unit = \"deg\"" };
            let message = format!("{:?} is {size:.4} times the derivative of {:?}: {which:?} is in degrees", names[0], names[1]);
            out.push(new(FindingKind::WrongUnit, message).todo(advice::entry(recording, joint, at, unit)));
        } else if found.is_scaled() {
            let message = format!("{:?} is {size:.4} times the derivative of {:?}", names[0], names[1]);
            let todo = advice::entry(recording, joint, place, &format!("scale = {:.4}", 1.0 / size));
            out.push(new(FindingKind::WrongScale, message).todo(todo));
        }
        let (lag, wide) = (found.lag_s, found.half_s);
        if found.is_shifted() {
            let (word, what) = if lag > 0.0 { ("lags", "a filter or an older sample") } else { ("leads", "the position is the older one") };
            let message = format!(
                "{:?} {word} the derivative of {:?} by {:.0} ms (95 % interval ±{:.0} ms): {what}",
                names[0],
                names[1],
                1e3 * lag.abs(),
                1e3 * wide
            );
            let todo = format!(
                "leave the velocity out of the set (it is computed from the position), or shift its column by {:.0} samples before the import",
                -lag / recording.period
            );
            out.push(new(FindingKind::VelocityLag, message).todo(todo));
        } else if lag.abs() > UNSURE_S.max(recording.period) {
            let message = format!("{:?} is shifted by {:.0} ms against the derivative of {:?}", names[0], 1e3 * lag, names[1]);
            out.push(new(FindingKind::VelocityLag, message).weighing(Weight::Note).todo("nothing; the interval contains 0").sure(0.5));
        }
    }
}

/// What a velocity is that is not the derivative of its position.
fn no_derivative(recording: &Recording, joint: &Joint, band: &Band, names: &[&str; 2]) -> Finding {
    let new = |kind: FindingKind, message: String| Finding::new(kind, &recording.file, names, message).at(&joint.name);
    let plain = || {
        let message = format!("{:?} is not the derivative of {:?}: another joint's column, or filtered heavily", names[0], names[1]);
        new(FindingKind::NotTheDerivative, message).todo("leave the velocity out of the set: it is computed from the position").sure(0.95)
    };
    let (Some(position), Some(velocity)) = (joint.position, joint.velocity) else { return plain() };
    let (p, v) = (&recording.signals[position], &recording.signals[velocity]);
    let (rate, told) = (band.rate(&p.even), band.smooth(&v.even));
    let lags = (-band.samples(0.05), band.samples(0.05));
    let explained = |u: &[f64], y: &[f64]| follow(u, y, lags).map_or(0.0, |found| found.explained);
    let size: Vec<f64> = rate.iter().map(|x| x.abs()).collect();
    if explained(&size, &told) > EXPLAINED {
        let message = format!("{:?} is the absolute value of the derivative of {:?}: it was logged without its sign", names[0], names[1]);
        return new(FindingKind::Rectified, message).todo("leave the velocity out of the set: it is computed from the position");
    }
    plain()
}

/// A position that is the derivative of its velocity: the two columns are exchanged.
fn exchanged(recording: &Recording, joint: &Joint, band: &Band, names: &[&str; 2], straight: f64) -> Option<Finding> {
    let (position, velocity) = (&recording.signals[joint.position?], &recording.signals[joint.velocity?]);
    let found = follow(&band.rate(&velocity.even), &band.smooth(&position.even), (-2, 2))?;
    let is_better = 1.0 - found.explained < BETTER * (1.0 - straight);
    (found.explained > EXPLAINED && is_better && (found.gain - 1.0).abs() < EXCHANGED).then_some(())?;
    let message = format!("{:?} is the derivative of {:?}: the two columns are exchanged", names[1], names[0]);
    let table = advice::table_name(joint.title());
    let (a, b) = (advice::source(recording, velocity, ""), advice::source(recording, position, ""));
    let finding = Finding::new(FindingKind::SwappedColumns, &recording.file, names, message).at(&joint.name);
    Some(finding.todo(format!("[joints.{table}]\nposition = {a}\nvelocity = {b}")))
}
