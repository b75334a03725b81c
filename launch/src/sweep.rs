//! Removes what dead runs have left: their directories, their shared memory, and processes that outlived them.
//!
//! Only what bears the name of a run whose lock is free is touched; everything else on the machine is somebody else's.

use crate::paths::{is_id, prefix_of};
use crate::remains::name_of;
use crate::remains::{remove_file, remove_run, shm_files, start_time};
use crate::rundir::{LOCK, PIDS, RunHome, UNBORN, boot_id, try_lock, uid};
use nix::fcntl::Flock;
use nix::sys::signal::{Signal, kill};
use nix::unistd::Pid;
use serde::Serialize;
use std::fs::File;
use std::io::ErrorKind;
use std::os::unix::fs::MetadataExt;
use std::path::{Path, PathBuf};
use std::time::{Duration, Instant, SystemTime};

/// How long a directory that holds something may lack its lock. None of ours does: the lock is made first and removed last.
const UNBORN_FOR: Duration = Duration::from_secs(60);

/// How long a process that has lost its supervisor may take to finish, such as a bag.
const ORPHAN_GRACE: Duration = Duration::from_secs(2);

/// Longest time to spend on looking which runs there are.
const LOOK: Duration = Duration::from_secs(2);

/// What a sweep did.
#[derive(Debug, Clone, Default, PartialEq, Serialize)]
pub struct Swept {
    /// Runs that were dead and are gone now.
    pub removed: Vec<SweptRun>,
    /// Runs that are alive.
    pub alive: Vec<String>,
    /// What could not be removed, one sentence each.
    pub failed: Vec<String>,
    /// Whether the time was over before everything was looked at.
    pub cut_short: bool,
}

/// A dead run that is gone now.
#[derive(Debug, Clone, Default, PartialEq, Serialize)]
pub struct SweptRun {
    /// Its name.
    pub id: String,
    /// Its directory.
    pub root: PathBuf,
    /// Its files in shared memory.
    pub shm: Vec<PathBuf>,
    /// Its processes that were still there.
    pub ended: Vec<i32>,
}

struct Dead {
    run: SweptRun,
    orphans: Vec<(i32, u64)>,
    // Held while it is removed, so that two sweeps do not get in each other's way.
    _lock: Option<Flock<File>>,
}

impl RunHome {
    /// Removes everything that dead runs have left, in about this time at most, and 3 s more if processes of
    /// theirs must be ended. Called at every start.
    pub fn sweep(&self, limit: Duration) -> Swept {
        let mut deadline = Instant::now() + limit;
        let mut swept = Swept::default();
        let mut dead = self.find_dead(deadline, &mut swept);
        if dead.is_empty() {
            return swept;
        }
        let before = Instant::now();
        end_orphans(&mut dead);
        deadline += before.elapsed();
        let prefixes: Vec<String> = dead.iter().map(|d| prefix_of(&d.run.id)).collect();
        let prefixes: Vec<&str> = prefixes.iter().map(String::as_str).collect();
        let shm = match shm_files(&self.shm, &prefixes) {
            Ok(files) => files,
            Err(e) => {
                swept.failed.push(format!("{}: cannot read it: {e}", self.shm.display()));
                return swept;
            }
        };
        for (mut dead, prefix) in dead.into_iter().zip(prefixes) {
            if Instant::now() > deadline {
                swept.cut_short = true;
                break;
            }
            if let Some((pid, _)) = dead.orphans.first() {
                swept.failed.push(format!("run {}: process {pid} does not end", dead.run.id));
                continue;
            }
            let mut whole = true;
            for file in shm.iter().filter(|f| name_of(f).starts_with(prefix)) {
                match remove_file(file) {
                    Ok(()) => dead.run.shm.push(file.clone()),
                    Err(e) => {
                        whole = false;
                        swept.failed.push(format!("{}: cannot remove it: {e}", file.display()));
                    }
                }
            }
            // The directory is removed last: while it is there, the next sweep tries again.
            if whole {
                match remove_run(&dead.run.root, LOCK) {
                    Ok(()) => swept.removed.push(dead.run),
                    Err(e) => swept.failed.push(format!("{}: cannot remove it: {e}", dead.run.root.display())),
                }
            }
        }
        swept
    }

    /// What `backdrive clean` does: a sweep that takes its time.
    pub fn clean(&self) -> Swept {
        self.sweep(Duration::from_secs(60))
    }

    /// The runs that are dead and have left something.
    pub fn dead(&self) -> Vec<String> {
        self.find_dead(Instant::now() + LOOK, &mut Swept::default()).into_iter().map(|d| d.run.id).collect()
    }

    /// The runs that are alive.
    pub fn alive(&self) -> Vec<String> {
        let mut swept = Swept::default();
        drop(self.find_dead(Instant::now() + LOOK, &mut swept));
        swept.alive
    }

