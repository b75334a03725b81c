//! The page of `backdrive why`: what happens, why, and what would stop it, for a colleague who was not there.

use crate::offered::Step;
use crate::parts::{ending, large, todo};
use backdrive_diagnosis::verdict::words::share;
use backdrive_report::{Figure, Page, Plot, Table, Tone, number, percent};
use backdrive_stability::session::Session;
use backdrive_why::answer::Answer;
use backdrive_why::happening::Happening;

/// Causes that are less likely are not shown.
const UNLIKELY: f64 = 0.01;

/// Where the signals alone do not say why.
pub const NO_CAUSE: &str = "not known: the recording contains no model of the loop and no excitation from which it can be measured";

/// The page of an answer about a session, with what to do next; `tries` are the commands that try each remedy, in their order.
pub fn page(found: &Answer, session: &Session, tries: &[Step], steps: &[Step]) -> Page {
    let name = std::path::Path::new(&found.bag).file_name().map_or(found.bag.clone(), |n| n.to_string_lossy().into_owned());
    let mut page = Page::new(&format!("Cause of the oscillation: {name}"));
    page.lead(tone(found), &lead(found));
    todo(&mut page, steps);
    if let Some(beneath) = &found.beneath {
        page.text(&format!("Without that limit: {beneath}."));
    }
    if !found.reproduced && found.again.is_some() {
        page.warning(
            "The re-simulation, with all differences found, does not reproduce the recording. Some cause is unknown, and the results \
             below are less certain.",
        );
    }
    pictures(&mut page, found, session);
    page.section("Causes");
    causes(&mut page, found);
    page.section("Details");
    page.details("Remedies", |inside| remedies(inside, found, tries));
    page.details("Differences between the recording and its graph", |inside| {
        if found.differs.is_empty() {
            inside.text("None: every node responds to its recorded inputs as the graph states.");
        }
        found.differs.iter().for_each(|d| {
            inside.text(&format!("{d}."));
        });
    });
    if !found.events.is_empty() {
        let mut table = Table::new(["event", "times"]);
        for (kind, count) in &found.events {
            table.push([kind.replace('_', " "), count.to_string()]);
        }
        page.details("Events of the nodes", |inside| {
            inside.table(table);
        });
    }
    if !found.notes.is_empty() {
        page.details("Notes", |inside| {
            found.notes.iter().for_each(|n| {
                inside.text(n);
            });
        });
    }
    ending(&mut page, &TERMS);
    page
}

fn tone(found: &Answer) -> Tone {
    match found.happening {
        Happening::Nothing => Tone::Good,
        Happening::NotJudged { .. } | Happening::Ringing { .. } => Tone::Warning,
        _ => Tone::Bad,
    }
}

fn lead(found: &Answer) -> String {
    let mut text = format!("{}, at μλ = {}.", large(&found.happens), number(found.gain));
    if let Some(first) = found.causes.first() {
        text += &format!(" Most likely cause: {} (confidence {}).", first.kind.words(), share(first.confidence));
    }
    if let Some(remedy) = found.remedies.first().filter(|r| r.stops && found.happening.is_trouble()) {
        text += &format!(" First remedy: {}.", remedy.text);
    }
    text
}

fn pictures(page: &mut Page, found: &Answer, session: &Session) {
    let Some(axis) = session.axes.first() else { return };
    page.section("The loop, recorded and re-simulated");
    let time = |s: &Session| (0..s.len()).map(|i| i as f64 * s.period_s).collect::<Vec<_>>();
    // A run-away is drawn as far as it stays in the device.
    let reach = axis.intent.as_ref().map_or(0.0, |x| x.iter().filter(|x| x.is_finite()).fold(0.0_f64, |m, x| m.max(x.abs())));
    let bound = if reach > 0.0 { 5.0 * reach } else { f64::INFINITY };
    let drawn =
        |column: &[f64]| -> Vec<f64> { column.iter().map(|x| if x.is_finite() { x.clamp(-bound, bound) } else { f64::NAN }).collect() };
    let mut plot =
        Plot::new("Master's position").x_axis("time", "s").y_axis("x_m", "m").line("recorded", &time(session), &drawn(&axis.master));
    if let Some(again) = &found.again_signals
        && let Some(a) = again.axes.first()
    {
        plot = plot.line("re-simulated as recorded", &time(again), &drawn(&a.master));
    }
    if let Some(remedy) = found.remedies.first().filter(|r| r.stops)
        && let Some(signals) = &remedy.signals
        && let Some(a) = signals.axes.first()
    {
        plot = plot.line("with the first remedy", &time(signals), &drawn(&a.master));
    }
    let force = Plot::new("Force on the master").x_axis("time", "s").y_axis("F_f", "N").line(
        "recorded",
        &time(session),
        &axis.force.iter().map(|f| if f.is_finite() { f.clamp(-1e3, 1e3) } else { f64::NAN }).collect::<Vec<_>>(),
    );
    page.figure(
        Figure::stacked([plot, force]),
        "The recording, the re-simulation with all differences found, and the re-simulation with the first remedy.",
    );
}

