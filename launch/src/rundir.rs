//! The directory of a run, and the lock that shows whether the run is alive.
//!
//! ```text
//! <tmp>/backdrive-<uid>/<id>/
//!     graph.toml         the graph as every process of the run reads it
//!     files/             what it names that lies nowhere else: the files of a graph that comes from a bag
//!     place.json         where its nodes meet, if that is not shared memory alone
//!     identity.json      the key of its messages on the network, and those of the other hosts; for its user only
//!     supervisor.lock    locked for as long as the supervisor lives
//!     processes.lock     locked, shared, by each process of the run
//!     asks.sock          where the supervisor can be asked for something while it lasts
//!     pids               who was started, for the case that the supervisor is killed
//!     middleware/        the transport's files
//! /dev/shm/bd<id>_*      shared memory
//! ```
//!
//! A process id can be reused and a process can be in another container; a lock belongs to whoever holds it and is free the moment that process is
//! gone. So the lock alone shows whether a run is alive. It is made first and removed last, so that wherever a supervisor is killed, what it leaves
//! is seen to be dead.

use crate::error::LaunchError;
use crate::paths::GRAPH;
use crate::paths::MIDDLEWARE;
use crate::paths::RunPaths;
use crate::paths::failed;
use crate::remains::{remove_file, remove_run, shm_files, start_time};
use backdrive_nodes::graph::with_files_renamed;
use backdrive_nodes::transport::ros2::Known;
use nix::errno::Errno;
use nix::fcntl::{Flock, FlockArg};
use std::fs::{DirBuilder, File, OpenOptions};
use std::hash::{BuildHasher, Hasher};
use std::io::Write;
use std::os::unix::fs::{DirBuilderExt, MetadataExt, OpenOptionsExt, PermissionsExt};
use std::path::{Path, PathBuf};
use std::time::{SystemTime, UNIX_EPOCH};

pub(crate) const LOCK: &str = "supervisor.lock";
pub(crate) const PIDS: &str = "pids";
pub(crate) const PROCESSES: &str = "processes.lock";
const HELD: &str = "files";

/// A run gets its directory under this name and takes its lock before it gets the name that others look at.
pub(crate) const UNBORN: &str = ".new-";

/// Shared memory that is there in every case, per node, bytes: its topics' segments as far as they are touched at the start.
const SHM_PER_NODE: u64 = 2 << 20;

/// How often a directory is tried to be made, where a sweep takes a new one for a dead one before it is locked.
const TRIES: usize = 5;

/// Longest root, bytes: the middleware's paths begin with it and may have 255.
const LONGEST_ROOT: usize = 120;

/// Where the runs of this user have their directories.
#[derive(Debug, Clone)]
pub struct RunHome {
    pub(crate) dir: PathBuf,
    pub(crate) shm: PathBuf,
}

impl RunHome {
    /// `backdrive-<uid>` in the system's directory for temporary files.
    pub fn system() -> RunHome {
        RunHome::at(std::env::temp_dir().join(format!("backdrive-{}", uid())))
    }

    /// Another directory, which then is for runs only.
    pub fn at(dir: impl Into<PathBuf>) -> RunHome {
        RunHome { dir: dir.into(), shm: PathBuf::from("/dev/shm") }
    }

    /// The directory.
    pub fn dir(&self) -> &Path {
        &self.dir
    }

    /// Makes the directory of a new run of this many nodes, and locks it.
    ///
    /// # Errors
    /// The directory cannot be made, is not this user's, or shared memory cannot be used or is nearly full.
    pub fn create(&self, graph: &str, nodes: usize) -> Result<RunDir, LaunchError> {
        self.create_with(graph, &[], nodes)
    }

    /// The same with files that the graph names and that lie nowhere on the disk, as (name, text): they are written beside it.
    ///
    /// # Errors
    /// As [`RunHome::create`].
    pub fn create_with(&self, graph: &str, held: &[(String, String)], nodes: usize) -> Result<RunDir, LaunchError> {
        self.make_home()?;
        let mut tries = 0;
        loop {
            tries += 1;
            let id = new_id();
            match self.create_as(&id, graph, held, nodes) {
                // A sweep was here between two lines of the making.
                Err(Unmade::Swept(_)) if tries < TRIES => {}
                Err(Unmade::Swept(error) | Unmade::Failed(error)) => {
                    let _ = remove_run(&self.dir.join(format!("{UNBORN}{id}")), LOCK);
                    return Err(error);
                }
                Ok(made) => return Ok(made),
            }
        }
    }

