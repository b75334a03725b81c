//! `study`: runs a study and prints its table.

// Printing panics where the other end is full or gone.
#![cfg_attr(not(test), warn(clippy::print_stdout, clippy::print_stderr))]

use backdrive::failure::{Failure, code};
use backdrive::output;
use backdrive_studies::data::Data;
use backdrive_studies::{STUDIES, Study, StudyError, study_named};
use clap::Parser;
use std::path::PathBuf;
use std::process::ExitCode;

/// Diagnose recordings of a real device and hold the result against what was published.
#[derive(Parser)]
#[command(name = "study", version, after_help = CODES)]
struct Options {
    /// Which study; several run one after the other.
    #[arg(required_unless_present_any = ["list", "all"], conflicts_with_all = ["list", "all"])]
    names: Vec<String>,
    /// Every study.
    #[arg(long)]
    all: bool,
    /// Say which studies there are.
    #[arg(long)]
    list: bool,
    /// Only the short part of each: less than half a minute on a machine that is free.
    #[arg(long)]
    quick: bool,
    /// How many times more than usual each search may compute.
    #[arg(long, value_name = "FACTOR", default_value_t = 1.0, value_parser = factor)]
    longer: f64,
    /// Folder with a folder of recordings per device; BACKDRIVE_DATA comes before it, and without both it is ../shared/data beside the project.
    #[arg(long, value_name = "DIR")]
    data: Option<PathBuf>,
    /// Folder for the results, one folder per study.
    #[arg(long, value_name = "DIR", default_value = "studies-out")]
    out: PathBuf,
}

fn factor(text: &str) -> Result<f64, String> {
    text.parse().ok().filter(|x| (0.1..=100.0).contains(x)).ok_or_else(|| "a number from 0.1 to 100".to_string())
}

/// The meaning of the exit code.
const CODES: &str = "Exit code: 0 every bar of the tables is met, 1 a bar is missed, 2 usage, 3 a file is missing, broken or of another kind, or there is \
                     no such study, 5 this machine does not let it, 7 none of the recordings are here.";

fn main() -> ExitCode {
    let options = match output::parsed::<Options>() {
        Ok(options) => options,
        Err(code) => return code,
    };
    if options.list {
        let lines: Vec<String> = STUDIES.iter().map(|study| format!("{:<22} {}", study.name, study.about)).collect();
        return output::line(lines.join("\n")).map_or_else(|failure| output::fail(&failure), |()| ExitCode::SUCCESS);
    }
    // A wrong name is reported before the first study takes its minutes.
    let asked: Result<Vec<&Study>, StudyError> =
        if options.all { Ok(STUDIES.to_vec()) } else { options.names.iter().map(|name| study_named(name)).collect() };
    match asked {
        Ok(studies) => run(&studies, &options).map_or_else(|failure| output::fail(&failure), ExitCode::from),
        Err(error) => {
            output::note(format_args!("error: {error}"));
            ExitCode::from(error.code())
        }
    }
}

/// Runs one after the other; a study that fails does not keep the next one from its turn.
fn run(studies: &[&Study], options: &Options) -> Result<u8, Failure> {
    let data = Data::find(options.data.as_deref());
    let (mut failed, mut missed, mut skipped) = (None, false, 0);
    for study in studies {
        match study.run(&data, &options.out, options.quick, options.longer) {
            Ok(report) => {
                output::line(report.text())?;
                output::line(format_args!("wrote {}", options.out.join(study.name).display()))?;
                missed |= report.missed() > 0;
            }
            Err(StudyError::NoData(message)) => {
                output::line(format_args!("skipped {message}"))?;
                skipped += 1;
            }
            Err(error) => {
                output::note(format_args!("error: {}: {error}", study.name));
                failed = failed.or(Some(error.code()));
            }
        }
    }
    Ok(match failed {
        Some(code) => code,
        None if missed => code::NEGATIVE,
        None if skipped == studies.len() => code::CANNOT_TELL,
        None => 0,
    })
}
