//! Between who brings news and who is shown it: everything of the past that a new viewer needs, and a channel for what comes.

use axum::extract::ws::Message as Frame;
use serde_json::Value;
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use tokio::sync::broadcast;

/// Frames that a slow viewer may be behind: about four seconds. Then it loses some, and is sent a note of that.
const QUEUE: usize = 256;

/// What a new viewer is sent first.
pub(crate) trait Past: Send {
    /// The frames, in their order.
    fn frames(&self) -> Vec<Frame>;
}

/// Where news come together.
pub(crate) struct Hub<P> {
    past: Mutex<P>,
    news: broadcast::Sender<Frame>,
}

impl<P: Past> Hub<P> {
    pub fn new(past: P) -> Arc<Hub<P>> {
        Arc::new(Hub { past: Mutex::new(past), news: broadcast::channel(QUEUE).0 })
    }

    /// The past, which changes only while this is held.
    pub fn past(&self) -> MutexGuard<'_, P> {
        self.past.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Sends news to every viewer. To be called while the past that has them is held, so that none gets them twice or never.
    pub fn send(&self, frame: Frame) {
        // Nobody may be looking.
        let _ = self.news.send(frame);
    }

    /// A new viewer: the past, and what comes.
    pub fn join(&self) -> (Vec<Frame>, broadcast::Receiver<Frame>) {
        let past = self.past();
        (past.frames(), self.news.subscribe())
    }
}

/// A value as a frame.
pub(crate) fn text(value: &Value) -> Frame {
    Frame::Text(value.to_string().into())
}
