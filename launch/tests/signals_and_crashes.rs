//! What signals do to a supervisor, and what becomes of its processes when it is killed.

mod common;

use backdrive_launch::{Cause, RunHome};
use common::{Outcome, processes_of, report_of, runs_in, send, shm_of, supervisor, until, wait_for_start};
use nix::sys::signal::Signal;
use std::io::{BufRead, Read};
use std::time::Duration;

#[test]
fn a_signal_ends_the_run_in_order() -> Outcome {
    for signal in [Signal::SIGINT, Signal::SIGTERM, Signal::SIGHUP] {
        let temp = tempfile::tempdir()?;
        let (home, bag) = (temp.path().join("runs"), temp.path().join("bag"));
        let mut child = supervisor(&home, &format!("realtime none master / slave / recorder,records bag {}", bag.display()))?;
        let mut errors = wait_for_start(&mut child)?;
        std::thread::spawn(move || errors.read_to_end(&mut Vec::new()));
        send(&child, signal)?;
        let report = report_of(&mut child)?;
        assert_eq!(report.cause, Cause::Stopped { by: signal.as_str().to_string() });
        assert!(report.orderly());
        assert!(report.nodes.iter().all(|n| n.end == "done"));
        assert_eq!(std::fs::read_to_string(&bag)?, "recorder finished");
        assert_eq!(runs_in(&home), [""; 0]);
        assert_eq!(processes_of(&home), [0; 0]);
    }
    Ok(())
}

#[test]
fn a_second_interrupt_kills() -> Outcome {
    let temp = tempfile::tempdir()?;
    let mut child = supervisor(temp.path(), "realtime none master / slave deaf stubborn / recorder,records deaf")?;
    let mut errors = wait_for_start(&mut child)?;
    let (told, heard) = std::sync::mpsc::channel();
    std::thread::spawn(move || {
        let mut line = String::new();
        while errors.read_line(&mut line).is_ok_and(|n| n > 0) {
            let _ = told.send(std::mem::take(&mut line));
        }
    });
    send(&child, Signal::SIGINT)?;
    while !heard.recv_timeout(Duration::from_secs(60))?.contains("Ctrl-C kills") {}
    send(&child, Signal::SIGINT)?;
    let report = report_of(&mut child)?;
    assert_eq!(report.cause, Cause::Stopped { by: "SIGINT".to_string() });
    assert!(report.killed.contains(&"slave".to_string()));
    assert_eq!(runs_in(temp.path()), [""; 0]);
    assert_eq!(processes_of(temp.path()), [0; 0]);
    Ok(())
}

#[test]
fn it_cannot_be_suspended() -> Outcome {
    let temp = tempfile::tempdir()?;
    let mut child = supervisor(temp.path(), "realtime 1500 master steps 1500")?;
    let mut errors = wait_for_start(&mut child)?;
    send(&child, Signal::SIGTSTP)?;
    let mut told = String::new();
    errors.read_to_string(&mut told)?;
    assert!(told.contains("cannot be suspended"), "{told}");
    assert_eq!(report_of(&mut child)?.cause, Cause::Completed);
    Ok(())
}

#[test]
fn nothing_outlives_a_killed_supervisor() -> Outcome {
    let temp = tempfile::tempdir()?;
    let home = temp.path();
    // One that heeds neither the end of its input nor SIGTERM, and a recorder that heeds the first.
    let bag = temp.path().with_extension("bag");
    let graph = format!("realtime none master deaf stubborn / slave / recorder,records bag {}", bag.display());
    let mut child = supervisor(home, &graph)?;
    wait_for_start(&mut child)?;
    let ids = runs_in(home);
    assert_eq!(ids.len(), 1);
    assert_eq!(processes_of(home).len(), 4);
    child.kill()?;
    child.wait()?;
    until("its processes have ended", || processes_of(home).is_empty())?;
    assert_eq!(runs_in(home), ids);
    assert_eq!(shm_of(&ids).len(), 3);

    let swept = RunHome::at(home).clean();
    assert_eq!(swept.removed.len(), 1);
    assert_eq!(swept.removed[0].shm.len(), 3);
    assert_eq!(runs_in(home), [""; 0]);
    assert_eq!(shm_of(&ids), [""; 0]);
    let _ = std::fs::remove_file(bag);
    Ok(())
}

#[test]
fn the_next_start_removes_what_a_killed_supervisor_has_left_and_spares_the_living() -> Outcome {
    let temp = tempfile::tempdir()?;
    let home = temp.path();
    let mut dead = supervisor(home, "realtime none master / recorder,records deaf stubborn")?;
    wait_for_start(&mut dead)?;
    let dead_ids = runs_in(home);
    let mut living = supervisor(home, "realtime none master / slave")?;
    let errors = wait_for_start(&mut living)?;
    let living_ids: Vec<String> = runs_in(home).into_iter().filter(|id| !dead_ids.contains(id)).collect();
    dead.kill()?;
    dead.wait()?;

    // The recorder hangs and heeds nothing: the sweep ends it.
    let mut next = supervisor(home, "realtime 200 master steps 200")?;
    assert_eq!(report_of(&mut next)?.cause, Cause::Completed);
    assert_eq!(runs_in(home), living_ids);
    assert_eq!(shm_of(&dead_ids), [""; 0]);
    assert_eq!(shm_of(&living_ids).len(), 2);
    assert_eq!(processes_of(home).len(), 3);

    drop(errors);
    send(&living, Signal::SIGINT)?;
    assert!(report_of(&mut living)?.orderly());
    assert_eq!(runs_in(home), [""; 0]);
    Ok(())
}
