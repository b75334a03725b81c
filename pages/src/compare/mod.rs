//! The page of a comparison: which law to take, one picture, one table.

pub mod cells;
pub mod choice;
pub mod compared;

use crate::offered::Step;
use crate::parts::{ending, sentence, symbols, todo};
use backdrive_report::{Cell as Shown, Colour, Figure, Page, Plot, Series, Table, Tone, number};
use backdrive_stability::compare::{Cell, Varied};
use backdrive_stability::outcome::Outcome;
use cells::{COLUMNS, row};
use choice::{Law, RESERVE, choice, decibels, laws};
use compared::Compared;

/// The terms of the page.
const TERMS: [(&str, &str); 4] = [
    ("μλ", "the loop's gain: the position scale μ from master to slave times the force scale λ from slave to master"),
    ("limit", "the μλ above which the loop is not stable while the hand presses on the wall"),
    ("link", "delay, jitter and loss of packets between master and slave, the same each way"),
    ("canceller", "the law direct, with the master's response to the reflected force subtracted from the motion"),
];

/// A quantity of a cell, for one curve of the picture.
type Of = fn(&Cell) -> Option<f64>;

/// The page; `steps` are what to do next.
pub fn page(compared: &Compared, steps: &[Step]) -> Page {
    let [mu, lambda] = compared.gains;
    let mut page = Page::new("Comparison of coupling laws");
    let laws = laws(compared);
    page.lead(tone(&laws), &choice::sentence(compared));
    todo(&mut page, steps);
    page.table(summary(&laws).caption(&format!(
        "The least favourable of all conditions compared, at μλ = {}. Reserve: the stability limit over this gain.",
        number(mu * lambda)
    )));
    page.text(&format!("{}: {}", compared.session, sentence(compared.title)));
    for note in compared.notes {
        page.note(&sentence(note));
    }
    if compared.cells.len() < compared.asked {
        page.warning(&format!("Interrupted: {} of {} comparisons were done.", compared.cells.len(), compared.asked));
    }
    page.section("Against the delay of the link");
    if let Some(figure) = picture(compared) {
        let caption = format!(
            "Top: the stability limit (higher is better); if none was found, the highest gain tried. Below, at μλ = {}: the displayed \
             share of the wall's stiffness (100 % is transparent; missing if the loop does not come to rest), the drag in free motion, \
             and the position error of the slave before contact.",
            number(mu * lambda)
        );
        page.figure(figure, &caption);
    } else {
        page.text("No delay was compared, so there is no figure.");
    }
    page.section("All conditions");
    let mut table = Table::new(std::iter::once("link").chain(COLUMNS.map(|c| c.0)));
    for cell in compared.cells {
        let mut cells = vec![Shown::from(cell.condition.text())];
        for (column, text) in row(cell, compared.highest).into_iter().enumerate() {
            cells.push(match column {
                2 => Shown::tone(text, tone_of(&cell.outcome)),
                _ => Shown::from(text),
            });
        }
        table.push(cells);
    }
    page.table(table.caption(&format!(
        "At μ = {}, λ = {}. Stability limits were searched up to μλ = {}, to within 5 %.",
        number(mu),
        number(lambda),
        number(compared.highest)
    )));
    let terms: Vec<(&str, &str)> = TERMS.into_iter().chain(COLUMNS.into_iter().skip(2)).collect();
    ending(&mut page, &terms);
    symbols(&mut page);
    page
}

fn tone_of(outcome: &Outcome) -> Tone {
    match outcome {
        Outcome::Stable => Tone::Good,
        Outcome::LimitCycle { .. } => Tone::Warning,
        Outcome::Unstable { .. } => Tone::Bad,
        Outcome::Limited { .. } => Tone::Limited,
        Outcome::NotJudged { .. } => Tone::Unsure,
    }
}

/// The colour of the choice.
fn tone(laws: &[Law]) -> Tone {
    match choice(laws) {
        Some(law) if law.reserve >= RESERVE => Tone::Good,
        Some(_) => Tone::Warning,
        None => Tone::Bad,
    }
}

/// A row per law.
fn summary(laws: &[Law]) -> Table {
    let taken = choice(laws).map(|law| law.name);
    let mut table = Table::new(["law", "", "reserve", "stiffness displayed", "drag"]);
    for law in laws {
        let (word, tone) = match law.is_stable {
            true if taken == Some(law.name) => ("take this", Tone::Good),
            true => ("stable", Tone::Neutral),
            false => ("not stable", Tone::Bad),
        };
        let stiffness = law.stiffness.map_or("–".to_string(), |share| format!("{:.0} %", 100.0 * share));
        let drag = law.drag.map_or("–".to_string(), |drag| format!("{drag:.1} N s/m"));
        let reserve = Shown::tone(decibels(law.reserve), if law.reserve >= RESERVE { Tone::Good } else { Tone::Warning });
        table.push([Shown::from(law.name), Shown::tone(word, tone), reserve, stiffness.into(), drag.into()]);
    }
    table
}

/// Four quantities over the delay, a line per law.
fn picture(compared: &Compared) -> Option<Figure> {
    let over_delay: Vec<&Cell> = compared.cells.iter().filter(|c| c.condition.varied == Varied::Delay).collect();
    if over_delay.is_empty() {
        return None;
    }
    let laws = laws(compared);
    let plot = |plot: Plot, of: Of| {
        laws.iter().enumerate().fold(plot, |plot, (index, Law { name: law, .. })| {
            let points = over_delay.iter().filter(|c| c.rival == *law).filter_map(|c| Some((1e3 * c.condition.delay_s, of(c)?)));
            let (x, y): (Vec<f64>, Vec<f64>) = points.unzip();
            // A line through one point is none.
            let series = if x.len() > 1 { Series::line(law, &x, &y) } else { Series::points(law, &x, &y) };
            plot.series(series.colour(Colour::Nth(index)))
        })
    };
    let edge: Of = |c| c.critical_gain.or((c.stable_up_to > 0.0).then_some(c.stable_up_to));
    let first = Plot::new("Stability limit").x_axis("delay each way", "ms").y_axis("stability limit μλ", "").y_log().height(230.0);
    let share =
        Plot::new("Displayed stiffness").y_axis("of the wall's", "%").include_y(0.0).horizontal(100.0, "", Tone::Good).height(180.0);
    let drag = Plot::new("Drag in free motion").y_axis("drag", "N s/m").include_y(0.0).height(180.0);
    let off = Plot::new("Position error of the slave in free motion").y_axis("error", "m").include_y(0.0).height(180.0);
    Some(Figure::stacked([
        plot(first, edge),
        plot(share, |c| c.measures.stiffness_share.map(|s| 100.0 * s)),
        plot(drag, |c| c.measures.drag),
        plot(off, |c| c.measures.tracking_free),
    ]))
}
