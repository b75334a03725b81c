//! A device that forces drive, read the other way round: the motion that was measured as input, the force that drove it as what is compared.
//!
//! What a simulation leaves out drives its motion ever farther from the device's, so that one effect hides all others. Forces along the measured motion do not
//! drift: each law adds to them where it acts.

use super::band::has_memory;
use crate::recordings::problem::{Inverse, Problem, Record, spread};
use backdrive_plant::model::{Hold, Input, InputKind, Model, Output, OutputKind};
use backdrive_plant::set::Initial;
use backdrive_plant::stepper::segments;
use std::sync::Arc;

/// The problem turned round; `None` unless it is one body without memory, driven by recorded forces alone, with its position recorded in every file.
pub(crate) fn inverse(problem: &Problem) -> Option<Problem> {
    let model = &problem.model;
    let is_known = |record: &Record| {
        let measured = |output: &usize| record.outputs.get(*output).is_some_and(Option::is_some);
        record.conditions.is_empty() && position(model).as_ref().is_some_and(measured)
    };
    let is_plain = |i: &Input| {
        i.kind == InputKind::Force && i.delay == 0.0 && i.saturation.is_infinite() && i.bandwidth.is_infinite() && i.back_emf == 0.0
    };
    // A force that stands at 0 is no measurement of what the body's motion asks for: any small body fits it.
    let is_driven = |record: &Record| record.inputs.first().is_some_and(|force| force.iter().any(|f| *f != force[0]));
    let applies = model.bodies.len() == 1
        && model.arm.is_none()
        && problem.unknown.is_empty()
        && model.inputs.iter().all(is_plain)
        && !model.elements.iter().any(|e| has_memory(e.law.kind().name))
        && problem.fit.iter().chain(&problem.held_out).all(is_known)
        && problem.fit.iter().any(is_driven);
    if !applies {
        return None;
    }
    let (output, force) = (position(model)?, model.inputs.first()?);
    let motion = model.outputs.get(output)?;
    let turned = turned_model(model, &motion.name, &force.name);
    let of = |records: &[Record]| records.iter().map(|record| turned_record(model, output, record)).collect::<Option<Vec<Record>>>();
    let (fit, held_out) = (of(&problem.fit)?, of(&problem.held_out)?);
    let inverse = Inverse { recorded: Arc::new(problem.clone()), motion: motion.name.clone(), force: force.name.clone() };
    let problem = Problem::new(problem.text.clone(), problem.model_path.clone(), turned, fit, held_out, Initial::Rest).ok()?;
    Some(Problem { inverse: Some(inverse), ..problem })
}

/// The model moved along the motion, with the force that this takes as its only output.
fn turned_model(model: &Model, motion: &str, force: &str) -> Model {
    Model {
        inputs: vec![Input::ideal(motion, InputKind::Motion, 0, Hold::Cubic)],
        outputs: vec![Output {
            name: force.to_string(),
            kind: OutputKind::Reaction(0),
            gain: 1.0,
            delay: 0.0,
            offset: 0.0,
            resolution: 0.0,
            noise: 0.0,
        }],
        axes: Vec::new(),
        ..model.clone()
    }
}

/// The turned problem with bodies and elements of another model of the same device, such as one that a simulation was fitted with.
pub(crate) fn with_model(turned: &Problem, model: &Model) -> Option<Problem> {
    let inverse = turned.inverse.as_ref()?;
    Some(Problem { model: turned_model(model, &inverse.motion, &inverse.force), stated: Vec::new(), ..turned.clone() })
}

/// The output that is the body's position, delayed by nothing.
fn position(model: &Model) -> Option<usize> {
    model.outputs.iter().position(|o| matches!(o.kind, OutputKind::Position(0)) && o.delay == 0.0 && o.gain != 0.0)
}

