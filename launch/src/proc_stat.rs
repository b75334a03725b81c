//! The system's information on a process: whether it lives, whether it was stopped, whether it works.

/// A line of `/proc/PID/stat`, of a process that is not gone and does not only wait to be reaped.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct ProcStat {
    state: char,
    /// Processor time used, clock ticks.
    used: u64,
    /// When it started, clock ticks since boot.
    pub started: u64,
}

impl ProcStat {
    pub fn of(pid: i32) -> Option<ProcStat> {
        let stat = std::fs::read_to_string(format!("/proc/{pid}/stat")).ok()?;
        // The program's name is in parentheses and may hold anything.
        let fields: Vec<&str> = stat.rsplit_once(')')?.1.split_whitespace().collect();
        let state = fields.first()?.chars().next()?;
        let number = |index: usize| fields.get(index)?.parse::<u64>().ok();
        (!matches!(state, 'Z' | 'X')).then_some(ProcStat { state, used: number(11)? + number(12)?, started: number(19)? })
    }

    /// Stopped by SIGSTOP or its like. One that a debugger holds is not: SIGCONT would not continue it.
    pub fn is_stopped(&self) -> bool {
        self.state == 'T'
    }

    /// Whether it has used its processor since, or waits for a disk.
    pub fn has_worked_since(&self, before: &ProcStat) -> bool {
        self.state == 'D' || self.used > before.used
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use nix::sys::signal::{Signal, kill};
    use nix::unistd::Pid;

    #[test]
    fn a_process_is_seen_to_be_stopped_to_live_and_to_be_gone() -> Result<(), Box<dyn std::error::Error>> {
        let mut child = std::process::Command::new("sleep").arg("600").spawn()?;
        let pid = child.id() as i32;
        let wait_for = |stopped: bool| {
            (0..500).any(|_| {
                std::thread::sleep(std::time::Duration::from_millis(10));
                ProcStat::of(pid).is_some_and(|s| s.is_stopped() == stopped)
            })
        };
        kill(Pid::from_raw(pid), Signal::SIGSTOP)?;
        assert!(wait_for(true));
        let before = ProcStat::of(pid).ok_or("it is gone")?;
        kill(Pid::from_raw(pid), Signal::SIGCONT)?;
        assert!(wait_for(false));
        assert_eq!(ProcStat::of(pid).map(|s| s.started), Some(before.started));
        child.kill()?;
        child.wait()?;
        assert_eq!(ProcStat::of(pid), None);
        Ok(())
    }
}
