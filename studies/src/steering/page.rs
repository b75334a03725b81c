//! The page: the paper's figures, drawn from its tables, beside ours, from the rig and what was found again.

use super::bench::{Curve, stroke};
use super::device::{Compensator, OILS, SAE_10, TABLE_1, TABLE_2, TABLE_3_RUN_2};
use super::identify::predicted;
use super::results::{Results, strokes};
use crate::table::Report;
use backdrive_plant::linear::{LinearModel, Operating, log_frequencies};
use backdrive_report::{Cell, Colour, Figure, Page, Plot, Series, Table, Tone};
use nalgebra::Complex;
use rayon::prelude::*;
use std::f64::consts::TAU;

/// A curve of a figure: name, frequencies in Hz, admittances in N s/m, and whether it is drawn as marks.
struct Drawn {
    name: String,
    frequency: Vec<f64>,
    value: Vec<Complex<f64>>,
    marks: bool,
}

pub(super) fn page(results: &Results, report: &Report) -> Page {
    let mut page = Page::new("An inerter steering compensator on its rig");
    let (tone, lead) = match report.missed() {
        0 => (Tone::Good, "Every number of Tables I to III is found again from the rig's recordings, and every check is met.".to_string()),
        missed => (Tone::Warning, format!("{missed} of the bars below are missed.")),
    };
    page.lead(tone, &lead);
    page.text(
        "Papageorgiou, Lockwood, Houghton and Smith (ECC 2007) move a steering compensator (an inerter and a damper in series, behind a gearbox) with a \
         hydraulic ram, take its admittance at 33 frequencies by the correlation method, and fit models of rising detail. Here the device of their \
         tables stands on a simulated rig: a ram of 20 kg on its column of oil, a servo-valve, a PID controller, a load cell with noise, analogue filters. \
         The numbers are then found again from what the rig recorded.",
    );
    page.note(
        "The scan of the paper has lost its curves and its strokes. On the left stand the paper's models, computed from its tables; on the right what \
         the rig measured and what the fit made of it. Ours are: the strokes (10 mm, then 60 mm/s, at least 1 mm, times the scale), the ram and its controller, \
         the Stribeck velocity, the shaft's damping (100 of 1, 10, 100 or 1000 N s/m), the presliding distance.",
    );
    page.section("Tables I to III and the checks");
    let mut table = Table::new(["", "found", "the paper's", ""]);
    for line in &report.lines {
        let bar = match line.within {
            Some(true) => Cell::tone("met", Tone::Good),
            Some(false) => Cell::tone("missed", Tone::Bad),
            None => Cell::from(""),
        };
        table.push([Cell::from(line.what.as_str()), line.measured.as_str().into(), line.published.as_str().into(), bar]);
    }
    page.table(table);
    measured(&mut page, results);
    fits(&mut page, results);
    times(&mut page, results);
    refined(&mut page, results);
    page
}

