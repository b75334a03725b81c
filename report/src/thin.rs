//! Long series made short for drawing, without losing what the eye would see.

use std::collections::HashSet;

/// The part of the plane that is drawn, px; y grows upward or downward, it does not matter here.
#[derive(Clone, Copy, Debug)]
pub struct Rect {
    pub x: f64,
    pub y: f64,
    pub w: f64,
    pub h: f64,
}

impl Rect {
    pub fn right(&self) -> f64 {
        self.x + self.w
    }
    pub fn bottom(&self) -> f64 {
        self.y + self.h
    }
}

/// Points in pixels cut into strokes at what is not finite.
fn strokes(points: impl Iterator<Item = (f64, f64)>) -> Vec<Vec<(f64, f64)>> {
    let mut out = vec![Vec::new()];
    for p in points {
        if p.0.is_finite() && p.1.is_finite() {
            if let Some(last) = out.last_mut() {
                last.push(p);
            }
        } else if out.last().is_some_and(|s| !s.is_empty()) {
            out.push(Vec::new());
        }
    }
    out.retain(|s| !s.is_empty());
    out
}

/// What is drawn of a line: its strokes, and whether they go to and fro so much that dashes would only blur.
pub struct Thinned {
    pub strokes: Vec<Vec<(f64, f64)>>,
    pub dense: bool,
}

/// A line in pixels for `window`. Where x never turns back, each pixel column keeps its first, lowest, highest and last point. In other places,
/// points closer than a third of a pixel to the one before are dropped, and what has been drawn already is not drawn again.
pub fn line(points: impl Iterator<Item = (f64, f64)>, window: Rect) -> Thinned {
    let mut out: Vec<Vec<(f64, f64)>> = Vec::new();
    for stroke in strokes(points) {
        let forward = stroke.windows(2).all(|w| matches!(w, [a, b] if b.0 >= a.0));
        let shorter = if forward {
            vec![columns(&stroke)]
        } else {
            let shorter = distinct(&stroke);
            if shorter.len() > 6000 { new_segments(&shorter) } else { vec![shorter] }
        };
        for part in shorter {
            out.extend(cut(&part, window).iter().map(|part| straightened(part)));
        }
    }
    let length: f64 = out.iter().flat_map(|s| s.windows(2)).map(|w| if let [a, b] = w { (b.0 - a.0).hypot(b.1 - a.1) } else { 0.0 }).sum();
    Thinned { strokes: out, dense: length > 4.0 * (window.w + window.h) }
}

/// How far a point may lie off the straight line between its neighbours and still be left out, px.
const STRAIGHT: f64 = 0.06;

/// Without the points that the eye cannot distinguish from the straight line between those kept (Ramer, Douglas and Peucker).
fn straightened(stroke: &[(f64, f64)]) -> Vec<(f64, f64)> {
    let ends = [0, stroke.len().saturating_sub(1)];
    let mut keep: Vec<bool> = (0..stroke.len()).map(|i| ends.contains(&i)).collect();
    let mut open = vec![(0, stroke.len().saturating_sub(1))];
    while let Some((from, to)) = open.pop() {
        let (Some(a), Some(b)) = (stroke.get(from), stroke.get(to)) else { continue };
        let (dx, dy) = (b.0 - a.0, b.1 - a.1);
        let length = dx.hypot(dy);
        let off = |p: &(f64, f64)| {
            let (x, y) = (p.0 - a.0, p.1 - a.1);
            // Beyond an end it is the distance from the end: a curve may turn back on its own line.
            let along = if length > 0.0 { (x * dx + y * dy) / length } else { 0.0 };
            if along < 0.0 || along > length || length == 0.0 {
                x.hypot(y).min((p.0 - b.0).hypot(p.1 - b.1))
            } else {
                (x * dy - y * dx).abs() / length
            }
        };
        let between = (from + 1..to).filter_map(|i| stroke.get(i).map(|p| (i, off(p))));
        if let Some((i, _)) = between.max_by(|p, q| p.1.total_cmp(&q.1)).filter(|p| p.1 > STRAIGHT) {
            if let Some(k) = keep.get_mut(i) {
                *k = true;
            }
            open.push((from, i));
            open.push((i, to));
        }
    }
    stroke.iter().zip(keep).filter_map(|(p, keep)| keep.then_some(*p)).collect()
}

