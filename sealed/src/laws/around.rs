//! What is around an effect, as far as it decides which answers are right.

use crate::effects::site::Site;

/// The surroundings of an effect in its device.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Around {
    /// Where the effect sits.
    pub site: Site,
    /// Whether it takes the place of something that the model states.
    pub replaces_something: bool,
    /// Name and body of every force input.
    pub force_inputs: Vec<(String, String)>,
    /// Bodies whose motion is prescribed.
    pub moved: Vec<String>,
    /// Kinds of the elements that join the same places.
    pub stated: Vec<&'static str>,
    /// Kinds of the grip's elements that join a body of the site.
    pub gripped_by: Vec<&'static str>,
    /// Kind and place of either end of the grip's elements.
    pub grip_ends: Vec<(&'static str, String)>,
}
