//! Signals that stand still while their joint moves: for the whole recording, or for a stretch.

use crate::advice;
use crate::finding::{Finding, FindingKind};
use crate::joints::Joint;
use crate::numeric::{extremes, median, quantile, resolution, runs, span};
use crate::quantity::Quantity;
use crate::recording::{Recording, Signal};
use backdrive_diagnosis::recordings::noise;

/// Least length of a frozen stretch, in samples and in seconds.
const LEAST_ROWS: usize = 8;
const LEAST_S: f64 = 0.08;
/// Least jump at its end, in usual steps, that shows that the signal went on meanwhile.
const JUMP: f64 = 5.0;
/// Share of this jump that the partner has to move meanwhile, where there is one.
const PARTNER_MOVES: f64 = 0.2;
/// Share of its range by which a partner has to move in the stretch.
const MOVES: f64 = 0.005;
/// Share of equal neighbours above which a signal stands still as a rule, and stretches are not reported.
const OFTEN_EQUAL: f64 = 0.25;

/// Finds them.
pub fn check(recording: &Recording, joints: &[Joint], out: &mut Vec<Finding>) {
    for joint in joints {
        stuck(recording, joint, out);
    }
    for (place, signal) in recording.signals.iter().enumerate() {
        let joint = joints.iter().find(|joint| {
            [joint.command, joint.position, joint.velocity, joint.effort, joint.current].contains(&Some(place))
                && !(joint.is_led && joint.command == Some(place))
        });
        if signal.quantity.is_measured() || signal.quantity == Quantity::Command {
            frozen(recording, signal, joint, out);
        }
    }
}

/// A signal with one value in a joint whose other signals move. What a command or a torque that stands still means is another check.
fn stuck(recording: &Recording, joint: &Joint, out: &mut Vec<Finding>) {
    let moves = |place: Option<usize>| place.is_some_and(|place| is_moving(&recording.signals[place]));
    let partners = [joint.command, joint.position, joint.velocity];
    for place in [joint.position, joint.velocity].into_iter().flatten() {
        let signal = &recording.signals[place];
        if span(&signal.values) > 0.0 || !partners.iter().any(|other| *other != Some(place) && moves(*other)) {
            continue;
        }
        let value = signal.values.first().copied().unwrap_or(0.0);
        let message = format!("{:?} is constant at {value} while its joint moves: the sensor is dead or the column is wrong", signal.name);
        let todo = match signal.quantity {
            Quantity::Velocity => "omit the velocity: it is computed from the position".to_string(),
            _ => "name the column that holds the position, or record again".to_string(),
        };
        out.push(Finding::new(FindingKind::Stuck, &recording.file, &[&signal.name], message).at(&joint.name).todo(todo));
    }
}

fn is_moving(signal: &Signal) -> bool {
    let noise = signal.noise.max(signal.step);
    span(&signal.even) > 10.0 * noise && span(&signal.even) > 0.0
}

