//! Reads a number out of any message of ROS 2, JSON or protobuf by the path of its field, guided by the schema in the bag.

use crate::cdr_bytes::Cdr;
pub(crate) use crate::cdr_bytes::{Count, Type};
use crate::field_path::Entry;
pub use crate::field_path::FieldPath;
use crate::json_message::{self, JsonMessage};
use crate::protobuf_message::ProtobufType;
use std::collections::HashMap;

/// What a topic's messages hold: of ROS 2 the definition with everything that it refers to.
#[derive(Debug, Clone, PartialEq)]
pub struct Schema {
    pub(crate) types: Vec<Vec<Field>>,
    form: Form,
}

/// How messages are encoded.
#[derive(Debug, Clone, PartialEq)]
enum Form {
    Cdr,
    /// The message itself describes its content: there are no types.
    Json,
    Protobuf(ProtobufType),
}

#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Field {
    pub(crate) name: String,
    pub(crate) of: Type,
    pub(crate) count: Count,
}

/// Nesting beyond this is a definition that contains itself.
pub(crate) const MOST_NESTED: usize = 16;

/// Most numbers that [`Schema::numbers`] lists.
const MOST_NUMBERS: usize = 256;

impl Schema {
    /// That of messages in JSON.
    pub fn json() -> Schema {
        Schema { types: Vec::new(), form: Form::Json }
    }

    /// That of messages in protobuf: `descriptors` is a FileDescriptorSet that defines `type_name`, such as `foxglove.JointStates`.
    ///
    /// Errors: a sentence, it is none or does not define it.
    pub fn protobuf(type_name: &str, descriptors: &[u8]) -> Result<Schema, String> {
        ProtobufType::parse(type_name, descriptors).map(|of| Schema { types: Vec::new(), form: Form::Protobuf(of) })
    }

    /// The message where it is JSON or protobuf; `None` where it is CDR.
    fn without_types(&self, payload: &[u8]) -> Result<Option<JsonMessage>, String> {
        match &self.form {
            Form::Cdr => Ok(None),
            Form::Json => json_message::parse(payload).map(Some),
            Form::Protobuf(of) => of.read(payload).map(Some),
        }
    }

    /// The field with the time at which a message was made; `None` where there is none.
    pub fn stamp(&self) -> Option<FieldPath> {
        let path = match &self.form {
            Form::Protobuf(of) => of.stamp()?,
            _ => "header.stamp",
        };
        self.find(path).ok()
    }

    /// Reads a ros2msg schema: the definition of `type_name`, then its dependencies behind lines of `=`.
    ///
    /// Errors: a sentence that names the line.
    pub fn parse(type_name: &str, text: &str) -> Result<Schema, String> {
        let mut sections: Vec<(String, Vec<&str>)> = vec![(short(type_name), Vec::new())];
        for line in text.lines() {
            let line = line.trim();
            if line.len() >= 3 && line.bytes().all(|byte| byte == b'=') {
                sections.push((String::new(), Vec::new()));
            } else if let Some((name, lines)) = sections.last_mut() {
                match line.strip_prefix("MSG:") {
                    Some(found) if name.is_empty() => *name = short(found.trim()),
                    _ => lines.push(line),
                }
            }
        }
        let places: HashMap<&str, usize> = sections.iter().enumerate().rev().map(|(index, (name, _))| (name.as_str(), index)).collect();
        let types = sections.iter().map(|(name, lines)| fields(name, lines, &places)).collect::<Result<_, _>>()?;
        Ok(Schema { types, form: Form::Cdr })
    }

