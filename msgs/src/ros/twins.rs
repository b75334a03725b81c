//! What the CDR encoder and decoder see: the fields of each message in the order of its schema.

use super::facts::{Facts, RosError};
use super::frame::FrameId;
use super::mark::Mark;
use super::time::Time;
use crate::text::Text;
use crate::{Event, Gains, MAX_AXES, Margin, NOT_MEASURED, Sample, Status};
use serde::de::{SeqAccess, Visitor};
use serde::ser::{SerializeSeq, SerializeStruct};
use serde::{Deserialize, Deserializer, Serialize, Serializer};
use std::borrow::Cow;
use std::fmt;

/// A NaN has many bit patterns; a bag holds one of them.
pub(super) fn canonical(value: f64) -> f64 {
    if value.is_nan() { NOT_MEASURED } else { value }
}

/// `sensor_msgs/JointState` in the form that is written.
pub(super) struct JointState<'a> {
    pub(super) sample: &'a Sample,
    pub(super) axis_names: &'a [String],
    pub(super) form: Form<'a>,
}

/// What a JointState is written for.
#[derive(Clone, Copy, PartialEq, Eq)]
pub(super) enum Form<'a> {
    /// A bag: no frame, and the other facts stand beside it.
    Bag,
    /// The wire: everything in one message, in the frame id.
    Wire(Option<&'a Mark<'a>>),
    /// The wire, for a list of named numbers, which are positions and nothing else.
    WireList(Option<&'a Mark<'a>>),
}

impl Serialize for JointState<'_> {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        let axes = self.sample.len();
        let frame_id = match self.form {
            Form::Bag => None,
            Form::Wire(mark) | Form::WireList(mark) => Some(FrameId::of(self.sample, mark)),
        };
        let mut out = serializer.serialize_struct("JointState", 7)?;
        out.serialize_field("stamp", &Time::from_ns(self.sample.stamp_ns))?;
        out.serialize_field("frame_id", frame_id.as_ref().map_or("", FrameId::as_str))?;
        out.serialize_field("name", &AxisNames { given: self.axis_names, axes })?;
        out.serialize_field("position", &Quantity(&self.sample.position[..axes]))?;
        let further = if matches!(self.form, Form::WireList(_)) { 0 } else { axes };
        out.serialize_field("velocity", &Quantity(&self.sample.velocity[..further]))?;
        out.serialize_field("effort", &Quantity(&self.sample.effort[..further]))?;
        out.end()
    }
}

/// Exactly as many names as there are axes: readers pair them with the values.
struct AxisNames<'a> {
    given: &'a [String],
    axes: usize,
}

impl Serialize for AxisNames<'_> {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        const SPARE: [&str; MAX_AXES] = ["axis0", "axis1", "axis2", "axis3", "axis4", "axis5", "axis6", "axis7"];
        let mut out = serializer.serialize_seq(Some(self.axes))?;
        for axis in 0..self.axes {
            out.serialize_element(self.given.get(axis).map_or(SPARE[axis], String::as_str))?;
        }
        out.end()
    }
}

/// Position, velocity or effort of all axes, NaN where it was not measured.
struct Quantity<'a>(&'a [f64]);

impl Serialize for Quantity<'_> {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        let mut out = serializer.serialize_seq(Some(self.0.len()))?;
        for value in self.0 {
            out.serialize_element(&canonical(*value))?;
        }
        out.end()
    }
}

/// `sensor_msgs/JointState` in the form that is read, without allocating. A quantity that no axis has may be an empty array: older bags and other
/// people write it so.
#[derive(Deserialize)]
pub(super) struct JointStateIn {
    stamp: Time,
    frame: FrameIn,
    _names: SkippedStrings,
    position: Values,
    velocity: Values,
    effort: Values,
}

impl TryFrom<JointStateIn> for Sample {
    type Error = RosError;

    fn try_from(read: JointStateIn) -> Result<Sample, RosError> {
        match &read.frame {
            FrameIn::Ours(Frame { facts, axes }) => read.with(facts, *axes),
            FrameIn::Foreign(frame_id) => Err(RosError::Foreign { frame_id: frame_id.clone() }),
        }
    }
}

