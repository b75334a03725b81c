"""Hand-made model of the damper without inertia: the rod drags the drum through a joint whose force grows as a power of its stretch (a play with round
edges), the band slips at the friction of each direction; viscous friction and an offset beside it.

python studies/brfd_friction_damper/hand_made.py studies-out/brfd_friction_damper
"""
import sys
from pathlib import Path

import numpy as np
from scipy.optimize import least_squares

sys.path.insert(0, str(Path(__file__).parent.parent))
from hand_made_errors import held_out, read

folder = sys.argv[1]
FITTED = ["0.25Hz-0.5in.csv", "0.25Hz-1in.csv", "0.5Hz-0.5in.csv", "0.5Hz-1in.csv"]
UNSEEN = ["0.25Hz-1.5in.csv", "0.5Hz-1.5in.csv", "1Hz-0.5in.csv", "1Hz-1in.csv", "1Hz-1.5in.csv", "imperial-valley.csv"]
RECORDS = {n: read(folder, n, "t", "displacement", "force") for n in FITTED + UNSEEN}


def damper(p, name):
    t, x, force = RECORDS[name]
    forward, backward, reach, power, viscous, offset = p
    stretch = np.empty_like(x)
    drum = x[0]
    for i, at in enumerate(x):  # the drum follows where the joint is stretched to its end
        drum = min(max(drum, at - reach), at + reach)
        stretch[i] = at - drum
    share = np.sign(stretch) * np.abs(stretch / reach) ** power
    return force, np.where(share > 0, forward, backward) * share + viscous * np.gradient(x, t) + offset


start = [1e4, 1e4, 4e-3, 2.0, 1e3, 0.0]
scale = [1e3, 1e3, 1e-3, 1.0, 1e3, 1e2]
fit = least_squares(lambda p: np.concatenate([np.subtract(*damper(p, n)) / np.std(RECORDS[n][2]) for n in FITTED]), start, x_scale=scale, diff_step=1e-3)
print("friction forward and backward, half of the way from end to end, power, viscous, offset:", fit.x)
held_out("friction damper, fitted", [(n, "force", *damper(fit.x, n)) for n in FITTED])
held_out("friction damper, unseen", [(n, "force", *damper(fit.x, n)) for n in UNSEEN])
