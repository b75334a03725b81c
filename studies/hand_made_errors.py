"""What every hand-made model needs: columns of recordings, derivatives, and the error that a verdict states for held-out recordings."""
import numpy as np


def read(folder, name, *columns):
    """Columns of a recording, by name."""
    table = np.genfromtxt(f"{folder}/{name}", delimiter=",", names=True)
    return [table[c] for c in columns]


def derivatives(t, x):
    """First and second derivative by central differences; the columns of a study are low-passed already."""
    v = np.gradient(x, t)
    return v, np.gradient(v, t)


def lagged(t, x, tau):
    """x through a low-pass of first order with time constant tau, s."""
    keep = np.exp(-(t[1] - t[0]) / max(tau, 1e-9))
    y = np.empty_like(x)
    state = x[0]
    for i, value in enumerate(x):
        state = keep * state + (1 - keep) * value
        y[i] = state
    return y


def held_out(title, pairs):
    """Prints the error of (record, output, measured, predicted): rms of the residual over the standard deviation of the measured signal, for each pair,
    their mean (nrmse_after of a verdict), and pooled by output (pooled_after)."""
    print(title)
    each, pooled = [], {}
    for record, output, measured, predicted in pairs:
        residual = measured - predicted
        each.append(np.sqrt(np.mean(residual**2)) / np.std(measured))
        sums = pooled.setdefault(output, [0.0, 0.0])
        sums[0] += np.sum(residual**2)
        sums[1] += np.sum((measured - measured.mean()) ** 2)
        print(f"  {record:28s} {output:20s} nrmse {100 * each[-1]:7.3f} %")
    print(f"  mean nrmse {100 * np.mean(each):.3f} %")
    for output, (a, b) in pooled.items():
        print(f"  pooled {output}: {100 * np.sqrt(a / b):.3f} %")
