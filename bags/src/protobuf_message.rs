//! Messages in protobuf, by the descriptors in the bag's schema: each becomes its JSON equivalent, and numbers are found by the same paths.

use crate::foreign_code::guarded;
use crate::json_message::JsonMessage;
use prost_reflect::prost::bytes::Buf;
use prost_reflect::{DescriptorPool, DynamicMessage, FieldDescriptor, Kind, MapKey, MessageDescriptor, ReflectMessage, Value};
use serde_json::Value as Json;

/// A longer message is not read, bytes: decoded, one byte may take a hundred.
const MOST_BYTES: usize = 4 << 20;

/// Nesting beyond this is not looked into.
const MOST_NESTED: usize = 16;

/// Types of a time; their fields are seconds and nanoseconds.
const TIMES: [&str; 2] = ["google.protobuf.Timestamp", "google.protobuf.Duration"];

/// Fields with the time at which a message was made; the first that it has counts.
const STAMPS: [&str; 3] = ["header.stamp", "timestamp", "stamp"];

/// The type of a topic's messages.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct ProtobufType(MessageDescriptor);

impl ProtobufType {
    /// Reads a schema: a set of file descriptors that defines `name`.
    ///
    /// # Errors
    /// A sentence: it is none, or does not define it.
    pub(crate) fn parse(name: &str, schema: &[u8]) -> Result<ProtobufType, String> {
        let broken = |what: String| format!("its schema is not a FileDescriptorSet: {what}");
        let read = |mut pool: DescriptorPool| {
            guarded(|| pool.decode_file_descriptor_set(schema).map(|()| pool).map_err(|error| error.to_string()))
        };
        // Some writers leave out the files of well-known types.
        let pool = read(DescriptorPool::new()).map_err(broken)?.or_else(|why| match read(DescriptorPool::global()) {
            Ok(Ok(pool)) => Ok(pool),
            _ => Err(broken(why)),
        })?;
        pool.get_message_by_name(name).map(ProtobufType).ok_or_else(|| format!("its schema does not define the message {name:?}"))
    }

    /// Reads a message.
    ///
    /// # Errors
    /// A sentence: it is none of this type.
    pub(crate) fn read(&self, payload: &[u8]) -> Result<JsonMessage, String> {
        if payload.len() > MOST_BYTES {
            return Err(format!("the message has {} bytes, and of protobuf up to {MOST_BYTES} are read", payload.len()));
        }
        let broken = |what: String| format!("the message is no {}: {what}", self.0.full_name());
        let decoded = guarded(|| DynamicMessage::decode(self.0.clone(), payload.chunk())).map_err(broken)?;
        Ok(JsonMessage::of(object(&decoded.map_err(|error| broken(error.to_string()))?, 0)))
    }

    /// Whether a path can be one.
    ///
    /// # Errors
    /// A sentence that names what there is instead.
    pub(crate) fn check(&self, path: &str) -> Result<(), String> {
        let (mut message, mut rest) = (self.0.clone(), path);
        loop {
            let name = rest.split(['.', '[']).next().unwrap_or_default();
            let field = message.fields().find(|field| field.name() == name).ok_or_else(|| {
                let names: Vec<String> = message.fields().map(|field| field.name().to_owned()).collect();
                format!("there is no {name:?}; there is {}", names.join(", "))
            })?;
            rest = rest.get(name.len()..).unwrap_or_default();
            let mut kind = field.kind();
            if let Some(entry) = rest.strip_prefix('[').and_then(|rest| rest.split_once(']')).filter(|_| field.is_list()) {
                rest = entry.1;
            } else if field.is_list() {
                return Err(format!("{name:?} is a list: name the element, as in {name}[0]"));
            } else if let (true, Kind::Message(entry)) = (field.is_map(), &kind) {
                // A key may have any letters, so that what a map holds shows in the messages alone.
                let value = entry.map_entry_value_field();
                return rest
                    .strip_prefix('.')
                    .filter(|key| !key.is_empty())
                    .map(|_| ())
                    .ok_or_else(|| format!("{name:?} is a map of {}: name the key, as in {name}.KEY", words_of(&value)));
            }
            if let (Kind::Message(inner), Some(below)) = (&kind, rest.strip_prefix('.')) {
                (message, rest) = (inner.clone(), below);
                continue;
            }
            return match (&mut kind, rest.is_empty()) {
                (Kind::Message(inner), true) if TIMES.contains(&inner.full_name()) => Ok(()),
                (Kind::Message(inner), true) => {
                    let names: Vec<String> = inner.fields().map(|field| field.name().to_owned()).collect();
                    Err(format!("{name:?} is not a number; it has {}", names.join(", ")))
                }
                (Kind::String | Kind::Bytes, _) => Err(format!("{name:?} is text")),
                (_, true) => Ok(()),
                (_, false) => Err(format!("{name:?} is not followed by {rest:?}")),
            };
        }
    }

