//! Time per simulated second of the chain in `chain.toml`, at the step where the solution is within 1 % of its converged one.
//!
//! The other side is `time_mujoco.py`; `benches/README.md` describes how to run both and lists the results.

use backdrive_plant::model::Model;
use backdrive_plant::stepper::{Options, Plant, Segment};
use std::f64::consts::TAU;
use std::hint::black_box;
use std::path::Path;
use std::time::Instant;

/// Time for which the force is held, s.
const HOLD_S: f64 = 1e-3;
/// Samples of the force.
const SAMPLES: usize = 2000;
/// Substeps of each hold that count as converged.
const CONVERGED: usize = 500;
const ROUNDS: usize = 200;

/// The force of `tests/python/mujoco_chain.py`, N.
fn force() -> Vec<f64> {
    let at = |t: f64| (TAU * 1.3 * t).sin() + 0.8 * (TAU * 7.1 * t).sin() + 0.6 * (TAU * 23.0 * t).sin();
    (0..SAMPLES).map(|k| HOLD_S * k as f64).map(|t| 2.0 * (t / 0.1).min(1.0) * at(t)).collect()
}

/// Positions of the three masses after every hold, m.
fn run(plant: &mut Plant, force: &[f64]) -> Vec<[f64; 3]> {
    plant.reset();
    let step = |force: &f64| {
        plant.step(&[Segment::held(*force)]);
        [plant.position(0), plant.position(1), plant.position(2)]
    };
    force.iter().map(step).collect()
}

/// Largest distance as a share of each mass's range.
fn distance(found: &[[f64; 3]], expected: &[[f64; 3]]) -> f64 {
    let of_mass = |i: usize| {
        let (low, high) = expected.iter().fold((0.0f64, 0.0f64), |(low, high), x| (low.min(x[i]), high.max(x[i])));
        let apart = found.iter().zip(expected).map(|(a, b)| (a[i] - b[i]).abs()).fold(0.0, f64::max);
        apart / (high - low)
    };
    (0..3).map(of_mass).fold(0.0, f64::max)
}

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let model = Model::load(&Path::new(env!("CARGO_MANIFEST_DIR")).join("benches/mujoco_chain/chain.toml"))?;
    let force = force();
    let plant = |substeps| Plant::new(&model, HOLD_S, &Options { substeps, ..Options::default() });
    let converged = run(&mut plant(Some(CONVERGED))?, &force);
    println!("{:>12} {:>14} {:>26}", "step, us", "from converged", "ns per simulated second");
    for substeps in [Some(1), Some(2), Some(4), Some(10), None] {
        let mut plant = plant(substeps)?;
        let apart = distance(&run(&mut plant, &force), &converged);
        let mut fastest = f64::INFINITY;
        for _ in 0..ROUNDS {
            let start = Instant::now();
            black_box(run(&mut plant, black_box(&force)));
            fastest = fastest.min(start.elapsed().as_secs_f64());
        }
        let per_second = 1e9 * fastest / (HOLD_S * SAMPLES as f64);
        let chosen = if substeps.is_none() { "  (the step it chooses)" } else { "" };
        println!("{:>12.1} {:>12.2} % {:>26.0}{chosen}", 1e6 * HOLD_S / plant.substeps() as f64, 100.0 * apart, per_second);
    }
    Ok(())
}
