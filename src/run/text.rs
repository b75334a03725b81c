//! What a run gave, for a person and for programs.

use crate::failure::{Failure, code};
use crate::offered::{Step, lines};
use crate::output;
use backdrive_launch::{Cause, RunReport};
use backdrive_report::{Page, percent};
use backdrive_runs::{Done, Fault, RunError};
use backdrive_stability::outcome::Outcome;
use backdrive_stability::summary::Summary;
use serde_json::json;
use std::path::Path;

/// Next steps that a terminal shows; the page shows all.
const SHOWN: usize = 2;

/// 0 judged and stable, or there is no loop, which its text states; 1 not stable; 7 it cannot be judged. Before these, of a run that did not go as it
/// should: 4 lost data, 5 a stranger on the network, 6 a node failed, 130 interrupted.
fn exit_code(done: &Done) -> u8 {
    match (done.fault(), done.summary.as_ref().and_then(|s| s.outcome)) {
        (Some(fault), _) => code_of(fault),
        (None, None | Some(Outcome::Stable)) => 0,
        (None, Some(Outcome::NotJudged { .. })) => code::CANNOT_TELL,
        (None, Some(Outcome::LimitCycle { .. } | Outcome::Unstable { .. } | Outcome::Limited { .. })) => code::NEGATIVE,
    }
}

fn code_of(fault: Fault) -> u8 {
    match fault {
        Fault::Exit(code) => code,
        Fault::Node => code::NODE,
        Fault::Stranger => code::MACHINE,
        Fault::Stopped => code::INTERRUPTED,
        Fault::Lost => code::LOST_DATA,
    }
}

impl From<RunError> for Failure {
    fn from(error: RunError) -> Failure {
        match error {
            RunError::Input(message) => Failure::input(message),
            RunError::Machine(message) => Failure::machine(message),
            RunError::Bag(error) => Failure::bag(error),
            RunError::Launch(error) => Failure::from(error),
            RunError::Experiment { fault, message } => Failure { code: code_of(fault), message },
        }
    }
}

/// Writes its page, if one is wanted, prints the result, and gives the exit code.
/// `steps` are what to do next.
pub fn tell(done: &Done, page: Option<(&Path, Page)>, json: bool, steps: &[Step]) -> Result<u8, Failure> {
    if let Some((html, page)) = page {
        output::page(html, page)?;
        output::note(format_args!("wrote {}", html.display()));
    }
    if json {
        let mut all = as_json(done);
        all["next"] = serde_json::to_value(steps).map_err(Failure::input)?;
        output::line(all)?;
    } else {
        output::line(text(done))?;
        // A sentence without a command stands above, where it belongs.
        let with_commands: Vec<Step> = steps.iter().filter(|step| !step.commands.is_empty()).take(SHOWN).cloned().collect();
        lines("next", 9, &with_commands).iter().try_for_each(output::line)?;
    }
    Ok(exit_code(done))
}

/// A few lines for a person.
fn text(done: &Done) -> String {
    let mut lines = Vec::new();
    let rate = done.steps as f64 / done.duration_s;
    let rate = if rate.is_finite() { format!(": {rate:.0} steps/s") } else { String::new() };
    lines.push(format!("ran      {} steps in {:.3} s{rate}", done.steps, done.duration_s));
    if let Some(report) = &done.report {
        lines.extend(timing(report));
        if report.cause != Cause::Completed {
            lines.push(format!("ended    {}", report.cause));
        }
        let told = match &report.cause {
            Cause::NodeDied { node, .. } | Cause::NodeFailed { node, .. } => node.as_str(),
            Cause::Completed | Cause::EndedEarly { .. } | Cause::Stopped { .. } | Cause::Stranger { .. } => "",
        };
        if report.refused > 0 {
            lines.push(format!("refused  {} messages from outside the run; none was used", report.refused));
        }
        for death in report.deaths.iter().filter(|d| d.node != told || d.recovered) {
            lines.push(format!("died     {} {} at {:.3} s", death.node, death.how, death.t_s));
        }
    }
    if let Some(summary) = &done.summary {
        lines.push(happened(summary));
    }
    if let Some(bag) = &done.bag {
        let complete = match done.lost {
            _ if done.unreadable.is_some() => "cannot be read".to_string(),
            0 if done.complete => "complete".to_string(),
            0 => "cut off".to_string(),
            lost => format!("{lost} messages lost"),
        };
        lines.push(format!("bag      {} ({complete})", bag.display()));
    }
    if let Some(why) = &done.unreadable {
        lines.push(format!("UNREADABLE {why}"));
    }
    lines.retain(|l| !l.is_empty());
    lines.join("\n")
}

