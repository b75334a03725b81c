//! Figs 3-5: friction torque against position under a slow oscillating torque. LuGre drifts, the rig's orbits close.

use super::axis::{Friction, MM, PAPER, axis};
use crate::StudyError;
use crate::error::failed;
use crate::table::Report;
use backdrive_plant::elements::kind_named;
use backdrive_plant::model::{Hold, Model, OutputKind};
use backdrive_plant::stepper::{Options, simulate};
use backdrive_report::{Figure, Page, Plot};
use std::f64::consts::TAU;

const RATE: f64 = 1000.0;
const TAIL_HZ: f64 = 0.2;
const CYCLES: usize = 8;

/// A command of half the friction's level with a sine of a fifth of it, at the paper's 0.2 Hz.
fn command(level: f64) -> Vec<f64> {
    let n = (RATE * (5.0 + CYCLES as f64 / TAIL_HZ)) as usize;
    (0..=n)
        .map(|k| {
            let t = k as f64 / RATE;
            level * (0.5 * (t / 4.0).min(1.0) + if t > 5.0 { 0.2 * (TAU * TAIL_HZ * (t - 5.0)).sin() } else { 0.0 })
        })
        .collect()
}

/// Position and friction of a model whose only input is a force.
fn driven(mut model: Model, level: f64) -> Result<[Vec<f64>; 2], StudyError> {
    let friction = model.elements.iter().position(|e| e.name == "friction").unwrap_or(0);
    let Some(mut output) = model.outputs.first().cloned() else { return Err(failed("the axis measures nothing")) };
    output.kind = OutputKind::Force(vec![friction]);
    model.outputs.push(output);
    for input in &mut model.inputs {
        input.hold = Hold::Linear;
    }
    let y = simulate(&model, &[command(level)], 1.0 / RATE, &Options { substeps: Some(4), ..Options::default() }).map_err(failed)?;
    <[Vec<f64>; 2]>::try_from(y).map_err(|_| failed("two outputs were asked for"))
}

/// Per cycle, over the last half of the cycles.
fn per_cycle(position: &[f64]) -> f64 {
    let at = |cycle: usize| position.get((RATE * (5.0 + cycle as f64 / TAIL_HZ)) as usize).copied().unwrap_or(f64::NAN);
    (at(CYCLES) - at(CYCLES / 2)) / (CYCLES - CYCLES / 2) as f64
}

/// The stage that check 29 is stated for: 1 kg under friction of 1 N, bristles of 20 kN/m.
fn stage(friction: Friction) -> Result<Model, StudyError> {
    let mut model = axis(Friction::Gated)?;
    let curves = backdrive_plant::preisach::DahlLoop { force: 1.5, slope: 2e4 };
    let (kind, values) = match friction {
        Friction::Lugre => ("lugre", vec![2e4, 100.0, 1.0, 1.0, 1e-3]),
        Friction::Literal => ("preisach_lugre", vec![2e4, 100.0, 1.0, 1.0, 1e-3, curves.reversal_of(1.0), 1.5, 2e4, 0.0]),
        Friction::Gated => ("preisach_lugre", vec![2e4, 100.0, 1.0, 1.0, 1e-3, curves.reversal_of(1.0), 1.5, 2e4, 1.0]),
    };
    let mut lists: Vec<Vec<f64>> = values.into_iter().map(|v| vec![v]).collect();
    if kind == "preisach_lugre" {
        lists.insert(8, Vec::new());
    }
    let kind = kind_named(kind).ok_or_else(|| failed("no such kind"))?;
    model.elements.retain(|e| e.name == "friction");
    for element in &mut model.elements {
        element.law = (kind.build)(&lists).map_err(failed)?;
    }
    model.bodies.iter_mut().for_each(|b| b.inertia = 1.0);
    Ok(model)
}

pub(super) fn run(report: &mut Report, page: &mut Page) -> Result<(), StudyError> {
    page.section("Drift under an oscillating torque (Figs 3-5)");
    let command = command(0.26);
    let t: Vec<f64> = (0..command.len()).map(|k| k as f64 / RATE).collect();
    let milli = |x: &[f64]| x.iter().map(|x| 1e3 * x).collect::<Vec<f64>>();
    page.figure(
        Plot::new("Fig. 3: command input torque")
            .x_axis("time", "s")
            .y_axis("torque", "mN m")
            .line("u", &t, &milli(&command))
            .height(150.0),
        "A slow torque below break-away, half of F_C with a fifth of it at 0.2 Hz.",
    );
    let mut plots = Vec::new();
    for friction in Friction::ALL {
        let [position, torque] = driven(axis(friction)?, 0.26)?;
        let from = (5.0 * RATE) as usize;
        let mm: Vec<f64> = position[from..].iter().map(|x| x * MM).collect();
        let title = match friction {
            Friction::Lugre => "Fig. 4: LuGre, simulated",
            Friction::Literal => "beside Fig. 5: eqs (4)-(6) as printed",
            Friction::Gated => "Fig. 5: gated, which does what the rig does",
        };
        plots.push(Plot::new(title).x_axis("position", "mm").y_axis("friction", "mN m").line("", &mm, &milli(&torque[from..])));
        let drift = 1e3 * MM * per_cycle(&position);
        report.figure(&format!("axis drift {}", friction.name()), drift);
        let (published, within) = match friction {
            Friction::Lugre => ("drifts (Fig. 4)", Some(drift > 0.5)),
            Friction::Literal => ("closed orbits wanted (Fig. 5)", None),
            Friction::Gated => ("closed orbits (Fig. 5)", Some(drift.abs() < 0.05)),
        };
        report.line(&format!("axis, drift per cycle, {}", friction.name()), format!("{drift:.3} um"), published, PAPER, within);
    }
    page.figure(
        Figure::beside(plots),
        "Friction torque against position over eight cycles. LuGre creeps a little further each time. So does the printed eq (5): the leak h |q'|/g \
         is what drifts, not the linear stiffness. With the leak gated (alpha = 0 below 45 % of break-away) the orbit closes, as the paper's Fig. 5 does.",
    );
    for friction in Friction::ALL {
        let drift = 1e6 * per_cycle(&driven(stage(friction)?, 1.0)?[0]);
        report.figure(&format!("drift {}", friction.name()), drift);
        let (bar, within) = match friction {
            Friction::Lugre => ("above 10 um", drift > 10.0),
            Friction::Literal => ("of LuGre's order", drift > 3.0 && drift < 300.0),
            Friction::Gated => ("below 1 um", drift.abs() < 1.0),
        };
        let what = format!("1 kg, F_C = 1 N, bias 0.5 N, sine 0.2 N: drift per cycle, {}", friction.name());
        report.line(&what, format!("{drift:.3} um"), bar, "closed forms and simulation", Some(within));
    }
    Ok(())
}
