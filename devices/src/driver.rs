//! The thread that owns a bus: it writes the newest goals and reads the joints, once for each request of the loop, and takes the force away where no
//! request comes any more.

use crate::bus::{Bus, Counts, Goal, Reading};
use crate::stopwatch::Stopwatch;
use backdrive_msgs::MAX_AXES;
use std::sync::{Arc, Condvar, Mutex, MutexGuard, PoisonError};
use std::thread::JoinHandle;
use std::time::{Duration, Instant};

/// What the loop and the thread share.
struct Shared {
    goals: [Goal; MAX_AXES],
    /// Counts requests of the loop.
    requests: u64,
    asked_at: Instant,
    readings: [Reading; MAX_AXES],
    /// Counts cycles that are done.
    cycles: u64,
    /// Why there is no bus any more.
    gone: Option<String>,
    stop: bool,
    health: Health,
}

/// How the bus is doing.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct Health {
    /// Cycles since the start.
    pub cycles: u64,
    /// Requests of the loop that found the bus still busy with an earlier one.
    pub missed: u64,
    /// What happened on the wire since the start of the run.
    pub counts: Counts,
    /// Cycles per second over the last second; NaN before.
    pub rate_hz: f64,
    /// 99th percentile of the difference of a period from the median period over the last second, s; NaN before.
    pub jitter_p99_s: f64,
    /// Median time from the first byte sent to the last one received, s, over the last second; NaN before.
    pub round_trip_p50_s: f64,
    /// 99th percentile of it.
    pub round_trip_p99_s: f64,
    /// The shortest possible time of a cycle by the bytes on the wire, s.
    pub wire_s: f64,
}

/// The loop's end of a bus.
pub struct Driver {
    shared: Arc<(Mutex<Shared>, Condvar)>,
    thread: Option<JoinHandle<Box<dyn Bus>>>,
    seen: u64,
}

fn locked(shared: &(Mutex<Shared>, Condvar)) -> MutexGuard<'_, Shared> {
    shared.0.lock().unwrap_or_else(PoisonError::into_inner)
}

/// What a request finds.
#[derive(Debug, Clone, Copy, Default)]
pub struct Newest {
    /// What was read since the last request; `None` where no cycle ended since.
    pub readings: Option<[Reading; MAX_AXES]>,
    /// Whether the bus still works.
    pub is_there: bool,
}

impl Driver {
    /// Takes a bus whose motors are on. A torque that is not renewed falls to zero within `patience` after half of it.
    pub fn start(bus: Box<dyn Bus>, present: &[Reading], patience: Duration) -> Driver {
        let mut readings = [Reading::default(); MAX_AXES];
        readings.iter_mut().zip(present).for_each(|(kept, read)| *kept = *read);
        let shared = Arc::new((
            Mutex::new(Shared {
                goals: [Goal::Keep; MAX_AXES],
                requests: 0,
                asked_at: Instant::now(),
                readings,
                cycles: 0,
                gone: None,
                stop: false,
                health: Health { wire_s: bus.wire_time().as_secs_f64(), ..Health::fresh() },
            }),
            Condvar::new(),
        ));
        let theirs = Arc::clone(&shared);
        let thread = std::thread::Builder::new().name("bus".to_string()).spawn(move || serve(bus, &theirs, patience)).ok();
        Driver { shared, thread, seen: 0 }
    }

    /// Hands over goals, starts a cycle, and takes what the last one read. Never waits for the wire.
    pub fn exchange(&mut self, goals: &[Goal]) -> Newest {
        let mut shared = locked(&self.shared);
        let is_new = shared.cycles > self.seen;
        self.seen = shared.cycles;
        for (kept, new) in shared.goals.iter_mut().zip(goals) {
            *kept = match (*new, *kept) {
                // A position stays wanted, and is sent again, so that a frame that was lost does no harm. A torque holds for one request.
                (Goal::Keep, Goal::Position(position)) => Goal::Position(position),
                (Goal::Keep, Goal::Effort(_)) => Goal::Effort(0.0),
                (new, _) => new,
            };
        }
        shared.requests += 1;
        shared.asked_at = Instant::now();
        let newest = Newest { readings: is_new.then_some(shared.readings), is_there: shared.gone.is_none() };
        drop(shared);
        self.shared.1.notify_one();
        newest
    }

    /// How the bus is doing.
    pub fn health(&self) -> Health {
        locked(&self.shared).health
    }

