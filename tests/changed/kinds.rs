//! Kinds of change to a bag, and what each costs.

use super::{Bag, Numbers};
use rand::RngExt;
use rand_chacha::ChaCha8Rng;

/// What a change costs.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Costs {
    /// Samples are missing: no verb may call it whole or its loop stable.
    Samples,
    /// Other messages are missing: the loop may be judged, the bag is not whole.
    Others,
    /// Numbers are wrong: nothing may be judged by them.
    Numbers,
    /// Its own records are wrong, and it matters.
    Itself,
    /// Nothing: every answer stays.
    Nothing,
}

/// A kind of change: what it costs, or `None` where it means nothing for this bag.
pub type Kind = (&'static str, fn(&mut Bag, &mut ChaCha8Rng) -> Option<Costs>);

/// Signals of a loop that its graph and models determine.
const DETERMINED: &[(&str, Numbers)] = &[
    ("/master/servo_jf", Numbers::Effort),
    ("/slave/servo_jp", Numbers::Position),
    ("/master/measured_js", Numbers::Position),
    ("/master/measured_js", Numbers::Effort),
    ("/slave/measured_js", Numbers::Effort),
    ("/canceller/measured_js", Numbers::Position),
];

/// Changes the numbers of one signal, if they say something.
fn numbers(bag: &mut Bag, random: &mut ChaCha8Rng, change: impl Fn(usize, usize, f64, &[f64]) -> f64) -> Option<Costs> {
    let (topic, which) = DETERMINED[random.random_range(0..DETERMINED.len())];
    let was = bag.values(topic, which);
    let (low, high) = was.iter().filter(|x| x.is_finite()).fold((f64::MAX, f64::MIN), |(l, h), x| (l.min(*x), h.max(*x)));
    if was.len() < 100 || high - low <= 0.0 {
        return None;
    }
    let of = was.len();
    let before = bag.clone();
    bag.numbers(topic, which, |index, number| change(index, of, number, &was));
    // What rests where it was frozen, or was nearly 0, is not changed by that.
    let mean = was.iter().sum::<f64>() / of as f64;
    let rms = |values: &mut dyn Iterator<Item = f64>| (values.map(|x| x * x).sum::<f64>() / of as f64).sqrt();
    let spread = rms(&mut was.iter().map(|x| x - mean));
    let changed = rms(&mut bag.values(topic, which).iter().zip(&was).map(|(is, was)| if is.is_nan() { spread } else { is - was }));
    if changed < 0.1 * spread {
        *bag = before;
        return None;
    }
    Some(Costs::Numbers)
}

fn a_topic(bag: &Bag, random: &mut ChaCha8Rng) -> String {
    let topics = bag.samples();
    topics[random.random_range(0..topics.len())].clone()
}

fn gone(bag: &mut Bag, random: &mut ChaCha8Rng, gone: impl Fn(f64) -> bool, record: bool) -> Option<Costs> {
    let topic = a_topic(bag, random);
    bag.keep(|name, index, of| name != topic || !gone(index as f64 / of as f64));
    if !record {
        bag.forget_completeness();
    }
    Some(Costs::Samples)
}

pub const KINDS: &[Kind] = &[
    ("scaled", |bag, r| {
        let factor = [1000.0, 1.3, 0.5, 10.0][r.random_range(0..4)];
        numbers(bag, r, |_, _, x, _| factor * x)
    }),
    ("negated", |bag, r| numbers(bag, r, |_, _, x, _| -x)),
    ("negated for a tenth", |bag, r| numbers(bag, r, |index, of, x, _| if index * 10 / of == 6 { -x } else { x })),
    ("not a number", |bag, r| numbers(bag, r, |index, of, x, _| if index * 10 / of == 6 { f64::NAN } else { x })),
    ("frozen", |bag, r| numbers(bag, r, |index, of, x, was| if index > of / 2 { was[of / 2] } else { x })),
    ("zero", |bag, r| numbers(bag, r, |_, _, _, _| 0.0)),
    ("every tenth gone", |bag, r| {
        let topic = a_topic(bag, r);
        bag.keep(|name, index, _| name != topic || index % 10 != 3);
        Some(Costs::Samples)
    }),
    ("a hole in one topic, record kept", |bag, r| gone(bag, r, |share| (0.5..0.6).contains(&share), true)),
    ("a hole in one topic", |bag, r| gone(bag, r, |share| (0.5..0.6).contains(&share), false)),
    ("the end of one topic gone, record kept", |bag, r| gone(bag, r, |share| share > 0.9, true)),
    ("the end of one topic gone", |bag, r| gone(bag, r, |share| share > 0.9, false)),
    ("the beginning of one topic gone", |bag, r| gone(bag, r, |share| share < 0.1, false)),
    ("a topic gone", |bag, r| gone(bag, r, |_| true, false)),
    ("a hole", |bag, _| {
        bag.keep(|_, index, of| !(0.5..0.6).contains(&(index as f64 / of as f64)));
        bag.forget_completeness();
        Some(Costs::Samples)
    }),
    ("the end gone", |bag, _| {
        bag.keep(|_, index, of| index * 10 < of * 8);
        bag.forget_completeness();
        Some(Costs::Samples)
    }),
    ("the end gone, record kept, no duration", |bag, _| {
        bag.keep(|_, index, of| index * 10 < of * 8);
        bag.graph(|text| text.lines().filter(|line| !line.starts_with("duration_s")).collect::<Vec<_>>().join("\n"));
        Some(Costs::Samples)
    }),
    ("a status gone", |bag, _| {
        bag.keep(|name, index, _| name != "/master/status" || index != 3);
        (bag.count("/master/status") > 5).then_some(Costs::Others)
    }),
    ("the graph at twice the rate", |bag, _| {
        bag.graph(|text| {
            let twice = |line: &str| match line.strip_prefix("rate_hz = ") {
                Some(rate) => format!("rate_hz = {}", 2.0 * rate.split('#').next().unwrap().trim().parse::<f64>().unwrap()),
                None => line.to_owned(),
            };
            text.lines().map(twice).collect::<Vec<_>>().join("\n")
        });
        Some(Costs::Itself)
    }),
    ("a file gone", |bag, r| {
        let at = r.random_range(0..bag.attachments.len());
        bag.attachments.remove(at);
        Some(Costs::Itself)
    }),
    ("two different messages with one sequence number", |bag, _| {
        let at = bag.messages.iter().position(|m| m.topic == "/master/measured_js" && m.header.sequence == 50)?;
        let mut other = bag.messages[at].clone();
        let last = other.data.len() - 1;
        other.data[last] ^= 0x40;
        bag.messages.insert(at + 1, other);
        Some(Costs::Itself)
    }),
    ("a message twice", |bag, r| {
        let topic = a_topic(bag, r);
        let at = bag.messages.iter().position(|m| m.topic == topic && m.header.sequence == 40)?;
        bag.messages.insert(at + 1, bag.messages[at].clone());
        Some(Costs::Nothing)
    }),
    ("two messages exchanged", |bag, r| {
        let topic = a_topic(bag, r);
        let at = |sequence| bag.messages.iter().position(|m| m.topic == topic && m.header.sequence == sequence);
        let (one, other) = (at(40)?, at(41)?);
        bag.messages.swap(one, other);
        Some(Costs::Nothing)
    }),
    ("the metadata's rate", |bag, r| {
        let rate = ["NaN", "0", "-1000", "inf", "7"][r.random_range(0..5)];
        bag.record("backdrive.run").insert("rate_hz".to_owned(), rate.to_owned());
        Some(Costs::Nothing)
    }),
    ("another title", |bag, _| {
        bag.record("backdrive.run").insert("title".to_owned(), "another".to_owned());
        Some(Costs::Nothing)
    }),
    ("another file beside", |bag, _| {
        bag.attachments.push(("notes.txt".to_owned(), b"made on a Tuesday".to_vec()));
        Some(Costs::Nothing)
    }),
];
