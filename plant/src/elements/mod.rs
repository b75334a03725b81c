//! Element kinds: one file each, and one line of registration here.

mod damper;
mod spring;

pub use damper::Damper;
pub use spring::Spring;

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
    /// Unit for a translation, such as `N/m`.
    pub unit: &'static str,
    /// What it may be.
    pub range: Range,
    /// Its value where the file has none; `None` when the file must have it.
    pub default: Option<f64>,
    /// Whether it is a list of numbers.
    pub list: bool,
    /// One line.
    pub doc: &'static str,
}

/// What the registry knows of an element kind.
#[derive(Debug)]
pub struct Kind {
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
    pub build: fn(&[Vec<f64>]) -> Result<Law, String>,
}

macro_rules! register {
    ($($law:ident),* $(,)?) => {
        /// Kind and parameters of an element.
        #[derive(Debug, Clone, PartialEq)]
        pub enum Law { $(#[doc = concat!("See [`", stringify!($law), "`].")] $law($law)),* }

        /// Every element kind.
        pub const KINDS: &[&Kind] = &[$(&$law::KIND),*];

        impl Law {
            /// The kind's description.
            pub fn kind(&self) -> &'static Kind {
                match self { $(Law::$law(_) => &$law::KIND),* }
            }

            /// Parameter values in the order of [`Kind::parameters`].
            pub fn values(&self) -> Vec<Vec<f64>> {
                match self { $(Law::$law(law) => law.values()),* }
            }
        }
    };
}

register!(Spring, Damper);
