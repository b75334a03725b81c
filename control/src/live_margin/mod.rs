//! The stability margin of the running loop, estimated from the loop itself.
//!
//! **With a dither** `d` on the force channel: the backward path sends `F_f(k) = lambda F_s(k-1) + d(k)` and knows all three exactly. So
//! `P = S_(d,F_s) / S_(d,F_f)` is the response once round the loop from the force sent to the force felt, for any hand and any gain. `L = lambda P`,
//! and the stability limit is where `lambda P` passes through `+1` ([`crate::margins`]). The three are demodulated at up to 40 lines from 6.7 to 250
//! Hz where the dither has power, in Hann windows of 0.6 s that overlap by half. Goertzel's recursion runs on their second differences, which removes
//! the slow force of the hand before it leaks. The newest eight windows count, without those that hold an impact. The residual `F_s - P F_f` over the
//! windows gives each line's standard deviation (Bendat & Piersol, for an instrumental variable). A line with too much uncertainty might hide a lower
//! limit, and then only a bound is reported: with `|P| + 2 sd < 1 / lambda` at every line no critical gain is below `lambda` (small gain). In free
//! motion nothing comes back, and nothing is reported. Only lines below 16 Hz, which the hand often masks, may be unknown beside a known limit: the
//! guard detects such slow run-aways. An effect that friction hides from a small dither stays hidden: this is the stability limit at the dither's
//! amplitude. So does what lies above 250 Hz or outside of the dither's band.
//!
//! **Without a dither** there is no response: operator motion alone returns `1 / (lambda H_se)`. Then only [`RingDown`] speaks:
//! how fast what the loop oscillates dies after contacts and disturbances.

mod edge;
mod estimate;
mod lines;
mod ring_down;

pub use edge::{Edge, MarginEstimate};
pub use estimate::LiveMargin;
pub use lines::MAX_LINES;
pub(crate) use ring_down::CORNER_HZ;
pub use ring_down::RingDown;

#[cfg(test)]
mod tests;
