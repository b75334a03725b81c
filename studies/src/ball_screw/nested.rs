//! Figs 6-8 and 11: turns within turns. LuGre forgets where it came from, the rig and the Preisach operator do not.

use super::axis::{Friction, MM, PAPER, axis, rubbing};
use crate::StudyError;
use crate::table::Report;
use backdrive_plant::elements::Law;
use backdrive_plant::preisach::{DahlLoop, Operator, Relays, Transition};
use backdrive_report::{Figure, Page, Plot};

/// Turning points, rad: each loop within the one before, then out again through all of them.
const TURNS: [f64; 14] = [0.0, 0.08, -0.06, 0.06, -0.03, 0.045, 0.0, 0.03, 0.0, 0.045, -0.03, 0.06, -0.06, 0.08];
/// Turns that are come back to in the same direction.
const AGAIN: [(usize, usize); 5] = [(1, 13), (2, 12), (3, 11), (4, 10), (5, 9)];
/// rad/s: slow, so that friction is that of presliding alone.
const SPEED: f64 = 0.02;
const RATE: f64 = 500.0;

/// The path, and where in it the turns are.
fn path() -> (Vec<f64>, Vec<usize>) {
    let (mut path, mut turns) = (vec![0.0], vec![0]);
    for pair in TURNS.windows(2) {
        let parts = ((pair[1] - pair[0]).abs() / SPEED * RATE).round();
        path.extend((1..=parts as usize).map(|k| pair[0] + (pair[1] - pair[0]) * k as f64 / parts));
        turns.push(path.len() - 1);
    }
    (path, turns)
}

pub(super) fn run(report: &mut Report, page: &mut Page) -> Result<(), StudyError> {
    page.section("Nested reversals and wiping-out (Figs 6-8 and 11)");
    let (path, turns) = path();
    let t: Vec<f64> = (0..path.len()).map(|k| k as f64 / RATE).collect();
    let mm: Vec<f64> = path.iter().map(|q| q * MM).collect();
    page.figure(
        Plot::new("Fig. 6: reference position").x_axis("time", "s").y_axis("position", "mm").line("q", &t, &mm).height(150.0),
        "Loops within loops, and out again through every turn.",
    );
    let mut plots = Vec::new();
    for friction in Friction::ALL {
        let mut axis = rubbing(friction)?;
        let mut torque = vec![0.0];
        for pair in path.windows(2) {
            axis.advance(pair[0], pair[1], 1.0 / RATE);
            torque.push(axis.friction(SPEED * (pair[1] - pair[0]).signum()) - axis.viscous * SPEED * (pair[1] - pair[0]).signum());
        }
        let off = AGAIN.iter().map(|(a, b)| (torque[turns[*a]] - torque[turns[*b]]).abs()).fold(0.0, f64::max);
        let title = match friction {
            Friction::Lugre => "Fig. 7: LuGre, simulated",
            Friction::Literal => "beside Fig. 11: eqs (4)-(6) as printed",
            Friction::Gated => "Figs 8 and 11: Preisach, gated",
        };
        let milli: Vec<f64> = torque.iter().map(|x| 1e3 * x).collect();
        plots.push(Plot::new(title).x_axis("position", "mm").y_axis("friction", "mN m").line("", &mm, &milli));
        report.figure(&format!("wiping out {}", friction.name()), off);
        let (published, within) = match friction {
            Friction::Lugre => ("does not come back (Fig. 7)", Some(off > 5e-3)),
            Friction::Literal => ("comes back (Fig. 11)", None),
            Friction::Gated => ("comes back (Figs 8, 11)", Some(off < 1e-9)),
        };
        let what = format!("force at turns that are come back to, largest difference, {}", friction.name());
        report.line(&what, format!("{:.3} mN m", 1e3 * off), published, PAPER, within);
    }
    page.figure(
        Figure::beside(plots),
        "The same path three times. Back at a turn, the force is what it was there where inner loops are wiped out; LuGre has one number to remember with.",
    );
    relays(report)
}

/// The operator against its definition, on the axis' own curves.
fn relays(report: &mut Report) -> Result<(), StudyError> {
    let axis = axis(Friction::Gated)?;
    let curves = axis.elements.iter().find_map(|e| match &e.law {
        Law::PreisachLugre(law) => Some(law.curves.clone()),
        _ => None,
    });
    let curves = curves.unwrap_or_else(|| Transition::from(DahlLoop { force: 0.35, slope: 20.0 }));
    let range = 2.0 * curves.rise(0.1, 0.2).force;
    for grid in [100, 400] {
        let (mut operator, mut relays) = (Operator::new(curves.clone()), Relays::new(&curves, 0.1, grid));
        let worst = path().0.iter().fold(0.0_f64, |worst, z| worst.max((operator.step(*z) - relays.step(*z)).abs())) / range;
        report.figure(&format!("relays {grid}"), worst);
        let within = (grid == 400).then_some(worst < 0.01);
        let what = format!("Everett form (9), (10) against {grid} x {grid} relays, largest difference over the range");
        report.line(&what, format!("{:.3} %", 100.0 * worst), "the same operator", "eq (7)", within);
    }
    let dahl = DahlLoop { force: 0.35, slope: 2.0 };
    let closes = [0.01, 0.2, 3.0].map(|r| (dahl.rising(r, r) - dahl.reversal_force(r)).abs()).into_iter().fold(0.0, f64::max);
    report.line(
        "deformed Dahl loop (11)-(13): where it ends less where it began",
        format!("{closes:.1e}"),
        "0",
        PAPER,
        Some(closes < 1e-9),
    );
    let f_r = dahl.reversal_force(0.2);
    report.line(
        "its reversal force, f_c = 0.35, s = 2, q_r = 0.2",
        format!("{f_r:.10}"),
        "0.1547405025",
        "eq (13)",
        Some((f_r - 0.154_740_502_5).abs() < 1e-9),
    );
    Ok(())
}
