//! Tables: hypotheses, numbers, records, the audit.

use super::phrases::adds;
use backdrive_diagnosis::audit::Weight;
use backdrive_diagnosis::belief::intervals::Uncertainty;
use backdrive_diagnosis::belief::parameters::{Row, correlated, rows};
use backdrive_diagnosis::diagnose::Diagnosis;
use backdrive_diagnosis::output_error::candidate::{Candidate, advantage_over};
use backdrive_report::{Cell, Page, Table, Tone, number, percent, si};

/// Hypotheses that are shown at once.
const SHOWN: usize = 25;
/// Differences of the information criterion below which two structures are as good as each other.
const ALIKE: f64 = 10.0;
/// Correlations from here on are named.
const CORRELATED: f64 = 0.9;

/// What a structure adds, in words.
fn structure_in_words(candidate: &Candidate) -> String {
    match candidate.structure.added.len() {
        0 => "the nominal model, refitted".to_string(),
        n => (0..n).map(|which| super::force::in_words(candidate, which)).collect::<Vec<_>>().join(" + "),
    }
}

pub(super) fn hypotheses(page: &mut Page, found: &Diagnosis, best: &Candidate) {
    let search = &found.search;
    page.text(&format!(
        "{} hypotheses were screened, {} structures fitted, in {} simulations of a recording.",
        search.hypotheses,
        search.found.len(),
        search.simulations
    ));
    let mut fitted = Table::new(["structure fitted", "parameters", "residual, in noise sd", "worse than the chosen one", ""]);
    let level = |c: &Candidate| c.levels.iter().fold(0.0f64, |a, b| a.max(*b));
    let mut push = |c: &Candidate| {
        let behind = -advantage_over(best, c, search.samples);
        let (why, tone) = match () {
            () if c.structure.name() == best.structure.name() => ("chosen".to_string(), Tone::Good),
            () if c.structure.added.len() < best.structure.added.len() && behind > ALIKE => ("too simple".to_string(), Tone::Neutral),
            () if behind.abs() <= ALIKE && c.structure.free.len() > best.structure.free.len() => {
                ("as good, more parameters".to_string(), Tone::Unsure)
            }
            () if behind.abs() <= ALIKE => ("as good".to_string(), Tone::Unsure),
            () if behind < 0.0 => ("better, not significantly".to_string(), Tone::Unsure),
            () => ("explains less".to_string(), Tone::Neutral),
        };
        let behind = if c.structure.name() == best.structure.name() { "–".to_string() } else { number(behind) };
        fitted.push([
            Cell::tone(structure_in_words(c), tone),
            c.structure.free.len().to_string().into(),
            number(level(c)).into(),
            behind.into(),
            Cell::tone(why, tone),
        ]);
    };
    push(&search.nominal);
    search.found.iter().take(SHOWN).for_each(&mut push);
    page.table(
        fitted
            .caption("Residual: rms of the worst output. Worse: difference of the information criterion, which penalises each parameter."),
    );

    let mut all: Vec<_> = search.tried.iter().collect();
    all.sort_by(|a, b| b.taken.unwrap_or(-1.0).total_cmp(&a.taken.unwrap_or(-1.0)).then(b.promised.total_cmp(&a.promised)));
    let least = all.iter().filter(|t| t.taken.is_some()).map(|t| t.promised).fold(f64::INFINITY, f64::min);
    let table = |part: &[&backdrive_diagnosis::search::Tried]| {
        let mut table = Table::new(["physics", "place", "promised by screening", "achieved by the fit", "why not"]);
        for tried in part {
            let (physics, place) = tried.id.split_once('@').unwrap_or((&tried.id, ""));
            let is_chosen = best.structure.added.iter().any(|h| h.id == tried.id);
            let why = match tried.taken {
                _ if is_chosen => Cell::tone("part of what is claimed", Tone::Good),
                Some(taken) if taken < 0.01 => Cell::from("explains nothing once the parameters are free"),
                Some(_) => Cell::from("others explain more"),
                None if tried.promised < least => Cell::from("promised less than those fitted"),
                None => Cell::from("similar ones promised more, or the search ended"),
            };
            let taken = tried.taken.map_or("not fitted".to_string(), percent);
            table.push([
                Cell::from(backdrive_diagnosis::verdict::words::physics(physics)),
                place.into(),
                percent(tried.promised).into(),
                taken.into(),
                why,
            ]);
        }
        table.caption("Shares of the residual of the refitted nominal model.")
    };
    let (first, rest) = all.split_at(all.len().min(SHOWN));
    page.details(&format!("Single effects, {} of {}", first.len(), all.len()), |inside| {
        inside.table(table(first));
    });
    if !rest.is_empty() {
        page.details(&format!("The other {}", rest.len()), |inside| {
            inside.table(table(rest));
        });
    }
}

