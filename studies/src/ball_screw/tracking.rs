//! Figs 17-20 and the RMS table: controllers at equal bandwidth, in presliding and in sliding, with encoder steps and noise.

use super::axis::{Friction, MM, PAPER, axis};
use super::identify::Found;
use crate::StudyError;
use crate::error::failed;
use crate::papers::device as device_file;
use crate::run::read;
use crate::table::Report;
use backdrive_control::controller::{
    AxisModel, Differentiator, Feedforward, Law, Reference, State, Working, backstepping, pd, sliding_mode,
};
use backdrive_control::device::{Device, DeviceOptions, DeviceRole};
use backdrive_plant::elements::{Law as Element, kind_named};
use backdrive_plant::model::Model;
use backdrive_plant::preisach::DahlLoop;
use backdrive_report::{Figure, Page, Plot};
use std::f64::consts::TAU;

const RATE: f64 = 2000.0;
/// Both poles of the error without friction, Hz: of every controller.
const BANDWIDTH_HZ: f64 = 10.0;
/// Standard deviation of the measured position, rad, before its rounding to the encoder's 0.16 mrad.
const NOISE: f64 = 5e-5;
/// What the controllers take the friction for, as a share of the axis' own.
const KNOWN: f64 = 0.8;
/// The laws that the paper compares.
const FED: &str = "SMC, LuGre fed forward";
const ADAPTIVE: &str = "adaptive back-stepping SMC";
const SWITCHING: f64 = 5.0;
const BOUNDARY: f64 = 2.0;

/// What is tracked, and what the controllers know.
struct Scenario {
    name: &'static str,
    /// Amplitude, rad, and frequency, Hz.
    motion: (f64, f64),
    truth: Model,
    /// The axis as they take it to be, with LuGre and with the Preisach operator.
    lugre: AxisModel,
    preisach: AxisModel,
    figures: &'static str,
    caption: String,
}

/// A sine that begins at rest, with its derivatives.
fn wanted(amplitude: f64, hz: f64, t: f64) -> Reference {
    let w = TAU * hz;
    let (s, c) = (w * t).sin_cos();
    // Faded in over a period by a polynomial whose ends are at rest.
    let u = (t * hz).min(1.0);
    let (fade, rate, bend) = if u < 1.0 {
        let shape = u * u * u * (10.0 + u * (-15.0 + 6.0 * u));
        (shape, 30.0 * u * u * (1.0 - u) * (1.0 - u) * hz, 60.0 * u * (1.0 - u) * (1.0 - 2.0 * u) * hz * hz)
    } else {
        (1.0, 0.0, 0.0)
    };
    Reference {
        position: amplitude * fade * s,
        velocity: amplitude * (fade * w * c + rate * s),
        acceleration: amplitude * (-fade * w * w * s + 2.0 * rate * w * c + bend * s),
    }
}

/// The controller's model: the axis with another law, and friction that is not quite its own.
fn known(friction: Friction, share: f64) -> Result<AxisModel, StudyError> {
    let mut model = axis(friction)?;
    for element in &mut model.elements {
        let mut values = element.law.values();
        // Forces, and slopes with them, so that presliding keeps its length.
        let forces: &[usize] = match element.law {
            Element::PreisachLugre(_) => &[0, 1, 2, 3, 6, 7],
            Element::Lugre(_) => &[0, 1, 2, 3],
            _ => &[0],
        };
        for place in forces {
            values[*place][0] *= share;
        }
        element.law = (element.law.kind().build)(&values).map_err(failed)?;
    }
    AxisModel::new(&model, 0).map_err(failed)
}

/// The axis of spring-sliders, and what its five loops say of it: no controller knows of sliders.
fn identified(found: &Found) -> Result<Scenario, StudyError> {
    let truth = Model::from_toml(&read(&device_file("ball-screw.toml"))?, "ball-screw.toml")?;
    let DahlLoop { force, slope } = found.dahl;
    let level = found.sliding;
    let break_away = found.dahl.reversal_of(level.min(0.95 * force));
    let with = |kind: &str, values: &[f64], curves: bool| {
        let mut lists: Vec<Vec<f64>> = values.iter().map(|v| vec![*v]).collect();
        if curves {
            lists.insert(8, Vec::new());
        }
        let kind = kind_named(kind).ok_or_else(|| failed("no such kind"))?;
        let mut model = truth.clone();
        for element in model.elements.iter_mut().filter(|e| e.name == "friction") {
            element.law = (kind.build)(&lists).map_err(failed)?;
        }
        AxisModel::new(&model, 0).map_err(failed)
    };
    Ok(Scenario {
        name: "presliding, identified from loops",
        motion: (0.5, 0.5),
        lugre: with("lugre", &[slope, 0.0, level, level, 0.5], false)?,
        preisach: with("preisach_lugre", &[slope, 0.0, level, level, 0.5, break_away, force, slope, 1.0], true)?,
        truth,
        figures: "An axis of spring-sliders",
        caption: "A sine of 0.5 rad at 0.5 Hz on an axis whose friction is seven spring-sliders; what the controllers know of it are f_c and s of \
                  five loops and the torque of sliding."
            .to_string(),
    })
}

