//! Options of `backdrive bag`.

use clap::{Args, Subcommand, ValueEnum};
use std::path::PathBuf;

/// `backdrive bag`
#[derive(Debug, Subcommand)]
pub enum Bag {
    /// Show what a bag contains and whether it is complete. Reads only its summary; a bag that was not closed is read completely.
    #[command(
        after_help = "Example:\n  backdrive bag info contact.mcap\n  backdrive bag info contact.mcap --check\n\nExit codes: 0 whole, 2 usage, 3 cannot be read, 4 damaged, cut off, with losses or contradicting itself."
    )]
    Info {
        /// The bag; any MCAP file.
        bag: PathBuf,
        /// Read every message and every checksum. Damaged messages are found only with this option.
        #[arg(long)]
        check: bool,
        /// Print the result as JSON.
        #[arg(long)]
        json: bool,
    },
    /// Convert recordings of other formats to bags: CSV, parquet, MATLAB, NumPy, LeRobot datasets, ROS bags.
    Import(BagImport),
    /// Export the signals of a bag as CSV, parquet or a MATLAB file, or bags as a LeRobot dataset.
    Export(BagExport),
    /// Recover the messages of a bag that was cut off or damaged.
    #[command(
        after_help = "Example:\n  backdrive bag recover contact.mcap --bag saved.mcap\n\nExit codes: 0 all was saved, 2 usage, 3 not a bag, or the copy exists, 4 something was lost, 5 the copy cannot be written."
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
    /// Merge the bags that two hosts recorded in the same run.
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
        /// Offset of the second bag's clock, s (positive: ahead). Without this it is estimated from the bags.
        #[arg(long, value_name = "S", allow_negative_numbers = true)]
        offset: Option<f64>,
        /// Print the result as JSON.
        #[arg(long)]
        json: bool,
    },
    /// Publish the recorded messages of a bag unchanged, at their recorded times.
    #[command(
        after_help = "Example:\n  backdrive bag play contact.mcap --speed 0.5\n\nExit codes: 0 played, 2 usage, 3 the bag is wrong, 5 shared memory is not available, 130 interrupted."
    )]
    Play {
        /// The bag.
        bag: PathBuf,
        /// Speed relative to real time.
        #[arg(long, default_value_t = 1.0)]
        speed: f64,
    },
    /// Compare two bags and show where they first differ; exit code 1 if they do.
    #[command(
        after_help = "Example:\n  backdrive bag diff a.mcap b.mcap --tolerance /master/measured_js=1e-6\n\nExit codes: 0 the same, 1 they differ, 2 usage, 3 a bag cannot be read."
    )]
    Diff {
        /// One bag.
        a: PathBuf,
        /// The other.
        b: PathBuf,
        /// Largest accepted difference of a topic, in its units; repeatable. Without this values must be identical.
        #[arg(long, value_name = "TOPIC=VALUE")]
        tolerance: Vec<String>,
        /// Topic to exclude from the comparison; repeatable.
        #[arg(long, value_name = "TOPIC")]
        ignore: Vec<String>,
        /// Print the result as JSON.
        #[arg(long)]
        json: bool,
    },
}

