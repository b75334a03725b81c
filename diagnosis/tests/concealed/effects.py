"""What a nominal model can leave out: drawing an effect, adding it to the true model, and saying which answers are right."""
import copy
import numpy as np
from excitation import log_uniform
from families import HAND, element, maxwell_slip, r4
from stepper import OWN, joint

FRICTION = ["coulomb", "asymmetric_coulomb", "stribeck", "friction_deficit", "dahl", "lugre", "maxwell_slip", "preisach_lugre"]
HYSTERESIS = ["dahl", "lugre", "maxwell_slip", "preisach_lugre", "hysteretic_spring", "bouc_wen"]
VISCOUS = ["damper", "asymmetric_damper", "quadratic_drag", "back_emf"]
ELASTIC = ["spring", "cubic_spring", "hysteretic_spring", "bouc_wen", "backlash", "contact", "hunt_crossley"]
DRY = FRICTION + [*OWN, "gear_loss"]
FAMILY = {**{k: DRY + HYSTERESIS[4:] for k in ("dahl", "lugre", "maxwell_slip")},
          **{k: DRY for k in ("coulomb", "asymmetric_coulomb", "stribeck", "friction_deficit", *OWN)},
          **{k: VISCOUS for k in VISCOUS}, **{k: ELASTIC for k in ("spring", "cubic_spring", "contact", "hunt_crossley")},
          "backlash": ELASTIC + ["series_compliance"], "series_compliance": ["series_compliance", "backlash"],
          "hysteretic_spring": HYSTERESIS + ["cubic_spring"], "bouc_wen": HYSTERESIS + ["cubic_spring"],
          "inertia": ["inertia", "inerter"], "inerter": ["inertia", "inerter"], "delay": ["delay", "bandwidth"],
          "bandwidth": ["delay", "bandwidth"], "gain": ["gain", "saturation"], "saturation": ["gain", "saturation"],
          "bias": ["bias", "offset", "asymmetric_coulomb"], "offset": ["bias", "offset"], "cogging": ["cogging"]}
INPUT_KEYS = ["delay", "bandwidth", "saturation", "gain", "back_emf"]
OUTPUT_KEYS = ["offset", "delay", "gain"]
OUTSIDE = ["tv_spring", "disturbance", "glitch"]
# What a friction or spring effect stands in for, when the nominal model has that at its place.
REPLACES = {"asymmetric_coulomb": ["coulomb"], "stribeck": ["coulomb"], "friction_deficit": ["coulomb"], "dahl": ["coulomb"],
            "lugre": ["coulomb"], "maxwell_slip": ["coulomb"], **{k: ["coulomb"] for k in OWN}, "cubic_spring": ["spring"], "hysteretic_spring": ["spring"],
            "bouc_wen": ["spring"], "tv_spring": ["spring"], "asymmetric_damper": ["damper"], "backlash": ["spring", "damper"]}
TOP = {"asymmetric_coulomb": 0.8, "friction_deficit": 0.9, "asymmetric_damper": 0.8, "saturation": 0.7, "tv_spring": 0.9,
       "backlash": 1.5, "contact": 50.0, "hunt_crossley": 50.0}          # sizes that would leave sense behind

BOTTOM = {"bandwidth": 0.15}                                             # a lag far above the band is a delay


def at(model, place, kind):
    return next((e for e in model["elements"] if frozenset(e["between"]) == frozenset(place) and e["kind"] == kind), None)


def free_bodies(model):
    held = {q["on"] for q in model["inputs"] if q["kind"] == "motion"}
    return [b for b in model["bodies"] if b not in held], held


def joints(model):
    seen = []
    for e in model["elements"]:
        if "ground" not in e["between"] and tuple(e["between"]) not in seen:
            seen.append(tuple(e["between"]))
    return seen


