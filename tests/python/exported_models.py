"""Runs exported models in MuJoCo, and says how far they are from our own simulation.

    python exported_models.py FOLDER

`cases.json` in FOLDER lists cases: `name`, the MJCF `NAME.xml`, the `period` (s) for which each sample of the `inputs` is held, `inputs` by the name of their
actuator, and what we compute of the `outputs`, by the name of their sensor. Contacts of geoms are switched off, as our simulation has none; the step and all
else is the file's. `led` are positions of joints that are led: set, with their speed, before each sample's steps. Printed is the largest difference of each output over the whole time, as a share of its range.
"""

import json
import sys
from pathlib import Path

import mujoco
import numpy as np

from runner import Table, share_of_range

LIMIT = 0.01  # share of an output's range


def run(path, case):
    """Each output at every sample."""
    model = mujoco.MjModel.from_xml_path(str(path))
    model.opt.disableflags |= mujoco.mjtDisableBit.mjDSBL_CONTACT
    data = mujoco.MjData(model)
    if model.nkey:
        mujoco.mj_resetDataKeyframe(model, data, model.key("pose").id)
    each = round(case["period"] / model.opt.timestep)
    assert abs(each * model.opt.timestep - case["period"]) < 1e-9, "the samples are whole steps apart"
    controls = {model.actuator(name).id: column for name, column in case["inputs"].items()}
    sensors = [model.sensor(name).adr[0] for name in case["outputs"]]
    led = [(model.joint(name), np.append(column, column[-1])) for name, column in case["led"].items()]
    count = len(next(iter(case["outputs"].values())))
    found = np.zeros((count, len(sensors)))
    for sample in range(count):
        for actuator, column in controls.items():
            data.ctrl[actuator] = column[sample]
        for joint, column in led:
            data.qpos[joint.qposadr[0]] = column[sample]
            data.qvel[joint.dofadr[0]] = (column[sample + 1] - column[sample]) / case["period"]
        mujoco.mj_forward(model, data)
        found[sample] = data.sensordata[sensors]
        mujoco.mj_step(model, data, nstep=each)
    return dict(zip(case["outputs"], found.T)), model.opt


def main():
    if len(sys.argv) != 2:
        sys.exit(__doc__)
    folder = Path(sys.argv[1])
    table = Table("exported to MuJoCo " + mujoco.__version__, ["of the range"])
    for case in json.loads((folder / "cases.json").read_text()):
        found, option = run(folder / f"{case['name']}.xml", case)
        seconds = case["period"] * len(next(iter(case["outputs"].values())))
        print(f"  {case['name']}: {seconds:.4g} s in steps of {1e3 * option.timestep:.3g} ms, {mujoco.mjtIntegrator(option.integrator).name[6:]}")
        for name, expected in case["outputs"].items():
            expected = np.array(expected)
            column = found[name]
            if name in case["from_zero"]:
                column = column - column[0] + expected[0]
            table.row(f"    {name}", [share_of_range(column, expected)], [LIMIT])
    table.verdict()


if __name__ == "__main__":
    main()
