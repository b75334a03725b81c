//! Which method leads, and the headline before it is compared with everything else that is known.

use super::question::{Question, Swapped};
use super::recorded::recorded_outcome;
use super::types::Answer;
use super::warn::of_the_recording;
use super::warning::Warning;
use super::word::{Method, Word};
use crate::energy::energy;
use crate::frequency::{self, CannotTell, Frequency};
use crate::nyquist::coupled_loops;
use crate::outcome::Outcome;
use crate::part_check::PartCheck;
use crate::transparency::transparency;
use crate::unjudged::Unjudged;
use backdrive_nodes::graph::{Graph, Settings};

/// The law of a graph's coupling.
fn coupling_law(graph: &Graph) -> Option<&'static str> {
    match graph.loop_node().map(|node| &node.settings) {
        Some(Settings::Coupling { law, .. }) => Some(law.name()),
        _ => None,
    }
}

impl Answer {
    /// What is known before the methods are weighed.
    pub(super) fn of(question: &Question, frequency: Frequency, checks: Vec<PartCheck>) -> Answer {
        let session = question.session;
        let gains = (0..session.len()).map(|row| session.gain(row)).filter(|g| g.is_finite());
        let range = gains.fold(None, |r: Option<[f64; 2]>, g| Some(r.map_or([g, g], |[a, b]| [a.min(g), b.max(g)])));
        let mut warnings = of_the_recording(session, &frequency);
        let recorded_outcome = recorded_outcome(session);
        let mut frequency = frequency;
        if let Some(Outcome::Unstable { growth_per_s }) = recorded_outcome {
            warnings.push(Warning::RecordingGrows { growth_per_s });
            frequency.cannot_tell = Some(CannotTell {
                reason: "the recording itself diverges, so it contains no steady response".to_string(),
                advice: Some("record at a lower gain, or with a smaller dither".to_string()),
            });
        }
        // Last, for it is about the loop that is asked about, whatever the recording is worth.
        if let Some(law) = [question.asked, question.recorded].into_iter().flatten().find_map(coupling_law) {
            frequency.cannot_tell = Some(CannotTell {
                reason: format!(
                    "the coupling law is {law}: the force on the master is not lambda times the contact force, so a loop measured at one \
                     gain does not predict another"
                ),
                advice: None,
            });
        }
        let frequency_answer = frequency.at(question.gain.product());
        Answer {
            bag: session.name.clone(),
            gain: question.gain,
            recorded_gain: range,
            verdict: Word::CannotTell,
            reason: String::new(),
            from: Method::Nothing,
            critical_gain: None,
            at_least: None,
            limited_from: None,
            critical_gain_ci95: None,
            critical_frequency_hz: None,
            margins: frequency_answer.margins,
            advice: frequency_answer.advice.clone(),
            frequency_answer: Some(frequency_answer),
            frequency: Some(frequency),
            resimulated: None,
            no_resimulation: None,
            recorded_outcome,
            recorded_energy: energy(session, question.recorded, None),
            transparency: transparency(session, question.recorded),
            checks,
            loop_check: None,
            disagreements: Vec::new(),
            warnings,
            held_back: None,
            witnesses: Vec::new(),
            decided_by: None,
            coupled: Vec::new(),
            loops: question.asked.and_then(|graph| coupled_loops(graph, session, question.gain.product()).transpose()),
            sensors: session.sensors.clone(),
        }
    }

    /// Whether the recording itself runs away: then it is no record of a steady loop.
    pub(super) fn runs_away(&self) -> bool {
        matches!(self.recorded_outcome, Some(Outcome::Unstable { .. }))
    }

    /// Whether the models that are not exchanged do what was recorded.
    fn models_agree(&self, swapped: Swapped) -> bool {
        let exchanged = |part: &str| match part {
            "master" | "master's motion" => swapped.master,
            "slave" | "slave's force" => swapped.slave,
            _ => false,
        };
        let counts = |c: &&PartCheck| !exchanged(c.part);
        self.checks.iter().filter(counts).all(|c| c.agrees) && self.loop_check.is_none_or(|c| c.agrees)
    }

    /// Whether the recording tests the models at all.
    fn models_are_checked(&self) -> bool {
        !self.checks.is_empty() || self.loop_check.is_some()
    }

    /// Weighs the methods and concludes.
    pub(super) fn conclude(&mut self, swapped: Swapped) {
        let agree = self.models_agree(swapped);
        self.find_disagreements(swapped);
        let judged = self.resimulated.as_ref().is_some_and(|r| !matches!(r.outcome, Outcome::NotJudged { .. }));
        let told = self.frequency_answer.as_ref().is_some_and(|a| a.verdict != frequency::Verdict::CannotTell);
        let measured = self.frequency.as_ref().is_some_and(|f| f.cannot_tell.is_none());
        match (&self.resimulated, agree && self.models_are_checked()) {
            (Some(_), true) if judged => self.by_resimulation(),
            _ if measured => self.by_frequency(),
            (Some(again), true) => {
                let why = again.outcome.to_string();
                self.untold(&format!(
                    "in the re-simulation {why}; and the recording contains no excitation from which the loop can be \
                    identified"
                ));
            }
            (Some(_), false) if agree => self.untold(
                "the recording does not show whether its models are right, and it contains no excitation from which the loop \
                    can be identified",
            ),
            (Some(_), false) => self.untold(
                "the models in the bag do not reproduce the recording, and it contains no excitation from which the loop can \
                    be identified",
            ),
            _ => self.untold(
                "there is no loop to re-simulate, and the recording contains no excitation from which the loop can be \
                identified",
            ),
        }
        if !self.least_favourable() {
            self.name_the_edge();
        }
        self.by_the_recording();
        self.hold_back();
        // Where the loop was not measured at all, the answer explains how to measure it even beside a verdict.
        if told || (measured && self.verdict != Word::CannotTell) {
            self.advice = None;
        }
        if let Some(why) = self.held_back {
            self.advice = Some(why.advice().to_string());
        }
        self.warn();
    }

