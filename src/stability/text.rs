//! The answer as text.

use backdrive_pages::stability::CANCELLED;
use backdrive_stability::nyquist::Limit;
use backdrive_stability::verdict::Answer;
use std::fmt::Write as _;

fn interval((low, high): (f64, Option<f64>)) -> String {
    match high {
        Some(high) => format!("{low:.3} to {high:.3}"),
        None => format!("{low:.3} or more"),
    }
}

/// Lines that begin with what they are about.
#[derive(Default)]
struct Lines(String);

impl Lines {
    fn put(&mut self, name: &str, text: String) {
        let _ = writeln!(self.0, "{name:<8} {text}");
    }
}

/// A few lines for a person.
pub(super) fn text(found: &Answer) -> String {
    let mut lines = Lines::default();
    let gain = found.gain;
    let at = match found.coupled.is_empty() {
        true => format!("at mu*lambda = {:.4} (mu {}, lambda {:.4})", gain.product(), gain.mu, gain.lambda),
        false => "at the gains of the recording".to_string(),
    };
    lines.put("verdict", format!("{} {at}", found.verdict.text().to_uppercase()));
    lines.put("why", found.reason.clone());
    coupled(found, &mut lines);
    edge(found, &mut lines);
    margins(found, &mut lines);
    if let Some(f) = &found.frequency_answer {
        lines.put("measured", f.reason.clone());
    }
    axes_together(found, &mut lines);
    run_again(found, &mut lines);
    felt(found, &mut lines);
    for d in &found.disagreements {
        lines.put("differs", d.text.clone());
    }
    for warning in &found.warnings {
        lines.put("note", warning.to_string());
    }
    if let Some(advice) = &found.advice {
        lines.put("record", advice.clone());
    }
    lines.0.trim_end().to_string()
}

/// Which laws couple the motors.
fn coupled(found: &Answer, lines: &mut Lines) {
    let several = found.coupled.len() > 1;
    for axis in &found.coupled {
        let name = if several { format!("{}: ", axis.axis) } else { String::new() };
        match (&axis.coupling, &axis.why_not) {
            (Some(coupling), _) => {
                lines.put("coupling", format!("{name}{}", coupling.kind.text()));
                let [master, slave] = coupling.lines();
                lines.put("master", master);
                lines.put("slave", slave);
            }
            (None, why) => lines.put("coupling", format!("{name}not known: {}", why.as_deref().unwrap_or_default())),
        }
    }
}

/// Where the loop stops being stable.
fn edge(found: &Answer, lines: &mut Lines) {
    let recorded = found.recorded_gain.map_or(String::new(), |[low, high]| match high - low < 1e-9 {
        true => format!("; recorded at {low:.4}"),
        false => format!("; recorded at {low:.4} to {high:.4}"),
    });
    match (found.critical_gain, found.at_least) {
        (Some(critical), _) => {
            let ci = found.critical_gain_ci95.map_or(String::new(), |ci| format!(" (95 %: {})", interval(ci)));
            let hz = match found.critical_frequency_hz {
                Some(hz) if hz > 0.0 => format!(" at {hz:.1} Hz"),
                Some(_) => ", where it diverges without oscillating".to_string(),
                None => String::new(),
            };
            let by = found.decided_by.as_deref().map_or(String::new(), |by| format!(", by {by}"));
            lines.put("limit", format!("mu*lambda = {critical:.3}{ci}{hz}{by}{recorded}"));
        }
        (None, Some(_)) if found.limited_from.is_some() => {
            let by = found.decided_by.as_deref().map_or(String::new(), |by| format!(", by {by}"));
            let from = found.limited_from.unwrap_or_default();
            lines.put(
                "limit",
                format!("from mu*lambda = {from:.3} on a clamp acts or the master leaves its travel, before any oscillation{by}{recorded}"),
            );
        }
        (None, Some(least)) => lines.put("limit", format!("none up to mu*lambda = {least:.3}{recorded}")),
        _ => {}
    }
}

