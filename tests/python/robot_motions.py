"""Draws arms and torques, and says how MuJoCo moves them.

    python robot_motions.py FOLDER

In FOLDER come to be for each case `NAME.xml` (the robot), `NAME.toml` (the model: what drives its joints), and `expected.json`: for each case the torques, a
column for each input, held for a millisecond each, and the joints' positions at every millisecond by MuJoCo at several steps, the finest last.

- "smooth": random trees with armature, dampers and springs, pushed by motors on their joints. MuJoCo integrates by Runge and Kutta's rule of fourth order.
- "geared": an arm whose joints are driven by motors through soft gears. MuJoCo has the rotors as bodies of their own, and tendons for the gears.
- "rubbing": an arm with dry friction in its joints that sticks and slides. MuJoCo's friction is a regularised constraint, as stiff as it can be made here
  (see mujoco_chain.py), and its rule is of first order.
"""

import json
import sys
from pathlib import Path

import mujoco
import numpy as np
from mujoco import rollout

from robot_trees import direction, numbers, orientation

RANDOM = np.random.default_rng(5)
HOLD = 1e-3  # s
SAMPLES = 800


def torques(count, size):
    """Columns of tones, a sample for every HOLD."""
    t = HOLD * np.arange(SAMPLES)
    tones = [sum(a * np.sin(2 * np.pi * f * t + p) for a, f, p in zip([1, 0.7, 0.5], RANDOM.uniform(0.5, 8, 3), RANDOM.uniform(0, 6, 3))) for _ in range(count)]
    return size * np.array(tones).T


def positions(text, joints, push, step, integrator):
    """Of each joint at every sample. `push` are the controls, in the order of the actuators."""
    model = mujoco.MjModel.from_xml_string(text)
    model.opt.timestep = step
    model.opt.integrator = getattr(mujoco.mjtIntegrator, f"mjINT_{integrator}")
    model.opt.disableflags |= mujoco.mjtDisableBit.mjDSBL_CONTACT
    if integrator != "RK4":
        model.dof_solref[:] = [2 * step, 1]
        model.dof_solimp[:] = [0.9999, 0.9999, 0.001, 0.5, 2]
    data = mujoco.MjData(model)
    each = round(HOLD / step)
    state = np.zeros(mujoco.mj_stateSize(model, mujoco.mjtState.mjSTATE_FULLPHYSICS))
    mujoco.mj_getState(model, data, state, mujoco.mjtState.mjSTATE_FULLPHYSICS)
    states, _ = rollout.rollout(model, data, state, np.repeat(push[:-1], each, axis=0))
    at = [1 + model.jnt_qposadr[model.joint(name).id] for name in joints]
    return np.vstack([state[at], states[0, each - 1 :: each][:, at]])


def chain(joints, extra, inside=""):
    """An arm of `joints` joints with geoms; `extra(i)` are attributes of a joint."""
    opened, closed = "", ""
    for i in range(joints):
        kind = "slide" if i % 4 == 2 else "hinge"
        opened += f"""<body name="link{i}" pos="{numbers(RANDOM.uniform(0.1, 0.3, 3))}" {orientation()}>
  <joint name="j{i}" type="{kind}" axis="{numbers(direction())}" {extra(i)}/>
  <geom type="capsule" fromto="0 0 0 {numbers(RANDOM.uniform(0.1, 0.3, 3))}" size="0.04"/>
"""
        closed += "</body>"
    return opened + closed


def whole(bodies, actuators, rest="", option=""):
    return f'<mujoco><compiler angle="degree"/><option {option}/><worldbody>{bodies}</worldbody>{rest}<actuator>{actuators}</actuator></mujoco>\n'


def outputs(joints):
    return "".join(f'[[outputs]]\nname = "{joint}_position"\nkind = "position"\nof = "{joint}"\n' for joint in joints)


def main():
    if len(sys.argv) != 2:
        sys.exit(__doc__)
    folder, cases = Path(sys.argv[1]), []

    def case(name, ours, theirs, toml, joints, push, steps, integrator):
        (folder / f"{name}.xml").write_text(ours)
        (folder / f"{name}.toml").write_text(f'[robot]\nfile = "{name}.xml"\n{toml}{outputs(joints)}')
        found = [positions(theirs, joints, push, step, integrator) for step in steps]
        found = [(columns - found[-1][0]).T.tolist() for columns in found]  # positions of a network begin at 0
        cases.append(dict(name=name, joints=joints, push=push.T.tolist(), steps=steps, positions=found))

    for i in range(6):
        count = 2 + i
        joints = [f"j{k}" for k in range(count)]
        spring = lambda k: f'damping="{numbers(RANDOM.uniform(0.2, 1))}" armature="{numbers(RANDOM.uniform(0, 0.2))}" ' + (
            f'stiffness="{numbers(RANDOM.uniform(5, 40))}" springref="0.1" ref="0.05"' if k % 2 else "")
        motors = "".join(f'<motor name="m{k}" joint="j{k}" gear="2" ctrlrange="-9 9"/>' for k in range(count))
        text = whole(chain(count, spring), motors)
        case(f"smooth{i}", text, text, "actuators = true\n", joints, torques(count, 2.0), [2e-4, 1e-4], "RK4")

    joints = ["j0", "j1", "j2"]
    bodies = chain(3, lambda k: 'damping="0.1"')
    rotors = "".join(f'<body name="r{k}" pos="1 {k} 0"><inertial pos="0 0 0" mass="1" diaginertia="0.05 0.05 0.05"/><joint name="rotor{k}" axis="1 0 0"/></body>' for k in range(3))
    gears = "".join(f'<fixed name="t{k}" stiffness="400" damping="0.5"><joint joint="rotor{k}" coef="1"/><joint joint="j{k}" coef="-1"/></fixed>' for k in range(3))
    motors = "".join(f'<motor joint="rotor{k}"/>' for k in range(3))
    toml = "[bodies]\n" + "".join(f"rotor{k} = 0.05\n" for k in range(3))
    for k in range(3):
        toml += f'[[elements]]\nkind = "spring"\nbetween = ["rotor{k}", "j{k}"]\nstiffness = 400\n'
        toml += f'[[elements]]\nkind = "damper"\nbetween = ["rotor{k}", "j{k}"]\ndamping = 0.5\n'
        toml += f'[[inputs]]\nname = "m{k}"\nkind = "force"\non = "rotor{k}"\n'
    theirs = whole(bodies + rotors, motors, f"<tendon>{gears}</tendon>")
    case("geared", whole(bodies, ""), theirs, toml, joints, torques(3, 4.0), [2e-4, 1e-4], "RK4")

    rubbing = chain(3, lambda k: f'damping="0.1" frictionloss="{3.0 / (1 + k)}" armature="0.02"')
    motors = "".join(f'<motor name="m{k}" joint="j{k}"/>' for k in range(3))
    text = whole(rubbing, motors, option='gravity="0 0 -3"')
    case("rubbing", text, text, "actuators = true\n", joints, torques(3, 5.0), [1e-4, 2e-5, 4e-6], "IMPLICITFAST")
    (folder / "expected.json").write_text(json.dumps(cases))


if __name__ == "__main__":
    main()
