//! What is asked of a frequency response, and what it answers.

use super::delays::Delays;
use super::edge::{Edge, Loop};
use super::note::Note;
use super::rows::RowCount;
use super::swap::{ExchangedParts, PartError};
use crate::spectra::Averaging;
use serde::Serialize;

/// What to ask for.
#[derive(Debug, Clone, Copy)]
pub struct Options<'a> {
    /// Draws from which intervals are made.
    pub draws: usize,
    /// Of the draws: the same record gives the same answer.
    pub seed: u64,
    /// Parts to exchange.
    pub parts: ExchangedParts<'a>,
}

impl Default for Options<'_> {
    fn default() -> Self {
        Options { draws: 400, seed: 1, parts: ExchangedParts::default() }
    }
}

/// The frequency-domain answer of a session, for any gain: [`Frequency::at`].
#[derive(Debug, Clone, Serialize)]
pub struct Frequency {
    /// One estimate for each amplitude of the dither, and for each set of axes that touch.
    pub levels: Vec<LevelEstimate>,
    /// The stability limit from each recorded gain alone, where there are several.
    pub gains: Vec<GainEstimate>,
    /// The stability limit from all data: an interval over the amplitudes where it depends on them.
    pub edge: Edge,
    /// Stability limits at different amplitudes differ by more than their uncertainty: friction, hysteresis or backlash.
    pub amplitude_dependent: bool,
    /// Stability limits from different recorded gains differ by more than their uncertainty.
    pub gains_disagree: bool,
    /// Gains are multiples of the recorded one, because it was not recorded and the signals do not determine it.
    pub relative: bool,
    /// What delays the loop beside its devices.
    pub delays: Delays,
    /// Where each factor of the loop comes from.
    pub provenance: Provenance,
    /// Which rows were used, and why others were not.
    pub rows: RowCount,
    /// The method and its settings, for a reader.
    pub method: String,
    /// What a reader has to know.
    pub notes: Vec<Note>,
    /// Why there is no answer.
    pub cannot_tell: Option<CannotTell>,
    /// What to record for a better answer.
    pub advice: String,
}

/// Why the record gives no answer.
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
pub struct CannotTell {
    /// In a sentence.
    pub reason: String,
    /// What to record instead.
    pub advice: Option<String>,
}

/// `measured`, or `from model`.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
pub struct Provenance {
    /// The master, from F_f to x_m.
    pub master: &'static str,
    /// The canceller.
    pub canceller: &'static str,
    /// Slave and environment, from x_c to F_s.
    pub slave: &'static str,
}

/// The loop at one amplitude of the dither.
#[derive(Debug, Clone, Serialize)]
pub struct LevelEstimate {
    /// RMS of the dither, root of the sum over the axes, N or N m; 0 where the operator shook it.
    pub amplitude_rms: f64,
    /// Which axes touched.
    pub contact: Vec<bool>,
    /// Rows used.
    pub rows: usize,
    /// Segments, window, averages.
    pub averaging: Averaging,
    /// The lines, Hz.
    pub hz: Vec<f64>,
    /// Each axis, the loops of the others open.
    pub axes: Vec<AxisEstimate>,
    /// Loci of the eigenvalues of the loop per unit gain at the lines with information; of one axis its `l`. `[re, im]`.
    pub loci: Vec<Vec<[f64; 2]>>,
    /// The lines of the loci, Hz.
    pub loci_hz: Vec<f64>,
    /// Stability limit of all loops together.
    pub edge: Edge,
    #[serde(skip)]
    pub(super) measured: Loop,
}

/// One axis of a level.
#[derive(Debug, Clone, Serialize)]
pub struct AxisEstimate {
    /// Name of the axis.
    pub name: String,
    /// Loop per unit of mu*lambda, `[re, im]`, at each line.
    pub l: Vec<[f64; 2]>,
    /// Standard deviation of each component of `l`.
    pub sigma: Vec<f64>,
    /// Whether `l` stands out of its uncertainty: `|l|` at least 4 sigma.
    pub told: Vec<bool>,
    /// Coherence of the dither with the reflected force.
    pub coherence: Vec<f64>,
    /// G_f, from F_f to x_m, m/N or rad/(N m).
    pub g_f: Response,
    /// From F_f to x_c over mu: G_f less what was cancelled.
    pub motion: Response,
    /// H_se, from x_c to F_s, N/m or N m/rad.
    pub h_se: Response,
    /// Stability limit of this loop alone.
    pub edge: Edge,
}

/// A response at the lines of its level; NaN where it has none.
#[derive(Debug, Clone, Default, Serialize)]
pub struct Response {
    /// `[re, im]`.
    pub value: Vec<[f64; 2]>,
    /// Standard deviation of each component.
    pub sigma: Vec<f64>,
}

/// The stability limit from one recorded gain.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct GainEstimate {
    /// Position scale.
    pub mu: f64,
    /// Force scale.
    pub lambda: f64,
    /// Rows used.
    pub rows: usize,
    /// What they say.
    pub edge: Edge,
}

/// Why a session cannot be analysed at all.
#[derive(Debug, thiserror::Error)]
pub enum FrequencyError {
    /// It has no rows, or columns of different length.
    #[error("the session \"{0}\" has no rows, or columns of different length")]
    Shape(String),
    /// A part cannot be exchanged.
    #[error(transparent)]
    Part(#[from] PartError),
}
