//! Numbers out of a message in JSON, or in what is the same, by the path of their field: `position[0]`, `position[elbow]`, `joints[elbow].position`,
//! `wrench.force.x`.

use serde_json::Value;

/// Nesting beyond this is not looked into.
const MOST_NESTED: usize = 16;

/// A message.
pub(crate) struct JsonMessage(Value);

/// Reads a message.
///
/// # Errors
/// A sentence: it is no JSON.
pub(crate) fn parse(payload: &[u8]) -> Result<JsonMessage, String> {
    let read = serde_json::from_slice(payload).or_else(|error| serde_json::from_slice(&without_nan(payload)).map_err(|_| error));
    read.map(JsonMessage).map_err(|error| format!("the message is not JSON: {error}"))
}

/// Python writes what was not measured as NaN, which JSON does not have.
fn without_nan(payload: &[u8]) -> Vec<u8> {
    const WORDS: [&[u8]; 3] = [b"NaN", b"-Infinity", b"Infinity"];
    let (mut plain, mut rest, mut is_text) = (Vec::with_capacity(payload.len()), payload, false);
    while let Some((first, behind)) = rest.split_first() {
        if let Some(word) = WORDS.iter().find(|word| !is_text && rest.starts_with(word)) {
            plain.extend(b"null");
            rest = rest.get(word.len()..).unwrap_or_default();
            continue;
        }
        plain.push(*first);
        rest = behind;
        match first {
            b'"' => is_text = !is_text,
            b'\\' => {
                if let Some((escaped, behind)) = rest.split_first() {
                    plain.push(*escaped);
                    rest = behind;
                }
            }
            _ => {}
        }
    }
    plain
}

/// Whether a path can be one. Whether a message has it shows in the message.
///
/// # Errors
/// A sentence.
pub(crate) fn check(path: &str) -> Result<(), String> {
    match path.is_empty() || path.matches('[').count() != path.matches(']').count() {
        true => Err(format!("{path:?} is not a path such as position[0] or wrench.force.x")),
        false => Ok(()),
    }
}

impl JsonMessage {
    /// A message that was no text.
    pub(crate) fn of(value: Value) -> JsonMessage {
        JsonMessage(value)
    }

    /// Paths of numeric fields, at most this many.
    pub(crate) fn numbers(&self, most: usize) -> Vec<String> {
        let mut found = Vec::new();
        list(&self.0, String::new(), most, &mut found, 0);
        found
    }

    /// The number at a path; `None` where there is none. A time is in s.
    ///
    /// # Errors
    /// A sentence: there is text.
    pub(crate) fn number(&self, path: &str) -> Result<Option<f64>, String> {
        Ok(match self.at(path) {
            Some(value @ Value::Object(_)) => time_ns(value).map(|ns| ns as f64 * 1e-9),
            Some(Value::String(_)) => return Err(format!("{path:?} is text in this message of json or protobuf")),
            value => value.and_then(number),
        })
    }

    /// The time at a path in ns: an object of seconds and nanoseconds.
    pub(crate) fn time_ns(&self, path: &str) -> Option<i64> {
        time_ns(self.at(path)?)
    }

    /// The names of the joints, as a JointState of ROS has them, or JointStates of Foxglove; none where there is no such list.
    pub(crate) fn joint_names(&self) -> Vec<String> {
        let list = |key: &str| self.0.get(key).and_then(Value::as_array);
        let names = list("name").map(|names| names.iter().filter_map(Value::as_str).collect());
        let of_joints = || list("joints").map(|joints| joints.iter().filter_map(name_of).collect());
        let names: Vec<&str> = names.or_else(of_joints).unwrap_or_default();
        names.into_iter().map(str::to_owned).collect()
    }

    fn at(&self, path: &str) -> Option<&Value> {
        let (mut value, mut rest) = (&self.0, path);
        while !rest.is_empty() {
            (value, rest) = match (value, rest.strip_prefix('[')) {
                (Value::Array(entries), Some(inner)) => {
                    let (entry, behind) = inner.split_once(']')?;
                    let own = || entries.iter().position(|value| name_of(value) == Some(entry));
                    let joint = || self.joint_names().iter().position(|name| name == entry);
                    let place = entry.parse().ok().or_else(own).or_else(joint)?;
                    (entries.get(place)?, behind)
                }
                (Value::Object(fields), None) => {
                    // A key may have dots: the longest that the path goes on with.
                    let rest = rest.strip_prefix('.').unwrap_or(rest);
                    let behind =
                        |key: &String| rest.strip_prefix(key.as_str()).filter(|behind| behind.is_empty() || behind.starts_with(['.', '[']));
                    fields
                        .iter()
                        .filter_map(|(key, value)| behind(key).map(|behind| (value, behind)))
                        .min_by_key(|(_, behind)| behind.len())?
                }
                _ => return None,
            };
        }
        Some(value)
    }
}

