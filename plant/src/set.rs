//! Recording sets: a folder of recordings, with a `set.toml` that states which may be fitted and which are held out.

use crate::elements::Range;
use crate::recording::{Cell, Columns, Frame, JointColumns, Piece, Recording, TableSource, read_columns, read_joints};
use crate::robot::Payload;
use crate::tomlfile::{FileError, Table, unknown};
use std::path::{Path, PathBuf};
use std::sync::Arc;

/// How the device starts in each file.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Initial {
    /// At rest at the first sample.
    #[default]
    Rest,
    /// In any state: initial states are estimated.
    Free,
}

/// What a parameter is in one file.
#[derive(Debug, Clone, PartialEq)]
pub enum Condition {
    /// Another value than in the other files, to be estimated.
    Free,
    /// The same in all files of a session, by its place in `[sessions]`, and to be estimated.
    Shared(usize),
    /// This value.
    Value(f64),
}

/// What is particular to one file of a set.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct FileRules {
    /// The file that it is a piece of, relative to the folder; `None` where it is a file of its own.
    pub of: Option<String>,
    /// Which rows count.
    pub piece: Piece,
    /// Parameters that differ in this file, by path: `elements.band.force`.
    pub condition: Vec<(String, Condition)>,
    /// A known mass that an arm carried in this file.
    pub payload: Option<Payload>,
}

/// A recording set.
#[derive(Debug, Clone, PartialEq)]
pub struct RecordingSet {
    /// The folder its files are in.
    pub folder: PathBuf,
    /// The nominal model; `None` where the set names none.
    pub model: Option<PathBuf>,
    /// Files a fit may see, relative to the folder.
    pub fit: Vec<String>,
    /// Files no fit may see, relative to the folder.
    pub held_out: Vec<String>,
    /// How the device starts.
    pub initial: Initial,
    /// Inputs of the model that were not measured: name, and Hz up to which they vary. They are no columns of the files.
    pub unknown: Vec<(String, f64)>,
    /// Names and units in the files.
    pub columns: Columns,
    /// Of an arm: where each joint's position, velocity and torque stand; empty where the set does not say.
    pub joints: Vec<JointColumns>,
    /// What is particular to a file, by its name in `fit` or `held_out`; what a session shares stands at each of its files.
    pub files: Vec<(String, FileRules)>,
    /// Names of the sessions, in their order, and the paths that each of them has a condition for.
    pub sessions: Vec<(String, Vec<String>)>,
    /// Recorded inputs that may have no place in the model.
    pub ignore: Vec<String>,
    /// Whether recordings of rates that differ by more than a factor of two belong together.
    pub mixed_rates: bool,
    /// Recordings in memory, by the names that they have in `fit` and `held_out`; the others are files.
    pub frames: Vec<Arc<Frame>>,
}

impl RecordingSet {
    /// Opens a set: a folder with a `set.toml`, that file itself, or a folder of recordings without one (all are then for fitting).
    pub fn open(path: &Path) -> Result<RecordingSet, FileError> {
        if !path.is_dir() {
            let folder = path.parent().unwrap_or(Path::new("")).to_path_buf();
            return read(Table::open(path)?, folder, Vec::new());
        }
        let file = path.join("set.toml");
        match file.exists() {
            true => read(Table::open(&file)?, path.to_path_buf(), Vec::new()),
            false => {
                let fit = recordings_in(path)?;
                if fit.is_empty() {
                    return Err(FileError::whole(path.display().to_string(), "has no set.toml and no recordings (.csv or .mcap)"));
                }
                Ok(RecordingSet::of_recordings(path.to_path_buf(), fit))
            }
        }
    }

    /// A set that a program states: the text of a `set.toml`, which files are relative to `folder`, and the recordings of it that are in memory.
    ///
    /// # Errors
    /// The text is wrong, or names a file that is not there.
    pub fn in_memory(text: &str, folder: PathBuf, frames: Vec<Frame>) -> Result<RecordingSet, FileError> {
        read(Table::parse(text, "set.toml")?, folder, frames.into_iter().map(Arc::new).collect())
    }

