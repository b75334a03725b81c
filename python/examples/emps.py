"""EMPS, a ball-screw axis that many identify: what its linear model leaves out, and the position error in open loop that its benchmark shows.

    python emps.py DATA        DATA: the folder with emps_train.csv and emps_test_pulses.csv (studies/emps says where they are from)
"""

import pathlib
import sys

import numpy as np
from scipy.signal import butter, filtfilt

import backdrive

tables = {name: np.genfromtxt(f"{sys.argv[1]}/emps_{name}.csv", delimiter=",", names=True) for name in ("train", "test_pulses")}
logs = {name: {"t": table["time_s"], "position": filtfilt(*butter(4, 100.0, fs=1000.0), table["q_m"]), "force": table["force_N"]} for name, table in tables.items()}
linear = backdrive.Model(pathlib.Path(__file__).parents[2] / "studies/emps/linear.toml")
verdict = backdrive.diagnose({"train": logs["train"]}, linear, held_out={"test_pulses": logs["test_pulses"]}, initial="free")
print(verdict)
for what, model in (("as given", linear), ("as found", verdict.model)):
    force_in = model.driven([{"name": "force", "kind": "force", "on": "carriage"}], [{"name": "position", "kind": "position", "of": "carriage"}])
    errors = {name: backdrive.simulate(force_in, log, kind="numpy").frame["position"] - log["position"] for name, log in logs.items()}
    print(f"open loop, {what}:", ", ".join(f"{name} {1e3 * np.sqrt(np.mean(error**2)):.2f} mm" for name, error in errors.items()))
