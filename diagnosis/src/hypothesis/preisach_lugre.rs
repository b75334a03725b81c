//! Bristle friction with non-local memory.

use super::Physics;

/// A name that verdicts and `--without` know, without hypotheses of its own: `maxwell_slip` has the same memory with its numbers free, and
/// what a search makes of both as rivals has not been measured.
pub(super) const PHYSICS: Physics =
    Physics { name: "preisach_lugre", family: "friction", contains: &["lugre", "dahl", "stribeck", "coulomb"], propose: |_| Vec::new() };
