//! Keys of a coupling: which law, and the values of each law in a table of its name; and the link of a graph that has one.
//!
//! All tables are read and checked, whichever law is in force: so one word, `law`, swaps the law and nothing else.

use super::{Connection, Graph, NodeKind};
use crate::stage::Impairment;
use backdrive_control::coupling::{Conditions, Law, LawKind, four_channel, passivity, position_position, virtual_coupling, wave};
use backdrive_plant::elements::Range;
use backdrive_plant::tomlfile::{FileError, Table};

/// Corner of the low-pass of velocities where the file names none, Hz.
const VELOCITY_HZ: f64 = 100.0;

/// Reads `law`, `velocity_hz` and the laws' own tables: the law in force, and the corner of the velocities' low-pass, Hz.
pub(super) fn read(table: &mut Table) -> Result<(Law, f64), FileError> {
    let chosen = table.need_one_of("law", &LawKind::ALL)?;
    let velocity_hz = table.number_or("velocity_hz", Range::Positive, VELOCITY_HZ)?;
    let mut law = chosen.usual();
    for (name, kind) in LawKind::ALL {
        let Some(mut keys) = table.table(name)? else { continue };
        let read = settings(kind.usual(), &mut keys)?;
        keys.finish()?;
        if kind == chosen {
            law = read;
        }
    }
    Ok((law, velocity_hz))
}

fn settings(law: Law, keys: &mut Table) -> Result<Law, FileError> {
    Ok(match law {
        Law::Direct => Law::Direct,
        Law::Wave(d) => Law::Wave(wave::Settings {
            impedance: keys.number_or("impedance", Range::Positive, d.impedance)?,
            stiffness: keys.number_or("stiffness", Range::Positive, d.stiffness)?,
            damping: keys.number("damping", Range::Positive)?,
            mass: keys.number_or("mass", Range::Positive, d.mass)?,
        }),
        Law::Passivity(d) => Law::Passivity(passivity::Settings {
            catch_up_s: keys.number_or("catch_up_s", Range::Positive, d.catch_up_s)?,
            harvest: keys.number_or("harvest", Range::NonNegative, d.harvest)?,
        }),
        Law::PositionPosition(d) => Law::PositionPosition(position_position::Settings {
            stiffness: keys.number_or("stiffness", Range::Positive, d.stiffness)?,
            damping: keys.number("damping", Range::NonNegative)?,
            mass: keys.number_or("mass", Range::Positive, d.mass)?,
        }),
        Law::FourChannel(d) => Law::FourChannel(four_channel::Settings {
            stiffness: keys.number_or("stiffness", Range::Positive, d.stiffness)?,
            damping: keys.number("damping", Range::NonNegative)?,
            mass: keys.number_or("mass", Range::Positive, d.mass)?,
            master_mass: keys.number_or("master_mass", Range::NonNegative, d.master_mass)?,
            compensation: compensation(keys, d.compensation)?,
        }),
        Law::VirtualCoupling(d) => Law::VirtualCoupling(virtual_coupling::Settings {
            stiffness: keys.number("stiffness", Range::Positive)?,
            damping: keys.number_or("damping", Range::Positive, d.damping)?,
            injection: keys.number("injection", Range::NonNegative)?,
        }),
    })
}

/// The share of the master's inertia that is taken away.
fn compensation(keys: &mut Table, default: f64) -> Result<f64, FileError> {
    let share = keys.number_or("compensation", Range::NonNegative, default)?;
    match share < 1.0 {
        true => Ok(share),
        false => {
            Err(keys.error_at("compensation", format!("must be below 1, is {share}: all of an inertia cannot be taken away in steps")))
        }
    }
}

/// What the laws' values by default are derived from: the rate, and the delays round the loop.
pub fn conditions(graph: &Graph) -> Conditions {
    let at = |node: usize| graph.nodes.get(node).is_some_and(|n| n.kind == NodeKind::Coupling);
    let into = |port: &str| graph.connections.iter().find(move |c| at(c.to.0) && c.to.1 == port);
    let from = |port: &str| graph.connections.iter().find(move |c| at(c.from.0) && c.from.1 == port);
    let steps = |connection: Option<&Connection>| connection.map_or(0, |c| c.delay);
    let in_loop = [into("motion"), from("to_far"), from("command"), into("contact"), from("to_near"), from("force")];
    let impaired: f64 = in_loop.iter().flatten().filter_map(|c| c.impairment).map(|i| i.delay_s + i.jitter_s).sum();
    let delayed: u64 = in_loop.iter().map(|c| steps(*c)).sum();
    Conditions {
        period_s: graph.period_s(),
        round_trip_s: delayed as f64 * graph.period_s() + impaired,
        held_steps: steps(into("motion")) + steps(from("force")) + 1,
    }
}

impl Graph {
    /// Impairs the link of the graph's coupling, both ways alike; each way draws its own jitter and loss.
    pub fn impair_link(&mut self, impairment: Option<Impairment>) {
        for connection in &mut self.connections {
            let way = match connection.from.1.as_str() {
                "to_far" => 0,
                "to_near" => 1,
                _ => continue,
            };
            if self.nodes.get(connection.from.0).is_some_and(|n| n.kind == NodeKind::Coupling) {
                connection.impairment = impairment.map(|i| Impairment { seed: i.seed.wrapping_mul(2).wrapping_add(way), ..i });
            }
        }
    }
}
