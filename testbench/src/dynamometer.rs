//! The dynamometer's linear part by output error.

use crate::fit::positive;
use crate::record::{BenchError, Record};
use backdrive_control::dynamometer::{Dynamometer, DynamometerModel};

/// Longest delay that is tried, s.
const LONGEST_DELAY_S: f64 = 0.02;

/// The torque that a machine gives under the commands of a record, N m, one value per step.
pub fn torque_of(model: &DynamometerModel, record: &Record) -> Vec<f64> {
    let mut machine = Dynamometer::new(model.clone(), record.period_s);
    record.command.iter().zip(&record.dyno_speed).map(|(wanted, speed)| machine.step(*wanted, *speed).0).collect()
}

/// The linear system of second order behind a static map whose simulated torque is nearest to the converter's estimate. For every delay of whole
/// periods up to 20 ms, natural frequency, damping ratio and the map's last slope are fitted; the best delay is kept. Stationary points hardly reach
/// the dragging side of the map, where this record is excited; so its slope is fitted here.
///
/// # Errors
/// When no fit converges: the record does not excite the machine.
pub fn linear_part(record: &Record, map: Vec<[f64; 2]>, power: f64) -> Result<DynamometerModel, BenchError> {
    let model = |values: &[f64], delay: usize| {
        let mut map = map.clone();
        if let [.., before, last] = map.as_mut_slice() {
            last[1] = before[1] + values[2] * (last[1] - before[1]);
        }
        DynamometerModel { map, frequency_hz: values[0], damping_ratio: values[1], delay_s: delay as f64 * record.period_s, power }
    };
    let error = |values: &[f64], delay: usize| -> Vec<f64> {
        torque_of(&model(values, delay), record).iter().zip(&record.torque).map(|(a, b)| a - b).collect()
    };
    let fitted = |delay: usize, start: &[f64]| positive(start, 20, |v| error(v, delay)).map(|f| (f.rms, delay, f.values));
    let most = (LONGEST_DELAY_S / record.period_s) as usize;
    // Coarsely, then every delay about the best one.
    let mut best = (0..=most).step_by(4).filter_map(|d| fitted(d, &[10.0, 0.7, 1.0])).min_by(|a, b| a.0.total_cmp(&b.0));
    if let Some((_, about, start)) = best.clone() {
        let near = (about.saturating_sub(3)..=about + 3).filter(|d| *d != about).filter_map(|d| fitted(d, &start));
        best = near.chain(best).min_by(|a, b| a.0.total_cmp(&b.0));
    }
    let (_, delay, values) = best.ok_or(BenchError::Poor {
        step: "linear part of the dynamometer",
        what: "its torque does not follow the commands; record it under an excitation".to_string(),
    })?;
    Ok(model(&values, delay))
}
