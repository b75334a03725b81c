//! The page of a fleet: what changed, small multiples by unit and month, and the parameters of all units. It is made of one table.

use crate::parts::ending;
use backdrive_fleet::analysis::{Analysis, Change, amount};
use backdrive_fleet::date::Date;
use backdrive_fleet::parameter::Parameter;
use backdrive_fleet::table::{Table as Rows, TableRow};
use backdrive_report::{Align, Cell, Figure, Page, Plot, Table, Tone, number};
use std::collections::{BTreeMap, BTreeSet};

/// Small multiples, at most.
const MOST_PICTURES: usize = 12;
/// Joints whose units are drawn beside each other, at most.
const MOST_JOINTS: usize = 8;
/// Rows of a table that is not folded away, at most.
const MOST_ROWS: usize = 30;
/// Months from which on values are drawn as medians of months, not recording by recording.
const MONTHS: usize = 4;
/// Recordings without an answer that are listed, at most.
const MOST_LEFT_OUT: usize = 200;

const TERMS: [(&str, &str); 5] = [
    ("unit", "one device of the fleet"),
    ("pooled", "estimate of a unit that uses the whole fleet: few recordings draw it towards the fleet's mean (empirical Bayes)"),
    ("together", "a shift that most units show at the same dates; it is removed before a unit is judged"),
    ("q", "false discovery rate at which the row would just be named (Benjamini and Hochberg), over all units, joints and parameters"),
    ("95 %", "interval that holds the true change in 95 of 100 cases, over all dates that are possible"),
];

/// The page.
pub fn page(table: &Rows, found: &Analysis) -> Page {
    let mut page = Page::new("The fleet");
    lead(&mut page, found);
    for note in &found.notes {
        page.note(note);
    }
    if !found.changes.is_empty() {
        page.section("What changed on single units");
        page.table(changes(found.changes.iter().take(MOST_ROWS), table));
        if found.changes.len() > MOST_ROWS {
            let rest = &found.changes[MOST_ROWS..];
            page.details(&format!("{} further changes", rest.len()), |inside| {
                inside.table(changes(rest.iter(), table));
            });
        }
        multiples(&mut page, table, found);
    }
    if !found.together.is_empty() {
        page.section("What the fleet did together");
        page.table(changes(found.together.iter(), table));
    }
    if !found.odd.is_empty() {
        page.section("Units that differ from the others");
        let mut odd = Table::new(["unit", "joint", "what", "q"]);
        for one in &found.odd {
            let what = one.sentence.split_once(": ").map_or(one.sentence.as_str(), |(_, what)| what);
            odd.push([one.unit.clone(), one.joint.clone(), what.to_string(), number(one.q)]);
        }
        page.table(odd);
    }
    units(&mut page, table, found);
    parameters(&mut page, found);
    if !found.left_out.is_empty() {
        page.section("Recordings that are in no number");
        page.details(&format!("{} recordings", found.left_out.len()), |inside| {
            let mut left = Table::new(["recording", "unit", "why"]);
            for one in found.left_out.iter().take(MOST_LEFT_OUT) {
                left.push([one.recording.clone(), one.unit.clone(), one.why.clone()]);
            }
            inside.table(left);
        });
    }
    ending(&mut page, &TERMS);
    page
}

fn lead(page: &mut Page, found: &Analysis) {
    let of = format!("{} units, {} recordings", found.units, found.recordings);
    match found.changes.first() {
        Some(first) => {
            let changed: BTreeSet<&str> = found.changes.iter().map(|change| change.unit.as_str()).collect();
            let more = if changed.len() > 1 { format!(" {} units changed.", changed.len()) } else { String::new() };
            page.lead(Tone::Bad, &format!("{of}. The clearest change: {}.{more}", first.sentence));
        }
        None if !found.odd.is_empty() => {
            page.lead(
                Tone::Unsure,
                &format!("{of}. No unit changed; {} differ from the others.", count_of(found.odd.iter().map(|o| o.unit.as_str()))),
            );
        }
        None => {
            page.lead(Tone::Good, &format!("{of}. No unit changed, and none differs from the others."));
        }
    }
}

fn count_of<'a>(units: impl Iterator<Item = &'a str>) -> usize {
    units.collect::<BTreeSet<_>>().len()
}

