//! The force that revealed the effect, the law over it, and the places that compete.

use super::phrases::adds;
use crate::parts::{file_name, sentence};
use backdrive_diagnosis::belief::evidence::{Curve, Evidence, Trace, evidence};
use backdrive_diagnosis::diagnose::Diagnosis;
use backdrive_diagnosis::hypothesis::{Against, Place};
use backdrive_diagnosis::locate::{Candidate as Located, Location, Variable};
use backdrive_diagnosis::output_error::candidate::Candidate;
use backdrive_diagnosis::verdict::words;
use backdrive_plant::describe::unit_for;
use backdrive_report::{Cell, Colour, Dash, Figure, Page, Plot, Series, Table, Tone, number, percent, si};

/// Points in a cloud, at most.
const POINTS: usize = 1500;
/// Share of a record that a loop is drawn from.
const LOOP: usize = 8;
/// Places in the ranking that are shown at once.
const PLACES: usize = 8;

pub(super) fn section(page: &mut Page, found: &Diagnosis, best: &Candidate) {
    let mut drawn = false;
    if adds(best) {
        for which in 0..best.structure.added.len() {
            match evidence(&found.problem, best, &found.search.noise_sd, which) {
                Some(evidence) => {
                    finding(page, &evidence, &in_words(best, which));
                    drawn = true;
                }
                None => {
                    page.text(&format!("The force of {} cannot be estimated from these sensors.", in_words(best, which)));
                }
            }
        }
    }
    let Some(location) = &found.location else {
        page.text("No force can be located with this model and these recordings.");
        return;
    };
    if !drawn && let Some(first) = location.ranking.first() {
        map(page, found, first);
    }
    page.details("The force at every place", |inside| places(inside, found, location));
}

/// A finding's effect and place in words, as a title.
pub(super) fn in_words(best: &Candidate, which: usize) -> String {
    let Some(own) = best.structure.added.get(which) else { return String::new() };
    sentence(&words::named(own.physics.name, &own.place)).trim_end_matches('.').to_string()
}

/// How a place reads.
fn shown(place: &Place) -> String {
    match place {
        Place::Between(a, b) if b == "ground" => format!("{a} to ground"),
        Place::Between(a, b) => format!("{a} to {b}"),
        Place::Signal(name) => format!("signal {name}"),
    }
}

fn variable_name(against: Against) -> &'static str {
    match against {
        Against::Velocity => "velocity",
        Against::Displacement => "displacement",
        Against::Acceleration => "acceleration",
        Against::Signal => "signal",
        Against::SignalRate => "rate of change of the signal",
        Against::Time => "time",
    }
}

