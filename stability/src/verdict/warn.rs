//! Which warnings an answer has.

use super::types::Answer;
use super::warning::Warning;
use super::word::Method;
use crate::frequency::{Frequency, Note};
use crate::outcome::Outcome;
use crate::session::Session;
use std::collections::HashSet;

/// What there is to say of how the recording was read, and of its sensors.
pub(super) fn of_what_was_read(session: &Session) -> Vec<Warning> {
    let sensors = session.sensors.iter().cloned().map(Warning::Sensor);
    session.notes.iter().cloned().map(Warning::Recording).chain(sensors).collect()
}

/// What the recording and its frequency response have to say, each once.
pub(super) fn of_the_recording(session: &Session, frequency: &Frequency) -> Vec<Warning> {
    // The dependence of the stability limit on the amplitude is reported with the values, by `Answer::warn`.
    let notes = frequency.notes.iter().filter(|n| **n != Note::AmplitudeDependent).cloned().map(Warning::Frequency);
    let mut warnings = of_what_was_read(session);
    warnings.extend(notes);
    let mut told = HashSet::new();
    warnings.retain(|w| told.insert(w.to_string()));
    warnings.extend(frequency.relative.then_some(Warning::GainsAreRelative));
    warnings
}

impl Answer {
    /// Adds what the answer itself gives reason to warn of.
    pub(super) fn warn(&mut self) {
        if self.from == Method::Resimulation && self.frequency.as_ref().is_some_and(|f| f.cannot_tell.is_some()) {
            self.warnings.push(Warning::LoopNotMeasured);
        }
        if let Some(again) = &self.resimulated {
            let fails: Vec<(f64, Outcome)> =
                again.grips.iter().filter_map(|g| Some((g.scale, g.at_asked.filter(|o| !o.is_stable())?))).collect();
            if !fails.is_empty() && again.outcome.is_stable() {
                self.warnings.push(Warning::NotWithEveryGrip { gain: self.gain.product(), fails });
            }
            let over = again.over_cancelling.as_ref().and_then(|o| o.warning.clone());
            self.warnings.extend(over.map(Warning::OverCancelling));
            let flickers = again.edge.flickers;
            self.warnings.extend(flickers.map(|[lowest, highest]| Warning::Flickers { lowest, highest }));
            let returns = again.edge.returns_to_stable.filter(|g| flickers.is_none_or(|[_, highest]| *g > highest));
            self.warnings.extend(returns.map(|gain| Warning::ReturnsToStable { gain }));
        }
        if let Some(frequency) = self.frequency.as_ref().filter(|f| f.amplitude_dependent) {
            let levels = frequency.levels.iter();
            let edges = levels.filter_map(|l| Some((l.edge.gain.or(l.edge.at_least)?, l.amplitude_rms))).collect();
            self.warnings.push(Warning::AmplitudeDependent { edges });
        }
    }
}
