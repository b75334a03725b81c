//! How well a structure predicts held-out data when its parameters may be as far off as the fitted recordings leave open.
//!
//! A prediction is off because the structure is wrong, or because its parameters are not known well. Of two structures that fit alike, the one whose
//! parameters happen to be nearer is not thereby the better model of the device. So both are fitted to all recordings together. They are compared by their
//! residuals on the unseen recordings and by the increase of cost on the others.

use crate::belief::choice::{chosen, decided_by_unseen};
use crate::belief::compare::{HeldOut, blocks};
use crate::belief::statistics::correlation_time;
use crate::output_error::candidate::Candidate;
use crate::output_error::evaluator::Evaluator;
use crate::output_error::structure::Structure;
use crate::output_error::work::{Budget, Limit, Steps};
use crate::recordings::problem::{Problem, Record};
use crate::search::Search;
use crate::tuning::tuning;
use rayon::prelude::*;

/// Releases the parameters of the chosen structure, and of structures of as many effects that only the unseen recordings separate from it. Then those of
/// the structure chosen for that.
pub fn hold_with_released_parameters(problem: &Problem, search: &mut Search, limit: Limit) {
    for _ in 0..tuning().search.finalists {
        let best = chosen(search);
        let with: Vec<bool> = search.found.iter().map(|c| std::ptr::eq(c, best) || decided_by_unseen(search, c, best)).collect();
        if with.iter().filter(|x| **x).count() < 2 {
            return;
        }
        let noise_sd = search.noise_sd.clone();
        let mut open: Vec<&mut Candidate> =
            search.found.iter_mut().zip(with).filter(|(c, with)| *with && c.released.is_none()).map(|(c, _)| c).collect();
        if open.is_empty() {
            return;
        }
        open.par_iter_mut().for_each(|c| c.released = of(problem, c, &noise_sd, limit).or_else(|| c.unseen.clone()));
    }
}

fn of(problem: &Problem, candidate: &Candidate, noise_sd: &[f64], limit: Limit) -> Option<HeldOut> {
    let raw = candidate.unseen.as_ref()?;
    let all: Vec<Record> = problem.fit.iter().chain(&problem.held_out).cloned().collect();
    let (fitted, values) = (&candidate.structure, &candidate.fit.values);
    let structure = Structure::new(problem, &all, fitted.added.clone());
    // What belongs to single recordings is fitted to those in any case.
    if structure.free.iter().chain(&fitted.free).any(|n| n.records.is_some()) || structure.free.len() != fitted.free.len() {
        return None;
    }
    let evaluator = Evaluator { noise_sd: noise_sd.to_vec(), budget: Budget::new(Steps::MAX, limit), ..Evaluator::on(problem, &all) };
    let together = evaluator.fit(&structure, values, tuning().fit.middle)?;
    let (fit, unseen) = together.residuals.split_at_checked(candidate.fit.residuals.len())?;
    let square = |residuals: &[f64]| residuals.iter().map(|r| r * r).sum::<f64>();
    let price = (square(fit) - square(&candidate.fit.residuals)).max(0.0) / unseen.len().max(1) as f64;
    let held = Evaluator { noise_sd: noise_sd.to_vec(), ..Evaluator::on(problem, &problem.held_out) };
    let mean_square = square(unseen) / unseen.len().max(1) as f64 + price;
    let priced = blocks(&held, unseen).into_iter().map(|list| list.into_iter().map(|square| square + price).collect()).collect();
    (mean_square < raw.mean_square).then(|| HeldOut { mean_square, correlation_time: correlation_time(&held, unseen), blocks: priced })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::belief::compare::unseen;
    use crate::output_error::candidate::candidate;
    use backdrive_plant::model::Model;
    use backdrive_plant::recording::Recording;
    use backdrive_plant::set::Initial;
    use backdrive_plant::stepper::{Options, simulate};
    use rand::SeedableRng;
    use rand_distr::{Distribution, StandardNormal};

    /// A cart of 2 kg that is hardly moved in the fitted recording, and moved far in the held-out one: its parameters are not known well there.
    #[test]
    fn numbers_that_were_not_known_well_are_no_fault_of_the_structure() {
        let text = "name = 'cart'\n[bodies]\ncart = 2.0\n[[elements]]\nname = 'spring'\nkind = 'spring'\nbetween = ['cart', 'ground']\nstiffness = 800.0\n\
                    [[elements]]\nname = 'loss'\nkind = 'damper'\nbetween = ['cart', 'ground']\ndamping = 8.0\n\
                    [[inputs]]\nname = 'f'\nkind = 'force'\non = 'cart'\n[[outputs]]\nname = 'x'\nkind = 'position'\nof = 'cart'\n";
        let model = Model::from_toml(text, "cart.toml").unwrap();
        let mut random = rand_chacha::ChaCha8Rng::seed_from_u64(3);
        let mut record = |size: f64| {
            let t: Vec<f64> = (0..3000).map(|i| 1e-3 * f64::from(i)).collect();
            let force: Vec<f64> = t.iter().map(|t| size * (17.0 * t + 2.0 * t * t).sin()).collect();
            let clean = simulate(&model, std::slice::from_ref(&force), 1e-3, &Options::default()).unwrap();
            let x =
                clean[0].iter().map(|x| x + 1e-3 * <StandardNormal as Distribution<f64>>::sample(&StandardNormal, &mut random)).collect();
            Record::new(&Recording::new("r", t, vec![("f".to_string(), force), ("x".to_string(), x)]).unwrap(), &model, Vec::new()).unwrap()
        };
        let (fit, held_out) = (vec![record(3.0)], vec![record(300.0)]);
        let problem = Problem::new(text.to_string(), "cart.toml".into(), model.clone(), fit, held_out, Initial::Rest).unwrap();
        let evaluator = Evaluator::new(&problem);
        let structure = Structure::new(&problem, &problem.fit, Vec::new());
        let given: Vec<f64> = problem.stated.iter().map(|s| s.given).collect();
        let start = structure.values(&problem, &given, &[], &[]);
        let fitted = evaluator.fit(&structure, &start, tuning().fit.to_the_end).unwrap();
        let mut found = candidate(&evaluator, structure, fitted);
        found.unseen = unseen(&problem, &problem.held_out, &found.structure, &found.fit.values, &problem.noise_sd);
        let raw = found.unseen.as_ref().unwrap().mean_square;
        let released = of(&problem, &found, &problem.noise_sd, Limit::default()).unwrap().mean_square;
        assert!(raw > 1.5 && released < 1.2, "{raw} {released}");
    }
}
