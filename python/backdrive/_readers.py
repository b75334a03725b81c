"""Recordings as people have them, as frames: LeRobot datasets, parquet, MATLAB files, ROS bags.

The readers behind them are those that are kept where the formats are: `pyarrow` (parquet), `scipy` (MAT), `rosbags` (ROS 1, and rosbag2 in sqlite3).
Each is needed by its own function alone. Of every recording the clock is looked at: what is wrong with it is a `ClockWarning`.
"""

from __future__ import annotations

import importlib
import json
import os
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from . import _clock
from ._errors import InputError, MachineError
from ._frames import of_kind, seconds


@dataclass(frozen=True)
class Contract:
    """Which columns of a LeRobot dataset are what, in which unit, and when.

    measured, velocity, effort: features with one number a joint; one that the dataset does not have stays missing. commanded: likewise, the target that was
    sent to the joints. commanded_at: "frame" where the target of a row is sent at the row's time and holds to the next; "next" where it stands in the row before
    the one at whose time it is sent. angle: what one unit of measured and commanded is in rad ("deg", "rad", or a number, such as pi/100 of a joint whose
    half turn is 100), one for all or by joint; effort_scale: N m in one unit of effort, likewise. joints: other names for the joints, by the dataset's.
    """

    measured: str | None = "observation.state"
    commanded: str | None = "action"
    velocity: str | None = "observation.velocity"
    effort: str | None = "observation.effort"
    commanded_at: str = "frame"
    angle: str | float | Mapping[str, str | float] = "deg"
    effort_scale: float | Mapping[str, float] = 1.0
    joints: Mapping[str, str] | None = None

    def radians(self, joint: str) -> float:
        """rad in one unit of a joint's position."""
        of = _of_joint(self.angle, joint, "angle")
        if isinstance(of, str):
            if of not in ("deg", "rad"):
                raise InputError(f"contract: angle: is {of!r}, expected \"deg\", \"rad\" or a number of rad")
            return {"deg": 0.017453292519943295, "rad": 1.0}[of]
        return float(of)


def load_lerobot(
    folder: str | os.PathLike[str], episodes: Iterable[int] | None = None, *, contract: Contract = Contract(), kind: str = "auto"
) -> dict[str, Any]:
    """The episodes of a LeRobot dataset (version 3) as frames by name, `episode_000000` and so on.

    Columns: `t` (s), and of every joint what the dataset has: `JOINT.position`, `JOINT.command` (rad), `JOINT.velocity` (rad/s), `JOINT.effort` (N m).
    Time is the frame's number over the dataset's rate where the stamps, which are single precision, say the same to their last digits; else the stamps.
    """
    import numpy

    parquet = _module("pyarrow.parquet", "pyarrow")
    root = Path(folder)
    info = _info(root)
    version = str(info.get("codebase_version", ""))
    if not version.startswith("v3"):
        raise InputError(f"{root / 'meta/info.json'}: codebase_version: is {version!r}, expected v3.0; lerobot's own converter brings older datasets there")
    features, fps = info.get("features", {}), float(info["fps"])
    roles = {"position": contract.measured, "velocity": contract.velocity, "command": contract.commanded, "effort": contract.effort}
    there = {role: feature for role, feature in roles.items() if feature is not None and feature in features}
    if "position" not in there:
        raise InputError(f"{root / 'meta/info.json'}: features: has no {contract.measured!r}; it has {', '.join(features)}: name one with Contract(measured=...)")
    names = {role: _joints(features[feature], feature) for role, feature in there.items()}
    known = {joint for of in names.values() for joint in of}
    for key, given in (("angle", contract.angle), ("effort_scale", contract.effort_scale), ("joints", contract.joints)):
        if isinstance(given, Mapping) and (unknown := [joint for joint in given if joint not in known]):
            raise InputError(f"contract: {key}: the dataset has no joint {unknown[0]}; it has {', '.join(sorted(known))}")
    wanted = None if episodes is None else set(episodes)
    columns = ["timestamp", "frame_index", "episode_index", *there.values()]
    parts: dict[int, list[Any]] = {}
    files = sorted((root / "data").glob("chunk-*/file-*.parquet"))
    if not files:
        raise InputError(f"{root / 'data'}: holds no chunk-*/file-*.parquet")
    for file in files:
        table = _read(lambda: parquet.read_table(file, columns=columns), file)
        index = table["episode_index"].to_numpy()
        for episode in numpy.unique(index):
            if wanted is None or int(episode) in wanted:
                picked = numpy.flatnonzero(index == episode)
                parts.setdefault(int(episode), []).append({c: _matrix(table[c], picked, file, c) for c in columns})
    if wanted is not None and (absent := wanted - set(parts)):
        raise InputError(f"{root}: has no episode {', '.join(map(str, sorted(absent)))}")
    out: dict[str, Any] = {}
    for episode in sorted(parts):
        rows = {c: numpy.concatenate([part[c] for part in parts[episode]]) for c in columns}
        name = f"episode_{episode:06d}"
        stamps, even = rows["timestamp"][:, 0], rows["frame_index"][:, 0] / fps
        even = even - even[0] + stamps[0] if len(even) else even
        close = numpy.allclose(stamps, even, rtol=4.0 * float(numpy.finfo(numpy.float32).eps), atol=1e-6)
        frame = {"t": even if close else stamps}
        _clock.warn(frame["t"], name)
        for role, feature in there.items():
            for place, joint in enumerate(names[role]):
                scale = _scale(contract, role, joint)
                values = rows[feature][:, place] * scale
                if role == "command" and contract.commanded_at == "next":
                    values = numpy.concatenate([[numpy.nan], values[:-1]])
                frame[f"{(contract.joints or {}).get(joint, joint)}.{role}"] = values
        if "command" in there and contract.commanded_at == "next":
            frame = {column: values[1:] for column, values in frame.items()}
        out[name] = of_kind(frame, kind)
    return out