/// The true axis, as a slave that a force drives.
fn device(model: &Model) -> Result<Device, StudyError> {
    let mut model = model.clone();
    model.outputs.iter_mut().for_each(|o| o.noise = NOISE);
    let options = DeviceOptions { substeps: Some(2), noise_seed: Some(1), quantise: true };
    Device::new(&model, None, DeviceRole::Slave, 1.0 / RATE, &options).map_err(failed)
}

/// Time, wanted and reached position, and what is learnt of σ0.
#[derive(Default)]
struct Run {
    t: Vec<f64>,
    wanted: Vec<f64>,
    reached: Vec<f64>,
    learnt: Vec<f64>,
}

fn track(law: &Law, model: &AxisModel, truth: &Model, motion: (f64, f64), seconds: f64) -> Result<Run, StudyError> {
    let mut device = device(truth)?;
    let mut working = Working::new(law, Some(model)).map_err(failed)?;
    let mut differences = Differentiator::new(100.0);
    device.start(&[], &[]);
    let mut run = Run::default();
    let limit = device.axis(0).force.unwrap_or(f64::INFINITY);
    let mut torque = 0.0;
    for k in 0..(seconds * RATE) as usize {
        if k > 0 {
            device.step(&[torque], &[]);
        }
        let (t, position) = (k as f64 / RATE, device.measured(0));
        let reference = wanted(motion.0, motion.1, t);
        let state = State { position, velocity: differences.step(position, 1.0 / RATE) };
        torque = working.effort(&reference, &state, 1.0 / RATE).clamp(-limit, limit);
        run.t.push(t);
        run.wanted.push(reference.position);
        run.reached.push(device.user_position(0));
        if let Working::Backstepping(law) = &working {
            run.learnt.push(law.estimates().stiffness);
        }
    }
    Ok(run)
}

/// RMS of the true error over the last two cycles, rad.
fn rms(run: &Run, hz: f64) -> f64 {
    let from = run.t.len() - ((2.0 / hz) * RATE) as usize;
    let error: f64 = run.wanted[from..].iter().zip(&run.reached[from..]).map(|(w, q)| (w - q).powi(2)).sum();
    (error / (run.t.len() - from) as f64).sqrt()
}

