//! The page: the paper's figures where its text gives them, and ours.

use super::reported::Reported;
use super::user_force;
use crate::table::Report;
use crate::{Context, StudyError};
use backdrive_report::{Cell, Dash, Figure, Page, Plot, Series, Table, Tone};

/// Rows of a plot, at most about this many.
const ROWS: usize = 3000;

/// One in several values, so that a plot has at most [`ROWS`].
fn thin(values: &[f64]) -> Vec<f64> {
    values.iter().step_by((values.len() / ROWS).max(1)).copied().collect()
}

/// Two signals and what is between them, one above the other.
fn over_time(title: &str, axis: (&str, &str), time: &[f64], signals: [(&str, &[f64]); 2]) -> Figure {
    let time = thin(time);
    let difference: Vec<f64> = signals[0].1.iter().zip(signals[1].1).map(|(a, b)| a - b).collect();
    let mut plot = Plot::new(title).x_axis("time", "s").y_axis(axis.0, axis.1);
    for (name, values) in signals {
        plot = plot.line(name, &time, &thin(values));
    }
    Figure::stacked([plot, Plot::new("").y_axis("difference", axis.1).line("", &time, &thin(&difference))])
}

/// The page in the folder of results.
///
/// # Errors
/// When it cannot be written.
pub fn write(context: &Context, report: &Report, told: &[Reported], users: &[user_force::Reported]) -> Result<(), StudyError> {
    let mut page = Page::new("Paper 003: model of a test bench for combustion engines, from bags");
    let missed = report.missed();
    let (tone, lead) = match missed {
        0 => (Tone::Good, "Every bar of the table is met.".to_string()),
        n => (Tone::Bad, format!("{n} bars of the table are missed.")),
    };
    page.lead(tone, &lead).text(
        "Blumenschein, Schrangl, Passenbrunner, Trogmann and del Re, Easily Adaptable Model of Test Benches for Internal Combustion Engines, ECC 2013. \
         Each bench here is a graph of engine, dynamometer, shaft, speed control, observer and operator, recorded to bags with sensor noise and \
         combustion ripple, and identified from them in the paper's order. Its text has lost every constant of its bench, the gains and the numbers at \
         its axes; what it still says stands on the left of a pair of figures or in the caption. All numbers of the benches are ours.",
    );
    let mut table = Table::new(["", "ours", "paper or truth", "source", "bar"]);
    for line in &report.lines {
        let bar = match line.within {
            Some(true) => Cell::tone("met", Tone::Good),
            Some(false) => Cell::tone("missed", Tone::Bad),
            None => "".into(),
        };
        table.push([
            line.what.as_str().into(),
            line.measured.as_str().into(),
            line.published.as_str().into(),
            line.source.as_str().into(),
            bar,
        ]);
    }
    page.section("Table").table(table);
    if let Some(one) = told.first() {
        page.section(&format!("The paper's figures, on bench {}", one.seed));
        correlations(&mut page, told);
        mechanics(&mut page, one);
        engine(&mut page, one);
        whole(&mut page, one);
        observer(&mut page, one);
    }
    page.section("The same observer on a master");
    for one in users {
        let title = format!("Force of the hand, {}", one.name);
        let figure = over_time(&title, ("force", "N"), &one.time, [("observer", &one.estimate), ("simulated hand", &one.truth)]);
        page.figure(
            figure,
            "launch/user-force.toml: the contact task with an observer that knows the measured position and the motor's force alone.",
        );
    }
    let path = context.out.join("report.html");
    page.write(&path).map_err(|e| StudyError::Write(format!("{}: cannot be written: {e}", path.display())))
}

