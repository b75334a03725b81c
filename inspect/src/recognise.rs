//! What each signal probably is, from its name and from the data, with how surely.

use crate::numeric::{span, thinned};
use crate::quantity::Quantity;
use crate::recording::{Recording, Signal};
use backdrive_diagnosis::recordings::follow::follow;
use backdrive_signal::derivative;

/// Share of variance from which on data alone say what a signal is.
const EXPLAINED: f64 = 0.9;
/// Most signals without a name among which pairs are looked for: their number grows with the square.
const MOST_UNKNOWN: usize = 12;
/// Rate to which signals are thinned to be compared, Hz, and the longest lag that is tried, s.
const COARSE_HZ: f64 = 50.0;
const LONGEST_S: f64 = 0.4;

/// Names every signal's quantity.
pub fn recognise(recording: &mut Recording) {
    for signal in &mut recording.signals {
        by_name(signal);
    }
    by_data(recording);
}

fn by_name(signal: &mut Signal) {
    let of_unit = signal.stated.or(signal.hint).and_then(|unit| Quantity::of_kind(unit.kind));
    let (quantity, sure, why) = match (signal.quantity, of_unit) {
        (Quantity::Unknown, Some(of_unit)) => (of_unit, 0.8, "its unit".to_string()),
        (Quantity::Command, _) => (Quantity::Command, 0.9, "its name".to_string()),
        (named, Some(of_unit)) if named == of_unit => (named, 0.98, "its name and its unit".to_string()),
        (Quantity::Unknown, None) => (Quantity::Unknown, 0.0, String::new()),
        (named, _) => (named, 0.9, "its name".to_string()),
    };
    (signal.quantity, signal.sure, signal.why) = (quantity, sure, why);
    if signal.quantity == Quantity::Unknown && counts(&signal.values) {
        (signal.quantity, signal.sure, signal.why) = (Quantity::Counter, 0.9, "it counts rows".to_string());
    } else if signal.quantity == Quantity::Unknown && !signal.values.is_empty() && span(&signal.values) == 0.0 {
        (signal.quantity, signal.sure, signal.why) = (Quantity::Constant, 1.0, "it has one value".to_string());
    }
}

fn counts(values: &[f64]) -> bool {
    values.len() > 2 && values.windows(2).all(|w| w[1] - w[0] == 1.0)
}

/// A velocity is the derivative of a position; a command is followed by a position, late.
fn by_data(recording: &mut Recording) {
    let unknown: Vec<usize> = (0..recording.signals.len())
        .filter(|place| {
            let signal = &recording.signals[*place];
            signal.quantity == Quantity::Unknown && signal.sure == 0.0 && signal.even.len() > 100 && span(&signal.even) > 0.0
        })
        .collect();
    if unknown.is_empty() || unknown.len() > MOST_UNKNOWN {
        return;
    }
    let stride = ((recording.rate() / COARSE_HZ) as usize).max(1);
    let period = recording.period * stride as f64;
    let lags = (LONGEST_S / period) as i64;
    let positions: Vec<usize> = (0..recording.signals.len())
        .filter(|place| unknown.contains(place) || recording.signals[*place].quantity == Quantity::Position)
        .filter(|place| recording.signals[*place].even.len() > 100)
        .collect();
    let coarse = |place: usize| thinned(&recording.signals[place].even, stride);
    let mut said: Vec<(usize, Quantity, f64, String)> = Vec::new();
    for velocity in &unknown {
        for position in positions.iter().filter(|position| *position != velocity) {
            let Some(found) = follow(&derivative(&coarse(*position), period), &coarse(*velocity), (-2, 2)) else { continue };
            if found.explained > EXPLAINED {
                let why = format!("it is the derivative of {}", recording.signals[*position].name);
                said.push((*velocity, Quantity::Velocity, 0.3 + 0.45 * found.explained, why));
                if unknown.contains(position) {
                    let why = format!("{} is its derivative", recording.signals[*velocity].name);
                    said.push((*position, Quantity::Position, 0.3 + 0.45 * found.explained, why));
                }
            }
        }
    }
    for command in &unknown {
        for position in positions.iter().filter(|position| *position != command) {
            if said.iter().any(|(place, ..)| place == command) {
                continue;
            }
            let Some(found) = follow(&coarse(*command), &coarse(*position), (-lags, lags)) else { continue };
            // Late by half a step at least, or either could be the other's command.
            if found.explained > EXPLAINED && found.lag > 0.5 {
                let why = format!("{} follows it with a lag of {:.0} ms", recording.signals[*position].name, 1e3 * found.lag * period);
                said.push((*command, Quantity::Command, 0.3 + 0.45 * found.explained, why));
                if unknown.contains(position) && !said.iter().any(|(place, ..)| place == position) {
                    let why = format!("it follows {} with a lag", recording.signals[*command].name);
                    said.push((*position, Quantity::Position, 0.3 + 0.45 * found.explained, why));
                }
            }
        }
    }
    for (place, quantity, sure, why) in said {
        let signal = &mut recording.signals[place];
        if sure > signal.sure {
            (signal.quantity, signal.sure, signal.why) = (quantity, sure, why);
        }
    }
}
