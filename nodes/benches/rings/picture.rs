//! The picture: panels side by side, both axes logarithmic, the same range of loops per second in all.

use std::fmt::{Result, Write};

pub struct Curve {
    pub name: String,
    /// x, loops per second.
    pub points: Vec<(f64, f64)>,
}

pub struct Panel<'a> {
    pub title: String,
    /// What its horizontal axis is.
    pub below: &'a str,
    /// On the horizontal axis, from left to right.
    pub ticks: &'a [usize],
    pub curves: Vec<Curve>,
}

const COLOURS: [&str; 4] = ["#1f6fb2", "#2a8f4e", "#c77c11", "#b03a2e"];
const WIDTH: f64 = 400.0;
const STRIDE: f64 = 480.0;
const LEFT: f64 = 80.0;
const TOP: f64 = 84.0;
const BOTTOM: f64 = 404.0;

/// The panels as SVG.
pub fn drawn(panels: &[Panel]) -> String {
    let mut svg = String::new();
    // Writing to a string cannot fail.
    let _ = write(&mut svg, panels);
    svg
}

fn write(svg: &mut String, panels: &[Panel]) -> Result {
    let rates = || panels.iter().flat_map(|p| &p.curves).flat_map(|c| &c.points).map(|(_, rate)| *rate);
    let (low, high) = (below(rates().fold(f64::INFINITY, f64::min)), above(rates().fold(0.0, f64::max)));
    let y = |rate: f64| BOTTOM - (BOTTOM - TOP) * (rate / low).log10() / (high / low).log10();
    let width = LEFT + STRIDE * panels.len() as f64 - 40.0;
    writeln!(svg, "<svg xmlns=\"http://www.w3.org/2000/svg\" viewBox=\"0 0 {width} 456\" font-family=\"sans-serif\" font-size=\"13\">")?;
    writeln!(svg, "<rect width=\"{width}\" height=\"456\" fill=\"white\"/>")?;
    for (index, curve) in panels.iter().take(1).flat_map(|p| &p.curves).enumerate() {
        let (at, colour) = (LEFT + 240.0 * index as f64, COLOURS[index % COLOURS.len()]);
        mark(svg, at + 10.0, 20.0, colour)?;
        writeln!(svg, "<path d=\"M{at} 20h20\" stroke=\"{colour}\" stroke-width=\"2\"/>")?;
        writeln!(svg, "<text x=\"{}\" y=\"24\">{}</text>", at + 27.0, curve.name)?;
    }
    for (index, panel) in panels.iter().enumerate() {
        let left = LEFT + STRIDE * index as f64;
        let (first, last) = (panel.ticks.first().copied().unwrap_or(1) as f64, panel.ticks.last().copied().unwrap_or(2) as f64);
        let x = |value: f64| left + 14.0 + (WIDTH - 28.0) * (value / first).log2() / (last / first).log2();
        let middle = left + WIDTH / 2.0;
        writeln!(svg, "<text x=\"{middle}\" y=\"70\" text-anchor=\"middle\" font-weight=\"bold\">{}</text>", panel.title)?;
        writeln!(svg, "<text x=\"{middle}\" y=\"446\" text-anchor=\"middle\">{}</text>", panel.below)?;
        writeln!(svg, "<text x=\"{}\" y=\"70\" text-anchor=\"end\">loops/s</text>", left - 8.0)?;
        for tick in panel.ticks {
            let at = x(*tick as f64);
            writeln!(svg, "<path d=\"M{at:.1} {TOP}V{BOTTOM}\" stroke=\"#ddd\"/>")?;
            writeln!(svg, "<text x=\"{at:.1}\" y=\"424\" text-anchor=\"middle\">{tick}</text>")?;
        }
        for rate in levels(low, high) {
            let at = y(rate);
            writeln!(svg, "<path d=\"M{left} {at:.1}H{}\" stroke=\"#ddd\"/>", left + WIDTH)?;
            writeln!(svg, "<text x=\"{}\" y=\"{:.1}\" text-anchor=\"end\">{}</text>", left - 8.0, at + 4.0, spaced(rate))?;
        }
        for (curve, colour) in panel.curves.iter().zip(COLOURS.iter().cycle()) {
            let line: Vec<String> = curve.points.iter().map(|(at, rate)| format!("{:.1},{:.1}", x(*at), y(*rate))).collect();
            writeln!(svg, "<polyline points=\"{}\" fill=\"none\" stroke=\"{colour}\" stroke-width=\"2\"/>", line.join(" "))?;
            for (at, rate) in &curve.points {
                mark(svg, x(*at), y(*rate), colour)?;
            }
        }
    }
    writeln!(svg, "</svg>")
}

fn mark(svg: &mut String, x: f64, y: f64, colour: &str) -> Result {
    writeln!(svg, "<circle cx=\"{x:.1}\" cy=\"{y:.1}\" r=\"4\" fill=\"{colour}\"/>")
}

/// 1, 2 and 5 times a power of ten.
fn levels(low: f64, high: f64) -> impl Iterator<Item = f64> {
    let decades = low.log10().floor() as i32..=high.log10().ceil() as i32;
    let all = decades.flat_map(|decade| [1.0, 2.0, 5.0].map(|factor| factor * 10f64.powi(decade)));
    all.filter(move |level| *level >= low * 0.999 && *level <= high * 1.001)
}

/// The level at or below a rate.
fn below(rate: f64) -> f64 {
    levels(rate / 10.0, rate).last().unwrap_or(rate)
}

/// The level at or above a rate.
fn above(rate: f64) -> f64 {
    levels(rate, rate * 10.0).next().unwrap_or(rate)
}

/// With a gap before each three digits.
fn spaced(number: f64) -> String {
    let digits = format!("{number:.0}");
    let gap = |i: usize| if i > 0 && (digits.len() - i).is_multiple_of(3) { "\u{202f}" } else { "" };
    digits.chars().enumerate().map(|(i, digit)| format!("{}{digit}", gap(i))).collect()
}
