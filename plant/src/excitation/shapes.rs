//! Sweeps, and the shapes that are laid out piece by piece.

use super::shape::{Shape, Spacing};
use std::f64::consts::{PI, TAU};

impl Spacing {
    /// Phase, rad, and frequency, Hz, at `t` of a sweep.
    pub(super) fn phase(self, from: f64, to: f64, duration: f64, t: f64) -> (f64, f64) {
        let octaves = (to / from).ln();
        if self == Spacing::Linear || octaves == 0.0 {
            let rate = (to - from) / duration;
            return (TAU * (from + 0.5 * rate * t) * t, from + rate * t);
        }
        let frequency = from * (octaves * t / duration).exp();
        (TAU * duration / octaves * (frequency - from), frequency)
    }
}

impl Shape {
    /// Length, s.
    pub fn duration(&self) -> f64 {
        match self {
            Shape::Sweep { duration, .. } => *duration,
            Shape::Multisine { period, periods, levels, .. } => period * f64::from(*periods) * levels.len() as f64,
            other => pieces(other).last().map_or(0.0, |p| p.end),
        }
    }

    /// Highest frequency that it must have room for, Hz; 0 for shapes with corners, which have no highest.
    pub fn highest_hz(&self) -> f64 {
        match self {
            Shape::Sweep { from, to, .. } | Shape::Multisine { from, to, .. } => from.max(*to),
            Shape::Sines { frequency, .. } => frequency.iter().copied().fold(0.0, f64::max),
            // Two samples in a pulse are the least that show it.
            Shape::Impacts { width, .. } => 1.0 / width,
            Shape::Triangle { .. } | Shape::Steps { .. } => 0.0,
        }
    }

    /// The name of its kind.
    pub fn kind(&self) -> &'static str {
        match self {
            Shape::Sweep { .. } => "sweep",
            Shape::Multisine { .. } => "multisine",
            Shape::Triangle { .. } => "triangle",
            Shape::Steps { .. } => "steps",
            Shape::Impacts { .. } => "impacts",
            Shape::Sines { .. } => "sines",
        }
    }
}

/// A piece of a signal, from where the one before ends.
#[derive(Debug, Clone, Copy)]
pub(super) struct Piece {
    start: f64,
    pub end: f64,
    course: Course,
}

#[derive(Debug, Clone, Copy)]
enum Course {
    /// From the first to the second value in a straight line.
    Line(f64, f64),
    /// `amplitude sin(2 pi frequency s)`.
    Sine(f64, f64),
    /// `amplitude sin(pi s/length)`.
    Pulse(f64),
}

struct Layout {
    pieces: Vec<Piece>,
    time: f64,
    value: f64,
}

impl Layout {
    fn push(&mut self, length: f64, course: Course) {
        self.pieces.push(Piece { start: self.time, end: self.time + length, course });
        self.time += length;
    }

    /// To a value in a straight line at a speed.
    fn ramp(&mut self, to: f64, speed: f64) {
        let length = (to - self.value).abs() / speed;
        if length > 0.0 {
            self.push(length, Course::Line(self.value, to));
            self.value = to;
        }
    }

    /// To a value within `rise`, and stays there.
    fn step(&mut self, to: f64, rise: f64, hold: f64) {
        if rise > 0.0 {
            self.push(rise, Course::Line(self.value, to));
        }
        self.push((hold - rise).max(0.0), Course::Line(to, to));
        self.value = to;
    }
}

pub(super) fn pieces(shape: &Shape) -> Vec<Piece> {
    let mut layout = Layout { pieces: Vec::new(), time: 0.0, value: 0.0 };
    match shape {
        Shape::Triangle { amplitude, period, cycles, nested, inner } => {
            for period in period {
                let speed = 4.0 * amplitude / period;
                for _ in 0..*cycles {
                    rising(&mut layout, *amplitude, speed, *nested, *inner);
                    layout.ramp(-amplitude, speed);
                }
            }
            // Ends where it began.
            let speed = 4.0 * amplitude / period.last().copied().unwrap_or(1.0);
            layout.ramp(0.0, speed);
        }
        Shape::Steps { amplitude, hold, rise, count } => {
            for _ in 0..*count {
                for level in amplitude {
                    for to in [*level, 0.0, -level, 0.0] {
                        layout.step(to, *rise, *hold);
                    }
                }
            }
        }
        Shape::Impacts { amplitude, width, interval, count, bounces } => {
            for peak in amplitude {
                for _ in 0..*count {
                    impact(&mut layout, *peak, *width, *interval, *bounces);
                }
            }
        }
        Shape::Sines { amplitude, frequency, cycles } => {
            for f in frequency {
                for a in amplitude {
                    layout.push(f64::from(*cycles) / f, Course::Sine(*a, *f));
                }
            }
        }
        Shape::Sweep { .. } | Shape::Multisine { .. } => {}
    }
    layout.pieces
}

/// Up to the amplitude, with closed inner loops evenly on the way: each goes back by `inner` and returns to where it left.
fn rising(layout: &mut Layout, amplitude: f64, speed: f64, nested: u32, inner: f64) {
    let from = layout.value;
    for i in 1..=nested {
        let top = from + (amplitude - from) * f64::from(i) / f64::from(nested + 1);
        layout.ramp(top, speed);
        layout.ramp(top - inner * amplitude, speed);
        layout.ramp(top, speed);
    }
    layout.ramp(amplitude, speed);
}

/// One impact and its bounces within an interval; pulses that would leave the interval are left out.
fn impact(layout: &mut Layout, peak: f64, width: f64, interval: f64, bounces: u32) {
    let end = layout.time + interval;
    let (mut height, mut pause) = (peak, 6.0 * width);
    for i in 0..=bounces {
        if i > 0 {
            if layout.time + pause + width > end {
                break;
            }
            layout.push(pause, Course::Line(0.0, 0.0));
            pause *= 0.7;
        }
        layout.push(width, Course::Pulse(height));
        height *= 0.5;
    }
    layout.push((end - layout.time).max(0.0), Course::Line(0.0, 0.0));
}

/// Value at `t`, from 0 to the end of the last piece.
pub(super) fn at(pieces: &[Piece], t: f64) -> f64 {
    let Some(piece) = pieces.get(pieces.partition_point(|p| p.end <= t)) else { return 0.0 };
    let (s, length) = (t - piece.start, piece.end - piece.start);
    match piece.course {
        Course::Line(from, to) => from + (to - from) * s / length,
        Course::Sine(amplitude, frequency) => amplitude * (TAU * frequency * s).sin(),
        Course::Pulse(amplitude) => amplitude * (PI * s / length).sin(),
    }
}
