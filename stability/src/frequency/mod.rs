//! Is the loop stable? From its frequency response, from the data alone.
//!
//! Force is fed back, so force and motion are correlated both ways round the loop. Their cross-spectra with the dither `d` (recorded, exogenous)
//! separate them. With `F_f = d + r`, `r` the reflected part, the loop is `L = S_rd / S_fd`, per unit of gain. It contains every hop, delay and
//! sampler of the recorded loop. The critical gain is where an eigenvalue of `k L(jw)` passes through `+1`.

mod answer;
mod conclude;
mod delays;
mod dithered;
mod edge;
mod local;
mod note;
mod prepared;
mod rows;
mod swap;
#[cfg(test)]
mod tests;
mod types;
mod undithered;

pub use answer::{FrequencyAnswer, Verdict};
pub use delays::{Delays, Hop};
pub use edge::Edge;
pub(crate) use edge::{crossing, eigenvalues};
pub use note::Note;
pub use rows::RowCount;
pub use swap::{ExchangedParts, PartError};
pub use types::{AxisEstimate, CannotTell, Frequency, FrequencyError, GainEstimate, LevelEstimate, Options, Provenance, Response};

use crate::session::Session;
use dithered::dithered;
use prepared::{Prepared, advice, check_shape, complete_gains, drop_unknown_gains, signals};

/// Analyses a session.
pub fn analyse(session: &Session, options: &Options) -> Result<Frequency, FrequencyError> {
    let mut session = session.clone();
    check_shape(&session)?;
    let mut notes = Vec::new();
    let bridged = rows::bridge(&mut session);
    let relative = complete_gains(&mut session, &mut notes);
    let mut rows = rows::usable(&session);
    rows.count.bridged = bridged;
    drop_unknown_gains(&mut rows);
    let has_dither = session.axes.iter().any(|a| a.dither.as_ref().is_some_and(|d| d.iter().any(|x| x.is_finite() && *x != 0.0)));
    if rows.hand_moves && has_dither {
        notes.push(Note::HandNeverRests);
    }
    // The release at the end is one.
    if rows.count.contact_losses > 1 && rows.count.free > 0 {
        notes.push(Note::ContactLost { times: rows.count.contact_losses });
    }
    let advice = advice(&session);
    let mut result = Frequency {
        levels: Vec::new(),
        gains: Vec::new(),
        edge: Edge::default(),
        amplitude_dependent: false,
        gains_disagree: false,
        relative,
        delays: Delays::default(),
        provenance: provenance(&options.parts),
        rows: rows.count,
        method: String::new(),
        notes,
        cannot_tell: None,
        advice,
    };
    let induced = options.parts.canceller.map(|(files, corner, hand)| swap::induced(&session, files, corner, hand)).transpose()?;
    let signals = signals(&session, induced.as_deref());
    let prepared = Prepared { session, signals, rows };
    if has_dither {
        dithered(&prepared, options, &mut result)?;
    } else {
        undithered::analyse(&prepared, options, &mut result)?;
    }
    result.conclude();
    Ok(result)
}

fn provenance(parts: &ExchangedParts) -> Provenance {
    let of = |there: bool| if there { "from model" } else { "measured" };
    let canceller = match parts.canceller {
        Some((files, ..)) if files.model.is_none() => "none",
        canceller => of(canceller.is_some()),
    };
    Provenance { master: of(parts.master.is_some()), canceller, slave: of(parts.slave.is_some()) }
}
