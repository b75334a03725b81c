"""Draws sealed arms: recordings of arms whose model lacks something, by a simulator that shares nothing with the fitting side.

    python tests/python/draw_arms.py OUT --seed 1 --count 48

MuJoCo is the hidden plant for joint friction, damping, armature, springs, soft gears and play, the direction of gravity, payloads and wrong masses; friction that depends on load
or speed, cogging, sensor zeros, wrong torque constants and coupled motors are added here. Into OUT/cases/NN go a URDF, a model file, a set and its logs; into
OUT/truth/NN.json what was hidden, which only score_arms.py opens, after every verdict is written.
"""
import argparse
import json
import math
from pathlib import Path

import mujoco
import numpy as np

KINDS = ["coulomb", "damper", "inertia", "spring", "gravity_direction", "payload", "gain", "load_friction", "stribeck", "cogging", "offset", "coupling", "series_compliance", "backlash"]
STEP = 5e-4      # s, of the hidden plant
SECONDS = 12.0   # of a recording
# Rotations about world or link axes, from the base outwards.
AXES = {"planar": "yyy", "turret": "zyy", "cross": "yxy"}


def draw_arm(rng):
    """Numbers of an arm as it is on paper."""
    n = int(rng.integers(2, 4))
    kind = rng.choice(list(AXES))
    links = []
    for k in range(n):
        length = rng.uniform(0.2, 0.45)
        mass = rng.uniform(0.8, 4.0) * 0.6**k
        thick = rng.uniform(0.02, 0.05)
        com = np.array([rng.uniform(-0.01, 0.01), rng.uniform(-0.01, 0.01), -length * rng.uniform(0.35, 0.6)])
        inertia = np.diag([mass * (length**2 / 12 + thick**2 / 4)] * 2 + [mass * thick**2 / 2])
        links.append(dict(length=length, mass=mass, com=com, inertia=inertia))
    size = [sum(l["mass"] for l in links[k:]) * 0.5 for k in range(n)]
    return dict(
        n=n, kind=str(kind), axes=AXES[kind][:n], links=links,
        armature=[rng.uniform(0.05, 0.3) * links[k]["mass"] * links[k]["length"] ** 2 for k in range(n)],
        damping=[rng.uniform(0.02, 0.12) * size[k] for k in range(n)],
        friction=[rng.uniform(0.05, 0.25) * size[k] for k in range(n)],
    )


def perturbed(arm, rng, masses, frictions):
    """The arm as it is in truth: numbers off by these shares, standard deviations."""
    out = json.loads(json.dumps(arm, default=lambda a: a.tolist()))
    for link in out["links"]:
        factor = 1 + masses * rng.uniform(-1.7, 1.7)
        link["mass"] *= factor
        link["inertia"] = (np.array(link["inertia"]) * factor * (1 + masses * rng.uniform(-1, 1))).tolist()
        link["com"] = (np.array(link["com"]) * (1 + masses * rng.uniform(-1, 1))).tolist()
    for key in ("armature", "damping", "friction"):
        out[key] = [x * (1 + frictions * rng.uniform(-1.7, 1.7)) for x in out[key]]
    return out


def mjcf(arm, gravity, payload, springs, gears=None):
    # Of a soft or loose gear the motor turns on a body of its own, with hardly any inertia but its armature, and the link hinges on that.
    gears = gears or {}
    axis = {"x": "1 0 0", "y": "0 1 0", "z": "0 0 1"}
    text, depth = "", 0
    for k, link in enumerate(arm["links"]):
        at = "0 0 0" if k == 0 else f"0 0 {-arm['links'][k - 1]['length']:.12g}"
        i = np.array(link["inertia"])
        turns = f'type="hinge" axis="{axis[arm["axes"][k]]}"'
        text += f'<body name="l{k}" pos="{at}"><joint name="j{k}" {turns} armature="{arm["armature"][k]:.12g}" '
        text += f'damping="{arm["damping"][k]:.12g}" frictionloss="{arm["friction"][k]:.12g}" stiffness="{springs[k][0]:.12g}" springref="{springs[k][1]:.12g}" solreffriction="0.002 1"/>'
        if k in gears:
            gear = gears[k]
            text += '<inertial pos="0 0 0" mass="1e-5" diaginertia="1e-7 1e-7 1e-7"/>'
            text += f'<body name="behind{k}"><joint name="gear{k}" {turns} damping="{gear["damping"]:.12g}" '
            if "gap" in gear:
                text += f'limited="true" range="{-gear["gap"] / 2:.12g} {gear["gap"] / 2:.12g}" solreflimit="0.004 1" solimplimit="0.95 0.99 0.0001"/>'
            else:
                text += f'stiffness="{gear["stiffness"]:.12g}"/>'
        c = link["com"]
        text += f'<inertial pos="{c[0]:.12g} {c[1]:.12g} {c[2]:.12g}" mass="{link["mass"]:.12g}" fullinertia="{i[0][0]:.12g} {i[1][1]:.12g} {i[2][2]:.12g} {i[0][1]:.12g} {i[0][2]:.12g} {i[1][2]:.12g}"/>'
        depth += 1
    if payload:
        p = payload["place"]
        small = payload["mass"] * 0.02**2
        text += f'<body name="load" pos="{p[0]:.12g} {p[1]:.12g} {p[2]:.12g}"><inertial pos="0 0 0" mass="{payload["mass"]:.12g}" diaginertia="{small} {small} {small}"/></body>'
    text += "</body>" * (depth + len(gears))
    g = " ".join(f"{x:.12g}" for x in gravity)
    return f'<mujoco><compiler angle="radian"/><option timestep="{STEP}" gravity="{g}" integrator="implicitfast" impratio="10"/><worldbody>{text}</worldbody></mujoco>'


