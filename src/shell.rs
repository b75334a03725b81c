//! `backdrive completions` and `backdrive man`: made from the command line itself, so that they never tell of another.

use crate::cli::{self, Cli};
use crate::failure::Failure;
use crate::output;
use clap::CommandFactory;
use std::path::Path;

/// Prints a shell's completions.
pub fn completions(options: &cli::Completions) -> Result<u8, Failure> {
    let mut script = Vec::new();
    clap_complete::generate(options.shell, &mut Cli::command(), "backdrive", &mut script);
    output::text(String::from_utf8_lossy(&script))?;
    Ok(0)
}

/// Writes a page for the program and one for every verb.
pub fn man(options: &cli::Man) -> Result<u8, Failure> {
    output::folder(&options.out)?;
    let mut program = Cli::command();
    // Names of the pages of verbs begin with the program's.
    program.build();
    let count = page(&program, &options.out)?;
    output::line(format_args!("{}: {count} pages", options.out.display()))?;
    Ok(0)
}

fn page(command: &clap::Command, folder: &Path) -> Result<usize, Failure> {
    let man = clap_mangen::Man::new(command.clone());
    let path = folder.join(man.get_filename());
    let mut text = Vec::new();
    man.render(&mut text).map_err(|e| Failure::write(&path, e))?;
    output::file(&path, text)?;
    let verbs = command.get_subcommands().filter(|verb| !verb.is_hide_set() && verb.get_name() != "help");
    verbs.map(|verb| page(verb, folder)).try_fold(1, |count, more| Ok(count + more?))
}
