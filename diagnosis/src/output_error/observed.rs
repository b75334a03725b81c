//! A device that drifts, simulated beside its recorded motion: an observer, a spring and a damper, pulls the measured body along, and what is compared is how far
//! the simulation is from the recording all the same.
//!
//! Left to itself such a simulation is as far off as all errors of force add up to, and a ripple over position loses its phase. With an observer the residual is the
//! error of prediction (Ljung 1999): of the force below the observer's bandwidth, of the motion above it. The bandwidth is chosen where noise of the force makes
//! as much of the motion as the sensor's own, so that errors are as large at every frequency. The body moves freely within it: steps of its encoder do not push on
//! stiff gears, as they would along a prescribed motion.

use crate::recordings::noise::white;
use crate::recordings::observer::{OBSERVER, law_of, name_of, rescaled, without_observer};
use crate::recordings::problem::{Inverse, Problem, Record};
use crate::tuning::tuning;
use backdrive_plant::elements::kind_named;
use backdrive_plant::model::{Body, Element, Hold, Input, InputKind, Model, OutputKind};
use backdrive_plant::set::Initial;
use backdrive_plant::stepper::segments;
use backdrive_signal::derivative;
use backdrive_signal::low_pass::LowPass;
use std::f64::consts::TAU;
use std::sync::Arc;

/// Noise of a force, at least, in its root mean square: a current loop or a torque constant is no better over a whole recording.
const LEAST_NOISE: f64 = 1e-3;

/// Damping ratio of the observer.
const DAMPING: f64 = 0.7;

/// Bandwidth of the observer in the sample rate, least and most.
const BANDWIDTH: [f64; 2] = [0.025, 0.05];

/// Time that bodies which nobody measured are given to swing in, s; at most a tenth of a recording.
const SETTLED: f64 = 0.5;

/// The problem with an observer; `None` unless forces alone drive the device, and a position of it is recorded in every file and nothing else is.
pub(crate) fn observed(problem: &Problem) -> Option<Problem> {
    let model = &problem.model;
    let (output, body) = measured_position(problem)?;
    let records = || problem.fit.iter().chain(&problem.held_out);
    let is_alone = |record: &Record| super::evaluator::measured(record).eq([output]) && record.conditions.is_empty();
    let applies = model.arm.is_none()
        && problem.unknown.is_empty()
        && model.inputs.iter().all(|i| i.kind == InputKind::Force)
        && !model.inputs.is_empty()
        && records().all(is_alone);
    if !applies {
        return None;
    }
    let gains = gains(problem, output)?;
    let model = with_observer(model, body, gains)?;
    let of = |records: &[Record]| records.iter().map(|record| with_motion(&model, output, record)).collect::<Option<Vec<Record>>>();
    let (fit, held_out) = (of(&problem.fit)?, of(&problem.held_out)?);
    let inverse =
        Inverse { recorded: Arc::new(problem.clone()), motion: OBSERVER.to_string(), force: problem.model.inputs.first()?.name.clone() };
    Some(Problem {
        model,
        fit,
        held_out,
        initial: Initial::Rest,
        lag: vec![0; problem.lag.len()],
        inverse: Some(inverse),
        ..problem.clone()
    })
}

/// The recorded problem, without its observer.
pub(crate) fn recorded(problem: &Problem) -> &Problem {
    problem.inverse.as_ref().filter(|inverse| inverse.motion == OBSERVER).map_or(problem, |inverse| inverse.recorded.as_ref())
}

/// The observed problem with bodies and elements of another model of the same device; `None` where it has no observer.
pub(crate) fn with_model(observed: &Problem, model: &Model) -> Option<Problem> {
    let spring = observed.model.elements.iter().rfind(|e| e.name == name_of("spring"))?;
    let damper = observed.model.elements.iter().rfind(|e| e.name == name_of("damper"))?;
    let recorded = &observed.inverse.as_ref()?.recorded.model;
    let own = without_observer(model);
    let own = Model { inputs: recorded.inputs.clone(), outputs: recorded.outputs.clone(), axes: Vec::new(), ..own };
    let first = |element: &Element| element.law.values().first().and_then(|v| v.first()).copied();
    let model = with_observer(&own, spring.between[0]?, [first(spring)?, first(damper)?])?;
    let model = rescaled(model, &observed.model);
    Some(Problem { model, stated: Vec::new(), ..observed.clone() })
}