def urdf(arm, damped, rubbing):
    axis = {"x": "1 0 0", "y": "0 1 0", "z": "0 0 1"}
    out = ['<robot name="arm">', '  <link name="base"/>']
    for k, link in enumerate(arm["links"]):
        i, c = link["inertia"], link["com"]
        at = "0 0 0" if k == 0 else f"0 0 {-arm['links'][k - 1]['length']:.9g}"
        parent = "base" if k == 0 else f"link{k}"
        dynamics = f'<dynamics damping="{arm["damping"][k] if damped[k] else 0:.9g}" friction="{arm["friction"][k] if rubbing[k] else 0:.9g}"/>'
        out += [
            f'  <link name="link{k + 1}"><inertial><origin xyz="{c[0]:.9g} {c[1]:.9g} {c[2]:.9g}"/><mass value="{link["mass"]:.9g}"/>'
            f'<inertia ixx="{i[0][0]:.9g}" ixy="0" ixz="0" iyy="{i[1][1]:.9g}" iyz="0" izz="{i[2][2]:.9g}"/></inertial></link>',
            f'  <joint name="joint{k + 1}" type="revolute"><parent link="{parent}"/><child link="link{k + 1}"/><origin xyz="{at}"/>'
            f'<axis xyz="{axis[arm["axes"][k]]}"/><limit lower="-3" upper="3" effort="200" velocity="20"/>{dynamics}</joint>',
        ]
    last = arm["n"]
    out += ['  <link name="tip"/>', f'  <joint name="flange" type="fixed"><parent link="link{last}"/><child link="tip"/><origin xyz="0 0 {-arm["links"][-1]["length"]:.9g}"/></joint>', "</robot>"]
    return "\n".join(out) + "\n"


def trajectory(rng, n, rate):
    """A Fourier series for each joint (Swevers et al. 1997), from rest."""
    t = np.arange(0, SECONDS, 1 / rate)
    q, v, a = (np.zeros((n, len(t))) for _ in range(3))
    base = 2 * math.pi * rng.uniform(0.08, 0.12)
    ramp = np.clip(t / 1.5, 0, 1)
    for j in range(n):
        for h in range(1, 6):
            c, s = rng.normal(0, 0.45 / h, 2)
            w = base * h * rng.uniform(0.9, 1.1)
            q[j] += c * (np.cos(w * t) - 1) + s * np.sin(w * t)
        q[j] *= ramp**3 * (10 - 15 * ramp + 6 * ramp**2)
        q[j] *= min(1.0, 2.2 / max(abs(q[j]).max(), 1e-9))
        v[j] = np.gradient(q[j], 1 / rate)
        a[j] = np.gradient(v[j], 1 / rate)
    return t, q, v, a


