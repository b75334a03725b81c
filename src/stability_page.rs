//! The report of `backdrive stability`: pictures first, the numbers beside them.

use crate::stability::Point;
use backdrive_report::{Cell, Colour, Dash, Figure, Page, Plot, Series, Table, Tone, number, percent, si};
use backdrive_stability::energy::{AxisEnergy, EnergyAnswer, EnergyVerdict};
use backdrive_stability::frequency::{self, AxisEstimate, Frequency, LevelEstimate};
use backdrive_stability::outcome::Outcome;
use backdrive_stability::session::{AxisSignals, Session};
use backdrive_stability::transparency::Transparency;
use backdrive_stability::verdict::{Answer, Method, Resimulated, Word};

/// Radius of the disc that holds 95 % of a two-dimensional normal spread, in standard deviations of one component: sqrt(-2 ln 0.05).
const DISC_95: f64 = 2.447_746_830_680_816;
/// Half the width of the interval that holds 95 % of a normal spread, in standard deviations.
const INTERVAL_95: f64 = 1.96;
/// A loop larger than this is cut in the Nyquist plot, so that what is near +1 can be seen.
const NYQUIST_REACH: f64 = 3.0;
/// How much of the first contact is drawn by itself, s.
const IMPACT_S: f64 = 0.3;
/// Discs per curve, about: more only hide each other.
const DISCS: usize = 60;

/// The report of an answer; `session` is what was recorded, `curve` the sweep, which may be empty.
pub fn page(found: &Answer, session: &Session, curve: &[&Point]) -> Page {
    let mut page = Page::new(&format!("Stability of {} at μλ = {}", file_name(&found.bag), number(found.gain.product())));
    page.lead(tone(found.verdict), &lead(found));
    page.text(&capital(&found.reason));
    for d in &found.disagreements {
        page.warning(&capital(&d.text));
    }
    for warning in &found.warnings {
        page.note(&capital(warning));
    }
    if let Some(advice) = &found.advice {
        page.note(&format!("To record for a better answer: {advice}"));
    }
    page.table(methods(found));

    page.section("Loop, measured");
    measured(&mut page, found);
    page.section("Gain");
    gains(&mut page, found, curve);
    page.section(&format!("Response at μλ = {}", number(found.gain.product())));
    response(&mut page, found, session);
    page.section("Energy");
    match &found.resimulated {
        Some(again) => {
            energy(&mut page, &again.energy, &format!("run again at μλ = {}", number(found.gain.product())));
            page.details("Energy as recorded", |inside| energy(inside, &found.recorded_energy, "as recorded"));
        }
        None => energy(&mut page, &found.recorded_energy, "as recorded"),
    }
    page.section("Transparency, as recorded");
    transparency(&mut page, &found.transparency);
    if !found.checks.is_empty() || found.loop_check.is_some() {
        page.section("Models against the recording");
        models(&mut page, found);
    }
    page
}

/// The verdict in a sentence.
fn lead(found: &Answer) -> String {
    let gain = number(found.gain.product());
    let verdict = match found.verdict {
        Word::Stable => format!("Stable at μλ = {gain}"),
        Word::LimitCycle => format!("Not stable at μλ = {gain}: it oscillates in a limit cycle"),
        Word::Unstable => format!("Unstable at μλ = {gain}"),
        Word::Limited => format!("Limited at μλ = {gain}: a clamp or the travel decides, not the loop"),
        Word::CannotTell => format!("It cannot be told whether the loop is stable at μλ = {gain}"),
    };
    let edge = match (found.critical_gain, found.at_least) {
        (Some(edge), _) => {
            let interval = found.critical_gain_ci95.map_or(String::new(), |ci| format!(" (95 %: {})", interval(ci)));
            let how = match found.critical_frequency_hz {
                Some(hz) if hz > 0.0 => format!(", where it oscillates at {}", si(hz, "Hz")),
                Some(_) => ", where it runs away without oscillating".to_string(),
                None => String::new(),
            };
            format!(" The edge is at μλ = {}{interval}{how}.", number(edge))
        }
        (None, Some(least)) => format!(" No edge up to μλ = {}.", number(least)),
        (None, None) => String::new(),
    };
    format!("{verdict}.{edge}")
}

