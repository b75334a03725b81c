//! `backdrive bridge`: a local graph over shared memory, seen and joined over ROS 2. The work is that of [`backdrive_launch::bridge`].

use crate::cli;
use crate::failure::{Failure, code};
use crate::interrupt;
use crate::output;
use backdrive_launch::bridge::{Bridged, Crossed, Options, bridge as carried};
use serde_json::json;

/// Carries the topics of a run until it ends or Ctrl-C. Exit code 0, or 4 when messages were lost on the way.
pub fn bridge(asked: &cli::Bridge) -> Result<u8, Failure> {
    let options = Options { run: asked.run.clone(), both_ways: asked.both_ways, network: asked.network.asked() };
    let stop = interrupt::heard()?;
    let Bridged { run, out, back } = carried(&options, &stop, &|told| output::note(told))?;
    if asked.json {
        let told = |c: Crossed| json!({ "messages": c.messages, "lost": c.lost });
        output::line(json!({ "run": run, "out": told(out), "in": told(back) }))?;
    } else {
        output::line(format_args!("out      {} messages, {} lost before the bridge", out.messages, out.lost))?;
        output::line(format_args!("in       {} messages, {} lost before the bridge", back.messages, back.lost))?;
    }
    Ok(if out.lost + back.lost > 0 { code::LOST_DATA } else { 0 })
}