def simulate(model, arm, hidden, path, rate, rigid=None):
    """Motion of the hidden arm under computed torque with the paper's numbers and a stiff loop; position and motor torque at the samples."""
    t, qd, vd, ad = path
    n = arm["n"]
    data = mujoco.MjData(model)
    # Coordinates of the motors; of a gear that gives way the controller knows the arm as a rigid one.
    at = np.array([model.joint(f"j{j}").qposadr[0] for j in range(n)])
    known = data if rigid is None else mujoco.MjData(rigid)
    per = round(1 / rate / STEP)
    q, tau = np.zeros((n, len(t))), np.zeros((n, len(t)))
    mass = np.zeros((n, n))
    u = np.zeros(n)
    qfull = np.zeros(n)
    gains = None
    for i in range(len(t)):
        mujoco.mj_forward(model, data)
        if rigid is not None:
            known.qpos[:], known.qvel[:] = data.qpos[at], data.qvel[at]
            mujoco.mj_forward(rigid, known)
        mujoco.mj_fullM(model if rigid is None else rigid, known, mass)
        if gains is None:
            # A loop about a soft gear is a slower one: it would shake the link.
            hz = 8 if rigid is None else 3
            gains = (np.diag(mass) * (2 * math.pi * hz) ** 2, np.diag(mass) * 2 * (2 * math.pi * hz))
        u = mass @ ad[:, i] + known.qfrc_bias + gains[0] * (qd[:, i] - data.qpos[at]) + gains[1] * (vd[:, i] - data.qvel[at])
        q[:, i], tau[:, i] = data.qpos[at], u
        for _ in range(per):
            v, x = data.qvel[at], data.qpos[at]
            extra = np.zeros(n)
            for e in hidden:
                j = e.get("index", 0)
                # Direction of friction, turned within a hundredth of a radian per second.
                s = math.tanh(v[j] / 0.01)
                if e["physics"] == "load_friction":
                    load = mass[j] @ data.qacc[at] + data.qfrc_bias[at[j]]
                    extra[j] -= e["coefficient"] * abs(load) * s
                elif e["physics"] == "stribeck":
                    extra[j] -= e["excess"] * math.exp(-((v[j] / e["velocity"]) ** 2)) * s
                elif e["physics"] == "cogging":
                    extra[j] -= e["amplitude"] * math.sin(e["number"] * x[j] + e["phase"])
            data.qfrc_applied[at] = u + extra
            mujoco.mj_step(model, data)
    return t, q, tau


def draw_hidden(rng, arm, kind, taken):
    n = arm["n"]
    joints = [j for j in range(n) if j not in taken]
    if kind in ("offset", "coupling"):
        joints = [j for j in joints if (j > 0 if kind == "offset" else j < n - 1)]
    if kind == "spring" or kind == "gain":
        joints = joints or [0]
    if not joints:
        return None
    j = int(rng.choice(joints))
    e = dict(physics=kind, joint=f"joint{j + 1}", index=j, share=float(rng.uniform(0.08, 0.25)))
    if kind == "gravity_direction":
        if arm["kind"] == "planar":
            return None
        e.update(joint=None, tilt=float(rng.uniform(0.06, 0.2)), about=float(rng.uniform(0, 2 * math.pi)))
    elif kind == "payload":
        tip = -arm["links"][-1]["length"]
        e.update(joint=None, mass=float(arm["links"][-1]["mass"] * rng.uniform(0.25, 0.8)), place=[float(rng.uniform(-0.02, 0.02)), 0.0, float(tip + rng.uniform(-0.02, 0.02))])
    elif kind == "gain":
        e.update(gain=float(1 + rng.choice([-1, 1]) * rng.uniform(0.08, 0.3)))
    elif kind == "offset":
        e.update(offset=float(rng.choice([-1, 1]) * rng.uniform(0.05, 0.2)))
    elif kind == "coupling":
        e.update(of=f"joint{j + 2}", ratio=float(rng.choice([-1, 1]) * rng.uniform(0.3, 1.0)))
    elif kind == "series_compliance":
        # Resonance of the link behind it, Hz, with the other links straight.
        e.update(hz=float(rng.uniform(2.5, 6.0)))
    elif kind == "backlash":
        e.update(gap=float(rng.uniform(0.005, 0.04)))
    elif kind == "cogging":
        e.update(number=int(rng.integers(6, 40)), phase=float(rng.uniform(0, 6.28)))
    elif kind == "stribeck":
        e.update(velocity=float(rng.uniform(0.08, 0.3)))
    return e


def size(e, torque, speed, angle, acceleration, own):
    """Sizes an effect as a share of the rms torque of its joint."""
    j, share = e["index"], e["share"]
    rms = lambda x: float(np.sqrt(np.mean(x**2)))
    level = share * rms(torque[j])
    kind = e["physics"]
    if kind == "coulomb":
        e["force"] = level
    elif kind == "damper":
        e["damping"] = level / max(rms(speed[j]), 1e-6)
    elif kind == "inertia":
        e["inertia"] = level / max(rms(acceleration[j]), 1e-6)
    elif kind == "spring":
        e["stiffness"] = level / max(rms(angle[j]), 1e-6)
    elif kind == "load_friction":
        e["coefficient"] = share
    elif kind == "stribeck":
        e["excess"] = max(2.0 * level, own["friction"][j])
    elif kind == "cogging":
        e["amplitude"] = level


