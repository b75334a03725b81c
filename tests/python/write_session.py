"""Writes a run as a rosbag2 folder, as a person with ROS 2 would have recorded it.

    write_session.py RUN.csv FOLDER mcap|sqlite3      columns: x_m, F_f, x_c, F_s, dither; one row every 0.2 ms
"""

import sys
from pathlib import Path

import numpy as np
from rosbags.rosbag2 import StoragePlugin, Writer
from rosbags.typesys import Stores, get_typestore

table, folder, storage = Path(sys.argv[1]), Path(sys.argv[2]), sys.argv[3]
store = get_typestore(Stores.ROS2_JAZZY)
kind = {name.split("/")[-1]: store.types[name] for name in store.types}
BEGIN, PERIOD = 1_750_000_000_000_000_000, 200_000


def header(ns):
    return kind["Header"](stamp=kind["Time"](sec=ns // 10**9, nanosec=ns % 10**9), frame_id="base")


def vector(x):
    return kind["Vector3"](x=x, y=0.0, z=0.0)


with Writer(folder, version=9, storage_plugin=StoragePlugin.MCAP if storage == "mcap" else StoragePlugin.SQLITE3) as bag:
    names = {
        "/touch/joint_states": "sensor_msgs/msg/JointState",
        "/touch/force": "geometry_msgs/msg/WrenchStamped",
        "/arm/goal": "geometry_msgs/msg/PoseStamped",
        "/arm/ft": "std_msgs/msg/Float64MultiArray",
        "/excite": "std_msgs/msg/Float64",
    }
    topics = {topic: bag.add_connection(topic, type_name, typestore=store) for topic, type_name in names.items()}

    def send(topic, ns, message):
        bag.write(topics[topic], ns, store.serialize_cdr(message, names[topic]))

    layout = kind["MultiArrayLayout"](dim=[], data_offset=0)
    none = np.array([])
    for k, line in enumerate(table.read_text().splitlines()):
        x_m, f_f, x_c, f_s, dither = (float(cell) for cell in line.split(","))
        ns = BEGIN + k * PERIOD
        send("/touch/joint_states", ns, kind["JointState"](header(ns), ["forward"], np.array([x_m]), none, none))
        send("/touch/force", ns, kind["WrenchStamped"](header(ns), kind["Wrench"](force=vector(-f_f), torque=vector(0.0))))
        place = kind["Point"](x=x_c, y=0.0, z=0.0)
        turn = kind["Quaternion"](x=0.0, y=0.0, z=0.0, w=1.0)
        send("/arm/goal", ns, kind["PoseStamped"](header(ns), kind["Pose"](position=place, orientation=turn)))
        send("/arm/ft", ns, kind["Float64MultiArray"](layout, np.array([0.0, 0.0, f_s])))
        send("/excite", ns, kind["Float64"](data=dither))
