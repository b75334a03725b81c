//! Which run a node is of, and whose messages it takes.
//!
//! Every message of a run carries a mark ([`backdrive_msgs::ros::mark`]): the name of the run, the life of the publisher, and a tag over the topic and
//! every byte of the message. The key is the run's own and lies in its directory, which only its user can read. What has no tag, the wrong one, or that
//! of another run is refused before anything else of it is read.

use super::key::{Key, TAG_BYTES, absorb, from_hex};
use crate::transport::TransportError;
use backdrive_msgs::Message;
use backdrive_msgs::ros::mark::{self, Mark, TAG_DIGITS};
use backdrive_msgs::ros::{RosError, live};
use backdrive_msgs::text::Text;
use backdrive_msgs::topic::Topic;
use hmac::{Hmac, Mac};
use serde::{Deserialize, Serialize};
use sha2::Sha256;
use std::os::unix::fs::MetadataExt;
use std::path::{Path, PathBuf};
use std::sync::{Arc, Mutex, PoisonError};

/// A run's name, without a heap.
pub(super) type Run = Text<32>;

/// What a message is tagged for: the first bytes under the tag.
const PURPOSE: &[u8] = b"backdrive message 1";

/// A run by name, with the key of its messages.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct Member {
    /// Name of the run, letters and digits.
    pub run: String,
    /// Key of its messages.
    pub key: Key,
}

/// What the supervisor passes to the processes of a run, in a file that only their user can read.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct Known {
    /// This host's run.
    pub own: Member,
    /// Whether other hosts belong to it: who is unknown may be one of them that has just begun.
    pub several: bool,
    /// The runs of the other hosts, by host, as far as they are known by now.
    pub others: Vec<(String, Member)>,
}

/// Who this node is on the network, and whose messages it takes. Clones share what is known of the other hosts.
#[derive(Clone)]
pub struct Identity(Arc<Inner>);

struct Inner {
    own: Session,
    several: bool,
    path: Option<PathBuf>,
    others: Mutex<Others>,
}

/// Inode, size and time of change.
type FileState = (u64, u64, i64, i64);

struct Others {
    sessions: Vec<Session>,
    /// What the file was like when it was read.
    read: FileState,
}

/// A run with its key, ready for messages.
struct Session {
    run: Run,
    mac: Hmac<Sha256>,
}

impl Session {
    fn new(member: &Member) -> Result<Session, TransportError> {
        mark::check_run(&member.run).map_err(|e| TransportError::Start(e.to_string()))?;
        Ok(Session { run: Run::new(&member.run), mac: member.key.mac() })
    }

    /// The tag of a message whose own digits count as zeros.
    fn over(&self, topic: &Topic, cdr: &[u8], digits: &std::ops::Range<usize>) -> Hmac<Sha256> {
        let mut mac = self.mac.clone();
        absorb(&mut mac, PURPOSE);
        absorb(&mut mac, topic.name.as_bytes());
        mac.update(&cdr[..digits.start]);
        mac.update(&[b'0'; TAG_DIGITS]);
        mac.update(&cdr[digits.end..]);
        mac
    }
}

/// What a message's mark is worth.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Judged {
    /// It is of this run, on this host or another.
    Ours {
        /// Of which host's.
        run: Run,
        /// Life of the publisher.
        life: u64,
    },
    /// It is not.
    Refused(Why),
}

/// Why a message is refused.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Why {
    /// It has no mark.
    Untagged,
    /// It names a run that is not this one.
    Unknown(Run),
    /// It names this run, and its tag is not one of this run's key for this message on this topic.
    Forged,
    /// It was sent before.
    Replayed,
    /// Not even its encoding is one that a node of a run uses.
    Unreadable,
}

impl Identity {
    /// For the nodes of a run: from the file that its supervisor keeps up to date.
    ///
    /// # Errors
    /// The file cannot be read, or does not hold it.
    pub fn read(path: &Path) -> Result<Identity, TransportError> {
        // Before it is read: a change while it is read is seen later.
        let state = state(path);
        Identity::make(&Known::read(path)?, Some(path.to_path_buf()), state)
    }

    /// For a process that needs no file.
    ///
    /// # Errors
    /// A run has no name that can be one.
    pub fn new(known: &Known) -> Result<Identity, TransportError> {
        Identity::make(known, None, FileState::default())
    }

    fn make(known: &Known, path: Option<PathBuf>, read: FileState) -> Result<Identity, TransportError> {
        let others = Mutex::new(Others { sessions: sessions(known)?, read });
        Ok(Identity(Arc::new(Inner { own: Session::new(&known.own)?, several: known.several, path, others })))
    }

    /// Name of this host's run.
    pub fn run(&self) -> &str {
        self.0.own.run.as_str()
    }

    /// Whether other hosts belong to the run.
    pub(super) fn is_of_several(&self) -> bool {
        self.0.several
    }

