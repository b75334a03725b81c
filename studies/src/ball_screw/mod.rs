//! Paper 000 reproduced: the ball-screw axis, its friction and its controllers, figure by figure.
//!
//! No constant and no curve of the rig survives in the text that we have: every value is ours, and is compared with the paper's statements about
//! shape and order.

mod axis;
mod drift;
mod identify;
mod nested;
mod network;
mod tracking;

use crate::table::Report;
use crate::{Context, Study, StudyError};
use backdrive_report::{Cell, Page, Table, Tone};

pub(crate) const STUDY: Study =
    Study { name: "ball_screw", about: "paper 000 reproduced: drift, nested loops, transition curves, controllers", needs: ("", &[]), run };

fn run(context: &Context) -> Result<Report, StudyError> {
    let mut report = Report::new("Paper 000: the ball-screw axis");
    let mut page = Page::new("The ball-screw axis of Choi, Han & Kim 2006, reproduced");
    page.text(
        "The text of the paper that we have holds its equations, captions and axis labels, but no curve and hardly a number: every value here is \
         ours, chosen in plant/models/ball-screw-preisach.toml, and what is held against the paper is what it says of shape and order. \
         Figures carry the paper's numbers. Positions are of a carriage on a lead of 5 mm.",
    );
    drift::run(&mut report, &mut page)?;
    nested::run(&mut report, &mut page)?;
    let found = identify::run(&mut report, &mut page, context.quick)?;
    tracking::run(&mut report, &mut page, &found, context.quick)?;
    page.section("All figures");
    match report.missed() {
        0 => {
            page.lead(Tone::Good, "What the paper claims of its friction model and its controllers can be seen, once its eq (5) is gated.")
        }
        n => page.lead(Tone::Warning, &format!("{n} of the bars are missed.")),
    };
    let mut table = Table::new(["", "measured", "published", "source", "bar"]);
    for line in &report.lines {
        let met = match line.within {
            Some(true) => Cell::tone("met", Tone::Good),
            Some(false) => Cell::tone("missed", Tone::Bad),
            None => Cell::from(""),
        };
        let words = [&line.what, &line.measured, &line.published, &line.source].map(|word| Cell::from(word.as_str()));
        table.push(words.into_iter().chain([met]));
    }
    page.table(table);
    let path = context.out.join("report.html");
    page.write(&path).map_err(|e| StudyError::Write(format!("{}: cannot be written: {e}", path.display())))?;
    report.notes.push(format!("Figures: {}", path.display()));
    Ok(report)
}
