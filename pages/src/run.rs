//! The page of a run or a replay: what happened, the signals with the contact marked, timing, losses, events.
//!
//! It is made from what went by (from the bag, or from the run itself where it was in one process) and from the supervisor's report.

use crate::offered::Step;
use crate::parts::{ending, todo};
use backdrive_bags::{BagError, Reader};
use backdrive_launch::{Cause, RunReport};
use backdrive_msgs::{Message, Status};
use backdrive_nodes::graph::Graph;
use backdrive_nodes::stage::Clock;
use backdrive_report::{Cell, Colour, Dash, Figure, Page, Plot, Series, Table, Tone, number, si};
use backdrive_runs::Done;
use backdrive_stability::collect::Collector;
use backdrive_stability::outcome::Outcome;
use backdrive_stability::session::{AxisSignals, Session};
use std::path::Path;

/// Events beyond these are counted, not listed.
const MOST_EVENTS: usize = 200;
/// A slave that lets go for less than this stays in contact, s.
const BRIDGE_S: f64 = 0.05;
/// How much of the first contact is drawn by itself, s.
const IMPACT_S: f64 = 0.3;

/// The terms of the page.
const TERMS: [(&str, &str); 7] = [
    ("μλ", "the loop's gain: the position scale μ from master to slave times the force scale λ from slave to master"),
    ("x_u, x_m, x_c, x_s", "positions of the hand's intent, the master, the command to the slave, and the slave"),
    ("F_f, F_s", "force reflected on the master; force of the environment on the slave"),
    ("stable", "oscillations decay while the hand holds still in contact"),
    ("limit cycle", "an oscillation of constant amplitude while the hand holds still"),
    ("loop time", "duration of one step of a node, including the wait for its inputs; 50 % of the steps are below p50, 99 % below p99"),
    ("canceller", "subtracts the induced motion of the master from the command"),
];

/// What goes by in a run, for its page.
pub struct Heard {
    signals: Collector,
    events: Vec<Told>,
    events_left_out: usize,
    statuses: Vec<(String, Vec<Status>)>,
}

/// An event of a node.
struct Told {
    node: String,
    step: u64,
    severity: u32,
    text: String,
}

impl Heard {
    /// Ready for the messages of a graph.
    pub fn of(graph: &Graph) -> Heard {
        let signals = Collector::of(graph, &graph.path.display().to_string());
        Heard { signals, events: Vec::new(), events_left_out: 0, statuses: Vec::new() }
    }

    /// Everything in a bag.
    ///
    /// # Errors
    /// A bag that cannot be read.
    pub fn from_bag(graph: &Graph, bag: &Path) -> Result<Heard, BagError> {
        let reader = Reader::open(bag)?;
        let mut heard = Heard::of(graph);
        for entry in reader.messages()? {
            let entry = entry?;
            if let Some(message) = entry.message(bag)? {
                heard.take(&entry.topic.name, &message);
            }
        }
        Ok(heard)
    }

    /// Hears a message.
    pub fn take(&mut self, topic: &str, message: &Message) {
        self.signals.take(topic, message);
        let node = || topic.trim_start_matches('/').split('/').next().unwrap_or_default().to_string();
        match message {
            Message::Event(_) if self.events.len() >= MOST_EVENTS => self.events_left_out += 1,
            Message::Event(event) => {
                let text = event.text.as_str().to_string();
                self.events.push(Told { node: node(), step: event.step, severity: event.severity, text });
            }
            Message::Status(status) => {
                let name = node();
                match self.statuses.iter_mut().find(|(n, _)| *n == name) {
                    Some((_, all)) => all.push(*status),
                    None => self.statuses.push((name, vec![*status])),
                }
            }
            Message::Sample(_) | Message::Gains(_) | Message::Margin(_) => {}
        }
    }
}

