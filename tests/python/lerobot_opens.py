"""What lerobot itself finds in a dataset: python lerobot_opens.py DATASET, with a Python that has lerobot (0.4 or later).

Prints JSON: episodes, frames, frames a second, features, and by feature its first and last row; and that a second dataset, merged of it and itself, has twice as many.
"""

import json
import pathlib
import sys
import tempfile

from lerobot.datasets.aggregate import aggregate_datasets
from lerobot.datasets.lerobot_dataset import LeRobotDataset

root = pathlib.Path(sys.argv[1])
dataset = LeRobotDataset("local/ours", root=root)
rows = [dataset[0], dataset[len(dataset) - 1]]
features = [name for name in dataset.features if name.startswith(("observation", "action"))]
with tempfile.TemporaryDirectory() as place:
    merged = pathlib.Path(place) / "merged"
    aggregate_datasets(["local/ours", "local/again"], "local/merged", roots=[root, root], aggr_root=merged)
    twice = LeRobotDataset("local/merged", root=merged)
    stats = {name: twice.meta.stats[name]["mean"].tolist() for name in features}
    twice = [twice.num_episodes, len(twice)]
told = {
    "episodes": dataset.num_episodes,
    "frames": len(dataset),
    "fps": dataset.fps,
    "task": rows[0]["task"],
    "rows": {name: [row[name].tolist() for row in rows] for name in features},
    "twice": twice,
    "mean": stats,
}
print(json.dumps(told))
