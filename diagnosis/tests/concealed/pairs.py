"""Pairs of explanations that recordings of a limited motion do not tell apart, each for a reason in physics; see README.md.

A kind of pair draws a device (its nominal structure with the true numbers), what it is driven with, and the explanations that are rivals under it. One of them is
hidden in the device. How loud the noise is follows from how near the rivals come: see `rivals.py`.
"""
import numpy as np
from excitation import log_uniform, smooth
from families import element, r4

NESTED = ("asymmetric_coulomb", "contact")    # laws that do all that a simpler rival does, and more
SIGNALS = ("delay", "bandwidth", "gain", "saturation", "back_emf")


def put(base, effect):
    """The device with an effect in it."""
    import copy
    m = copy.deepcopy(base)
    if effect["kind"] in SIGNALS:
        q = next(q for q in m["inputs"] + m["outputs"] if q["name"] == effect["place"])
        q.update(effect["numbers"])
    else:
        m["elements"].append(element("hidden", effect["kind"], *effect["place"], **effect["numbers"]))
    return m


def numbers(kind, force, x, v, rng):
    """Numbers of a law with which its force has about the root mean square `force` in this motion."""
    rms = lambda a: float(np.sqrt(np.mean(np.square(a)))) + 1e-300
    peak = float(np.max(np.abs(x))) + 1e-300
    if kind == "damper":
        return dict(damping=force / rms(v))
    if kind == "coulomb":
        return dict(force=force)
    if kind == "quadratic_drag":
        return dict(coefficient=force / rms(v * np.abs(v)))
    if kind == "bias":
        return dict(force=force)
    if kind == "asymmetric_coulomb":
        return dict(positive=force, negative=force * rng.uniform(0.2, 0.6))
    if kind == "spring":
        return dict(stiffness=force / rms(x))
    if kind == "contact":
        return dict(stiffness=force / rms(x), damping=0.02 * force / rms(v), gap=0.0)
    raise ValueError(kind)


class Draw:
    """What all kinds of pairs need: a device of one or two bodies, and what drives it."""

    def __init__(self, rng, name):
        self.rng, self.name = rng, name
        self.f0 = log_uniform(rng, 3, 12)
        self.mass = log_uniform(rng, 0.05, 5)
        self.w = 2 * np.pi * self.f0
        self.amplitude = r4(self.mass * log_uniform(rng, 1, 20))
        self.bodies, self.elements, self.outputs = {}, [], []

    def body(self, name, mass):
        self.bodies[name] = r4(mass)

    def spring(self, a, b, stiffness, damping=0.0):
        self.elements.append(element("%s_%s" % (a, b), "spring", a, b, stiffness=r4(stiffness)))
        if damping:
            self.elements.append(element("%s_%s_damping" % (a, b), "damper", a, b, damping=r4(damping)))

    def damper(self, a, damping):
        self.elements.append(element(a + "_drag", "damper", a, "ground", damping=r4(damping)))

    def output(self, kind, of):
        self.outputs.append(dict(name="%s_%s" % (of, kind), kind=kind, **({"element": of} if kind == "force" else {"of": of})))

    def model(self, on):
        hold = str(self.rng.choice(["zero", "linear"]))
        return dict(name="rivals", title="Axis on a bench", source="nominal data sheet values", motion="translation", bodies=self.bodies, elements=self.elements,
                    inputs=[dict(name="drive", kind="force", on=on, hold=hold)], outputs=self.outputs)

    def reading(self, body):
        self.output(str(self.rng.choice(["position", "velocity"])), body)

    def sine(self, f, n, ts, amplitude=1.0):
        t = np.arange(n) * ts
        return amplitude * self.amplitude * np.sin(2 * np.pi * f * t)

    def lines(self, low, high, n, ts, count=12):
        t, u = np.arange(n) * ts, np.zeros(n)
        for f in np.geomspace(low, high, count):
            u += np.sin(2 * np.pi * f * t + self.rng.uniform(0, 2 * np.pi))
        return self.amplitude * 0.4 * u / np.std(u) * np.minimum(1.0, np.arange(n) / (0.03 * n))

    def pushes(self, n, ts):
        """A push that only goes one way: a short kick to get going, then a force that never ends."""
        t = np.arange(n) * ts
        u = 1 + sum(0.12 * np.sin(2 * np.pi * f * t + self.rng.uniform(0, 6.28)) for f in self.f0 * self.rng.uniform(0.3, 2, 3))
        u[: int(0.04 * n)] *= self.rng.uniform(3.6, 4.4)
        u[0] = 0.0
        return self.amplitude * u


def two_stiff(d):
    """A motor and a load behind a joint whose frequency is far above all that is played."""
    share = d.rng.uniform(0.3, 0.7)
    d.body("motor", share * d.mass)
    d.body("load", (1 - share) * d.mass)
    reduced = share * (1 - share) * d.mass
    stiffness = reduced * (d.w * d.rng.uniform(12, 15)) ** 2
    d.spring("motor", "load", stiffness, 0.04 * np.sqrt(stiffness * reduced))


def one_amplitude(d):
    """At one amplitude and one frequency drag that grows with the square of the speed and viscous friction that take the same energy from a cycle are one: what else
    they do lies at three times the frequency, where the mass hardly follows."""
    d.body("carriage", d.mass)
    d.spring("carriage", "ground", d.mass * (d.w * d.rng.uniform(0.15, 0.3)) ** 2)
    d.output("position", "carriage")
    n, ts = 1400, r4(1 / (70 * d.f0))
    plays = [d.amplitude * np.cos(2 * np.pi * q * d.f0 * np.arange(n) * ts) for q in (1.0, 1.04, 1.02)]
    place = ("carriage", "ground")
    return d.model("carriage"), [(k, place) for k in ("damper", "quadratic_drag")], plays, ts, (0.2, 0.45)


