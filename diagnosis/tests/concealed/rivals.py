"""Pairs of rival explanations, and whether the experiment that a verdict proposes tells them apart: see README.md.

    python rivals.py draw OUT --count 50 --seed 1
    python rivals.py run OUT VERDICTS [--program PROGRAM] [--play PROGRAM] [--pattern 'case-0*'] [-- ARGUMENTS FOR THE PROGRAM]
    python rivals.py score OUT VERDICTS

`draw` writes OUT/cases (nominal model, set, recordings) and OUT/truth. `run` diagnoses each case, plays the experiment that the verdict proposes on the hidden device,
adds the recordings to a copy of the case and diagnoses that. `score` opens the truth, once all verdicts are written.
Cases that have their verdicts are not diagnosed again.
"""
import argparse
import copy
import csv
import glob
import json
import os
import shutil
import subprocess
import sys

import numpy as np
from scipy.optimize import least_squares

import stepper
from bench import numbers_of, rounded
from effects import right_answers
from excitation import log_uniform
from families import r4, wrong_numbers
from measure import WORKSPACE, diagnose, named, read, verdict
from pairs import HIDDEN, KINDS, NESTED, SIGNALS, WEIGHTS, Draw, numbers, put

ROOT = os.path.join(WORKSPACE, "..", "shared", "concealed")
FIT, HELD = 2, 1           # recordings of a case
NEAR = (0.4, 2.0)          # standard deviations between the rivals over all recordings together
SEEN = 25.0                # standard deviations between the device and the best that the nominal structure can do, at least
LEVELS = (1e-3, 0.7)      # noise over the standard deviation of the signal


class Redraw(Exception):
    """This device does not serve; another is drawn."""


def core_of(simulator):
    sys.path.insert(0, simulator)
    import core
    return core


class Plant:
    """A device that can be played."""

    def __init__(self, core, model, ts):
        self.core, self.model, self.ts = core, model, ts

    def play(self, inputs, model=None, outputs=None, rough=False):
        """The outputs of the device, or of a model; `rough`: with steps that serve to compare two models that are simulated alike."""
        model, n = model or self.model, len(next(iter(inputs.values())))
        if stepper.needed(model):
            return stepper.simulate(model, inputs, self.ts, n, outputs=outputs)[0]
        steps = min(self.core.substeps(model, self.ts, True), max(8, self.core.substeps(model, self.ts, False))) if rough else None
        return self.core.simulate(model, inputs, self.ts, n, nsub=steps, outputs=outputs)[0]


def record(plant, inputs, sigma, rng, resolution=None):
    y = plant.play(inputs)
    return rounded(y + rng.standard_normal(y.shape) * np.asarray(sigma))


def changed(base, effect, logs):
    """The device and its effect with their numbers multiplied by exp(logs): those of the device first."""
    which = numbers_of(base)
    m, by_name = copy.deepcopy(base), {}
    by_name = {e["name"]: e for e in m["elements"]}
    for (section, name, key), q in zip(which, np.exp(logs)):
        if section == "bodies":
            m["bodies"][name] *= q
        else:
            by_name[name][key] *= q
    if effect is None:
        return m
    free = [k for k in effect["numbers"] if effect["numbers"][k] != 0.0]
    new = dict(effect["numbers"], **{k: effect["numbers"][k] * q for k, q in zip(free, np.exp(logs[len(which):]))})
    return put(m, dict(effect, numbers=new))


def imitate(plant, base, effect, plays, wanted, scale, evaluations=15):
    """How far a rival stays away from a device at best, with all numbers free: root of the summed squares in units of `scale`, and the rival so. Twice, the second time
    from where its numbers are half as large."""
    count = len(numbers_of(base)) + (len([v for v in effect["numbers"].values() if v]) if effect else 0)
    target = np.concatenate([(y / scale).ravel() for y in wanted])

    def f(q):
        try:
            return np.concatenate([(plant.play(u, changed(base, effect, q), rough=True) / scale).ravel() for u in plays]) - target
        except plant.core.SimError:
            return np.full(len(target), 1e3)

    best = None
    for start in (0.0, -0.5) if effect else (0.0,):
        x0 = np.zeros(count)
        x0[len(numbers_of(base)):] = start
        found = least_squares(f, x0, bounds=(-6, 6), diff_step=1e-4, max_nfev=evaluations, x_scale="jac", ftol=1e-5, xtol=1e-5)
        best = found if best is None or found.cost < best.cost else best
    return float(np.sqrt(2 * best.cost)), best.x


