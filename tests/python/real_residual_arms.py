"""Draws arms of one to three joints whose torque holds hidden laws in the noise of real machines, and scores verdicts on them.

    python tests/python/real_residual_arms.py draw GENERATOR SOURCES OUT --seed S --n N [--joints 1,2,3]
    python tests/python/real_residual_arms.py score OUT VERDICTS

GENERATOR is `real_residual.py`, SOURCES its folder of real machines. OUT/cases/case-NNN holds what a user has: set.toml, arm.toml, arm.urdf and logs. OUT/truth holds what is
hidden; only `score` opens it, after the verdicts of VERDICTS/case-NNN/verdict.json are written.

Each joint moves along the recorded motion of a real machine. Its torque is that of the rigid links (MuJoCo's inverse dynamics), viscous friction, the hidden laws, and what the
usual laws leave of the real machine's torque, scattered until it goes with nothing. That noise keeps its ratio to the torque of its machine.
Classes: none 25 %, one law 60 %, two laws 15 %; the files' masses and viscous friction are off by up to 20 % in half of the cases.
"""
import argparse
import importlib.util
import json
import sys
from pathlib import Path

import numpy as np

LONGEST = 6000


def generator(path):
    spec = importlib.util.spec_from_file_location("real_residual", path)
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


def urdf(axes, masses, lengths, inertias):
    """A chain of rods; each swings about its own axis and hangs down at zero."""
    text = ['<robot name="arm">', '<link name="base"/>']
    for i, axis in enumerate(axes):
        parent = "base" if i == 0 else f"link{i}"
        at = 0.0 if i == 0 else -lengths[i - 1]
        # A rod that turns about the vertical stands off sideways, so that its inertia shows.
        com = f"{0.5 * lengths[i]} 0 0" if axis == (0, 0, 1) else f"0 0 {-0.5 * lengths[i]}"
        text.append(
            f'<joint name="joint{i + 1}" type="revolute"><parent link="{parent}"/><child link="link{i + 1}"/><origin xyz="0 0 {at}"/>'
            f'<axis xyz="{axis[0]} {axis[1]} {axis[2]}"/><limit lower="-6" upper="6" effort="1e9" velocity="1e3"/></joint>'
        )
        text.append(
            f'<link name="link{i + 1}"><inertial><origin xyz="{com}"/><mass value="{masses[i]:.6g}"/>'
            f'<inertia ixx="{inertias[i]:.6g}" iyy="{inertias[i]:.6g}" izz="{inertias[i]:.6g}" ixy="0" ixz="0" iyz="0"/></inertial></link>'
        )
    return "\n".join(text + ["</robot>"])


def rigid(xml, q, v, a):
    import mujoco

    model = mujoco.MjModel.from_xml_string(xml)
    model.opt.disableflags |= mujoco.mjtDisableBit.mjDSBL_CONTACT | mujoco.mjtDisableBit.mjDSBL_LIMIT
    data = mujoco.MjData(model)
    out = np.zeros_like(q)
    for i in range(len(q)):
        data.qpos[:], data.qvel[:], data.qacc[:] = q[i], v[i], a[i]
        mujoco.mj_inverse(model, data)
        out[i] = data.qfrc_inverse
    return out


