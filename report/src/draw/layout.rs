//! Where everything stands: limits, margins, frames, legends, looks.

use super::label_width;
use crate::plot::{Axis, Colour, Dash, Kind, Plot, Region, Series};
use crate::style::{PALETTE, Tone};
use crate::svg::{Rect, shorten, text_width, wrap};
use crate::ticks::{self, Scale, Tick, Ticks, drawable};

/// Font sizes, px; they agree with the style sheet.
pub const FONT: f64 = 12.0;
pub const SMALL: f64 = 11.0;
const TITLE: f64 = 14.0;
/// How much wider bold letters are.
const BOLD: f64 = 1.12;

/// How a series looks: its colour's class, its dash, its mark.
#[derive(Clone, Debug)]
pub struct Look {
    pub class: String,
    pub dash: &'static str,
    pub width: f64,
    pub shape: usize,
}

impl Look {
    /// The inline style of a line; dense ones are never dashed.
    pub fn stroke(&self, dense: bool) -> String {
        let width = crate::svg::px(if dense { self.width.min(1.2) } else { self.width });
        if dense || self.dash.is_empty() {
            format!("stroke-width:{width}")
        } else {
            format!("stroke-width:{width};stroke-dasharray:{};stroke-linecap:butt", self.dash)
        }
    }
}

const DASHES: [&str; PALETTE] = ["", "7 3.5", "2 2.5", "10 3 2 3", "14 4", "10 3 2 3 2 3", "4 2"];

/// An entry of a legend.
#[derive(Clone, Debug)]
pub enum Entry {
    Series { name: String, look: Look, kind: Kind },
    Region { name: String, tone: Tone },
}

impl Entry {
    pub fn name(&self) -> &str {
        match self {
            Entry::Series { name, .. } | Entry::Region { name, .. } => name,
        }
    }
}

/// One plot of the stack, laid out.
pub struct Panel {
    /// Width of the whole drawing, px.
    pub width: f64,
    /// Top of the title, px.
    pub top: f64,
    pub frame: Rect,
    pub x: Scale,
    pub y: Scale,
    pub y_ticks: Ticks,
    pub x_label: String,
    pub x_unit: String,
    pub title: Vec<String>,
    pub legend: Vec<(f64, f64, Entry)>,
    pub looks: Vec<Look>,
    /// The regions, neighbours alike joined.
    pub regions: Vec<Region>,
}

impl Panel {
    pub fn at_x(&self, value: f64) -> f64 {
        self.frame.x + self.x.share(value) * self.frame.w
    }
    pub fn at_y(&self, value: f64) -> f64 {
        self.frame.bottom() - self.y.share(value) * self.frame.h
    }

    /// The span of a region within the frame, px; `None` outside and for spans of nothing.
    pub fn region_span(&self, region: &Region) -> Option<Rect> {
        region_span(region, &self.x, self.frame)
    }
}

fn region_span(region: &Region, x: &Scale, frame: Rect) -> Option<Rect> {
    let at = |v: f64| {
        let share = if v <= x.lo {
            0.0
        } else if v >= x.hi {
            1.0
        } else {
            x.share(v) // NaN for NaN
        };
        frame.x + share * frame.w
    };
    let (from, to) = (at(region.from.min(region.to)), at(region.from.max(region.to)));
    let known = !region.from.is_nan() && !region.to.is_nan();
    (known && to - from > 0.05).then_some(Rect { x: from, y: frame.y, w: to - from, h: frame.h })
}

pub struct Layout {
    pub height: f64,
    pub panels: Vec<Panel>,
    pub x_label: String,
    pub x_ticks: Ticks,
    pub remarks: Vec<String>,
}

