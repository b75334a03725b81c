"""Checks the simulation against an independent simulator that shares nothing with the project.

    python independent_simulator.py BACKDRIVE FOLDER        (FOLDER holds core.py, sim.c and, optionally, dev/)

Every element kind that both know, every key of inputs and outputs, stiction in several places, kinds in combination, and
the nominal models of some recording sets on their recordings. Errors are shares of the range of the other's solution, the
worst over the outputs of a case. Both are taken at a substep of 2.5 us ("at 2.5 us"), which has to show the same
equations, and ours also at the step that it chooses itself ("chosen"). The column "its own" is how far the other's solution
moves when its step is halved: where that is large, the case is sensitive and neither can be better.
"""

import sys
from pathlib import Path

import numpy as np

from runner import Backdrive, Table, columns_of, share_of_range

PERIOD = 5e-4
FINE = 2.5e-6
MODELS = Path(__file__).resolve().parents[2] / "plant" / "models"
CASES = ["001", "002", "003", "004", "005", "008", "009", "012", "015", "020", "025", "030", "035", "043", "045"]

# A mass on presliding friction alone, thrown by impacts: the sliders break loose within 12 to 140 um, and the step is chosen
# from the stiffness, not from how soon a slider breaks. It converges with the square of the step (2.8e-5 at an eighth).
LOOSER = {"008": 3e-3}
TOUCH = "both find the instant of touch to a part of a step, and every bounce carries the difference on"


def element(kind, a, b="ground", name=None, **parameters):
    return {"name": name or f"{kind}_{a}", "kind": kind, "between": [a, b], **parameters}


def signal(kind, of, **keys):
    of = {"element": of} if kind == "force" else {"of": of}
    return {"kind": kind, **of, **keys}


def force(on="m", **keys):
    return {"name": f"push_{on}", "kind": "force", "on": on, "hold": "linear", **keys}


def motion(on, **keys):
    return {"name": f"move_{on}", "kind": "motion", "on": on, **keys}


def model(bodies, elements, inputs=None, outputs=None):
    outputs = outputs or [signal(kind, "m") for kind in ("position", "velocity")]
    outputs = [{"name": f"y{i}_{o['kind']}", **o} for i, o in enumerate(outputs)]
    return {"bodies": bodies, "elements": elements, "inputs": inputs or [force()], "outputs": outputs}


def held(*laws, outputs=None, inputs=None, spring=300.0):
    """One mass on a spring and a damper with something beside them."""
    beside = [element("spring", "m", stiffness=spring), element("damper", "m", damping=0.5)]
    return model({"m": 0.2}, beside + list(laws), inputs, outputs)


def tones(amplitude, *frequencies, seconds=1.2, seed=0):
    t = PERIOD * np.arange(round(seconds / PERIOD))
    phases = np.random.default_rng(seed).uniform(0, 6.28, len(frequencies))
    start = 1 - np.exp(-((t / 0.04) ** 3))
    return amplitude * start * sum(np.sin(2 * np.pi * f * t + p) for f, p in zip(frequencies, phases)) / len(frequencies)


MAXWELL = dict(stiffness=[400.0, 250.0, 120.0, 60.0], force=[0.05, 0.1, 0.15, 0.25])
HYSTERETIC = dict(stiffness_positive=390.0, stiffness_negative=400.0, offset_positive=0.3, offset_negative=-0.2, bandwidth=2500.0)
LAWS = {
    "cubic_spring": dict(stiffness=50.0, cubic=4e5),
    "quadratic_drag": dict(coefficient=8.0),
    "asymmetric_damper": dict(positive=6.0, negative=1.5),
    "cogging": dict(amplitude=0.25, period=4e-3, phase=0.4),
    "bias": dict(force=0.3),
    "inerter": dict(inertance=0.15),
    "coulomb": dict(force=0.4),
    "asymmetric_coulomb": dict(positive=0.5, negative=0.25),
    "stribeck": dict(coulomb=0.3, static=0.5, velocity=0.02),
    "friction_deficit": dict(coulomb=0.5, rest=0.3, velocity=0.02),
    "dahl": dict(stiffness=2000.0, coulomb=0.5),
    "lugre": dict(stiffness=4000.0, damping=4.0, coulomb=0.5, static=0.7, velocity=0.01),
    "maxwell_slip": MAXWELL,
    "hysteretic_spring": HYSTERETIC,
    "bouc_wen": dict(stiffness=400.0, ratio=0.3, amplitude=1.0, beta=300.0, gamma=200.0, exponent=1.0),
    "contact": dict(stiffness=1500.0, damping=3.0, gap=4e-3),
    "hunt_crossley": dict(stiffness=3e4, damping=4e4, exponent=1.5, gap=4e-3),
}


