//! Two network namespaces as two hosts, joined by a cable or by a relay that delays, loses and cuts.

#![allow(dead_code)] // each test program uses its own part

mod relay;
#[path = "../common/skipped.rs"]
pub mod skipped;

pub use relay::{Link, Relay};

use skipped::skipped;
use std::path::Path;
use std::process::{Command, Output};
use std::sync::atomic::{AtomicU32, Ordering};
use std::sync::{Mutex, MutexGuard, PoisonError};

/// Addresses of the two hosts.
pub const ADDRESSES: [&str; 2] = ["10.9.0.1", "10.9.0.2"];

/// Two hosts. Gone when dropped.
pub struct Hosts {
    names: [String; 2],
    relay: Option<Relay>,
    /// Two runs in real time at once would only measure each other; `None` for those that run none.
    _alone: Option<MutexGuard<'static, ()>>,
}

static ALONE: Mutex<()> = Mutex::new(());

impl Hosts {
    /// Joined by a cable. `None`, with a message, where namespaces are not permitted; with BACKDRIVE_REQUIRE_NETNS=1 a failure.
    pub fn joined() -> Option<Hosts> {
        Hosts::make(None, true)
    }

    /// The same for a test that runs nothing in real time, and so goes on beside one that does.
    pub fn joined_at_leisure() -> Option<Hosts> {
        Hosts::make(None, false)
    }

    /// Joined by a relay.
    pub fn relayed(link: Link) -> Option<Hosts> {
        Hosts::make(Some(link), true)
    }

    fn make(link: Option<Link>, alone: bool) -> Option<Hosts> {
        let alone = alone.then(|| ALONE.lock().unwrap_or_else(PoisonError::into_inner));
        static COUNT: AtomicU32 = AtomicU32::new(0);
        let id = format!("bd{}_{}", std::process::id(), COUNT.fetch_add(1, Ordering::Relaxed));
        let names = [format!("{id}a"), format!("{id}b")];
        let mut hosts = Hosts { names, relay: None, _alone: alone };
        match hosts.set_up(link) {
            Ok(()) => Some(hosts),
            Err(why) => {
                assert!(std::env::var("BACKDRIVE_REQUIRE_NETNS").as_deref() != Ok("1"), "network namespaces cannot be made: {why}");
                skipped(format_args!("network namespaces cannot be made here: {why}"));
                None
            }
        }
    }

    fn set_up(&mut self, link: Option<Link>) -> Result<(), String> {
        for name in &self.names {
            ip(&["netns", "add", name])?;
            ip(&["-n", name, "link", "set", "lo", "up"])?;
        }
        match link {
            None => {
                let [a, b] = &self.names;
                ip(&["-n", a, "link", "add", "veth0", "type", "veth", "peer", "name", "veth0", "netns", b])?;
            }
            Some(link) => self.relay = Some(Relay::between(&self.names, "veth0", link)?),
        }
        for (name, address) in self.names.iter().zip(ADDRESSES) {
            ip(&["-n", name, "addr", "add", &format!("{address}/24"), "dev", "veth0"])?;
            ip(&["-n", name, "link", "set", "veth0", "up"])?;
            ip(&["-n", name, "route", "add", "224.0.0.0/4", "dev", "veth0"])?;
        }
        Ok(())
    }

    /// A program on one of the hosts.
    pub fn on(&self, host: usize, program: impl AsRef<Path>) -> Command {
        let mut command = Command::new("ip");
        command.args(["netns", "exec", &self.names[host]]).arg(program.as_ref());
        command
    }

    /// The relay between them.
    pub fn relay(&self) -> &Relay {
        self.relay.as_ref().expect("they are joined by a cable")
    }

    /// Something that `ip` does on one of the hosts.
    pub fn ip(&self, host: usize, arguments: &[&str]) {
        let all: Vec<&str> = ["-n", self.names[host].as_str()].into_iter().chain(arguments.iter().copied()).collect();
        ip(&all).unwrap();
    }
}

impl Drop for Hosts {
    fn drop(&mut self) {
        for name in &self.names {
            let _ = ip(&["netns", "del", name]);
        }
    }
}

fn ip(arguments: &[&str]) -> Result<(), String> {
    let Output { status, stderr, .. } = Command::new("ip").args(arguments).output().map_err(|e| format!("ip: {e}"))?;
    if status.success() { Ok(()) } else { Err(format!("ip {}: {}", arguments.join(" "), String::from_utf8_lossy(&stderr).trim())) }
}
