"""Checks `preisach_lugre` against implementations that share nothing with it.

    python preisach_check.py BACKDRIVE

A body is moved along straight lines at stated speeds, with turns within turns, and the force of its friction is read.
- Gated (gate = 1): bristles bend up to break-away and stay there, so the force is that of a grid of relays in NumPy, weighted from the
  deformed Dahl loops, or the level of sliding. A grid of n relays is good to about a cell; two grids show that.
- As printed (gate = 0): the bristles creep, and SciPy integrates eq (5) along the path, with branches that are looked up from the list
  of all past turns by the sum over Everett's function, eqs (8)-(10), and no memory of our own sort.
Errors are shares of the range of the other's force.
"""

import sys

import numpy as np
from scipy.integrate import solve_ivp

from runner import Backdrive, Table, share_of_range

PERIOD = 1e-3
P = dict(stiffness=2e4, damping=30.0, coulomb=0.9, static=1.0, velocity=2e-3, break_away=2.5e-4, loop_force=1.5, loop_slope=2e4)


def reversal_force(reach):
    """Eq (13)."""
    f, k = P["loop_force"], P["loop_slope"] * reach / P["loop_force"]
    return 0.5 * f * (np.sqrt((1 + k) ** 2 + 4 * k) - (1 + k))


def everett(high, low):
    """Force gained between turns at `low` and `high`: eq (12) of the loop that reaches as far as the further of them."""
    reach = np.maximum(np.abs(high), np.abs(low))
    f_c, f_r, s = P["loop_force"], reversal_force(reach), P["loop_slope"]
    q = high - low - reach
    rising = (-f_r * (f_c + f_r) + f_c * s * (reach + q)) / (f_c + f_r + s * (reach + q))
    return rising + f_r


class Relays:
    """Relays of ±1 on a grid of thresholds within break-away, half of them up."""

    def __init__(self, n):
        edge = P["break_away"] * np.linspace(-1.0, 1.0, n + 1)
        middle = 0.5 * (edge[1:] + edge[:-1])
        high, low = np.meshgrid(edge, edge, indexing="ij")
        gained = np.where(high > low, everett(high, np.minimum(low, high)), 0.0)
        self.weight = gained[1:, :-1] - gained[:-1, :-1] - gained[1:, 1:] + gained[:-1, 1:]
        self.up, self.down = np.meshgrid(middle, middle, indexing="ij")
        self.weight[self.down > self.up] = 0.0
        self.state = np.where(self.up + self.down > 0.0, -1.0, 1.0)
        self.state[np.isclose(self.up, -self.down)] = 0.0

    def at(self, z):
        self.state[z >= self.up] = 1.0
        self.state[z <= self.down] = -1.0
        return 0.5 * np.sum(self.weight * self.state)


def level(v):
    return P["coulomb"] + (P["static"] - P["coulomb"]) * np.exp(-((v / P["velocity"]) ** 2))


def gated(x, n):
    """Force, and the samples at which sliding begins or ends."""
    relays, z, force, sliding = Relays(n), 0.0, [0.0], [False]
    for a, b in zip(x[:-1], x[1:]):
        v = (b - a) / PERIOD
        z = np.clip(z + b - a, -P["break_away"], P["break_away"])
        bristles = relays.at(z)
        # A straight piece may break away in its middle; at its end it then slides.
        slides = abs(z) >= P["break_away"] and z * v > 0.0
        force.append(np.sign(v) * level(v) if slides else bristles + P["damping"] * v)
        sliding.append(slides)
    return np.array(force), np.flatnonzero(np.diff(sliding))


def value(turns, z):
    """Eqs (8)-(10), symmetric: the virgin curve to the outermost turn, then every way between the turns that are left."""
    turns = list(turns)
    while turns:
        limit = -turns[0] if len(turns) == 1 else turns[-2]
        if (z - turns[-1]) * (z - limit) <= 0.0 or z == turns[-1]:
            break
        turns = turns[:-2]
    gained = lambda a, b: everett(max(a, b), min(a, b)) * np.sign(b - a)
    if not turns:
        return 0.5 * gained(-z, z) if z != 0.0 else 0.0
    path = turns + [z]
    return 0.5 * gained(-turns[0], turns[0]) + sum(gained(a, b) for a, b in zip(path[:-1], path[1:]))