def draw(options):
    real = generator(options.generator)
    rng = np.random.default_rng(options.seed)
    specs = json.loads((Path(options.sources) / "sources.json").read_text())
    machines = {name: real.source(str(Path(options.sources) / name), spec) for name, spec in specs.items()}
    counts = [int(n) for n in options.joints.split(",")]
    out = Path(options.out)
    for case in range(1, options.n + 1):
        n = int(rng.choice(counts))
        names = [str(x) for x in rng.choice(list(machines), n, replace=False)]
        logs = min(len(machines[name][0]) for name in names)
        length = min(min(len(machines[name][0][k][0]) for name in names for k in range(logs)), LONGEST)
        axes = [(0, 1, 0)] * n if rng.random() < 0.5 else [(0, 0, 1)] + [(0, 1, 0)] * (n - 1)
        masses = [2.0 * 0.6**i for i in range(n)]
        lengths = [0.3] * n
        inertias = [m * l * l / 12 for m, l in zip(masses, lengths)]
        ts = specs[names[0]]["ts"]
        ranges = [max(np.ptp(np.concatenate([x[0] for x in machines[name][0]])), 1e-9) for name in names]
        scale = [float(rng.uniform(0.8, 2.0)) / r for r in ranges]
        true = urdf(axes, masses, lengths, inertias)
        motions, torques = [], []
        for k in range(logs):
            parts = [machines[name][0][k] for name in names]
            # All joints at the rate of the first one's machine.
            rate = [specs[name]["ts"] / ts for name in names]
            q, v, a = (np.column_stack([s * r**o * p[o][:length] for p, s, r in zip(parts, scale, rate)]) for o in range(3))
            motions.append((q, v, a))
            torques.append(rigid(true, q, v, a))
        damping, noise_rms, noises = [], [], [np.zeros_like(t) for t in torques]
        for j, name in enumerate(names):
            recs, p = machines[name]
            usual = np.concatenate([abs(p[0]) * x[2] + p[1] * x[1] for x in recs])
            residual = np.concatenate([x[3] for x in recs])
            ratio = np.sqrt(np.mean(residual**2)) / max(np.sqrt(np.mean(usual**2)), 1e-300)
            own = np.sqrt(np.mean(np.concatenate([t[:, j] for t in torques]) ** 2))
            speed = np.sqrt(np.mean(np.concatenate([m[1][:, j] for m in motions]) ** 2))
            damping.append(float(rng.uniform(0.05, 0.4) * own / speed))
            size = float(min(ratio, 0.5) * own)
            noise_rms.append(size)
            for k in range(logs):
                qf, vf, af, res = (x[:length] for x in recs[k])
                y = real.scattered(rng, res, qf, vf, af)[1]
                noises[k][:, j] = y * size / max(np.sqrt(np.mean(y**2)), 1e-300)
        kind = str(rng.choice(["none", "single", "double"], p=[0.25, 0.6, 0.15]))
        laws = [] if kind == "none" else [str(x) for x in rng.choice(list(real.FAMILY), 1 if kind == "single" else 2, replace=False)]
        effects, hidden = [], [np.zeros_like(t) for t in torques]
        for law in laws:
            j = int(rng.integers(n))
            if any(e["joint"] == j + 1 and e["family"] == real.FAMILY[law] for e in effects):
                continue
            q, v, a = (np.concatenate([m[o][:, j] for m in motions]) for o in range(3))
            turn = max(np.quantile(abs(v), 0.9) * 0.01, 1e-9)
            whole, numbers = real.law(law, rng, q, v, a, float(np.exp(rng.uniform(0, np.log(5.0)))) * noise_rms[j], turn)
            for k in range(logs):
                hidden[k][:, j] += whole[k * length : (k + 1) * length]
            effects.append(dict(physics=law, family=real.FAMILY[law], joint=j + 1, parameters={key: float(x) for key, x in numbers.items()}))
        off = lambda: 1 + rng.uniform(-0.2, 0.2) if rng.random() < 0.5 else 1.0
        factor = [off() for _ in range(n)]
        folder = out / "cases" / f"case-{case:03d}"
        folder.mkdir(parents=True, exist_ok=True)
        (folder / "arm.urdf").write_text(urdf(axes, [m * f for m, f in zip(masses, factor)], lengths, [i * f for i, f in zip(inertias, factor)]))
        elements = "".join(
            f'[[elements]]\nname = "viscous{j + 1}"\nkind = "damper"\nbetween = ["joint{j + 1}", "ground"]\ndamping = {d * off():.5g}\n'
            for j, d in enumerate(damping)
        )
        (folder / "arm.toml").write_text(f'name = "arm"\n[robot]\nfile = "arm.urdf"\n{elements}')
        files = []
        for k, (q, v, _) in enumerate(motions):
            step = np.array([s * specs[name].get("step", 1e-4) for s, name in zip(scale, names)])
            torque = torques[k] + v * np.array(damping) + hidden[k] + noises[k]
            head = ",".join(["t"] + [f"pos{j + 1},tau{j + 1}" for j in range(n)])
            columns = [np.arange(length) * ts] + [c for j in range(n) for c in (np.round(q[:, j] / step[j]) * step[j], torque[:, j])]
            files.append(f"{chr(97 + k)}.csv")
            np.savetxt(folder / files[-1], np.column_stack(columns), delimiter=",", header=head, comments="", fmt=["%.5f"] + ["%.7g", "%.6g"] * n)
        held = files[-max(1, len(files) // 3) :]
        text = f"model = \"arm.toml\"\nfit = {json.dumps([f for f in files if f not in held])}\nheld_out = {json.dumps(held)}\n"
        text += "".join(f'[joints.joint{j + 1}]\nposition = "pos{j + 1}"\ntorque = "tau{j + 1}"\n' for j in range(n))
        (folder / "set.toml").write_text(text)
        truth = out / "truth" / f"case-{case:03d}.json"
        truth.parent.mkdir(parents=True, exist_ok=True)
        truth.write_text(json.dumps(dict(joints=n, sources=names, effects=effects, damping=damping, factor=factor, noise=noise_rms), indent=1))
        print(f"case-{case:03d} {'+'.join(names):24s} {'+'.join(e['physics'] + '@' + str(e['joint']) for e in effects) or '-'}")


# The same force under other names, beside those of the generator's scorer; for an arm, dry friction and a constant are what friction by direction is.
KIN = {
    "friction": {"coulomb", "asymmetric_coulomb", "stribeck", "dahl", "load_friction", "friction_deficit", "hysteretic_spring"},
    "viscous": {"quadratic_drag", "damper", "asymmetric_damper"},
    "position": {"cogging"},
    "constant": {"bias", "offset"},
    "elastic": {"spring", "cubic_spring"},
}
ALIKE = {
    "asymmetric_coulomb": [{"coulomb", "bias"}],
    "stribeck": [{"friction_deficit"}],
    "bias": [{"offset"}],
}


def place(finding):
    if "signal" in finding:
        return finding["signal"].split(".")[0]
    return finding["between"][0]


def score(options):
    n = dict(none=0, alarms=0, effects=0, law=0, kind=0, sure=0, sure_right=0, kind_sure=0, kind_right=0, other=0, missing=0)
    for path in sorted((Path(options.out) / "truth").glob("case-*.json")):
        truth, case = json.loads(path.read_text()), path.stem
        file = Path(options.verdicts) / case / "verdict.json"
        if not file.exists():
            n["missing"] += 1
            continue
        verdict = json.loads(file.read_text())
        found = [(f["physics"], place(f), f["confidence"], f.get("family_confidence") or f["confidence"]) for f in verdict["findings"]]
        right, kinds = set(), set()
        for e in truth["effects"]:
            joint = f"joint{e['joint']}"
            names = {p for p, at, _, _ in found if at == joint}
            alike = next((other for other in ALIKE.get(e["physics"], []) if other <= names), set())
            n["effects"] += 1
            n["law"] += e["physics"] in names or bool(alike)
            n["kind"] += bool((KIN[e["family"]] | alike) & names)
            right |= {(name, joint) for name in {e["physics"]} | alike}
            kinds |= {(name, joint) for name in KIN[e["family"]] | alike}
        if not truth["effects"]:
            n["none"] += 1
            n["alarms"] += any(c >= 0.5 for _, _, c, _ in found)
        for name, at, c, kind in found:
            n["other"] += (name, at) not in kinds
            if c >= 0.9:
                n["sure"] += 1
                n["sure_right"] += (name, at) in right
            if kind >= 0.9:
                n["kind_sure"] += 1
                n["kind_right"] += (name, at) in kinds
        hidden = [f"{e['physics']}@{e['joint']}" for e in truth["effects"]]
        print(case, "+".join(truth["sources"]), hidden, "->", [(p, at, round(c, 2)) for p, at, c, _ in found])
    share = lambda a, b: f"{n[a]} of {n[b]}" + (f" ({100 * n[a] / n[b]:.0f} %)" if n[b] else "")
    print(f"nulls with a finding of 0.5 and more: {share('alarms', 'none')}")
    print(f"effects by their law at their joint: {share('law', 'effects')}; by their kind: {share('kind', 'effects')}")
    print(f"findings of another kind or joint: {n['other']}; law at 0.9 and more, right: {share('sure_right', 'sure')}; kind: {share('kind_right', 'kind_sure')}")
    print(f"no verdict: {n['missing']}")


def main():
    parser = argparse.ArgumentParser()
    verbs = parser.add_subparsers(required=True)
    one = verbs.add_parser("draw")
    for name in ["generator", "sources", "out"]:
        one.add_argument(name)
    one.add_argument("--seed", type=int, required=True)
    one.add_argument("--n", type=int, required=True)
    one.add_argument("--joints", default="1,2,3")
    one.set_defaults(work=draw)
    other = verbs.add_parser("score")
    for name in ["out", "verdicts"]:
        other.add_argument(name)
    other.set_defaults(work=score)
    options = parser.parse_args()
    options.work(options)


if __name__ == "__main__":
    sys.exit(main())
