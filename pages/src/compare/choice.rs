//! Which law to take: of those that keep a reserve under every condition, the one that displays most of the wall.

use super::compared::Compared;
use backdrive_stability::compare::Cell;

/// Factor on the gain that a law has to keep below its stability limit: 6 dB, the usual gain margin.
pub const RESERVE: f64 = 2.0;

/// A law over all conditions compared.
#[derive(Clone, Debug, PartialEq)]
pub struct Law<'a> {
    /// Its word.
    pub name: &'a str,
    /// Whether it is stable at the gain of the comparison under every condition.
    pub is_stable: bool,
    /// Its lowest stability limit over the gain of the comparison; where a clamp came first, the highest gain found stable.
    pub reserve: f64,
    /// The least share of the wall's stiffness that it displays, 1 for all of it; `None` where a condition shows none.
    pub stiffness: Option<f64>,
    /// Its largest drag in free motion by absolute value, N s/m or N m s/rad.
    pub drag: Option<f64>,
}

/// The laws in the order of the table.
pub fn laws<'a>(compared: &Compared<'a>) -> Vec<Law<'a>> {
    let mut names: Vec<&str> = Vec::new();
    for cell in compared.cells {
        if !names.contains(&cell.rival.as_str()) {
            names.push(&cell.rival);
        }
    }
    let gain = compared.gains[0] * compared.gains[1];
    names.into_iter().map(|name| law(name, compared.cells.iter().filter(|cell| cell.rival == name), gain)).collect()
}

fn law<'a>(name: &'a str, cells: impl Iterator<Item = &'a Cell> + Clone, gain: f64) -> Law<'a> {
    let limit = |cell: &Cell| cell.critical_gain.unwrap_or(cell.stable_up_to);
    let stiffness: Option<Vec<f64>> = cells.clone().map(|cell| cell.measures.stiffness_share).collect();
    Law {
        name,
        is_stable: cells.clone().all(|cell| cell.outcome.is_stable()),
        reserve: cells.clone().map(limit).fold(f64::INFINITY, f64::min) / gain,
        stiffness: stiffness.and_then(|all| all.into_iter().reduce(f64::min)),
        drag: cells.filter_map(|cell| cell.measures.drag).reduce(|a, b| if b.abs() > a.abs() { b } else { a }),
    }
}

/// The law to take. `None` where no law that displays the wall is stable under every condition.
///
/// Stability comes first: a law that keeps [`RESERVE`] is preferred to one that does not. Among equals the displayed stiffness decides, and without
/// reserve the reserve itself.
pub fn choice<'a, 'b>(laws: &'b [Law<'a>]) -> Option<&'b Law<'a>> {
    let possible = || laws.iter().filter(|law| law.is_stable && law.stiffness.is_some());
    let kept = possible().filter(|law| law.reserve >= RESERVE);
    kept.max_by(|a, b| a.stiffness.unwrap_or(0.0).total_cmp(&b.stiffness.unwrap_or(0.0)))
        .or_else(|| possible().max_by(|a, b| a.reserve.total_cmp(&b.reserve)))
}

/// The choice in a sentence, with what it costs.
pub fn sentence(compared: &Compared) -> String {
    let laws = laws(compared);
    let at = backdrive_report::number(compared.gains[0] * compared.gains[1]);
    let stable = laws.iter().filter(|law| law.is_stable).count();
    let Some(law) = choice(&laws) else {
        return match stable {
            0 => format!("At mu*lambda = {at} no law is stable under every condition compared: lower the gain, or shorten the link."),
            _ => format!(
                "At mu*lambda = {at} no law that is stable under every condition displays the wall: lower the gain, or shorten the link."
            ),
        };
    };
    let share = law.stiffness.map_or(String::new(), |share| format!("{:.0} % of the wall's stiffness", 100.0 * share));
    let reserve = decibels(law.reserve);
    if law.reserve >= RESERVE {
        format!(
            "Take {} at mu*lambda = {at}: of the laws with 6 dB of reserve or more under every condition it displays most of the wall. \
             It displays {share}, with {reserve} of reserve.",
            law.name
        )
    } else {
        format!(
            "At mu*lambda = {at} no law keeps 6 dB of reserve under every condition. {} has most, {reserve}, and displays {share}: lower the \
             gain before use.",
            law.name
        )
    }
}

/// A factor on the gain in decibels.
pub fn decibels(factor: f64) -> String {
    format!("{:.1} dB", 20.0 * factor.log10())
}

#[cfg(test)]
mod tests {
    use super::*;

    fn law(name: &'static str, is_stable: bool, reserve: f64, stiffness: Option<f64>) -> Law<'static> {
        Law { name, is_stable, reserve, stiffness, drag: None }
    }

    #[test]
    fn reserve_comes_before_stiffness_and_a_law_that_displays_no_wall_is_not_taken() {
        let taken = |laws: &[Law<'static>]| choice(laws).map(|law| law.name);
        let soft = law("soft", true, 5.0, Some(0.1));
        let hard = law("hard", true, 2.5, Some(0.8));
        let near = law("near", true, 1.3, Some(0.9));
        let none = law("none", true, 9.0, None);
        let shaking = law("shaking", false, 9.0, Some(1.0));
        assert_eq!(taken(&[soft.clone(), hard, near.clone(), none.clone(), shaking.clone()]), Some("hard"));
        assert_eq!(taken(&[soft, near.clone(), none.clone()]), Some("soft"));
        assert_eq!(taken(&[near, law("nearer", true, 1.1, Some(1.0))]), Some("near"));
        assert_eq!(taken(&[none, shaking]), None);
    }
}
