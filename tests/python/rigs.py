"""Draws the commonest rig there is, a motor with a gear and a load of which only current and motor angle are recorded, and scores verdicts on it.

    python tests/python/rigs.py draw OUT --seed S --n N
    python tests/python/rigs.py score OUT VERDICTS

OUT/cases/rig-NNN holds what a user has: five recordings, model.toml and set.toml. OUT/truth holds what is hidden; only `score` opens it, after
VERDICTS/rig-NNN/verdict.json are written.

Hidden are two or three of: dry friction at the motor, dry friction at the load, play of the gear, compliance of the shaft, cogging of the motor. A rig with play or
compliance has a load behind it. The nominal model is the true linear device, or (every other rig) one body as `backdrive init` writes it.
The simulator is independent of the project's: semi-implicit Euler at 20 us, dry friction by its exact resolvent, the gear as a one-sided spring with a loss.
"""
import argparse
import json
import math
import sys
from pathlib import Path

import numpy as np

RATE, STEP, SECONDS = 500, 2e-5, 8.0
RECORDS = ["chirp", "ramps", "multisine", "steps", "held_out"]
SETS = [
    ("friction", "play"), ("friction", "compliance"), ("friction", "cogging"), ("play", "cogging"), ("compliance", "cogging"),
    ("friction", "play", "load_friction"), ("friction", "play", "cogging"), ("friction", "compliance", "cogging"), ("play", "load_friction"),
    ("friction", "compliance", "load_friction"),
]
ENCODER = 2 * math.pi / 4096


def drawn(rng, index):
    inertia = 10 ** rng.uniform(-4.5, -2.5)
    # A speed scale of 10 to 40 rad/s and the torque that swings the motor so.
    rig = dict(inertia=inertia, ratio=rng.uniform(0.5, 4.0), speed=rng.uniform(8, 25), effects=list(SETS[index % len(SETS)]), one_body=index % 2 == 1)
    total = inertia * (1 + (rig["ratio"] if needs_load(rig) else 0.0))
    torque = total * rig["speed"] * 2 * math.pi * 1.5
    rig.update(torque=torque, damping=total * rng.uniform(0.3, 1.5), share=rng.uniform(0.2, 0.8))
    has = rig["effects"]
    load = inertia * rig["ratio"]
    rig["friction"] = torque * rng.uniform(0.06, 0.25) if "friction" in has else 0.0
    rig["load_friction"] = torque * rng.uniform(0.06, 0.2) if "load_friction" in has else 0.0
    rig["cogging"] = torque * rng.uniform(0.05, 0.2) if "cogging" in has else 0.0
    rig["poles"], rig["phase"] = int(rng.integers(6, 25)), rng.uniform(0, 2 * math.pi)
    rig["gap"] = math.radians(rng.uniform(0.5, 4.0)) if "play" in has else 0.0
    both = inertia * load / (inertia + load)
    # A shaft gives way at 6 to 25 Hz with the load held free; a gear's teeth at 80 to 200 Hz.
    hz = rng.uniform(6, 25) if "compliance" in has else rng.uniform(80, 200)
    rig["stiffness"] = both * (2 * math.pi * hz) ** 2
    rig["loss"] = 2 * (rng.uniform(0.02, 0.08) if "compliance" in has else rng.uniform(0.1, 0.4)) * math.sqrt(rig["stiffness"] * both)
    rig["amps"] = torque / rng.uniform(1.0, 5.0)
    return rig


def needs_load(rig):
    return any(e in rig["effects"] for e in ("play", "compliance", "load_friction"))


