//! What supervisors say to each other under the secret that they share.
//!
//! Every word carries the speaker's nonce, a count and a tag. A recording of an earlier run is recognised by its nonce: a speaker is trusted only after
//! it has repeated this supervisor's nonce, which is of this start alone. After that its count has to grow.

use super::words::Say;
use crate::session::Session;
use backdrive_nodes::transport::ros2::Key;
use serde::{Deserialize, Serialize};

/// Speakers that are remembered. A recording of many starts must not fill the memory.
const MOST_SPEAKERS: usize = 32;

/// What goes over the network.
#[derive(Serialize, Deserialize)]
struct Envelope {
    /// The speaker's run.
    run: String,
    /// Of this start of it.
    nonce: String,
    count: u64,
    /// A [`Say`] as JSON.
    said: String,
    tag: String,
}

/// The sender of a message.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) struct Speaker {
    pub run: String,
    pub nonce: String,
}

struct Heard {
    speaker: Speaker,
    proven: bool,
    count: u64,
}

/// What a word is worth.
#[derive(Debug, PartialEq)]
pub(super) enum Opened {
    /// A current message, from a sender with the secret.
    Said(Speaker, Say),
    /// By who has the secret, but perhaps long ago; with whether it is the first of this speaker.
    Unproven { first: bool },
    /// One's own, or one that was heard before.
    Nothing,
    /// By who does not have the secret.
    Foreign,
}

/// The way from words to what goes over the network, and back.
pub(super) struct Sealed {
    key: Key,
    own: Speaker,
    count: u64,
    heard: Vec<Heard>,
}

impl Sealed {
    pub fn new(session: &Session) -> Sealed {
        let own = Speaker { run: session.known.own.run.clone(), nonce: session.nonce.clone() };
        Sealed { key: session.talk_key(), own, count: 0, heard: Vec::new() }
    }

    /// Nonces of the others that were heard: each believes who has heard its own.
    pub fn heard(&self) -> Vec<String> {
        self.heard.iter().map(|h| h.speaker.nonce.clone()).collect()
    }

    /// A word as it goes over the network.
    pub fn seal(&mut self, say: &Say) -> Option<String> {
        self.count += 1;
        let said = serde_json::to_string(say).ok()?;
        let tag = self.key.tag(&[&self.own.run, &self.own.nonce, &self.count.to_string(), &said]);
        let Speaker { run, nonce } = self.own.clone();
        serde_json::to_string(&Envelope { run, nonce, count: self.count, said, tag }).ok()
    }

    /// What came from there.
    pub fn open(&mut self, text: &str) -> Opened {
        let Ok(Envelope { run, nonce, count, said, tag }) = serde_json::from_str(text) else { return Opened::Foreign };
        if !self.key.verifies(&[&run, &nonce, &count.to_string(), &said], &tag) {
            return Opened::Foreign;
        }
        let speaker = Speaker { run, nonce };
        if speaker == self.own {
            return Opened::Nothing;
        }
        // With the secret, of another version.
        let Ok(say) = serde_json::from_str::<Say>(&said) else { return Opened::Nothing };
        let first = self.heard.iter().all(|h| h.speaker != speaker);
        if first {
            if self.heard.len() == MOST_SPEAKERS {
                let oldest = self.heard.iter().position(|h| !h.proven).unwrap_or(0);
                self.heard.remove(oldest);
            }
            self.heard.push(Heard { speaker: speaker.clone(), proven: false, count: 0 });
        }
        let Some(known) = self.heard.iter_mut().find(|h| h.speaker == speaker) else { return Opened::Nothing };
        known.proven |= matches!(&say, Say::Hello { heard, .. } if heard.contains(&self.own.nonce));
        match (known.proven, count > known.count) {
            (false, _) => Opened::Unproven { first },
            (true, false) => Opened::Nothing,
            (true, true) => {
                known.count = count;
                Opened::Said(speaker, say)
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use backdrive_nodes::transport::ros2::Known;

    fn sealed(secret: &Key, run: &str) -> Sealed {
        let nonce = Key::fresh().unwrap().to_hex();
        let known = Known { own: Session::member(secret, run, &nonce), several: true, others: Vec::new() };
        Sealed::new(&Session { known, path: Default::default(), nonce, secret: secret.clone() })
    }

    fn hello(by: &mut Sealed, host: &str) -> String {
        let (host, heard) = (host.to_string(), by.heard());
        let hello = Say::Hello { run: 1, host, life: 2, ready: true, missing: Vec::new(), begun: None, leaving: false, heard };
        by.seal(&hello).unwrap()
    }

    #[test]
    fn who_has_the_secret_is_believed_once_it_has_heard_who_listens() {
        let secret = Key::fresh().unwrap();
        let (mut desk, mut robot) = (sealed(&secret, "a1"), sealed(&secret, "b2"));
        let first = hello(&mut desk, "desk");
        assert_eq!(robot.open(&first), Opened::Unproven { first: true });
        assert_eq!(robot.open(&first), Opened::Unproven { first: false });
        assert_eq!(desk.open(&first), Opened::Nothing);
        // The robot has heard the desk's nonce, and repeats it.
        assert!(matches!(desk.open(&hello(&mut robot, "robot")), Opened::Said(speaker, _) if speaker.run == "b2"));
        let second = hello(&mut desk, "desk");
        assert!(matches!(robot.open(&second), Opened::Said(..)));
        assert_eq!(robot.open(&second), Opened::Nothing);
        assert_eq!(robot.open(&first), Opened::Nothing);
    }

    #[test]
    fn a_recording_of_an_earlier_start_is_not_believed() {
        let secret = Key::fresh().unwrap();
        let (mut desk, mut robot) = (sealed(&secret, "a1"), sealed(&secret, "b2"));
        desk.open(&hello(&mut robot, "robot"));
        let heard_by_desk = hello(&mut desk, "desk");
        assert!(matches!(robot.open(&heard_by_desk), Opened::Said(..)));
        // The robot begins again; the recording has the nonce that it had before.
        let mut again = sealed(&secret, "b2");
        for _ in 0..3 {
            assert!(matches!(again.open(&heard_by_desk), Opened::Unproven { .. }));
        }
        // And of very many of them few are kept.
        for number in 0..100 {
            again.open(&hello(&mut sealed(&secret, &format!("r{number}")), "desk"));
        }
        assert_eq!(again.heard().len(), MOST_SPEAKERS);
    }

    #[test]
    fn who_does_not_have_the_secret_is_not_heard() {
        let (mut desk, mut robot) = (sealed(&Key::fresh().unwrap(), "a1"), sealed(&Key::fresh().unwrap(), "b2"));
        let said = hello(&mut desk, "desk");
        assert_eq!(robot.open(&said), Opened::Foreign);
        for text in ["", "{}", "{\"say\":\"hello\"}", &said.replace("\"count\":1", "\"count\":2"), &said.replace("a1", "a2")] {
            assert_eq!(desk.open(text), Opened::Foreign, "{text}");
        }
    }
}
