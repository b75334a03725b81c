//! Derivatives carried along with a motion, beside differences of whole simulations.

use backdrive_plant::elements::KINDS;
use backdrive_plant::model::Model;
use backdrive_plant::stepper::{LANES, Options, Plant, Segment, Tangents};

const PERIOD: f64 = 1e-3;
const SAMPLES: usize = 1500;

/// A motor that moves a handle by a shaft; `between` two places is the element.
fn master(kind: &str, parameters: &str, between: &str, outputs: &str) -> Model {
    let text = format!(
        "name = 'master'
[bodies]
motor = 0.4
handle = 0.9
[[elements]]
name = 'shaft'
kind = 'spring'
between = ['motor', 'handle']
stiffness = 4000.0
[[elements]]
name = 'grease'
kind = 'damper'
between = ['motor', 'handle']
damping = 6.0
[[elements]]
name = 'grip'
kind = 'spring'
between = ['handle', 'ground']
stiffness = 150.0
[[elements]]
name = 'hand'
kind = 'damper'
between = ['handle', 'ground']
damping = 3.0
[[elements]]
name = 'law'
kind = '{kind}'
between = [{between}]
{parameters}
[[inputs]]
name = 'force'
kind = 'force'
on = 'motor'
hold = 'linear'
{outputs}"
    );
    Model::from_toml(&text, kind).unwrap()
}

const POSITIONS: &str = "[[outputs]]
name = 'x'
kind = 'position'
of = 'handle'
[[outputs]]
name = 'v'
kind = 'velocity'
of = 'motor'
";

const FORCES: &str = "[[outputs]]
name = 'x'
kind = 'position'
of = 'handle'
delay = 0.0023
[[outputs]]
name = 'a'
kind = 'acceleration'
of = 'motor'
[[outputs]]
name = 'f'
kind = 'force'
element = 'law'
";

/// Sines of which none is a multiple of another.
fn force(sample: usize) -> f64 {
    let t = sample as f64 * PERIOD;
    6.0 * (9.1 * t).sin() + 4.0 * (23.7 * t + 1.0).sin() + 2.0 * (61.3 * t).sin()
}

fn segment(sample: usize) -> Segment {
    Segment::line(force(sample), force(sample + 1), PERIOD)
}

/// Outputs, one column after the other.
fn simulated(model: &Model, substeps: usize) -> Vec<f64> {
    let mut plant = Plant::new(model, PERIOD, &Options { substeps: Some(substeps), ..Options::default() }).unwrap();
    let count = model.outputs.len();
    let (mut columns, mut values) = (vec![0.0; count * SAMPLES], vec![0.0; count]);
    plant.start_at(&[]);
    for sample in 0..SAMPLES {
        plant.outputs(&mut values);
        (0..count).for_each(|o| columns[o * SAMPLES + sample] = values[o]);
        plant.step(&[segment(sample)]);
    }
    columns
}

/// Paths of every parameter of a model, and their values.
fn parameters(model: &Model) -> Vec<(String, usize, f64)> {
    let mut all: Vec<(String, usize, f64)> = model.bodies.iter().map(|b| (format!("bodies.{}", b.name), 0, b.inertia)).collect();
    for element in &model.elements {
        for (parameter, values) in element.law.kind().parameters.iter().zip(element.law.values()) {
            all.extend(values.iter().enumerate().map(|(i, value)| (format!("elements.{}.{}", element.name, parameter.key), i, *value)));
        }
    }
    // From 0 some have a derivative to one side only: round ends of a gap are another law, and a spring without a rest length leaves a joint unloaded.
    all.retain(|(.., value)| *value != 0.0);
    all
}

fn with(model: &Model, path: &str, index: usize, value: f64) -> Option<Model> {
    let mut changed = model.clone();
    let mut values = changed.values_at(path).ok()?;
    values[index] = value;
    changed.set_values_at(path, &values).ok()?;
    Some(changed)
}

fn rms(column: &[f64]) -> f64 {
    (column.iter().map(|y| y * y).sum::<f64>() / column.len() as f64).sqrt()
}