    fn find_dead(&self, deadline: Instant, swept: &mut Swept) -> Vec<Dead> {
        // A home that is a link or another user's could name anything as a run.
        let ours = std::fs::symlink_metadata(&self.dir).is_ok_and(|m| m.is_dir() && m.uid() == uid());
        let Ok(entries) = std::fs::read_dir(&self.dir) else { return Vec::new() };
        let mut dead = Vec::new();
        for entry in entries.flatten().take_while(|_| ours) {
            if Instant::now() > deadline {
                swept.cut_short = true;
                break;
            }
            let name = entry.file_name().to_string_lossy().into_owned();
            let id = name.strip_prefix(UNBORN).unwrap_or(&name).to_string();
            let root = entry.path();
            let Ok(meta) = std::fs::symlink_metadata(&root) else { continue };
            if !is_id(&id) || !meta.is_dir() || meta.uid() != uid() {
                continue;
            }
            let old = meta.modified().ok().and_then(|m| SystemTime::now().duration_since(m).ok()).is_some_and(|age| age > UNBORN_FOR);
            let lock = match try_lock(&root.join(LOCK)) {
                Ok(Some(lock)) => Some(lock),
                Ok(None) => {
                    swept.alive.push(id);
                    continue;
                }
                Err(e) if e.kind() == ErrorKind::NotFound && old => None,
                Err(e) if e.kind() == ErrorKind::NotFound => {
                    // Made and not yet locked, or its lock removed and it itself not yet: it is empty. Its maker, if it lives, begins again.
                    let _ = std::fs::remove_dir(&root);
                    continue;
                }
                Err(e) => {
                    swept.failed.push(format!("{}: cannot lock it: {e}", root.join(LOCK).display()));
                    continue;
                }
            };
            let orphans = orphans(&root.join(PIDS));
            dead.push(Dead { run: SweptRun { id, root, ..SweptRun::default() }, orphans, _lock: lock });
        }
        dead
    }
}

/// Processes of a dead run that still live: (process id, start time). Same id and same start time since
/// the same boot is the same process.
fn orphans(pids: &Path) -> Vec<(i32, u64)> {
    let text = std::fs::read_to_string(pids).unwrap_or_default();
    let mut lines = text.lines();
    if lines.next() != Some(boot_id().as_str()) {
        return Vec::new();
    }
    let parse = |line: &str| {
        let mut words = line.split(' ');
        Some((words.next()?.parse().ok()?, words.next()?.parse().ok()?))
    };
    lines.filter_map(parse).filter(|&(pid, started)| pid > 1 && start_time(pid) == Some(started)).collect()
}

