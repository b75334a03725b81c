"""Hand-made model of the stack: a gain and a sum of play operators (Prandtl-Ishlinskii, so with minor loops), behind a low-pass of first order.

python studies/piezo_p885/hand_made.py DATA/piezo_p885
"""
import sys
from pathlib import Path

import numpy as np
from scipy.optimize import minimize_scalar, nnls

sys.path.insert(0, str(Path(__file__).parent.parent))
from hand_made_errors import held_out, lagged, read

folder = sys.argv[1]
WIDTHS = np.linspace(0.0, 1.6, 9)  # V; a play of width 0 is the gain
ZERO = -123.06e-6 / 1e-6  # um at 0 V, as set.toml has it


def plays(u):
    """Every play operator along the drive, from rest at 0 V."""
    out = np.empty((len(u), len(WIDTHS)))
    state = np.zeros(len(WIDTHS))
    for i, value in enumerate(u):
        state = np.minimum(np.maximum(state, value - WIDTHS), value + WIDTHS)
        out[i] = state
    return out


def recording(name, rows=None):
    t, u, y = (c[:rows] for c in read(folder, name, "time_s", "u_V", "y_um"))
    return t, u, y - ZERO


def columns(t, u, tau):
    # Before the first sample the drive was at 0 V.
    return plays(lagged(np.append(t[0] - (t[1] - t[0]), t), np.append(0.0, u), tau)[1:])


t, u, y = recording("model.csv", 1000)
tau = minimize_scalar(lambda tau: nnls(columns(t, u, tau), y)[1], bounds=(1e-3, 0.06), method="bounded").x
weights = nnls(columns(t, u, tau), y)[0]
print(f"lag {1e3 * tau:.1f} ms; um per V of plays of {WIDTHS} V:", weights.round(3))
held_out("piezo stack, ramps", [("test.csv", "displacement", y, columns(t, u, tau) @ weights) for t, u, y in [recording("test.csv")]])
