//! From what to what the axes go.

use crate::plot::{Axis, Kind, Plot};

/// Beyond this magnitude a value counts as not finite: differences and products of such values would overflow.
const HUGE: f64 = 1e150;

/// Whether a value can stand on this axis at all.
pub fn drawable(value: f64, log: bool) -> bool {
    value.abs() < HUGE && (!log || value > 1.0 / HUGE)
}

/// A drawn axis: its limits, and how a value becomes a share of its length.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Scale {
    pub lo: f64,
    pub hi: f64,
    pub log: bool,
}

impl Scale {
    /// Where the value lies: 0 at the lower limit, 1 at the upper one; NaN if it cannot stand on this axis.
    pub fn share(&self, value: f64) -> f64 {
        if !drawable(value, self.log) {
            f64::NAN
        } else if self.log {
            (value / self.lo).ln() / (self.hi / self.lo).ln()
        } else {
            (value - self.lo) / (self.hi - self.lo)
        }
    }

    /// The value at a share of the axis: [`Scale::share`] turned round.
    pub fn value(&self, share: f64) -> f64 {
        if self.log { self.lo * (self.hi / self.lo).powf(share) } else { self.lo + share * (self.hi - self.lo) }
    }

    pub fn holds(&self, value: f64) -> bool {
        drawable(value, self.log) && value >= self.lo && value <= self.hi
    }
}

/// The limits of an axis: the fixed ones if they make an axis, else all values with `air` (a share of the span) at both ends.
pub fn limits(axis: &Axis, values: impl Iterator<Item = f64>, air: f64) -> Scale {
    let log = axis.log;
    if let Some((a, b)) = axis.limits {
        let (lo, hi) = (a.min(b), a.max(b));
        if drawable(lo, log) && drawable(hi, log) && wide_enough(lo, hi) {
            return Scale { lo, hi, log };
        }
    }
    let (mut lo, mut hi) = (f64::INFINITY, f64::NEG_INFINITY);
    for v in values.chain(axis.include.iter().copied()).filter(|v| drawable(*v, log)) {
        lo = lo.min(v);
        hi = hi.max(v);
    }
    if lo > hi {
        return if log { Scale { lo: 0.1, hi: 10.0, log } } else { Scale { lo: 0.0, hi: 1.0, log } };
    }
    if !wide_enough(lo, hi) {
        // One value, or many alike: a window of a tenth, or of a factor of two on a logarithmic axis.
        return if log {
            Scale { lo: lo / 2.0, hi: hi * 2.0, log }
        } else {
            let half = if lo.abs().max(hi.abs()) > 1.0 / HUGE { lo.abs().max(hi.abs()) * 0.1 } else { 1.0 };
            Scale { lo: lo - half, hi: hi + half, log }
        };
    }
    if log {
        let factor = (hi / lo).powf(air);
        Scale { lo: lo / factor, hi: hi * factor, log }
    } else {
        let more = (hi - lo) * air;
        Scale { lo: lo - more, hi: hi + more, log }
    }
}

/// Whether the span is more than the rounding of its ends.
fn wide_enough(lo: f64, hi: f64) -> bool {
    hi - lo > 1e-11 * lo.abs().max(hi.abs())
}

/// The limits of a stack of plots: the x axis that they share, and each one's y.
pub fn of_stack(plots: &[Plot]) -> (Scale, Vec<Scale>) {
    let x_axis = shared_x(plots);
    let solid = plots.iter().flat_map(|p| &p.series).all(|s| matches!(s.kind, Kind::Line | Kind::Band { .. }));
    let air = if solid && !plots.iter().any(|p| p.equal_aspect) {
        0.0 // lines may touch the frame
    } else if plots.iter().any(|p| !p.regions.is_empty()) {
        0.015
    } else {
        0.04
    };
    let x = limits(&x_axis, plots.iter().flat_map(|p| x_values(p, x_axis.log)), air);
    let ys = plots.iter().map(|p| limits(&p.y, y_values(p, &x, x_axis.limits.is_some()), 0.06)).collect();
    (x, ys)
}

/// The x axis of a stack: that of its first plot, holding what any of them asks for.
pub fn shared_x(plots: &[Plot]) -> Axis {
    let mut axis = plots.first().map(|p| p.x.clone()).unwrap_or_default();
    axis.include = plots.iter().flat_map(|p| p.x.include.iter().copied()).collect();
    axis
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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn limits_of_odd_data_still_make_an_axis() {
        let axis = |log| Axis { log, ..Axis::default() };
        for (log, values) in [
            (false, vec![]),
            (true, vec![]),
            (false, vec![f64::NAN, f64::INFINITY]),
            (false, vec![0.0; 3]),
            (false, vec![-7.0; 3]),
            (false, vec![1e-300, 2e-300]),
            (false, vec![f64::MAX, f64::MIN]),
            (true, vec![0.0, -1.0]),
            (true, vec![3.0]),
            (true, vec![1e-300, 1e300]),
            (false, vec![1.0, 1.0 + 1e-15]),
        ] {
            let scale = limits(&axis(log), values.iter().copied(), 0.05);
            assert!(scale.lo < scale.hi && scale.lo.is_finite() && scale.hi.is_finite(), "{values:?}: {scale:?}");
            for v in values.iter().filter(|v| drawable(**v, log)) {
                assert!((0.0..=1.0).contains(&scale.share(*v)), "{v} in {scale:?}");
            }
        }
        let fixed = Axis { limits: Some((f64::NAN, 1.0)), ..Axis::default() };
        assert_eq!(limits(&fixed, [2.0, 4.0].into_iter(), 0.0), Scale { lo: 2.0, hi: 4.0, log: false });
    }

    #[test]
    fn a_share_turned_round_is_its_value() {
        for scale in [Scale { lo: -2.0, hi: 6.0, log: false }, Scale { lo: 0.1, hi: 50.0, log: true }] {
            for value in [0.1, 1.0, 5.9] {
                assert!((scale.value(scale.share(value)) / value - 1.0).abs() < 1e-12, "{value} in {scale:?}");
            }
        }
    }
}
