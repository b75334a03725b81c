//! `profile SET...`: 95 % intervals of the parameters of the explanation that is chosen, beside those of its profile likelihood.
//!
//! The profile of a parameter is the least cost with that parameter held and all others refitted. Its interval ends where the profile is 3.84 above the
//! least cost of all, in units of the residual's mean square over the number of effective samples. It assumes no more about the noise than the fit does,
//! and needs no quadratic cost. One row per parameter: set, structure, parameter, its value, both ends of either interval in the fit's own unit, and the
//! ratio of their widths. At the end the quantiles of the ratios.

use backdrive_diagnosis::belief::choice::chosen;
use backdrive_diagnosis::belief::intervals::Uncertainty;
use backdrive_diagnosis::options::Options;
use backdrive_diagnosis::output_error::candidate::Candidate;
use backdrive_diagnosis::output_error::evaluator::Evaluator;
use backdrive_diagnosis::output_error::work::Limit;
use backdrive_diagnosis::recordings::problem::Problem;
use backdrive_diagnosis::search::search;
use backdrive_diagnosis::tuning::tuning;
use std::path::Path;

/// 95 % quantile of a chi-square of one degree of freedom.
const CHI_SQUARE_95: f64 = 3.841_459;
/// Evaluations of a profile on one side, at most.
const EVALUATIONS: usize = 6;

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let sets: Vec<String> = std::env::args().skip(1).collect();
    if sets.is_empty() {
        return Err("usage: profile SET...".into());
    }
    let mut ratios = Vec::new();
    for set in &sets {
        let problem = Problem::open(Path::new(set), None)?;
        let found = search(&problem, &Options::default(), Limit::default(), &|_| {})?;
        let best = chosen(&found);
        let evaluator = Evaluator { noise_sd: found.noise_sd.clone(), ..Evaluator::new(&problem) };
        let spread = Uncertainty::measured(&evaluator, best);
        for number in 0..best.structure.free.len() {
            let Some((low, high)) = profile(&evaluator, best, &spread, number) else { continue };
            let own = best.structure.free[number].to_internal(best.fit.values[number]);
            let half = spread.half(number);
            let ratio = 2.0 * half / (high - low);
            let name = format!("{:?}", best.structure.free[number].role);
            println!(
                "{set}\t{}\t{name}\t{own:.6}\t{:.6} {:.6}\t{low:.6} {high:.6}\t{ratio:.2}",
                best.structure.name(),
                own - half,
                own + half
            );
            ratios.push(ratio);
        }
    }
    ratios.sort_by(f64::total_cmp);
    let at = |share: f64| ratios.get((share * ratios.len() as f64) as usize).copied().unwrap_or(f64::NAN);
    let wide = ratios.iter().filter(|r| **r > 2.0).count();
    println!(
        "{} numbers; width over the profile's: 10 % {:.2}, median {:.2}, 90 % {:.2}; wider than twice: {wide}",
        ratios.len(),
        at(0.1),
        at(0.5),
        at(0.9)
    );
    Ok(())
}

/// Where the profile of a parameter ends on both sides, in the fit's own unit; `None` where it does not end within the parameter's bounds.
fn profile(evaluator: &Evaluator, best: &Candidate, spread: &Uncertainty, number: usize) -> Option<(f64, f64)> {
    let structure = &best.structure;
    let own = structure.free[number].to_internal(best.fit.values[number]);
    let (lowest, highest) = structure.free[number].bounds();
    let deviation = spread.deviation.get(number).copied().filter(|d| d.is_finite() && *d > 0.0)?;
    let others = structure.free.iter().enumerate().filter(|(i, _)| *i != number).map(|(_, n)| n.role.clone()).collect();
    let held = Evaluator { only: Some(others), ..evaluator.clone() };
    let samples = best.fit.residuals.len() as f64;
    let unit = (best.fit.residuals.iter().map(|r| r * r).sum::<f64>() / samples).max(1.0) * best.correlation_time;
    let rise = |at: f64| -> Option<f64> {
        let mut values = best.fit.values.clone();
        values[number] = structure.free[number].to_external(at);
        let fit = held.fit(structure, &values, tuning().fit.to_the_end)?;
        Some((fit.cost - best.fit.cost) / unit)
    };
    let end = |direction: f64| -> Option<f64> {
        // The root of the rise grows in proportion where the cost is quadratic.
        let mut away = 1.96 * deviation;
        for _ in 0..EVALUATIONS {
            let at = own + direction * away;
            if !(lowest..=highest).contains(&at) {
                return None;
            }
            let there = rise(at)?.max(1e-6);
            if (there / CHI_SQUARE_95 - 1.0).abs() < 0.05 {
                return Some(at);
            }
            away *= (CHI_SQUARE_95 / there).sqrt().clamp(0.25, 4.0);
        }
        Some(own + direction * away)
    };
    Some((end(-1.0)?, end(1.0)?))
}
