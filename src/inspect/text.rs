//! The answer for a terminal.

use crate::columns::columns;
use backdrive_diagnosis::verdict::words::share;
use backdrive_inspect::{Finding, Quantity, Report, Weight};
use backdrive_pages::inspect::response;
use backdrive_report::number;
use std::fmt::Write as _;

/// Most signals of a recording that are listed; the rest is counted.
const MOST_SIGNALS: usize = 40;

/// All of it.
pub fn text(report: &Report) -> String {
    let mut out = format!("answer    {}\n", report.sentence());
    let several = report.files.len() > 1;
    for clock in &report.clocks {
        let of = if clock.topic.is_empty() { clock.file.clone() } else { format!("{} {}", clock.file, clock.topic) };
        let _ = writeln!(
            out,
            "clock     {of}: {} samples in {:.1} s, {} Hz, jitter {} ms",
            clock.samples,
            clock.duration_s,
            number(clock.rate_hz),
            number(clock.jitter_ms)
        );
    }
    signals(&mut out, report, several);
    let mut rows: Vec<Vec<String>> = Vec::new();
    for answer in &report.responses {
        let mut cells = response::cells(answer);
        if several {
            cells.insert(0, answer.file.clone());
        }
        rows.push(cells);
    }
    if !rows.is_empty() {
        let mut head: Vec<String> = response::HEADERS.map(str::to_string).to_vec();
        if several {
            head.insert(0, "recording".to_string());
        }
        rows.insert(0, head);
        let _ = write!(out, "\n{}", columns(&rows));
    }
    for finding in &report.findings {
        let _ = write!(out, "\n{}", said(finding, several));
    }
    for note in &report.notes {
        let _ = writeln!(out, "note      {note}");
    }
    out
}

fn signals(out: &mut String, report: &Report, several: bool) {
    // Of several recordings of one device the first states what the signals are.
    let first = report.files.first().map_or("", String::as_str);
    let listed: Vec<_> = report.signals.iter().filter(|signal| !several || signal.file == first).collect();
    for signal in listed.iter().take(MOST_SIGNALS) {
        let unit = signal.unit.as_ref().map_or(String::new(), |unit| format!(" [{unit}]"));
        let why = match signal.quantity {
            Quantity::Unknown => String::new(),
            _ if signal.why.is_empty() => String::new(),
            _ => format!(", {} sure by {}", share(signal.sure), signal.why),
        };
        let [low, high] = signal.range;
        let step = signal.step.map_or(String::new(), |step| format!(", step {}", number(step)));
        let _ =
            writeln!(out, "signal    {}: {}{unit}{why}; {} to {}{step}", signal.name, signal.quantity.text(), number(low), number(high));
    }
    if listed.len() > MOST_SIGNALS {
        let _ = writeln!(out, "signal    and {} more: --json lists them", listed.len() - MOST_SIGNALS);
    }
}

fn said(finding: &Finding, several: bool) -> String {
    let word = if finding.weight == Weight::Wrong { "wrong" } else { "note" };
    let file = if several { format!("{}: ", finding.file) } else { String::new() };
    let at = finding
        .time_s
        .map_or(String::new(), |[from, to]| if from == to { format!(" (at {from:.2} s)") } else { format!(" ({from:.2} to {to:.2} s)") });
    let mut text = format!("{word:<9} {file}{}{at}; {} sure\n", finding.message, share(finding.sure));
    for (number, line) in finding.todo.lines().enumerate() {
        let _ = writeln!(text, "{:<9} {line}", if number == 0 { "do" } else { "" });
    }
    text
}