impl JointStateIn {
    /// The sample that it is part of, in either form: the content of its frame id takes precedence over `facts`.
    pub(super) fn sample(self, facts: &Facts) -> Result<Sample, RosError> {
        match self.frame {
            FrameIn::Ours(_) => Sample::try_from(self),
            FrameIn::Foreign(_) => match u32::try_from(self.position.len) {
                Ok(axes) if axes as usize <= MAX_AXES => self.with(facts, axes),
                _ => Err(RosError::Inconsistent { what: format!("{} axes, but {MAX_AXES} are the most", self.position.len) }),
            },
        }
    }

    fn with(&self, facts: &Facts, axes: u32) -> Result<Sample, RosError> {
        for (name, values) in [("position", &self.position), ("velocity", &self.velocity), ("effort", &self.effort)] {
            if values.len != 0 && values.len != axes as usize {
                return Err(RosError::Inconsistent { what: format!("{axes} axes, but {name} has {} entries", values.len) });
            }
        }
        Ok(Sample {
            layout: facts.layout,
            source: facts.source,
            step: facts.step,
            sequence: facts.sequence,
            stamp_ns: facts.stamp_ns.unwrap_or_else(|| self.stamp.to_ns()),
            axes,
            flags: facts.flags,
            position: self.position.values,
            velocity: self.velocity.values,
            effort: self.effort.values,
        })
    }
}

/// Content of a frame id of ours.
struct Frame {
    facts: Facts,
    axes: u32,
}

impl Frame {
    /// Keys may come in any order and unknown ones are skipped, so that a later version may add some.
    fn parse(text: &str) -> Option<Frame> {
        let (mut step, mut sequence, mut source, mut axes, mut flags, mut layout, mut stamp_ns) =
            (None, None, None, None, None, None, None);
        for word in text.split_ascii_whitespace() {
            let (key, value) = word.split_once('=')?;
            match key {
                "step" => step = Some(value.parse().ok()?),
                "seq" => sequence = Some(value.parse().ok()?),
                "src" => source = Some(u32::from_str_radix(value, 16).ok()?),
                "axes" => axes = Some(value.parse().ok().filter(|axes| *axes as usize <= MAX_AXES)?),
                "flags" => flags = Some(value.parse().ok()?),
                "layout" => layout = Some(value.parse().ok()?),
                "stamp" => stamp_ns = Some(value.parse().ok()?),
                _ => {}
            }
        }
        let facts = Facts { step: step?, sequence: sequence?, source: source?, flags: flags?, layout: layout?, stamp_ns };
        Some(Frame { facts, axes: axes? })
    }
}

enum FrameIn {
    Ours(Frame),
    Foreign(String),
}

impl<'de> Deserialize<'de> for FrameIn {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<FrameIn, D::Error> {
        struct FrameVisitor;
        impl Visitor<'_> for FrameVisitor {
            type Value = FrameIn;

            fn expecting(&self, f: &mut fmt::Formatter) -> fmt::Result {
                f.write_str("a frame id")
            }

            fn visit_str<E>(self, text: &str) -> Result<FrameIn, E> {
                Ok(Frame::parse(text).map_or_else(|| FrameIn::Foreign(Text::<64>::new(text).as_str().to_owned()), FrameIn::Ours))
            }
        }
        deserializer.deserialize_str(FrameVisitor)
    }
}

/// Axis names are for other people's tools.
struct SkippedStrings;

impl<'de> Deserialize<'de> for SkippedStrings {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<SkippedStrings, D::Error> {
        struct Skip;
        impl Visitor<'_> for Skip {
            type Value = Skip;

            fn expecting(&self, f: &mut fmt::Formatter) -> fmt::Result {
                f.write_str("a name")
            }

            fn visit_str<E>(self, _: &str) -> Result<Skip, E> {
                Ok(Skip)
            }
        }
        impl<'de> Deserialize<'de> for Skip {
            fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Skip, D::Error> {
                deserializer.deserialize_str(Skip)
            }
        }
        struct Strings;
        impl<'de> Visitor<'de> for Strings {
            type Value = SkippedStrings;

