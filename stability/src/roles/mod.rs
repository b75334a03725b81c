//! Other people's recordings: a roles file assigns a signal to a field of a topic, or to a column of a table.
//!
//! ```toml
//! axes = ["x"]                         # names; optional
//!
//! [signals]                            # "TOPIC.FIELD", or a table; for several axes a list of either
//! x_m = "/omega/joint_states.position[0]"
//! F_f = { topic = "/omega/wrench_cmd", field = "wrench.force.x", scale = -1.0 }
//! x_c = "/slave/target.data"
//! F_s = { topic = "/ft_sensor", field = "wrench.force.z", offset = 0.12 }
//! x_s = "/slave/pose.pose.position.x"  # optional, as are dither and operator
//!
//! [gains]                              # optional: estimated from the signals where absent
//! mu = 1.0
//! lambda = 0.3
//!
//! [resample]                           # optional: the rate of the most frequent signal where absent
//! rate_hz = 1000
//! ```
//!
//! For a table (CSV) columns are named instead of topics: `x_m = "master_position"`, or `{ column = "...", scale = -1.0 }`. Where the slave has a
//! motor of its own (`tau_s`, with `x_s`) the law that couples the two motors is identified, and `x_c` may be omitted.
//!
//! `docs/roles-example.toml` has every key with its meaning. Any ROS 2 type can be read whose ros2msg schema is in the bag. Positions
//! are interpolated linearly between their samples; forces hold the last one, as a servo does (`hold` in a table changes either).

mod clock;
mod faulty;
mod file;
mod gains;
mod gather;
mod table;

pub use file::{AxisRoles, Roles};

use crate::grid::{Grid, Ordered, step_of};
use crate::session::{AxisSignals, Session};
use crate::signal_role::{SessionError, SignalRole};
use crate::unjudged::{BRIDGED_S, Unjudged};
use clock::{ends_apart, note_resampled, on_one_clock};
use faulty::faulty;
use file::{Located, is_required};
use gains::{check_signs, settle_gains};
use gather::gather;
use std::path::Path;

impl Session {
    /// Reads somebody else's recording: one `.mcap`, a rosbag2 folder, or a table (`.csv`).
    ///
    /// The signals are put on one grid of rows over the time that x_m, F_f, x_c and F_s have in common. What was done to them, and what
    /// looks wrong with signs, clocks or gains, is in the notes.
    ///
    /// # Errors
    /// A storage that is not read, a damaged bag, a topic or field that is not there (at its line of the roles file), signals
    /// that have no time in common.
    pub fn from_roles(path: &Path, roles: &Roles) -> Result<Session, SessionError> {
        let wrong = |what: String| SessionError::Rows { path: path.to_owned(), what };
        let wanted: Vec<(SignalRole, &Located)> = roles.axes.iter().flat_map(|a| a.signals.iter().map(|(r, l)| (*r, l))).collect();
        let extra: Vec<(SignalRole, &Located)> = roles.sensors.iter().map(|s| (SignalRole::Sensor, &s.located)).collect();
        let everything = [wanted.clone(), extra].concat();
        let (mut series, closed, others) = if table::is_table(path) {
            let (series, columns) = table::gather(path, roles, &everything)?;
            (series, true, columns)
        } else {
            let (series, closed) = gather(path, roles, &everything)?;
            (series, closed, Vec::new())
        };
        let sensors = faulty(roles, &everything, &series, &others);
        series.truncate(wanted.len());
        let mut notes = Vec::new();
        let ordered = on_one_clock(&wanted, &series, &mut notes);

        let needed: Vec<&Ordered> = wanted.iter().zip(&ordered).filter(|((role, _), _)| is_required(*role)).map(|(_, o)| o).collect();
        for ((role, located), o) in wanted.iter().zip(&ordered) {
            if is_required(*role) && o.times.is_empty() {
                return Err(roles.at(located, format!("{} was never measured; without it {}", located.place(), role.without())));
            }
        }
        let grid = Grid::over(&needed, roles.rate_hz).map_err(wrong)?;
        let period_s = grid.period * 1e-9;
        let cut_short = if closed { ends_apart(&needed, &grid) } else { Some(Unjudged::NotClosed) };
        notes.push(format!("{} rows at {:.6} Hz; {}", grid.rows, 1.0 / period_s, rate_source(roles)));

        let mut axes = Vec::new();
        let mut next = 0;
        for told in &roles.axes {
            let mut axis =
                AxisSignals { name: told.name.clone(), clamped: vec![false; grid.rows], unit: told.unit, ..AxisSignals::default() };
            for (role, located) in &told.signals {
                let Some(signal) = ordered.get(next) else { break };
                next += 1;
                let laid = signal.on(&grid, located.signal.hold);
                note_resampled(located, signal, &laid, &grid, &mut notes);
                if *role == SignalRole::Master {
                    axis.resolution = step_of(&signal.values);
                }
                put(&mut axis, *role, laid.values);
            }
            if axis.resolution > 0.0 {
                notes.push(format!("axis {}: x_m has a resolution of {:.3e}", axis.name, axis.resolution));
            }
            if axis.command.is_empty() {
                // The slave follows the master itself.
                let mu = roles.mu.unwrap_or(1.0);
                axis.command = axis.master.iter().map(|x| mu * x).collect();
                notes.push(format!("axis {}: no position command of the slave was recorded; x_c is assumed to be {mu} x_m", axis.name));
            }
            axes.push(axis);
        }
        let mut session = Session {
            name: path.display().to_string(),
            period_s,
            axes,
            mu: Vec::new(),
            lambda: Vec::new(),
            notes,
            sensors,
            cut_short,
            parts: Vec::new(),
            elsewhere: None,
            bridged_s: BRIDGED_S,
        };
        settle_gains(&mut session, roles);
        check_signs(&mut session);
        Ok(session)
    }
}

fn rate_source(roles: &Roles) -> &'static str {
    if roles.rate_hz.is_some() { "the rate is given in the roles file" } else { "the rate is that of the most frequent signal" }
}

fn put(axis: &mut AxisSignals, role: SignalRole, values: Vec<f64>) {
    match role {
        SignalRole::Master => axis.master = values,
        SignalRole::Force => axis.force = values,
        SignalRole::Command => axis.command = values,
        SignalRole::Contact => axis.contact = values,
        SignalRole::Slave => axis.slave = Some(values),
        SignalRole::Dither => axis.dither = Some(values),
        SignalRole::Intent => axis.intent = Some(values),
        SignalRole::Induced => axis.induced = Some(values),
        SignalRole::SlaveForce => axis.slave_force = Some(values),
        SignalRole::Hand => axis.hand = Some(values),
        SignalRole::Sensor => {}
    }
}
