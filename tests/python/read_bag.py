"""Reads a bag with other people's readers and prints what they see, as JSON.

    python read_bag.py RUN.mcap        (pip install mcap mcap-ros2-support rosbags numpy)

Every message is decoded. Prints {"mcap": {TOPIC: {...}}, "rosbags": {TOPIC: {...}}} with, per topic, the number of
messages, the ROS type, and of a JointState the last effort and the last step, so that values can be compared too. Exits with 1 and
the reader's own error when a reader cannot open the bag or decode a message.
"""

import json
import math
import sys
from pathlib import Path


JOINT_STATE = "sensor_msgs/msg/JointState"


def plain(values):
    """Numbers as JSON knows them: NaN is null."""
    return [None if math.isnan(value) else float(value) for value in values]


def note(topics, topic, type_name, message):
    seen = topics.setdefault(topic, {"count": 0, "type": type_name})
    seen["count"] += 1
    if type_name == JOINT_STATE:
        seen["frame_id"] = message.header.frame_id
        if "next_step" in seen:
            seen["last_step"] = seen["next_step"]
            seen["next_step"] += 1
        seen["names"] = list(message.name)
        seen["last_effort"] = plain(message.effort)
        seen["last_stamp"] = [message.header.stamp.sec, message.header.stamp.nanosec]
    elif type_name == "backdrive_msgs/msg/Event":
        seen["last_text"] = message.text
    elif type_name == "backdrive_msgs/msg/Steps":
        # Which step the next message of a topic is of; those after it count on.
        topics.setdefault(message.topic, {"count": 0, "type": JOINT_STATE})["next_step"] = message.step
    elif type_name == "backdrive_msgs/msg/Gains":
        seen["last_mu"] = message.mu


def with_mcap(path):
    from mcap.reader import make_reader
    from mcap_ros2.decoder import DecoderFactory

    topics = {}
    with open(path, "rb") as file:
        reader = make_reader(file, validate_crcs=True, decoder_factories=[DecoderFactory()])
        for schema, channel, _, message in reader.iter_decoded_messages():
            note(topics, channel.topic, schema.name, message)
    return topics


def with_rosbags(path):
    from rosbags.highlevel import AnyReader

    topics = {}
    with AnyReader([Path(path)]) as reader:
        for connection, _, data in reader.messages():
            note(topics, connection.topic, connection.msgtype, reader.deserialize(data, connection.msgtype))
    return topics


def main():
    if len(sys.argv) != 2:
        sys.exit(__doc__)
    json.dump({"mcap": with_mcap(sys.argv[1]), "rosbags": with_rosbags(sys.argv[1])}, sys.stdout, indent=1)
    print()


if __name__ == "__main__":
    main()