            fn expecting(&self, f: &mut fmt::Formatter) -> fmt::Result {
                f.write_str("names")
            }

            fn visit_seq<A: SeqAccess<'de>>(self, mut seq: A) -> Result<SkippedStrings, A::Error> {
                while seq.next_element::<Skip>()?.is_some() {}
                Ok(SkippedStrings)
            }
        }
        deserializer.deserialize_seq(Strings)
    }
}

/// An array of at most [`MAX_AXES`] numbers; the places beyond it are not measured.
struct Values {
    values: [f64; MAX_AXES],
    len: usize,
}

impl<'de> Deserialize<'de> for Values {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Values, D::Error> {
        struct ValuesVisitor;
        impl<'de> Visitor<'de> for ValuesVisitor {
            type Value = Values;

            fn expecting(&self, f: &mut fmt::Formatter) -> fmt::Result {
                f.write_str("numbers")
            }

            fn visit_seq<A: SeqAccess<'de>>(self, mut seq: A) -> Result<Values, A::Error> {
                let mut read = Values { values: [NOT_MEASURED; MAX_AXES], len: 0 };
                while let Some(value) = seq.next_element::<f64>()? {
                    // A longer array is somebody else's: its length shows this, its values are not needed.
                    if let Some(place) = read.values.get_mut(read.len) {
                        *place = canonical(value);
                    }
                    read.len += 1;
                }
                Ok(read)
            }
        }
        deserializer.deserialize_seq(ValuesVisitor)
    }
}

/// The fields that all twins share. The stamp stands twice: in the header for tools, in full for us.
#[derive(Serialize, Deserialize)]
struct Common {
    stamp: Time,
    frame_id: Cow<'static, str>,
    layout: u32,
    source: u32,
    step: u64,
    sequence: u64,
    stamp_ns: i64,
}

impl Common {
    fn new(layout: u32, source: u32, step: u64, sequence: u64, stamp_ns: i64) -> Common {
        Common { stamp: Time::from_ns(stamp_ns), frame_id: Cow::Borrowed(""), layout, source, step, sequence, stamp_ns }
    }
}

/// `backdrive_msgs/Steps`.
#[derive(Serialize, Deserialize)]
pub(super) struct StepsTwin<'a> {
    stamp: Time,
    frame_id: Cow<'static, str>,
    topic: Cow<'a, str>,
    layout: u32,
    source: u32,
    flags: u32,
    step: u64,
    sequence: u64,
    stamp_ns: i64,
}

impl<'a> StepsTwin<'a> {
    pub(super) fn new(topic: &'a str, sample: &Sample) -> StepsTwin<'a> {
        let Sample { layout, source, step, sequence, stamp_ns, flags, .. } = *sample;
        let (stamp, frame_id, topic) = (Time::from_ns(stamp_ns), Cow::Borrowed(""), Cow::Borrowed(topic));
        StepsTwin { stamp, frame_id, topic, layout, source, flags, step, sequence, stamp_ns }
    }

    pub(super) fn into_facts(self) -> (String, Facts) {
        let StepsTwin { topic, layout, source, flags, step, sequence, stamp_ns, .. } = self;
        (topic.into_owned(), Facts { layout, source, step, sequence, flags, stamp_ns: Some(stamp_ns) })
    }
}

/// `backdrive_msgs/Gains`.
#[derive(Serialize, Deserialize)]
pub(super) struct GainsTwin {
    common: Common,
    mu: f64,
    lambda: f64,
    ramp_s: f64,
}

impl From<&Gains> for GainsTwin {
    fn from(gains: &Gains) -> Self {
        GainsTwin {
            common: Common::new(gains.layout, gains.source, gains.step, gains.sequence, gains.stamp_ns),
            mu: canonical(gains.mu),
            lambda: canonical(gains.lambda),
            ramp_s: canonical(gains.ramp_s),
        }
    }
}

impl From<GainsTwin> for Gains {
    fn from(GainsTwin { common, mu, lambda, ramp_s }: GainsTwin) -> Gains {
        let Common { layout, source, step, sequence, stamp_ns, .. } = common;
        Gains { layout, source, step, sequence, stamp_ns, mu: canonical(mu), lambda: canonical(lambda), ramp_s: canonical(ramp_s) }
    }
}

/// `backdrive_msgs/Event`.
#[derive(Serialize, Deserialize)]
pub(super) struct EventTwin<'a> {
    common: Common,
    severity: u32,
    value: f64,
    kind: Cow<'a, str>,
    text: Cow<'a, str>,
}

