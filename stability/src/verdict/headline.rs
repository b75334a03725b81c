//! The headline: the least favourable of what is known, in one verdict with one stability limit and one frequency.
//!
//! `decide.rs` selects the method that leads. Its result is then compared with everything else that is known and counts (a [`Witness`]):
//! - with the models leading: the re-simulation with every grip of the requested range, because no grip is known exactly. Also the measured frequency
//!   response, where its limit is below the others' by more than the uncertainty of both. Delays that the models lack are in the measured loop, so
//!   they count by it;
//! - with the frequency response leading: it alone, for then the models have been seen to do something else than was recorded.
//!
//! The headline has the lowest stability limit, with the frequency of the same witness. The verdict is green only where every witness is, and where
//! the gain in question lies below that limit and outside its 95 % interval. A gain above a limit at which one run happens to look stable is not
//! stable, and one within the interval is too close to call. Where witnesses differ the reason names both, and the lower limit is the one to act on.

use super::types::Answer;
use super::witness::Witness;
use super::word::{Method, Word};
use crate::frequency;
use crate::resimulate::edge::Edge;

/// How bad a word is.
fn rank(word: Word) -> u8 {
    match word {
        Word::Stable => 0,
        Word::CannotTell => 1,
        Word::Limited => 2,
        Word::LimitCycle => 3,
        Word::Unstable => 4,
    }
}

/// A grip in words.
fn grip_name(scale: f64) -> String {
    if scale == 1.0 { "the grip as recorded".to_string() } else { format!("a grip {scale} times as stiff") }
}

/// Logarithm of the ratio up to which two stability limits may be one.
const SAME_EDGE: f64 = 0.22;

impl Answer {
    /// Everything that counts, the one that leads first.
    fn witnesses(&self) -> Vec<Witness> {
        let measured = self.frequency_answer.as_ref().map(|answer| Witness {
            name: "the measured frequency response".to_string(),
            method: Method::Frequency,
            grip: None,
            verdict: match answer.verdict {
                frequency::Verdict::Stable => Word::Stable,
                frequency::Verdict::Unstable => Word::Unstable,
                frequency::Verdict::CannotTell => Word::CannotTell,
            },
            seen: answer.reason.clone(),
            critical_gain: answer.critical_gain,
            at_least: answer.at_least,
            frequency_hz: answer.frequency_hz,
            beyond: None,
        });
        let again = self.resimulated.as_ref().filter(|_| self.from == Method::Resimulation);
        let Some(again) = again else {
            return measured.into_iter().filter(|_| self.from == Method::Frequency).collect();
        };
        let mut all = vec![Witness::of_run(format!("re-simulation with {}", grip_name(1.0)), 1.0, &again.outcome, &again.edge)];
        for grip in &again.grips {
            let Some(at_asked) = &grip.at_asked else { continue };
            all.push(Witness::of_run(format!("re-simulation with {}", grip_name(grip.scale)), grip.scale, at_asked, &grip.edge));
        }
        // Within their uncertainty they say the same, and the runs know friction and contact besides.
        let highest = self.frequency_answer.as_ref().and_then(|a| a.critical_gain_ci95).and_then(|ci| ci.1);
        let below = |edge: &Edge| highest.is_some_and(|high| 1.05 * high < edge.critical_gain.unwrap_or(edge.at_least));
        all.extend(measured.filter(|m| m.critical_gain.is_some() && below(&again.edge)));
        all
    }

