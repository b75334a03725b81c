//! Options of `backdrive fleet`.

use super::values::number;
use backdrive_fleet::what::What;
use clap::Args;
use std::path::PathBuf;

/// Examples and exit codes.
pub const HELP: &str = "Examples:
  backdrive fleet recordings/ --model arm.toml --out out/fleet --html out/fleet.html
  backdrive fleet fleet.toml --what triage --shard 3/20 --out /shared/fleet
  backdrive fleet out/fleet/triage.parquet --html out/fleet.html

MANIFEST is a folder (its folders are the units, dates stand in file names), a LeRobot dataset, or a TOML file (docs/fleet.md). A table that was
written before is analysed again. In DIR the table is triage.parquet, one row a recording and joint; a column names the verdict of each row,
verdicts/KEY.json. Answers are kept by content: the same command continues after an interruption, and several processes may write to one DIR.

Exit codes: 0 nothing changed, 1 a unit changed or differs, 2 usage, 3 wrong input, 5 a file cannot be written, 7 every
recording is left out, 130 interrupted.";

/// Which shard of how many: `3/20`.
pub type Shard = (usize, usize);

/// `backdrive fleet`
#[derive(Debug, Args)]
pub struct Fleet {
    /// A manifest, a folder of recordings, a LeRobot dataset, or a table of before.
    #[arg(value_name = "MANIFEST")]
    pub manifest: PathBuf,
    /// What is asked of each recording: triage, diagnose, fit or stability.
    #[arg(long, value_name = "WHAT", default_value = "triage", value_parser = what)]
    pub what: What,
    /// The nominal model of recordings for which the manifest names none.
    #[arg(long, value_name = "MODEL")]
    pub model: Option<PathBuf>,
    /// Only every n-th recording, from the i-th on; the last shard to finish writes the table.
    #[arg(long, value_name = "I/N", default_value = "1/1", value_parser = shard)]
    pub shard: Shard,
    /// The folder for answers, verdicts and the table.
    #[arg(long, value_name = "DIR")]
    pub out: Option<PathBuf>,
    /// Threads; without it one for each core.
    #[arg(long, value_name = "N", default_value_t = 0)]
    pub jobs: usize,
    /// False discovery rate over all units, joints and parameters.
    #[arg(long, value_name = "RATE", default_value_t = backdrive_fleet::analysis::FALSE_DISCOVERIES, value_parser = rate)]
    pub false_discoveries: f64,
    /// Write the page of the fleet as one HTML file that opens offline.
    #[arg(long, value_name = "FILE")]
    pub html: Option<PathBuf>,
    /// Print the analysis as JSON.
    #[arg(long)]
    pub json: bool,
}

fn what(text: &str) -> Result<What, String> {
    text.parse()
}

fn rate(text: &str) -> Result<f64, String> {
    number(text).and_then(|x| if x > 0.0 && x < 1.0 { Ok(x) } else { Err("must be above 0 and below 1".to_string()) })
}

fn shard(text: &str) -> Result<Shard, String> {
    let read = || {
        let (number, of) = text.split_once('/')?;
        Some((number.parse().ok()?, of.parse().ok()?))
    };
    let (number, of): (usize, usize) = read().ok_or("must be I/N, such as 3/20")?;
    if (1..=of).contains(&number) { Ok((number, of)) } else { Err(format!("the first number must be from 1 to {of}")) }
}
