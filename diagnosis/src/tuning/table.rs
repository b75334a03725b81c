//! What a table of tuning is made of: entries with their unit, value and evidence.

use crate::output_error::effort::Effort;

/// What a value rests on.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Evidence {
    /// A level of a test or of a criterion, with its source.
    Statistics(&'static str),
    /// The size of an error of arithmetic or discretisation.
    Numerics(&'static str),
    /// It trades time for completeness: a larger value tries more and claims nothing else.
    Cost(&'static str),
    /// A measurement: the command and what it said.
    Measured(&'static str),
    /// Judgement, with its reason; how much verdicts depend on it is measured in `docs/tuning.md`.
    Judgement(&'static str),
}

impl Evidence {
    /// Kind and text.
    pub fn kind_and_reason(&self) -> (&'static str, &'static str) {
        match self {
            Evidence::Statistics(text) => ("statistics", text),
            Evidence::Numerics(text) => ("numerics", text),
            Evidence::Cost(text) => ("cost", text),
            Evidence::Measured(text) => ("measured", text),
            Evidence::Judgement(text) => ("judgement", text),
        }
    }
}

/// An entry as a table shows it.
#[derive(Debug, Clone, PartialEq)]
pub struct Row {
    /// Group and field, such as `claim.least_advantage`.
    pub name: String,
    /// Value.
    pub value: String,
    /// Its unit.
    pub unit: &'static str,
    /// What it decides.
    pub decides: String,
    /// What it rests on.
    pub evidence: Evidence,
}

/// A value that a study may change.
pub trait Quantity {
    /// As a table shows it.
    fn shown(&self) -> String;
    /// Multiplies it by a factor; integers are rounded.
    fn times(&mut self, factor: f64);
    /// This value, in all of a list.
    fn set(&mut self, value: f64);
}

impl Quantity for f64 {
    fn shown(&self) -> String {
        format!("{self}")
    }

    fn times(&mut self, factor: f64) {
        *self *= factor;
    }

    fn set(&mut self, value: f64) {
        *self = value;
    }
}

impl Quantity for usize {
    fn shown(&self) -> String {
        format!("{self}")
    }

    fn times(&mut self, factor: f64) {
        *self = (*self as f64 * factor).round() as usize;
    }

    fn set(&mut self, value: f64) {
        *self = value as usize;
    }
}

impl Quantity for u64 {
    fn shown(&self) -> String {
        format!("{:e}", *self as f64)
    }

    fn times(&mut self, factor: f64) {
        *self = (*self as f64 * factor).round() as u64;
    }

    fn set(&mut self, value: f64) {
        *self = value as u64;
    }
}

impl Quantity for Effort {
    fn shown(&self) -> String {
        format!("{} to {}", self.steps, self.tolerance)
    }

    fn times(&mut self, factor: f64) {
        self.steps.times(factor);
    }

    fn set(&mut self, value: f64) {
        self.steps.set(value);
    }
}

impl<Q: Quantity, const N: usize> Quantity for [Q; N] {
    fn shown(&self) -> String {
        self.iter().map(Quantity::shown).collect::<Vec<_>>().join(", ")
    }

    fn times(&mut self, factor: f64) {
        self.iter_mut().for_each(|q| q.times(factor));
    }

    fn set(&mut self, value: f64) {
        self.iter_mut().for_each(|q| q.set(value));
    }
}

/// A group of entries.
pub trait Group {
    /// All of them; `group` is the name they stand under.
    fn rows(&self, group: &str) -> Vec<Row>;
    /// One by its name; `None` where there is none of it.
    fn quantity(&mut self, field: &str) -> Option<&mut dyn Quantity>;
}

/// Declares a group: each entry has its documentation, name, type, value, unit and evidence.
macro_rules! group {
    ($(#[doc = $about:literal])+ $name:ident { $( $(#[doc = $decides:literal])+ $field:ident: $type:ty = $value:expr, $unit:literal, $evidence:expr; )* }) => {
        $(#[doc = $about])+
        #[derive(Debug, Clone, PartialEq)]
        pub struct $name {
            $( $(#[doc = $decides])+ pub $field: $type, )*
        }

        impl Default for $name {
            fn default() -> $name {
                $name { $( $field: $value, )* }
            }
        }

        impl $crate::tuning::table::Group for $name {
            fn rows(&self, group: &str) -> Vec<$crate::tuning::table::Row> {
                use $crate::tuning::table::{Evidence::*, Quantity, Row};
                vec![$( Row {
                    name: format!("{group}.{}", stringify!($field)),
                    value: self.$field.shown(),
                    unit: $unit,
                    decides: concat!($($decides, " "),+).trim().to_string(),
                    evidence: $evidence,
                }, )*]
            }

            fn quantity(&mut self, field: &str) -> Option<&mut dyn $crate::tuning::table::Quantity> {
                match field {
                    $( stringify!($field) => Some(&mut self.$field), )*
                    _ => None,
                }
            }
        }
    };
}
pub(super) use group;
