//! Every message comes back from its ROS 2 form bit for bit.

use backdrive_msgs::ros::{self, Facts, RosError};
use backdrive_msgs::text::Text;
use backdrive_msgs::topic::Kind;
use backdrive_msgs::{Event, Gains, LAYOUT, MAX_AXES, Margin, Message, NOT_MEASURED, Sample, Status};

/// SplitMix64: enough randomness for test data, the same on every machine.
struct Random(u64);

impl Random {
    fn bits(&mut self) -> u64 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mut z = self.0;
        z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        z ^ (z >> 31)
    }

    /// Ordinary numbers, and in one of four draws any bit pattern: infinities, subnormals, NaN.
    fn number(&mut self) -> f64 {
        match self.bits() % 4 {
            0 => {
                let any = f64::from_bits(self.bits());
                if any.is_nan() { NOT_MEASURED } else { any }
            }
            1 => NOT_MEASURED,
            _ => (self.bits() as i64 as f64) * 1e-19,
        }
    }

    fn integer(&mut self) -> u64 {
        let bits = self.bits();
        bits >> (self.bits() % 64)
    }

    fn text<const N: usize>(&mut self) -> Text<N> {
        let letters: String = (0..self.bits() % 140).map(|_| char::from_u32(0x20 + (self.bits() % 0x2000) as u32).unwrap_or('x')).collect();
        Text::new(&letters)
    }
}

fn samples(random: &mut Random) -> Sample {
    let mut sample = Sample::new((random.bits() % (MAX_AXES as u64 + 1)) as usize);
    sample.layout = random.integer() as u32;
    sample.source = random.integer() as u32;
    (sample.step, sample.sequence) = (random.integer(), random.integer());
    sample.stamp_ns = random.integer() as i64;
    sample.flags = random.integer() as u32;
    for axis in 0..sample.len() {
        (sample.position[axis], sample.velocity[axis], sample.effort[axis]) = (random.number(), random.number(), random.number());
    }
    match random.bits() % 4 {
        0 => sample.velocity = [NOT_MEASURED; MAX_AXES],
        1 => (sample.position, sample.effort) = ([NOT_MEASURED; MAX_AXES], [NOT_MEASURED; MAX_AXES]),
        _ => {}
    }
    sample
}

fn there_and_back(message: &Message, payload: &mut Vec<u8>) -> Message {
    ros::encode(message, &["forward".to_owned()], payload).expect("it encodes");
    assert_eq!(payload[..4], ros::ENCAPSULATION);
    match message {
        Message::Sample(sent) => {
            let (bytes, mut said) = (payload.clone(), Vec::new());
            ros::encode_steps("/t", sent, &mut said).expect("it encodes");
            let (topic, facts) = ros::decode_steps(&said).expect("it decodes");
            assert_eq!(topic, "/t");
            // The header holds the time of all but those that it cannot represent.
            let facts = Facts { stamp_ns: facts.stamp_ns.filter(|stamp| !ros::header_holds(*stamp)), ..facts };
            Message::Sample(ros::decode_sample(&bytes, &facts).expect("it decodes"))
        }
        _ => ros::decode(message.kind(), payload).expect("it decodes"),
    }
}

#[test]
fn samples_come_back_bit_for_bit() {
    let (mut random, mut payload) = (Random(1), Vec::new());
    for _ in 0..20_000 {
        let sent = samples(&mut random);
        let Message::Sample(back) = there_and_back(&Message::Sample(sent), &mut payload) else { panic!("another kind came back") };
        assert!(back.same_bits(&sent), "sent {sent:?}\nback {back:?}");
    }
}

