//! `backdrive device`: find, new, check, emulate.

mod emulate;
mod find;
mod look;
mod new;

use crate::cli;
use crate::failure::Failure;

/// Carries the command out.
pub fn device(command: &cli::Device) -> Result<u8, Failure> {
    match command {
        cli::Device::Find(options) => find::find(options),
        cli::Device::New(options) => new::new(options),
        cli::Device::Check { device, port, json } => look::check(device, port.as_deref(), *json),
        cli::Device::Emulate(options) => emulate::emulate(options),
    }
}
