//! Figs 12, 13 and 15: transition curves from five measured loops, by the deformed Dahl model, by that bent through the loops, and by the
//! paper's network.

use super::axis::{FILE, Friction, MM, PAPER, axis};
use super::network::Network;
use crate::StudyError;
use crate::error::failed;
use crate::papers::device;
use crate::run::read;
use crate::table::Report;
use backdrive_plant::elements::Law;
use backdrive_plant::model::Model;
use backdrive_plant::preisach::{DahlLoop, MeasuredLoop, Transition, fit};
use backdrive_report::{Colour, Figure, Page, Plot, Series};
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, Normal};
use std::f64::consts::TAU;

/// Standard deviation of the torque meter, N m: 0.1 % of the paper's 5 N m.
const TORQUE_NOISE: f64 = 5e-3;
const SAMPLES: usize = 2000;

/// A slow closed loop of a friction law between ±reach: the third one, which is closed.
fn cycle(law: &Law, reach: f64) -> (Vec<f64>, Vec<f64>) {
    let mut memory = vec![0.0; law.memory_len()];
    let (mut q, mut f, mut at) = (Vec::new(), Vec::new(), 0.0);
    for k in 1..=3 * SAMPLES {
        let phase = TAU * k as f64 / SAMPLES as f64;
        let to = reach * phase.sin();
        law.advance(&mut memory, at, to, 100.0 / SAMPLES as f64);
        at = to;
        if k > 2 * SAMPLES {
            q.push(to);
            f.push(law.force(&memory, to, TAU * 0.01 * reach * phase.cos()));
        }
    }
    (q, f)
}

/// Measured as the bench would: with noise, and rounded to the encoder's step.
fn measured(law: &Law, reach: f64, step: f64, rng: &mut ChaCha8Rng) -> Result<MeasuredLoop, StudyError> {
    let noise = Normal::new(0.0, TORQUE_NOISE).map_err(failed)?;
    let (q, f) = cycle(law, reach);
    let q: Vec<f64> = q.iter().map(|q| (q / step).round() * step).collect();
    let f: Vec<f64> = f.iter().map(|f| f + noise.sample(rng)).collect();
    MeasuredLoop::from_cycle(&q, &f).map_err(failed)
}

/// The force on the falling branch of the loop of `reach`.
type Falling<'a> = &'a dyn Fn(f64, f64) -> f64;

fn by_curves(curves: &Transition) -> impl Fn(f64, f64) -> f64 + '_ {
    |reach, q| 0.5 * curves.rise(reach, 2.0 * reach).force - curves.rise(reach, reach - q).force
}

/// RMS over loops that were not measured, as a share of their force.
fn error(law: &Law, unseen: &[f64], falling: Falling) -> f64 {
    let (mut sum, mut all) = (0.0, 0.0);
    for reach in unseen {
        let (q, f) = cycle(law, *reach);
        // Its falling half: from the top at a quarter to three quarters.
        for k in SAMPLES / 4..3 * SAMPLES / 4 {
            sum += (falling(*reach, q[k]) - f[k]).powi(2);
            all += f[k] * f[k];
        }
    }
    (sum / all).sqrt()
}

struct Bench {
    what: &'static str,
    law: Law,
    loops: [f64; 5],
    unseen: [f64; 4],
}

/// What five loops say of the axis of spring-sliders, for its controllers.
pub(super) struct Found {
    /// Its transition curves.
    pub dahl: DahlLoop,
    /// Torque of slow sliding, N m.
    pub sliding: f64,
}