    fn create_as(&self, id: &str, graph: &str, held: &[(String, String)], nodes: usize) -> Result<RunDir, Unmade> {
        const ROOM: &str = "check that there is room and that you may write there, or set TMPDIR";
        let id = id.to_string();
        let paths = RunPaths { root: self.dir.join(&id), id: id.clone() };
        if paths.root.as_os_str().len() > LONGEST_ROOT {
            let reason = format!("the path has more than {LONGEST_ROOT} bytes");
            return Err(Unmade::Failed(failed(&paths.root, "make it", reason, "set TMPDIR to a shorter path")));
        }
        let unborn = self.dir.join(format!("{UNBORN}{id}"));
        let wrong = |path: &Path, what: &'static str| {
            let path = path.to_path_buf();
            move |e: std::io::Error| match e.kind() {
                std::io::ErrorKind::NotFound => Unmade::Swept(failed(&path, what, e, ROOM)),
                _ => Unmade::Failed(failed(&path, what, e, ROOM)),
            }
        };
        let make = |dir: &Path| DirBuilder::new().mode(0o700).create(dir).map_err(wrong(dir, "make it"));
        let new_file = |name: &str| {
            let path = unborn.join(name);
            OpenOptions::new().append(true).create_new(true).mode(0o600).open(&path).map_err(wrong(&path, "make it"))
        };
        make(&unborn)?;
        let mut file = new_file(LOCK)?;
        let _ = writeln!(file, "{}", std::process::id());
        let lock = Flock::lock(file, FlockArg::LockExclusiveNonblock).map_err(|(_, e)| {
            let error = failed(&unborn.join(LOCK), "lock it", e, "set TMPDIR to a directory on a local file system");
            if e == Errno::EWOULDBLOCK { Unmade::Swept(error) } else { Unmade::Failed(error) }
        })?;
        // From here on it is seen to be alive, and when this process is killed, to be dead. So nothing is made outside of it before.
        new_file(PROCESSES)?;
        self.check_shm(&paths.prefix(), nodes as u64 * SHM_PER_NODE).map_err(Unmade::Failed)?;
        let graph_path = unborn.join(GRAPH);
        // Each in a folder of its own: their names are the bag's, and not ours to trust or to change.
        let place = |number: usize, name: &str| {
            let own = Path::new(name).file_name().unwrap_or_else(|| std::ffi::OsStr::new("file"));
            Path::new(HELD).join(number.to_string()).join(own)
        };
        for (number, (name, text)) in held.iter().enumerate() {
            let path = unborn.join(place(number, name));
            let folder = path.parent().unwrap_or(&unborn);
            DirBuilder::new().recursive(true).mode(0o700).create(folder).map_err(wrong(folder, "make it"))?;
            std::fs::write(&path, text).map_err(wrong(&path, "write it"))?;
        }
        let at = |named: &str| held.iter().position(|(name, _)| name == named).map(|number| paths.root.join(place(number, named)));
        let graph = match held {
            [] => graph.to_string(),
            _ => with_files_renamed(graph, &|named| at(named).map_or_else(|| named.to_string(), |path| path.display().to_string())),
        };
        std::fs::write(&graph_path, graph).map_err(wrong(&graph_path, "write it"))?;
        make(&unborn.join(MIDDLEWARE))?;
        let mut pids = new_file(PIDS)?;
        let _ = writeln!(pids, "{}", boot_id());
        std::fs::rename(&unborn, &paths.root).map_err(wrong(&paths.root, "make it"))?;
        Ok(RunDir { paths, shm: self.shm.clone(), pids, _lock: lock })
    }

    /// Makes the directory of all runs. Another user's is refused: what is in it decides what is removed.
    fn make_home(&self) -> Result<(), LaunchError> {
        let advice = "remove it, or set TMPDIR to a directory of yours";
        DirBuilder::new().recursive(true).mode(0o700).create(&self.dir).map_err(|e| failed(&self.dir, "make it", e, advice))?;
        let meta = std::fs::symlink_metadata(&self.dir).map_err(|e| failed(&self.dir, "read it", e, advice))?;
        if !meta.is_dir() || meta.uid() != uid() {
            return Err(failed(&self.dir, "use it", "it is not a directory of this user", advice));
        }
        if meta.mode() & 0o077 != 0 {
            let private = std::fs::Permissions::from_mode(0o700);
            std::fs::set_permissions(&self.dir, private).map_err(|e| failed(&self.dir, "make it private", e, advice))?;
        }
        Ok(())
    }

    fn check_shm(&self, prefix: &str, need: u64) -> Result<(), LaunchError> {
        let error = |reason: String, advice: String| LaunchError::SharedMemory { path: self.shm.clone(), reason, advice };
        let full = |free: u64| {
            error(
                format!("is nearly full: {free} bytes free, {need} needed"),
                "run `backdrive clean`, remove what else fills it, or in a container give it more with `--shm-size=256m`".to_string(),
            )
        };
        // One page is written: a file system may let a file be made and still have no room, or be over its quota.
        let probe = self.shm.join(format!("{prefix}probe"));
        let written = OpenOptions::new().write(true).create_new(true).mode(0o600).open(&probe).and_then(|mut f| f.write_all(&[1; 4096]));
        let _ = std::fs::remove_file(&probe);
        match written {
            Ok(()) => {}
            Err(e) if e.kind() == std::io::ErrorKind::StorageFull => return Err(full(0)),
            Err(e) if e.kind() == std::io::ErrorKind::NotFound => {
                return Err(error("is not there".to_string(), format!("mount a tmpfs at {}", self.shm.display())));
            }
            Err(e) => {
                let advice = format!("its mode should be 1777: `ls -ld {}`, or in a container mount it writable", self.shm.display());
                return Err(error(format!("cannot be written: {e}"), advice));
            }
        }
        if let Ok(stat) = nix::sys::statvfs::statvfs(&self.shm) {
            let free = stat.blocks_available().saturating_mul(stat.fragment_size());
            // A file system without a size limit reports 0 blocks.
            if stat.blocks() > 0 && free < need {
                return Err(full(free));
            }
        }
        Ok(())
    }
}