def options(model, own=()):
    """Every effect that makes sense here: (kind, place or signal name). `own`: laws of the second simulator, which are drawn where they are asked for."""
    free, held = free_bodies(model)
    grounds = [(b, "ground") for b in free]
    out = []
    frictions = ("coulomb", "maxwell_slip")
    for p in grounds:
        had = [k for k in frictions if at(model, p, k)]
        out += [(k, p) for k in ("cogging", "bias", "contact", "hunt_crossley", "quadratic_drag")]
        out += [(k, p) for k in ("inertia", "series_compliance") if k == "inertia" or at(model, p, "spring")]
        if "maxwell_slip" not in had:
            out += [(k, p) for k in ("asymmetric_coulomb", "stribeck", "friction_deficit", "dahl", "lugre", "maxwell_slip")]
            out += [(k, p) for k in OWN if k in own and (k == "warm_friction" or joint(model, p))]
        out += [("coulomb", p)] if not had else []
        out += [(k, p) for k, base in (("damper", "damper"), ("spring", "spring")) if not at(model, p, base) and not at(model, p, "hysteretic_spring")]
        out += [("asymmetric_damper", p)] if at(model, p, "damper") else []
    for p in joints(model):
        spring = at(model, p, "spring")
        out += [(k, p) for k in ("coulomb", "dahl", "inerter", "quadratic_drag", "series_compliance")]
        out += [("backlash", p)] if spring and at(model, p, "damper") else []
    for p in joints(model) + grounds:
        out += [(k, p) for k in ("cubic_spring", "hysteretic_spring", "bouc_wen") if at(model, p, "spring")]
    out += [(k, (b, "ground")) for b in held for k in ("coulomb", "inertia")]
    for q in model["inputs"]:
        out += [(k, q["name"]) for k in (INPUT_KEYS if q["kind"] == "force" else ["delay", "gain"])]
    if len(model["inputs"]) + len(model["outputs"]) > 2:
        out += [(k, o["name"]) for o in model["outputs"] for k in OUTPUT_KEYS]
    else:
        out += [("offset", o["name"]) for o in model["outputs"] if o["kind"] != "acceleration"]
    return out


def is_scaled(model):
    """Whether masses and stiffnesses cannot all be off by the same factor unseen, as they can where only forces go in and only motions come out."""
    return any(q["kind"] == "motion" for q in model["inputs"]) or any(o["kind"] in ("force", "reaction") for o in model["outputs"])


def torque_constant(model, rng):
    """An input whose gain is off by 10 to 40 % beside dry friction that was left out, and whether the recordings can tell the gain: where there is no
    other force to compare with, it is the same as all masses and stiffnesses being off together."""
    inputs = [q for q in model["inputs"] if q["kind"] == "force"]
    motors = [q["name"] for q in inputs if q["name"] != HAND]
    places = [p for p in ((b, "ground") for b in free_bodies(model)[0]) if not at(model, p, "coulomb") and not at(model, p, "maxwell_slip")]
    if not motors or not places:
        return None, False
    gain = dict(kind="gain", place=str(rng.choice(motors)), value=r4(1 + rng.choice([-1, 1]) * rng.uniform(0.1, 0.4)))
    friction = dict(kind=str(rng.choice(["coulomb", "stribeck"])), place=places[rng.integers(len(places))])
    tells = len(inputs) > 1 or is_scaled(model)
    return [dict(e, seed=int(rng.integers(2**62)), size=log_uniform(rng, 0.05, 0.5)) for e in (friction, gain)], tells


def add(model, effect, stat):
    """The model with the effect in it, and the effect's numbers. `stat`: ranges of motion and force at every place."""
    m, rng, s = copy.deepcopy(model), np.random.default_rng(effect["seed"]), effect["size"]
    kind, place = effect["kind"], effect["place"]
    name = "extra_" + kind
    if "value" in effect:
        next(q for q in m["inputs"] + m["outputs"] if q["name"] == place)[kind] = effect["value"]
        return m, {kind: effect["value"]}
    if isinstance(place, str):
        return signal_effect(m, kind, place, s, stat, rng)
    a, b = place
    x, v, peak, f = stat[place]
    if kind == "inertia":
        extra = r4(s * m["bodies"][a] * (1 if m["bodies"][a] > 0.01 else 100))
        m["bodies"][a] += extra
        return m, dict(inertia=extra)
    if kind == "series_compliance":
        k = max([e["stiffness"] for e in m["elements"] if set(e["between"]) == set(place) and e["kind"] == "spring"] or [f / x])
        held = free_bodies(m)[1]
        body, near = "between_%s_%s" % place, min(m["bodies"].get(q, 1e99) for q in place if q not in held)
        p = dict(stiffness=r4(k / s), damping=r4(0.05 * np.sqrt(k / s * near)), inertia=r4(near * log_uniform(rng, 0.05, 0.4)))
        m["bodies"][body] = p["inertia"]
        for e in m["elements"]:
            if set(e["between"]) == set(place):
                a, b = e["between"]
                e["between"] = [a, body]
        m["elements"] += [element(name, "spring", body, b, stiffness=p["stiffness"]),
                          element(name + "_damping", "damper", body, b, damping=p["damping"])]
        return m, p
    old = [e for e in (at(m, place, k) for k in REPLACES.get(kind, [])) if e]
    if old:
        a, b = old[0]["between"]
        name = old[0]["name"]
    p = numbers(kind, s, x, v, peak, f, {k: val for e in old for k, val in e.items()}, stat, place, m, rng)
    m["elements"] = [e for e in m["elements"] if not any(e is q for q in old)]
    m["elements"].append(element(name, kind, a, b, **p))
    return m, p


