"""Draws diagnosis cases with a sealed truth from devices simulated by an independent simulator: see README.md."""
import argparse
import copy
import json
import os
import sys
import time
from multiprocessing import Pool

import numpy as np

import effects as fx
import stepper
from bench import FINE, Bench, numbers_of, rounded
from excitation import log_uniform
from families import FAMILIES, HAND, STAGES, draw_device, with_hand, wrong_numbers
from oracle import jacobian, left_over, predictions, retune, score

ROOT = os.path.abspath(os.path.join(os.path.dirname(os.path.abspath(__file__)), "..", "..", ".."))
SHARES = dict(single=0.58, double=0.25, none=0.05, parameters=0.05, outside=0.07)
EFFECTS = dict(single=1, double=2, triple=3, not_visible=1)
RIGHT = dict(none=["nothing_missing"], parameters=["parameters"], outside=["unexplained"], not_visible=["nothing_missing", "parameters", "cannot_tell"])
ORACLE_SAMPLES = 20000     # longer recordings are judged by a shorter one of the same device
MOST_STEPS = 400           # of the simulator in a sample interval
OPTIONS = ("snr", "samples", "wrong_hold", "six", "controlled", "effects", "least", "oracle", "stage", "torque_constant", "margin_range")
STAGE_WORDS = dict(hand="a hand that nobody measured pushes on the master", loop="a running teleoperation loop, with a measured hand",
                   clock="irregular sample times, and samples that are not there", velocity="velocities from differentiated encoders")


class Redraw(Exception):
    """This device or effect does not serve; another is drawn."""


def classes(which, count, rng):
    if which == "nulls":
        return ["none" if i % 2 == 0 else "parameters" for i in range(count)]
    if which != "mixed":
        return [which] * count
    out = [c for c, share in SHARES.items() for _ in range(round(share * count))]
    return list(rng.permutation((out + ["single"] * count)[:count]))


def pick_effects(model, n, rng, only=None, stage=None, numbers=True):
    """n effects of different kinds at different places; kinds are equally likely, then their places."""
    choice, out = fx.options(model, own=only or ()), []
    if n > 1 or not numbers:                       # beside others an added inertia is only a number that is off
        choice = [c for c in choice if c[0] != "inertia"]
    if stage == "hand":                            # nobody can tell what scales a hand that nobody measured
        choice = [c for c in choice if c[1] != HAND]
    if stage == "velocity":                        # a differentiated encoder has no offset, and a lag of its own
        choice = [c for c in choice if c[1] not in [o["name"] for o in model["outputs"]]]
    if stage == "loop":
        inputs = [q["name"] for q in model["inputs"]]
        choice = [c for c in choice if c[0] in stepper.FRICTION + stepper.OTHERS + ("damper",) or c[0] in ("delay", "gain") and c[1] in inputs]
    if only:
        choice = [c for c in choice if c[0] in only]
    while len(out) < n:
        left = [c for c in choice if all(c[0] != e["kind"] and c[1] != e["place"] for e in out)]
        if not left:
            raise Redraw("no place left")
        kind = rng.choice(sorted({c[0] for c in left}))
        places = [c[1] for c in left if c[0] == kind]
        place = places[rng.integers(len(places))]
        out.append(dict(kind=str(kind), place=place, seed=int(rng.integers(2**62)), size=log_uniform(rng, 0.05, 0.5)))
    return out


def outside_effect(model, rng):
    kind = str(rng.choice(fx.OUTSIDE))
    springs = [tuple(e["between"]) for e in model["elements"] if e["kind"] == "spring"]
    if kind == "tv_spring" and springs:
        place = springs[rng.integers(len(springs))]
    elif kind == "glitch":
        place = str(rng.choice([o["name"] for o in model["outputs"]]))
    else:
        kind, free = "disturbance", fx.free_bodies(model)[0]
        place = (str(rng.choice(free)), "ground")
    return dict(kind=kind, place=place, seed=int(rng.integers(2**62)), size=0.3)


def with_effects(model, chosen, stat):
    """The true model with all effects, those that split a joint last, and the numbers of each."""
    out, found = model, {}
    for i in sorted(range(len(chosen)), key=lambda i: chosen[i]["kind"] == "series_compliance"):
        if chosen[i]["kind"] != "glitch":
            out, found[i] = fx.add(out, chosen[i], stat)
        else:
            found[i] = {}
    return out, [found[i] for i in range(len(chosen))]