    /// The path of the time at which a message was made; `None` where the type has none.
    pub(crate) fn stamp(&self) -> Option<&'static str> {
        STAMPS.into_iter().find(|path| self.check(path).is_ok())
    }
}

fn words_of(field: &FieldDescriptor) -> &'static str {
    match field.kind() {
        Kind::Message(_) => "messages",
        Kind::String | Kind::Bytes => "texts",
        _ => "numbers",
    }
}

fn object(message: &DynamicMessage, nested: usize) -> Json {
    if nested > MOST_NESTED {
        return Json::Null;
    }
    // A field with its default value is not in the bytes of a message, and is there nevertheless.
    let is_there = |field: &FieldDescriptor| !field.supports_presence() || message.has_field(field);
    let fields = message.descriptor();
    let there = fields.fields().filter(is_there).map(|field| (field.name().to_owned(), json(&message.get_field(&field), nested)));
    Json::Object(there.collect())
}

fn json(value: &Value, nested: usize) -> Json {
    match value {
        Value::Bool(is) => Json::from(*is),
        Value::I32(number) | Value::EnumNumber(number) => Json::from(*number),
        Value::I64(number) => Json::from(*number),
        Value::U32(number) => Json::from(*number),
        Value::U64(number) => Json::from(*number),
        // What is no number was not measured.
        Value::F32(number) => Json::from(f64::from(*number)),
        Value::F64(number) => Json::from(*number),
        Value::String(text) => Json::from(text.as_str()),
        Value::Bytes(_) => Json::Null,
        Value::Message(message) => object(message, nested + 1),
        Value::List(entries) => Json::Array(entries.iter().map(|entry| json(entry, nested + 1)).collect()),
        Value::Map(entries) => Json::Object(entries.iter().map(|(key, value)| (key_of(key), json(value, nested + 1))).collect()),
    }
}

