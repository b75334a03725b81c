//! What the numbers of a column are in the file that they came from.

use serde::{Deserialize, Serialize};

/// What the numbers of a column are in their file. In a bag all are doubles, which hold each of these exactly but for whole numbers beyond 2⁵³.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize, Default)]
#[serde(rename_all = "lowercase")]
pub enum NumberType {
    /// 64 bits, IEEE 754.
    #[default]
    Double,
    /// 32 bits, IEEE 754.
    Single,
    /// Whole, 8 bits.
    Int8,
    /// Whole, 16 bits.
    Int16,
    /// Whole, 32 bits.
    Int32,
    /// Whole, 64 bits.
    Int64,
    /// Whole, 8 bits, not negative.
    Uint8,
    /// Whole, 16 bits, not negative.
    Uint16,
    /// Whole, 32 bits, not negative.
    Uint32,
    /// Whole, 64 bits, not negative.
    Uint64,
    /// 0 or 1.
    Bool,
}

/// Up to here every whole number is a double.
pub(crate) const LARGEST_WHOLE: f64 = 9_007_199_254_740_992.0;

impl NumberType {
    /// Least and greatest value of a type of whole numbers, as far as doubles hold them all.
    pub(crate) fn range(self) -> Option<(f64, f64)> {
        Some(match self {
            NumberType::Double | NumberType::Single => return None,
            NumberType::Int8 => (i8::MIN.into(), i8::MAX.into()),
            NumberType::Int16 => (i16::MIN.into(), i16::MAX.into()),
            NumberType::Int32 => (i32::MIN.into(), i32::MAX.into()),
            NumberType::Int64 => (-LARGEST_WHOLE, LARGEST_WHOLE),
            NumberType::Uint8 => (0.0, u8::MAX.into()),
            NumberType::Uint16 => (0.0, u16::MAX.into()),
            NumberType::Uint32 => (0.0, u32::MAX.into()),
            NumberType::Uint64 => (0.0, LARGEST_WHOLE),
            NumberType::Bool => (0.0, 1.0),
        })
    }

    /// Whether a column of this type holds these numbers exactly.
    pub(crate) fn holds(self, values: &[f64]) -> bool {
        let whole = |value: f64, (least, greatest): (f64, f64)| {
            value.fract() == 0.0 && (least..=greatest).contains(&value) && !(value == 0.0 && value.is_sign_negative())
        };
        match self.range() {
            Some(range) => values.iter().all(|value| whole(*value, range)),
            None if self == NumberType::Single => values.iter().all(|value| value.is_nan() || f64::from(*value as f32) == *value),
            None => true,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::{LARGEST_WHOLE, NumberType};

    #[test]
    fn a_type_holds_what_comes_back_the_same() {
        assert!(NumberType::Single.holds(&[0.5, f64::NAN, -0.0, f64::INFINITY]) && !NumberType::Single.holds(&[0.1]));
        assert!(NumberType::Int8.holds(&[-128.0, 127.0]) && !NumberType::Int8.holds(&[128.0]));
        assert!(!NumberType::Int32.holds(&[0.5]) && !NumberType::Int32.holds(&[f64::NAN]) && !NumberType::Int32.holds(&[-0.0]));
        assert!(NumberType::Uint64.holds(&[LARGEST_WHOLE]) && !NumberType::Uint64.holds(&[LARGEST_WHOLE * 2.0]));
        assert!(NumberType::Bool.holds(&[0.0, 1.0]) && !NumberType::Bool.holds(&[2.0]) && NumberType::Double.holds(&[f64::NAN]));
    }
}
