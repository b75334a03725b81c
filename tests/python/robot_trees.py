"""Draws random trees of links, writes them as URDF and MJCF, and says how MuJoCo and Pinocchio see their mechanics.

    python robot_trees.py FOLDER

In FOLDER come to be `NAME.urdf` or `NAME.xml` for each case, and `expected.json`: for each case the file, who computed, the joints by name in their order,
q, v, a and tau (random), the forces that inverse dynamics finds for a, the accelerations that forward dynamics finds for tau, the mass matrix, kinetic and
potential energy (see below), where the last link is, and how its origin moves with the joints (three rows of velocity, three of turning). Whoever reads the file by other means has to come to the same.

- "shared" trees are written in both formats with the same numbers.
- "wild" ones use what only MJCF has: degrees, Euler angles of any order, several joints in a body with anchors, references, armatures, frames, classes of
  defaults, inertia from geoms. "saved" ones are these as MuJoCo writes them itself.

Potential energy is that of all masses about the origin, without those fixed to the world.
"""

import json
import sys
from pathlib import Path

import mujoco
import numpy as np
import pinocchio as pin

RANDOM = np.random.default_rng(20260)
SHARED, WILD = 25, 25


def numbers(values):
    return " ".join(repr(float(x)) for x in np.ravel(values))


def rotation_of(rpy):
    """About the fixed x, y and z axes."""
    return pin.rpy.rpyToMatrix(*rpy)


def quaternion(rotation):
    x, y, z, w = pin.Quaternion(rotation).coeffs()
    return np.array([w, x, y, z])


def body_inertia():
    """Mass, centre and inertia about it of a few points: one that a body can have."""
    masses, points = RANDOM.uniform(0.1, 1.0, 5), RANDOM.uniform(-0.2, 0.2, (5, 3))
    centre = masses @ points / masses.sum()
    apart = points - centre
    inertia = sum(m * (p @ p * np.eye(3) - np.outer(p, p)) for m, p in zip(masses, apart))
    return masses.sum(), centre, inertia


def direction():
    vector = RANDOM.normal(size=3)
    return vector / np.linalg.norm(vector)


def tree(joints):
    """Links as dicts; link i + 1 hangs on joint i."""
    links = []
    for i in range(joints):
        kind = RANDOM.choice(["revolute", "revolute", "prismatic", "fixed"]) if i > 0 else "revolute"
        parent = RANDOM.integers(0, i + 1) if RANDOM.random() < 0.3 else i
        mass, centre, inertia = body_inertia()
        links.append(
            dict(kind=kind, parent=int(parent), xyz=RANDOM.uniform(-0.4, 0.4, 3), rpy=RANDOM.uniform(-1.5, 1.5, 3), axis=direction(),
                 mass=mass, centre=centre, turn=RANDOM.uniform(-1.5, 1.5, 3), inertia=inertia)
        )
    return links


def urdf(links):
    text = '<robot name="shared"><link name="link0"/>'
    for i, link in enumerate(links):
        names = ["ixx", "ixy", "ixz", "iyy", "iyz", "izz"]
        upper = link["inertia"][np.triu_indices(3)]
        moments = " ".join(f'{name}="{numbers(value)}"' for name, value in zip(names, upper))
        text += f"""
  <link name="link{i + 1}"><inertial><origin xyz="{numbers(link['centre'])}" rpy="{numbers(link['turn'])}"/>
    <mass value="{numbers(link['mass'])}"/><inertia {moments}/></inertial></link>
  <joint name="joint{i}" type="{link['kind']}"><origin xyz="{numbers(link['xyz'])}" rpy="{numbers(link['rpy'])}"/>
    <parent link="link{link['parent']}"/><child link="link{i + 1}"/><axis xyz="{numbers(link['axis'])}"/>
    <limit lower="-9" upper="9" effort="1000" velocity="100"/></joint>"""
    return text + "\n</robot>\n"


def mjcf(links):
    def body(i):
        link = links[i]
        turn = rotation_of(link["turn"])
        inertia = turn @ link["inertia"] @ turn.T
        full = [inertia[0, 0], inertia[1, 1], inertia[2, 2], inertia[0, 1], inertia[0, 2], inertia[1, 2]]
        kind = {"revolute": "hinge", "prismatic": "slide"}.get(link["kind"])
        joint = f'<joint name="joint{i}" type="{kind}" axis="{numbers(link["axis"])}"/>' if kind else ""
        inside = "".join(body(j) for j in range(len(links)) if links[j]["parent"] == i + 1)
        return f"""
    <body name="link{i + 1}" pos="{numbers(link['xyz'])}" quat="{numbers(quaternion(rotation_of(link['rpy'])))}">
      <inertial pos="{numbers(link['centre'])}" mass="{numbers(link['mass'])}" fullinertia="{numbers(full)}"/>{joint}{inside}</body>"""

    bodies = "".join(body(i) for i in range(len(links)) if links[i]["parent"] == 0)
    return f'<mujoco model="shared"><compiler angle="radian"/><worldbody>{bodies}\n</worldbody></mujoco>\n'


