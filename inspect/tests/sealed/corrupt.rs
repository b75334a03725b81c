//! One thing made wrong in a clean recording, and what an answer has to name.

use super::draw::{Clean, Column, Random, Role};
use backdrive_inspect::FindingKind as Kind;

/// A recording with one thing wrong.
pub struct Corrupted {
    pub name: &'static str,
    /// Kinds that are right answers.
    pub accepted: Vec<Kind>,
    /// Columns of which one has to be named; empty where the whole file is meant.
    pub columns: Vec<String>,
    /// Pieces, each a file.
    pub pieces: Vec<Vec<Column>>,
}

pub const NAMES: [&str; 27] = [
    "stuck",
    "clipped",
    "rectified",
    "rectified velocity",
    "quantised",
    "outliers",
    "gap",
    "missing",
    "time back",
    "duplicated",
    "frozen",
    "repeated",
    "held",
    "interpolated",
    "filtered",
    "degrees",
    "milliampere",
    "degrees velocity",
    "sign",
    "sign velocity",
    "scale",
    "scale velocity",
    "swapped",
    "velocity late",
    "torque late",
    "zero shifted",
    "exchanged",
];
/// Further ones, which need a joint with a command.
pub const MORE: [&str; 4] = ["passive command", "passive torque", "rate limit", "state as action"];

fn span(x: &[f64]) -> f64 {
    x.iter().fold(f64::NEG_INFINITY, |m, x| m.max(*x)) - x.iter().fold(f64::INFINITY, |m, x| m.min(*x))
}

fn quantile(x: &[f64], share: f64) -> f64 {
    let mut x = x.to_vec();
    x.sort_by(f64::total_cmp);
    x[((x.len() - 1) as f64 * share) as usize]
}

fn derivative(x: &[f64], period: f64) -> Vec<f64> {
    (0..x.len()).map(|i| (x[(i + 1).min(x.len() - 1)] - x[i.saturating_sub(1)]) / (2.0 * period)).collect()
}

/// How far a signal moves within some rows.
fn moves(x: &[f64], from: usize, to: usize) -> f64 {
    span(&x[from..to])
}

/// A stretch in which a signal moves by a good part of its range.
fn busy(random: &mut Random, x: &[f64], length: usize) -> Option<usize> {
    (0..200).map(|_| random.below(x.len() - length - 20) + 10).find(|from| {
        let (a, b) = (x[*from], x[*from + length]);
        moves(x, *from, *from + length) > 0.08 * span(x) && (a - b).abs() > 0.06 * span(x)
    })
}

