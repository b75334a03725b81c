//! What makes a remedy on the command line of `backdrive run` and `backdrive replay`.

use crate::change::Change;
use backdrive_nodes::graph::{DeviceFiles, Graph, NodeKind, Settings};

/// A word of a command line.
#[derive(Debug, Clone, PartialEq)]
pub enum Word {
    /// As it stands.
    Text(String),
    /// The model file of the master as recorded, its hand included: the recording shows another master than the graph states.
    MasterFile,
}

/// The devices that options can name.
#[derive(Debug, Clone, Copy)]
pub struct Named<'a> {
    /// The master as recorded.
    master: Option<&'a DeviceFiles>,
    /// The canceller that the graph states.
    canceller: Option<&'a DeviceFiles>,
    /// Whether the master as recorded is the one that the graph states.
    is_stated: bool,
}

impl<'a> Named<'a> {
    /// The master of the loop as recorded, `was`, and the canceller of the graph.
    pub fn of(was: &'a Graph, stated: &'a Graph, is_stated: bool) -> Named<'a> {
        let master = was.node_of(NodeKind::Master).and_then(|node| match &node.settings {
            Settings::Master(files) => Some(files),
            _ => None,
        });
        let canceller = stated.node_of(NodeKind::Canceller).and_then(|node| match &node.settings {
            Settings::Canceller(files, ..) => Some(files),
            _ => None,
        });
        Named { master, canceller, is_stated }
    }
}

/// Options and values that make the changes of a remedy, with exactly the models that were tried; `None` where the command line has no words for one of
/// them.
pub fn options(changes: &[Change], named: &Named) -> Option<Vec<Word>> {
    let each: Option<Vec<Vec<Word>>> = changes.iter().map(|change| of(change, named)).collect();
    each.map(|each| each.concat()).filter(|words| !words.is_empty())
}

fn of(change: &Change, named: &Named) -> Option<Vec<Word>> {
    let words = |words: &[&str]| words.iter().map(|word| Word::Text(word.to_string())).collect::<Vec<_>>();
    match change {
        Change::Gain { lambda, .. } => Some(words(&["--lambda", &plain(*lambda)])),
        Change::Canceller { model: None, .. } => Some(words(&["--canceller", "none"])),
        Change::Canceller { model: Some(model), grip, high_pass_hz, .. } => {
            let model = predicted(model, grip.as_deref(), named)?;
            Some([model, words(&["--high-pass", &high_pass_hz.to_string()])].concat())
        }
        Change::EstimatedHand { model, grip } => {
            Some([predicted(model, Some(grip), named)?, words(&["--hand", "estimated", "--high-pass", "0"])].concat())
        }
        Change::HighPass { hz } => Some(words(&["--high-pass", &hz.to_string()])),
        Change::Rate { hz } => Some(words(&["--rate", &format!("{hz:.0}")])),
        Change::Coupling { law } if named.canceller.is_some() => Some(words(&["--coupling", law.name(), "--canceller", "none"])),
        Change::Coupling { law } => Some(words(&["--coupling", law.name()])),
        Change::WayRepaired { .. }
        | Change::Delays { .. }
        | Change::SensorRepaired { .. }
        | Change::NumberRepaired { .. }
        | Change::DeviceRepaired { .. }
        | Change::Wall { .. }
        | Change::Servo { .. }
        | Change::FeedForward { .. }
        | Change::Dither { .. }
        | Change::FollowerWithoutFriction
        | Change::Renewals { .. }
        | Change::Interpolated
        | Change::FinerSensors
        | Change::Damping { .. }
        | Change::FrictionCompensated { .. }
        | Change::Grip { .. }
        | Change::StrongerMotor
        | Change::NoLimits => None,
    }
}

/// The options that let a canceller predict with a model and a grip.
fn predicted(model: &backdrive_plant::model::Model, grip: Option<&backdrive_plant::model::Fragment>, named: &Named) -> Option<Vec<Word>> {
    let text = |word: &str| Word::Text(word.to_string());
    let master = named.master.filter(|files| files.fragment.as_ref() == grip)?;
    if master.model.as_ref() == Some(model) {
        return Some(match named.is_stated {
            true => vec![text("--canceller"), text("master")],
            false => vec![text("--canceller"), Word::MasterFile, text("--canceller-grip"), text("none")],
        });
    }
    let own = named.canceller.is_some_and(|files| files.model.as_ref() == Some(model));
    (own && named.is_stated).then(|| vec![text("--canceller-grip"), text("master")])
}

/// Four significant digits, as a command takes them.
fn plain(value: f64) -> String {
    let digits = if value > 0.0 { (3.0 - value.log10().floor()).clamp(0.0, 12.0) as usize } else { 4 };
    format!("{value:.digits$}")
}
