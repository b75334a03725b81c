"""Times real time of MuJoCo on the arms that `cargo bench --bench arm_speed` wrote, at several steps, each with its distance from the converged
solution there; with matplotlib a picture of both.

    python time_mujoco.py [docs/arm-speed.svg]

A run is one call of `mujoco.rollout` on one thread: its loop is C, and neither Python nor files are timed. Best of several rounds.
"""

import json
import sys
import time
from pathlib import Path

import mujoco
import numpy as np
from mujoco import rollout

FOLDER = Path(__file__).resolve().parents[2] / "target" / "arm_speed"
ROUNDS = 5


def measured(arm, us, integrator, solver):
    """Largest distance as a share of a joint's range, and times real time."""
    model = mujoco.MjModel.from_xml_path(str(FOLDER / f"{arm['name']}-{us:g}.xml"))
    model.opt.integrator = getattr(mujoco.mjtIntegrator, f"mjINT_{integrator.upper()}")
    model.opt.solver = getattr(mujoco.mjtSolver, f"mjSOL_{solver.upper()}")
    each = round(arm["hold"] / model.opt.timestep)
    drives = np.array(arm["drives"]).T
    order = [model.actuator(name).id for name in arm["inputs"]]
    control = np.zeros((1, each * len(drives), model.nu))
    control[0][:, order] = np.repeat(drives, each, axis=0)
    data = mujoco.MjData(model)
    size = mujoco.mj_stateSize(model, mujoco.mjtState.mjSTATE_FULLPHYSICS)
    mujoco.mj_getState(model, data, start := np.zeros(size), mujoco.mjtState.mjSTATE_FULLPHYSICS)
    states = np.zeros((1, control.shape[1], size))
    best = float("inf")
    for _ in range(ROUNDS):
        begin = time.perf_counter_ns()
        rollout.rollout(model, data, start[None], control, state=states)
        best = min(best, 1e-9 * (time.perf_counter_ns() - begin))
    # The state begins with the time, then come the coordinates.
    angles = [1 + model.joint(f"q{i}").qposadr[0] for i in range(arm["joints"])]
    found = states[0][each - 1 :: each][:, angles].T
    expected = np.array(arm["converged"])
    ranges = np.maximum(expected.max(axis=1), 0) - np.minimum(expected.min(axis=1), 0)
    return float((np.abs(found - expected).max(axis=1) / ranges).max()), arm["hold"] * len(drives) / best


def at_error(steps, most):
    """Times real time at the longest step that is no further off."""
    good = [step for step in steps if step["apart"] <= most]
    return max((step["times"] for step in good), default=float("nan"))


def main():
    arms = json.loads((FOLDER / "arms.json").read_text())
    print(f"MuJoCo {mujoco.__version__}\n{'arm':>10} {'integrator':>14} {'solver':>8} {'step, us':>10} {'from converged':>16} {'times real time':>18}")
    for arm in arms:
        arm["mujoco"] = []
        for integrator, solver in (("implicitfast", "Newton"), ("Euler", "Newton"), ("implicitfast", "PGS")):
            for us in arm["mujoco_us"]:
                apart, times = measured(arm, us, integrator, solver)
                arm["mujoco"].append({"us": us, "apart": apart, "times": times})
                print(f"{arm['name']:>10} {integrator:>14} {solver:>8} {us:>10.3f} {100 * apart:>14.4f} % {times:>18.1f}", flush=True)
    print(f"\n{'arm':>10} {'within':>8} {'ours, times real time':>24} {'MuJoCo, times real time':>26}")
    for arm in arms:
        for most in (1e-2, 1e-3):
            print(f"{arm['name']:>10} {100 * most:>6.1f} % {at_error(arm['steps'], most):>24.0f} {at_error(arm['mujoco'], most):>26.0f}")
    if len(sys.argv) > 1:
        picture(arms, sys.argv[1])


def picture(arms, path):
    import matplotlib

    matplotlib.use("Agg")
    import matplotlib.pyplot as plt

    matplotlib.rcParams.update({"font.size": 9, "svg.hashsalt": "backdrive", "axes.spines.top": False, "axes.spines.right": False})
    figure, axes = plt.subplots(1, 2, figsize=(9, 3.4), sharey=True)
    for ax, soft, title in zip(axes, (False, True), ("joints that rub", "motors behind soft gears, friction on both sides")):
        some = [arm for arm in arms if arm["soft"] == soft]
        for key, colour, name in (("steps", "#1f4e79", "backdrive"), ("mujoco", "#b03a2e", f"MuJoCo {mujoco.__version__}")):
            times = [at_error(arm[key], 1e-2) for arm in some]
            ax.plot([arm["joints"] for arm in some], times, "o-", color=colour, label=name)
        ax.set(title=title, xlabel="joints", xscale="log", yscale="log", xticks=[2, 4, 7, 14], xticklabels=["2", "4", "7", "14"])
        ax.minorticks_off()
    axes[0].set_ylabel("times real time, within 1 %")
    axes[0].legend(frameon=False)
    figure.tight_layout()
    figure.savefig(path, metadata={"Date": None})


if __name__ == "__main__":
    main()
