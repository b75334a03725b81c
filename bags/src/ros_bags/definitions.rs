//! Definitions of common ROS 2 types, for bags that do not have them (sqlite3 before ROS 2 Iron).

/// Types by their short names; each names what it is made of.
const TYPES: &[(&str, &[(&str, &str)])] = &[
    ("builtin_interfaces/Time", &[("int32", "sec"), ("uint32", "nanosec")]),
    ("std_msgs/Header", &[("builtin_interfaces/Time", "stamp"), ("string", "frame_id")]),
    ("std_msgs/Bool", &[("bool", "data")]),
    ("std_msgs/Int32", &[("int32", "data")]),
    ("std_msgs/Int64", &[("int64", "data")]),
    ("std_msgs/Float32", &[("float32", "data")]),
    ("std_msgs/Float64", &[("float64", "data")]),
    ("std_msgs/MultiArrayDimension", &[("string", "label"), ("uint32", "size"), ("uint32", "stride")]),
    ("std_msgs/MultiArrayLayout", &[("std_msgs/MultiArrayDimension[]", "dim"), ("uint32", "data_offset")]),
    ("std_msgs/Float32MultiArray", &[("std_msgs/MultiArrayLayout", "layout"), ("float32[]", "data")]),
    ("std_msgs/Float64MultiArray", &[("std_msgs/MultiArrayLayout", "layout"), ("float64[]", "data")]),
    ("geometry_msgs/Vector3", &[("float64", "x"), ("float64", "y"), ("float64", "z")]),
    ("geometry_msgs/Point", &[("float64", "x"), ("float64", "y"), ("float64", "z")]),
    ("geometry_msgs/Quaternion", &[("float64", "x"), ("float64", "y"), ("float64", "z"), ("float64", "w")]),
    ("geometry_msgs/Wrench", &[("geometry_msgs/Vector3", "force"), ("geometry_msgs/Vector3", "torque")]),
    ("geometry_msgs/Twist", &[("geometry_msgs/Vector3", "linear"), ("geometry_msgs/Vector3", "angular")]),
    ("geometry_msgs/Pose", &[("geometry_msgs/Point", "position"), ("geometry_msgs/Quaternion", "orientation")]),
    ("geometry_msgs/Vector3Stamped", &[("std_msgs/Header", "header"), ("geometry_msgs/Vector3", "vector")]),
    ("geometry_msgs/WrenchStamped", &[("std_msgs/Header", "header"), ("geometry_msgs/Wrench", "wrench")]),
    ("geometry_msgs/TwistStamped", &[("std_msgs/Header", "header"), ("geometry_msgs/Twist", "twist")]),
    ("geometry_msgs/PoseStamped", &[("std_msgs/Header", "header"), ("geometry_msgs/Pose", "pose")]),
    (
        "sensor_msgs/JointState",
        &[
            ("std_msgs/Header", "header"),
            ("string[]", "name"),
            ("float64[]", "position"),
            ("float64[]", "velocity"),
            ("float64[]", "effort"),
        ],
    ),
    (
        "sensor_msgs/Imu",
        &[
            ("std_msgs/Header", "header"),
            ("geometry_msgs/Quaternion", "orientation"),
            ("float64[9]", "orientation_covariance"),
            ("geometry_msgs/Vector3", "angular_velocity"),
            ("float64[9]", "angular_velocity_covariance"),
            ("geometry_msgs/Vector3", "linear_acceleration"),
            ("float64[9]", "linear_acceleration_covariance"),
        ],
    ),
];

/// The definition of a type with all that it is made of, as a bag would have it; `None` of one that is not known.
pub(crate) fn of(type_name: &str) -> Option<String> {
    let mut wanted = vec![type_name.replace("/msg/", "/")];
    let (mut text, mut next) = (String::new(), 0);
    while let Some(name) = wanted.get(next).cloned() {
        let (_, fields) = TYPES.iter().find(|(known, _)| *known == name)?;
        if next > 0 {
            text.push_str(&format!("{}\nMSG: {name}\n", "=".repeat(80)));
        }
        for (of, field) in *fields {
            text.push_str(&format!("{of} {field}\n"));
            let element = of.split('[').next().unwrap_or(of);
            if element.contains('/') && !wanted.iter().any(|known| known == element) {
                wanted.push(element.to_owned());
            }
        }
        next += 1;
    }
    Some(text)
}

#[cfg(test)]
mod tests {
    use super::{TYPES, of};
    use crate::cdr::Schema;
    use backdrive_msgs::ros;
    use backdrive_msgs::topic::Kind;

    #[test]
    fn every_definition_is_whole() {
        for (name, _) in TYPES {
            let text = of(name).expect("it is known");
            Schema::parse(name, &text).unwrap_or_else(|error| panic!("{name}: {error}"));
        }
        let (name, text) = ros::schema(Kind::Sample);
        assert_eq!(Schema::parse(name, &of(name).expect("it is known")), Schema::parse(name, text), "ours is the same");
        assert_eq!(of("somebody/msg/Odd"), None);
    }
}
