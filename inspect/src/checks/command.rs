//! A position beside its command: unit, sign, scale, which of the two is which.

use super::motion::{band_of, excitation, of};
use crate::advice;
use crate::finding::{Finding, FindingKind, Weight};
use crate::joints::Joint;
use crate::numeric::{quantile, width};
use crate::recording::{Recording, Signal};
use backdrive_diagnosis::recordings::follow::{Follow, Profile, follow};
use backdrive_signal::low_pass::LowPass;

/// Lags that are tried: a command may be this late, and the position this early (columns exchanged), s.
const LATE_S: f64 = 1.0;
const EARLY_S: f64 = 0.5;
/// Lags of most servos, s: within them a sign is claimed.
const USUAL_S: [f64; 2] = [0.05, 0.4];
/// By which factor the rest grows where a position is taken to be late that is early.
const WORSE: f64 = 3.0;
/// Share of variance from which on a position follows its command.
const EXPLAINED: f64 = 0.8;
/// Motion below this frequency is followed by any servo at its full size, Hz.
const SLOW_HZ: f64 = 0.5;
/// A slow motion off by more than this is a scale; droop and dead bands make less.
const SCALE: f64 = 0.3;
/// Share of the slow motion that a scale explains; dead bands and stiction leave more.
const SLOW_EXPLAINED: f64 = 0.995;
/// How often slow motion has to come back through its middle.
const LEAST_CROSSINGS: usize = 3;
/// Degrees for radians, within what a servo's bandwidth leaves of fast motion.
const NEAR: f64 = 0.3;
/// A position is early by at least this, s, and by this many samples, to be taken for the command.
const EARLY: f64 = 0.008;
/// What a sensor measures has this many times the noise of what a computer wrote, or its step.
const NOISIER: f64 = 1.5;
/// Share of equal rows from which on command and position are the same column.
const SAME: f64 = 0.99;
/// What names and units say is this sure at least.
const NAMED: f64 = 0.8;
/// Share of variance above which columns are reported as exchanged.
const ALL_BUT: f64 = 0.97;

