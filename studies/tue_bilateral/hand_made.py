"""Hand-made models of both levers: inertia, Coulomb friction with a smoothed sign, viscous friction; for the master a gain of its gauge, the lag of
the recorded torque, and a zero of the gauge in each record.

python studies/tue_bilateral/hand_made.py studies-out/tue_bilateral
"""
import sys
from pathlib import Path

import numpy as np
from scipy.optimize import least_squares

sys.path.insert(0, str(Path(__file__).parent.parent))
from hand_made_errors import derivatives, held_out, lagged, read

folder = sys.argv[1]
KINDS = ["free_motion", "spring", "foam", "foam2", "foam3", "rigid"]
UNSEEN = [f"{g}_{k}.csv" for g in "bc" for k in KINDS if (g, k) != ("c", "foam3")]


def lever(p, v, a):
    """Torque of the lever itself: inertia, dry friction and its width in speed, viscous friction."""
    return p[0] * a + p[1] * np.tanh(v / p[2]) + p[3] * v


def slave(p, name):
    t, x, motor = read(folder, f"slave-{name}", "t", "position", "motor_torque")
    v, a = derivatives(t, x)
    return motor, lever(p, v, a) + p[4]


names = ["a_free_motion.csv"]
fit = least_squares(lambda p: np.concatenate([np.subtract(*slave(p, n)) for n in names]), [1.58e-3, 0.02, 0.02, 0.01, 0.0], x_scale=[1e-3, 1e-2, 1e-2, 1e-2, 1e-2])
print("slave: inertia, dry, its width in speed, viscous, offset:", fit.x)
held_out("slave, free motion", [(n, "motor_torque", *slave(fit.x, n)) for n in ["b_free_motion.csv", "c_free_motion.csv"]])


def master(p, name, column):
    t, x, motor, hand = read(folder, f"master-{name}", "t", "position", "motor_torque", column)
    v, a = derivatives(t, x)
    predicted = lagged(t, lever(p, v, a) - p[4] * motor, p[5])
    return hand, predicted + np.mean(hand - predicted)  # the gauge's zero is free in each record


names = ["a_free_motion.csv", "a_spring.csv", "a_foam.csv", "a_rigid.csv"]
for title, column, lag in [("master, torque as recorded", "hand_torque", 3e-3), ("master, torque of the gauge", "gauge_torque", 1e-3)]:
    start = [1.58e-3, 0.02, 0.02, 0.01, 1.0, lag]
    low, high = [0, 0, 1e-4, -1, 0.2, 1e-5], [0.1, 1, 1, 1, 5, 0.05]
    fit = least_squares(lambda p: np.concatenate([np.subtract(*master(p, n, column)) for n in names]), start, bounds=(low, high), x_scale=[1e-3, 1e-2, 1e-2, 1e-2, 1, 1e-3])
    print(f"{title}: inertia, dry, its width in speed, viscous, gain of the motor's torque, lag:", fit.x)
    held_out(title, [(n, "hand_torque", *master(fit.x, n, column)) for n in UNSEEN])
