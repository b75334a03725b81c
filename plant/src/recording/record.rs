//! Signals on one time axis, and how regular it is.

use super::hold::resample;
use super::units::{self, Unit};
use crate::model::{Hold, Model};
use backdrive_signal::statistics::middle_step;

/// One experiment: signals on one time axis.
#[derive(Debug, Clone, PartialEq)]
pub struct Recording {
    /// The file it came from, or what stands for it.
    pub name: String,
    /// Time of each sample, s, rising; at least 2.
    pub t: Vec<f64>,
    /// Sample time, s: `(t_last - t_first)/(N - 1)`.
    pub period: f64,
    /// Name and samples of each signal, as many as `t`, in SI units, all finite.
    pub signals: Vec<(String, Vec<f64>)>,
    /// How regular the time axis is.
    pub jitter: Jitter,
    /// Units that the file names for its signals, which are in SI units nevertheless.
    pub units: Vec<(String, Unit)>,
}

/// How far a time axis is from a regular grid.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Jitter {
    /// Root mean square distance of the samples' times from `t_first + i period`, s.
    pub rms: f64,
    /// Largest such distance, s.
    pub largest: f64,
    /// Steps of at least 1.5 median steps.
    pub gaps: Vec<Gap>,
}

/// A place where samples are missing.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Gap {
    /// Time of the last sample before it, s.
    pub after: f64,
    /// Its length, s.
    pub length: f64,
    /// How many samples of a median step would fit in.
    pub missing: usize,
}

/// Why samples are no recording.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum RecordingError {
    /// A recording needs a sample time.
    #[error("{name}: has {count} samples, needs at least 2")]
    TooShort {
        /// The recording.
        name: String,
        /// Samples there are.
        count: usize,
    },
    /// Time must rise from sample to sample.
    #[error("{name}: time does not rise at sample {index}: {now} s after {before} s")]
    NotRising {
        /// The recording.
        name: String,
        /// The sample, from 0.
        index: usize,
        /// s.
        before: f64,
        /// s.
        now: f64,
    },
    /// A signal has another number of samples than the time axis.
    #[error("{name}: signal \"{signal}\" has {count} samples, time has {expected}")]
    Length {
        /// The recording.
        name: String,
        /// The signal.
        signal: String,
        /// Its samples.
        count: usize,
        /// Samples of the time axis.
        expected: usize,
    },
    /// A sample that is no number.
    #[error("{name}: sample {index} of \"{signal}\" is {value}, expected a finite number")]
    NotFinite {
        /// The recording.
        name: String,
        /// The signal, or `t`.
        signal: String,
        /// The sample, from 0.
        index: usize,
        /// NaN or infinite.
        value: f64,
    },
    /// A sample beyond [`LARGEST`].
    #[error("{name}: sample {index} of \"{signal}\" is {value:e}, which nothing measures: a mark for a missing value? Leave such rows out")]
    TooLarge {
        /// The recording.
        name: String,
        /// The signal.
        signal: String,
        /// The sample, from 0.
        index: usize,
        /// In the signal's SI unit.
        value: f64,
    },
    /// The file names a unit that the signal cannot have.
    #[error(
        "{name}: \"{signal}\" is in {unit}, {is}; the model's signal is {expected}: name another column or unit, or set scale under \
            [columns]"
    )]
    WrongUnit {
        /// The recording.
        name: String,
        /// The signal.
        signal: String,
        /// From the file.
        unit: &'static str,
        /// What that measures.
        is: &'static str,
        /// What the signal measures.
        expected: &'static str,
    },
    /// The recording has no such signal.
    #[error("{name}: has no signal \"{signal}\"; it has {there}")]
    NoSignal {
        /// The recording.
        name: String,
        /// The signal that was asked for.
        signal: String,
        /// The signals that are there.
        there: String,
    },
}

/// Largest magnitude of a sample in SI units. No sensor measures as much, and with it squares and products of samples stay finite.
pub const LARGEST: f64 = 1e30;

impl Recording {
    /// Whether the units that the file names go with the model's signals.
    ///
    /// # Errors
    /// [`RecordingError::WrongUnit`] for the first that does not.
    pub fn check_units(&self, model: &Model) -> Result<(), RecordingError> {
        for (signal, unit) in &self.units {
            let Some(expected) = units::kind_of(model, signal).filter(|kind| *kind != unit.kind) else { continue };
            let (name, signal) = (self.name.clone(), signal.clone());
            return Err(RecordingError::WrongUnit { name, signal, unit: unit.name, is: unit.kind.text(), expected: expected.text() });
        }
        Ok(())
    }

