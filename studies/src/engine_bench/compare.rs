//! The observer beside an extended Kalman filter, a derivative, and the engine model alone.

use crate::table::Report;
use backdrive_control::engine::Engine;
use backdrive_control::observer::{Derivative, ExtendedKalman};
use backdrive_signal::butterworth::Butterworth;
use backdrive_signal::statistics::{correlation, rms};
use backdrive_testbench::lag::{Observation, engine_torque};
use backdrive_testbench::{Bench, BenchError, Record};

/// Corner of the Butterworth filter behind observer and derivative, Hz: the graph's.
const CORNER_HZ: f64 = 5.0;
/// Start that is left out, s: the bench speeds up from rest.
const START_S: f64 = 4.0;

/// One estimate of the engine's torque.
pub struct Estimate {
    /// How it came about.
    pub name: &'static str,
    /// N m, one value per step.
    pub torque: Vec<f64>,
    /// Root mean square error against the torque without ripple, N m.
    pub error: f64,
    /// The same over the largest torque, no unit.
    pub share: f64,
    /// Correlation with it.
    pub correlation: f64,
    /// By how much it is late, s: the shift at which its error is least.
    pub late_s: f64,
}

/// All estimates on one record.
pub struct Comparison {
    /// The torque without ripple, N m.
    pub truth: Vec<f64>,
    /// In the order of the table.
    pub estimates: Vec<Estimate>,
}

/// How the Kalman filter is tuned: what the map's error walks by in a second, N m, and the torque's own disturbance, N m per root s.
#[derive(Debug, Clone, Copy)]
pub struct Tuning {
    walk: f64,
    ripple: f64,
}

impl Tuning {
    /// The best of a grid on a record whose engine is known: an advantage that the observer does not get.
    pub fn best(bench: &Bench, observation: &Observation, record: &Record, truth: &Engine) -> Tuning {
        let truth = engine_torque(truth, record);
        let start = ((START_S / record.period_s) as usize).min(record.len());
        let grid = [1.0, 5.0, 25.0, 125.0].into_iter().flat_map(|walk| [0.5, 2.0, 8.0, 32.0].map(|ripple| Tuning { walk, ripple }));
        let error = |tuning: &Tuning| {
            let found = tuning.torque(bench, observation, record);
            rms(found[start..].iter().zip(&truth[start..]).map(|(a, b)| a - b))
        };
        let told = grid.map(|tuning| (error(&tuning), tuning)).min_by(|a, b| a.0.total_cmp(&b.0));
        told.map_or(Tuning { walk: 5.0, ripple: 2.0 }, |t| t.1)
    }

    fn torque(&self, bench: &Bench, observation: &Observation, record: &Record) -> Vec<f64> {
        let mut kalman =
            ExtendedKalman::new(bench.shaft, bench.engine.clone(), observation.noise[0], self.walk, self.ripple, record.period_s);
        let before = |column: &[f64], k: usize| if k == 0 { 0.0 } else { column[k - 1] };
        let speeds = |k: usize| [record.engine_speed[k], record.dyno_speed[k]];
        (0..record.len()).map(|k| kalman.step(before(&record.torque, k), before(&record.pedal, k), speeds(k))).collect()
    }
}

/// The estimates on a record whose engine is known.
///
/// # Errors
/// When the observer has no gains.
pub fn compare(bench: &Bench, observation: &Observation, record: &Record, truth: &Engine, tuned: Tuning) -> Result<Comparison, BenchError> {
    // The node computes its torque from the measured speed: this is it, ripple left out.
    let truth = engine_torque(truth, record);
    let shaft = bench.shaft;
    let observed = observation.torque(&shaft, record)?;
    let mut filter = Butterworth::new(2, CORNER_HZ, record.period_s);
    let filtered = observed.iter().map(|t| filter.step(*t)).collect();
    let each = |step: &mut dyn FnMut(f64, [f64; 2], usize) -> f64| -> Vec<f64> {
        let known = |k: usize| if k == 0 { 0.0 } else { record.torque[k - 1] };
        (0..record.len()).map(|k| step(known(k), [record.engine_speed[k], record.dyno_speed[k]], k)).collect()
    };
    let extended = tuned.torque(bench, observation, record);
    let mut plain = Derivative::new([shaft.engine, shaft.dynamometer], 2, CORNER_HZ, record.period_s);
    let derived = each(&mut |torque, speeds, _| plain.step(torque, speeds));
    let mut raw = Derivative::new([shaft.engine, shaft.dynamometer], 2, 0.0, record.period_s);
    let unfiltered = each(&mut |torque, speeds, _| raw.step(torque, speeds));
    let model = engine_torque(&bench.engine, record);
    let estimates = [
        ("observer", observed),
        ("observer and Butterworth, 5 Hz", filtered),
        ("extended Kalman filter with the engine's model", extended),
        ("derivative", unfiltered),
        ("derivative and Butterworth, 5 Hz", derived),
        ("engine model alone", model),
    ];
    let start = ((START_S / record.period_s) as usize).min(record.len());
    let most = truth.iter().fold(0.0_f64, |most, t| most.max(t.abs()));
    let estimates = estimates.into_iter().map(|(name, torque)| {
        let error = |late: usize| {
            let pairs = torque[start + late..].iter().zip(&truth[start..]);
            rms(pairs.map(|(a, b)| a - b))
        };
        let late = (0..300).step_by(2).min_by(|a, b| error(*a).total_cmp(&error(*b))).unwrap_or(0);
        let correlation = correlation(&torque[start..], &truth[start..]);
        Estimate { name, error: error(0), share: error(0) / most, correlation, late_s: late as f64 * record.period_s, torque }
    });
    Ok(Comparison { estimates: estimates.collect(), truth })
}

/// The table, over all benches.
pub fn table(report: &mut Report, told: &[&Comparison]) {
    let Some(first) = told.first() else { return };
    for (index, estimate) in first.estimates.iter().enumerate() {
        let of = |pick: &dyn Fn(&Estimate) -> String| {
            told.iter().filter_map(|t| t.estimates.get(index)).map(pick).collect::<Vec<_>>().join(", ")
        };
        let text = format!(
            "{} N m rms, correlation {} %, late by {} ms",
            of(&|e| format!("{:.1}", e.error)),
            of(&|e| format!("{:.2}", 100.0 * e.correlation)),
            of(&|e| format!("{:.0}", 1e3 * e.late_s))
        );
        report.line(&format!("T_C by {}", estimate.name), text, "", "against the simulated torque without ripple", None);
        let worst = told.iter().filter_map(|t| t.estimates.get(index)).map(|e| e.error).fold(0.0, f64::max);
        report.figure(&format!("error of {}", estimate.name), worst);
    }
}
