//! Arms: their regressor, logs of known arms, altered logs, what is stated of them, and the motion to record next.

mod altered_logs;
mod common;
mod known_arms;
mod known_cases;
#[path = "../../../tests/common/naming.rs"]
mod naming;
mod next_motion;
mod regressor;
mod stated_and_usable;
