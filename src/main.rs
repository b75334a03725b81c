//! The command line: parses, dispatches, and maps errors to exit codes.

mod bag;
mod cli;
mod experiments;
mod failure;
mod graph;
mod model;
mod node;
mod play;
mod progress;
mod replay;
mod run;
mod simulate;
mod summary;

use clap::Parser;
use cli::{Cli, Command};
use std::process::ExitCode;

fn main() -> ExitCode {
    // A file that reaches the size a user is allowed is an error of its writer, with a name, and no end without a word.
    // SAFETY: ignoring a signal runs no code of ours.
    let _ = unsafe { nix::sys::signal::signal(nix::sys::signal::Signal::SIGXFSZ, nix::sys::signal::SigHandler::SigIgn) };
    let result = match Cli::parse().command {
        Command::Run(options) => run::run(&options),
        Command::Replay(options) => replay::replay(&options),
        Command::Check(options) => graph::check(&options),
        Command::Graph(options) => graph::draw(&options),
        Command::Simulate(options) => simulate::simulate(&options),
        Command::Model(command) => model::model(&command),
        Command::Bag(command) => bag::bag(&command),
        Command::Clean => run::clean(),
        Command::Node(options) => return node::node(&options),
    };
    match result {
        Ok(code) => ExitCode::from(code),
        Err(failure) => {
            eprintln!("error: {}", failure.message);
            ExitCode::from(failure.code)
        }
    }
}
