"""Driving a device: recordings of a true model with noise, and how far a model is from them."""
import copy
import math
import numpy as np
from scipy.fft import dct, idct
from scipy.interpolate import CubicSpline
import stepper
from excitation import plan, signal, smooth
from families import HAND, r4
from loop import Loop

FINE = 10                  # points of the grid that an irregular clock is on, per mean sample time


def rounded(a):
    """Numbers with the seven digits that a file keeps."""
    a = np.asarray(a, float)
    with np.errstate(divide="ignore"):
        p = 10.0 ** (6 - np.floor(np.log10(np.where(a == 0, 1.0, np.abs(a)))))
    return np.round(a * p) / p


class Bench:
    """One device on its bench: the same excitation and the same noise for every model tried on it."""

    def __init__(self, core, device, rng, snr, samples):
        self.core, self.device = core, device
        self.ts, self.n = device["ts"], samples or device["samples"]
        if samples and samples < 4000:
            self.ts = r4(min(self.ts * min(4, 4000 / samples), 1 / (8 * device["band"][1])))
        fit, held = plan(device, rng)
        self.files, self.fit = fit + held, len(fit)
        self.seeds = rng.integers(0, 2**62, (len(self.files), 2))
        self.level = [float(np.exp(rng.uniform(np.log(0.001), np.log(0.03)))) * snr for _ in device["model"]["outputs"]]
        self.grid = [np.exp(rng.uniform(np.log(0.1), np.log(3))) if o["kind"] == "position" and rng.random() < 0.8 else 0
                     for o in device["model"]["outputs"]]
        self.differenced = [device["stage"] == "velocity" and o["kind"] == "velocity" for o in device["model"]["outputs"]]
        for j, o in enumerate(device["model"]["outputs"]):
            if self.differenced[j]:                    # over one period: it is half a sample late, which the model says
                self.grid[j], o["delay"] = np.exp(rng.uniform(np.log(0.3), np.log(2))), 0.5 * self.ts
        self.sigma = self.resolution = None
        self.set_noise()

    def excite(self, i, n=None):
        """The samples that the generator plays in recording i: inputs, or the reference of the controller."""
        n = n or self.n
        name, kind, factor = self.files[i]
        rng, dev = np.random.default_rng(self.seeds[i][0]), self.device
        if dev["control"]:
            c = dev["control"]
            u = signal(kind, factor * c["travel"], n, self.ts, c["band"], rng)
            return smooth(u, int(0.12 / c["band"][1] / self.ts))
        U = {}
        for j, (q, a) in enumerate(zip(dev["model"]["inputs"], dev["amplitude"])):
            other = kind if j == 0 or kind in ("impacts",) or rng.random() < 0.4 else str(rng.choice(["sines", "multisine", "sweep", "triangle"]))
            band = dev["band"]
            if dev["loop"]:                            # the hand moves it; on the motor a dither at most
                other, band = (kind, (0.3, dev["hand"]["band"])) if q["name"] == HAND else ("multisine", (1, band[1]))
            elif dev["hand"] and q["name"] == HAND:
                other, band = "hand", (0, dev["hand"]["band"])
            u = signal(other, factor * a, n, self.ts, band, rng)
            if dev["loop"] and q["name"] == HAND:
                u = smooth(u, int(0.1 / self.ts))
            U[q["name"]] = rounded(smooth(u, int(0.25 / band[1] / self.ts)) if q["kind"] == "motion" else u)
        return self.irregular(U, i, n) if dev["stage"] == "clock" else U

    def irregular(self, U, i, n):
        """The same played by a computer whose clock is not even and that skips samples, here and there and in bursts. `t`: where, on the fine grid."""
        rng = np.random.default_rng(self.seeds[i][1] // 2)
        steps = np.maximum(1, np.round(FINE * (1 + rng.uniform(0.1, 0.4) * rng.uniform(-1, 1, n)))).astype(int)
        keep = rng.random(n) > rng.uniform(0.005, 0.04)
        for at in rng.integers(1, n, int(rng.integers(1, 5))):
            keep[at : at + int(rng.integers(5, 40))] = False
        keep[0] = True
        at = (np.cumsum(steps) - steps[0])[keep]
        return dict({k: rounded(np.interp(at / FINE, np.arange(n), u)) for k, u in U.items()}, t=at)

    def controller(self, model, i, n):
        dev, c = self.device, self.device["control"]
        q = model["inputs"][0]
        bodies = dev["model"]["bodies"]
        mass, w = sum(bodies.values()), 2 * np.pi * c["frequency"]
        rng = np.random.default_rng(self.seeds[i][1])
        noise = rng.standard_normal(n) * self.sigma[0] if self.resolution else np.zeros(n)
        return dict(input=q["name"], body=q["on"], resolution=self.resolution[0] if self.resolution else 0.0, kp=mass * w * w,
                    ki=mass * w**3 / 8, kd=1.4 * mass * w, limit=40 * dev["amplitude"][0], tau=1 / (8 * w), ref=self.excite(i, n), noise=noise)

    def run(self, model, i, fine=True, n=None, outputs=None):
        """Recording i of a device: (inputs as applied, clean outputs)."""
        n = n or self.n
        nsub = None if fine else self.steps(model)
        if self.device["control"]:
            c = self.controller(model, i, n)
            y, u = self.core.simulate(model, {}, self.ts, n, ctrl=c, nsub=nsub, outputs=outputs)
            return {c["input"]: u}, y
        U = self.excite(i, n)
        if self.device["loop"]:
            return self.session(model, i, U, nsub, outputs)
        return U, self.predict(model, U, nsub, outputs)

    def session(self, model, i, U, nsub, outputs):
        """The same of a running loop, whose computer commands the motor from what the encoder reads."""
        q, n = model["inputs"][0]["name"], len(U[HAND])
        noise = np.random.default_rng(self.seeds[i][1]).standard_normal(n) * (self.sigma[0] if self.resolution else 0)
        loop = Loop(self.device["loop"], self.device["model"], self.ts)
        y, U = stepper.simulate(model, U, self.ts, n, nsub, outputs, (q, loop.command(noise, self.resolution[0] if self.resolution else 0, U[q])))
        return U, y

    def steps(self, model, times=1):
        """Steps in a sample interval for what need not be exact."""
        return min(self.core.substeps(model, self.ts, True), times * self.core.substeps(model, self.ts, False))

    def predict(self, model, U, nsub=None, outputs=None):
        if "t" not in U:
            return self.solve(model, U, self.ts, len(next(iter(U.values()))), nsub, outputs)
        at, grid = np.asarray(U["t"], int), np.arange(int(U["t"][-1]) + 1)
        between = dict(zero=lambda u: u[np.searchsorted(at, grid, side="right") - 1], linear=lambda u: np.interp(grid, at, u),
                       cubic=lambda u: CubicSpline(at, u)(grid))
        fine = {q["name"]: between[self.core.hold_of(q)](U[q["name"]]) for q in model["inputs"]}
        return self.solve(model, fine, self.ts / FINE, len(grid), nsub and math.ceil(nsub / FINE), outputs)[at]

    def solve(self, model, U, ts, n, nsub, outputs):
        if stepper.needed(model):
            return stepper.simulate(model, U, ts, n, nsub, outputs)[0]
        return self.core.simulate(model, U, ts, n, nsub=nsub, outputs=outputs)[0]

    def set_noise(self):
        base = self.device["model"]
        y = [self.run(base, i, fine=False)[1] for i in range(len(self.files))]
        std = np.median([np.std(a, axis=0) for a in y], axis=0)
        self.sigma = [r4(level * s) for level, s in zip(self.level, std)]
        if self.device["control"]:                     # a controller that differentiates must not drown in noise
            c = self.controller(base, 0, 2)
            most = 0.1 * self.device["amplitude"][0] * (self.ts + c["tau"]) / (1.5 * c["kd"])
            self.sigma[0] = r4(min(self.sigma[0], max(most, 0.0005 * std[0])))
            self.level[0] = self.sigma[0] / std[0]
        self.scale_noise(1.0, base)

    def scale_noise(self, factor, *models):
        """More noise, or less; encoder steps with it, which the models state."""
        self.sigma, self.level = [r4(s * factor) for s in self.sigma], [level * factor for level in self.level]
        self.resolution = [r4(g * s) if g else 0.0 for g, s in zip(self.grid, self.sigma)]
        for m in models:
            for o, r in zip(m["outputs"], self.resolution):
                if r:
                    o["resolution"] = r

    def noise(self, i, y, travelled=None):
        """The clean outputs as the sensors report them. `travelled`: what differentiated encoders count."""
        rng, out = np.random.default_rng(self.seeds[i][1]), np.array(y)
        for j in range(y.shape[1]):
            noise = rng.standard_normal(len(y)) * self.sigma[j]
            if self.differenced[j]:                    # an encoder's counts, and their backward difference
                step = self.resolution[j] * self.ts
                counts = np.round((travelled[:, j] + noise * self.ts / np.sqrt(2)) / step)
                out[:, j] = np.diff(counts, prepend=counts[0]) * self.resolution[j]
                continue
            out[:, j] += noise
            if self.resolution[j]:
                out[:, j] = self.resolution[j] * np.round(out[:, j] / self.resolution[j])
        return out

    def record(self, truth):
        """All recordings of a device: inputs, clean outputs, and outputs as the sensors report them."""
        runs = [self.run(truth, i) for i in range(len(self.files))]
        counted = [dict(name=o["name"], kind="position", of=o["of"]) if d else o for o, d in zip(truth["outputs"], self.differenced)]
        travelled = [self.run(truth, i, outputs=counted)[1] if any(self.differenced) else None for i in range(len(runs))]
        inputs = [{k: rounded(u) for k, u in r[0].items()} for r in runs]
        return inputs, [r[1] for r in runs], [self.noise(i, r[1], t) for i, (r, t) in enumerate(zip(runs, travelled))]

    def deviations(self):
        """Standard deviations of what the sensors add."""
        return np.array([np.hypot(s, r / np.sqrt(6 if d else 12)) for s, r, d in zip(self.sigma, self.resolution, self.differenced)])

    def told(self, difference):
        """A difference of outputs without what a hand that nobody measured could have done: all that is no faster than the set says."""
        if not self.device["hand"] or "stated" not in self.device["hand"]:
            return difference
        lines = dct(difference, axis=0, norm="ortho")
        lines[: math.ceil(2 * len(difference) * self.ts * self.device["hand"]["stated"])] = 0
        return idct(lines, axis=0, norm="ortho")

    def ranges(self, model):
        """How far, how fast and with what force things move at every place, from a quick run of all recordings."""
        bodies = list(model["bodies"])
        outs = [dict(name=k + b, kind=k, of=b) for b in bodies for k in ("position", "velocity", "acceleration")]
        runs = [self.run(model, i, fine=False, outputs=outs) for i in range(len(self.files))]
        n = min(self.n, 20000)
        sig = {b: [np.concatenate([r[1][:n, 3 * k + q] for r in runs]) for q in range(3)] for k, b in enumerate(bodies)}
        push = {q["name"]: np.concatenate([r[0][q["name"]][:n] for r in runs]) for q in model["inputs"]}
        rms = lambda a: float(np.sqrt(np.mean(a**2))) + 1e-300
        stat = dict(ts=self.ts, band=self.device["band"], length=self.n * self.ts)
        held = {q["on"] for q in model["inputs"] if q["kind"] == "motion"}
        pull = {}
        for e in model["elements"]:
            a, b = e["between"]
            if "ground" not in (a, b):
                x, v, _ = (p - q for p, q in zip(sig[a], sig[b]))
                f = e.get("stiffness", e.get("stiffness_positive", 0)) * x if e["kind"] in ("spring", "hysteretic_spring") else e.get("damping", 0) * v
                pull[(a, b)] = np.hypot(pull.get((a, b), 0), rms(f))
                stat[(a, b)] = (rms(x), rms(v), float(np.max(np.abs(x))), float(pull[(a, b)]))
        inert = {b: model["bodies"][b] + sum(e["inertance"] for e in model["elements"] if e["kind"] == "inerter" and b in e["between"]) for b in bodies}
        for b in bodies:
            f = max([inert[b] * rms(sig[b][2])] + [rms(push[q["name"]]) for q in model["inputs"] if q["kind"] == "force" and q["on"] == b]
                    + [p for pair, p in pull.items() if b in pair and b in held])
            stat[(b, "ground")] = (rms(sig[b][0]), rms(sig[b][1]), float(np.max(np.abs(sig[b][0]))), f)
        for q in model["inputs"]:
            stat[q["name"]] = float(np.max(np.abs(push[q["name"]])))
        for o, s, l in zip(model["outputs"], self.sigma, self.level):
            stat[o["name"]] = s / l
        return stat


def mismatch(bench, predicted, recorded):
    """Mean nrmse over files and outputs."""
    return float(np.mean([np.sqrt(np.mean(bench.told(p - r) ** 2, axis=0)) / np.std(r, axis=0) for p, r in zip(predicted, recorded)]))


def numbers_of(model):
    """Every number that a nominal file states, as (section, name, key)."""
    held = {q["on"] for q in model["inputs"] if q["kind"] == "motion"}
    out = [("bodies", b, None) for b in model["bodies"] if b not in held]
    return out + [("elements", e["name"], k) for e in model["elements"] for k in e if k not in ("name", "kind", "between", "phase", "exponent")]


def scaled(model, which, logs):
    """The model with its numbers multiplied by exp(logs)."""
    m = copy.deepcopy(model)
    by_name = {e["name"]: e for e in m["elements"]}
    for (section, name, key), q in zip(which, np.exp(logs)):
        if section == "bodies":
            m["bodies"][name] *= q
        else:
            v = by_name[name][key]
            by_name[name][key] = [x * q for x in v] if isinstance(v, list) else v * q
    return m