def shows(model, path, q, read, arm, hidden):
    """Whether the measured torque differs from that of the arm without what is hidden by 3 % of its rms at some joint at least."""
    plain = mujoco.MjModel.from_xml_string(mjcf(dict(arm, friction=[0.0 if any(h["physics"] == "coulomb" and h["index"] == j for h in hidden) else f for j, f in enumerate(arm["friction"])], damping=[0.0 if any(h["physics"] == "damper" and h["index"] == j for h in hidden) else d for j, d in enumerate(arm["damping"])], armature=[0.0 if any(h["physics"] == "inertia" and h["index"] == j for h in hidden) else d for j, d in enumerate(arm["armature"])]), [0, 0, -9.81], None, [[0.0, 0.0]] * arm["n"]))
    data = mujoco.MjData(plain)
    _, _, vd, ad = path
    n = arm["n"]
    takes = np.zeros_like(read)
    for i in range(read.shape[1]):
        data.qpos[:], data.qvel[:], data.qacc[:] = q[:, i], vd[:, i], ad[:, i]
        mujoco.mj_inverse(plain, data)
        takes[:, i] = data.qfrc_inverse
    rms = lambda x: np.sqrt((x**2).mean(axis=1))
    return bool((rms(read - takes) / rms(read) > 0.03).any())