def master(*extra, rest="coulomb"):
    """Motor, drum and handle, with friction in two places and a hand."""
    frictions = {
        "coulomb": [dict(kind="coulomb", force=0.044), dict(kind="coulomb", force=0.1)],
        "stribeck": [dict(kind="stribeck", coulomb=0.04, static=0.07, velocity=5e-3), dict(kind="stribeck", coulomb=0.1, static=0.15, velocity=0.01)],
    }[rest]
    elements = [
        element("spring", "motor", "drum", stiffness=39500.0),
        element("damper", "motor", "drum", damping=3.6),
        element("hysteretic_spring", "drum", "handle", **{**HYSTERETIC, "stiffness_positive": 3900.0, "stiffness_negative": 4000.0}),
        element("damper", "drum", "handle", damping=1.0),
        element("spring", "handle", stiffness=400.0),
        element("damper", "handle", damping=4.0),
        {"name": "dry_motor", "between": ["motor", "ground"], **frictions[0]},
        {"name": "dry_drum", "between": ["drum", "ground"], **frictions[1]},
        *extra,
    ]
    bodies = {"motor": 0.01075, "drum": 0.0175, "handle": 0.04}
    outputs = [signal("position", body) for body in bodies] + [signal("velocity", "drum")]
    return model(bodies, elements, [force("motor", hold="zero")], outputs)


def compensator(*extra):
    """A moved ram with backlash before a disc with stiction, oil, and a flywheel; the force of the rig is read."""
    elements = [
        element("backlash", "ram", "disc", gap=3.36e-4, stiffness=861e3, damping=1000.0),
        element("inerter", "disc", inertance=24.8),
        element("damper", "disc", damping=370.0),
        element("stribeck", "disc", coulomb=16.38, static=18.72, velocity=1e-3),
        element("damper", "disc", "flywheel", name="oil", damping=1354.0),
        element("inerter", "flywheel", inertance=80.1),
        *extra,
    ]
    outputs = [signal("reaction", "ram"), signal("position", "disc"), signal("velocity", "flywheel")]
    return model({"ram": 0.3, "disc": 0.01, "flywheel": 0.01}, elements, [motion("ram")], outputs)


def three_contacts():
    """Three masses in a row, each with stiction, slowly pulled through: they let go one after another and stop again."""
    elements = []
    for first, second, level in (("m", "n", 0.3), ("n", "o", 0.2), ("o", "ground", 0.25)):
        elements += [element("spring", first, second, stiffness=900.0), element("damper", first, second, damping=0.8)]
        elements += [element("stribeck", first, coulomb=level, static=1.4 * level, velocity=0.01)]
    return model({"m": 0.1, "n": 0.15, "o": 0.12}, elements, None, [signal("position", body) for body in ("m", "n", "o")])


def between_bodies():
    """Stiction between two moving bodies and to ground, and presliding between them too."""
    elements = [
        element("spring", "m", "n", stiffness=500.0),
        element("damper", "m", "n", damping=0.4),
        element("coulomb", "m", "n", force=0.15),
        element("maxwell_slip", "m", "n", **MAXWELL),
        element("asymmetric_coulomb", "n", positive=0.2, negative=0.12),
        element("spring", "n", stiffness=250.0),
        element("damper", "n", damping=0.5),
    ]
    return model({"m": 0.1, "n": 0.2}, elements, None, [signal("position", "m"), signal("position", "n"), signal("velocity", "n")])


def everything():
    """Many kinds in one chain with two inputs."""
    elements = [
        element("spring", "m", "n", stiffness=800.0, rest=1e-3),
        element("damper", "m", "n", damping=0.6),
        element("cogging", "m", amplitude=0.1, period=5e-3, phase=0.2),
        element("coulomb", "m", force=0.1),
        element("bouc_wen", "n", "o", **LAWS["bouc_wen"]),
        element("cubic_spring", "n", "o", stiffness=200.0, cubic=1e5),
        element("inerter", "m", "o", inertance=0.03),
        element("quadratic_drag", "n", coefficient=2.0),
        element("dahl", "o", stiffness=1500.0, coulomb=0.2),
        element("asymmetric_damper", "o", positive=1.5, negative=1.0),
        element("spring", "o", stiffness=200.0),
        element("bias", "o", force=-0.1),
    ]
    outputs = [signal("position", "m"), signal("velocity", "n"), signal("position", "o")]
    outputs += [signal("force", ["spring_m", "damper_m"]), signal("force", "dahl_o"), signal("force", "bouc_wen_n")]
    return model({"m": 0.1, "n": 0.2, "o": 0.15}, elements, [force("m"), force("o", hold="cubic")], outputs)


