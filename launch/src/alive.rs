//! Which runs of this user are alive.

use crate::carry_error::CarryError;
use crate::paths::RunPaths;
use crate::rundir::RunHome;

/// The run that is named, by the beginning of its name, or the only one that lives.
///
/// # Errors
/// None or several are alive.
pub fn find(named: Option<&str>) -> Result<RunPaths, CarryError> {
    let home = RunHome::system();
    let alive: Vec<String> = home.alive().into_iter().filter(|id| named.is_none_or(|n| id.starts_with(n))).collect();
    match (&alive[..], named) {
        ([one], _) => RunPaths::open(&home.dir().join(one)).map_err(CarryError::from),
        ([], None) => Err(CarryError::input(format!("no run is alive in {}; start one with `backdrive run`", home.dir().display()))),
        ([], Some(named)) => Err(CarryError::input(format!("no living run's name begins with `{named}`"))),
        (several, _) => Err(CarryError::input(format!("several runs are alive, name one: {}", several.join(", ")))),
    }
}

/// Whether a run is alive.
pub fn lives(paths: &RunPaths) -> bool {
    paths.root().parent().is_some_and(|home| RunHome::at(home).alive().iter().any(|id| id == paths.id()))
}
