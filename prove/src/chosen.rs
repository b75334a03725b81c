//! How much of a diagnosed model's estimate is subtracted where the grip is uncertain, and the explanation too. No truth is needed: the diagnosed
//! model is the master, and so are its rivals, which explain the recordings nearly as well.
//!
//! A hand that grips more firmly than the model assumes moves less. The whole estimate then subtracts too much, and the loop runs away where it would not
//! have without any canceller. Of several shares of the estimate, and of no canceller, that one is chosen whose stable gain is largest for the worst of the
//! grips and explanations.

use super::edges::{Canceller, Loop, Moved};
use crate::error::ProveError;
use crate::files::write;
use backdrive_plant::model::Model;
use std::path::{Path, PathBuf};
use std::sync::atomic::AtomicBool;

/// Shares of the estimate that are tried, the largest first: it wins a tie.
const SHARES: [f64; 5] = [1.0, 0.9, 0.75, 0.5, 0.25];
/// How firmly the hand may grip: factors on the grip of the session.
pub const GRIPS: [f64; 3] = [0.8, 1.0, 1.2];
/// A share must be better by this factor than a larger one.
const BETTER: f64 = 1.05;

/// How firmly the hand may hold a model, about the grip of the session, where the canceller estimates it.
const HELD: [f64; 3] = [0.5, 1.0, 2.0];
/// A stable gain above this share of the one without a canceller is not below it: both critical gains are known to 3 per cent only.
pub const AS_GOOD: f64 = 0.94;

/// The canceller that estimates the hand, with what the loop bears without one, whichever of the `models` the device is and however firmly it is held. `None` where it
/// would be below no canceller on one of them. The first model is the one that predicts.
///
/// # Errors
/// A run that cannot be done; `stop` was set.
pub fn estimating(name: &'static str, models: &[PathBuf], task: &Task, stop: &AtomicBool) -> Result<Option<Canceller>, ProveError> {
    let held = || models.iter().flat_map(|model| HELD.map(|grip| (model, grip)));
    let edge = |canceller: &Canceller, (model, grip): (&PathBuf, f64)| -> Result<f64, ProveError> {
        let the_loop = Loop { graph: task.graph, high_pass_hz: task.high_pass_hz, master: Moved::Model(model) };
        Ok(the_loop.edge(canceller, grip, stop)?.at_least)
    };
    let without = held().map(|of| edge(&Canceller::fixed("none", None, None), of)).collect::<Result<Vec<f64>, ProveError>>()?;
    let edge_without = without.iter().copied().reduce(f64::min).filter(|edge| *edge > 0.0);
    let canceller = Canceller { estimates_hand: true, edge_without, ..Canceller::fixed(name, models.first().cloned(), None) };
    for (of, without) in held().zip(without) {
        if edge(&canceller, of)? < AS_GOOD * without {
            return Ok(None);
        }
    }
    Ok(Some(canceller))
}

/// What was chosen.
pub struct Chosen {
    /// Share of the estimate that is subtracted; 0 for no canceller.
    pub share: f64,
    /// Its stable gain for the worst of the grips and explanations.
    pub worst: f64,
}

impl Chosen {
    /// No canceller, because nothing is known of its stable gain.
    pub fn nothing() -> Chosen {
        Chosen { share: 0.0, worst: 0.0 }
    }
}

/// Chooses, and writes the model with its outputs scaled to `path`. The hand holds the diagnosed model `model`, and every one of its `rivals`: the
/// loop has to be stable whichever of them the device is.
pub fn choose(model: &Path, rivals: &[PathBuf], path: &Path, task: &Task, stop: &AtomicBool) -> Result<Chosen, ProveError> {
    let text = backdrive_plant::input_file::read_to_string(model)
        .map_err(|e| ProveError::input(format!("{}: cannot be read: {e}", model.display())))?;
    let masters: Vec<&Path> = std::iter::once(model).chain(rivals.iter().map(PathBuf::as_path)).collect();
    // Below `enough` it does not matter by how much.
    let worst = |canceller: &Canceller, enough: f64| -> Result<f64, ProveError> {
        let mut worst = f64::INFINITY;
        for master in &masters {
            let the_loop = Loop { graph: task.graph, high_pass_hz: task.high_pass_hz, master: Moved::Model(master) };
            for grip in GRIPS {
                worst = the_loop.edge(canceller, grip, stop)?.at_least.min(worst);
                if worst <= enough {
                    return Ok(worst);
                }
            }
        }
        Ok(worst)
    };
    let mut best = Chosen { share: 0.0, worst: worst(&Canceller::fixed("none", None, None), 0.0)? };
    for share in SHARES {
        write_scaled(&text, model, path, share)?;
        let enough = if best.share > 0.0 { BETTER * best.worst } else { best.worst };
        let worst = worst(&Canceller::fixed("chosen", Some(path.to_path_buf()), None), enough)?;
        if worst > enough {
            best = Chosen { share, worst };
        }
    }
    write_scaled(&text, model, path, best.share)?;
    Ok(best)
}

/// The task in which the gain is raised.
pub struct Task<'a> {
    /// Its graph file.
    pub graph: &'a Path,
    /// Corner of the canceller's high-pass, Hz.
    pub high_pass_hz: f64,
}

/// The model file with every output's gain scaled.
fn write_scaled(text: &str, model: &Path, path: &Path, share: f64) -> Result<(), ProveError> {
    use toml_edit::{DocumentMut, Item, value};
    let bad = |e: &dyn std::fmt::Display| ProveError::input(format!("{}: {e}", model.display()));
    let parsed = Model::from_toml(text, &model.display().to_string()).map_err(|e| bad(&e))?;
    let mut document: DocumentMut = text.parse().map_err(|e| bad(&e))?;
    let outputs = document.get_mut("outputs").and_then(Item::as_array_of_tables_mut);
    for (output, known) in outputs.into_iter().flat_map(|t| t.iter_mut()).zip(&parsed.outputs) {
        output["gain"] = value(share * known.gain);
    }
    write(path, document.to_string())
}
