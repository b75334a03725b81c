//! What first steps of fits are held against: beginnings of the recordings that are explained worst, as many samples as it takes to rank structures.

use crate::output_error::evaluator::Evaluator;
use crate::output_error::fit::{Fit, dot};
use crate::recordings::problem::{Problem, Record};
use crate::search::screen::worst_records;
use crate::tuning::tuning;
use backdrive_plant::set::Initial;

/// Beginnings of some recordings: which, and how many samples of each.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(crate) struct Beginnings {
    shown: Vec<(usize, usize)>,
}

impl Beginnings {
    /// Beginnings of the two recordings with the largest of these residuals. Each is long enough that its residual per sample is as large as in the whole
    /// recording, or nearly. Where parameters belong to single recordings, or to their ends, all recordings in full.
    pub fn of_the_worst(evaluator: &Evaluator, residuals: &[f64]) -> Beginnings {
        let whole = |r: usize| (r, evaluator.records.get(r).map_or(0, |record| record.len));
        if !can_be_cut(evaluator.problem) {
            return Beginnings { shown: (0..evaluator.records.len()).map(whole).collect() };
        }
        let worst = worst_records(evaluator, residuals, 2);
        let least = tuning().search.first_samples / worst.len().max(1);
        let shown = worst.into_iter().map(|r| (r, enough(evaluator, residuals, r, least))).collect();
        Beginnings { shown }
    }

    /// They as recordings.
    pub fn records(&self, evaluator: &Evaluator) -> Vec<Record> {
        let part = |(r, len): &(usize, usize)| {
            let record = evaluator.records.get(*r)?;
            Some(if *len < record.len { record.part(0..*len, record.begins.clone(), record.skip) } else { record.clone() })
        };
        self.shown.iter().filter_map(part).collect()
    }

    /// A fit's residuals and derivatives there.
    pub fn restricted(&self, evaluator: &Evaluator, fit: &Fit) -> Fit {
        let layout = evaluator.layout();
        let pick = |all: &Vec<f64>| -> Vec<f64> {
            let parts =
                self.shown.iter().flat_map(|(r, len)| layout.iter().filter(move |l| l.0 == *r).map(move |l| l.2.start..l.2.start + len));
            parts.filter_map(|range| all.get(range)).flatten().copied().collect()
        };
        Fit { residuals: pick(&fit.residuals), jacobian: fit.jacobian.iter().map(pick).collect(), ..fit.clone() }
    }
}

/// Whether first steps may be taken on some of the recordings only: nothing belongs to single ones.
fn can_be_cut(problem: &Problem) -> bool {
    problem.initial != Initial::Free && problem.unknown.is_empty() && problem.fit.iter().all(|r| r.conditions.is_empty())
}

/// Samples of a recording from its beginning, `least` or more by doubling, until their mean square residual is near that of the whole.
fn enough(evaluator: &Evaluator, residuals: &[f64], r: usize, least: usize) -> usize {
    let Some(record) = evaluator.records.get(r) else { return 0 };
    let layout = evaluator.layout();
    let square_up_to = |len: usize| -> f64 {
        let ranges = layout.iter().filter(|l| l.0 == r).map(|l| l.2.start..l.2.start + len);
        ranges.filter_map(|range| residuals.get(range)).map(|part| dot(part, part)).sum::<f64>() / len.max(1) as f64
    };
    let wanted = tuning().search.first_share * square_up_to(record.len);
    let mut len = least.max(1);
    while len < record.len && square_up_to(len) < wanted {
        len *= 2;
    }
    // A beginning that is nearly all of it saves nothing.
    if 4 * len > 3 * record.len { record.len } else { len }
}

#[cfg(test)]
mod tests {
    use super::*;
    use backdrive_plant::model::Model;
    use backdrive_plant::recording::Recording;

    #[test]
    fn a_beginning_holds_as_much_residual_per_sample_as_the_whole_or_half_of_it() {
        let text = "name = 'cart'\n[bodies]\ncart = 2.0\n[[inputs]]\nname = 'f'\nkind = 'force'\non = 'cart'\n\
                    [[outputs]]\nname = 'v'\nkind = 'velocity'\nof = 'cart'\n";
        let model = Model::from_toml(text, "cart.toml").unwrap();
        let record = |samples: usize| {
            let t: Vec<f64> = (0..samples).map(|i| 1e-3 * i as f64).collect();
            let signals = vec![("f".to_string(), t.iter().map(|t| t.sin()).collect()), ("v".to_string(), t.clone())];
            Record::new(&Recording::new("r", t, signals).unwrap(), &model, Vec::new()).unwrap()
        };
        let of = |lengths: &[usize]| {
            let fit: Vec<Record> = lengths.iter().map(|n| record(*n)).collect();
            Problem::new(text.to_string(), "cart.toml".into(), model.clone(), fit, Vec::new(), Initial::Rest).unwrap()
        };
        let first = tuning().search.first_samples;
        // Even residuals: as many as first steps take, over the two worst recordings.
        let problem = of(&[4 * first, 100, 4 * first]);
        let evaluator = Evaluator::new(&problem);
        let even = vec![1.0; evaluator.len()];
        let shown = Beginnings::of_the_worst(&evaluator, &even);
        assert_eq!(shown.shown, [(0, first / 2), (2, first / 2)]);
        // What shows late only has to be seen.
        let mut late = vec![0.1; evaluator.len()];
        late[3 * first..4 * first].fill(10.0);
        let shown = Beginnings::of_the_worst(&evaluator, &late);
        assert_eq!(shown.shown, [(0, 4 * first), (2, first / 2)]);
        // A fit's residuals there.
        let numbered = Fit {
            values: Vec::new(),
            cost: 0.0,
            residuals: (0..evaluator.len()).map(|i| i as f64).collect(),
            jacobian: Vec::new(),
            predicted_decrease: 0.0,
            steps: 0,
        };
        let there = shown.restricted(&evaluator, &numbered).residuals;
        assert_eq!(there.len(), shown.records(&evaluator).iter().map(|r| r.len).sum::<usize>());
        assert_eq!((there[0], there[4 * first]), (0.0, (4 * first + 100) as f64));
    }
}
