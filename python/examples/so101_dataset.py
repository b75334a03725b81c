"""A LeRobot dataset of a small table-top arm in the manner of the SO-101, simulated in MuJoCo with what its model leaves out: 0.12 N m of dry friction at the
elbow, and 2 degrees of play in the gear of the pan.

    python so101_dataset.py FOLDER        writes FOLDER/dataset (version 3; by lerobot itself where it is installed) and FOLDER/arm.xml, the model without both

Servos of 18 N m/rad follow motions of three sines a joint for 12 s, four times, recorded 50 times a second as such an arm does it: positions of a 12-bit encoder at
the motor, in degrees, and efforts in steps of 3 mN m.
"""

import json
import pathlib
import sys

import mujoco
import numpy as np

FPS, SECONDS, EPISODES = 50, 12, 4
FRICTION = {"elbow_flex": 0.12}  # N m
PLAY = {"shoulder_pan": np.radians(2.0)}
FEATURES = ("observation.state", "action", "observation.effort")
# Name, axis, place on the one before (m), centre of mass (m), mass (kg), moments of inertia (kg m2), amplitude of its motion (rad), where it swings about (rad).
LINKS = [
    ("shoulder_pan", "0 0 1", "0 0 0.06", "0 0 0.03", 0.25, "2e-4 2e-4 2e-4", 0.7, 0.0),
    ("shoulder_lift", "0 1 0", "0 0 0.05", "0.02 0 0.055", 0.16, "2.5e-4 2.6e-4 6e-5", 0.5, 0.3),
    ("elbow_flex", "0 1 0", "0.02 0 0.11", "0.065 0.002 0", 0.15, "5e-5 2.4e-4 2.4e-4", 0.6, -0.2),
    ("wrist_flex", "0 1 0", "0.135 0 0", "0.03 0 0.003", 0.12, "3e-5 6e-5 6e-5", 0.7, 0.2),
    ("wrist_roll", "1 0 0", "0.06 0 0", "0.05 0.004 0", 0.14, "6e-5 1.2e-4 1.3e-4", 1.0, 0.0),
]
JOINTS = [link[0] for link in LINKS]
AMPLITUDE, MIDDLE = (np.array([link[n] for link in LINKS]) for n in (6, 7))


def mjcf(friction, play):
    """The arm, with dry friction (N m) and play (rad) at some joints: a motor of its own before its link there."""
    inner, ends = "", ""
    for name, axis, place, centre, mass, moments, _, _ in LINKS:
        inner += f'<body name="{name}_link" pos="{place}"><joint name="{name}" axis="{axis}" damping="0.3" armature="0.02" frictionloss="{friction.get(name, 0)}"/>'
        ends = "</body>" + ends
        if name in play:
            inner += f'<inertial pos="0 0 0" mass="1e-4" diaginertia="1e-6 1e-6 1e-6"/><body name="{name}_out"><joint name="{name}_play" axis="{axis}" limited="true" '
            inner += f'range="{-play[name] / 2} {play[name] / 2}" damping="0.002" armature="1e-4" solreflimit="0.002 1"/>'
            ends = "</body>" + ends
        inner += f'<inertial pos="{centre}" mass="{mass}" diaginertia="{moments}"/>'
    servos = "".join(f'<position name="{name}" joint="{name}" kp="18" kv="0.6" forcerange="-3 3"/>' for name in JOINTS)
    options = '<option timestep="0.0005" gravity="0 0 -9.81" integrator="implicitfast"/><compiler angle="radian"/>'
    return f'<mujoco model="so101-like">{options}<worldbody>{inner}{ends}</worldbody><actuator>{servos}</actuator></mujoco>'


