"""True devices of the five families: numbers drawn log-uniform about typical ones."""
import numpy as np
from excitation import log_uniform
from loop import draw_loop

FAMILIES = ["master", "compensator", "ballscrew", "testbench", "chain"]
STAGES = dict(hand=["master"], loop=["master"], clock=FAMILIES, velocity=["master", "ballscrew", "testbench", "chain"])
HAND = "hand_force"


def r4(x):
    return float("%.4g" % x)


def around(rng, value, spread=1.6):
    return r4(value * log_uniform(rng, 1 / spread, spread))


def element(name, kind, a, b, **numbers):
    return dict(name=name, kind=kind, between=[a, b], **numbers)


def maxwell_slip(name, a, b, force, distance, rng, n=5):
    """Sliders that let go one after the other between 0.1 and 3 times `distance`."""
    share = rng.dirichlet(np.full(n, 3.0)) * force
    gaps = np.geomspace(0.1, 3, n) * distance
    return element(name, "maxwell_slip", a, b, stiffness=[r4(f / g) for f, g in zip(share, gaps)], force=[r4(f) for f in share])


def force_input(name, body, rng):
    q = dict(name=name, kind="force", on=body)
    hold = rng.choice(["", "zero", "linear"], p=[0.4, 0.3, 0.3])
    return dict(q, hold=str(hold)) if hold else q


def master(rng):
    bodies = dict(motor=around(rng, 0.018), drum=around(rng, 0.02), handle=around(rng, 0.08))
    linkage = around(rng, 1400)
    els = [element("cable", "spring", "motor", "drum", stiffness=around(rng, 25000, 2)),
           element("cable_damping", "damper", "motor", "drum", damping=around(rng, 5)),
           element("linkage", "spring", "drum", "handle", stiffness=linkage),
           element("linkage_damping", "damper", "drum", "handle", damping=around(rng, 0.5)),
           element("user", "spring", "handle", "ground", stiffness=around(rng, 600)),
           element("user_damping", "damper", "handle", "ground", damping=around(rng, 15))]
    amplitude = log_uniform(rng, 1, 5)
    pick = rng.random()
    if pick < 0.15:
        bend = amplitude * rng.uniform(0.05, 0.15)
        els[2] = element("linkage", "hysteretic_spring", "drum", "handle", stiffness_positive=linkage, stiffness_negative=linkage,
                         offset_positive=r4(bend), offset_negative=r4(-bend), bandwidth=around(rng, 3 * linkage / amplitude))
    elif pick < 0.4:
        els.append(element("friction", "coulomb", str(rng.choice(["motor", "drum"])), "ground", force=r4(amplitude * rng.uniform(0.02, 0.1))))
    if rng.random() < 0.4:
        els.append(element("motor_drag", "damper", "motor", "ground", damping=around(rng, 0.5, 2)))
    outs = [dict(name="motor_position", kind="position", of="motor")]
    if rng.random() < 0.2:
        outs.append(dict(name="handle_acceleration", kind="acceleration", of="handle"))
    return dict(name="master", title="Single-axis force-reflecting master", motion="translation", bodies=bodies, elements=els,
                inputs=[force_input("feedback_force", "motor", rng)], outputs=outs), \
        dict(ts=float(rng.choice([0.00025, 0.0004, 0.0005])), band=(0.7, log_uniform(rng, 40, 110)), amplitude=[amplitude])


def compensator(rng):
    bodies = dict(ram=0.001, disc=around(rng, 0.35, 2), flywheel=around(rng, 0.25, 2))
    els = [element("gearbox", "spring", "ram", "disc", stiffness=around(rng, 6e5))]
    if rng.random() < 0.8:
        els.append(element("parasitic_inertance", "inerter", "disc", "ground", inertance=around(rng, 20, 1.3)))
    else:
        bodies["disc"] = around(rng, 5)
    els += [element("oil", "damper", "disc", "flywheel", damping=around(rng, 3500)),
            element("inertance", "inerter", "flywheel", "ground", inertance=around(rng, 85, 1.3))]
    if rng.random() < 0.35:
        els.append(element("viscous", "damper", "disc", "ground", damping=around(rng, 600, 2)))
    if rng.random() < 0.4:
        els.append(element("friction", "coulomb", "disc", "ground", force=around(rng, 12, 2)))
    return dict(name="compensator", title="Steering compensator on a displacement rig", motion="translation", bodies=bodies, elements=els,
                inputs=[dict(name="displacement", kind="motion", on="ram")],
                outputs=[dict(name="force", kind="reaction", of="ram")]), \
        dict(ts=float(rng.choice([0.001, 0.002])), band=(0.6, log_uniform(rng, 8, 25)), amplitude=[log_uniform(rng, 1.5e-3, 6e-3)])


