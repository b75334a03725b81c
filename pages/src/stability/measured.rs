//! The measured loop: Nyquist and Bode plots, critical gains and their intervals.

use super::words::interval;
use backdrive_report::{Colour, Dash, Figure, Page, Plot, Series, Table, Tone, number, si};
use backdrive_stability::frequency::{AxisEstimate, Frequency, LevelEstimate};
use backdrive_stability::verdict::Answer;
use std::f64::consts::TAU;

/// Radius of the disc that holds 95 % of a two-dimensional normal spread, in standard deviations of one component: sqrt(-2 ln 0.05).
const DISC_95: f64 = 2.447_746_830_680_816;
/// Half the width of the interval that holds 95 % of a normal spread, in standard deviations.
const INTERVAL_95: f64 = 1.96;
/// A loop larger than this is cut in the Nyquist plot, so that what is near +1 can be seen.
const NYQUIST_REACH: f64 = 3.0;
/// Discs are drawn where they come nearer to +1 than this.
const NEAR_CRITICAL: f64 = 0.5;
/// Discs per curve, about: more only hide each other.
const DISCS: usize = 60;

/// Nyquist and Bode plots of the measured loop at the gain asked.
pub(super) fn measured(page: &mut Page, found: &Answer) {
    let Some(frequency) = &found.frequency else {
        page.text("The recording was not analysed in frequency.");
        return;
    };
    if let Some(cannot) = &frequency.cannot_tell {
        page.note(&format!("The loop cannot be identified from this recording: {}.", cannot.reason.trim_end_matches('.')));
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
        let whose = if found.margins_are_of_the_edge() {
            "At the requested gain, from the measured response of the least stable loop at the worst amplitude."
        } else {
            "At the requested gain, from the measured response alone. The stability limit to use (above) is lower or known better; these \
                margins do not refer to it."
        };
        let of = |value: Option<f64>, unit: &str| value.map_or("unlimited".to_string(), |v| format!("{} {unit}", number(v)));
        page.table(
            Table::new(["gain margin", "phase margin", "delay margin", "modulus margin |1 − L|"])
                .row([of(m.gain_db, "dB"), of(m.phase_deg, "°"), of(m.delay_ms, "ms"), number(m.modulus)])
                .caption(whose),
        );
    }
    let several = names.len() > 1;
    if several && frequency.levels.iter().any(|l| !l.loci.is_empty()) {
        page.figure(
            loci(frequency, gain),
            "All axes together: the loop is stable if none of these loci encircles +1. Uncertainty is shown for each axis below.",
        );
    }
    for name in &names {
        let found: Vec<(&LevelEstimate, &AxisEstimate)> =
            frequency.levels.iter().filter_map(|l| Some((l, l.axes.iter().find(|a| a.name == **name)?))).collect();
        if found.iter().all(|(_, a)| !a.told.iter().any(|t| *t)) {
            page.text(&format!("{name}: no line of the loop exceeds its uncertainty."));
            continue;
        }
        let title = if several { format!("{name}: ") } else { String::new() };
        page.figure(
            bode(&found, gain, &title),
            "The loop is at its stability limit where |L| = 1 at a phase of 0° (or a multiple of 360°). Band: 95 % interval.",
        );
        page.details(&format!("{title}Nyquist plot"), |inside| {
            inside.figure(
                nyquist(&found, gain, &title),
                "Open-loop response L at the requested gain. The closed loop is F_f = d + L F_f, so +1 is the critical point. Colour: \
                 frequency. Discs: 95 % confidence regions near +1. Lines within their uncertainty are omitted.",
            );
        });
    }
    page.details("How the response was estimated", |inside| {
        inside.text(&frequency.method);
        let mut table =
            Table::new(["dither rms", "rows", "window", "segment", "segments", "averages", "line spacing", "critical μλ", "95 % interval"]);
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
            inside.text(&format!("Delay of the loop outside its devices: {}.", si(delay, "s")));
        }
        let r = &frequency.rows;
        inside.text(&format!(
            "Of {} rows {} were used. Omitted: {} missing, {} clamped, {} while a gain ramped, {} out of contact, {} while the hand \
             moved, {} without excitation, {} while settling.",
            r.all, r.used, r.missing, r.clamped, r.ramping, r.free, r.moving, r.quiet, r.settling
        ));
    });
}

