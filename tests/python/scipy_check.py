"""Checks the simulation against SciPy, which integrates the same equations with an error control of its own.

    python scipy_check.py BACKDRIVE

The equations below are those of the model format. Each case is simulated at the step that the program chooses, which
has to be good enough, and at a step of 5 us, which shows that what is left is the step and not another equation.
Errors are shares of the range of SciPy's solution, the worst over the outputs of a case. The column "SciPy's own" is how
far its solution moves when its tolerance is 100 times looser.
"""

import sys

import numpy as np
from scipy.integrate import solve_ivp
from scipy.interpolate import CubicSpline

from runner import Backdrive, Table, share_of_range

TAU = 2.0 * np.pi
FINE = 5e-6
PERIOD = 1e-3


def bristle_level(p, v):
    return p["coulomb"] + (p["static"] - p["coulomb"]) * np.exp(-((v / p["velocity"]) ** 2))


def lugre_rate(p, x, v, z):
    return v - abs(v) * p["stiffness"] * z / bristle_level(p, v)


def hysteretic_rate(p, x, v, z):
    # dF/d|x| = bandwidth (line - F), so dF/dt is that times |v|. The line leads its asymptote by stiffness/bandwidth,
    # as in Kuchenbecker & Niemeyer's eq (3), so that F settles on offset + stiffness x and not behind it.
    side, ahead = ("positive", 1.0) if v > 0 else ("negative", -1.0)
    line = p["offset_" + side] + p["stiffness_" + side] * (x + ahead / p["bandwidth"])
    return p["bandwidth"] * abs(v) * (line - z)


def bouc_wen_rate(p, x, v, z):
    n = p["exponent"]
    # β|v||z|^(n-1) z + γ v |z|^n, with |z|^(n-1) z written so that it is 0 at z = 0.
    return p["amplitude"] * v - p["beta"] * abs(v) * np.sign(z) * abs(z) ** n - p["gamma"] * v * abs(z) ** n


def backlash_rate(p, x, v, z):
    half = 0.5 * p["gap"]
    free = v + p["stiffness"] / p["damping"] * (x - z)
    return min(free, 0.0) if z >= half else max(free, 0.0) if z <= -half else free


def backlash_force(p, x, v, z):
    z = np.clip(z, -0.5 * p["gap"], 0.5 * p["gap"])
    return p["stiffness"] * (x - z) + p["damping"] * (v - backlash_rate(p, x, v, z))


def contact_force(p, x, v, z):
    depth = x - p["gap"]
    return max(0.0, p["stiffness"] * depth + p["damping"] * v) if depth > 0 else 0.0


def hunt_crossley_force(p, x, v, z):
    depth = x - p["gap"]
    return max(0.0, depth ** p["exponent"] * (p["stiffness"] + p["damping"] * v)) if depth > 0 else 0.0


# Force of an element, and rate of its memory where it has one.
FORCE = {
    "spring": lambda p, x, v, z: p["stiffness"] * (x - p.get("rest", 0.0)),
    "damper": lambda p, x, v, z: p["damping"] * v,
    "asymmetric_damper": lambda p, x, v, z: p["positive" if v > 0 else "negative"] * v,
    "quadratic_drag": lambda p, x, v, z: p["coefficient"] * v * abs(v),
    "cubic_spring": lambda p, x, v, z: p["stiffness"] * x + p["cubic"] * x**3,
    "cogging": lambda p, x, v, z: p["amplitude"] * np.sin(TAU * x / p["period"] + p["phase"]),
    "bias": lambda p, x, v, z: p["force"],
    "dahl": lambda p, x, v, z: p["stiffness"] * z,
    "lugre": lambda p, x, v, z: p["stiffness"] * z + p["damping"] * lugre_rate(p, x, v, z),
    "hysteretic_spring": lambda p, x, v, z: z,
    "bouc_wen": lambda p, x, v, z: p["stiffness"] * (p["ratio"] * x + (1 - p["ratio"]) * z),
    "backlash": backlash_force,
    "contact": contact_force,
    "hunt_crossley": hunt_crossley_force,
}
RATE = {
    "dahl": lambda p, x, v, z: v - abs(v) * p["stiffness"] * z / p["coulomb"],
    "lugre": lugre_rate,
    "hysteretic_spring": hysteretic_rate,
    "bouc_wen": bouc_wen_rate,
    "backlash": backlash_rate,
}
# Level of dry friction for v > 0 and for v < 0, as positive numbers.
LEVEL = {
    "coulomb": lambda p, v: (p["force"], p["force"]),
    "asymmetric_coulomb": lambda p, v: (p["positive"], p["negative"]),
    "stribeck": lambda p, v: (bristle_level(p, v),) * 2,
    "friction_deficit": lambda p, v: (p["coulomb"] - (p["coulomb"] - p["rest"]) * np.exp(-((v / p["velocity"]) ** 2)),) * 2,
}


