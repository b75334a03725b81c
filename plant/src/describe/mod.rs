//! A description of a model for a person: its network, parameters, modes and responses, and what is unusual about it.

mod check;
mod diagram;
mod robot;
mod text;
mod units;

pub use check::{Remark, Severity, check};
pub use diagram::diagram;
pub use robot::{JointRow, PointRow, RobotRow};
pub use units::unit_for;

use crate::linear::{LinearError, LinearModel, Operating, log_frequencies};
use crate::model::{Model, Motion, OutputKind};
use serde::Serialize;

/// All there is to show of a model. Displays as text; serialises as data.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Description {
    /// Short id.
    pub name: String,
    /// One line.
    pub title: String,
    /// Where the numbers come from.
    pub source: String,
    /// `translation` or `rotation`.
    pub motion: &'static str,
    /// The network as a drawing of lines.
    pub diagram: String,
    /// The robot whose joints are bodies; `None` of a device without one.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub robot: Option<RobotRow>,
    /// Bodies.
    pub bodies: Vec<NamedNumber>,
    /// Elements.
    pub elements: Vec<ElementRow>,
    /// Undamped modes, slowest first.
    pub modes: Vec<ModeRow>,
    /// Damped poles, slowest first.
    pub poles: Vec<PoleRow>,
    /// One response for each axis, or else from the first input to the first output.
    pub responses: Vec<Response>,
    /// Why modes, poles and responses are missing, where they are.
    pub not_linear: Option<String>,
    /// Amplitude at which hysteresis and the like were evaluated, m or rad.
    pub amplitude: f64,
    /// What is odd.
    pub remarks: Vec<Remark>,
}

/// A number with its name and unit.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct NamedNumber {
    /// Name or key.
    pub name: String,
    /// One number, or the numbers of a list.
    pub values: Vec<f64>,
    /// Such as `N/m`.
    pub unit: String,
}

/// An element.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct ElementRow {
    /// Its name.
    pub name: String,
    /// Its kind.
    pub kind: &'static str,
    /// Names of its ends.
    pub between: [String; 2],
    /// The kind's equation.
    pub equation: &'static str,
    /// Its parameters.
    pub parameters: Vec<NamedNumber>,
}

/// An undamped mode.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct ModeRow {
    /// Hz; 0 where nothing holds the device.
    pub frequency_hz: f64,
    /// Name and motion of every body, the largest 1.
    pub shape: Vec<(String, f64)>,
}

/// A damped pole or pair.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct PoleRow {
    /// Magnitude, Hz.
    pub frequency_hz: f64,
    /// Damping ratio; negative where it grows.
    pub damping_ratio: f64,
}

/// A frequency response.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Response {
    /// Name of the input.
    pub input: String,
    /// Name of the output.
    pub output: String,
    /// Unit of its magnitude, such as `m/N`.
    pub unit: String,
    /// Its points.
    pub points: Vec<ResponsePoint>,
}

/// A point of a frequency response.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct ResponsePoint {
    /// Hz.
    pub frequency_hz: f64,
    /// Output's unit over input's unit.
    pub magnitude: f64,
    /// Degrees, from -180 to 180.
    pub phase_deg: f64,
}

/// Everything about a model; nonlinear elements are evaluated at the operating point `at`.
pub fn describe(model: &Model, at: &Operating) -> Description {
    let motions = robot::motions(model);
    let mut description = Description {
        name: model.name.clone(),
        title: model.title.clone(),
        source: model.source.clone(),
        motion: match model.motion {
            Motion::Translation => "translation",
            Motion::Rotation => "rotation",
        },
        diagram: diagram(model),
        robot: model.arm.as_ref().map(|arm| robot::robot_row(model, arm)),
        bodies: model
            .bodies
            .iter()
            .zip(&motions)
            .map(|(b, motion)| NamedNumber { name: b.name.clone(), values: vec![b.inertia], unit: unit_for(*motion, "kg") })
            .collect(),
        elements: (0..model.elements.len()).map(|index| element_row(model, index, &motions)).collect(),
        modes: Vec::new(),
        poles: Vec::new(),
        responses: Vec::new(),
        not_linear: None,
        amplitude: at.amplitude,
        remarks: check(model, at),
    };
    if let Err(error) = add_linear(&mut description, model, at) {
        description.not_linear = Some(error.to_string());
    }
    description
}