pub(super) fn numbers(page: &mut Page, found: &Diagnosis, best: &Candidate) {
    let problem = &found.problem;
    let nominal = &found.search.nominal;
    let (before_spread, after_spread) = (Uncertainty::of(nominal), Uncertainty::of(best));
    let (before, after) = (rows(problem, nominal, &before_spread), rows(problem, best, &after_spread));
    let added = adds(best);
    let mut header = vec!["parameter", "unit", "nominal", "refitted alone", "change", "moved, in sd"];
    if added {
        header.extend(["diagnosed", "95 % interval", "change", "moved, in sd"]);
    } else {
        header.push("95 % interval");
    }
    let mut table = Table::new(header);
    let interval =
        |r: &Row| if r.determined { format!("{} to {}", number(r.ci95[0]), number(r.ci95[1])) } else { "not determined".to_string() };
    let moved = |r: Option<&Row>| match r.and_then(|r| r.moved_sd.filter(|s| s.is_finite() && r.determined)) {
        Some(sd) => Cell::tone(number(sd), if sd.abs() > 5.0 { Tone::Warning } else { Tone::Neutral }),
        None => Cell::from("–"),
    };
    let change = |r: Option<&Row>| match r.and_then(|r| Some((r.value, r.given.filter(|g| *g != 0.0 && r.determined)?))) {
        Some((value, given)) => format!("{:+.1} %", 100.0 * (value - given) / given.abs()),
        None => "–".to_string(),
    };
    let mut names: Vec<&Row> = before.iter().collect();
    names.extend(after.iter().filter(|r| !before.iter().any(|b| b.name == r.name)));
    for row in names {
        let (b, a) = (before.iter().find(|r| r.name == row.name), after.iter().find(|r| r.name == row.name));
        let value = |r: Option<&Row>| {
            r.map_or("–".to_string(), |r| format!("{}{}", number(r.value), if r.at_bound { " (at its bound)" } else { "" }))
        };
        let mut cells = vec![
            Cell::from(row.name.clone()),
            row.unit.clone().into(),
            row.given.map_or("–".to_string(), number).into(),
            value(b).into(),
            change(b).into(),
            moved(b),
        ];
        if added {
            cells.extend([value(a).into(), a.map_or("–".to_string(), interval).into(), change(a).into(), moved(a)]);
        } else {
            cells.push(b.map_or("–".to_string(), interval).into());
        }
        table.push(cells);
    }
    page.table(table.caption(
        "A missing effect distorts parameters: one that changes much in the refit, and returns once the effect is added, had absorbed \
                it.",
    ));
    let (which, spread) = if added { (best, &after_spread) } else { (nominal, &before_spread) };
    let pairs = correlated(problem, which, spread, CORRELATED);
    if !pairs.is_empty() {
        let text: Vec<String> = pairs.iter().take(8).map(|p| format!("{} with {} ({:.2})", p.first, p.second, p.correlation)).collect();
        page.note(&format!("The recordings hardly separate these parameters: {}.", text.join("; ")));
    }
}

pub(super) fn per_record(page: &mut Page, found: &Diagnosis) {
    let fits = &found.per_record;
    page.text(&format!("The nominal structure, refitted to each record alone: {}.", fits.sentence()));
    if fits.records.len() < 2 {
        return;
    }
    let mut header = vec!["parameter".to_string()];
    header.extend(fits.records.iter().map(|r| crate::parts::file_name(r).to_string()));
    header.push("probability of this scatter".to_string());
    let mut table = Table::new(header);
    for across in &fits.numbers {
        let disagree = fits.disagreements().iter().any(|d| d.name == across.name);
        let mut cells = vec![Cell::from(across.name.clone())];
        cells.extend(across.own.iter().map(|own| {
            if own.determined {
                let half = 0.5 * (own.ci95[1] - own.ci95[0]);
                Cell::from(format!("{} ± {}", number(own.value), number(half)))
            } else {
                Cell::from("not determined")
            }
        }));
        let tone = if disagree { Tone::Bad } else { Tone::Neutral };
        let chance = if across.own.iter().filter(|o| o.determined).count() < 2 {
            "–".to_string()
        } else {
            backdrive_diagnosis::verdict::words::share(across.p_value)
        };
        cells.push(Cell::tone(chance, tone));
        table.push(cells);
    }
    page.table(table.caption(
        "± half the width of the 95 % interval. A device has one set of parameters: if records disagree, the model structure is wrong.",
    ));
}

pub(super) fn audit(page: &mut Page, found: &Diagnosis) {
    let problem = &found.problem;
    let mut files = Table::new(["recording", "samples", "rate", "length", "used for"]);
    for (records, use_) in [(&problem.fit, "fits"), (&problem.held_out, "held out")] {
        for record in records {
            files.push([
                crate::parts::file_name(&record.name).to_string(),
                record.len.to_string(),
                si(1.0 / record.period, "Hz"),
                si(record.len as f64 * record.period, "s"),
                use_.to_string(),
            ]);
        }
    }
    page.table(files);
    let mut table = Table::new(["checked", "where", "seen", "weight"]);
    for remark in &found.remarks {
        let (word, tone) = match remark.weight {
            Weight::Note => ("note", Tone::Neutral),
            Weight::Caution => ("caution", Tone::Warning),
            Weight::Unusable => ("unusable", Tone::Bad),
        };
        table.push([Cell::from(remark.about), remark.place().into(), remark.text.clone().into(), Cell::tone(word, tone)]);
    }
    page.table(table);
}