    /// Finds a field by its path.
    ///
    /// Errors: a sentence that names what there is instead.
    pub fn find(&self, path: &str) -> Result<FieldPath, String> {
        match &self.form {
            Form::Cdr => {}
            Form::Json => return json_message::check(path).map(|()| FieldPath::of_json(path)),
            Form::Protobuf(of) => return of.check(path).map(|()| FieldPath::of_json(path)),
        }
        let (mut at, mut steps) = (0, Vec::new());
        let (mut inside, mut has_names) = (false, self.name_list().is_some());
        // A dot in brackets is one of a joint's name.
        let parting = |letter: char| {
            inside = letter == '[' || (inside && letter != ']');
            letter == '.' && !inside
        };
        let mut parts = path.split(parting).peekable();
        while let Some(part) = parts.next() {
            let (name, index) = match part.strip_suffix(']').and_then(|part| part.split_once('[')) {
                Some((name, entry)) => match entry.parse() {
                    Ok(index) => (name, Some(Entry::At(index))),
                    Err(_) if has_names && !entry.is_empty() => (name, Some(Entry::Named(entry.to_owned()))),
                    Err(_) => return Err(format!("{entry:?} is not an index")),
                },
                None => (part, None),
            };
            has_names = false;
            let fields = &self.types[at];
            let place = fields.iter().position(|field| field.name == name).ok_or_else(|| {
                let names: Vec<&str> = fields.iter().map(|field| field.name.as_str()).collect();
                format!("there is no {name:?}; there is {}", names.join(", "))
            })?;
            let field = &fields[place];
            match (field.count, index) {
                (Count::One, Some(_)) => return Err(format!("{name:?} is not a list")),
                (Count::Array(_) | Count::Sequence, None) => return Err(format!("{name:?} is a list: name the element, as in {name}[0]")),
                (Count::Array(len), Some(Entry::At(index))) if index >= len => return Err(format!("{name:?} has {len} entries")),
                (_, entry) => steps.push((place, entry)),
            }
            match (field.of, parts.peek().is_some()) {
                (Type::Message(inner), true) => at = inner,
                (Type::Message(inner), false) if self.is_time(inner) => {
                    return Ok(FieldPath { text: path.to_owned(), steps, is_time: true });
                }
                (Type::Message(inner), false) => {
                    let names: Vec<&str> = self.types[inner].iter().map(|field| field.name.as_str()).collect();
                    return Err(format!("{name:?} is not a number; it has {}", names.join(", ")));
                }
                (Type::Text | Type::WideText, _) => return Err(format!("{name:?} is text")),
                (_, true) => return Err(format!("{name:?} is a number and has no fields")),
                (_, false) => return Ok(FieldPath { text: path.to_owned(), steps, is_time: false }),
            }
        }
        Err("the path is empty".to_owned())
    }

    /// Paths of all numbers in a message like this one, at most 256: lists have the length that they have in it.
    pub fn numbers(&self, payload: &[u8]) -> Result<Vec<String>, String> {
        if let Some(message) = self.without_types(payload)? {
            return Ok(message.numbers(MOST_NUMBERS));
        }
        let mut found = Vec::new();
        let mut cdr = Cdr::new(payload)?;
        self.list(&mut cdr, 0, "", &mut found, 0)?;
        Ok(found)
    }

    /// Reads a number; `None` when the list it stands in is shorter in this message.
    ///
    /// Integers beyond 2⁵³ are rounded. A time is in s. Errors: a sentence, the message ends early.
    pub fn read(&self, path: &FieldPath, payload: &[u8]) -> Result<Option<f64>, String> {
        if let Some(message) = self.without_types(payload)? {
            return message.number(&path.text);
        }
        self.read_with(path, payload, |cdr, of| match of {
            Type::Message(_) => Ok(cdr.time_ns()? as f64 * 1e-9),
            of => cdr.number(of),
        })
    }

    /// Reads a time in ns: as a number of s since 1970 it would have a grain of 0.2 µs.
    ///
    /// `None` as of [`Schema::read`], and for a field that is no time.
    pub fn read_time_ns(&self, path: &FieldPath, payload: &[u8]) -> Result<Option<i64>, String> {
        if let Some(message) = self.without_types(payload)? {
            return Ok(message.time_ns(&path.text));
        }
        if path.is_time { self.read_with(path, payload, |cdr, _| cdr.time_ns()) } else { Ok(None) }
    }

    /// Where the messages have a list of the names of their joints, as a JointState has.
    pub(crate) fn name_list(&self) -> Option<usize> {
        if self.form != Form::Cdr {
            return Some(0); // any message may have one
        }
        self.types.first()?.iter().position(|field| field.name == "name" && field.of == Type::Text && field.count != Count::One)
    }