class Reference:
    """The equations of motion of a model, for solve_ivp. At most one dry friction, from a body to ground."""

    def __init__(self, model, inputs, period):
        self.bodies = list(model["bodies"])
        self.place = {name: index for index, name in enumerate(self.bodies)} | {"ground": -1}
        self.mass = np.diag([float(m) for m in model["bodies"].values()])
        self.elements, self.friction = [], None
        for e in model["elements"]:
            a, b = (self.place[name] for name in e["between"])
            if e["kind"] == "inerter":
                for i, j, sign in ((a, a, 1), (b, b, 1), (a, b, -1), (b, a, -1)):
                    if i >= 0 and j >= 0:
                        self.mass[i, j] += sign * e["inertance"]
            elif e["kind"] in LEVEL:
                assert self.friction is None and b < 0
                self.friction = (a, e)
            self.elements.append((e, a, b))
        self.memories = [k for k, (e, _, _) in enumerate(self.elements) if e["kind"] in RATE]
        self.inputs, self.outputs = model["inputs"], model["outputs"]
        self.moved = {self.place[q["on"]]: q for q in self.inputs if q["kind"] == "motion"}
        self.free = [i for i in range(len(self.bodies)) if i not in self.moved]
        self.lagged = [q["name"] for q in self.inputs if q.get("bandwidth")]
        self.period, self.samples = period, inputs
        t = period * np.arange(len(next(iter(inputs.values()))))
        self.t = t
        self.spline = {q["name"]: CubicSpline(t, inputs[q["name"]]) for q in self.inputs}
        self.mode, self.middle = 0, 0.0

    def hold(self, q):
        return q.get("hold", "zero" if q["kind"] == "force" else "cubic")

    def signal(self, q, t, order=0):
        """Gain, saturation and delay of an input, as it runs in the piece that `self.middle` lies in."""
        late = q.get("delay", 0.0)
        t, middle, samples = t - late, self.middle - late, self.samples[q["name"]]
        held = self.hold(q)
        if middle <= 0.0:
            y = samples[0] if order == 0 else 0.0
        elif held == "cubic":
            y = float(self.spline[q["name"]](t, order))
        else:
            k = min(int(middle / self.period), len(samples) - 2)
            slope = 0.0 if held == "zero" else (samples[k + 1] - samples[k]) / self.period
            y = [samples[k] + slope * (t - k * self.period), slope, 0.0][order]
        y *= q.get("gain", 1.0)
        limit = q.get("saturation", np.inf)
        return min(max(y, -limit), limit) if q["kind"] == "force" else y

    def state(self, s, t):
        """Positions and velocities of all bodies, memories, lags."""
        n, f = len(self.bodies), len(self.free)
        x, v, a = np.zeros(n + 1), np.zeros(n + 1), np.zeros(n)
        x[self.free], v[self.free] = s[:f], s[f : 2 * f]
        for i, q in self.moved.items():
            x[i], v[i], a[i] = (self.signal(q, t, order) for order in range(3))
        z = s[2 * f : 2 * f + len(self.memories)]
        return x, v, a, z, s[2 * f + len(self.memories) :]

    def push(self, s, t):
        """Forces of the elements without dry friction, and their sum on each body."""
        x, v, a, z, lag = self.state(s, t)
        total, forces = np.zeros(len(self.bodies) + 1), {}
        for k, (e, i, j) in enumerate(self.elements):
            if e["kind"] in LEVEL or e["kind"] == "inerter":
                continue
            memory = z[self.memories.index(k)] if k in self.memories else 0.0
            forces[k] = FORCE[e["kind"]](e, x[i] - x[j], v[i] - v[j], memory)
            total[i] -= forces[k]
            total[j] += forces[k]
        for q in self.inputs:
            if q["kind"] == "force":
                u = lag[self.lagged.index(q["name"])] if q["name"] in self.lagged else self.signal(q, t)
                i = self.place[q["on"]]
                total[i] += u - q.get("back_emf", 0.0) * v[i]
        return x, v, a, z, lag, total[:-1], forces

    def motion(self, s, t):
        """Accelerations, the friction force, and everything that they come from."""
        x, v, a, z, lag, total, forces = self.push(s, t)
        total = total.copy()
        friction = 0.0
        if self.friction:
            i, e = self.friction
            if self.mode == 0:  # what keeps it at rest: the mass matrix of such cases is diagonal
                friction = total[i]
            else:
                positive, negative = LEVEL[e["kind"]](e, v[i])
                friction = positive if self.mode > 0 else -negative
            total[i] -= friction
        f, p = self.free, list(self.moved)
        right = total[f] - (self.mass[np.ix_(f, p)] @ a[p] if p else 0.0)
        a[f] = np.linalg.solve(self.mass[np.ix_(f, f)], right)
        return x, v, a, z, lag, total, forces, friction

    def rate(self, t, s):
        x, v, a, z, lag, _, _, _ = self.motion(s, t)
        zdot = []
        for memory, k in zip(z, self.memories):
            e, i, j = self.elements[k]
            zdot.append(RATE[e["kind"]](e, x[i] - x[j], v[i] - v[j], memory))
        inputs = {q["name"]: q for q in self.inputs}
        ldot = [TAU * inputs[n]["bandwidth"] * (self.signal(inputs[n], t) - y) for n, y in zip(self.lagged, lag)]
        return np.concatenate([v[self.free], a[self.free], zdot, ldot])

    def pieces(self):
        """Between these times the inputs are smooth."""
        ends = {0.0, self.t[-1]}
        for q in self.inputs:
            if self.hold(q) != "cubic":
                ends |= {t for t in np.round(self.t + q.get("delay", 0.0), 12) if 0 < t < self.t[-1]}
            elif q.get("delay"):
                ends.add(q["delay"])
        ends = np.array(sorted(ends))
        return ends[np.concatenate([[True], np.diff(ends) > 1e-9])]

    def solve(self, tolerance):
        size = 2 * len(self.free) + len(self.memories) + len(self.lagged)
        s, spans = np.zeros(size), []
        events = self.events() if self.friction else None
        pieces = self.pieces()
        for start, end in zip(pieces[:-1], pieces[1:]):
            self.middle = 0.5 * (start + end)
            while start < end - 1e-13:
                done = solve_ivp(self.rate, (start, end), s, "DOP853", rtol=tolerance, atol=1e-4 * tolerance,
                                 max_step=2 * self.period, dense_output=True, events=events)  # fmt: skip
                assert done.success, done.message
                spans.append((self.middle, done.t[-1], done.sol, self.mode))
                start, s = done.t[-1], done.y[:, -1].copy()
                if done.status == 1:
                    s = self.switch(start, s)
        return self.read(spans)

    def events(self):
        """A slide ends at velocity 0; rest ends when the push exceeds the level at rest."""
        place, e = self.friction
        at = self.free.index(place)
        positive, negative = LEVEL[e["kind"]](e, 0.0)

        def stops(t, s):
            return s[len(self.free) + at] * self.mode if self.mode else 1.0

        def leaves(t, s):
            if self.mode:
                return 1.0
            need = self.push(s, t)[5][place]
            return min(positive - need, need + negative)

        for event in (stops, leaves):
            event.terminal, event.direction = True, -1
        return [stops, leaves]

    def switch(self, t, s):
        place, e = self.friction
        need = self.push(s, t)[5][place]
        positive, negative = LEVEL[e["kind"]](e, 0.0)
        s[len(self.free) + self.free.index(place)] = 0.0
        was = self.mode
        if was == 0:
            self.mode = 1 if need > 0 else -1
        else:
            self.mode = 1 if need > positive else -1 if need < -negative else 0
        return s

    def read(self, spans):
        """The outputs, with gain, delay and offset; what jumps at a sample is that before it."""
        names = {e["name"]: k for k, (e, _, _) in enumerate(self.elements)}
        cache, found = {}, {o["name"]: [] for o in self.outputs}
        spans_end = np.array([span[1] for span in spans])

        def at(t):
            if t not in cache:
                index = min(int(np.searchsorted(spans_end, t - 1e-12)), len(spans) - 1)
                self.middle, self.mode = spans[index][0], spans[index][3]
                cache[t] = self.motion(spans[index][2](t), t)
            return cache[t]

        for o in self.outputs:
            for sample in self.t:
                x, v, a, _, _, total, forces, friction = at(max(0.0, round(sample - o.get("delay", 0.0), 12)))
                if o["kind"] == "force":
                    y = 0.0
                    for name in [o["element"]] if isinstance(o["element"], str) else o["element"]:
                        e, i, j = self.elements[names[name]]
                        if e["kind"] == "inerter":
                            b = np.append(a, 0.0)
                            y += e["inertance"] * (b[i] - b[j])
                        else:
                            y += friction if e["kind"] in LEVEL else forces[names[name]]
                elif o["kind"] == "reaction":
                    i = self.place[o["of"]]
                    y = self.mass[i] @ a - total[i]
                else:
                    y = {"position": x, "velocity": v, "acceleration": a}[o["kind"]][self.place[o["of"]]]
                found[o["name"]].append(o.get("gain", 1.0) * y + o.get("offset", 0.0))
        return {name: np.array(y) for name, y in found.items()}


