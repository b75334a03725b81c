//! Which of the messages that arrive on a topic is its next: one publisher, nothing late, nothing twice.

use super::identity::{Run, Why};
use std::time::{Duration, Instant};

/// Publishers that a topic is remembered to have had in one run: one that was recreated has another identity on the network.
const REMEMBERED: usize = 4;

/// What becomes of a message.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Admission {
    /// It is the topic's next.
    Next,
    /// A later one of the same publisher was here before it.
    Late,
    /// It is somebody else's.
    Refused(Why),
}

/// The publisher of a topic, by what its messages say under their tag, and how far it has come.
#[derive(Debug, Clone)]
pub(super) struct Proven<G> {
    newest: Option<(Run, u64, u64)>,
    /// Who is on the network what has sent genuine messages, the newest first.
    seen: [Option<G>; REMEMBERED],
    /// Runs that other hosts have left behind.
    former: Vec<Run>,
}

impl<G> Default for Proven<G> {
    fn default() -> Proven<G> {
        Proven { newest: None, seen: [const { None }; REMEMBERED], former: Vec::new() }
    }
}

impl<G: Copy + PartialEq> Proven<G> {
    /// Whether a message whose tag is right comes next. One that is not newer than what was here is late where its sender has been genuine before,
    /// and a recording that somebody plays where it has not.
    pub fn admit(&mut self, from: G, run: Run, life: u64, sequence: u64) -> Admission {
        let is_next = match &self.newest {
            None => true,
            Some((newest, ..)) if *newest != run => !self.former.contains(&run),
            Some((_, newest_life, newest_sequence)) => (life, sequence) > (*newest_life, *newest_sequence),
        };
        if !is_next {
            return if self.seen.contains(&Some(from)) { Admission::Late } else { Admission::Refused(Why::Replayed) };
        }
        if let Some((before, ..)) = self.newest.filter(|(before, ..)| *before != run) {
            self.former.push(before);
        }
        self.newest = Some((run, life, sequence));
        if self.seen[0] != Some(from) {
            self.seen.rotate_right(1);
            self.seen[0] = Some(from);
        }
        Admission::Next
    }
}

/// Without tags: who speaks first has the topic until it is silent. For tools and tests that belong to no run.
#[derive(Debug, Clone)]
pub(super) struct First<G> {
    speaker: Option<(G, u64, Instant)>,
    silence: Duration,
    /// Whether a publisher that was recreated continues its count; of samples two may count alike.
    continues: bool,
}

impl<G: Copy + PartialEq> First<G> {
    pub fn new(silence: Duration, continues: bool) -> First<G> {
        First { speaker: None, silence, continues }
    }

    pub fn admit(&mut self, from: G, sequence: u64) -> Admission {
        let admission = match self.speaker {
            None => Admission::Next,
            Some((speaker, newest, _)) if speaker == from => {
                if sequence > newest {
                    Admission::Next
                } else {
                    Admission::Late
                }
            }
            Some((_, newest, heard)) => {
                let next = self.continues && sequence == newest + 1 || heard.elapsed() >= self.silence;
                if next { Admission::Next } else { Admission::Refused(Why::Untagged) }
            }
        };
        if admission == Admission::Next {
            self.speaker = Some((from, sequence, Instant::now()));
        }
        admission
    }

    /// The middleware reports that a publisher has gone.
    pub fn gone(&mut self, who: G) {
        self.speaker = self.speaker.filter(|(speaker, ..)| *speaker != who);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const REPLAYED: Admission = Admission::Refused(Why::Replayed);

    fn run(name: &str) -> Run {
        Run::new(name)
    }

    #[test]
    fn a_message_counts_once_and_only_forward() {
        let mut proven = Proven::default();
        assert_eq!(proven.admit(1, run("a"), 5, 0), Admission::Next);
        assert_eq!(proven.admit(1, run("a"), 5, 3), Admission::Next);
        assert_eq!(proven.admit(1, run("a"), 5, 2), Admission::Late);
        assert_eq!(proven.admit(1, run("a"), 5, 3), Admission::Late);
        for sequence in 0..=3 {
            assert_eq!(proven.admit(2, run("a"), 5, sequence), REPLAYED);
        }
        // What is held back and sent by somebody else first is what was sent, once.
        assert_eq!(proven.admit(2, run("a"), 5, 4), Admission::Next);
        assert_eq!(proven.admit(1, run("a"), 5, 4), Admission::Late);
    }

    #[test]
    fn a_publisher_that_was_started_again_counts_from_0_and_its_former_life_is_over() {
        let mut proven = Proven::default();
        assert_eq!(proven.admit(1, run("a"), 5, 900), Admission::Next);
        assert_eq!(proven.admit(2, run("a"), 6, 0), Admission::Next);
        // Its own, still on the way, and a recording.
        assert_eq!(proven.admit(1, run("a"), 5, 901), Admission::Late);
        assert_eq!(proven.admit(3, run("a"), 5, 901), REPLAYED);
        assert_eq!(proven.admit(2, run("a"), 6, 1), Admission::Next);
    }

    #[test]
    fn a_host_that_has_begun_again_does_not_come_back_as_it_was() {
        let mut proven = Proven::default();
        assert_eq!(proven.admit(1, run("a"), 5, 900), Admission::Next);
        assert_eq!(proven.admit(2, run("b"), 1, 0), Admission::Next);
        assert_eq!(proven.admit(3, run("a"), 5, 901), REPLAYED);
        assert_eq!(proven.admit(2, run("b"), 1, 1), Admission::Next);
    }

    #[test]
    fn without_tags_who_speaks_first_has_the_topic_until_it_is_silent() {
        let mut first = First::new(Duration::from_millis(20), false);
        assert_eq!((first.admit(1, 0), first.admit(1, 1), first.admit(1, 1)), (Admission::Next, Admission::Next, Admission::Late));
        assert_eq!(first.admit(2, 7), Admission::Refused(Why::Untagged));
        first.gone(2);
        assert_eq!(first.admit(2, 8), Admission::Refused(Why::Untagged));
        std::thread::sleep(Duration::from_millis(30));
        assert_eq!(first.admit(2, 9), Admission::Next);
        first.gone(2);
        assert_eq!(first.admit(1, 0), Admission::Next);
        let mut told = First::new(Duration::from_secs(60), true);
        assert_eq!(
            (told.admit(1, 4), told.admit(2, 5), told.admit(3, 9)),
            (Admission::Next, Admission::Next, Admission::Refused(Why::Untagged))
        );
    }
}