/// Lays out a stack that shares the x axis of the first plot.
pub fn layout(plots: &[Plot], width: f64) -> Layout {
    let narrow = width < 600.0;
    let x_axis = {
        let mut axis = plots.first().map(|p| p.x.clone()).unwrap_or_default();
        axis.include = plots.iter().flat_map(|p| p.x.include.iter().copied()).collect();
        axis
    };
    let solid = plots.iter().flat_map(|p| &p.series).all(|s| matches!(s.kind, Kind::Line | Kind::Band { .. }));
    let equal = plots.iter().any(|p| p.equal_aspect);
    let air = if solid && !equal {
        0.0 // lines may touch the frame
    } else if plots.iter().any(|p| !p.regions.is_empty()) {
        0.015
    } else {
        0.04
    };
    let x = ticks::limits(&x_axis, plots.iter().flat_map(|p| x_values(p, x_axis.log)), air);
    let ys: Vec<Scale> = plots.iter().map(|p| ticks::limits(&p.y, y_values(p, &x, x_axis.limits.is_some()), 0.06)).collect();

    let right = 18.0;
    let mut left = 44.0f64;
    let mut scales = Vec::new();
    // The left margin needs the labels of y, these the limits, and equal aspect makes limits depend on the width: twice is enough.
    for _ in 0..2 {
        let w = width - left - right;
        scales = plots.iter().zip(&ys).map(|(p, y)| frame_height(p, x, *y, w, plots.len() > 1, narrow)).collect::<Vec<_>>();
        let widest = plots
            .iter()
            .zip(&scales)
            .flat_map(|(p, (_, y, h))| y_ticks(y, &p.y.unit, *h).ticks)
            .filter_map(|t| t.label)
            .map(|l| text_width(&l, FONT))
            .fold(20.0, f64::max);
        left = (widest + 12.0).min(width * 0.4);
    }
    let w = width - left - right;
    let x = scales.first().map_or(x, |s| s.0);

    let mut top = 4.0;
    let mut panels = Vec::new();
    let mut remarks = Vec::new();
    for (plot, (_, y, height)) in plots.iter().zip(scales) {
        let looks = looks(&plot.series);
        let title = wrap(&plot.title, TITLE * BOLD, width - left - 6.0);
        let regions = joined(&plot.regions);
        let mut at = top + 18.0 * title.len() as f64;
        let probe = Rect { x: left, y: 0.0, w, h: height };
        let entries = entries(plot, &looks, &regions, &x, probe);
        let (legend, rows) = flow(entries, left, width - 4.0, at + 14.0);
        at += 18.0 * rows as f64;
        at += if plot.y.label.is_empty() && plot.y.unit.is_empty() { 8.0 } else { 22.0 };
        let frame = Rect { x: left, y: at, w, h: height };
        let y_ticks = match step_of(&x_ticks(&x, &x_axis, left, w, width)) {
            // Equal aspect asks for equal steps.
            Some(step) if plot.equal_aspect && !x.log && !y.log => ticks::ticks(&y, &plot.y.unit, (y.hi - y.lo) / step),
            _ => y_ticks(&y, &plot.y.unit, height),
        };
        remarks.extend(left_out(plot, x_axis.log));
        panels.push(Panel {
            width,
            top,
            frame,
            x,
            y,
            y_ticks,
            x_label: x_axis.label.clone(),
            x_unit: x_axis.unit.clone(),
            title,
            legend,
            looks,
            regions,
        });
        top = frame.bottom() + 14.0;
    }
    let x_ticks = x_ticks(&x, &x_axis, left, w, width);
    let named = !(x_axis.label.is_empty() && x_ticks.unit.is_empty());
    let height = top + if named { 28.0 } else { 12.0 };
    Layout { height, panels, x_label: x_axis.label, x_ticks, remarks }
}

/// The scales and the height of a frame `w` px wide.
fn frame_height(plot: &Plot, x: Scale, y: Scale, w: f64, stacked: bool, narrow: bool) -> (Scale, Scale, f64) {
    let asked = plot.height.map(|h| if narrow { h * 0.8 } else { h });
    if plot.equal_aspect && !x.log && !y.log {
        let (span_x, span_y) = (x.hi - x.lo, y.hi - y.lo);
        let h = asked.unwrap_or((w * span_y / span_x).clamp(0.55 * w, w));
        // One unit per px for both axes: the one with too much room gets more data.
        let unit = (span_x / w).max(span_y / h);
        let wider = |s: Scale, length: f64| {
            let more = (unit * length - (s.hi - s.lo)) / 2.0;
            Scale { lo: s.lo - more, hi: s.hi + more, log: false }
        };
        return (wider(x, w), wider(y, h), h);
    }
    let usual = match (stacked, narrow) {
        (false, false) => 300.0,
        (false, true) => 240.0,
        (true, false) => 190.0,
        (true, true) => 160.0,
    };
    (x, y, asked.unwrap_or(usual))
}

/// The x values that the limits must hold.
fn x_values(plot: &Plot, log: bool) -> impl Iterator<Item = f64> {
    let series = plot.series.iter().filter(|s| s.in_limits).flat_map(move |s| {
        let n = s.len().0;
        let own = s.x.iter().take(n).copied();
        let edges: Vec<f64> = match &s.kind {
            Kind::Discs { radius } => reach(&s.x, radius, n, log),
            Kind::Bars if !log => bar_edges(&s.x, n),
            _ => Vec::new(),
        };
        own.chain(edges)
    });
    let regions = plot.regions.iter().flat_map(|r| [r.from, r.to]);
    let markers = plot.markers.iter().filter(|m| m.vertical).map(|m| m.at);
    series.chain(regions).chain(markers).chain(plot.annotations.iter().map(|a| a.x))
}

