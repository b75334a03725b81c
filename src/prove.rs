//! `backdrive prove`: options, what is said of each case as it ends, its files, exit codes. The work is that of [`backdrive_prove`].

use crate::cli;
use crate::failure::{Failure, code};
use crate::{interrupt, output, progress};
use backdrive_pages::prove::page;
use backdrive_prove::case::Case;
use backdrive_prove::headline::Headline;
use backdrive_prove::summary::Summary;
use backdrive_prove::{Options, Proof, ProveError, Watch, hidden};
use std::any::Any;
use std::path::PathBuf;
use std::process::ExitCode;
use std::sync::Arc;
use std::sync::atomic::AtomicBool;

/// Proves as many cases as are asked for.
pub fn prove(asked: &cli::Prove) -> Result<u8, Failure> {
    given_files_are_there(asked)?;
    let options = resolved(asked)?;
    let html = asked.html.clone().unwrap_or_else(|| options.out.join("proof.html"));
    let terminal = Terminal { options: &options, html, stop: interrupt::heard()? };
    let Proof { cases, broken, stopped } = backdrive_prove::prove(&options, &terminal)?;
    if stopped {
        return Err(Failure { code: code::INTERRUPTED, message: "stopped; the cases done until then are above".to_string() });
    }
    if cases.len() > 1 {
        output::line(format_args!("{} cases: {}", cases.len(), Summary::of(&cases).text()))?;
        Headline::of(&cases).sentences().iter().try_for_each(output::line)?;
    }
    if let Some(error) = broken {
        let (not_ended, failure) = (options.cases - cases.len(), Failure::from(error));
        return Err(Failure {
            message: format!("{not_ended} of {} cases did not end; the last: {}", options.cases, failure.message),
            ..failure
        });
    }
    Ok(if Headline::of(&cases).favourable { 0 } else { code::NEGATIVE })
}

/// The options of the work.
fn resolved(asked: &cli::Prove) -> Result<Options, Failure> {
    let asked = asked.clone();
    Ok(Options {
        seed: asked.seed,
        effects: asked.effects,
        cases: asked.cases,
        nonlinear: asked.nonlinear,
        out: asked.out,
        model: asked.model,
        grip: asked.grip,
        second_order: asked.second_order,
        session: asked.session,
        contact: asked.contact,
        regrip: asked.regrip,
        high_pass_hz: asked.high_pass,
        effort: asked.effort,
        patience_s: asked.patience,
        operator: asked.operator,
        nominal: asked.nominal,
        hand_bandwidth_hz: asked.hand_bandwidth,
        grips: (!asked.same_grip).then_some(asked.grips),
        live: !asked.no_live,
        gains: !asked.no_gains,
        plant: asked.plant.unwrap_or_else(hidden::program),
        backdrive: std::env::current_exe().map_err(Failure::machine)?,
    })
}

/// What a terminal hears of a proof, and the files that are kept of it.
struct Terminal<'a> {
    options: &'a Options,
    html: PathBuf,
    stop: Arc<AtomicBool>,
}

impl Watch for Terminal<'_> {
    fn stop(&self) -> &AtomicBool {
        &self.stop
    }

    fn begins(&self, doing: &str) -> Box<dyn Any> {
        Box::new(progress::Busy::begin(doing))
    }

    fn sealed(&self, sentence: &str) -> Result<(), ProveError> {
        Ok(output::line(sentence)?)
    }

    fn ended(&self, last: Result<&Case, &ProveError>, cases: &[Case]) -> Result<(), ProveError> {
        match last {
            Ok(case) => {
                output::line(case.text())?;
                for (index, sentence) in Headline::of([case]).sentences().iter().enumerate() {
                    output::line(format_args!("  {:<11} {sentence}", if index == 0 { "comes to" } else { "" }))?;
                }
                output::line("")?;
            }
            Err(error) => output::line(format_args!("  not ended   {error}\n"))?,
        }
        // What is done is kept, whatever comes.
        let json = serde_json::to_string_pretty(&backdrive_prove::json(cases)).map_err(ProveError::input)?;
        output::file(&self.options.out.join("proof.json"), json)?;
        Ok(output::page(&self.html, page(self.options, cases))?)
    }
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

/// Joins a run instead of its master, with a hidden plant's process behind.
pub fn sealed_master(options: &cli::SealedMaster) -> ExitCode {
    backdrive_launch::join::join(|graph, node| hidden::core(graph, node, &options.word))
}

impl From<ProveError> for Failure {
    fn from(error: ProveError) -> Failure {
        match error {
            ProveError::Input(message) => Failure::input(message),
            ProveError::Machine(message) => Failure::machine(message),
        }
    }
}

impl From<Failure> for ProveError {
    fn from(failure: Failure) -> ProveError {
        match failure.code {
            code::BAD_INPUT => ProveError::Input(failure.message),
            _ => ProveError::Machine(failure.message),
        }
    }
}