    /// The names of the joints in a message, in its order; none where it has no such list.
    ///
    /// Errors: a sentence, the message ends early.
    pub fn joint_names(&self, payload: &[u8]) -> Result<Vec<String>, String> {
        if let Some(message) = self.without_types(payload)? {
            return Ok(message.joint_names());
        }
        let Some((place, fields)) = self.name_list().zip(self.types.first()) else { return Ok(Vec::new()) };
        let mut cdr = Cdr::new(payload)?;
        fields[..place].iter().try_for_each(|field| self.skip_field(&mut cdr, field, 0))?;
        let count = cdr.count(fields[place].count)?;
        let name = |_| {
            let length = cdr.unsigned(4)? as usize;
            let bytes = cdr.take(length)?;
            Ok(String::from_utf8_lossy(bytes.strip_suffix(&[0]).unwrap_or(bytes)).into_owned())
        };
        (0..count).map(name).collect()
    }

    fn read_with<T>(
        &self,
        path: &FieldPath,
        payload: &[u8],
        value: impl Fn(&mut Cdr, Type) -> Result<T, String>,
    ) -> Result<Option<T>, String> {
        let mut cdr = Cdr::new(payload)?;
        let mut at = 0;
        for (depth, (place, entry)) in path.steps.iter().enumerate() {
            let fields = self.types.get(at).ok_or("the path is of another schema")?;
            for field in fields.get(..*place).ok_or("the path is of another schema")? {
                self.skip_field(&mut cdr, field, 0)?;
            }
            let field = fields.get(*place).ok_or("the path is of another schema")?;
            let len = cdr.count(field.count)?;
            let index = match entry {
                None => None,
                Some(Entry::At(index)) => Some(*index),
                Some(Entry::Named(name)) => match self.joint_names(payload)?.iter().position(|found| found == name) {
                    None => return Ok(None),
                    place => place,
                },
            };
            if let Some(index) = index {
                if index >= len {
                    return Ok(None);
                }
                self.skip(&mut cdr, field.of, index, 0)?;
            }
            match field.of {
                Type::Message(inner) if depth + 1 < path.steps.len() => at = inner,
                of => return value(&mut cdr, of).map(Some),
            }
        }
        Err("the path is empty".to_owned())
    }

    fn is_time(&self, index: usize) -> bool {
        let names: Vec<(&str, Type)> = self.types[index].iter().map(|field| (field.name.as_str(), field.of)).collect();
        names == [("sec", Type::Signed(4)), ("nanosec", Type::Unsigned(4))]
    }

    fn list(&self, cdr: &mut Cdr, of: usize, prefix: &str, found: &mut Vec<String>, nested: usize) -> Result<(), String> {
        if nested > MOST_NESTED {
            return Err("the definition contains itself".to_owned());
        }
        for field in &self.types[of] {
            let len = cdr.count(field.count)?;
            for index in 0..len {
                if found.len() >= MOST_NUMBERS {
                    return Ok(());
                }
                let name =
                    if field.count == Count::One { format!("{prefix}{}", field.name) } else { format!("{prefix}{}[{index}]", field.name) };
                match field.of {
                    Type::Message(inner) => self.list(cdr, inner, &format!("{name}."), found, nested + 1)?,
                    Type::Text | Type::WideText => self.skip(cdr, field.of, 1, nested)?,
                    of => {
                        cdr.number(of)?;
                        found.push(name);
                    }
                }
            }
        }
        Ok(())
    }

    fn skip_field(&self, cdr: &mut Cdr, field: &Field, nested: usize) -> Result<(), String> {
        let len = cdr.count(field.count)?;
        self.skip(cdr, field.of, len, nested)
    }

    fn skip(&self, cdr: &mut Cdr, of: Type, times: usize, nested: usize) -> Result<(), String> {
        if nested > MOST_NESTED {
            return Err("the definition contains itself".to_owned());
        }
        match of {
            Type::Message(inner) => {
                // A type of no size must not be skipped four thousand million times because of a damaged length.
                let fields = &self.types[inner];
                let times = if fields.is_empty() { 0 } else { times };
                for _ in 0..times {
                    let before = cdr.at;
                    for field in fields {
                        self.skip_field(cdr, field, nested + 1)?;
                    }
                    if cdr.at == before {
                        break;
                    }
                }
                Ok(())
            }
            Type::Text => (0..times).try_for_each(|_| {
                let len = cdr.unsigned(4)? as usize;
                cdr.take(len).map(|_| ())
            }),
            Type::WideText => (0..times).try_for_each(|_| {
                let len = cdr.unsigned(4)? as usize;
                cdr.take(len.saturating_mul(2)).map(|_| ())
            }),
            Type::Bool => cdr.take(times).map(|_| ()),
            Type::Unsigned(size) | Type::Signed(size) | Type::Float(size) => {
                if times > 0 {
                    cdr.align(size.into());
                    cdr.take(times.saturating_mul(size.into()))?;
                }
                Ok(())
            }
        }
    }
}