class Judge:
    """How visible an effect is, in noise floors, before and after a first-order re-tune of the nominal numbers."""

    def __init__(self, bench, base):
        self.bench, self.base = bench, base
        self.scale = bench.deviations()

    def difference(self, model, inputs, outputs):
        out = []
        for U, y in zip(inputs, outputs):
            out.append((self.bench.told(self.bench.predict(model, U, self.bench.steps(model)) - y) / self.scale)[::4].ravel())
        r = np.concatenate(out)
        return r / np.sqrt(len(r))

    def fit_runs(self, model, first=0):
        runs = [self.bench.run(model, i, fine=False) for i in range(first, self.bench.fit)]
        return [r[0] for r in runs], [r[1] for r in runs]

    def resize(self, e, stat, target):
        """Scale one effect until the model without it misses by about `target` floors."""
        low, high = fx.BOTTOM.get(e["kind"], 1e-4), fx.TOP.get(e["kind"], 100.0)
        for _ in range(5):
            inputs, y = self.fit_runs(fx.add(self.base, e, stat)[0], self.bench.fit - 2)
            d = float(np.linalg.norm(self.difference(self.base, inputs, y)))
            size = float(np.clip(e["size"] * np.clip(target / (d + 1e-9), 0.1, 8), low, high))
            if 0.6 * target < d < 1.6 * target or size == e["size"]:
                return
            e["size"] = size

    def missed(self, truth, chosen, stat):
        """How much of every effect is missed when the others are there and all other numbers are free, to first order; the same of all together;
        and where a refit of the nominal numbers may start: the logarithms of their changes."""
        inputs, y = self.fit_runs(truth)
        without = [with_effects(self.base, chosen[:i] + chosen[i + 1 :], stat)[0] for i in range(len(chosen))]
        at = self.base if len(chosen) == 1 else truth
        which = numbers_of(at)
        _, J = jacobian(self.bench, at, inputs, y, self.scale, self.bench.steps(at))
        each = []
        for m in without:
            known = set(numbers_of(m))
            each.append(left_over(self.difference(m, inputs, y), J[:, [w in known for w in which]]))
        nominal = numbers_of(self.base)
        J, off = J[:, [which.index(w) for w in nominal if w in which]], self.difference(self.base, inputs, y)
        start = np.zeros(len(nominal))
        start[[i for i, w in enumerate(nominal) if w in which]] = np.clip(np.linalg.lstsq(J, -off, rcond=1e-4)[0], -0.7, 0.7)
        return np.array(each), left_over(off, J), start


def glitches(recorded, effect, sigma, std, rng):
    """Bursts in which a sensor reports something else."""
    for y in recorded:
        for at in rng.integers(50, len(y) - 60, int(rng.integers(3, 9))):
            n = int(rng.integers(3, 40))
            y[at : at + n, effect["column"]] += rng.choice([-1, 1]) * rng.uniform(0.3, 2) * max(std, 20 * sigma) * rng.random(n)


def check_contact(bench, inputs):
    """Whether the slave of a loop is at its wall for some of the time, is felt there, and does not shake at the limit of the motor."""
    motor, limit = bench.device["model"]["inputs"][0]["name"], bench.device["loop"]["limit"]
    force = np.concatenate([U[motor] for U in inputs])
    wall = force - np.concatenate([bench.excite(i)[motor] for i in range(len(inputs))])
    hand = np.std(np.concatenate([U[HAND] for U in inputs]))
    if not 0.05 < np.mean(np.abs(wall) > 1e-3 * limit) < 0.9 or np.std(wall) < 0.1 * hand or np.mean(np.abs(force) >= limit) > 0.02:
        raise Redraw("no contact, or an unstable loop")


def recordings(bench, truth, chosen, stat):
    """Inputs, clean outputs and recorded outputs of all recordings."""
    inputs, clean, recorded = bench.record(truth)
    if bench.device["loop"]:
        check_contact(bench, inputs)
        # The forces that the loop played have to give the same motion in the other simulator, with other steps.
        apart = [np.sqrt(np.mean((p - y) ** 2, axis=0)) / bench.deviations() for p, y in zip(predictions(bench, truth, inputs, exact=True), clean)]
        if np.max(apart) > 0.5:
            raise Redraw("motion that hangs on the step of the simulation")
    for e in chosen:
        if e["kind"] == "glitch":
            e["column"] = [o["name"] for o in truth["outputs"]].index(e["place"])
            glitches(recorded, e, bench.sigma[e["column"]], stat[e["place"]], np.random.default_rng(e["seed"]))
    return inputs, clean, [rounded(y) for y in recorded]


