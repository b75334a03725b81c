//! Bags into tables and datasets: which format is asked for, which options are for it, and what may be replaced.

use crate::{Account, BagError, Contract, Fault, LerobotReport, Reader, TableFormat, export_lerobot, export_table, is_lerobot};
use std::path::{Path, PathBuf};

/// What bags become.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum ExportFormat {
    /// One table of one bag.
    Table(TableFormat),
    /// A LeRobot dataset, an episode for each bag.
    Lerobot,
}

/// What is exported, and how.
#[derive(Debug, Clone)]
pub struct Export {
    /// The bags.
    pub bags: Vec<PathBuf>,
    /// The file, or the folder of a dataset.
    pub out: PathBuf,
    /// The format; `None` for that of the file's ending, else CSV.
    pub to: Option<ExportFormat>,
    /// Only these topics; `None` for all.
    pub topics: Option<Vec<String>>,
    /// Of a dataset: what its features are; `None` for the usual ones.
    pub contract: Option<Contract>,
    /// Of a dataset: a description of the task.
    pub task: Option<String>,
    /// Replace what is there.
    pub overwrite: bool,
}

/// What an export is, once its options are checked.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum PlannedExport<'a> {
    /// One table.
    Table {
        /// The bag.
        bag: &'a Path,
        /// The format.
        format: TableFormat,
    },
    /// A dataset of all bags.
    Lerobot,
}

impl Export {
    /// Checks the options, and that nothing is replaced which is read or was not given up.
    ///
    /// # Errors
    /// [`BagError::Option`] for an option of another format; a place that is taken.
    pub fn planned(&self) -> Result<PlannedExport<'_>, BagError> {
        let by_ending = TableFormat::of_ending(&self.out).unwrap_or(TableFormat::Csv);
        match self.to.unwrap_or(ExportFormat::Table(by_ending)) {
            ExportFormat::Lerobot => self.planned_dataset(),
            ExportFormat::Table(format) => self.planned_table(format),
        }
    }

    fn planned_table(&self, format: TableFormat) -> Result<PlannedExport<'_>, BagError> {
        let wrong = |what: &str| Err(BagError::Option(what.to_owned()));
        let [bag] = self.bags.as_slice() else { return wrong("several bags become the episodes of a dataset alone, with --to lerobot") };
        if self.contract.is_some() || self.task.is_some() {
            return wrong("--contract and --task are for --to lerobot");
        }
        self.apart_from(bag)?;
        Ok(PlannedExport::Table { bag, format })
    }

    fn planned_dataset(&self) -> Result<PlannedExport<'_>, BagError> {
        if self.topics.is_some() {
            return Err(BagError::Option("--topic is for tables; a dataset contains all joints of the bag".to_owned()));
        }
        let out = &self.out;
        let is_free = !out.exists() || std::fs::read_dir(out).is_ok_and(|mut entries| entries.next().is_none());
        let taken = |what: &str| Err(BagError::File { path: out.clone(), what: what.to_owned() });
        if !is_free && !is_lerobot(out) {
            return taken("exists and is not a LeRobot dataset, so it is not replaced; name another");
        }
        if !is_free && !self.overwrite {
            return taken("exists already; --overwrite replaces it, or name another");
        }
        self.bags.iter().try_for_each(|bag| self.apart_from(bag))?;
        Ok(PlannedExport::Lerobot)
    }

    /// What is written replaces what is there: no bag that is read may be it, or in it.
    fn apart_from(&self, bag: &Path) -> Result<(), BagError> {
        match (self.out.canonicalize(), bag.canonicalize()) {
            (Ok(there), Ok(read)) if read.starts_with(&there) => {
                let what = format!("would replace {}, which is an input; name another place", bag.display());
                Err(BagError::File { path: self.out.clone(), what })
            }
            _ => Ok(()),
        }
    }

    /// Writes the table of a bag to `to`, where nothing is yet: its rows, and what a person should know.
    ///
    /// # Errors
    /// As of [`export_table`].
    pub fn table(&self, reader: &Reader, to: &Path, format: TableFormat) -> Result<(u64, Vec<String>), BagError> {
        export_table(reader, to, format, self.topics.as_deref())
    }

    /// Writes the dataset. The folder is there whole or not at all: it is written beside its place and then moved there.
    ///
    /// # Errors
    /// As of [`export_lerobot`]; the folder cannot be written.
    pub fn dataset(&self, readers: &[Reader]) -> Result<LerobotReport, BagError> {
        let (out, contract) = (&self.out, self.contract.clone().unwrap_or_default());
        let task = self.task.as_deref().unwrap_or("not given");
        let failed = |e: std::io::Error| BagError::create(out)(e);
        let above = out.parent().filter(|above| !above.as_os_str().is_empty()).unwrap_or(Path::new("."));
        std::fs::create_dir_all(above).map_err(failed)?;
        let beside = tempfile::Builder::new().prefix(".backdrive-").tempdir_in(above).map_err(failed)?;
        let made = beside.path().join("dataset");
        let report = export_lerobot(readers, &made, &contract, task)?;
        let before = beside.path().join("before");
        let replaces = out.exists();
        if replaces {
            std::fs::rename(out, &before).map_err(failed)?;
        }
        if let Err(e) = std::fs::rename(&made, out) {
            // What was there is there still.
            if replaces {
                std::fs::rename(&before, out).map_err(failed)?;
            }
            return Err(failed(e));
        }
        Ok(report)
    }

    /// What a bag lacks, and so what is written of it lacks too.
    ///
    /// # Errors
    /// The bag cannot be read.
    pub fn missing(&self, bag: &Reader) -> Result<Missing, BagError> {
        let account = Account::of(bag)?;
        let counts = |fault: &Fault| match (fault, self.topics.as_deref()) {
            (Fault::Lost { topic, .. }, Some(topics)) => topics.contains(topic),
            _ => true,
        };
        let faults: Vec<Fault> = account.faults.into_iter().filter(counts).collect();
        let rows = account.last_step.map_or(0, |last| last + 1);
        let empty_rows = if faults.is_empty() { 0 } else { account.empty_steps };
        Ok(Missing { faults, empty_rows, rows, notes: account.notes })
    }
}

/// What is missing of a bag that was exported.
#[derive(Debug)]
pub struct Missing {
    /// What is wrong with the bag, among the topics that were asked for.
    pub faults: Vec<Fault>,
    /// Rows that no topic has a message for.
    pub empty_rows: u64,
    /// Of how many.
    pub rows: u64,
    /// What else to know: a sentence each.
    pub notes: Vec<String>,
}
