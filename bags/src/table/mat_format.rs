//! The numbers of the MAT format, version 5 (MathWorks, "MAT-File Format"), that its reader and its writer share.

use crate::number_type::NumberType;

/// Bytes before the first element.
pub(crate) const HEADER: usize = 128;

/// Types of elements.
pub(crate) const INT8: u32 = 1;
pub(crate) const UINT8: u32 = 2;
pub(crate) const INT16: u32 = 3;
pub(crate) const UINT16: u32 = 4;
pub(crate) const INT32: u32 = 5;
pub(crate) const UINT32: u32 = 6;
pub(crate) const SINGLE: u32 = 7;
pub(crate) const DOUBLE: u32 = 9;
pub(crate) const INT64: u32 = 12;
pub(crate) const UINT64: u32 = 13;
pub(crate) const MATRIX: u32 = 14;
pub(crate) const COMPRESSED: u32 = 15;
pub(crate) const UTF8: u32 = 16;
pub(crate) const UTF16: u32 = 17;

/// Classes of arrays.
pub(crate) const CLASS_STRUCTURE: u8 = 2;
pub(crate) const CLASS_TEXT: u8 = 4;
pub(crate) const CLASS_OPAQUE: u8 = 17;

/// Flags of arrays, beside their class.
pub(crate) const FLAG_LOGICAL: u8 = 2;
pub(crate) const FLAG_COMPLEX: u8 = 8;

/// Where names that MATLAB does not take are listed: text, a row a column, "name = heading".
pub(crate) const NAMES: &str = "backdrive_names";

/// Of a class of numbers: what they are; and the type of the elements that hold them in full.
pub(crate) const CLASSES: [(u8, NumberType, u32); 10] = [
    (6, NumberType::Double, DOUBLE),
    (7, NumberType::Single, SINGLE),
    (8, NumberType::Int8, INT8),
    (9, NumberType::Uint8, UINT8),
    (10, NumberType::Int16, INT16),
    (11, NumberType::Uint16, UINT16),
    (12, NumberType::Int32, INT32),
    (13, NumberType::Uint32, UINT32),
    (14, NumberType::Int64, INT64),
    (15, NumberType::Uint64, UINT64),
];