fn causes(page: &mut Page, found: &Answer) {
    if found.causes.is_empty() {
        let trouble = found.happening.is_trouble();
        page.text(&if trouble { format!("The cause {}.", NO_CAUSE) } else { "There is no oscillation, so there is no cause.".to_string() });
        return;
    }
    let alone = matches!(found.happening, Happening::FollowerStairs { .. });
    page.text(if alone {
        "The slave was run alone on its recorded commands, as recorded and without its dry friction."
    } else {
        "The loop was re-simulated as recorded, and once without each suspect. A suspect seen in the recording has more weight than one \
         stated by the graph. A suspect without which the loop still oscillates has little weight."
    });
    let mut table =
        Table::new(["cause", "where", "confidence", "seen", "goes when it alone is repaired", "without it", "stable up to μλ, without it"]);
    for cause in found.causes.iter().filter(|c| c.confidence >= UNLIKELY) {
        table.push([
            large(cause.kind.words()),
            cause.place.clone(),
            share(cause.confidence),
            if cause.seen { "yes" } else { "no" }.to_string(),
            cause.share.map_or_else(String::new, percent),
            cause.without.clone(),
            cause.edge_without.map_or_else(|| if cause.holds_without { "everything tried".to_string() } else { String::new() }, number),
        ]);
    }
    page.table(table);
    for cause in found.causes.iter().filter(|c| c.confidence >= UNLIKELY) {
        page.text(&format!("{}: {}.", large(cause.kind.words()), cause.evidence));
    }
}

fn remedies(page: &mut Page, found: &Answer, tries: &[Step]) {
    if found.remedies.is_empty() {
        page.text(if found.happening.is_trouble() { "No remedy could be tried." } else { "No remedy is needed." });
        return;
    }
    let mut table = Table::new([
        "remedy",
        "result",
        "stops it",
        "other grips, walls and gain",
        "force left",
        "motion left",
        "beyond the recording",
        "options of the command",
    ]);
    let yes = |is: bool| if is { "yes" } else { "no" }.to_string();
    for (index, remedy) in found.remedies.iter().enumerate() {
        table.push([
            large(&remedy.text),
            remedy.outcome.clone(),
            yes(remedy.stops),
            yes(remedy.robust),
            percent(remedy.force_kept),
            percent(remedy.motion_kept),
            remedy.throws.as_ref().map_or_else(|| "no".to_string(), ToString::to_string),
            tries.get(index).and_then(Step::pasted).map(|command| options(&command)).unwrap_or_default(),
        ]);
    }
    page.table(table);
}

/// A command without its program, verb and bag.
fn options(command: &str) -> String {
    command.find(" --").map_or(command, |at| &command[at + 1..]).to_string()
}

/// The terms of the page.
const TERMS: [(&str, &str); 7] = [
    ("μλ", "the loop's gain: the position scale μ from master to slave times the force scale λ from slave to master"),
    ("limit cycle", "an oscillation of constant amplitude while the hand holds still"),
    ("canceller", "the node that predicts the motion that the reflected force causes, and subtracts it from the command"),
    ("seen", "shown by the recording itself: a node's recorded output differs from its response to the recorded inputs"),
    ("re-simulated", "a simulation of the loop from its models with the recorded hand, with all differences found"),
    ("force left", "the force that reaches the hand, relative to λ times the contact force with the λ of the bag"),
    ("motion left", "the share of the hand's motion in free space that is sent to the slave, relative to the master without force"),
];