def excitation(rng, name, t, rig):
    """Torque commands, N m, held from sample to sample."""
    if name == "chirp":
        f0, f1 = 0.3, 12.0
        rate = math.log(f1 / f0) / SECONDS
        u = np.cos(2 * math.pi * f0 / rate * (np.exp(rate * t) - 1)) * np.linspace(0.5, 1.0, len(t))
    elif name == "ramps":
        hz = rng.uniform(0.25, 0.5)
        u = 0.8 * (2 / math.pi) * np.arcsin(np.cos(2 * math.pi * hz * t))
    elif name == "steps":
        # Each step is taken back, so that the motor does not run away.
        every = int(0.2 * RATE)
        levels = [x for size in rng.uniform(-0.9, 0.9, size=len(t) // (4 * every) + 1) for x in (size, -size, -size, size)]
        u = np.repeat(levels, every)[: len(t)]
    else:
        lines = np.arange(2, 60) / SECONDS * 2
        phases = rng.uniform(0, 2 * math.pi, len(lines))
        u = np.sum(np.sin(2 * math.pi * lines[:, None] * t + phases[:, None]) / np.sqrt(lines)[:, None], axis=0)
        u *= 1.0 / np.max(np.abs(u))
    return u * rig["torque"]


def simulate(rigs, torque, step=STEP):
    """Motor angle at the samples, for all lanes at once: `torque` is (lanes, samples)."""
    col = lambda key: np.array([rig[key] for rig in rigs])
    jm, ratio = col("inertia"), col("ratio")
    loaded = np.array([needs_load(rig) for rig in rigs])
    jl = np.where(loaded, jm * ratio, jm)
    k, b, half = np.where(loaded, col("stiffness"), 0.0), np.where(loaded, col("loss"), 0.0), 0.5 * col("gap")
    cm = np.where(loaded, col("damping") * col("share"), col("damping"))
    cl = np.where(loaded, col("damping") * (1 - col("share")), 0.0)
    fm, fl, cog, poles, phase = col("friction"), col("load_friction"), col("cogging"), col("poles"), col("phase")
    qm, vm, ql, vl = (np.zeros(len(rigs)) for _ in range(4))
    per = int(round(1 / RATE / step))
    out = np.empty_like(torque)

    def dry(v, force, inertia):
        return np.sign(v) * np.maximum(np.abs(v) - step * force / inertia, 0.0)

    for i in range(torque.shape[1]):
        out[:, i] = qm
        u = torque[:, i]
        for _ in range(per):
            x, rate = qm - ql, vm - vl
            deep = np.where(x > half, x - half, np.where(x < -half, x + half, 0.0))
            push = k * deep + np.where(deep != 0.0, b * rate, 0.0)
            push = np.where(deep > 0, np.maximum(push, 0.0), np.where(deep < 0, np.minimum(push, 0.0), 0.0)) if np.any(half > 0) else push
            # A shaft without play pulls and pushes, with its loss throughout.
            push = np.where(half > 0, push, k * x + b * rate)
            vm = dry(vm + step * (u - cm * vm - push - cog * np.sin(poles * qm + phase)) / jm, fm, jm)
            vl = dry(vl + step * (push - cl * vl) / jl, fl, jl)
            qm, ql = qm + step * vm, ql + step * vl
    return out


def model_text(rig, rng):
    jm, jl = rig["inertia"], rig["inertia"] * rig["ratio"]
    loaded, effects = needs_load(rig), rig["effects"]
    two = loaded and not rig["one_body"] and "compliance" not in effects
    off = (lambda: rng.uniform(0.7, 1.4)) if rig["one_body"] else (lambda: 1.0)
    text = f'name = "rig"\nmotion = "rotation"\n[bodies]\nmotor = {(jm if two else jm + (jl if loaded else 0.0)) * off():.4g}\n'
    if two:
        text += f"load = {jl:.4g}\n"
    damping = rig["damping"]
    parts = [("bearing", "motor", damping * (rig["share"] if two else 1.0) * off())] + ([("load_bearing", "load", damping * (1 - rig["share"]))] if two else [])
    for name, body, value in parts:
        text += f'[[elements]]\nname = "{name}"\nkind = "damper"\nbetween = ["{body}", "ground"]\ndamping = {value:.4g}\n'
    if two:
        text += f'[[elements]]\nname = "gear"\nkind = "spring"\nbetween = ["motor", "load"]\nstiffness = {rig["stiffness"]:.4g}\n'
        text += f'[[elements]]\nname = "gear_loss"\nkind = "damper"\nbetween = ["motor", "load"]\ndamping = {rig["loss"]:.4g}\n'
    text += '[[inputs]]\nname = "motor_torque"\nkind = "force"\non = "motor"\nhold = "zero"\n'
    text += f'[[outputs]]\nname = "angle"\nkind = "position"\nof = "motor"\nresolution = {ENCODER:.6g}\n'
    return text


SET = """model = "model.toml"
fit = ["chirp.csv", "ramps.csv", "multisine.csv", "steps.csv"]
held_out = ["held_out.csv"]
initial = "free"
[columns]
t = {{ column = "time (s)" }}
motor_torque = {{ column = "current_A", unit = "A", scale = {scale:.6g} }}
angle = {{ column = "angle_deg", unit = "deg" }}
"""


def draw(out, seed, n):
    rng = np.random.default_rng(seed)
    t = np.arange(int(SECONDS * RATE)) / RATE
    rigs = [drawn(rng, i) for i in range(n)]
    lanes = [(rig, name) for rig in rigs for name in RECORDS]
    torque = np.array([excitation(rng, name, t, rig) for rig, name in lanes])
    angle = simulate([rig for rig, _ in lanes], torque)
    for i, rig in enumerate(rigs):
        folder = out / "cases" / f"rig-{i:03d}"
        folder.mkdir(parents=True, exist_ok=True)
        (out / "truth").mkdir(exist_ok=True)
        (folder / "model.toml").write_text(model_text(rig, rng))
        (folder / "set.toml").write_text(SET.format(scale=rig["amps"]))
        for r, name in enumerate(RECORDS):
            lane = i * len(RECORDS) + r
            current = torque[lane] / rig["amps"] + rng.normal(0, 0.002 * rig["torque"] / rig["amps"], len(t))
            degrees = np.degrees(np.round(angle[lane] / ENCODER) * ENCODER)
            rows = [f"{a:.4f},{d:.4f},{c:.5f}" for a, d, c in zip(t, degrees, current)]
            (folder / f"{name}.csv").write_text("time (s),angle_deg,current_A\n" + "\n".join(rows) + "\n")
        (out / "truth" / f"rig-{i:03d}.json").write_text(json.dumps(rig))


KIND = {
    "friction": ("coulomb", "dahl", "lugre", "stribeck", "asymmetric_coulomb", "maxwell_slip", "preisach_lugre", "friction_deficit"),
    "play": ("backlash",), "compliance": ("series_compliance",), "cogging": ("cogging",),
}
KIND["load_friction"] = KIND["friction"]


def at_load(finding):
    """Whether a finding is between ground and something other than the motor."""
    between = finding.get("between") or []
    return "motor" not in between and "ground" in between


def is_named(effect, findings):
    def fits(f):
        if f["physics"] not in KIND[effect] or f.get("confidence", 0) < 0.5 and f.get("family_confidence", 0) < 0.5:
            return False
        return effect not in ("friction", "load_friction") or at_load(f) == (effect == "load_friction")

    return any(fits(f) for f in findings)


def score(out, verdicts):
    whole = worse = named = total = extra = sure = sure_right = 0
    for path in sorted((out / "truth").glob("*.json")):
        rig = json.loads(path.read_text())
        file = verdicts / path.stem / "verdict.json"
        if not file.exists():
            print(path.stem, "NO VERDICT", rig["effects"])
            continue
        verdict = json.loads(file.read_text())
        findings = verdict["findings"]
        hit = [e for e in rig["effects"] if is_named(e, findings)]
        other = [f["physics"] for f in findings if max(f.get("confidence", 0), f.get("family_confidence", 0)) >= 0.5 and not any(is_named(e, [f]) for e in rig["effects"])]
        for f in findings:
            if f.get("confidence", 0) >= 0.9:
                sure += 1
                sure_right += any(is_named(e, [f]) for e in rig["effects"])
        held = verdict.get("held_out") or {}
        before, refit, after = (held.get(k) for k in ("nrmse_before", "nrmse_refit", "nrmse_after"))
        is_worse = after is not None and before is not None and after > min(before, refit or before) * 1.02
        named, total, extra = named + len(hit), total + len(rig["effects"]), extra + len(other)
        whole, worse = whole + (len(hit) == len(rig["effects"])), worse + is_worse
        numbers = " ".join("-" if x is None else f"{x:.3f}" for x in (before, refit, after))
        print(path.stem, "one" if rig["one_body"] else "lin", "OK " if len(hit) == len(rig["effects"]) else "   ", ",".join(rig["effects"]), "| found",
              ",".join(f"{f['physics']}@{'-'.join(f.get('between') or [f.get('signal') or ''])}:{f.get('confidence', 0):.2f}/{f.get('family_confidence', 0):.2f}" for f in findings),
              "| held out", numbers, "WORSE" if is_worse else "", f"beside {other}" if other else "")
    n = len(list((out / "truth").glob("*.json")))
    print(f"all effects named: {whole} of {n}; effects {named} of {total}; beside {extra}; sure and right {sure_right} of {sure}; predicts worse {worse}")


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    commands = parser.add_subparsers(dest="command", required=True)
    one = commands.add_parser("draw")
    one.add_argument("out", type=Path)
    one.add_argument("--seed", type=int, required=True)
    one.add_argument("--n", type=int, default=30)
    two = commands.add_parser("score")
    two.add_argument("out", type=Path)
    two.add_argument("verdicts", type=Path)
    args = parser.parse_args()
    if args.command == "draw":
        draw(args.out, args.seed, args.n)
    else:
        score(args.out, args.verdicts)


if __name__ == "__main__":
    sys.exit(main())
