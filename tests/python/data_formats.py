"""Recordings in the formats of others, by their own writers: pyarrow, scipy and rosbags; and what these read in files of ours.

    python data_formats.py write FOLDER     writes typed.parquet, stamps.parquet, typed.mat, packed.mat, dataset (LeRobot, version 3), sqlite (rosbag2), ros1.bag,
                                            and expected.json: by file the columns, each with its type and its numbers
    python data_formats.py read FILE        prints the same of a parquet or a MATLAB file, or of the data of a LeRobot dataset

Numbers are told by the bits of the double that they are, in hexadecimal.
"""

import json
import sqlite3
import struct
import sys
from pathlib import Path

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq
import scipy.io

TYPES = ["float64", "float32", "int8", "int16", "int32", "int64", "uint8", "uint16", "uint32", "uint64", "bool"]
JOINTS = ["shoulder_pan", "elbow_flex"]
BEGIN = 1_700_000_000_123_456_789


def bits(values):
    return [struct.pack(">d", float(value)).hex() for value in values]


def told(columns):
    return {name: [str(values.dtype), bits(values)] for name, values in columns.items()}


def typed(rows):
    """A column of every type, with its extremes as far as a double holds them, zero of both signs among them."""
    random = np.random.default_rng(7)
    columns = {"t": np.arange(rows) * 1e-3}
    for name in TYPES:
        kind = np.dtype(name)
        if kind.kind == "f":
            values = random.standard_normal(rows).astype(kind)
            values[:4] = [0.0, -0.0, np.finfo(kind).max, np.finfo(kind).tiny]
        elif kind.kind == "b":
            values = random.integers(0, 2, rows).astype(bool)
        else:
            edge = np.iinfo(kind)
            values = random.integers(0, 100, rows).astype(kind)
            values[:2] = [max(edge.min, -(2**53)), min(edge.max, 2**53)]
        columns[f"a_{name}"] = values
    return columns


def dataset(folder):
    """A LeRobot dataset to the layout of its version 3: three episodes over two files."""
    random, names = np.random.default_rng(3), [f"{joint}.pos" for joint in JOINTS]
    features = {f: {"dtype": "float32", "shape": [2], "names": names} for f in ("observation.state", "action", "observation.effort")}
    for name, kind in (("timestamp", "float32"), ("frame_index", "int64"), ("episode_index", "int64"), ("index", "int64"), ("task_index", "int64")):
        features[name] = {"dtype": kind, "shape": [1], "names": None}
    (folder / "meta").mkdir(parents=True)
    (folder / "data/chunk-000").mkdir(parents=True)
    (folder / "meta/info.json").write_text(json.dumps({"codebase_version": "v3.0", "fps": 50, "features": features}))
    tables, index, expected = [], 0, {}
    for episode, rows in enumerate((40, 700, 5)):
        flat = {f: (random.standard_normal((rows, 2)) * 90.0).astype("f4") for f in list(features)[:3]}
        columns = {f: pa.FixedSizeListArray.from_arrays(pa.array(values.ravel()), 2) for f, values in flat.items()}
        columns["timestamp"] = pa.array((np.arange(rows) / 50).astype("f4"))
        columns |= {"frame_index": pa.array(np.arange(rows)), "episode_index": pa.array(np.full(rows, episode))}
        columns |= {"index": pa.array(np.arange(index, index + rows)), "task_index": pa.array(np.zeros(rows, dtype="i8"))}
        tables.append(pa.table(columns))
        index += rows
        degree = np.pi / 180.0
        expected[f"episode_{episode:06}"] = {"t": np.arange(rows) / 50}
        for place, joint in enumerate(JOINTS):
            for role, feature, scale in (("position", "observation.state", degree), ("command", "action", degree), ("effort", "observation.effort", 1.0)):
                expected[f"episode_{episode:06}"][f"{joint}.{role}"] = flat[feature][:, place].astype(float) * scale
    pq.write_table(pa.concat_tables(tables[:2]), folder / "data/chunk-000/file-000.parquet", compression="snappy")
    pq.write_table(tables[2], folder / "data/chunk-000/file-001.parquet", compression="zstd")
    return {name: told(columns) for name, columns in expected.items()}


