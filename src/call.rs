//! Verbs: dispatched for the command line, and called from another program in its own process, as the Python package does. Then what a verb prints is handed over
//! in place of printed, Ctrl-C is heard by the caller, and how far the work is can be read while it runs.

use crate::caller::{Caller, Calling, taken};
use crate::cli::{self, Cli, Command};
use crate::failure::{Failure, code};
use crate::{
    bag, bridge, compare, device, diagnose, doctor, export, fit, fleet, gate, graph, init, inspect, live, model, prove, replay, run,
    secret, shell, simulate, stability, test_bench, why, why_now,
};
use clap::Parser;
use std::sync::Arc;

/// What a verb gave.
#[derive(Debug)]
pub struct Called {
    /// The exit code that the command line would end with.
    pub code: u8,
    /// What it would have printed on standard output.
    pub result: String,
    /// What it would have said on standard error besides an error, a note each.
    pub notes: Vec<String>,
    /// What was wrong, where it failed.
    pub error: Option<String>,
}

/// Runs a verb in this thread, as `backdrive ARGUMENTS` would. Verbs that start other processes or never end by themselves are refused.
pub fn call<S: AsRef<str>>(arguments: &[S], caller: &Arc<Caller>) -> Called {
    let words = std::iter::once("backdrive").chain(arguments.iter().map(AsRef::as_ref));
    caller.calls(arguments.iter().map(|word| word.as_ref().to_string()).collect());
    let done = match Cli::try_parse_from(words) {
        Err(told) => {
            Err(Failure { code: code::USAGE, message: told.render().to_string().trim_start_matches("error: ").trim_end().to_string() })
        }
        Ok(cli) => {
            let _calling = Calling::begin(caller);
            dispatched(&cli.command)
        }
    };
    caller.tell(None);
    let (code, error) = match done {
        Ok(code) => (code, None),
        Err(failure) => (failure.code, Some(failure.message)),
    };
    let (result, notes) = taken(caller);
    Called { code, result, notes, error }
}

/// Does work in this thread for a caller: its progress and its notes are theirs, and they can end it. Gives the notes beside the result.
pub fn called<T>(caller: &Arc<Caller>, work: impl FnOnce() -> Result<T, Failure>) -> (Result<T, Failure>, Vec<String>) {
    let done = {
        let _calling = Calling::begin(caller);
        work()
    };
    caller.tell(None);
    let (_, notes) = taken(caller);
    (done, notes)
}

fn dispatched(command: &Command) -> Result<u8, Failure> {
    match command {
        Command::Run(_)
        | Command::Prove(_)
        | Command::Live(_)
        | Command::Bridge(_)
        | Command::Device(_)
        | Command::Node(_)
        | Command::Step(_)
        | Command::SealedMaster(_)
        | Command::Bag(cli::Bag::Play { .. }) => {
            let message = "this verb starts processes; run it from the command line".to_string();
            Err(Failure { code: code::USAGE, message })
        }
        command => dispatch(command),
    }
}

/// What a verb does.
pub(crate) fn dispatch(command: &Command) -> Result<u8, Failure> {
    match command {
        Command::Run(options) => run::run(options),
        Command::Replay(options) => replay::replay(options),
        Command::Stability(options) => stability::stability(options),
        Command::Why(options) => why::why(options),
        Command::WhyNow(options) => why_now::answer(options),
        Command::Compare(options) => compare::compare(options),
        Command::Inspect(options) => inspect::inspect(options),
        Command::Init(options) => init::init(options),
        Command::Diagnose(options) => diagnose::diagnose(options),
        Command::Fit(options) => fit::fit(options),
        Command::Fleet(options) => fleet::fleet(options),
        Command::Gate(options) => gate::gate(options),
        Command::TestBench(options) => test_bench::test_bench(options),
        Command::Check(options) => graph::check(options),
        Command::Graph(options) => graph::draw(options),
        Command::Simulate(options) => simulate::simulate(options),
        Command::Export(options) => export::export(options),
        Command::Model(command) => model::model(command),
        Command::Bag(command) => bag::bag(command),
        Command::Clean => run::clean(),
        Command::Secret(options) => secret::secret(options),
        Command::Live(options) => live::live(options),
        Command::Bridge(options) => bridge::bridge(options),
        Command::Device(command) => device::device(command),
        Command::Doctor(options) => doctor::doctor(options),
        Command::Prove(options) => prove::prove(options),
        Command::Completions(options) => shell::completions(options),
        Command::Man(options) => shell::man(options),
        Command::Node(_) | Command::Step(_) | Command::SealedMaster(_) => Ok(0), // those that end as they like: `main` sees to them
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_verb_gives_its_caller_what_it_would_print() {
        let model = concat!(env!("CARGO_MANIFEST_DIR"), "/plant/models/impulse-engine.toml");
        let caller = Arc::new(Caller::default());
        let called = call(&["model", "check", model], &caller);
        assert_eq!((called.code, called.error.as_deref()), (0, None));
        assert!(!called.result.is_empty() && called.result.ends_with('\n'), "{called:?}");
        assert_eq!(caller.progress(), None);
        let called = call(&["model", "check", "there-is-none.toml"], &caller);
        assert_eq!(called.code, code::BAD_INPUT);
        assert!(called.error.is_some_and(|e| e.contains("there-is-none.toml")));
    }

    #[test]
    fn wrong_usage_and_verbs_with_processes_are_refused() {
        let caller = Arc::new(Caller::default());
        let wrong = call(&["diagnose", "--what"], &caller);
        assert_eq!(wrong.code, code::USAGE);
        assert!(wrong.error.is_some_and(|e| e.starts_with("unexpected argument '--what'")));
        assert_eq!(call(&["run", "launch/contact.toml"], &caller).code, code::USAGE);
    }
}