def settle(turns, z):
    """The turns that are left at z."""
    turns = list(turns)
    while turns:
        limit = -turns[0] if len(turns) == 1 else turns[-2]
        if (z - turns[-1]) * (z - limit) < 0.0 or z == turns[-1]:
            break
        turns = turns[:-2]
    return turns


def printed(corners, speeds):
    """Every sample of a path through `corners`, a straight line each."""
    turns, z, force, before = [], 0.0, [0.0], 0.0
    for a, b, speed in zip(corners[:-1], corners[1:], speeds):
        v = np.sign(b - a) * speed
        top = level(v)
        direction = np.sign(v)
        if before * direction < 0.0:
            turns = settle(turns, z) + [z]
        before = direction
        count = round(abs(b - a) / speed / PERIOD)
        rate = lambda t, y: v - abs(v) * value(turns, y[0]) / top
        times = PERIOD * np.arange(1, count + 1)
        found = solve_ivp(rate, (0.0, times[-1]), [z], method="LSODA", t_eval=times, rtol=1e-10, atol=1e-14, max_step=20 * PERIOD)
        bristles = np.array([value(turns, y) for y in found.y[0]])
        force.extend(bristles + P["damping"] * (v - abs(v) * bristles / top))
        z = found.y[0][-1]
    return np.array(force)


def path(corners, speeds):
    x = [0.0]
    for a, b, speed in zip(corners[:-1], corners[1:], speeds):
        count = round(abs(b - a) / speed / PERIOD)
        x.extend(a + (b - a) * np.arange(1, count + 1) / count)
    return np.array(x)


def model(gate):
    friction = {"name": "friction", "kind": "preisach_lugre", "between": ["m", "ground"], **P, "gate": gate}
    return {
        "bodies": {"m": 0.1},
        "elements": [friction],
        "inputs": [{"name": "move", "kind": "motion", "on": "m", "hold": "linear"}],
        "outputs": [{"name": "force", "kind": "force", "element": "friction"}],
    }


def main():
    if len(sys.argv) != 2:
        sys.exit(__doc__)
    program = Backdrive(sys.argv[1])
    table = Table("preisach_lugre", ["largest", "rms"])
    corners = np.array([0.0, 20e-5, -12e-5, 14e-5, -4e-5, 9e-5, 2e-5, 9e-5, -4e-5, 15e-5, -18e-5, 16e-5, 10e-5, 24e-5])
    speeds = np.full(len(corners) - 1, 4e-4)

    def row(name, gate, x, expected, limits, skip=()):
        # Where the speed jumps or bristles break away, the force jumps: which side a sample is on is not what is checked.
        found = program.simulate(model(gate), {"move": x}, PERIOD, PERIOD / 8)["force"]
        keep = np.setdiff1d(np.arange(len(x)), np.concatenate([[0], *(np.asarray(skip) + k for k in (-1, 0, 1, 2))]).astype(int))
        rms = float(np.sqrt(np.mean((found[keep] - expected[keep]) ** 2)) / np.ptp(expected))
        table.row(name, [share_of_range(found[keep], expected[keep]), rms], limits)

    def ends(corners, speeds):
        return np.cumsum([round(abs(b - a) / s / PERIOD) for a, b, s in zip(corners[:-1], corners[1:], speeds)])

    x = path(corners, speeds)
    for n, limits in ((100, [3e-2, 1e-2]), (400, [8e-3, 2.5e-3])):
        row(f"gated, presliding, {n} x {n} relays", 1.0, x, gated(x, n)[0], limits, ends(corners, speeds))
    far = np.array([0.0, 2e-3, -1e-3, 1e-3, 0.8e-3, 2e-3])
    fast = np.array([4e-3, 2e-3, 1e-3, 5e-4, 4e-3])
    x = path(far, fast)
    force, jumps = gated(x, 400)
    row("gated, sliding and back, 400 x 400 relays", 1.0, x, force, [8e-3, 2.5e-3], np.concatenate([ends(far, fast), jumps]))
    x = path(corners, speeds)
    row("as printed, presliding, SciPy", 0.0, x, printed(corners, speeds), [1e-6, 1e-6], ends(corners, speeds))
    table.verdict()


if __name__ == "__main__":
    main()
