//! Paper 000 reproduced: the ball-screw axis, its friction and its controllers, figure by figure.
//!
//! No constant and no curve of the rig survives in the text that we have: every value is ours, and the paper's statements about shape
//! and order are what is held against.

mod drift;
mod identify;
mod nested;
mod network;
mod tracking;

use crate::papers::device;
use crate::run::read;
use crate::table::Report;
use crate::{Context, Study, StudyError};
use backdrive_control::controller::AxisModel;
use backdrive_plant::elements::{Law, kind_named};
use backdrive_plant::model::Model;
use backdrive_report::{Cell, Page, Table, Tone};

pub(crate) const STUDY: Study =
    Study { name: "ball_screw", about: "paper 000 reproduced: drift, nested loops, transition curves, controllers", needs: ("", &[]), run };

const PAPER: &str = "Choi, Han & Kim 2006";
const FILE: &str = "ball-screw-preisach.toml";
/// mm of the carriage per rad of the screw, of a lead of 5 mm (chosen).
const MM: f64 = 5.0 / std::f64::consts::TAU;

/// Which friction an axis has.
#[derive(Clone, Copy, PartialEq)]
enum Friction {
    Lugre,
    Literal,
    Gated,
}

impl Friction {
    const ALL: [Friction; 3] = [Friction::Lugre, Friction::Literal, Friction::Gated];

    fn name(self) -> &'static str {
        match self {
            Friction::Lugre => "LuGre",
            Friction::Literal => "eqs (4)-(6) as printed",
            Friction::Gated => "gated",
        }
    }
}

fn failed(error: impl std::fmt::Display) -> StudyError {
    StudyError::Diagnosis(error.to_string())
}

/// The axis of the project with one of the friction laws; all have the same numbers where they have the same ones.
fn axis(friction: Friction) -> Result<Model, StudyError> {
    let mut model = Model::from_toml(&read(&device(FILE))?, FILE)?;
    let element = model.elements.iter_mut().find(|e| matches!(e.law, Law::PreisachLugre(_)));
    let element = element.ok_or_else(|| failed(format!("{FILE} has no preisach_lugre")))?;
    let mut values = element.law.values();
    let kind = match friction {
        Friction::Gated => return Ok(model),
        Friction::Literal => {
            if let Some(gate) = values.last_mut() {
                *gate = vec![0.0];
            }
            element.law.kind()
        }
        Friction::Lugre => {
            values.truncate(5);
            kind_named("lugre").ok_or_else(|| failed("there is no kind lugre"))?
        }
    };
    element.law = (kind.build)(&values).map_err(failed)?;
    Ok(model)
}

/// The friction alone, to be moved by hand.
fn rubbing(friction: Friction) -> Result<AxisModel, StudyError> {
    AxisModel::new(&axis(friction)?, 0).map_err(failed)
}

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