def side_of_a_joint(kind):
    def make(d):
        two_stiff(d)
        d.spring("load", "ground", d.mass * d.w**2, 0.2 * d.mass * d.w)
        d.output("position", "motor")
        n, ts = 1400, r4(1 / (160 * d.f0))
        plays = [d.lines(0.3 * d.f0, 1.2 * d.f0, n, ts, 6) for _ in range(3)]
        return d.model("motor"), [(kind, (b, "ground")) for b in ("motor", "load")], plays, ts, (0.1, 0.35)
    return make


def bias_or_friction(d):
    """While a body only moves one way, dry friction, lopsided friction and a constant force are the same number."""
    d.body("carriage", d.mass)
    d.damper("carriage", d.mass * d.w)
    d.reading("carriage")
    n, ts = 1400, r4(1 / (60 * d.f0))
    plays = [d.pushes(n, ts) for _ in range(3)]
    place = ("carriage", "ground")
    return d.model("carriage"), [(k, place) for k in ("bias", "coulomb", "asymmetric_coulomb")], plays, ts, (0.1, 0.35)


def spring_or_stop(d):
    """While a body is only ever pressed one way, a spring and a stop that it leans on are the same."""
    d.body("carriage", d.mass)
    d.damper("carriage", 1.2 * d.mass * d.w)
    d.reading("carriage")
    n, ts = 1400, r4(1 / (60 * d.f0))
    plays = [d.pushes(n, ts) for _ in range(3)]
    place = ("carriage", "ground")
    return d.model("carriage"), [(k, place) for k in ("spring", "contact")], plays, ts, (0.3, 0.6)


def delay_or_lag(d):
    """Far below its corner a first-order lag is a delay of its time constant."""
    d.body("carriage", d.mass)
    d.spring("carriage", "ground", d.mass * d.w**2, 0.1 * d.mass * d.w)
    d.output("position", "carriage")
    d.output("force", "carriage_ground")
    n, ts = 1600, r4(1 / (110 * d.f0))
    plays = [d.lines(0.3 * d.f0, 1.6 * d.f0, n, ts) for _ in range(3)]
    return d.model("carriage"), [(k, "drive") for k in ("delay", "bandwidth")], plays, ts, (0.006, 0.02)


def gain_or_limit(d):
    """Where every step of a force is as large as the others, a drive that ends below it and one of a smaller gain do the same. The limit is what is hidden: a gain of the
    drive is that of the force sensor with all masses and stiffnesses off, whatever is played."""
    d.body("carriage", d.mass)
    d.spring("carriage", "ground", d.mass * d.w**2, 0.2 * d.mass * d.w)
    d.output("position", "carriage")
    d.output("force", "carriage_ground")
    n, ts = 1400, r4(1 / (70 * d.f0))
    plays = []
    for _ in range(3):
        levels = d.rng.choice([-1.0, 0.0, 1.0], size=40)
        knots = np.cumsum(np.concatenate([[0.02 * n], d.rng.uniform(0.3, 1.2, 39) / d.f0 / ts])).astype(int)
        u = np.zeros(n)
        for at, level in zip(knots, levels):
            u[at:] = level
        plays.append(d.amplitude * u)
    return d.model("carriage"), [(k, "drive") for k in ("gain", "saturation")], plays, ts, (0.6, 0.85)


def constant_side(d):
    """A constant force on either side of a joint differs by the joint's twist alone, whatever else is played: no excitation tells, a sensor behind the joint does."""
    two_stiff(d)
    d.spring("load", "ground", d.mass * d.w**2, 0.1 * d.mass * d.w)
    d.output("position", "motor")
    n, ts = 1600, r4(1 / (110 * d.f0))
    plays = [d.lines(0.3 * d.f0, 1.4 * d.f0, n, ts) for _ in range(3)]
    return d.model("motor"), [("bias", (b, "ground")) for b in ("motor", "load")], plays, ts, (0.1, 0.35)


def one_force(d):
    """Back-EMF and a damper on the driven body are one force under two names."""
    d.body("carriage", d.mass)
    d.spring("carriage", "ground", d.mass * d.w**2)
    d.reading("carriage")
    n, ts = 1400, r4(1 / (70 * d.f0))
    plays = [d.lines(0.3 * d.f0, 2 * d.f0, n, ts) for _ in range(3)]
    return d.model("carriage"), [("damper", ("carriage", "ground")), ("back_emf", "drive")], plays, ts, (0.1, 0.3)


KINDS = {"one-amplitude": one_amplitude, "dry-side": side_of_a_joint("coulomb"), "drag-side": side_of_a_joint("quadratic_drag"),
         "bias-or-friction": bias_or_friction, "spring-or-stop": spring_or_stop, "delay-or-lag": delay_or_lag, "gain-or-limit": gain_or_limit,
         "constant-side": constant_side, "one-force": one_force}
# Kinds of which only one of the explanations is ever hidden.
HIDDEN = {"gain-or-limit": "saturation"}
# How often each is drawn, where not once: three laws have three times the pairs.
WEIGHTS = {"bias-or-friction": 3, "one-force": 0.5}
