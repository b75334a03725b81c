//! The command line as a library: [`main`] parses, dispatches, and maps errors to exit codes; studies run the code of its verbs.

// Printing panics where the other end is full or gone.
#![cfg_attr(not(test), warn(clippy::print_stdout, clippy::print_stderr))]

mod bag;
mod bridge;
pub mod call;
pub mod caller;
mod cli;
mod columns;
pub mod compare;
mod device;
pub mod diagnose;
mod doctor;
pub mod export;
pub mod failure;
pub mod fit;
pub mod fleet;
mod gate;
mod graph;
mod init;
pub mod inspect;
mod interrupt;
mod live;
mod model;
pub mod model_run;
mod node;
mod offered;
pub mod output;
pub mod program;
mod progress;
mod prove;
mod replay;
mod run;
mod secret;
mod servo_runs;
mod shell;
pub mod simulate;
pub mod stability;
mod test_bench;
pub mod why;
mod why_now;

use cli::{Cli, Command};
use std::process::ExitCode;

/// The program in the process of another one, such as Python's: runs the command line, and gives the exit code.
pub fn main_as(called: program::Called) -> u8 {
    program::state(called);
    let code = main();
    (0..=u8::MAX).find(|known| ExitCode::from(*known) == code).unwrap_or(1)
}

/// The program: runs the command line.
pub fn main() -> ExitCode {
    // A file that reaches the size a user is allowed is an error of its writer, with a name, and no end without a word.
    // SAFETY: ignoring a signal runs no code of ours.
    let _ = unsafe { nix::sys::signal::signal(nix::sys::signal::Signal::SIGXFSZ, nix::sys::signal::SigHandler::SigIgn) };
    let command = match output::parsed::<Cli>() {
        Ok(cli) => cli.command,
        Err(code) => return code,
    };
    end_with_the_reader(&command);
    let result = match &command {
        Command::Node(options) => return node::node(options),
        Command::Step(options) => return node::step(options),
        Command::SealedMaster(options) => return prove::sealed_master(options),
        command => call::dispatch(command),
    };
    match result {
        Ok(code) => output::ended(code),
        Err(failure) => output::fail(&failure),
    }
}

/// `backdrive ... | head` ends quietly when the reader has enough. Not where other processes hang on pipes of ours:
/// there a closed one must not end us.
fn end_with_the_reader(command: &Command) {
    use nix::sys::signal::{SigHandler, Signal, signal};
    if !matches!(
        command,
        Command::Run(_)
            | Command::Live(_)
            | Command::Prove(_)
            | Command::Node(_)
            | Command::Step(_)
            | Command::SealedMaster(_)
            | Command::Bag(cli::Bag::Play { .. })
    ) {
        // SAFETY: the default action replaces none of ours.
        let _ = unsafe { signal(Signal::SIGPIPE, SigHandler::SigDfl) };
    }
}
