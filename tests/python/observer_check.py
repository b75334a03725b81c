"""Checks the unknown-input observer of a test bench against SciPy.

    python observer_check.py BACKDRIVE

Runs a piece of launch/engine-test-bench.toml, finds the gains again by bisection on SciPy's solution of the Riccati equation, and runs the
observer again over the recorded speeds and torque by an exponential of its own. The first row is an example bench: its least m
by bisection, and CLARABEL's answer to the matrix inequality.
"""

import subprocess
import sys
from pathlib import Path

import numpy as np
from scipy.linalg import expm, solve_continuous_are

from runner import Backdrive, Table, columns_of, share_of_range

LAUNCH = Path(__file__).resolve().parents[2] / "launch" / "engine-test-bench.toml"


def augmented(jc, ja, c, d):
    a = np.zeros((4, 4))
    a[:3, :3] = [[0, 1, -1], [-c / jc, -d / jc, d / jc], [c / ja, d / ja, -d / ja]]
    a[1, 3] = 1 / jc
    return a, np.array([[0.0, 1, 0, 0], [0, 0, 1, 0]])


def solution(a, c, noise, rate, m):
    """S of A S + S A' + G rate^2 G' - S (C' R^-1 C - 1/m) S = 0, or None where it does not exist."""
    g = np.zeros((4, 4))
    g[3, 3] = rate**2
    weight = np.block([[noise**2 * np.eye(2), np.zeros((2, 4))], [np.zeros((4, 2)), -m * np.eye(4)]])
    try:
        s = solve_continuous_are(a.T, np.hstack([c.T, np.eye(4)]), g, weight)
    except (np.linalg.LinAlgError, ValueError):
        return None
    closed = a - s @ (c.T @ c / noise**2 - np.eye(4) / m)
    fine = np.all(np.linalg.eigvalsh(s) > 0) and np.all(np.linalg.eigvals(closed).real < 0)
    return s if fine else None


def design(a, c, noise, rate, back_off):
    low, high = 1e-12, 1e12
    while high / low > 1 + 1e-9:
        middle = np.sqrt(low * high)
        low, high = (low, middle) if solution(a, c, noise, rate, middle) is not None else (middle, high)
    return high, solution(a, c, noise, rate, back_off * high) @ c.T / noise**2


def observe(a, c, gains, period, speeds, torque, ja):
    """The estimated torque, for a held known torque and speeds in straight lines."""
    n = 4
    whole = np.zeros((n + 5, n + 5))
    whole[:n, :n] = a - gains @ c
    whole[2, n] = 1 / ja
    whole[:n, n + 1 : n + 3] = gains
    whole[n + 1 : n + 3, n + 3 :] = np.eye(2)
    step = expm(whole * period)
    state = np.zeros(n)
    state[1:3] = speeds[0]
    found = [state[3]]
    for k in range(1, len(speeds)):
        slope = (speeds[k] - speeds[k - 1]) / period
        state = step[:n] @ np.concatenate([state, [torque[k - 1]], speeds[k - 1], slope])
        found.append(state[3])
    return np.array(found)


def main():
    program = Backdrive(sys.argv[1])
    table = Table("observer of a test bench", ["error"])
    bench = (0.9, 0.7, 2e4, 12.0)
    a, c = augmented(*bench)
    least, _ = design(a, c, 0.1, 1.0, 1.05)
    table.row("least m of the example, by SciPy: 0.118248", [abs(least / 0.118248 - 1)], [1e-4])
    table.row("  by CLARABEL's inequality: 0.118265", [abs(least / 0.118265 - 1)], [2e-3])

    bag, out = program.here / "bench.mcap", program.here / "bench.csv"
    for command in (
        ["run", LAUNCH, "--duration", "9", "--transport", "inproc", "--bag", bag],
        ["bag", "export", bag, "--csv", out],
    ):
        done = subprocess.run([program.program, *map(str, command)], capture_output=True, text=True, stdin=subprocess.DEVNULL)
        if done.returncode != 0:
            raise RuntimeError(done.stderr)
    columns = columns_of(out)

    def column(topic, field):
        return next(values for name, values in columns.items() if name.startswith(f"{topic}.{field}"))

    # As launch/engine-test-bench.toml has it: noise 0.02 rad/s, 200 N m/s, m 1.2 times the least.
    _, gains = design(a, c, 0.02, 200.0, 1.2)
    speeds = np.column_stack([column("/shaft/engine_js", "velocity"), column("/shaft/dynamometer_js", "velocity")])
    torque = column("/dynamometer/measured_js", "effort")
    expected = observe(a, c, gains, 1e-3, speeds, torque, bench[1])
    found = column("/observer/estimated_js", "effort")
    # The program keeps off the inequality's edge by a little, which moves its gains a little.
    table.row("the estimated torque along a recorded bench", [share_of_range(found, expected)], [1e-4])
    table.verdict()


main()
