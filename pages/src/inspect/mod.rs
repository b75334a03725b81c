//! The answer as a page: one sentence, the joints, and the pictures that show each finding.

pub mod response;

use crate::parts::{ending, lines_to_paste, sentence};
use backdrive_diagnosis::verdict::words::share;
use backdrive_inspect::{Finding, FindingKind, Quantity, Recording, Report, Response, Signal, Weight};
use backdrive_report::{Cell, Figure, Page, Plot, Table, Tone, number};

/// Most findings that have a picture; the table lists all.
const MOST_PICTURES: usize = 12;
/// Most pictures of one kind of finding: six joints alike need no six pictures.
const MOST_OF_A_KIND: usize = 2;
/// Most joints whose response is drawn.
const MOST_JOINTS: usize = 4;
/// Most signals in a picture.
const MOST_SIGNALS: usize = 3;
/// Seconds that are shown before and behind a place.
const AROUND_S: f64 = 1.5;
/// Seconds that are shown of what is true of a whole recording.
const WINDOW_S: f64 = 8.0;

/// The page.
pub fn page(report: &Report, recordings: &[Recording]) -> Page {
    let mut page = Page::new("Checks of the recording");
    let wrong = report.wrong().count();
    page.lead(if wrong > 0 { Tone::Bad } else { Tone::Good }, &lead(report));
    if !report.findings.is_empty() {
        let items: Vec<(String, Option<String>)> =
            report.findings.iter().filter(|f| f.todo.starts_with('[')).map(|f| (f.message.clone(), Some(f.todo.clone()))).collect();
        if !items.is_empty() {
            lines_to_paste(&mut page, &items);
        }
        page.section("Findings");
        let mut table = Table::new(["", "recording", "joint", "finding", "sure", "what to do"]);
        for finding in &report.findings {
            let (word, tone) = if finding.weight == Weight::Wrong { ("wrong", Tone::Bad) } else { ("note", Tone::Neutral) };
            table.push([
                Cell::tone(word, tone),
                short(&finding.file).into(),
                finding.joint.clone().unwrap_or_default().into(),
                finding.message.clone().into(),
                share(finding.sure).into(),
                (if finding.todo.starts_with('[') { "the lines above" } else { finding.todo.as_str() }).into(),
            ]);
        }
        page.table(table);
    }
    pictures(&mut page, report, recordings);
    if !report.responses.is_empty() {
        page.section("Command and response");
        let mut table = Table::new(std::iter::once("recording").chain(response::HEADERS));
        for answer in &report.responses {
            table.push(std::iter::once(short(&answer.file)).chain(response::cells(answer)).collect::<Vec<_>>());
        }
        page.table(table);
        let drawn: Vec<Figure> = report.responses.iter().take(MOST_JOINTS).filter_map(|answer| followed(answer, recordings)).collect();
        if !drawn.is_empty() {
            page.figure(Figure::beside(drawn), "Command and position where the command moves most.");
        }
        page.text("A dash: not identifiable from this motion. Droop, dead band and speed limit are in the position's SI unit.");
    }
    page.section("Details");
    page.details("What each column is", |inside| {
        let mut table = Table::new(["recording", "signal", "is", "unit", "sure", "why", "from", "to", "step", "noise"]);
        for signal in &report.signals {
            let [low, high] = signal.range;
            let optional = |value: Option<f64>| value.map_or(String::new(), number);
            table.push([
                short(&signal.file),
                signal.name.clone(),
                signal.quantity.text().to_string(),
                signal.unit.clone().unwrap_or_default(),
                share(signal.sure),
                signal.why.clone(),
                number(low),
                number(high),
                optional(signal.step),
                optional(signal.noise),
            ]);
        }
        inside.table(table);
    });
    let mut table = Table::new(["recording", "topic", "samples", "rate, Hz", "jitter, ms", "duration, s"]);
    for clock in &report.clocks {
        let samples = clock.samples.to_string();
        table.push([
            short(&clock.file),
            clock.topic.clone(),
            samples,
            number(clock.rate_hz),
            number(clock.jitter_ms),
            number(clock.duration_s),
        ]);
    }
    page.table(table);
    for note in &report.notes {
        page.note(&sentence(note));
    }
    ending(&mut page, &TERMS);
    page
}

fn short(file: &str) -> String {
    std::path::Path::new(file).file_name().map_or_else(|| file.to_string(), |name| name.to_string_lossy().into_owned())
}

/// Command and position of a joint, in SI units where these are known.
fn followed(answer: &Response, recordings: &[Recording]) -> Option<Figure> {
    let recording = recordings.iter().find(|recording| recording.file == answer.file)?;
    let find = |name: &str| recording.signals.iter().find(|signal| signal.name == name);
    let (command, position) = (find(&answer.command)?, find(&answer.position)?);
    let (from, to) = busiest(recording, command);
    let at = |time: f64| (time / recording.period) as usize;
    let rows = at(from)..at(to).min(command.even.len()).min(position.even.len());
    let t: Vec<f64> = rows.clone().map(|row| row as f64 * recording.period).collect();
    let (u, y) = (command.even.get(rows.clone())?, position.even.get(rows)?);
    let plot = Plot::new(&response::title(answer)).x_axis("time", "s").y_axis("position", "");
    Some(Figure::from(plot.line("command", &t, u).line("position", &t, y)))
}

