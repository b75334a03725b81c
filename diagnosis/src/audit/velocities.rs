//! Velocities beside the derivatives of the positions of the same bodies: where they contradict each other, one of the two columns is wrong.

use super::remark::{Remark, Weight, file_name};
use crate::recordings::kinematics::{Band, Kinematics};
use crate::recordings::problem::{Problem, Record};
use backdrive_plant::model::OutputKind;
use backdrive_plant::write::round_significant;

/// Least motion of a position that can be differentiated, in standard deviations of its sensor noise.
const MOVES: f64 = 30.0;

/// A velocity that contradicts its position.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Contradiction {
    /// The velocity, by its place among the outputs.
    pub output: usize,
    /// What was seen and what to do, as a clause.
    pub text: String,
    /// Whether neither a factor nor a lag alone corrects it, so that it is unknown which of the two columns is right.
    pub is_both: bool,
    /// The file where it was seen first.
    pub file: String,
}

/// Every velocity that contradicts the position of its body in all recordings that tell.
pub(super) fn contradictions(problem: &Problem) -> Vec<Contradiction> {
    let outputs = &problem.model.outputs;
    let position_of = |body: usize| outputs.iter().position(|o| matches!(o.kind, OutputKind::Position(own) if own == body));
    let of = |(velocity, output): (usize, &backdrive_plant::model::Output)| {
        let OutputKind::Velocity(body) = output.kind else { return None };
        let position = position_of(body).filter(|position| outputs[*position].gain != 0.0)?;
        let seen: Vec<(&Record, Kinematics)> =
            problem.fit.iter().chain(&problem.held_out).filter_map(|r| Some((r, seen(r, position, velocity, problem)?))).collect();
        let first = seen.first()?;
        let (turned, scaled, shifted) =
            (seen.iter().all(|(_, k)| k.gain < 0.0), seen.iter().all(|(_, k)| k.is_scaled()), seen.iter().all(|(_, k)| k.is_shifted()));
        if !turned && !scaled && !shifted {
            return None;
        }
        let (name, of) = (&output.name, &outputs[position].name);
        let middle = |value: &dyn Fn(&Kinematics) -> f64| seen.iter().map(|(_, k)| value(k)).sum::<f64>() / seen.len() as f64;
        let gain = middle(&|k| k.gain);
        let mut parts = Vec::new();
        if turned || scaled {
            parts.push(format!("is {} times the derivative of {of}", round_significant(gain, 3)));
        }
        if shifted {
            let lag = middle(&|k| k.lag_s);
            let word = if lag > 0.0 { "lags" } else { "leads" };
            parts.push(format!("{word} the derivative of {of} by {:.0} ms", 1e3 * lag.abs()));
        }
        let is_both = scaled && shifted;
        let todo = match is_both || shifted {
            false => format!(
                "{name} is ignored, and computed from {of} where needed; if {of} is right, set scale to {} times its present value for \
                    {name} under [columns] of set.toml",
                round_significant(1.0 / gain, 3)
            ),
            true if is_both => format!(
                "one of the two columns is mislabelled: find out which, and leave it out with --ignore-signal {name} or --ignore-signal \
                    {of}"
            ),
            true => format!("{name} is ignored, and computed from {of} where needed"),
        };
        let text = format!("{}: {todo}", parts.join(", and "));
        Some(Contradiction { output: velocity, text, is_both, file: file_name(&first.0.name).to_string() })
    };
    outputs.iter().enumerate().filter_map(of).collect()
}

impl Contradiction {
    /// As a remark of the audit.
    fn remark(&self, problem: &Problem) -> Remark {
        let signal = problem.model.outputs.get(self.output).map_or(String::new(), |o| o.name.clone());
        Remark { weight: Weight::Caution, records: Vec::new(), signal, about: "velocity", text: self.text.clone() }
    }
}

/// A problem without the velocities that contradict the positions of their bodies, and what is to be said of each: the position is a measurement of the same.
pub fn without_contradicted(problem: Problem) -> (Problem, Vec<Remark>) {
    let wrong = contradictions(&problem);
    let remarks = wrong.iter().map(|contradiction| contradiction.remark(&problem)).collect();
    let places: Vec<usize> = wrong.iter().map(|contradiction| contradiction.output).collect();
    (problem.without_outputs(&places), remarks)
}

/// How a velocity follows its position in a recording; `None` where too little moves to tell, and where the one is not the other's derivative at all.
fn seen(record: &Record, position: usize, velocity: usize, problem: &Problem) -> Option<Kinematics> {
    let (x, v) = (record.outputs.get(position)?.as_deref()?, record.outputs.get(velocity)?.as_deref()?);
    let far = |output: usize| record.spread[output] > MOVES * problem.noise_sd[output];
    let moves = far(position) && record.spread[velocity] > problem.noise_sd[velocity];
    let found = Kinematics::of(x, v, &Band::of(record.period, 1.0 / record.period)).filter(|k| moves && k.is_explained())?;
    // What the model states of its sensors, such as counts for radians or a delay, is no contradiction.
    let (of_x, of_v) = (problem.model.outputs.get(position)?, problem.model.outputs.get(velocity)?);
    let factor = of_x.gain / of_v.gain;
    factor.is_finite().then_some(Kinematics { gain: found.gain * factor, lag_s: found.lag_s - (of_v.delay - of_x.delay), ..found })
}

#[cfg(test)]
mod tests {
    use super::*;
    use backdrive_plant::model::Model;
    use backdrive_plant::recording::Recording;
    use backdrive_plant::set::Initial;

    #[test]
    fn what_the_model_states_of_its_sensors_is_no_contradiction() {
        let told = |gain: f64, scale: f64| {
            let text = format!(
                "motion = 'rotation'\nbodies = {{ rotor = 1e-3 }}\ninputs = [ {{ name = 'u', kind = 'force', on = 'rotor' }} ]\n\
                 outputs = [ {{ name = 'counts', kind = 'position', of = 'rotor', gain = {gain} }}, {{ name = 'speed', kind = 'velocity', of = 'rotor' }} ]\n"
            );
            let model = Model::from_toml(&text, "model").unwrap();
            let t: Vec<f64> = (0..4000).map(|i| f64::from(i) * 2e-3).collect();
            let of = |f: &dyn Fn(f64) -> f64| t.iter().map(|t| f(*t)).collect::<Vec<f64>>();
            let turn = |t: f64| (3.0 * t).sin() + 0.3 * (7.7 * t).sin();
            let speed = |t: f64| 3.0 * (3.0 * t).cos() + 0.3 * 7.7 * (7.7 * t).cos();
            let signals = vec![
                ("u".to_string(), of(&|t| t.sin())),
                ("counts".to_string(), of(&|t| 636.62 * turn(t))),
                ("speed".to_string(), of(&|t| scale * speed(t))),
            ];
            let record = Record::new(&Recording::new("r", t.clone(), signals).unwrap(), &model, Vec::new()).unwrap();
            let problem = Problem::new(text.clone(), "model.toml".into(), model, vec![record], Vec::new(), Initial::Free).unwrap();
            contradictions(&problem)
        };
        assert!(told(636.62, 1.0).is_empty());
        assert!(told(636.62, 3.0)[0].text.starts_with("is 3 times the derivative of counts"));
        assert!(told(1.0, 1.0)[0].text.contains("times the derivative of counts"));
    }
}