def make(core, task):
    """One case: files and truth. Raises Redraw where the draw does not serve."""
    rng, opt, cls = np.random.default_rng(task["seed"]), task["options"], task["class"]
    dev = draw_device(task["family"], rng, six=opt["six"], controlled=opt["controlled"], stage=opt["stage"])
    if opt["torque_constant"] and task["family"] == "master" and rng.random() < 0.8:
        with_hand(dev["model"], dev, dev["amplitude"][0] * log_uniform(rng, 0.3, 1))
    short = min(opt["samples"], ORACLE_SAMPLES // 2) if opt["samples"] > ORACLE_SAMPLES else opt["samples"]
    played = copy.deepcopy(dev["model"])
    if opt["wrong_hold"]:
        q = played["inputs"][rng.integers(len(played["inputs"]))]
        q["hold"] = dict(zero="linear", linear="zero", cubic="zero")[core.hold_of(q)]
    stated = [q.get("hold") for q in dev["model"]["inputs"]]
    dev["model"] = played
    bench = Bench(core, dev, rng, opt["snr"], short)
    base = dev["model"]
    chosen, stat = [], bench.ranges(base)
    if dev["loop"]:
        check_contact(bench, [bench.run(base, i, fine=False)[0] for i in range(len(bench.files))])
    least, tells = float(opt["least"]), True
    if opt["torque_constant"]:
        chosen, tells = fx.torque_constant(base, rng)
        if not chosen:
            raise Redraw("no place left")
    elif cls in EFFECTS:
        chosen = pick_effects(base, EFFECTS[cls], rng, fx.FRICTION if opt["controlled"] else opt["effects"], opt["stage"], not opt["margin_range"])
    if cls == "outside" and not opt["wrong_hold"]:
        chosen = [outside_effect(base, rng)]
    judge = Judge(bench, base)
    rough = with_effects(copy.deepcopy(base), chosen, stat)[0]
    if dev["loop"] and not stepper.knows(rough) or stepper.needed(rough) and (dev["control"] or not stepper.knows(rough)):
        raise Redraw("not for the second simulator")
    for e in chosen:
        if e["kind"] != "glitch" and "value" not in e:
            judge.resize(e, stat, log_uniform(rng, 0.02, 0.1) if cls == "not_visible" else log_uniform(rng, 3, 120))
    truth, found = with_effects(copy.deepcopy(base), chosen, stat)
    number = any(e["kind"] == "inertia" for e in chosen)      # an added inertia is a number as well: a re-tune may hide it
    seen = cls in ("single", "double", "triple", "outside") and chosen and chosen[0]["kind"] != "glitch"
    if core.substeps(truth, bench.ts) > MOST_STEPS:
        raise Redraw("too stiff for quick simulation")
    start, each, together = None, np.array([]), 0.0
    if seen and not number:
        each, together, start = judge.missed(truth, chosen, stat)
        each = each if tells else each[:1]
        if np.any(np.hypot(1, each) < (least if len(chosen) == 1 else 1.3)):
            raise Redraw("not visible")
    wrong = cls == "parameters" or (cls != "none" and rng.random() < 0.5)
    nominal = wrong_numbers(base, rng, cls == "parameters") if wrong else copy.deepcopy(base)
    # the sealed recordings
    if opt["samples"] > ORACLE_SAMPLES:
        bench.n = opt["samples"]
    for m in (nominal, base):
        for q, hold in zip(m["inputs"], stated):
            q.pop("hold", None)
            if hold:
                q["hold"] = hold
    k, cut, tuned, louder = bench.fit, slice(0, ORACLE_SAMPLES), None, 0.0
    while True:
        inputs, simulated, recorded = recordings(bench, truth, chosen, stat)
        clean = predictions(bench, truth, inputs, exact=True) if dev["control"] else simulated
        floor = score(bench, clean, recorded)
        off = score(bench, predictions(bench, nominal, inputs), recorded) if chosen or wrong or opt["wrong_hold"] else floor
        left = off
        if not chosen and not opt["wrong_hold"]:
            left = floor                           # the structure is the true one
        elif opt["oracle"]:
            tuned = tuned or retune(bench, base, [{n: u[cut] for n, u in q.items()} for q in inputs[:k]],
                                    [y[cut] for y in recorded[:k]], judge.scale, start)
            left = score(bench, predictions(bench, tuned, inputs), recorded)
        margin = max(a / b for a, b in zip(left, floor))
        if louder or not opt["margin_range"] or cls not in EFFECTS or cls == "not_visible":
            break
        effect = np.sqrt(max(margin**2 - 1, 1e-9)) if opt["oracle"] else together
        louder = effect / np.sqrt(log_uniform(rng, *opt["margin_range"]) ** 2 - 1)
        if np.any(np.hypot(1, each / louder) < 1.3) or dev["control"] and louder > 3:
            raise Redraw("not visible in that noise, or not to be controlled")
        bench.scale_noise(louder, truth, nominal, base)
    if louder and not opt["oracle"]:
        margin = float(np.hypot(1, together / louder))
    oracle = dict(fit_floor=floor[0], held_out_floor=floor[1], fit_nominal=off[0], held_out_nominal=off[1], fit_retuned=left[0], held_out_retuned=left[1])
    off = max(a / b for a, b in zip(off, floor))
    if floor[1] > 0.5 or not np.isfinite(off):
        raise Redraw("the noise hides all, or the nominal model runs away")
    low, high = opt["margin_range"] or (least, 150)
    if cls in ("single", "double", "triple") and tells and (off < least if number else (opt["oracle"] or louder) and not low <= margin <= high):
        raise Redraw("margin %.2f" % margin)
    if cls == "not_visible" and margin > 1.1:
        raise Redraw("visible")
    if cls == "parameters" and off < 1.2:
        raise Redraw("numbers too near")
    answers = [fx.right_answers(e["kind"], e["place"], p, base) for e, p in zip(chosen, found)]
    if cls == "outside" and opt["wrong_hold"]:
        answers = [dict(physics="hold", signal=q["name"], accept=[], family=["delay", "bandwidth"], parameters_as={})
                   for q, p in zip(base["inputs"], truth["inputs"]) if core.hold_of(q) != core.hold_of(p)]
    return dict(model=nominal, truth=truth, base=base, bench=bench, inputs=inputs, recorded=recorded, oracle=oracle, margin=margin, answers=answers,
                tells=tells)


def write(out, name, task, case, core):
    """The case's folder as a person with the device would have it, and its sealed truth."""
    folder = os.path.join(out, "cases", name)
    os.makedirs(folder, exist_ok=True)
    with open(os.path.join(folder, "model.toml"), "w") as f:
        f.write(core.dump_model(case["model"]))
    bench, m = case["bench"], case["model"]
    files = ["%s.csv" % f[0] for f in bench.files]
    quoted = ["[%s]" % ", ".join('"%s"' % f for f in part) for part in (files[: bench.fit], files[bench.fit :])]
    hand = bench.device["hand"] or {}
    measured = [q["name"] for q in m["inputs"] if not ("stated" in hand and q["name"] == HAND)]
    with open(os.path.join(folder, "set.toml"), "w") as f:
        f.write('model    = "model.toml"\nfit      = %s\nheld_out = %s\ninitial  = "rest"\n' % tuple(quoted))
        if "stated" in hand:
            f.write("\n[unknown]\n%s = { bandwidth_hz = %.1f }\n" % (HAND, hand["stated"]))
    head = ",".join(["t"] + measured + [o["name"] for o in m["outputs"]])
    for file, U, y in zip(files, case["inputs"], case["recorded"]):
        t = U["t"] * bench.ts / FINE if "t" in U else np.arange(len(y)) * bench.ts
        table = np.column_stack([t] + [U[name] for name in measured] + [y])
        np.savetxt(os.path.join(folder, file), table, fmt=["%.10g"] + ["%.7g"] * (table.shape[1] - 1), delimiter=",", header=head, comments="")
    cls = task["class"]
    drawn = cls
    if task["options"]["wrong_hold"] and cls in ("none", "parameters"):
        cls = "outside"
    if not case["tells"]:                          # a gain that is all masses and stiffnesses: right where either or the other of the two is said
        cls = "single"
    accept = RIGHT.get(cls) or sorted({"missing", "ambiguous"} | {v for e in case["answers"] for v in e.get("accept_verdicts", []) if cls == "single"})
    if task["options"]["wrong_hold"] and cls == "outside":
        accept = ["unexplained", "cannot_tell", "nothing_missing", "parameters"]
    truth = dict(case=name, family=task["family"], drawn=drawn, margin=case["margin"], seed=task["seed"],
                 effects=case["answers"], accept_verdicts=accept, oracle=case["oracle"],
                 stress={k: v for k, v in task["options"].items() if k not in ("effects", "least", "oracle")},
                 resim=not (hand.get("stated") or bench.device["stage"] == "clock" or stepper.needed(case["truth"])),
                 hand=bench.device["hand"], loop=bench.device["loop"],
                 model=core.dump_model(case["truth"]), nominal_exact=case["model"] == case["base"])
    truth["class"] = "double" if cls == "triple" else cls      # the score reads three effects as it reads two
    with open(os.path.join(out, "truth", name + ".json"), "w") as f:
        json.dump(truth, f, indent=1)


def draw(task):
    """One case; redrawn until it serves."""
    sys.path.insert(0, task["simulator"])
    import core
    name, began, why = "case-%03d" % task["number"], time.time(), []
    seeds = np.random.default_rng(task["seed"])
    for _ in range(60):
        try:
            case = make(core, dict(task, seed=int(seeds.integers(2**62))))
        except (Redraw, core.SimError, FloatingPointError, np.linalg.LinAlgError) as e:
            why.append(str(e))
            continue
        write(task["out"], name, task, case, core)
        what = "+".join("%s@%s" % (e["physics"], e.get("signal") or "-".join(e["between"])) for e in case["answers"]) or "-"
        o = case["oracle"]
        return "%s %-11s %-11s %-50s floor %.4f nominal %.4f retuned %.4f margin %.2f  %.1f s, %d redrawn" % (
            name, task["family"], task["class"], what, o["held_out_floor"], o["held_out_nominal"], o["held_out_retuned"],
            case["margin"], time.time() - began, len(why))
    return "%s FAILED: %s" % (name, why[-3:])


def main():
    a = argparse.ArgumentParser(description=__doc__)
    a.add_argument("--out", required=True)
    a.add_argument("--count", type=int, default=48)
    a.add_argument("--seed", type=int, default=1)
    a.add_argument("--class", dest="cls", default="mixed", choices=["none", "parameters", "single", "double", "triple", "outside", "not_visible", "mixed", "nulls"])
    a.add_argument("--family", action="append", choices=FAMILIES, help="only this family; may be given several times")
    a.add_argument("--effect", action="append", dest="effects", help="only this kind of effect; may be given several times")
    a.add_argument("--least", type=float, default=1.5, help="how many noise floors a re-tuned nominal model stays away at least")
    a.add_argument("--no-oracle", dest="oracle", action="store_false", help="do not refit the nominal model: quick, without the last check of the margin")
    a.add_argument("--snr", type=float, default=1.0, help="noise multiplied by this")
    a.add_argument("--samples", type=int, default=0, help="samples of each recording, 500 to 500000")
    a.add_argument("--wrong-hold", action="store_true", help="the model states another hold than the one that drove the device")
    a.add_argument("--six", action="store_true", help="branched chains of six bodies")
    a.add_argument("--controlled", action="store_true", help="a closed loop that hides friction")
    a.add_argument("--margin-range", type=float, nargs=2, metavar=("LOW", "HIGH"),
                   help="so much noise that a re-tuned nominal model misses by that many standard deviations of it")
    a.add_argument("--torque-constant", action="store_true", help="class double: an input's gain is off by 10 to 40 %%, and dry friction is left out")
    stage = a.add_mutually_exclusive_group()
    for name, words in STAGE_WORDS.items():
        stage.add_argument("--" + name, dest="stage", action="store_const", const=name, help=words)
    a.add_argument("--simulator", default=os.path.join(ROOT, "..", "shared", "concealed"), help="folder of core.py and sim.c")
    a.add_argument("--processes", type=int, default=2)
    o = a.parse_args()
    if o.stage and (o.six or o.controlled or o.wrong_hold):
        a.error("--%s goes with none of --six, --controlled, --wrong-hold" % o.stage)
    if not os.path.exists(os.path.join(o.simulator, "core.py")):
        print("no simulator in %s: nothing is drawn" % o.simulator)
        return
    rng = np.random.default_rng(o.seed)
    families = ["chain"] if o.six else ["ballscrew"] if o.controlled else o.family or STAGES.get(o.stage, FAMILIES)
    if o.torque_constant or set(o.effects or ()) & set(stepper.OWN):       # which need a force that drives
        o.cls, families = "double" if o.torque_constant else o.cls, [f for f in families if f != "compensator"]
    order = classes(o.cls, o.count, rng)
    options = {k: getattr(o, k) for k in OPTIONS}
    tasks = [dict(number=i + 1, seed=int(s), family=families[i % len(families)], options=options, out=o.out, simulator=os.path.abspath(o.simulator))
             for i, s in enumerate(rng.integers(2**62, size=o.count))]
    for t, c in zip(tasks, order):
        t["class"] = str(c)
    for d in ("cases", "truth"):
        os.makedirs(os.path.join(o.out, d), exist_ok=True)
    with Pool(o.processes) as pool:
        for line in pool.imap_unordered(draw, [t for t in tasks if not os.path.exists(os.path.join(o.out, "truth", "case-%03d.json" % t["number"]))]):
            print(line, flush=True)


if __name__ == "__main__":
    main()
