//! Options of `backdrive bag`.

use clap::Subcommand;
use std::path::PathBuf;

/// `backdrive bag`
#[derive(Debug, Subcommand)]
pub enum Bag {
    /// What is in a bag, and whether it is complete, as its end tells without reading the messages; of a bag that was not closed all is read.
    #[command(
        after_help = "Example:\n  backdrive bag info contact.mcap\n  backdrive bag info contact.mcap --check\n\nExit codes: 0 whole, 2 usage, 3 cannot be read, 4 damaged, cut off or with losses."
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
    /// CSV recordings into a bag.
    #[command(
        after_help = "Example:\n  backdrive bag import sweep.csv --bag sweep.mcap\n\nTells where the clock jumps or its steps are uneven; times that repeat or go back are an error.\n\nExit codes: 0 imported, 2 usage, 3 a table is wrong or the bag exists, 5 the bag cannot be written."
    )]
    Import {
        /// CSV files with a column `t`, s.
        #[arg(required = true)]
        csv: Vec<PathBuf>,
        /// The new bag; of several CSV files the folder in which each becomes one.
        #[arg(long, visible_alias = "out", value_name = "FILE")]
        bag: PathBuf,
        /// Replace a bag that exists.
        #[arg(long)]
        overwrite: bool,
        /// Which column is what, as `motor_position=/master/measured_js.position[0]`; repeatable.
        #[arg(long, value_name = "COLUMN=TOPIC.FIELD[AXIS]")]
        map: Vec<String>,
    },
    /// A bag's signals as CSV.
    #[command(
        after_help = "Example:\n  backdrive bag export contact.mcap --csv contact.csv\n\nExit codes: 0 exported, 2 usage, 3 the bag is wrong or the table exists, 5 the table cannot be written."
    )]
    Export {
        /// The bag.
        bag: PathBuf,
        /// The CSV file.
        #[arg(long, visible_alias = "out", value_name = "FILE")]
        csv: PathBuf,
        /// Replace a file that exists.
        #[arg(long)]
        overwrite: bool,
        /// Only these topics; repeatable.
        #[arg(long)]
        topic: Vec<String>,
    },
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