/// First, lowest, highest and last point of each pixel column, in their order.
fn columns(stroke: &[(f64, f64)]) -> Vec<(f64, f64)> {
    let mut out: Vec<(f64, f64)> = Vec::with_capacity(stroke.len().min(4096));
    let same = |a: &(f64, f64), b: &(f64, f64)| a.0.floor() == b.0.floor();
    for column in stroke.chunk_by(same) {
        if column.len() <= 4 {
            out.extend_from_slice(column);
            continue;
        }
        let (mut lowest, mut highest) = (0, 0);
        for (i, p) in column.iter().enumerate() {
            if column.get(lowest).is_some_and(|l| p.1 < l.1) {
                lowest = i;
            }
            if column.get(highest).is_some_and(|h| p.1 > h.1) {
                highest = i;
            }
        }
        let mut kept = [0, lowest, highest, column.len() - 1];
        kept.sort_unstable();
        let mut before = None;
        for i in kept {
            if before != Some(i) {
                out.extend(column.get(i));
            }
            before = Some(i);
        }
    }
    out
}

/// Without the points that lie within a third of a pixel of the last kept one; the last point stays.
fn distinct(stroke: &[(f64, f64)]) -> Vec<(f64, f64)> {
    let mut out: Vec<(f64, f64)> = Vec::new();
    for (i, p) in stroke.iter().enumerate() {
        let near = out.last().is_some_and(|l| (l.0 - p.0).hypot(l.1 - p.1) < 0.35);
        if !near || i + 1 == stroke.len() {
            out.push(*p);
        }
    }
    out
}

/// The remaining strokes when points are rounded to half pixels and a segment that was drawn before is not drawn again. A trace that winds round many
/// times costs no more than the area it covers.
fn new_segments(stroke: &[(f64, f64)]) -> Vec<Vec<(f64, f64)>> {
    let round = |p: &(f64, f64)| ((2.0 * p.0).round() as i64, (2.0 * p.1).round() as i64);
    let at = |c: (i64, i64)| (c.0 as f64 / 2.0, c.1 as f64 / 2.0);
    let mut drawn = HashSet::new();
    let mut out: Vec<Vec<(f64, f64)>> = Vec::new();
    let mut joined = false;
    for w in stroke.windows(2) {
        let [a, b] = w else { continue };
        let (from, to) = (round(a), round(b));
        if from == to {
            continue;
        }
        if !drawn.insert((from.min(to), from.max(to))) {
            joined = false;
            continue;
        }
        match out.last_mut() {
            Some(last) if joined => last.push(at(to)),
            _ => out.push(vec![at(from), at(to)]),
        }
        joined = true;
    }
    out
}

/// The parts of a stroke within the window and half of it again on each side (the drawing clips the rest): renderers do badly with
/// coordinates of millions of pixels. Cut on the segment, so that slopes stay true.
fn cut(stroke: &[(f64, f64)], window: Rect) -> Vec<Vec<(f64, f64)>> {
    let (mx, my) = (window.w / 2.0, window.h / 2.0);
    let (x0, x1, y0, y1) = (window.x - mx, window.right() + mx, window.y - my, window.bottom() + my);
    let inside = |p: &(f64, f64)| p.0 >= x0 && p.0 <= x1 && p.1 >= y0 && p.1 <= y1;
    if stroke.iter().all(inside) {
        return vec![stroke.to_vec()];
    }
    let mut out: Vec<Vec<(f64, f64)>> = Vec::new();
    let mut joined = false;
    for w in stroke.windows(2) {
        let [a, b] = w else { continue };
        // Liang and Barsky: the share of the segment within each pair of parallels.
        let (dx, dy) = (b.0 - a.0, b.1 - a.1);
        let (mut enter, mut leave) = (0.0f64, 1.0f64);
        for (run, room) in [(-dx, a.0 - x0), (dx, x1 - a.0), (-dy, a.1 - y0), (dy, y1 - a.1)] {
            if run == 0.0 {
                if room < 0.0 {
                    leave = -1.0;
                }
            } else if run < 0.0 {
                enter = enter.max(room / run);
            } else {
                leave = leave.min(room / run);
            }
        }
        if enter > leave {
            joined = false;
            continue;
        }
        let at = |t: f64| (a.0 + t * dx, a.1 + t * dy);
        match out.last_mut() {
            Some(last) if joined && enter == 0.0 => last.push(at(leave)),
            _ => out.push(vec![at(enter), at(leave)]),
        }
        joined = leave == 1.0;
    }
    out
}