/// Each method's verdict and edge.
fn methods(found: &Answer) -> Table {
    let mut table = Table::new(["method", "verdict", "critical μλ", "95 % interval", "frequency", "why"]);
    let edge = |gain: Option<f64>, least: Option<f64>| match (gain, least) {
        (Some(gain), _) => number(gain),
        (None, Some(least)) => format!("≥ {}", number(least)),
        (None, None) => "–".to_string(),
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
            match again.edge.outcome_beyond {
                Some(Outcome::LimitCycle { frequency_hz, .. }) => si(frequency_hz, "Hz"),
                _ => "–".to_string(),
            }
            .into(),
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

/// Nyquist and Bode plots of the measured loop at the gain asked.
fn measured(page: &mut Page, found: &Answer) {
    let Some(frequency) = &found.frequency else {
        page.text("The recording was not analysed in frequency.");
        return;
    };
    if let Some(cannot) = &frequency.cannot_tell {
        page.note(&format!("The loop cannot be told from this recording: {}.", cannot.reason.trim_end_matches('.')));
    }
    let gain = found.gain.product();
    let axes = frequency.levels.iter().flat_map(|l| l.axes.iter().map(|a| a.name.as_str()));
    let mut names: Vec<&str> = Vec::new();
    for name in axes {
        if !names.contains(&name) {
            names.push(name);
        }
    }
    if let Some(m) = &found.margins {
        let of = |value: Option<f64>, unit: &str| value.map_or("unlimited".to_string(), |v| format!("{} {unit}", number(v)));
        page.table(
            Table::new(["gain margin", "phase margin", "delay margin", "modulus margin |1 − L|"])
                .row([of(m.gain_db, "dB"), of(m.phase_deg, "°"), of(m.delay_ms, "ms"), number(m.modulus)])
                .caption("At the gain asked, by the measured response of the worst loop at the worst amplitude."),
        );
    }
    let several = names.len() > 1;
    if several && frequency.levels.iter().any(|l| !l.loci.is_empty()) {
        page.figure(
            loci(frequency, gain),
            "All axes together: the loop is stable if none of these loci encircles +1. No discs: see each axis below.",
        );
    }
    for name in &names {
        let found: Vec<(&LevelEstimate, &AxisEstimate)> =
            frequency.levels.iter().filter_map(|l| Some((l, l.axes.iter().find(|a| a.name == **name)?))).collect();
        if found.iter().all(|(_, a)| !a.told.iter().any(|t| *t)) {
            page.text(&format!("{name}: no line of the loop stands out of its uncertainty."));
            continue;
        }
        let title = if several { format!("{name}: ") } else { String::new() };
        page.figure(
            nyquist(&found, gain, &title),
            "L, once round the loop, scaled to the gain asked; the closed loop is F_f = d + L F_f, so +1 is the critical point. The discs hold \
             95 % each. Only lines at which L stands out of its uncertainty are drawn.",
        );
        page.figure(
            bode(&found, gain, &title),
            "The loop is on its edge where |L| = 1 at a phase of 0° (or a whole turn). The band holds 95 %.",
        );
    }
    page.details("How the response was estimated", |inside| {
        inside.text(&frequency.method);
        let mut table = Table::new(["dither rms", "rows", "window", "segment", "segments", "averages", "line spacing", "critical μλ", "95 % interval"]);
        for level in &frequency.levels {
            let a = &level.averaging;
            table.push([
                number(level.amplitude_rms),
                level.rows.to_string(),
                match a.window {
                    backdrive_stability::spectra::Window::Hann => "Hann",
                    backdrive_stability::spectra::Window::Periods => "whole periods",
                }
                .to_string(),
                si(a.segment_s, "s"),
                a.segments.to_string(),
                number(a.averages),
                si(a.resolution_hz, "Hz"),
                level.edge.gain.map_or("–".to_string(), number),
                level.edge.interval().map_or("–".to_string(), interval),
            ]);
        }
        inside.table(table);
        let p = &frequency.provenance;
        inside.text(&format!("Master: {}; canceller: {}; slave and environment: {}.", p.master, p.canceller, p.slave));
        if let Some(delay) = frequency.delays.loop_s {
            inside.text(&format!("Delay of the loop beside its devices: {}.", si(delay, "s")));
        }
        let r = &frequency.rows;
        inside.text(&format!(
            "Of {} rows {} were used; left out: {} missing, {} clamped, {} while a gain ramped, {} out of contact, {} while the hand moved, \
             {} without excitation, {} while settling.",
            r.all, r.used, r.missing, r.clamped, r.ramping, r.free, r.moving, r.quiet, r.settling
        ));
    });
}

/// One curve per amplitude, with discs, and where it meets the edge.
fn nyquist(found: &[(&LevelEstimate, &AxisEstimate)], gain: f64, title: &str) -> Plot {
    let mut plot = Plot::new(&format!("{title}Nyquist plot of the loop L")).x_axis("Re L", "").y_axis("Im L", "").equal_aspect();
    plot = plot.include(1.0, 0.0).include(0.0, 0.0);
    let mut seen = Vec::new();
    // Frequencies are written at the curve whose edge comes first.
    let first = first_edge(found);
    for (i, (level, axis)) in found.iter().enumerate() {
        let at = |k: usize| told(axis, k).map_or((f64::NAN, f64::NAN), |l| (gain * l[0], gain * l[1]));
        let (re, im): (Vec<f64>, Vec<f64>) = (0..axis.l.len()).map(at).unzip();
        seen.extend(re.iter().copied().zip(im.iter().copied()));
        let every = axis.l.len().div_ceil(DISCS).max(1);
        let thin = |v: &[f64]| v.iter().step_by(every).copied().collect::<Vec<f64>>();
        let radius: Vec<f64> = axis.sigma.iter().map(|s| DISC_95 * gain * s).collect();
        let name = level_name(level, found.len());
        let disc_name = if found.len() == 1 { "95 % discs" } else { "" };
        plot = plot.series(Series::discs(disc_name, &thin(&re), &thin(&im), &thin(&radius)).colour(Colour::Nth(i)));
        plot = plot.series(Series::line(&name, &re, &im).colour(Colour::Nth(i)));
        let lines: Vec<usize> = (0..axis.l.len()).filter(|k| told(axis, *k).is_some()).collect();
        let mut marks = vec![lines.first().copied(), lines.last().copied()];
        if let Some(hz) = axis.edge.frequency_hz {
            let near = |k: &&usize| level.hz.get(**k).map_or(f64::INFINITY, |f| (f - hz).abs());
            marks.push(lines.iter().min_by(|a, b| near(a).total_cmp(&near(b))).copied());
        }
        marks.dedup();
        if first == Some(i) {
            for k in marks.into_iter().flatten() {
                if let (Some(re), Some(im), Some(hz)) = (re.get(k), im.get(k), level.hz.get(k)) {
                    plot = plot.annotate(*re, *im, &si(*hz, "Hz"), Tone::Neutral);
                }
            }
        }
    }
    within_reach(plot, &seen).annotate(1.0, 0.0, "+1", Tone::Bad)
}

/// Limits that leave out what lies far from +1, where anything does.
fn within_reach(plot: Plot, points: &[(f64, f64)]) -> Plot {
    let near = |p: &&(f64, f64)| p.0.abs() <= NYQUIST_REACH && p.1.abs() <= NYQUIST_REACH;
    if points.iter().all(|p| near(&p) || !(p.0.is_finite() && p.1.is_finite())) {
        return plot;
    }
    let (mut x, mut y) = ((-0.5f64, 1.5f64), (-0.5f64, 0.5f64));
    for p in points.iter().filter(near) {
        x = (x.0.min(p.0 - 0.1), x.1.max(p.0 + 0.1));
        y = (y.0.min(p.1 - 0.1), y.1.max(p.1 + 0.1));
    }
    plot.x_limits(x.0, x.1).y_limits(y.0, y.1)
}

/// The eigenvalues of several coupled loops.
fn loci(frequency: &Frequency, gain: f64) -> Plot {
    let mut plot = Plot::new("Loci of all axes").x_axis("Re", "").y_axis("Im", "").equal_aspect().include(1.0, 0.0);
    let mut seen = Vec::new();
    for level in &frequency.levels {
        let points = level.loci.iter().flatten().map(|l| (gain * l[0], gain * l[1]));
        let (re, im): (Vec<f64>, Vec<f64>) = points.unzip();
        seen.extend(re.iter().copied().zip(im.iter().copied()));
        plot = plot.series(Series::points(&level_name(level, frequency.levels.len()), &re, &im).width(1.2));
    }
    within_reach(plot, &seen).annotate(1.0, 0.0, "+1", Tone::Bad)
}

/// Magnitude with its interval, phase, coherence.
fn bode(found: &[(&LevelEstimate, &AxisEstimate)], gain: f64, title: &str) -> Figure {
    let mut magnitude = Plot::new(&format!("{title}Frequency response of the loop L")).x_axis("frequency", "Hz").x_log();
    magnitude = magnitude.y_axis("|L|", "dB").horizontal(0.0, "|L| = 1", Tone::Neutral);
    let mut phase = Plot::new("").y_axis("phase of L", "°");
    let mut coherence = Plot::new("").y_axis("coherence of the dither with the reflected force", "").y_limits(0.0, 1.02).height(90.0);
    let (mut lowest, mut highest) = (0.0f64, 0.0f64);
    let first = first_edge(found);
    for (i, (level, axis)) in found.iter().enumerate() {
        let size = |k: usize| told(axis, k).map_or(f64::NAN, |l| gain * l[0].hypot(l[1]));
        let db = |v: f64| 20.0 * v.log10();
        let n = axis.l.len();
        let spread = |k: usize| INTERVAL_95 * gain * axis.sigma.get(k).copied().unwrap_or(f64::NAN);
        let values: Vec<f64> = (0..n).map(|k| db(size(k))).collect();
        // A line that is told is at least three standard deviations, so its interval stays above zero.
        let lower: Vec<f64> = (0..n).map(|k| db(size(k) - spread(k))).collect();
        let upper: Vec<f64> = (0..n).map(|k| db(size(k) + spread(k))).collect();
        let band = if found.len() == 1 { "95 % interval" } else { "" };
        magnitude = magnitude.series(Series::band(band, &level.hz, &lower, &upper).colour(Colour::Nth(i)));
        magnitude = magnitude.series(Series::line(&level_name(level, found.len()), &level.hz, &values).colour(Colour::Nth(i)));
        let angles = unwrapped(axis);
        lowest = angles.iter().copied().filter(|a| a.is_finite()).fold(lowest, f64::min);
        highest = angles.iter().copied().filter(|a| a.is_finite()).fold(highest, f64::max);
        phase = phase.series(Series::line("", &level.hz, &angles).colour(Colour::Nth(i)));
        coherence = coherence.series(Series::line("", &level.hz, &axis.coherence).colour(Colour::Nth(i)));
        if let Some(hz) = axis.edge.frequency_hz.filter(|hz| *hz > 0.0 && first == Some(i)) {
            magnitude = magnitude.vertical(hz, &format!("edge at {}", si(hz, "Hz")), Tone::Bad);
            phase = phase.vertical(hz, "", Tone::Bad);
        }
    }
    let (first, last) = ((lowest / 360.0).ceil() as i64, (highest / 360.0).floor() as i64);
    for turn in first..=last.min(first + 20) {
        phase = phase.horizontal(360.0 * turn as f64, if turn == 0 { "critical" } else { "" }, Tone::Neutral);
    }
    Figure::stacked([magnitude, phase, coherence])
}

/// Which of the estimates has the lowest edge.
fn first_edge(found: &[(&LevelEstimate, &AxisEstimate)]) -> Option<usize> {
    let edge = |i: &usize| found.get(*i).and_then(|(_, a)| a.edge.gain).unwrap_or(f64::INFINITY);
    (0..found.len()).min_by(|a, b| edge(a).total_cmp(&edge(b)))
}

/// L at a line that tells something, per unit gain.
fn told(axis: &AxisEstimate, line: usize) -> Option<[f64; 2]> {
    let told = axis.told.get(line).copied().unwrap_or(false);
    axis.l.get(line).copied().filter(|l| told && l.iter().all(|v| v.is_finite()))
}

/// Phase over the lines that are told, degrees, without jumps of a turn between neighbours.
fn unwrapped(axis: &AxisEstimate) -> Vec<f64> {
    let mut before: Option<f64> = None;
    (0..axis.l.len())
        .map(|k| {
            let Some(l) = told(axis, k) else { return f64::NAN };
            let angle = l[1].atan2(l[0]).to_degrees();
            let angle = before.map_or(angle, |b| angle + 360.0 * ((b - angle) / 360.0).round());
            before = Some(angle);
            angle
        })
        .collect()
}

fn level_name(level: &LevelEstimate, levels: usize) -> String {
    if levels == 1 { "measured".to_string() } else { format!("at {} rms", number(level.amplitude_rms)) }
}

/// The sweep, or the search for the edge where nothing was swept.
fn gains(page: &mut Page, found: &Answer, curve: &[&Point]) {
    let again = found.resimulated.as_ref();
    let swept: Vec<(f64, Outcome)> = match again {
        _ if !curve.is_empty() => curve.iter().map(|(gain, run)| (*gain, run.outcome)).collect(),
        Some(again) => again.edge.grid.clone(),
        None => Vec::new(),
    };
    let measured = found.frequency.as_ref().filter(|f| f.cannot_tell.is_none());
    if swept.is_empty() && measured.is_none() {
        page.text("Neither could the loop be run again nor does the recording tell it: there is nothing to draw over the gain.");
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
        // Beyond the edge the distance is counted below zero, so that the curve crosses zero where the loop does.
        let signed = |g: &f64| {
            let answer = frequency.at(*g);
            let distance = answer.margins.map_or(f64::NAN, |m| m.modulus);
            if answer.margins.and_then(|m| m.critical).is_some_and(|c| c.factor < 1.0) { -distance } else { distance }
        };
        let distance: Vec<f64> = gains.iter().map(signed).collect();
        let mut plot = Plot::new("").y_axis("distance of L from +1, measured (below 0: beyond the edge)", "").include_y(0.0);
        plot = plot.y_limits(-1.0, 1.0).line("", &gains, &distance);
        plots.push(plot);
    }
    if plots.is_empty() {
        plots.push(Plot::new("").y_limits(0.0, 1.0).height(60.0));
    }
    let edges = edge_marks(found);
    let count = plots.len();
    for (i, plot) in plots.iter_mut().enumerate() {
        let mut drawn = std::mem::replace(plot, Plot::new(""));
        if i == 0 {
            drawn = drawn.titled("Verdict over the gain product").x_axis("gain product μλ", "").x_log();
        }
        for (from, to, word) in verdict_spans(&swept) {
            drawn = drawn.region(from, to, tone(word), if i == 0 { text(word) } else { "" });
        }
        for (at, label, tone) in &edges {
            drawn = drawn.vertical(*at, if i == 0 { label } else { "" }, *tone);
        }
        *plot = if count == 1 { drawn.height(260.0) } else { drawn };
    }
    let what = match (curve.is_empty(), again) {
        (false, _) => format!("{} gains, the loop run again at each; the colour is its verdict.", swept.len()),
        (true, Some(again)) => format!(
            "The colour is the verdict of the loop run again, at the {} gains at which the edge was looked for (--sweep draws more); it was \
             narrowed down with {} runs.",
            swept.len(),
            again.edge.evaluations
        ),
        (true, None) => "By the measured frequency response alone.".to_string(),
    };
    page.figure(Figure::stacked(plots), &what);
    if let Some(again) = again {
        grips(page, again, asked);
    }
}

/// What is marked on the gain axis.
fn edge_marks(found: &Answer) -> Vec<(f64, String, Tone)> {
    let mut marks = vec![(found.gain.product(), format!("asked {}", number(found.gain.product())), tone(found.verdict))];
    if let Some([low, high]) = found.recorded_gain.filter(|r| r.iter().all(|g| *g > 0.0)) {
        marks.push((low, format!("recorded {}", number(low)), Tone::Neutral));
        if high > low * 1.001 {
            marks.push((high, format!("recorded {}", number(high)), Tone::Neutral));
        }
    }
    if let Some(edge) = found.resimulated.as_ref().and_then(|a| a.edge.critical_gain) {
        marks.push((edge, format!("edge, re-simulated {}", number(edge)), Tone::Bad));
    }
    if let Some(edge) = found.frequency_answer.as_ref().and_then(|a| a.critical_gain) {
        marks.push((edge, format!("edge, measured {}", number(edge)), Tone::Bad));
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
        let mut table =
            Table::new(head).caption("The edge for softer and firmer grips than the one recorded: nobody knows a grip exactly.");
        for g in &again.grips {
            table.push([
                Cell::from(format!("× {}", g.scale)),
                g.edge.critical_gain.map_or_else(|| format!("≥ {}", number(g.edge.at_least)), number).into(),
                g.at_asked.map_or(Cell::from("–"), |o| Cell::tone(o.to_string(), tone(word(&o)))),
            ]);
        }
        page.table(table);
    }
    if let Some(over) = again.over_cancelling.as_ref().filter(|o| !o.balances.is_empty()) {
        page.details("The canceller at rest: does it take out more than the master moves?", |inside| {
            let mut table = Table::new(["axis", "grip", "amplitude", "master |G(0)|", "canceller |Ĝ(0)|", "runs away beyond μλ"]);
            for b in &over.balances {
                let limit = b.dc_limit.map_or(Cell::from("never"), |l| Cell::tone(number(l), Tone::Bad));
                let row = [b.axis.clone(), format!("× {}", b.scale), si(b.amplitude, "m"), si(b.master, "m/N"), si(b.model, "m/N")];
                table.push(row.into_iter().map(Cell::from).chain([limit]));
            }
            inside.table(table);
        });
    }
}

/// Position and force of each axis: run again at the gain asked, else as recorded.
fn response(page: &mut Page, found: &Answer, session: &Session) {
    let (signals, what) = match &found.resimulated {
        Some(again) => (&again.signals, format!("The loop run again with {}: {}.", again.script, again.outcome)),
        None => {
            let why = found.no_resimulation.as_deref().unwrap_or("it was not asked for");
            page.note(&format!("The loop was not run again ({why}): below is what was recorded, at its own gain."));
            (session, "As recorded.".to_string())
        }
    };
    for axis in &signals.axes {
        let name = if signals.axes.len() > 1 { axis.name.as_str() } else { "" };
        page.figure(time_plots(axis, signals.period_s, name, None), &what);
        // An oscillation cannot be seen in seconds.
        if let Some(touch) = axis.contact.iter().position(|f| f.is_finite() && *f != 0.0) {
            let from = touch as f64 * signals.period_s;
            page.figure(time_plots(axis, signals.period_s, name, Some((from - 0.02, from + IMPACT_S))), "The first contact.");
        }
    }
    if found.resimulated.is_some() {
        page.details("As recorded", |inside| {
            for axis in &session.axes {
                inside.figure(time_plots(axis, session.period_s, &axis.name, None), "");
            }
        });
    }
}

/// Position above force, of all the time or of a part of it, s.
fn time_plots(axis: &AxisSignals, period_s: f64, name: &str, part: Option<(f64, f64)>) -> Figure {
    let time: Vec<f64> = (0..axis.master.len()).map(|k| k as f64 * period_s).collect();
    let mut position = Plot::new(name).x_axis("time", "s").y_axis("position", "m");
    if let Some(intent) = &axis.intent {
        position = position.series(Series::line("hand x_u", &time, intent).colour(Colour::Ink).dash(Dash::Dashed));
    }
    // Without a canceller and at mu = 1 the command is the master's position, and would hide it.
    let same = axis.master.iter().zip(&axis.command).all(|(m, c)| (m - c).abs() <= 2.0 * axis.resolution + 1e-6 || !(m - c).is_finite());
    let name = if same { "master x_m, and command x_c" } else { "master x_m" };
    position = position.series(Series::line(name, &time, &axis.master).colour(Colour::Nth(0)).dash(Dash::Solid));
    if !same {
        position = position.series(Series::line("command x_c", &time, &axis.command).colour(Colour::Nth(2)).dash(Dash::Dotted));
    }
    if let Some([low, high]) = axis.travel {
        let seen = |limit: f64| axis.master.iter().any(|x| (x - limit).abs() < 0.2 * (high - low));
        for limit in [low, high].into_iter().filter(|l| l.is_finite() && seen(*l)) {
            position = position.horizontal(limit, "end of the travel", Tone::Limited);
        }
    }
    let mut force = Plot::new("").y_axis("force", "N");
    force = force.series(Series::line("on the master F_f", &time, &axis.force).colour(Colour::Nth(0)));
    force = force.series(Series::line("on the slave F_s", &time, &axis.contact).colour(Colour::Nth(1)));
    for (from, to) in spans(&axis.clamped) {
        force = force.region(from as f64 * period_s, to as f64 * period_s, Tone::Limited, "clamp");
    }
    if let Some((from, to)) = part {
        (position, force) = (position.x_limits(from, to), force.x_limits(from, to));
    }
    Figure::stacked([position, force])
}

/// Runs of true, at most so many that they can still be seen: gaps of less than a thousandth of all are bridged.
fn spans(flags: &[bool]) -> Vec<(usize, usize)> {
    let gap = flags.len() / 1000 + 1;
    let mut out: Vec<(usize, usize)> = Vec::new();
    for (k, _) in flags.iter().enumerate().filter(|f| *f.1) {
        match out.last_mut() {
            Some(last) if k <= last.1 + gap => last.1 = k + 1,
            _ => out.push((k, k + 1)),
        }
    }
    out
}

fn energy(page: &mut Page, answer: &EnergyAnswer, what: &str) {
    page.text(&capital(&answer.reason));
    for axis in &answer.axes {
        let mut ports = Plot::new(&format!("{}: energy taken by the ports, {what}", axis.name)).x_axis("time", "s").y_axis("energy", "J");
        ports = ports.line("displayed environment, at the master", &axis.time_s, &axis.master.energy_j);
        ports = ports.line("environment, at the slave", &axis.time_s, &axis.slave.energy_j);
        ports = ports.line("channel between them", &axis.time_s, &axis.two_port.energy_j);
        let mut plots = vec![ports.include_y(0.0)];
        if !axis.elements.is_empty() {
            let mut taken = Plot::new("").y_axis("energy taken in the master, by its model", "J").include_y(0.0);
            for e in &axis.elements {
                taken = taken.line(&format!("{} ({})", e.name, e.kind), &axis.time_s, &e.energy_j);
            }
            plots.push(taken);
        }
        page.figure(
            Figure::stacked(plots),
            "A port below zero has given more than it took. Passive is enough for stable, and not needed for it.",
        );
        energy_numbers(page, axis);
    }
}

fn energy_numbers(page: &mut Page, axis: &AxisEnergy) {
    let mut table = Table::new(["", "at the end", "least", "while the hand held still"]);
    let power = |t: &backdrive_stability::energy::Trend| format!("{} ± {}", si(t.mean_w, "W"), si(t.half_width_w, "W"));
    for (name, port) in [("master's port", &axis.master), ("slave's port", &axis.slave), ("channel", &axis.two_port)] {
        let hold = port.hold.as_ref().map_or("–".to_string(), power);
        table.push([
            name.to_string(),
            si(port.final_j, "J"),
            format!("{} at {}", si(port.minimum_j, "J"), si(port.minimum_at_s, "s")),
            hold,
        ]);
    }
    for e in axis.elements.iter().filter(|e| e.friction) {
        table.push([format!("{} ({})", e.name, e.kind), si(e.final_j, "J"), "–".into(), e.hold_w.map_or("–".into(), |w| si(w, "W"))]);
    }
    let friction: f64 = axis.elements.iter().filter(|e| e.friction).map(|e| e.final_j).sum();
    if axis.elements.iter().any(|e| e.friction) {
        table.push(["friction and hysteresis together".to_string(), si(friction, "J"), String::new(), String::new()]);
    }
    page.table(table);
    if let Some(why) = &axis.elements_reason {
        page.note(&format!("What friction and hysteresis took cannot be told: {why}"));
    }
    match (&axis.bounds, &axis.bounds_reason) {
        (Some(b), _) => {
            let within = |yes: bool| if yes { Cell::tone("within", Tone::Good) } else { Cell::tone("beyond", Tone::Warning) };
            let mut table = Table::new(["bound", "displayed stiffness at most", "μλ at most", "at this gain"]);
            table.push([
                Cell::from("Colgate: viscous damping and delay"),
                si(b.colgate_n_per_m, "N/m").into(),
                number(b.colgate_gain).into(),
                within(b.within_colgate),
            ]);
            table.push([
                Cell::from("Abbott: with Coulomb friction and encoder step"),
                si(b.abbott_n_per_m, "N/m").into(),
                number(b.abbott_gain).into(),
                within(b.within_abbott),
            ]);
            page.table(table.caption(&format!(
                "Displayed stiffness μλK_e here: {}, with K_e = {} ({}).",
                si(b.displayed_n_per_m, "N/m"),
                si(b.environment_n_per_m, "N/m"),
                b.environment_from
            )));
            for note in &b.notes {
                page.text(&capital(note));
            }
        }
        (None, Some(why)) => {
            page.note(&format!("The classical bounds cannot be told: {why}"));
        }
        (None, None) => {}
    }
}

fn transparency(page: &mut Page, axes: &[Transparency]) {
    let mut table = Table::new([
        "axis",
        "position error, free",
        "in contact",
        "force error in contact",
        "of a reflected",
        "induced motion",
        "cancelled in the first 50 ms",
        "impedance error",
    ]);
    let or_not = |value: Option<f64>, unit: &str| value.map_or("–".to_string(), |v| si(v, unit));
    for t in axes {
        table.push([
            t.name.clone(),
            or_not(t.position_free_rms, "m"),
            or_not(t.position_contact_rms, "m"),
            or_not(t.force_contact_rms, "N"),
            or_not(t.reflected_rms, "N"),
            t.induced_ratio.map_or("–".to_string(), percent),
            t.cancellation.as_ref().map_or("–".to_string(), |c| percent(c.quality)),
            t.impedance.as_ref().map_or("–".to_string(), |i| format!("factor {}", number(i.error.exp()))),
        ]);
    }
    page.table(
        table.caption(
            "Root mean squares; induced motion as a share of what the hand does; the impedance error is a mean factor, 1 is ideal.",
        ),
    );
    for t in axes {
        if let Some(i) = &t.impedance {
            let magnitude = Plot::new(&format!("{}: impedance transmitted to the hand", t.name)).x_axis("frequency", "Hz").x_log();
            let magnitude = magnitude.y_axis("magnitude", "N s/m").y_log().line("transmitted Z_t", &i.frequency_hz, &i.transmitted);
            let degrees: Vec<f64> = i.phase.iter().map(|p| p.to_degrees()).collect();
            let phase = Plot::new("").y_axis("phase of Z_t over μλZ_e", "°").include_y(0.0).line("", &i.frequency_hz, &degrees);
            page.figure(
                Figure::stacked([magnitude.line("environment μλZ_e", &i.frequency_hz, &i.environment), phase]),
                &format!(
                    "Against the {}, where the coherence is at least {}; ideal: the curves lie on each other.",
                    i.against,
                    number(i.least_coherence)
                ),
            );
        }
        for note in &t.notes {
            page.text(&format!("{}: {note}", t.name));
        }
    }
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
        page.table(table.caption("Each device's model run alone on what the device was given in the recording; root mean squares."));
    }
    if let Some(check) = &found.loop_check {
        let mut table = Table::new(["measured loop against the models' loop", "noise explains", ""]);
        table.push([Cell::from(percent(check.difference)), percent(check.noise).into(), agrees(check.agrees)]);
        page.table(table);
    }
}

fn word(outcome: &Outcome) -> Word {
    match outcome {
        Outcome::Stable => Word::Stable,
        Outcome::LimitCycle { .. } => Word::LimitCycle,
        Outcome::Unstable { .. } => Word::Unstable,
        Outcome::Limited { .. } => Word::Limited,
    }
}

fn tone(word: Word) -> Tone {
    match word {
        Word::Stable => Tone::Good,
        Word::LimitCycle => Tone::Warning,
        Word::Unstable => Tone::Bad,
        Word::Limited => Tone::Limited,
        Word::CannotTell => Tone::Unsure,
    }
}

fn text(word: Word) -> &'static str {
    match word {
        Word::Stable => "stable",
        Word::LimitCycle => "limit cycle",
        Word::Unstable => "unstable",
        Word::Limited => "limited",
        Word::CannotTell => "cannot tell",
    }
}

