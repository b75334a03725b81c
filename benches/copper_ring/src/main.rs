//! Five tasks in copper (crate cu29), one after the other, 232 bytes handed on: what one process with all five takes per loop.
//!
//!     cargo run --release [-- LOOPS RUNS]
//!
//! A task graph of copper has no circles, so the last task leaves its message for the first one of the next iteration.
//! Nothing is logged to the disk.

use cu29::prelude::*;
use std::sync::Mutex;
use std::time::Instant;

/// As many bytes as a sample of backdrive.
type Words = [u64; 29];

/// From the last task to the first.
static BACK: Mutex<Words> = Mutex::new([0; 29]);

fn back() -> std::sync::MutexGuard<'static, Words> {
    BACK.lock().unwrap_or_else(std::sync::PoisonError::into_inner)
}

#[derive(Reflect)]
struct First;

impl Freezable for First {}

impl CuSrcTask for First {
    type Resources<'r> = ();
    type Output<'m> = output_msg!(Words);

    fn new(_: Option<&ComponentConfig>, _: Self::Resources<'_>) -> CuResult<Self> {
        Ok(First)
    }

    fn process(&mut self, _: &CuContext, output: &mut Self::Output<'_>) -> CuResult<()> {
        output.set_payload(*back());
        Ok(())
    }
}

/// Adds one to the first word, so that the number of hops can be checked.
#[derive(Reflect)]
struct Pass;

impl Freezable for Pass {}

impl CuTask for Pass {
    type Resources<'r> = ();
    type Input<'m> = input_msg!(Words);
    type Output<'m> = output_msg!(Words);

    fn new(_: Option<&ComponentConfig>, _: Self::Resources<'_>) -> CuResult<Self> {
        Ok(Pass)
    }

    fn process(&mut self, _: &CuContext, input: &Self::Input<'_>, output: &mut Self::Output<'_>) -> CuResult<()> {
        let mut words = input.payload().copied().unwrap_or_default();
        words[0] += 1;
        output.set_payload(words);
        Ok(())
    }
}

#[derive(Reflect)]
struct Last;

impl Freezable for Last {}

impl CuSinkTask for Last {
    type Resources<'r> = ();
    type Input<'m> = input_msg!(Words);

    fn new(_: Option<&ComponentConfig>, _: Self::Resources<'_>) -> CuResult<Self> {
        Ok(Last)
    }

    fn process(&mut self, _: &CuContext, input: &Self::Input<'_>) -> CuResult<()> {
        *back() = input.payload().copied().unwrap_or_default();
        Ok(())
    }
}

#[copper_runtime(config = "copperconfig.ron")]
struct Ring {}

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let mut numbers = std::env::args().skip(1).map(|a| a.parse::<usize>());
    let loops = numbers.next().transpose()?.unwrap_or(30_000).max(1);
    let runs = numbers.next().transpose()?.unwrap_or(10).max(1);
    let folder = tempfile::tempdir()?;
    let app = Ring::builder().with_log_path(folder.path().join("ring.copper"), Some(16 << 20))?.build()?;
    let mut running = app.start()?;
    let (mut rates, mut medians) = (Vec::new(), Vec::new());
    for _ in 0..runs {
        for _ in 0..loops / 10 {
            running.run_one_iteration()?;
        }
        let before = back()[0];
        let begun = Instant::now();
        let mut times = Vec::with_capacity(loops);
        let mut last = begun;
        for _ in 0..loops {
            running.run_one_iteration()?;
            let now = Instant::now();
            times.push(now - last);
            last = now;
        }
        let went = back()[0] - before;
        if went != 3 * loops as u64 {
            return Err(format!("a message made {went} hops between tasks that pass it on, not {}", 3 * loops).into());
        }
        rates.push(loops as f64 / (last - begun).as_secs_f64());
        times.sort();
        medians.push(times[loops / 2].as_secs_f64() * 1e6);
    }
    rates.sort_by(f64::total_cmp);
    medians.sort_by(f64::total_cmp);
    println!("copper, five tasks in one process: {:.0} loops/s, p50 {:.2} us", rates[runs / 2], medians[runs / 2]);
    drop(running.stop()?);
    Ok(())
}
