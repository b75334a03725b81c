//! Runs of toy nodes from start to end, and their remains: nothing.

#[path = "../../tests/common/naming.rs"]
mod naming;

mod common;

use backdrive_launch::{Cause, Command, LaunchError, OnDeath, Plan, RunReport, SuperviseOptions, supervise_plan};
use backdrive_nodes::stage::Clock;
use common::{Outcome, options, plan, processes_of, recorder, restarting, runs_in, shm_of, toy};
use naming::assert_names;
use std::path::Path;
use std::time::Duration;

/// Runs it, and makes sure that nothing is left.
async fn run(home: &Path, plan: Plan, options: SuperviseOptions) -> Result<RunReport, LaunchError> {
    let result = supervise_plan(plan, options).await;
    assert_eq!(runs_in(home), [""; 0], "run directories are left");
    assert_eq!(processes_of(home), [0; 0], "processes are left");
    if let Ok(report) = &result {
        assert_eq!(shm_of(std::slice::from_ref(&report.id)), [""; 0], "shared memory is left");
    }
    assert_eq!(zombies(), 0);
    result
}

/// Children of this process that have ended and were not waited for. Tests run side by side, so one may be seen in passing.
fn zombies() -> usize {
    let this = std::process::id().to_string();
    let count = || {
        let Ok(entries) = std::fs::read_dir("/proc") else { return 0 };
        let stats = entries.flatten().filter_map(|e| std::fs::read_to_string(e.path().join("stat")).ok());
        stats.filter(|s| s.rsplit_once(')').is_some_and(|(_, rest)| rest.starts_with(&format!(" Z {this} ")))).count()
    };
    for _ in 0..200 {
        if count() == 0 {
            return 0;
        }
        std::thread::sleep(Duration::from_millis(20));
    }
    count()
}

#[tokio::test]
async fn every_node_does_its_steps() -> Outcome {
    let temp = tempfile::tempdir()?;
    let bag = temp.path().join("bag");
    let nodes = vec![toy("master", "steps 400"), toy("slave", "steps 400"), recorder(&format!("bag {}", bag.display()))];
    let home = temp.path().join("runs");
    let report = run(&home, plan(Clock::Lockstep, Some(400), nodes), options(&home)).await?;
    assert_eq!(report.cause, Cause::Completed);
    assert!(report.orderly());
    assert_eq!(report.steps, 400);
    assert!(report.duration_s > 0.3 && report.steps_per_s > 0.0);
    assert_eq!(report.loop_node.as_deref(), Some("master"));
    assert_eq!((report.loop_p50_us, report.loop_p99_us), (Some(40.0), Some(90.0)));
    assert_eq!((report.lost, report.unrecorded, report.missed_deadlines), (0, Some(0), 0));
    assert!(report.recorded.is_some());
    assert_eq!(std::fs::read_to_string(&bag)?, "recorder finished");
    assert!(report.nodes.iter().all(|n| n.end == "done" && n.restarts == 0));
    Ok(())
}

#[tokio::test]
async fn who_is_not_ready_is_named() -> Outcome {
    let temp = tempfile::tempdir()?;
    let nodes = vec![toy("master", ""), toy("slave", "lonely"), toy("hand", "mute")];
    let options = SuperviseOptions { ready_timeout: Duration::from_secs(2), ..options(temp.path()) };
    let told = run(temp.path(), plan(Clock::Lockstep, None, nodes), options).await.err().map(|e| e.to_string()).unwrap_or_default();
    assert_names(&told, &["slave", "/slave/measured_js"]);
    assert_names(&told, &["hand"]);
    assert!(!told.contains("master:"), "{told}");
    Ok(())
}

#[tokio::test]
async fn a_node_that_ends_before_the_start_is_named_with_its_words() -> Outcome {
    let temp = tempfile::tempdir()?;
    let nodes = vec![toy("master", ""), toy("slave", "early")];
    let error = run(temp.path(), plan(Clock::Lockstep, None, nodes), options(temp.path())).await.err();
    let Some(LaunchError::DiedAtStart { node, how, stderr }) = error else { return Err(format!("{error:?}").into()) };
    assert_eq!((node.as_str(), how.as_str()), ("slave", "ended with exit code 3"));
    assert_eq!(stderr, ["no such device"]);
    Ok(())
}

