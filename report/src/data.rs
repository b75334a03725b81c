//! What the script in the page is given of a figure: each stack of plots as JSON, in the units that its axes show.
//!
//! Numbers are rounded to less than a ten-thousandth of their axis and long series are thinned for the widest drawing. A page stays small, and its
//! values are right to more digits than can be seen.

use crate::limits::{self, Scale, drawable};
use crate::number::{axis_scale, number, power_of_ten};
use crate::plot::{Axis, Colour, Dash, Kind, Plot, Region, Series};
use crate::style::PALETTE;
use crate::thin::{self, Rect};
use serde::Serialize;
use serde::ser::{SerializeSeq, Serializer};

/// How wide a drawing its data are thinned for, px: of one in its row, and of one beside others. A page is at most 1000 px wide; the
/// rest is for zooming in.
const WIDTH: f64 = 1200.0;
const BESIDE: f64 = 700.0;

/// Height of the axes, px: of a plot alone and of one in a stack.
const HEIGHT: f64 = 300.0;
const STACKED: f64 = 190.0;

/// Dashes by their number, SVG's notation.
const DASHES: [&str; PALETTE] = ["", "7 3.5", "2 2.5", "10 3 2 3", "14 4", "10 3 2 3 2 3", "4 2"];

/// Plots over one x axis.
#[derive(Serialize)]
pub struct StackData {
    x: AxisData,
    /// Height of the axes as a share of their width, where one unit of x is as long as one of y.
    aspect: Option<f64>,
    panels: Vec<PanelData>,
}

#[derive(Serialize)]
struct AxisData {
    label: String,
    unit: String,
    log: bool,
    lo: f64,
    hi: f64,
    #[serde(skip_serializing_if = "Vec::is_empty")]
    names: Vec<String>,
}

#[derive(Serialize)]
struct PanelData {
    title: String,
    height: f64,
    y: AxisData,
    series: Vec<SeriesData>,
    regions: Vec<RegionData>,
    markers: Vec<MarkerData>,
    points: Vec<PointData>,
}

#[derive(Serialize)]
struct SeriesData {
    name: String,
    kind: &'static str,
    colour: String,
    #[serde(skip_serializing_if = "str::is_empty")]
    dash: &'static str,
    width: f64,
    /// Which mark, of points.
    #[serde(skip_serializing_if = "Option::is_none")]
    shape: Option<usize>,
    /// Whether x never turns back, so that a place on the x axis has one value.
    forward: bool,
    #[serde(serialize_with = "short")]
    x: Vec<f64>,
    #[serde(serialize_with = "short")]
    y: Vec<f64>,
    /// The other boundary of a band, the radii of discs.
    #[serde(skip_serializing_if = "Option::is_none", serialize_with = "short_if_any")]
    z: Option<Vec<f64>>,
    #[serde(skip_serializing_if = "Option::is_none")]
    by: Option<ByData>,
}

/// What colours a line along its way.
#[derive(Serialize)]
struct ByData {
    label: String,
    unit: String,
    values: Vec<f64>,
}

/// Whole numbers without their point: half of a page is numbers.
fn short<S: Serializer>(values: &[f64], to: S) -> Result<S::Ok, S::Error> {
    let mut list = to.serialize_seq(Some(values.len()))?;
    for v in values {
        if v.fract() == 0.0 && v.abs() < 1e15 {
            list.serialize_element(&(*v as i64))?;
        } else {
            list.serialize_element(v)?;
        }
    }
    list.end()
}

fn short_if_any<S: Serializer>(values: &Option<Vec<f64>>, to: S) -> Result<S::Ok, S::Error> {
    short(values.as_deref().unwrap_or_default(), to)
}

#[derive(Serialize)]
struct RegionData {
    from: f64,
    to: f64,
    tone: &'static str,
    label: String,
}

#[derive(Serialize)]
struct MarkerData {
    vertical: bool,
    at: f64,
    label: String,
    tone: &'static str,
}

#[derive(Serialize)]
struct PointData {
    x: f64,
    y: f64,
    label: String,
    tone: &'static str,
}

/// An axis with the unit that it shows: values are divided by `factor` and rounded as its length asks.
struct Shown {
    scale: Scale,
    factor: f64,
    unit: String,
    decimals: usize,
}

impl Shown {
    fn new(scale: Scale, unit: &str) -> Self {
        let decades = if scale.log { (scale.hi / scale.lo).log10() } else { 0.0 };
        // A prefix does not serve over many decades.
        let (power, prefix) = if decades > 4.0 { (0, None) } else { axis_scale(scale.lo.abs().max(scale.hi.abs()), unit) };
        // Beyond all prefixes numbers stay as they are: the power itself could not be written.
        let (power, prefix) = if power.abs() > 100 { (0, None) } else { (power, prefix) };
        let factor = 10f64.powi(power);
        let unit = match prefix {
            Some(prefix) => format!("{prefix}{unit}"),
            None if power == 0 => unit.to_string(),
            None => format!("×{} {unit}", power_of_ten(power)).trim_end().to_string(),
        };
        let decimals = (4.3 - ((scale.hi - scale.lo) / factor).log10()).ceil().clamp(0.0, 17.0) as usize;
        Self { scale, factor, unit, decimals }
    }

