"""A second simulator, for laws that `sim.c` does not have and for loops that close through a force.

The linear part of a device is advanced exactly, by its matrix exponential. Every other law is a force that is constant over a short step, taken
from the state in the middle of it. Dry friction is set-valued: of the forces within its level the one that has the contact at rest at the end of
the step, or the level where none does.
"""
import math

import numpy as np
from scipy.linalg import expm

OWN = ("load_friction", "warm_friction")
FRICTION = ("coulomb", "asymmetric_coulomb", "stribeck", "friction_deficit") + OWN
LINEAR = ("spring", "damper", "cubic_spring")
OTHERS = ("cubic_spring", "backlash", "quadratic_drag", "asymmetric_damper", "cogging", "bias", "contact")
STEP, MOST = 40e-6, 25     # s, a step of recordings, but no more of them in a sample
INSTANT = 1e-6             # s before a sample: what is read there has not seen the force jump


def knows(model):
    """Whether everything in the model is simulated here."""
    kinds = all(e["kind"] in FRICTION + LINEAR + OTHERS for e in model["elements"])
    return kinds and all(q["kind"] == "force" and not set(q) & {"bandwidth", "saturation", "back_emf"} for q in model["inputs"]) \
        and all(o["kind"] != "reaction" and "delay" not in o for o in model["outputs"])


def needed(model):
    return any(e["kind"] in OWN for e in model["elements"])


def joint(model, place):
    """What loads friction at a place: between two bodies their joint, else that of the body with the first other body, else its springs to ground."""
    springs = [e["between"] for e in model["elements"] if e["kind"] in ("spring", "cubic_spring")]
    body = place[0] if place[0] != "ground" else place[1]
    inner = [p for p in springs if body in p and "ground" not in p]
    wanted = set(place) if "ground" not in place else set(inner[0]) if inner else {body, "ground"}
    return next((tuple(p) for p in springs if set(p) == wanted), None)


def relative(values, ends):
    a, b = ends
    return (values[a] if a >= 0 else 0.0) - (values[b] if b >= 0 else 0.0)


class Drive:
    """An input between its samples, behind gain and delay: its mean over any time."""

    def __init__(self, q, body, u, ts):
        self.u, self.ts, self.body, self.linear = u, ts, body, q.get("hold", "zero") == "linear"
        self.gain, self.delay, self.sums = q.get("gain", 1.0), q.get("delay", 0.0), [0.0]

    def integral(self, t):
        if t <= 0:
            return self.u[0] * t
        k = min(int(t / self.ts + 1e-9), len(self.u) - 2)
        while len(self.sums) <= k:
            i = len(self.sums) - 1
            self.sums.append(self.sums[i] + self.ts * (0.5 * (self.u[i] + self.u[i + 1]) if self.linear else self.u[i]))
        r = t - k * self.ts
        return self.sums[k] + r * (self.u[k] + (0.5 * r * (self.u[k + 1] - self.u[k]) / self.ts if self.linear else 0.0))

    def mean(self, t, h):
        return self.gain * (self.integral(t + h - self.delay) - self.integral(t - self.delay)) / h