def ballscrew(rng):
    linear = rng.random() < 0.5
    mass, slip = (around(rng, 10, 3), around(rng, 6e-5, 3)) if linear else (around(rng, 0.0018, 2), around(rng, 0.01, 3))
    friction = around(rng, 6, 2) * (1 if linear else 0.008)
    two = rng.random() < 0.5
    bodies = dict(motor=r4(mass * (0.5 if two else 1)))
    els = []
    if two:
        bodies["carriage"] = r4(mass * rng.uniform(0.3, 0.9))
        w = 2 * np.pi * log_uniform(rng, 18, 60)
        m1, m2 = bodies["motor"], bodies["carriage"]
        k = w * w * m1 * m2 / (m1 + m2)
        els += [element("screw", "spring", "motor", "carriage", stiffness=r4(k)),
                element("screw_damping", "damper", "motor", "carriage", damping=r4(2 * rng.uniform(0.01, 0.05) * k / w))]
    els.append(element("viscous", "damper", "motor", "ground", damping=r4(mass * log_uniform(rng, 1.5, 9))))
    where = "carriage" if two and rng.random() < 0.6 else "motor"
    pick = rng.random()
    if pick < 0.4:
        els.append(element("friction", "coulomb", where, "ground", force=r4(friction)))
    elif pick < 0.8:
        els.append(maxwell_slip("friction", where, "ground", friction, slip, rng))
    unit = "force" if linear else "torque"
    amplitude = friction * log_uniform(rng, 1.6, 5)
    model = dict(name="ballscrew", title="Ball-screw axis", motion="translation" if linear else "rotation", bodies=bodies, elements=els,
                 inputs=[force_input("motor_" + unit, "motor", rng)], outputs=[dict(name="position", kind="position", of="motor")])
    use = dict(ts=float(rng.choice([0.0005, 0.001])), band=(0.5, log_uniform(rng, 20, 60)), amplitude=[amplitude])
    if rng.random() < 0.4:
        model["title"] += ", position controlled"
        use["control"] = dict(frequency=rng.uniform(4, 9), travel=(slip * log_uniform(rng, 20, 80)), band=(0.4, rng.uniform(3, 8)))
    return model, use


def testbench(rng):
    bodies = dict(engine=around(rng, 0.28, 1.8), dyno=around(rng, 0.6, 2.4))
    els = [element("shaft", "spring", "engine", "dyno", stiffness=around(rng, 3500, 2)),
           element("shaft_damping", "damper", "engine", "dyno", damping=around(rng, 1.3, 2)),
           element("engine_drag", "damper", "engine", "ground", damping=around(rng, 0.2, 2)),
           element("dyno_drag", "damper", "dyno", "ground", damping=around(rng, 0.2, 2))]
    if rng.random() < 0.4:
        els.append(element("bearing", "coulomb", "dyno", "ground", force=around(rng, 4, 1.6)))
    outs = [dict(name="engine_speed", kind="velocity", of="engine"), dict(name="dyno_speed", kind="velocity", of="dyno"),
            dict(name="shaft_torque", kind="force", element="shaft")]
    return dict(name="testbench", title="Engine test bench", motion="rotation", bodies=bodies, elements=els,
                inputs=[force_input("dyno_torque", "dyno", rng), force_input("engine_torque", "engine", rng)], outputs=outs), \
        dict(ts=float(rng.choice([0.001, 0.002])), band=(0.4, log_uniform(rng, 20, 45)), samples=4206,
             amplitude=[log_uniform(rng, 30, 140), log_uniform(rng, 20, 60)])


def chain(rng, six=False):
    n = 6 if six else int(rng.integers(1, 5))
    scale, f0 = log_uniform(rng, 0.02, 15), log_uniform(rng, 4, 30)
    names = ["abcdef"[i] for i in range(n)] if rng.random() < 0.5 else ["body%d" % (i + 1) for i in range(n)]
    bodies = {b: r4(scale * log_uniform(rng, 0.4, 2.5)) for b in names}
    els = []

    def joint(i, a, b, k0):
        k = r4(k0 * log_uniform(rng, 0.4, 2.5))
        els.append(element("k%d" % i, "spring", a, b, stiffness=k))
        els.append(element("d%d" % i, "damper", a, b, damping=r4(2 * log_uniform(rng, 0.01, 0.08) * np.sqrt(k * scale))))

    stiffness = scale * (2 * np.pi * f0) ** 2
    for i in range(1, n):
        parent = i - 1 if rng.random() < (0.5 if six else 0.7) else int(rng.integers(0, i))
        joint(i - 1, names[parent], names[i], stiffness)
    for j, b in enumerate(rng.permutation(names)[: 1 if rng.random() < 0.7 else 2]):
        joint(n + j, str(b), "ground", 0.6 * stiffness)
    amplitude = scale * log_uniform(rng, 0.05, 60)
    if rng.random() < 0.3:
        els.append(element("c0", "coulomb", str(rng.choice(names)), "ground", force=r4(amplitude * rng.uniform(0.01, 0.08))))
    motion = n > 1 and rng.random() < 0.2
    if motion:
        inputs = [dict(name="u1", kind="motion", on=str(rng.choice(names)))]
    else:
        on = rng.permutation(names)[: 1 if n == 1 or rng.random() < 0.7 else 2]
        inputs = [force_input("u%d" % (i + 1), str(b), rng) for i, b in enumerate(on)]
    seen = [b for b in names if not motion or b != inputs[0]["on"]]
    of = rng.permutation(seen)[: 1 if n == 1 or rng.random() < 0.5 else 3 if six else 2]
    kind = lambda: str(rng.choice(["position", "velocity", "acceleration"], p=[0.55, 0.2, 0.25]))
    outs = [dict(name="y%d" % (i + 1), kind=kind(), of=str(b)) for i, b in enumerate(of)]
    high = f0 * rng.uniform(1.6, 2.5)
    push = 0.3 * amplitude / stiffness if motion else amplitude
    return dict(name="device", title="Device", motion=str(rng.choice(["translation", "rotation"])), bodies=bodies, elements=els,
                inputs=inputs, outputs=outs), \
        dict(ts=r4(1 / (high * rng.uniform(12, 20))), band=(f0 / 25, high), samples=int(rng.integers(5000, 7066)),
             amplitude=[push * log_uniform(rng, 0.5, 1) for _ in inputs])


