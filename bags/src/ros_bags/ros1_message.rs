//! Messages of ROS 1 in the form of ROS 2: the same fields, aligned, times as two numbers of `builtin_interfaces`, headers without their `seq`.

use crate::cdr::{Count, MOST_NESTED, Schema, Type};
use backdrive_msgs::ros::ENCAPSULATION;

/// A type of ROS 1 that can be turned into one of ROS 2.
pub(crate) struct Converter {
    /// Its name in ROS 2.
    pub(crate) type_name: String,
    /// Its definition in ROS 2.
    pub(crate) definition: String,
    schema: Schema,
    /// Which of the schema's types has a `seq` before its fields on the wire of ROS 1.
    header: Option<usize>,
}

const HEADER: &str = "std_msgs/Header";
const TIMES: [(&str, &str); 2] =
    [("builtin_interfaces/Time", "int32 sec\nuint32 nanosec\n"), ("builtin_interfaces/Duration", "int32 sec\nuint32 nanosec\n")];

impl Converter {
    /// Reads a definition of ROS 1: the fields, and behind lines of `=` those of every type they are made of.
    ///
    /// # Errors
    /// A sentence: what cannot be read in it.
    pub(crate) fn new(type_name: &str, text: &str) -> Result<Converter, String> {
        let mut sections: Vec<(String, String)> = vec![(type_name.to_owned(), String::new())];
        for line in text.lines() {
            let line = line.split('#').next().unwrap_or_default().trim();
            if line.len() >= 3 && line.bytes().all(|byte| byte == b'=') {
                sections.push((String::new(), String::new()));
            } else if let Some((name, fields)) = sections.last_mut() {
                match line.strip_prefix("MSG:") {
                    Some(found) => *name = found.trim().to_owned(),
                    // Constants are not on the wire.
                    None if line.is_empty() || line.contains('=') => {}
                    None => fields.push_str(&field(name, line)?),
                }
            }
        }
        for (name, fields) in TIMES {
            let is_used = sections.iter().any(|(_, text)| text.contains(name));
            if is_used && !sections.iter().any(|(known, _)| known == name) {
                sections.push((name.to_owned(), fields.to_owned()));
            }
        }
        let header = sections.iter().position(|(name, _)| name == HEADER || name == "roslib/Header");
        let mut definition = String::new();
        for (place, (name, fields)) in sections.iter().enumerate() {
            if place > 0 {
                let name = if Some(place) == header { HEADER } else { name };
                definition.push_str(&format!("{}\nMSG: {name}\n", "=".repeat(80)));
            }
            definition.push_str(fields);
        }
        let type_name = type_name.replacen('/', "/msg/", 1);
        let schema = Schema::parse(&type_name, &definition)?;
        Ok(Converter { type_name, definition, schema, header })
    }

    /// Writes a message in the form of ROS 2 in place of what `out` holds.
    ///
    /// # Errors
    /// A sentence: the message does not match the definition.
    pub(crate) fn convert(&self, message: &[u8], out: &mut Vec<u8>) -> Result<(), String> {
        out.clear();
        out.extend(ENCAPSULATION);
        let mut wire = Wire { bytes: message, at: 0 };
        self.copy(0, &mut wire, out, 0)?;
        match wire.at == message.len() {
            true => Ok(()),
            false => Err(format!("the message has {} bytes, its definition makes {}", message.len(), wire.at)),
        }
    }

    fn copy(&self, of: usize, wire: &mut Wire, out: &mut Vec<u8>, nested: usize) -> Result<(), String> {
        if nested > MOST_NESTED {
            return Err("the definition contains itself".to_owned());
        }
        let fields = self.schema.types.get(of).map_or(&[][..], Vec::as_slice);
        if self.header == Some(of) {
            wire.take(4)?;
        }
        if fields.is_empty() {
            out.push(0); // ROS 2 has a byte where there is nothing
        }
        for field in fields {
            let count = match field.count {
                Count::One => 1,
                Count::Array(count) => count,
                Count::Sequence => {
                    let bytes = wire.take(4)?;
                    align(out, 4);
                    out.extend(bytes);
                    length(bytes)
                }
            };
            match field.of {
                Type::Message(inner) => {
                    let before = wire.at;
                    for _ in 0..count {
                        self.copy(inner, wire, out, nested + 1)?;
                        if wire.at == before && count > MOST_EMPTY {
                            return Err(format!("{}: {count} messages without fields; it is damaged", field.name));
                        }
                    }
                }
                Type::Text | Type::WideText => {
                    for _ in 0..count {
                        let length = length(wire.take(4)?);
                        let text = wire.take(length)?;
                        align(out, 4);
                        out.extend((length as u32 + 1).to_le_bytes());
                        out.extend(text);
                        out.push(0);
                    }
                }
                Type::Bool => out.extend(wire.take(count)?),
                Type::Unsigned(size) | Type::Signed(size) | Type::Float(size) if count > 0 => {
                    let size = usize::from(size);
                    let bytes = wire.take(count.saturating_mul(size))?;
                    align(out, size);
                    out.extend(bytes);
                }
                Type::Unsigned(_) | Type::Signed(_) | Type::Float(_) => {}
            }
        }
        Ok(())
    }
}

/// A list of more messages without fields than this is damage.
const MOST_EMPTY: usize = 1 << 16;

