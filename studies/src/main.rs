//! `study`: runs a study and prints its table.

use backdrive_studies::data::Data;
use backdrive_studies::{STUDIES, StudyError, study_named};
use clap::Parser;
use std::path::PathBuf;
use std::process::ExitCode;

/// Diagnose recordings of a real device and hold the result against what was published.
#[derive(Parser)]
#[command(name = "study", version)]
struct Options {
    /// Which study; several run one after the other.
    #[arg(required_unless_present_any = ["list", "all"])]
    names: Vec<String>,
    /// Every study.
    #[arg(long)]
    all: bool,
    /// Say which studies there are.
    #[arg(long)]
    list: bool,
    /// Only what takes less than a minute.
    #[arg(long)]
    quick: bool,
    /// Folder with a folder of recordings per device; BACKDRIVE_DATA comes before it, and without both it is ../shared/data beside the project.
    #[arg(long, value_name = "DIR")]
    data: Option<PathBuf>,
    /// Folder for the results, one folder per study.
    #[arg(long, value_name = "DIR", default_value = "studies-out")]
    out: PathBuf,
}

fn main() -> ExitCode {
    let options = Options::parse();
    if options.list {
        for study in STUDIES {
            println!("{:<10} {}", study.name, study.about);
        }
        return ExitCode::SUCCESS;
    }
    let data = Data::find(options.data.as_deref());
    let all = STUDIES.iter().map(|s| s.name.to_string()).collect();
    let names: Vec<String> = if options.all { all } else { options.names };
    let mut failed = false;
    for name in names {
        match study_named(&name).and_then(|study| study.run(&data, &options.out, options.quick)) {
            Ok(report) => {
                println!("{}", report.text());
                println!("wrote {}", options.out.join(&name).display());
            }
            Err(StudyError::NoData(message)) => println!("skipped {message}"),
            Err(error) => {
                eprintln!("error: {error}");
                failed = true;
            }
        }
    }
    if failed { ExitCode::FAILURE } else { ExitCode::SUCCESS }
}