def element(kind, *between, name=None, **parameters):
    return {"name": name or kind, "kind": kind, "between": list(between), **parameters}


def outputs(*asked):
    """`("position", "m")` or `("force", "spring", ...)`; outputs are named y0, y1, ..."""
    return [
        {"name": f"y{i}", "kind": k, "element": list(of)} if k == "force" else {"name": f"y{i}", "kind": k, "of": of[0], **dict(more)}
        for i, (k, *rest) in enumerate(asked)
        for of, more in [([r for r in rest if isinstance(r, str)], {key: x for r in rest if isinstance(r, dict) for key, x in r.items()})]
    ]


def smooth(t, amplitude, *tones):
    """Tones that set in without a jump in velocity or acceleration."""
    start = 1 - np.exp(-((t / 0.05) ** 3))
    return amplitude * start * sum(np.sin(TAU * f * t + 0.3 * i) for i, f in enumerate(tones)) / len(tones)


def one(law, mass=0.2, spring=200.0, damping=0.4, extra=()):
    """One mass on a spring and a damper with the element beside them, pushed."""
    held = [element("spring", "m", "ground", stiffness=spring), element("damper", "m", "ground", damping=damping)]
    asked = outputs(("position", "m"), ("velocity", "m"), ("acceleration", "m"), ("force", law["name"]))
    force = {"name": "push", "kind": "force", "on": "m", "hold": "cubic"}
    return {"bodies": {"m": mass}, "elements": held + [law, *extra], "inputs": [force], "outputs": asked}


