//! A servo joint in time: from recorded commands alone to its positions.
//!
//! Over a substep the motion under inertia and damping is exact, forces are those of its middle, and a reversal is met where it falls. At rest friction is any
//! force up to its level, so a joint that rests under a load does not creep.

use crate::record::Record;
use backdrive_plant::servo::{Number, Numbers};

/// Coefficients of a substep: how far and how fast speed and force move the joint in it.
#[derive(Clone, Copy)]
struct Step {
    h: f64,
    /// Displacement per speed at the beginning, s, and what remains of that speed.
    drift: f64,
    keeps: f64,
    /// Displacement and speed per force.
    pushed: f64,
    gains: f64,
}

impl Step {
    fn new(h: f64, inertia: f64, damping: f64) -> Step {
        let x = damping * h / inertia;
        // (1 - e^-x) / x and (x - 1 + e^-x) / x^2, by their series where x is small.
        let (one, two) = match x < 1e-3 {
            true => (1.0 - x / 2.0 + x * x / 6.0, 0.5 - x / 6.0 + x * x / 24.0),
            false => {
                let one = -(-x).exp_m1() / x;
                (one, (1.0 - one) / x)
            }
        };
        Step { h, drift: h * one, keeps: (-x).exp(), pushed: h * h / inertia * two, gains: h / inertia * one }
    }
}

/// The command at work: held from its sample to the next, and late.
struct Held<'a> {
    t: &'a [f64],
    command: &'a [f64],
    at: usize,
}

impl Held<'_> {
    /// Its mean from a time to another one, and the change at the sample that is held at the beginning, per second.
    fn mean(&mut self, from: f64, to: f64) -> f64 {
        let last = self.t.len() - 1;
        while self.at < last && self.t[self.at + 1] <= from {
            self.at += 1;
        }
        if self.at == last || to <= self.t[self.at + 1] {
            return self.command[self.at];
        }
        let (mut sum, mut left, mut index) = (0.0, from, self.at);
        while index < last && self.t[index + 1] < to {
            let right = self.t[index + 1];
            sum += (right - left) * self.command[index];
            left = right;
            index += 1;
        }
        (sum + (to - left) * self.command[index]) / (to - from)
    }

    fn slope(&self) -> f64 {
        match self.at {
            0 => 0.0,
            at => (self.command[at] - self.command[at - 1]) / (self.t[at] - self.t[at - 1]),
        }
    }
}

