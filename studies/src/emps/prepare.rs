//! The records as the diagnosis takes them: strokes between reversals.
//!
//! A position is differentiated twice on its way to a force, so that its noise needs a low-pass. The filter blurs the kink that dry friction makes at
//! a reversal, over some milliseconds, and a diagnosis would find that blur. So strokes are cut where it ends.

use crate::{StudyError, csv_columns};
use backdrive_signal::low_pass::LowPass;
use std::path::Path;

/// Sample rate of the records, Hz.
pub(super) const RATE: f64 = 1000.0;
/// Force of the motor per volt of its command, N/V; published.
pub(super) const GTAU: f64 = 35.15065188;
/// Low-pass of the position: order, Hz.
pub(super) const POSITION: (usize, f64) = (4, 100.0);
/// Samples that a filter spoils at the ends of a record.
const ENDS: usize = 50;
/// Samples on either side of a reversal that the low-pass of the position blurs.
const BLUR: usize = 8;
/// Samples of a stroke, at least.
const SHORTEST: usize = 200;
/// One in this number of samples is kept: the position holds nothing above the low-pass.
const THIN: usize = 2;

/// A record.
pub(super) struct Record {
    /// Commanded force, N.
    pub force: Vec<f64>,
    /// Position, m, low-passed.
    pub position: Vec<f64>,
    /// Position that was asked for, m.
    pub asked: Vec<f64>,
    /// Pulses added to the controller's voltage, as recorded.
    pub pulses: Vec<f64>,
}

impl Record {
    /// Reads a file of the benchmark.
    pub fn read(path: &Path) -> Result<Record, StudyError> {
        let mut columns = csv_columns::read_at_least(path, &["u_V", "q_m", "qref_m"], 20_000)?.into_iter();
        let mut next = || columns.next().unwrap_or_default();
        let (u, q, asked) = (next(), next(), next());
        // Only the record with the pulses has that column.
        let pulses = csv_columns::read(path, &["pulse_raw"]).ok().and_then(|c| c.into_iter().next()).unwrap_or_else(|| vec![0.0; u.len()]);
        Ok(Record::new(u.iter().map(|u| GTAU * u).collect(), &q, asked, pulses))
    }

    /// The same from samples.
    pub fn new(force: Vec<f64>, position: &[f64], asked: Vec<f64>, pulses: Vec<f64>) -> Record {
        let position = LowPass::butterworth(POSITION.0, POSITION.1, RATE).both_ways(position);
        Record { force, position, asked, pulses }
    }

    /// Where each stroke begins and ends, samples.
    fn strokes(&self) -> Vec<(usize, usize)> {
        let q = &self.position;
        let turns = (ENDS..q.len().saturating_sub(ENDS)).filter(|i| (q[i + 1] - q[*i]) * (q[*i] - q[i - 1]) <= 0.0);
        let ends = [ENDS, q.len().saturating_sub(ENDS)];
        let mut marks: Vec<(usize, usize)> = vec![(0, ends[0])];
        marks.extend(turns.map(|i| (i - BLUR, i + BLUR)));
        marks.push((ends[1], q.len()));
        marks.windows(2).map(|w| (w[0].1, w[1].0)).filter(|(a, b)| *b >= a + SHORTEST).collect()
    }

    /// Writes the record in one piece as `NAME.csv`, its ends left out: what the published numbers were fitted to, reversals and all.
    pub fn write_whole(&self, out: &Path, name: &str) -> Result<(), StudyError> {
        self.write_piece(out, &format!("{name}.csv"), ENDS, self.position.len().saturating_sub(ENDS))
    }

    /// Writes each stroke as `NAME-1.csv` and so on; the names.
    pub fn write_strokes(&self, out: &Path, name: &str) -> Result<Vec<String>, StudyError> {
        let mut names = Vec::new();
        for (from, to) in self.strokes() {
            let file = format!("{name}-{}.csv", names.len() + 1);
            self.write_piece(out, &file, from, to)?;
            names.push(file);
        }
        Ok(names)
    }

    fn write_piece(&self, out: &Path, file: &str, from: usize, to: usize) -> Result<(), StudyError> {
        let thin = |column: &[f64]| column[from..to].iter().step_by(THIN).copied().collect::<Vec<f64>>();
        let (position, force) = (thin(&self.position), thin(&self.force));
        let t: Vec<f64> = (0..position.len()).map(|i| (i * THIN) as f64 / RATE).collect();
        csv_columns::write(&out.join(file), &["t", "position", "force"], &[&t, &position, &force])
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn strokes_end_before_a_reversal_and_begin_after_it() {
        let q: Vec<f64> = (0..4000).map(|i| 0.1 * (std::f64::consts::TAU * i as f64 / 2000.0).cos()).collect();
        let record = Record::new(vec![0.0; 4000], &q, q.clone(), vec![0.0; 4000]);
        let strokes = record.strokes();
        assert_eq!(strokes.len(), 4);
        assert_eq!(strokes[0], (50, 1000 - BLUR));
        assert!(strokes[1].0.abs_diff(1000 + BLUR) <= 1, "{strokes:?}");
    }
}