def cases():
    """Name, model, limit at the chosen step, limit at the fine step, reason."""
    for kind, parameters in LAWS.items():
        law = element(kind, "m", **parameters)
        asked = [signal("position", "m"), signal("velocity", "m"), signal("force", law["name"]), signal("acceleration", "m")]
        yield kind, held(law, outputs=asked[:2] if "coulomb" in kind else asked[:3]), 1e-3, 1e-4, ""
    slack = element("backlash", "m", gap=4e-3, stiffness=1000.0, damping=6.0)
    yield "backlash", held(slack, spring=20.0), 1e-2, 1e-4, TOUCH
    tight = element("backlash", "m", gap=2e-3, stiffness=4000.0)
    yield "backlash without damping: a dead zone", held(tight, spring=20.0), 1e-2, 1e-4, TOUCH
    for hold in ("zero", "linear", "cubic"):
        law = element("cubic_spring", "m", **LAWS["cubic_spring"])
        yield f"input hold {hold}", held(law, inputs=[force(hold=hold)]), 1e-3, 1e-4, ""
    keys = {"gain": -1.3, "delay": 0.00312, "saturation": 0.9, "bandwidth": 20.0, "back_emf": 1.7}
    for key, number in keys.items():
        yield f"input {key}", held(element("coulomb", "m", force=0.1), inputs=[force(**{key: number})]), 1e-3, 1e-4, ""
    yield "input, all keys", held(element("coulomb", "m", force=0.1), inputs=[force(**keys)]), 1e-3, 1e-4, ""
    sensed = [signal(kind, "m", gain=0.8, delay=0.00271, offset=0.3) for kind in ("position", "velocity")]
    sensed += [signal("force", ["spring_m", "damper_m"], gain=2.0, offset=0.1)]
    yield "output gain, delay, offset, force of two", held(element("coulomb", "m", force=0.1), outputs=sensed), 1e-3, 1e-4, ""
    still = [signal("acceleration", "m"), signal("force", "inerter_m")]
    yield "acceleration, inerter force", held(element("inerter", "m", inertance=0.15), outputs=still), 1e-3, 1e-4, ""
    yield "stiction in two places of a master", master(), 1e-3, 1e-4, ""
    yield "the same with Stribeck friction", master(rest="stribeck"), 1e-3, 1e-4, ""
    yield "three contacts in a row", three_contacts(), 1e-3, 1e-4, ""
    yield "stiction between bodies, presliding", between_bodies(), 1e-3, 1e-4, ""
    yield "backlash and stiction on a moved ram", compensator(), 1e-2, 1e-3, TOUCH
    yield "many kinds in one chain", everything(), 1e-3, 1e-4, ""
    delayed = compensator(element("cogging", "disc", amplitude=8.0, period=3e-4, phase=0.3))
    delayed["inputs"][0].update(delay=0.0031, gain=1.1)
    yield "a late motion, and cogging", delayed, 1e-2, 1e-3, TOUCH


def drive(model, number):
    """Samples for each input of a case."""
    found = {}
    for i, q in enumerate(model["inputs"]):
        amplitude = 2e-3 if q["kind"] == "motion" else 1.2 if "motor" in q["name"] else 3.0
        found[q["name"]] = tones(amplitude, 2.3, 7.1, 11.7, seed=10 * number + i)
    return found


def nominal_models(program, core, folder, table):
    """Recording sets: the nominal model on its first recording."""
    for case in CASES:
        folder_of = folder / f"case-{case}"
        if not folder_of.is_dir():
            continue
        other = core.load_model(folder_of / "model.toml")
        recording = sorted(path for path in folder_of.glob("*.csv"))[0]
        measured = columns_of(recording)
        count = min(len(measured["t"]), 6000)
        cut = program.here / "cut.csv"
        lines = recording.read_text().splitlines(keepends=True)
        cut.write_text("".join(lines[: count + 1]))
        period = (measured["t"][count - 1] - measured["t"][0]) / (count - 1)
        substeps = core.substeps(other, period)
        inputs = {q["name"]: measured[q["name"]] for q in other["inputs"]}
        expected, _ = core.simulate(other, inputs, period, count, nsub=4 * substeps)
        halved, _ = core.simulate(other, inputs, period, count, nsub=8 * substeps)
        runs = [program.simulate_files(folder_of / "model.toml", cut, n) for n in (4 * substeps, None)]
        numbers = [max(error(run[o["name"]], expected[:, i], o) for i, o in enumerate(other["outputs"])) for run in runs]
        own = max(error(halved[:, i], expected[:, i], o) for i, o in enumerate(other["outputs"]))
        kinds = sorted({e["kind"] for e in other["elements"]} - {"spring", "damper", "inerter"})
        name = f"case-{case}, {recording.stem}" + (f" ({', '.join(kinds)})" if kinds else "")
        table.row(name, [*numbers, own], [1e-4, LOOSER.get(case, 1e-3)])