def _info(root: Path) -> dict[str, Any]:
    path = root / "meta/info.json"
    try:
        info = json.loads(path.read_text(encoding="utf-8"))
    except OSError as error:
        raise InputError(f"{path}: cannot be read: {error.strerror}; is this the folder of a LeRobot dataset?") from error
    except ValueError as error:
        raise InputError(f"{path}: {error}") from error
    if not isinstance(info, dict) or not isinstance(info.get("fps"), (int, float)) or info["fps"] <= 0:
        raise InputError(f"{path}: fps: expected a number above 0, frames a second")
    return info


def _joints(feature: Mapping[str, Any], name: str) -> list[str]:
    """The joints of a feature; lerobot calls their positions `JOINT.pos` and the like."""
    names = feature.get("names")
    if isinstance(names, Mapping):  # {"motors": [...]}
        names = next(iter(names.values()), None)
    if not isinstance(names, list):
        names = [f"joint{number}" for number in range(1, int(feature["shape"][0]) + 1)]
    if len(names) != int(feature["shape"][0]):
        raise InputError(f"meta/info.json: features.{name}.names: has {len(names)} names, the shape has {feature['shape'][0]}")
    joints = [str(n).rsplit(".", 1)[0] for n in names]
    # Where only the end separates joints, it is not the name of a quantity: arm.1, arm.2.
    return joints if len(set(joints)) == len(joints) else [str(n) for n in names]


def _of_joint(given: Any, joint: str, key: str) -> Any:
    """What is given for all joints, or for this one."""
    if not isinstance(given, Mapping):
        return given
    if joint not in given:
        raise InputError(f"contract: {key}: has nothing for {joint}; it has {', '.join(map(str, given))}")
    return given[joint]


def _scale(contract: Contract, role: str, joint: str) -> float:
    if role == "effort":
        return float(_of_joint(contract.effort_scale, joint, "effort_scale"))
    return contract.radians(joint)


def _matrix(column: Any, rows: Any, file: Path, name: str) -> Any:
    """Rows of a column, one or several numbers each, as doubles; what is missing is NaN."""
    import numpy

    picked = column.combine_chunks().take(rows) if hasattr(column, "combine_chunks") else column.take(rows)
    flat = getattr(picked, "flatten", None)
    kind = str(picked.type)
    if kind.startswith(("fixed_size_list", "list")) and flat is not None:
        values = flat().to_numpy(zero_copy_only=False).astype(float)
        if len(rows) and len(values) % len(rows):
            raise InputError(f"{file}: {name}: rows have different numbers of values")
        return values.reshape(len(rows), -1)
    return numpy.asarray(picked.to_numpy(zero_copy_only=False), dtype=float).reshape(len(rows), 1)


def load_parquet(path: str | os.PathLike[str], *, time: str = "t", kind: str = "auto") -> Any:
    """A table in parquet as a frame; `time` is its column of times: s, or instants, which are counted from the first. Columns that hold no numbers are left out."""
    return _timed(_parquet(path), time, path, kind)


