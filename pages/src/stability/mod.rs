//! The report of `backdrive stability`: pictures first, the numbers beside them.

mod axes;
mod coupled;
mod energy;
mod gains;
mod measured;
mod response;
mod words;

use crate::offered::Step;
use crate::parts::{ending, file_name, sentence, todo};
pub use axes::CANCELLED;
use backdrive_report::{Cell, Page, Table, Tone, number, percent, si};
use backdrive_stability::frequency;
use backdrive_stability::session::Session;
use backdrive_stability::verdict::{Answer, Method, Word};
use energy::{energy, transparency};
pub use gains::Point;
use gains::gains;
use measured::measured;
use response::response;
use words::{energy_verdict, interval, tone, verdict, word};

/// The report of an answer; `session` is what was recorded, `curve` the sweep, which may be empty, `steps` what to do next.
pub fn page(found: &Answer, session: &Session, curve: &[&Point], steps: &[Step]) -> Page {
    let is_pair = !found.coupled.is_empty();
    let mut page = Page::new(&match is_pair {
        true => coupled::title(file_name(&found.bag)),
        false => format!("Stability of {} at μλ = {}", file_name(&found.bag), number(found.gain.product())),
    });
    page.lead(tone(found.verdict), &lead(found));
    todo(&mut page, steps);
    page.text(&sentence(&found.reason));
    for d in &found.disagreements {
        page.warning(&sentence(&d.text));
    }
    for warning in &found.warnings {
        page.note(&sentence(&warning.to_string()));
    }
    if is_pair {
        page.section("Coupling");
        coupled::coupled(&mut page, found);
        page.section("Response, as recorded");
    } else {
        page.section("Gain");
        gains(&mut page, found, curve);
        page.section("Methods");
        page.table(methods(found));
        page.section("Loop, measured");
        measured(&mut page, found);
        axes::axes(&mut page, found);
        page.section(&format!("Response at μλ = {}", number(found.gain.product())));
    }
    response(&mut page, found, session);
    page.section("Details");
    if let Some(again) = &found.resimulated {
        let at = format!("re-simulated at μλ = {}", number(found.gain.product()));
        page.details(&format!("Energy, {at}"), |inside| energy(inside, &again.energy, &at));
    }
    page.details("Energy, as recorded", |inside| energy(inside, &found.recorded_energy, "as recorded"));
    page.details("Transparency, as recorded", |inside| transparency(inside, &found.transparency));
    if !found.checks.is_empty() || found.loop_check.is_some() {
        page.details("Models against the recording", |inside| models(inside, found));
    }
    ending(&mut page, &TERMS);
    page
}

/// The terms of the page.
const TERMS: [(&str, &str); 10] = [
    ("μλ", "the loop's gain: the position scale μ from master to slave times the force scale λ from slave to master"),
    ("critical μλ, stability limit", "the lowest gain at which the loop is not stable; there an oscillation neither grows nor decays"),
    ("L", "the open-loop frequency response: reflected force to master to slave to environment and back; the closed loop is 1/(1 − L)"),
    (
        "margins",
        "gain, phase or delay that may be added before the loop becomes unstable; modulus margin: the smallest distance of L from \
        +1",
    ),
    ("coherence", "share of a signal's power that the excitation explains, 0 to 1, at each frequency"),
    ("re-simulation", "a simulation of the recorded loop from its models with the recorded hand"),
    ("limit cycle", "an oscillation of constant amplitude while the hand holds still"),
    ("limited", "a clamp or the end of travel determines the motion; never called stable"),
    ("passive port", "one that never delivers more energy than it received"),
    ("95 %", "range that contains the true value in 95 of 100 such recordings"),
];

/// The verdict in a sentence.
fn lead(found: &Answer) -> String {
    let gain = number(found.gain.product());
    if !found.coupled.is_empty() {
        let said = match found.verdict {
            Word::Stable => "Stable",
            Word::LimitCycle => "Not stable: it oscillates in a limit cycle",
            Word::Unstable => "Unstable",
            Word::Limited => "Limited: a clamp determines the motion, not the loop",
            Word::CannotTell => "It is not known whether the pair is stable",
        };
        return format!("{said}, at the gains of the recording.");
    }
    let verdict = match found.verdict {
        Word::Stable => format!("Stable at μλ = {gain}"),
        Word::LimitCycle => format!("Not stable at μλ = {gain}: it oscillates in a limit cycle"),
        Word::Unstable => format!("Unstable at μλ = {gain}"),
        Word::Limited => format!("Limited at μλ = {gain}: a clamp or the end of travel determines the motion, not the loop"),
        Word::CannotTell => format!("It is not known whether the loop is stable at μλ = {gain}"),
    };
    let edge = match (found.critical_gain, found.at_least) {
        (Some(edge), _) => {
            let interval = found.critical_gain_ci95.map_or(String::new(), |ci| format!(" (95 %: {})", interval(ci)));
            let how = match found.critical_frequency_hz {
                Some(hz) if hz > 0.0 => format!(" At the limit it oscillates at {}.", si(hz, "Hz")),
                Some(_) => " At the limit it diverges without oscillating.".to_string(),
                None => String::new(),
            };
            let by = found.decided_by.as_deref().map_or(String::new(), |by| format!(", by {by}"));
            format!(" The stability limit is μλ = {}{interval}{by}.{how}", number(edge))
        }
        // Beyond a clamp or an end of the travel no critical gain can be seen.
        (None, Some(least)) if least < found.gain.product() => {
            let by = found.decided_by.as_deref().map_or(String::new(), |by| format!(", by {by}"));
            format!(" It is stable only up to μλ = {}{by}.", number(least))
        }
        (None, Some(least)) => format!(" No stability limit up to μλ = {}.", number(least)),
        (None, None) => String::new(),
    };
    format!("{verdict}.{edge}")
}

