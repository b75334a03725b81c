"""Milliseconds per simulated second of the devices that `cargo bench -p backdrive-export --bench five_devices` wrote, by MuJoCo and by SciPy, each at the
loosest setting that is within the same distance from the converged solution.

    python time_others.py

MuJoCo: the fastest of its integrators, solvers and steps; one call of `mujoco.rollout` on one thread, whose loop is C. SciPy: the fastest of `solve_ivp`'s
RK45, LSODA and BDF, of tolerances, and of widths of the tanh that stands for sign in dry friction; restarted at every jump of the held forces, which its
error control would stumble over, and with the equations as one NumPy function. Files and the making of models are not timed. Best of several rounds.
"""

import json
import time
from pathlib import Path

import mujoco
import numpy as np
from mujoco import rollout
from scipy.integrate import solve_ivp

FOLDER = Path(__file__).resolve().parents[2] / "target" / "five_devices"
ROUNDS = 5
LONGEST_S = 60.0  # of one run by SciPy


def distance(found, expected):
    ranges = np.maximum(expected.max(axis=1), 0) - np.minimum(expected.min(axis=1), 0)
    return float((np.abs(found - expected).max(axis=1) / ranges).max())


def mujoco_at(device, expected, us, integrator, solver):
    """Milliseconds per simulated second, and the distance."""
    model = mujoco.MjModel.from_xml_path(str(FOLDER / f"{device['name']}-{us:g}.xml"))
    model.opt.integrator = getattr(mujoco.mjtIntegrator, f"mjINT_{integrator.upper()}")
    model.opt.solver = getattr(mujoco.mjtSolver, f"mjSOL_{solver.upper()}")
    each = round(device["hold"] / model.opt.timestep)
    drives = np.array(device["drives"]).T
    control = np.zeros((1, each * len(drives), model.nu))
    control[0][:, [model.actuator(i["name"]).id for i in device["inputs"]]] = np.repeat(drives, each, axis=0)
    data = mujoco.MjData(model)
    size = mujoco.mj_stateSize(model, mujoco.mjtState.mjSTATE_FULLPHYSICS)
    mujoco.mj_getState(model, data, start := np.zeros(size), mujoco.mjtState.mjSTATE_FULLPHYSICS)
    states, fastest = np.zeros((1, control.shape[1], size)), float("inf")
    places = [1 + model.joint(b["name"]).qposadr[0] for b in device["bodies"]]
    for turn in range(ROUNDS):
        begin = time.perf_counter()
        rollout.rollout(model, data, start[None], control, state=states)
        fastest = min(fastest, time.perf_counter() - begin)
        apart = distance(states[0][each - 1 :: each][:, places].T, expected)
        if not apart <= device["error"]:
            break
    return 1e3 * fastest / (device["hold"] * len(drives)), apart


def by_mujoco(device, expected):
    best = None
    for integrator in ("implicitfast", "Euler", "RK4"):
        for solver in ("Newton", "PGS"):
            for us in device["mujoco_us"]:
                ms, apart = mujoco_at(device, expected, us, integrator, solver)
                if apart <= device["error"]:
                    if best is None or ms < best[0]:
                        best = (ms, apart, f"{integrator}, {solver}, {us:g} us")
                    break
    return best


class Network:
    """The equations of motion, state: positions, velocities, deflections of slip elements."""

    def __init__(self, device):
        n = len(device["bodies"])
        self.n, self.stiffness, self.damping, self.frictions, self.slips = n, np.zeros((n, n)), np.zeros((n, n)), [], []
        self.constant = np.zeros(n)
        self.inverse = 1.0 / np.array([b["inertia"] for b in device["bodies"]])
        self.push = np.zeros((n, len(device["inputs"])))
        for column, i in enumerate(device["inputs"]):
            self.push[i["on"], column] = i["gain"]
        for element in device["elements"]:
            across = np.zeros(n)
            for end, sign in zip(element["between"], (1.0, -1.0)):
                if end is not None:
                    across[end] += sign
            values = element["values"]
            match element["kind"]:
                case "spring":
                    self.stiffness += values[0][0] * np.outer(across, across)
                    self.constant += values[0][0] * values[1][0] * across
                case "damper":
                    self.damping += values[0][0] * np.outer(across, across)
                case "coulomb":
                    self.frictions.append((across, values[0][0]))
                case "maxwell_slip":
                    self.slips.append((across, np.array(values[0]), np.array(values[1])))
                case other:
                    raise SystemExit(f"{device['name']}: no equations for {other}")
        self.length = 2 * n + sum(len(s[1]) for s in self.slips)

    def rate(self, _t, state, force, width):
        n = self.n
        x, v = state[:n], state[n : 2 * n]
        f = force + self.constant - self.stiffness @ x - self.damping @ v
        for across, level in self.frictions:
            f = f - across * (level * np.tanh((across @ v) / width))
        memory, at = [], 2 * n
        for across, stiffness, level in self.slips:
            z, u = state[at : at + len(level)], across @ v
            f = f - across * z.sum()
            # Each spring's force grows with the path until its slider slips.
            memory.append(np.where(z * u > 0, stiffness * u * (np.abs(z) < level), stiffness * u))
            at += len(level)
        return np.concatenate([v, self.inverse * f, *memory])


def by_scipy(device, expected):
    network, drives = Network(device), np.array(device["drives"]).T
    hold, best = device["hold"], None
    pushes = drives @ network.push.T
    widths = (1e-2, 1e-3, 1e-4, 1e-5) if network.frictions else (1.0,)
    speed = np.abs(np.diff(expected, axis=1)).max() / hold
    for width in widths:
        for method in ("LSODA", "RK45", "BDF"):
            for tolerance in (1e-3, 1e-4, 1e-5, 1e-6):
                state, found = np.zeros(network.length), np.zeros_like(expected)
                absolute = tolerance * 1e-2 * np.abs(expected).max()
                begin = time.perf_counter()
                for sample, force in enumerate(pushes):
                    solution = solve_ivp(network.rate, (0.0, hold), state, method, args=(force, width * speed), t_eval=[hold], rtol=tolerance, atol=absolute)
                    if not solution.success or time.perf_counter() - begin > LONGEST_S:
                        break
                    state = solution.y[:, -1]
                    found[:, sample] = state[: network.n]
                else:
                    ms, apart = 1e3 * (time.perf_counter() - begin) / (hold * len(drives)), distance(found, expected)
                    if apart <= device["error"]:
                        if best is None or ms < best[0]:
                            best = (ms, apart, f"{method}, rtol {tolerance:g}" + (f", width {width:g} of the top speed" if network.frictions else ""))
                        break
                if best and time.perf_counter() - begin > 1e-3 * best[0] * hold * len(drives):
                    break
        if best:
            return best
    return None


def main():
    mujoco.set_mju_user_warning(lambda _: None)  # steps that are too long for it are part of the search
    print(f"MuJoCo {mujoco.__version__}\n\n| device | ours | MuJoCo | SciPy |\n|---|---|---|---|")
    for device in json.loads((FOLDER / "devices.json").read_text()):
        expected, ours = np.array(device["converged"]), device["ours"]
        cells = [f"{ours['ms']:.3f} ({100 * ours['apart']:.3f} %, {ours['us']:g} us)" if ours else "not within the error"]
        for found in (by_mujoco(device, expected), by_scipy(device, expected)):
            cells.append(f"{found[0]:.3g} ({100 * found[1]:.3f} %, {found[2]})" if found else "not within the error")
        print(f"| {device['name']} | {' | '.join(cells)} |", flush=True)


if __name__ == "__main__":
    main()
