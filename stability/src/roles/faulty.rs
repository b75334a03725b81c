//! Which signals of a recording are checked for faults, and what they are called.

use super::file::{Located, Roles, key_of};
use super::table::Named;
use crate::grid::Series;
use crate::sensors::{Column, SensorFault, Twin, faults};
use crate::signal_role::SignalRole;

/// The faults of the signals with a role, of the further sensors, and of all other columns of a table.
pub(super) fn faulty(roles: &Roles, wanted: &[(SignalRole, &Located)], series: &[Series], others: &Named) -> Vec<SensorFault> {
    let named = wanted.len().saturating_sub(roles.sensors.len());
    let of_role = |role: SignalRole| wanted.iter().position(|(r, _)| *r == role).and_then(|i| series.get(i));
    let mut columns: Vec<Column> = Vec::new();
    for (index, ((role, located), signal)) in wanted.iter().zip(series).enumerate() {
        // What somebody wanted, or added on purpose, may well be nothing.
        if matches!(role, SignalRole::Dither | SignalRole::Intent | SignalRole::Command) {
            continue;
        }
        let sensor = index.checked_sub(named).and_then(|i| roles.sensors.get(i));
        let called = sensor.map_or(key_of(*role), |s| s.name.as_str());
        let name = if called == located.place() { called.to_owned() } else { format!("{called} ({})", located.place()) };
        // With several axes it is not stated of which one it is a second sensor.
        let twin = sensor.and_then(|s| s.of).filter(|_| roles.axes.len() == 1).and_then(|of| Some((key_of(of), of_role(of)?)));
        columns.push(Column {
            name,
            values: &signal.values,
            position: matches!(role, SignalRole::Master | SignalRole::Slave),
            twin: twin.map(|(name, of)| Twin { name, values: &of.values }),
        });
    }
    let bare = |heading: &str| heading.split_once('[').map_or(heading, |(name, _)| name).trim().to_owned();
    let taken = |name: &str| wanted.iter().any(|(_, l)| l.column.as_ref().is_some_and(|c| c == name || bare(c) == bare(name)));
    for (name, values) in others.iter().filter(|(name, _)| !taken(name)) {
        columns.push(Column { name: name.clone(), values, position: false, twin: None });
    }
    faults(&columns)
}