/// How far away that is.
fn margins(found: &Answer, lines: &mut Lines) {
    let gain_db = found.gain_margin_db();
    let to_clamp = found.limited_from.map(|from| 20.0 * (from / found.gain.product()).log10());
    let at_least = found
        .at_least
        .filter(|_| found.critical_gain.is_none() && to_clamp.is_none())
        .map(|least| 20.0 * (least / found.gain.product()).log10());
    let of = |value: Option<f64>, unit: &str| value.map_or("unlimited".to_string(), |v| format!("{v:.2} {unit}"));
    let to_edge = match (gain_db, at_least) {
        (Some(db), _) => Some(format!("gain {db:.2} dB to the stability limit")),
        (None, Some(db)) if db > 0.0 => Some(format!("gain at least {db:.2} dB")),
        _ if to_clamp.is_some() => to_clamp.map(|db| format!("gain {db:.2} dB to where a clamp acts or the master leaves its travel")),
        _ => None,
    };
    // Margins of another critical gain than the reported one would contradict it.
    let measured = found.margins.as_ref().filter(|_| found.margins_are_of_the_edge());
    if measured.is_none()
        && let Some(to_edge) = &to_edge
    {
        lines.put("margins", to_edge.clone());
    }
    if let Some(m) = measured {
        lines.put(
            "margins",
            format!(
                "{}, phase {}, delay {}, modulus {:.3} (measured)",
                to_edge.unwrap_or_else(|| "gain not known".to_string()),
                of(m.phase_deg, "deg"),
                of(m.delay_ms, "ms"),
                m.modulus
            ),
        );
    }
}

/// The loops of several axes, by the models: together, and one by one.
fn axes_together(found: &Answer, lines: &mut Lines) {
    let loops = match &found.loops {
        None => return,
        Some(Err(why)) => return lines.put("axes", format!("their joint stability does not follow from the models: {why}")),
        Some(Ok(loops)) => loops,
    };
    let limit = |limit: &Limit| match (limit.critical_gain, limit.frequency_hz) {
        (Some(gain), Some(hz)) if hz > 0.0 => format!("up to {gain:.3} ({hz:.1} Hz)"),
        (Some(gain), _) => format!("up to {gain:.3}"),
        (None, _) => "at any gain".to_string(),
    };
    let each: Vec<String> = loops.alone.iter().map(|(axis, alone)| format!("{axis} {}", limit(alone))).collect();
    let now = match loops.encirclements {
        0 => "at the requested gain their eigenloci do not encircle +1: stable".to_string(),
        n => format!("at the requested gain their eigenloci encircle +1: {n} unstable poles"),
    };
    lines.put(
        "axes",
        format!(
            "together stable {} (generalised Nyquist criterion; models linearised in contact, without dry friction); {now}",
            limit(&loops.together)
        ),
    );
    lines.put("", format!("alone, the others open: {}", each.join(", ")));
    if loops.is_cancelled() {
        lines.put("", CANCELLED.to_string());
    }
    if loops.alone_misleads() {
        lines.put("", "the axes interact through the loop: their separate limits are no answer for all axes together".to_string());
    }
}

/// What the loop did when it was run again.
fn run_again(found: &Answer, lines: &mut Lines) {
    if !found.coupled.is_empty() {
        lines.put("energy", found.recorded_energy.reason.clone());
        return;
    }
    match (&found.resimulated, &found.no_resimulation) {
        (Some(again), _) => {
            lines.put("re-sim", format!("{}; {}", again.outcome, again.edge.reason));
            let grips: Vec<String> = again
                .grips
                .iter()
                .map(|g| match g.edge.critical_gain {
                    Some(gain) => format!("x{}: {gain:.2}", g.scale),
                    None if g.edge.at_least == 0.0 => format!("x{}: not known", g.scale),
                    None => format!("x{}: above {:.2}", g.scale, g.edge.at_least),
                })
                .collect();
            if !grips.is_empty() {
                lines.put("grips", format!("stability limit by factor on the grip: {}", grips.join(", ")));
            }
            lines.put("energy", again.energy.reason.clone());
        }
        (None, Some(why)) => {
            lines.put("re-sim", format!("not possible: {why}"));
            lines.put("energy", found.recorded_energy.reason.clone());
        }
        _ => {}
    }
}

/// What the hand felt.
fn felt(found: &Answer, lines: &mut Lines) {
    for t in &found.transparency {
        let mut parts = Vec::new();
        if let Some(i) = &t.impedance {
            parts.push(format!("impedance error: a factor of {:.2} over {:.0}-{:.0} Hz", i.error.exp(), i.band_hz[0], i.band_hz[1]));
        }
        if let Some(ratio) = t.induced_ratio {
            parts.push(format!("induced motion {:.0} % of the hand's", 100.0 * ratio));
        }
        if let Some(c) = &t.cancellation {
            parts.push(format!("{:.1} % of it cancelled in the first 50 ms", 100.0 * c.quality));
        }
        if !parts.is_empty() {
            lines.put("hand", format!("{}: {}", t.name, parts.join("; ")));
        }
    }
}
