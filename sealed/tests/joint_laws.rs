//! Laws of a joint: friction by what it passes on, and creep, against closed forms.

mod common;

use backdrive_sealed::network::NetworkError;
use backdrive_sealed::plant::SealedPlant;
use backdrive_sealed::truth::Truth;
use common::*;

/// A shaft with friction, and a load behind a spring; dampers to ground on either.
fn gear(friction: &str, damping: [f64; 2], driven: &str) -> SealedPlant {
    let text = format!(
        "name = 'gear'
[bodies]
shaft = 0.05
load = 0.2
[[elements]]
name = 'spring'
kind = 'spring'
between = ['shaft', 'load']
stiffness = 3000.0
[[elements]]
name = 'loss'
kind = 'damper'
between = ['shaft', 'load']
damping = 2.0
{}{}{}
[[inputs]]
name = 'f'
kind = 'force'
on = '{driven}'
[[outputs]]
name = 'v'
kind = 'velocity'
of = 'load'
[[outputs]]
name = 'x'
kind = 'position'
of = 'shaft'
",
        element("friction", "shaft", friction),
        element("shaft_damping", "shaft", &format!("kind = 'damper'\ndamping = {}", damping[0])),
        element("load_damping", "load", &format!("kind = 'damper'\ndamping = {}", damping[1])),
    );
    let network = device(&text);
    SealedPlant::new(&network, &Truth::nothing(&network), 1e-3).unwrap()
}

fn settled(mut plant: SealedPlant, force: f64) -> f64 {
    run(&mut plant, 6000, 1e-3, |t| vec![force * (t / 0.5).min(1.0)]).last().unwrap()[0]
}

#[test]
fn friction_in_a_joint_takes_its_share_of_what_is_passed_on() {
    // f = L + c + mu L, L = 10 v.
    let v = settled(gear("kind = 'load_friction'\nforce = 0.4\ncoefficient = 0.25", [0.0, 10.0], "shaft"), 5.0);
    near(10.0 * v, (5.0 - 0.4) / 1.25, 1e-4);
    // Driven from behind the shaft gets L - c - mu L.
    let v = settled(gear("kind = 'load_friction'\nforce = 0.4\ncoefficient = 0.25", [10.0, 0.0], "load"), -5.0);
    near(10.0 * v, -(5.0 - 0.4 - 0.25 * 5.0), 1e-4);
}

#[test]
fn a_gear_loses_by_the_direction_of_power() {
    let loss = "kind = 'gear_loss'\nefficiency = 0.8\nback_efficiency = 0.7";
    for force in [5.0, -5.0] {
        near(10.0 * settled(gear(loss, [0.0, 10.0], "shaft"), force), 0.8 * force, 1e-4);
        near(10.0 * settled(gear(loss, [10.0, 0.0], "load"), force), 0.7 * force, 1e-4);
    }
}

#[test]
fn a_self_locking_gear_is_moved_from_one_side_only() {
    let loss = "kind = 'gear_loss'\nefficiency = 0.4\nback_efficiency = -0.2";
    let mut plant = gear(loss, [0.0, 0.0], "load");
    let rows = run(&mut plant, 3000, 1e-3, |t| vec![2.0 * t * t]);
    assert!(rows[2999][1].abs() < 1e-7 && (rows[2999][1] - rows[2000][1]).abs() < 1e-14, "{}", rows[2999][1]);
    near(10.0 * settled(gear(loss, [0.0, 10.0], "shaft"), 5.0), 0.4 * 5.0, 1e-4);
}

#[test]
fn an_efficiency_above_one_is_refused() {
    let text = MASS.to_string() + &element("gear", "mass", "kind = 'gear_loss'\nefficiency = 1.2\nback_efficiency = 0.5");
    let error: NetworkError = backdrive_sealed::network::Network::from_toml(&text, "gear.toml").unwrap_err();
    assert!(error.to_string().contains("expected at most 1, found 1.2"), "{error}");
}

#[test]
fn held_a_creeping_spring_relaxes_and_pulled_it_yields() {
    let (k, k1, tau, x0) = (2000.0, 1000.0, 0.3, 2e-3);
    let text = RAM.to_string()
        + &element("creep", "ram", &format!("kind = 'creep'\nstiffness = {k:?}\ncreep_stiffness = [{k1:?}]\ntime = [{tau:?}]"));
    let network = device(&text);
    let mut plant = SealedPlant::new(&network, &Truth::nothing(&network), 1e-3).unwrap();
    let rows = run(&mut plant, 1500, 1e-3, |_| vec![x0]);
    let relaxed = k * k1 / (k + k1);
    for i in [50, 400, 1499] {
        // The ram takes its place within the first ms.
        let t = (i as f64 + 0.5) * 1e-3;
        near(rows[i][0], x0 * (relaxed + (k - relaxed) * (-t * k / relaxed / tau).exp()), 1e-3);
    }
    let mass = device(
        &(MASS.replace("mass = 0.5", "mass = 1e-4")
            + &element("damper", "mass", "kind = 'damper'\ndamping = 0.5")
            + &element(
                "creep",
                "mass",
                &format!("kind = 'creep'\nstiffness = {k:?}\ncreep_stiffness = [{k1:?}, 700.0]\ntime = [{tau:?}, 2.0]"),
            )),
    );
    let mut plant = SealedPlant::new(&mass, &Truth::nothing(&mass), 1e-3).unwrap();
    let rows = run(&mut plant, 4000, 1e-3, |_| vec![3.0]);
    for i in [300, 1500, 3999] {
        let t = f64::from(i + 1) * 1e-3;
        let exact = 3.0 * (1.0 / k + (1.0 - (-t / tau).exp()) / k1 + (1.0 - (-t / 2.0_f64).exp()) / 700.0);
        near(rows[i as usize][0], exact, 2e-3);
    }
}