/// Figs 3, 5 and 6.
fn measured(page: &mut Page, results: &Results) {
    page.section("Figure 3: the measured admittance with four oils");
    let simulated = (0..4).map(|oil| of_model(&TABLE_3_RUN_2, &results.whole[0].1[oil], OILS[oil])).collect();
    let rig = results.whole[0].1.iter().map(|c| of_rig(c, OILS[c.oil])).collect();
    page.figure(
        beside(("Table III run 2, simulated", simulated), ("our rig", rig)),
        "Friction makes the gain fall at low frequencies; the gap and the stiffness make it fall at high ones.",
    );
    let shown = |(scale, curves): &(f64, Vec<Curve>)| of_rig(&curves[SAE_10], &format!("strokes {}", strokes(*scale)));
    let all: Vec<Drawn> = results.whole.iter().map(shown).collect();
    page.figure(
        bode("SAE-10 at several strokes, our rig", &all),
        "What friction and gap do depends on the stroke; a linear device would show one curve.",
    );
    let tracking: Vec<f64> = results.whole[0].1[SAE_10].points.iter().map(|p| p.tracking.norm()).collect();
    let frequency: Vec<f64> = results.whole[0].1[SAE_10].points.iter().map(|p| p.frequency_hz).collect();
    let plot = Plot::new("The ram's displacement over the demand").x_axis("frequency", "Hz").x_log().y_axis("gain", "").include_y(0.0);
    page.figure(
        plot.line("", &frequency, &tracking),
        "Why the admittance is taken from two estimates: the ram does not follow to the end of the band.",
    );

    page.section("Figure 5: the gain of eq (2) as a function of c");
    let fine = log_frequencies(3.0, 100.0, 300);
    let dampings = [1.0, 300.0, 1000.0, 3000.0, 10_000.0, 1e6];
    let (f, gain) = TABLE_1.invariant();
    let family = |title: &str, of: &dyn Fn(&Compensator, f64) -> f64| {
        let plot = Plot::new(title).x_axis("frequency", "Hz").x_log().y_axis("|Y|", "N s/m").y_log().y_limits(1e2, 1e6);
        dampings
            .iter()
            .fold(plot, |plot, c| {
                let device = Compensator { oils: [[*c, 0.0]; 4], ..TABLE_1 };
                let y: Vec<f64> = fine.iter().map(|f| of(&device, *f)).collect();
                plot.line(&format!("c = {c:.0} N s/m"), &fine, &y)
            })
            .annotate(f, gain, &format!("{f:.2} Hz"), Tone::Neutral)
    };
    let network = |device: &Compensator, f: f64| {
        let model = device.model(0);
        let at = Operating::small();
        let linear = LinearModel::new(&model, &at).and_then(|l| l.response(0, 0, &[f]));
        linear.ok().and_then(|y| y.first().map(|y| y.norm() / (TAU * f))).unwrap_or(f64::NAN)
    };
    let equation = family("eq (2)", &|device, f| device.linear_admittance(0, f).norm());
    page.figure(
        Figure::beside([equation, family("our network", &network)]),
        "Resonances at 23.725 Hz without oil and 10.066 Hz with a stiff one; between them one frequency at which the oil does not matter.",
    );

    page.section("Figure 6: the design, Table I");
    let frequency = log_frequencies(0.1, 35.0, 200);
    let equation = (0..4).map(|oil| Drawn {
        name: OILS[oil].to_string(),
        value: frequency.iter().map(|f| TABLE_1.linear_admittance(oil, *f)).collect(),
        frequency: frequency.clone(),
        marks: false,
    });
    let found = &results.design_fit.device;
    let ours = results.design.iter().flat_map(|c| [of_rig(c, OILS[c.oil]), of_equation(found, c)]);
    page.figure(beside(("eq (2), Table I", equation.collect()), ("our rig, and eq (2) with what was found", ours.collect())), "");
}

/// Figs 8 to 11 and 14 to 17.
fn fits(page: &mut Page, results: &Results) {
    let oils = [3, 2, 1, 0];
    page.section("Figures 8 to 11: the friction model");
    page.text(
        "Left: the paper's model of Table II beside the device that Table III describes. Right: the same on our rig, the friction model fitted up to 20 Hz. It fits \
         up to there, and pays with its stiffness.",
    );
    for oil in oils {
        let curve = &results.whole[0].1[oil];
        let paper = vec![of_model(&TABLE_3_RUN_2, curve, "device of Table III"), of_model(&TABLE_2, curve, "Table II")];
        let ours = vec![of_rig(curve, "rig"), of_model(&results.without_gap.device, curve, "fitted without backlash")];
        page.figure(beside((&format!("{}, the paper's tables", OILS[oil]), paper), (&format!("{}, ours", OILS[oil]), ours)), "");
    }
    page.section("Table II's device itself");
    for oil in oils {
        let curve = &results.friction[oil];
        let paper = vec![of_model(&TABLE_2, curve, "Table II")];
        let ours = vec![of_rig(curve, "rig"), of_model(&results.friction_fit.device, curve, "fitted")];
        page.figure(beside((&format!("{}, the paper's table", OILS[oil]), paper), (&format!("{}, ours", OILS[oil]), ours)), "");
    }
    page.section("Figures 14 to 17: with backlash");
    for oil in oils {
        let curve = &results.whole[0].1[oil];
        let paper = vec![of_model(&TABLE_3_RUN_2, curve, "Table III run 2")];
        let ours = vec![of_rig(curve, "rig"), of_model(&results.run_2.device, curve, "fitted with backlash")];
        page.figure(beside((&format!("{}, the paper's table", OILS[oil]), paper), (&format!("{}, ours", OILS[oil]), ours)), "");
    }
}

