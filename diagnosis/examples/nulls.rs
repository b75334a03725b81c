//! `nulls COUNT [FIRST]`: how often a diagnosis claims an effect in devices whose model is complete. Devices of five kinds are drawn and simulated with
//! finer steps than the diagnosis takes. They are measured with noise and encoders. The diagnosis receives their models with parameters that are off in
//! half of the cases.

use backdrive_diagnosis::options;
use backdrive_diagnosis::output_error::work::Limit;
use backdrive_diagnosis::recordings::problem::{Problem, Record};
use backdrive_diagnosis::search::search;
use backdrive_diagnosis::verdict::verdict;
use backdrive_plant::model::{InputKind, Model};
use backdrive_plant::recording::Recording;
use backdrive_plant::set::Initial;
use backdrive_plant::stepper::{Options, Plant, simulate};
use rand::{Rng, RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, StandardNormal};
use std::f64::consts::TAU;

const MASTER: &str = "bodies = { motor = 0.02, drum = 0.03, handle = 0.1 }
elements = [
 { name = 'cable', kind = 'spring', between = ['motor', 'drum'], stiffness = 9000.0 },
 { name = 'cable_damping', kind = 'damper', between = ['motor', 'drum'], damping = 4.0 },
 { name = 'link', kind = 'spring', between = ['drum', 'handle'], stiffness = 1200.0 },
 { name = 'link_damping', kind = 'damper', between = ['drum', 'handle'], damping = 0.6 },
 { name = 'user', kind = 'spring', between = ['handle', 'ground'], stiffness = 400.0 },
 { name = 'user_damping', kind = 'damper', between = ['handle', 'ground'], damping = 12.0 },
]
inputs = [{ name = 'u', kind = 'force', on = 'motor', hold = 'zero' }]
outputs = [{ name = 'y', kind = 'position', of = 'motor', resolution = 2e-6 }]";
const COMPENSATOR: &str = "bodies = { ram = 0.001, disc = 0.4, flywheel = 0.2 }
elements = [
 { name = 'gearbox', kind = 'spring', between = ['ram', 'disc'], stiffness = 5e5 },
 { name = 'parasitic', kind = 'inerter', between = ['disc', 'ground'], inertance = 20.0 },
 { name = 'oil', kind = 'damper', between = ['disc', 'flywheel'], damping = 2500.0 },
 { name = 'inertance', kind = 'inerter', between = ['flywheel', 'ground'], inertance = 80.0 },
 { name = 'friction', kind = 'coulomb', between = ['disc', 'ground'], force = 20.0 },
]
inputs = [{ name = 'u', kind = 'motion', on = 'ram' }]
outputs = [{ name = 'y', kind = 'reaction', of = 'ram' }]";
const AXIS: &str = "bodies = { motor = 15.0 }
elements = [
 { name = 'viscous', kind = 'damper', between = ['motor', 'ground'], damping = 120.0 },
 { name = 'friction', kind = 'coulomb', between = ['motor', 'ground'], force = 8.0 },
]
inputs = [{ name = 'u', kind = 'force', on = 'motor', hold = 'linear' }]
outputs = [{ name = 'y', kind = 'position', of = 'motor', resolution = 1e-7 }]";
const BENCH: &str = "motion = 'rotation'
bodies = { engine = 0.35, dyno = 0.6 }
elements = [
 { name = 'shaft', kind = 'spring', between = ['engine', 'dyno'], stiffness = 2000.0 },
 { name = 'shaft_damping', kind = 'damper', between = ['engine', 'dyno'], damping = 1.4 },
 { name = 'engine_drag', kind = 'damper', between = ['engine', 'ground'], damping = 0.1 },
 { name = 'dyno_drag', kind = 'damper', between = ['dyno', 'ground'], damping = 0.4 },
]
inputs = [{ name = 'u', kind = 'force', on = 'dyno' }, { name = 'w', kind = 'force', on = 'engine' }]
outputs = [{ name = 'a', kind = 'velocity', of = 'engine' }, { name = 'b', kind = 'velocity', of = 'dyno' }, { name = 'c', kind = 'force', element = 'shaft' }]";
const CHAIN: &str = "motion = 'rotation'
bodies = { a = 0.05, b = 0.02, c = 0.03 }
elements = [
 { name = 'k0', kind = 'spring', between = ['a', 'b'], stiffness = 25.0 },
 { name = 'd0', kind = 'damper', between = ['a', 'b'], damping = 0.02 },
 { name = 'k1', kind = 'spring', between = ['b', 'c'], stiffness = 18.0 },
 { name = 'd1', kind = 'damper', between = ['b', 'c'], damping = 0.02 },
 { name = 'g', kind = 'spring', between = ['c', 'ground'], stiffness = 2.0 },
 { name = 'h', kind = 'damper', between = ['c', 'ground'], damping = 0.03 },
]
inputs = [{ name = 'u', kind = 'force', on = 'a', hold = 'linear' }]
outputs = [{ name = 'p', kind = 'acceleration', of = 'a' }, { name = 'q', kind = 'position', of = 'c' }]";