def rosbag(path, ros1, version):
    """20 JointStates, wrenches and bare numbers, and a topic of a type of somebody's own."""
    from rosbags.rosbag1 import Writer as Writer1
    from rosbags.rosbag2 import StoragePlugin
    from rosbags.rosbag2 import Writer as Writer2
    from rosbags.typesys import Stores, get_types_from_msg, get_typestore

    store = get_typestore(Stores.ROS1_NOETIC if ros1 else Stores.ROS2_HUMBLE)
    store.register(get_types_from_msg("float32 gain\nstring label\nuint8 state\n", "mine_msgs/msg/Own"))
    kinds, q = store.types, np.random.default_rng(5).standard_normal((20, 2))
    writer = Writer1(path) if ros1 else Writer2(path, version=version, storage_plugin=StoragePlugin.SQLITE3)
    if packed := path.stem.partition("_")[2] if ros1 else "":
        writer.set_compression(Writer1.CompressionFormat[packed.upper()])
    names = {"/joint_states": "sensor_msgs/msg/JointState", "/ft": "geometry_msgs/msg/WrenchStamped", "/excite": "std_msgs/msg/Float64", "/own": "mine_msgs/msg/Own"}
    with writer:
        topics = {topic: writer.add_connection(topic, kind, typestore=store) for topic, kind in names.items()}

        def send(topic, ns, message):
            raw = store.serialize_ros1(message, names[topic]) if ros1 else store.serialize_cdr(message, names[topic])
            writer.write(topics[topic], ns, bytes(raw))

        for row in range(20):
            ns = BEGIN + row * 10_000_000 + (35_000_000 if row > 12 else 0)
            time = kinds["builtin_interfaces/msg/Time"](sec=ns // 10**9, nanosec=ns % 10**9)
            header = kinds["std_msgs/msg/Header"](**({"seq": row} if ros1 else {}), stamp=time, frame_id="odd")
            send("/joint_states", ns + 777, kinds["sensor_msgs/msg/JointState"](header, JOINTS, q[row], q[row] * 2.0, np.array([])))
            vector = [kinds["geometry_msgs/msg/Vector3"](x=float(x), y=0.0, z=-1.5) for x in q[row]]
            send("/ft", ns + 777, kinds["geometry_msgs/msg/WrenchStamped"](header, kinds["geometry_msgs/msg/Wrench"](force=vector[0], torque=vector[1])))
            send("/excite", ns + 777, kinds["std_msgs/msg/Float64"](data=float(q[row, 0])))
            send("/own", ns + 777, kinds["mine_msgs/msg/Own"](gain=0.5 * row, label="x" * row, state=row))
    if path.name == "sqlite_old":  # as before ROS 2 Iron
        with sqlite3.connect(next(path.glob("*.db3"))) as database:
            database.execute("DROP TABLE message_definitions")
    return told({"position[1]": q[:, 1], "velocity[0]": q[:, 0] * 2.0, "wrench.torque.x": q[:, 1], "data": q[:, 0], "gain": np.arange(20) * 0.5})


def odd(folder):
    """What is easily taken for something else."""
    n = np.arange(100)
    for unit, step in (("ns", 2_000_000), ("us", 2_000), ("ms", 2)):
        columns = {"t": pa.array(n * step, pa.duration(unit)), "words": pa.array(["a"] * 100), "x": pa.array(n * 0.5)}
        pq.write_table(pa.table(columns), folder / f"durations-{unit}.parquet")
    pq.write_table(pa.table({"a": ["x", "y"], "b": ["p", "q"]}), folder / "words.parquet")
    pq.write_table(pa.table([n / 100.0, n * 1.0, n * 2.0], names=["t", "x", "x"]), folder / "twice.parquet")
    fields = {"decimal": pa.array(n).cast(pa.decimal128(21, 2)), "text": pa.array(["a", "b"] * 50).dictionary_encode()}
    fields |= {"when": pa.array(n, pa.timestamp("us")), "deep": pa.array([{"a": 1.0}] * 100), "few": pa.array([1.5, 2.5] * 50).dictionary_encode()}
    pq.write_table(pa.table({"t": n / 100.0} | fields), folder / "odd.parquet")
    # Two publishers of one topic, and one that changes the order of its joints.
    from rosbags.rosbag2 import StoragePlugin, Writer
    from rosbags.typesys import Stores, get_typestore

    store = get_typestore(Stores.ROS2_HUMBLE)
    kinds, kind = store.types, "sensor_msgs/msg/JointState"
    with Writer(folder / "joints", version=9, storage_plugin=StoragePlugin.SQLITE3) as writer:
        topic = writer.add_connection("/joint_states", kind, typestore=store)
        for row in range(60):
            ns = BEGIN + row * 5_000_000
            stamp = kinds["builtin_interfaces/msg/Time"](sec=ns // 10**9, nanosec=ns % 10**9)
            values = {"pan": float(row), "l.elbow": -float(row)} if row % 2 == 0 else {"gripper": 100.0 + row}
            names = list(values) if row % 4 == 0 else list(values)[::-1]
            header = kinds["std_msgs/msg/Header"](stamp=stamp, frame_id="")
            message = kinds[kind](header, names, np.array([values[name] for name in names]), np.array([]), np.array([]))
            writer.write(topic, ns, bytes(store.serialize_cdr(message, kind)))


def write(folder):
    odd(folder)
    expected = {}
    columns = typed(3_000)
    table = pa.table(columns)
    for codec in ("snappy", "zstd", "gzip", "none"):
        pq.write_table(table, folder / f"typed-{codec}.parquet", compression=codec, row_group_size=1_000)
    expected["typed"] = told(columns)
    words = pa.array(["run"] * 100)
    lists = pa.array([[1.0, 2.0]] * 100)
    late = pa.array([None] * 3 + [0.5] * 97)
    stamps = pa.array(BEGIN + np.arange(100) * 1_000_001, pa.timestamp("ns"))
    half = pa.array(np.linspace(-2.0, 2.0, 100).astype("float16"))
    big = pa.array(2**60 + np.arange(100))
    pq.write_table(pa.table({"t": stamps, "half": half, "words": words, "lists": lists, "big": big}), folder / "stamps.parquet")
    pq.write_table(pa.table({"t": np.arange(100) / 100, "late": late}), folder / "late.parquet")
    expected["stamps"] = told({"t": np.arange(100) * 1_000_001 / 1e9, "half": np.linspace(-2.0, 2.0, 100).astype("float16").astype("f4")})
    vectors = {name: values.reshape(-1, 1) for name, values in columns.items()}
    pair = np.random.default_rng(9).standard_normal((3_000, 2))
    extra = {"q": pair, "name": "emps", "gain": 35.15, "log": {"time": columns["t"], "q": pair.T}, "both": np.array([1 + 2j])}
    scipy.io.savemat(folder / "typed.mat", vectors | extra)
    scipy.io.savemat(folder / "packed.mat", vectors | extra, do_compression=True)
    expected["matrix"] = told({"q[0]": pair[:, 0], "q[1]": pair[:, 1]})
    expected["dataset"] = dataset(folder / "dataset")
    expected["sqlite"] = rosbag(folder / "sqlite", False, 9)
    expected["sqlite_old"] = rosbag(folder / "sqlite_old", False, 8)
    expected["ros1"] = rosbag(folder / "ros1.bag", True, None)
    rosbag(folder / "ros1_lz4.bag", True, None)
    rosbag(folder / "ros1_bz2.bag", True, None)
    (folder / "expected.json").write_text(json.dumps(expected))


def statistics(table, whole, episodes):
    """How many figures a dataset tells of its features, and by how much the worst is off what NumPy says of its rows."""
    told, worst = 0, 0.0
    for name in table.column_names:
        rows = np.array(table[name].to_pylist(), dtype=float).reshape(table.num_rows, -1)
        wanted = {"min": lambda x: x.min(0), "max": lambda x: x.max(0), "mean": lambda x: x.mean(0), "std": lambda x: x.std(0), "count": lambda x: [len(x)]}
        wanted |= {f"q{percent:02}": lambda x, percent=percent: np.quantile(x, percent / 100, axis=0) for percent in (1, 10, 50, 90, 99)}
        for figure, of in wanted.items():
            pairs = [(whole[name][figure], of(rows))]
            for row in episodes.itertuples():
                pairs.append((episodes.loc[row.Index, f"stats/{name}/{figure}"], of(rows[row.dataset_from_index : row.dataset_to_index])))
            for found, right in pairs:
                assert np.shape(found) == np.shape(right), (name, figure, found)
                told, worst = told + 1, max(worst, float(np.max(np.abs(np.asarray(found) - right))))
    return [told, worst]


def read(path):
    if path.is_dir():
        table = pa.concat_tables(pq.read_table(file) for file in sorted(path.glob("data/*/*.parquet")))
        columns = {}
        for name in table.column_names:
            column = table[name].combine_chunks()
            values = (column.flatten() if "list" in str(column.type) else column).to_numpy(zero_copy_only=False)
            columns[name] = values
        if not (path / "meta/tasks.parquet").exists():
            return told(columns)
        import pandas

        tasks, episodes = pandas.read_parquet(path / "meta/tasks.parquet"), pandas.read_parquet(path / "meta/episodes/chunk-000/file-000.parquet")
        meta = {"info": json.loads((path / "meta/info.json").read_text()), "stats": json.loads((path / "meta/stats.json").read_text())}
        meta |= {"tasks": list(tasks.index), "task_index": tasks["task_index"].tolist(), "lengths": episodes["length"].tolist()}
        meta |= {"from": episodes["dataset_from_index"].tolist(), "to": episodes["dataset_to_index"].tolist(), "of": [list(t) for t in episodes["tasks"]]}
        return told(columns) | {"meta": meta | {"statistics": statistics(table, meta["stats"], episodes)}}
    if path.suffix == ".parquet":
        table = pq.read_table(path)
        return told({name: table[name].to_numpy() for name in table.column_names})
    held = scipy.io.loadmat(path)
    # scipy gives logical arrays as bytes; the file's own list of its variables knows.
    logical = {name for name, _, kind in scipy.io.whosmat(path) if kind == "logical"}
    names = [str(line) for line in np.atleast_1d(held.pop("backdrive_names", np.array([], dtype=str)))]
    columns = {k: v[:, 0].astype(bool) if k in logical else v[:, 0] for k, v in held.items() if not k.startswith("__")}
    return told(columns) | {"names": names}


if __name__ == "__main__":
    if sys.argv[1] == "write":
        write(Path(sys.argv[2]))
    else:
        json.dump(read(Path(sys.argv[2])), sys.stdout)
