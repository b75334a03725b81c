//! `backdrive secret`: what the hosts of a run know each other by.

use crate::failure::Failure;
use crate::{cli, output};

/// Makes a file with a fresh secret.
pub fn secret(options: &cli::Secret) -> Result<u8, Failure> {
    backdrive_launch::secret::create(&options.file).map_err(Failure::input)?;
    let file = options.file.display();
    output::line(format_args!("wrote {file}; copy it to each host over a way that you trust, and run with --host NAME --secret {file}"))?;
    Ok(0)
}