def numbers(kind, s, x, v, peak, f, old, stat, place, m, rng):
    """An effect's numbers at relative size `s`: x, v rms motion, peak its largest, f rms force; `old` what it replaces."""
    c = old.get("force", s * f)
    if kind == "coulomb":
        return dict(force=r4(s * f))
    if kind == "asymmetric_coulomb":
        q = s * (rng.choice([-1, 1])) if "force" in old else rng.choice([-1, 1]) * rng.uniform(0.2, 0.7)
        return dict(positive=r4(c * (1 + q)), negative=r4(c * (1 - q)))
    if kind == "stribeck":
        return dict(coulomb=r4(c), static=r4(c * (1 + (s if "force" in old else rng.uniform(0.4, 1.5)))), velocity=r4(v * log_uniform(rng, 0.15, 0.7)))
    if kind == "friction_deficit":
        return dict(coulomb=r4(c), rest=r4(c * (1 - (s if "force" in old else rng.uniform(0.3, 0.8)))), velocity=r4(v * log_uniform(rng, 0.15, 0.7)))
    if kind == "load_friction":
        load = stat[joint(m, place)][3] if "ground" not in joint(m, place) else f
        return dict(force=r4(c if "force" in old else rng.uniform(0, 0.5) * s * f), coefficient=r4(min(s * f / load, 0.6)))
    if kind == "warm_friction":                    # it warms within a recording
        heat = c * 0.8 * v * stat["length"]
        halves = 8 * s if "force" in old else rng.uniform(0.7, 4)
        return dict(force=r4(c), half_heat=r4(heat / halves), cooling_time=r4(stat["length"] * log_uniform(rng, 0.3, 4)))
    if kind in ("dahl", "lugre"):
        force = c if "force" in old else s * f
        p = dict(stiffness=r4(force / (x * (0.6 * s if "force" in old else log_uniform(rng, 0.15, 0.9)))), coulomb=r4(force))
        if kind == "lugre":
            mass = m["bodies"][place[0]]
            p = dict(p, damping=r4(rng.uniform(0.1, 0.6) * np.sqrt(p["stiffness"] * mass)), static=r4(force * rng.uniform(1.2, 2)),
                     velocity=r4(v * log_uniform(rng, 0.05, 0.5)))
        return p
    if kind == "maxwell_slip":
        e = maxwell_slip("", *place, c, x * (s if "force" in old else log_uniform(rng, 0.2, 0.9)), rng, int(rng.integers(3, 6)))
        return dict(stiffness=e["stiffness"], force=e["force"])
    if kind == "quadratic_drag":
        return dict(coefficient=r4(s * f / v**2))
    if kind == "damper":
        return dict(damping=r4(s * f / v))
    if kind == "asymmetric_damper":
        q = s * rng.choice([-1, 1])
        return dict(positive=r4(old["damping"] * (1 + q)), negative=r4(old["damping"] * (1 - q)))
    if kind == "spring":
        return dict(stiffness=r4(s * f / x))
    if kind == "inerter":
        return dict(inertance=r4(s * min(m["bodies"][q] for q in place)))
    if kind == "cogging":
        return dict(amplitude=r4(s * f), period=r4(peak * log_uniform(rng, 0.15, 1.2)), phase=r4(rng.uniform(-3, 3)))
    if kind == "bias":
        return dict(force=r4(s * f * rng.choice([-1, 1])))
    if kind in ("contact", "hunt_crossley"):
        gap, depth = peak * rng.uniform(0.3, 0.75), 0.3 * peak
        if kind == "contact":
            return dict(stiffness=r4(s * f / depth), damping=r4(s * f / depth * 0.05 * depth / v), gap=r4(gap))
        n = float(rng.choice([1.3, 1.5, 2.0]))
        return dict(stiffness=r4(s * f / depth**n), damping=r4(s * f / depth**n * rng.uniform(0.05, 0.4) / v), exponent=n, gap=r4(gap))
    k = old.get("stiffness", f / x)
    if kind == "cubic_spring":
        return dict(stiffness=r4(k), cubic=r4(s * k / x**2))
    if kind == "hysteretic_spring":
        q = rng.uniform(0.8, 1.2)
        return dict(stiffness_positive=r4(k * q), stiffness_negative=r4(k * rng.uniform(0.9, 1.1) * q), offset_positive=r4(s * k * x),
                    offset_negative=r4(-s * k * x * rng.uniform(0.7, 1.3)), bandwidth=r4(log_uniform(rng, 2, 15) / x))
    if kind == "bouc_wen":
        n = float(rng.choice([1.0, 1.5, 2.0]))
        z = x / s * log_uniform(rng, 0.5, 1.5)
        share = rng.uniform(0.55, 0.9)
        return dict(stiffness=r4(k), ratio=r4(rng.uniform(0.3, 0.8)), amplitude=1.0, beta=r4(share / z**n), gamma=r4((1 - share) / z**n), exponent=n)
    if kind == "backlash":
        return dict(gap=r4(2 * s * x), stiffness=r4(k), damping=r4(old["damping"]))
    if kind == "tv_spring":
        return dict(stiffness=r4(k), depth=r4(s), frequency=r4(log_uniform(rng, 1, 12) / stat["length"]), phase=r4(rng.uniform(-3, 3)))
    if kind == "disturbance":
        return dict(amplitude=r4(s * f), frequency=r4(log_uniform(rng, *stat["band"]) * 0.7), phase=r4(rng.uniform(-3, 3)))
    raise ValueError(kind)