/// The name that an entry of a list has itself.
fn name_of(entry: &Value) -> Option<&str> {
    entry.get("name").and_then(Value::as_str)
}

fn number(value: &Value) -> Option<f64> {
    match value {
        Value::Bool(is) => Some(f64::from(u8::from(*is))),
        value => value.as_f64(),
    }
}

/// `{ sec, nanosec }` of ROS 2, `{ secs, nsecs }` of ROS 1, `{ sec, nsec }` of Foxglove, `{ seconds, nanos }` of protobuf.
fn time_ns(value: &Value) -> Option<i64> {
    let whole = |keys: &[&str]| keys.iter().find_map(|key| value.get(key)).and_then(Value::as_i64);
    let nanoseconds = whole(&["nanosec", "nsec", "nsecs", "nanosecs", "nanos"])?;
    Some(whole(&["sec", "secs", "seconds"])?.saturating_mul(1_000_000_000).saturating_add(nanoseconds))
}

fn list(value: &Value, path: String, most: usize, found: &mut Vec<String>, nested: usize) {
    if found.len() >= most || nested > MOST_NESTED {
        return;
    }
    match value {
        Value::Object(fields) => {
            for (key, value) in fields {
                let below = if path.is_empty() { key.clone() } else { format!("{path}.{key}") };
                list(value, below, most, found, nested + 1);
            }
        }
        Value::Array(entries) => {
            for (place, value) in entries.iter().enumerate() {
                list(value, format!("{path}[{place}]"), most, found, nested + 1);
            }
        }
        value if number(value).is_some() => found.push(path),
        _ => {}
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_are_found_by_their_paths() {
        let text = r#"{"header": {"stamp": {"sec": 2, "nanosec": 500000000}, "frame_id": "a"}, "name": ["a", "el.bow"], "position": [0.5, -1],
                       "state.x": {"y": [{"z": 7}]}, "on": true, "none": null, "words": "12"}"#;
        let message = parse(text.as_bytes()).unwrap();
        assert!(message.number("words").is_err_and(|what| what.contains("is text")));
        let number = |path: &str| message.number(path).unwrap();
        assert_eq!((number("position[1]"), number("position[el.bow]"), number("position[2]")), (Some(-1.0), Some(-1.0), None));
        assert_eq!((number("state.x.y[0].z"), number("on"), number("none")), (Some(7.0), Some(1.0), None));
        assert_eq!((message.time_ns("header.stamp"), number("header.stamp")), (Some(2_500_000_000), Some(2.5)));
        assert_eq!((number("header"), number("position"), number("position[0].x"), number("x[")), (None, None, None, None));
        let all = message.numbers(256);
        assert_eq!(all, ["header.stamp.nanosec", "header.stamp.sec", "on", "position[0]", "position[1]", "state.x.y[0].z"]);
        assert!(all.iter().all(|path| check(path).is_ok() && number(path).is_some()));
        assert_eq!(message.joint_names(), ["a", "el.bow"]);
    }

    #[test]
    fn what_python_writes_for_not_measured_is_no_number() {
        let message = parse(br#"{"effort": [NaN, -Infinity, 1.5], "name": ["NaN", "a\"NaN"]}"#).unwrap();
        assert_eq!(message.numbers(9), ["effort[2]"]);
        assert_eq!((message.number("effort[0]").unwrap(), message.number("effort[2]").unwrap()), (None, Some(1.5)));
        assert_eq!(message.joint_names(), ["NaN", "a\"NaN"]);
    }

    #[test]
    fn what_is_no_json_is_an_error() {
        for text in [&b"{"[..], b"", b"\xff\xfe", b"{\"a\": NaM}"] {
            assert!(parse(text).is_err_and(|what| what.contains("not JSON")));
        }
        assert!(parse(b"[1, [2, {\"a\": 3}]]").unwrap().numbers(2) == ["[0]", "[1][0]"]);
        assert!(check("").is_err() && check("position[0").is_err());
    }
}
