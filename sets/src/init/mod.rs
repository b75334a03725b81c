//! A model and a set for recordings of one's own.
//!
//! [`prepare`] reads the contents of the files and asks what they do not state ([`ask::Asker`]; an option, a terminal or a default answers). It estimates
//! start values of the parameters, and gives the texts of both files ([`Prepared`]). It writes only bags of tables, and those only on request
//! ([`Prepared::keep`]).

pub mod ask;
mod error;
pub mod estimate;
mod found;
mod made;
pub mod options;
pub mod plan;
mod seen;
mod stated;
mod write;

pub use error::InitError;
pub use options::Options;
pub use seen::ESTIMATE;
pub use write::Seen;

use ask::Asker;
use backdrive_plant::recording::Recording;
use found::Recordings;
use plan::Plan;
use std::io::{BufRead, Write};

/// A model and a set that are ready to be written.
pub struct Prepared {
    /// What is driven and measured.
    pub plan: Plan,
    /// What the recordings show.
    pub seen: Seen,
    /// Their signals.
    pub records: Vec<Recording>,
    /// What is assumed of units, in a sentence.
    pub assumed: Option<String>,
    found: Recordings,
}

/// Asks what the recordings do not state, and reads the recordings.
///
/// # Errors
/// A recording is not there or wrong, or an answer is missing or makes no sense.
pub fn prepare<R: BufRead, W: Write>(asker: &mut Asker<R, W>, options: &Options) -> Result<Prepared, InitError> {
    let found = found::recordings(options)?;
    // A bag has its times by itself.
    let made = Options { time: None, time_unit: None, ..options.clone() };
    let options = if found.made.is_some() { &made } else { options };
    let plan = plan::plan(asker, options, &found)?;
    let records = seen::read(&plan, &found)?;
    let assumed = stated::check(&plan, &records)?;
    let seen = seen::seen(asker, options, &plan, &found, &records)?;
    Ok(Prepared { plan, seen, records, assumed, found })
}

impl Prepared {
    /// The text of the model, which is called so.
    pub fn model(&self, name: &str) -> String {
        write::model(&self.plan, &self.seen, name)
    }

    /// The text of the set, beside a model file of this name.
    pub fn set(&self, model: &str) -> String {
        write::set(&self.plan, &self.seen, model)
    }

    /// Puts bags that were made of tables in their places; their names.
    ///
    /// # Errors
    /// The operating system refuses it.
    pub fn keep(&self) -> Result<Vec<String>, InitError> {
        let Some(made) = &self.found.made else { return Ok(Vec::new()) };
        made.keep()?;
        Ok(made.names())
    }

    /// Columns that only some of the recordings hold.
    pub fn partial(&self) -> &[String] {
        &self.found.partial
    }

    /// Topics whose messages are not read, a sentence each.
    pub fn unread(&self) -> &[String] {
        &self.found.unread
    }
}
