"""Hand-made model of either joint: the published rigid arm's torque times a gain, the rotor, Coulomb friction with a smoothed sign, viscous friction,
an offset.

python studies/dfki_double_pendulum/hand_made.py studies-out/dfki_double_pendulum
"""
import sys
from pathlib import Path

import numpy as np
from scipy.optimize import least_squares

sys.path.insert(0, str(Path(__file__).parent.parent))
from hand_made_errors import derivatives, held_out, read

folder = sys.argv[1]


def joint(p, number, name):
    t, q, load, torque = read(folder, f"joint-{number}-{name}.csv", "t", "angle", "load", "torque")
    v, a = derivatives(t, q)
    return torque, -p[0] * load + p[1] * a + p[2] * np.tanh(v / p[3]) + p[4] * v + p[5]


for number in (1, 2):
    misfit = lambda p: np.subtract(*joint(p, number, "061157-1"))
    fit = least_squares(misfit, [1.0, 2e-3, 0.15, 0.05, 0.01, 0.0], x_scale=[1, 1e-2, 0.1, 0.05, 0.1, 0.1])
    print(f"joint {number}: gain of the rigid arm, rotor, dry, its width in speed, viscous, offset:", fit.x)
    held_out(f"joint {number}", [("061157-2", "torque", *joint(fit.x, number, "061157-2"))])
    short = ["060143", "060245", "055640", "055032"]
    held_out(f"joint {number}, records whose torque is a command", [(n, "torque", *joint(fit.x, number, n)) for n in short])
