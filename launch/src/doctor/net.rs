//! Interfaces, multicast, socket buffers, ports, and who else is heard.

use super::Finding;
use backdrive_nodes::transport::ros2::overheard::{GROUP, Overheard, listen};
use backdrive_nodes::transport::ros2::{Interface, Network, interfaces};
use nix::libc;
use std::net::UdpSocket;
use std::os::fd::AsRawFd;
use std::time::{Duration, Instant};

/// What a socket should hold of what arrives, bytes: 20 ms of a 5 kHz graph's nine topics.
const BUFFER_WANTED: u64 = 1 << 20;

pub(super) fn look(network: &Network, listen_s: f64) -> Vec<Finding> {
    let all = match interfaces() {
        Ok(all) => all,
        Err(e) => return vec![Finding::bad("network", e.to_string(), "the system must let its interfaces be listed")],
    };
    let used: Vec<&Interface> = all.iter().filter(|i| network.interfaces.is_empty() || network.interfaces.contains(&i.address)).collect();
    let mut findings = vec![which(&used)];
    findings.extend(used.iter().filter(|i| i.up && !i.loopback).map(|i| multicast(i)));
    findings.extend([buffers(), ports(network.domain), heard(network.domain, listen_s), strangers(network.domain)]);
    findings
}

fn which(used: &[&Interface]) -> Finding {
    let up: Vec<String> = used.iter().filter(|i| i.up).map(|i| format!("{} ({})", i.name, i.address)).collect();
    if used.iter().any(|i| i.up && !i.loopback) {
        return Finding::fine("interfaces", up.join(", "));
    }
    let advice = "a graph on one host works; for several connect the network or name another --interface";
    Finding::weak("interfaces", format!("only the loopback is up: {}", up.join(", ")), advice)
}

/// Sends to the group on this interface and listens whether it comes back.
fn multicast(interface: &Interface) -> Finding {
    const PART: &str = "multicast";
    let name = format!("{} ({})", interface.name, interface.address);
    let advice = "name the other hosts with --peer, or `address` under [hosts] in the graph";
    if !interface.multicast {
        return Finding::weak(PART, format!("{name} cannot multicast"), advice);
    }
    let heard = || -> std::io::Result<bool> {
        // A port that no domain uses for announcements.
        let port = 7399;
        let Some(ear) = listen(port, std::slice::from_ref(interface)) else { return Ok(false) };
        let mouth = UdpSocket::bind((interface.address, 0))?;
        let on = libc::in_addr { s_addr: u32::from(interface.address).to_be() };
        // SAFETY: the address lives as long as the call and has the size that is passed.
        let set = unsafe {
            let length = size_of::<libc::in_addr>() as libc::socklen_t;
            libc::setsockopt(mouth.as_raw_fd(), libc::IPPROTO_IP, libc::IP_MULTICAST_IF, (&raw const on).cast(), length)
        };
        if set != 0 {
            return Err(std::io::Error::last_os_error());
        }
        let word = format!("backdrive doctor {}", std::process::id());
        mouth.send_to(word.as_bytes(), (GROUP, port))?;
        let (begun, mut datagram) = (Instant::now(), [0; 64]);
        while begun.elapsed() < Duration::from_millis(300) {
            if ear.recv_from(&mut datagram).is_ok_and(|(n, _)| &datagram[..n] == word.as_bytes()) {
                return Ok(true);
            }
            std::thread::sleep(Duration::from_millis(5));
        }
        Ok(false)
    };
    match heard() {
        Ok(true) => Finding::fine(
            PART,
            format!("{name} sends to {GROUP} and receives its own messages; only another host can check whether the network forwards them"),
        ),
        Ok(false) => Finding::weak(PART, format!("what {name} sends to {GROUP} does not come back: a firewall?"), advice),
        Err(e) => Finding::weak(PART, format!("{name} cannot send to {GROUP}: {e}; is there a route?"), advice),
    }
}

