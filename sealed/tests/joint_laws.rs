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
