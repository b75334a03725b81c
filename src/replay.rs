//! `backdrive replay`: the recorded operator in, everything else executed again. The work is that of [`backdrive_runs::replay`].

use crate::cli;
use crate::failure::Failure;
use crate::offered::with_recover;
use crate::output;
use crate::progress::Terminal;
use crate::run::{next, tell};
use backdrive_pages::run::{Heard, page};
use backdrive_runs::replay::Replay;

/// Replays a bag in lockstep, in this process.
pub fn replay(options: &cli::Replay) -> Result<u8, Failure> {
    let path = &options.recording;
    let terminal = Terminal::default();
    let replay = Replay::read(path, &options.changes.overrides(None), &terminal)?;
    if replay.is_cut {
        output::note(format_args!("warning: {}: {}", path.display(), with_recover("was not closed; its content is replayed", path)));
    }
    if let Some(html) = &options.result.html {
        output::writable(html)?;
    }
    let mut heard = Heard::of(&replay.graph);
    let drawn = options.result.html.is_some();
    let done = replay.run(&terminal, &mut |topic, message| {
        if drawn {
            heard.take(topic, message);
        }
    })?;
    let steps = next(&done, &replay.graph, Some(path));
    let page = options.result.html.as_deref().map(|html| (html, page(&done, &replay.graph, &heard, &steps)));
    tell(&done, page, options.result.json, &steps)
}