fn changes<'a>(of: impl Iterator<Item = &'a Change>, rows: &Rows) -> Table {
    let mut table =
        Table::new(["unit", "joint", "parameter", "change", "since", "possible dates", "recordings since", "q"]).align(6, Align::Right);
    for change in of {
        let Some(parameter) = Parameter::of(change.parameter) else { continue };
        let is_servo = is_servo(rows, &change.joint);
        let size = amount(change.effect, change.ci95, change.before, parameter, is_servo);
        let interval = change.sentence.rsplit_once(" (95 %: ").map_or(String::new(), |(_, rest)| format!(" (95 %: {rest}"));
        let [first, last] = &change.possible;
        table.push([
            Cell::from(change.unit.clone()),
            change.joint.clone().into(),
            parameter.said(is_servo).into(),
            Cell::tone(format!("{size}{interval}"), Tone::Bad),
            change.since.clone().into(),
            if first == last { first.clone() } else { format!("{first} to {last}") }.into(),
            change.recordings.to_string().into(),
            number(change.q).into(),
        ]);
    }
    table
}

fn is_servo(rows: &Rows, joint: &str) -> bool {
    rows.rows.iter().find(|row| row.joint == joint).is_some_and(TableRow::is_servo)
}

/// Of each changed unit and joint the clearest change: the unit's values over the range of the fleet.
fn multiples(page: &mut Page, rows: &Rows, found: &Analysis) {
    let mut drawn: Vec<(&str, &str)> = Vec::new();
    let mut figures: Vec<Figure> = Vec::new();
    for change in &found.changes {
        let place = (change.unit.as_str(), change.joint.as_str());
        if drawn.contains(&place) || figures.len() == MOST_PICTURES {
            continue;
        }
        drawn.push(place);
        figures.extend(multiple(rows, change));
    }
    if !figures.is_empty() {
        let caption =
            "The clearest change of each unit and joint: its values, and the middle 80 % of the other units. The line marks the change.";
        page.figure(Figure::beside(figures), caption);
    }
}

fn multiple(rows: &Rows, change: &Change) -> Option<Figure> {
    let parameter = Parameter::of(change.parameter)?;
    let of: Vec<(Date, f64, bool)> = rows
        .rows
        .iter()
        .filter(|row| row.joint == change.joint && row.error.is_empty())
        .filter_map(|row| Some((row.date?, row.estimate(change.parameter)?.0, row.unit == change.unit)))
        .collect();
    let first = of.iter().map(|(date, ..)| *date).min()?;
    let mut months: Vec<String> = of.iter().map(|(date, ..)| date.month()).collect();
    months.sort();
    months.dedup();
    let by_month = months.len() >= MONTHS;
    let place = |date: Date| match by_month {
        true => months.iter().position(|month| *month == date.month()).unwrap_or(0) as f64 + 1.0,
        false => (date.days() - first.days()) as f64,
    };
    // Keys of the map are thousandths of a place: times of one day are one place.
    let mut own: BTreeMap<i64, Vec<f64>> = BTreeMap::new();
    let mut others: BTreeMap<i64, Vec<f64>> = BTreeMap::new();
    for (date, value, is_own) in &of {
        let key = (1000.0 * place(*date)) as i64;
        if *is_own { &mut own } else { &mut others }.entry(key).or_default().push(*value);
    }
    let quantile = |values: &Vec<f64>, share: f64| {
        let mut sorted = values.clone();
        sorted.sort_by(f64::total_cmp);
        sorted[((sorted.len() - 1) as f64 * share).round() as usize]
    };
    let x = |map: &BTreeMap<i64, Vec<f64>>| map.keys().map(|key| *key as f64 / 1000.0).collect::<Vec<f64>>();
    let y = |map: &BTreeMap<i64, Vec<f64>>, share: f64| map.values().map(|values| quantile(values, share)).collect::<Vec<f64>>();
    let is_servo = is_servo(rows, &change.joint);
    let title = format!("{}, {}: {}", change.unit, change.joint, parameter.said(is_servo));
    let mut plot = Plot::new(&title).y_axis("", parameter.unit(is_servo));
    plot = match by_month {
        true => plot.x_axis("month", "").x_names(months.clone()),
        false => plot.x_axis(&format!("time since {}", first.words()), "d"),
    };
    if !others.is_empty() {
        plot = plot.band("other units", &x(&others), &y(&others, 0.1), &y(&others, 0.9));
    }
    plot = match by_month {
        true => plot.line(&change.unit, &x(&own), &y(&own, 0.5)),
        false => plot.points(&change.unit, &x(&own), &y(&own, 0.5)),
    };
    if let Some(since) = Date::parse(&change.since) {
        plot = plot.vertical(place(since), "change", Tone::Bad);
    }
    Some(plot.into())
}

