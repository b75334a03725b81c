//! Motions whose recording comes late: whole recordings know what is to come, a step at a time does not.

use super::segment::Segment;
use super::spline::segments;
use crate::model::{InputKind, Model};

/// A model without the negative delays of its motion inputs, and the samples of all inputs with those motions taken as much earlier from their
/// recordings; `None` where it has no such delay. Beyond its last sample a motion goes on at its last acceleration.
pub fn ahead(model: &Model, inputs: &[impl AsRef<[f64]>], period_s: f64) -> Option<(Model, Vec<Vec<f64>>)> {
    let is_late = |kind: InputKind, delay: f64| kind == InputKind::Motion && delay < 0.0 && delay.is_finite();
    if !(period_s > 0.0 && model.inputs.iter().any(|i| is_late(i.kind, i.delay))) {
        return None;
    }
    let mut caught_up = model.clone();
    let mut columns: Vec<Vec<f64>> = inputs.iter().map(|column| column.as_ref().to_vec()).collect();
    for (input, column) in caught_up.inputs.iter_mut().zip(&mut columns) {
        if is_late(input.kind, input.delay) {
            *column = earlier(&segments(input.hold, column, period_s), column, -input.delay / period_s, period_s);
            input.delay = 0.0;
        }
    }
    Some((caught_up, columns))
}

/// The value of a motion this number of periods after each sample.
fn earlier(pieces: &[Segment], samples: &[f64], lead: f64, period: f64) -> Vec<f64> {
    let (Some(last), Some(end)) = (samples.last(), pieces.last()) else { return samples.to_vec() };
    let whole = (lead.floor() as usize).min(samples.len());
    let rest = (lead - lead.floor()) * period;
    (0..samples.len())
        .map(|i| match pieces.get(i + whole) {
            Some(piece) => piece.value(rest),
            None => {
                let beyond = (i as f64 + lead - pieces.len() as f64) * period;
                last + beyond * (end.slope(period) + 0.5 * beyond * end.curvature(period))
            }
        })
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::stepper::{Options, Plant, simulate};

    const CART: &str = "name = 'cart'
[bodies]
cart = 2.0
[[elements]]
name = 'friction'
kind = 'damper'
between = ['cart', 'ground']
damping = 3.0
[[inputs]]
name = 'position'
kind = 'motion'
on = 'cart'
[[outputs]]
name = 'force'
kind = 'reaction'
of = 'cart'
";

    #[test]
    fn a_motion_recorded_late_is_taken_earlier() {
        let (period, late, w) = (1e-3, 2.3e-3, 20.0f64);
        let mut model = Model::from_toml(CART, "cart").unwrap();
        model.inputs[0].delay = -late;
        let samples: Vec<f64> = (0..2000).map(|i| (w * (i as f64 * period - late)).sin()).collect();
        let force = &simulate(&model, &[&samples], period, &Options::default()).unwrap()[0];
        for i in 50..1900 {
            let phase = w * i as f64 * period;
            let exact = -2.0 * w * w * phase.sin() + 3.0 * w * phase.cos();
            assert!((force[i] - exact).abs() < 1.0, "{i}: {} {exact}", force[i]);
        }
        // Its end goes on as it went.
        assert!(force.iter().all(|f| f.abs() < 1e3));
    }

    #[test]
    fn a_step_at_a_time_does_not_know_what_is_to_come() {
        let mut model = Model::from_toml(CART, "cart").unwrap();
        model.set_values_at("inputs.position.delay", &[-0.001]).unwrap();
        let error = Plant::new(&model, 1e-3, &Options::default()).err().map(|e| e.to_string()).unwrap_or_default();
        assert!(error.contains("delay must be at least 0 where the motion to come is not known"), "{error}");
        assert!(Model::from_toml(&CART.replace("on = 'cart'", "on = 'cart'\ndelay = -0.002"), "cart").is_ok());
    }
}
