//! A ROS 2 node in a few lines, over the transport of the graphs: it listens, speaks, asks or echoes on one topic.
//!
//!   ros2_peer listen TOPIC[:KIND] ...     until nothing has come for 2 s: how many messages of each, the first and last number, how many late.
//!   ros2_peer speak TOPIC COUNT HZ        sends samples once somebody listens.
//!   ros2_peer push TOPIC EFFORT HZ SECONDS   sends a force at once, whoever listens, as a stranger would.
//!   ros2_peer ping COUNT HZ               sends on /ping, hears /pong: one way and round trip, median and 99th percentile.
//!   ros2_peer echo                        sends what it hears on /ping back on /pong, until nobody speaks any more.
//!
//!   ros2_peer as FILE ...                 the same as a node of the run whose `identity.json` this is: it tags what it sends, and hears that run alone
//!
//! KIND is sample (the default), gains, status, margin or event. The one-way time is measured in the clock of one machine: both ends must share it, as
//! network namespaces do.

use backdrive_msgs::topic::{Kind, Topic};
use backdrive_msgs::{Message, Sample};
use backdrive_nodes::clock::now_ns;
use backdrive_nodes::transport::ros2::{Delivery, Identity, Network, Ros2};
use backdrive_nodes::transport::{Transport, TransportError};
use serde_json::json;
use std::error::Error;
use std::time::{Duration, Instant};

/// How long it waits for the other.
const PATIENCE: Duration = Duration::from_secs(20);
/// How long nothing comes once all have spoken.
const QUIET: Duration = Duration::from_secs(2);

fn main() -> Result<(), Box<dyn Error>> {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let mut words: Vec<&str> = arguments.iter().map(String::as_str).collect();
    let mut ros2 = Ros2::open(&Network::from_environment()?, "ros2_peer", Delivery::BestEffort)?;
    if let ["as", file, ref rest @ ..] = words[..] {
        ros2 = ros2.with_identity(Identity::read(file.as_ref())?);
        words = rest.to_vec();
    }
    match words[..] {
        ["listen", ref topics @ ..] if !topics.is_empty() => listen(&mut ros2, topics)?,
        ["speak", topic, count, hz] => speak(&mut ros2, topic, count.parse()?, hz.parse()?)?,
        ["push", topic, effort, hz, seconds] => push(&mut ros2, topic, effort.parse()?, hz.parse()?, seconds.parse()?)?,
        ["ping", count, hz] => ping(&mut ros2, count.parse()?, hz.parse()?)?,
        ["echo"] => echo(&mut ros2)?,
        _ => return Err("say listen, speak, push, ping or echo; the first lines of the source tell how".into()),
    }
    Ok(())
}

fn samples(name: &str) -> Topic {
    Topic { name: name.to_string(), kind: Kind::Sample }
}

fn sample(sequence: u64) -> Message {
    let mut sample = Sample { step: sequence, sequence, stamp_ns: now_ns(), ..Sample::new(2) };
    sample.position[..2].copy_from_slice(&[0.1, 0.2]);
    sample.effort[..2].copy_from_slice(&[1.0, 2.0]);
    Message::Sample(sample)
}

/// A topic by its name and what it carries.
fn named(text: &str) -> Result<Topic, Box<dyn Error>> {
    let (name, kind) = text.split_once(':').unwrap_or((text, "sample"));
    Ok(Topic { name: name.to_string(), kind: serde_json::from_value(kind.into())? })
}

fn listen(ros2: &mut Ros2, topics: &[&str]) -> Result<(), Box<dyn Error>> {
    let mut lanes = Vec::new();
    for text in topics {
        let topic = named(text)?;
        lanes.push((ros2.subscriber(&topic, usize::MAX, true)?, topic.name, Vec::new()));
    }
    println!("listening");
    let (mut begun, mut at) = (false, Instant::now());
    while at.elapsed() < if begun { QUIET } else { PATIENCE } {
        let mut came = false;
        for (subscriber, _, numbers) in &mut lanes {
            while let Some(message) = subscriber.receive()? {
                numbers.push(message.sequence());
                came = true;
            }
        }
        if came {
            (begun, at) = (true, Instant::now());
        } else {
            ros2.wait(Duration::from_millis(100))?;
        }
    }
    let mut told = serde_json::Map::new();
    for (subscriber, name, numbers) in lanes {
        let (first, last) = (numbers.iter().min(), numbers.iter().max());
        told.insert(
            name,
            json!({ "count": numbers.len(), "first": first, "last": last, "ordered": numbers.is_sorted(), "late": subscriber.late() }),
        );
    }
    println!("{}", serde_json::Value::Object(told));
    Ok(())
}