/// The y values that the limits must hold: of what has a place on the x axis, and where its limits are fixed, lies within them.
fn y_values<'a>(plot: &'a Plot, x: &'a Scale, fixed: bool) -> impl Iterator<Item = f64> + 'a {
    let log = plot.y.log;
    let series = plot.series.iter().filter(|s| s.in_limits).flat_map(move |s| {
        let n = s.len().0;
        let seen = move |i: &usize| s.x.get(*i).is_some_and(|v| if fixed { x.holds(*v) } else { drawable(*v, x.log) });
        let own = (0..n).filter(seen).filter_map(|i| s.y.get(i).copied());
        let more: Vec<f64> = match &s.kind {
            Kind::Band { upper } => (0..n).filter(seen).filter_map(|i| upper.get(i).copied()).collect(),
            Kind::Discs { radius } => reach(&s.y, radius, n, log),
            Kind::Bars if !log => vec![0.0],
            _ => Vec::new(),
        };
        own.chain(more)
    });
    let markers = plot.markers.iter().filter(|m| !m.vertical).map(|m| m.at);
    series.chain(markers).chain(plot.annotations.iter().map(|a| a.y))
}

/// Half the least distance between bars beyond the first and the last one.
fn bar_edges(x: &[f64], n: usize) -> Vec<f64> {
    let mut x: Vec<f64> = x.iter().take(n).copied().filter(|v| drawable(*v, false)).collect();
    x.sort_by(f64::total_cmp);
    let apart =
        x.windows(2).filter_map(|w| if let [a, b] = w { Some(b - a).filter(|d| *d > 0.0) } else { None }).reduce(f64::min).unwrap_or(0.0);
    x.first().into_iter().map(|v| v - apart / 2.0).chain(x.last().into_iter().map(|v| v + apart / 2.0)).collect()
}

/// How far discs reach, but no farther than a quarter of the centres' span beyond each: one very uncertain disc must not shrink the curve
/// to a dot.
fn reach(centres: &[f64], radius: &[f64], n: usize, log: bool) -> Vec<f64> {
    let drawn = || centres.iter().take(n).copied().filter(|c| drawable(*c, log));
    let (lo, hi) = drawn().fold((f64::INFINITY, f64::NEG_INFINITY), |(lo, hi), c| (lo.min(c), hi.max(c)));
    if log || lo > hi {
        return Vec::new();
    }
    let most = if hi > lo { 0.25 * (hi - lo) } else { f64::MAX };
    let pairs = centres.iter().zip(radius).take(n).filter(|(_, r)| r.is_finite() && **r > 0.0);
    pairs.flat_map(|(c, r)| [c - r.min(most), c + r.min(most)]).collect()
}

fn y_ticks(y: &Scale, unit: &str, height: f64) -> Ticks {
    let mut room = (height / 32.0).floor().max(1.0);
    loop {
        let found = ticks::ticks(y, unit, room);
        let at: Vec<f64> = found.ticks.iter().filter(|t| t.label.is_some()).map(|t| y.share(t.at) * height).collect();
        if room <= 1.0 || at.windows(2).all(|w| matches!(w, [a, b] if b - a >= 17.0)) {
            return found;
        }
        room -= 1.0;
    }
}

fn step_of(ticks: &Ticks) -> Option<f64> {
    match ticks.ticks.as_slice() {
        [a, b, ..] => Some(b.at - a.at).filter(|s| *s > 0.0),
        _ => None,
    }
}

/// The middle of a label below the x axis: at its tick, but within the drawing.
pub fn x_label_at(tick: f64, label: &str, width: f64) -> f64 {
    tick.min(width - text_width(label, FONT) / 2.0)
}

/// A tick at each named place, its name cut to the room between neighbours.
fn named_ticks(x: &Scale, names: &[String], w: f64) -> Ticks {
    let room = (w / (x.hi - x.lo) - 6.0).max(12.0);
    let places = (1..).map(f64::from).zip(names).filter(|(at, _)| x.holds(*at));
    Ticks { ticks: places.map(|(at, name)| Tick { at, label: Some(shorten(name, FONT, room)) }).collect(), unit: String::new() }
}

/// As many ticks as their labels leave air between.
fn x_ticks(x: &Scale, axis: &Axis, left: f64, w: f64, width: f64) -> Ticks {
    if !axis.names.is_empty() && !x.log {
        return named_ticks(x, &axis.names, w);
    }
    let mut room = (w / 44.0).floor().clamp(1.0, 14.0);
    loop {
        let found = ticks::ticks(x, &axis.unit, room);
        let spans: Vec<(f64, f64)> = found
            .ticks
            .iter()
            .filter_map(|t| t.label.as_ref().map(|l| (t, l)))
            .map(|(t, l)| {
                let (middle, half) = (x_label_at(left + x.share(t.at) * w, l, width), text_width(l, FONT) / 2.0);
                (middle - half, middle + half)
            })
            .collect();
        if room <= 1.0 || spans.windows(2).all(|w| matches!(w, [a, b] if b.0 - a.1 >= 9.0)) {
            return found;
        }
        room -= 1.0;
    }
}