    /// A recording from samples in SI units; checks what its fields promise and measures the jitter.
    pub fn new(name: impl Into<String>, t: Vec<f64>, signals: Vec<(String, Vec<f64>)>) -> Result<Recording, RecordingError> {
        let name = name.into();
        let count = t.len();
        let finite = |signal: &str, samples: &[f64]| match samples.iter().position(|x| !x.is_finite()) {
            Some(index) => Err(RecordingError::NotFinite { name: name.clone(), signal: signal.to_string(), index, value: samples[index] }),
            None => match samples.iter().position(|x| x.abs() > LARGEST) {
                Some(index) => {
                    Err(RecordingError::TooLarge { name: name.clone(), signal: signal.to_string(), index, value: samples[index] })
                }
                None => Ok(()),
            },
        };
        finite("t", &t)?;
        for (signal, samples) in &signals {
            if samples.len() != count {
                let (signal, expected, count) = (signal.clone(), count, samples.len());
                return Err(RecordingError::Length { name, signal, count, expected });
            }
            finite(signal, samples)?;
        }
        if let Some(i) = (1..count).find(|i| t[*i] <= t[i - 1]) {
            return Err(RecordingError::NotRising { name, index: i, before: t[i - 1], now: t[i] });
        }
        let (Some(first), Some(last), true) = (t.first(), t.last(), count > 1) else {
            return Err(RecordingError::TooShort { name, count });
        };
        let period = (last - first) / (count - 1) as f64;
        let jitter = Jitter::of(&t, period);
        Ok(Recording { name, t, period, signals, jitter, units: Vec::new() })
    }

    /// Number of samples.
    pub fn len(&self) -> usize {
        self.t.len()
    }

    /// Whether there are no samples; never so for a recording made by [`Recording::new`].
    pub fn is_empty(&self) -> bool {
        self.t.is_empty()
    }

    /// Samples of a signal.
    pub fn signal(&self, name: &str) -> Option<&[f64]> {
        self.signals.iter().find(|s| s.0 == name).map(|s| s.1.as_slice())
    }

    /// Samples of a signal that must be there.
    pub fn need_signal(&self, name: &str) -> Result<&[f64], RecordingError> {
        self.signal(name).ok_or_else(|| {
            let there: Vec<&str> = self.signals.iter().map(|s| s.0.as_str()).collect();
            RecordingError::NoSignal { name: self.name.clone(), signal: name.to_string(), there: there.join(", ") }
        })
    }

    /// Samples of the model's inputs, in its order: what drives a simulation.
    pub fn inputs_of(&self, model: &Model) -> Result<Vec<&[f64]>, RecordingError> {
        model.inputs.iter().map(|i| self.need_signal(&i.name)).collect()
    }

    /// Samples of the model's outputs, in its order: what a simulation is compared with.
    pub fn outputs_of(&self, model: &Model) -> Result<Vec<&[f64]>, RecordingError> {
        model.outputs.iter().map(|o| self.need_signal(&o.name)).collect()
    }

    /// Whether every sample lies within `tolerance` periods of the regular grid and none is missing.
    pub fn is_regular(&self, tolerance: f64) -> bool {
        self.jitter.largest <= tolerance * self.period && self.jitter.gaps.is_empty()
    }

    /// The recording on a regular grid of `period` s from its first sample on; `hold` gives for each signal name how it is interpolated between its
    /// samples.
    pub fn onto_grid(&self, period: f64, hold: impl Fn(&str) -> Hold) -> Result<Recording, RecordingError> {
        let (first, last) = (self.t.first().copied().unwrap_or(0.0), self.t.last().copied().unwrap_or(0.0));
        // A grid point that rounding put just beyond the last sample is still inside.
        let count = if period > 0.0 { ((last - first) / period + 1e-6).floor() as usize + 1 } else { 0 };
        let grid: Vec<f64> = (0..count).map(|i| first + i as f64 * period).collect();
        let signals = self.signals.iter().map(|(name, y)| (name.clone(), resample(hold(name), &self.t, y, &grid))).collect();
        Recording::new(self.name.clone(), grid, signals)
    }

    /// The recording on a regular grid of its own.
    ///
    /// Times that are even but for their rounding stay as they are written. Where no sample is missing and none is half a period from its place, samples keep
    /// their values and only the times are made even. Otherwise the grid has the median step. Inputs of the model are interpolated by their hold, and
    /// everything else linearly.
    pub fn regular_for(&self, model: &Model) -> Result<Recording, RecordingError> {
        if self.is_regular(ROUNDED) {
            return Ok(self.clone());
        }
        if self.is_regular(0.5) {
            let t = (0..self.len()).map(|i| self.t[0] + i as f64 * self.period).collect();
            return Recording::new(self.name.clone(), t, self.signals.clone());
        }
        self.onto_grid(middle_step(&self.t).unwrap_or(self.period), |name| {
            model.inputs.iter().find(|i| i.name == name).map_or(Hold::Linear, |i| i.hold)
        })
    }
}

/// Periods by which the rounding of written times may put a sample off its place.
const ROUNDED: f64 = 1e-6;

impl Jitter {
    fn of(t: &[f64], period: f64) -> Jitter {
        let first = t.first().copied().unwrap_or(0.0);
        let off = |i: usize| (t[i] - first - i as f64 * period).abs();
        let mean_square = (0..t.len()).map(|i| off(i) * off(i)).sum::<f64>() / t.len().max(1) as f64;
        let median = middle_step(t).unwrap_or(period);
        let gaps = t
            .windows(2)
            .filter(|w| w[1] - w[0] >= 1.5 * median)
            .map(|w| Gap { after: w[0], length: w[1] - w[0], missing: ((w[1] - w[0]) / median).round() as usize - 1 })
            .collect();
        Jitter { rms: mean_square.sqrt(), largest: (0..t.len()).map(off).fold(0.0, f64::max), gaps }
    }
}

/// Names of the signals that a model needs: its inputs, then its outputs.
pub fn signals_of(model: &Model) -> Vec<&str> {
    model.inputs.iter().map(|i| i.name.as_str()).chain(model.outputs.iter().map(|o| o.name.as_str())).collect()
}
