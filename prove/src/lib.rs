//! A master hides effects, the tool finds them from a session's bags, and the loop shows what that is worth.
//!
//! [`prove`] runs cases: each draws and seals a truth, records a session, diagnoses it in a process of its own, raises the gain, and only
//! then looks at the truth. [`summary`] and [`headline`] say what several come to. Who calls it watches ([`Watch`]).

pub mod case;
mod chosen;
mod edges;
mod error;
mod files;
pub mod gain;
pub mod headline;
pub mod hidden;
pub mod live;
mod options;
mod proving;
mod raise;
mod recovery;
pub mod score;
mod session;
pub mod statistics;
pub mod summary;
mod watch;
pub mod worth;

pub use error::ProveError;
pub use options::{Nominal, Operator, Options};
pub use watch::Watch;

use case::Case;
use headline::Headline;
use proving::Draw;
use std::sync::atomic::Ordering;
use summary::Summary;

/// Every fifth of several cases hides nothing.
const NULLS: usize = 5;

/// What came of a proof.
#[derive(Debug)]
pub struct Proof {
    /// The cases that ended.
    pub cases: Vec<Case>,
    /// Why the last case that broke did.
    pub broken: Option<ProveError>,
    /// Whether it was stopped.
    pub stopped: bool,
}

/// Proves as many cases as are asked for.
///
/// # Errors
/// The first case breaks, the proof is stopped within a case, or what a case gave cannot be kept.
pub fn prove(options: &Options, watch: &dyn Watch) -> Result<Proof, ProveError> {
    let stopped = || watch.stop().load(Ordering::SeqCst);
    let mut proof = Proof { cases: Vec::new(), broken: None, stopped: false };
    for index in 0..options.cases {
        let hides_nothing = options.cases > 1 && index % NULLS == NULLS - 1;
        let drawn = Draw {
            seed: options.seed.wrapping_add(index as u64),
            effects: if hides_nothing { 0 } else { options.effects },
            shows_hand: options.operator.is_shown(index),
            refitted: options.nominal.is_refitted(index),
        };
        let folder = options.out.join(format!("case-{:03}", index + 1));
        match proving::prove(options, &folder, &drawn, watch) {
            Ok(case) => {
                proof.cases.push(case);
                if let Some(case) = proof.cases.last() {
                    watch.ended(Ok(case), &proof.cases)?;
                }
            }
            // What is wrong with the options shows in the first case; one of many that breaks must not cost the others.
            Err(error) if !proof.cases.is_empty() && !stopped() => {
                watch.ended(Err(&error), &proof.cases)?;
                proof.broken = Some(error);
            }
            Err(error) => return Err(error),
        }
        if stopped() {
            proof.stopped = true;
            break;
        }
    }
    Ok(proof)
}

/// All that is known of cases, for programs.
pub fn json(cases: &[Case]) -> serde_json::Value {
    let with_headline = |case: &Case| {
        let mut json = case.json();
        json["headline"] = serde_json::json!(Headline::of([case]));
        json
    };
    let all: Vec<serde_json::Value> = cases.iter().map(with_headline).collect();
    serde_json::json!({ "schema": 1, "headline": Headline::of(cases), "summary": Summary::of(cases), "cases": all })
}
