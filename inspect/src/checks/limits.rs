//! What a sensor cannot say: beyond its range, the sign, between its steps.

use crate::finding::{Finding, FindingKind, Weight};
use crate::joints::Joint;
use crate::numeric::{extremes, median, resolution, span, width};
use crate::quantity::Quantity;
use crate::recording::{Recording, Signal};
use backdrive_diagnosis::audit::limits_reached;
use backdrive_diagnosis::recordings::noise;
use backdrive_plant::recording::units::Kind;
use backdrive_signal::derivative;
use backdrive_signal::low_pass::LowPass;

/// A limit is entered at this share of the usual step at least: what comes to rest there by itself slows down before.
const ENTERED: f64 = 0.4;
/// Fewest samples that stand at a limit.
const LEAST_AT_LIMIT: usize = 8;
/// A command goes beyond a limit by this share of its range; droop and dead bands leave less.
const BEYOND: f64 = 0.05;
/// Of a joint with a command the limit is entered by this many steps of the sensor at least: stiction stops a joint that is slow already.
const ENTRY_STEPS: f64 = 3.0;
/// The least of a signal without a sign, as a share of its range: it comes down to 0.
const TOUCHES: f64 = 0.02;
/// It does so this often, and rises to this share again: a motor that is off at the beginning does so once.
const LEAST_TOUCHES: usize = 3;
const RISES: f64 = 0.08;
/// Share of the samples with motion, and their number, in either direction, for a drive to need both signs.
const LEAST_MOVING: usize = 40;
const EITHER_WAY: f64 = 0.05;
/// Steps across the motion below which a position or a velocity is coarse, and a torque or a current.
const COARSE: f64 = 25.0;
const COARSE_DRIVE: f64 = 14.0;
/// Steps that encoders of joints have, rad (1024 counts a turn) and m: finer ones are not coarse, the motion is small.
const USUAL_STEP: [f64; 2] = [6.2e-3, 2e-4];

/// Finds them.
pub fn check(recording: &Recording, joints: &[Joint], out: &mut Vec<Finding>) {
    for signal in &recording.signals {
        if signal.quantity.is_measured() || signal.quantity == Quantity::Voltage || signal.quantity == Quantity::Unknown {
            let joint = joints.iter().find(|joint| joint.position.is_some_and(|place| std::ptr::eq(&recording.signals[place], signal)));
            clipped(recording, signal, joint, out);
        }
    }
    for joint in joints {
        joint.drives().for_each(|place| rectified(recording, joint, place, out));
        for place in [joint.position, joint.velocity, joint.effort, joint.current].into_iter().flatten() {
            quantised(recording, joint, place, out);
        }
    }
}

fn clipped(recording: &Recording, signal: &Signal, joint: Option<&Joint>, out: &mut Vec<Finding>) {
    let values: Vec<f64> = signal.values.iter().copied().filter(|x| x.is_finite()).collect();
    let whole = span(&values);
    if values.len() < 100 || whole <= 0.0 {
        return;
    }
    let moving: Vec<f64> = values.windows(2).map(|w| (w[1] - w[0]).abs()).filter(|step| *step > 0.0).collect();
    let usual = median(&moving);
    let step = noise::step_of(&values).unwrap_or(0.0);
    let mut found: Vec<(f64, usize, usize)> = Vec::new();
    for (level, _) in limits_reached(&values) {
        let is_at = |x: f64| (x - level).abs() <= 1e-4 * whole;
        let count = values.iter().filter(|x| is_at(**x)).count();
        let entries: Vec<f64> = values.windows(2).filter(|w| !is_at(w[0]) && is_at(w[1])).map(|w| (w[1] - w[0]).abs()).collect();
        let stands = values.windows(2).filter(|w| is_at(w[0]) && is_at(w[1])).count();
        // Rest at 0 is no limit, and one step of the sensor is how any motion ends.
        if count >= LEAST_AT_LIMIT
            && stands * 3 >= count
            && level != 0.0
            && !entries.is_empty()
            && crate::numeric::mean(&entries) > (ENTERED * usual).max(1.5 * step)
        {
            let is_slow = crate::numeric::mean(&entries) < ENTRY_STEPS * resolution(&values);
            if joint.is_some_and(|joint| joint.command.is_some() && (is_slow || !is_told_further(recording, joint, level))) {
                continue;
            }
            found.push((level, count, signal.values.iter().position(|x| is_at(*x)).unwrap_or(0)));
        }
    }
    let Some((_, _, first)) = found.iter().copied().max_by_key(|(_, count, _)| *count) else { return };
    let stream = recording.stream(signal);
    let levels: Vec<String> = found.iter().map(|(level, ..)| format!("{level}")).collect();
    let message = format!(
        "{:?} is at its limit of {} in {:.1} % of the samples, first in {} {}: it is clipped there",
        signal.name,
        levels.join(" and "),
        100.0 * found.iter().map(|(_, count, _)| count).sum::<usize>() as f64 / values.len() as f64,
        stream.row_word(),
        stream.row(first)
    );
    let mut finding = Finding::new(FindingKind::Clipped, &recording.file, &[&signal.name], message).at(&signal.joint);
    finding.rows = Some([stream.row(first), stream.row(first)]);
    finding.time_s = Some([stream.time(first), stream.time(first)]);
    out.push(finding.todo("widen the sensor's or the drive's range and record again; until then omit these samples"));
}

