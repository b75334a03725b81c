//! Recordings of any format into bags: which format each has, which options are for it, and where its bag goes.

use crate::{
    BagError, Contract, ImportOptions, ImportReport, LerobotOptions, RosbagReport, check_target, import_lerobot, import_rosbag,
    import_table, is_lerobot, is_rosbag,
};
use std::path::{Path, PathBuf};

/// What becomes bags, and how.
#[derive(Debug, Clone)]
pub struct Import {
    /// Tables, LeRobot datasets, rosbag2 folders or ROS 1 bags.
    pub recordings: Vec<PathBuf>,
    /// The bag; of several recordings or of a dataset the folder for them.
    pub bag: PathBuf,
    /// How a table is read; what is replaced and how much memory is used are for every format.
    pub table: ImportOptions,
    /// Of a LeRobot dataset: what its features are; `None` for the usual ones.
    pub contract: Option<Contract>,
    /// Of a LeRobot dataset: the episodes to import; `None` for all.
    pub episodes: Option<Vec<u64>>,
}

/// What a recording is that becomes bags.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Kind {
    /// One table, one bag.
    Table,
    /// A folder of episodes, a folder of bags.
    Lerobot,
    /// Topics of somebody else's, one bag.
    Rosbag,
}

/// One recording whose format is known.
#[derive(Debug, Clone)]
pub struct Planned {
    /// The recording.
    pub from: PathBuf,
    /// Its bag, or the folder for its bags.
    pub to: PathBuf,
    kind: Kind,
}

/// A bag that was made.
#[derive(Debug)]
pub struct Imported {
    /// The recording, of a dataset with the name of the episode.
    pub from: PathBuf,
    /// The bag.
    pub to: PathBuf,
    /// What the import did.
    pub report: Report,
}

/// What an import did.
#[derive(Debug)]
pub enum Report {
    /// Of a table or an episode.
    Table(ImportReport),
    /// Of topics of ROS.
    Rosbag(RosbagReport),
}

impl Import {
    /// Recognises the recordings, and checks the options and the places of the bags.
    ///
    /// # Errors
    /// [`BagError::Option`] for an option of another format, or two recordings that would become one bag; a recording that is not there or of no known
    /// format; a bag that is there already.
    pub fn planned(&self) -> Result<Vec<Planned>, BagError> {
        let all = self.recordings.iter().map(|from| self.one(from)).collect::<Result<Vec<_>, _>>()?;
        if let Some(place) = (1..all.len()).find(|place| all[..*place].iter().any(|other| other.to == all[*place].to)) {
            let (second, first) = (&all[place], all.iter().find(|other| other.to == all[place].to).unwrap_or(&all[0]));
            let (a, b, to) = (first.from.display(), second.from.display(), second.to.display());
            return Err(BagError::Option(format!("{a} and {b} would both become {to}; import them one by one")));
        }
        if self.recordings.len() > 1 {
            std::fs::create_dir_all(&self.bag).map_err(BagError::create(&self.bag))?;
        }
        for planned in all.iter().filter(|planned| planned.kind != Kind::Lerobot) {
            check_target(&planned.to, self.table.overwrite)?;
        }
        if let (Some(rate), true) = (self.table.rate_hz, self.names_time()) {
            let time = &self.table.time;
            let what = format!("--rate {rate} is for tables in which no column is the time, and --time names {time:?}; keep one");
            return Err(BagError::Option(what));
        }
        Ok(all)
    }

    /// Makes the bags of one recording.
    ///
    /// # Errors
    /// The recording is wrong, or a bag cannot be written.
    pub fn carry_out(&self, planned: &Planned) -> Result<Vec<Imported>, BagError> {
        let (from, to) = (planned.from.as_path(), planned.to.as_path());
        let (overwrite, most_bytes) = (self.table.overwrite, self.table.most_bytes);
        let one = |report: Report| vec![Imported { from: from.to_owned(), to: to.to_owned(), report }];
        Ok(match planned.kind {
            Kind::Table => one(Report::Table(import_table(from, to, &self.table)?)),
            Kind::Rosbag => one(Report::Rosbag(import_rosbag(from, to, overwrite, most_bytes)?)),
            Kind::Lerobot => {
                let contract = self.contract.clone().unwrap_or_default();
                let options = LerobotOptions { contract, episodes: self.episodes.clone(), overwrite, most_bytes };
                let episodes = import_lerobot(from, to, &options)?.into_iter();
                let of = |e: crate::Episode| Imported { from: from.join(&e.name), to: e.bag, report: Report::Table(e.report) };
                episodes.map(of).collect()
            }
        })
    }

    /// One recording is one experiment and one bag: several go into a folder, as the episodes of a dataset do.
    fn one(&self, from: &Path) -> Result<Planned, BagError> {
        let kind = self.kind_of(from)?;
        let to = match (self.recordings.len(), kind) {
            (1, _) => self.bag.clone(),
            (_, Kind::Lerobot) => self.bag.join(from.file_name().unwrap_or_default()),
            _ => self.bag.join(from.with_extension("mcap").file_name().unwrap_or_default()),
        };
        Ok(Planned { from: from.to_owned(), to, kind })
    }

    /// What a recording is; an option that is for another kind is an error.
    fn kind_of(&self, from: &Path) -> Result<Kind, BagError> {
        let wrong_file = |what: &str| BagError::File { path: from.to_owned(), what: what.to_owned() };
        if !from.exists() {
            return Err(wrong_file("there is no such file or folder"));
        }
        let kind = match from {
            from if is_lerobot(from) => Kind::Lerobot,
            from if is_rosbag(from) => Kind::Rosbag,
            from if from.is_dir() => {
                return Err(wrong_file(
                    "is a folder, but neither a LeRobot dataset (meta/info.json) nor a rosbag2 (metadata.yaml, .db3); name the files in it",
                ));
            }
            _ => Kind::Table,
        };
        let table = &self.table;
        let of_tables = [
            ("--map", !table.columns.is_empty()),
            ("--variable", table.variable.is_some()),
            ("--time", self.names_time()),
            ("--columns", table.headings.is_some()),
            ("--rate", table.rate_hz.is_some()),
        ];
        let of_datasets = [("--contract", self.contract.is_some()), ("--episode", self.episodes.is_some())];
        let wrong = |options: &[(&str, bool)], is_for: &str| match options.iter().find(|(_, given)| *given) {
            Some((option, _)) => Err(BagError::Option(format!("{}: {option} is for {is_for}", from.display()))),
            None => Ok(()),
        };
        if kind != Kind::Table {
            wrong(&of_tables, "tables: CSV, parquet, MATLAB and NumPy files")?;
        }
        if kind != Kind::Lerobot {
            wrong(&of_datasets, "LeRobot datasets")?;
        }
        Ok(kind)
    }

    fn names_time(&self) -> bool {
        self.table.time != ImportOptions::default().time
    }
}
