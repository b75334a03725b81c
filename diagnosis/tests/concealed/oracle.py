"""The best that the nominal structure can do, and the noise floor, with the simulator that made the data."""
import numpy as np
from scipy.optimize import least_squares
from bench import mismatch, numbers_of, scaled

KEEP = 4          # every fourth sample enters the least squares


def residual(bench, model, inputs, recorded, scale, nsub):
    out = []
    for U, y in zip(inputs, recorded):
        try:
            p = bench.predict(model, U, nsub)
        except bench.core.SimError:
            p = np.full_like(y, 1e3 * np.max(scale))
        out.append((bench.told(p - y) / scale)[::KEEP].ravel())
    r = np.concatenate(out)
    return np.clip(r / np.sqrt(len(r)), -1e6, 1e6)


def jacobian(bench, model, inputs, recorded, scale, nsub, step=1e-3):
    which = numbers_of(model)
    r0 = residual(bench, model, inputs, recorded, scale, nsub)
    J = np.empty((len(r0), len(which)))
    for k in range(len(which)):
        q = np.zeros(len(which))
        q[k] = step
        J[:, k] = (residual(bench, scaled(model, which, q), inputs, recorded, scale, nsub) - r0) / step
    return r0, J


def left_over(r, J):
    """Root mean square of what a re-tune, to first order, leaves of a difference r."""
    J = J / (np.linalg.norm(J, axis=0) + 1e-300)
    q = np.linalg.lstsq(J, r, rcond=1e-6)[0]
    return float(np.linalg.norm(r - J @ q))


def retune(bench, base, inputs, recorded, scale, start=None, evaluations=4):
    """The nominal structure with its stated numbers refitted to the fit recordings by least squares."""
    which, nsub = numbers_of(base), bench.steps(base)

    def f(q):
        return residual(bench, scaled(base, which, q), inputs, recorded, scale, nsub)

    zero = np.zeros(len(which))
    if start is None or np.linalg.norm(f(start)) > np.linalg.norm(f(zero)):
        start = zero
    best = least_squares(f, start, bounds=(-3, 3), diff_step=1e-4, max_nfev=evaluations, ftol=1e-3, xtol=1e-4)
    return scaled(base, which, best.x)


def score(bench, predicted, recorded):
    """(fit, held out) nrmse of a prediction, as resim.py computes it."""
    k = bench.fit
    return mismatch(bench, predicted[:k], recorded[:k]), mismatch(bench, predicted[k:], recorded[k:])


def predictions(bench, model, inputs, exact=False):
    """What a model says to the recorded inputs; `exact`: with the fine steps that resim.py takes."""
    nsub = None if exact else bench.steps(model, 4)
    return [bench.predict(model, U, nsub) for U in inputs]