fn frozen(recording: &Recording, signal: &Signal, joint: Option<&Joint>, out: &mut Vec<Finding>) {
    let values = &signal.values;
    let stream = recording.stream(signal);
    let steps: Vec<f64> = values.windows(2).map(|w| (w[1] - w[0]).abs()).collect();
    let moving: Vec<f64> = steps.iter().copied().filter(|step| *step > 0.0 && step.is_finite()).collect();
    if moving.len() < 50 {
        return;
    }
    let equal = 1.0 - moving.len() as f64 / steps.len() as f64;
    let (usual, large) = (median(&moving), quantile(&moving, 0.95));
    let Some((low, high)) = extremes(values) else { return };
    let (range, fine) = (high - low, resolution(values));
    // Noise beyond the step: then no two neighbours are equal but by chance.
    let is_fine = noise::white(values).is_some_and(|noise| noise > fine);
    let candidates = runs(values, LEAST_ROWS).into_iter().filter(|(from, to)| stream.time(*to) - stream.time(*from) >= LEAST_S);
    let mut found: Vec<(usize, usize)> = Vec::new();
    for (from, to) in candidates {
        let before = from.checked_sub(1).map_or(0.0, |before| steps[before]);
        let after = steps.get(to).copied().unwrap_or(0.0);
        // Noise does not stand still: with this share of equal neighbours so long a run does not happen once in a million recordings.
        let chance = equal.max(1e-3).powi((to - from) as i32) * values.len() as f64;
        let is_noisy = is_fine && equal < OFTEN_EQUAL && chance < 1e-6 && values[from] != 0.0;
        let at_an_end = (values[from] - low).abs().min((high - values[from]).abs()) < (1e-3 * range).max(3.0 * fine);
        // Where rows are missing behind it, the jump is theirs.
        let is_gap =
            stream.times.get(to + 1).is_some_and(|next| next - stream.times[to] > 1.5 * recording.period || *next <= stream.times[to]);
        let jumped = !is_gap && after > JUMP * large && before > 0.1 * usual && after < large * (to - from) as f64 * 1.5;
        let noise_stops = is_noisy && !at_an_end && signal.quantity.is_measured() && is_noisy_around(values, from, to);
        if (noise_stops && joint_moves(recording, joint, signal, from, to))
            || (jumped && partner_moves(recording, joint, signal, from, to, after))
        {
            found.push((from, to));
        }
    }
    let Some((from, to)) = found.iter().copied().max_by_key(|(from, to)| to - from) else { return };
    let length = stream.time(to) - stream.time(from);
    let (word, a, b) = (stream.row_word(), stream.row(from), stream.row(to));
    let more = if found.len() > 1 { format!(" ({} such stretches)", found.len()) } else { String::new() };
    let message =
        format!("{:?} repeats {} for {length:.2} s, {word} {a} to {b}, while it changes before and after{more}", signal.name, values[from]);
    let mut finding = Finding::new(FindingKind::Frozen, &recording.file, &[&signal.name], message).at(&signal.joint);
    finding.rows = Some([a, b]);
    finding.time_s = Some([stream.time(from), stream.time(to)]);
    out.push(finding.todo(advice::without(&recording.file, from, to + 1, values.len())));
}

/// Rows of a signal on the recording's even clock.
fn even_rows(recording: &Recording, signal: &Signal, from: usize, to: usize) -> (usize, usize) {
    let stream = recording.stream(signal);
    let at = |row: usize| (stream.time(row) / recording.period).round() as usize;
    (at(from), at(to))
}

/// Whether neighbours differ before and behind a stretch: where they do not, it rests there.
fn is_noisy_around(values: &[f64], from: usize, to: usize) -> bool {
    let length = 3 * (to - from);
    let share = |part: &[f64]| part.windows(2).filter(|w| w[0] == w[1]).count() as f64 / part.len().max(1) as f64;
    let (before, behind) = (&values[from.saturating_sub(length)..from], &values[to + 1..(to + 1 + length).min(values.len())]);
    before.len().max(behind.len()) >= LEAST_ROWS && share(before) < OFTEN_EQUAL && share(behind) < OFTEN_EQUAL
}

/// Whether the joint is known to move in this stretch: by its command or its velocity where it is the position that stands, else by its position.
fn joint_moves(recording: &Recording, joint: Option<&Joint>, signal: &Signal, from: usize, to: usize) -> bool {
    let Some(joint) = joint else { return false };
    let (a, b) = even_rows(recording, signal, from, to);
    [joint.command, joint.position, joint.velocity].into_iter().flatten().map(|place| &recording.signals[place]).any(|other| {
        let part = other.even.get(a..=b.min(other.even.len().saturating_sub(1))).unwrap_or(&[]);
        let noise = other.noise.max(resolution(&other.even));
        !std::ptr::eq(other, signal) && span(part) > (5.0 * noise).max(MOVES * span(&other.even))
    })
}

/// Whether the partner of a signal moved on while it stood: of a position its command, of a command its position.
fn partner_moves(recording: &Recording, joint: Option<&Joint>, signal: &Signal, from: usize, to: usize, jump: f64) -> bool {
    let partner = match signal.quantity {
        Quantity::Position => joint.and_then(|joint| joint.command),
        Quantity::Command => joint.and_then(|joint| joint.position),
        _ => None,
    };
    let Some(partner) = partner.map(|place| &recording.signals[place]).filter(|partner| !std::ptr::eq(*partner, signal)) else {
        // Without a partner a command may stand and jump as it likes.
        return signal.quantity != Quantity::Command;
    };
    let (a, b) = even_rows(recording, signal, from, to);
    let whole = span(&partner.even) / span(&signal.even).max(f64::MIN_POSITIVE);
    let moved = partner.even.get(a..=b.min(partner.even.len().saturating_sub(1))).map_or(0.0, span);
    moved > PARTNER_MOVES * whole * jump * signal.factor().abs()
}