/// Recordings of a unit: all, and those of each month.
type Counts<'r> = (BTreeSet<&'r str>, BTreeMap<String, BTreeSet<&'r str>>);

/// Units by month: recordings, and what is known of each unit.
fn units(page: &mut Page, rows: &Rows, found: &Analysis) {
    let mut months: Vec<String> = rows.rows.iter().filter_map(|row| row.date.map(Date::month)).collect();
    months.sort();
    months.dedup();
    let mut counts: BTreeMap<&str, Counts> = BTreeMap::new();
    for row in &rows.rows {
        let of = counts.entry(&row.unit).or_default();
        of.0.insert(&row.recording);
        if let Some(date) = row.date {
            of.1.entry(date.month()).or_default().insert(&row.recording);
        }
    }
    page.section("Units by month");
    let changed = |unit: &str| found.changes.iter().filter(|change| change.unit == unit).count();
    let odd = |unit: &str| found.odd.iter().filter(|odd| odd.unit == unit).count();
    let left = |unit: &str| found.left_out.iter().filter(|left| left.unit == unit).count();
    // The units that need a look come first.
    let mut order: Vec<&str> = counts.keys().copied().collect();
    order.sort_by_key(|unit| std::cmp::Reverse((changed(unit), odd(unit), left(unit))));
    let table = |units: &[&str]| {
        let heads = ["unit", "changes", "differs", "left out", "recordings"].into_iter().map(str::to_string).chain(months.iter().cloned());
        let mut table = Table::new(heads.collect::<Vec<_>>());
        for unit in units {
            let (all, by_month) = &counts[unit];
            let cell = |count: usize| if count > 0 { Cell::tone(count.to_string(), Tone::Bad) } else { Cell::from("") };
            let mut cells = vec![Cell::from(*unit), cell(changed(unit)), cell(odd(unit)), cell(left(unit)), all.len().to_string().into()];
            cells.extend(months.iter().map(|month| Cell::from(by_month.get(month).map_or(String::new(), |of| of.len().to_string()))));
            table.push(cells);
        }
        table
    };
    page.table(table(&order[..order.len().min(MOST_ROWS)]));
    if order.len() > MOST_ROWS {
        page.details(&format!("{} further units", order.len() - MOST_ROWS), |inside| {
            inside.table(table(&order[MOST_ROWS..]));
        });
    }
}

/// Parameters of the fleet, and the dry friction of each unit with its interval.
fn parameters(page: &mut Page, found: &Analysis) {
    if found.parameters.is_empty() {
        return;
    }
    page.section("Parameters");
    let mut table = Table::new(["joint", "parameter", "fleet's mean", "unit", "sd between units", "sd between recordings", "follows"]);
    for of in &found.parameters {
        let Some(parameter) = Parameter::of(of.parameter) else { continue };
        let follows = match &of.covariate {
            Some(by) if by.time_constant.is_some() => {
                format!("{} more at the start, {} s to warm up", number(by.slope), by.time_constant.map_or(String::new(), number))
            }
            Some(by) => format!("{} ± {} per °C", number(by.slope), number(by.sd)),
            None => String::new(),
        };
        let pooled = &of.pooled;
        let mean = format!("{} ± {}", number(pooled.mean), number(pooled.mean_sd));
        table.push([
            of.joint.clone(),
            parameter.words.to_string(),
            mean,
            of.unit.to_string(),
            number(pooled.between_sd),
            number(pooled.within_sd),
            follows,
        ]);
    }
    page.table(table);
    let friction = found.parameters.iter().filter(|of| of.parameter == "dry").take(MOST_JOINTS);
    let figures: Vec<Figure> = friction
        .map(|of| {
            let units = &of.pooled.units;
            let x: Vec<f64> = (1..=units.len()).map(|i| i as f64).collect();
            let pick =
                |of_unit: &dyn Fn(&backdrive_fleet::analysis::pooled::OfUnit) -> f64| units.values().map(of_unit).collect::<Vec<f64>>();
            let plot =
                Plot::new(&format!("{}: dry friction", of.joint)).x_axis("unit", "").y_axis("", of.unit).x_names(units.keys().cloned());
            let plot = plot.band("95 %", &x, &pick(&|unit| unit.ci95[0]), &pick(&|unit| unit.ci95[1]));
            Figure::from(plot.points("pooled", &x, &pick(&|unit| unit.value)))
        })
        .collect();
    if !figures.is_empty() {
        page.figure(Figure::beside(figures), "Dry friction of each unit by partial pooling; of a changed unit since its change.");
    }
}
