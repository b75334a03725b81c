"""Least squares on each machine of the study, by SciPy alone: inertia, viscous friction, dry friction and a constant, below a corner in Hz.

python studies/machines/hand_made.py studies-out/machines [CORNER_HZ]
"""
import sys
from pathlib import Path

import numpy as np
import tomllib
from scipy.signal import butter, filtfilt

folder = Path(sys.argv[1])
corner = float(sys.argv[2]) if len(sys.argv) > 2 else 48.0


def rows(name, gains):
    """The regressor and the force of a prepared record, both low-passed, without a period of the corner at either end."""
    table = np.genfromtxt(folder / name, delimiter=",", names=True)
    t, q = table["t"], table["position"]
    force = sum(gain * table[c] for c, gain in gains.items())
    step = np.median(np.diff(t))
    low = butter(4, corner, fs=1 / step)
    velocity = np.gradient(q, step)
    columns = [np.gradient(velocity, step), velocity, np.sign(filtfilt(*low, velocity)), np.ones_like(q)]
    edge = int(1 / (corner * step))
    return np.column_stack([filtfilt(*low, c) for c in columns])[edge:-edge], filtfilt(*low, force)[edge:-edge]


for path in sorted(folder.glob("*-set.toml")):
    listed = tomllib.loads(path.read_text())
    model = tomllib.loads((folder / listed["model"]).read_text())
    gains = {one["name"]: one["gain"] for one in model["inputs"]}
    fit, held = ([rows(name, gains) for name in listed[key]] for key in ("fit", "held_out"))
    matrix, force = (np.concatenate(part) for part in zip(*fit))
    inertia, viscous, dry, constant = np.linalg.lstsq(matrix, force, rcond=None)[0]
    left = [np.sqrt(np.mean((f - m @ [inertia, viscous, dry, constant]) ** 2)) / np.std(f) for m, f in held]
    print(f"{path.name.removesuffix('-set.toml'):16} inertia {inertia:.4g}  viscous {viscous:.4g}  dry friction {dry:.4g}  constant {constant:.4g}  held out {100 * np.mean(left):.1f} %")
