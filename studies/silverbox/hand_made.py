"""Hand-made model of the circuit: mass, damping, springs of the first, second and third power, a constant force, simulated from rest as the diagnosis
does (Runge and Kutta, two steps per sample, the drive smooth between them); fitted to the first samples of the multisine.

python studies/silverbox/hand_made.py studies-out/silverbox
"""
import sys
from pathlib import Path

import numpy as np
from scipy.interpolate import CubicSpline
from scipy.optimize import least_squares

sys.path.insert(0, str(Path(__file__).parent.parent))
from hand_made_errors import held_out, read

folder = sys.argv[1]
FITTED = 6000  # samples
STEPS = 2  # per sample


def recording(name):
    t, u, y = read(folder, name, "t", "u", "y")
    quarter = (t[1] - t[0]) / (2 * STEPS)
    fine = CubicSpline(t, u)(t[0] + quarter * np.arange((len(t) - 1) * 2 * STEPS + 1))
    return t, fine.tolist(), y


def simulate(p, t, u):
    """y as the model has it, from rest."""
    m, d, k1, k2, k3, force = (float(x) for x in p)
    h, x, v, out = float(t[1] - t[0]) / STEPS, 0.0, 0.0, []
    accelerate = lambda x, v, u: (u - force - d * v - x * (k1 + x * (k2 + x * k3))) / m
    for i in range(len(t)):
        out.append(x)
        for s in range(STEPS if i + 1 < len(t) else 0):
            a, b, c = u[2 * (i * STEPS + s) : 2 * (i * STEPS + s) + 3]
            x1, v1 = v, accelerate(x, v, a)
            x2, v2 = v + h / 2 * v1, accelerate(x + h / 2 * x1, v + h / 2 * v1, b)
            x3, v3 = v + h / 2 * v2, accelerate(x + h / 2 * x2, v + h / 2 * v2, b)
            x4, v4 = v + h * v3, accelerate(x + h * x3, v + h * v3, c)
            x, v = x + h / 6 * (x1 + 2 * x2 + 2 * x3 + x4), v + h / 6 * (v1 + 2 * v2 + 2 * v3 + v4)
    return np.array(out)


t, u, y = recording("multisine-train.csv")
t, y = t[:FITTED], y[:FITTED]
scale = np.array([5.4e-6, 2.3e-4, 1.0, 1.0, 4.0, 5e-3])
p = least_squares(lambda p: (simulate(p * scale, t, u) - y) * 1e3, [1, 1, 1, 0, 1, 0]).x * scale
print("mass, damping, springs of power 1, 2, 3, force:", p)
pairs = []
for name in ["multisine-test.csv", "arrow.csv"]:
    t, u, y = recording(name)
    pairs.append((name, "y", y, simulate(p, t, u)))
held_out("silverbox", pairs)