/// The page of a run or of a replay, with what to do next.
pub fn page(done: &Done, graph: &Graph, heard: &Heard, steps: &[Step]) -> Page {
    let mut page = Page::new(if graph.title.is_empty() { "A run" } else { &graph.title });
    let (tone, sentence) = headline(done);
    page.lead(tone, &sentence);
    todo(&mut page, steps);
    let session = heard.signals.session();
    page.section("Signals");
    if session.is_empty() {
        page.note("Master and contact force were never sampled at the same time, so there is no figure.");
    }
    for axis in &session.axes {
        signals(&mut page, axis, &session);
    }
    page.section("Run");
    page.table(facts(done, graph));
    page.details("Timing and losses", |inside| timing(inside, done, graph, heard));
    page.details("Events", |inside| events(inside, done, graph, heard));
    ending(&mut page, &TERMS);
    page
}

/// What a hurried reader takes away.
fn headline(done: &Done) -> (Tone, String) {
    let gain = done.summary.as_ref().map_or(String::new(), |s| format!(" at μλ = {}", number(s.last_loop_gain)));
    let fault =
        done.report.as_ref().filter(|r| !matches!(r.cause, Cause::Completed)).map(|r| format!(" The run did not complete: {}.", r.cause));
    let fault = fault.or((done.lost > 0).then(|| format!(" {} messages were lost.", done.lost))).unwrap_or_default();
    let Some(outcome) = done.summary.as_ref().and_then(|s| s.outcome) else {
        let tone = if fault.is_empty() { Tone::Neutral } else { Tone::Bad };
        let why = done.summary.as_ref().and_then(|s| s.no_loop).map_or(String::new(), |why| format!(": {why}"));
        return (tone, format!("There is no loop whose stability could be judged{why}.{fault}"));
    };
    let (tone, text) = match outcome {
        Outcome::Stable => (Tone::Good, format!("Stable{gain}: oscillations in contact decay.")),
        Outcome::LimitCycle { amplitude_m, frequency_hz, unit } => (
            Tone::Warning,
            format!(
                "Not stable{gain}: a limit cycle of ±{} at {} persists while the hand holds still.",
                unit.text(amplitude_m),
                si(frequency_hz, "Hz")
            ),
        ),
        Outcome::Unstable { growth_per_s } => (Tone::Bad, format!("Unstable{gain}: it grows by {} per second.", number(growth_per_s))),
        Outcome::Limited { clamped_share, beyond_travel } => {
            let travel = if beyond_travel { ", and the master left its travel" } else { "" };
            (
                Tone::Limited,
                format!("Limited{gain}: a clamp acted in {:.1} % of the contact{travel}; never called stable.", 100.0 * clamped_share),
            )
        }
        Outcome::NotJudged { why } => (Tone::Unsure, format!("It is not known whether the loop is stable{gain}: {why}.")),
    };
    (tone, format!("{text}{fault}"))
}

fn facts(done: &Done, graph: &Graph) -> Table {
    let mut table = Table::new(["", ""]);
    let mut row = |name: &str, text: String| table.push([name.to_string(), text]);
    let clock = if graph.timing.clock == Clock::Realtime { "real time" } else { "lockstep" };
    let planned = graph.timing.steps.map_or(String::new(), |n| format!(" of {n}"));
    row("steps", format!("{}{planned}, at {} ({clock})", done.steps, si(graph.timing.rate_hz, "Hz")));
    if let Some(s) = &done.summary {
        let later = if (s.last_loop_gain - s.loop_gain).abs() > 1e-9 {
            format!("; {} at the end", number(s.last_loop_gain))
        } else {
            String::new()
        };
        row("gain", format!("μλ = {} (μ {}, λ {}){later}", number(s.loop_gain), number(graph.gains.mu), number(graph.gains.lambda)));
        match (s.first_contact_s, s.peak_contact_force) {
            (Some(first), Some(peak)) => row(
                "contact",
                format!("first at {}, {} in all, force up to {}", si(first, "s"), si(s.contact_s, "s"), si(peak, s.force_units[0])),
            ),
            (None, Some(_)) => row("contact", "none".to_string()),
            _ => {}
        }
        if let Some(peak) = s.peak_feedback_force {
            row("reflected force", format!("up to {}", si(peak, s.force_units[1])));
        }
        if let Some(margin) = &s.margin {
            row("margin in contact", margin.clone());
        }
    }
    if let Some(bag) = &done.bag {
        let state = if done.complete { "complete".to_string() } else { format!("not complete, {} messages lost", done.lost) };
        row("bag", format!("{} ({state})", bag.file_name().unwrap_or_default().to_string_lossy()));
    }
    table
}

