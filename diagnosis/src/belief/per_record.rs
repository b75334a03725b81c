//! The same structure fitted to each record by itself. A device has one set of parameters, so parameters that differ from record to record by more than
//! their errors indicate a wrong structure.

use crate::belief::intervals::Uncertainty;
use crate::belief::parameters::name_of;
use crate::output_error::candidate::{Candidate, candidate};
use crate::output_error::evaluator::Evaluator;
use crate::output_error::structure::{Role, Structure};
use crate::output_error::work::Budget;
use crate::recordings::problem::{Problem, Record};
use crate::tuning::tuning;
use serde::Serialize;
use statrs::distribution::{ChiSquared, ContinuousCDF};

/// A parameter as estimated from one record alone.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Own {
    /// As fitted.
    pub value: f64,
    /// 95 % interval.
    pub ci95: [f64; 2],
    /// Whether this record by itself carries information on it.
    pub determined: bool,
}

/// A parameter in every record.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Across {
    /// Path in the model; of an added effect its id and key.
    pub name: String,
    /// One for each record of [`PerRecord::records`].
    pub own: Vec<Own>,
    /// Weighted sum of squared distances from the common value, in standard deviations.
    pub chi_square: f64,
    /// Probability of so large a sum where all records have the same value; 1 where fewer than two determine it.
    pub p_value: f64,
}

/// Fits of every record by itself.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct PerRecord {
    /// The records, in order; those whose fit failed are left out.
    pub records: Vec<String>,
    /// Root mean square of the residual of each record's own fit at each output, noise standard deviations.
    pub levels: Vec<Vec<f64>>,
    /// Every parameter that all records share.
    pub numbers: Vec<Across>,
}

/// Fits the structure of `joint` to each record by itself, from the joint values on. `noise_sd` is the measuring error of each output, in
/// its unit. Fits end early once the budget is used up.
pub fn fit_each<'a>(problem: &'a Problem, joint: &Candidate, noise_sd: &[f64], budget: &Budget<'a>) -> PerRecord {
    let stated = joint.structure.stated_of(problem, &joint.fit.values);
    let added = joint.structure.added_of(&joint.fit.values);
    let own = joint.structure.of_records(&joint.fit.values);
    let one = |budget: &Budget<'a>, (index, record): &(usize, &'a Record)| -> Option<(String, Candidate, Uncertainty)> {
        let records = std::slice::from_ref(*record);
        let mut evaluator = Evaluator::on(problem, records);
        (evaluator.noise_sd, evaluator.budget) = (noise_sd.to_vec(), budget.clone());
        let structure = Structure::new(problem, records, joint.structure.added.clone());
        let here: Vec<(Role, f64)> =
            own.iter().filter(|(role, _)| role.in_record(*index) == *role).map(|(role, value)| (role.in_record(0), *value)).collect();
        let start = structure.values(problem, &stated, &added, &here);
        let fit = evaluator.fit(&structure, &start, tuning().fit.to_the_end)?;
        let candidate = candidate(&evaluator, structure, fit);
        let spread = Uncertainty::of(&candidate);
        Some((record.name.clone(), candidate, spread))
    };
    let records: Vec<(usize, &'a Record)> = problem.fit.iter().enumerate().collect();
    let fits: Vec<_> = budget.abreast(&records, one).into_iter().flatten().flatten().collect();
    let shared = joint.structure.free.iter().enumerate().filter(|(_, n)| matches!(n.role, Role::Stated(_) | Role::Added(..)));
    let numbers = shared.filter_map(|(index, number)| across(problem, joint, index, &number.role, &fits)).collect();
    PerRecord { records: fits.iter().map(|f| f.0.clone()).collect(), levels: fits.iter().map(|f| f.1.levels.clone()).collect(), numbers }
}

fn across(problem: &Problem, joint: &Candidate, index: usize, role: &Role, fits: &[(String, Candidate, Uncertainty)]) -> Option<Across> {
    let mut own = Vec::new();
    let mut points: Vec<(f64, f64)> = Vec::new();
    for (_, candidate, spread) in fits {
        let place = candidate.structure.free.iter().position(|n| n.role == *role)?;
        let (number, value) = (candidate.structure.free.get(place)?, *candidate.fit.values.get(place)?);
        let deviation = spread.deviation.get(place).copied().unwrap_or(f64::INFINITY);
        let scale = if number.log { 1.0 } else { value.abs() };
        let determined = deviation > 0.0 && deviation < tuning().claim.undetermined * scale;
        if determined {
            points.push((number.to_internal(value), deviation));
        }
        own.push(Own { value, ci95: spread.interval(candidate, place), determined });
    }
    let (chi_square, p_value) = disagreement(&points);
    Some(Across { name: name_of(problem, joint, index), own, chi_square, p_value })
}

