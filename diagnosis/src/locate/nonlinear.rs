//! Forces of the nonlinear elements of the nominal model along a given motion.

use super::equations::Linearisation;
use super::trajectory::Trajectory;
use crate::tuning::tuning;
use backdrive_plant::elements::{Law, Role, Rubbing, Side};
use backdrive_signal::statistics::rms;

/// What the deviation from the simulated motion adds to the forces of the nonlinear elements, beyond their linear part: one column for each element of
/// [`Linearisation::nonlinear`].
pub(super) fn forces_beyond_linear(
    linearisation: &Linearisation,
    trajectory: &Trajectory,
    position: &[Vec<f64>],
    velocity: &[Vec<f64>],
) -> Vec<Vec<f64>> {
    let one = |index: &usize| {
        let element = &linearisation.model.elements[*index];
        let linear = linearisation.linear.elements[*index];
        let (x, v) = trajectory.across(element.between);
        let of = |columns: &[Vec<f64>], k: usize| {
            let at = |end: Option<usize>| end.and_then(|b| columns.get(b)).and_then(|c| c.get(k)).copied().unwrap_or(0.0);
            at(element.between[0]) - at(element.between[1])
        };
        let (dx, dv): (Vec<f64>, Vec<f64>) = (0..trajectory.len).map(|k| (of(position, k), of(velocity, k))).unzip();
        let moved: Vec<f64> = x.iter().zip(&dx).map(|(a, b)| a + b).collect();
        let faster: Vec<f64> = v.iter().zip(&dv).map(|(a, b)| a + b).collect();
        let slip = tuning().locate.slip * rms(&x);
        let (before, after) =
            (along(&element.law, &x, &v, trajectory.period, slip), along(&element.law, &moved, &faster, trajectory.period, slip));
        (0..trajectory.len).map(|k| after[k] - before[k] - linear.stiffness * dx[k] - linear.damping * dv[k]).collect()
    };
    linearisation.nonlinear.iter().map(one).collect()
}

/// Root mean square of the force of each nonlinear element beyond its linear part along the simulated motion, N.
pub(super) fn rms_beyond_linear(linearisation: &Linearisation, trajectory: &Trajectory) -> Vec<f64> {
    let one = |index: &usize| {
        let element = &linearisation.model.elements[*index];
        let linear = linearisation.linear.elements[*index];
        let (x, v) = trajectory.across(element.between);
        let force = along(&element.law, &x, &v, trajectory.period, tuning().locate.slip * rms(&x));
        let rest: Vec<f64> = (0..x.len()).map(|k| force[k] - linear.stiffness * x[k] - linear.damping * v[k]).collect();
        rms(&rest).max(f64::MIN_POSITIVE.sqrt())
    };
    linearisation.nonlinear.iter().map(one).collect()
}

/// Force of a law along a motion, N; of displacement, m, and velocity, m/s, at samples `period` s apart.
pub(crate) fn force_along(law: &Law, x: &[f64], v: &[f64], period: f64) -> Vec<f64> {
    along(law, x, v, period, tuning().locate.slip * rms(x))
}

/// Force of a law along a motion. Dry friction builds up over the distance `slip`, so that noise about rest does not make it chatter.
fn along(law: &Law, x: &[f64], v: &[f64], period: f64, slip: f64) -> Vec<f64> {
    let mut memory = vec![0.0; law.memory_len()];
    let (mut last, mut force) = (x.first().copied().unwrap_or(0.0), 0.0_f64);
    let is_friction = law.role() == Role::Friction;
    let step = |(x, v): (&f64, &f64)| {
        if is_friction {
            let level = |side| law.level(&Rubbing { side, speed: Some(*v), load: 0.0, memory: &memory });
            let (up, down) = (level(Side::Forwards), level(Side::Backwards));
            let slope = if slip > 0.0 { up.max(down) / slip } else { f64::INFINITY };
            let change = x - last;
            force = if change == 0.0 { force } else { (force + slope * change).min(up).max(-down) };
        } else {
            law.advance(&mut memory, last, *x, period);
            force = law.force(&memory, *x, *v);
        }
        last = *x;
        force
    };
    x.iter().zip(v).map(step).collect()
}