/// For scripts.
fn as_json(done: &Done) -> serde_json::Value {
    let report = done.report.as_ref();
    let summary = done.summary.as_ref();
    json!({
        "steps": done.steps,
        "duration_s": done.duration_s,
        "steps_per_s": (done.duration_s > 0.0).then(|| done.steps as f64 / done.duration_s),
        "loop_p50_us": report.and_then(|r| r.loop_p50_us),
        "loop_p99_us": report.and_then(|r| r.loop_p99_us),
        "missed_deadlines": report.map(|r| r.missed_deadlines),
        "lost": done.lost,
        "refused": report.map(|r| r.refused),
        "bag": done.bag,
        "unreadable": done.unreadable,
        "complete": done.bag.as_ref().map(|_| done.complete),
        "loop_gain": summary.map(|s| s.loop_gain),
        "last_loop_gain": summary.map(|s| s.last_loop_gain),
        "peak_contact_force_n": summary.and_then(|s| s.peak_contact_force),
        "peak_feedback_force_n": summary.and_then(|s| s.peak_feedback_force),
        "first_contact_s": summary.and_then(|s| s.first_contact_s),
        "contact_s": summary.map(|s| s.contact_s),
        "no_loop": summary.and_then(|s| s.no_loop),
        "margin": summary.and_then(|s| s.margin.as_ref()),
        "outcome": summary.and_then(|s| s.outcome).map(|o| o.word()),
        "outcome_detail": summary.and_then(|s| s.outcome),
        "run": report,
    })
}
/// What happened, in a few lines for a person.
fn happened(summary: &Summary) -> String {
    let mut lines = Vec::new();
    if let (Some(start), Some(peak)) = (summary.first_contact_s, summary.peak_contact_force) {
        lines.push(format!(
            "contact  first at {start:.3} s, {:.3} s in all, force up to {peak:.3} {}",
            summary.contact_s, summary.force_units[0]
        ));
    } else if summary.peak_contact_force.is_some() {
        lines.push("contact  none".to_string());
    }
    if let Some(peak) = summary.peak_feedback_force {
        lines.push(format!("master   reflected force up to {peak:.3} {}", summary.force_units[1]));
    }
    if let Some(margin) = &summary.margin {
        lines.push(format!("margin   {margin}"));
    }
    if let Some(outcome) = &summary.outcome {
        let moved = (summary.last_loop_gain - summary.loop_gain).abs() > 1e-9 * summary.loop_gain.abs();
        let later = if moved { format!(" at the start and {:.4} at the end", summary.last_loop_gain) } else { String::new() };
        let gain = format!("at mu*lambda = {}{later}", summary.loop_gain);
        match outcome {
            Outcome::NotJudged { why } => {
                lines.push(format!("loop     not known whether it is stable {gain}: {why}"));
                lines.push(format!("to do    {}", why.advice()));
            }
            outcome => lines.push(format!("loop     {outcome} {gain}")),
        }
    }
    if let Some(why) = summary.no_loop {
        lines.push(format!("loop     none to judge: {why}"));
    }
    lines.join("\n")
}

/// Share of a node's steps that may miss their deadline before it is worth a word of advice.
const MANY_MISSED: f64 = 1e-3;