def chain(hold):
    between = [("a", "b"), ("b", "c"), ("c", "ground")]
    elements = []
    for i, ends in enumerate(between):
        elements += [element("spring", *ends, name=f"k{i}", stiffness=[3000.0, 900.0, 400.0][i], rest=[0.0, 1e-3, 0.0][i])]
        elements += [element("damper", *ends, name=f"b{i}", damping=[1.5, 0.8, 0.6][i])]
    elements += [element("inerter", "a", "c", inertance=0.02), element("bias", "b", "ground", force=0.3)]
    asked = outputs(("position", "a"), ("velocity", "b"), ("position", "c"))
    if hold != "zero":
        asked = outputs(("position", "a"), ("velocity", "b"), ("acceleration", "c"), ("force", "k1", "b1"), ("force", "inerter"))
    return {
        "bodies": {"a": 0.03, "b": 0.08, "c": 0.1},
        "elements": elements,
        "inputs": [{"name": "push", "kind": "force", "on": "a", "hold": hold}],
        "outputs": asked,
    }


def compensator():
    """An inerter behind a spring on a moved ram, with a massive ram, as the force of a test rig reads it."""
    return {
        "bodies": {"ram": 0.7, "disc": 0.0, "flywheel": 0.0},
        "elements": [
            element("spring", "ram", "disc", stiffness=480e3),
            element("damper", "ram", "disc", name="shaft", damping=300.0),
            element("inerter", "disc", "ground", name="b1", inertance=21.6),
            element("inerter", "flywheel", "ground", name="b2", inertance=98.4),
            element("damper", "disc", "flywheel", name="oil", damping=5518.0),
            element("quadratic_drag", "disc", "ground", coefficient=4000.0),
        ],
        "inputs": [{"name": "push", "kind": "motion", "on": "ram"}],
        "outputs": outputs(("reaction", "ram"), ("position", "disc"), ("velocity", "flywheel"), ("force", "b2")),
    }


