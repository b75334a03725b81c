//! Cost of a step over the number of bodies and of friction contacts. The model is a chain of masses on springs and dampers, some of which rub on the ground.
//! A sine pushes its end so that contacts slide, stop and stick.
//!
//!     cargo bench -p backdrive-plant --bench cost -- docs/step-cost.svg      (from the root; without a file nothing is drawn)
//!
//! Prints microseconds per step of one substep (the fastest of several rounds). Also prints the exponent of a power of the number of bodies fitted from 8
//! bodies on, and of the number of contacts from 2 on.

use backdrive_plant::model::Model;
use backdrive_plant::stepper::{Options, Plant, Segment};
use std::fmt::Write;
use std::time::Instant;

const BODIES: [usize; 10] = [2, 4, 6, 8, 12, 16, 24, 32, 48, 64];
const CONTACTS: [usize; 5] = [0, 2, 4, 8, 16];
const PERIOD_S: f64 = 5e-4;
const STEPS: usize = 4000;
const ROUNDS: usize = 7;

/// A chain; `None` where there are more contacts than bodies.
fn chain(bodies: usize, contacts: usize) -> Option<Model> {
    if contacts > bodies {
        return None;
    }
    let mut text = String::from("name = 'chain'\n[bodies]\n");
    (0..bodies).for_each(|i| writeln!(text, "b{i} = 0.05").unwrap());
    // Nonlinear, so that a chain without friction is stepped and not propagated exactly.
    text += "[[elements]]\nkind = 'cubic_spring'\nbetween = ['b0', 'ground']\nstiffness = 2000\ncubic = 1e6\n";
    for i in 1..bodies {
        let ends = format!("between = ['b{}', 'b{i}']", i - 1);
        writeln!(text, "[[elements]]\nkind = 'spring'\n{ends}\nstiffness = 2000\n[[elements]]\nkind = 'damper'\n{ends}\ndamping = 0.3")
            .unwrap();
    }
    for c in 0..contacts {
        let body = c * bodies / contacts;
        writeln!(text, "[[elements]]\nkind = 'coulomb'\nbetween = ['b{body}', 'ground']\nforce = 0.05").unwrap();
    }
    writeln!(text, "[[inputs]]\nname = 'push'\nkind = 'force'\non = 'b{}'\nhold = 'linear'", bodies - 1).unwrap();
    writeln!(text, "[[outputs]]\nname = 'end'\nkind = 'position'\nof = 'b{}'", bodies - 1).unwrap();
    Some(Model::from_toml(&text, "chain").expect("a model"))
}

/// Microseconds per step.
fn cost(model: &Model) -> f64 {
    let options = Options { substeps: Some(1), ..Options::default() };
    let mut plant = Plant::new(model, PERIOD_S, &options).expect("compiles");
    let force = |i: usize| 2.0 * (15.0 * i as f64 * PERIOD_S).sin();
    let mut out = [0.0];
    (0..ROUNDS)
        .map(|_| {
            plant.reset();
            let start = Instant::now();
            for i in 0..STEPS {
                plant.step(&[Segment::line(force(i), force(i + 1), PERIOD_S)]);
                plant.outputs(&mut out);
            }
            assert!(out[0].is_finite() && out[0] != 0.0);
            start.elapsed().as_secs_f64() * 1e6 / STEPS as f64
        })
        .fold(f64::INFINITY, f64::min)
}

/// Exponent of the power law through these points.
fn exponent(points: &[(f64, f64)]) -> f64 {
    let logs: Vec<(f64, f64)> = points.iter().map(|(x, y)| (x.ln(), y.ln())).collect();
    let mean = |f: &dyn Fn(&(f64, f64)) -> f64| logs.iter().map(f).sum::<f64>() / logs.len() as f64;
    let (x, y) = (mean(&|p| p.0), mean(&|p| p.1));
    logs.iter().map(|p| (p.0 - x) * (p.1 - y)).sum::<f64>() / logs.iter().map(|p| (p.0 - x).powi(2)).sum::<f64>()
}

const COLOURS: [&str; 5] = ["#222222", "#1f6fb2", "#2a8f4e", "#c77c11", "#b03a2e"];