/// The loop's times and the deadlines that were missed. In real time the node that missed most is the one to show, with its own numbers: the
/// misses of all nodes beside the times of one that kept its own would hide where the loop is late.
fn timing(report: &RunReport) -> Vec<String> {
    let times = |p50: f64, p99: f64| format!("p50 {p50:.1} us, p99 {p99:.1} us");
    let of = |name: &str| report.nodes.iter().find(|n| n.name == name).and_then(|n| n.status.as_ref());
    let late = report.latest_node.as_ref().and_then(|(name, most)| Some((name, *most, of(name)?)));
    let Some((name, most, status)) = late else {
        let timed = report.loop_node.as_ref().zip(report.loop_p50_us.zip(report.loop_p99_us));
        return timed.map(|(node, (p50, p99))| format!("timing   {node}: {}; 0 missed deadlines", times(p50, p99))).into_iter().collect();
    };
    // Steps that were left out to catch up count as missed too, and stand in the count of steps done.
    let share = most as f64 / status.steps.max(most).max(1) as f64;
    let period = report.rate_hz.map_or(String::new(), |rate| format!(" (a step is {:.0} us)", 1e6 / rate));
    let all = match report.missed_deadlines {
        all if all == most => String::new(),
        all => format!("; {all} in all nodes together"),
    };
    let mut lines = vec![format!(
        "timing   {name} is the slowest node: {}{period}; {most} of its {} steps ({}) missed their deadline{all}",
        times(status.loop_p50_us, status.loop_p99_us),
        status.steps,
        percent(share),
    )];
    if share > MANY_MISSED {
        lines.push(
            "to do    lower --rate, close other programs, or allow real-time scheduling: `backdrive doctor` reports what this machine \
             lacks (SCHED_FIFO, timers)"
                .to_string(),
        );
    }
    lines
}

#[cfg(test)]
mod tests {
    use super::*;
    use backdrive_launch::NodeReport;
    use backdrive_nodes::protocol::NodeStatus;
    use backdrive_nodes::stage::Clock;

    /// A run at 5 kHz of 20 000 steps in which each node missed the given number of deadlines.
    fn report(missed: &[(&str, u64)]) -> RunReport {
        let node = |(name, missed): &(&str, u64)| NodeReport {
            with: Vec::new(),
            name: name.to_string(),
            kind: name.to_string(),
            status: Some(NodeStatus {
                steps: 20_000,
                missed_deadlines: *missed,
                loop_p50_us: 40.0 + *missed as f64,
                loop_p99_us: 400.0 + *missed as f64,
                ..NodeStatus::default()
            }),
            restarts: 0,
            end: "done".to_string(),
        };
        RunReport {
            id: String::new(),
            title: String::new(),
            clock: Clock::Realtime,
            rate_hz: Some(5000.0),
            steps: 20_000,
            planned_steps: Some(20_000),
            startup_s: 0.1,
            duration_s: 4.0,
            steps_per_s: 5000.0,
            loop_node: Some("master".to_string()),
            loop_p50_us: Some(40.0),
            loop_p99_us: Some(400.0),
            refused: 0,
            missed_deadlines: missed.iter().map(|m| m.1).sum(),
            latest_node: missed.iter().max_by_key(|m| m.1).filter(|m| m.1 > 0).map(|m| (m.0.to_string(), m.1)),
            lost: 0,
            unrecorded: Some(0),
            bag: None,
            recorded: None,
            nodes: missed.iter().map(node).collect(),
            events: Vec::new(),
            events_left_out: 0,
            deaths: Vec::new(),
            killed: Vec::new(),
            cause: Cause::Completed,
            outcome: None,
            peak_contact_force_n: None,
        }
    }

    #[test]
    fn the_slowest_node_is_told_with_its_own_numbers_and_with_advice() {
        let told = timing(&report(&[("master", 55), ("canceller", 5000), ("slave", 2000)]));
        let first = "timing   canceller is the slowest node: p50 5040.0 us, p99 5400.0 us (a step is 200 us); 5000 of its 20000 steps (25.0 %) \
                     missed their deadline; 7055 in all nodes together";
        assert_eq!(told[0], first);
        assert!(told[1].starts_with("to do    lower --rate") && told[1].contains("SCHED_FIFO"), "{told:?}");
        // A few are no reason to do anything, and where one node alone is late its number is the total.
        let few = timing(&report(&[("master", 12), ("slave", 0)]));
        assert!(few.len() == 1 && few[0].contains("12 of its 20000 steps") && !few[0].contains("all nodes"), "{few:?}");
        let none = timing(&report(&[("master", 0), ("slave", 0)]));
        assert_eq!(none, ["timing   master: p50 40.0 us, p99 400.0 us; 0 missed deadlines"]);
    }
}
