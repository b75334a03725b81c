//! The answer at a gain.

use super::edge::{Edge, eigenvalues, loci};
use super::{Frequency, LevelEstimate};
use backdrive_control::margins::{Margins, is_stable, margins};
use nalgebra::Complex;
use serde::Serialize;

/// The frequency response's verdict on a gain.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Verdict {
    /// The closed loop is stable.
    Stable,
    /// It is not.
    Unstable,
    /// The record gives no answer.
    CannotTell,
}

/// The answer at a gain.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct FrequencyAnswer {
    /// mu*lambda that was asked for.
    pub gain: f64,
    /// Stable or not.
    pub verdict: Verdict,
    /// Margins at this gain, of the worst loop at the worst amplitude; `None` where they are not known.
    pub margins: Option<Margins>,
    /// Critical mu*lambda; `None` where none was found.
    pub critical_gain: Option<f64>,
    /// Where none was found: it is at least this.
    pub at_least: Option<f64>,
    /// 95 % interval of the critical gain, over all amplitudes where they differ; an open upper end is `None`.
    pub critical_gain_ci95: Option<(f64, Option<f64>)>,
    /// Frequency at the stability limit, Hz; 0 for a run-away without oscillation.
    pub frequency_hz: Option<f64>,
    /// Whether the stability limit depends on the amplitude.
    pub amplitude_dependent: bool,
    /// Why, in a sentence.
    pub reason: String,
    /// Which recording would give an answer, where this one does not.
    pub advice: Option<String>,
}

impl Frequency {
    /// Whether the loop is stable at `gain`, mu*lambda (in multiples of the recorded gain where [`Frequency::relative`]).
    pub fn at(&self, gain: f64) -> FrequencyAnswer {
        let mut answer = FrequencyAnswer {
            gain,
            verdict: Verdict::CannotTell,
            margins: None,
            critical_gain: self.edge.gain,
            at_least: self.edge.at_least,
            critical_gain_ci95: self.edge.ci95,
            frequency_hz: self.edge.frequency_hz,
            amplitude_dependent: self.amplitude_dependent,
            reason: String::new(),
            advice: None,
        };
        if let Some(cannot) = &self.cannot_tell {
            (answer.reason, answer.advice) = (cannot.reason.clone(), cannot.advice.clone());
            (answer.critical_gain, answer.at_least, answer.critical_gain_ci95, answer.frequency_hz) = (None, None, None, None);
            answer.amplitude_dependent = false;
            return answer;
        }
        if !(gain.is_finite() && gain >= 0.0) {
            answer.reason = format!("the gain must be a number of at least 0, is {gain}");
            return answer;
        }
        let all = self.levels.iter().map(|level| (level, margins_at(level, gain), level_verdict(level, gain)));
        let all: Vec<_> = all.collect();
        let worst = all.iter().map(|(_, m, _)| *m).min_by(|a, b| distance(a).total_cmp(&distance(b)));
        // The margin refers to the reported stability limit, not to that of single lines.
        let to_edge = self.edge.gain.map(|edge| 20.0 * (edge / gain).log10());
        answer.margins = worst.map(|m| Margins { gain_db: to_edge, ..m });
        let of = |verdict: Verdict| all.iter().filter(move |a| a.2.0 == verdict).collect::<Vec<_>>();
        let (unstable, open) = (of(Verdict::Unstable), of(Verdict::CannotTell));
        let decides = unstable.first().or(open.first()).copied().or(all.first());
        if let Some((level, _, (verdict, reason))) = decides {
            answer.verdict = *verdict;
            answer.reason = match self.levels.len() {
                1 => reason.clone(),
                _ => format!("at a dither of {:.3} rms: {reason}", level.amplitude_rms),
            };
        }
        if answer.verdict == Verdict::CannotTell {
            answer.advice = Some(self.advice.clone());
        }
        answer
    }
}