/// Asks them to end, waits a moment, and kills them. Those that live on stay in the lists.
fn end_orphans(dead: &mut [Dead]) {
    for (signal, grace) in [(Signal::SIGTERM, ORPHAN_GRACE), (Signal::SIGKILL, Duration::from_secs(1))] {
        if dead.iter().all(|d| d.orphans.is_empty()) {
            return;
        }
        for (pid, _) in dead.iter().flat_map(|d| &d.orphans) {
            let _ = kill(Pid::from_raw(*pid), signal);
        }
        let until = Instant::now() + grace;
        while Instant::now() < until && dead.iter().any(|d| !d.orphans.is_empty()) {
            std::thread::sleep(Duration::from_millis(10));
            for one in dead.iter_mut() {
                let Dead { run, orphans, .. } = one;
                orphans.retain(|&(pid, started)| {
                    let lives = start_time(pid) == Some(started);
                    if !lives {
                        run.ended.push(pid);
                    }
                    lives
                });
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    type Outcome = Result<(), Box<dyn std::error::Error>>;
    const LIMIT: Duration = Duration::from_secs(60);

    #[test]
    fn the_dead_go_and_the_living_stay() -> Outcome {
        let temp = tempfile::tempdir()?;
        let home = RunHome::at(temp.path());
        let living = home.create("", 1)?;
        let dead = home.create("", 1)?;
        let (dead_root, dead_id) = (dead.paths().root().to_path_buf(), dead.paths().id().to_string());
        let shm = |id: &str| Path::new("/dev/shm").join(format!("{}x.data", prefix_of(id)));
        std::fs::write(shm(&dead_id), "x")?;
        std::fs::write(shm(living.paths().id()), "x")?;
        drop(dead);

        let swept = home.sweep(LIMIT);
        assert_eq!(swept.removed.len(), 1);
        assert_eq!(swept.removed[0].id, dead_id);
        assert_eq!(swept.removed[0].shm, [shm(&dead_id)]);
        assert_eq!(swept.alive, [living.paths().id()]);
        assert_eq!(swept.failed, [""; 0]);
        assert!(!dead_root.exists() && !shm(&dead_id).exists());
        assert!(living.paths().graph().exists() && shm(living.paths().id()).exists());
        living.remove()?;
        Ok(())
    }

    #[test]
    fn what_is_not_ours_stays() -> Outcome {
        let temp = tempfile::tempdir()?;
        let home = RunHome::at(temp.path().join("runs"));
        home.create("", 1)?.remove()?;
        // Foreign names, a file with the name of a run, a link with the name of a run, and a directory that holds something and has no lock.
        let precious = temp.path().join("precious");
        std::fs::create_dir(&precious)?;
        std::fs::write(precious.join("thesis"), "x")?;
        std::fs::write(precious.join(LOCK), "")?;
        std::fs::create_dir(home.dir().join("notes"))?;
        std::fs::write(home.dir().join("0123456789abcdef0123"), "")?;
        std::os::unix::fs::symlink(&precious, home.dir().join("0123456789abcdef0124"))?;
        std::fs::create_dir(home.dir().join("0123456789abcdef0126"))?;
        std::fs::write(home.dir().join("0123456789abcdef0126/file"), "x")?;
        let foreign = Path::new("/dev/shm").join(format!("bd-test-{}", std::process::id()));
        std::fs::write(&foreign, "x")?;
        // And one that is dead and links to something precious.
        let dead = home.create("", 1)?;
        std::os::unix::fs::symlink(&precious, dead.paths().root().join("link"))?;
        drop(dead);

        let swept = home.sweep(LIMIT);
        assert_eq!(swept.removed.len(), 1);
        assert!(foreign.exists());
        std::fs::remove_file(&foreign)?;
        assert!(precious.join("thesis").exists());
        assert_eq!(std::fs::read_dir(home.dir())?.count(), 4);
        Ok(())
    }

    #[test]
    fn a_start_or_an_end_that_was_cut_short_anywhere_is_removed() -> Outcome {
        let temp = tempfile::tempdir()?;
        let home = RunHome::at(temp.path().join("runs"));
        home.create("", 1)?.remove()?;
        // What a run has, in the order in which it is made; an end leaves the same, from the end on.
        let parts = [LOCK, "processes.lock", "graph.toml", "middleware", PIDS];
        for (number, name) in [UNBORN, ""].iter().enumerate() {
            for made in 0..=parts.len() {
                let id = format!("0123456789abcdef{number}{made:03}");
                let root = home.dir().join(format!("{name}{id}"));
                std::fs::create_dir(&root)?;
                for part in &parts[..made] {
                    if *part == "middleware" { std::fs::create_dir(root.join(part))? } else { std::fs::write(root.join(part), "")? }
                }
                // The probe of shared memory is made once there is a lock.
                let probe = Path::new("/dev/shm").join(format!("{}probe", prefix_of(&id)));
                if made >= 2 {
                    std::fs::write(&probe, "x")?;
                }
                let swept = home.sweep(LIMIT);
                assert_eq!(swept.failed, [""; 0], "{root:?}");
                assert!(!root.exists() && !probe.exists(), "{root:?}");
            }
        }
        // One that is being made is locked, and stays.
        let root = home.dir().join(format!("{UNBORN}0123456789abcdef0999"));
        std::fs::create_dir(&root)?;
        std::fs::write(root.join(LOCK), "")?;
        let lock = try_lock(&root.join(LOCK))?.ok_or("it is locked")?;
        assert_eq!(home.sweep(LIMIT).removed.len(), 0);
        assert!(root.exists());
        drop(lock);
        Ok(())
    }

    #[test]
    fn a_process_that_outlived_its_run_is_ended_but_not_one_with_a_reused_id() -> Outcome {
        let temp = tempfile::tempdir()?;
        let home = RunHome::at(temp.path());
        let mut orphan = std::process::Command::new("sleep").arg("600").spawn()?;
        let mut other = std::process::Command::new("sleep").arg("600").spawn()?;
        let mut run = home.create("", 1)?;
        run.note(orphan.id() as i32, "orphan");
        let pids = run.paths().root().join(PIDS);
        drop(run);
        let mut text = std::fs::read_to_string(&pids)?;
        text.push_str(&format!("{} 1 other\n", other.id()));
        std::fs::write(&pids, text)?;
        let swept = home.sweep(LIMIT);
        assert_eq!(swept.removed.len(), 1);
        assert_eq!(swept.removed[0].ended, [orphan.id() as i32]);
        orphan.wait()?;
        assert!(other.try_wait()?.is_none());
        other.kill()?;
        other.wait()?;
        Ok(())
    }

    #[test]
    fn no_home_is_nothing_to_do() {
        assert_eq!(RunHome::at("/nonexistent/runs").sweep(LIMIT), Swept::default());
    }
}