/// Whether the command of a joint goes on beyond a level at which its position stands; true where there is no command.
fn is_told_further(recording: &Recording, joint: &Joint, level: f64) -> bool {
    let (Some(command), Some(position)) = (joint.command, joint.position) else { return true };
    let (command, position) = (&recording.signals[command].even, &recording.signals[position]);
    let Some((low, high)) = extremes(command) else { return true };
    let level = level * position.factor();
    let least = BEYOND * (high - low);
    let middle = median(&position.even);
    if level > middle { high > level + least } else { low < level - least }
}

/// Share of the samples with motion in which a joint moves either way, the smaller of the two; 0 where its position does not say.
fn either_way(recording: &Recording, joint: &Joint) -> f64 {
    let Some(signal) = joint.position.map(|place| &recording.signals[place]) else { return 0.0 };
    let position = &signal.even;
    let smooth = LowPass::butterworth(2, (0.1 * recording.rate()).min(5.0), recording.rate()).both_ways(position);
    let rate = derivative(&smooth, recording.period);
    let least = 0.05 * width(&rate);
    let noise = signal.step.max(signal.noise);
    if rate.is_empty() || span(position) < 8.0 * noise || least <= 0.0 {
        return 0.0;
    }
    let count = |sign: f64| rate.iter().filter(|v| sign * **v > least).count();
    let (up, down) = (count(1.0), count(-1.0));
    if up + down < LEAST_MOVING {
        return 0.0;
    }
    up.min(down) as f64 / (up + down) as f64
}

/// How often the size of a signal comes down to 0 and rises again.
fn touches(values: &[f64], most: f64) -> usize {
    let (mut count, mut is_down) = (0, false);
    for size in values.iter().map(|x| x.abs()) {
        if size <= TOUCHES * most {
            is_down = true;
        } else if is_down && size > RISES * most {
            is_down = false;
            count += 1;
        }
    }
    count
}

fn rectified(recording: &Recording, joint: &Joint, place: usize, out: &mut Vec<Finding>) {
    let signal = &recording.signals[place];
    let Some((low, high)) = extremes(&signal.values).filter(|(low, high)| high > low) else { return };
    let is_one_sided = low >= 0.0 || high <= 0.0;
    let (least, most) = (low.abs().min(high.abs()), low.abs().max(high.abs()));
    if !is_one_sided || least > TOUCHES * most || either_way(recording, joint) < EITHER_WAY {
        return;
    }
    if touches(&signal.values, most) < LEAST_TOUCHES {
        return;
    }
    let message = format!(
        "{:?} never changes its sign while the joint moves both ways, and its minimum is {least}: it was logged without its sign \
            (rectified)",
        signal.name
    );
    let todo = "log the signed value; until then omit it from the set and use the positions alone".to_string();
    out.push(Finding::new(FindingKind::Rectified, &recording.file, &[&signal.name], message).at(&joint.name).todo(todo).sure(0.97));
}

fn quantised(recording: &Recording, joint: &Joint, place: usize, out: &mut Vec<Finding>) {
    let signal = &recording.signals[place];
    let Some(step) = noise::step_of(&signal.values) else { return };
    let levels = width(&signal.values) / step;
    let limit = if signal.quantity.is_drive() { COARSE_DRIVE } else { COARSE };
    // A joint that is commanded to stand still, or a motion of one or two steps, needs no finer sensor.
    let asked = joint.command.filter(|_| !joint.is_led).map_or(f64::INFINITY, |place| span(&recording.signals[place].even));
    if levels < 3.0 || levels >= limit || asked < 3.0 * step * signal.factor().abs() {
        return;
    }
    let message = format!("{:?} has steps of {step:.6}, {levels:.0} across its range: derivatives of it are equally coarse", signal.name);
    // A joint that hardly moves has few steps with any encoder: that is its motion, not its sensor.
    let is_length = signal.stated.or(signal.hint).is_some_and(|unit| unit.kind == Kind::Length);
    let usual = if is_length { USUAL_STEP[1] } else { USUAL_STEP[0] };
    let is_usual = signal.quantity == Quantity::Position && step * signal.factor().abs() < usual;
    let weight = if is_usual { Weight::Note } else { Weight::Wrong };
    let more = format!("resolution = {:.6}", step * signal.factor().abs());
    let todo = format!("state it in the model's output ({more}), or record larger motions or with a finer sensor");
    out.push(Finding::new(FindingKind::Quantised, &recording.file, &[&signal.name], message).at(&joint.name).weighing(weight).todo(todo));
}
