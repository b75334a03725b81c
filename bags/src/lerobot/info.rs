//! `meta/info.json` of a dataset, read.

use crate::BagError;
use serde_json::Value;
use std::path::{Path, PathBuf};

/// A feature of more numbers is none of joints; the file may say anything.
const MOST_JOINTS: usize = 10_000;

/// A dataset's description of itself.
pub(crate) struct Info {
    path: PathBuf,
    /// Frames a second.
    pub(crate) fps: f64,
    features: serde_json::Map<String, Value>,
}

impl Info {
    pub(crate) fn read(folder: &Path) -> Result<Info, BagError> {
        let path = folder.join("meta/info.json");
        let wrong = |what: String| BagError::File { path: path.clone(), what };
        let text = backdrive_plant::input_file::read_to_string(&path)
            .map_err(|error| wrong(format!("cannot be read: {error}; is this the folder of a LeRobot dataset?")))?;
        let info: Value = serde_json::from_str(&text).map_err(|error| wrong(error.to_string()))?;
        let version = info.get("codebase_version").and_then(Value::as_str).unwrap_or_default();
        if !version.starts_with("v3") {
            return Err(wrong(format!(
                "codebase_version: is {version:?}, expected v3.0; lerobot converts older datasets: python -m lerobot.datasets.v30.convert_dataset_v21_to_v30 --repo-id=..."
            )));
        }
        let fps = info.get("fps").and_then(Value::as_f64).filter(|fps| *fps > 0.0 && fps.is_finite());
        let fps = fps.ok_or_else(|| wrong("fps: expected a number above 0, frames a second".to_owned()))?;
        let features = info.get("features").and_then(Value::as_object).cloned().unwrap_or_default();
        Ok(Info { path, fps, features })
    }

    pub(crate) fn has(&self, feature: &str) -> bool {
        self.features.contains_key(feature)
    }

    /// An error that lists the features.
    pub(crate) fn no_feature(&self, feature: &str) -> BagError {
        let names: Vec<&str> = self.features.keys().map(String::as_str).collect();
        let what = format!("features: has no {feature:?}; it has {}: name one as \"measured\" in a contract", names.join(", "));
        BagError::File { path: self.path.clone(), what }
    }

    /// The joints of a feature; lerobot calls their positions `JOINT.pos` and the like.
    pub(crate) fn joints(&self, feature: &str) -> Result<Vec<String>, BagError> {
        let wrong = |what: String| BagError::File { path: self.path.clone(), what: format!("features.{feature}.{what}") };
        let of = self.features.get(feature).unwrap_or(&Value::Null);
        let count = match of.get("shape").and_then(Value::as_array).map(Vec::as_slice) {
            Some([count]) => count.as_u64().and_then(|count| usize::try_from(count).ok()),
            _ => None,
        };
        let count = count.filter(|count| (1..=MOST_JOINTS).contains(count));
        let count = count.ok_or_else(|| wrong(format!("shape: expected one number, a value a joint, from 1 to {MOST_JOINTS}")))?;
        // Some datasets group them: {"motors": [...]}.
        let names = match of.get("names") {
            Some(Value::Object(groups)) => groups.values().next().and_then(Value::as_array),
            Some(Value::Array(names)) => Some(names),
            _ => None,
        };
        let Some(names) = names else { return Ok((1..=count).map(|number| format!("joint{number}")).collect()) };
        if names.len() != count {
            return Err(wrong(format!("names: has {} names, but the shape has {count}", names.len())));
        }
        let plain = |name: &Value| name.as_str().map_or_else(|| name.to_string(), str::to_owned);
        let names: Vec<String> = names.iter().map(plain).collect();
        let joints: Vec<String> =
            names.iter().map(|name| name.rsplit_once('.').map_or(name.as_str(), |(joint, _)| joint).to_owned()).collect();
        // Where joints differ only in the end of a name, it is no name of a quantity: arm.1, arm.2.
        let is_told_apart = |place: usize| !joints[..place].contains(&joints[place]);
        Ok(if (0..count).all(is_told_apart) { joints } else { names })
    }
}