    /// A set of recordings without further statements: all are for fitting, from rest, their columns as they are named. `fit` is relative to the
    /// folder.
    pub fn of_recordings(folder: PathBuf, fit: Vec<String>) -> RecordingSet {
        RecordingSet {
            folder,
            model: None,
            fit,
            held_out: Vec::new(),
            initial: Initial::Rest,
            unknown: Vec::new(),
            columns: Columns::new(),
            joints: Vec::new(),
            files: Vec::new(),
            sessions: Vec::new(),
            ignore: Vec::new(),
            mixed_rates: false,
            frames: Vec::new(),
        }
    }

    /// Path of one of its files; of a piece that of the file that holds it.
    pub fn path_of(&self, file: &str) -> PathBuf {
        self.folder.join(source_of(&self.files, file))
    }

    /// One of its recordings in memory; of a piece that of the recording that it is a piece of. `None` of a file.
    pub fn frame(&self, file: &str) -> Option<&Arc<Frame>> {
        let source = source_of(&self.files, file);
        self.frames.iter().find(|frame| frame.name() == source)
    }

    /// Where one of its tables is. An MCAP file is no table.
    pub fn table(&self, file: &str) -> TableSource {
        self.frame(file).map_or_else(|| TableSource::File(self.path_of(file)), |frame| TableSource::Frame(frame.clone()))
    }

    /// Whether one of its recordings is an MCAP file.
    pub fn is_bag(&self, file: &str) -> bool {
        self.frame(file).is_none() && self.path_of(file).extension().is_some_and(|e| e.eq_ignore_ascii_case("mcap"))
    }

    /// Paths of the files among its recordings.
    pub fn paths(&self) -> Vec<PathBuf> {
        self.fit.iter().chain(&self.held_out).filter(|file| self.frame(file).is_none()).map(|file| self.path_of(file)).collect()
    }

    /// What is particular to a file; the defaults where the set has no entry.
    pub fn rules_of(&self, file: &str) -> FileRules {
        self.files.iter().find(|f| f.0 == file).map(|f| f.1.clone()).unwrap_or_default()
    }

    /// Whether every condition names a number of the model, and every payload hangs on a link of its robot; the error names the file or the session,
    /// and the path.
    pub fn check_conditions(&self, model: &crate::model::Model) -> Result<(), FileError> {
        for (name, payload) in self.files.iter().filter_map(|(name, rules)| Some((name, rules.payload.as_ref()?))) {
            let found = match &model.arm {
                Some(arm) => arm.link_of(payload).map(|_| ()),
                None => Err("is of a model with a [robot], and this one has none".to_string()),
            };
            found.map_err(|message| FileError {
                path: self.path_of("set.toml").display().to_string(),
                line: None,
                key: format!("files.{name}.payload"),
                message,
            })?;
        }
        let of_sessions = self.sessions.iter().flat_map(|(name, paths)| paths.iter().map(move |path| (format!("sessions.{name}"), path)));
        let of_files =
            self.files.iter().flat_map(|(name, rules)| rules.condition.iter().map(move |(path, _)| (format!("files.{name}"), path)));
        for (owner, path) in of_sessions.chain(of_files) {
            model.values_at(path).map_err(|message| FileError {
                path: self.path_of("set.toml").display().to_string(),
                line: None,
                key: format!("{owner}.condition.{path}"),
                message,
            })?;
        }
        Ok(())
    }

    /// Reads the named signals of one of its tables. An MCAP file is read by the crate for bags, with
    /// `columns` and `rules_of` of this set.
    pub fn read_table(&self, file: &str, signals: &[&str]) -> Result<Recording, FileError> {
        self.table(file).read(Some(signals), &self.columns, &self.rules_of(file).piece)
    }
}

/// The file that holds what a set calls so.
fn source_of<'a>(files: &'a [(String, FileRules)], name: &'a str) -> &'a str {
    files.iter().find(|(file, _)| file == name).and_then(|(_, rules)| rules.of.as_deref()).unwrap_or(name)
}

fn is_recording(name: &str) -> bool {
    let lower = name.to_lowercase();
    lower.ends_with(".csv") || lower.ends_with(".mcap")
}

/// Names of the recordings in a folder, in order.
///
/// # Errors
/// When the folder cannot be read.
pub fn recordings_in(folder: &Path) -> Result<Vec<String>, FileError> {
    let failed = |e: std::io::Error| FileError::whole(folder.display().to_string(), format!("cannot be read: {e}"));
    let mut names = Vec::new();
    for entry in std::fs::read_dir(folder).map_err(failed)? {
        let name = entry.map_err(failed)?.file_name().to_string_lossy().into_owned();
        if is_recording(&name) {
            names.push(name);
        }
    }
    names.sort();
    Ok(names)
}