fn turned_record(model: &Model, output: usize, record: &Record) -> Option<Record> {
    let sensor = model.outputs.get(output)?;
    let motion: Vec<f64> = record.outputs.get(output)?.as_ref()?.iter().map(|y| (y - sensor.offset) / sensor.gain).collect();
    let force = record.total_force(model)?;
    let (inputs, outputs) = (vec![motion], vec![Some(force)]);
    let segments = inputs.iter().map(|samples| segments(Hold::Cubic, samples, record.period)).collect();
    let spread = outputs.iter().flatten().map(|samples| spread(samples)).collect();
    Some(Record {
        inputs,
        outputs,
        segments,
        spread,
        begins: Vec::new(),
        skip: 0,
        before: 0,
        logged: None,
        outliers: Vec::new(),
        ..record.clone()
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::belief::choice::chosen;
    use crate::equation_error::search_on_forces;
    use crate::options::Options;
    use backdrive_plant::recording::Recording;
    use backdrive_plant::write::{Edit, Value};

    const DRIVEN: &str = "name = 'lever'\nmotion = 'rotation'\n[bodies]\nlever = 0.02\n\
        [[elements]]\nname = 'viscous'\nkind = 'damper'\nbetween = ['lever', 'ground']\ndamping = 0.05\n\
        [[inputs]]\nname = 'torque'\nkind = 'force'\non = 'lever'\nhold = 'linear'\ngain = 0.5\n\
        [[outputs]]\nname = 'angle'\nkind = 'position'\nof = 'lever'\n";

    /// A lever with friction of 0.1 N m and gravity of 0.3 N m, moved by a controller; the torque is logged in units of 0.5 N m.
    fn record(model: &Model, name: &str, phase: f64) -> Record {
        let t: Vec<f64> = (0..6000).map(|k| f64::from(k) / 500.0).collect();
        let waves = [(0.9, 0.31, phase), (0.3, 0.83, 1.0 + phase), (0.05, 2.1, 2.0)];
        let derivative = |t: f64, order: i32| {
            let one = |(amplitude, hz, phase): &(f64, f64, f64)| {
                let w = std::f64::consts::TAU * hz;
                amplitude * w.powi(order) * (w * t + phase + f64::from(order) * std::f64::consts::FRAC_PI_2).sin()
            };
            waves.iter().map(one).sum::<f64>()
        };
        let torque = |t: &f64| {
            let [q, v, a] = [0, 1, 2].map(|order| derivative(*t, order));
            (0.02 * a + 0.05 * v + 0.1 * v.signum() + 0.3 * q.sin() + 0.004 * (40.0 * t).sin()) / 0.5
        };
        let signals = vec![
            ("angle".to_string(), t.iter().map(|t| derivative(*t, 0)).collect()),
            ("torque".to_string(), t.iter().map(torque).collect()),
        ];
        Record::new(&Recording::new(name, t.clone(), signals).unwrap(), model, Vec::new()).unwrap()
    }

    #[test]
    fn what_a_torque_drives_is_named_on_forces_and_written_into_its_own_file() {
        let model = Model::from_toml(DRIVEN, "lever.toml").unwrap();
        let records = [0.0, 0.7].map(|phase| record(&model, "r.csv", phase)).to_vec();
        let held_out = vec![record(&model, "h.csv", 2.0)];
        let problem = Problem::new(DRIVEN.to_string(), "lever.toml".into(), model.clone(), records, held_out, Initial::Free).unwrap();
        let turned = inverse(&problem).unwrap();
        let options = Options::default();
        let (_, search) = search_on_forces(&turned, &options, options.limit(None), &|_| ()).unwrap();
        let best = chosen(&search);
        let mut names: Vec<&str> = best.structure.added.iter().map(|h| h.physics.name).collect();
        names.sort_unstable();
        assert_eq!(names, ["coulomb", "gravity"]);
        for (hypothesis, values) in best.structure.added.iter().zip(best.structure.added_of(&best.fit.values)) {
            let size = if hypothesis.physics.name == "coulomb" { 0.1 } else { 0.3 };
            assert!((values[0].abs() / size - 1.0).abs() < 0.05, "{} {values:?}", hypothesis.id);
        }
    }

    #[test]
    fn a_motion_ahead_of_its_recording_is_a_force_that_acts_late() {
        let model = Model::from_toml(DRIVEN, "lever.toml").unwrap();
        let records = vec![record(&model, "r.csv", 0.0)];
        let problem = Problem::new(DRIVEN.to_string(), "lever.toml".into(), model, records, Vec::new(), Initial::Free).unwrap();
        let turned = inverse(&problem).unwrap().inverse.unwrap();
        let set = |late: f64| vec![Edit::Set { path: "inputs.angle.delay".to_string(), value: Value::Number(late), comment: None }];
        let expected = Edit::Set { path: "inputs.torque.delay".to_string(), value: Value::Number(0.004), comment: None };
        assert_eq!(turned.in_file(set(-0.004)), [expected]);
        assert!(turned.in_file(set(0.004)).is_empty());
    }
}
