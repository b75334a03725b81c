//! A bag's description of the run that it holds.

use crate::BagError;
use crate::number_type::NumberType;
use backdrive_msgs::topic::{Kind, Topic};
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;
use std::path::Path;

/// Name of the metadata record that holds a [`BagHeader`].
pub(crate) const RUN: &str = "backdrive.run";

/// How time ran.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize, Default)]
#[serde(rename_all = "lowercase")]
pub enum Clock {
    /// Simulated time: stamps are ns since the start and log times are stamps, so that nothing in the bag depends on the machine.
    #[default]
    Lockstep,
    /// Wall-clock time: stamps are ns since the Unix epoch, and log times are when each message came to the recorder.
    Realtime,
    /// A table was turned into a bag: stamps are its times.
    Imported,
}

impl Clock {
    /// As it stands in a bag.
    pub fn as_str(self) -> &'static str {
        match self {
            Clock::Lockstep => "lockstep",
            Clock::Realtime => "realtime",
            Clock::Imported => "imported",
        }
    }
}

/// A recorded topic.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct TopicInfo {
    /// Name and kind.
    pub topic: Topic,
    /// Names of its axes; empty for topics without axes.
    #[serde(default)]
    pub axes: Vec<String>,
    /// Name of the node that speaks on it.
    #[serde(default)]
    pub publisher: String,
}

/// Everything needed to know what a bag is of, written before its first message.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct BagHeader {
    /// One line for a person; may be empty.
    pub title: String,
    /// The graph file of the run.
    pub graph_toml: String,
    /// Models, grips and whatever else the graph names, as used: name and text. They become attachments.
    pub files: Vec<(String, String)>,
    /// Program and version, such as `backdrive` and `0.1.0`.
    pub versions: BTreeMap<String, String>,
    /// What each seed was for, and the seed.
    pub seeds: BTreeMap<String, u64>,
    /// How time ran.
    pub clock: Clock,
    /// Steps per second.
    pub rate_hz: f64,
    /// Name of the host in a graph that runs on several, or of the machine where that was asked for; else empty.
    pub host: String,
    /// Topics, in the order of their indices.
    pub topics: Vec<TopicInfo>,
    /// Of a table that was imported: what the numbers of a column were in it, by where they stand now (`/recording/x.position[0]`); doubles are left out.
    pub column_types: BTreeMap<String, NumberType>,
    /// Of a table that was imported: the SI unit of a column whose heading stated one, by where it stands now; without an entry nothing states the unit.
    pub column_units: BTreeMap<String, String>,
}

impl BagHeader {
    /// Index of a topic in [`BagHeader::topics`].
    pub fn topic(&self, name: &str) -> Option<usize> {
        self.topics.iter().position(|info| info.topic.name == name)
    }

    /// As the entries of a metadata record, whose values are all text.
    pub(crate) fn to_metadata(&self) -> Result<BTreeMap<String, String>, serde_json::Error> {
        let file_names: Vec<&str> = self.files.iter().map(|(name, _)| name.as_str()).collect();
        let mut metadata = BTreeMap::from([
            ("format".to_owned(), "1".to_owned()),
            ("title".to_owned(), self.title.clone()),
            ("graph".to_owned(), self.graph_toml.clone()),
            ("files".to_owned(), serde_json::to_string(&file_names)?),
            ("versions".to_owned(), serde_json::to_string(&self.versions)?),
            ("seeds".to_owned(), serde_json::to_string(&self.seeds)?),
            ("clock".to_owned(), self.clock.as_str().to_owned()),
            ("rate_hz".to_owned(), format!("{:?}", self.rate_hz)),
            ("host".to_owned(), self.host.clone()),
            ("topics".to_owned(), serde_json::to_string(&self.topics)?),
        ]);
        if !self.column_types.is_empty() {
            metadata.insert("column_types".to_owned(), serde_json::to_string(&self.column_types)?);
        }
        if !self.column_units.is_empty() {
            metadata.insert("column_units".to_owned(), serde_json::to_string(&self.column_units)?);
        }
        Ok(metadata)
    }

    /// Back from a metadata record; the texts of the files are attachments and are looked up with `file`.
    pub(crate) fn from_metadata(
        path: &Path,
        metadata: &BTreeMap<String, String>,
        file: impl Fn(&str) -> Option<String>,
    ) -> Result<BagHeader, BagError> {
        let wrong = |key: &'static str, what: String| BagError::Metadata { path: path.to_owned(), record: RUN, key, what };
        let text = |key: &'static str| metadata.get(key).map(String::as_str).ok_or_else(|| wrong(key, "is missing".to_owned()));
        fn json<T: serde::de::DeserializeOwned>(text: &str) -> Result<T, String> {
            serde_json::from_str(text).map_err(|error| error.to_string())
        }
        let format = text("format")?;
        if format != "1" {
            return Err(wrong("format", format!("is {format:?}, this version reads \"1\"")));
        }
        let file_names: Vec<String> = json(text("files")?).map_err(|what| wrong("files", what))?;
        Ok(BagHeader {
            title: text("title")?.to_owned(),
            graph_toml: text("graph")?.to_owned(),
            files: file_names.into_iter().filter_map(|name| file(&name).map(|text| (name, text))).collect(),
            versions: json(text("versions")?).map_err(|what| wrong("versions", what))?,
            seeds: json(text("seeds")?).map_err(|what| wrong("seeds", what))?,
            clock: json(&format!("{:?}", text("clock")?)).map_err(|what| wrong("clock", what))?,
            rate_hz: text("rate_hz")?.parse().map_err(|_| wrong("rate_hz", "is not a number".to_owned()))?,
            host: text("host")?.to_owned(),
            topics: json(text("topics")?).map_err(|what| wrong("topics", what))?,
            // Bags of before have none.
            column_types: match metadata.get("column_types") {
                Some(text) => json(text).map_err(|what| wrong("column_types", what))?,
                None => BTreeMap::new(),
            },
            column_units: match metadata.get("column_units") {
                Some(text) => json(text).map_err(|what| wrong("column_units", what))?,
                None => BTreeMap::new(),
            },
        })
    }
}

impl TopicInfo {
    /// Whether one message per step is due on it.
    pub(crate) fn is_dense(&self) -> bool {
        self.topic.kind == Kind::Sample
    }
}
