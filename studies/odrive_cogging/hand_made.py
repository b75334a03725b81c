"""Hand-made model of the motor turned slowly: the five strongest harmonics of the published map, friction, by least squares.

python studies/odrive_cogging/hand_made.py studies-out/odrive_cogging
"""
import sys
from pathlib import Path

import numpy as np

sys.path.insert(0, str(Path(__file__).parent.parent))
from hand_made_errors import held_out, read

folder = sys.argv[1]
HARMONICS = [7, 12, 14, 28, 36]  # periods in a turn


def recording(name):
    t, angle, torque = read(folder, name, "t", "angle", "torque")
    direction = np.sign(angle[-1] - angle[0])
    columns = [np.full_like(angle, direction)]
    for n in HARMONICS:
        columns += [np.sin(n * angle), np.cos(n * angle)]
    return torque, np.column_stack(columns)


fitted = [recording(n) for n in ["slow-3.csv", "slow-4.csv"]]
numbers = np.linalg.lstsq(np.vstack([c for _, c in fitted]), np.concatenate([y for y, _ in fitted]), rcond=None)[0]
print("friction", numbers[0], "amplitudes", dict(zip(HARMONICS, np.hypot(numbers[1::2], numbers[2::2]))))
held_out("motor, unseen runs", [(n, "torque", recording(n)[0], recording(n)[1] @ numbers) for n in ["slow-5.csv", "slower-3.csv"]])
