"""What lerobot-doctor finds in the sealed draws of `inspect`, as LeRobot datasets of version 3, beside what `inspect` found.

    BACKDRIVE_LONG=1 BACKDRIVE_SEALED_OUT=DRAWS cargo test -p backdrive-inspect --test sealed
    python tests/python/doctor_on_sealed.py DRAWS

Needs lerobot-doctor and pyarrow. Draws with commands and positions count, for a dataset has an action and a state. A draw is found where the doctor warns or fails on it with a check
that passes on the clean recording of the same draw; whichever check, at whichever column. A clean draw has a false finding where a check of its signals warns or fails.
"""

import collections
import json
import sys
import tempfile
from pathlib import Path

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq
from lerobot_doctor.dataset_loader import load_local
from lerobot_doctor.runner import Severity, run_checks

# Those that look at signals; the rest are about files, videos and training.
CHECKS = ["temporal", "actions", "statistics", "episodes", "consistency", "anomalies", "per_episode"]


def columns_of(path):
    """Time, actions and states of a table, and the names of both."""
    with open(path) as file:
        headings = [heading.split(":", 2) for heading in file.readline().strip().split(",")]
    values = np.genfromtxt(path, delimiter=",", skip_header=1)
    of = lambda *roles: [i for i, heading in enumerate(headings) if heading[0] in roles]
    states = of("position", "velocity", "drive")
    return values[:, of("time")[0]], values[:, of("command")], values[:, states], [headings[i][2] for i in states]


def dataset(root, tables):
    """Writes a dataset with an episode for each table."""
    episodes, rows, first = [], [], 0
    for number, (time, action, state, _) in enumerate(tables):
        episodes.append({"episode_index": number, "length": len(time), "dataset_from_index": first, "dataset_to_index": first + len(time), "tasks": ["drawn"]})
        for i in range(len(time)):
            rows.append((action[i].tolist(), state[i].tolist(), time[i] - time[0], i, number, first + i, 0))
        first += len(time)
    names = ["action", "observation.state", "timestamp", "frame_index", "episode_index", "index", "task_index"]
    for folder in ["data/chunk-000", "meta/episodes/chunk-000"]:
        (root / folder).mkdir(parents=True)
    pq.write_table(pa.table({name: list(column) for name, column in zip(names, zip(*rows))}), root / "data/chunk-000/file-000.parquet")
    pq.write_table(pa.Table.from_pylist(episodes), root / "meta/episodes/chunk-000/file-000.parquet")
    pq.write_table(pa.table({"task": ["drawn"], "task_index": [0]}), root / "meta/tasks.parquet")
    stats = {}
    for place, name in enumerate(names[:2]):
        all_rows = np.array([row[place] for row in rows])
        stats[name] = {key: getattr(np, "nan" + key)(all_rows, axis=0).tolist() for key in ["mean", "std", "min", "max"]} | {"count": [len(rows)]}
    (root / "meta/stats.json").write_text(json.dumps(stats))
    wide = lambda count: {"dtype": "float32", "shape": [count], "names": [f"joint_{i}" for i in range(count)]}
    scalar = lambda dtype: {"dtype": dtype, "shape": [1], "names": None}
    rate = round(1 / np.median(np.diff(tables[0][0])))
    info = {
        "codebase_version": "v3.0", "robot_type": "drawn", "fps": rate, "total_episodes": len(tables), "total_frames": len(rows), "total_tasks": 1, "chunks_size": 1000,
        "data_path": "data/chunk-{chunk_index:03d}/file-{file_index:03d}.parquet", "video_path": None, "splits": {"train": f"0:{len(tables)}"},
        "features": {"action": wide(len(rows[0][0])), "observation.state": wide(len(rows[0][1])), "timestamp": scalar("float32")}
        | {name: scalar("int64") for name in names[3:]},
    }
    (root / "meta/info.json").write_text(json.dumps(info))


def complaints(tables):
    """The checks that do not pass, each with how badly."""
    with tempfile.TemporaryDirectory() as place:
        root = Path(place) / "dataset"
        dataset(root, tables)
        report = run_checks(load_local(root), CHECKS)
        return {(result.name, message.message.split(":")[0], message.severity) for result in report.results for message in result.messages if message.severity != Severity.PASS}


counts = collections.defaultdict(lambda: [0, 0, 0])
clean = [0, 0]
for folder in sorted(Path(sys.argv[1]).iterdir(), key=lambda folder: int(folder.name)):
    base = columns_of(folder / "clean-0.csv")
    if base[1].shape[1] == 0:
        continue
    name = (folder / "truth.txt").read_text()
    drawn = [columns_of(path) for path in sorted(folder.glob("drawn-*.csv"))]
    said = complaints(drawn)
    if name == "clean":
        clean[0] += bool(said)
        clean[1] += 1
        continue
    # A clean recording cut as the draw is.
    lengths = [len(table[0]) for table in drawn]
    starts = np.minimum(np.cumsum([0, *lengths[:-1]]), max(len(base[0]) - 2, 0))
    before = complaints([tuple(part[start : start + length] for part in base[:3]) + (base[3],) for start, length in zip(starts, lengths)])
    severity = lambda found: {(check, bad) for check, _, bad in found}
    counts[name][0] += bool(severity(said) - severity(before))
    counts[name][1] += (folder / "inspect.txt").read_text() == "found"
    counts[name][2] += 1
print(f"{'fault':20} {'doctor':>8} {'inspect':>8} {'draws':>6}")
for name, (doctor, ours, all_of) in sorted(counts.items()):
    print(f"{name:20} {doctor:8} {ours:8} {all_of:6}")
doctor, ours, all_of = np.sum(list(counts.values()), axis=0)
print(f"{'all':20} {doctor:8} {ours:8} {all_of:6}")
print(f"clean draws on which a check of the doctor's warns or fails: {clean[0]} of {clean[1]}")
