//! What derivatives by eight parameters cost: carried along with the motion, beside eight more simulations.
//!
//!     cargo bench -p backdrive-plant --bench tangents
//!
//! For each law, of one body and of three: nanoseconds per substep of the plant alone, and the cost of the plant with its derivatives in units of
//! that (differences take nine). Both are given with the law's own parameters among the eight and without. Medians of 15 interleaved runs.

use backdrive_plant::model::Model;
use backdrive_plant::stepper::{Options, Plant, Segment, Tangents};
use std::hint::black_box;
use std::time::Instant;

const PERIOD: f64 = 1e-3;
const SAMPLES: usize = 4000;
const RUNS: usize = 15;

/// A chain of bodies, the first one pushed and held by the law; numbers as of a haptic master.
fn chain(bodies: usize, law: &str) -> Model {
    let mut text = String::from("name = 'chain'\n[bodies]\n");
    (0..bodies).for_each(|i| text += &format!("b{i} = 0.{}\n", 5 + i));
    for i in 0..bodies {
        let to = if i + 1 < bodies { format!("b{}", i + 1) } else { "ground".to_owned() };
        text += &format!("[[elements]]\nname = 's{i}'\nkind = 'spring'\nbetween = ['b{i}', '{to}']\nstiffness = {}.0\n", 300 + 2000 * i);
        text += &format!("[[elements]]\nname = 'd{i}'\nkind = 'damper'\nbetween = ['b{i}', '{to}']\ndamping = 3.0\n");
    }
    text += &format!("[[elements]]\nname = 'law'\nbetween = ['b0', 'ground']\n{law}\n");
    text += "[[inputs]]\nname = 'f'\nkind = 'force'\non = 'b0'\nhold = 'linear'\n[[outputs]]\nname = 'x'\nkind = 'position'\nof = 'b0'\n";
    Model::from_toml(&text, "chain").expect("a model")
}

/// Up to eight models of which each has one number a millionth larger.
fn moved(model: &Model, own: bool) -> Vec<(Model, f64)> {
    let mut paths: Vec<(String, f64)> = Vec::new();
    let law = model.elements.last().expect("the law");
    for (parameter, values) in law.law.kind().parameters.iter().zip(law.law.values()) {
        paths.push((format!("elements.law.{}", parameter.key), values[0]));
    }
    paths.extend(model.bodies.iter().map(|b| (format!("bodies.{}", b.name), b.inertia)));
    paths.extend(model.elements.iter().take(model.elements.len() - 1).map(|e| {
        let key = if e.name.starts_with('s') { "stiffness" } else { "damping" };
        (format!("elements.{}.{key}", e.name), e.law.values()[0][0])
    }));
    let lane = |(path, value): (String, f64)| {
        let mut changed = model.clone();
        let mut values = changed.values_at(&path).expect("a path");
        values[0] = value * (1.0 + 1e-6);
        changed.set_values_at(&path, &values).ok()?;
        Some((changed, 1e-6 * value))
    };
    let mut all: Vec<(Model, f64)> = paths.into_iter().filter(|(_, value)| *value != 0.0).filter_map(lane).collect();
    if !own {
        all.reverse();
    }
    let some = all.len();
    (some..8).for_each(|i| all.push(all[(i - some) % if own { some } else { 3 }].clone()));
    all.truncate(8);
    all
}

fn segment(sample: usize) -> Segment {
    let at = |i: usize| 8.0 * (0.02 * i as f64).sin() + 3.0 * (0.093 * i as f64).sin();
    Segment::line(at(sample), at(sample + 1), PERIOD)
}

fn main() {
    let laws = [
        ("coulomb", "kind = 'coulomb'\nforce = 2.0"),
        ("stribeck", "kind = 'stribeck'\ncoulomb = 1.5\nstatic = 2.5\nvelocity = 0.05"),
        ("quadratic_drag", "kind = 'quadratic_drag'\ncoefficient = 20.0"),
        ("bouc_wen", "kind = 'bouc_wen'\nstiffness = 800.0\nratio = 0.3\namplitude = 1.0\nbeta = 200.0\ngamma = 100.0\nexponent = 1.3"),
        ("bouc_wen, stiff", "kind = 'bouc_wen'\nstiffness = 1e6\nratio = 0.01\namplitude = 1.0\nbeta = 4e5\ngamma = 1e5\nexponent = 1.3"),
        ("lugre", "kind = 'lugre'\nstiffness = 2e5\ndamping = 80.0\ncoulomb = 1.5\nstatic = 2.5\nvelocity = 0.03"),
        ("maxwell_slip", "kind = 'maxwell_slip'\nstiffness = [900.0, 500.0, 200.0]\nforce = [0.5, 1.0, 1.5]"),
        (
            "hysteretic_spring",
            "kind = 'hysteretic_spring'\nstiffness_positive = 300.0\nstiffness_negative = 260.0\noffset_positive = 0.8\noffset_negative = -0.7\nbandwidth = 900.0",
        ),
        ("backlash", "kind = 'backlash'\ngap = 0.004\nstiffness = 3000.0\ndamping = 8.0"),
    ];
    println!("{:<20} {:>6} {:>14} {:>20} {:>20}", "law", "bodies", "alone, ns", "with the law's", "with the others");
    for (name, law) in laws {
        for bodies in [1, 3] {
            let model = chain(bodies, law);
            let plant = Plant::new(&model, PERIOD, &Options::default()).expect("a plant");
            let follow = |own: bool| Tangents::new(&plant, &model, &moved(&model, own), PERIOD).expect("it can be followed");
            let tangents = [follow(true), follow(false)];
            let substeps = plant.substeps();
            let (mut alone, mut followed) = (Vec::new(), [Vec::new(), Vec::new()]);
            for _ in 0..RUNS {
                let mut p = plant.clone();
                let began = Instant::now();
                (0..SAMPLES).for_each(|i| p.step(&[segment(i)]));
                alone.push(began.elapsed().as_secs_f64());
                black_box(p.position(0));
                for (tangents, followed) in tangents.iter().zip(&mut followed) {
                    let (mut p, mut t) = (plant.clone(), tangents.clone());
                    let began = Instant::now();
                    (0..SAMPLES).for_each(|i| t.step(&mut p, &[segment(i)]));
                    followed.push(began.elapsed().as_secs_f64());
                    black_box(p.position(0));
                }
            }
            let median = |times: &mut Vec<f64>| {
                times.sort_by(f64::total_cmp);
                times[RUNS / 2] * 1e9 / (SAMPLES * substeps) as f64
            };
            let a = median(&mut alone);
            let [own, rest] = followed.map(|mut times| median(&mut times) / a);
            println!("{name:<20} {bodies:>6} {a:>14.0} {own:>20.1} {rest:>20.1}");
        }
    }
}