/// The answer, with the first problem and how many more there are.
fn lead(report: &Report) -> String {
    let Some(first) = report.wrong().next() else { return format!("{}.", report.sentence()) };
    format!("{}. First: {}.", report.sentence(), first.message)
}

fn pictures(page: &mut Page, report: &Report, recordings: &[Recording]) {
    let mut shown: Vec<(FindingKind, &str)> = Vec::new();
    let mut drawn = Vec::new();
    for finding in report.wrong() {
        let key = (finding.kind, finding.joint.as_deref().unwrap_or(""));
        let Some(recording) = recordings.iter().find(|recording| recording.file == finding.file) else { continue };
        let alike = shown.iter().filter(|(kind, _)| *kind == finding.kind).count();
        if shown.contains(&key) || alike >= MOST_OF_A_KIND || drawn.len() >= MOST_PICTURES {
            continue;
        }
        if let Some(figure) = picture(finding, recording) {
            shown.push(key);
            drawn.push((figure, format!("{}: {}.", short(&finding.file), finding.message)));
        }
    }
    if !drawn.is_empty() {
        page.section("Evidence");
    }
    for (figure, caption) in drawn {
        page.figure(figure, &caption);
    }
}

/// The signals of a finding over the time that shows it, each over its own axis.
fn picture(finding: &Finding, recording: &Recording) -> Option<Figure> {
    let of_clock = matches!(finding.kind, FindingKind::Gap | FindingKind::TimeGoesBack | FindingKind::DuplicateTimes | FindingKind::Jitter);
    if of_clock {
        return clock(finding, recording);
    }
    let named: Vec<&Signal> =
        finding.signals.iter().filter_map(|name| recording.signals.iter().find(|signal| signal.name == *name)).collect();
    let mut signals: Vec<&Signal> = named.into_iter().take(MOST_SIGNALS).collect();
    // What the joint does meanwhile.
    if let [only] = signals[..] {
        let moves = |signal: &Signal| matches!(signal.quantity, Quantity::Position | Quantity::Command);
        let partner = |signal: &&Signal| signal.joint == only.joint && signal.name != only.name && moves(signal);
        signals.extend(recording.signals.iter().filter(partner).take(1));
    }
    let busy = signals.last()?;
    let (from, to) = finding.time_s.map_or_else(|| busiest(recording, busy), |[from, to]| (from - AROUND_S, to + AROUND_S));
    let plots: Vec<Plot> = signals
        .iter()
        .map(|signal| {
            let stream = &recording.streams[signal.stream];
            let rows: Vec<usize> = (0..signal.values.len()).filter(|row| (from..=to).contains(&stream.time(*row))).collect();
            let t: Vec<f64> = rows.iter().map(|row| stream.time(*row)).collect();
            let y: Vec<f64> = rows.iter().map(|row| signal.values[*row]).collect();
            let unit = signal.stated.or(signal.hint).map_or("", |unit| unit.name);
            let label = if unit.is_empty() { signal.quantity.text().to_string() } else { format!("{}, {unit}", signal.quantity.text()) };
            let plot = Plot::new(&signal.name).x_axis("time", "s").y_axis(&label, "").line(&signal.name, &t, &y);
            match finding.time_s {
                Some([from, to]) if to > from => plot.region(from, to, Tone::Bad, ""),
                Some([at, _]) => plot.vertical(at, "", Tone::Bad),
                None => plot,
            }
        })
        .collect();
    (!plots.is_empty()).then(|| Figure::stacked(plots))
}

/// The steps of a clock.
fn clock(finding: &Finding, recording: &Recording) -> Option<Figure> {
    let stream = recording.streams.iter().find(|stream| stream.topic.is_empty() || finding.signals.contains(&stream.topic))?;
    let rows: Vec<f64> = (1..stream.times.len()).map(|row| row as f64).collect();
    let steps: Vec<f64> = stream.times.windows(2).map(|w| w[1] - w[0]).collect();
    Some(Figure::from(Plot::new("Steps of the clock").x_axis("row", "").y_axis("step", "s").line("step", &rows, &steps)))
}

/// The part of a recording in which a signal moves most.
fn busiest(recording: &Recording, signal: &Signal) -> (f64, f64) {
    let length = ((WINDOW_S / recording.period) as usize).max(1);
    let pieces = signal.even.chunks(length).enumerate();
    let path = |piece: &[f64]| piece.windows(2).map(|w| (w[1] - w[0]).abs()).sum::<f64>();
    let best = pieces.max_by(|a, b| path(a.1).total_cmp(&path(b.1))).map_or(0, |(place, _)| place);
    let from = best as f64 * length as f64 * recording.period;
    (from, from + WINDOW_S)
}

/// The terms of the page.
const TERMS: [(&str, &str); 7] = [
    ("lag", "the time by which a position lags its command in this motion; if the response is not a pure delay, the lag depends on speed"),
    ("-3 dB", "the frequency at which the response falls to 71 % of its low-frequency value; >= if the motion has no higher frequencies"),
    ("droop", "steady error while the command is constant, due to weight and friction"),
    ("dead band", "steady position after an approach from above minus that from below"),
    ("rectified", "logged without its sign"),
    ("jitter", "standard deviation of the steps of the clock"),
    ("sure", "probability that the finding is right"),
];