fn key_of(key: &MapKey) -> String {
    match key {
        MapKey::Bool(key) => key.to_string(),
        MapKey::I32(key) => key.to_string(),
        MapKey::I64(key) => key.to_string(),
        MapKey::U32(key) => key.to_string(),
        MapKey::U64(key) => key.to_string(),
        MapKey::String(key) => key.clone(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use prost_reflect::prost::Message;
    use prost_reflect::prost_types::field_descriptor_proto::{Label, Type};
    use prost_reflect::prost_types::{DescriptorProto, FieldDescriptorProto, FileDescriptorProto, FileDescriptorSet, MessageOptions};

    fn field(number: i32, name: &str, of: Type, label: Label, type_name: &str) -> FieldDescriptorProto {
        FieldDescriptorProto {
            name: Some(name.to_owned()),
            number: Some(number),
            label: Some(label.into()),
            r#type: Some(of.into()),
            type_name: (!type_name.is_empty()).then(|| type_name.to_owned()),
            ..FieldDescriptorProto::default()
        }
    }

    /// What Foxglove calls JointStates, with what else a message can have.
    fn schema() -> Vec<u8> {
        let (one, list) = (Label::Optional, Label::Repeated);
        let message = |name: &str, fields: Vec<FieldDescriptorProto>| DescriptorProto {
            name: Some(name.to_owned()),
            field: fields,
            ..DescriptorProto::default()
        };
        let joint = message(
            "JointState",
            vec![
                field(1, "name", Type::String, one, ""),
                field(2, "position", Type::Double, one, ""),
                field(3, "effort", Type::Float, one, ""),
            ],
        );
        let entry = DescriptorProto {
            options: Some(MessageOptions { map_entry: Some(true), ..MessageOptions::default() }),
            ..message("GainsEntry", vec![field(1, "key", Type::String, one, ""), field(2, "value", Type::Double, one, "")])
        };
        let states = DescriptorProto {
            nested_type: vec![entry],
            ..message(
                "JointStates",
                vec![
                    field(1, "timestamp", Type::Message, one, ".google.protobuf.Timestamp"),
                    field(2, "joints", Type::Message, list, ".foxglove.JointState"),
                    field(3, "currents", Type::Double, list, ""),
                    field(4, "count", Type::Sint64, one, ""),
                    field(5, "gains", Type::Message, list, ".foxglove.JointStates.GainsEntry"),
                    field(6, "below", Type::Message, one, ".foxglove.JointStates"),
                    field(7, "frame", Type::String, one, ""),
                ],
            )
        };
        let file = FileDescriptorProto {
            name: Some("foxglove/JointStates.proto".to_owned()),
            package: Some("foxglove".to_owned()),
            dependency: vec!["google/protobuf/timestamp.proto".to_owned()],
            message_type: vec![joint, states],
            syntax: Some("proto3".to_owned()),
            ..FileDescriptorProto::default()
        };
        FileDescriptorSet { file: vec![file] }.encode_to_vec()
    }

    /// Fields of a message as they stand in its bytes.
    fn bytes(fields: &[(u8, &[u8])]) -> Vec<u8> {
        fields.iter().flat_map(|(number, data)| [&[number << 3 | 2, data.len() as u8], *data].concat()).collect()
    }

    fn joint(name: &str, position: f64, effort: f32) -> Vec<u8> {
        [&bytes(&[(1, name.as_bytes())])[..], &[2 << 3 | 1], &position.to_le_bytes(), &[3 << 3 | 5], &effort.to_le_bytes()].concat()
    }

    fn states() -> ProtobufType {
        ProtobufType::parse("foxglove.JointStates", &schema()).unwrap()
    }

    #[test]
    fn numbers_are_found_by_their_paths_and_their_joints() {
        let packed: Vec<u8> = [1.5_f64, f64::NAN].iter().flat_map(|x| x.to_le_bytes()).collect();
        let gain = [&bytes(&[(1, b"k.p")])[..], &[2 << 3 | 1], &4.0_f64.to_le_bytes()].concat();
        let payload = bytes(&[
            // 2 s and 500 000 000 ns.
            (1, &[8, 2, 16, 0x80, 0xca, 0xb5, 0xee, 0x01]),
            (2, &joint("shoulder", 0.5, 0.25)),
            (2, &joint("elbow", -1.0, 2.0)),
            (3, &packed),
            (5, &gain),
        ]);
        let message = states().read(&payload).unwrap();
        let number = |path: &str| message.number(path).unwrap();
        assert_eq!(
            (number("joints[1].position"), number("joints[elbow].position"), number("joints[shoulder].effort")),
            (Some(-1.0), Some(-1.0), Some(0.25))
        );
        assert_eq!((message.time_ns("timestamp"), number("timestamp")), (Some(2_500_000_000), Some(2.5)));
        assert_eq!(
            (number("currents[0]"), number("currents[1]"), number("currents[2]"), number("gains.k.p")),
            (Some(1.5), None, None, Some(4.0))
        );
        // A number that is not in the bytes is 0, and a message that is not there is none.
        assert_eq!((number("count"), number("below.count")), (Some(0.0), None));
        assert_eq!(message.joint_names(), ["shoulder", "elbow"]);
        let all = message.numbers(256);
        assert!(
            all.contains(&"joints[0].position".to_owned()) && all.iter().all(|path| states().check(path).is_ok() && number(path).is_some()),
            "{all:?}"
        );
        assert_eq!(states().stamp(), Some("timestamp"));
    }

    #[test]
    fn a_wrong_path_says_what_there_is() {
        for (path, says) in [
            ("positions", "there is no \"positions\"; there is timestamp, joints, currents"),
            ("joints", "is a list: name the element, as in joints[0]"),
            ("joints[0]", "is not a number; it has name, position, effort"),
            ("joints[0].name", "\"name\" is text"),
            ("joints[0].position.x", "is not followed by"),
            ("gains", "as in gains.KEY"),
            ("count[0]", "is not followed by"),
            ("", "there is no \"\""),
        ] {
            let error = states().check(path).unwrap_err();
            assert!(error.contains(says), "{path}: {error}");
        }
        assert!(["joints[elbow].position", "timestamp", "below.below.currents[3]"].iter().all(|path| states().check(path).is_ok()));
    }

    #[test]
    fn what_is_no_message_and_no_schema_is_an_error() {
        let refused = |payload: &[u8], says: &str| assert!(states().read(payload).is_err_and(|error| error.contains(says)));
        refused(&[9, 0, 0], "the message is no foxglove.JointStates");
        refused(&vec![0; MOST_BYTES + 1], "up to 4194304 are read");
        // Nested deeper than the stack is safe.
        let mut deep = Vec::new();
        for _ in 0..60 {
            deep = bytes(&[(6, &deep)]);
        }
        assert!(states().read(&deep).unwrap().number("below.below.count").unwrap() == Some(0.0));
        assert!(ProtobufType::parse("foxglove.JointStates", b"{}").is_err_and(|error| error.contains("FileDescriptorSet")));
        assert!(ProtobufType::parse("foxglove.Other", &schema()).is_err_and(|error| error.contains("does not define")));
    }
}
