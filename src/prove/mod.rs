//! `backdrive prove`: a master hides effects, the tool finds them from a session's bags, and the loop shows what that is worth.

mod case;
mod edges;
pub mod hidden;
mod score;

use crate::cli;
use crate::failure::{Failure, code};
use case::Case;
use std::path::Path;
use std::process::ExitCode;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};

/// Every fifth of several cases hides nothing.
const NULLS: usize = 5;

/// Proves as many cases as are asked for.
pub fn prove(options: &cli::Prove) -> Result<u8, Failure> {
    let stop = Arc::new(AtomicBool::new(false));
    let heard = stop.clone();
    // A second Ctrl-C ends at once.
    let handler = move || {
        if heard.swap(true, Ordering::SeqCst) {
            std::process::exit(i32::from(code::INTERRUPTED))
        }
    };
    ctrlc::set_handler(handler).map_err(Failure::machine)?;
    let mut cases = Vec::new();
    for index in 0..options.cases {
        let effects = if options.cases > 1 && index % NULLS == NULLS - 1 { 0 } else { options.effects };
        let folder = options.out.join(format!("case-{:03}", index + 1));
        let case = case::prove(options, &folder, options.seed.wrapping_add(index as u64), effects, &stop)?;
        println!("{}\n", case.text());
        cases.push(case);
        if stop.load(Ordering::SeqCst) {
            break;
        }
    }
    let all: Vec<serde_json::Value> = cases.iter().map(Case::json).collect();
    let path = options.out.join("proof.json");
    std::fs::write(&path, serde_json::to_string_pretty(&all).map_err(Failure::input)?).map_err(|e| Failure::write(&path, e))?;
    if cases.len() > 1 {
        println!("{}", summary(&cases));
    }
    if stop.load(Ordering::SeqCst) {
        return Err(Failure { code: code::INTERRUPTED, message: "stopped; the cases done until then are above".to_string() });
    }
    Ok(if cases.iter().all(Case::is_right) { 0 } else { code::NEGATIVE })
}

/// Joins a run in the place of its master, with a hidden plant's process behind.
pub fn sealed_master(options: &cli::SealedMaster) -> ExitCode {
    backdrive_launch::join::join(|graph, node| hidden::core(graph, node, &options.word))
}

/// A few lines over all cases.
fn summary(cases: &[Case]) -> String {
    let marks: Vec<_> = cases.iter().flat_map(|c| c.marks.iter()).collect();
    let share = |of: &dyn Fn(&score::Mark) -> bool| format!("{} of {}", marks.iter().filter(|m| of(m)).count(), marks.len());
    let nulls: Vec<&Case> = cases.iter().filter(|c| c.marks.is_empty()).collect();
    let alarms = nulls.iter().filter(|c| !c.findings.is_empty()).count();
    let mut ratios: Vec<f64> = cases.iter().filter(|c| c.nonlinear).filter_map(Case::ratio).collect();
    ratios.sort_by(f64::total_cmp);
    let median = match ratios.len() {
        0 => "no case".to_string(),
        n => format!("{:.1} (median of {n})", 0.5 * (ratios[(n - 1) / 2] + ratios[n / 2])),
    };
    format!(
        "{} cases: place {}, family {}, exact {}; false alarms {alarms} of {}; stable gain over the better linear canceller, nonlinear effects: {median}",
        cases.len(),
        share(&|m| m.place),
        share(&|m| m.family),
        share(&|m| m.exact),
        nulls.len(),
    )
}

/// A path as text that a file of ours can hold wherever it lies.
fn absolute(path: &Path) -> Result<String, Failure> {
    std::path::absolute(path).map(|p| p.display().to_string()).map_err(|e| Failure::write(path, e))
}
