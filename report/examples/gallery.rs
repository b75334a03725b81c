//! Every kind of plot with data like those of a real report: `cargo run -p backdrive-report --example gallery -- gallery.html`.

use backdrive_report::{Align, Cell, Colour, Dash, Figure, Page, Plot, Series, Table, Tone, number, percent, si};
use std::f64::consts::{PI, TAU};

/// A loop of a resonant master against a stiff wall, one delay: (frequency Hz, magnitude, phase rad, re, im).
fn loop_response() -> Vec<(f64, f64, f64, f64, f64)> {
    let (mut before, mut turns) = (0.0, 0.0);
    (0..400)
        .map(|k| {
            let f = 0.5 * 1000f64.powf(f64::from(k) / 399.0);
            let s = TAU * f;
            let mode = |f0: f64, zeta: f64| {
                let u = f / f0;
                let (re, im) = (1.0 - u * u, 2.0 * zeta * u);
                (1.0 / re.hypot(im), -im.atan2(re))
            };
            let (a, b) = (mode(12.0, 0.35), mode(80.0, 0.12));
            let magnitude = 1.6 * a.0 * b.0.sqrt();
            let phase = PI + a.1 + 0.5 * b.1 - s * 2e-3;
            let wrapped = phase.sin().atan2(phase.cos());
            if wrapped - before > PI {
                turns -= TAU;
            }
            before = wrapped;
            (f, magnitude, wrapped + turns, magnitude * phase.cos(), magnitude * phase.sin())
        })
        .collect()
}

