//! Signals over time: recorded, and run again.

use backdrive_report::{Colour, Dash, Figure, Page, Plot, Series, Tone};
use backdrive_stability::session::{AxisSignals, Session};
use backdrive_stability::verdict::Answer;

/// How much of the first contact is drawn by itself, s.
const IMPACT_S: f64 = 0.3;

/// Position and force of each axis: run again at the gain asked, else as recorded.
pub(super) fn response(page: &mut Page, found: &Answer, session: &Session) {
    let (signals, what) = match &found.resimulated {
        Some(again) => (&again.signals, format!("Re-simulation with {}: {}.", again.script, again.outcome)),
        None => {
            let why = found.no_resimulation.as_deref().unwrap_or("it was not requested");
            page.note(&format!("The loop was not re-simulated ({why}): the recording is shown, at its own gain."));
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
            position = position.horizontal(limit, "end of travel", Tone::Limited);
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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn clamps_close_together_are_one_span() {
        let mut flags = vec![false; 3000];
        for k in [10, 11, 13, 2000] {
            flags[k] = true;
        }
        assert_eq!(spans(&flags), [(10, 14), (2000, 2001)]);
    }
}