/// `std_msgs/msg/Header` and `std_msgs/Header` are the same.
fn short(name: &str) -> String {
    name.replace("/msg/", "/")
}

fn fields(of: &str, lines: &[&str], places: &HashMap<&str, usize>) -> Result<Vec<Field>, String> {
    let mut fields = Vec::new();
    for line in lines {
        let line = line.split('#').next().unwrap_or("").trim();
        let Some((type_text, rest)) = line.split_once(char::is_whitespace) else {
            if line.is_empty() {
                continue;
            }
            return Err(format!("schema of {of}: {line:?} is not a field"));
        };
        let rest = rest.trim_start();
        let name_end = rest.find(|c: char| !c.is_ascii_alphanumeric() && c != '_').unwrap_or(rest.len());
        let (name, behind) = rest.split_at(name_end);
        if behind.trim_start().starts_with('=') {
            continue; // a constant is not on the wire
        }
        let (element, count) = match type_text.strip_suffix(']').and_then(|text| text.rsplit_once('[')) {
            None => (type_text, Count::One),
            Some((element, "")) => (element, Count::Sequence),
            Some((element, bound)) if bound.starts_with("<=") => (element, Count::Sequence),
            Some((element, len)) => {
                (element, Count::Array(len.parse().map_err(|_| format!("schema of {of}: {type_text:?} is not an array"))?))
            }
        };
        let element = element.split("<=").next().unwrap_or(element); // a bounded string
        fields.push(Field { name: name.to_owned(), of: type_named(of, element, places)?, count });
    }
    Ok(fields)
}