    fn by_resimulation(&mut self) {
        let Some(again) = &self.resimulated else { return };
        self.from = Method::Resimulation;
        self.verdict = Word::of(&again.outcome);
        self.reason = format!("{} in the re-simulation with {}", again.outcome, again.script);
        let edge = &again.edge;
        match edge.critical_gain {
            Some(critical) => {
                self.critical_gain = Some(critical);
                self.critical_gain_ci95 = self.interval_about(critical);
                self.critical_frequency_hz = edge.frequency_hz;
            }
            None => {
                self.at_least = Some(edge.at_least);
                self.reason += &format!("; {}", edge.reason);
            }
        }
    }

    fn by_frequency(&mut self) {
        let (Some(answer), Some(frequency)) = (&self.frequency_answer, &self.frequency) else { return };
        self.from = Method::Frequency;
        self.verdict = match answer.verdict {
            frequency::Verdict::Stable => Word::Stable,
            frequency::Verdict::Unstable => Word::Unstable,
            frequency::Verdict::CannotTell => Word::CannotTell,
        };
        self.reason = format!("by the measured frequency response: {}", answer.reason);
        (self.critical_gain, self.at_least) = (answer.critical_gain, answer.at_least);
        (self.critical_gain_ci95, self.critical_frequency_hz) = (answer.critical_gain_ci95, answer.frequency_hz);
        if frequency.amplitude_dependent {
            self.reason += "; the limit depends on the amplitude, so it is an interval over the measured amplitudes";
        }
        // A clamp limits whatever the model lacks.
        if let (Word::Stable, Some(Outcome::Limited { .. })) = (self.verdict, self.resimulated.as_ref().map(|r| r.outcome)) {
            self.verdict = Word::Limited;
            self.reason += "; in the re-simulation a clamp acts or the master leaves its travel, which is never called stable";
        }
    }

    fn untold(&mut self, why: &str) {
        self.verdict = Word::CannotTell;
        let more = self.frequency_answer.as_ref().map(|a| a.reason.clone()).filter(|r| !r.is_empty());
        self.reason = more.map_or(why.to_string(), |more| format!("{why} ({more})"));
    }

    /// A recording that is cut short, has gaps or contains no contact is no evidence for a stable loop; its evidence against one counts.
    fn hold_back(&mut self) {
        let Some(Outcome::NotJudged { why }) = self.recorded_outcome else { return };
        // A hand that never holds still moves the loop nevertheless, and that gives a frequency response. Nor does a recording at lambda = 0 speak
        // against a loop that it never closed. What contradicts itself is no record at all: that is the first thing to know of it.
        let comes_first = self.verdict == Word::CannotTell && why == Unjudged::Contradictory;
        if self.verdict != Word::Stable && !comes_first || matches!(why, Unjudged::NoHold | Unjudged::NoFeedback) {
            return;
        }
        self.verdict = Word::CannotTell;
        self.reason = format!("the recording does not allow the answer \"stable\": {why}; from the available data: {}", self.reason);
        self.held_back = Some(why);
    }

    /// At the very gain of the recording the recording itself is the best witness, where it speaks against.
    fn by_the_recording(&mut self) {
        let Some([low, high]) = self.recorded_gain else { return };
        let asked = self.gain.product();
        let same = (low / asked - 1.0).abs() < 0.01 && (high / asked - 1.0).abs() < 0.01;
        let Some(outcome) = self.recorded_outcome.filter(|o| same && !o.is_stable() && !matches!(o, Outcome::NotJudged { .. })) else {
            return;
        };
        if self.verdict == Word::Stable || self.verdict == Word::CannotTell {
            self.reason = format!("at this gain the recording itself shows: {outcome}; otherwise {}", self.reason);
            (self.verdict, self.from) = (Word::of(&outcome), Method::Recording);
        }
    }

    /// The interval of a re-simulated stability limit: from the uncertainty of the recorded loop near its crossover.
    pub(super) fn interval_about(&self, critical: f64) -> Option<(f64, Option<f64>)> {
        let frequency = self.frequency.as_ref().filter(|f| f.cannot_tell.is_none())?;
        let measured = match (frequency.edge.gain, frequency.edge.ci95) {
            (Some(gain), Some((low, high))) if !frequency.amplitude_dependent => Some((low / gain, high.map(|h| h / gain))),
            _ => None,
        };
        let difference = self.loop_check.map(|c| (1.0 - 2.0 * c.difference.max(0.005), Some(1.0 + 2.0 * c.difference.max(0.005))));
        let Some((low, high)) = measured.or(difference) else {
            // Nothing of the loop stands out of the noise: then the recording gives a lower end only.
            return frequency.edge.at_least.map(|least| (least.min(critical), None));
        };
        let (low, high) = (critical * low.max(0.0), high.map(|h| critical * h));
        // Where the verdict flickers, the stability limit is not a single gain.
        let highest = self.resimulated.as_ref().and_then(|r| r.edge.flickers).map_or(0.0, |[_, highest]| highest * 1.01);
        Some((low, high.map(|h| h.max(highest))))
    }
}
