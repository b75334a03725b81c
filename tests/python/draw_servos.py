"""Servo joints with something hidden in them, drawn from a seed and simulated in steps of 0.1 ms.

    python draw_servos.py OUT --seed 1 --count 20

Each case is a folder with recordings of command and position, a set.toml and truth.json. One in five has nothing beside delay, second order and offset. It shares
nothing with the program but the format of its files: forces are N m, the servo is a proportional and derivative controller, and friction is a limit on
the force that holds the joint over a step.
"""

import argparse
import csv
import json
import math
import random
from pathlib import Path

KINDS = ["coulomb", "dead_band", "backlash", "speed_limit", "acceleration_limit", "saturation", "payload", "stribeck"]
STEP = 1e-4


def drawn(rng, index):
    gain = math.exp(rng.uniform(math.log(3.0), math.log(60.0)))
    settle = rng.uniform(0.03, 0.12)
    truth = {
        "rate": rng.choice([30.0, 50.0, 50.0, 100.0]),
        "gain": gain,
        "damping": gain * settle,
        "inertia": gain * (settle * rng.uniform(0.2, 0.7)) ** 2,
        "delay": rng.uniform(0.0, 0.04),
        "offset": rng.uniform(-0.01, 0.01),
        "tick": rng.choice([2 * math.pi / 4096, 2 * math.pi / 16384]),
        "effects": [],
    }
    if index % 5 == 4:
        return truth
    kinds = ["coulomb"] if rng.random() < 0.5 else []
    kinds.append(rng.choice([k for k in KINDS if k not in kinds and (k != "stribeck" or kinds)]))
    for kind in kinds:
        size = {
            "coulomb": rng.uniform(0.008, 0.04),
            "stribeck": rng.uniform(0.01, 0.03),
            "dead_band": rng.uniform(0.008, 0.03),
            "backlash": rng.uniform(0.015, 0.05),
            "speed_limit": rng.uniform(0.8, 2.0),
            "acceleration_limit": rng.uniform(5.0, 25.0),
            "saturation": rng.uniform(0.05, 0.12),
            "payload": rng.uniform(0.02, 0.08),
        }[kind]
        truth["effects"].append({"kind": kind, "size": size})
    return truth


def command(rng, kind, rate):
    count = int(rng.uniform(20.0, 30.0) * rate)
    t = [i / rate for i in range(count)]
    span = t[-1]
    if kind == "steps":
        out, level = [], 0.0
        for i in range(count):
            if i % int(1.5 * rate) == 0 and i > 0:
                level = rng.choice([-1, 1]) * rng.choice([0.05, 0.15, 0.4, 0.8])
            out.append(level)
        return t, out
    if kind == "chirp":
        size = rng.uniform(0.2, 0.5)
        end = rng.uniform(1.5, 3.0)
        return t, [size * math.sin(2 * math.pi * (0.1 * x + 0.5 * (end - 0.1) / span * x * x)) for x in t]
    if kind == "slow":
        size, period = rng.uniform(0.1, 0.5), rng.uniform(8.0, 12.0)
        return t, [size * (4 * abs((x / period) % 1 - 0.5) - 1) + size for x in t]
    lines = [(rng.uniform(0.03, 0.15), rng.uniform(0.1, 1.2), rng.uniform(0, 6.28)) for _ in range(6)]
    start = sum(a * math.sin(p) for a, _, p in lines)
    return t, [sum(a * math.sin(2 * math.pi * f * x + p) for a, f, p in lines) - start for x in t]


def simulated(truth, t, commands):
    size = {e["kind"]: e["size"] for e in truth["effects"]}
    gain = truth["gain"]
    dry, more = gain * size.get("coulomb", 0.0), gain * size.get("stribeck", 0.0)
    dead, gap = size.get("dead_band", 0.0), size.get("backlash", 0.0) / 2
    fastest, quickest = size.get("speed_limit", 1e9), size.get("acceleration_limit", 1e9)
    most, weight = gain * size.get("saturation", 1e9), gain * size.get("payload", 0.0)
    q = v = goal_speed = 0.0
    goal = held = commands[0] + truth["offset"]
    # It has rested at the first command.
    q = goal if not weight else goal - weight / gain * math.cos(goal)
    out = []
    k = 0
    rate = truth["rate"]
    for i, now in enumerate(t):
        out.append(q)
        if i + 1 == len(t):
            break
        while now + k * STEP < t[i + 1] - 0.5 * STEP:
            x = now + k * STEP - truth["delay"]
            target = commands[max(0, min(len(commands) - 1, int(math.floor(x * rate + 1e-9))))] + truth["offset"]
            left = target - goal
            wanted = math.copysign(min(math.sqrt(2 * quickest * abs(left)), fastest, abs(left) / STEP), left)
            goal_speed = max(goal_speed - quickest * STEP, min(goal_speed + quickest * STEP, wanted))
            goal += goal_speed * STEP
            held = max(goal - gap, min(goal + gap, held))
            error = held - q
            error = math.copysign(max(0.0, abs(error) - dead), error)
            force = max(-most, min(most, gain * error)) - weight * math.cos(q)
            free = v + STEP / truth["inertia"] * (force - truth["damping"] * v)
            level = dry + more * math.exp(-((v / 0.1) ** 2))
            holds = STEP / truth["inertia"] * level
            v = math.copysign(max(0.0, abs(free) - holds), free)
            q += STEP * v
            k += 1
        k = 0
    return [round(x / truth["tick"]) * truth["tick"] for x in out]


def main():
    parser = argparse.ArgumentParser()
    parser.add_argument("out", type=Path)
    parser.add_argument("--seed", type=int, required=True)
    parser.add_argument("--count", type=int, default=20)
    asked = parser.parse_args()
    for index in range(asked.count):
        rng = random.Random(f"{asked.seed}-{index}")
        truth = drawn(rng, index)
        folder = asked.out / f"{index:03}"
        folder.mkdir(parents=True, exist_ok=True)
        names = []
        for number, kind in enumerate(["steps", "chirp", "slow", "lines", "steps", "lines"]):
            t, commands = command(rng, kind, truth["rate"])
            position = simulated(truth, t, commands)
            name = f"{number}-{kind}.csv"
            names.append(name)
            with open(folder / name, "w", newline="") as file:
                rows = csv.writer(file)
                rows.writerow(["t", "joint.command", "joint.position"])
                rows.writerows((f"{a:.5f}", f"{b:.6f}", f"{c:.6f}") for a, b, c in zip(t, commands, position))
        (folder / "set.toml").write_text(f"fit = {json.dumps(names[:4])}\nheld_out = {json.dumps(names[4:])}\n")
        (folder / "truth.json").write_text(json.dumps(truth, indent=1) + "\n")


if __name__ == "__main__":
    main()
