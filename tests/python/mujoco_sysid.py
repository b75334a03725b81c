"""MuJoCo's own system identification (mujoco.sysid, `pip install "mujoco[sysid]"`) beside ours on sealed arms: held-out torque residual and seconds.

    python tests/python/mujoco_sysid.py OUT [CASE...]

OUT is what draw_arms.py wrote and score_arms.py has diagnosed. MuJoCo is given the structure: mass and centre of mass of every body, armature, damping and dry friction of every
joint are free, from the nominal file's numbers on; it fits the motion of the arm under the measured torque with a tracking loop of 4 Hz about the measured motion, since
without one no simulation of a mistaken arm stays near a record of 12 s. Ours is free to find the structure. Both are measured alike: the torque that the model takes along the measured
motion of the held-out log, low-passed as in the verdict, beside the torque that was measured, as a share of its rms. Only cases whose effects MuJoCo's structure has are taken where none is named.
"""
import json
import sys
import time
import xml.etree.ElementTree as ET
from pathlib import Path

import mujoco
import numpy as np
from mujoco import sysid
from scipy.signal import butter, sosfiltfilt

HAS = {"coulomb", "damper", "inertia"}


def read(folder, name, n):
    data = np.genfromtxt(folder / name, delimiter=",", names=True, deletechars="")
    t = data["t"]
    q = np.stack([data[f"joint{j + 1}.position"] for j in range(n)])
    tau = np.stack([data[f"joint{j + 1}.torque"] for j in range(n)])
    return t, q, tau


def smooth(x, corner, rate):
    return sosfiltfilt(butter(4, corner, fs=rate, output="sos"), x, axis=-1)


def spec_of(folder, armature, gains):
    spec = mujoco.MjSpec.from_file(str(folder / "arm.urdf"))
    spec.option.timestep = 1e-3
    spec.option.integrator = mujoco.mjtIntegrator.mjINT_IMPLICITFAST
    # A URDF's limits are none that the hidden arm has.
    for j, joint in enumerate(spec.joints):
        joint.limited = False
        joint.armature = max(armature[j], 1e-4)
        actuator = spec.add_actuator(name=f"a{j}", target=joint.name, trntype=mujoco.mjtTrn.mjTRN_JOINT)
        actuator.gaintype, actuator.biastype = mujoco.mjtGain.mjGAIN_FIXED, mujoco.mjtBias.mjBIAS_AFFINE
        actuator.gainprm[0] = 1.0
        actuator.biasprm[1], actuator.biasprm[2] = -gains[j][0], -gains[j][1]
        spec.add_sensor(name=f"q{j}", type=mujoco.mjtSensor.mjSENS_JOINTPOS, objtype=mujoco.mjtObj.mjOBJ_JOINT, objname=joint.name)
    return spec


def parameters(spec, n):
    out = sysid.ParameterDict()
    for j in range(n):
        joint, body = spec.joints[j].name, spec.joints[j].parent.name

        def set_joint(key, name=joint):
            return lambda s, p: setattr(s.joint(name), key, scalar(getattr(s.joint(name), key), p.value[0]))

        for key, least, most in (("armature", 1e-5, 1.0), ("damping", 0.0, 5.0), ("frictionloss", 0.0, 5.0)):
            now = float(np.ravel(getattr(spec.joints[j], key))[0])
            out.add(sysid.Parameter(f"{joint}.{key}", max(now, least + 1e-4), least, most, modifier=set_joint(key)))

        def set_mass(s, p, name=body):
            b = s.body(name)
            factor = p.value[0] / b.mass
            b.mass, b.inertia, b.fullinertia = p.value[0], np.array(b.inertia) * factor, np.array(b.fullinertia) * factor

        def set_centre(s, p, name=body):
            s.body(name).ipos = np.array(p.value)

        mass, centre = float(spec.body(body).mass), np.array(spec.body(body).ipos)
        out.add(sysid.Parameter(f"{body}.mass", mass, 0.3 * mass, 3 * mass, modifier=set_mass))
        out.add(sysid.Parameter(f"{body}.centre", centre, centre - 0.1, centre + 0.1, modifier=set_centre))
    return out