fn read(mut top: Table, folder: PathBuf, frames: Vec<Arc<Frame>>) -> Result<RecordingSet, FileError> {
    let exists = |table: &Table, key: &str, name: &str| match folder.join(name).is_file() {
        true => Ok(()),
        false => Err(table.error_at(key, format!("there is no file \"{name}\" in {}", shown(&folder)))),
    };
    let model = top.string("model")?;
    if let Some(name) = &model {
        exists(&top, "model", name)?;
    }
    let held_out = top.strings("held_out")?.unwrap_or_default();
    let fit = match top.strings("fit")? {
        Some(fit) => fit,
        None => recordings_in(&folder)?.into_iter().filter(|name| !held_out.contains(name)).collect(),
    };
    let mut files_table = top.table("files")?;
    let mut files = Vec::new();
    if let Some(table) = &mut files_table {
        for name in table.keys() {
            let below = table.table(&name)?.ok_or_else(|| table.missing(&name))?;
            files.push((name, read_rules(below)?));
        }
    }
    for (key, names) in [("fit", &fit), ("held_out", &held_out)] {
        for (i, name) in names.iter().enumerate() {
            let source = source_of(&files, name);
            let is_frame = frames.iter().any(|frame| frame.name() == source);
            if !is_frame && !is_recording(source) {
                return Err(top.error_at(
                    key,
                    format!("\"{source}\" is not a recording; expected .csv or .mcap (`backdrive bag import` makes bags of other formats)"),
                ));
            }
            if !is_frame {
                exists(&top, key, source)?;
            }
            if names[..i].contains(name) {
                return Err(top.error_at(key, format!("names \"{name}\" twice")));
            }
        }
    }
    if let Some(both) = held_out.iter().find(|name| fit.contains(name)) {
        return Err(top.error_at("held_out", format!("\"{both}\" is in fit too; a held-out recording must not be fitted")));
    }
    if fit.is_empty() && held_out.is_empty() {
        return Err(top.error("names no recordings; expected fit = [\"a.csv\", ...]"));
    }
    let initial = top.one_of("initial", &[("rest", Initial::Rest), ("free", Initial::Free)])?.unwrap_or_default();
    let unknown_inputs = top.table("unknown")?.map(read_unknown).transpose()?.unwrap_or_default();
    let mut columns = top.table("columns")?.map(read_columns).transpose()?.unwrap_or_default();
    let joints = top.table("joints")?.map(|table| read_joints(table, &mut columns)).transpose()?.unwrap_or_default();
    if let Some(table) = &files_table {
        for (name, _) in &files {
            let all = fit.iter().chain(&held_out).map(String::as_str);
            if !fit.contains(name) && !held_out.contains(name) {
                return Err(table.error_at(name, unknown("file", name, all)));
            }
        }
    }
    let sessions = match top.table("sessions")? {
        Some(table) => read_sessions(table, [&fit, &held_out], &mut files)?,
        None => Vec::new(),
    };
    let ignore = top.strings("ignore")?.unwrap_or_default();
    let mixed_rates = top.boolean("mixed_rates")?.unwrap_or_default();
    top.finish()?;
    let model = model.map(|name| folder.join(name));
    Ok(RecordingSet {
        model,
        folder,
        fit,
        held_out,
        initial,
        unknown: unknown_inputs,
        columns,
        joints,
        files,
        sessions,
        ignore,
        mixed_rates,
        frames,
    })
}

/// The inputs that were not measured.
fn read_unknown(mut table: Table) -> Result<Vec<(String, f64)>, FileError> {
    let mut inputs = Vec::new();
    for name in table.keys() {
        let mut below = table.table(&name)?.ok_or_else(|| table.missing(&name))?;
        inputs.push((name, below.need_number("bandwidth_hz", Range::Positive)?));
        below.finish()?;
    }
    Ok(inputs)
}

