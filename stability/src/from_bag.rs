//! A session from a bag of ours: the graph in the bag assigns topics to signals.

use crate::bag_gate::{Gate, gate};
use crate::bag_rows::{Place, Rows};
use crate::long_bag;
pub use crate::long_bag::MOST_ROWS;
use crate::session::Session;
pub use crate::signal_role::SessionError;
use crate::unjudged::Unjudged;
use backdrive_bags::Reader;
use backdrive_nodes::graph::Graph;

impl Session {
    /// Reads a bag of ours; `graph` is the one that made it.
    ///
    /// Rows are steps, from the first that any signal has to the last. What a topic lacks is NaN and counted in the notes.
    ///
    /// A bag of more than [`MOST_ROWS`] steps (of one axis; of several correspondingly fewer) is read in pieces of that size, one after the other, so
    /// that memory does not grow with its length. What the recording did is judged over all of them ([`Session::elsewhere`]). The rows are those of
    /// the worst piece; of equals the first.
    ///
    /// # Errors
    /// A damaged bag; x_m, F_f, x_c or F_s missing; steps that make no rows.
    pub fn from_bag(reader: &Reader, graph: &Graph) -> Result<Session, SessionError> {
        Session::from_bag_in_pieces(reader, graph, MOST_ROWS)
    }

    /// The same with pieces of another length, rows of one axis.
    pub fn from_bag_in_pieces(reader: &Reader, graph: &Graph, most_rows: usize) -> Result<Session, SessionError> {
        let place = Place::of(reader, graph)?;
        let longest = reader.counts().iter().max().copied().unwrap_or(0);
        let most = (most_rows / place.axes.max(1)).max(1) as u64;
        let mut session = if longest > most {
            long_bag::read(reader, graph, &place, most)?
        } else {
            let mut rows = Rows::of(&place);
            for entry in reader.messages()? {
                rows.take(&place, &entry?)?;
            }
            rows.session(reader, graph, &place)?
        };
        let Gate { kept_back, notes, parts } = gate(reader, graph)?;
        session.cut_short = kept_back.filter(|why| *why == Unjudged::Contradictory).or(session.cut_short).or(kept_back);
        session.notes.extend(notes);
        session.parts = parts;
        Ok(session)
    }
}
