//! Two motors that are coupled: their laws, and how what is stirred up dies.

use backdrive_report::{Cell, Page, Table, number, si};
use backdrive_stability::coupling::{Estimate, SideLaw};
use backdrive_stability::verdict::{Answer, CoupledAxis};

/// The title of the page, for a pair at the gains of its recording.
pub(super) fn title(name: &str) -> String {
    format!("Stability of {name} at the gains of the recording")
}

/// The coupling of each axis.
pub(super) fn coupled(page: &mut Page, found: &Answer) {
    for axis in &found.coupled {
        let name = if found.coupled.len() > 1 { format!("{}: ", axis.axis) } else { String::new() };
        let Some(coupling) = &axis.coupling else {
            page.text(&format!(
                "{name}The law of the motors is not known: {}.",
                axis.why_not.as_deref().unwrap_or("it was not identified")
            ));
            continue;
        };
        page.text(&format!("{name}{}.", coupling.kind.text()));
        let mut table = Table::new(["motor", "term", "coefficient", "95 % interval"]);
        for (motor, side) in [("master", &coupling.master), ("slave", &coupling.slave)] {
            for gain in &side.gains {
                table.push(row(motor, gain.term.name(), &gain.estimate));
            }
            for (what, estimate) in times(side) {
                table.push(row(motor, what, &estimate));
            }
        }
        page.table(table.caption("SI units; times in s. Positions and speeds are those of the other side relative to this side."));
        let mut rivals = Table::new(["motor", "law", "unexplained in held-out time"]);
        for (motor, side) in [("master", &coupling.master), ("slave", &coupling.slave)] {
            let own = side.gains.iter().map(|g| g.term.name()).collect::<Vec<_>>().join(", ");
            rivals.push([Cell::from(motor), format!("{own} (recorded)").into(), format!("{:.1e}", side.unexplained).into()]);
            for rival in &side.rivals {
                let terms = rival.terms.iter().map(|t| t.name()).collect::<Vec<_>>().join(", ");
                rivals.push([Cell::from(motor), terms.into(), format!("{:.1e}", rival.unexplained).into()]);
            }
        }
        page.table(
            rivals.caption("Other fitted laws, with the share of the force's variance that they leave unexplained in held-out time."),
        );
        decay(page, axis);
    }
}

fn decay(page: &mut Page, axis: &CoupledAxis) {
    let Some(mode) = &axis.slowest_mode else { return };
    let what = if mode.of_error { "the difference of the positions" } else { "the master's motion" };
    let mut table = Table::new(["least damped oscillation in", "frequency", "decay rate, 1/s", "95 % interval"]);
    let [low, high] = mode.ci95.map(number);
    table.push([Cell::from(what), si(mode.frequency_hz, "Hz").into(), number(mode.per_s).into(), format!("{low} to {high}").into()]);
    page.table(table);
}

fn row(motor: &str, what: &str, estimate: &Estimate) -> [Cell; 4] {
    let [low, high] = estimate.ci95.map(number);
    [Cell::from(motor), what.to_string().into(), number(estimate.value).into(), format!("{low} to {high}").into()]
}

fn times(side: &SideLaw) -> Vec<(&'static str, Estimate)> {
    let all = [("filter of speeds", side.filter_s), ("delay of the motion", side.delay_s), ("delay of the force", side.force_delay_s)];
    all.into_iter().filter_map(|(what, estimate)| Some((what, estimate?))).collect()
}