/// The directory of a run that is alive because this exists. Dropped without [`RunDir::remove`], it is left to the next sweep.
#[derive(Debug)]
pub struct RunDir {
    paths: RunPaths,
    shm: PathBuf,
    pids: File,
    _lock: Flock<File>,
}

impl RunDir {
    /// Where its things are.
    pub fn paths(&self) -> &RunPaths {
        &self.paths
    }

    /// Informs the processes of the run where they meet.
    ///
    /// # Errors
    /// The file cannot be written.
    pub(crate) fn tell_place(&self, place: &crate::place::Place) -> Result<(), LaunchError> {
        let path = self.paths.place();
        let text = serde_json::to_string(place).unwrap_or_default();
        std::fs::write(&path, text).map_err(|e| failed(&path, "write it", e, "check that there is room and that you may write there"))
    }

    /// Informs the processes of the run who they are on the network.
    ///
    /// # Errors
    /// The file cannot be written.
    pub(crate) fn tell_identity(&self, known: &Known) -> Result<(), LaunchError> {
        let path = self.paths.identity();
        known.write(&path).map_err(|e| failed(&path, "write it", e, "check that there is room and that you may write there"))
    }

    /// Notes a process of the run, so that it can be ended should it outlive the supervisor.
    pub(crate) fn note(&mut self, pid: i32, name: &str) {
        if let Some(started) = start_time(pid) {
            let _ = writeln!(self.pids, "{pid} {started} {name}");
        }
    }

    /// Removes everything of the run. None of its processes may live.
    ///
    /// # Errors
    /// Something cannot be removed; the rest is.
    pub fn remove(self) -> Result<(), LaunchError> {
        let advice = "run `backdrive clean`";
        let mut first = None;
        match shm_files(&self.shm, &[&self.paths.prefix()]) {
            Ok(files) => {
                for file in files {
                    if let Err(e) = remove_file(&file) {
                        first.get_or_insert(failed(&file, "remove it", e, advice));
                    }
                }
            }
            Err(e) => first = Some(failed(&self.shm, "read it", e, advice)),
        }
        // Last, and with the lock still held: what remains of a removal that is cut short is swept.
        if let Err(e) = remove_run(&self.paths.root, LOCK) {
            first.get_or_insert(failed(&self.paths.root, "remove it", e, advice));
        }
        first.map_or(Ok(()), Err)
    }
}