/// What the recordings ask for at a finding's place, with the law over it.
fn finding(page: &mut Page, evidence: &Evidence, name: &str) {
    let place = shown(&evidence.place);
    let what = if matches!(evidence.place, Place::Between(..)) { "force" } else { "error of the signal" };
    // The record in which the law does most shows it best.
    let size = |t: &Trace| backdrive_signal::statistics::rms(&t.law.force);
    let Some(main) = evidence.traces.iter().max_by(|a, b| size(a).total_cmp(&size(b))) else { return };

    let over = variable_name(evidence.against);
    let mut map = Plot::new(&format!("{name}: {what} against {over}")).x_axis(over, &evidence.variable_unit);
    map = map.y_axis(what, &evidence.force_unit);
    let (x, y) = cloud(&evidence.traces);
    map = map.series(Series::points("required by the recordings", &x, &y).colour(Colour::Muted).width(1.3));
    map = map.series(law(evidence, main));
    let mut figures: Vec<Figure> = vec![map.into()];
    let loose = loose(main, &evidence.force_unit);
    // A law of velocity over displacement is a fence of jumps without information: loops are drawn of what depends on the path.
    if loose.is_none()
        && !main.latent.displacement.is_empty()
        && !matches!(evidence.against, Against::Velocity | Against::Acceleration | Against::Time)
    {
        let part = fullest(&main.latent);
        let mut turn = Plot::new(&format!("{name}: {what} against displacement, loops"));
        turn = turn.x_axis("displacement", &evidence.displacement_unit).y_axis(what, &evidence.force_unit);
        let cut = |x: &[f64]| x.get(part.clone()).unwrap_or(&[]).to_vec();
        let (x, y) = (cut(&main.latent.displacement), cut(&main.latent.force));
        turn = turn.series(Series::line("required by the recordings", &x, &y).colour(Colour::Muted).dash(Dash::Solid));
        let (x, y) = (cut(&main.law.displacement), cut(&main.law.force));
        figures.push(turn.series(Series::line("the law found", &x, &y).colour(Colour::Nth(1)).dash(Dash::Solid).outside_limits()).into());
    }
    let replaced = match evidence.replaces.is_empty() {
        true => String::new(),
        false => format!(" The force of {}, which it replaces, is in both.", evidence.replaces.join(" and ")),
    };
    page.figure(
        Figure::beside(figures),
        &format!(
            "At {place}: grey is the force required by the recordings without this law, orange the force of the law.{replaced}{}",
            loose.as_deref().unwrap_or_default()
        ),
    );
    // Where the law does most; one that only bends is shown where the recordings ask for most.
    let part = if main.law.force.windows(2).any(|w| w[0] != w[1]) { fullest(&main.law) } else { fullest(&main.latent) };
    let cut = |x: &[f64]| x.get(part.clone()).unwrap_or(&[]).to_vec();
    let (time, force, deviation) = (cut(&main.latent.time), cut(&main.latent.force), cut(&main.deviation));
    let edge = |sign: f64| force.iter().zip(&deviation).map(|(f, d)| f + sign * 2.0 * d).collect::<Vec<f64>>();
    let mut course = Plot::new("").x_axis("time", "s").y_axis(what, &evidence.force_unit).height(220.0);
    let band = Series::band("its 95 % interval", &time, &edge(-1.0), &edge(1.0)).colour(Colour::Muted);
    course = course.series(if loose.is_some() { band.outside_limits() } else { band });
    course = course.series(Series::line("the law found", &time, &cut(&main.law.force)).colour(Colour::Nth(1)).dash(Dash::Solid));
    course = course.series(Series::line("required by the recordings", &time, &force).colour(Colour::Ink).dash(Dash::Dotted));
    page.figure(course, &format!("The same against time, in {}.", file_name(&main.record)));
    if loose.is_none() {
        page.text(&within(main));
    }
}

/// A sentence for the case that the sensors leave the force so uncertain that its cloud is no evidence for or against a law.
fn loose(main: &Trace, unit: &str) -> Option<String> {
    let mut wide: Vec<f64> = main.deviation.iter().copied().filter(|d| d.is_finite()).collect();
    wide.sort_by(f64::total_cmp);
    let half = 2.0 * wide.get(wide.len() / 2)?;
    let level = backdrive_signal::statistics::rms(&main.law.force);
    (half > level).then(|| {
        format!(
            " Without the law, this force is known only to ± {}, more than the law itself ({} rms): these sensors do not separate it from \
             the rest of the model. The evidence for the law is the residual above, not this figure.",
            si(half, unit),
            si(level, unit)
        )
    })
}

/// Whether the law lies within the interval of what the recordings ask for, and if not, where.
fn within(main: &Trace) -> String {
    let (latent, law, deviation) = (&main.latent.force, &main.law.force, &main.deviation);
    let n = latent.len().min(law.len()).min(deviation.len());
    let known: Vec<usize> = (0..n).filter(|k| latent[*k].is_finite() && law[*k].is_finite() && deviation[*k] > 0.0).collect();
    if known.is_empty() {
        return String::new();
    }
    let outside: Vec<usize> = known.iter().copied().filter(|k| (latent[*k] - law[*k]).abs() > 2.0 * deviation[*k]).collect();
    let share = 1.0 - outside.len() as f64 / known.len() as f64;
    let inside = format!("Over the whole record the law is within the 95 % interval at {} of the samples", percent(share));
    if share > 0.9 {
        return format!("{inside}.");
    }
    // The estimate is smooth: where the law jumps (friction that turns, an end of a gap) it cannot follow.
    let level = backdrive_signal::statistics::rms(law);
    let reach = (n / 500).max(3);
    let jumps = |k: usize| {
        let part = law.get(k.saturating_sub(reach)..(k + reach).min(n)).unwrap_or(&[]);
        let (low, high) = part.iter().fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), f| (low.min(*f), high.max(*f)));
        high - low > level
    };
    let at_jumps = outside.iter().filter(|k| jumps(**k)).count() as f64 / outside.len() as f64;
    let off: Vec<f64> = outside.iter().map(|k| latent[*k] - law[*k]).collect();
    let size = backdrive_signal::statistics::rms(&off) / level;
    let why = if at_jumps > 0.5 {
        format!("{} of the others are where the law jumps, which an estimate from sensors of finite bandwidth smooths", percent(at_jumps))
    } else {
        format!(
            "at the other samples it differs by {} of the law's rms: the interval contains only sensor noise, not errors of the rest of \
             the model. The true law may be none of the known ones",
            percent(size)
        )
    };
    format!("{inside}; {why}.")
}

