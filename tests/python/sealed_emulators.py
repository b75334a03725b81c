"""Hides effects in emulated servos, runs a leader and follower over their buses, diagnoses the bags, and scores the verdicts.

    python3 tests/python/sealed_emulators.py target/release/backdrive out/sealed-emulators --seed 4711 --cases 7

Each case is an arm of three servos. A joint hides dry friction, a dead band, a limit of torque, or nothing. The diagnosis gets two bags a case: commands and
positions of the run, and nothing of the emulator's file.
"""

import argparse
import json
import math
import random
import subprocess
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
JOINTS = ["base", "shoulder", "elbow"]
# Laws that positions do not separate: docs/servo.md, Identifiability.
KINDS = {
    "friction": ["dry friction", "dead band", "play"],
    "dead_band": ["dead band", "dry friction", "play"],
    "limit": ["limit"],
}
WORDS = {"friction": "dry friction", "dead_band": "dead band", "limit": "limit"}


def plant(rng, friction):
    rubs = f'{{ name = "gear", kind = "coulomb", between = ["rotor", "ground"], force = {friction:.5f} }},' if friction else ""
    return (
        f'name = "hidden"\nmotion = "rotation"\nbodies = {{ rotor = {rng.uniform(0.008, 0.02):.5f} }}\n'
        f'elements = [{{ name = "bearing", kind = "damper", between = ["rotor", "ground"], damping = {rng.uniform(0.08, 0.25):.4f} }}, {rubs}]\n'
        'inputs = [{ name = "torque", kind = "force", on = "rotor" }]\n'
        'outputs = [{ name = "angle", kind = "position", of = "rotor" }]\n'
        'axes = [{ name = "turn", user = "rotor", feedback = "torque", measured = "angle" }]\n'
    )


def draw(rng, folder):
    """Writes the emulators and graphs of a case; what is hidden in each joint."""
    truth, follower = {}, 'protocol = "feetech_sts"\nbaud = 1000000\nlatency_s = 1e-4\n'
    for index, joint in enumerate(JOINTS):
        effect = rng.choice(["none", "friction", "friction", "dead_band", "dead_band", "limit"])
        stiffness, delay = rng.uniform(15, 30), rng.uniform(0.004, 0.03)
        size = {"none": 0.0, "friction": rng.uniform(0.006, 0.025), "dead_band": rng.uniform(0.006, 0.025), "limit": rng.uniform(0.01, 0.03)}[effect]
        (folder / f"{joint}.toml").write_text(plant(rng, size * stiffness if effect == "friction" else 0.0))
        follower += f'[[servos]]\nid = {index + 1}\nmodel = "{joint}.toml"\nstiffness = {stiffness:.4f}\ndamping = {rng.uniform(0.4, 0.8):.4f}\n'
        follower += f"goal_delay_s = {delay:.5f}\ndead_band = {size if effect == 'dead_band' else 0.0:.6f}\n"
        follower += f"torque_limit = {size * stiffness if effect == 'limit' else 3.0:.5f}\n"
        truth[joint] = {"effect": effect, "size": size, "delay": delay}
    (folder / "follower.toml").write_text(follower)
    servos = ROOT / "launch" / "servo-pair"
    for name in ["fit", "held_out"]:
        leader = 'protocol = "feetech_sts"\nbaud = 1000000\n'
        for index in range(len(JOINTS)):
            tones = [(a * rng.uniform(0.8, 1.2), f * rng.uniform(0.8, 1.25), rng.uniform(0, 2 * math.pi)) for a, f in [(0.35, 0.25), (0.18, 0.7), (0.07, 1.8)]]
            hand = ", ".join(f"{{ amplitude = {a:.4f}, frequency = {f:.4f}, phase = {p:.3f} }}" for a, f, p in tones)
            leader += f'[[servos]]\nid = {index + 1}\nmodel = "{servos}/backdriven-servo.toml"\ngrip = "{ROOT}/plant/grips/knob.toml"\nhand = [{hand}]\n'
        (folder / f"leader-{name}.toml").write_text(leader)
        graph = (ROOT / "launch" / "servo-pair.toml").read_text()
        graph = graph.replace('"servo-pair/emulated-follower.toml"', f'"{folder}/follower.toml"')
        graph = graph.replace('"servo-pair/emulated-leader.toml"', f'"{folder}/leader-{name}.toml"')
        (folder / f"{name}.graph.toml").write_text(graph.replace('"servo-pair/', f'"{servos}/'))
    return truth


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("program")
    parser.add_argument("out", type=Path)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--cases", type=int, default=7)
    asked = parser.parse_args()
    rng, hidden, named, kind, false, clean = random.Random(asked.seed), 0, 0, 0, 0, 0
    for case in range(asked.cases):
        folder = (asked.out / f"case{case}").resolve()
        folder.mkdir(parents=True, exist_ok=True)
        truth = draw(rng, folder)
        bags = []
        for name in ["fit", "held_out"]:
            bags.append(str(folder / f"{name}.mcap"))
            subprocess.run([asked.program, "run", str(folder / f"{name}.graph.toml"), "--bag", bags[-1], "--overwrite"], capture_output=True, check=False)
        done = subprocess.run([asked.program, "diagnose", *bags, "--out", str(folder / "verdict")], capture_output=True, text=True, check=False)
        found = [line for line in done.stdout.splitlines() if line.startswith("found")]
        for joint, hides in truth.items():
            lines = [line for line in found if joint in line]
            effect = hides["effect"]
            if effect == "none":
                clean += 1
                false += bool(lines)
            else:
                hidden += 1
                named += any(WORDS[effect] in line for line in lines)
                kind += any(word in line for line in lines for word in KINDS[effect])
            print(json.dumps({"case": case, "joint": joint, **hides, "found": lines}))
    print(f"{named} of {hidden} laws named, {kind} of the right kind, {false} false findings in {clean} joints without an effect")


if __name__ == "__main__":
    main()