/// One curve per amplitude, with discs, and where it meets the stability limit.
fn nyquist(found: &[(&LevelEstimate, &AxisEstimate)], gain: f64, title: &str) -> Plot {
    let mut plot = Plot::new(&format!("{title}Nyquist plot of the loop L")).x_axis("Re L", "").y_axis("Im L", "").equal_aspect();
    plot = plot.include(1.0, 0.0).include(0.0, 0.0);
    let (circle_re, circle_im): (Vec<f64>, Vec<f64>) =
        (0..=180).map(|k| (f64::from(k) * TAU / 180.0).sin_cos()).map(|(s, c)| (c, s)).unzip();
    plot = plot.series(Series::line("|L| = 1", &circle_re, &circle_im).colour(Colour::Muted).dash(Dash::Dotted).width(1.0));
    let mut seen = Vec::new();
    // Frequencies are written at the curve with the lowest critical gain.
    let first = first_edge(found);
    let mut order: Vec<usize> = (0..found.len()).collect();
    order.sort_by_key(|i| first == Some(*i)); // the curve that decides last, on top
    for (i, (level, axis)) in order.into_iter().filter_map(|i| Some((i, found.get(i)?))) {
        let at = |k: usize| at_line(axis, k).map_or((f64::NAN, f64::NAN), |l| (gain * l[0], gain * l[1]));
        let (re, im): (Vec<f64>, Vec<f64>) = (0..axis.l.len()).map(at).unzip();
        seen.extend(re.iter().copied().zip(im.iter().copied()));
        let every = axis.l.len().div_ceil(DISCS).max(1);
        let thin = |v: &[f64]| v.iter().step_by(every).copied().collect::<Vec<f64>>();
        // Uncertainty decides only where a disc comes near +1; in other places discs would smear the curve.
        let near = |k: usize, r: f64| re.get(k).zip(im.get(k)).is_some_and(|(re, im)| (re - 1.0).hypot(*im) - r < NEAR_CRITICAL);
        let all = axis.sigma.iter().map(|s| DISC_95 * gain * s).enumerate();
        let radius: Vec<f64> = all.map(|(k, r)| if near(k, r) { r } else { f64::NAN }).collect();
        let name = level_name(level, found.len());
        let disc_name = if found.len() == 1 { "95 % discs" } else { "" };
        // Of several amplitudes that with the lowest critical gain decides: its colour is the frequency, the others stay behind it.
        let leads = first == Some(i);
        let colour = if leads { Colour::Nth(0) } else { Colour::Muted };
        plot = plot.series(Series::discs(disc_name, &thin(&re), &thin(&im), &thin(&radius)).colour(colour));
        let curve = Series::line(&name, &re, &im).colour(colour).dash(Dash::Solid);
        plot = plot.series(if leads { curve.by("frequency", "Hz", &level.hz).width(2.2) } else { curve.width(0.8) });
        let lines: Vec<usize> = (0..axis.l.len()).filter(|k| at_line(axis, *k).is_some()).collect();
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
pub(super) fn within_reach(plot: Plot, points: &[(f64, f64)]) -> Plot {
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
        let size = |k: usize| at_line(axis, k).map_or(f64::NAN, |l| gain * l[0].hypot(l[1]));
        let db = |v: f64| 20.0 * v.log10();
        let n = axis.l.len();
        let spread = |k: usize| INTERVAL_95 * gain * axis.sigma.get(k).copied().unwrap_or(f64::NAN);
        let values: Vec<f64> = (0..n).map(|k| db(size(k))).collect();
        // A line that carries information is at least three standard deviations, so its interval stays above zero.
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
            magnitude = magnitude.vertical(hz, &format!("limit at {}", si(hz, "Hz")), Tone::Bad);
            phase = phase.vertical(hz, "", Tone::Bad);
        }
    }
    let (first, last) = ((lowest / 360.0).ceil() as i64, (highest / 360.0).floor() as i64);
    for turn in first..=last.min(first + 20) {
        phase = phase.horizontal(360.0 * turn as f64, if turn == 0 { "critical" } else { "" }, Tone::Neutral);
    }
    Figure::stacked([magnitude, phase, coherence])
}

/// Which of the estimates has the lowest critical gain.
fn first_edge(found: &[(&LevelEstimate, &AxisEstimate)]) -> Option<usize> {
    let edge = |i: &usize| found.get(*i).and_then(|(_, a)| a.edge.gain).unwrap_or(f64::INFINITY);
    (0..found.len()).min_by(|a, b| edge(a).total_cmp(&edge(b)))
}

/// L at a line that carries information, per unit gain.
fn at_line(axis: &AxisEstimate, line: usize) -> Option<[f64; 2]> {
    let told = axis.told.get(line).copied().unwrap_or(false);
    axis.l.get(line).copied().filter(|l| told && l.iter().all(|v| v.is_finite()))
}

/// Phase over the lines that carry information, degrees, without jumps of a turn between neighbours.
fn unwrapped(axis: &AxisEstimate) -> Vec<f64> {
    let mut before: Option<f64> = None;
    (0..axis.l.len())
        .map(|k| {
            let Some(l) = at_line(axis, k) else { return f64::NAN };
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
