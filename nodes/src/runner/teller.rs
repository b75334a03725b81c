//! Publishes events and status, and passes them on to whoever watches.

use super::control::Told;
use super::stage::Output;
use crate::book::{Book, NO_VALUE};
use crate::protocol::{NodeStatus, STRANGER};
use crate::transport::TransportError;
use backdrive_control::core::Events;
use backdrive_msgs::Message;
use backdrive_msgs::text::Text;

/// Publishes events and status, and passes them on to whoever watches.
pub(super) struct Teller {
    pub(super) book: Book,
    pub(super) events: Output,
    pub(super) status: Output,
    pub(super) noted: Events,
    pub(super) report: NodeStatus,
    /// When a broken connection was last reported, ns: once a second is enough.
    pub(super) broken_told_at: i64,
}

impl Teller {
    pub(super) fn drain(&mut self, step: u64, stamp_ns: i64, tell: &mut dyn FnMut(Told)) {
        let Teller { book, events, noted, .. } = self;
        book.drain(step, stamp_ns, noted, |_, event| {
            // An event that cannot be published is still reported.
            let _ = events.publisher.send(&Message::Event(event));
            tell(Told::Event(event));
        });
    }

    #[allow(clippy::too_many_arguments)]
    pub(super) fn tell_event(
        &mut self,
        step: u64,
        stamp_ns: i64,
        kind: &str,
        value: f64,
        severity: u32,
        text: Text<128>,
        tell: &mut dyn FnMut(Told),
    ) {
        let event = self.book.event(step, stamp_ns, kind, value, severity, text);
        let _ = self.events.publisher.send(&Message::Event(event));
        tell(Told::Event(event));
    }

    /// Real time goes on without a message that could not be moved, and both clocks without a stranger's. Returns "not ready".
    pub(super) fn tell_broken(&mut self, step: u64, stamp_ns: i64, error: &TransportError, tell: &mut dyn FnMut(Told)) -> bool {
        if let TransportError::Stranger { refused, moves, .. } = error {
            let (severity, text) = (1 + u32::from(*moves), Text::new(&error.to_string()));
            self.tell_event(step, stamp_ns, STRANGER, *refused as f64, severity, text, tell);
            return false;
        }
        if stamp_ns.saturating_sub(self.broken_told_at) >= 1_000_000_000 {
            self.broken_told_at = stamp_ns;
            self.tell_event(step, stamp_ns, "connection_broken", NO_VALUE, 2, Text::new(&error.to_string()), tell);
        }
        false
    }
}