/// The picture: both axes logarithmic.
fn drawn(curves: &[(usize, Vec<(f64, f64)>)]) -> String {
    let (least, most) =
        curves.iter().flat_map(|(_, points)| points).fold((f64::INFINITY, 0.0f64), |(low, high), (_, y)| (low.min(*y), high.max(*y)));
    let (low, high) = (least.log10().floor(), most.log10().ceil());
    let x = |bodies: f64| 70.0 + 500.0 * (bodies / 2.0).log2() / 5.0;
    let y = |cost: f64| 350.0 - 310.0 * (cost.log10() - low) / (high - low);
    let mut svg = String::from(
        "<svg xmlns=\"http://www.w3.org/2000/svg\" viewBox=\"0 0 720 410\" font-family=\"sans-serif\" font-size=\"13\">\n<rect width=\"720\" height=\"410\" fill=\"white\"/>\n",
    );
    for bodies in [2, 4, 8, 16, 32, 64] {
        let at = x(f64::from(bodies));
        writeln!(svg, "<path d=\"M{at:.1} 40V350\" stroke=\"#ddd\"/><text x=\"{at:.1}\" y=\"370\" text-anchor=\"middle\">{bodies}</text>")
            .unwrap();
    }
    for decade in low as i32..=high as i32 {
        for factor in [1.0, 2.0, 5.0] {
            let cost = factor * 10f64.powi(decade);
            if cost <= 10f64.powf(high) {
                let at = y(cost);
                writeln!(
                    svg,
                    "<path d=\"M70 {at:.1}H570\" stroke=\"#ddd\"/><text x=\"62\" y=\"{:.1}\" text-anchor=\"end\">{cost}</text>",
                    at + 4.0
                )
                .unwrap();
            }
        }
    }
    svg += "<text x=\"320\" y=\"397\" text-anchor=\"middle\">bodies in the chain</text><text x=\"70\" y=\"24\">time per step, µs</text><text x=\"585\" y=\"36\">friction contacts</text>\n";
    for (index, ((contacts, points), colour)) in curves.iter().zip(COLOURS).enumerate() {
        let line: Vec<String> = points.iter().map(|(n, cost)| format!("{:.1},{:.1}", x(*n), y(*cost))).collect();
        writeln!(svg, "<polyline points=\"{}\" fill=\"none\" stroke=\"{colour}\" stroke-width=\"2\"/>", line.join(" ")).unwrap();
        let at = 58 + 20 * index;
        writeln!(
            svg,
            "<path d=\"M585 {at}h24\" stroke=\"{colour}\" stroke-width=\"2\"/><text x=\"617\" y=\"{}\">{contacts}</text>",
            at + 4
        )
        .unwrap();
    }
    svg + "</svg>\n"
}

fn main() {
    let file = std::env::args().skip(1).find(|a| a.ends_with(".svg"));
    println!("contacts  {}   exponent from 8 bodies on", BODIES.map(|n| format!("{n:>7}")).concat());
    let mut curves = Vec::new();
    for contacts in CONTACTS {
        let points: Vec<(f64, f64)> = BODIES.iter().filter_map(|n| chain(*n, contacts).map(|model| (*n as f64, cost(&model)))).collect();
        let costs: String = points.iter().map(|(_, cost)| format!("{cost:>7.3}")).collect();
        let large: Vec<(f64, f64)> = points.iter().copied().filter(|(n, _)| *n >= 8.0).collect();
        println!("{contacts:>8}  {costs:>70}   {:.2}", exponent(&large));
        curves.push((contacts, points));
    }
    let widest: Vec<(f64, f64)> = curves
        .iter()
        .filter(|(contacts, _)| *contacts >= 2)
        .filter_map(|(contacts, points)| points.last().map(|p| (*contacts as f64, p.1)))
        .collect();
    println!("exponent over contacts from 2 on, with 64 bodies: {:.2}", exponent(&widest));
    if let Some(file) = file {
        // Cargo runs a bench in the folder of its package.
        let path = std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join("..").join(file);
        std::fs::write(&path, drawn(&curves)).unwrap_or_else(|e| panic!("{}: {e}", path.display()));
    }
}
