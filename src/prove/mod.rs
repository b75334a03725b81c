//! `backdrive prove`: a master hides effects, the tool finds them from a session's bags, and the loop shows what that is worth.

mod case;
mod chosen;
mod edges;
mod files;
mod headline;
pub mod hidden;
mod live;
mod page;
mod raise;
mod recovery;
mod score;
mod session;
mod statistics;
mod summary;
mod worth;

use crate::cli;
use crate::failure::{Failure, code};
use crate::interrupt;
use crate::output;
use case::{Case, Draw};
use headline::Headline;
use std::process::ExitCode;
use std::sync::atomic::Ordering;
use summary::Summary;

/// Every fifth of several cases hides nothing.
const NULLS: usize = 5;

/// Proves as many cases as are asked for.
pub fn prove(options: &cli::Prove) -> Result<u8, Failure> {
    given_files_are_there(options)?;
    let stop = interrupt::heard()?;
    let (mut cases, mut broken) = (Vec::new(), None);
    for index in 0..options.cases {
        let several = options.cases > 1;
        let drawn = Draw {
            seed: options.seed.wrapping_add(index as u64),
            effects: if several && index % NULLS == NULLS - 1 { 0 } else { options.effects },
            shows_hand: match options.operator {
                cli::Operator::Shown => true,
                cli::Operator::Hidden => false,
                cli::Operator::Half => index % 2 == 0,
            },
            refitted: match options.nominal {
                cli::Nominal::Given => false,
                cli::Nominal::Refitted => true,
                cli::Nominal::Half => index % 4 >= 2,
            },
        };
        let folder = options.out.join(format!("case-{:03}", index + 1));
        match case::prove(options, &folder, &drawn, &stop) {
            Ok(case) => {
                output::line(case.text())?;
                for (index, sentence) in Headline::of([&case]).sentences().iter().enumerate() {
                    output::line(format_args!("  {:<11} {sentence}", if index == 0 { "comes to" } else { "" }))?;
                }
                output::line("")?;
                cases.push(case);
            }
            // What is wrong with the command shows in the first case; one of many that breaks must not cost the others.
            Err(failure) if !cases.is_empty() && !stop.load(Ordering::SeqCst) => {
                output::line(format_args!("  not ended   {}\n", failure.message))?;
                broken = Some(failure);
            }
            Err(failure) => return Err(failure),
        }
        // What is done is kept, whatever comes.
        write(options, &cases)?;
        if stop.load(Ordering::SeqCst) {
            return Err(Failure { code: code::INTERRUPTED, message: "stopped; the cases done until then are above".to_string() });
        }
    }
    if cases.len() > 1 {
        output::line(format_args!("{} cases: {}", cases.len(), Summary::of(&cases).text()))?;
        Headline::of(&cases).sentences().iter().try_for_each(output::line)?;
    }
    if let Some(failure) = broken {
        let not_ended = options.cases - cases.len();
        return Err(Failure {
            message: format!("{not_ended} of {} cases did not end; the last: {}", options.cases, failure.message),
            ..failure
        });
    }
    Ok(if Headline::of(&cases).favourable { 0 } else { code::NEGATIVE })
}

/// Before anything is sealed or recorded: the files that are needed at the end of a case.
fn given_files_are_there(options: &cli::Prove) -> Result<(), Failure> {
    let given = [
        ("model", &options.model),
        ("grip", &options.grip),
        ("second-order", &options.second_order),
        ("session", &options.session),
        ("contact", &options.contact),
        ("regrip", &options.regrip),
    ];
    for (option, path) in given {
        backdrive_plant::input_file::open(path).map_err(|e| {
            let path = path.display();
            Failure::input(format!(
                "{path}: cannot be read: {e}; run this in the folder of the project, or name another file with --{option}"
            ))
        })?;
    }
    Ok(())
}

/// Writes proof.json and the report.
fn write(options: &cli::Prove, cases: &[Case]) -> Result<(), Failure> {
    let with_headline = |case: &Case| {
        let mut json = case.json();
        json["headline"] = serde_json::json!(Headline::of([case]));
        json
    };
    let all: Vec<serde_json::Value> = cases.iter().map(with_headline).collect();
    let json = serde_json::json!({ "schema": 1, "headline": Headline::of(cases), "summary": Summary::of(cases), "cases": all });
    let path = options.out.join("proof.json");
    output::file(&path, serde_json::to_string_pretty(&json).map_err(Failure::input)?)?;
    let html = options.html.clone().unwrap_or_else(|| options.out.join("proof.html"));
    output::page(&html, page::page(options, cases))
}

/// Joins a run in the place of its master, with a hidden plant's process behind.
pub fn sealed_master(options: &cli::SealedMaster) -> ExitCode {
    backdrive_launch::join::join(|graph, node| hidden::core(graph, node, &options.word))
}