/// Position above force, of all the time and of the first contact.
fn signals(page: &mut Page, axis: &AxisSignals, session: &Session) {
    let touching = touching(&axis.contact, session.period_s);
    let several = if session.axes.len() > 1 { axis.name.as_str() } else { "" };
    let share = touching.iter().map(|(a, b)| b - a).sum::<f64>();
    page.figure(
        plots(axis, session.period_s, several, &touching, None),
        &match touching.len() {
            0 => "Position and force; no contact of the slave.".to_string(),
            1 => format!("Position and force; contact for {} (shaded; gaps below 50 ms included).", si(share, "s")),
            n => format!("Position and force; {n} contacts, {} in total (shaded; gaps below 50 ms included).", si(share, "s")),
        },
    );
    if let Some((first, _)) = touching.first() {
        page.figure(plots(axis, session.period_s, several, &[], Some((first - 0.02, first + IMPACT_S))), "The first contact.");
    }
}

/// Times at which the slave touches something, s, short leaps bridged.
fn touching(contact: &[f64], period_s: f64) -> Vec<(f64, f64)> {
    let bridge = (BRIDGE_S / period_s) as usize;
    let mut pieces: Vec<(usize, usize)> = Vec::new();
    for (row, _) in contact.iter().enumerate().filter(|(_, f)| f.is_finite() && **f != 0.0) {
        match pieces.last_mut() {
            Some(last) if row - last.1 <= bridge => last.1 = row + 1,
            _ => pieces.push((row, row + 1)),
        }
    }
    pieces.into_iter().map(|(a, b)| (a as f64 * period_s, b as f64 * period_s)).collect()
}

fn plots(axis: &AxisSignals, period_s: f64, title: &str, touching: &[(f64, f64)], part: Option<(f64, f64)>) -> Figure {
    let time: Vec<f64> = (0..axis.master.len()).map(|k| k as f64 * period_s).collect();
    let has = |column: &[f64]| column.iter().any(|x| x.is_finite());
    let mut position = Plot::new(title).x_axis("time", "s").y_axis("position", "m");
    let mut force = Plot::new("").y_axis("force", "N");
    for (from, to) in touching.iter().take(100) {
        position = position.region(*from, *to, Tone::Neutral, "");
        force = force.region(*from, *to, Tone::Neutral, "");
    }
    if let Some(intent) = axis.intent.as_ref().filter(|x| has(x)) {
        position = position.series(Series::line("hand x_u", &time, intent).colour(Colour::Ink).dash(Dash::Dashed));
    }
    position = position.series(Series::line("master x_m", &time, &axis.master).colour(Colour::Nth(0)).dash(Dash::Solid));
    if has(&axis.command) {
        position = position.series(Series::line("command x_c", &time, &axis.command).colour(Colour::Nth(2)).dash(Dash::Dotted));
    }
    if let Some(slave) = axis.slave.as_ref().filter(|x| has(x)) {
        position = position.series(Series::line("slave x_s", &time, slave).colour(Colour::Nth(1)));
    }
    force = force.series(Series::line("on the master F_f", &time, &axis.force).colour(Colour::Nth(0)));
    force = force.series(Series::line("on the slave F_s", &time, &axis.contact).colour(Colour::Nth(1)));
    if let Some((from, to)) = part {
        (position, force) = (position.x_limits(from, to), force.x_limits(from, to));
    }
    Figure::stacked([position, force])
}