    /// A message as it goes over the network from a publisher of this run: see [`live::encode`].
    ///
    /// # Errors
    /// As of [`live::encode`].
    pub fn encode(
        &self,
        topic: &Topic,
        message: &Message,
        speaker: &str,
        names: &[String],
        life: u64,
        cdr: &mut Vec<u8>,
    ) -> Result<(), RosError> {
        live::encode(message, speaker, names, Some(&Mark { run: self.run(), life }), cdr)?;
        self.seal(topic, cdr);
        Ok(())
    }

    /// Whether the CDR of a message on a topic was sent by this run, now or before.
    pub fn is_ours(&self, topic: &Topic, little_endian: bool, cdr: &[u8]) -> bool {
        matches!(self.judge(topic, little_endian, cdr), Judged::Ours { .. })
    }

    /// Puts the tag into a message that was encoded with this run's mark.
    fn seal(&self, topic: &Topic, cdr: &mut [u8]) {
        let Some(digits) = mark::marked(topic.kind, true, cdr).map(|m| m.digits) else { return };
        let tag = self.0.own.over(topic, cdr, &digits).finalize().into_bytes();
        for (digits, byte) in cdr[digits].chunks_exact_mut(2).zip(&tag[..TAG_BYTES]) {
            const HEX: &[u8; 16] = b"0123456789abcdef";
            digits.copy_from_slice(&[HEX[usize::from(byte >> 4)], HEX[usize::from(byte & 15)]]);
        }
    }

    /// What a message of the topic is worth.
    pub(super) fn judge(&self, topic: &Topic, little_endian: bool, cdr: &[u8]) -> Judged {
        let Some(found) = mark::marked(topic.kind, little_endian, cdr) else { return Judged::Refused(Why::Untagged) };
        let (run, life) = (Run::new(found.mark.run), found.mark.life);
        let verified = |session: &Session| {
            let mut tag = [0; TAG_BYTES];
            let digits = cdr.get(found.digits.clone()).and_then(|d| std::str::from_utf8(d).ok()).unwrap_or_default();
            from_hex(digits, &mut tag) && session.over(topic, cdr, &found.digits).verify_truncated_left(&tag).is_ok()
        };
        let judged = match run == self.0.own.run {
            true => Some(verified(&self.0.own)),
            false => self.other(run, verified),
        };
        match judged {
            Some(true) => Judged::Ours { run, life },
            Some(false) => Judged::Refused(Why::Forged),
            None => Judged::Refused(Why::Unknown(run)),
        }
    }

    /// Asks the session of another host; `None` where there is none of this name, also after another look at the file.
    fn other(&self, run: Run, ask: impl Fn(&Session) -> bool) -> Option<bool> {
        let mut others = self.0.others.lock().unwrap_or_else(PoisonError::into_inner);
        let find = |others: &Others| others.sessions.iter().find(|s| s.run == run).map(&ask);
        let judged = find(&others);
        if judged.is_some() || !self.0.several {
            return judged;
        }
        // Another host may have begun, or begun again: then its old session is no longer valid.
        let path = self.0.path.as_deref()?;
        let now = state(path);
        if now == others.read {
            return None;
        }
        let sessions = Known::read(path).and_then(|known| sessions(&known)).ok()?;
        *others = Others { sessions, read: now };
        find(&others)
    }
}

fn sessions(known: &Known) -> Result<Vec<Session>, TransportError> {
    known.others.iter().map(|(_, member)| Session::new(member)).collect()
}

fn state(path: &Path) -> FileState {
    std::fs::metadata(path).map_or(FileState::default(), |m| (m.ino(), m.size(), m.mtime(), m.mtime_nsec()))
}

impl Known {
    /// What a supervisor has written.
    ///
    /// # Errors
    /// It cannot be read, or is something else.
    pub fn read(path: &Path) -> Result<Known, TransportError> {
        let failed = |e: &dyn std::fmt::Display| TransportError::Start(format!("{}: {e}; start the run again", path.display()));
        let text = std::fs::read_to_string(path).map_err(|e| failed(&e))?;
        serde_json::from_str(&text).map_err(|e| failed(&e))
    }

