"""Columns of numbers: out of whatever holds them, and into what people work with."""

from __future__ import annotations

import importlib.util
import os
from collections.abc import Iterable, Mapping
from typing import Any

from . import _backdrive
from ._errors import InputError, UsageError

KINDS = ("auto", "numpy", "pandas", "polars")


def is_path(value: Any) -> bool:
    """Whether this names a file or a folder."""
    return isinstance(value, (str, os.PathLike))


def is_frame(value: Any) -> bool:
    """Whether this is one recording as columns, and not several of them by name."""
    if hasattr(value, "columns") and hasattr(value, "__getitem__"):
        return True
    if getattr(getattr(value, "dtype", None), "names", None):
        return True
    return isinstance(value, Mapping) and bool(value) and not any(is_path(v) or is_frame(v) for v in value.values())


def columns_of(frame: Any, name: str) -> dict[str, Any]:
    """The columns of numbers as arrays of doubles. Of a column of something else nothing is taken: it is missing then, and who needs it says so."""
    import numpy

    if getattr(getattr(frame, "dtype", None), "names", None):
        pairs = [(heading, frame[heading]) for heading in frame.dtype.names]
    elif isinstance(frame, Mapping):
        pairs = list(frame.items())
    else:
        pairs = [(heading, frame[heading]) for heading in frame.columns]
        index = getattr(frame, "index", None)  # pandas: a clock may stand there
        if "t" not in frame.columns and (getattr(index, "name", None) == "t" or getattr(getattr(index, "dtype", None), "kind", "") in ("m", "M")):
            pairs.insert(0, ("t", index))
    out: dict[str, Any] = {}
    rows = None
    for heading, column in pairs:
        if str(getattr(column, "dtype", "")).startswith("datetime64"):  # with a time zone too
            values = numpy.asarray(column, dtype="datetime64[ns]")
        else:
            values = column.to_numpy() if hasattr(column, "to_numpy") else numpy.asarray(column)
        if values.dtype.kind in "mM":
            values = seconds(values)
        if values.dtype.kind not in "fiub":
            if values.dtype.kind != "O":
                continue
            try:  # numbers with gaps
                values = values.astype("<f8")
            except (TypeError, ValueError):
                continue
        if values.ndim != 1:
            raise InputError(f"{name}: {heading}: has the shape {values.shape}; a column has one number a row: give each of its parts a name of its own")
        if rows is not None and len(values) != rows[1]:
            raise InputError(f"{name}: {heading}: has {len(values)} samples, \"{rows[0]}\" has {rows[1]}")
        rows = rows or (heading, len(values))
        out[str(heading)] = numpy.ascontiguousarray(values, dtype=float)
    if not out:
        raise InputError(f"{name}: has no columns of numbers; a recording is a frame or a dictionary with a column t (s) and one for each signal")
    return out


def seconds(values: Any) -> Any:
    """Instants as s since the first of them, durations as s; what is no time is NaN. Differences of whole ns: seconds since 1970 would leave only 0.2 us of a double."""
    import numpy

    span = values - values[:1] if values.dtype.kind == "M" else values
    return numpy.where(numpy.isnat(span), numpy.nan, span.astype("timedelta64[ns]").astype("i8") / 1e9)


def write(frame: Any, path: str, name: str) -> None:
    """Writes a recording as CSV, to the last bit."""
    _backdrive.write_table(path, list(columns_of(frame, name).items()))


def of_bytes(columns: Iterable[tuple[str, bytearray]], kind: str) -> Any:
    """Columns, each the bytes of doubles, as a frame of a kind; `auto` is pandas where it is installed, else a dictionary of arrays."""
    import numpy

    return of_kind({name: numpy.frombuffer(column, dtype="<f8") for name, column in columns}, kind)


def of_kind(arrays: dict[str, Any], kind: str) -> Any:
    """Columns as a frame of a kind."""
    if kind not in KINDS:
        raise UsageError(f"kind is {kind!r}, expected one of {', '.join(KINDS)}", 2)
    if kind == "polars":
        import polars

        return polars.DataFrame(arrays)
    if kind == "pandas" or kind == "auto" and importlib.util.find_spec("pandas"):
        import pandas

        return pandas.DataFrame(arrays)
    return arrays