    /// Makes the verdict, the stability limit and its frequency those of the least favourable witness. Returns whether the reason then names both it
    /// and the one that leads, each with its limit.
    pub(super) fn least_favourable(&mut self) -> bool {
        let witnesses = self.witnesses();
        let asked = self.gain.product();
        let Some(leads) = witnesses.first() else { return false };
        // The stability limit: the lowest.
        let lowest =
            witnesses.iter().filter(|w| w.end().is_some()).min_by(|a, b| a.end().unwrap_or(0.0).total_cmp(&b.end().unwrap_or(0.0)));
        if let Some(lowest) = lowest.filter(|_| leads.method == Method::Resimulation) {
            (self.critical_gain, self.at_least) = (lowest.critical_gain, lowest.at_least.filter(|_| lowest.critical_gain.is_none()));
            self.limited_from = lowest.end().filter(|_| lowest.critical_gain.is_none());
            self.critical_frequency_hz = lowest.frequency_hz;
            self.critical_gain_ci95 = match lowest.method {
                Method::Frequency => self.frequency_answer.as_ref().and_then(|a| a.critical_gain_ci95),
                Method::Resimulation | Method::Recording | Method::Nothing => {
                    lowest.critical_gain.and_then(|critical| self.interval_about(critical))
                }
            };
        }
        // The verdict: the worst; of several equally bad ones that with the lowest stability limit.
        let end = |w: &Witness| w.end().unwrap_or(f64::INFINITY);
        let worst = witnesses.iter().max_by(|a, b| {
            let (a_word, b_word) = (a.word_at(asked), b.word_at(asked));
            rank(a_word).min(2).cmp(&rank(b_word).min(2)).then(end(b).total_cmp(&end(a)))
        });
        // All that is not stable is equally negative: where the one that leads is, it is the one to report.
        let negative = |word: Word| rank(word).min(2);
        let worse = worst.filter(|w| negative(w.word_at(asked)) > negative(leads.word_at(asked))).unwrap_or(leads);
        let word = worse.word_at(asked);
        let mut both_named = false;
        if negative(word) > negative(self.verdict) {
            both_named = worse.name != leads.name;
            self.reason = reason(worse, asked, both_named.then_some(leads));
            self.verdict = word;
            self.from = worse.method;
        }
        self.too_close(asked);
        self.decided_by = Some(lowest.filter(|_| leads.method == Method::Resimulation).unwrap_or(worse).name.clone());
        self.witnesses = witnesses;
        both_named
    }

    /// Within the interval of its stability limit a gain is neither.
    fn too_close(&mut self, asked: f64) {
        let Some((low, Some(high))) = self.critical_gain_ci95 else { return };
        if self.verdict == Word::Stable && asked >= low && asked <= high {
            self.verdict = Word::CannotTell;
            self.reason = format!(
                "too close to call: the gain lies within the 95 % interval of the stability limit, {low:.3} to {high:.3}; {}",
                self.reason
            );
        }
    }

    /// The distance of the gain to the headline's stability limit, dB; below 0 above the limit; `None` where no limit is known.
    pub fn gain_margin_db(&self) -> Option<f64> {
        self.critical_gain.map(|edge| 20.0 * (edge / self.gain.product()).log10())
    }

    /// Whether the margins of the measured response are those of the headline's limit: they are reported beside it only then. An open interval
    /// contains every limit and does not make the margins of one those of another.
    pub fn margins_are_of_the_edge(&self) -> bool {
        let Some(edge) = self.critical_gain else { return self.limited_from.is_none() };
        let Some(answer) = &self.frequency_answer else { return false };
        let (Some(measured), Some((low, high))) = (answer.critical_gain, answer.critical_gain_ci95) else { return false };
        1.05 * edge >= low && high.is_none_or(|high| edge <= 1.05 * high) && (measured / edge).ln().abs() < SAME_EDGE
    }

    /// States in the reason whose stability limit the headline has, and which other one differs from it.
    pub(super) fn name_the_edge(&mut self) {
        let (Some(by), Some(leads)) = (&self.decided_by, self.witnesses.first()) else { return };
        if self.from == Method::Frequency {
            return;
        }
        if let Some(end) = self.limited_from.filter(|_| leads.name != *by) {
            let other = leads.end().map_or("none".to_string(), |end| format!("{end:.3}"));
            self.reason += &format!("; use the lowest limit, mu*lambda = {end:.3} by {by} ({other} by {})", leads.name);
            return;
        }
        let Some(edge) = self.critical_gain else { return };
        self.reason += &match leads.critical_gain {
            Some(other) if leads.name != *by => {
                format!("; use the lowest stability limit, mu*lambda = {edge:.3} by {by} ({other:.3} by {})", leads.name)
            }
            _ => format!("; the stability limit is mu*lambda = {edge:.3}"),
        };
    }
}

/// Why it is not stable, by the witness that found it and the one that leads.
fn reason(worst: &Witness, asked: f64, leads: Option<&Witness>) -> String {
    let edge = |w: &Witness| match (w.critical_gain, w.end()) {
        (Some(edge), _) => format!("stability limit at mu*lambda = {edge:.3}"),
        (None, Some(end)) => format!("a clamp or the end of travel from {end:.3} on"),
        (None, None) => "no stability limit known".to_string(),
    };
    let beyond = worst.verdict == Word::Stable && worst.end().is_some_and(|end| asked >= end);
    let mut text = if beyond {
        format!(
            "the gain lies above the stability limit by {} ({}): do not rely on one run at this gain that looks stable",
            worst.name,
            edge(worst)
        )
    } else {
        format!("{}: {} ({})", worst.name, worst.seen, edge(worst))
    };
    if let Some(leads) = leads {
        text += &format!("; {}: {} ({}); use the lower limit", leads.name, leads.seen, edge(leads));
    }
    text
}