/// Each method's verdict and critical gain.
fn methods(found: &Answer) -> Table {
    let mut table = Table::new(["method", "verdict", "critical μλ", "95 % interval", "frequency", "why"]);
    let edge = |gain: Option<f64>, least: Option<f64>| match (gain, least) {
        (Some(gain), _) => number(gain),
        (None, Some(least)) if least > 0.0 => format!("≥ {}", number(least)),
        _ => "–".to_string(),
    };
    let mark = |name: &str, leads: bool| if leads { format!("{name} (leads)") } else { name.to_string() };
    if let Some(f) = &found.frequency_answer {
        let word = match f.verdict {
            frequency::Verdict::Stable => Word::Stable,
            frequency::Verdict::Unstable => Word::Unstable,
            frequency::Verdict::CannotTell => Word::CannotTell,
        };
        table.push([
            Cell::from(mark("frequency response", found.from == Method::Frequency)),
            verdict(word),
            edge(f.critical_gain, f.at_least).into(),
            f.critical_gain_ci95.map_or("–".to_string(), interval).into(),
            f.frequency_hz.map_or("–".to_string(), |hz| si(hz, "Hz")).into(),
            f.reason.clone().into(),
        ]);
    }
    match &found.resimulated {
        Some(again) => table.push([
            Cell::from(mark("re-simulation", found.from == Method::Resimulation)),
            verdict(word(&again.outcome)),
            edge(again.edge.critical_gain, Some(again.edge.at_least)).into(),
            "–".into(),
            again.edge.frequency_hz.filter(|hz| *hz > 0.0).map_or("–".to_string(), |hz| si(hz, "Hz")).into(),
            format!("{}; {}", again.outcome, again.edge.reason).into(),
        ]),
        None => table.push([
            Cell::from("re-simulation"),
            verdict(Word::CannotTell),
            "–".into(),
            "–".into(),
            "–".into(),
            found.no_resimulation.clone().unwrap_or_default().into(),
        ]),
    }
    let energy = found.resimulated.as_ref().map_or(&found.recorded_energy, |r| &r.energy);
    let (text, tone) = energy_verdict(energy.verdict);
    table.push([Cell::from("energy"), Cell::tone(text, tone), "–".into(), "–".into(), "–".into(), energy.reason.clone().into()]);
    if let Some(outcome) = &found.recorded_outcome {
        let at = found.recorded_gain.map_or(String::new(), |[low, high]| {
            if high - low < 1e-9 {
                format!(" at μλ = {}", number(low))
            } else {
                format!(" at μλ = {} to {}", number(low), number(high))
            }
        });
        table.push([
            Cell::from(mark("the recording itself", found.from == Method::Recording)),
            verdict(word(outcome)),
            "–".into(),
            "–".into(),
            "–".into(),
            format!("{outcome}{at}").into(),
        ]);
    }
    table
}

fn models(page: &mut Page, found: &Answer) {
    let agrees = |yes: bool| if yes { Cell::tone("agrees", Tone::Good) } else { Cell::tone("does not", Tone::Bad) };
    if !found.checks.is_empty() {
        let mut table = Table::new(["model", "axis", "compared", "error", "of an effect of", "sensor explains", ""]);
        for c in &found.checks {
            let unit = if c.part == "master" { "m" } else { "N" };
            table.push([
                Cell::from(c.part),
                c.axis.to_string().into(),
                c.quantity.into(),
                si(c.error_rms, unit).into(),
                si(c.effect_rms, unit).into(),
                si(c.floor_rms, unit).into(),
                agrees(c.agrees),
            ]);
        }
        page.table(table.caption("Each device's model, simulated alone with the recorded inputs of the device; rms values."));
    }
    if let Some(check) = &found.loop_check {
        let mut table = Table::new(["measured loop against the models' loop", "noise explains", ""]);
        table.push([Cell::from(percent(check.difference)), percent(check.noise).into(), agrees(check.agrees)]);
        page.table(table);
    }
}