fn buffers() -> Finding {
    const PART: &str = "socket buffers";
    let read = |name: &str| std::fs::read_to_string(format!("/proc/sys/net/core/{name}")).ok().and_then(|t| t.trim().parse::<u64>().ok());
    // In a network namespace the limits may not be shown; then what a socket gets is asked.
    let Some(limit) = read("rmem_max").or_else(granted) else {
        return Finding::weak(PART, "the system does not report their limit", "raise net.core.rmem_max to 8388608 if samples are lost");
    };
    if limit < BUFFER_WANTED {
        let advice = "`sysctl -w net.core.rmem_max=8388608`; a node or recorder that is held up loses best-effort samples earlier";
        return Finding::weak(PART, format!("at most {} KiB are kept of what arrives", limit >> 10), advice);
    }
    Finding::fine(PART, format!("{} KiB are kept of what arrives", limit >> 10))
}

fn granted() -> Option<u64> {
    let socket = UdpSocket::bind("127.0.0.1:0").ok()?;
    let (wanted, mut got): (libc::c_int, libc::c_int) = (8 << 20, 0);
    let mut length = size_of::<libc::c_int>() as libc::socklen_t;
    // SAFETY: the values live as long as the calls, and have the sizes that are passed.
    let asked = unsafe {
        libc::setsockopt(socket.as_raw_fd(), libc::SOL_SOCKET, libc::SO_RCVBUF, (&raw const wanted).cast(), length);
        libc::getsockopt(socket.as_raw_fd(), libc::SOL_SOCKET, libc::SO_RCVBUF, (&raw mut got).cast(), &mut length)
    };
    // The kernel reports twice what it keeps for payloads.
    (asked == 0).then_some(got as u64 / 2)
}

/// Participants of a host find each other without multicast on the first twelve ports of a domain.
fn ports(domain: u16) -> Finding {
    let first = 7410 + 250 * domain;
    let taken = (0..12).filter(|slot| UdpSocket::bind(("0.0.0.0", first + 2 * slot)).is_err()).count();
    let found = format!("ROS domain {domain}: {taken} of its first 12 ports are taken");
    if taken > 6 {
        let advice = "other programs use this domain on this host; without multicast the six nodes of a graph would not find each other: \
            choose another --domain";
        return Finding::weak("domain", found, advice);
    }
    Finding::fine("domain", found)
}

/// What holds of every run, whoever is in the domain.
fn strangers(domain: u16) -> Finding {
    let found = format!(
        "a run accepts only messages of its own nodes; anybody in ROS domain {domain} can read what it sends, and can end it by sending \
         on its topics (docs/security.md)"
    );
    Finding::fine("strangers", found)
}

fn heard(domain: u16, listen_s: f64) -> Finding {
    let (mut overheard, begun) = (Overheard::begin(), Instant::now());
    let mut others = overheard.others();
    while begun.elapsed().as_secs_f64() < listen_s {
        std::thread::sleep(Duration::from_millis(100));
        others = overheard.others();
    }
    if others.is_empty() {
        return Finding::fine("others", format!("no other host announced itself in {listen_s:.0} s"));
    }
    let list = |same: bool| {
        let picked = others.iter().filter(|(d, _)| (*d == domain) == same);
        picked
            .map(|(d, address)| if same { address.to_string() } else { format!("{address} in domain {d}") })
            .collect::<Vec<_>>()
            .join(", ")
    };
    match (list(true), list(false)) {
        (here, elsewhere) if here.is_empty() => Finding::weak(
            "others",
            format!("announce themselves in other domains: {elsewhere}"),
            format!("this host is in domain {domain}: see ROS_DOMAIN_ID"),
        ),
        (here, elsewhere) if elsewhere.is_empty() => Finding::fine("others", format!("in this domain: {here}")),
        (here, elsewhere) => Finding::fine("others", format!("in this domain: {here}; in other domains: {elsewhere}")),
    }
}