#[test]
fn extreme_stamps_and_counts_come_back() {
    let mut payload = Vec::new();
    for stamp_ns in [0, -1, i64::MIN, i64::MAX, i64::from(i32::MAX) * 1_000_000_000 + 999_999_999, i64::from(i32::MIN) * 1_000_000_000] {
        let mut sent = Sample::new(MAX_AXES);
        (sent.layout, sent.source, sent.flags) = (u32::MAX, u32::MAX, u32::MAX);
        (sent.step, sent.sequence, sent.stamp_ns) = (u64::MAX, u64::MAX, stamp_ns);
        let Message::Sample(back) = there_and_back(&Message::Sample(sent), &mut payload) else { panic!("another kind came back") };
        assert!(back.same_bits(&sent), "sent {sent:?}\nback {back:?}");
    }
}

#[test]
fn every_nan_comes_back_as_not_measured() {
    let mut sent = Sample::new(2);
    sent.position = [0.5; MAX_AXES]; // beyond the two axes it is nobody's
    sent.effort[0] = -f64::NAN;
    sent.effort[1] = 0.0;
    let Message::Sample(back) = there_and_back(&Message::Sample(sent), &mut Vec::new()) else { panic!("another kind came back") };
    assert_eq!(back.position[1], 0.5);
    assert_eq!(back.position[2].to_bits(), NOT_MEASURED.to_bits());
    assert_eq!(back.effort[0].to_bits(), NOT_MEASURED.to_bits());
    assert_eq!(back.effort[1].to_bits(), 0.0_f64.to_bits());
}

#[test]
fn the_other_kinds_come_back_bit_for_bit() {
    let (mut random, mut payload) = (Random(2), Vec::new());
    let debug = |message: &Message| format!("{message:?}"); // shortest decimal digits: equal text is equal bits, NaN included
    for _ in 0..5_000 {
        let (layout, source) = (random.integer() as u32, random.integer() as u32);
        let (step, sequence, stamp_ns) = (random.integer(), random.integer(), random.integer() as i64);
        let (mu, lambda, ramp_s) = (random.number(), random.number(), random.number());
        let (steps, missed_deadlines, lost) = (random.integer(), random.integer(), random.integer());
        let (severity, value, kind, text) = (random.integer() as u32, random.number(), random.text(), random.text());
        for sent in [
            Message::Gains(Gains { layout, source, step, sequence, stamp_ns, mu, lambda, ramp_s }),
            Message::Event(Event { layout, source, step, sequence, stamp_ns, severity, reserved: 0, value, kind, text }),
            Message::Status(Status {
                layout,
                source,
                step,
                sequence,
                stamp_ns,
                steps,
                missed_deadlines,
                lost,
                loop_p50_s: mu,
                loop_p99_s: lambda,
            }),
            Message::Margin(Margin {
                layout,
                source,
                step,
                sequence,
                stamp_ns,
                axis: severity,
                known: source,
                gain: mu,
                factor: lambda,
                deviation: ramp_s,
                frequency_hz: value,
                decay_per_s: lambda,
            }),
        ] {
            assert_eq!(debug(&there_and_back(&sent, &mut payload)), debug(&sent));
        }
    }
}

#[test]
fn a_joint_state_is_laid_out_as_ros_expects() {
    let mut sample = Sample::new(1);
    (sample.stamp_ns, sample.step, sample.sequence, sample.source) = (3_000_000_007, 12, 13, 0x89ab_cdef);
    sample.effort[0] = -1.5;
    let mut payload = Vec::new();
    ros::encode(&Message::Sample(sample), &["x".to_owned()], &mut payload).expect("it encodes");
    let mut expected = vec![0, 1, 0, 0, 3, 0, 0, 0, 7, 0, 0, 0];
    expected.extend([1, 0, 0, 0, 0]); // frame_id: none
    let align = |bytes: &mut Vec<u8>, to: usize| {
        while !(bytes.len() - 4).is_multiple_of(to) {
            bytes.push(0);
        }
    };
    align(&mut expected, 4);
    expected.extend([1, 0, 0, 0, 2, 0, 0, 0, b'x', 0]); // name: one string
    align(&mut expected, 4);
    for value in [f64::NAN, f64::NAN, -1.5] {
        align(&mut expected, 4);
        expected.extend([1, 0, 0, 0]); // as many as there are axes, measured or not
        align(&mut expected, 8);
        expected.extend(value.to_le_bytes());
    }
    assert_eq!(payload, expected);
}

