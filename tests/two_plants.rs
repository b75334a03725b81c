//! The plant's stepper against the hidden plant's integrator, which shares nothing with it but the model file.

use backdrive_plant::elements::KINDS;
use backdrive_plant::model::Model;
use backdrive_plant::stepper::{Options, simulate};
use backdrive_sealed::network::Network;
use backdrive_sealed::plant::SealedPlant;
use backdrive_sealed::truth::Truth;

/// A motor and a load behind a spring; a force drives one of them. `elements` are what else there is.
fn device(driven: &str, elements: &str) -> String {
    format!(
        "name = 'device'
[bodies]
motor = 0.05
load = 0.2
[[elements]]
name = 'joint'
kind = 'spring'
between = ['motor', 'load']
stiffness = 1500.0
[[elements]]
name = 'joint_damping'
kind = 'damper'
between = ['motor', 'load']
damping = 1.0
[[elements]]
name = 'centring'
kind = 'spring'
between = ['load', 'ground']
stiffness = 200.0
{elements}
[[inputs]]
name = 'f'
kind = 'force'
on = '{driven}'
[[outputs]]
name = 'motor'
kind = 'position'
of = 'motor'
[[outputs]]
name = 'load'
kind = 'velocity'
of = 'load'
"
    )
}

/// Asserts that both give the same outputs under a force, within `share` of their ranges (root mean square). `substeps` are the stepper's.
#[track_caller]
fn agree(text: &str, force: impl Fn(f64) -> f64, substeps: Option<usize>, share: f64) {
    let (period, count) = (1e-3, 4000);
    let column: Vec<f64> = (0..count).map(|k| force(k as f64 * period)).collect();
    let model = Model::from_toml(text, "device").unwrap();
    let ours = simulate(&model, &[&column], period, &Options { substeps, ..Options::default() }).unwrap();
    let network = Network::from_toml(text, "device").unwrap();
    let mut hidden = SealedPlant::new(&network, &Truth::nothing(&network), period).unwrap();
    let theirs: Vec<Vec<f64>> = column
        .iter()
        .map(|f| {
            hidden.step(&[*f]).unwrap();
            hidden.exact_outputs().to_vec()
        })
        .collect();
    for (output, ours) in ours.iter().enumerate() {
        // What one reads before a step, the other reads after the step before.
        let pairs = || ours[1..].iter().zip(theirs.iter().map(|row| row[output]));
        let off = (pairs().map(|(a, b)| (a - b) * (a - b)).sum::<f64>() / (count - 1) as f64).sqrt();
        let (low, high) = ours.iter().fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), x| (low.min(*x), high.max(*x)));
        assert!(off < share * (high - low), "output {output}: {off} apart in a range of {}", high - low);
    }
}

/// A force to and fro, slower and faster.
fn to_and_fro(t: f64) -> f64 {
    2.5 * (4.0 * t + 6.0 * t * t).sin() * (1.0 - (-4.0 * t).exp())
}

fn element(kind: &str, between: [&str; 2], numbers: &str) -> String {
    format!("[[elements]]\nname = '{kind}'\nkind = '{kind}'\nbetween = ['{}', '{}']\n{numbers}\n", between[0], between[1])
}

#[test]
fn coulomb_friction() {
    agree(&device("motor", &element("coulomb", ["motor", "ground"], "force = 0.3")), to_and_fro, None, 2e-3);
}

#[test]
fn friction_under_load() {
    let friction = |between| element("load_friction", between, "force = 0.1\ncoefficient = 0.2");
    agree(&device("motor", &friction(["motor", "ground"])), to_and_fro, None, 2e-3);
    agree(&device("load", &friction(["ground", "motor"])), to_and_fro, None, 2e-3);
}

#[test]
fn friction_that_warms() {
    let text = device("motor", &element("warm_friction", ["motor", "ground"], "force = 0.4\nhalf_heat = 0.05\ncooling_time = 1.2"));
    agree(&text, to_and_fro, None, 2e-3);
}

#[test]
fn loss_of_a_gear() {
    let loss = |between, back: f64| element("gear_loss", between, &format!("efficiency = 0.8\nback_efficiency = {back}"));
    for driven in ["motor", "load"] {
        agree(&device(driven, &loss(["motor", "ground"], 0.7)), to_and_fro, None, 1e-3);
    }
    agree(&device("motor", &loss(["ground", "motor"], 0.5)), to_and_fro, None, 1e-3);
    // Where it locks, the moment at which it does decides what follows: that takes short substeps.
    agree(&device("motor", &loss(["motor", "ground"], -0.3)), to_and_fro, Some(16), 2e-3);
}

#[test]
fn a_joint_that_creeps() {
    let joint = element("creep", ["motor", "load"], "stiffness = 900.0\ncreep_stiffness = [2000.0, 700.0]\ntime = [0.02, 0.5]");
    agree(&device("motor", &joint), to_and_fro, None, 1e-3);
}

/// Kinds that model files may name and that the hidden plant has not: no device with one of them can be concealed.
const NOT_HIDDEN: [&str; 4] = ["bouc_wen", "contact", "hunt_crossley", "preisach_lugre"];

#[test]
fn every_element_kind_of_the_stepper_is_known_to_the_hidden_plant() {
    for kind in KINDS {
        // Parameters may be missing or wrong here: that error is about a known kind.
        let told = Network::from_toml(&device("motor", &element(kind.name, ["motor", "ground"], "")), "device").err();
        let told = told.map_or_else(String::new, |error| error.to_string());
        let is_unknown = told.contains("does not know");
        assert_eq!(is_unknown, NOT_HIDDEN.contains(&kind.name), "{}: a law of it belongs into sealed/src/laws/ ({told})", kind.name);
    }
}