fn timing(page: &mut Page, done: &Done, graph: &Graph, heard: &Heard) {
    let Some(report) = &done.report else {
        page.text(&format!(
            "All nodes ran in one process, in lockstep: {} steps in {}. There are no deadlines, and no sample can be lost between nodes.",
            done.steps,
            si(done.duration_s, "s")
        ));
        return;
    };
    let mut table = Table::new(["node", "steps", "loop p50", "loop p99", "missed deadlines", "samples lost", "restarts", "end"]);
    for node in &report.nodes {
        let us = |value: Option<f64>| value.filter(|v| *v > 0.0).map_or("–".to_string(), |us| si(us * 1e-6, "s"));
        let bad = |count: u64| if count > 0 { Cell::tone(count.to_string(), Tone::Warning) } else { Cell::from("0".to_string()) };
        let status = node.status.as_ref();
        table.push([
            Cell::from(node.name.clone()),
            status.map_or("–".to_string(), |s| s.steps.to_string()).into(),
            us(status.map(|s| s.loop_p50_us)).into(),
            us(status.map(|s| s.loop_p99_us)).into(),
            bad(status.map_or(0, |s| s.missed_deadlines)),
            bad(status.map_or(0, |s| s.lost)),
            node.restarts.to_string().into(),
            if node.end == "done" { Cell::from("done".to_string()) } else { Cell::tone(node.end.clone(), Tone::Warning) },
        ]);
    }
    let period = si(graph.period_s(), "s");
    page.table(table.caption(&format!("Duration of one step of each node, including the wait for its inputs; the period is {period}.")));
    if let Some(unrecorded) = report.unrecorded.filter(|n| *n > 0) {
        page.warning(&format!("{unrecorded} messages did not reach the recorder and are not in the bag."));
    }
    for death in &report.deaths {
        let again = if death.recovered { "; it was restarted and rejoined the run" } else { "" };
        page.warning(&format!("{} {} at {}{again}.", death.node, death.how, si(death.t_s, "s")));
    }
    if graph.timing.clock == Clock::Realtime {
        latency(page, graph, heard);
    }
}

/// The 99th percentile of each node's loop time over the run.
fn latency(page: &mut Page, graph: &Graph, heard: &Heard) {
    let mut plot = Plot::new("").x_axis("time", "s").y_axis("loop time, 99th percentile", "s").include_y(0.0);
    let mut any = false;
    for (node, all) in &heard.statuses {
        let all: Vec<&Status> = all.iter().filter(|s| s.loop_p99_s.is_finite() && s.loop_p99_s > 0.0).collect();
        let time: Vec<f64> = all.iter().map(|s| s.step as f64 * graph.period_s()).collect();
        let late: Vec<f64> = all.iter().map(|s| s.loop_p99_s).collect();
        any |= !time.is_empty();
        plot = plot.line(node, &time, &late);
    }
    if any {
        plot = plot.horizontal(graph.period_s(), "one step", Tone::Warning);
        page.figure(plot, "Loop time of each node, as reported during the run.");
    }
}

fn events(page: &mut Page, done: &Done, graph: &Graph, heard: &Heard) {
    let severity = |severity: u32| match severity {
        0 => Cell::from("info".to_string()),
        1 => Cell::tone("warning", Tone::Warning),
        _ => Cell::tone("error", Tone::Bad),
    };
    let mut table = Table::new(["time", "node", "", "what happened"]);
    let mut rows: Vec<(f64, String, u32, String)> =
        heard.events.iter().map(|e| (e.step as f64 * graph.period_s(), e.node.clone(), e.severity, e.text.clone())).collect();
    // What only the supervisor knows is not in the bag.
    let supervised = |report: &RunReport| -> Vec<(f64, String, u32, String)> {
        let own = report.events.iter().filter(|e| e.step.is_none());
        own.map(|e| (e.t_s.unwrap_or(0.0), e.node.clone(), e.severity, e.text.clone())).collect()
    };
    rows.extend(done.report.as_ref().map(supervised).unwrap_or_default());
    if rows.is_empty() {
        page.text("None.");
        return;
    }
    rows.sort_by(|a, b| a.0.total_cmp(&b.0));
    for (time, node, how, text) in rows {
        table.push([Cell::from(si(time, "s")), node.into(), severity(how), text.into()]);
    }
    page.table(table);
    let left_out = heard.events_left_out as u64 + done.report.as_ref().map_or(0, |r| r.events_left_out);
    if left_out > 0 {
        page.note(&format!("{left_out} more events are in the bag."));
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_slave_that_leaps_for_a_moment_stays_in_contact() {
        let contact: Vec<f64> =
            (0..3000).map(|k| if (500..540).contains(&k) || (560..900).contains(&k) || k > 2000 { -1.0 } else { 0.0 }).collect();
        assert_eq!(touching(&contact, 1e-3), [(0.5, 0.9), (2.001, 3.0)]);
    }
}