#[tokio::test]
async fn a_program_that_is_not_there_is_named() -> Outcome {
    let temp = tempfile::tempdir()?;
    let mut nodes = vec![toy("master", ""), toy("slave", "")];
    nodes[1].command = Some(vec!["/nonexistent/driver".to_string()]);
    let told =
        run(temp.path(), plan(Clock::Lockstep, None, nodes), options(temp.path())).await.err().map(|e| e.to_string()).unwrap_or_default();
    assert_names(&told, &["`slave`", "/nonexistent/driver"]);
    Ok(())
}

#[tokio::test]
async fn in_lockstep_a_crash_stops_the_run() -> Outcome {
    let temp = tempfile::tempdir()?;
    let bag = temp.path().join("bag");
    let nodes = vec![toy("master", ""), toy("slave", "crash 200"), recorder(&format!("bag {}", bag.display()))];
    let home = temp.path().join("runs");
    let report = run(&home, plan(Clock::Lockstep, Some(1_000_000), nodes), options(&home)).await?;
    assert_eq!(report.cause, Cause::NodeDied { node: "slave".to_string(), how: "was killed by signal 6 (SIGABRT)".to_string() });
    assert!(!report.orderly());
    let death = report.deaths.first().ok_or("no death")?;
    assert_eq!((death.signal, death.recovered), (Some(6), false));
    assert_eq!(death.stderr, ["about to crash"]);
    assert_eq!(report.nodes[0].end, "done");
    // The recorder went last and finished its file.
    assert_eq!(std::fs::read_to_string(&bag)?, "recorder finished");
    Ok(())
}

#[tokio::test]
async fn a_node_that_fails_gives_its_reason_and_code() -> Outcome {
    let temp = tempfile::tempdir()?;
    let nodes = vec![toy("master", "fail 200"), toy("slave", "")];
    let report = run(temp.path(), plan(Clock::Lockstep, None, nodes), options(temp.path())).await?;
    assert_eq!(report.cause, Cause::NodeFailed { node: "master".to_string(), error: "the encoder is silent".to_string(), code: 5 });
    Ok(())
}

#[tokio::test]
async fn in_real_time_a_crashed_node_comes_back() -> Outcome {
    let temp = tempfile::tempdir()?;
    let once = temp.path().join("once");
    let slave = restarting("slave", &format!("crash 200 once {} steps 2500", once.display()));
    let home = temp.path().join("runs");
    let report = run(&home, plan(Clock::Realtime, Some(2500), vec![toy("master", "steps 2500"), slave]), options(&home)).await?;
    assert_eq!(report.cause, Cause::Completed);
    assert!(report.orderly());
    assert_eq!(report.deaths.len(), 1);
    assert!(report.deaths[0].recovered);
    assert_eq!(report.nodes[1].restarts, 1);
    assert!(report.events.iter().any(|e| e.kind == "node_restarted"));
    Ok(())
}

#[tokio::test]
async fn a_node_that_always_crashes_is_given_up_and_the_others_go_on() -> Outcome {
    let temp = tempfile::tempdir()?;
    let nodes = vec![toy("master", "steps 3000"), restarting("slave", "exit 0")];
    let options = SuperviseOptions { max_restarts: 2, ..options(temp.path()) };
    let report = run(temp.path(), plan(Clock::Realtime, Some(3000), nodes), options).await?;
    assert_eq!(report.deaths.len(), 3);
    assert_eq!(report.nodes[1].restarts, 2);
    assert_eq!(report.steps, 3000);
    assert_eq!(report.cause, Cause::NodeDied { node: "slave".to_string(), how: "ended with exit code 7".to_string() });
    Ok(())
}

#[tokio::test]
async fn in_real_time_the_recorder_is_needed_unless_said_otherwise() -> Outcome {
    let temp = tempfile::tempdir()?;
    let nodes = || vec![toy("master", "steps 1500"), recorder("exit 100")];
    let report = run(temp.path(), plan(Clock::Realtime, Some(1500), nodes()), options(temp.path())).await?;
    assert!(report.steps < 1500);
    let going_on = SuperviseOptions { on_death: OnDeath::Continue, ..options(temp.path()) };
    let report = run(temp.path(), plan(Clock::Realtime, Some(1500), nodes()), going_on).await?;
    assert_eq!(report.steps, 1500);
    assert!(matches!(report.cause, Cause::NodeDied { ref node, .. } if node == "recorder"));
    Ok(())
}

