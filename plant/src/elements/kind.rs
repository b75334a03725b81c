//! What the registry knows of an element kind: its name, its parameters, and how a law is made of them.

/// What a parameter may be.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Range {
    /// Any finite number.
    Any,
    /// At least 0.
    NonNegative,
    /// Above 0.
    Positive,
    /// From the first to the second, both allowed.
    Between(f64, f64),
}

/// A parameter of an element kind.
#[derive(Debug, Clone, Copy)]
pub struct Parameter {
    /// Key in the model file.
    pub key: &'static str,
    /// Unit for a translation, such as `N/m`; of a list of rows the unit of each column, such as `m, m, N`.
    pub unit: &'static str,
    /// What it may be.
    pub range: Range,
    /// Its value where the file has none; `None` when the file must have it. Of a list that a file may leave out any number: it is then empty.
    pub default: Option<f64>,
    /// Whether it is a list of numbers.
    pub list: bool,
    /// One line.
    pub doc: &'static str,
}

impl Parameter {
    /// A number that the file must have.
    pub(super) const fn number(key: &'static str, unit: &'static str, range: Range, doc: &'static str) -> Parameter {
        Parameter { key, unit, range, default: None, list: false, doc }
    }

    /// A list of numbers that the file must have.
    pub(super) const fn numbers(key: &'static str, unit: &'static str, range: Range, doc: &'static str) -> Parameter {
        Parameter { key, unit, range, default: None, list: true, doc }
    }

    /// The same, with a value for files that have none.
    pub(super) const fn or(self, default: f64) -> Parameter {
        Parameter { key: self.key, unit: self.unit, range: self.range, default: Some(default), list: self.list, doc: self.doc }
    }

    /// Its values where a file has none, as [`KindOf::build`] takes them; `None` when the file must have them.
    pub fn default_values(&self) -> Option<Vec<f64>> {
        self.default.map(|value| if self.list { Vec::new() } else { vec![value] })
    }

    /// Multiplies its values by `factor` as far as they are forces, forces per anything (N/m, N s/m, N/m^1.5) or energies; lengths, times,
    /// rates, exponents and masses stay. An element whose parameters are all scaled so has its force multiplied by `factor` at every motion.
    pub fn scale_force(&self, values: &mut [f64], factor: f64) {
        let columns: Vec<bool> = self.unit.split(", ").map(is_force).collect();
        for (value, _) in values.iter_mut().zip(columns.iter().cycle()).filter(|(_, force)| **force) {
            *value *= factor;
        }
    }
}

/// Whether a unit has a force as its factor.
fn is_force(unit: &str) -> bool {
    unit == "N" || unit.starts_with("N ") || unit.starts_with("N/") || unit == "J"
}

/// What the registry knows of an element kind whose laws are `L`.
#[derive(Debug)]
pub struct KindOf<L> {
    /// Name in model files.
    pub name: &'static str,
    /// Equation in one line.
    pub equation: &'static str,
    /// Where it comes from.
    pub source: &'static str,
    /// What energy it may create, and when.
    pub energy: &'static str,
    /// Its parameters, in the order of the file format.
    pub parameters: &'static [Parameter],
    /// Builds the law from values in the order of `parameters` (a number is a list of one), each
    /// within its range. Errors say in one sentence which relation between parameters is broken.
    pub build: fn(&[Vec<f64>]) -> Result<L, String>,
}

impl<L> KindOf<L> {
    /// The same kind, whose laws are built by `build`.
    pub(super) const fn built_by<M>(&self, build: fn(&[Vec<f64>]) -> Result<M, String>) -> KindOf<M> {
        KindOf { name: self.name, equation: self.equation, source: self.source, energy: self.energy, parameters: self.parameters, build }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn forces_are_scaled_and_lengths_are_not() {
        let scaled = |unit: &'static str, mut values: Vec<f64>| {
            Parameter::numbers("p", unit, Range::Any, "").scale_force(&mut values, 2.0);
            values
        };
        for unit in ["N", "N/m", "N s/m", "N s²/m²", "N/m³", "J"] {
            assert_eq!(scaled(unit, vec![3.0]), [6.0], "{unit}");
        }
        for unit in ["m", "m/s", "s", "kg", "rad", "rad/m", "-", "1", "1/m^n"] {
            assert_eq!(scaled(unit, vec![3.0]), [3.0], "{unit}");
        }
        assert_eq!(scaled("m, m, N", vec![1.0, 2.0, 3.0, 4.0, 5.0, 6.0]), [1.0, 2.0, 6.0, 4.0, 5.0, 12.0]);
    }
}
