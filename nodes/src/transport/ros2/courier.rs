//! Informs hosts that multicast does not reach of the participants on this one.
//!
//! A participant announces itself to the multicast group and to the well-known ports of its own host (RTPS 2.5, section 9.6.2.3). The courier listens
//! on one of those ports and passes every announcement on, unchanged, to the same ports of the named peers. It repeats this every second, because
//! theirs may start later. What follows the announcement is unicast in any case: it carries the addresses at which its sender is reached.

use super::Network;
use crate::transport::TransportError;
use std::collections::HashMap;
use std::net::{Ipv4Addr, SocketAddrV4, UdpSocket};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::thread::JoinHandle;
use std::time::{Duration, Instant};

/// Participants of a host that are announced to each other by unicast; the middleware's own number.
const SLOTS: u16 = 12;

/// How often the announcements are passed on.
const EVERY: Duration = Duration::from_millis(500);

/// A participant announces itself every 10 s; one that has not for this long is gone.
const FORGET: Duration = Duration::from_secs(12);

/// Runs as long as it exists.
pub struct Courier {
    stop: Arc<AtomicBool>,
    thread: Option<JoinHandle<()>>,
}

/// The port at which participant number `slot` of a domain hears announcements.
fn port(domain: u16, slot: u16) -> u16 {
    7400 + 250 * domain + 10 + 2 * slot
}

impl Courier {
    /// Starts to inform `network.peers`; `None` when there are none.
    ///
    /// # Errors
    /// No port of the domain is free on this host.
    pub fn start(network: &Network) -> Result<Option<Courier>, TransportError> {
        if network.peers.is_empty() {
            return Ok(None);
        }
        // From the last on: participants take the first.
        let bound = (0..SLOTS).rev().find_map(|slot| UdpSocket::bind((Ipv4Addr::LOCALHOST, port(network.domain, slot))).ok());
        let socket = bound.ok_or_else(|| {
            let (first, last) = (port(network.domain, 0), port(network.domain, SLOTS - 1));
            TransportError::Start(format!("all ports for announcements of ROS domain {} ({first} to {last}) are taken", network.domain))
        })?;
        let failed = |e: std::io::Error| TransportError::Start(format!("cannot pass announcements on: {e}"));
        socket.set_read_timeout(Some(EVERY / 2)).map_err(failed)?;
        // Another socket, for this one is bound to the loopback.
        let out = UdpSocket::bind((Ipv4Addr::UNSPECIFIED, 0)).map_err(failed)?;
        let to: Vec<SocketAddrV4> =
            network.peers.iter().flat_map(|peer| (0..SLOTS).map(|slot| SocketAddrV4::new(*peer, port(network.domain, slot)))).collect();
        let stop = Arc::new(AtomicBool::new(false));
        let stopped = Arc::clone(&stop);
        let thread = std::thread::spawn(move || carry(&socket, &out, &to, &stopped));
        Ok(Some(Courier { stop, thread: Some(thread) }))
    }
}

impl Drop for Courier {
    fn drop(&mut self) {
        self.stop.store(true, Ordering::SeqCst);
        if let Some(thread) = self.thread.take() {
            let _ = thread.join();
        }
    }
}

fn carry(socket: &UdpSocket, out: &UdpSocket, to: &[SocketAddrV4], stopped: &AtomicBool) {
    // By the prefix of the participant's identity: bytes 8 to 19 of every RTPS message.
    let mut known: HashMap<[u8; 12], (Vec<u8>, Instant)> = HashMap::new();
    let (mut datagram, mut told) = (vec![0; 65_536], Instant::now());
    while !stopped.load(Ordering::SeqCst) {
        if let Ok((length, _)) = socket.recv_from(&mut datagram)
            && let Some((header, _)) = datagram[..length].split_first_chunk::<20>()
            && header.starts_with(b"RTPS")
        {
            let mut prefix = [0; 12];
            prefix.copy_from_slice(&header[8..]);
            known.insert(prefix, (datagram[..length].to_vec(), Instant::now()));
            tell(out, &datagram[..length], to);
        }
        if told.elapsed() >= EVERY {
            told = Instant::now();
            known.retain(|_, (_, heard)| heard.elapsed() < FORGET);
            known.values().for_each(|(datagram, _)| tell(out, datagram, to));
        }
    }
}

/// A peer that is not there now may be later.
fn tell(out: &UdpSocket, datagram: &[u8], to: &[SocketAddrV4]) {
    for peer in to {
        let _ = out.send_to(datagram, peer);
    }
}
