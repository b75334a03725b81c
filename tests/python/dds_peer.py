"""CycloneDDS as an equal partner: it knows the standard messages, and nothing of backdrive.

    dds_peer.py hear SECONDS [TOPIC:TYPE:QOS ...]   counts what arrives, until nothing has for a second, at most SECONDS
    dds_peer.py pass SECONDS DOMAIN [TOPIC:TYPE:QOS ...]   hears the same, and publishes it in another domain, once each is listened to there
    dds_peer.py speak TOPIC COUNT HZ                sends JointStates whose frame_id says what backdrive's says
    dds_peer.py push TOPIC EFFORT HZ SECONDS        sends forces at once, whoever listens
    dds_peer.py replay TOPIC SECONDS                hears a topic for a second, then sends what it heard once more, again and again
    dds_peer.py ping COUNT HZ | echo                as examples/ros2_peer.rs

TYPE is JointState or Log; QOS is best_effort or reliable. The domain is that of ROS_DOMAIN_ID.
"""

import json
import os
import re
import sys
import time
from dataclasses import dataclass

from cyclonedds.core import Policy, Qos, ReadCondition, ViewState, InstanceState, SampleState, WaitSet
from cyclonedds.domain import DomainParticipant
from cyclonedds.idl import IdlStruct
from cyclonedds.idl.types import float64, int32, sequence, uint8, uint32
from cyclonedds.pub import DataWriter
from cyclonedds.sub import DataReader
from cyclonedds.topic import Topic
from cyclonedds.util import duration


@dataclass
class Time(IdlStruct, typename="builtin_interfaces::msg::dds_::Time_"):
    sec: int32
    nanosec: uint32


@dataclass
class Header(IdlStruct, typename="std_msgs::msg::dds_::Header_"):
    stamp: Time
    frame_id: str


@dataclass
class JointState(IdlStruct, typename="sensor_msgs::msg::dds_::JointState_"):
    header: Header
    name: sequence[str]
    position: sequence[float64]
    velocity: sequence[float64]
    effort: sequence[float64]


@dataclass
class Log(IdlStruct, typename="rcl_interfaces::msg::dds_::Log_"):
    stamp: Time
    level: uint8
    name: str
    msg: str
    file: str
    function: str
    line: uint32


TYPES = {"JointState": JointState, "Log": Log}
BEST_EFFORT = Qos(Policy.Reliability.BestEffort, Policy.Durability.Volatile, Policy.History.KeepLast(20000))
RELIABLE = Qos(Policy.Reliability.Reliable(duration(seconds=1)), Policy.Durability.TransientLocal, Policy.History.KeepLast(1000))
QOS = {"best_effort": BEST_EFFORT, "reliable": RELIABLE}
PATIENCE_S = 20.0


def sequence_of(message):
    """The sequence number that backdrive puts where the message has room for text."""
    text = message.file if isinstance(message, Log) else message.header.frame_id
    return int(re.search(r"seq=(\d+)", text).group(1))


def valid(samples):
    """Without the news that a writer has gone."""
    return [sample for sample in samples if isinstance(sample, (JointState, Log))]


