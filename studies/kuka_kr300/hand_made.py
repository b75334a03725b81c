"""Hand-made model of an axis: the arm's encoder is read later than the motor's, and has a zero of its own in each run; for axis 1 the torque by inertia,
Coulomb friction with a smoothed sign and viscous friction.

python studies/kuka_kr300/hand_made.py studies-out/kuka_kr300
"""
import sys
from pathlib import Path

import numpy as np
from scipy.optimize import least_squares

sys.path.insert(0, str(Path(__file__).parent.parent))
from hand_made_errors import derivatives, held_out, read

folder = sys.argv[1]


def arm(skew, axis, run):
    t, motor, angle = read(folder, f"axis-{axis}-{run}.csv", "t", "motor_angle", "arm_angle")
    predicted = np.interp(t - skew, t, motor)
    return angle, predicted + np.mean(angle - predicted)


def torque(p, axis, run):
    t, motor, measured = read(folder, f"axis-{axis}-{run}.csv", "t", "motor_angle", "torque")
    v, a = derivatives(t, motor)
    return measured, p[0] * a + p[1] * np.tanh(v / p[2]) + p[3] * v


for axis in (1, 2, 3):
    skew = least_squares(lambda p: 1e5 * np.subtract(*arm(p[0], axis, "A")), [3e-3], x_scale=1e-3, diff_step=1e-2).x[0]
    print(f"axis {axis}: skew {1e3 * skew:.2f} ms")
    pairs = [(run, "arm_angle", *arm(skew, axis, run)) for run in "BC"]
    if axis == 1:
        fit = least_squares(lambda p: np.subtract(*torque(p, axis, "A")), [1800.0, 355.0, 0.02, 2050.0], x_scale=[1e3, 1e2, 1e-2, 1e3])
        print("inertia, dry, its width in speed, viscous:", fit.x)
        pairs += [(run, "torque", *torque(fit.x, axis, run)) for run in "BC"]
    held_out(f"axis {axis}", pairs)