class Device:
    """A device that is advanced by steps of h. Its state is the positions of its bodies, then their velocities."""

    def __init__(self, model, h):
        self.h, self.names, self.n = h, list(model["bodies"]), len(model["bodies"])
        index = dict({b: i for i, b in enumerate(self.names)}, ground=-1)
        self.elements = [dict(e, ends=tuple(index[b] for b in e["between"])) for e in model["elements"]]
        M, K, D = np.diag([float(m) for m in model["bodies"].values()]), np.zeros((self.n, self.n)), np.zeros((self.n, self.n))
        for e in self.elements:
            row = self.row(e)
            if e["kind"] in LINEAR:
                matrix, key = (D, "damping") if e["kind"] == "damper" else (K, "stiffness")
                matrix += e[key] * np.outer(row, row)
        self.index, inverse = index, np.linalg.inv(M)
        A = np.block([[np.zeros_like(M), np.eye(self.n)], [-inverse @ K, -inverse @ D]])
        B = np.vstack([np.zeros_like(M), inverse])
        self.fall, self.lift = A[self.n:], B[self.n:]
        self.step, self.push = discrete(A, B, h)
        self.half, self.half_push = discrete(A, B, 0.5 * h)
        self.state, self.inner = np.zeros(2 * self.n), np.zeros(self.n)
        self.others = [dict(e, row=self.row(e), now=0.0) for e in self.elements if e["kind"] in OTHERS]
        self.contacts = [dict(e, row=self.row(e), kick=self.push @ self.row(e), now=0.0, warming=0.0, loads=self.loads(model, e))
                         for e in self.elements if e["kind"] in FRICTION]
        self.W = [[float(c["row"] @ k["kick"][self.n:]) for k in self.contacts] for c in self.contacts]

    def row(self, e):
        row = np.zeros(self.n)
        for end, sign in zip(e["ends"], (1.0, -1.0)):
            if end >= 0:
                row[end] += sign
        return row

    def loads(self, model, e):
        """The springs of the joint that loads a friction, each with its sign along the joint."""
        if e["kind"] != "load_friction" or not (pair := joint(model, e["between"])):
            return []
        return [(q, 1.0 if tuple(q["between"]) == pair else -1.0) for q in self.elements
                if q["kind"] in ("spring", "cubic_spring") and set(q["between"]) == set(pair)]

    def other(self, e, x, v):
        """The force of a law that is neither linear nor dry friction, at the middle of a step."""
        kind = e["kind"]
        if kind == "cubic_spring":
            return e["cubic"] * x**3
        if kind == "backlash":                         # in the gap the shaft's twist fades out; at its sides it pushes, and never pulls
            side, k, c = 0.5 * e["gap"], e["stiffness"], e["damping"]
            within = min(max(x - e.get("twist", 0.0) * math.exp(-k * self.h / c), -side), side)
            e["twist"] = x - within
            push = k * e["twist"] + c * v
            return push if abs(within) == side and push * within > 0 else 0.0
        if kind == "quadratic_drag":
            return e["coefficient"] * v * abs(v)
        if kind == "asymmetric_damper":
            return (e["positive"] if v > 0 else e["negative"]) * v
        if kind == "cogging":
            return e["amplitude"] * math.sin(2 * math.pi * x / e["period"] + e["phase"])
        if kind == "bias":
            return e["force"]
        return max(0.0, e["stiffness"] * (x - e["gap"]) + e["damping"] * v) if x > e["gap"] else 0.0       # contact

    def level(self, c, x, v):
        """Friction forwards and backwards of a contact that slides at v, its most where it rests."""
        kind = c["kind"]
        if kind == "asymmetric_coulomb":
            return c["positive"], c["negative"]
        if kind in ("stribeck", "friction_deficit"):
            at_rest = c["static"] if kind == "stribeck" else c["rest"]
            one = c["coulomb"] + (at_rest - c["coulomb"]) * math.exp(-((v / c["velocity"]) ** 2))
        elif kind == "load_friction":
            load = sum(sign * (q["stiffness"] * (w := relative(x, q["ends"])) + q.get("cubic", 0.0) * w**3) for q, sign in c["loads"])
            one = c["force"] + c["coefficient"] * abs(load)
        else:
            one = c["force"] / (1.0 + c["warming"])
        return one, one

    def advance(self, force):
        """One step under these forces on the bodies."""
        n, h, s = self.n, self.h, self.state
        middle = (self.half @ s + self.half_push @ (force + self.inner)).tolist()
        x, v = middle[:n], middle[n:]
        pushed = force.copy()
        for e in self.others:
            e["now"] = self.other(e, relative(x, e["ends"]), relative(v, e["ends"]))
            pushed -= e["now"] * e["row"]
        new = self.step @ s + self.push @ pushed
        if self.contacts:
            free, before = new[n:].tolist(), s[n:].tolist()
            slides = [relative(free, c["ends"]) for c in self.contacts]
            bounds = [self.level(c, x, relative(v, c["ends"])) for c in self.contacts]
            self.share(slides, bounds)
            for c in self.contacts:
                new = new - c["now"] * c["kick"]
                pushed = pushed - c["now"] * c["row"]
            after = new[n:].tolist()
            for c in self.contacts:
                if c["kind"] == "warm_friction":       # fed by its own power, lost with a time constant
                    power = abs(c["now"]) * 0.5 * abs(relative(before, c["ends"]) + relative(after, c["ends"]))
                    settled = power * c["cooling_time"] / c["half_heat"]
                    c["warming"] = settled + (c["warming"] - settled) * math.exp(-h / c["cooling_time"])
        self.inner, self.state = pushed - force, new

    def share(self, slides, bounds):
        """The friction forces of all contacts at once, by projected Gauss-Seidel."""
        for _ in range(100):
            most = 0.0
            for c, (contact, (forwards, backwards)) in enumerate(zip(self.contacts, bounds)):
                slide = slides[c] - sum(w * k["now"] for w, k in zip(self.W[c], self.contacts))
                new = min(max(contact["now"] + slide / self.W[c][c], -backwards), forwards)
                most, contact["now"] = max(most, abs(new - contact["now"]) / (forwards + backwards + 1e-300)), new
            if len(self.contacts) == 1 or most < 1e-12:
                return

    def read(self, o, force):
        """An output while these forces act on the bodies."""
        if o["kind"] == "force":
            return sum(self.force(next(e for e in self.elements if e["name"] == name)) for name in np.atleast_1d(o["element"]))
        i = self.index[o["of"]]
        if o["kind"] == "acceleration":
            value = self.fall[i] @ self.state + self.lift[i] @ (force + self.inner)
        else:
            value = self.state[i if o["kind"] == "position" else self.n + i]
        return o.get("gain", 1.0) * value + o.get("offset", 0.0)

    def force(self, e):
        x, v = self.row(e) @ self.state[: self.n], self.row(e) @ self.state[self.n:]
        if e["kind"] in LINEAR:
            return e["damping"] * v if e["kind"] == "damper" else e["stiffness"] * x + e.get("cubic", 0.0) * x**3
        return next(q["now"] for q in self.contacts + self.others if q["name"] == e["name"])