impl<'a> From<&'a Event> for EventTwin<'a> {
    fn from(event: &'a Event) -> Self {
        EventTwin {
            common: Common::new(event.layout, event.source, event.step, event.sequence, event.stamp_ns),
            severity: event.severity,
            value: canonical(event.value),
            kind: Cow::Borrowed(event.kind.as_str()),
            text: Cow::Borrowed(event.text.as_str()),
        }
    }
}

impl From<EventTwin<'_>> for Event {
    fn from(EventTwin { common, severity, value, kind, text }: EventTwin) -> Event {
        let Common { layout, source, step, sequence, stamp_ns, .. } = common;
        let (kind, text) = (Text::new(&kind), Text::new(&text));
        Event { layout, source, step, sequence, stamp_ns, severity, reserved: 0, value: canonical(value), kind, text }
    }
}

/// `backdrive_msgs/Status`.
#[derive(Serialize, Deserialize)]
pub(super) struct StatusTwin {
    common: Common,
    steps: u64,
    missed_deadlines: u64,
    lost: u64,
    loop_p50_s: f64,
    loop_p99_s: f64,
}

impl From<&Status> for StatusTwin {
    fn from(status: &Status) -> Self {
        StatusTwin {
            common: Common::new(status.layout, status.source, status.step, status.sequence, status.stamp_ns),
            steps: status.steps,
            missed_deadlines: status.missed_deadlines,
            lost: status.lost,
            loop_p50_s: canonical(status.loop_p50_s),
            loop_p99_s: canonical(status.loop_p99_s),
        }
    }
}

impl From<StatusTwin> for Status {
    fn from(StatusTwin { common, steps, missed_deadlines, lost, loop_p50_s, loop_p99_s }: StatusTwin) -> Status {
        let Common { layout, source, step, sequence, stamp_ns, .. } = common;
        let (loop_p50_s, loop_p99_s) = (canonical(loop_p50_s), canonical(loop_p99_s));
        Status { layout, source, step, sequence, stamp_ns, steps, missed_deadlines, lost, loop_p50_s, loop_p99_s }
    }
}

/// `backdrive_msgs/Margin`.
#[derive(Serialize, Deserialize)]
pub(super) struct MarginTwin {
    common: Common,
    axis: u32,
    known: u32,
    gain: f64,
    factor: f64,
    deviation: f64,
    frequency_hz: f64,
    decay_per_s: f64,
}

impl From<&Margin> for MarginTwin {
    fn from(margin: &Margin) -> Self {
        MarginTwin {
            common: Common::new(margin.layout, margin.source, margin.step, margin.sequence, margin.stamp_ns),
            axis: margin.axis,
            known: margin.known,
            gain: canonical(margin.gain),
            factor: canonical(margin.factor),
            deviation: canonical(margin.deviation),
            frequency_hz: canonical(margin.frequency_hz),
            decay_per_s: canonical(margin.decay_per_s),
        }
    }
}

impl From<MarginTwin> for Margin {
    fn from(twin: MarginTwin) -> Margin {
        let MarginTwin { common, axis, known, gain, factor, deviation, frequency_hz, decay_per_s } = twin;
        let Common { layout, source, step, sequence, stamp_ns, .. } = common;
        let [gain, factor, deviation, frequency_hz, decay_per_s] = [gain, factor, deviation, frequency_hz, decay_per_s].map(canonical);
        Margin { layout, source, step, sequence, stamp_ns, axis, known, gain, factor, deviation, frequency_hz, decay_per_s }
    }
}
