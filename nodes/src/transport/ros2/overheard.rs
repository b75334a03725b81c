//! Who else announces itself, in whichever domain: why somebody is not found.

use super::MAX_DOMAIN;
use super::network::{Interface, interfaces};
use nix::libc;
use std::collections::BTreeMap;
use std::net::{Ipv4Addr, SocketAddr, UdpSocket};
use std::os::fd::{AsRawFd, FromRawFd};

/// The group of all announcements (RTPS 2.5, section 9.6.1.4.1).
pub const GROUP: Ipv4Addr = Ipv4Addr::new(239, 255, 0, 1);

/// Listens to the announcements of all domains on all interfaces.
pub struct Overheard {
    sockets: Vec<(u16, UdpSocket)>,
    own: Vec<Ipv4Addr>,
    heard: BTreeMap<(u16, Ipv4Addr), u64>,
}

impl Overheard {
    /// Begins to listen. Where a port or an interface refuses, the others are listened to.
    pub fn begin() -> Overheard {
        let all = interfaces().unwrap_or_default();
        let ports = (0..=MAX_DOMAIN).filter_map(|domain| Some((domain, listen(7400 + 250 * domain, &all)?)));
        Overheard { sockets: ports.collect(), own: all.iter().map(|i| i.address).collect(), heard: BTreeMap::new() }
    }

    /// Domains and addresses of those who have announced themselves so far, this host left out.
    pub fn others(&mut self) -> Vec<(u16, Ipv4Addr)> {
        let mut datagram = [0; 2048];
        for (domain, socket) in &self.sockets {
            while let Ok((length, from)) = socket.recv_from(&mut datagram) {
                if let (SocketAddr::V4(from), true) = (from, datagram[..length].starts_with(b"RTPS")) {
                    *self.heard.entry((*domain, *from.ip())).or_default() += 1;
                }
            }
        }
        self.heard.keys().filter(|(_, address)| !self.own.contains(address)).copied().collect()
    }
}

/// A socket that hears the group on a port of which it is not the only listener.
pub fn listen(port: u16, on: &[Interface]) -> Option<UdpSocket> {
    // SAFETY: a plain call; the descriptor is owned by the socket made of it.
    let socket = unsafe {
        let fd = libc::socket(libc::AF_INET, libc::SOCK_DGRAM | libc::SOCK_NONBLOCK | libc::SOCK_CLOEXEC, 0);
        if fd < 0 {
            return None;
        }
        UdpSocket::from_raw_fd(fd)
    };
    let yes: libc::c_int = 1;
    let length = size_of::<libc::c_int>() as libc::socklen_t;
    // The port of domain 232 is the highest; the group's address keeps out what is sent to this host alone.
    let address = libc::sockaddr_in {
        sin_family: libc::AF_INET as libc::sa_family_t,
        sin_port: port.to_be(),
        sin_addr: libc::in_addr { s_addr: u32::from(GROUP).to_be() },
        sin_zero: [0; 8],
    };
    // SAFETY: the values live as long as the calls, and have the stated sizes.
    let bound = unsafe {
        for option in [libc::SO_REUSEADDR, libc::SO_REUSEPORT] {
            libc::setsockopt(socket.as_raw_fd(), libc::SOL_SOCKET, option, (&raw const yes).cast(), length);
        }
        libc::bind(socket.as_raw_fd(), (&raw const address).cast(), size_of::<libc::sockaddr_in>() as libc::socklen_t)
    };
    let joined = on.iter().filter(|i| i.multicast && i.up).filter(|i| socket.join_multicast_v4(&GROUP, &i.address).is_ok()).count();
    (bound == 0 && joined > 0).then_some(socket)
}
