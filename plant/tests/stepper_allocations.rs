//! A plant is stepped and read without asking for memory, be it small, large, rubbing, stiff, or a copy of another.

mod counting;

use backdrive_plant::model::{Fragment, Model};
use backdrive_plant::stepper::{Options, Plant, Segment};
use std::fmt::Write;
use std::path::Path;

/// Steps under a sine on every input, and how often memory was asked for on the way.
fn asked_while_stepping(model: &Model, amplitude: f64, substeps: Option<usize>) -> usize {
    let options = Options { substeps, add_noise: Some(1), quantise: true };
    // A copy: what it has kept space for must be copied, too.
    let mut plant = Plant::new(model, 1e-3, &options).expect("compiles").clone();
    let mut values = vec![0.0; plant.output_count()];
    let mut inputs = vec![Segment::default(); model.inputs.len()];
    let at = |i: u32| amplitude * (0.05 * f64::from(i)).sin();
    let asked = counting::asked(|| {
        for i in 0..1500 {
            inputs.fill(Segment::line(at(i), at(i + 1), 1e-3));
            plant.step(&inputs);
            plant.outputs(&mut values);
        }
    });
    assert!(plant.is_finite() && (0..model.bodies.len()).any(|b| plant.position(b) != 0.0), "{} moves", model.name);
    asked
}

fn chain(bodies: usize, contacts: usize) -> Model {
    let mut text = String::from("name = 'chain'\n[bodies]\n");
    (0..bodies).for_each(|i| writeln!(text, "b{i} = 0.05").unwrap());
    text += "[[elements]]\nkind = 'contact'\nbetween = ['b0', 'ground']\nstiffness = 1e7\n";
    for i in 1..bodies {
        writeln!(text, "[[elements]]\nkind = 'spring'\nbetween = ['b{}', 'b{i}']\nstiffness = 2000", i - 1).unwrap();
    }
    for c in 0..contacts {
        writeln!(
            text,
            "[[elements]]\nkind = 'stribeck'\nbetween = ['b{}', 'ground']\ncoulomb = 0.05\nstatic = 0.08\nvelocity = 0.1",
            c * bodies / contacts
        )
        .unwrap();
    }
    writeln!(text, "[[inputs]]\nname = 'push'\nkind = 'force'\non = 'b{}'\nhold = 'linear'", bodies - 1).unwrap();
    writeln!(text, "[[outputs]]\nname = 'end'\nkind = 'acceleration'\nof = 'b0'\n").unwrap();
    Model::from_toml(&text, "chain").unwrap()
}

#[test]
fn nothing_is_allocated_while_stepping() {
    assert_eq!(counting::asked(|| drop(std::hint::black_box(vec![0_u8; 1]))), 1, "the counter counts");
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("models");
    let grip = Fragment::load(&folder.join("../grips/normal.toml")).unwrap();
    let mut seen = 0;
    for entry in std::fs::read_dir(&folder).unwrap() {
        let path = entry.unwrap().path();
        let Ok(mut model) = Model::load(&path) else { continue };
        if let Some(axis) = model.axes.first().filter(|axis| !axis.holds_user).map(|axis| axis.user) {
            model.attach(&grip, axis, "hand");
        }
        assert_eq!(asked_while_stepping(&model, 1e-2, None), 0, "{}", path.display());
        seen += 1;
    }
    assert!(seen > 10, "{seen} models");
    for (bodies, contacts) in [(2, 2), (8, 8), (12, 3), (64, 16), (64, 0)] {
        assert_eq!(asked_while_stepping(&chain(bodies, contacts), 1.0, Some(2)), 0, "{bodies} bodies, {contacts} contacts");
    }
}
