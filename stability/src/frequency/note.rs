//! What a reader of a frequency response has to know.

use serde::{Serialize, Serializer};
use std::fmt;

/// A note; its text is made from what it holds.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Note {
    /// lambda, from the signals.
    LambdaFromSignals {
        /// What they say.
        lambda: f64,
        /// F_f follows F_s by this number of rows.
        lag: usize,
    },
    /// mu, from the signals.
    MuFromSignals {
        /// What they say.
        mu: f64,
        /// x_c follows x_m by this number of rows.
        lag: usize,
    },
    /// Neither was recorded, and the signals do not determine them.
    GainsUnknown,
    /// The hand moves throughout the contact.
    HandNeverRests,
    /// Contact was lost.
    ContactLost {
        /// So often.
        times: usize,
    },
    /// A level of the dither acts too shortly.
    DitherTooShort {
        /// Its RMS.
        rms: f64,
    },
    /// Nothing is seen above the band of the operator.
    OperatorBand {
        /// Its upper end, Hz.
        hz: f64,
    },
    /// The operator's intent took the dither's place.
    NoDither,
    /// Stability limits from different recorded gains differ.
    GainsDisagree,
    /// Stability limits at different amplitudes differ.
    AmplitudeDependent,
    /// The interval extends to the stability limit at large amplitudes.
    ContinuedToLarge {
        /// That stability limit.
        gain: f64,
    },
    /// The interval extends to the stability limit while friction holds the master.
    ContinuedToRest {
        /// That stability limit.
        gain: f64,
    },
}

impl fmt::Display for Note {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Note::LambdaFromSignals { lambda, lag } => {
                write!(f, "lambda was not recorded: {lambda:.4} from the signals, F_f following F_s by {lag} rows")
            }
            Note::MuFromSignals { mu, lag } => {
                write!(f, "mu was not recorded: {mu:.4} from the signals, x_c following x_m by {lag} rows")
            }
            Note::GainsUnknown => f.write_str(
                "the gains were not recorded and cannot be estimated from the signals: all gains are multiples of the \
                    recorded one",
            ),
            Note::HandNeverRests => f.write_str(
                "the hand never rests in contact: the whole contact was used, and below a few Hz the hand's motion acts as \
                    noise",
            ),
            Note::ContactLost { times } => {
                write!(f, "contact was lost {times} times; rows without contact and the 200 ms after are omitted")
            }
            Note::DitherTooShort { rms } => write!(f, "a dither of {rms:.3} rms acts too briefly to be used"),
            Note::OperatorBand { hz } => {
                write!(f, "the operator excites the loop only up to {hz:.0} Hz; a stability limit above that frequency is not visible")
            }
            Note::NoDither => f.write_str("no dither was recorded: the operator's intent, in free motion and in contact, was used instead"),
            Note::GainsDisagree => f.write_str(
                "the recorded gains give different stability limits: the loop depends on its gain or its \
                amplitude",
            ),
            Note::AmplitudeDependent => f.write_str(
                "the stability limit depends on the amplitude of the dither: the loop contains friction, hysteresis or \
                    backlash",
            ),
            Note::ContinuedToLarge { gain } => write!(
                f,
                "the interval is extended to large amplitudes, where the limit tends to {gain:.3} by the describing function of dry \
                    friction"
            ),
            Note::ContinuedToRest { gain } => write!(
                f,
                "the interval is extended to rest: while dry friction holds the master the canceller still subtracts, and the limit is \
                 {gain:.3}"
            ),
        }
    }
}

/// As its text.
impl Serialize for Note {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        serializer.collect_str(self)
    }
}