fn correlations(page: &mut Page, told: &[Reported]) {
    let names = ["w_A closed loop", "T_C engine", "T_A shaken", "T_A cycle"];
    let places = [1.0, 2.0, 3.0, 4.0];
    let paper = Plot::new("Paper: Section III")
        .x_axis("w_A, T_C, T_A, T_A", "")
        .y_axis("correlation", "%")
        .y_limits(80.0, 100.0)
        .band("stated range", &[2.5, 4.5], &[88.0, 88.0], &[95.0, 95.0])
        .points("stated", &[1.0, 2.0], &[93.0, 90.0])
        .x_limits(0.5, 4.5);
    let mut ours = Plot::new("Ours").x_axis(&names.join(", "), "").y_axis("correlation", "%").y_limits(80.0, 100.0).x_limits(0.5, 4.5);
    for one in told {
        let v = &one.validation;
        let values = [v.mechanical_closed, v.engine, v.dynamometer[0], v.dynamometer[1]].map(|c| 100.0 * c);
        ours = ours.points(&format!("bench {}", one.seed), &places, &values);
    }
    page.figure(
        Figure::beside([paper, ours]),
        "Correlation coefficients of the validations: mechanical model, engine dynamics (\"9 %\" in the scan, read as 90), dynamometer.",
    );
}

fn mechanics(page: &mut Page, one: &Reported) {
    let (v, dragged, unseen) = (&one.validation, &one.dragged, &one.unseen);
    page.figure(
        over_time("Fig. 4: validation of the mechanical system", ("w_A", "rad/s"), &dragged.times(), [("simulated", &v.dragged.dyno_speed), ("measured", &dragged.dyno_speed)]),
        "Paper: upper part simulated and measured dynamometer speed, lower part their difference, correlation 93 %. Ours in closed loop, as the paper's second validation: the open one integrates what the torques are off by.",
    );
    for (name, simulated, measured) in [("w_C", &v.fed.engine_speed, &unseen.engine_speed), ("w_A", &v.fed.dyno_speed, &unseen.dyno_speed)]
    {
        page.figure(
            over_time(&format!("Fig. 6: validation of the torque observer, {name}"), (name, "rad/s"), &unseen.times(), [("of T_A and observed T_C", simulated), ("measured", measured)]),
            "Paper: the estimated torque feeds the mechanical model (Fig. 5), whose speeds are compared with the measured ones. No number survives.",
        );
    }
}

fn engine(page: &mut Page, one: &Reported) {
    let percent = |pedals: &[f64]| pedals.iter().map(|p| 100.0 * p).collect::<Vec<f64>>();
    let map = &one.identified.bench.engine.map;
    let paper = Plot::new("Fig. 7, paper: static map")
        .x_axis("pedal", "%")
        .y_axis("T_C stat", "N m")
        .series(Series::line("nearly linear at fixed speed", &[0.0, 100.0], &[0.0, 600.0]).dash(Dash::Dashed))
        .horizontal(600.0, "about 600 N m [R]", Tone::Neutral)
        .y_limits(-100.0, 700.0);
    let mut ours = Plot::new("Fig. 7, ours: identified").x_axis("pedal", "%").y_axis("T_C stat", "N m").y_limits(-100.0, 700.0);
    for (row, speed) in map.values().chunks(map.pedals().len()).zip(map.speeds()).skip(1) {
        ours = ours.line(&format!("{speed:.0} rad/s"), &percent(map.pedals()), row);
    }
    page.figure(
        Figure::beside([paper, ours]),
        "The paper's map is a surface whose text says only that it is nearly linear at fixed speed, with 6(00) at its axis.",
    );
    let lag = &one.identified.bench.engine.lag;
    let paper = Plot::new("Fig. 8, paper: lag")
        .x_axis("pedal", "%")
        .y_axis("time constant", "s")
        .x_limits(0.0, 100.0)
        .y_limits(0.0, 2.5)
        .band("from 0.4 [A] to 2.1 s", &[0.0, 100.0], &[0.4, 0.4], &[2.1, 2.1]);
    let mut ours = Plot::new("Fig. 8, ours: identified").x_axis("pedal", "%").y_axis("time constant", "s").y_limits(0.0, 2.5);
    let truth = one.world.engine.engine.lag.values();
    for (index, speed) in lag.speeds().iter().enumerate() {
        let of = |values: &[f64]| values.chunks(lag.pedals().len()).nth(index).unwrap_or_default().to_vec();
        ours = ours.line(&format!("{speed:.0} rad/s"), &percent(lag.pedals()), &of(lag.values())).points(
            "",
            &percent(lag.pedals()),
            &of(truth),
        );
    }
    page.figure(Figure::beside([paper, ours]), "Marks: the simulated truth. The scan has \".4 s\", which may be 0.4 or 0.04.");
    let v = &one.validation;
    page.figure(
        over_time("Fig. 9: validation of the engine", ("T_C", "N m"), &one.unseen.times(), [("engine model", &v.engine_torques[1]), ("observed", &v.engine_torques[0])]),
        "Paper: about 90 %; errors at stationary points since the map was recorded on another day, in transients from the linear scheduling. Ours: the validation's engine has another day's map.",
    );
    page.figure(
        over_time(
            "Fig. 10: validation of the dynamometer",
            ("T_A", "N m"),
            &one.unseen.times(),
            [("simulated", &v.dyno_torque), ("converter's estimate", &one.unseen.torque)],
        ),
        "Paper: 95 % of the trajectory drawn, 88 to 95 % of all; peaks of the error from a slight time shift.",
    );
    let steps = &one.steps;
    page.details("The steps that the lag is identified from", |inside| {
        inside.figure(
            over_time(
                "Pedal steps",
                ("T_C", "N m"),
                &steps.times(),
                [
                    ("engine model", &backdrive_testbench::lag::engine_torque(&one.identified.bench.engine, steps)),
                    ("observed", &one.identified.observed),
                ],
            ),
            "",
        );
    });
}