#[tokio::test]
async fn who_does_not_end_when_asked_is_killed() -> Outcome {
    let temp = tempfile::tempdir()?;
    let nodes = vec![toy("master", "steps 300"), toy("deaf", "deaf"), toy("stubborn", "deaf stubborn")];
    let report = run(temp.path(), plan(Clock::Realtime, Some(300), nodes), options(temp.path())).await?;
    let mut killed = report.killed.clone();
    killed.sort();
    assert_eq!(killed, ["deaf", "stubborn"]);
    assert_eq!(report.cause, Cause::Completed);
    assert!(!report.orderly());
    Ok(())
}

#[tokio::test]
async fn what_a_node_has_started_ends_with_it() -> Outcome {
    let temp = tempfile::tempdir()?;
    let nodes = vec![toy("master", "steps 300"), toy("slave", "steps 300 breed")];
    let report = run(temp.path(), plan(Clock::Realtime, Some(300), nodes), options(temp.path())).await?;
    assert_eq!(report.cause, Cause::Completed);
    Ok(())
}

#[tokio::test]
async fn a_talkative_node_holds_nobody() -> Outcome {
    let temp = tempfile::tempdir()?;
    let nodes = vec![toy("master", "steps 500"), toy("slave", "steps 500 chatter 20000 events 12000 stray")];
    let report = run(temp.path(), plan(Clock::Realtime, Some(500), nodes), options(temp.path())).await?;
    assert_eq!(report.cause, Cause::Completed);
    assert_eq!(report.events.len(), 10_000);
    assert!(report.events_left_out >= 2_000);
    let first = report.events.iter().find(|e| e.node == "slave").ok_or("no event")?;
    assert_eq!((first.text.as_str(), first.value, first.step), ("event 0", Some(1.5), Some(0)));
    Ok(())
}

#[tokio::test]
async fn one_that_ends_early_ends_the_others_in_lockstep() -> Outcome {
    let temp = tempfile::tempdir()?;
    let nodes = vec![toy("master", ""), toy("hand", "steps 200")];
    let report = run(temp.path(), plan(Clock::Lockstep, Some(1_000_000), nodes), options(temp.path())).await?;
    assert_eq!(report.cause, Cause::EndedEarly { node: "hand".to_string(), steps: 200 });
    Ok(())
}

#[tokio::test]
async fn gains_reach_the_node_that_has_them_also_when_it_comes_back() -> Outcome {
    let temp = tempfile::tempdir()?;
    let (send, commands) = tokio::sync::mpsc::channel(4);
    let once = temp.path().join("once");
    let mut scaling = restarting("scaling", &format!("exit 300 once {} steps 2500", once.display()));
    scaling.has_gains = true;
    let home = temp.path().join("runs");
    let options = SuperviseOptions { commands: Some(commands), ..options(&home) };
    send.send(Command::Gains { mu: f64::NAN, lambda: 1.0, ramp_s: 0.0 }).await?;
    send.send(Command::Gains { mu: 0.5, lambda: 2.0, ramp_s: 0.1 }).await?;
    drop(send);
    let report = run(&home, plan(Clock::Realtime, Some(2500), vec![toy("master", "steps 2500"), scaling]), options).await?;
    assert!(report.events.iter().any(|e| e.kind == "gains_refused"));
    assert_eq!(report.nodes[1].restarts, 1);
    let told: Vec<&str> = report.events.iter().filter(|e| e.kind == "gains").map(|e| e.text.as_str()).collect();
    assert_eq!(told, ["0.5 2", "0.5 2"]);
    Ok(())
}

#[tokio::test]
async fn two_runs_side_by_side_do_not_touch_each_other() -> Outcome {
    let temp = tempfile::tempdir()?;
    let nodes = |steps: u64| vec![toy("master", &format!("steps {steps}")), toy("slave", &format!("steps {steps}"))];
    let short = supervise_plan(plan(Clock::Realtime, Some(500), nodes(500)), options(temp.path()));
    let long = supervise_plan(plan(Clock::Realtime, Some(2500), nodes(2500)), options(temp.path()));
    let (short, long) = tokio::join!(short, long);
    let (short, long) = (short?, long?);
    assert_ne!(short.id, long.id);
    assert!(short.orderly() && long.orderly());
    assert_eq!((short.steps, long.steps), (500, 2500));
    assert_eq!(runs_in(temp.path()), [""; 0]);
    Ok(())
}
