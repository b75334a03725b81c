//! Static maps from stationary points.

use crate::record::{BenchError, Record};
use backdrive_control::engine::Grid;
use backdrive_signal::statistics::mean;

/// A stretch over which pedal and wanted speed did not change.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Plateau {
    /// Pedal, 0 to 1.
    pub pedal: f64,
    /// Wanted speed, rad/s.
    pub speed: f64,
    /// First step of what is averaged, and the step after its last.
    pub steps: [usize; 2],
}

/// The plateaus of at least `least_s`; of each only the last third counts as stationary.
pub fn plateaus(record: &Record, least_s: f64) -> Vec<Plateau> {
    let least = (least_s / record.period_s) as usize;
    let (mut found, mut start) = (Vec::new(), 0);
    let same = |a: usize, b: usize| record.pedal[a] == record.pedal[b] && (record.setpoint[a] - record.setpoint[b]).abs() < 1e-9;
    for k in 1..=record.len() {
        if k < record.len() && same(k, start) {
            continue;
        }
        if k - start >= least {
            found.push(Plateau { pedal: record.pedal[start], speed: record.setpoint[start], steps: [k - (k - start) / 3, k] });
        }
        start = k;
    }
    found
}

/// The engine's static map: at a stationary point the shaft carries the engine's torque. A row of zeros at rest is added, where nothing burns.
///
/// # Errors
/// When the points do not make a grid.
pub fn engine_map(record: &Record, least_s: f64) -> Result<Grid, BenchError> {
    let points = plateaus(record, least_s);
    let mut pedals: Vec<f64> = points.iter().map(|p| p.pedal).collect();
    let mut speeds: Vec<f64> = points.iter().map(|p| p.speed).collect();
    for axis in [&mut pedals, &mut speeds] {
        axis.sort_by(f64::total_cmp);
        axis.dedup_by(|a, b| (*a - *b).abs() < 1e-9);
    }
    if pedals.len() < 2 {
        let what = "stationary points at one pedal only, or none; record several pedals at several speeds".to_string();
        return Err(BenchError::Poor { step: "static map of the engine", what });
    }
    let mut values = vec![0.0; pedals.len()];
    for speed in &speeds {
        for pedal in &pedals {
            let at: Vec<f64> = points
                .iter()
                .filter(|p| (p.pedal - pedal).abs() < 1e-9 && (p.speed - speed).abs() < 1e-9)
                .map(|p| mean(&record.shaft_torque[p.steps[0]..p.steps[1]]))
                .collect();
            if at.is_empty() {
                let what = format!("no stationary point at pedal {:.0} %, {speed} rad/s; record every pedal at every speed", 100.0 * pedal);
                return Err(BenchError::Poor { step: "static map of the engine", what });
            }
            values.push(mean(&at));
        }
    }
    speeds.insert(0, 0.0);
    Grid::new(pedals, speeds, values).map_err(|e| BenchError::Poor { step: "static map of the engine", what: e.to_string() })
}

/// The dynamometer's static map (wanted, given), N m: means at stationary points, least squares on lines between five knots.
///
/// # Errors
/// When there are fewer than five stationary points.
pub fn dynamometer_map(record: &Record, least_s: f64) -> Result<Vec<[f64; 2]>, BenchError> {
    let points: Vec<[f64; 2]> = plateaus(record, least_s)
        .iter()
        .map(|p| [&record.command, &record.torque].map(|column| mean(&column[p.steps[0]..p.steps[1]])))
        .collect();
    if points.len() < 5 {
        let what = format!("{} stationary points are too few; record at least five torques", points.len());
        return Err(BenchError::Poor { step: "static map of the dynamometer", what });
    }
    let extreme = |pick: fn(f64, f64) -> f64, start: f64| points.iter().map(|p| p[0]).fold(start, pick);
    let (low, high) = (extreme(f64::min, f64::INFINITY), extreme(f64::max, f64::NEG_INFINITY));
    let knots: Vec<f64> = if low < 0.0 && high > 0.0 { vec![low, 0.5 * low, 0.0, high] } else { vec![low, 0.5 * (low + high), high] };
    let hat = |knot: usize, x: f64| {
        let side = |other: Option<&f64>| other.map_or(0.0, |o| (1.0 - (x - knots[knot]) / (o - knots[knot])).clamp(0.0, 1.0));
        if x < knots[knot] {
            side(knot.checked_sub(1).map(|k| &knots[k]))
        } else if x == knots[knot] {
            1.0
        } else {
            side(knots.get(knot + 1))
        }
    };
    let rows = nalgebra::DMatrix::from_fn(points.len(), knots.len(), |i, j| hat(j, points[i][0]));
    let given = nalgebra::DVector::from_iterator(points.len(), points.iter().map(|p| p[1]));
    let solved = rows.svd(true, true).solve(&given, 1e-9);
    let values = solved.map_err(|e| BenchError::Poor { step: "static map of the dynamometer", what: e.to_string() })?;
    Ok(knots.into_iter().zip(values.iter()).map(|(k, v)| [k, *v]).collect())
}