def sized(plant, base, kind, place, force, plays, rng):
    """An effect whose force is about so large in the motion that it allows itself."""
    seed = rng.integers(2**62)
    if isinstance(place, str):
        return None
    outs = [dict(name=k, kind=k, of=place[0]) for k in ("position", "velocity")]
    effect = dict(kind=kind, place=place, numbers=None)
    x, v = plant.play(plays[0], base, outs, True).T
    for _ in range(4):
        effect["numbers"] = {k: r4(q) for k, q in numbers(kind, force, x, v, np.random.default_rng(seed)).items()}
        x, v = plant.play(plays[0], put(base, effect), outs, True).T
    return effect


def signal_pair(kinds, plays, ts, size, peak):
    """Two effects on the drive that do the same as far as the recordings go."""
    tau = size / (1.0 / (110 * ts))
    value = dict(delay=tau, bandwidth=1 / (2 * np.pi * tau), gain=size, saturation=size * peak)
    return [dict(kind=k, place=p, numbers={k: r4(value[k])}) for k, p in kinds]


def make(core, kind, rng):
    d = Draw(rng, kind)
    base, kinds, plays, ts, sizes = KINDS[kind](d)
    plays = [dict(drive=rounded(u)) for u in plays]
    plant = Plant(core, base, ts)
    size = rng.uniform(*sizes)
    order = [kinds[i] for i in rng.permutation(len(kinds))[:2]]
    order.sort(key=lambda q: q[0] != HIDDEN.get(kind, q[0]))
    if kind == "one-force":
        damper = sized(plant, base, "damper", ("carriage", "ground"), size * d.amplitude, plays, rng)
        both = {"damper": damper, "back_emf": dict(kind="back_emf", place="drive", numbers=dict(back_emf=damper["numbers"]["damping"]))}
        hidden, rival = (both[k] for k, _ in order)
    elif isinstance(order[0][1], str):
        hidden, rival = signal_pair(order, plays, ts, size, d.amplitude)
    else:
        hidden, rival = (sized(plant, base, k, p, size * d.amplitude, plays, rng) for k, p in order)
    # Of two laws of which one contains the other, the noise is such that the richer one would just not show.
    rich = next((e for e in (hidden, rival) if e["kind"] in NESTED), hidden)
    poor = rival if rich is hidden else hidden
    clean = [plant.play(u, put(base, rich), rough=True) for u in plays]
    std = np.mean([np.std(y, axis=0) for y in clean], axis=0)
    apart, _ = imitate(plant, base, poor, plays, clean, std)
    level = float(np.clip(apart / rng.uniform(*NEAR), log_uniform(rng, LEVELS[0], 5 * LEVELS[0]), None))
    clean = [plant.play(u, put(base, hidden), rough=True) for u in plays]
    missed, _ = imitate(plant, base, None, plays, clean, std)
    if level > LEVELS[1] or missed / level < SEEN:
        raise Redraw("%s: noise %.2g, rivals %.2f, missed %.1f" % (kind, level, apart / level, missed / level))
    sigma = [r4(level * s) for s in std]
    nominal = wrong_numbers(base, rng) if rng.random() < 0.5 else copy.deepcopy(base)
    truth = put(base, hidden)
    hide = Plant(core, truth, ts)
    recorded = [record(hide, u, sigma, rng) for u in plays]
    answer = right_answers(hidden["kind"], hidden["place"], hidden["numbers"], base)
    return dict(kind=kind, ts=ts, base=base, nominal=nominal, truth=truth, hidden=hidden, rival=rival, plays=plays, recorded=recorded, sigma=sigma,
                apart=apart / level, missed=missed / level, answer=answer)


def write_csv(path, ts, inputs, y, outputs):
    head = ",".join(["t"] + list(inputs) + outputs)
    table = np.column_stack([np.arange(len(y)) * ts] + list(inputs.values()) + [y])
    np.savetxt(path, table, fmt=["%.10g"] + ["%.7g"] * (table.shape[1] - 1), delimiter=",", header=head, comments="")


