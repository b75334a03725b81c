//! Addresses of recordings: paths, and `file://`.

use crate::error::FleetError;
use std::path::{Path, PathBuf};

/// The path of a `file://` address; any other address is refused, and a path stays.
pub(super) fn local(path: &Path) -> Result<PathBuf, FleetError> {
    let Some(text) = path.to_str() else { return Ok(path.to_path_buf()) };
    match text.split_once("://") {
        None => Ok(path.to_path_buf()),
        Some(("file", rest)) if rest.starts_with('/') => Ok(PathBuf::from(rest)),
        Some(("file", _)) => Err(FleetError::input(format!("{text}: names another host; write file:///folder/of/this/machine"))),
        Some((scheme, _)) => Err(FleetError::input(format!(
            "{text}: {scheme}:// is not read; mount the store as a folder, or copy the files of a shard before it runs (docs/fleet.md)"
        ))),
    }
}