/// A number by which margins are compared: below 0 above the stability limit.
fn distance(m: &Margins) -> f64 {
    let beyond = m.phase_deg.is_some_and(|p| p < 0.0) || m.gain_db.is_some_and(|g| g < 0.0);
    if beyond { -m.modulus } else { m.modulus }
}

/// Margins of the worst locus of a level.
fn margins_at(level: &LevelEstimate, gain: f64) -> Margins {
    let told = level.measured.told();
    let hz: Vec<f64> = level.hz.iter().zip(&told).filter(|(_, t)| **t).map(|(f, _)| *f).collect();
    let scaled = |locus: Vec<Complex<f64>>| locus.into_iter().map(|l| l * gain).collect::<Vec<_>>();
    let all = loci(&level.measured.nominal, &told).into_iter().map(|locus| margins(&hz, &scaled(locus)));
    all.min_by(|a, b| distance(a).total_cmp(&distance(b))).unwrap_or_else(|| margins(&[], &[]))
}

fn level_verdict(level: &LevelEstimate, gain: f64) -> (Verdict, String) {
    let Edge { gain: critical, ci95, frequency_hz, at_least, told_to } = level.edge;
    if told_to.is_some_and(|most| gain > most) {
        let most = told_to.unwrap_or(0.0);
        let reason =
            format!("above a gain of {most:.3}, lines lost in noise or frequencies above the highest line may hide a stability limit");
        // A known stability limit lies below: then the noise does not matter.
        if !ci95.and_then(|c| c.1).is_some_and(|high| gain > high) {
            return (Verdict::CannotTell, reason);
        }
    }
    match (critical, ci95, frequency_hz) {
        (Some(critical), Some((low, high)), Some(hz)) => {
            let how = if hz > 0.0 { format!("at {hz:.1} Hz") } else { "without oscillating".to_string() };
            let upper = high.map_or("open".to_string(), |h| format!("{h:.3}"));
            if gain < low {
                (
                    Verdict::Stable,
                    format!("below the stability limit, {critical:.3} ({low:.3} to {upper}), where it becomes unstable {how}"),
                )
            } else if high.is_some_and(|high| gain > high) {
                if stable_again(level, gain) {
                    return (Verdict::Stable, format!("above the first stability limit at {critical:.3} {how}, and stable again"));
                }
                (Verdict::Unstable, format!("above the stability limit, {critical:.3} ({low:.3} to {upper}): it is unstable {how}"))
            } else {
                (Verdict::CannotTell, format!("too close to call: the stability limit is {critical:.3} ({low:.3} to {upper}), {how}"))
            }
        }
        _ => match at_least {
            Some(least) if gain < least => (Verdict::Stable, format!("no line reaches the stability limit below a gain of {least:.3}")),
            Some(least) => (
                Verdict::CannotTell,
                format!(
                    "within the uncertainty of the lines, the stability limit may be as low as \
                {least:.3}"
                ),
            ),
            None => (Verdict::CannotTell, "no line determines the loop".to_string()),
        },
    }
}

/// Whether a gain above the first stability limit is stable nevertheless, by the winding of det(1 - kL), and with some margin.
fn stable_again(level: &LevelEstimate, gain: f64) -> bool {
    let told = level.measured.told();
    let one = Complex::new(1.0, 0.0);
    let (mut hz, mut l, mut clear) = (Vec::new(), Vec::new(), true);
    for line in (0..told.len()).filter(|line| told[*line]) {
        let all = eigenvalues(&level.measured.nominal[line]);
        let sigma = level.measured.sigma[line].iter().fold(0.0_f64, |m, s| m.max(*s));
        clear &= all.iter().all(|e| (one - e * gain).norm() > 4.0 * sigma * gain);
        hz.push(level.hz[line]);
        l.push(one - all.iter().map(|e| one - e * gain).product::<Complex<f64>>());
    }
    clear && hz.first().is_some_and(|f| *f < 8.0) && is_stable(&hz, &l)
}