def write_set(folder, fit, held):
    quoted = ["[%s]" % ", ".join('"%s"' % f for f in part) for part in (fit, held)]
    with open(os.path.join(folder, "set.toml"), "w") as f:
        f.write('model    = "model.toml"\nfit      = %s\nheld_out = %s\ninitial  = "rest"\n' % tuple(quoted))


def write(core, out, name, case, seed):
    folder = os.path.join(out, "cases", name)
    os.makedirs(folder, exist_ok=True)
    with open(os.path.join(folder, "model.toml"), "w") as f:
        f.write(core.dump_model(case["nominal"]))
    files = ["%s.csv" % n for n in ("first", "second", "third")]
    outputs = [o["name"] for o in case["nominal"]["outputs"]]
    for file, U, y in zip(files, case["plays"], case["recorded"]):
        write_csv(os.path.join(folder, file), case["ts"], U, y, outputs)
    write_set(folder, files[:FIT], files[FIT:])
    keep = {k: case[k] for k in ("kind", "ts", "base", "truth", "hidden", "rival", "sigma", "apart", "missed", "answer")}
    with open(os.path.join(out, "truth", name + ".json"), "w") as f:
        json.dump(dict(keep, case=name, seed=int(seed)), f, indent=1)


def draw(o):
    core = core_of(o.simulator)
    rng = np.random.default_rng(o.seed)
    names = o.kind or list(KINDS)
    share = np.array([WEIGHTS.get(k, 1.0) for k in names])
    # As many of each as its share says, the rest by chance; in any order.
    whole = np.floor(share / share.sum() * o.count).astype(int)
    kinds = [k for k, n in zip(names, whole) for _ in range(n)]
    kinds += [str(k) for k in rng.choice(names, o.count - len(kinds), p=share / share.sum())]
    kinds = [kinds[i] for i in rng.permutation(len(kinds))]
    for d in ("cases", "truth"):
        os.makedirs(os.path.join(o.out, d), exist_ok=True)
    for i, (kind, seed) in enumerate(zip(kinds, rng.integers(2**62, size=o.count))):
        name, why, seeds = "case-%03d" % (i + 1), [], np.random.default_rng(seed)
        if os.path.exists(os.path.join(o.out, "truth", name + ".json")):
            continue
        for tried in range(120):
            if tried == 30:                            # a kind that will not be drawn makes room for another
                kind = str(seeds.choice([k for k in names if k != kind] or names))
            try:
                case = make(core, kind, np.random.default_rng(seeds.integers(2**62)))
            except (Redraw, core.SimError, FloatingPointError, np.linalg.LinAlgError) as e:
                why.append(str(e))
                continue
            write(core, o.out, name, case, seed)
            print("%s %-16s %-28s beside %-28s apart %5.2f missed %7.1f noise %.4f  %d redrawn" % (
                name, kind, named(case["answer"]), said_of(case["rival"]), case["apart"], case["missed"],
                case["sigma"][0], len(why)), flush=True)
            break
        else:
            print(name, kind, "FAILED:", why[-3:], flush=True)


def said_of(effect):
    return "%s@%s" % (effect["kind"], effect["place"] if isinstance(effect["place"], str) else "-".join(effect["place"]))


def built(example):
    subprocess.run(["cargo", "build", "--release", "--locked", "-p", "backdrive-diagnosis", "--example", example], cwd=WORKSPACE, check=True)
    return os.path.join(os.environ.get("CARGO_TARGET_DIR", os.path.join(WORKSPACE, "target")), "release", "examples", example)


