//! What a person is shown of a model.

use backdrive_plant::describe::{Severity, check, describe};
use backdrive_plant::linear::Operating;
use backdrive_plant::model::{Fragment, Model};
use std::path::{Path, PathBuf};

fn file(name: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join(name)
}

fn device(name: &str) -> Model {
    Model::load(&file(&format!("models/{name}.toml"))).unwrap_or_else(|e| panic!("{e}"))
}

#[test]
fn the_network_is_drawn() {
    let shown = describe(&device("impulse-engine"), &Operating::amplitude(1e-4));
    println!("{shown}");
    let expected = "\
[motor] 0.01075 kg   <== force feedback_force   ==> position motor_position
  |-- ground: motor_friction (coulomb)
  |
  +== cable (spring), cable_damping (damper)
  |
[drum] 0.0175 kg
  |-- ground: drum_damping (damper), drum_friction (coulomb)
  |
  +== linkage (hysteretic_spring), linkage_damping (damper)
  |
[handle] 0.04 kg   (axis forward: user)
";
    assert_eq!(shown.diagram, expected);
    assert_eq!((shown.modes.len(), shown.responses.len(), shown.not_linear.is_none()), (3, 1, true));
    assert_eq!(shown.responses[0].unit, "m/N");
    let json = serde_json::to_value(&shown).unwrap();
    assert_eq!(json["elements"][0]["parameters"][0]["unit"], "N/m");
}

#[test]
fn branches_and_loops_are_drawn_once() {
    let text = "[bodies]\na=1\nb=1\nc=1\nd=1\n\
        [[elements]]\nname='ab'\nkind='spring'\nbetween=['a','b']\nstiffness=1\n\
        [[elements]]\nname='ac'\nkind='spring'\nbetween=['c','a']\nstiffness=1\n\
        [[elements]]\nname='bc'\nkind='spring'\nbetween=['b','c']\nstiffness=1\n\
        [[elements]]\nname='ad'\nkind='spring'\nbetween=['a','d']\nstiffness=1\n";
    let shown = describe(&Model::from_toml(text, "x").unwrap(), &Operating::small());
    for name in ["[a]", "[d]", "ab (", "ac (", "bc (", "ad ("] {
        assert_eq!(shown.diagram.matches(name).count(), 1 + usize::from(name == "[a]"), "{name}\n{}", shown.diagram);
    }
}

#[test]
fn odd_things_are_remarked() {
    let messages =
        |m: &Model| check(m, &Operating::amplitude(1e-4)).iter().map(|r| format!("{}: {}", r.about, r.message)).collect::<Vec<_>>();
    let engine = messages(&device("impulse-engine"));
    assert!(engine[0].starts_with("elements.linkage: creates energy in cycles beyond 0.0047 m"), "{engine:?}");
    let text = "[bodies]\na=1\nb=1\n[[elements]]\nname='k'\nkind='damper'\nbetween=['a','ground']\ndamping=-1\n";
    let odd = Model::from_toml(text, "x").unwrap();
    let found = messages(&odd);
    for expected in [
        "bodies.b: nothing is tied",
        "elements.k: creates energy: its damping is -1",
        "inputs: nothing drives",
        "x: a motion about rest grows",
    ] {
        assert!(found.iter().any(|m| m.starts_with(expected)), "{expected}: {found:?}");
    }
}

/// Every device of ours, alone and held or with each environment, can be simulated.
#[test]
fn no_file_of_ours_has_an_error() {
    let fragments = |folder: &str| {
        let mut found: Vec<Fragment> = Vec::new();
        for entry in std::fs::read_dir(file(folder)).unwrap() {
            found.push(Fragment::load(&entry.unwrap().path()).unwrap_or_else(|e| panic!("{e}")));
        }
        found
    };
    let (grips, walls) = (fragments("grips"), fragments("environments"));
    for entry in std::fs::read_dir(file("models")).unwrap() {
        let path = entry.unwrap().path();
        let device = Model::load(&path).unwrap_or_else(|e| panic!("{e}"));
        for fragment in grips.iter().chain(&walls) {
            let mut m = device.clone();
            for axis in device.axes.iter() {
                let on = m.attach(fragment, axis.user, &axis.name);
                m.add_port_force(&on);
            }
            let errors: Vec<_> = check(&m, &Operating::amplitude(1e-4)).into_iter().filter(|r| r.severity == Severity::Error).collect();
            assert!(errors.is_empty(), "{} with {}: {errors:?}", path.display(), fragment.network.name);
        }
    }
}
