//! No law that takes energy gives any, and a spring returns no more than it took.

mod common;

use backdrive_sealed::laws::*;
use backdrive_sealed::plant::SealedPlant;
use common::*;

/// Laws of every kind that should not give energy to a body that moves them.
fn laws() -> Vec<Law> {
    let (k, c, vs) = (4000.0, 2.0, 5e-3);
    vec![
        Law::Spring(Spring { stiffness: k, rest: 0.0 }),
        Law::CubicSpring(CubicSpring { stiffness: k, cubic: 1e8 }),
        Law::Damper(Damper { damping: 3.0 }),
        Law::AsymmetricDamper(AsymmetricDamper { positive: 3.0, negative: 1.0 }),
        Law::QuadraticDrag(QuadraticDrag { coefficient: 20.0 }),
        Law::Coulomb(Coulomb { force: c }),
        Law::AsymmetricCoulomb(AsymmetricCoulomb { positive: c, negative: 0.5 * c }),
        Law::Stribeck(Stribeck { coulomb: c, at_rest: 1.5 * c, velocity: vs }),
        Law::FrictionDeficit(FrictionDeficit { coulomb: c, rest: 0.5 * c, velocity: vs }),
        Law::Dahl(Dahl { stiffness: k, coulomb: c }),
        Law::MaxwellSlip(MaxwellSlip { stiffness: vec![1000.0, 3000.0], force: vec![1.5, 0.5] }),
        Law::HystereticSpring(HystereticSpring {
            stiffness_positive: k,
            stiffness_negative: k,
            offset_positive: c,
            offset_negative: -c,
            bandwidth: 3000.0,
        }),
        Law::Backlash(Backlash { gap: 1e-3, stiffness: k, damping: 5.0 }),
        Law::RoundedGap(RoundedGap { gap: 1e-3, rounding: 1e-4, stiffness: k, damping: 5.0 }),
        Law::BristleField(BristleField {
            stiffness: k,
            force: c,
            stiffness_spread: 0.5,
            force_spread: 0.6,
            count: 50,
            static_ratio: 1.6,
            velocity: vs,
        }),
        Law::WarmFriction(WarmFriction { force: c, half_warming: 20.0, heat_capacity: 0.01, cooling_time: 1.0 }),
    ]
}

#[test]
fn nobody_gains_energy_by_moving_a_law_about() {
    let network = device(RAM);
    let period = 1e-4;
    // Large and small reversals at speeds from a hundredth to ten times the laws' own, from rest and back to 0.
    let motion = |t: f64| (1.0 - (3.1 * t).cos()) * (1.2e-3 * (17.3 * t).sin() + 4e-4 * (61.7 * t).sin());
    for law in laws() {
        let mut plant = SealedPlant::new(&network, &hiding(&network, vec![grounded("ram", law.clone())]), period).unwrap();
        let (mut x, mut f, mut given, mut least, mut most) = (0.0, 0.0, 0.0, 0.0_f64, 0.0_f64);
        for k in 0..40_000 {
            let next = motion((k + 1) as f64 * period);
            plant.step(&[next]).unwrap();
            let force = plant.exact_outputs()[0];
            given += 0.5 * (f + force) * (next - x);
            (x, f) = (next, force);
            (least, most) = (least.min(given), most.max(given));
        }
        assert!(least >= -2e-3 * most && most > 0.0, "{}: {least} of {most} J", law.kind());
        let gives_back = matches!(law, Law::Spring(_) | Law::CubicSpring(_) | Law::Backlash(_) | Law::RoundedGap(_));
        assert!(gives_back || given > 0.5 * most, "{} took only {given} of {most} J", law.kind());
    }
}

#[test]
fn a_device_with_friction_under_load_comes_to_rest() {
    let text = MASS.to_string() + &element("spring", "mass", "kind = \"spring\"\nstiffness = 800.0");
    let network = device(&text);
    let law = LoadFriction { force: 0.05, coefficient: 0.1, joint: Some("spring".into()) };
    let mut plant = SealedPlant::new(&network, &hiding(&network, vec![grounded("mass", Law::LoadFriction(law))]), 1e-4).unwrap();
    run(&mut plant, 200, 1e-4, |_| vec![20.0]);
    let energy = |row: &[f64]| 0.5 * 0.5 * row[1] * row[1] + 0.5 * 800.0 * row[0] * row[0];
    let rows = run(&mut plant, 60_000, 1e-4, |_| vec![0.0]);
    for pair in rows.windows(2) {
        // The leapfrog's own ripple of energy is (w h)^2/8 of it.
        assert!(energy(&pair[1]) <= energy(&pair[0]) * (1.0 + 1e-6), "{pair:?}");
    }
    // What the spring loses over half a swing is what friction takes: k (x0^2 - x1^2)/2 = c0 (x0 + x1) + mu k (x0^2 + x1^2)/2.
    let turns: Vec<f64> = rows.windows(2).filter(|pair| pair[0][1] * pair[1][1] < 0.0).map(|pair| pair[1][0].abs()).collect();
    let (mu, b) = (0.1, 2.0 * 0.05 / 800.0);
    let next = |x0: f64| {
        let c = (1.0 - mu) * x0 * x0 - b * x0;
        (-b + (b * b + 4.0 * (1.0 + mu) * c).sqrt()) / (2.0 * (1.0 + mu))
    };
    for pair in turns.windows(2).take(6) {
        near(pair[1], next(pair[0]), 1e-3);
    }
    assert!(turns.len() > 6 && rows.last().unwrap()[1].abs() < 1e-12);
}