fn laws(inertia: f64) -> [(&'static str, Friction, Law); 7] {
    let w = TAU * BANDWIDTH_HZ;
    let pd = pd::Gains { stiffness: inertia * w * w, damping: 2.0 * inertia * w };
    let sliding = sliding_mode::Gains { surface: w, reaching: w, switching: SWITCHING, boundary: BOUNDARY };
    let adaptive = |adaptation| {
        let (surface, stabilising) = (0.5 * w, 0.5 * w);
        Law::Backstepping(backstepping::Gains {
            surface,
            stabilising,
            reaching: w,
            switching: SWITCHING,
            boundary: BOUNDARY,
            adaptation,
            start: 1.0,
        })
    };
    [
        ("PD", Friction::Gated, Law::Pd(pd, Feedforward::None)),
        ("PD, Preisach fed forward", Friction::Gated, Law::Pd(pd, Feedforward::Friction)),
        ("SMC", Friction::Gated, Law::SlidingMode(sliding, Feedforward::None)),
        (FED, Friction::Lugre, Law::SlidingMode(sliding, Feedforward::Friction)),
        ("SMC, Preisach fed forward", Friction::Gated, Law::SlidingMode(sliding, Feedforward::Friction)),
        ("back-stepping SMC, not adapting", Friction::Gated, adaptive([0.0; 3])),
        (ADAPTIVE, Friction::Gated, adaptive([40.0, 1e-5, 1e-5])),
    ]
}

pub(super) fn run(report: &mut Report, page: &mut Page, found: &Found, quick: bool) -> Result<(), StudyError> {
    page.section("Tracking (Figs 17-20)");
    page.text(&format!(
        "Every controller has both poles of its error at {BANDWIDTH_HZ} Hz, samples at {RATE} Hz, and differentiates the encoder through a low-pass of \
         100 Hz; noise of {NOISE} rad comes before the encoder's steps of 1.57e-4 rad. The error is that of the true position, over the last two cycles."
    ));
    let ours = |name, motion: (f64, f64), figures| {
        let [lugre, preisach] = [known(Friction::Lugre, KNOWN)?, known(Friction::Gated, KNOWN)?];
        let caption = format!(
            "A sine of {} rad at {} Hz; the controllers take the friction for {:.0} % of what it is. Errors over the last two cycles.",
            motion.0,
            motion.1,
            100.0 * KNOWN
        );
        Ok::<_, StudyError>(Scenario { name, motion, truth: axis(Friction::Gated)?, lugre, preisach, figures, caption })
    };
    let sliding = ours("sliding", (2.0, 0.5), "Figs 17, 18: sliding")?;
    let presliding = ours("presliding", (0.05, 0.5), "Figs 19, 20: the reduced reference")?;
    for scenario in [sliding, presliding, identified(found)?] {
        one(report, page, &scenario, if quick { 12.0 } else { 20.0 })?;
    }
    Ok(())
}

fn one(report: &mut Report, page: &mut Page, scenario: &Scenario, seconds: f64) -> Result<(), StudyError> {
    let Scenario { name: motion, motion: (amplitude, hz), truth, lugre, preisach, figures, caption } = scenario;
    let (mut errors, mut tracked, mut learnt) = (Vec::new(), Run::default(), Run::default());
    let mut plot = Plot::new("Errors").x_axis("time", "s").y_axis("error", "um");
    let last_two = |run: &Run| run.t.len() - ((2.0 / hz) * RATE) as usize;
    for (name, friction, law) in laws(preisach.inertia) {
        let model = if friction == Friction::Lugre { lugre } else { preisach };
        let run = track(&law, model, truth, (*amplitude, *hz), seconds)?;
        let error = rms(&run, *hz);
        errors.push((name, error));
        report.figure(&format!("{motion} {name}"), error);
        if ["SMC", FED, ADAPTIVE].contains(&name) {
            let from = last_two(&run);
            let error: Vec<f64> = run.wanted[from..].iter().zip(&run.reached[from..]).map(|(w, q)| 1e3 * MM * (w - q)).collect();
            plot = plot.line(name, &run.t[from..], &error);
        }
        match name {
            ADAPTIVE => learnt = run,
            FED => tracked = run,
            _ => {}
        }
    }
    let of = |name: &str| errors.iter().find(|e| e.0 == name).map_or(f64::NAN, |e| e.1);
    for (name, error) in &errors {
        let (published, source) = match *name {
            ADAPTIVE => ("0.08 (a digit may be lost), unit lost", PAPER),
            FED => ("number lost", PAPER),
            _ => ("", ""),
        };
        let said = format!("{:.4} mrad = {:.3} um", 1e3 * error, 1e3 * MM * error);
        report.line(&format!("{motion}, rms error, {name}"), said, published, source, None);
    }
    let order = of("SMC") > of(FED) && of(FED) > of(ADAPTIVE);
    let said = format!("{:.3} > {:.3} > {:.3} mrad", 1e3 * of("SMC"), 1e3 * of(FED), 1e3 * of(ADAPTIVE));
    report.line(&format!("{motion}: SMC > SMC with feedforward > adaptive back-stepping"), said, "that order", PAPER, Some(order));
    // The beginning and three cycles: more would be a grey band.
    let shown = learnt.t.len().min((4.0 / hz * RATE) as usize);
    let mm = |x: &[f64]| x[..shown].iter().map(|x| MM * x).collect::<Vec<f64>>();
    let t = &learnt.t[..shown];
    let response = Plot::new(figures)
        .x_axis("time", "s")
        .y_axis("position", "mm")
        .line("reference", t, &mm(&learnt.wanted))
        .line(FED, t, &mm(&tracked.reached))
        .line(ADAPTIVE, t, &mm(&learnt.reached));
    page.figure(Figure::beside([response, plot]), caption);
    let estimate =
        Plot::new("What is learnt of sigma_0").x_axis("time", "s").y_axis("estimate", "N m/rad").line("", &learnt.t, &learnt.learnt);
    page.figure(estimate.height(150.0), "The estimate of the bristles' stiffness by the adaptive controller.");
    Ok(())
}