/// Colours, dashes and marks. Bands and discs take the colour of the series that comes next.
fn looks(series: &[Series]) -> Vec<Look> {
    let (mut colour, mut lines, mut points) = (0, 0, 0);
    let mut out = Vec::new();
    for s in series {
        let class = match s.colour {
            Colour::Auto => format!("c{}", colour % PALETTE),
            Colour::Nth(n) => format!("c{}", n % PALETTE),
            Colour::Tone(tone) => tone.class().to_string(),
            Colour::Ink => "ink".into(),
            Colour::Muted => "muted".into(),
        };
        if matches!(s.kind, Kind::Line | Kind::Points | Kind::Bars) && s.colour == Colour::Auto {
            colour += 1;
        }
        let dash = match s.dash {
            Dash::Auto => DASHES.get(lines % PALETTE).copied().unwrap_or(""),
            Dash::Solid => "",
            Dash::Dashed => "7 3.5",
            Dash::Dotted => "2 2.5",
            Dash::DashDot => "10 3 2 3",
        };
        out.push(Look { class, dash, width: s.width, shape: points });
        match s.kind {
            Kind::Line => lines += 1,
            Kind::Points => points += 1,
            _ => {}
        }
    }
    out
}

/// Neighbours alike in tone and label as one.
fn joined(regions: &[Region]) -> Vec<Region> {
    let mut out: Vec<Region> = Vec::new();
    for r in regions {
        match out.last_mut() {
            Some(last) if last.tone == r.tone && last.label == r.label && (last.to - r.from).abs() <= 1e-9 * r.from.abs() => last.to = r.to,
            _ => out.push(r.clone()),
        }
    }
    out
}

fn entries(plot: &Plot, looks: &[Look], regions: &[Region], x: &Scale, frame: Rect) -> Vec<Entry> {
    let mut out: Vec<Entry> = plot
        .series
        .iter()
        .zip(looks)
        .filter(|(s, _)| !s.name.is_empty())
        .map(|(s, look)| Entry::Series { name: s.name.clone(), look: look.clone(), kind: s.kind.clone() })
        .collect();
    for r in regions.iter().filter(|r| !r.label.is_empty()) {
        let fits = region_span(r, x, frame).is_none_or(|span| region_label_fits(r, span));
        let known = out.iter().any(|e| matches!(e, Entry::Region { name, tone } if *name == r.label && *tone == r.tone));
        if !fits && !known {
            out.push(Entry::Region { name: r.label.clone(), tone: r.tone });
        }
    }
    out
}

/// Whether the label of a region can be written into it.
pub fn region_label_fits(region: &Region, span: Rect) -> bool {
    label_width(&region.label) + 4.0 <= span.w
}

/// Entries in rows from `left` to `right`; names too long for a row are cut.
fn flow(entries: Vec<Entry>, left: f64, right: f64, first: f64) -> (Vec<(f64, f64, Entry)>, usize) {
    let (mut x, mut row) = (left, 0usize);
    let mut out = Vec::new();
    for mut entry in entries {
        match &mut entry {
            Entry::Series { name, .. } | Entry::Region { name, .. } => *name = shorten(name, FONT, right - left - 30.0),
        }
        let width = 30.0 + text_width(entry.name(), FONT) + 14.0;
        if x > left && x + width - 14.0 > right {
            x = left;
            row += 1;
        }
        out.push((x, first + 18.0 * row as f64, entry));
        x += width;
    }
    let rows = if out.is_empty() { 0 } else { row + 1 };
    (out, rows)
}

/// What of the data no axis can show, in sentences.
fn left_out(plot: &Plot, x_log: bool) -> Vec<String> {
    let mut out = Vec::new();
    for s in &plot.series {
        let (n, ragged) = s.len();
        let name = if s.name.is_empty() { "a series" } else { &s.name };
        if ragged {
            out.push(format!("{name}: its vectors differ in length; drawn are the first {n} samples."));
        }
        let not_positive = |v: &f64| v.is_finite() && *v <= 0.0;
        let upper = match &s.kind {
            Kind::Band { upper } => upper.as_slice(),
            _ => &[],
        };
        let count = (0..n)
            .filter(|i| {
                (x_log && s.x.get(*i).is_some_and(not_positive))
                    || (plot.y.log && (s.y.get(*i).is_some_and(not_positive) || upper.get(*i).is_some_and(not_positive)))
            })
            .count();
        if count > 0 {
            out.push(format!("{name}: {count} of {n} values are not positive and left out on the logarithmic axis."));
        }
    }
    out
}