/// The worst of how far the derivatives of an output by a parameter are from differences, over their rms; and which it was.
fn worst(model: &Model) -> (f64, String) {
    let parameters = parameters(model);
    let mut worst = (0.0, String::new());
    for group in parameters.chunks(LANES) {
        let moved: Vec<(Model, f64)> = group
            .iter()
            .filter_map(|(path, i, value)| {
                let step = 1e-6 * value;
                with(model, path, *i, value + step).map(|m| (m, step))
            })
            .collect();
        assert_eq!(moved.len(), group.len());
        let mut plant = Plant::new(model, PERIOD, &Options::default()).unwrap();
        let mut tangents = Tangents::new(&plant, model, &moved, PERIOD).expect("it can be followed");
        plant.start_at(&[]);
        tangents.start_at(&[]);
        let count = model.outputs.len();
        let (mut values, mut now) = (vec![0.0; count], vec![vec![0.0; count]; group.len()]);
        let mut columns = vec![vec![0.0; count * SAMPLES]; group.len()];
        let mut followed = vec![0.0; count * SAMPLES];
        for sample in 0..SAMPLES {
            plant.outputs(&mut values);
            tangents.outputs(&plant, &values, &mut now);
            for o in 0..count {
                followed[o * SAMPLES + sample] = values[o];
                columns.iter_mut().zip(&now).for_each(|(column, now)| column[o * SAMPLES + sample] = now[o]);
            }
            tangents.step(&mut plant, &[segment(sample)]);
        }
        let substeps = plant.substeps();
        assert_eq!(followed, simulated(model, substeps), "it moves as if nobody followed");
        for ((path, i, value), column) in group.iter().zip(&columns) {
            let step = 3e-6 * value;
            let ahead = with(model, path, *i, value + step).map(|m| simulated(&m, substeps));
            let behind = with(model, path, *i, value - step).map(|m| simulated(&m, substeps));
            let (Some(ahead), over) = (ahead, if behind.is_some() { 2.0 * step } else { step }) else { continue };
            let behind = behind.unwrap_or_else(|| followed.clone());
            let difference: Vec<f64> = ahead.iter().zip(&behind).map(|(a, b)| (a - b) / over).collect();
            for o in 0..count {
                let (mine, other) = (&column[o * SAMPLES..(o + 1) * SAMPLES], &difference[o * SAMPLES..(o + 1) * SAMPLES]);
                let apart: Vec<f64> = mine.iter().zip(other).map(|(a, b)| a - b).collect();
                let share = rms(&apart) / rms(other).max(1e-9 * rms(&followed) / value.abs().max(1.0));
                if share > worst.0 || share.is_nan() {
                    worst = (share, format!("{path}[{i}] -> {}", model.outputs[o].name));
                }
            }
        }
    }
    worst
}

/// Numbers with which a kind shows what it does under the force above.
fn typical(kind: &str) -> &'static str {
    match kind {
        "coulomb" => "force = 2.5",
        "asymmetric_coulomb" => "positive = 2.0\nnegative = 3.0",
        "stribeck" => "coulomb = 1.5\nstatic = 2.6\nvelocity = 0.03",
        "friction_deficit" => "coulomb = 2.5\nrest = 1.2\nvelocity = 0.03",
        "load_friction" => "force = 0.8\ncoefficient = 0.2",
        "warm_friction" => "force = 3.0\nhalf_heat = 0.4\ncooling_time = 0.5",
        "gear_loss" => "efficiency = 0.8\nback_efficiency = 0.7",
        "asymmetric_damper" => "positive = 5.0\nnegative = 12.0",
        "quadratic_drag" => "coefficient = 20.0",
        "dahl" => "stiffness = 3000.0\ncoulomb = 2.5",
        "lugre" => "stiffness = 8000.0\ndamping = 20.0\ncoulomb = 1.5\nstatic = 2.5\nvelocity = 0.03",
        "maxwell_slip" => "stiffness = [900.0, 500.0, 200.0]\nforce = [0.5, 1.0, 1.5]",
        "hysteretic_spring" => {
            "stiffness_positive = 300.0\nstiffness_negative = 260.0\noffset_positive = 0.8\noffset_negative = -0.7\nbandwidth = 900.0"
        }
        "bouc_wen" => "stiffness = 800.0\nratio = 0.3\namplitude = 1.0\nbeta = 200.0\ngamma = 100.0\nexponent = 1.3",
        "backlash" => "gap = 0.004\nstiffness = 3000.0\ndamping = 8.0",
        "contact" => "stiffness = 2000.0\ndamping = 10.0\ngap = 0.003",
        "hunt_crossley" => "stiffness = 20000.0\ndamping = 9000.0\nexponent = 1.3\ngap = 0.003",
        "cubic_spring" => "stiffness = 100.0\ncubic = 300000.0",
        "cogging" => "amplitude = 1.5\nperiod = 0.011\nphase = 0.4",
        "creep" => "stiffness = 600.0\ncreep_stiffness = [400.0, 900.0]\ntime = [0.02, 0.3]",
        _ => "",
    }
}

#[test]
fn derivatives_are_those_of_differences_for_every_kind() {
    let mut seen = 0;
    for kind in KINDS {
        let numbers = typical(kind.name);
        let Some(law) = Some(numbers).filter(|n| !n.is_empty()) else { continue };
        for between in ["'motor', 'ground'", "'motor', 'handle'"] {
            for outputs in [POSITIONS, FORCES] {
                let model = master(kind.name, law, between, outputs);
                let (off, which) = worst(&model);
                assert!(off < 2e-3, "{} {between}: {off} {which}", kind.name);
                seen += 1;
            }
        }
    }
    assert!(seen >= 4 * 19, "{seen}");
}

#[test]
fn what_has_no_substeps_to_follow_is_refused() {
    let model = master("damper", "damping = 1.0", "'motor', 'ground'", POSITIONS);
    let plant = Plant::new(&model, PERIOD, &Options::default()).unwrap();
    let heavier = with(&model, "bodies.motor", 0, 0.41).unwrap();
    assert!(Tangents::new(&plant, &model, &[(heavier, 0.01)], PERIOD).is_none());
    // A sensor that reads more is no matter of the motion.
    let model = master("coulomb", "force = 1.0", "'motor', 'ground'", POSITIONS);
    let plant = Plant::new(&model, PERIOD, &Options::default()).unwrap();
    let mut louder = model.clone();
    louder.outputs[0].gain = 1.1;
    assert!(Tangents::new(&plant, &model, &[(louder, 0.1)], PERIOD).is_none());
}