def with_hand(model, use, force):
    """A hand that pushes on the handle."""
    model["inputs"].append(dict(name=HAND, kind="force", on="handle", hold="linear"))
    use["amplitude"].append(r4(force))


def rigid(model, rng):
    """A master of one to three bodies: cable and linkage may be stiff."""
    for a, b in [("motor", "drum"), ("drum", "handle")][: int(rng.choice(3, p=[0.4, 0.3, 0.3]))]:
        model["bodies"][b] = r4(model["bodies"][b] + model["bodies"].pop(a))
        model["elements"] = [e for e in model["elements"] if set(e["between"]) != {a, b}]
        for e in model["elements"]:
            e["between"] = [b if q == a else q for q in e["between"]]
        for q, key in [(q, "on") for q in model["inputs"]] + [(o, "of") for o in model["outputs"]]:
            q[key] = b if q[key] == a else q[key]


def staged(stage, model, use, rng):
    """The device where it is not alone on a quiet bench. False where it cannot be there."""
    kinds = {e["kind"] for e in model["elements"]}
    if stage in ("clock", "velocity") and "control" in use or stage == "loop" and "hysteretic_spring" in kinds:
        return False
    if stage == "hand":                            # in no column of the files; the set states a bandwidth that is larger than the hand's
        band = rng.uniform(1.5, 3)
        with_hand(model, use, use["amplitude"][0] * log_uniform(rng, 0.2, 1))
        use["hand"] = dict(input=HAND, band=r4(band), stated=round(band * rng.uniform(1.6, 2.2), 1))
    if stage == "loop":
        del model["outputs"][1:]
        rigid(model, rng)
        model["inputs"][0]["hold"], use["ts"] = "zero", float(rng.choice([0.0005, 0.001]))
        with_hand(model, use, log_uniform(rng, 1, 6))
        use["hand"] = dict(input=HAND, band=r4(rng.uniform(3, 6)))
        use["loop"] = draw_loop(model, use["ts"], use["amplitude"][1], rng)
        use["amplitude"][0] = r4(use["amplitude"][1] * float(rng.choice([0, log_uniform(rng, 0.02, 0.1)])))       # of a dither on the motor
    if stage == "velocity":                        # sampled so fast that a mean over a sample is the velocity in its middle
        use["ts"] = min(use["ts"], r4(1 / (30 * use["band"][1])))
        for o in model["outputs"]:
            if o["kind"] == "position":
                o.update(kind="velocity", name=o["name"].replace("position", "velocity"))
        return any(o["kind"] == "velocity" for o in model["outputs"])
    return True


def draw_device(family, rng, six=False, controlled=False, stage=None):
    """A true device: model, sample time, band, amplitudes, and how it is controlled (None: open loop)."""
    while True:
        model, use = chain(rng, six) if family == "chain" else globals()[family](rng)
        if (not controlled or "control" in use) and staged(stage, model, use, rng):
            break
    if controlled:
        use["control"]["frequency"] = min(2 * use["control"]["frequency"], 15)
    model["source"] = "nominal data sheet values"
    return dict(family=family, model=model, ts=use["ts"], band=use["band"], amplitude=use["amplitude"],
                samples=use.get("samples", int(rng.choice([7066, 8833]))), control=use.get("control"), stage=stage,
                hand=use.get("hand"), loop=use.get("loop"))


def wrong_numbers(model, rng, all_wrong=False):
    """The nominal numbers: each with some chance off by up to 30 %, a few by up to a factor of two."""
    import copy
    m = copy.deepcopy(model)

    def factor():
        if rng.random() > (0.8 if all_wrong else 0.6):
            return 1.0
        return log_uniform(rng, 0.5, 2) if rng.random() < 0.12 else 1 + rng.uniform(-0.3, 0.3)

    prescribed = {q["on"] for q in m["inputs"] if q["kind"] == "motion"}
    for b in m["bodies"]:
        if b not in prescribed:
            m["bodies"][b] = r4(m["bodies"][b] * factor())
    for e in m["elements"]:
        for k, v in e.items():
            if k in ("name", "kind", "between"):
                continue
            f = factor()
            e[k] = [r4(x * f) for x in v] if isinstance(v, list) else r4(v * f)
    return m
