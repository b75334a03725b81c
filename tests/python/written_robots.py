"""Loads robots that were written as URDF and MJCF in Pinocchio and MuJoCo, and compares the torques of a motion with ours.

    python written_robots.py FOLDER

`cases.json` in FOLDER lists cases: `name`, of which there are `NAME.xml` (MJCF), `NAME.urdf` and `NAME.alone.urdf`; the `joints`, and by joint `q`, `v`, `a`,
the `torque` that we find for them without friction, `damping`, `range` and `effort`; `limit` is the largest difference, as a share of the largest torque.
MuJoCo's motors are tried as well: with the torque of the motion it has to find the acceleration of the motion again.
"""

import json
import sys
from pathlib import Path

import mujoco
import numpy as np
import pinocchio as pin


def share(ours, theirs):
    return float(np.max(np.abs(ours - theirs)) / max(np.max(np.abs(ours)), 1e-12))


def by_pinocchio(path, case):
    model = pin.buildModelFromUrdf(str(path))
    data = model.createData()
    places = [model.joints[model.getJointId(name)].idx_v for name in case["joints"]]
    assert model.nv == len(places), f"{path.name}: {model.nv} joints"
    q, v, a = (np.zeros(model.nv) for _ in range(3))
    for i, place in enumerate(places):
        q[place], v[place], a[place] = case["q"][i], case["v"][i], case["a"][i]
    return pin.rnea(model, data, pin.integrate(model, pin.neutral(model), q), v, a)[places]


def by_mujoco(path, case):
    model = mujoco.MjModel.from_xml_path(str(path))
    off = mujoco.mjtDisableBit
    # Limits and dry friction are constraints: the torque of the motion is without them.
    model.opt.disableflags |= off.mjDSBL_CONTACT | off.mjDSBL_LIMIT | off.mjDSBL_FRICTIONLOSS
    data = mujoco.MjData(model)
    places = [model.joint(name).dofadr[0] for name in case["joints"]]
    assert model.nv == len(places) == model.nq, f"{path.name}: {model.nv} joints"
    for name, wanted in zip(case["joints"], case["range"]):
        joint = model.joint(name)
        assert bool(joint.limited[0]) == (wanted is not None), f"{path.name}: {name} is limited: {joint.limited}"
        assert wanted is None or np.allclose(joint.range, wanted, rtol=1e-12), f"{path.name}: {name} has the range {joint.range}"
    for name, effort in zip(case["joints"], case["effort"]):
        if effort == 0:
            continue  # passive: without a motor
        motor = model.actuator(name)
        if effort is not None:
            wanted = [-effort, effort]
            assert np.allclose(motor.ctrlrange, wanted) and np.allclose(motor.forcerange, wanted), f"{path.name}: {name}: {motor.ctrlrange}"
    for i, place in enumerate(places):
        data.qpos[place], data.qvel[place], data.qacc[place] = case["q"][i], case["v"][i], case["a"][i]
    mujoco.mj_inverse(model, data)
    inverse = data.qfrc_inverse[places].copy()
    # The motors push with what the motion takes, or as much of it as they have; gravity and the rest do what is left.
    for name, torque in zip(case["joints"], inverse):
        names = [model.actuator(k).name for k in range(model.nu)]
        if name in names:
            data.ctrl[names.index(name)] = torque
    mujoco.mj_forward(model, data)
    pushed = np.array(data.qfrc_actuator)
    for i, place in enumerate(places):
        effort = case["effort"][i]
        wanted = inverse[i] if effort is None else np.clip(inverse[i], -effort, effort)
        assert abs(pushed[place] - wanted) <= 1e-9 * max(1.0, abs(inverse[i])), f"{path.name}: {case['joints'][i]} pushes with {pushed[place]}"
    data.qfrc_applied[:] = 0
    for i, place in enumerate(places):
        data.qfrc_applied[place] = inverse[i] - pushed[place]
    mujoco.mj_forward(model, data)
    again = share(np.array(case["a"]), data.qacc[places])
    # And it moves: a second without a command stays finite.
    model.opt.disableflags &= ~int(off.mjDSBL_LIMIT) & ~int(off.mjDSBL_FRICTIONLOSS)
    mujoco.mj_resetData(model, data)
    mujoco.mj_step(model, data, nstep=200)
    assert np.all(np.isfinite(data.qpos)), f"{path.name}: moves out of all bounds"
    return inverse, again


def main():
    if len(sys.argv) != 2:
        sys.exit(__doc__)
    folder = Path(sys.argv[1])
    bad, largest = [], {}
    for case in json.loads((folder / "cases.json").read_text()):
        name, torque = case["name"], np.array(case["torque"])
        kind = "random trees" if name.startswith("tree") else name
        inverse, again = by_mujoco(folder / f"{name}.xml", case)
        found = {
            "MuJoCo": share(torque + np.array(case["damping"]) * np.array(case["v"]), inverse),
            "accelerations": again,
            "Pinocchio": share(torque, by_pinocchio(folder / f"{name}.urdf", case)),
            "Pinocchio, alone": share(torque, by_pinocchio(folder / f"{name}.alone.urdf", case)),
        }
        for what, off in found.items():
            largest[kind, what] = max(largest.get((kind, what), 0.0), off)
            # Forward dynamics solves with the mass matrix, which magnifies what is off.
            limit = case["limit"] * (1e3 if what == "accelerations" else 1)
            if not off <= limit:
                bad.append(f"{name}: {what} {off:.2e}")
    for (kind, what), off in largest.items():
        print(f"  {kind:14} {what:18} {off:.1e}")
    if bad:
        sys.exit("\n".join(bad))


if __name__ == "__main__":
    main()