def scalar(there, value):
    return value if np.ndim(there) == 0 else np.concatenate([[value], np.ravel(there)[1:]])


def takes(model, q, v, a):
    data = mujoco.MjData(model)
    out = np.zeros_like(q)
    for i in range(q.shape[1]):
        data.qpos[:], data.qvel[:], data.qacc[:] = q[:, i], v[:, i], a[:, i]
        mujoco.mj_inverse(model, data)
        out[:, i] = data.qfrc_inverse
    return out


def case(folder, verdict, seconds):
    n = len(ET.parse(folder / "arm.urdf").getroot().findall("joint[@type='revolute']"))
    lines = (folder / "arm.toml").read_text().split("[bodies]")[1].strip().splitlines()
    armature = [float(line.split("=")[1]) for line in lines]
    first = spec_of(folder, armature, [[0.0, 0.0]] * n).compile()
    data, mass = mujoco.MjData(first), np.zeros((n, n))
    mujoco.mj_forward(first, data)
    mujoco.mj_fullM(first, data, mass)
    w = 2 * np.pi * 4
    own = 1 / np.diag(np.linalg.inv(mass))
    gains = [[m * w * w, 2 * m * w] for m in own]
    spec = spec_of(folder, armature, gains)
    model = spec.compile()
    sequences = []
    for name in ("log-1.csv", "log-2.csv", "log-3.csv"):
        t, q, tau = read(folder, name, n)
        rate = 1 / np.median(np.diff(t))
        qs = smooth(q, 25, rate)
        vs = np.gradient(qs, 1 / rate, axis=1)
        control = tau + np.array(gains)[:, :1] * qs + np.array(gains)[:, 1:] * vs
        state = sysid.create_initial_state(model, qs[:, 0], vs[:, 0])
        sequences.append(sysid.ModelSequences(name, spec, name, state, sysid.TimeSeries(t, control.T), sysid.TimeSeries.from_names(t, qs.T, model)))
    began = time.monotonic()
    fitted, _ = sysid.optimize(parameters(spec, n), sysid.build_residual_fn(models_sequences=sequences), optimizer="mujoco", verbose=False)
    theirs = time.monotonic() - began
    found = sysid.apply_param_modifiers(fitted, spec)
    if isinstance(found, mujoco.MjSpec):
        found = found.compile()
    t, q, tau = read(folder, "log-4.csv", n)
    rate, corner = 1 / np.median(np.diff(t)), verdict["arm"]["corner_hz"]
    qs = smooth(q, 5 * corner, rate)
    v = np.gradient(qs, 1 / rate, axis=1)
    a = np.gradient(v, 1 / rate, axis=1)
    cut = slice(int(rate / corner), -int(rate / corner))
    low = lambda x: smooth(x, corner, rate)[:, cut]
    found.actuator_biasprm[:] = 0
    left = low(tau - takes(found, qs, v, a))
    share = np.sqrt((left**2).mean(axis=1) / (low(tau) ** 2).mean(axis=1))
    ours = [j["diagnosed"] for j in verdict["arm"]["joints"]]
    show = lambda s: ", ".join(f"{100 * x:.1f}" for x in s)
    print(f"| {folder.name} | {show(share)} | {theirs:.1f} | {show(ours)} | {seconds:.1f} |", flush=True)


def main():
    out = Path(sys.argv[1])
    names = sys.argv[2:]
    if not names:
        for file in sorted((out / "truth").iterdir()):
            truth = json.loads(file.read_text())
            if truth["hidden"] and all(h["physics"] in HAS for h in truth["hidden"]):
                names.append(file.stem)
    print("| arm | mujoco.sysid, structure given: % of held-out torque left, by joint | s | ours, structure found | s |\n|---|---|---|---|---|")
    seconds = json.loads((out / "seconds.json").read_text())
    for name in names:
        verdict = json.loads((out / "verdicts" / name / "verdict.json").read_text())
        case(out / "cases" / name, verdict, seconds[name])


if __name__ == "__main__":
    main()