def geom(i):
    kind = RANDOM.choice(["sphere", "capsule", "cylinder", "ellipsoid", "box"])
    weight = f'mass="{numbers(RANDOM.uniform(0.2, 2.0))}"' if RANDOM.random() < 0.5 else f'density="{numbers(RANDOM.uniform(300.0, 3000.0))}"'
    weight = "" if RANDOM.random() < 0.2 else weight
    sizes = numbers(RANDOM.uniform(0.03, 0.15, {"sphere": 1, "capsule": 2, "cylinder": 2}.get(kind, 3)))
    if kind != "sphere" and RANDOM.random() < 0.4:
        place = f'fromto="{numbers(RANDOM.uniform(-0.3, 0.3, 6))}"'
        sizes = sizes.split()[0]
    else:
        place = f'pos="{numbers(RANDOM.uniform(-0.2, 0.2, 3))}" {orientation()}'
    return f'<geom name="geom{i}_{RANDOM.integers(10**9)}" type="{kind}" size="{sizes}" {place} {weight}/>'


def orientation():
    """One way to say how something is turned; angles in degrees."""
    way = RANDOM.integers(6)
    return [
        f'quat="{numbers(RANDOM.normal(size=4))}"',
        f'axisangle="{numbers(RANDOM.normal(size=3))} {numbers(RANDOM.uniform(-170, 170))}"',
        f'euler="{numbers(RANDOM.uniform(-170, 170, 3))}"',
        f'xyaxes="{numbers(RANDOM.normal(size=6))}"',
        f'zaxis="{numbers(RANDOM.normal(size=3))}"',
        "",
    ][way]


def wild(bodies):
    children = {i: [] for i in range(bodies + 1)}
    for i in range(bodies):
        children[int(RANDOM.integers(0, i + 1)) if RANDOM.random() < 0.3 else i].append(i + 1)

    def joint(i, k):
        slide = RANDOM.random() < 0.3
        ref = RANDOM.uniform(-0.3, 0.3) if slide else RANDOM.uniform(-40, 40)
        armature = f'armature="{numbers(RANDOM.uniform(0, 0.2))}"' if RANDOM.random() < 0.5 else 'class="heavy"' if RANDOM.random() < 0.3 else ""
        pos = f'pos="{numbers(RANDOM.uniform(-0.2, 0.2, 3))}"' if RANDOM.random() < 0.7 else ""
        axis = f'axis="{numbers(RANDOM.normal(size=3))}"' if RANDOM.random() < 0.8 else ""
        return f'<joint name="joint{i}_{k}" type="{"slide" if slide else "hinge"}" ref="{numbers(ref)}" {pos} {axis} {armature}/>'

    def body(i):
        joints = "".join(joint(i, k) for k in range(1 if i == 1 else RANDOM.integers(0, 4)))
        inertia = "".join(geom(i) for _ in range(RANDOM.integers(1, 4)))
        if RANDOM.random() < 0.4:
            mass, centre, full = body_inertia()
            moments = np.linalg.eigvalsh(full)
            inertia += f'<inertial pos="{numbers(centre)}" mass="{numbers(mass)}" diaginertia="{numbers(moments)}" {orientation()}/>'
        inside = "".join(body(j) for j in children[i])
        if RANDOM.random() < 0.3:
            inside = f'<frame pos="{numbers(RANDOM.uniform(-0.2, 0.2, 3))}" {orientation()}>{geom(i)}{inside}</frame>'
        childclass = 'childclass="light"' if RANDOM.random() < 0.3 else ""
        return f'\n<body name="link{i}" {childclass} pos="{numbers(RANDOM.uniform(-0.4, 0.4, 3))}" {orientation()}>{inertia}{joints}{inside}</body>'

    sequence = "".join(RANDOM.choice(list("xyzXYZ"), 3))
    bodies = "".join(body(i) for i in children[0])
    return f"""<mujoco model="wild"><compiler angle="degree" eulerseq="{sequence}"/><option gravity="{numbers(RANDOM.uniform(-9, 9, 3))}"/>
<default><joint axis="0 1 0.5"/><geom density="700"/>
  <default class="heavy"><joint armature="0.4"/></default>
  <default class="light"><joint armature="0.05"/><geom density="150"/><default class="lighter"><geom density="50"/></default></default></default>
<worldbody>{bodies}
</worldbody></mujoco>
"""


