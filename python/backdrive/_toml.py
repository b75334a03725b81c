"""Settings as TOML."""

from __future__ import annotations

import json
import os
from collections.abc import Mapping
from typing import Any


def value(of: Any) -> str:
    """A value on one line."""
    if isinstance(of, bool):
        return "true" if of else "false"
    if isinstance(of, (str, os.PathLike)):
        return json.dumps(os.fspath(of), ensure_ascii=False).replace("\x7f", "\\u007f")
    if isinstance(of, Mapping):
        return "{ " + ", ".join(f"{value(str(k))} = {value(v)}" for k, v in of.items()) + " }" if of else "{}"
    if hasattr(of, "tolist"):
        return value(of.tolist())
    if isinstance(of, (list, tuple)):
        return "[" + ", ".join(value(v) for v in of) + "]"
    if isinstance(of, (int, float)):
        return repr(of)
    raise TypeError(f"{of!r} has no place in a settings file; expected text, numbers, lists and dictionaries")


def document(of: Mapping[str, Any]) -> str:
    """Keys and their values, one a line."""
    plain = {k: v for k, v in of.items() if v is not None and not isinstance(v, Mapping)}
    tables = {k: v for k, v in of.items() if isinstance(v, Mapping)}
    text = "".join(f"{value(k)} = {value(v)}\n" for k, v in plain.items())
    for name, table in tables.items():
        text += f"\n[{value(name)}]\n" + "".join(f"{value(str(k))} = {value(v)}\n" for k, v in table.items())
    return text
