//! The report of `backdrive diagnose`: pictures first, the numbers beside them.

mod about;
mod arm;
mod arm_figures;
mod arm_tables;
mod force;
mod held_out;
mod one_axis;
mod phrases;
mod servo;
mod tables;

use crate::offered::Step;
use about::About;
use backdrive_answers::found::{Diagnosed, Found};
use backdrive_report::Page;

/// The report on what was found. `steps`: what to do next.
pub fn page(found: &Found, steps: &[Step]) -> Page {
    let about = About { name: &found.name, notes: &found.all_notes(), steps };
    match &found.device {
        Diagnosed::OneAxis(found) => one_axis::page(found, &about),
        Diagnosed::Arm(both) => arm::page(&both.0, &both.1, &about),
        Diagnosed::Servo(both) => servo::page(&both.0, &both.1, &about),
    }
}