/// The output that is a position, and the body whose it is.
fn measured_position(problem: &Problem) -> Option<(usize, usize)> {
    problem.model.outputs.iter().enumerate().find_map(|(index, output)| match output.kind {
        OutputKind::Position(body) if output.gain != 0.0 && problem.lag.get(index).is_some_and(|lag| *lag > 0) => Some((index, body)),
        _ => None,
    })
}

/// The model with an observer of this stiffness and damping.
fn with_observer(model: &Model, body: usize, gains: [f64; 2]) -> Option<Model> {
    let mut own = model.clone();
    let observer = own.bodies.len();
    own.bodies.push(Body { name: OBSERVER.to_string(), inertia: 0.0 });
    for (kind, gain) in ["spring", "damper"].into_iter().zip(gains) {
        let law = law_of(kind_named(kind)?, gain)?;
        own.elements.push(Element { name: name_of(kind), between: [Some(body), Some(observer)], law });
    }
    own.inputs.push(Input::ideal(OBSERVER, InputKind::Motion, observer, Hold::Cubic));
    Some(own)
}

/// Stiffness and damping of the observer.
fn gains(problem: &Problem, output: usize) -> Option<[f64; 2]> {
    let order = tuning().equation_error.order;
    let (mut of_force, mut products, mut squares, mut rate) = (f64::INFINITY, 0.0, 0.0, f64::INFINITY);
    for record in &problem.fit {
        let own = 1.0 / record.period;
        let low_pass = LowPass::butterworth(order, 0.05 * own, own);
        let motion = low_pass.both_ways(&motion(&problem.model, output, record)?);
        let force = record.total_force(&problem.model)?;
        let acceleration = derivative(&derivative(&motion, record.period), record.period);
        products += acceleration.iter().zip(low_pass.both_ways(&force)).map(|(a, f)| a * f).sum::<f64>();
        squares += acceleration.iter().map(|a| a * a).sum::<f64>();
        let spread = (force.iter().map(|f| f * f).sum::<f64>() / force.len().max(1) as f64).sqrt();
        // The smoothest recording shows the noise best.
        of_force = of_force.min(white(&force)?.max(LEAST_NOISE * spread));
        rate = rate.min(own);
    }
    let inertia = (products / squares).abs();
    // Both noises are white, and as wide: where the body's inertia makes as much motion of the one as the other is.
    let of_motion = problem.noise_sd.get(output)? / problem.model.outputs.get(output)?.gain.abs();
    let crossing = (of_force / (of_motion * inertia)).sqrt() / TAU;
    let pulse = TAU * crossing.clamp(BANDWIDTH[0] * rate, BANDWIDTH[1] * rate);
    // Of the nominal model's inertia: see `rescaled`.
    let own: f64 = problem.model.bodies.iter().map(|b| b.inertia).sum();
    let gains = [own * pulse * pulse, 2.0 * DAMPING * own * pulse];
    gains.iter().all(|g| g.is_finite() && *g > 0.0).then_some(gains)
}

/// The measured position of the body, m or rad.
fn motion(model: &Model, output: usize, record: &Record) -> Option<Vec<f64>> {
    let sensor = model.outputs.get(output)?;
    Some(record.outputs.get(output)?.as_ref()?.iter().map(|y| (y - sensor.offset) / sensor.gain).collect())
}