def actuated(**keys):
    """A mass that a lagging, late, limited actuator with back-EMF pushes; sensors with gain, delay and offset."""
    model = one(element("cubic_spring", "m", "ground", stiffness=100.0, cubic=4e4))
    model["inputs"][0].update(keys)
    late = {"gain": 1.2, "delay": 0.0023, "offset": 0.01}
    model["outputs"] = outputs(("position", "m", late), ("velocity", "m", {"delay": 0.004}), ("acceleration", "m"))
    return model


def dragged():
    """A mass that sticks and slips behind a moved one."""
    elements = [element("spring", "lead", "m", stiffness=300.0), element("damper", "lead", "m", damping=2.0)]
    elements += [element("spring", "m", "n", name="k2", stiffness=500.0), element("damper", "m", "n", name="b2", damping=0.5)]
    elements += [element("stribeck", "n", "ground", coulomb=0.3, static=0.45, velocity=0.03)]
    return {
        "bodies": {"lead": 0.0, "m": 0.1, "n": 0.15},
        "elements": elements,
        "inputs": [{"name": "push", "kind": "motion", "on": "lead"}],
        "outputs": outputs(("position", "m"), ("position", "n"), ("velocity", "n"), ("reaction", "lead")),
    }


# Why a limit at the chosen step is above 1e-3.
TOUCH = "the shaft's force sets in with a jump at an instant known to a step only: first order there, and every bounce carries it on"


