"""Runs exported servo joints in MuJoCo from their commands, and compares them with free runs of the servo model.

    python servo_exports.py FOLDER [LIMIT]

`cases.json` in FOLDER lists cases: `name`, the MJCF `NAME.xml`, the times `t` (s), and for each joint by name its `command`, held from one time to the next, and
its `position` in our free run. Where a case has `recorded` positions by joint, the nrmse of both runs on them is printed. `rests`: joints that must not creep by
more than a tenth of an encoder step (2 pi / 4096 rad) in the last 10 s. LIMIT is the largest difference allowed, as a share of the standard deviation of our position
(default 0.02).
"""

import json
import sys
from pathlib import Path

try:
    import mujoco
except ImportError:
    print("SKIPPED: the Python package mujoco is not installed (tests/python/requirements.txt)")
    sys.exit(0)
import numpy as np

from runner import Table

LIMIT = 0.02
TICK = 2 * np.pi / 4096
HOLD = 10.0


def run(path, case):
    """Position of every joint at the times of the case, and its steps."""
    model = mujoco.MjModel.from_xml_path(str(path))
    model.opt.disableflags |= mujoco.mjtDisableBit.mjDSBL_CONTACT
    data = mujoco.MjData(model)
    t = np.array(case["t"])
    names = list(case["joints"])
    commands = np.array([case["joints"][n]["command"] for n in names])
    address = [model.joint(n).qposadr[0] for n in names]
    actuators = [model.actuator(n).id for n in names]
    for n, a in zip(names, address):
        data.qpos[a] = case["joints"][n]["position"][0]
    # What was commanded before the start is the first command; a delayed actuator reads its history.
    for n, id in zip(names, actuators):
        count = int(model.actuator_history[id][0])
        if count:
            step = model.opt.timestep
            times = step * (np.arange(count) - count)
            mujoco.mj_initCtrlHistory(model, data, id, times, np.full(count, case["joints"][n]["command"][0]))
    step = model.opt.timestep
    steps = int(round((t[-1] - t[0]) / step)) + 1
    held = np.clip(np.searchsorted(t, t[0] + step * np.arange(steps) + 1e-9, side="right") - 1, 0, len(t) - 1)
    found = np.zeros((steps + 1, len(names)))
    found[0] = data.qpos[address]
    for k in range(steps):
        data.ctrl[actuators] = commands[:, held[k]]
        mujoco.mj_step(model, data)
        found[k + 1] = data.qpos[address]
    at = t[0] + step * np.arange(steps + 1)
    return {n: np.interp(t, at, found[:, k]) for k, n in enumerate(names)}, step


def nrmse(simulated, expected):
    return float(np.sqrt(np.mean((simulated - expected) ** 2)) / np.std(expected))


def main():
    if len(sys.argv) not in (2, 3):
        sys.exit(__doc__)
    folder = Path(sys.argv[1])
    limit = float(sys.argv[2]) if len(sys.argv) == 3 else LIMIT
    table = Table("servo joints in MuJoCo " + mujoco.__version__, ["from ours", "creep, ticks"])
    for case in json.loads((folder / "cases.json").read_text()):
        found, step = run(folder / f"{case['name']}.xml", case)
        print(f"  {case['name']}: {case['t'][-1] - case['t'][0]:.4g} s in steps of {1e3 * step:.3g} ms")
        last = np.array(case["t"]) >= case["t"][-1] - HOLD
        for name, joint in case["joints"].items():
            ours = np.array(joint["position"])
            rests = name in case.get("rests", [])
            creep = float(np.ptp(found[name][last])) / TICK if rests else 0.0
            away = nrmse(found[name], ours) if np.std(ours) > 1e-3 else 0.0
            table.row(f"    {name}", [away, creep], [limit, 0.1])
            if "recorded" in joint and np.std(joint["recorded"]) > 1e-3:
                recorded = np.array(joint["recorded"])
                print(f"      nrmse on the recording: MuJoCo {nrmse(found[name], recorded):.4f}, ours {nrmse(ours, recorded):.4f}")
    table.verdict()


if __name__ == "__main__":
    main()
