//! What a search tried, what it cost and why it lost, as tables to follow.

use backdrive_diagnosis::belief::beaten::{Beaten, beaten};
use backdrive_diagnosis::search::{Outcome, Search};
use std::fmt::Write as _;

/// Structures that are shown, at most.
const SHOWN: usize = 25;

/// Both tables.
pub(crate) fn explained(search: &Search) -> String {
    format!("{}\n{}", steps(search), structures(search))
}

/// The steps of the search in their order.
fn steps(search: &Search) -> String {
    let mut out = String::new();
    let _ = writeln!(out, "{:<40} {:>8} {:>6} {:>10} {:>9}  best after it", "step", "proposed", "fitted", "work, 1e6", "residual");
    for entry in &search.journal {
        let best = if entry.best.is_empty() { "nominal" } else { &entry.best };
        let _ = match entry.outcome {
            Outcome::Taken { proposed, fitted, work } => {
                writeln!(out, "{:<40} {proposed:>8} {fitted:>6} {:>10.1} {:>9.3}  {best}", entry.step, work as f64 / 1e6, entry.residual)
            }
            Outcome::ResidualIsWhite => writeln!(out, "{:<40} skipped: the residual is white", entry.step),
            Outcome::NoWorkLeft => writeln!(out, "{:<40} skipped: the effort is used up (--effort)", entry.step),
            Outcome::NothingNew => writeln!(out, "{:<40} skipped: nothing new to try", entry.step),
        };
    }
    let _ = writeln!(
        out,
        "in all {} hypotheses, {} simulations, {:.1} million steps; residuals in noise standard deviations",
        search.hypotheses,
        search.simulations,
        search.work as f64 / 1e6
    );
    out
}

/// The structures that were fitted, and why each is not claimed.
fn structures(search: &Search) -> String {
    let all = beaten(search);
    let mut out = String::new();
    let _ = writeln!(
        out,
        "{:<58} {:>10} {:>9} {:>9} {:>11} {:>11}  why",
        "structure", "parameters", "residual", "unseen", "by fits", "by held out"
    );
    for Beaten { name, parameters, residual, unseen, by_fits, by_unseen, why } in all.iter().take(SHOWN) {
        let unseen = unseen.map_or("-".to_string(), |u| format!("{u:.3}"));
        let _ = writeln!(out, "{name:<58} {parameters:>10} {residual:>9.3} {unseen:>9} {by_fits:>11.1} {by_unseen:>11.1}  {}", why.text());
    }
    if all.len() > SHOWN {
        let _ = writeln!(out, "and {} more that are worse", all.len() - SHOWN);
    }
    let _ = write!(
        out,
        "by fits, by held out: advantage of the claimed structure (difference of the information criterion, effective samples)"
    );
    out
}