/// A band in pixels as (x, one boundary, the other), x never turning back: per pixel column its outermost points, one stretch between gaps.
pub fn band(points: impl Iterator<Item = (f64, f64, f64)>) -> Vec<Vec<(f64, f64, f64)>> {
    let mut stretches: Vec<Vec<(f64, f64, f64)>> = vec![Vec::new()];
    for (x, a, b) in points {
        if x.is_finite() && a.is_finite() && b.is_finite() {
            if let Some(last) = stretches.last_mut() {
                let begun = last.len() > 1;
                match last.last_mut() {
                    Some(p) if begun && p.0.floor() == x.floor() => *p = (p.0, p.1.min(a.min(b)), p.2.max(a.max(b))),
                    _ => last.push((x, a.min(b), a.max(b))),
                }
            }
        } else {
            stretches.push(Vec::new());
        }
    }
    stretches.retain(|s| !s.is_empty());
    for p in stretches.iter_mut().flatten() {
        *p = (p.0, p.1.clamp(-1e5, 1e5), p.2.clamp(-1e5, 1e5));
    }
    stretches
}

/// Marks in pixels within the window, one per half pixel.
pub fn points(points: impl Iterator<Item = (f64, f64)>, window: Rect) -> Vec<(f64, f64)> {
    let mut seen = HashSet::new();
    points
        .filter(|p| p.0 >= window.x - 1.0 && p.0 <= window.right() + 1.0 && p.1 >= window.y - 1.0 && p.1 <= window.bottom() + 1.0)
        .filter(|p| seen.insert(((p.0 * 2.0).round() as i64, (p.1 * 2.0).round() as i64)))
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    const WINDOW: Rect = Rect { x: 0.0, y: 0.0, w: 800.0, h: 300.0 };

    #[test]
    fn a_long_trace_becomes_short_and_keeps_each_spike() {
        let n = 100_000;
        let y = |k: usize| match k {
            31_417 => 20.0,
            77_777 => 290.0,
            _ => 150.0 + 10.0 * (k as f64 * 0.37).sin(),
        };
        let thinned = line((0..n).map(|k| (k as f64 * 800.0 / n as f64, y(k))), WINDOW);
        let all: Vec<_> = thinned.strokes.concat();
        assert!(thinned.dense && thinned.strokes.len() == 1 && all.len() <= 4 * 800, "{}", all.len());
        assert!(all.contains(&(31_417.0 * 0.008, 20.0)) && all.contains(&(77_777.0 * 0.008, 290.0)));
        assert!(all.windows(2).all(|w| w[1].0 >= w[0].0), "the order in x is kept");
    }

    #[test]
    fn gaps_stay_gaps() {
        let y = [1.0, 2.0, f64::NAN, 3.0, f64::INFINITY, f64::NAN, 4.0];
        let thinned = line(y.iter().enumerate().map(|(k, y)| (k as f64, *y)), WINDOW);
        assert_eq!(thinned.strokes, vec![vec![(0.0, 1.0), (1.0, 2.0)], vec![(3.0, 3.0)], vec![(6.0, 4.0)]]);
    }

    #[test]
    fn a_line_that_leaves_the_window_leaves_it_with_its_slope() {
        // From the middle far up and to the right: cut half a window above the top, on the line itself.
        let thinned = line([(400.0, 150.0), (400.0 + 1e9, 150.0 - 1e9)].into_iter(), WINDOW);
        let end = thinned.strokes[0][1];
        assert!((end.1 + 150.0).abs() < 1e-3 && (end.0 - 700.0).abs() < 1e-3, "{end:?}");
        // One that passes the window by is not drawn; one through it with both ends outside is.
        assert!(line([(-5000.0, -900.0), (5000.0, -800.0)].into_iter(), WINDOW).strokes.is_empty());
        assert_eq!(line([(-5000.0, 100.0), (5000.0, 100.0)].into_iter(), WINDOW).strokes, [[(-400.0, 100.0), (1200.0, 100.0)]]);
    }

    #[test]
    fn a_loop_run_through_a_thousand_times_is_drawn_once() {
        let turn = |k: usize| (400.0 + 100.0 * (k as f64 * 0.01).cos(), 150.0 + 100.0 * (k as f64 * 0.01).sin());
        let thinned = line((0..600_000).map(turn), WINDOW);
        let count: usize = thinned.strokes.iter().map(Vec::len).sum();
        assert!(count < 20_000, "{count}");
        let reach = thinned.strokes.concat().iter().fold(0.0f64, |r, p| r.max((p.0 - 400.0).hypot(p.1 - 150.0)));
        assert!((reach - 100.0).abs() < 1.0, "{reach}");
    }
}
