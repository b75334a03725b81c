"""Checks the admittance of the steering compensator against SciPy, by the correlation method.

    python steering_check.py BACKDRIVE MODELS

The model files of plant/models are read again here and integrated by SciPy with an error control of its own: Nordin's gap as the state that his
equations give it, dry friction as a steep smooth curve (its slope is 1/SMOOTH s/m), which is what differs most. The lever is moved by the same sine, and
gain and phase of the force are taken over the last cycle.
"""

import sys
import tomllib
from pathlib import Path

import numpy as np
from scipy.integrate import solve_ivp

from runner import Backdrive

SMOOTH = 1e-5  # m/s
# Hz, m, cycles before the last one
CASES = [(0.1, 10e-3, 1), (1.22, 7.8e-3, 2), (8.09, 1.2e-3, 7), (20.21, 0.8e-3, 15), (35.0, 0.6e-3, 26)]


def elements(path):
    with open(path, "rb") as file:
        return {e["name"]: e for e in tomllib.load(file)["elements"]}


def force(e, f, amplitude, before):
    """Times of the last cycle and the force on the lever there."""
    w = 2 * np.pi * f
    gear, dry = e["gearbox"], e.get("friction")
    b1, b = e["parasitic_inertance"]["inertance"], e["inertance"]["inertance"]
    c, c1 = e["oil"]["damping"], e.get("parasitic_damping", {"damping": 0.0})["damping"]
    half = 0.5 * gear.get("gap", 0.0)
    k, cs = gear["stiffness"], gear.get("damping", 0.0)

    def gap_rate(x, v, z):
        free = v + k / cs * (x - z)
        return min(free, 0.0) if z >= half else max(free, 0.0) if z <= -half else free

    def gear_force(t, y):
        x, v = amplitude * np.sin(w * t) - y[0], amplitude * w * np.cos(w * t) - y[1]
        if half == 0.0:
            return k * x + cs * v, 0.0
        z = np.clip(y[3], -half, half)
        rate = gap_rate(x, v, z)
        return k * (x - z) + cs * (v - rate), rate

    def friction(v):
        if dry is None:
            return 0.0
        level = dry["coulomb"] + (dry["static"] - dry["coulomb"]) * np.exp(-((v / dry["velocity"]) ** 2))
        return level * np.tanh(v / SMOOTH)

    def rate(t, y):
        pull, gap = gear_force(t, y)
        slip = y[1] - y[2]
        return [y[1], (pull - friction(y[1]) - c1 * y[1] - c * slip) / b1, c * slip / b, gap]

    span = (before + 1) / f
    times = np.linspace(before / f, span, 4000, endpoint=False)
    done = solve_ivp(rate, (0, span), [0, 0, 0, 0], method="LSODA", t_eval=times, rtol=1e-6, atol=1e-9, max_step=1 / f / 200)
    assert done.success, done.message
    return times, np.array([gear_force(t, y)[0] for t, y in zip(times, done.y.T)])


def admittance(times, displacement, pull, f):
    w = 2 * np.pi * f
    turn = np.exp(-1j * w * times)
    return np.sum(pull * turn) / np.sum(displacement * turn) / (1j * w)


def main():
    program, models = Backdrive(sys.argv[1]), Path(sys.argv[2])
    worst = 0.0
    print(f"{'model':<32} {'Hz':>6} {'SciPy N s/m':>12} {'deg':>7} {'backdrive':>12} {'deg':>7} {'apart':>8}")
    for name in ["steering-compensator", "steering-compensator-sae-10", "steering-compensator-sae-40"]:
        path = models / f"{name}.toml"
        for f, amplitude, before in CASES:
            times, pull = force(elements(path), f, amplitude, before)
            theirs = admittance(times, amplitude * np.sin(2 * np.pi * f * times), pull, f)
            samples = 4000
            t = np.arange((before + 1) * samples + 1) / (f * samples)
            drive = program.here / "drive.csv"
            np.savetxt(drive, np.column_stack([t, amplitude * np.sin(2 * np.pi * f * t)]), fmt="%.17g", delimiter=",", header="t,displacement", comments="")
            out = program.simulate_files(path, drive)
            last = slice(before * samples, (before + 1) * samples)
            ours = admittance(t[last], amplitude * np.sin(2 * np.pi * f * t[last]), out["force"][last], f)
            apart = abs(ours / theirs - 1)
            worst = max(worst, apart)
            degrees = [np.degrees(np.angle(y)) for y in (theirs, ours)]
            print(f"{name:<32} {f:6.2f} {abs(theirs):12.2f} {degrees[0]:7.2f} {abs(ours):12.2f} {degrees[1]:7.2f} {apart:8.5f}")
    print(f"worst {worst:.5f}")
    sys.exit(int(worst > 0.01))


main()