def discrete(A, B, h):
    """A linear system over a step under constant forces."""
    n, m = B.shape
    E = expm(np.block([[A, B], [np.zeros((m, n + m))]]) * h)
    return E[:n, :n], E[:n, n:]


def simulate(model, U, ts, n, nsub=None, outputs=None, command=None):
    """Outputs at n samples, and the inputs as they were played. `command`: the name of an input, and the function of sample and positions that says
    its value there."""
    nsub = nsub or min(MOST, max(1, math.ceil(ts / STEP - 1e-9)))
    h, device = ts / nsub, Device(model, ts / nsub)
    outputs = model["outputs"] if outputs is None else outputs
    U = {k: np.array(u, float)[:n].tolist() for k, u in U.items()}
    drives = [Drive(q, device.index[q["on"]], U.setdefault(q["name"], [0.0] * n), ts) for q in model["inputs"]]
    Y = np.empty((n, len(outputs)))

    def forces(t, h):
        force = np.zeros(device.n)
        for d in drives:
            force[d.body] += d.mean(t, h)
        return force

    for k in range(n):
        before = forces(k * ts - INSTANT, INSTANT)
        Y[k] = [device.read(o, before) for o in outputs]
        if not np.all(np.abs(device.state) < 1e9):
            raise FloatingPointError("diverged")
        if command:
            U[command[0]][k] = command[1](k, dict(zip(device.names, device.state.tolist())))
        for i in range(nsub if k < n - 1 else 0):
            device.advance(forces(k * ts + i * h, h))
    return Y, {name: np.array(u) for name, u in U.items()}
