//! An excitation as a function of time.

use super::error::ExcitationError;
use super::multisine::{Lines, whole};
use super::shape::{Shape, Spacing};
use super::shapes;
use std::f64::consts::PI;

/// The excitation signal, and how it is framed.
#[derive(Debug, Clone, PartialEq, serde::Serialize, serde::Deserialize)]
#[serde(try_from = "String", into = "String")]
pub struct Excitation {
    /// The kind and its parameters.
    pub shape: Shape,
    /// Rest before it, s.
    pub quiet: f64,
    /// Raised-cosine rise of the amplitude at its beginning, s.
    pub fade_in: f64,
    /// Raised-cosine fall of the amplitude at its end, s.
    pub fade_out: f64,
    /// Added to it, and faded with it; unit of the input.
    pub offset: f64,
    /// Largest magnitude that leaves it, unit of the input; infinite when there is no limit.
    pub limit: f64,
}

/// Most samples that an excitation is made of.
const MOST_SAMPLES: usize = 100_000_000;

impl Excitation {
    /// A shape without quiet, fades, offset or limit.
    pub fn of(shape: Shape) -> Excitation {
        Excitation { shape, quiet: 0.0, fade_in: 0.0, fade_out: 0.0, offset: 0.0, limit: f64::INFINITY }
    }

    /// Length, s, with the quiet before it.
    pub fn duration(&self) -> f64 {
        self.quiet + self.shape.duration()
    }

    /// Whether a sampling rate can carry it.
    pub fn fits(&self, rate_hz: f64) -> Result<(), ExcitationError> {
        let highest = self.shape.highest_hz();
        // Written so that a rate that is no number is refused too.
        if !(rate_hz > 2.0 * highest && rate_hz > 0.0) {
            let (rate, needed, highest) = (rate_hz.to_string(), (2.0 * highest).to_string(), highest.to_string());
            return Err(ExcitationError::Rate { rate, highest, needed });
        }
        if self.duration() * rate_hz > MOST_SAMPLES as f64 {
            let (seconds, rate) = (self.duration().to_string(), rate_hz.to_string());
            return Err(ExcitationError::TooLong { seconds, rate, most: MOST_SAMPLES });
        }
        Ok(())
    }

    /// Its samples at a rate, from time 0 on, up to but without its end.
    pub fn samples(&self, rate_hz: f64) -> Result<Vec<f64>, ExcitationError> {
        self.fits(rate_hz)?;
        let count = (self.duration() * rate_hz).round().max(1.0) as usize;
        let signal = self.signal();
        if let (Core::Lines(lines, levels), Some(rest)) = (&signal.core, whole(self.quiet * rate_hz))
            && let Some(period) = lines.one_period(rate_hz)
        {
            let value = |i: usize| match i.checked_sub(rest) {
                Some(k) => signal.framed(k as f64 / rate_hz, levels.at(k as f64 / rate_hz) * period[k % period.len()]),
                None => 0.0,
            };
            return Ok((0..count).map(value).collect());
        }
        Ok((0..count).map(|i| signal.at(i as f64 / rate_hz)).collect())
    }

    /// The excitation ready to be asked for values: phases are drawn and turning points laid out once.
    pub fn signal(&self) -> Signal {
        let core = match &self.shape {
            Shape::Multisine { rms, peak, from, to, period, periods, levels, grid, seed, crest } => {
                let lines = Lines::new([*from, *to], *period, *grid, *seed, *crest, *rms, *peak);
                Core::Lines(lines, Levels { length: period * f64::from(*periods), factors: levels.clone() })
            }
            Shape::Sweep { amplitude, from, to, duration, spacing, tilt } => {
                Core::Sweep { amplitude: *amplitude, from: *from, to: *to, duration: *duration, spacing: *spacing, tilt: *tilt }
            }
            shape => Core::Pieces(shapes::pieces(shape)),
        };
        Signal { core, frame: self.clone(), length: self.shape.duration() }
    }
}

/// An excitation that is ready to be asked for values.
#[derive(Debug, Clone)]
pub struct Signal {
    core: Core,
    frame: Excitation,
    length: f64,
}

#[derive(Debug, Clone)]
enum Core {
    Lines(Lines, Levels),
    Pieces(Vec<shapes::Piece>),
    Sweep { amplitude: f64, from: f64, to: f64, duration: f64, spacing: Spacing, tilt: f64 },
}

/// Factors that follow each other, each for the same time.
#[derive(Debug, Clone)]
struct Levels {
    /// s of each.
    length: f64,
    factors: Vec<f64>,
}

impl Levels {
    /// The factor in force at `t`, s; that of the last one beyond its end.
    fn at(&self, t: f64) -> f64 {
        // Rounding must not let a level begin a sample late.
        let index = ((t / self.length + 1e-9).max(0.0) as usize).min(self.factors.len().saturating_sub(1));
        self.factors.get(index).copied().unwrap_or(1.0)
    }
}

impl Signal {
    /// Value at a time, s from its start; 0 before and after it. Unit of the input.
    pub fn at(&self, time: f64) -> f64 {
        let t = time - self.frame.quiet;
        if !(0.0..self.length).contains(&t) {
            return 0.0;
        }
        let core = match &self.core {
            Core::Lines(lines, levels) => levels.at(t) * lines.at(t),
            Core::Pieces(pieces) => shapes::at(pieces, t),
            Core::Sweep { amplitude, from, to, duration, spacing, tilt } => {
                let (phase, frequency) = spacing.phase(*from, *to, *duration, t);
                amplitude * (frequency / from).powf(*tilt) * phase.sin()
            }
        };
        self.framed(t, core)
    }

    /// The value at `t` of the shape with fades, offset and limit.
    fn framed(&self, t: f64, core: f64) -> f64 {
        let rise = fade(t, self.frame.fade_in);
        let fall = fade(self.length - t, self.frame.fade_out);
        ((core + self.frame.offset) * rise * fall).clamp(-self.frame.limit, self.frame.limit)
    }
}

/// Raised cosine from 0 at 0 to 1 at `length`.
fn fade(t: f64, length: f64) -> f64 {
    if t >= length { 1.0 } else { 0.5 - 0.5 * (PI * t / length).cos() }
}