# Devices whose motion magnifies what is small, as their own error shows: limit at the chosen step, and why.
RATTLES = {"steering-compensator-master": (0.1, "its half kilogram, which nobody holds, bounces in the gap: any error grows from bounce to bounce")}


def devices(program, core, table):
    """The device models of the project, driven by tones of a size that suits each.

    A motion that is held linearly has a velocity that jumps at every sample, and a damper's force with it. What is read at
    the very sample is then a matter of side (ours is the value before it, which SciPy's check sees to), so such motions
    run as cubics here.
    """
    size = {"force": 1.5, "motion": 3e-4}
    special = {"steering-compensator-master": 60.0, "engine-test-bench": 150.0, "ball-screw": 0.5, "steering-compensator": 3e-3}
    for path in sorted(MODELS.glob("*.toml")):
        model_file = program.here / "device.toml"
        text = path.read_text()
        moved = 'kind = "motion"' in text
        model_file.write_text(text.replace('hold = "linear"', 'hold = "cubic"') if moved else text)
        other = core.load_model(model_file)
        if {e["kind"] for e in other["elements"]} - set(core.KIND):
            print(f"{path.stem}: has a kind that the other does not know")
            continue
        amplitude = [number for name, number in special.items() if path.stem.startswith(name)][:1]
        inputs = {}
        for i, q in enumerate(other["inputs"]):
            inputs[q["name"]] = tones(*(amplitude or [size[q["kind"]]]), 1.3, 4.1, 9.7, seed=i)
        count, substeps = len(next(iter(inputs.values()))), round(PERIOD / FINE)
        drive = program.here / "device.csv"
        table_of = np.column_stack([PERIOD * np.arange(count), *inputs.values()])
        np.savetxt(drive, table_of, fmt="%.17g", delimiter=",", header=",".join(["t", *inputs]), comments="")
        expected, halved = (core.simulate(other, inputs, PERIOD, count, nsub=n)[0] for n in (substeps, 2 * substeps))
        runs = [program.simulate_files(model_file, drive, n) for n in (substeps, None)]
        numbers = [max(error(run[o["name"]], expected[:, i], o) for i, o in enumerate(other["outputs"])) for run in runs]
        own = max(error(halved[:, i], expected[:, i], o) for i, o in enumerate(other["outputs"]))
        why = TOUCH if any(e["kind"] == "backlash" for e in other["elements"]) else ""
        loose = 1e-2 if why else 1e-3
        if path.stem in RATTLES:
            loose, why = RATTLES[path.stem]
        table.row(path.stem, [*numbers, own], [1e-3 if why else 1e-4, loose], why)


def error(found, expected, output):
    """Of motions the largest difference; of what may jump between two samples the root mean square."""
    if output["kind"] in ("position", "velocity"):
        return share_of_range(found, expected)
    return float(np.sqrt(np.mean((found - expected) ** 2)) / max(np.ptp(expected), 1e-300))


def main():
    if len(sys.argv) != 3:
        sys.exit(__doc__)
    program, folder = Backdrive(sys.argv[1]), Path(sys.argv[2]).resolve()
    sys.path.insert(0, str(folder))
    import core

    table = Table("against the independent simulator", ["at 2.5 us", "chosen", "its own"])
    for number, (name, ours, limit, fine, why) in enumerate(cases()):
        inputs = drive(ours, number)
        count, substeps = len(next(iter(inputs.values()))), round(PERIOD / FINE)
        expected, _ = core.simulate(ours, inputs, PERIOD, count, nsub=substeps)
        halved, _ = core.simulate(ours, inputs, PERIOD, count, nsub=2 * substeps)
        runs = [program.simulate(ours, inputs, PERIOD, step) for step in (FINE, None)]
        numbers = [max(error(run[o["name"]], expected[:, i], o) for i, o in enumerate(ours["outputs"])) for run in runs]
        own = max(error(halved[:, i], expected[:, i], o) for i, o in enumerate(ours["outputs"]))
        table.row(name, [*numbers, own], [fine, limit], why)
    table.head("device models", table.columns)
    devices(program, core, table)
    if (folder / "dev").is_dir():
        table.head("nominal models on recordings", table.columns)
        nominal_models(program, core, folder / "dev", table)
    table.verdict()


if __name__ == "__main__":
    main()
