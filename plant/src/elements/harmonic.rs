//! What an element looks like to one sine: the stiffness and damping of its first harmonic.

use super::law::{FrictionLaw, Linear, PathLaw, Rubbing, Side};
use super::sine::{DryFriction, Sine};
use std::f64::consts::{PI, TAU};

/// Steps in a cycle. Errors of a law with corners fall with its square: about 1e-5 here.
const STEPS: usize = 512;
/// Most cycles before the one that is measured, for hysteresis to close its loop.
const SETTLE: usize = 100;

/// Dry friction: nothing where it is ignored, else the damping that takes as much energy per cycle, `4 c/(pi A w)` for Coulomb friction. It is
/// evaluated without load and with the memory of rest.
pub fn of_friction(law: &impl FrictionLaw, at: &Sine) -> Linear {
    if at.friction == DryFriction::Ignored {
        return Linear::default();
    }
    let speed = at.amplitude * TAU * at.frequency_hz;
    let memory = vec![0.0; law.memory_len()];
    let sum: f64 = (0..STEPS)
        .map(|i| {
            let cos = (TAU * (i as f64 + 0.5) / STEPS as f64).cos();
            law.level(&Rubbing { side: Side::of(cos), speed: Some(speed * cos), load: 0.0, memory: &memory }) * cos.abs()
        })
        .sum();
    Linear { damping: 2.0 * sum / STEPS as f64 / speed, ..Linear::default() }
}

/// Any other law, by its first harmonic: with `x = x0 + A sin(wt)` and `f` the element's force, the stiffness is `(1/pi A) ∮ f sin` and the
/// damping `(1/pi A w) ∮ f cos`, the describing function of Krylov & Bogoliubov.
pub fn of_path(law: &impl PathLaw, at: &Sine) -> Linear {
    let x0 = at.about;
    let (amplitude, omega) = (at.amplitude, TAU * at.frequency_hz);
    let dt = TAU / omega / STEPS as f64;
    let mut memory = vec![0.0; law.memory_len()];
    // To the operating point in a straight line and slowly, then sines about it.
    let mut x = 0.0;
    if x0 != 0.0 {
        for i in 1..=STEPS {
            let next = x0 * i as f64 / STEPS as f64;
            law.advance(&mut memory, x, next, dt);
            x = next;
        }
    }
    let mut cycle = |measured: Option<f64>| {
        let (mut in_phase, mut in_quadrature, mut travelled, mut last) = (0.0, 0.0, 0.0, 0.0);
        for i in 1..=STEPS {
            let (sin, cos) = (TAU * i as f64 / STEPS as f64).sin_cos();
            let next = x0 + amplitude * sin;
            law.advance(&mut memory, x, next, dt);
            travelled += (next - x).abs();
            x = next;
            last = law.force(&memory, x, amplitude * omega * cos);
            let force = last - measured.unwrap_or(0.0) * travelled;
            in_phase += force * sin;
            in_quadrature += force * cos;
        }
        (in_phase, in_quadrature, last, travelled)
    };
    let mut before = cycle(None).2;
    for _ in 0..SETTLE {
        let after = cycle(None).2;
        let closed = (after - before).abs() <= 1e-12 * after.abs();
        before = after;
        if closed {
            break;
        }
    }
    // A loop that has not closed yet gains as much force per distance on each cycle: that creep is no response to the sine. Asymmetric hysteresis
    // under a small sine creeps for thousands of cycles.
    let (_, _, after, travelled) = cycle(None);
    let (in_phase, in_quadrature, ..) = cycle(Some((after - before) / travelled));
    let scale = TAU / STEPS as f64 / (PI * amplitude);
    Linear { stiffness: in_phase * scale, damping: in_quadrature * scale / omega, inertance: 0.0, force: 0.0 }
}
