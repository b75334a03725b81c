"""Looks on at a topic of a run over shared memory: pip install iceoryx2==0.10.0, then python examples/watch_topic.py RUN /master/measured_js.

RUN is the folder of a running run; `backdrive doctor` lists them. The layout is that of `Sample` in msgs/src/lib.rs, and the version of iceoryx2 has to be that of
backdrive. It prints how many samples came, how many were lost, and how old they were when they came.
"""

import ctypes
import sys
import time
from pathlib import Path

import iceoryx2 as iox2

AXES = ctypes.c_double * 8


class Sample(ctypes.Structure):
    """State or command of a device's axes at one step."""

    _fields_ = [
        ("layout", ctypes.c_uint32),
        ("source", ctypes.c_uint32),
        ("step", ctypes.c_uint64),
        ("sequence", ctypes.c_uint64),
        ("stamp_ns", ctypes.c_int64),
        ("axes", ctypes.c_uint32),
        ("flags", ctypes.c_uint32),
        ("position", AXES),
        ("velocity", AXES),
        ("effort", AXES),
    ]

    @staticmethod
    def type_name():
        return "backdrive/Sample/1"


def subscriber(run, topic):
    """A subscriber of a topic, with the service that it belongs to."""
    run = Path(run)
    config = iox2.config.default()
    config.global_cfg.prefix = iox2.FileName.new(f"bd{run.name}_")
    config.global_cfg.root_path = iox2.Path.new(str(run / "middleware"))
    iox2.set_log_level(iox2.LogLevel.Error)
    handling = iox2.SignalHandlingMode.Disabled
    node = iox2.NodeBuilder.new().config(config).signal_handling_mode(handling).create(iox2.ServiceType.Ipc)
    builder = node.service_builder(iox2.ServiceName.new(topic)).publish_subscribe(Sample).user_header(ctypes.c_int64)
    service = builder.open()
    return service.subscriber_builder().buffer_size(4096).create(), (node, service)


def main():
    port, keep = subscriber(*sys.argv[1:3])
    until = time.monotonic() + float(sys.argv[3] if len(sys.argv) > 3 else 2.0)
    count = lost = 0
    expected, ages = None, []
    while time.monotonic() < until:
        sample = port.receive()
        if sample is None:
            time.sleep(50e-6)
            continue
        data = sample.payload().contents
        assert data.layout == 1, f"layout {data.layout}: this program reads layout 1"
        ages.append(time.monotonic_ns() - sample.user_header().contents.value)
        lost += 0 if expected is None else data.sequence - expected
        expected = data.sequence + 1
        count += 1
        sample.delete()
    if not count:
        raise SystemExit("no sample came")
    ages.sort()
    middle, late = ages[count // 2] / 1e3, ages[min(count - 1, count * 99 // 100)] / 1e3
    print(f"{count} samples, {lost} lost, age p50 {middle:.0f} us, p99 {late:.0f} us")


if __name__ == "__main__":
    main()