/// Puts one thing into a recording; `None` where it does not fit this one.
pub fn corrupt(random: &mut Random, clean: &Clean, name: &'static str) -> Option<Corrupted> {
    let mut columns = clean.columns.clone();
    let (rate, period) = (clean.rate, 1.0 / clean.rate);
    let rows = columns[0].values.len();
    let places =
        |columns: &[Column], roles: &[Role]| -> Vec<usize> { (0..columns.len()).filter(|i| roles.contains(&columns[*i].role)).collect() };
    let pick = |random: &mut Random, columns: &[Column], roles: &[Role]| -> Option<usize> {
        let found = places(columns, roles);
        if found.is_empty() { None } else { Some(found[random.below(found.len())]) }
    };
    let of_joint = |columns: &[Column], joint: usize, role: Role| columns.iter().position(|c| c.joint == joint && c.role == role);
    let accepted: Vec<Kind>;
    let mut named: Vec<usize> = Vec::new();
    match name {
        "stuck" => {
            let place = pick(random, &columns, &[Role::Position, Role::Velocity])?;
            // Something else of the joint has to show that it moves.
            let joint = columns[place].joint;
            let others = columns
                .iter()
                .enumerate()
                .filter(|(i, c)| *i != place && c.joint == joint && matches!(c.role, Role::Command | Role::Position | Role::Velocity));
            (others.count() > 0).then_some(())?;
            let value = columns[place].values[random.below(rows)];
            columns[place].values.fill(value);
            (accepted, named) = (vec![Kind::Stuck], vec![place]);
        }
        "clipped" => {
            let place = pick(random, &columns, &[Role::Position, Role::Velocity, Role::Drive])?;
            let share = random.range(0.02, 0.1);
            let (low, high) = (quantile(&columns[place].values, share), quantile(&columns[place].values, 1.0 - share));
            // A position clipped where it rests anyway is not clipped.
            let before = columns[place].values.clone();
            columns[place].values.iter_mut().for_each(|x| *x = x.clamp(low, high));
            let beyond = before.iter().map(|x| (x - high).max(low - x)).fold(0.0, f64::max);
            (beyond > 0.06 * span(&before)).then_some(())?;
            (accepted, named) = (vec![Kind::Clipped], vec![place]);
        }
        "rectified" | "rectified velocity" => {
            let role = if name == "rectified" { Role::Drive } else { Role::Velocity };
            let place = pick(random, &columns, &[role])?;
            let x = &columns[place].values;
            (quantile(x, 0.15) < -0.05 * span(x) && quantile(x, 0.85) > 0.05 * span(x)).then_some(())?;
            columns[place].values.iter_mut().for_each(|x| *x = x.abs());
            (accepted, named) = (vec![Kind::Rectified], vec![place]);
        }
        "quantised" => {
            let place = pick(random, &columns, &[Role::Position, Role::Velocity, Role::Drive])?;
            let step = span(&columns[place].values) / random.range(6.0, 11.0);
            columns[place].values.iter_mut().for_each(|x| *x = (*x / step).round() * step);
            (accepted, named) = (vec![Kind::Quantised], vec![place]);
        }
        "outliers" => {
            let place = pick(random, &columns, &[Role::Position, Role::Velocity, Role::Drive])?;
            let whole = span(&columns[place].values);
            let is_position = columns[place].role == Role::Position;
            for _ in 0..1 + random.below(6) {
                let (row, size) = (random.below(rows - 10) + 5, if is_position { random.range(0.3, 2.0) } else { random.range(1.8, 4.0) });
                columns[place].values[row] += whole * size * if random.chance(0.5) { 1.0 } else { -1.0 };
            }
            (accepted, named) = (vec![Kind::Outliers], vec![place]);
        }
        "gap" | "time back" | "duplicated" | "repeated" => {
            let length = (random.range(0.2, 1.5) * rate) as usize;
            let from = random.below(rows - 2 * length - 20) + 10 + length;
            accepted = match name {
                "gap" => {
                    columns.iter_mut().for_each(|c| drop(c.values.drain(from..from + length)));
                    vec![Kind::Gap]
                }
                "time back" => {
                    let back = random.range(0.05, 2.0);
                    columns[0].values[from..].iter_mut().for_each(|t| *t -= back);
                    vec![Kind::TimeGoesBack]
                }
                "duplicated" => {
                    for k in 0..1 + random.below(10) {
                        let row = from + 7 * k;
                        if row + 1 < rows {
                            columns[0].values[row + 1] = columns[0].values[row];
                        }
                    }
                    vec![Kind::DuplicateTimes]
                }
                _ => {
                    let place = pick(random, &columns, &[Role::Position])?;
                    (moves(&columns[place].values, from - length, from) > 0.05 * span(&columns[place].values)).then_some(())?;
                    columns.iter_mut().skip(1).for_each(|c| {
                        let copy = c.values[from - length..from].to_vec();
                        c.values[from..from + length].copy_from_slice(&copy);
                    });
                    vec![Kind::Repeated]
                }
            };
        }
        "missing" => {
            let place = random.below(columns.len() - 1) + 1;
            let (from, length) = (random.below(rows - 60) + 10, 1 + random.below(40));
            columns[place].values[from..from + length].fill(f64::NAN);
            (accepted, named) = (vec![Kind::Missing], vec![place]);
        }
        "frozen" => {
            let place = pick(random, &columns, &[Role::Position, Role::Velocity, Role::Drive])?;
            let length = (random.range(0.3, 1.5) * rate) as usize;
            let position = of_joint(&columns, columns[place].joint, Role::Position)
                .or_else(|| of_joint(&columns, columns[place].joint, Role::Leader))?;
            let from = busy(random, &columns[position].values, length)?;
            let value = columns[place].values[from];
            columns[place].values[from..from + length].fill(value);
            (accepted, named) = (vec![Kind::Frozen], vec![place]);
        }
        "held" | "interpolated" => {
            let place = pick(random, &columns, &[Role::Position, Role::Velocity, Role::Drive])?;
            let factor = 2 + random.below(5);
            let x = columns[place].values.clone();
            for row in 0..rows {
                let (a, share) = (row / factor * factor, (row % factor) as f64 / factor as f64);
                let b = (a + factor).min(rows - 1);
                columns[place].values[row] = if name == "held" { x[a] } else { x[a] + share * (x[b] - x[a]) };
            }
            (accepted, named) = (vec![Kind::Resampled], vec![place]);
        }
        "filtered" | "velocity late" | "torque late" => {
            let role = if name == "velocity late" || (name == "filtered" && random.chance(0.5)) { Role::Velocity } else { Role::Drive };
            let place = pick(random, &columns, &[role])?;
            let late = if name == "filtered" { random.range(0.03, 0.08) } else { random.range(0.03, 0.1).max(2.0 * period) };
            let x = columns[place].values.clone();
            if name == "filtered" {
                // First order twice: late by the sum of the time constants at low frequencies.
                let share = 1.0 - (-period / (0.5 * late)).exp();
                let (mut a, mut b) = (x[0], x[0]);
                for (y, x) in columns[place].values.iter_mut().zip(&x) {
                    a += share * (x - a);
                    b += share * (a - b);
                    *y = b;
                }
            } else {
                let shift = (late / period).round() as usize;
                for (other, column) in columns.iter_mut().enumerate() {
                    let from = if other == place { 0 } else { shift };
                    column.values = column.values[from..from + rows - shift].to_vec();
                }
            }
            let kind = if role == Role::Velocity { Kind::VelocityLag } else { Kind::EffortLag };
            (accepted, named) = (vec![kind], vec![place]);
        }
        "degrees" => {
            let place = pick(random, &columns, &[Role::Position])?;
            (of_joint(&columns, columns[place].joint, Role::Command).is_some()
                || of_joint(&columns, columns[place].joint, Role::Velocity).is_some())
            .then_some(())?;
            let factor = 180.0 / std::f64::consts::PI;
            columns[place].values.iter_mut().for_each(|x| *x *= factor);
            (accepted, named) = (vec![Kind::WrongUnit], vec![place]);
        }
        "milliampere" => {
            let place = columns.iter().position(|c| c.heading.ends_with("[A]"))?;
            columns[place].values.iter_mut().for_each(|x| *x *= 1e3);
            (span(&columns[place].values) > 250.0).then_some(())?;
            (accepted, named) = (vec![Kind::WrongUnit], vec![place]);
        }
        "degrees velocity" | "sign velocity" | "scale velocity" => {
            let place = pick(random, &columns, &[Role::Velocity])?;
            let (factor, kind) = match name {
                "degrees velocity" => (180.0 / std::f64::consts::PI, Kind::WrongUnit),
                "sign velocity" => (-1.0, Kind::WrongSign),
                _ => ([0.1, 0.5, 1.5, 2.0, 3.2][random.below(5)], Kind::WrongScale),
            };
            columns[place].values.iter_mut().for_each(|x| *x *= factor);
            (accepted, named) = (vec![kind], vec![place]);
        }
        "sign" | "scale" => {
            let place = pick(random, &columns, &[Role::Position, Role::Drive])?;
            let is_drive = columns[place].role == Role::Drive;
            // The scale of a torque cannot be known without a model.
            (!is_drive || name == "sign").then_some(())?;
            let joint = columns[place].joint;
            (is_drive || of_joint(&columns, joint, Role::Command).or(of_joint(&columns, joint, Role::Velocity)).is_some()).then_some(())?;
            let factor = if name == "sign" { -1.0 } else { [0.1, 0.5, 1.7, 2.0, 10.0][random.below(5)] };
            columns[place].values.iter_mut().for_each(|x| *x *= factor);
            (accepted, named) = (vec![if name == "sign" { Kind::WrongSign } else { Kind::WrongScale }], vec![place]);
        }
        "swapped" => {
            let position = pick(random, &columns, &[Role::Position])?;
            let joint = columns[position].joint;
            let other = of_joint(&columns, joint, Role::Command).or(of_joint(&columns, joint, Role::Velocity))?;
            let heading = columns[position].heading.clone();
            columns[position].heading = std::mem::replace(&mut columns[other].heading, heading);
            (accepted, named) = (vec![Kind::SwappedColumns], vec![position, other]);
        }
        "exchanged" => {
            let found = places(&columns, &[Role::Position]);
            (found.len() > 1).then_some(())?;
            let (a, b) = (found[random.below(found.len())], found[random.below(found.len())]);
            (a != b).then_some(())?;
            let heading = columns[a].heading.clone();
            columns[a].heading = std::mem::replace(&mut columns[b].heading, heading);
            (accepted, named) = (vec![Kind::JointsExchanged], vec![a, b]);
        }
        "passive command" | "state as action" => {
            let place = pick(random, &columns, &[Role::Command])?;
            let position = of_joint(&columns, columns[place].joint, Role::Position)?;
            if name == "passive command" {
                let value = columns[place].values[0];
                columns[place].values.fill(value);
                (accepted, named) = (vec![Kind::Passive, Kind::Stuck], vec![place]);
            } else {
                columns[place].values = columns[position].values.clone();
                (accepted, named) = (vec![Kind::CommandIsPosition], vec![place]);
            }
        }
        "passive torque" => {
            let place = pick(random, &columns, &[Role::Drive])?;
            let level = if random.chance(0.3) { 0.0 } else { 0.01 * span(&columns[place].values) };
            columns[place].values.iter_mut().for_each(|x| *x = level * random.normal());
            (accepted, named) = (vec![Kind::Passive, Kind::Stuck], vec![place]);
        }
        "rate limit" => {
            let place = pick(random, &columns, &[Role::Position])?;
            let joint = columns[place].joint;
            of_joint(&columns, joint, Role::Command)?;
            let x = columns[place].values.clone();
            let speeds: Vec<f64> = derivative(&x, period).iter().map(|v| v.abs()).collect();
            let limit = random.range(0.3, 0.6) * quantile(&speeds, 0.98);
            let mut y = x[0];
            let step = span(&x) / 4000.0;
            let limited: Vec<f64> = x
                .iter()
                .map(|x| {
                    y += (x - y).clamp(-limit * period, limit * period);
                    y
                })
                .collect();
            columns[place].values = limited.iter().map(|y| (y / step).round() * step).collect();
            if let Some(velocity) = of_joint(&columns, joint, Role::Velocity) {
                let v = derivative(&limited, period);
                let spread = 0.004 * span(&v);
                columns[velocity].values = v.iter().map(|v| v + spread * random.normal()).collect();
            }
            // What the motor does then is another motion's torque.
            columns.retain(|c| !(c.joint == joint && c.role == Role::Drive));
            named = columns.iter().position(|c| c.joint == joint && c.role == Role::Position).into_iter().collect();
            accepted = vec![Kind::RateLimit];
        }
        "zero shifted" => {
            let place = pick(random, &columns, &[Role::Position])?;
            of_joint(&columns, columns[place].joint, Role::Command)?;
            let mut pieces = halves(&columns);
            let shift = random.range(0.15, 0.6) * span(&columns[place].values) * if random.chance(0.5) { 1.0 } else { -1.0 };
            pieces[1][place].values.iter_mut().for_each(|x| *x += shift);
            let columns = vec![bare(&columns[place].heading)];
            return Some(Corrupted { name, accepted: vec![Kind::ZeroShifted], columns, pieces });
        }
        _ => return None,
    }
    let named = named.iter().map(|place| bare(&columns[*place].heading)).collect();
    Some(Corrupted { name, accepted, columns: named, pieces: vec![columns] })
}

/// A heading without its unit.
fn bare(heading: &str) -> String {
    heading.split(" [").next().unwrap_or(heading).to_string()
}

/// A recording as two files.
pub fn halves(columns: &[Column]) -> Vec<Vec<Column>> {
    let middle = columns[0].values.len() / 2;
    let piece =
        |rows: std::ops::Range<usize>| columns.iter().map(|c| Column { values: c.values[rows.clone()].to_vec(), ..c.clone() }).collect();
    vec![piece(0..middle), piece(middle..2 * middle)]
}
