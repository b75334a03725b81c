//! What happens at which gain, and with which grip.

use super::words::{text, tone, word};
use backdrive_report::{Cell, Figure, Page, Plot, Table, Tone, number, si};
use backdrive_stability::outcome::Outcome;
use backdrive_stability::resimulate::Run;
use backdrive_stability::resimulate::edge::Edge;
use backdrive_stability::verdict::{Answer, Resimulated, Word};

/// Height of verdicts with no curve over them, px.
const BARE: f64 = 90.0;

/// One gain of a sweep, and what the loop did at it.
pub type Point = (f64, Run);

/// The sweep, or the search for the critical gain where nothing was swept.
pub(super) fn gains(page: &mut Page, found: &Answer, curve: &[&Point]) {
    let again = found.resimulated.as_ref();
    let swept: Vec<(f64, Outcome)> = match again {
        _ if !curve.is_empty() => curve.iter().map(|(gain, run)| (*gain, run.outcome)).collect(),
        Some(again) => again.edge.grid.clone(),
        None => Vec::new(),
    };
    let measured = found.frequency.as_ref().filter(|f| f.cannot_tell.is_none());
    if swept.is_empty() && measured.is_none() {
        page.text("The loop could neither be re-simulated nor identified from the recording, so there is no figure over the gain.");
        return;
    }
    let asked = found.gain.product();
    let grid: Vec<f64> = if swept.is_empty() { spaced(asked / 20.0, asked * 20.0) } else { swept.iter().map(|p| p.0).collect() };
    let pick = |of: fn(&Outcome) -> Option<f64>| -> (Vec<f64>, Vec<f64>) { swept.iter().filter_map(|(g, o)| Some((*g, of(o)?))).unzip() };
    let amplitude = pick(|o| if let Outcome::LimitCycle { amplitude_m, .. } = o { Some(*amplitude_m) } else { None });
    let growth = pick(|o| if let Outcome::Unstable { growth_per_s } = o { Some(*growth_per_s) } else { None });

    let mut plots = Vec::new();
    if !amplitude.0.is_empty() {
        plots.push(Plot::new("").y_axis("amplitude of the limit cycle", "m").y_log().points("", &amplitude.0, &amplitude.1));
    }
    if !growth.0.is_empty() {
        plots.push(Plot::new("").y_axis("growth", "1/s").include_y(0.0).points("", &growth.0, &growth.1));
    }
    if let Some(frequency) = measured {
        let lo = grid.iter().copied().fold(f64::INFINITY, f64::min);
        let hi = grid.iter().copied().fold(0.0, f64::max);
        let gains = if lo < hi { spaced(lo, hi) } else { vec![asked] };
        // Beyond the stability limit the distance is counted below zero, so that the curve crosses zero where the loop does.
        let signed = |g: &f64| {
            let answer = frequency.at(*g);
            let distance = answer.margins.map_or(f64::NAN, |m| m.modulus);
            if answer.margins.and_then(|m| m.critical).is_some_and(|c| c.factor < 1.0) { -distance } else { distance }
        };
        let distance: Vec<f64> = gains.iter().map(signed).collect();
        let mut plot = Plot::new("").y_axis("distance of L from +1", "").include_y(0.0);
        plot = plot.y_limits(-1.0, 1.0).line("", &gains, &distance);
        plots.push(plot);
    }
    let bare = plots.is_empty();
    if bare {
        plots.push(Plot::new("").y_limits(0.0, 1.0).height(BARE));
    }
    let edges = edge_marks(found);
    let count = plots.len();
    for (i, plot) in plots.iter_mut().enumerate() {
        let mut drawn = std::mem::replace(plot, Plot::new(""));
        if i == 0 {
            drawn = drawn.titled("Verdict over the loop gain").x_axis("loop gain μλ", "").x_log();
        }
        for (from, to, word) in verdict_spans(&swept) {
            drawn = drawn.region(from, to, tone(word), if i == 0 { text(word) } else { "" });
        }
        for (at, label, tone) in &edges {
            drawn = drawn.vertical(*at, if i == 0 { label } else { "" }, *tone);
        }
        *plot = if count == 1 && !bare { drawn.height(260.0) } else { drawn };
    }
    let what = match (curve.is_empty(), again) {
        (false, _) => format!("Re-simulation at {} gains with the grip as recorded; the colour is the verdict.", swept.len()),
        (true, Some(again)) => format!(
            "The colour is the verdict of the re-simulation with the grip as recorded, at the {} gains of the search for the stability \
             limit (--sweep adds more). The limit was refined with {} runs.",
            swept.len(),
            again.edge.evaluations
        ),
        (true, None) => "From the measured frequency response alone.".to_string(),
    };
    let below = if measured.is_some() { " The distance of L from +1 is negative above the stability limit." } else { "" };
    page.figure(Figure::stacked(plots), &format!("{what}{below}"));
    if let Some(again) = again {
        grips(page, again, asked);
    }
}