    /// Writes it so that a reader has the old or the new one, and no other user has any.
    ///
    /// # Errors
    /// The system refuses.
    pub fn write(&self, path: &Path) -> std::io::Result<()> {
        use std::io::Write;
        use std::os::unix::fs::OpenOptionsExt;
        let next = path.with_extension("next");
        let mut file = std::fs::OpenOptions::new().write(true).create(true).truncate(true).mode(0o600).open(&next)?;
        file.write_all(serde_json::to_string(self).unwrap_or_default().as_bytes())?;
        std::fs::rename(&next, path)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use backdrive_msgs::Sample;
    use backdrive_msgs::topic::Kind;

    fn member(run: &str) -> Member {
        Member { run: run.to_string(), key: Key::fresh().unwrap() }
    }

    fn alone(own: Member) -> Known {
        Known { own, several: false, others: Vec::new() }
    }

    fn topic(name: &str) -> Topic {
        Topic { name: name.to_string(), kind: Kind::Sample }
    }

    fn sealed(identity: &Identity, topic: &Topic) -> Vec<u8> {
        let mut cdr = Vec::new();
        let sample = Sample { step: 7, sequence: 7, ..Sample::new(2) };
        identity.encode(topic, &Message::Sample(sample), "", &[], 5, &mut cdr).unwrap();
        cdr
    }

    #[test]
    fn a_message_of_the_run_is_taken_and_reads_as_it_was_sent() {
        let identity = Identity::new(&alone(member("a1"))).unwrap();
        let (topic, other) = (topic("/master/servo_jf"), topic("/slave/servo_jp"));
        let cdr = sealed(&identity, &topic);
        assert_eq!(identity.judge(&topic, true, &cdr), Judged::Ours { run: Run::new("a1"), life: 5 });
        let Message::Sample(read) = live::decode(Kind::Sample, true, &cdr).unwrap() else { panic!() };
        assert_eq!((read.step, read.sequence), (7, 7));
        // The same bytes on another topic.
        assert_eq!(identity.judge(&other, true, &cdr), Judged::Refused(Why::Forged));
    }

    #[test]
    fn another_key_or_run_is_refused() {
        let own = member("a1");
        let identity = Identity::new(&alone(own)).unwrap();
        let topic = topic("/master/servo_jf");
        let same_name = Identity::new(&alone(member("a1"))).unwrap();
        assert_eq!(identity.judge(&topic, true, &sealed(&same_name, &topic)), Judged::Refused(Why::Forged));
        let other = Identity::new(&alone(member("b2"))).unwrap();
        assert_eq!(identity.judge(&topic, true, &sealed(&other, &topic)), Judged::Refused(Why::Unknown(Run::new("b2"))));
        let mut plain = Vec::new();
        live::encode(&Message::Sample(Sample::new(2)), "", &[], None, &mut plain).unwrap();
        assert_eq!(identity.judge(&topic, true, &plain), Judged::Refused(Why::Untagged));
    }

    #[test]
    fn no_changed_bit_and_no_cut_is_taken() {
        let identity = Identity::new(&alone(member("a1"))).unwrap();
        let topic = topic("/master/servo_jf");
        let cdr = sealed(&identity, &topic);
        for bit in 0..8 * cdr.len() {
            let mut changed = cdr.clone();
            changed[bit / 8] ^= 1 << (bit % 8);
            assert!(matches!(identity.judge(&topic, true, &changed), Judged::Refused(_)), "bit {bit}");
        }
        for end in 0..cdr.len() {
            assert!(matches!(identity.judge(&topic, true, &cdr[..end]), Judged::Refused(_)), "cut at {end}");
        }
        // The step, the force and the tag by name: another number under the old tag.
        let text = String::from_utf8_lossy(&cdr).into_owned();
        for (from, to) in [("step=7 ", "step=8 "), ("seq=7 ", "seq=8 "), ("life=5 ", "life=6 "), (" tag=", " tug=")] {
            let at = text.find(from).unwrap();
            let mut changed = cdr.clone();
            changed[at..at + to.len()].copy_from_slice(to.as_bytes());
            assert!(matches!(identity.judge(&topic, true, &changed), Judged::Refused(_)), "{to}");
        }
        let longer = [&cdr[..], &[0; 4]].concat();
        assert_eq!(identity.judge(&topic, true, &longer), Judged::Refused(Why::Forged));
        // A shorter tag is none.
        let mut short = cdr.clone();
        let digits = mark::marked(Kind::Sample, true, &cdr).unwrap().digits;
        short[digits.end - 1] = 0;
        short[8] -= 1;
        assert_eq!(identity.judge(&topic, true, &short), Judged::Refused(Why::Untagged));
    }

    #[test]
    fn other_hosts_are_known_from_the_file_as_it_is_now() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("identity.json");
        let (desk, robot, again) = (member("a1"), member("b2"), member("c3"));
        let mut known = Known { several: true, ..alone(desk) };
        known.write(&path).unwrap();
        assert_eq!(std::fs::metadata(&path).unwrap().mode() & 0o777, 0o600);
        let here = Identity::read(&path).unwrap();
        let topic = topic("/slave/measured_js");
        let [first, second] = [robot.clone(), again.clone()].map(|m| sealed(&Identity::new(&alone(m)).unwrap(), &topic));
        let ours = |run: &str| Judged::Ours { run: Run::new(run), life: 5 };
        let unknown = |run: &str| Judged::Refused(Why::Unknown(Run::new(run)));
        assert_eq!(here.judge(&topic, true, &first), unknown("b2"));
        known.others = vec![("robot".to_string(), robot)];
        known.write(&path).unwrap();
        assert_eq!((here.judge(&topic, true, &first), here.judge(&topic, true, &second)), (ours("b2"), unknown("c3")));
        // Started again: from then on the old session is not valid.
        known.others = vec![("robot".to_string(), again)];
        known.write(&path).unwrap();
        assert_eq!((here.judge(&topic, true, &second), here.judge(&topic, true, &first)), (ours("c3"), unknown("b2")));
        std::fs::remove_file(&path).unwrap();
        assert_eq!(here.judge(&topic, true, &second), ours("c3"));
        assert!(Identity::read(&path).is_err());
    }
}