/// Why a directory was not made.
enum Unmade {
    /// A sweep has removed it meanwhile.
    Swept(LaunchError),
    Failed(LaunchError),
}

/// Takes the lock of a run if it is free. `Ok(None)`: the run is alive.
pub(crate) fn try_lock(path: &Path) -> std::io::Result<Option<Flock<File>>> {
    let file = OpenOptions::new().read(true).write(true).custom_flags(nix::libc::O_NOFOLLOW).open(path)?;
    match Flock::lock(file, FlockArg::LockExclusiveNonblock) {
        Ok(lock) => Ok(Some(lock)),
        Err((_, Errno::EWOULDBLOCK)) => Ok(None),
        Err((_, e)) => Err(e.into()),
    }
}

/// Time, process and chance, in fixed widths: sorts by time, and none begins another.
fn new_id() -> String {
    let seconds = SystemTime::now().duration_since(UNIX_EPOCH).map_or(0, |d| d.as_secs()) as u32;
    let chance = std::hash::RandomState::new().build_hasher().finish() & 0xff_ffff;
    format!("{seconds:08x}{:06x}{chance:06x}", std::process::id() & 0xff_ffff)
}

/// Differs from one start of the machine to the next; process ids mean nothing beyond it.
pub(crate) fn boot_id() -> String {
    std::fs::read_to_string("/proc/sys/kernel/random/boot_id").map_or_else(|_| "unknown".to_string(), |s| s.trim().to_string())
}

pub(crate) fn uid() -> u32 {
    // SAFETY: has no preconditions and cannot fail.
    unsafe { nix::libc::geteuid() }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::paths::is_id;

    type Outcome = Result<(), Box<dyn std::error::Error>>;

    #[test]
    fn a_run_has_its_files_and_leaves_none() -> Outcome {
        let temp = tempfile::tempdir()?;
        let home = RunHome::at(temp.path().join("runs"));
        let run = home.create("title = \"x\"\n", 3)?;
        let paths = RunPaths::open(run.paths().root())?;
        assert_eq!(&paths, run.paths());
        assert_eq!(std::fs::read_to_string(paths.graph())?, "title = \"x\"\n");
        assert!(paths.location().root.is_dir());
        assert_eq!(std::fs::metadata(home.dir())?.mode() & 0o777, 0o700);
        let shm = Path::new("/dev/shm").join(format!("{}segment", paths.prefix()));
        std::fs::write(&shm, "x")?;
        run.remove()?;
        assert!(!shm.exists());
        assert_eq!(std::fs::read_dir(home.dir())?.count(), 0);
        Ok(())
    }

    #[test]
    fn ids_differ_and_have_one_form() {
        let ids: std::collections::HashSet<String> = (0..100).map(|_| new_id()).collect();
        assert!(ids.len() > 98);
        assert!(ids.iter().all(|id| is_id(id)));
        assert!(!is_id("..") && !is_id("0123456789abcdef012G") && !is_id(""));
    }

    #[test]
    fn another_directory_is_no_run() -> Outcome {
        let temp = tempfile::tempdir()?;
        let told = RunPaths::open(temp.path()).err().map(|e| e.to_string()).unwrap_or_default();
        assert!(told.contains("not the directory of a run"), "{told}");
        Ok(())
    }

    #[test]
    fn trouble_with_shared_memory_is_told_with_what_to_do() -> Outcome {
        let temp = tempfile::tempdir()?;
        let mut home = RunHome::at(temp.path().join("runs"));
        home.shm = temp.path().join("absent");
        let told = home.create("", 1).err().map(|e| e.to_string()).unwrap_or_default();
        assert!(told.contains("is not there") && told.contains("tmpfs"), "{told}");
        home.shm = PathBuf::from("/dev/shm");
        let told = home.create("", 1 << 40).err().map(|e| e.to_string()).unwrap_or_default();
        assert!(told.contains("nearly full") && told.contains("--shm-size"), "{told}");
        Ok(())
    }

    #[test]
    fn a_home_that_is_a_link_is_refused() -> Outcome {
        let temp = tempfile::tempdir()?;
        std::fs::create_dir(temp.path().join("theirs"))?;
        std::os::unix::fs::symlink(temp.path().join("theirs"), temp.path().join("runs"))?;
        assert!(RunHome::at(temp.path().join("runs")).create("", 1).is_err());
        Ok(())
    }
}