/// The law's curve: without a memory a line over its variable, with one in the order of time.
fn law(evidence: &Evidence, main: &Trace) -> Series {
    let own = &main.law;
    let (x, y): (Vec<f64>, Vec<f64>) = if evidence.memory || evidence.against == Against::Displacement && evidence.id.starts_with("series")
    {
        let part = fullest(own);
        let cut = |x: &[f64]| x.get(part.clone()).unwrap_or(&[]).to_vec();
        (cut(&own.variable), cut(&own.force))
    } else {
        let mut pairs: Vec<(f64, f64)> =
            evidence.traces.iter().flat_map(|t| t.law.variable.iter().copied().zip(t.law.force.iter().copied())).collect();
        pairs.sort_by(|a, b| a.0.total_cmp(&b.0).then(a.1.total_cmp(&b.1)));
        pairs.into_iter().unzip()
    };
    let series = match evidence.against {
        // Behind a lag a signal has no curve, but a cloud.
        Against::SignalRate | Against::Signal | Against::Acceleration => {
            let step = x.len().div_ceil(POINTS).max(1);
            let thin = |x: &[f64]| x.iter().step_by(step).copied().collect::<Vec<f64>>();
            Series::points("the law found", &thin(&x), &thin(&y)).width(1.3)
        }
        Against::Velocity | Against::Displacement | Against::Time => Series::line("the law found", &x, &y).dash(Dash::Solid).width(2.2),
    };
    series.colour(Colour::Nth(1))
}

/// Points of all records, evenly taken.
fn cloud(traces: &[Trace]) -> (Vec<f64>, Vec<f64>) {
    let all: usize = traces.iter().map(|t| t.latent.force.len()).sum();
    let step = all.div_ceil(POINTS).max(1);
    traces.iter().flat_map(|t| t.latent.variable.iter().copied().zip(t.latent.force.iter().copied())).step_by(step).unzip()
}

/// The part of a record in which the force goes furthest and turns: samples with the largest change of force.
fn fullest(curve: &Curve) -> std::ops::Range<usize> {
    let n = curve.force.len();
    let size = (n / LOOP).max(200).min(n);
    // Changes, not sizes: a friction that holds its level shows nothing.
    let mut square: Vec<f64> =
        curve.force.windows(2).map(|w| (w[1] - w[0]) * (w[1] - w[0])).map(|d| if d.is_finite() { d } else { 0.0 }).collect();
    square.resize(n, 0.0);
    let mut sum: f64 = square.iter().take(size).sum();
    let (mut best, mut at) = (sum, 0);
    for k in size..n {
        sum += square[k] - square[k - size];
        if sum > best {
            (best, at) = (sum, k + 1 - size);
        }
    }
    at..at + size
}