/// Finds what is wrong.
pub fn check(recording: &Recording, joints: &[Joint], out: &mut Vec<Finding>) {
    let band = band_of(recording);
    for joint in joints {
        let (Some(command), Some(position)) = (of(recording, joint.command), of(recording, joint.position)) else { continue };
        let Some(place) = joint.position else { continue };
        // Where only the data say which is the command, they cannot say that it is wrong.
        if command.sure.min(position.sure) < NAMED {
            continue;
        }
        if excitation(command) == 0.0 || excitation(position) < 10.0 {
            continue;
        }
        let names = [position.name.as_str(), command.name.as_str()];
        let new = |kind: FindingKind, message: String| Finding::new(kind, &recording.file, &names, message).at(&joint.name);
        let same = command.even.iter().zip(&position.even).filter(|(u, y)| u == y).count();
        if same as f64 > SAME * position.even.len() as f64 && !joint.is_led {
            let message = format!("{:?} and {:?} are the same in every row: the state was logged as the command", names[0], names[1]);
            out.push(
                new(FindingKind::CommandIsPosition, message)
                    .todo("name the column of the command that was sent; the response is not known"),
            );
            continue;
        }
        let (u, y) = (band.smooth(&command.even), band.smooth(&position.even));
        let profile = Profile::new(&u, &y, (-band.samples(EARLY_S), band.samples(LATE_S)), None);
        let near = |from: f64, to: f64, sign: f64| profile.within((band.samples(from), band.samples(to)), sign);
        // Of a periodic motion a late response and one of the other sign look alike: the sign is claimed where no response within the usual lags explains it.
        let (along, against) = (near(-USUAL_S[0], USUAL_S[1], 1.0), near(-USUAL_S[0], USUAL_S[1], -1.0));
        let share = |found: Option<Follow>| found.map_or(0.0, |found| found.explained);
        let is_against = share(against) > EXPLAINED && share(along) < 0.5 * share(against);
        let found = if is_against { against } else { near(-EARLY_S, LATE_S, 1.0) };
        let Some(found) = found.filter(|found| found.explained > EXPLAINED) else { continue };
        let weight = if joint.is_led { Weight::Note } else { Weight::Wrong };
        if found.gain < 0.0 {
            let message = format!("{:?} moves opposite to {:?}: one of them has the wrong sign", names[0], names[1]);
            out.push(new(FindingKind::WrongSign, message).todo(advice::entry(recording, joint, place, "scale = -1")));
        }
        let (size, degree) = (found.gain.abs(), 180.0 / std::f64::consts::PI);
        let is_by = |factor: f64| (size / factor - 1.0).abs() < NEAR;
        let slow = slow_gain(recording, &command.even, &position.even).unwrap_or(1.0);
        if is_by(degree) || is_by(1.0 / degree) {
            let (which, at) = if size > 1.0 { (names[0], place) } else { (names[1], joint.command.unwrap_or(place)) };
            let message = format!("{:?} is {size:.3} times {:?}: {which:?} is in degrees, the other one in radians", names[0], names[1]);
            out.push(new(FindingKind::WrongUnit, message).todo(advice::entry(recording, joint, at, "unit = \"deg\"")));
        } else if (slow - 1.0).abs() > SCALE && found.gain > 0.0 {
            let message = format!("slow motion of {:?} is {slow:.3} times that of {:?}: their scales differ", names[0], names[1]);
            let todo = advice::entry(recording, joint, place, &format!("scale = {:.4}", 1.0 / slow));
            out.push(new(FindingKind::WrongScale, message).weighing(weight).todo(todo));
        }
        let (lag, wide) = (found.lag * band.period, profile.uncertainty().map_or(f64::INFINITY, |half| half * band.period));
        let late = share(near(0.0, LATE_S, 1.0));
        let is_early = found.explained > ALL_BUT && 1.0 - late > WORSE * (1.0 - found.explained).max(1e-9);
        if lag < -EARLY.max(0.6 * recording.period) && lag + wide < 0.0 && is_early && !joint.is_led && !is_against {
            let ahead = format!(
                "{:?} is {:.0} ms ahead of {:?} (95 % interval ±{:.0} ms), but a joint cannot lead its command",
                names[0],
                -1e3 * lag,
                names[1],
                1e3 * wide
            );
            // What a sensor measures is the noisier of the two.
            let noise = |signal: &Signal| signal.noise.max(signal.step / 12f64.sqrt());
            if noise(command) > NOISIER * noise(position) {
                let (a, b) = (advice::source(recording, position, ""), advice::source(recording, command, ""));
                let todo = format!("[columns]\ncommand = {a}\nposition = {b}");
                out.push(new(FindingKind::SwappedColumns, format!("{ahead}, and less noisy: the two columns are exchanged")).todo(todo));
            } else {
                let todo = "check in the logger which of the two is older; a lag computed from them is wrong";
                let finding = new(FindingKind::CommandLate, format!("{ahead}: the command was logged late, or the two are exchanged"));
                out.push(finding.weighing(Weight::Note).sure(0.7).todo(todo));
            }
        }
    }
}

/// The size of slow motion as a multiple of its command's; `None` where there is little slow motion, or it does not follow.
fn slow_gain(recording: &Recording, u: &[f64], y: &[f64]) -> Option<f64> {
    let filter = LowPass::butterworth(2, SLOW_HZ, recording.rate());
    let stride = ((recording.rate() / 20.0) as usize).max(1);
    let slow = |x: &[f64]| crate::numeric::thinned(&filter.both_ways(x), stride);
    let (a, b) = (slow(u), slow(y));
    // One transition fits any factor; several have to agree.
    let middle = 0.5 * (quantile(&a, 0.01) + quantile(&a, 0.99));
    let crossings = a.windows(2).filter(|w| (w[0] - middle) * (w[1] - middle) < 0.0).count();
    if crossings < LEAST_CROSSINGS || width(&a) < 0.3 * width(u) {
        return None;
    }
    let lags = ((LATE_S * recording.rate()) as i64 / stride as i64).max(1);
    follow(&a, &b, (-lags / 4, lags)).filter(|found| found.explained > SLOW_EXPLAINED).map(|found| found.gain)
}
