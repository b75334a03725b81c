//! Excerpts of recordings that show enough: where many structures are tried, each is simulated only where the residual is largest.
//!
//! A part is the recording's beginning where that shows enough. Other parts begin with the motion of the search's base model, firmly coupled to the
//! measured motion. Their first samples do not count, because laws with a memory begin without one.

use crate::output_error::coupling::Coupling;
use crate::output_error::evaluator::Evaluator;
use crate::output_error::fit::{Fit, dot};
use crate::output_error::simulate::{Conditions, motion_at};
use crate::output_error::structure::Structure;
use crate::recordings::problem::Record;
use crate::tuning::tuning;
use backdrive_plant::set::Initial;
use rayon::prelude::*;
use std::ops::Range;

/// Excerpts of recordings, ready to be simulated, and the coupling to them.
#[derive(Debug, Clone)]
pub struct Excerpts {
    /// The parts.
    pub records: Vec<Record>,
    /// The coupling of the evaluator that they were taken for.
    pub coupling: Option<Coupling>,
}

impl Excerpts {
    /// The part of each recording where a fit leaves most over, all together about so many samples. `None` where the recordings are no
    /// longer than that, or cannot be cut: they start freely, or have parameters of their own.
    pub fn of(evaluator: &Evaluator, structure: &Structure, fit: &Fit, samples: usize) -> Option<Excerpts> {
        let (problem, records) = (evaluator.problem, evaluator.records);
        let total: usize = records.iter().map(|r| r.len).sum();
        let own_numbers = problem.initial == Initial::Free || records.iter().any(|r| !r.conditions.is_empty());
        if total < samples + samples / 2 || own_numbers {
            return None;
        }
        let model = structure.model(problem, &fit.values)?;
        // Firmly coupled, so that a part begins with the measured motion, not with the motion of an incomplete model.
        let firm = evaluator.coupling.as_ref().map(|g| g.with(tuning().coupling.firm * g.strength));
        let layout = evaluator.layout();
        // No part can begin with a memory of what came before.
        let remembers = model.elements.iter().any(|e| e.law.memory_len() > 0);
        let ranges: Vec<Range<usize>> = records
            .iter()
            .enumerate()
            .map(|(r, record)| {
                let length = (record.len * samples / total).clamp(record.len.min(tuning().coupling.shortest), record.len);
                let columns: Vec<&[f64]> = layout.iter().filter(|l| l.0 == r).filter_map(|l| fit.residuals.get(l.2.clone())).collect();
                let stride = (length / 8).max(1);
                let energy = |from: usize| columns.iter().filter_map(|c| c.get(from..from + length)).map(|c| dot(c, c)).sum::<f64>();
                let from = (0..=record.len - length).step_by(stride).max_by(|a, b| energy(*a).total_cmp(&energy(*b))).unwrap_or(0);
                // Of the same number of samples, less the first that do not count.
                let early = remembers || energy(0) > (1.0 - tuning().coupling.transient) * energy(from) * tuning().coupling.beginning;
                if early { 0..length } else { from..from + length }
            })
            .collect();
        let seen = structure.with_unknown(problem, records, &fit.values);
        let cut = |(r, range): (usize, &Range<usize>)| {
            let begins = match range.start {
                0 => records[r].begins.clone(),
                at => motion_at(
                    &model,
                    &seen[r],
                    &Conditions {
                        starts: &[],
                        curves: &[],
                        substeps: evaluator.substeps,
                        coupling: firm.as_ref().map(|g| (g, r)),
                        budget: &evaluator.budget,
                    },
                    at,
                )?
                .into_iter()
                .chain(records[r].along_the_motion(problem.model.bodies.len(), &problem.model, at))
                .collect(),
            };
            let skip = if range.start == 0 { records[r].skip } else { (tuning().coupling.transient * range.len() as f64) as usize };
            Some(records[r].part(range.clone(), begins, skip))
        };
        let parts = ranges.par_iter().enumerate().map(cut).collect::<Vec<_>>().into_iter().collect::<Option<Vec<Record>>>()?;
        let of: Vec<(usize, Range<usize>, f64)> = ranges.into_iter().enumerate().map(|(r, range)| (r, range, records[r].period)).collect();
        Some(Excerpts { records: parts, coupling: evaluator.coupling.as_ref().map(|g| g.of_parts(&of)) })
    }

    /// An evaluator on these parts.
    pub fn evaluator<'a>(&'a self, of: &Evaluator<'a>) -> Evaluator<'a> {
        Evaluator { records: &self.records, coupling: self.coupling.clone(), ..of.clone() }
    }
}