/// A repeatable stand-in for noise, about normal, of deviation 1.
fn noise(k: usize) -> f64 {
    let mut x = (k as u64).wrapping_mul(0x9e37_79b9_7f4a_7c15);
    let mut sum = 0.0;
    for _ in 0..4 {
        x = (x ^ (x >> 31)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        sum += (x >> 11) as f64 / (1u64 << 53) as f64 - 0.5;
    }
    sum * 3f64.sqrt()
}

/// How the oscillation grows from 1 s on, m.
fn grown(t: f64) -> f64 {
    if t < 1.0 { 0.0 } else { 1.4e-3 * (1.0 - (-(t - 1.0) * 1.8).exp()) }
}

/// Bode and Nyquist of the loop.
fn loop_figures(page: &mut Page) {
    let response = loop_response();
    let column = |pick: fn(&(f64, f64, f64, f64, f64)) -> f64| response.iter().map(pick).collect::<Vec<f64>>();
    let (f, magnitude, re, im) = (column(|r| r.0), column(|r| 20.0 * r.1.log10()), column(|r| r.3), column(|r| r.4));
    let phase: Vec<f64> = column(|r| r.2.to_degrees());
    let sigma: Vec<f64> = response.iter().map(|r| 0.03 * r.1 + 0.02 + 0.1 * (r.0 / 120.0).min(1.0) * r.1).collect();

    page.section("Loop frequency response");
    let every = |v: &[f64]| v.iter().step_by(6).copied().collect::<Vec<f64>>();
    let nyquist = Plot::new("Nyquist plot of the loop L")
        .x_axis("Re L", "")
        .y_axis("Im L", "")
        .equal_aspect()
        .include(1.0, 0.0)
        .discs("95 % discs", &every(&re), &every(&im), &every(&sigma))
        .line("L, from the bag", &re, &im)
        .annotate(1.0, 0.0, "+1", Tone::Bad)
        .annotate(re[240], im[240], &si(f[240], "Hz"), Tone::Neutral)
        .annotate(re[150], im[150], &si(f[150], "Hz"), Tone::Neutral);
    page.figure(nyquist.clone(), "The closed loop is F_f = d + L F_f, so the critical point is +1.");
    let (low, high): (Vec<f64>, Vec<f64>) =
        response.iter().zip(&sigma).map(|(r, s)| (20.0 * (r.1 - s).max(1e-3).log10(), 20.0 * (r.1 + s).log10())).unzip();
    let modelled: Vec<f64> = magnitude.iter().zip(&f).map(|(m, f)| m - 1.5 * (f / 30.0).ln().tanh()).collect();
    let bode = Figure::stacked([
        Plot::new("Loop frequency response")
            .x_axis("frequency", "Hz")
            .x_log()
            .y_axis("|L|", "dB")
            .band("95 % interval", &f, &low, &high)
            .line("from the bag", &f, &magnitude)
            .line("model", &f, &modelled)
            .horizontal(0.0, "|L| = 1", Tone::Neutral)
            .vertical(22.7, "phase crossover 22.7 Hz", Tone::Bad),
        Plot::new("").y_axis("phase of L", "°").line("", &f, &phase).vertical(22.7, "", Tone::Bad),
        Plot::new("").y_axis("coherence", "").y_limits(0.0, 1.0).height(90.0).series(
            Series::line(
                "",
                &f,
                &f.iter().enumerate().map(|(k, f)| 1.0 / (1.0 + (f / 200.0).powi(2)) - 0.04 * noise(k).abs()).collect::<Vec<_>>(),
            )
            .colour(Colour::Muted),
        ),
    ]);
    page.figure(bode, "Magnitude and phase with the 95 % interval; the model's answer beside it.");
}

/// Verdicts over the gain.
fn gain_sweep(page: &mut Page) {
    page.section("Gain sweep");
    let gains: Vec<f64> = (0..200).map(|k| 0.1 * 500f64.powf(f64::from(k) / 199.0)).collect();
    let amplitude: Vec<f64> = gains
        .iter()
        .enumerate()
        .map(|(k, g)| if *g < 4.1 { 4e-6 * (1.0 + 0.3 * noise(k)).abs() } else { 2.2e-3 * (1.0 - 4.05 / g).sqrt() })
        .collect();
    let mut sweep =
        Plot::new("Oscillation in contact over the gain product").x_axis("gain product μλ", "").x_log().y_axis("amplitude", "m").y_log();
    for w in gains.windows(2) {
        let (tone, label) = match w[0] {
            g if g < 4.08 => (Tone::Good, "stable"),
            g if g < 9.0 => (Tone::Warning, "limit cycle"),
            g if g < 9.6 => (Tone::Unsure, "cannot tell"),
            g if g < 22.0 => (Tone::Bad, "unstable"),
            _ => (Tone::Limited, "limited"),
        };
        sweep = sweep.region(w[0], w[1], tone, label);
    }
    sweep = sweep
        .points("re-simulated", &gains, &amplitude)
        .vertical(4.1, "edge 4.1", Tone::Neutral)
        .vertical(4.6, "edge from L 4.6", Tone::Neutral)
        .vertical(6.2, "asked 6.2", Tone::Bad)
        .horizontal(1e-5, "encoder step", Tone::Unsure);
    page.figure(sweep, "200 gains of 5 s each; the colour is the verdict.");
}

/// A run in time, with a gap and a spike.
fn time_response(page: &mut Page, t: &[f64]) {
    page.section("Time response at the asked gain");
    let x: Vec<f64> =
        t.iter().enumerate().map(|(k, t)| 4e-3 * (1.0 - (-t * 3.0).exp()) + grown(*t) * (TAU * 23.0 * t).sin() + 2e-6 * noise(k)).collect();
    let force: Vec<f64> =
        t.iter().zip(&x).map(|(t, x)| if (2.2..2.35).contains(t) { f64::NAN } else { -((x - 3e-3).max(0.0)) * 2500.0 }).collect();
    let intent: Vec<f64> = t.iter().map(|t| 4e-3 * (1.0 - (-t * 3.0).exp())).collect();
    let spiked: Vec<f64> = force.iter().enumerate().map(|(k, v)| if k == 9_001 { -9.0 } else { *v }).collect();
    page.figure(
        Figure::stacked([
            Plot::new("Contact at μλ = 6.2")
                .x_axis("time", "s")
                .y_axis("position", "m")
                .line("x_m", t, &x)
                .series(Series::line("operator's intent", t, &intent).colour(Colour::Ink).dash(Dash::Dashed))
                .horizontal(3e-3, "wall", Tone::Neutral)
                .region(1.0, 5.0, Tone::Warning, "limit cycle, 1.4 mm at 23 Hz"),
            Plot::new("").y_axis("force F_s", "N").series(Series::line("", t, &spiked).colour(Colour::Nth(1))),
        ]),
        "The force is missing from 2.20 s to 2.35 s: not measured is not zero. One sample at 2.25 s is a spike.",
    );
}

/// Who gives and takes energy.
fn energy(page: &mut Page, t: &[f64]) {
    page.section("Energy");
    let into: Vec<f64> = t.iter().map(|t| 3e-3 * (1.0 - (-t).exp()) + 4e-4 * grown(*t) / 1.4e-3 * t).collect();
    let master: Vec<f64> = t.iter().map(|t| 2e-3 * (1.0 - (-t).exp()) - 9e-4 * (t - 1.0).max(0.0)).collect();
    let friction: Vec<f64> = t.iter().map(|t| 7e-4 * t).collect();
    page.figure(
        Figure::beside([
            Plot::new("Passivity observers")
                .x_axis("time", "s")
                .y_axis("energy taken in", "J")
                .line("master's port", t, &master)
                .line("slave's port", t, &into)
                .line("Coulomb friction and hysteresis", t, &friction)
                .horizontal(0.0, "passive above", Tone::Unsure),
            Plot::new("Hysteresis of the linkage").x_axis("deflection", "m").y_axis("force", "N").line(
                "cable side",
                &(0..30_000).map(|k| 8e-4 * (f64::from(k) * 0.01).cos()).collect::<Vec<_>>(),
                &(0..30_000).map(|k| 3.2 * (f64::from(k) * 0.01 - 0.12).cos()).collect::<Vec<_>>(),
            ),
        ]),
        "A port whose curve falls below zero has given out more than it took.",
    );
}

/// Bars, and points beside a line.
fn shares(page: &mut Page) {
    page.figure(
        Figure::beside([
            Plot::new("Share of the motion by effect")
                .x_axis("number of the effect", "")
                .y_axis("share", "%")
                .series(Series::bars("NRMSE explained", &[1.0, 2.0, 3.0, 4.0, 5.0], &[42.0, 23.0, 8.0, 3.0, -1.5]).colour(Colour::Nth(0))),
            Plot::new("Prediction against live edge")
                .x_axis("predicted edge", "")
                .x_log()
                .y_axis("live edge", "")
                .y_log()
                .points("linear", &[0.4, 1.1, 3.0, 4.2, 9.5, 30.0], &[0.41, 1.08, 3.1, 4.0, 9.7, 29.0])
                .points("friction", &[0.6, 2.0, 5.5, 14.0], &[0.7, 2.3, 5.0, 16.0])
                .points("hysteresis", &[1.5, 8.0, 20.0], &[1.4, 8.3, 23.0])
                .series(Series::line("", &[0.3, 40.0], &[0.3, 40.0]).colour(Colour::Muted).dash(Dash::Solid)),
        ]),
        "",
    );
}

/// A wide table, and what is folded away.
fn numbers(page: &mut Page) {
    page.section("Numbers");
    let mut table = Table::new([
        "method",
        "verdict",
        "critical μλ",
        "95 % interval",
        "frequency",
        "gain margin",
        "phase margin",
        "delay margin",
        "modulus margin",
        "limit cycle",
        "growth",
        "coherence",
    ])
    .caption("A wide table scrolls by itself and leaves the page's width alone.");
    table.push([
        Cell::from("frequency response"),
        Cell::tone("unstable", Tone::Bad),
        number(4.6).into(),
        "4.30 to 4.90".into(),
        si(22.7, "Hz").into(),
        "-2.6 dB".into(),
        "-14 °".into(),
        si(-0.0017, "s").into(),
        number(0.21).into(),
        "–".into(),
        "–".into(),
        percent(0.93).into(),
    ]);
    table.push([
        Cell::from("re-simulation"),
        Cell::tone("limit cycle", Tone::Warning),
        number(4.1).into(),
        "3.80 to 4.40".into(),
        si(23.1, "Hz").into(),
        "–".into(),
        "–".into(),
        "–".into(),
        "–".into(),
        si(1.4e-3, "m").into(),
        "0 1/s".into(),
        "–".into(),
    ]);
    table.push([Cell::from("energy"), Cell::tone("cannot tell", Tone::Unsure), "≥ 50".into()]);
    page.table(table);
    page.details("How it was computed", |inside| {
        inside
            .text("Cross-spectra against the recorded dither.\n\nA second paragraph.")
            .table(Table::new(["setting", "value"]).row(["segments", "31"]).row(["window", "Hann"]).align(1, Align::Right));
    });
}

/// What a figure makes of nothing, of one value and of what its axis cannot show.
fn odd_data(page: &mut Page) {
    page.section("Odd data");
    page.figure(
        Figure::beside([
            Plot::new("Nothing measured").x_axis("time", "s").y_axis("force", "N").line("F_s", &[], &[]),
            Plot::new("One sample").x_axis("time", "s").y_axis("force", "N").points("F_s", &[0.3], &[2.0]),
            Plot::new("All alike").x_axis("time", "s").y_axis("force", "N").line("F_s", &[0.0, 1.0, 2.0], &[1.5; 3]),
            Plot::new("Zeros on a logarithmic axis")
                .x_axis("frequency", "Hz")
                .x_log()
                .y_axis("amplitude", "m")
                .y_log()
                .line("spectrum", &[0.0, 1.0, 2.0, 4.0, 8.0], &[1.0, 1e-3, 0.0, 1e-4, -1e-4])
                .annotate(3.0, -1.0, "outside", Tone::Neutral),
        ]),
        "",
    );
}

fn main() -> std::io::Result<()> {
    let path = std::env::args().nth(1).unwrap_or_else(|| "gallery.html".into());
    let mut page = Page::new("Stability of session-07.mcap at μλ = 6.2");
    page.lead(
        Tone::Bad,
        "Unstable at μλ = 6.2: the loop goes into a limit cycle of 1.4 mm at 23 Hz. It is stable up to μλ = 4.1 (95 %: 3.8 to 4.4).",
    );
    page.warning("The two methods disagree by 18 %: a physical effect may be missing from the model <impulse-engine>.");
    page.note("Estimated from 31 segments of 2.0 s, Hann window, 50 % overlap; coherence above 0.8 from 1 Hz to 140 Hz.");

    let n = 20_000;
    let t: Vec<f64> = (0..n).map(|k| k as f64 / 4000.0).collect();
    loop_figures(&mut page);
    gain_sweep(&mut page);
    time_response(&mut page, &t);
    energy(&mut page, &t);
    shares(&mut page);
    numbers(&mut page);
    odd_data(&mut page);
    page.write(&path)?;
    println!("{path}: {} kB", page.html().len() / 1000);
    Ok(())
}