fn verdict(word: Word) -> Cell {
    Cell::tone(text(word), tone(word))
}

fn energy_verdict(verdict: EnergyVerdict) -> (&'static str, Tone) {
    match verdict {
        EnergyVerdict::Passive => ("passive", Tone::Good),
        EnergyVerdict::Active => ("active", Tone::Warning),
        EnergyVerdict::CannotTell => ("cannot tell", Tone::Unsure),
    }
}

fn interval((low, high): (f64, Option<f64>)) -> String {
    match high {
        Some(high) => format!("{} to {}", number(low), number(high)),
        None => format!("{} or more", number(low)),
    }
}

/// The last part of a path, for the title.
fn file_name(path: &str) -> &str {
    path.rsplit('/').find(|part| !part.is_empty()).unwrap_or(path)
}

/// A sentence from a clause: its first letter large, a full stop at its end.
fn capital(clause: &str) -> String {
    let mut chars = clause.chars();
    let first: String = chars.next().map(|c| c.to_uppercase().collect()).unwrap_or_default();
    let stop = if clause.is_empty() || clause.ends_with(['.', '!', '?', ':']) { "" } else { "." };
    format!("{first}{}{stop}", chars.as_str())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn verdicts_hold_half_way_to_their_neighbours() {
        let cycle = Outcome::LimitCycle { amplitude_m: 1e-3, frequency_hz: 20.0 };
        let spans = verdict_spans(&[(4.0, cycle), (1.0, Outcome::Stable), (f64::NAN, Outcome::Stable)]);
        assert_eq!(spans, [(1.0, 2.0, Word::Stable), (2.0, 4.0, Word::LimitCycle)]);
        assert!(verdict_spans(&[]).is_empty());
    }

    #[test]
    fn clamps_close_together_are_one_span() {
        let mut flags = vec![false; 3000];
        for k in [10, 11, 13, 2000] {
            flags[k] = true;
        }
        assert_eq!(spans(&flags), [(10, 14), (2000, 2001)]);
    }

    #[test]
    fn clauses_become_sentences() {
        assert_eq!(capital("äh, no"), "Äh, no.");
        assert_eq!(capital("Done."), "Done.");
        assert_eq!(capital(""), "");
        assert_eq!(file_name("a/b/session/"), "session");
    }
}