def cases():
    """Name, model, samples of the input, limit at the chosen step, limit at the fine step, reason."""
    t = PERIOD * np.arange(1000)
    push = smooth(t, 2.5, 2.3, 7.1)
    rough = np.cumsum(np.random.default_rng(1).standard_normal(250)) * np.minimum(1.0, np.arange(250) / 20.0)
    yield "linear chain, cubic hold", chain("cubic"), push, 1e-6, 1e-6, ""
    yield "linear chain, linear hold", chain("linear"), rough, 1e-6, 1e-6, ""
    yield "linear chain, zero hold", chain("zero"), rough, 1e-6, 1e-6, ""

    def beside(law, *extra, force=push, spring=200.0, limit=1e-3, fine=1e-6, name=None, why=""):
        return name or law["kind"], one(law, spring=spring, extra=extra), force, limit, fine, why

    m = ("m", "ground")
    yield beside(element("cubic_spring", *m, stiffness=50.0, cubic=4e5))
    yield beside(element("quadratic_drag", *m, coefficient=8.0))
    yield beside(element("asymmetric_damper", *m, positive=6.0, negative=1.5))
    yield beside(element("cogging", *m, amplitude=0.25, period=4e-3, phase=0.4))
    loop = dict(stiffness_positive=390.0, stiffness_negative=400.0, offset_positive=0.3, offset_negative=-0.2, bandwidth=2500.0)
    yield beside(element("hysteretic_spring", *m, **loop), spring=50.0)
    for n in (1.0, 1.7):
        wen = dict(stiffness=400.0, ratio=0.3, amplitude=1.0, beta=0.6 * 500.0**n, gamma=0.4 * 500.0**n, exponent=n)
        yield beside(element("bouc_wen", *m, **wen), spring=50.0, name=f"bouc_wen, exponent {n}")
    yield beside(element("dahl", *m, stiffness=2000.0, coulomb=0.5))
    yield beside(element("lugre", *m, stiffness=4000.0, damping=4.0, coulomb=0.5, static=0.7, velocity=0.01))
    weight = element("bias", *m, force=-4.0)
    wall, foam = dict(stiffness=1500.0, damping=3.0), dict(stiffness=3e4, damping=4e4, exponent=1.5)
    for kind, p in (("contact", wall), ("hunt_crossley", foam)):
        yield beside(element(kind, *m, gap=0.0, **p), weight, force=0.4 * push, name=f"{kind}, always touching")
        yield beside(element(kind, *m, gap=4e-3, **p), name=f"{kind}, touching and leaving")
    slack = element("backlash", *m, gap=4e-3, stiffness=1000.0, damping=6.0)
    yield beside(slack, spring=20.0, limit=1e-2, fine=1e-4, why=TOUCH)
    yield "bandwidth, back-EMF, gain", actuated(gain=1.3, bandwidth=15.0, back_emf=2.0), push, 1e-3, 1e-6, ""
    yield "saturation, delay, bandwidth", actuated(saturation=1.2, delay=0.0042, bandwidth=15.0), push, 1e-3, 1e-6, ""
    yield "motion input, inerters, reaction", compensator(), smooth(t, 2e-3, 3.1, 8.7), 1e-3, 1e-6, ""
    dry = {
        "coulomb": dict(force=0.4),
        "asymmetric_coulomb": dict(positive=0.5, negative=0.25),
        "stribeck": dict(coulomb=0.3, static=0.5, velocity=0.02),
        "friction_deficit": dict(coulomb=0.5, rest=0.3, velocity=0.02),
    }
    for kind, p in dry.items():
        yield beside(element(kind, *m, **p), name=f"{kind}, with rests")
    servo = dragged()
    servo["inputs"][0]["hold"] = "linear"
    servo["elements"][-1] = element("damper", "n", "ground", name="drag", damping=0.7)
    servo["outputs"] = outputs(("position", "m"), ("velocity", "n"), ("force", "spring", "damper"))
    yield "linear motion, force of its spring and damper", servo, smooth(t, 5e-3, 1.1, 6.9), 1e-3, 1e-6, ""
    yield "stribeck on the second of two masses", dragged(), 6.0 * smooth(t, 1e-3, 1.1, 2.9), 1e-3, 1e-6, ""


def errors(found, expected, model):
    """Of motions the largest error, of forces and accelerations (which may jump between two samples) the root mean square."""
    motions, forces = [0.0], [0.0]
    for output in model["outputs"]:
        y = output["name"]
        if output["kind"] in ("position", "velocity"):
            motions.append(share_of_range(found[y], expected[y]))
        else:
            forces.append(float(np.sqrt(np.mean((found[y] - expected[y]) ** 2)) / np.ptp(expected[y])))
    return [max(motions), max(forces)]


def main():
    if len(sys.argv) != 2:
        sys.exit(__doc__)
    program = Backdrive(sys.argv[1])
    print(f"Samples every {1e3 * PERIOD:.0f} ms. x, v: largest error; a, f: root mean square error; as shares of the range.")
    table = Table("against SciPy", ["x, v chosen", "a, f chosen", "x, v at 5 us", "a, f at 5 us", "SciPy's own"])
    for name, model, push, limit, fine_limit, why in cases():
        inputs = {"push": push}
        exact, loose = (Reference(model, inputs, PERIOD).solve(tolerance) for tolerance in (1e-10, 1e-8))
        ours = [errors(program.simulate(model, inputs, PERIOD, step), exact, model) for step in (None, FINE)]
        table.row(name, [*ours[0], *ours[1], max(errors(loose, exact, model))], [limit, limit, fine_limit, fine_limit], why)
    table.verdict()


if __name__ == "__main__":
    main()