/// `backdrive bag import`
#[derive(Debug, Args)]
#[command(
    after_help = "Examples:\n  backdrive bag import sweep.csv --bag sweep.mcap\n  backdrive bag import log.parquet --time time --bag log.mcap\n  backdrive bag import rig.mat --variable run1 --bag rig.mcap\n  backdrive bag import log.npz --bag log.mcap\n  backdrive bag import log.csv --columns 'angle (deg),speed,torque' --rate 1000 --bag log.mcap\n  backdrive bag import my_dataset --episode 0 --episode 3 --bag episodes\n  backdrive bag import session_db3 --bag session.mcap\n\nThe format is recognised from a file's first bytes or a folder's content. The bag stores the number type of each column (single precision, whole \
                  numbers, ...), and `bag export` restores it. The clock of every recording is checked: jumps and irregular steps are warnings; times that \
                  repeat or decrease are an error in a table and a warning in ROS topics.\n\nExit codes: 0 imported, 2 usage, 3 a recording is wrong or the bag exists, 5 the bag cannot be written."
)]
pub struct BagImport {
    /// CSV, parquet, MATLAB or NumPy files with a column `t`, s; folders of LeRobot datasets (version 3) or of rosbag2 in sqlite3; ROS 1 bags.
    #[arg(required = true)]
    pub recordings: Vec<PathBuf>,
    /// The new bag. For several recordings or a LeRobot dataset: the folder for one bag per recording or episode.
    #[arg(long, visible_alias = "out", value_name = "FILE")]
    pub bag: PathBuf,
    /// Replace a bag that exists.
    #[arg(long)]
    pub overwrite: bool,
    /// For a table: the topic of a column, as `motor_position=/master/measured_js.position[0]`; repeatable. Without this each column becomes a topic.
    #[arg(long, value_name = "COLUMN=TOPIC.FIELD[AXIS]")]
    pub map: Vec<String>,
    /// For a table: the time column, in s or in the unit of its heading; `t [ns]` states the unit of a column t.
    #[arg(long, default_value = "t", value_name = "COLUMN")]
    pub time: String,
    /// For a table without a heading: the names of its columns in order; a name may include a unit.
    #[arg(long, value_name = "NAME,...", value_delimiter = ',')]
    pub columns: Vec<String>,
    /// For a table without a time column: rows per second.
    #[arg(long, value_name = "HZ", value_parser = super::values::positive, allow_negative_numbers = true)]
    pub rate: Option<f64>,
    /// For a MATLAB file: the structure whose fields are the columns.
    #[arg(long, value_name = "NAME")]
    pub variable: Option<String>,
    /// For a LeRobot dataset: a TOML file that describes its features (measured, commanded, velocity, effort, commanded_at, angle, effort_scale, joints).
    #[arg(long, value_name = "FILE")]
    pub contract: Option<PathBuf>,
    /// For a LeRobot dataset: import only this episode; repeatable.
    #[arg(long, value_name = "NUMBER")]
    pub episode: Vec<u64>,
    /// Memory limit for the unpacked data of one recording, MiB; the peak use is at most three times as much.
    #[arg(long, value_name = "MIB", default_value_t = backdrive_bags::MOST_BYTES >> 20, value_parser = clap::value_parser!(u64).range(1..=1 << 30))]
    pub memory: u64,
}

/// `backdrive bag export`
#[derive(Debug, Args)]
#[command(
    after_help = "Examples:\n  backdrive bag export contact.mcap --csv contact.csv\n  backdrive bag export contact.mcap --to parquet --out contact.parquet\n  backdrive bag export episode_000000.mcap episode_000001.mcap --to lerobot --out my_dataset\n\nExit codes: 0 exported, 2 usage, 3 a bag is wrong or the output exists, 4 exported, but the bag is cut off, contradicts itself or lacks messages, 5 the output cannot be written."
)]
pub struct BagExport {
    /// The bag; for a LeRobot dataset one bag per episode, with columns such as JOINT.position.
    #[arg(required = true, value_name = "BAG")]
    pub bags: Vec<PathBuf>,
    /// The file, or the folder of a dataset.
    #[arg(long, visible_alias = "csv", value_name = "FILE")]
    pub out: PathBuf,
    /// The format. Without this it follows from the file's ending; otherwise CSV.
    #[arg(long, value_name = "FORMAT")]
    pub to: Option<ExportTo>,
    /// Replace existing files.
    #[arg(long)]
    pub overwrite: bool,
    /// Export only this topic; repeatable.
    #[arg(long)]
    pub topic: Vec<String>,
    /// For a LeRobot dataset: a TOML file with the names and units of its features, as for `bag import`.
    #[arg(long, value_name = "FILE")]
    pub contract: Option<PathBuf>,
    /// For a LeRobot dataset: a description of the task.
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
