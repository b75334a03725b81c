"""Test signals: what drives a device while it is recorded."""
import numpy as np

FORCE_KINDS = ["sweep", "triangle", "sines", "multisine", "steps", "impacts"]
MOTION_KINDS = ["sweep", "triangle", "sines", "multisine"]


def log_uniform(rng, low, high):
    return float(np.exp(rng.uniform(np.log(low), np.log(high))))


def signal(kind, amplitude, n, ts, band, rng):
    """N samples of a test signal that starts at zero; `band` is its lowest and highest frequency in Hz."""
    t = np.arange(n) * ts
    length = n * ts
    low, high = max(band[0], 1.0 / length), band[1]
    ramp = np.minimum(1.0, t / (0.02 * length))
    if kind == "sweep":
        rate = np.log(high / low)
        phase = 2 * np.pi * low * length / rate * (np.exp(rate * t / length) - 1)
        if rng.random() < 0.3:
            phase = phase[-1] - phase[::-1]
        return amplitude * ramp * np.sin(phase)
    if kind == "sines":
        u = np.zeros(n)
        edges = np.linspace(0, n, int(rng.integers(4, 7)) + 1).astype(int)
        for a, b in zip(edges[:-1], edges[1:]):
            f = log_uniform(rng, min(max(low, 2.0 / ((b - a) * ts)), high), high)
            fade = np.minimum(1.0, np.minimum(np.arange(b - a), np.arange(b - a)[::-1]) / (0.06 * (b - a)))
            u[a:b] = amplitude * rng.uniform(0.3, 1) * fade * np.sin(2 * np.pi * f * t[: b - a])
        return u
    if kind == "multisine":
        f = np.geomspace(low, high, int(rng.integers(20, 50)))
        f = np.maximum(1, np.round(f * length)) / length
        u = np.zeros(n)
        for fi, p in zip(f, rng.uniform(0, 2 * np.pi, len(f))):
            u += np.sin(2 * np.pi * fi * t + p)
        return 0.37 * amplitude * u / np.std(u) * ramp
    if kind in ("triangle", "steps"):
        start, knots, levels = 0.02 * length, [0.0], [0.0]
        knots.append(start)
        levels.append(0.0)
        spacing = length / rng.uniform(10, 25)
        while knots[-1] < length:
            knots.append(knots[-1] + spacing * rng.uniform(0.4, 1.8))
            levels.append(amplitude * rng.uniform(-1, 1))
        if kind == "triangle":
            return np.interp(t, knots, levels)
        return np.array(levels)[np.searchsorted(knots, t, side="right") - 1]
    if kind == "impacts":
        u = np.zeros(n)
        for at in np.linspace(0.04, 0.93, int(rng.integers(6, 12))):
            k = int((at + rng.uniform(-0.02, 0.02)) * n)
            width = max(4, int(min(0.01 * n, rng.uniform(0.2, 0.6) / high / ts)))
            u[k : k + width] = rng.choice([-1, 1]) * amplitude * rng.uniform(0.5, 1) * np.sin(np.pi * np.arange(width) / width)[: n - k]
        return u
    if kind == "hand":                             # slow, and never the same: no faster than `high`
        u = sum(np.sin(2 * np.pi * f * t + p) for f, p in zip(rng.uniform(0.05, 1, 24) * band[1], rng.uniform(0, 2 * np.pi, 24)))
        return amplitude * u / np.std(u) * np.sin(0.5 * np.pi * np.minimum(1.0, t * band[1])) ** 2
    raise ValueError(kind)


def smooth(u, width):
    """A motion without corners: a Hann window of `width` samples, still zero at the first sample."""
    w = np.hanning(max(5, width) + 2)
    w /= w.sum()
    out = np.convolve(np.concatenate([np.full(len(w), u[0]), u, np.full(len(w), u[-1])]), w, "same")[len(w) : -len(w)]
    return out - out[0] * np.maximum(0, 1 - np.arange(len(u)) / len(w))


def plan(device, rng):
    """Names of the recordings with their kind and amplitude factor, those for the fit first: (fit, held out)."""
    if device.get("loop"):
        fit = [("explore", "hand", 0.7), ("press", "triangle", 1.2), ("tap", "impacts", 4.0), ("explore-2", "hand", 1.0)]
        return fit[: int(rng.integers(3, 5))], [("again", "hand", 0.85)]
    motion = any(q["kind"] == "motion" for q in device["model"]["inputs"])
    kinds = MOTION_KINDS if motion else FORCE_KINDS[:-1] if device["control"] else FORCE_KINDS
    rest = list(rng.permutation([k for k in kinds if k not in ("sweep", "impacts")]))
    if rng.random() < 0.5:
        fit = [("sweep", "sweep", 0.3), ("sweep-2", "sweep", 1.0)] + [(k, k, 1.0) for k in rest[:2]]
    else:
        fit = [("sweep", "sweep", 0.65)] + [(k, k, 0.8) for k in rest[:2]]
    held = [(k, k, 0.9) for k in rest[2:3]]
    if len(fit) == 3 and rng.random() < 0.5:
        held += [("impacts", "impacts", 1.0)] if "impacts" in kinds else [(k, k, 0.7) for k in rest[3:4]]
    return fit, held