def episode(xml, seed):
    """Rows of each feature, while the arm follows a motion of its own; the first second is not recorded."""
    model = mujoco.MjModel.from_xml_string(xml)
    data, random = mujoco.MjData(model), np.random.default_rng(seed)
    hertz = np.array([0.13, 0.31, 0.71]) * random.uniform(0.8, 1.25, (len(JOINTS), 3))
    phase, share = random.uniform(0.0, 2.0 * np.pi, (len(JOINTS), 3)), np.array([1.0, 0.45, 0.2]) / 1.2

    def target(t):
        return MIDDLE + AMPLITUDE * (share * np.sin(2.0 * np.pi * hertz * t + phase)).sum(1)

    places = [model.jnt_qposadr[model.joint(name).id] for name in JOINTS]
    data.qpos[places] = target(0.0)
    rows = {feature: [] for feature in FEATURES}
    for frame in range((SECONDS + 1) * FPS):
        data.ctrl[:] = target(frame / FPS)
        mujoco.mj_forward(model, data)
        if frame >= FPS:
            rows["observation.state"].append(np.round(data.qpos[places] / (2.0 * np.pi) * 4096) / 4096 * 360.0)
            rows["action"].append(np.degrees(data.ctrl))
            rows["observation.effort"].append(np.round(data.actuator_force / 0.003) * 0.003)
        mujoco.mj_step(model, data, round(1.0 / FPS / model.opt.timestep))
    return {feature: np.array(values, dtype="float32") for feature, values in rows.items()}


def features():
    """What the dataset says of its columns; lerobot adds its own."""
    return {feature: {"dtype": "float32", "shape": (len(JOINTS),), "names": [f"{name}.pos" for name in JOINTS]} for feature in FEATURES}


def by_lerobot(root, episodes):
    """Written by lerobot's own writer."""
    from lerobot.datasets.lerobot_dataset import LeRobotDataset

    dataset = LeRobotDataset.create("local/so101-like", fps=FPS, features=features(), root=root, robot_type="so101_follower", use_videos=False)
    for rows in episodes:
        for frame in range(len(rows["action"])):
            dataset.add_frame({feature: values[frame] for feature, values in rows.items()} | {"task": "follow"})
        dataset.save_episode()
    dataset.finalize()


def by_layout(root, episodes):
    """Written to the layout of version 3, with pyarrow alone."""
    import pyarrow
    from pyarrow import parquet

    own = {"timestamp": "float32", "frame_index": "int64", "episode_index": "int64", "index": "int64", "task_index": "int64"}
    told = features() | {name: {"dtype": dtype, "shape": (1,), "names": None} for name, dtype in own.items()}
    count = sum(len(rows["action"]) for rows in episodes)
    info = {"codebase_version": "v3.0", "fps": FPS, "features": told, "total_episodes": len(episodes), "total_frames": count, "total_tasks": 1}
    (root / "meta").mkdir(parents=True)
    (root / "meta/info.json").write_text(json.dumps(info | {"robot_type": "so101_follower"}))
    tables, index = [], 0
    for number, rows in enumerate(episodes):
        frames = np.arange(len(rows["action"]))
        columns = {f: pyarrow.FixedSizeListArray.from_arrays(pyarrow.array(values.ravel()), len(JOINTS)) for f, values in rows.items()}
        columns |= {"timestamp": (frames / FPS).astype("float32"), "frame_index": frames, "episode_index": np.full(len(frames), number)}
        tables.append(pyarrow.table(columns | {"index": frames + index, "task_index": np.zeros(len(frames), dtype="int64")}))
        index += len(frames)
    (root / "data/chunk-000").mkdir(parents=True)
    parquet.write_table(pyarrow.concat_tables(tables), root / "data/chunk-000/file-000.parquet")


def main():
    if len(sys.argv) != 2:
        sys.exit(__doc__)
    folder = pathlib.Path(sys.argv[1])
    folder.mkdir(parents=True, exist_ok=True)
    episodes = [episode(mjcf(FRICTION, PLAY), seed) for seed in range(EPISODES)]
    try:
        by_lerobot(folder / "dataset", episodes)
        writer = "lerobot"
    except ImportError:
        by_layout(folder / "dataset", episodes)
        writer = "pyarrow, to the layout of version 3"
    (folder / "arm.xml").write_text(mjcf({}, {}))
    print(f"wrote {folder / 'dataset'} ({writer}) and {folder / 'arm.xml'}")


if __name__ == "__main__":
    main()