/// Figs 18 to 21.
fn times(page: &mut Page, results: &Results) {
    page.section("Figures 18 to 21: time responses, SAE-10");
    page.text("The paper's curves are lost. The rig's force beside that of the fitted model under the displacement that the rig recorded.");
    for (f, recorded, force) in &results.times {
        let count = ((2.0 / (f * recorded.period_s)).ceil() as usize).min(force.len());
        let time: Vec<f64> = (0..count).map(|k| k as f64 * recorded.period_s).collect();
        let millimetres: Vec<f64> = recorded.displacement[..count].iter().map(|x| 1e3 * x).collect();
        let over_time = Plot::new(&format!("{f:.2} Hz"))
            .x_axis("time", "s")
            .y_axis("force", "N")
            .line("rig", &time, &recorded.force[..count])
            .line("model", &time, &force[..count]);
        let over_displacement = Plot::new(&format!("{f:.2} Hz, over the displacement"))
            .x_axis("displacement", "mm")
            .y_axis("force", "N")
            .line("rig", &millimetres, &recorded.force[..count])
            .line("model", &millimetres, &force[..count]);
        page.figure(Figure::beside([over_time, over_displacement]), &format!("Demanded stroke {:.2} mm.", 1e3 * stroke(*f, 1.0)));
    }
}

/// Figs 22 and 23.
fn refined(page: &mut Page, results: &Results) {
    page.section("Figure 22: force over velocity at 0.1 Hz, SAE-10, hysteretic friction");
    let (recorded, sudden, refined) = &results.slow;
    let speed: Vec<f64> = recorded.velocity.iter().map(|v| 1e3 * v).collect();
    let plot = |title: &str| Plot::new(title).x_axis("velocity", "mm/s").y_axis("force", "N");
    page.figure(
        Figure::beside([
            plot("friction that is there at once").line("rig", &speed, &recorded.force).line("model", &speed, sudden),
            plot("friction behind a presliding distance").line("rig", &speed, &recorded.force).line("model", &speed, refined),
        ]),
        "The force lags the velocity. The paper's hysteretic map is lost; ours is Dahl's law, whose force comes back over a distance behind each reversal.",
    );
    page.section("Figure 23: the refined friction in the admittance, SAE-10");
    let curve = &results.hysteretic;
    let all = [
        of_rig(curve, "rig"),
        of_model(&results.sudden_fit.device, curve, "friction at once"),
        of_model(&results.refined_fit.device, curve, "presliding"),
    ];
    page.figure(bode("Admittance", &all), "The refined friction has the small negative phase at low frequencies.");
}

fn of_rig(curve: &Curve, name: &str) -> Drawn {
    Drawn {
        name: name.to_string(),
        frequency: curve.points.iter().map(|p| p.frequency_hz).collect(),
        value: curve.points.iter().map(|p| p.admittance).collect(),
        marks: true,
    }
}

fn of_model(device: &Compensator, curve: &Curve, name: &str) -> Drawn {
    let value = curve.points.par_iter().map(|p| predicted(device, curve.oil, p)).collect();
    Drawn { name: name.to_string(), value, marks: false, ..of_rig(curve, name) }
}

fn of_equation(device: &Compensator, curve: &Curve) -> Drawn {
    let value = curve.points.iter().map(|p| device.linear_admittance(curve.oil, p.frequency_hz)).collect();
    Drawn { value, marks: false, ..of_rig(curve, "") }
}

/// Gain over phase.
fn bode(title: &str, curves: &[Drawn]) -> Figure {
    let gain = Plot::new(title).x_axis("frequency", "Hz").x_log().y_axis("|Y|", "N s/m").y_log();
    let phase = Plot::new("").y_axis("phase", "°").y_limits(-90.0, 90.0);
    let (mut plots, mut colour) = ([gain, phase], 0);
    for curve in curves {
        let rows = [curve.value.iter().map(|y| y.norm()).collect::<Vec<f64>>(), curve.value.iter().map(|y| y.arg().to_degrees()).collect()];
        // An unnamed curve belongs to the marks before it.
        colour += usize::from(!curve.name.is_empty());
        let mut row = 0;
        plots = plots.map(|plot| {
            let name = if row == 0 { curve.name.as_str() } else { "" };
            let series = if curve.marks {
                Series::points(name, &curve.frequency, &rows[row])
            } else {
                Series::line(name, &curve.frequency, &rows[row])
            };
            row += 1;
            plot.series(series.colour(Colour::Nth(usize::max(colour, 1) - 1)))
        });
    }
    Figure::stacked(plots)
}

fn beside((left, paper): (&str, Vec<Drawn>), (right, ours): (&str, Vec<Drawn>)) -> Figure {
    Figure::beside([bode(left, &paper), bode(right, &ours)])
}
