"""A master of one's own in Python: `backdrive run launch/own-master-python.toml`.

Here the device is simulated; a real one reads its encoder and writes its motor current at the same places.
"""

import json
import struct
import sys

MASS, STIFFNESS, DAMPING = 0.25, 400.0, 23.0  # of stick and motor, kg; of the hand, N/m and N s/m
about = json.loads(sys.stdin.buffer.readline())  # node, axes, period_s, names of inputs and outputs
asked, answered = struct.Struct(about["asked"]), struct.Struct(about["answered"])
x = v = force = 0.0
while frame := sys.stdin.buffer.read(asked.size):
    step, time, intent_age, x_u, v_u, f_u, force_age, x_f, v_f, wanted = asked.unpack(frame)
    x_u, v_u = (x_u, v_u) if x_u == x_u else (0.0, 0.0)  # what was not measured is NaN
    grip = STIFFNESS * (x_u - x) + DAMPING * (v_u - v)
    if step > 0:
        v += (force + grip) / MASS * about["period_s"]
        x += v * about["period_s"]
    fresh = wanted == wanted and force_age <= 100  # a loop that has gone quiet must not go on pushing
    force = max(-5.0, min(5.0, wanted)) if fresh else 0.0
    measured, user = (round(x / 2e-6) * 2e-6, float("nan"), force), (x, v, grip)
    sys.stdout.buffer.write(answered.pack(*measured, *user))
    sys.stdout.buffer.flush()