def signal_effect(m, kind, name, s, stat, rng):
    q = next(q for q in m["inputs"] + m["outputs"] if q["name"] == name)
    value = {"delay": s * 10 * stat["ts"], "bandwidth": stat["band"][1] / s, "saturation": stat[name] * (1 - s), "gain": 1 + s * rng.choice([-1, 0.5]),
             "offset": s * stat[name] * rng.choice([-1, 1])}
    if kind == "back_emf":
        x, v, peak, f = stat[(q["on"], "ground")]
        value = dict(back_emf=s * f / v)
    if kind == "gain":
        value["gain"] = max(value["gain"], 0.3)
    q[kind] = r4(value[kind])
    return m, {kind: q[kind]}


def right_answers(kind, place, p, nominal):
    """An effect as the score reads it, with all that formats.md counts as the same; of a list the score reads the sum."""
    p = {k: sum(v) if isinstance(v, list) else v for k, v in p.items()}
    if isinstance(place, str):
        inputs, outputs = ([q["name"] for q in nominal[k]] for k in ("inputs", "outputs"))
        e = dict(physics=kind, signal=place, accept=[dict(physics=[kind], signal=place)], family=FAMILY.get(kind, [kind]), parameters_as={kind: p})
        if kind in ("delay", "bandwidth") and len(inputs) == len(outputs) == 1:
            e["signal_any"] = inputs + outputs
        # Of two forces, or of two motions, either has the gain: all masses and stiffnesses make up for it.
        side = inputs if place in inputs else outputs
        if kind == "gain" and len(side) == 2 and not is_scaled(nominal):
            e["accept"] += [dict(physics=[kind], signal=name) for name in side if name != place]
        if kind == "back_emf":
            on = next(q["on"] for q in nominal["inputs"] if q["name"] == place)
            e["accept"].append(dict(physics=["damper"], between=[on, "ground"]))
            e["parameters_as"]["damper"] = dict(damping=p["back_emf"])
        return e
    between = list(place)
    e = dict(physics=kind, between=between, accept=[dict(physics=[kind], between=between)], family=FAMILY.get(kind, [kind]), parameters_as={kind: p})
    if kind in ("inertia", "inerter") and "ground" in place:
        e["accept"][0]["physics"] = ["inertia", "inerter"]
        value = next(iter(p.values()))
        e["parameters_as"] = dict(inertia=dict(inertia=value), inerter=dict(inertance=value))
        e["accept_verdicts"] = ["missing", "parameters"]
    if kind == "damper" and "ground" in place:
        for q in nominal["inputs"]:
            if q["kind"] == "force" and q["on"] == place[0]:
                e["accept"].append(dict(physics=["back_emf"], signal=q["name"]))
                e["parameters_as"]["back_emf"] = dict(back_emf=p["damping"])
    coulomb = at(nominal, place, "coulomb")
    if kind == "asymmetric_coulomb" and coulomb:
        e["accept"][0]["physics"] = ["asymmetric_coulomb", "bias"]
        e["parameters_as"]["bias"] = dict(force=(p["positive"] - p["negative"]) / 2)
    if kind == "bias" and coulomb:
        e["accept"][0]["physics"] = ["bias", "asymmetric_coulomb"]
        c = coulomb["force"]
        e["parameters_as"]["asymmetric_coulomb"] = dict(positive=c + p["force"], negative=c - p["force"])
    if kind == "cubic_spring":
        e["parameters_as"] = dict(cubic_spring=dict(cubic=p["cubic"]))
    if kind == "cogging":
        e["parameters_as"] = dict(cogging=dict(amplitude=p["amplitude"], period=p["period"]))
    return e
