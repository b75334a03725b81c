//! Which column of a table goes where in a bag.

use crate::BagError;
use crate::memory::MOST_BYTES;
use serde::Serialize;
use std::str::FromStr;

/// What a column is of an axis.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Quantity {
    /// m or rad.
    #[default]
    Position,
    /// m/s or rad/s.
    Velocity,
    /// N or N m.
    Effort,
}

impl Quantity {
    pub(crate) const ALL: [Quantity; 3] = [Quantity::Position, Quantity::Velocity, Quantity::Effort];

    /// Name of the field in a JointState.
    pub fn field(self) -> &'static str {
        match self {
            Quantity::Position => "position",
            Quantity::Velocity => "velocity",
            Quantity::Effort => "effort",
        }
    }
}

/// Where a column goes: `scale * cell + offset`.
#[derive(Debug, Clone, PartialEq)]
pub struct ColumnMap {
    /// Heading of the column.
    pub column: String,
    /// Topic that gets it.
    pub topic: String,
    /// As what.
    pub quantity: Quantity,
    /// Of which axis, below [`backdrive_msgs::MAX_AXES`].
    pub axis: usize,
    /// Factor to SI units.
    pub scale: f64,
    /// Then added.
    pub offset: f64,
}

impl ColumnMap {
    /// A column at a place such as `/master/servo_jf.effort[0]`, unscaled.
    ///
    /// # Errors
    /// [`BagError::Option`] where that is no place.
    pub fn at(column: &str, place: &str) -> Result<ColumnMap, BagError> {
        let read = || {
            let (topic, field) = place.rsplit_once('.')?;
            let (field, axis) = field.strip_suffix(']')?.split_once('[')?;
            let quantity = Quantity::ALL.into_iter().find(|quantity| quantity.field() == field)?;
            let (column, topic) = (column.to_owned(), topic.to_owned());
            Some(ColumnMap { column, topic, quantity, axis: axis.parse().ok()?, scale: 1.0, offset: 0.0 })
        };
        read().ok_or_else(|| no_map(&format!("{column}={place}")))
    }
}

fn no_map(text: &str) -> BagError {
    BagError::Option(format!("--map \"{text}\": expected COLUMN=TOPIC.FIELD[AXIS], such as force=/master/servo_jf.effort[0]"))
}

impl FromStr for ColumnMap {
    type Err = BagError;

    /// `COLUMN=TOPIC.FIELD[AXIS]`
    fn from_str(text: &str) -> Result<ColumnMap, BagError> {
        let (column, place) = text.split_once('=').ok_or_else(|| no_map(text))?;
        ColumnMap::at(column, place)
    }
}

/// How a table becomes a bag.
#[derive(Debug, Clone, PartialEq)]
pub struct ImportOptions {
    /// Heading of the column with the times, s.
    pub time: String,
    /// Where columns go. When empty, each column becomes `position[0]` of a topic of its own, `/recording/NAME`, in which
    /// letters that ROS does not allow are `_`.
    pub columns: Vec<ColumnMap>,
    /// Of a MATLAB file, the structure whose fields the columns are; `None` where they are variables of their own.
    pub variable: Option<String>,
    /// Names of the columns of a table that has no headings, in its order; a name may state its unit, `q (deg)`.
    pub headings: Option<Vec<String>>,
    /// Rows per second of a table in which no column is the time, Hz.
    pub rate_hz: Option<f64>,
    /// Replace a bag that exists.
    pub overwrite: bool,
    /// Bytes that the unpacked numbers may take, see [`crate::MOST_BYTES`].
    pub most_bytes: u64,
}

impl Default for ImportOptions {
    fn default() -> ImportOptions {
        ImportOptions {
            time: "t".to_owned(),
            columns: Vec::new(),
            variable: None,
            headings: None,
            rate_hz: None,
            overwrite: false,
            most_bytes: MOST_BYTES,
        }
    }
}

/// What an import did.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct ImportReport {
    /// Rows, which are steps in the bag.
    pub rows: u64,
    /// Topics written, without that of the times.
    pub topics: Vec<String>,
    /// Columns left out because they hold something that is no number.
    pub skipped: Vec<String>,
    /// What was left out, and what else a person should know: a sentence each.
    pub notes: Vec<String>,
    /// What is wrong with the clock: a sentence each, see [`crate::clock_remarks`].
    pub clock: Vec<String>,
}

/// The topic that a signal of this name has to itself in a bag made of a table: `/recording/NAME`, in which what ROS does not allow in a name
/// is `_`.
pub fn topic_of(column: &str) -> String {
    let name: String = column.chars().map(|c| if c.is_ascii_alphanumeric() || c == '_' { c } else { '_' }).collect();
    format!("/recording/{name}")
}