#[test]
fn the_older_form_is_read() {
    let frame_id = format!("step=12 seq=13 src=89abcdef axes=1 flags=2 layout={LAYOUT}");
    let mut payload = vec![0, 1, 0, 0, 3, 0, 0, 0, 7, 0, 0, 0];
    payload.extend((frame_id.len() as u32 + 1).to_le_bytes());
    payload.extend(frame_id.as_bytes());
    payload.push(0);
    payload.resize(4 + (payload.len() - 4).next_multiple_of(4), 0);
    payload.extend([1, 0, 0, 0, 2, 0, 0, 0, b'x', 0, 0, 0]); // name
    payload.extend([0; 8]); // position, velocity: empty
    payload.extend([1, 0, 0, 0]);
    payload.resize(4 + (payload.len() - 4).next_multiple_of(8), 0);
    payload.extend((-1.5_f64).to_le_bytes());
    let mut sent = Sample { step: 12, sequence: 13, source: 0x89ab_cdef, flags: 2, stamp_ns: 3_000_000_007, ..Sample::new(1) };
    sent.effort[0] = -1.5;
    let Message::Sample(back) = ros::decode(Kind::Sample, &payload).expect("it decodes") else { panic!("another kind came back") };
    assert!(back.same_bits(&sent), "{back:?}");
    // Its own content takes precedence over other facts.
    let other = Facts { layout: 9, source: 9, step: 9, sequence: 9, flags: 9, stamp_ns: Some(9) };
    assert!(ros::decode_sample(&payload, &other).expect("it decodes").same_bits(&sent));
}

#[test]
fn schemas_name_their_type_and_carry_their_dependencies() {
    for kind in [Kind::Sample, Kind::Gains, Kind::Event, Kind::Status, Kind::Margin] {
        let (name, text) = ros::schema(kind);
        assert_eq!(ros::kind_of(name), Some(kind));
        let separator = format!("\n{}\nMSG: ", "=".repeat(80));
        let parts: Vec<&str> = text.split(&separator).collect();
        assert_eq!(parts.len(), 3, "{name}");
        assert!(parts[1].starts_with("std_msgs/Header\n") && parts[2].starts_with("builtin_interfaces/Time\n"), "{name}");
    }
    assert_eq!(ros::kind_of("std_msgs/msg/String"), None);
}

const FACTS: Facts = Facts { layout: LAYOUT, source: 1, step: 2, sequence: 3, flags: 0, stamp_ns: None };

#[test]
fn damaged_payloads_are_errors() {
    let mut payload = Vec::new();
    let mut random = Random(3);
    let mut sample = samples(&mut random);
    sample.axes = 3;
    ros::encode(&Message::Sample(sample), &[], &mut payload).expect("it encodes");
    for len in 0..payload.len() {
        assert!(ros::decode_sample(&payload[..len], &FACTS).is_err(), "cut to {len} of {} bytes", payload.len());
    }
    assert!(matches!(ros::decode(Kind::Sample, b"\x07\x00\x00\x00"), Err(RosError::Encapsulation { .. })));
    // Any byte may be wrong: an error or another message, never a panic or a huge allocation.
    for _ in 0..20_000 {
        let mut damaged = payload.clone();
        let at = (random.bits() % damaged.len() as u64) as usize;
        damaged[at] = random.bits() as u8;
        let _ = ros::decode_sample(&damaged, &FACTS);
        let _ = ros::decode_steps(&damaged);
        let _ = ros::decode(Kind::Event, &damaged);
    }
}

#[test]
fn a_joint_state_of_somebody_else_is_told_apart() {
    let mut payload = Vec::new();
    ros::encode(&Message::Sample(Sample::new(1)), &[], &mut payload).expect("it encodes");
    let error = ros::decode(Kind::Sample, &payload).expect_err("it is foreign");
    assert!(matches!(error, RosError::Foreign { .. }), "{error}");
}
