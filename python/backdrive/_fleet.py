"""Many recordings over any executor: one stateless call a shard, and answers that are kept by content in a folder."""

from __future__ import annotations

import json
import os
import tempfile
from collections.abc import Mapping, Sequence
from concurrent.futures import Executor, as_completed
from dataclasses import dataclass, field
from typing import Any

from . import _backdrive, _toml
from ._errors import UsageError
from ._work import Bar, Progress, Work

_WHAT = ("triage", "diagnose", "fit", "stability")


@dataclass
class Survey:
    """What was found of a fleet: `changes`, `odd`, `parameters` and so on are in `analysis`."""

    out: str
    """The folder with answers, verdicts and the table."""
    table_path: str
    """The table, parquet: one row a recording and joint."""
    analysis: dict[str, Any] | None
    """Of a triage: changes, odd units and parameters of each unit; the content of `fleet.json`."""
    failed: dict[str, str] = field(default_factory=dict)
    """Recordings without an answer, each with the reason."""

    @property
    def changes(self) -> list[dict[str, Any]]:
        """Changes of single units, the clearest first."""
        return [] if self.analysis is None else self.analysis["changes"]

    @property
    def table(self) -> Any:
        """The table as a pandas frame; needs pandas and pyarrow."""
        import pandas

        return pandas.read_parquet(self.table_path)

    def __str__(self) -> str:
        lines = [change["sentence"] for change in self.changes] or ["nothing changed"]
        return "\n".join(lines + [f"{name}: {why}" for name, why in self.failed.items()])


def _shard(manifest: str, model: str | None, what: str, out: str, number: int, of: int, false_discoveries: float) -> str:
    """A shard in the process of a worker; its result as JSON."""
    with Work(False) as work:
        return work.answer(_backdrive.fleet, manifest, model=model, what=what, shard=(number, of), jobs=1, out=out, false_discoveries=false_discoveries).json


def map(
    recordings: Any,
    model: str | os.PathLike[str] | None = None,
    *,
    what: str = "triage",
    executor: Any = None,
    out: str | os.PathLike[str] | None = None,
    shards: int | None = None,
    false_discoveries: float = 0.01,
    progress: Progress = True,
) -> Survey:
    """Answers for many recordings, over threads, processes, Dask, MPI or Ray, and what the answers show together.

    recordings: a manifest, a folder whose folders are the units, a LeRobot dataset; or a list of `{"file": ..., "unit": ..., "date": ...}`.
    model: the nominal model of recordings for which the manifest names none. what: "triage", "diagnose", "fit" or "stability".
    executor: any `concurrent.futures.Executor`, such as Dask's `Client.get_executor()`; the module `ray` after `ray.init()`; without it this process.
    out: the folder for answers; every worker must reach it under this path. The same call with the same folder continues after an interruption.
    shards: parts of the work; without it as many as keep a worker busy for some seconds.
    """
    if what not in _WHAT:
        raise UsageError(f"what is {what!r}, and must be one of {', '.join(_WHAT)}", 2)
    out = os.path.abspath(tempfile.mkdtemp(prefix="backdrive-fleet-") if out is None else os.fspath(out))
    os.makedirs(out, exist_ok=True)
    manifest, count = _manifest(recordings, out)
    model = None if model is None else os.path.abspath(os.fspath(model))
    of = shards or max(1, min(count, -(-count // 32) if count > 512 else 16))
    jobs = [(manifest, model, what, out, number, of, false_discoveries) for number in range(1, of + 1)]
    bar = Bar() if progress is True else (progress if callable(progress) else None)
    failed: dict[str, str] = {}
    analysis = None
    try:
        for done, text in enumerate(_results(executor, jobs), 1):
            result = json.loads(text)
            failed.update(dict(result["recordings"]["failed"]))
            analysis = result["analysis"] or analysis
            if bar:
                bar(what, done, of)
    finally:
        if isinstance(bar, Bar):
            bar.close()
    return Survey(out, os.path.join(out, f"{what}.parquet"), analysis, dict(sorted(failed.items())))


def _results(executor: Any, jobs: Sequence[tuple[Any, ...]]) -> Any:
    """The results in the order in which they come."""
    if executor is None:
        yield from (_shard(*job) for job in jobs)
    elif getattr(executor, "__name__", None) == "ray":
        remote = executor.remote(_shard)
        waiting = [remote.remote(*job) for job in jobs]
        while waiting:
            ready, waiting = executor.wait(waiting)
            yield from executor.get(ready)
    elif isinstance(executor, Executor) or hasattr(executor, "submit"):
        futures = [executor.submit(_shard, *job) for job in jobs]
        try:
            yield from (future.result() for future in as_completed(futures))
        finally:
            for future in futures:
                future.cancel()
    else:
        raise UsageError(f"{type(executor).__name__} is no executor: it has no submit, and is not the module ray", 2)


def _manifest(recordings: Any, out: str) -> tuple[str, int]:
    """The path of a manifest, and about how many recordings it has."""
    if isinstance(recordings, (str, os.PathLike)):
        path = os.path.abspath(os.fspath(recordings))
        if os.path.isdir(path):
            return path, _count(path)
        with open(path, encoding="utf-8") as file:
            text = file.read()
        below = _count(os.path.dirname(path)) if "[[folders]]" in text else 0
        return path, max(1, text.count("[[recordings]]") + below)
    if not isinstance(recordings, Sequence) or not all(isinstance(one, Mapping) and "file" in one and "unit" in one for one in recordings):
        raise UsageError("recordings: expected a path, or a list of dictionaries with file and unit", 2)
    entries = [{**one, "file": os.path.abspath(os.fspath(one["file"])), "unit": str(one["unit"])} for one in recordings]
    for entry in entries:
        if "date" in entry:
            entry["date"] = str(entry["date"])
    path = os.path.join(out, "fleet.toml")
    with open(path, "w", encoding="utf-8") as file:
        for entry in entries:
            file.write("[[recordings]]\n" + _toml.document(entry) + "\n")
    return path, len(entries)


def _count(folder: str) -> int:
    """About how many recordings a folder has."""
    info = os.path.join(folder, "meta", "info.json")
    if os.path.isfile(info):
        with open(info, encoding="utf-8") as file:
            return int(json.load(file).get("total_episodes", 1))
    return sum(len(files) for _, _, files in os.walk(folder))