    /// The value that is written; NaN (which JSON writes as null) for what cannot stand on this axis.
    fn round(&self, value: f64) -> f64 {
        let shown = value / self.factor;
        if !drawable(value, self.scale.log) {
            f64::NAN
        } else if self.scale.log {
            format!("{shown:.5e}").parse().unwrap_or(shown)
        } else {
            format!("{shown:.*}", self.decimals).parse::<f64>().unwrap_or(shown) + 0.0 // no −0
        }
    }

    fn data(&self, axis: &Axis) -> AxisData {
        let names = if self.scale.log { Vec::new() } else { axis.names.clone() };
        let (lo, hi) = (self.scale.lo / self.factor, self.scale.hi / self.factor);
        AxisData { label: axis.label.clone(), unit: self.unit.clone(), log: self.scale.log, lo, hi, names }
    }
}

/// Both axes of a panel and its drawing, for thinning.
struct Frame<'a> {
    x: &'a Shown,
    y: &'a Shown,
    window: Rect,
}

impl Frame<'_> {
    fn at(&self, x: f64, y: f64) -> (f64, f64) {
        (self.x.scale.share(x) * self.window.w, self.y.scale.share(y) * self.window.h)
    }

    fn at_y(&self, y: f64) -> f64 {
        self.y.scale.share(y) * self.window.h
    }

    fn value_x(&self, px: f64) -> f64 {
        self.x.round(self.x.scale.value(px / self.window.w))
    }

    fn value_y(&self, px: f64) -> f64 {
        self.y.round(self.y.scale.value(px / self.window.h))
    }
}

/// Plots of one stack, and what of them cannot be shown, in sentences.
pub fn stack(plots: &[Plot], beside: bool) -> (StackData, Vec<String>) {
    let (mut x_scale, mut y_scales) = limits::of_stack(plots);
    let x_axis = limits::shared_x(plots);
    let mut aspect = None;
    if let ([plot], [y]) = (plots, y_scales.as_mut_slice())
        && plot.equal_aspect
        && !x_scale.log
        && !y.log
    {
        aspect = Some(equal(&mut x_scale, y));
    }
    let x = Shown::new(x_scale, &x_axis.unit);
    let mut remarks = Vec::new();
    let mut panels = Vec::new();
    for (plot, y_scale) in plots.iter().zip(y_scales) {
        remarks.extend(left_out(plot, x_scale.log));
        let mut y = Shown::new(y_scale, &plot.y.unit);
        if aspect.is_some() {
            // One prefix for both, or equal lengths would bear unlike numbers.
            y = Shown { scale: y_scale, factor: x.factor, unit: plot.y.unit.clone(), decimals: x.decimals };
            if plot.y.unit == x_axis.unit {
                y.unit.clone_from(&x.unit);
            }
        }
        let height = plot.height.unwrap_or(if plots.len() > 1 { STACKED } else { HEIGHT });
        let window = Rect { x: 0.0, y: 0.0, w: if beside { BESIDE } else { WIDTH }, h: height.max(200.0) };
        panels.push(panel(plot, &x, &y, height, window, &mut remarks));
    }
    (StackData { x: x.data(&x_axis), aspect, panels }, remarks)
}

/// Widens one of two axes until a unit is as long on both; gives the height of the drawing as a share of its width.
fn equal(x: &mut Scale, y: &mut Scale) -> f64 {
    let (span_x, span_y) = (x.hi - x.lo, y.hi - y.lo);
    let aspect = (span_y / span_x).clamp(0.55, 1.0);
    let unit = span_x.max(span_y / aspect);
    for (scale, length) in [(x, 1.0), (y, aspect)] {
        let more = (unit * length - (scale.hi - scale.lo)) / 2.0;
        *scale = Scale { lo: scale.lo - more, hi: scale.hi + more, log: false };
    }
    aspect
}

fn panel(plot: &Plot, x: &Shown, y: &Shown, height: f64, window: Rect, remarks: &mut Vec<String>) -> PanelData {
    let frame = Frame { x, y, window };
    let looks = looks(&plot.series);
    let series = plot.series.iter().zip(looks).map(|(s, look)| series(s, look, &frame)).collect();
    let regions = joined(&plot.regions).into_iter().filter_map(|r| {
        // Infinite ends are the ends of the axis; what has no place on it is not drawn.
        let at = |v: f64| if v.is_nan() { f64::NAN } else { v.clamp(x.scale.lo, x.scale.hi) };
        let (from, to) = (x.round(at(r.from.min(r.to))), x.round(at(r.from.max(r.to))));
        (to > from).then(|| RegionData { from, to, tone: r.tone.class(), label: r.label })
    });
    let regions = regions.collect();
    let mut markers = Vec::new();
    for m in &plot.markers {
        let (axis, name) = if m.vertical { (x, &plot.x.label) } else { (y, &plot.y.label) };
        if axis.scale.holds(m.at) {
            markers.push(MarkerData { vertical: m.vertical, at: axis.round(m.at), label: m.label.clone(), tone: m.tone.class() });
        } else if !m.label.is_empty() {
            remarks.push(format!("{}: at {} {}, beyond the axis.", m.label, name, number(m.at)).replace("  ", " "));
        }
    }
    let mut points = Vec::new();
    for p in &plot.annotations {
        if x.scale.holds(p.x) && y.scale.holds(p.y) {
            points.push(PointData { x: x.round(p.x), y: y.round(p.y), label: p.label.clone(), tone: p.tone.class() });
        } else if p.x.is_finite() && p.y.is_finite() {
            remarks.push(format!("{}: at ({}, {}), beyond the axes.", p.label, number(p.x), number(p.y)));
        }
    }
    PanelData { title: plot.title.clone(), height, y: y.data(&plot.y), series, regions, markers, points }
}