/// Chi-square of values about their weighted mean and its probability; (0, 1) for fewer than two.
fn disagreement(points: &[(f64, f64)]) -> (f64, f64) {
    if points.len() < 2 {
        return (0.0, 1.0);
    }
    let weight = |p: &(f64, f64)| 1.0 / (p.1 * p.1);
    let all: f64 = points.iter().map(weight).sum();
    let mean = points.iter().map(|p| weight(p) * p.0).sum::<f64>() / all;
    let sum: f64 = points.iter().map(|p| weight(p) * (p.0 - mean).powi(2)).sum();
    (sum, ChiSquared::new((points.len() - 1) as f64).map_or(1.0, |d| d.sf(sum)))
}

impl PerRecord {
    /// Numbers in which the records disagree by more than chance, the clearest first.
    pub fn disagreements(&self) -> Vec<&Across> {
        let each = tuning().claim.significance / self.numbers.len().max(1) as f64;
        let mut all: Vec<&Across> = self.numbers.iter().filter(|n| n.p_value < each).collect();
        all.sort_by(|a, b| b.chi_square.total_cmp(&a.chi_square));
        all
    }

    /// How many parameters at least two records determine each by itself, so that they can be compared.
    pub fn compared(&self) -> usize {
        self.numbers.iter().filter(|n| n.own.iter().filter(|o| o.determined).count() > 1).count()
    }

    /// Whether the records agree; `None` where no parameter can be compared.
    pub fn agree(&self) -> Option<bool> {
        (self.compared() > 0).then(|| self.disagreements().is_empty())
    }

    /// In one sentence.
    pub fn sentence(&self) -> String {
        if self.records.len() < 2 {
            return "there is one record only: its parameters cannot be compared with others".to_string();
        }
        match self.disagreements().as_slice() {
            [] => {
                let (records, compared, all) = (self.records.len(), self.compared(), self.numbers.len());
                match compared {
                    0 => format!(
                        "it is not known whether the {records} records agree: none of the {all} parameters is determined by two of them"
                    ),
                    _ if compared == all => format!("the {records} records agree within their errors in all {all} parameters"),
                    _ => format!(
                        "the {records} records agree within their errors in the {compared} of {all} parameters that at least two of them \
                         determine; the other {} cannot be compared",
                        all - compared
                    ),
                }
            }
            all => {
                let names: Vec<&str> = all.iter().take(3).map(|n| n.name.as_str()).collect();
                let more = if all.len() > 3 { format!(" and {} more", all.len() - 3) } else { String::new() };
                format!("the records disagree in {}{more}: the model structure is wrong", names.join(", "))
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn values_within_their_errors_agree_and_others_do_not() {
        let (near, p) = disagreement(&[(1.0, 0.1), (1.05, 0.1), (0.93, 0.2)]);
        assert!(near < 1.0 && p > 0.5, "{near} {p}");
        let (far, p) = disagreement(&[(1.0, 0.01), (1.1, 0.01)]);
        assert!((far - 50.0).abs() < 1e-9 && p < 1e-10, "{far} {p}");
        assert_eq!(disagreement(&[(1.0, 0.1)]), (0.0, 1.0));
    }

    #[test]
    fn what_no_two_records_determine_is_not_said_to_agree() {
        let own = |determined| Own { value: 1.0, ci95: [0.9, 1.1], determined };
        let across = |both| Across { name: "n".to_string(), own: vec![own(true), own(both)], chi_square: 0.0, p_value: 1.0 };
        let of = |numbers| PerRecord { records: vec!["a".to_string(), "b".to_string()], levels: Vec::new(), numbers };
        let none = of(vec![across(false), across(false)]);
        assert_eq!((none.compared(), none.agree()), (0, None));
        assert!(none.sentence().contains("none of the 2 parameters"), "{}", none.sentence());
        let some = of(vec![across(true), across(false), across(false)]);
        assert!(some.sentence().contains("1 of 3 parameters") && some.sentence().contains("other 2 cannot"), "{}", some.sentence());
        assert_eq!(some.agree(), Some(true));
    }
}
