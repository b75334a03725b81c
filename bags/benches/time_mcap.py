"""Writes and reads the messages of a bag with PyPI's mcap, and prints how long each took, s.

    python time_mcap.py FROM.mcap TO.mcap        (pip install mcap mcap-ros2-support)

Prints three lines: writing (payloads ready in memory, lz4, chunks of 1 MiB), reading, reading and decoding.
"""

import sys
import time

from mcap.reader import make_reader
from mcap.writer import CompressionType, Writer
from mcap_ros2.decoder import DecoderFactory

source, target = sys.argv[1:]
with open(source, "rb") as file:
    messages = [(schema, channel, message) for schema, channel, message in make_reader(file).iter_messages(log_time_order=False)]

begin = time.perf_counter()
with open(target, "wb") as file:
    writer = Writer(file, compression=CompressionType.LZ4, chunk_size=1 << 20)
    writer.start(profile="ros2")
    channels = {}
    for schema, channel, message in messages:
        if channel.id not in channels:
            number = writer.register_schema(schema.name, schema.encoding, schema.data)
            channels[channel.id] = writer.register_channel(channel.topic, channel.message_encoding, number, channel.metadata)
        writer.add_message(channels[channel.id], message.log_time, message.data, message.publish_time, message.sequence)
    writer.finish()
print(time.perf_counter() - begin)
del messages

begin = time.perf_counter()
with open(target, "rb") as file:
    count = sum(1 for _ in make_reader(file).iter_messages())
print(time.perf_counter() - begin)
assert count >= 500_000, count

begin = time.perf_counter()
with open(target, "rb") as file:
    count = sum(1 for _ in make_reader(file, decoder_factories=[DecoderFactory()]).iter_decoded_messages())
print(time.perf_counter() - begin)
assert count >= 500_000, count
