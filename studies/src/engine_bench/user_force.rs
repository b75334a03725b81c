//! The same observer on masters: the force of a user's hand without a force sensor.

use crate::error::failed;
use crate::table::Report;
use crate::{Context, StudyError};
use backdrive_bags::{Reader, Signal, signals};
use backdrive_nodes::graph::{Graph, Overrides};
use backdrive_signal::statistics::{correlation, rms};
use std::path::Path;

/// The observer's estimates of a master.
pub struct Reported {
    /// The master.
    pub name: &'static str,
    /// s.
    pub time: Vec<f64>,
    /// The hand's force in the simulation, N.
    pub truth: Vec<f64>,
    /// As estimated, behind the filter, N.
    pub estimate: Vec<f64>,
    /// Root mean square error, N, and over the largest force, no unit.
    pub error: [f64; 2],
    /// Correlation.
    pub correlation: f64,
}

/// The contact task of `launch/user-force.toml` on a linear master and on the whole one, whose friction the observer's model lacks.
///
/// # Errors
/// When a run fails.
pub fn run(context: &Context) -> Result<Vec<Reported>, StudyError> {
    let file = |path: &str| Path::new(env!("CARGO_MANIFEST_DIR")).join("..").join(path);
    [
        ("linear master", "plant/models/impulse-engine-linear.toml"),
        ("master with friction and hysteresis", "plant/models/impulse-engine.toml"),
    ]
    .into_iter()
    .map(|(name, master)| {
        let stem = name.split(' ').next().unwrap_or("master");
        let bag = context.out.join(format!("user-force-{stem}.mcap"));
        let bag = if bag.is_absolute() { bag } else { std::env::current_dir().unwrap_or_default().join(bag) };
        let changes = Overrides { master: Some(file(master)), bag: Some(bag.clone()), ..Overrides::default() };
        let graph = Graph::load(&file("launch/user-force.toml"), &changes)?;
        backdrive_runs::way::run_here(&graph, &backdrive_runs::Silent, &mut |_, _| {})?;
        let reader = Reader::open(&bag).map_err(failed)?;
        let wanted = [Signal::new("truth", "/master/user_js", "effort[0]"), Signal::new("estimate", "/observer/filtered_js", "effort[0]")];
        let found = signals(&reader, &wanted).map_err(failed)?;
        let [truth, estimate]: [Vec<f64>; 2] = found.columns.try_into().map_err(|_| failed("a bag without its two columns"))?;
        let most = truth.iter().fold(0.0_f64, |most, f| most.max(f.abs()));
        let error = rms(truth.iter().zip(&estimate).map(|(a, b)| a - b));
        let correlation = correlation(&truth, &estimate);
        Ok(Reported { name, time: found.t, truth, estimate, error: [error, error / most], correlation })
    })
    .collect()
}

/// Its lines of the table.
pub fn table(report: &mut Report, told: &[Reported]) {
    for one in told {
        let text = format!(
            "{:.3} N rms, {:.1} % of the largest, correlation {:.1} %",
            one.error[0],
            100.0 * one.error[1],
            100.0 * one.correlation
        );
        report.line(
            &format!("hand's force, {}", one.name),
            text,
            "",
            "launch/user-force.toml, no force sensor",
            Some(one.correlation > 0.93),
        );
        report.figure(&format!("hand's force, {}", one.name), one.error[0]);
    }
}