def experiment(core, o, name, said):
    """The proposed experiment, played on the hidden device: the case with its recordings. None where there is nothing to play."""
    plan = said.get("next_experiment") or {}
    if "file" not in plan:
        return None
    sensor, rate = plan.get("sensor"), plan["rate_hz"]
    device = read(os.path.join(o.out, "truth", name + ".json"))
    first, folder = os.path.join(o.out, "cases", name), os.path.join(o.verdicts, name, "with-experiment")
    shutil.rmtree(folder, ignore_errors=True)
    shutil.copytree(first, folder)
    samples = os.path.join(o.verdicts, name, "played.csv")
    subprocess.run([o.play, os.path.join(o.verdicts, name, plan["file"]), "--rate", repr(rate), "--out", samples], check=True)
    table = core.read_csv(samples)
    inputs = {q["name"]: rounded(table.get(q["name"], np.zeros(len(table["t"])))) for q in device["truth"]["inputs"]}
    truth, sigma = device["truth"], list(device["sigma"])
    if sensor:
        nominal = core.load_model(os.path.join(folder, "model.toml"))
        added = dict(name="further", kind=sensor["kind"], **({"element": sensor["element"]} if "element" in sensor else {"of": sensor["of"]}))
        for m in (nominal, truth):
            m["outputs"].append(added)
        with open(os.path.join(folder, "model.toml"), "w") as f:
            f.write(core.dump_model(nominal))
        sigma.append(sensor["noise_sd"])
    plant = Plant(core, truth, 1.0 / rate)
    repeats = plan["repeats"]
    rng = np.random.default_rng([device["seed"] % 2**32, 7])
    files = ["next-%d.csv" % (i + 1) for i in range(repeats + 1)]
    for file in files:
        y = record(plant, inputs, sigma, rng)
        write_csv(os.path.join(folder, file), plant.ts, inputs, y, [q["name"] for q in truth["outputs"]])
    write_set(folder, ["first.csv", "second.csv"] + files[:-1], ["third.csv", files[-1]])
    return folder


def run(o):
    core = core_of(o.simulator)
    for case in sorted(glob.glob(os.path.join(o.out, "cases", o.pattern))):
        name = os.path.basename(case)
        out = os.path.join(o.verdicts, name)
        if verdict(os.path.join(out, "second")) or "file" not in ((verdict(out) or {}).get("next_experiment") or {"file": 0}):
            continue                                   # a run that was stopped goes on
        seconds = diagnose(o.program, case, out, o.more)
        said = verdict(out)
        folder = said and experiment(core, o, name, said)
        again = diagnose(o.program, folder, os.path.join(out, "second"), o.more) if folder else 0.0
        words = [(v or {}).get("verdict", "-") for v in (said, verdict(os.path.join(out, "second")))]
        print("%s %-16s then %-16s %.1f s and %.1f s" % (name, *words, seconds, again), flush=True)


def is_right(finding, answer):
    place = lambda q: q.get("signal") or frozenset(q["between"])
    for a in answer["accept"]:
        if finding["physics"] in a["physics"] and (place(finding) == place(a) or finding.get("signal") in answer.get("signal_any", [])):
            return True
    return False


def judged(said, answer):
    """What a verdict is: right, ambiguous (with the truth among its explanations or without), cannot_tell, boldly wrong, wrong."""
    if said is None:
        return "failed"
    findings, word = said.get("findings") or [], said["verdict"]
    if word in ("ambiguous", "cannot_tell"):
        every = findings[:1] + [a for f in findings[:1] for a in f.get("alternatives", [])]
        return word if word == "cannot_tell" or any(is_right(f, answer) for f in every) else "ambiguous without it"
    if word == "missing":
        good = [f for f in findings if is_right(f, answer)]
        bold = [f for f in findings if f not in good and f["confidence"] >= 0.5]
        return "right" if good and not bold else "boldly wrong" if bold else "wrong"
    return "boldly wrong" if word in ("parameters", "nothing_missing") else word