/// The sessions, whose conditions go to the rules of each of their files; `lists` are the files of the set.
fn read_sessions(
    mut table: Table,
    lists: [&Vec<String>; 2],
    files: &mut Vec<(String, FileRules)>,
) -> Result<Vec<(String, Vec<String>)>, FileError> {
    let mut sessions = Vec::new();
    for (session, name) in table.keys().into_iter().enumerate() {
        let mut below = table.table(&name)?.ok_or_else(|| table.missing(&name))?;
        let mut condition = Vec::new();
        read_condition(below.table("condition")?.ok_or_else(|| below.missing("condition"))?, "", &mut condition)?;
        for c in condition.iter_mut().filter(|c| c.1 == Condition::Free) {
            c.1 = Condition::Shared(session);
        }
        for file in below.strings("files")?.ok_or_else(|| below.missing("files"))? {
            if !lists.iter().any(|list| list.contains(&file)) {
                return Err(below.error_at("files", unknown("file", &file, lists.into_iter().flatten().map(String::as_str))));
            }
            let at = files.iter().position(|(name, _)| *name == file).unwrap_or_else(|| {
                files.push((file.clone(), FileRules::default()));
                files.len() - 1
            });
            let Some((_, rules)) = files.get_mut(at) else { continue };
            for (path, value) in &condition {
                if rules.condition.iter().any(|(other, _)| other == path) {
                    let message = format!("\"{path}\" has a condition in this file, or in another session of it, already");
                    return Err(below.error_at("files", format!("\"{file}\": {message}")));
                }
                rules.condition.push((path.clone(), value.clone()));
            }
        }
        below.finish()?;
        sessions.push((name, condition.into_iter().map(|(path, _)| path).collect()));
    }
    Ok(sessions)
}

fn shown(folder: &Path) -> String {
    if folder.as_os_str().is_empty() { "this folder".to_string() } else { folder.display().to_string() }
}

fn read_rules(mut table: Table) -> Result<FileRules, FileError> {
    let mut rules = FileRules { of: table.string("of")?, ..FileRules::default() };
    if let Some(rows) = table.numbers("rows", Range::NonNegative)? {
        let whole = rows.iter().all(|x| x.fract() == 0.0);
        match rows.as_slice() {
            [from, to] if whole && from < to => rules.piece.rows = Some([*from as usize, *to as usize]),
            _ => return Err(table.error_at("rows", "expected two row numbers, from 0: the first that counts and the first that does not")),
        }
    }
    if let Some(mut keep) = table.table("where")? {
        for column in keep.keys() {
            let cell = match keep.is_string(&column) {
                true => Cell::Text(keep.need_string(&column)?),
                false => Cell::Number(keep.need_number(&column, Range::Any)?),
            };
            rules.piece.keep.push((column, cell));
        }
    }
    if let Some(condition) = table.table("condition")? {
        read_condition(condition, "", &mut rules.condition)?;
    }
    rules.payload = table.table("payload")?.map(read_payload).transpose()?;
    table.finish()?;
    Ok(rules)
}

/// `{ mass = 0.5, at = [0.0, 0.0, 0.2] }`, with `link` where it is not on the last one.
fn read_payload(mut table: Table) -> Result<Payload, FileError> {
    let mass = table.need_number("mass", Range::NonNegative)?;
    let at = match table.numbers("at", Range::Any)?.ok_or_else(|| table.missing("at"))?.as_slice() {
        [x, y, z] => [*x, *y, *z].into(),
        _ => return Err(table.error_at("at", "expected three numbers: its centre in the frame of the link, m")),
    };
    let link = table.string("link")?;
    table.finish()?;
    Ok(Payload { mass, at, link })
}

/// `{ "elements.band.force" = "free" }`, and the same without the quotes, which TOML reads as tables.
fn read_condition(mut table: Table, path: &str, found: &mut Vec<(String, Condition)>) -> Result<(), FileError> {
    for key in table.keys() {
        let full = if path.is_empty() { key.clone() } else { format!("{path}.{key}") };
        if table.is_table(&key) {
            if let Some(below) = table.table(&key)? {
                read_condition(below, &full, found)?;
            }
            continue;
        }
        if !full.contains('.') {
            return Err(table.error_at(&key, "expected the path of a parameter, such as elements.band.force"));
        }
        let value = match table.is_string(&key) {
            true => table.need_one_of(&key, &[("free", Condition::Free)])?,
            false => Condition::Value(table.need_number(&key, Range::Any)?),
        };
        found.push((full, value));
    }
    Ok(())
}