/// What is marked on the gain axis.
fn edge_marks(found: &Answer) -> Vec<(f64, String, Tone)> {
    let mut marks = vec![(found.gain.product(), format!("requested {}", number(found.gain.product())), tone(found.verdict))];
    if let Some([low, high]) = found.recorded_gain.filter(|r| r.iter().all(|g| *g > 0.0)) {
        marks.push((low, format!("recorded {}", number(low)), Tone::Neutral));
        if high > low * 1.001 {
            marks.push((high, format!("recorded {}", number(high)), Tone::Neutral));
        }
    }
    if let Some(edge) = found.resimulated.as_ref().and_then(|a| a.edge.critical_gain) {
        marks.push((edge, format!("limit, re-simulated {}", number(edge)), Tone::Bad));
    }
    // Below those of the recorded grip there may be one of a firmer or softer one.
    let marked = |edge: f64, marks: &[(f64, String, Tone)]| marks.iter().any(|m| m.2 == Tone::Bad && (m.0 / edge - 1.0).abs() < 0.005);
    let limit = found.critical_gain.or(found.at_least.filter(|least| *least < found.gain.product()));
    if let Some(edge) = limit.filter(|edge| !marked(*edge, &marks)) {
        marks.push((edge, format!("limit to use {}", number(edge)), Tone::Bad));
    }
    if let Some(edge) = found.frequency_answer.as_ref().and_then(|a| a.critical_gain) {
        marks.push((edge, format!("limit, measured {}", number(edge)), Tone::Bad));
    }
    marks
}

/// Each gain's verdict holds half way (in the logarithm) to its neighbours.
fn verdict_spans(swept: &[(f64, Outcome)]) -> Vec<(f64, f64, Word)> {
    let mut order: Vec<&(f64, Outcome)> = swept.iter().filter(|p| p.0 > 0.0 && p.0.is_finite()).collect();
    order.sort_by(|a, b| a.0.total_cmp(&b.0));
    let between = |a: Option<&&(f64, Outcome)>, b: Option<&&(f64, Outcome)>| match (a, b) {
        (Some(a), Some(b)) => Some((a.0 * b.0).sqrt()),
        _ => None,
    };
    (0..order.len())
        .filter_map(|i| {
            let here = order.get(i)?;
            let from = between(i.checked_sub(1).and_then(|j| order.get(j)), Some(here)).unwrap_or(here.0);
            let to = between(Some(here), order.get(i + 1)).unwrap_or(here.0);
            Some((from, to, word(&here.1)))
        })
        .collect()
}

/// Gains evenly spaced in their logarithm.
fn spaced(from: f64, to: f64) -> Vec<f64> {
    backdrive_stability::resimulate::sweep::log_grid(from, to, 200)
}

fn grips(page: &mut Page, again: &Resimulated, asked: f64) {
    if !again.grips.is_empty() {
        let head = ["grip".to_string(), "critical μλ".to_string(), format!("at μλ = {}", number(asked))];
        let mut table = Table::new(head).caption(
            "The stability limit for softer and stiffer grips than the recorded one: a grip is never known \
                exactly.",
        );
        let mut rows: Vec<(f64, &Edge, Option<Outcome>)> = again.grips.iter().map(|g| (g.scale, &g.edge, g.at_asked)).collect();
        rows.push((1.0, &again.edge, Some(again.outcome)));
        rows.sort_by(|a, b| a.0.total_cmp(&b.0));
        for (scale, edge, at_asked) in rows {
            table.push([
                Cell::from(if scale == 1.0 { "× 1 (as recorded)".to_string() } else { format!("× {scale}") }),
                match edge.critical_gain {
                    Some(gain) => number(gain),
                    None if edge.at_least > 0.0 => format!("≥ {}", number(edge.at_least)),
                    None => "–".to_string(),
                }
                .into(),
                at_asked.map_or(Cell::from("–"), |o| Cell::tone(o.to_string(), tone(word(&o)))),
            ]);
        }
        page.table(table);
    }
    if let Some(over) = again.over_cancelling.as_ref().filter(|o| !o.balances.is_empty()) {
        page.details("The canceller at rest: does it subtract more than the induced motion?", |inside| {
            let mut table = Table::new(["axis", "grip", "amplitude", "master |G(0)|", "canceller |Ĝ(0)|", "diverges above μλ"]);
            for b in &over.balances {
                let limit = b.dc_limit.map_or(Cell::from("never"), |l| Cell::tone(number(l), Tone::Bad));
                let row = [b.axis.clone(), format!("× {}", b.scale), si(b.amplitude, "m"), si(b.master, "m/N"), si(b.model, "m/N")];
                table.push(row.into_iter().map(Cell::from).chain([limit]));
            }
            inside.table(table);
        });
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn verdicts_hold_half_way_to_their_neighbours() {
        let cycle = Outcome::LimitCycle { amplitude_m: 1e-3, frequency_hz: 20.0, unit: Default::default() };
        let spans = verdict_spans(&[(4.0, cycle), (1.0, Outcome::Stable), (f64::NAN, Outcome::Stable)]);
        assert_eq!(spans, [(1.0, 2.0, Word::Stable), (2.0, 4.0, Word::LimitCycle)]);
        assert!(verdict_spans(&[]).is_empty());
    }
}
