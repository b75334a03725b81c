//! Numbers as verdict files have them.

use backdrive_plant::write::round_significant;

/// Rounded to `digits` significant digits; `None` for what is no finite number, which JSON cannot hold.
pub(super) fn rounded(value: f64, digits: usize) -> Option<f64> {
    Some(round_significant(value, digits)).filter(|x| x.is_finite())
}