/// The force at the place that explains most, where no effect was named.
fn map(page: &mut Page, found: &Diagnosis, place: &Located) {
    let motion = found.problem.model.motion;
    let unit = if matches!(place.place, Place::Between(..)) { unit_for(motion, "N") } else { String::new() };
    let title = format!("unknown force at {}", shown(&place.place));
    let mut figures: Vec<Figure> = Vec::new();
    for (label, column, own) in [("velocity", 0, "m/s"), ("displacement", 1, "m")] {
        let (mut x, mut y) = (Vec::new(), Vec::new());
        for course in &place.courses {
            let over = if column == 0 { &course.velocity } else { &course.displacement };
            x.extend_from_slice(over);
            y.extend_from_slice(&course.force[..over.len().min(course.force.len())]);
        }
        if x.is_empty() {
            continue;
        }
        let step = x.len().div_ceil(POINTS).max(1);
        let thin = |x: &[f64]| x.iter().step_by(step).copied().collect::<Vec<f64>>();
        let mut plot = Plot::new(&format!("{title} against {label}")).x_axis(label, &unit_for(motion, own)).y_axis("force", &unit);
        plot = plot.series(Series::points("required by the recordings", &thin(&x), &thin(&y)).colour(Colour::Muted).width(1.3));
        let wanted = if column == 0 { Variable::Velocity } else { Variable::Displacement };
        if let Some(law) = place.laws.iter().find(|l| l.variable == wanted && !l.curve.is_empty()) {
            let (at, mean): (Vec<f64>, Vec<f64>) = law.curve.iter().map(|p| (p.at, p.mean)).unzip();
            plot = plot.series(Series::line("its mean", &at, &mean).colour(Colour::Nth(1)).dash(Dash::Solid));
        }
        figures.push(plot.into());
    }
    if figures.is_empty() {
        return;
    }
    page.figure(Figure::beside(figures), "The force at this place that would make the refitted nominal model reproduce the recording.");
    if let Some(c) = &place.character {
        let mut words = vec![if c.odd_share > 0.7 {
            "odd"
        } else if c.odd_share < 0.3 {
            "even"
        } else {
            "neither odd nor even"
        }];
        words.push(if c.memory { "with memory" } else { "without memory" });
        words.push(if c.rate_dependent { "dependent on speed" } else { "independent of speed" });
        page.text(&format!("Its class: {}; it dissipates {} per cycle.", words.join(", "), si(c.dissipated_per_cycle, "J")));
    }
}

/// The ranking, and what the sensors cannot tell apart.
fn places(page: &mut Page, found: &Diagnosis, location: &Location) {
    let mut table =
        Table::new(["place", "log-likelihood gain", "behind the best", "force needed, rms", "correlates best with", "not separated from"]);
    let top = location.ranking.first().map_or(0.0, |c| c.evidence);
    let n = location.ranking.len();
    for (index, candidate) in location.ranking.iter().enumerate().take(PLACES) {
        let class = location.classes.iter().find(|c| c.members.contains(&index));
        let alike: Vec<String> = class
            .map(|c| c.members.iter().filter(|m| **m != index).filter_map(|m| location.ranking.get(*m)).map(|c| shown(&c.place)).collect())
            .unwrap_or_default();
        let unit = match &candidate.place {
            Place::Between(..) => unit_for(found.problem.model.motion, "N"),
            Place::Signal(_) => String::new(),
        };
        let behind = top - candidate.evidence;
        let tone = if behind < 10.0 { Tone::Good } else { Tone::Neutral };
        table.push([
            Cell::tone(shown(&candidate.place), tone),
            number(candidate.evidence - location.log_likelihood_without).into(),
            number(behind).into(),
            si(candidate.rms, &unit).into(),
            candidate
                .laws
                .first()
                .map_or("–".to_string(), |l| format!("{} ({})", variable_word(l.variable), percent(l.held_out_share)))
                .into(),
            alike.join(", ").into(),
        ]);
    }
    let more = if n > PLACES { format!(" {} more places explain less.", n - PLACES) } else { String::new() };
    page.table(table.caption(&format!(
        "For each place: the force that would make the refitted nominal model reproduce the recordings. Log-likelihood gain: relative to \
         no force. The share in the last column but one: how much of the force the law explains on other parts of the recordings.{more}"
    )));
}

fn variable_word(variable: Variable) -> &'static str {
    match variable {
        Variable::Constant => "nothing (constant)",
        Variable::Direction => "direction of motion",
        Variable::Velocity => "velocity",
        Variable::Displacement => "displacement",
        Variable::Acceleration => "acceleration",
        Variable::DisplacementByDirection => "displacement, by direction",
        Variable::SinceReversal => "distance since reversal",
        Variable::TimeSinceReversal => "time since reversal",
        Variable::Ripple => "position, periodically",
        Variable::Signal => "signal",
        Variable::SignalRate => "signal's rate",
        Variable::Time => "time",
    }
}
