//! Figures of an arm: what remains, torque and its predictions, friction, the motion to record next.

use crate::parts::{file_name, sentence};
use backdrive_diagnosis::arms::drawn::{Drawn, DrawnJoint};
use backdrive_diagnosis::verdict::Verdict;
use backdrive_report::{Colour, Dash, Figure, Page, Plot, Series, Tone, number};

/// Points in a cloud, at most.
const POINTS: usize = 1500;
/// Width that bars of one joint share, of the distance between joints.
const BARS: f64 = 0.8;

/// Bars of what remains at each joint, by each model.
pub(super) fn remaining(page: &mut Page, verdict: &Verdict, held: bool) {
    let Some(arm) = &verdict.arm else { return };
    let joints = &arm.joints;
    let mut kinds: Vec<(&str, Vec<Option<f64>>, Colour)> = vec![
        ("as given", joints.iter().map(|j| Some(j.as_given)).collect(), Colour::Muted),
        ("refitted", joints.iter().map(|j| Some(j.refit)).collect(), Colour::Nth(0)),
        ("diagnosed", joints.iter().map(|j| Some(j.diagnosed)).collect(), Colour::Nth(1)),
        ("closed loop, refitted", joints.iter().map(|j| j.loop_refit).collect(), Colour::Nth(5)),
        ("closed loop, diagnosed", joints.iter().map(|j| j.loop_diagnosed).collect(), Colour::Nth(4)),
    ];
    kinds.retain(|(_, values, _)| values.iter().any(Option::is_some));
    let width = BARS / kinds.len() as f64;
    let mut plot = Plot::new("").x_axis("joint", "").x_names(joints.iter().map(|j| j.joint.clone()));
    plot = plot.y_axis("share of the rms torque", "%").include_y(0.0).height(300.0).x_limits(0.5, joints.len() as f64 + 0.5);
    for (k, (name, values, colour)) in kinds.iter().enumerate() {
        let offset = (k as f64 + 0.5) * width - 0.5 * BARS;
        let (x, y): (Vec<f64>, Vec<f64>) =
            values.iter().enumerate().filter_map(|(j, v)| Some((j as f64 + 1.0 + offset, 100.0 * (*v)?))).unzip();
        plot = plot.series(Series::bars(name, &x, &y).colour(*colour));
    }
    let on = if held { "held-out logs" } else { "fitted logs" };
    page.figure(
        plot,
        &format!(
            "On {on}: the share of the measured torque that the models do not explain, and the share that a controller adds to keep the \
                simulated arm on the measured motion."
        ),
    );
}

/// Measured torque with both predictions, and residuals, joint by joint.
pub(super) fn torque(page: &mut Page, drawn: &Drawn) {
    let log = file_name(&drawn.log.0);
    for joint in &drawn.joints {
        let predicted = |left: &[f64]| joint.measured.iter().zip(left).map(|(m, l)| m - l).collect::<Vec<f64>>();
        let unit = joint.units[2];
        let line = |name: &str, y: &[f64], colour, dash| Series::line(name, &joint.time, y).colour(colour).dash(dash);
        let upper = Plot::new(&joint.name)
            .x_axis("time", "s")
            .y_axis("torque", unit)
            .height(230.0)
            .series(line("measured", &joint.measured, Colour::Ink, Dash::Solid))
            .series(line("refitted", &predicted(&joint.left_refit), Colour::Nth(0), Dash::Dashed))
            .series(line("diagnosed", &predicted(&joint.left_diagnosed), Colour::Nth(1), Dash::Solid));
        let lower = Plot::new("")
            .x_axis("time", "s")
            .y_axis("residual", unit)
            .height(190.0)
            .horizontal(0.0, "", Tone::Neutral)
            .series(line("refitted", &joint.left_refit, Colour::Nth(0), Dash::Dashed))
            .series(line("diagnosed", &joint.left_diagnosed, Colour::Nth(1), Dash::Solid));
        page.figure(Figure::stacked([upper, lower]), &format!("{} in {log}, through the filter of the regression.", joint.name));
    }
}

/// Friction against velocity, joint by joint.
pub(super) fn friction(page: &mut Page, drawn: &Drawn) {
    let mut figures: Vec<Figure> = Vec::new();
    for joint in &drawn.joints {
        let friction = &joint.friction;
        if friction.velocity.is_empty() {
            continue;
        }
        let step = friction.velocity.len().div_ceil(POINTS).max(1);
        let thin = |x: &[f64]| x.iter().step_by(step).copied().collect::<Vec<f64>>();
        let cloud = Series::points("required by the logs", &thin(&friction.velocity), &thin(&friction.torque));
        let law = Series::line("fitted law", &friction.line_velocity, &friction.line);
        let plot = Plot::new(&joint.name)
            .x_axis("velocity", joint.units[1])
            .y_axis("torque", joint.units[2])
            .series(cloud.colour(Colour::Muted).width(1.3))
            .series(law.colour(Colour::Nth(1)).dash(Dash::Solid).width(2.2));
        figures.push(plot.into());
    }
    if figures.is_empty() {
        page.text("No joint moves long enough to show its friction.");
        return;
    }
    let by_load: Vec<&str> = drawn.joints.iter().filter(|j| j.friction.by_load).map(|j| j.name.as_str()).collect();
    let load = match by_load.is_empty() {
        true => String::new(),
        false => format!(
            " Friction that grows with the load (at {}) is drawn at the mean load, and its points scatter around it.",
            by_load.join(", ")
        ),
    };
    page.figure(
        Figure::beside(figures),
        &format!(
            "Grey: torque in motion that the diagnosed model without the joint's friction and constant torque does not explain. Orange: \
             friction and constant torque of the diagnosed model.{load}"
        ),
    );
}

/// The planned motion.
pub(super) fn next(page: &mut Page, verdict: &Verdict, drawn: &Drawn) {
    if let Some(next) = &verdict.next_experiment {
        page.text(&sentence(next.sentence()));
    }
    // Angles and lengths have an axis each.
    for unit in ["rad", "m"] {
        let of_unit: Vec<(&DrawnJoint, &Vec<f64>)> =
            drawn.joints.iter().zip(&drawn.next_position).filter(|(j, _)| j.units[0] == unit).collect();
        if of_unit.is_empty() {
            continue;
        }
        let mut plot = Plot::new("").x_axis("time", "s").y_axis("position", unit).height(260.0);
        for (joint, position) in of_unit {
            plot = plot.line(&joint.name, &drawn.next_time, position);
        }
        let seconds = drawn.next_time.last().copied().unwrap_or(0.0);
        page.figure(plot, &format!("Positions to track, a period of {} s; it repeats without a discontinuity.", number(seconds.round())));
    }
}
