"""Time per simulated second of the chain in chain.toml by MuJoCo, at steps around 1 % from its converged solution.

    python time_mujoco.py

The whole run is one call of `mujoco.rollout` on one thread: its loop is C, and neither Python nor files are timed. Best of
several rounds.
"""

import sys
import time
from pathlib import Path

import mujoco
import numpy as np
from mujoco import rollout

sys.path.insert(0, str(Path(__file__).resolve().parents[2] / "tests" / "python"))
from mujoco_chain import HOLD, distance, force, mujoco_model, mujoco_positions  # noqa: E402

CONVERGED = 1e-6
ROUNDS = 20


def fastest(model, push):
    """ns per simulated second."""
    each, data, best = round(HOLD / model.opt.timestep), mujoco.MjData(model), float("inf")
    control = np.repeat(push[:-1], each)[None, :, None]
    size = mujoco.mj_stateSize(model, mujoco.mjtState.mjSTATE_FULLPHYSICS)
    start, states = np.zeros((1, size)), np.zeros((1, control.shape[1], size))
    for _ in range(ROUNDS):
        begin = time.perf_counter_ns()
        rollout.rollout(model, data, start, control, state=states)
        best = min(best, (time.perf_counter_ns() - begin) / (HOLD * (len(push) - 1)))
    return best


def main():
    push = force()
    converged = mujoco_positions(mujoco_model(CONVERGED), push)
    print(f"MuJoCo {mujoco.__version__}\n{'integrator':>14} {'solver':>8} {'step, us':>10} {'from converged':>16} {'ns per simulated second':>26}")
    for integrator in ("implicitfast", "Euler", "RK4"):
        for solver in ("Newton", "PGS"):
            for step in (1e-3, 5e-4, 2.5e-4):
                model = mujoco_model(step, integrator, solver)
                apart = distance(mujoco_positions(model, push), converged)
                print(f"{integrator:>14} {solver:>8} {1e6 * step:>10.0f} {100 * apart:>14.2f} % {fastest(model, push):>26.0f}", flush=True)


if __name__ == "__main__":
    main()