def case(rng, folder, truth_file, number, kinds):
    arm = draw_arm(rng)
    n = arm["n"]
    null = kinds[0] if kinds[0] in ("nothing", "numbers") else None
    hidden = []
    for kind in kinds if null is None else []:
        e = draw_hidden(rng, arm, kind, [h["index"] for h in hidden])
        if e is None:
            e = draw_hidden(rng, arm, "coulomb", [h["index"] for h in hidden])
        if e is not None:
            hidden.append(e)
    off = {"nothing": (0.0, 0.0), "numbers": (0.1, 0.2)}.get(null, (0.006, 0.1))
    true = perturbed(arm, rng, *off)
    damped, geared, rubbing = [True] * n, [True] * n, [bool(rng.random() < 0.7) for _ in range(n)]
    for h in hidden:
        if h["physics"] == "coulomb":
            rubbing[h["index"]] = False
        if h["physics"] == "damper":
            damped[h["index"]] = False
        if h["physics"] == "inertia":
            geared[h["index"]] = False
        if h["physics"] == "stribeck":
            rubbing[h["index"]] = True
    for j in range(n):
        if not rubbing[j]:
            true["friction"][j] = 0.0
        if not damped[j]:
            true["damping"][j] = 0.0
    rate = float(rng.choice([250, 500]))
    paths = [trajectory(rng, n, rate) for _ in range(4)]
    gravity = np.array([0, 0, -9.81])
    springs = [[0.0, 0.0] for _ in range(n)]
    # First without what is hidden, for its size.
    t, q, plain = simulate(mujoco.MjModel.from_xml_string(mjcf(true, gravity, None, springs)), true, [], paths[0], rate)
    tau = plain
    if not np.isfinite(q).all() or abs(q - paths[0][1]).max() > 0.5:
        raise ValueError("the arm ran away")
    for h in hidden:
        size(h, tau, paths[0][2], paths[0][1], paths[0][3], true)
    payload = None
    gears = {}
    straight = mujoco.MjModel.from_xml_string(mjcf(dict(true, armature=[0.0] * n), gravity, None, springs))
    at_rest, links = mujoco.MjData(straight), np.zeros((n, n))
    mujoco.mj_forward(straight, at_rest)
    mujoco.mj_fullM(straight, at_rest, links)
    for h in hidden:
        kind, j = h["physics"], h["index"]
        own = links[j, j]
        if kind == "series_compliance":
            h["stiffness"] = own * (2 * math.pi * h["hz"]) ** 2
            gears[j] = dict(stiffness=h["stiffness"], damping=2 * 0.05 * own * 2 * math.pi * h["hz"])
        elif kind == "backlash":
            gears[j] = dict(gap=h["gap"], damping=0.02 * own)
        if kind == "coulomb":
            true["friction"][j] = h["force"]
        elif kind == "damper":
            true["damping"][j] = h["damping"]
        elif kind == "inertia":
            true["armature"][j] = h["inertia"]
        elif kind == "spring":
            springs[j] = [h["stiffness"], float(rng.uniform(-0.3, 0.3))]
        elif kind == "gravity_direction":
            s, c = math.sin(h["tilt"]), math.cos(h["tilt"])
            gravity = 9.81 * np.array([s * math.cos(h["about"]), s * math.sin(h["about"]), -c])
        elif kind == "payload":
            payload = h
    model = mujoco.MjModel.from_xml_string(mjcf(true, gravity, payload, springs, gears))
    rigid = mujoco.MjModel.from_xml_string(mjcf(true, gravity, payload, springs)) if gears else None
    folder.mkdir(parents=True)
    bits = int(rng.integers(14, 19))
    noise = rng.uniform(0.003, 0.015)
    names = []
    for k, path in enumerate(paths):
        t, q, tau = simulate(model, true, hidden, path, rate, rigid)
        if not np.isfinite(q).all() or abs(q - path[1]).max() > 0.5:
            raise ValueError("the hidden arm ran away")
        level = np.sqrt((tau**2).mean(axis=1, keepdims=True))
        for h in hidden:
            j = h["index"]
            if h["physics"] == "offset":
                q[j] += h["offset"]
        read = tau.copy()
        for h in hidden:
            j = h["index"]
            if h["physics"] == "gain":
                read[j] *= h["gain"]
            elif h["physics"] == "coupling":
                read[j] += h["ratio"] * tau[j + 1]
        # What would hardly show in any torque is not hidden.
        if k == 0 and hidden and not shows(model, paths[0], q, read, true, hidden):
            raise ValueError("the effect is too small")
        read += rng.normal(0, 1, tau.shape) * noise * level
        quantum = 2 * math.pi / 2**bits
        q = np.round(q / quantum) * quantum
        name = f"log-{k + 1}.csv"
        names.append(name)
        heading = ",".join(["t"] + [f"joint{j + 1}.position" for j in range(n)] + [f"joint{j + 1}.torque" for j in range(n)])
        np.savetxt(folder / name, np.column_stack([t, q.T, read.T]), delimiter=",", header=heading, comments="", fmt="%.8g")
    (folder / "arm.urdf").write_text(urdf(arm, damped, rubbing))
    bodies = "\n".join(f"joint{j + 1} = {arm['armature'][j] if geared[j] else 0:.9g}" for j in range(n))
    (folder / "arm.toml").write_text(f'name = "arm-{number}"\n[robot]\nfile = "arm.urdf"\n\n[bodies]\n{bodies}\n')
    (folder / "set.toml").write_text(f'model = "arm.toml"\nfit = {json.dumps(names[:3])}\nheld_out = {json.dumps(names[3:])}\n')
    truth_file.write_text(json.dumps(dict(null=null, hidden=hidden, kind=arm["kind"], joints=n), indent=1, default=float) + "\n")


def main():
    parser = argparse.ArgumentParser()
    parser.add_argument("out", type=Path)
    parser.add_argument("--seed", type=int, required=True)
    parser.add_argument("--count", type=int, default=48)
    parser.add_argument("--only", default=",".join(KINDS), help="physics that may be hidden, with commas between them")
    options = parser.parse_args()
    kinds = options.only.split(",")
    if wrong := [k for k in kinds if k not in KINDS]:
        parser.error(f"--only {wrong[0]}: known are {', '.join(KINDS)}")
    rng = np.random.default_rng(options.seed)
    truth = options.out / "truth"
    truth.mkdir(parents=True)
    nulls = max(options.count // 4, 1)
    plan = [["nothing"] if i % 2 else ["numbers"] for i in range(nulls)]
    for i in range(options.count - nulls):
        first = kinds[i % len(kinds)]
        second = [str(rng.choice([k for k in KINDS if k != first]))] if rng.random() < 0.25 and options.only == parser.get_default("only") else []
        plan.append([first] + second)
    rng.shuffle(plan)
    for number, kinds in enumerate(plan):
        for attempt in range(5):
            folder = options.out / "cases" / f"{number:02d}"
            own = np.random.default_rng([options.seed, number, attempt])
            try:
                case(own, folder, truth / f"{number:02d}.json", number, list(kinds))
                break
            except ValueError:
                if folder.exists():
                    for f in folder.iterdir():
                        f.unlink()
                    folder.rmdir()
    print(f"{len(plan)} arms in {options.out / 'cases'}")


if __name__ == "__main__":
    main()
