"""Hand-made model of the axis, on the study's strokes: mass, viscous friction of either direction, dry friction that is lower near rest, offset, a delay
between command and motion.

python studies/emps/hand_made.py studies-out/emps
"""
import sys
from pathlib import Path

import numpy as np
from scipy.optimize import least_squares

sys.path.insert(0, str(Path(__file__).parent.parent))
from hand_made_errors import derivatives, held_out, read

folder = sys.argv[1]


def axis(p, name):
    t, x, force = read(folder, name, "t", "position", "force")
    v, a = derivatives(t, x)
    # The command acts p[7] later: the motion that it made is read that much later.
    v, a = (np.interp(t + p[7], t, c) for c in (v, a))
    viscous = np.where(v > 0, p[1], p[2]) * v
    dry = (p[3] - p[4] * np.exp(-((v / p[5]) ** 2))) * np.sign(v)
    return force, p[0] * a + viscous + dry + p[6]


names = [f"train-{i}.csv" for i in (1, 2, 3, 8)]
start = [95.0, 167.0, 240.0, 20.4, 8.0, 0.013, -3.0, 5e-4]
fit = least_squares(lambda p: np.concatenate([np.subtract(*axis(p, n)) for n in names]), start, x_scale=[10, 10, 10, 1, 1, 0.01, 1, 1e-4])
print("mass, viscous + and -, dry, of it lost near rest, speed, offset, delay:", fit.x)
held_out("EMPS, strokes of the record with the pulses", [(n, "force", *axis(fit.x, n)) for n in [f"pulses-{i}.csv" for i in range(1, 12)]])