/// Name, text, period, size of the inputs.
const FAMILIES: [(&str, &str, f64, f64); 5] = [
    ("master", MASTER, 5e-4, 3.0),
    ("compensator", COMPENSATOR, 1e-3, 4e-3),
    ("axis", AXIS, 1e-3, 40.0),
    ("bench", BENCH, 2e-3, 30.0),
    ("chain", CHAIN, 5e-3, 0.5),
];

fn normal(random: &mut impl Rng) -> f64 {
    StandardNormal.sample(random)
}

fn excitation(kind: usize, n: usize, period: f64, size: f64, random: &mut impl Rng) -> Vec<f64> {
    let top = 0.02 / period;
    let length = n as f64 * period;
    let phases: Vec<f64> = (0..20).map(|_| random.random_range(0.0..TAU)).collect();
    (0..n)
        .map(|k| {
            let t = k as f64 * period;
            // From rest: every excitation comes in over a tenth of its length.
            let ease = (t / (0.1 * length)).min(1.0);
            let x = match kind {
                0 => (TAU * (0.02 * top + 0.5 * top * t / length) * t).sin(),
                1 => phases.iter().enumerate().map(|(i, p)| (TAU * top * (i + 1) as f64 / 20.0 * t + p).sin()).sum::<f64>() / 4.0,
                2 => 4.0 * ((t * 0.03 * top).fract() - 0.5).abs() - 1.0,
                _ => 0.7 * (TAU * 0.05 * top * t).sin() + 0.4 * (TAU * 0.31 * top * t).sin(),
            };
            size * ease * ease * (3.0 - 2.0 * ease) * x
        })
        .collect()
}

fn draw(seed: u64) -> Result<(String, Problem), Box<dyn std::error::Error>> {
    let mut random = ChaCha8Rng::seed_from_u64(seed);
    let (name, text, period, size) = FAMILIES[seed as usize % FAMILIES.len()];
    let text = format!("name = 'null'\n{text}\n");
    let mut truth = Model::from_toml(&text, name)?;
    let paths = truth.parameter_paths();
    for path in &paths {
        let values: Vec<f64> = truth.values_at(path)?.iter().map(|v| v * (0.35 * normal(&mut random)).exp()).collect();
        truth.set_values_at(path, &values)?;
    }
    let mut nominal = truth.clone();
    if random.random_bool(0.5) {
        for path in &paths {
            let factor = (0.15 * normal(&mut random)).exp();
            let values: Vec<f64> = nominal.values_at(path)?.iter().map(|v| v * factor).collect();
            nominal.set_values_at(path, &values)?;
        }
    }
    let n = 5000;
    let level = 10f64.powf(random.random_range(-3.5..-1.8));
    let mut records = Vec::new();
    // A sensor's noise is the same in every recording.
    let mut noise: Vec<f64> = Vec::new();
    for kind in 0..4 {
        let inputs: Vec<Vec<f64>> = truth
            .inputs
            .iter()
            .enumerate()
            .map(|(i, input)| {
                let size = if input.kind == InputKind::Motion { size } else { size * (0.3 * normal(&mut random)).exp() };
                excitation((kind + i) % 4, n, period, size, &mut random)
            })
            .collect();
        let substeps = 4 * Plant::new(&truth, period, &Options::default())?.substeps().max(4);
        let clean = simulate(&truth, &inputs, period, &Options { substeps: Some(substeps), ..Options::default() })?;
        let mut signals: Vec<(String, Vec<f64>)> = truth.inputs.iter().map(|i| i.name.clone()).zip(inputs).collect();
        for (o, (output, y)) in truth.outputs.iter().zip(clean).enumerate() {
            if noise.len() == o {
                noise.push(level * (y.iter().map(|y| y * y).sum::<f64>() / n as f64).sqrt());
            }
            let step = output.resolution;
            let measured = y.iter().map(|y| {
                let noisy = y + noise[o] * normal(&mut random);
                if step > 0.0 { step * (noisy / step).round() } else { noisy }
            });
            signals.push((output.name.clone(), measured.collect()));
        }
        let recording = Recording::new(format!("{kind}.csv"), (0..n).map(|k| k as f64 * period).collect(), signals)?;
        records.push(Record::new(&recording, &nominal, Vec::new())?);
    }
    let held_out = records.split_off(3);
    let problem = Problem::new(nominal.to_toml(), "null.toml".into(), nominal, records, held_out, Initial::Rest)?;
    Ok((name.to_string(), problem))
}

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let args: Vec<u64> = std::env::args().skip(1).filter_map(|a| a.parse().ok()).collect();
    let (count, first) = (args.first().copied().unwrap_or(10), args.get(1).copied().unwrap_or(0));
    let mut alarms = 0;
    for seed in first..first + count {
        let (name, problem) = draw(seed)?;
        let began = std::time::Instant::now();
        let found = search(&problem, &options::Options::default(), Limit::default(), &|_| {})?;
        let (said, _) = verdict(&problem, &found, &[], None, Limit::default())?;
        let alarm = !said.word.is_structure_right();
        alarms += u32::from(alarm);
        println!(
            "{seed} {name}: {}{} levels {:.3?} correlation {:.2} ({:.1} s)",
            if alarm { "FALSE ALARM " } else { "" },
            said.sentence,
            found.nominal.levels,
            found.nominal.correlation_time,
            began.elapsed().as_secs_f64()
        );
    }
    println!("{alarms} false alarms in {count}");
    Ok(())
}