def _parquet(path: Any) -> dict[str, Any]:
    """The columns of numbers and of times, these in s (instants since the first of them); what is missing in them is NaN."""
    import numpy

    parquet = _module("pyarrow.parquet", "pyarrow")
    table = _read(lambda: parquet.read_table(os.fspath(path)), path)
    numbers, times = ("float", "double", "halffloat", "int", "uint", "bool"), ("timestamp", "duration")
    out: dict[str, Any] = {}
    for name in table.column_names:
        kind = str(table[name].type)
        if kind.startswith(times):
            out[name] = seconds(table[name].to_numpy())
        elif kind.startswith(numbers):
            out[name] = numpy.asarray(table[name].to_numpy(), dtype=float)
    return out


def numbers_of(path: str) -> dict[str, Any] | None:
    """The columns of a file that is no recording of ours; `None` of one that is, or may be."""
    suffix = os.path.splitext(path)[1].lower()
    if suffix == ".parquet":
        return _parquet(path)
    if suffix == ".mat":
        return _mat(path, None)[0]
    return None


def load_mat(path: str | os.PathLike[str], *, time: str = "t", variable: str | None = None, kind: str = "auto") -> Any:
    """A MATLAB file (version 4 to 7.2) as a frame: vectors as long as `time`, s, which is one of them.

    variable: the structure whose fields they are, where they are those of one. A matrix becomes columns `NAME[0]`, `NAME[1]` and so on.
    """
    frame, vectors = _mat(path, variable, time)
    if time not in frame:
        raise InputError(f"{path}: {time}: is no vector of times; vectors are {', '.join(vectors)}: name one with time=...")
    return _timed(frame, time, path, kind)


def _mat(path: Any, variable: str | None, time: str | None = None) -> tuple[dict[str, Any], list[str]]:
    """The vectors as long as that of the times, or as the longest, and the names of all vectors."""
    import numpy

    scipy_io = _module("scipy.io", "scipy")
    held = _read(lambda: scipy_io.loadmat(os.fspath(path), squeeze_me=True, struct_as_record=True), path)
    if variable is not None:
        if variable not in held:
            raise InputError(f"{path}: {variable}: there is none; there are {', '.join(k for k in held if not k.startswith('__'))}")
        struct = held[variable]
        held = {name: struct[name].item() for name in struct.dtype.names or ()}
    arrays = {k: numpy.asarray(v) for k, v in held.items() if not k.startswith("__")}
    vectors = [k for k, v in arrays.items() if v.ndim == 1 and v.dtype.kind in "fiub"]
    rows = len(arrays[time]) if time in vectors else max((len(arrays[k]) for k in vectors), default=0)
    frame: dict[str, Any] = {}
    for name, values in arrays.items():
        if values.dtype.kind not in "fiub" or values.ndim not in (1, 2):
            continue
        if values.ndim == 1 and len(values) == rows:
            frame[name] = values.astype(float)
        elif values.ndim == 2 and rows in values.shape:
            by_row = values if values.shape[0] == rows else values.T
            frame.update({f"{name}[{n}]": by_row[:, n].astype(float) for n in range(by_row.shape[1])})
    return frame, vectors


def load_rosbag(path: str | os.PathLike[str], *, topics: str | Iterable[str] | None = None, kind: str = "auto") -> dict[str, Any]:
    """A ROS 1 bag, or a rosbag2 folder (sqlite3 or MCAP), as a frame for each topic: `t` (s since the bag's first message), and a column for each number.

    `t` is the header's stamp where messages have one that is filled in, else the time at which they were recorded. A list becomes columns `NAME[0]` and so on, or,
    of a JointState, `NAME.JOINT`.
    """
    import numpy

    highlevel = _module("rosbags.highlevel", "rosbags")
    wanted = None if topics is None else {topics} if isinstance(topics, str) else set(topics)
    rows: dict[str, list[tuple[int, int, dict[str, float]]]] = {}
    if not Path(path).exists():
        raise InputError(f"{path}: there is no such bag")
    with _read(lambda: highlevel.AnyReader([Path(path)]), path) as reader:
        if wanted and (absent := wanted - set(reader.topics)):
            raise InputError(f"{path}: has no topic {', '.join(sorted(absent))}; it has {', '.join(sorted(reader.topics))}")
        connections = [c for c in reader.connections if wanted is None or c.topic in wanted]
        for connection, logged, raw in reader.messages(connections=connections):
            message = _read(lambda: reader.deserialize(raw, connection.msgtype), path)
            numbers: dict[str, float] = {}
            _flatten(message, "", numbers)
            stamp = getattr(getattr(message, "header", None), "stamp", None)
            stamped = 0 if stamp is None else int(stamp.sec) * 1_000_000_000 + int(stamp.nanosec)
            rows.setdefault(connection.topic, []).append((stamped, logged, numbers))
    stamped_topics = {topic: all(stamp != 0 for stamp, _, _ in of) for topic, of in rows.items()}
    times = {topic: [s if stamped_topics[topic] else logged for s, logged, _ in of] for topic, of in rows.items()}
    begin = min((min(t) for t in times.values()), default=0)
    out: dict[str, Any] = {}
    for topic, of in rows.items():
        # Differences of whole ns: seconds since 1970 would leave only 0.2 us of a double.
        frame = {"t": numpy.array([t - begin for t in times[topic]], dtype=float) / 1e9}
        _clock.warn(frame["t"], topic)
        headings = list(dict.fromkeys(name for _, _, numbers in of for name in numbers))
        frame.update({name: numpy.array([numbers.get(name, numpy.nan) for _, _, numbers in of]) for name in headings})
        out[topic] = of_kind(frame, kind)
    return out