def states(count):
    return [RANDOM.uniform(-size, size, count) for size in (2.0, 3.0, 5.0, 20.0)]


def by_pinocchio(text, names, last, q, v, a, tau):
    model = pin.buildModelFromXML(text)
    data = model.createData()
    order = [model.joints[model.getJointId(name)].idx_v for name in names]

    def put(values):
        placed = np.zeros(model.nv)
        placed[order] = values
        return placed

    Q, V, A, TAU = map(put, (q, v, a, tau))
    mass = np.array(pin.crba(model, data, Q))
    mass = np.triu(mass) + np.triu(mass, 1).T
    pin.framesForwardKinematics(model, data, Q)
    frame = model.getFrameId(last)
    tip = data.oMf[frame]
    jacobian = pin.computeFrameJacobian(model, data, Q, frame, pin.LOCAL_WORLD_ALIGNED).reshape(6, -1)[:, order]
    pin.computePotentialEnergy(model, data, Q)
    return dict(
        inverse=pin.rnea(model, data, Q, V, A)[order].tolist(),
        forward=pin.aba(model, data, Q, V, TAU)[order].tolist(),
        mass=mass[np.ix_(order, order)].tolist(),
        kinetic=pin.computeKineticEnergy(model, data, Q, V),
        potential=data.potential_energy,
        tip=dict(rotation=tip.rotation.tolist(), translation=tip.translation.tolist()),
        jacobian=jacobian.tolist(),
    )


def by_mujoco(text, names, last, q, v, a, tau):
    model = mujoco.MjModel.from_xml_string(text)
    model.opt.disableflags |= mujoco.mjtDisableBit.mjDSBL_CONTACT | mujoco.mjtDisableBit.mjDSBL_CONSTRAINT
    model.opt.enableflags |= mujoco.mjtEnableBit.mjENBL_ENERGY
    data = mujoco.MjData(model)
    at = [model.jnt_dofadr[model.joint(name).id] for name in names]
    data.qpos[at], data.qvel[at], data.qacc[at] = q, v, a
    mujoco.mj_inverse(model, data)
    inverse = data.qfrc_inverse[at].tolist()
    data.qfrc_applied[at] = tau
    mujoco.mj_forward(model, data)
    mass = np.zeros((model.nv, model.nv))
    mujoco.mj_fullM(model, data, mass)
    body = data.body(last)
    linear, angular = np.zeros((2, 3, model.nv))
    mujoco.mj_jacBody(model, data, linear, angular, body.id)
    still = sum(m * (model.opt.gravity @ p) for m, p, w in zip(model.body_mass, data.xipos, model.body_weldid) if w == 0)
    return dict(
        inverse=inverse,
        forward=data.qacc[at].tolist(),
        mass=mass[np.ix_(at, at)].tolist(),
        kinetic=data.energy[1],
        potential=data.energy[0] + still,
        tip=dict(rotation=body.xmat.reshape(3, 3).tolist(), translation=body.xpos.tolist()),
        jacobian=np.vstack([linear, angular])[:, at].tolist(),
    )


def main():
    if len(sys.argv) != 2:
        sys.exit(__doc__)
    folder, cases = Path(sys.argv[1]), []

    def case(name, text, tool, names, last, state):
        (folder / name).write_text(text)
        found = {"pinocchio": by_pinocchio, "mujoco": by_mujoco}[tool](text, names, last, *state)
        q, v, a, tau = (part.tolist() for part in state)
        cases.append(dict(file=name, tool=tool, joints=names, last=last, q=q, v=v, a=a, tau=tau, **found))

    for i in range(SHARED):
        links = tree(1 + i % 13)
        names = [f"joint{j}" for j, link in enumerate(links) if link["kind"] != "fixed"]
        state, last = states(len(names)), f"link{len(links)}"
        case(f"shared{i}.urdf", urdf(links), "pinocchio", names, last, state)
        case(f"shared{i}.xml", mjcf(links), "mujoco", names, last, state)
    for i in range(WILD):
        bodies = 1 + i % 8
        text = wild(bodies)
        names = [joint.name for joint in mujoco.MjSpec.from_string(text).joints]
        case(f"wild{i}.xml", text, "mujoco", names, f"link{bodies}", states(len(names)))
        # As MuJoCo writes it, with what it has worked out, in fewer digits.
        spec = mujoco.MjSpec.from_string(text)
        spec.compile()
        case(f"saved{i}.xml", spec.to_xml(), "mujoco", names, f"link{bodies}", states(len(names)))
    (folder / "expected.json").write_text(json.dumps(cases))


if __name__ == "__main__":
    main()