/// A field in the words of ROS 2.
fn field(section: &str, line: &str) -> Result<String, String> {
    let (of, name) = line.split_once(char::is_whitespace).ok_or_else(|| format!("definition of {section}: {line:?} is not a field"))?;
    let (name, is_header) = (name.trim(), section == HEADER || section == "roslib/Header");
    if is_header && name == "seq" {
        return Ok(String::new());
    }
    let (element, list) = of.find('[').map_or((of, ""), |place| of.split_at(place));
    let element = match element {
        "time" => TIMES[0].0,
        "duration" => TIMES[1].0,
        "Header" | "roslib/Header" => HEADER,
        "char" => "uint8",
        "byte" => "int8",
        other => other,
    };
    Ok(format!("{element}{list} {name}\n"))
}

fn length(bytes: &[u8]) -> usize {
    bytes.iter().rev().fold(0, |length, byte| length << 8 | usize::from(*byte))
}

/// Zeros up to a multiple, counted from behind the encapsulation.
fn align(out: &mut Vec<u8>, to: usize) {
    let behind = ENCAPSULATION.len();
    out.resize(behind + (out.len() - behind).next_multiple_of(to), 0);
}

/// A message of ROS 1: lower byte first, nothing aligned.
struct Wire<'a> {
    bytes: &'a [u8],
    at: usize,
}

impl<'a> Wire<'a> {
    fn take(&mut self, count: usize) -> Result<&'a [u8], String> {
        let end = self.at.checked_add(count).filter(|end| *end <= self.bytes.len());
        let end = end.ok_or_else(|| format!("the message ends at byte {}, {count} more are due at {}", self.bytes.len(), self.at))?;
        let taken = &self.bytes[self.at..end];
        self.at = end;
        Ok(taken)
    }
}

#[cfg(test)]
mod tests {
    use super::Converter;
    use crate::cdr::Schema;

    const JOINT_STATE: &str = "# a comment\nHeader header\n\nstring[] name\nfloat64[] position\nfloat64[] velocity\nfloat64[] effort\n\
        ====\nMSG: std_msgs/Header\nuint32 seq\n#time\ntime stamp\nstring frame_id\n";

    fn joint_state() -> Vec<u8> {
        let mut message = Vec::new();
        for word in [7_u32, 1_700_000_000, 250_000_000, 1] {
            message.extend(word.to_le_bytes());
        }
        message.extend(b"b");
        message.extend(1_u32.to_le_bytes());
        message.extend(3_u32.to_le_bytes());
        message.extend(b"arm");
        message.extend(1_u32.to_le_bytes());
        message.extend(0.5_f64.to_le_bytes());
        message.extend([0; 8]);
        message
    }

    #[test]
    fn a_joint_state_has_its_fields_in_ros_2() {
        let converter = Converter::new("sensor_msgs/JointState", JOINT_STATE).expect("it is read");
        assert_eq!(converter.type_name, "sensor_msgs/msg/JointState");
        let mut payload = Vec::new();
        converter.convert(&joint_state(), &mut payload).expect("it is converted");
        let schema = Schema::parse(&converter.type_name, &converter.definition).expect("it parses");
        let read = |path: &str| schema.read(&schema.find(path).expect(path), &payload).expect(path);
        assert_eq!((read("position[0]"), read("velocity[0]")), (Some(0.5), None));
        assert_eq!((read("header.stamp.sec"), read("header.stamp.nanosec")), (Some(1.7e9), Some(2.5e8)));
    }

    #[test]
    fn a_message_that_is_not_what_its_definition_says_is_an_error() {
        let converter = Converter::new("sensor_msgs/JointState", JOINT_STATE).expect("it is read");
        let (message, mut out) = (joint_state(), Vec::new());
        for length in 0..message.len() {
            assert!(converter.convert(&message[..length], &mut out).is_err(), "{length}");
        }
        let longer = [message.as_slice(), &[0]].concat();
        assert!(converter.convert(&longer, &mut out).is_err_and(|what| what.contains("its definition makes")));
        assert!(Converter::new("a/B", "Missing x\n").is_err() && Converter::new("a/B", "x\n").is_err());
        let endless = Converter::new("a/B", "B[] inner\n").expect("it is read");
        assert!(endless.convert(&[1, 0, 0, 0].repeat(40), &mut out).is_err());
    }

    #[test]
    fn odd_types_keep_their_values() {
        let text = "byte a\nchar b\nint8 KIND=3\nduration wait\nbool[2] flags\nuint16[] counts\nfloat32 last\n";
        let converter = Converter::new("a/Odd", text).expect("it is read");
        let mut message = vec![0xff, 200];
        message.extend((-1_i32).to_le_bytes());
        message.extend(5_u32.to_le_bytes());
        message.extend([1, 0, 1, 0, 0, 0, 7, 1]);
        message.extend(1.5_f32.to_le_bytes());
        let mut payload = Vec::new();
        converter.convert(&message, &mut payload).expect("it is converted");
        let schema = Schema::parse(&converter.type_name, &converter.definition).expect("it parses");
        let read = |path: &str| schema.read(&schema.find(path).expect(path), &payload).expect(path);
        assert_eq!((read("a"), read("b"), read("wait.sec"), read("wait.nanosec")), (Some(-1.0), Some(200.0), Some(-1.0), Some(5.0)));
        assert_eq!((read("flags[0]"), read("flags[1]"), read("counts[0]"), read("last")), (Some(1.0), Some(0.0), Some(263.0), Some(1.5)));
    }
}