fn type_named(of: &str, name: &str, places: &HashMap<&str, usize>) -> Result<Type, String> {
    Ok(match name {
        "bool" => Type::Bool,
        "byte" | "char" | "uint8" => Type::Unsigned(1),
        "uint16" => Type::Unsigned(2),
        "uint32" => Type::Unsigned(4),
        "uint64" => Type::Unsigned(8),
        "int8" => Type::Signed(1),
        "int16" => Type::Signed(2),
        "int32" => Type::Signed(4),
        "int64" => Type::Signed(8),
        "float32" => Type::Float(4),
        "float64" => Type::Float(8),
        "string" => Type::Text,
        "wstring" => Type::WideText,
        name => {
            let package = of.split('/').next().unwrap_or("");
            let candidates = [short(name), format!("{package}/{name}"), format!("std_msgs/{name}"), format!("builtin_interfaces/{name}")];
            let place = candidates.iter().find_map(|name| places.get(name.as_str()));
            Type::Message(*place.ok_or_else(|| format!("schema of {of}: type {name:?} is not defined in it"))?)
        }
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use backdrive_msgs::topic::Kind;
    use backdrive_msgs::{Message, Sample, ros};

    #[test]
    fn a_joint_state_is_read_by_name() {
        let (name, text) = ros::schema(Kind::Sample);
        let schema = Schema::parse(name, text).expect("it parses");
        let mut sample = Sample::new(2);
        (sample.stamp_ns, sample.effort[1], sample.position[0]) = (2_500_000_000, -3.25, 0.5);
        let mut payload = Vec::new();
        ros::encode(&Message::Sample(sample), &["a".to_owned(), "bcd".to_owned()], &mut payload).expect("it encodes");
        let read = |path: &str| schema.read(&schema.find(path).expect(path), &payload).expect(path);
        assert_eq!(read("effort[1]"), Some(-3.25));
        assert_eq!(read("position[0]"), Some(0.5));
        assert!(read("velocity[0]").is_some_and(f64::is_nan), "not measured");
        assert_eq!(read("velocity[2]"), None, "the list is shorter");
        assert_eq!((read("effort[bcd]"), read("effort[b.d]")), (Some(-3.25), None), "by the name of the joint");
        assert_eq!(read("header.stamp"), Some(2.5));
        assert_eq!(read("header.stamp.nanosec"), Some(5e8));
        let numbers = schema.numbers(&payload).expect("they can be listed");
        let of_axes = ["position", "velocity", "effort"].map(|quantity| [format!("{quantity}[0]"), format!("{quantity}[1]")]);
        assert_eq!(numbers, [vec!["header.stamp.sec".to_owned(), "header.stamp.nanosec".to_owned()], of_axes.concat()].concat());
    }

    #[test]
    fn a_wrong_path_says_what_there_is() {
        let (name, text) = ros::schema(Kind::Sample);
        let schema = Schema::parse(name, text).expect("it parses");
        for (path, says) in [
            ("torque[0]", "there is header, name, position, velocity, effort"),
            ("effort", "effort[0]"),
            ("header", "it has stamp, frame_id"),
            ("header.frame_id", "is text"),
            ("effort[]", "not an index"),
            ("header[0].stamp", "not a list"),
            ("effort[0].x", "has no fields"),
        ] {
            let error = schema.find(path).expect_err(path);
            assert!(error.contains(says), "{path}: {error}");
        }
    }

    #[test]
    fn other_peoples_types_are_read() {
        let wrench = "# This represents a wrench with reference coordinate frame and timestamp\nstd_msgs/Header header\nWrench wrench\n\
            ================================================================================\nMSG: geometry_msgs/Wrench\n\
            Vector3  force\nVector3  torque\n\
            ================================================================================\nMSG: geometry_msgs/Vector3\n\
            float64 x 0.0 # default\nfloat64 y\nfloat64 z\n\
            ================================================================================\nMSG: std_msgs/Header\n\
            builtin_interfaces/Time stamp\nstring frame_id\n\
            ================================================================================\nMSG: builtin_interfaces/Time\nint32 sec\nuint32 nanosec\n";
        let schema = Schema::parse("geometry_msgs/msg/WrenchStamped", wrench).expect("it parses");
        // Time, text of one letter, two bytes up to a multiple of eight.
        let mut payload = vec![0, 1, 0, 0, 1, 0, 0, 0, 0, 0, 0, 0, 2, 0, 0, 0, b'b', 0, 0, 0];
        for value in [1.0_f64, 2.0, 3.0, 4.0, 5.0, 6.0] {
            payload.extend(value.to_le_bytes());
        }
        let read = |path: &str| schema.read(&schema.find(path).expect(path), &payload).expect(path);
        assert_eq!((read("wrench.force.x"), read("wrench.torque.z")), (Some(1.0), Some(6.0)));
        let odd = "uint8 KIND=3\nstring<=5 label \"x\"\nbool[2] flags\nint16[<=4] counts\nfloat32 last\nfloat64[] none\n";
        let schema = Schema::parse("a/msg/Odd", odd).expect("it parses");
        let payload = [0, 1, 0, 0, 2, 0, 0, 0, b'q', 0, 1, 0, 2, 0, 0, 0, 255, 255, 7, 0, 0, 0, 0xc0, 0x3f, 0, 0, 0, 0];
        let read = |path: &str| schema.read(&schema.find(path).expect(path), &payload).expect(path);
        assert_eq!(
            (read("flags[0]"), read("flags[1]"), read("counts[0]"), read("counts[1]")),
            (Some(1.0), Some(0.0), Some(-1.0), Some(7.0))
        );
        assert_eq!((read("counts[3]"), read("last"), read("none[9]")), (None, Some(1.5), None));
        assert!(Schema::parse("a/msg/B", "Missing x\n").is_err());
    }

    #[test]
    fn damaged_messages_are_errors() {
        let schema = Schema::parse("a/msg/L", "string[] names\nb/Empty[] nothing\nfloat64 x\n===\nMSG: b/Empty\n").expect("it parses");
        let path = schema.find("x").expect("it is there");
        assert!(schema.read(&path, &[0, 1, 0, 0, 255, 255, 255, 255]).is_err());
        assert!(schema.read(&path, &[0, 1, 0, 0, 0, 0, 0, 0, 255, 255, 255, 255]).is_err());
        assert!(schema.read(&path, &[]).is_err());
    }
}
