"""Checks the simulation against MuJoCo: a chain of sliding masses with joint friction, both driven by the same force.

    python mujoco_chain.py BACKDRIVE

MuJoCo's friction loss is a regularised constraint. Where ours holds a joint at velocity 0 exactly, MuJoCo lets it creep:
with impedance d and time constant T, a joint of effective mass m that holds a force f creeps at about
f (1 - d)/d T/(2 m). The impedance can be at most 0.9999 and T at least two steps, so creep is of the order of
0.5 N * 1e-4 * 1e-6 s / 0.04 kg, some 1e-9 m/s, at a step of 1 us: far below what is compared here. What is left then is
MuJoCo's integrator, of first order in the step. So both solutions are taken at steps where they have converged, and have to
agree to 1e-4 of the range of each mass; and MuJoCo's distance has to shrink as its step does, which tells a solution of the
same equations from one that is only near.
"""

import sys
import tomllib
from pathlib import Path

import mujoco
import numpy as np
from mujoco import rollout

from runner import Backdrive, Table, share_of_range

CHAIN = Path(__file__).resolve().parents[2] / "benches" / "mujoco_chain" / "chain.toml"
HOLD = 1e-3  # s, for which the force is held
SECONDS = 2.0


def force(seconds=SECONDS):
    """N, a sample for every HOLD: tones that slide every joint and let it rest."""
    t = HOLD * np.arange(round(seconds / HOLD) + 1)
    tones = np.sin(2 * np.pi * 1.3 * t) + 0.8 * np.sin(2 * np.pi * 7.1 * t) + 0.6 * np.sin(2 * np.pi * 23.0 * t)
    return 2.0 * np.minimum(1.0, t / 0.1) * tones


def mujoco_model(step, integrator="implicitfast", solver="Newton"):
    """The chain of the model file as slide joints, each mass in the one before."""
    chain = tomllib.loads(CHAIN.read_text())
    opened, closed = "", ""
    for name, mass in chain["bodies"].items():
        laws = {e["kind"]: e for e in chain["elements"] if e["between"][0] == name}
        joint = f'stiffness="{laws["spring"]["stiffness"]}" damping="{laws["damper"]["damping"]}" frictionloss="{laws["coulomb"]["force"]}"'
        rigid = f'solreffriction="{2 * step} 1" solimpfriction="0.9999 0.9999 0.001 0.5 2"'
        opened += f'<body name="{name}"><joint name="{name}" type="slide" axis="1 0 0" {joint} {rigid}/>'
        opened += f'<inertial pos="0 0 0" mass="{mass}" diaginertia="1e-3 1e-3 1e-3"/>'
        closed += "</body>"
    # The push acts on the last mass against ground: in these joint coordinates, on every joint.
    gear = "".join(f'<joint joint="{name}" coef="1"/>' for name in chain["bodies"])
    return mujoco.MjModel.from_xml_string(
        f"""<mujoco><option timestep="{step}" integrator="{integrator}" solver="{solver}" gravity="0 0 0">
        <flag contact="disable"/></option><worldbody>{opened}{closed}</worldbody>
        <tendon><fixed name="tip">{gear}</fixed></tendon><actuator><motor tendon="tip"/></actuator></mujoco>"""
    )


def mujoco_positions(model, push):
    """Position of each mass at every sample of the force."""
    each = round(HOLD / model.opt.timestep)
    control = np.repeat(push[:-1], each)[:, None]
    data = mujoco.MjData(model)
    start = np.zeros(mujoco.mj_stateSize(model, mujoco.mjtState.mjSTATE_FULLPHYSICS))
    states, _ = rollout.rollout(model, data, start, control)
    joints = np.vstack([np.zeros(3), states[0, each - 1 :: each, 1:4]])
    return np.cumsum(joints, axis=1)


def our_positions(program, push, substeps):
    drive = program.here / "drive.csv"
    table = np.column_stack([HOLD * np.arange(len(push)), push])
    np.savetxt(drive, table, fmt="%.17g", delimiter=",", header="t,push", comments="")
    found = program.simulate_files(CHAIN, drive, substeps)
    return np.column_stack([found[f"{name}_position"] for name in ("first", "second", "third")])


def distance(found, expected):
    return max(share_of_range(found[:, i], expected[:, i]) for i in range(3))


def main():
    if len(sys.argv) != 2:
        sys.exit(__doc__)
    program, push = Backdrive(sys.argv[1]), force()
    ours = {substeps: our_positions(program, push, substeps) for substeps in (1, 4, 16, 250, 500)}
    converged = ours[500]
    table = Table("against MuJoCo", ["from ours"])
    print("  ours, from its own solution at 2 us")
    for substeps in (1, 4, 16, 250):
        limits = [1e-5] if substeps == 250 else []
        table.row(f"    step {1e6 * HOLD / substeps:.4g} us", [distance(ours[substeps], converged)], limits)
    print("  MuJoCo, from ours at 2 us")
    distances = []
    for step in (1e-4, 1e-5, 1e-6):
        distances.append(distance(mujoco_positions(mujoco_model(step), push), converged))
        table.row(f"    step {1e6 * step:.4g} us", distances[-1:], [1e-4] if step == 1e-6 else [])
    if not distances[0] > 2 * distances[1] > 4 * distances[2]:
        table.broken.append(f"MuJoCo does not approach our solution as its step shrinks: {distances}")
    table.verdict()


if __name__ == "__main__":
    main()