pub(super) fn run(report: &mut Report, page: &mut Page, quick: bool) -> Result<Found, StudyError> {
    page.section("Transition curves from five loops (Figs 12, 13, 15)");
    let law_of =
        |model: Model| model.elements.into_iter().find(|e| e.name == "friction").map(|e| e.law).ok_or_else(|| failed("no friction"));
    let sliders = Model::from_toml(&read(&device("ball-screw.toml"))?, "ball-screw.toml")?;
    let benches = [
        Bench {
            what: "an axis whose loops are deformed Dahl loops",
            law: law_of(axis(Friction::Gated)?)?,
            loops: [0.01, 0.02, 0.035, 0.055, 0.08],
            unseen: [0.015, 0.028, 0.045, 0.07],
        },
        Bench {
            what: "an axis of seven spring-sliders",
            law: law_of(sliders)?,
            loops: [0.1, 0.2, 0.4, 0.8, 1.4],
            unseen: [0.15, 0.3, 0.6, 1.1],
        },
    ];
    let mut last = None;
    for (index, bench) in benches.iter().enumerate() {
        let mut rng = ChaCha8Rng::seed_from_u64(index as u64);
        let loops: Vec<MeasuredLoop> =
            bench.loops.iter().map(|reach| measured(&bench.law, *reach, 1.5708e-4, &mut rng)).collect::<Result<_, _>>()?;
        let found = fit(&loops).map_err(failed)?;
        let dahl = Transition::from(found.dahl);
        let rows: Vec<[f64; 3]> = loops.iter().flat_map(|l| l.rows(15)).collect();
        let bent = Transition::measured(found.dahl, &rows).map_err(failed)?;
        // The paper's network learns the five completed loops.
        let (widest, top) = (bench.loops[4], 1.2 * found.dahl.reversal_force(bench.loops[4]));
        let inputs = move |reach: f64, q: f64| [2.0 * reach / widest - 1.0, q / widest];
        let patterns: Vec<([f64; 2], f64)> = bench
            .loops
            .iter()
            .flat_map(|reach| (0..=40).map(move |k| (*reach, reach * (1.0 - 0.05 * f64::from(k)))))
            .map(|(reach, q)| (inputs(reach, q), 0.5 + 0.4 * found.dahl.falling(q, reach) / top))
            .collect();
        let mut network = Network::new(7);
        network.train(&patterns, if quick { 300 } else { 6000 }, 8);
        let learnt = |reach: f64, q: f64| (network.value(inputs(reach, q)) - 0.5) / 0.4 * top;

        let shares = [
            ("deformed Dahl by least squares", error(&bench.law, &bench.unseen, &by_curves(&dahl))),
            ("that bent through the loops", error(&bench.law, &bench.unseen, &by_curves(&bent))),
            ("the paper's network on the completed loops", error(&bench.law, &bench.unseen, &learnt)),
        ];
        let numbers = format!("{:.4} N m, {:.3} N m/rad", found.dahl.force, found.dahl.slope);
        let near = (found.dahl.force / 0.35 - 1.0).abs() < 0.05 && (found.dahl.slope / 20.0 - 1.0).abs() < 0.05;
        let (known, source, within) = if index == 0 { ("0.35, 20 (true)", FILE, Some(near)) } else { ("", "", None) };
        report.line(&format!("{}: f_c and s from five loops", bench.what), numbers, known, source, within);
        for (name, share) in shares {
            report.figure(&format!("{index} {name}"), share);
            let within = (name == "that bent through the loops").then_some(share <= shares[2].1.min(0.1));
            let (published, source) = if name.contains("network") { ("follows the target (Fig. 15)", PAPER) } else { ("", "") };
            report.line(
                &format!("{}: loops that nobody measured, {name}", bench.what),
                format!("{:.2} % rms", 100.0 * share),
                published,
                source,
                within,
            );
        }
        let line = |falling: Falling, reach: f64| {
            let q: Vec<f64> = (0..=60).map(|k| reach * (1.0 - f64::from(k) / 30.0)).collect();
            let f: Vec<f64> = q.iter().map(|q| 1e3 * falling(reach, *q)).collect();
            (q.iter().map(|q| q * MM).collect::<Vec<f64>>(), f)
        };
        let mut raw = Plot::new("Fig. 12: five loops, measured").x_axis("position", "mm").y_axis("friction", "mN m");
        let mut completed = Plot::new("Figs 13 and 15: transition curves").x_axis("position", "mm").y_axis("friction", "mN m");
        for (k, one) in loops.iter().enumerate() {
            let name = |name: &str| if k == 0 { name.to_string() } else { String::new() };
            let (q, f): (Vec<f64>, Vec<f64>) = one.falling.iter().step_by(8).map(|s| (s.0 * MM, 1e3 * s.1)).unzip();
            let (back_q, back_f): (Vec<f64>, Vec<f64>) = (q.iter().map(|x| -x).collect(), f.iter().map(|x| -x).collect());
            raw = raw.series(Series::points(&name("falling"), &q, &f).colour(Colour::Nth(0)));
            raw = raw.series(Series::points(&name("rising"), &back_q, &back_f).colour(Colour::Nth(1)));
            let colours = [0, 1, 2].map(Colour::Nth);
            let fits: [(&str, Falling); 3] = [("deformed Dahl", &by_curves(&dahl)), ("bent", &by_curves(&bent)), ("network", &learnt)];
            for ((what, falling), colour) in fits.into_iter().zip(colours) {
                let (q, f) = line(falling, one.reach);
                completed = completed.series(Series::line(&name(what), &q, &f).colour(colour));
            }
        }
        let caption = format!(
            "Left, {}, with the torque meter's noise and the encoder's steps; right, its falling branches by three interpolations.",
            bench.what
        );
        page.figure(Figure::beside([raw, completed]), &caption);
        // Far and slowly, as no loop goes.
        let mut memory = vec![0.0; bench.law.memory_len()];
        bench.law.advance(&mut memory, 0.0, 100.0, 1e4);
        last = Some(Found { dahl: found.dahl, sliding: bench.law.force(&memory, 100.0, 0.01) });
    }
    last.ok_or_else(|| failed("no axis was measured"))
}
