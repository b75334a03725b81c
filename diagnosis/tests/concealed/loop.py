"""A running teleoperation loop: the force of a slave at a wall is played on the motor of the master that a hand moves.

Only the master is physics here. All else is what a computer does at each sample, and the force that it commands is recorded.
"""
import copy

import numpy as np

from excitation import log_uniform
from stepper import Device

PARTS = 4                  # steps of the slave in a sample


class Loop:
    """Everything between the measured position of a master and the force on its motor: slave, wall, delay, canceller."""

    def __init__(self, numbers, master, ts):
        self.p, self.ts = numbers, ts
        linear = copy.deepcopy(master)
        linear["elements"] = [e for e in master["elements"] if e["kind"] in ("spring", "damper")]
        device = Device(linear, ts)
        self.step, self.push = device.step, device.push[:, device.index[master["inputs"][0]["on"]]]
        self.body = master["outputs"][0]["of"]
        self.at = device.index[self.body]

    def start(self):
        return np.zeros(2 + self.p["delay"] + len(self.step))

    def next(self, z, measured, added=0.0, tied=False):
        """The state after a sample, and the motor's force. `tied`: a wall that pulls as well, and no limit: the loop is then linear."""
        p, h, d = self.p, self.ts / PARTS, self.p["delay"]
        slave, speed = z[:2]
        queue, model = list(z[2 : 2 + d]), z[2 + d :]
        # The canceller takes out of the measured motion what the motor made of it.
        target = p["position_scale"] * (measured - p["canceller"] * model[self.at])
        w = 2 * np.pi * p["servo"]
        for _ in range(PARTS):
            depth = slave - (0.0 if tied else p["gap"])
            wall = p["stiffness"] * depth + p["damping"] * speed
            wall = wall if tied else max(0.0, wall) if depth > 0 else 0.0
            speed += h * (w * w * (target - slave) - 1.4 * w * speed - wall / p["mass"])
            slave += h * speed
        queue.append(-p["force_scale"] * wall)
        force = queue.pop(0) + added
        if not tied:
            force = float(np.clip(force, -p["limit"], p["limit"]))
        return np.concatenate([[slave, speed], queue, self.step @ model + self.push * force]), force

    def radius(self):
        """Spectral radius of the loop with the slave tied to its wall: stable below 1."""
        n, z = len(self.step), self.start()
        columns = []
        for unit in np.eye(n + len(z)):
            after, force = self.next(unit[n:], unit[self.at], tied=True)
            columns.append(np.concatenate([self.step @ unit[:n] + self.push * force, after]))
        return float(np.max(np.abs(np.linalg.eigvals(np.array(columns).T))))

    def command(self, noise, resolution, added):
        """What the computer does at sample k, for the simulation: reads the encoder, and says the motor's force."""
        z = self.start()

        def at(k, positions):
            nonlocal z
            x = positions[self.body] + noise[k]
            z, force = self.next(z, resolution * round(x / resolution) if resolution else x, added[k])
            return force

        return at


def draw_loop(master, ts, hand, rng):
    """Numbers of a loop that is stable but near its limit: the force scale is 40 to 85 % of that at which the tied loop becomes unstable."""
    grip = sum(e["stiffness"] for e in master["elements"] if e["kind"] == "spring" and "ground" in e["between"])
    p = dict(position_scale=log_uniform(rng, 0.3, 3), stiffness=log_uniform(rng, 300, 6000), servo=log_uniform(rng, 15, 60), mass=log_uniform(rng, 0.1, 1),
             delay=int(rng.integers(1, 9)), canceller=float(rng.choice([0.0, rng.uniform(0.6, 1)])), limit=4 * hand, force_scale=1.0)
    p["damping"] = 2 * rng.uniform(0.02, 0.3) * np.sqrt(p["stiffness"] * p["mass"])
    p["gap"] = p["position_scale"] * rng.uniform(0.02, 0.3) * hand / grip
    for scale in np.geomspace(0.02, 8, 50) * grip / (p["position_scale"] * p["stiffness"]):
        p["force_scale"] = scale
        if Loop(p, master, ts).radius() >= 1:
            break
    p["force_scale"] *= rng.uniform(0.4, 0.85)
    return {k: float("%.4g" % v) if isinstance(v, float) else v for k, v in p.items()}