/// A record with its motion as the observer's, and bodies that begin with it.
fn with_motion(model: &Model, output: usize, record: &Record) -> Option<Record> {
    let (rate, tuning) = (1.0 / record.period, &tuning().equation_error);
    let low_pass = LowPass::butterworth(tuning.order, tuning.highest_corner * rate, rate);
    let motion = low_pass.both_ways(&motion(model, output, record)?);
    let mut own = Record { logged: None, ..record.clone() };
    own.segments.push(segments(Hold::Cubic, &motion, record.period));
    own.inputs.push(motion);
    own.begins = own.along_the_motion(0, model, 0);
    own.skip = ((SETTLED * rate) as usize).min(own.len / 10);
    Some(own)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::output_error::evaluator::Evaluator;
    use crate::output_error::structure::Structure;
    use backdrive_plant::recording::Recording;

    const STEP: f64 = 0.0015;

    fn motor(cogging: f64) -> String {
        format!(
            "name = 'motor'\nmotion = 'rotation'\n[bodies]\nrotor = 0.0003\n\
             [[elements]]\nname = 'bearing'\nkind = 'damper'\nbetween = ['rotor', 'ground']\ndamping = 0.001\n\
             [[elements]]\nname = 'magnets'\nkind = 'cogging'\nbetween = ['rotor', 'ground']\namplitude = {cogging}\nperiod = 0.5\nphase = 0.3\n\
             [[inputs]]\nname = 'torque'\nkind = 'force'\non = 'rotor'\nhold = 'linear'\n\
             [[outputs]]\nname = 'angle'\nkind = 'position'\nof = 'rotor'\nresolution = {STEP}\n"
        )
    }

    /// A motor that turns on and on, with the torque that this takes against a ripple of 5 mN m; its encoder rounds.
    fn problem(text: &str) -> Problem {
        let model = Model::from_toml(text, "motor.toml").unwrap();
        let t: Vec<f64> = (0..4000).map(|k| f64::from(k) / 500.0).collect();
        let waves = [(2.0, 0.6), (0.6, 2.3), (0.1, 5.1)];
        let order = |t: f64, order: i32| {
            let wave = |(amplitude, hz): &(f64, f64)| {
                let pulse = TAU * hz;
                amplitude * pulse.powi(order) * (pulse * t + f64::from(order) * std::f64::consts::FRAC_PI_2).sin()
            };
            let turning = [4.0 * t, 4.0, 0.0][order as usize];
            turning + waves.iter().map(wave).sum::<f64>()
        };
        let torque = |t: &f64| {
            let [q, v, a] = [0, 1, 2].map(|n| order(*t, n));
            0.0003 * a + 0.001 * v + 0.005 * (TAU * q / 0.5 + 0.3).sin()
        };
        let angle = t.iter().map(|t| (order(*t, 0) / STEP).round() * STEP).collect();
        let signals = vec![("angle".to_string(), angle), ("torque".to_string(), t.iter().map(torque).collect())];
        let record = Record::new(&Recording::new("r.csv", t.clone(), signals).unwrap(), &model, Vec::new()).unwrap();
        Problem::new(text.to_string(), "motor.toml".into(), model, vec![record], Vec::new(), Initial::Free).unwrap()
    }

    /// Root mean square of what a model leaves beside its recording, in the noise of its encoder.
    fn left(observed: &Problem) -> f64 {
        let structure = Structure::new(observed, &observed.fit, Vec::new());
        let given: Vec<f64> = observed.stated.iter().map(|s| s.given).collect();
        let residuals = Evaluator::new(observed).residuals(&structure, &structure.values(observed, &given, &[], &[])).unwrap();
        (residuals.iter().map(|r| r * r).sum::<f64>() / residuals.len() as f64).sqrt()
    }

    #[test]
    fn a_true_model_leaves_the_rounding_of_the_encoder_and_one_without_a_ripple_leaves_it() {
        let [right, wrong] = [0.005, 1e-9].map(|cogging| left(&observed(&problem(&motor(cogging))).unwrap()));
        assert!((0.6..1.3).contains(&right), "{right}");
        assert!(wrong > 2.0, "{wrong}");
    }

    #[test]
    fn a_device_without_inertia_and_without_force_does_not_follow_its_recording() {
        let observed = observed(&problem(&motor(0.005))).unwrap();
        let mut light = observed.model.clone();
        light.set_values_at("bodies.rotor", &[3e-7]).unwrap();
        light.set_values_at("elements.bearing.damping", &[1e-6]).unwrap();
        light.set_values_at("elements.magnets.amplitude", &[5e-6]).unwrap();
        // All of it a thousandth, and so is its observer: what a thousandth of the torque drives moves alike, and what none drives does not.
        let silent = |gain: f64| {
            let mut model = light.clone();
            model.inputs[0].gain = gain;
            left(&Problem { model: rescaled(model, &observed.model), stated: Vec::new(), ..observed.clone() })
        };
        assert!(silent(1e-3) < 1.3 && silent(0.0) > 10.0, "{} {}", silent(1e-3), silent(0.0));
    }

    #[test]
    fn without_its_observer_a_model_is_what_it_was() {
        let problem = problem(&motor(0.005));
        let observed = observed(&problem).unwrap();
        assert_eq!(without_observer(&observed.model), problem.model);
        assert_eq!(with_model(&observed, &problem.model).unwrap().model, observed.model);
        assert_eq!(recorded(&observed).model, problem.model);
        // A lever on a spring does not drift.
        let held = motor(0.005).replace("kind = 'damper'", "kind = 'spring'").replace("damping = 0.001", "stiffness = 1.0");
        assert!(super::observed(&self::problem(&held)).is_none());
    }
}