    /// Why the bus is gone, if it is.
    pub fn gone(&self) -> Option<String> {
        locked(&self.shared).gone.clone()
    }

    /// Turns the motors off and gives the bus back.
    pub fn stop(&mut self) -> Option<Box<dyn Bus>> {
        locked(&self.shared).stop = true;
        self.shared.1.notify_one();
        self.thread.take().and_then(|thread| thread.join().ok())
    }
}

impl Drop for Driver {
    fn drop(&mut self) {
        drop(self.stop());
    }
}

impl Health {
    /// Of a bus that has done nothing yet.
    pub fn fresh() -> Health {
        Health { rate_hz: f64::NAN, jitter_p99_s: f64::NAN, round_trip_p50_s: f64::NAN, round_trip_p99_s: f64::NAN, ..Health::default() }
    }
}

fn serve(mut bus: Box<dyn Bus>, shared: &(Mutex<Shared>, Condvar), patience: Duration) -> Box<dyn Bus> {
    // Ordinary rights do not allow it everywhere; the loop reports that for the process.
    let _ = nix::sys::prctl::set_timerslack(1);
    let before = bus.counts();
    let joints = bus.joints().min(MAX_AXES);
    let mut readings = [Reading::default(); MAX_AXES];
    let mut stopwatch = Stopwatch::default();
    let mut served = 0u64;
    loop {
        let (mut goals, silence, requests) = {
            let mut state = locked(shared);
            loop {
                if state.stop {
                    drop(state);
                    let _ = bus.release();
                    return bus;
                }
                let silence = state.asked_at.elapsed();
                if state.requests > served || silence > patience / 2 {
                    break (state.goals, silence, state.requests);
                }
                let left = (patience / 2).saturating_sub(silence) + Duration::from_micros(100);
                state = shared.1.wait_timeout(state, left).unwrap_or_else(PoisonError::into_inner).0;
            }
        };
        let is_new = requests > served;
        let skipped = requests.saturating_sub(served + 1);
        served = requests;
        if silence > patience / 2 {
            fade(&mut goals[..joints], silence, patience);
        } else if !is_new {
            continue;
        }
        let began = Instant::now();
        let done = bus.write(&goals[..joints]).and_then(|()| bus.read(&mut readings[..joints]));
        let ended = Instant::now();
        let mut state = locked(shared);
        match done {
            Ok(()) => {
                state.readings = readings;
                state.cycles += 1;
                stopwatch.lap(began, ended);
                let times = stopwatch.times();
                let health = &mut state.health;
                (health.cycles, health.missed) = (health.cycles + 1, health.missed + skipped);
                health.counts = bus.counts().since(before);
                (health.rate_hz, health.jitter_p99_s) = (times.rate_hz, times.jitter_p99_s);
                (health.round_trip_p50_s, health.round_trip_p99_s) = (times.round_trip_p50_s, times.round_trip_p99_s);
            }
            Err(error) => {
                state.gone = Some(error.to_string());
                drop(state);
                let _ = bus.release();
                return bus;
            }
        }
        if silence > patience / 2 {
            drop(state);
            // Nobody asks: the wire has time.
            std::thread::sleep(Duration::from_millis(2));
        }
    }
}

/// Takes torque away where the loop is silent: all of it until half the patience, none after all of it. A position is held.
fn fade(goals: &mut [Goal], silence: Duration, patience: Duration) {
    let share = 2.0 * (1.0 - silence.as_secs_f64() / patience.as_secs_f64().max(1e-6));
    for goal in goals {
        match goal {
            Goal::Effort(effort) => *effort *= share.clamp(0.0, 1.0),
            Goal::Position(_) => *goal = Goal::Keep,
            Goal::Keep => {}
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_torque_that_is_not_renewed_is_gone_after_the_patience() {
        let patience = Duration::from_millis(20);
        let after = |ms: u64| {
            let mut goals = [Goal::Effort(2.0), Goal::Position(0.3)];
            fade(&mut goals, Duration::from_millis(ms), patience);
            assert_eq!(goals[1], Goal::Keep);
            match goals[0] {
                Goal::Effort(effort) => effort,
                _ => f64::NAN,
            }
        };
        assert_eq!((after(10), after(20), after(200)), (2.0, 0.0, 0.0));
        assert!((after(15) - 1.0).abs() < 1e-9);
    }
}