fn whole(page: &mut Page, one: &Reported) {
    let (v, unseen) = (&one.validation, &one.unseen);
    page.figure(
        over_time(
            "Fig. 11: validation of the whole bench, speed",
            ("w_C", "rad/s"),
            &unseen.times(),
            [("simulated", &v.all.engine_speed), ("measured", &unseen.engine_speed)],
        ),
        "The whole bench from pedal and wanted speed alone. No number of the paper's figure survives.",
    );
    page.figure(
        over_time(
            "Fig. 12: validation of the whole bench, torque",
            ("T_A", "N m"),
            &unseen.times(),
            [("simulated", &v.all.dyno_torque), ("converter's estimate", &unseen.torque)],
        ),
        "As Fig. 11, the dynamometer's torque.",
    );
}

fn observer(page: &mut Page, one: &Reported) {
    let comparison = &one.comparison;
    let from = (18.0 / one.unseen.period_s) as usize;
    let to = (from + (8.0 / one.unseen.period_s) as usize).min(comparison.truth.len());
    let cut = |values: &[f64]| thin(values.get(from.min(to)..to).unwrap_or_default());
    let time = cut(&one.unseen.times());
    let mut plot = Plot::new("The engine's torque by four ways").x_axis("time", "s").y_axis("T_C", "N m");
    for estimate in comparison.estimates.iter().filter(|e| !matches!(e.name, "derivative" | "observer")) {
        plot = plot.line(estimate.name, &time, &cut(&estimate.torque));
    }
    plot = plot.line("simulated, without ripple", &time, &cut(&comparison.truth));
    page.figure(plot.height(380.0), "Some seconds of the test cycle.");
    let mut table = Table::new(["estimate", "error, N m rms", "share of the largest torque", "correlation", "late by"]);
    for e in &comparison.estimates {
        table.push([
            e.name.to_string(),
            format!("{:.2}", e.error),
            format!("{:.2} %", 100.0 * e.share),
            format!("{:.3} %", 100.0 * e.correlation),
            format!("{:.0} ms", 1e3 * e.late_s),
        ]);
    }
    page.table(table.caption("Against the simulated torque without ripple, from 4 s on. The observer knows one number of the engine, its inertia; the Kalman filter its map, lag and pedal too."));
}