/// Free run of a record: positions at its samples, from its commands alone. `substeps`: how many of them between two samples, at least 1.
pub fn simulate(numbers: &Numbers, record: &Record, substeps: usize) -> Vec<f64> {
    let n = |number: Number| numbers[number];
    let (delay, ratio, offset) = (n(Number::Delay), n(Number::Gain), n(Number::Offset));
    let (friction, load_friction) = (n(Number::Friction), n(Number::LoadFriction));
    let (excess, stribeck_speed) = (n(Number::Stribeck), n(Number::StribeckSpeed));
    let (dead, limit, play) = (n(Number::DeadBand), n(Number::Limit), 0.5 * n(Number::Play));
    let (most_speed, most_acceleration) = (n(Number::Speed), n(Number::Acceleration));
    let (gravity, cos, sin) = (n(Number::Gravity), n(Number::MomentCos), n(Number::MomentSin));
    let (integral, lead, drag) = (n(Number::Integral), n(Number::Lead), n(Number::QuadraticDamping));
    let (inertia, damping) = (n(Number::Inertia), n(Number::Damping));
    let has_profile = most_speed < 1e8 || most_acceleration < 1e8;
    let has_weight = gravity != 0.0 || cos != 0.0 || sin != 0.0;

    let t = record.t.as_slice();
    let mut out = Vec::with_capacity(t.len());
    let (Some(first), Some(position)) = (record.command.first(), record.position.first()) else { return out };
    let (mut q, mut v) = (*position, 0.0f64);
    let mut step = Step::new(1.0, inertia, damping);
    let first = ratio * first + offset;
    let (mut held, mut profile, mut profile_speed, mut sum) = (first, first, 0.0f64, 0.0f64);
    let mut command_at = Held { t, command: &record.command, at: 0 };
    out.push(q);
    for i in 0..t.len() - 1 {
        let h = (t[i + 1] - t[i]) / substeps as f64;
        if (h - step.h).abs() > 1e-6 * step.h {
            step = Step::new(h, inertia, damping);
        }
        // The weight about where the joint is now: its value and its slope.
        let (mut weight_here, mut weight_slope, from) = (0.0, 0.0, q);
        if has_weight {
            let [a, b, c] = record.gravity.get(i).copied().unwrap_or_default();
            let (a, b) = (gravity * a + cos, gravity * b + sin);
            let (s, co) = q.sin_cos();
            (weight_here, weight_slope) = (a * co + b * s + gravity * c, b * co - a * s);
        }
        for k in 0..substeps {
            let begins = t[i] + k as f64 * h - delay;
            let mut command = ratio * command_at.mean(begins, begins + h) + offset;
            if lead != 0.0 {
                command += lead * command_at.slope();
            }
            if has_profile {
                follow(&mut profile, &mut profile_speed, command, most_speed, most_acceleration, h);
                command = profile;
            }
            if play > 0.0 {
                held = held.clamp(command - play, command + play);
                command = held;
            }
            // Force of the servo where the joint is, and its stiffness.
            let error = command - q;
            let (mut force, mut stiffness) = (error, 1.0);
            if dead > 0.0 {
                let beyond = error.abs() - dead;
                (force, stiffness) = if beyond > 0.0 { (beyond.copysign(error), 1.0) } else { (0.0, 0.0) };
            }
            if integral > 0.0 {
                sum += integral * h * force;
                force += sum;
            }
            if force.abs() > limit {
                (force, stiffness) = (limit.copysign(force), 0.0);
            }
            let weight = weight_here + weight_slope * (q - from);
            let mut level = friction + load_friction * weight.abs();
            if excess > 0.0 {
                let x = v / stribeck_speed;
                level += excess * (-x * x).exp();
            }
            let push = force - weight - drag * v * v.abs();
            let way = match v {
                v if v > 0.0 => 1.0,
                v if v < 0.0 => -1.0,
                _ if push > level => 1.0,
                _ if -push > level => -1.0,
                _ => continue,
            };
            let right = push - way * level;
            let far = (step.drift * v + step.pushed * right) / (1.0 + 0.5 * step.pushed * stiffness);
            let next = step.keeps * v + step.gains * (right - 0.5 * stiffness * far);
            if next * way >= 0.0 {
                (q, v) = (q + far, next);
                continue;
            }
            // It comes to rest within the substep: there it stays, or it turns for the rest.
            let share = if v != 0.0 { v / (v - next) } else { 0.0 };
            let stopped = 0.5 * share * h * v;
            q += stopped;
            v = 0.0;
            let back = push - stiffness * stopped + way * level;
            if -way * back > 0.0 {
                let rest = (1.0 - share) * h;
                v = back * rest / (inertia + damping * rest);
                q += 0.5 * rest * v;
            }
        }
        out.push(q);
    }
    out
}

/// A profile of bounded speed and acceleration follows its goal for a substep.
fn follow(at: &mut f64, speed: &mut f64, goal: f64, most_speed: f64, most_acceleration: f64, h: f64) {
    let left = goal - *at;
    if left == 0.0 && *speed == 0.0 {
        return;
    }
    // The speed from which it can still stop at the goal, and that which arrives there in this substep.
    let wanted = (2.0 * most_acceleration * left.abs()).sqrt().min(most_speed).min(left.abs() / h).copysign(left);
    let change = most_acceleration * h;
    *speed = wanted.clamp(*speed - change, *speed + change);
    *at += *speed * h;
}
