"""Holds an arm at points of its links by springs and dampers, pushes it there, and says how MuJoCo moves it.

    python robot_points.py FOLDER

In FOLDER come to be `arm.xml` (the robot), `arm.toml` (the model) and `expected.json`: the pushes, held for a millisecond each, and at every millisecond the
positions of the joints and the displacements of the points. MuJoCo gives accelerations (`mj_forward`) and Jacobians (`mj_jac`); forces on points are its
`qfrc_applied`, the transposed Jacobian times the force, and the motion is integrated here, by Runge and Kutta's rule of fourth order with a step of 0.1 ms.
"""

import json
import sys
from pathlib import Path

import mujoco
import numpy as np

HOLD, STEP, SAMPLES = 1e-3, 1e-4, 800  # s, s
POSE = [0.3, -0.7, 0.05, 0.9]
ARM = """<mujoco><option gravity="1 -2 -9"/><compiler angle="radian"/><worldbody>
<body name="link0" pos="0 0 0.3"><joint name="j0" axis="0 0 1" armature="0.01" damping="0.05"/><geom type="capsule" size="0.04" fromto="0 0 0 0.05 0 0.25" mass="1.2"/>
<body name="link1" pos="0.05 0 0.25" euler="0.2 0.1 0"><joint name="j1" axis="0 1 0.2" armature="0.01" damping="0.05"/><geom type="capsule" size="0.03" fromto="0 0 0 0.3 0 0" mass="0.9"/>
<body name="link2" pos="0.3 0 0"><joint name="j2" type="slide" axis="1 0 0.3" armature="0.1" damping="0.5"/><geom type="box" size="0.03 0.02 0.05" mass="0.5"/>
<body name="link3" pos="0.08 0.01 0"><joint name="j3" axis="0.1 1 0" armature="0.01" damping="0.05"/><geom type="capsule" size="0.02" fromto="0 0 0 0.25 0 0.03" mass="0.6"/>
</body></body></body></body></worldbody></mujoco>"""
# Name, body, place in it, direction in the base's frame, stiffness and damping to ground; the first is pushed.
POINTS = [
    ("tip", "link3", [0.25, 0.0, 0.03], [0.6, 0.0, 0.8], 150.0, 2.0),
    ("side", "link3", [0.25, 0.0, 0.03], [0.0, 1.0, 0.0], 90.0, 0.0),
    ("elbow", "link1", [0.3, 0.02, 0.0], [0.0, 0.0, 1.0], 400.0, 3.0),
]


def main(folder):
    model = mujoco.MjModel.from_xml_string(ARM)
    model.opt.disableflags |= mujoco.mjtDisableBit.mjDSBL_CONTACT
    data = mujoco.MjData(model)
    t = HOLD * np.arange(SAMPLES)
    push = 6 * np.sin(2 * np.pi * 2.3 * t) + 3 * np.sin(2 * np.pi * 7.1 * t + 1)

    def place(point):
        jac = np.zeros((3, model.nv))
        body = model.body(point[1]).id
        at = data.xpos[body] + data.xmat[body].reshape(3, 3) @ point[2]
        mujoco.mj_jac(model, data, jac, None, at, body)
        return np.dot(point[3], at), np.array(point[3]) @ jac

    data.qpos[:] = POSE
    mujoco.mj_forward(model, data)
    first = [place(point)[0] for point in POINTS]

    def rates(state, force):
        data.qpos[:], data.qvel[:] = state[: model.nq], state[model.nq :]
        data.qfrc_applied[:] = 0
        mujoco.mj_fwdPosition(model, data)
        for index, point in enumerate(POINTS):
            at, row = place(point)
            f = -point[4] * (at - first[index]) - point[5] * (row @ data.qvel) + (force if index == 0 else 0)
            data.qfrc_applied += row * f
        mujoco.mj_forward(model, data)
        return np.concatenate([state[model.nq :], data.qacc])

    state, rows = np.concatenate([POSE, np.zeros(model.nv)]), []
    for sample in range(SAMPLES):
        data.qpos[:], data.qvel[:] = state[: model.nq], state[model.nq :]
        mujoco.mj_fwdPosition(model, data)
        rows.append(np.concatenate([state[: model.nq] - POSE, [place(p)[0] - f for p, f in zip(POINTS, first)]]))
        for _ in range(round(HOLD / STEP)):
            a = rates(state, push[sample])
            b = rates(state + 0.5 * STEP * a, push[sample])
            c = rates(state + 0.5 * STEP * b, push[sample])
            d = rates(state + STEP * c, push[sample])
            state = state + STEP / 6 * (a + 2 * b + 2 * c + d)

    (folder / "arm.xml").write_text(ARM)
    pose = ", ".join(f"j{i} = {value}" for i, value in enumerate(POSE))
    text = f'[robot]\nfile = "arm.xml"\npose = {{ {pose} }}\n'
    for name, link, at, axis, _, _ in POINTS:
        text += f'[point.{name}]\nlink = "{link}"\nat = {at}\naxis = {axis}\n'
    for name, *_, stiffness, damping in POINTS:
        for kind, key, value in [("spring", "stiffness", stiffness), ("damper", "damping", damping)]:
            text += f'[[elements]]\nname = "{name}_{kind}"\nkind = "{kind}"\nbetween = ["{name}", "ground"]\n{key} = {value}\n'
    text += '[[inputs]]\nname = "push"\nkind = "force"\non = "tip"\n'
    for body in [f"j{i}" for i in range(model.nq)] + [p[0] for p in POINTS]:
        text += f'[[outputs]]\nname = "{body}"\nkind = "position"\nof = "{body}"\n'
    (folder / "arm.toml").write_text(text)
    (folder / "expected.json").write_text(json.dumps({"push": [push.tolist()], "positions": np.array(rows).T.tolist()}))


main(Path(sys.argv[1]))