fn element_row(model: &Model, index: usize, motions: &[Motion]) -> ElementRow {
    let element = &model.elements[index];
    let motion = element.between.iter().flatten().next().map_or(model.motion, |body| motions[*body]);
    let kind = element.law.kind();
    let parameters = kind
        .parameters
        .iter()
        .zip(element.law.values())
        .filter(|(p, values)| !(values.is_empty() || !p.list && p.default == Some(values[0])))
        .map(|(p, values)| NamedNumber { name: p.key.to_string(), values, unit: unit_for(motion, p.unit) })
        .collect();
    let between = element.between.map(|place| model.place_name(place).to_string());
    ElementRow { name: element.name.clone(), kind: kind.name, between, equation: kind.equation, parameters }
}

fn add_linear(description: &mut Description, model: &Model, at: &Operating) -> Result<(), LinearError> {
    let linear = LinearModel::new(model, at)?;
    for mode in linear.modes()? {
        let shape = model.bodies.iter().map(|b| b.name.clone()).zip(mode.shape.iter().copied()).collect();
        description.modes.push(ModeRow { frequency_hz: mode.frequency_hz(), shape });
    }
    for pole in linear.poles()? {
        description.poles.push(PoleRow { frequency_hz: pole.frequency_hz(), damping_ratio: pole.damping_ratio() });
    }
    let mut pairs: Vec<(usize, usize)> = model.axes.iter().map(|a| (a.feedback, a.measured)).collect();
    if pairs.is_empty() && !model.inputs.is_empty() && !model.outputs.is_empty() {
        pairs.push((0, 0));
    }
    let frequencies = frequencies_around(description.modes.iter().map(|m| m.frequency_hz));
    for (input, output) in pairs {
        let values = linear.response(input, output, &frequencies)?;
        let points = frequencies.iter().zip(&values).map(|(f, v)| ResponsePoint {
            frequency_hz: *f,
            magnitude: v.norm(),
            phase_deg: v.arg().to_degrees(),
        });
        description.responses.push(Response {
            input: model.inputs[input].name.clone(),
            output: model.outputs[output].name.clone(),
            unit: response_unit(model, input, output, &robot::motions(model)),
            points: points.collect(),
        });
    }
    Ok(())
}

/// A decade below the slowest mode that is held to half a decade above the fastest, 6 to the decade.
fn frequencies_around(modes: impl Iterator<Item = f64>) -> Vec<f64> {
    let held: Vec<f64> = modes.filter(|f| *f > 0.0).collect();
    let slowest = held.iter().copied().fold(f64::INFINITY, f64::min);
    let fastest = held.iter().copied().fold(0.0, f64::max);
    let (from, to) = if held.is_empty() { (0.1, 1000.0) } else { (slowest / 10.0, fastest * 3.0) };
    // Round numbers are read more easily than the modes' own.
    let from = 10.0_f64.powf((from.log10() * 3.0).floor() / 3.0);
    let count = ((to / from).log10() * 6.0).ceil() as usize + 1;
    log_frequencies(from, from * 10.0_f64.powf((count - 1) as f64 / 6.0), count)
}

fn response_unit(model: &Model, input: usize, output: usize, motions: &[Motion]) -> String {
    let (from, to) = (&model.inputs[input], &model.outputs[output]);
    let read = match &to.kind {
        OutputKind::Position(body) | OutputKind::Velocity(body) | OutputKind::Acceleration(body) | OutputKind::Reaction(body) => {
            Some(*body)
        }
        OutputKind::Force(elements) => elements.first().and_then(|e| model.elements[*e].between.into_iter().flatten().next()),
    };
    let from = unit_for(motions[from.on], from.kind.unit());
    let to = unit_for(read.map_or(model.motion, |body| motions[body]), to.kind.unit());
    match (to == from, from.contains(' ')) {
        (true, _) => "-".to_string(),
        (false, true) => format!("{to}/({from})"),
        (false, false) => format!("{to}/{from}"),
    }
}