fn speak(ros2: &mut Ros2, topic: &str, count: u64, hz: f64) -> Result<(), TransportError> {
    let mut publisher = ros2.publisher(&samples(topic), 1)?;
    let begun = Instant::now();
    while publisher.listeners() == 0 && begun.elapsed() < PATIENCE {
        std::thread::sleep(Duration::from_millis(5));
    }
    // The other end may hear of this one a little later.
    std::thread::sleep(Duration::from_millis(300));
    let begun = Instant::now();
    for i in 0..count {
        std::thread::sleep(Duration::from_secs_f64(i as f64 / hz).saturating_sub(begun.elapsed()));
        publisher.send(&sample(i))?;
    }
    println!("{{\"count\": {count}}}");
    Ok(())
}

fn push(ros2: &mut Ros2, topic: &str, effort: f64, hz: f64, seconds: f64) -> Result<(), TransportError> {
    let mut publisher = ros2.publisher(&samples(topic), 1)?;
    println!("listening");
    let (begun, mut count) = (Instant::now(), 0);
    while begun.elapsed().as_secs_f64() < seconds {
        let mut sample = Sample { step: count, sequence: count, stamp_ns: now_ns(), ..Sample::new(1) };
        sample.effort[0] = effort;
        publisher.send(&Message::Sample(sample))?;
        count += 1;
        std::thread::sleep(Duration::from_secs_f64(count as f64 / hz).saturating_sub(begun.elapsed()));
    }
    println!("{{\"count\": {count}}}");
    Ok(())
}

fn ping(ros2: &mut Ros2, count: u64, hz: f64) -> Result<(), TransportError> {
    let mut publisher = ros2.publisher(&samples("/ping"), 1)?;
    let mut subscriber = ros2.subscriber(&samples("/pong"), usize::MAX, true)?;
    let begun = Instant::now();
    while (publisher.listeners() == 0 || !subscriber.has_publisher()) && begun.elapsed() < PATIENCE {
        std::thread::sleep(Duration::from_millis(5));
    }
    std::thread::sleep(Duration::from_millis(300));
    let (mut there, mut round, begun) = (Vec::new(), Vec::new(), Instant::now());
    for i in 0..count {
        std::thread::sleep(Duration::from_secs_f64(i as f64 / hz).saturating_sub(begun.elapsed()));
        let sent = now_ns();
        publisher.send(&sample(i))?;
        let asked = Instant::now();
        while asked.elapsed() < Duration::from_millis(100) {
            match subscriber.receive()? {
                Some(m) if m.sequence() == i => {
                    round.push(now_ns() - sent);
                    // The echo states when it heard.
                    there.push(m.stamp_ns() - sent);
                    break;
                }
                Some(_) => {}
                None => ros2.wait(Duration::from_millis(100))?,
            }
        }
    }
    let quantile = |times: &mut Vec<i64>, q: f64| {
        times.sort_unstable();
        times.get((times.len() as f64 * q) as usize).map_or(f64::NAN, |t| *t as f64 * 1e-3)
    };
    let numbers = [quantile(&mut there, 0.5), quantile(&mut there, 0.99), quantile(&mut round, 0.5), quantile(&mut round, 0.99)];
    let [one_p50, one_p99, round_p50, round_p99] = numbers.map(|n| format!("{n:.1}"));
    println!(
        "{{\"sent\": {count}, \"count\": {}, \"one_way_us\": [{one_p50}, {one_p99}], \"round_trip_us\": [{round_p50}, {round_p99}]}}",
        round.len()
    );
    Ok(())
}

fn echo(ros2: &mut Ros2) -> Result<(), TransportError> {
    let mut subscriber = ros2.subscriber(&samples("/ping"), usize::MAX, true)?;
    let mut publisher = ros2.publisher(&samples("/pong"), 1)?;
    println!("listening");
    let (mut met, begun) = (false, Instant::now());
    while begun.elapsed() < PATIENCE || met {
        match subscriber.receive()? {
            Some(Message::Sample(mut sample)) => {
                sample.stamp_ns = now_ns();
                publisher.send(&Message::Sample(sample))?;
            }
            Some(_) => {}
            None => {
                let there = subscriber.has_publisher();
                if met && !there {
                    return Ok(());
                }
                met |= there;
                ros2.wait(Duration::from_millis(100))?;
            }
        }
    }
    Ok(())
}