def save(frame: Any, path: str | os.PathLike[str], *, overwrite: bool = False) -> None:
    """Writes a recording as .csv, .parquet, .mat or .mcap, by the ending of the path; what is read back is the same to the last bit."""
    from ._frames import columns_of, write

    name, suffix = os.fspath(path), os.path.splitext(os.fspath(path))[1].lower()
    if os.path.exists(name) and not overwrite:
        raise InputError(f"{name}: is there already; say overwrite=True, or write to another file")
    if suffix == ".csv":
        write(frame, name, "recording")
        return
    if suffix == ".mcap":
        from ._verbs import save_bag

        save_bag(frame, name, overwrite=overwrite)
        return
    columns = columns_of(frame, "recording")
    if suffix == ".parquet":
        pyarrow, parquet = _module("pyarrow", "pyarrow"), _module("pyarrow.parquet", "pyarrow")
        parquet.write_table(pyarrow.table(columns), name)
    elif suffix == ".mat":
        for heading in columns:
            if not heading.isidentifier() or heading.startswith("_") or len(heading) > 63:
                raise InputError(f"{name}: {heading}: is no name that MATLAB takes: a letter, then letters, digits and _, at most 63; rename the column")
        _module("scipy.io", "scipy").savemat(name, columns, oned_as="column", long_field_names=True)
    else:
        raise InputError(f"{name}: ends in none of .csv, .parquet, .mat and .mcap, so nobody knows what to write")


def _flatten(value: Any, name: str, out: dict[str, float]) -> None:
    """Every number of a message, under its place in it."""
    fields = getattr(value, "__dataclass_fields__", None)
    if fields is not None:
        joints = list(value.name) if "JointState" in str(getattr(value, "__msgtype__", "")) else None
        for field in fields:
            if field in ("header", "__msgtype__"):
                continue
            inner = getattr(value, field)
            at = f"{name}.{field}" if name else field
            if joints and field in ("position", "velocity", "effort"):
                out.update({f"{at}.{joint}": float(v) for joint, v in zip(joints, inner)})
            else:
                _flatten(inner, at, out)
    elif isinstance(value, (bool, int, float)) or getattr(value, "ndim", None) == 0:
        out[name] = float(value)
    elif not isinstance(value, (str, bytes)) and hasattr(value, "__len__"):
        for number, one in enumerate(value):
            _flatten(one, f"{name}[{number}]", out)


def _timed(frame: dict[str, Any], time: str, path: Any, kind: str) -> Any:
    """With its times first, called t."""
    if time not in frame:
        raise InputError(f"{os.fspath(path)}: {time}: there is no such column of numbers; there are {', '.join(frame)}: name the times with time=...")
    _clock.warn(frame[time], os.path.basename(os.fspath(path)))
    return of_kind({"t": frame[time], **{name: values for name, values in frame.items() if name != time}}, kind)


def _module(name: str, package: str) -> Any:
    try:
        return importlib.import_module(name)
    except ImportError as error:
        raise MachineError(f"this needs the package {package}: pip install {package}", 5) from error


def _read(read: Any, path: Any) -> Any:
    """What a reader of somebody else's gives, its errors with the file."""
    try:
        return read()
    except (InputError, MachineError):
        raise
    except FileNotFoundError as error:
        raise InputError(f"{os.fspath(path)}: there is no such file") from error
    except Exception as error:  # noqa: BLE001: whatever such a reader raises, the file cannot be read
        raise InputError(f"{os.fspath(path)}: cannot be read: {error}") from error