/// How a series looks: its colour's class, its dash, its mark.
struct Look {
    colour: String,
    dash: &'static str,
    shape: usize,
}

/// Colours, dashes and marks. Bands and discs take the colour of the series that comes next. A colour by number has the dash and the mark of that
/// number, so that a thing looks alike in every plot of a stack.
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
        let nth = |count: usize| if let Colour::Nth(n) = s.colour { n } else { count };
        let dash = match s.dash {
            Dash::Auto => DASHES.get(nth(lines) % PALETTE).copied().unwrap_or(""),
            Dash::Solid => "",
            Dash::Dashed => "7 3.5",
            Dash::Dotted => "2 2.5",
            Dash::DashDot => "10 3 2 3",
        };
        out.push(Look { colour: class, dash, shape: nth(points) });
        match s.kind {
            Kind::Line => lines += 1,
            Kind::Points => points += 1,
            _ => {}
        }
    }
    out
}

fn series(s: &Series, look: Look, frame: &Frame) -> SeriesData {
    let n = s.len().0;
    let (x, y) = (frame.x, frame.y);
    let values = || s.x.iter().copied().zip(s.y.iter().copied()).take(n);
    let pixels = || values().map(|(x, y)| frame.at(x, y));
    let round_x = || values().map(|p| x.round(p.0)).collect::<Vec<f64>>();
    let round_y = || values().map(|p| y.round(p.1)).collect::<Vec<f64>>();
    let back = |p: &(f64, f64)| (frame.value_x(p.0), frame.value_y(p.1));
    let mut dense = false;
    let (kind, (px, py), z) = match &s.kind {
        // What is coloured along its way keeps each point with its value.
        Kind::Line if s.by.is_some() => ("line", (round_x(), round_y()), None),
        Kind::Line => {
            let thinned = thin::line(pixels(), frame.window);
            dense = thinned.dense;
            let mut points = Vec::new();
            for (i, stroke) in thinned.strokes.iter().enumerate() {
                if i > 0 {
                    points.push((f64::NAN, f64::NAN)); // the gap between two strokes
                }
                points.extend(stroke.iter().map(back));
            }
            ("line", points.into_iter().unzip(), None)
        }
        Kind::Points => {
            let kept = thin::points(pixels().filter(|p| p.0.is_finite() && p.1.is_finite()), frame.window);
            ("points", kept.iter().map(back).unzip(), None)
        }
        Kind::Band { upper } => {
            let three = pixels().zip(upper).map(|(p, u)| (p.0, p.1, frame.at_y(*u)));
            let (mut points, mut other) = (Vec::new(), Vec::new());
            for (i, stretch) in thin::band(three).iter().enumerate() {
                if i > 0 {
                    points.push((f64::NAN, f64::NAN));
                    other.push(f64::NAN);
                }
                points.extend(stretch.iter().map(|p| (frame.value_x(p.0), frame.value_y(p.1))));
                other.extend(stretch.iter().map(|p| frame.value_y(p.2)));
            }
            ("band", points.into_iter().unzip(), Some(other))
        }
        Kind::Discs { radius } => {
            let size = |r: &f64| if *r > 0.0 { x.round(*r) } else { f64::NAN };
            ("discs", (round_x(), round_y()), Some(radius.iter().take(n).map(size).collect()))
        }
        Kind::Bars => ("bars", (round_x(), round_y()), None),
    };
    let px: Vec<f64> = px;
    let mut before = f64::NEG_INFINITY;
    let forward = px.iter().filter(|v| v.is_finite()).all(|v| std::mem::replace(&mut before, *v) <= *v);
    SeriesData {
        name: s.name.clone(),
        kind,
        colour: look.colour,
        // To and fro on few pixels dashes only blur.
        dash: if dense { "" } else { look.dash },
        width: if dense { s.width.min(1.2) } else { s.width },
        shape: (kind == "points").then_some(look.shape),
        forward,
        x: px,
        y: py,
        z,
        by: s.by.as_ref().map(|by| ByData {
            label: by.label.clone(),
            unit: by.unit.clone(),
            values: by.values.iter().take(n).map(|v| format!("{v:.3e}").parse().unwrap_or(f64::NAN)).collect(),
        }),
    }
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