def joint_state(number):
    ns = time.monotonic_ns()
    frame = f"step={number} seq={number} src=0000002a axes=2 flags=0 layout=1"
    header = Header(Time(ns // 10**9, ns % 10**9), frame)
    return JointState(header, ["axis0", "axis1"], [0.1, 0.2], [], [1.0, 2.0])


def hear(participant, seconds, wanted, further=None):
    """With a further participant everything is published there as it came."""
    readers, writers = {}, {}
    for entry in wanted:
        name, kind, qos = entry.split(":")
        topic = lambda of: Topic(of, "rt" + name, TYPES[kind], qos=QOS[qos])
        readers[name] = DataReader(participant, topic(participant), qos=QOS[qos])
        if further:
            writers[name] = DataWriter(further, topic(further), qos=QOS[qos])
    for writer in writers.values():
        matched(writer, "writer")
    settle()
    print("listening", flush=True)
    heard = {name: [] for name in readers}
    begun = quiet = time.monotonic()
    while time.monotonic() - begun < seconds and (not any(heard.values()) or time.monotonic() - quiet < 2.0):
        for name, reader in readers.items():
            for message in valid(reader.take(N=2000)):
                heard[name].append(sequence_of(message))
                quiet = time.monotonic()
                if further:
                    writers[name].write(message)
        time.sleep(0.002)
    result = {}
    for name, numbers in heard.items():
        ordered = numbers == sorted(numbers)
        result[name] = {"count": len(numbers), "first": min(numbers, default=-1), "last": max(numbers, default=-1), "ordered": ordered}
    # What was published last has to arrive before its writer goes.
    time.sleep(1.0 if further else 0.0)
    print(json.dumps(result))


def matched(endpoint, of):
    begun = time.monotonic()
    while time.monotonic() - begun < PATIENCE_S:
        if endpoint.get_matched_subscriptions() if of == "writer" else endpoint.get_matched_publications():
            return
        time.sleep(0.005)
    sys.exit("nobody is there")


def settle():
    """The other end may hear of this one a little later."""
    time.sleep(0.3)


def speak(participant, name, count, hz):
    writer = DataWriter(participant, Topic(participant, "rt" + name, JointState, qos=BEST_EFFORT), qos=BEST_EFFORT)
    matched(writer, "writer")
    settle()
    begun = time.monotonic()
    for number in range(count):
        time.sleep(max(0.0, begun + number / hz - time.monotonic()))
        writer.write(joint_state(number))
    time.sleep(0.3)
    print(json.dumps({"count": count}))


def push(participant, name, effort, hz, seconds):
    writer = DataWriter(participant, Topic(participant, "rt" + name, JointState, qos=BEST_EFFORT), qos=BEST_EFFORT)
    print("listening", flush=True)
    begun, number = time.monotonic(), 0
    while time.monotonic() - begun < seconds:
        message = joint_state(number)
        message.header.frame_id = message.header.frame_id.replace("axes=2", "axes=1")
        message.name, message.position, message.effort = ["axis0"], [], [effort]
        writer.write(message)
        number += 1
        time.sleep(max(0.0, begun + number / hz - time.monotonic()))
    print(json.dumps({"count": number}))


def replay(participant, name, seconds):
    topic = Topic(participant, "rt" + name, JointState, qos=BEST_EFFORT)
    reader = DataReader(participant, topic, qos=BEST_EFFORT)
    print("listening", flush=True)
    begun, heard = time.monotonic(), []
    while time.monotonic() - begun < PATIENCE_S and len(heard) < 200:
        heard += valid(reader.take(N=2000))
        time.sleep(0.002)
    writer = DataWriter(participant, topic, qos=BEST_EFFORT)
    begun, number = time.monotonic(), 0
    while heard and time.monotonic() - begun < seconds:
        writer.write(heard[number % len(heard)])
        number += 1
        time.sleep(0.002)
    print(json.dumps({"count": number}))


def ends(participant, out, back):
    writer = DataWriter(participant, Topic(participant, "rt" + out, JointState, qos=BEST_EFFORT), qos=BEST_EFFORT)
    reader = DataReader(participant, Topic(participant, "rt" + back, JointState, qos=BEST_EFFORT), qos=BEST_EFFORT)
    condition = ReadCondition(reader, SampleState.Any | ViewState.Any | InstanceState.Any)
    waits = WaitSet(participant)
    waits.attach(condition)
    return writer, reader, waits


def ping(participant, count, hz):
    writer, reader, waits = ends(participant, "/ping", "/pong")
    matched(writer, "writer")
    matched(reader, "reader")
    settle()
    there, back = [], []
    begun = time.monotonic()
    for number in range(count):
        time.sleep(max(0.0, begun + number / hz - time.monotonic()))
        message = joint_state(number)
        sent = time.monotonic_ns()
        writer.write(message)
        asked = time.monotonic()
        answered = False
        while not answered and time.monotonic() - asked < 0.1:
            waits.wait(duration(milliseconds=100))
            for answer in valid(reader.take(N=10)):
                if sequence_of(answer) == number:
                    back.append(time.monotonic_ns() - sent)
                    stamp = answer.header.stamp
                    there.append(stamp.sec * 10**9 + stamp.nanosec - sent)
                    answered = True
    quantile = lambda times, q: round(sorted(times)[int(len(times) * q)] * 1e-3, 1)
    result = {"sent": count, "count": len(back)}
    result["one_way_us"] = [quantile(there, 0.5), quantile(there, 0.99)]
    result["round_trip_us"] = [quantile(back, 0.5), quantile(back, 0.99)]
    print(json.dumps(result))


def echo(participant):
    writer, reader, waits = ends(participant, "/pong", "/ping")
    print("listening", flush=True)
    matched(reader, "reader")
    settle()
    while reader.get_matched_publications():
        waits.wait(duration(milliseconds=100))
        for message in valid(reader.take(N=100)):
            ns = time.monotonic_ns()
            message.header.stamp = Time(ns // 10**9, ns % 10**9)
            writer.write(message)


def main():
    participant = DomainParticipant(int(os.environ.get("ROS_DOMAIN_ID", "0")))
    verb, *rest = sys.argv[1:]
    if verb == "hear":
        hear(participant, float(rest[0]), rest[1:])
    elif verb == "pass":
        hear(participant, float(rest[0]), rest[2:], DomainParticipant(int(rest[1])))
    elif verb == "speak":
        speak(participant, rest[0], int(rest[1]), float(rest[2]))
    elif verb == "push":
        push(participant, rest[0], *(float(number) for number in rest[1:]))
    elif verb == "replay":
        replay(participant, rest[0], float(rest[1]))
    elif verb == "ping":
        ping(participant, int(rest[0]), float(rest[1]))
    elif verb == "echo":
        echo(participant)
    else:
        sys.exit(__doc__)


if __name__ == "__main__":
    main()
