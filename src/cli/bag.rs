//! Options of `backdrive bag`.

use clap::{Args, Subcommand, ValueEnum};
use std::path::PathBuf;

/// `backdrive bag`
#[derive(Debug, Subcommand)]
pub enum Bag {
    /// What is in a bag, and whether it is complete, as its end tells without reading the messages; of a bag that was not closed all is read.
    #[command(
        after_help = "Example:\n  backdrive bag info contact.mcap\n  backdrive bag info contact.mcap --check\n\nExit codes: 0 whole, 2 usage, 3 cannot be read, 4 damaged, cut off, with losses or contradicting itself."
    )]
    Info {
        /// The bag; any MCAP file.
        bag: PathBuf,
        /// Read every message and every checksum; damage among the messages shows only so.
        #[arg(long)]
        check: bool,
        /// Print it as JSON.
        #[arg(long)]
        json: bool,
    },
    /// Recordings of other formats into bags: CSV, parquet, MATLAB, NumPy, LeRobot datasets, ROS bags.
    Import(BagImport),
    /// A bag's signals as CSV, parquet or a MATLAB file, or bags as a LeRobot dataset.
    Export(BagExport),
    /// What can be saved of a bag that was cut off.
    #[command(
        after_help = "Example:\n  backdrive bag recover contact.mcap --bag saved.mcap\n\nExit codes: 0 all was saved, 2 usage, 3 it is no bag or the copy exists, 4 something was lost, 5 the copy cannot be written."
    )]
    Recover {
        /// The damaged bag; it is not changed.
        damaged: PathBuf,
        /// The new bag.
        #[arg(long, visible_alias = "out", value_name = "FILE")]
        bag: PathBuf,
        /// Replace a bag that exists.
        #[arg(long)]
        overwrite: bool,
    },
    /// One bag from those that two hosts recorded of the same run.
    #[command(
        after_help = "Example:\n  backdrive bag merge contact-desk.mcap contact-robot.mcap --bag contact.mcap\n\nExit codes: 0 merged, 2 usage, 3 a bag is wrong or the new one exists, 4 messages are missing, 5 the bag cannot be written."
    )]
    Merge {
        /// One bag; its clock is kept.
        a: PathBuf,
        /// The other.
        b: PathBuf,
        /// The new bag.
        #[arg(long, visible_alias = "out", value_name = "FILE")]
        bag: PathBuf,
        /// Replace a bag that exists.
        #[arg(long)]
        overwrite: bool,
        /// By how much the second's clock is ahead, s, in place of what the bags say.
        #[arg(long, value_name = "S", allow_negative_numbers = true)]
        offset: Option<f64>,
        /// Print the result as JSON.
        #[arg(long)]
        json: bool,
    },
    /// Publish a bag's messages again, verbatim and at their times.
    #[command(
        after_help = "Example:\n  backdrive bag play contact.mcap --speed 0.5\n\nExit codes: 0 played, 2 usage, 3 the bag is wrong, 5 shared memory does not let it, 130 interrupted."
    )]
    Play {
        /// The bag.
        bag: PathBuf,
        /// Times real time.
        #[arg(long, default_value_t = 1.0)]
        speed: f64,
    },
    /// Where two bags part; exit code 1 if they do.
    #[command(
        after_help = "Example:\n  backdrive bag diff a.mcap b.mcap --tolerance /master/measured_js=1e-6\n\nExit codes: 0 the same, 1 they differ, 2 usage, 3 a bag cannot be read."
    )]
    Diff {
        /// One bag.
        a: PathBuf,
        /// The other.
        b: PathBuf,
        /// Largest difference of a topic that counts as none, in its units; repeatable. Without one every bit counts.
        #[arg(long, value_name = "TOPIC=VALUE")]
        tolerance: Vec<String>,
        /// A topic that is not compared; repeatable.
        #[arg(long, value_name = "TOPIC")]
        ignore: Vec<String>,
        /// Print it as JSON.
        #[arg(long)]
        json: bool,
    },
}

