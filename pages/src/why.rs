//! The page of `backdrive why`: what happens, why, and what would stop it, for a colleague who was not there.

use crate::offered::Step;
use crate::parts::{ending, large, todo};
use backdrive_report::{Figure, Page, Plot, Table, Tone, number, percent};
use backdrive_stability::session::Session;
use backdrive_why::answer::Answer;
use backdrive_why::happening::Happening;

/// Causes that are less likely are not shown.
const UNLIKELY: f64 = 0.01;

/// Where the signals alone do not say why.
pub const NO_CAUSE: &str = "cannot be told: what there is holds no model of the loop and no excitation that measures it";

/// The page of an answer about a session, with what to do next; `tries` are the commands that try each remedy, in their order.
pub fn page(found: &Answer, session: &Session, tries: &[Step], steps: &[Step]) -> Page {
    let name = std::path::Path::new(&found.bag).file_name().map_or(found.bag.clone(), |n| n.to_string_lossy().into_owned());
    let mut page = Page::new(&format!("Why does it shake? {name}"));
    page.lead(tone(found), &lead(found));
    if let Some(beneath) = &found.beneath {
        page.text(&format!("Without that limit: {beneath}."));
    }
    if !found.reproduced && found.again.is_some() {
        page.warning(
            "The loop of the graph, with everything that was found, does something else when it is run again than what was recorded. Something is not known, and \
             what follows is less sure.",
        );
    }
    todo(&mut page, steps);
    pictures(&mut page, found, session);
    page.section("Causes");
    causes(&mut page, found);
    page.section("What would stop it");
    remedies(&mut page, found, tries);
    page.section("Where the recording is not what its graph says");
    if found.differs.is_empty() {
        page.text("Nowhere: every node does of what it was given what the graph says of it.");
    }
    found.differs.iter().for_each(|d| {
        page.text(&format!("{d}."));
    });
    if !found.events.is_empty() {
        page.section("What the nodes told");
        let mut table = Table::new(["event", "times"]);
        for (kind, count) in &found.events {
            table.push([kind.replace('_', " "), count.to_string()]);
        }
        page.table(table);
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
        text += &format!(" The likeliest cause is {} (confidence {}).", first.kind.words(), percent(first.confidence));
    }
    text
}

fn pictures(page: &mut Page, found: &Answer, session: &Session) {
    let Some(axis) = session.axes.first() else { return };
    page.section("The loop, recorded and run again");
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
        plot = plot.line("run again as it was", &time(again), &drawn(&a.master));
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
        "What the master did, what the loop does when it is run again with everything that was found, and with the first remedy.",
    );
}

fn causes(page: &mut Page, found: &Answer) {
    if found.causes.is_empty() {
        let trouble = found.happening.is_trouble();
        page.text(&if trouble { format!("The cause {}.", NO_CAUSE) } else { "Nothing shakes, so nothing is the cause.".to_string() });
        return;
    }
    page.text(
        "The loop was run again as it was, and once more without each suspect. A suspect that was seen in the recording counts more than one that the graph states; \
         one without which the loop still shakes counts little.",
    );
    let mut table = Table::new(["cause", "where", "confidence", "seen", "without it", "stable up to μλ, without it"]);
    for cause in found.causes.iter().filter(|c| c.confidence >= UNLIKELY) {
        table.push([
            large(cause.kind.words()),
            cause.place.clone(),
            percent(cause.confidence),
            if cause.seen { "yes" } else { "no" }.to_string(),
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
        page.text(if found.happening.is_trouble() { "Nothing could be tried." } else { "Nothing needs to be stopped." });
        return;
    }
    let mut table = Table::new([
        "remedy",
        "the loop then",
        "stops it",
        "with other grips and more gain",
        "force left",
        "motion left",
        "beyond what was recorded",
        "how it is tried",
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
            tries.get(index).and_then(Step::pasted).unwrap_or_default(),
        ]);
    }
    page.table(table);
}

/// The terms of the page.
const TERMS: [(&str, &str); 7] = [
    ("μλ", "the loop's gain: the position scale μ from master to slave times the force scale λ from slave to master"),
    ("limit cycle", "an oscillation that neither dies out nor grows while the hand holds still"),
    ("canceller", "the node that predicts the motion that the reflected force makes, and takes it out of the command"),
    ("seen", "the recording itself shows it: a node's recorded output is not what its recorded inputs make of it"),
    ("run again", "the loop of the bag run from its models with the recorded hand, with everything that was found"),
    ("force left", "the force that reaches the hand, against λ times the contact force with the λ of the bag"),
    ("motion left", "how much of the hand's motion in free space the slave is told, against the master without force"),
];