def score(o):
    core = core_of(o.simulator)
    rows, firsts, lasts, kinds, separations = [], {}, {}, {}, []
    for path in sorted(glob.glob(os.path.join(o.out, "truth", o.pattern + ".json"))):
        device = read(path)
        name, answer = device["case"], device["answer"]
        first, second = verdict(os.path.join(o.verdicts, name)), verdict(os.path.join(o.verdicts, name, "second"))
        if first is None:
            continue
        a, b = judged(first, answer), judged(second if second else first, answer)
        plan = first.get("next_experiment") or {}
        predicted = (plan.get("separation_sd") or 0) * (plan.get("repeats") or 1) ** 0.5
        real = None
        samples = os.path.join(o.verdicts, name, "played.csv")
        if first["verdict"] == "ambiguous" and "sensor" not in plan and os.path.exists(samples) and not o.quick:
            real = separation(core, o, device, name, samples, plan)
            separations.append((predicted, real))
        firsts[a], lasts[b] = firsts.get(a, 0) + 1, lasts.get(b, 0) + 1
        kinds.setdefault(device["kind"], []).append((a, b))
        of = lambda v: "+".join("%s %.2f" % (named(f), f.get("confidence", 1)) for f in (v or {}).get("findings", [])[:2]) or "-"
        rows.append((name, device["kind"], named(answer), a, b))
        print("%s %-16s %-26s beside %-26s first %-20s %-52s then %-14s %-52s predicted %s real %s" % (
            name, device["kind"], named(answer), said_of(device["rival"]), a, of(first), b, of(second), "%.1f" % predicted, "-" if real is None else "%.1f" % real))
    print("\n| kind | pairs | first ambiguous or cannot_tell | first right | first boldly wrong | right after the experiment |\n|---|---|---|---|---|---|")
    for kind in sorted(kinds):
        each = kinds[kind]
        count = lambda which, *words: sum(1 for q in each if q[which] in words)
        print("| %s | %d | %d | %d | %d | %d |" % (kind, len(each), count(0, "ambiguous", "cannot_tell", "ambiguous without it"), count(0, "right"), count(0, "boldly wrong"), count(1, "right")))
    print("\nfirst:", firsts, "\nafter the experiment:", lasts)
    total = sum(lasts.values())
    print("right after the experiment %d of %d (%.0f %%)" % (lasts.get("right", 0), total, 100 * lasts.get("right", 0) / max(total, 1)))
    if separations:
        held = sum(1 for p, r in separations if r >= 5.0)
        ratio = sorted(r / p for p, r in separations if p)
        print("experiments of ambiguous verdicts: %d; the other explanation is 5 standard deviations and more away on the device in %d; real over predicted: median %.2f, from %.2f to %.2f"
              % (len(separations), held, ratio[len(ratio) // 2] if ratio else 0, ratio[0] if ratio else 0, ratio[-1] if ratio else 0))


def separation(core, o, device, name, samples, plan):
    """How far the rival that is not there stays from the hidden device in the first recordings and the experiment together, all its numbers free, beyond how far it is in the
    first alone: standard deviations."""
    plant = Plant(core, device["truth"], device["ts"])
    case = os.path.join(o.out, "cases", name)
    names = [q["name"] for q in device["base"]["inputs"]]
    old = [{n: core.read_csv(os.path.join(case, f))[n] for n in names} for f in ("first.csv", "second.csv", "third.csv")]
    table = core.read_csv(samples)
    new = {n: rounded(table.get(n, np.zeros(len(table["t"])))) for n in names}
    plays, rival = old[:FIT] + [new], device["rival"]
    wanted = [plant.play(u, rough=True) for u in plays]
    scale = np.array(device["sigma"][: wanted[0].shape[1]])
    before, _ = imitate(plant, device["base"], rival, plays[:FIT], wanted[:FIT], scale)
    after, _ = imitate(plant, device["base"], rival, plays, wanted, scale)
    return float(np.sqrt(max(after**2 - before**2, 0.0) * (plan.get("repeats") or 1)))


def main():
    a = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    a.add_argument("--simulator", default=ROOT, help="folder of core.py and sim.c")
    parts = a.add_subparsers(dest="do", required=True)
    p = parts.add_parser("draw")
    p.add_argument("out")
    p.add_argument("--count", type=int, default=50)
    p.add_argument("--seed", type=int, default=1)
    p.add_argument("--kind", action="append", choices=list(KINDS), help="only this kind of pair; may be given several times")
    for do in ("run", "score"):
        p = parts.add_parser(do)
        p.add_argument("out")
        p.add_argument("verdicts")
        p.add_argument("--pattern", default="*")
        p.add_argument("--program")
        p.add_argument("--play")
        p.add_argument("--quick", action="store_true", help="without the separation on the hidden device")
    own, more = sys.argv[1:], []
    if "--" in own:
        at = own.index("--")
        own, more = own[:at], own[at + 1:]
    o = a.parse_args(own)
    o.more, o.simulator = more, os.path.abspath(o.simulator)
    if not os.path.exists(os.path.join(o.simulator, "core.py")):
        print("no simulator in %s: nothing is done" % o.simulator)
        return
    if o.do == "run":
        o.program, o.play = o.program or built("diagnose"), o.play or built("play")
    {"draw": draw, "run": run, "score": score}[o.do](o)


if __name__ == "__main__":
    main()