/// `backdrive bag import`
#[derive(Debug, Args)]
#[command(
    after_help = "Examples:\n  backdrive bag import sweep.csv --bag sweep.mcap\n  backdrive bag import log.parquet --time time --bag log.mcap\n  backdrive bag import rig.mat --variable run1 --bag rig.mcap\n  backdrive bag import log.npz --bag log.mcap\n  backdrive bag import log.csv --columns 'angle (deg),speed,torque' --rate 1000 --bag log.mcap\n  backdrive bag import my_dataset --episode 0 --episode 3 --bag episodes\n  backdrive bag import session_db3 --bag session.mcap\n\nA file tells by its first bytes what it is, a folder by what is in it. The bag remembers what the numbers of a column were (single precision, whole \
                  numbers, ...), and `bag export` writes them so again. Of every recording the clock is looked at: a jump and uneven steps are a warning; times that \
                  repeat or go back are an error of a table and a warning of ROS topics.\n\nExit codes: 0 imported, 2 usage, 3 a recording is wrong or the bag exists, 5 the bag cannot be written."
)]
pub struct BagImport {
    /// CSV, parquet, MATLAB or NumPy files with a column `t`, s; folders of LeRobot datasets (version 3) or of rosbag2 in sqlite3; ROS 1 bags.
    #[arg(required = true)]
    pub recordings: Vec<PathBuf>,
    /// The new bag; of several recordings, or of a LeRobot dataset, the folder in which each, or each episode, becomes one.
    #[arg(long, visible_alias = "out", value_name = "FILE")]
    pub bag: PathBuf,
    /// Replace a bag that exists.
    #[arg(long)]
    pub overwrite: bool,
    /// Of a table: which column is what, as `motor_position=/master/measured_js.position[0]`; repeatable. Without one each becomes a topic of its own.
    #[arg(long, value_name = "COLUMN=TOPIC.FIELD[AXIS]")]
    pub map: Vec<String>,
    /// Of a table: the column with the times, s, or in the unit of its heading; `t [ns]` says the unit of a column t.
    #[arg(long, default_value = "t", value_name = "COLUMN")]
    pub time: String,
    /// Of a table without a heading: the names of its columns, in their order; a name may state its unit.
    #[arg(long, value_name = "NAME,...", value_delimiter = ',')]
    pub columns: Vec<String>,
    /// Of a table in which no column is the time: rows per second.
    #[arg(long, value_name = "HZ", value_parser = super::values::positive, allow_negative_numbers = true)]
    pub rate: Option<f64>,
    /// Of a MATLAB file: the structure whose fields the columns are.
    #[arg(long, value_name = "NAME")]
    pub variable: Option<String>,
    /// Of a LeRobot dataset: a TOML file that tells what its features are (measured, commanded, velocity, effort, commanded_at, angle, effort_scale, joints).
    #[arg(long, value_name = "FILE")]
    pub contract: Option<PathBuf>,
    /// Of a LeRobot dataset: only this episode; repeatable.
    #[arg(long, value_name = "NUMBER")]
    pub episode: Vec<u64>,
    /// Memory that the unpacked numbers of a recording may take, MiB; the peak is at most three times as much.
    #[arg(long, value_name = "MIB", default_value_t = backdrive_bags::MOST_BYTES >> 20, value_parser = clap::value_parser!(u64).range(1..=1 << 30))]
    pub memory: u64,
}

/// `backdrive bag export`
#[derive(Debug, Args)]
#[command(
    after_help = "Examples:\n  backdrive bag export contact.mcap --csv contact.csv\n  backdrive bag export contact.mcap --to parquet --out contact.parquet\n  backdrive bag export episode_000000.mcap episode_000001.mcap --to lerobot --out my_dataset\n\nExit codes: 0 exported, 2 usage, 3 a bag is wrong or what is to be written exists, 4 exported, but the bag is cut off, contradicts itself or lacks messages, 5 it cannot be written."
)]
pub struct BagExport {
    /// The bag; for a LeRobot dataset one an episode, with columns JOINT.position and the like.
    #[arg(required = true, value_name = "BAG")]
    pub bags: Vec<PathBuf>,
    /// The file, or the folder of a dataset.
    #[arg(long, visible_alias = "csv", value_name = "FILE")]
    pub out: PathBuf,
    /// The format; without it what the file's ending says, else CSV.
    #[arg(long, value_name = "FORMAT")]
    pub to: Option<ExportTo>,
    /// Replace what exists.
    #[arg(long)]
    pub overwrite: bool,
    /// Only these topics; repeatable.
    #[arg(long)]
    pub topic: Vec<String>,
    /// Of a LeRobot dataset: a TOML file that tells what its features are called and in which units, as for `bag import`.
    #[arg(long, value_name = "FILE")]
    pub contract: Option<PathBuf>,
    /// Of a LeRobot dataset: what the arm was to do, in words.
    #[arg(long, value_name = "TEXT")]
    pub task: Option<String>,
}

/// A format to export to.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
pub enum ExportTo {
    /// Apache Parquet.
    Parquet,
    /// A LeRobot dataset, version 3: a folder.
    Lerobot,
    /// Text.
    Csv,
    /// MATLAB, version 5 (`-v7`).
    Mat,
}
