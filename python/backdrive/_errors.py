"""What goes wrong, as exceptions."""

from __future__ import annotations

import re

_PLACE = re.compile(r"^(?P<file>[^:\n]+?)(?::(?P<line>\d+))?: (?:(?P<key>[A-Za-z_][\w.\-\"\[\]]*): )?", re.ASCII)
_NAME = re.compile(r"\.(toml|csv|mcap|xml|urdf|mjcf|json)$|^recording-\d+$", re.IGNORECASE)


class Error(Exception):
    """Something could not be done. `str()` of it states what was wrong, where, and what to do.

    `file`, `line` and `key` are where, `None` where that is not known; `code` is the exit code that the command line would end with.
    """

    def __init__(self, message: str, code: int = 3) -> None:
        super().__init__(message)
        self.message: str = message
        self.code: int = code
        found = _PLACE.match(message)
        if found is not None and _NAME.search(found["file"]) is None and found["line"] is None:
            found = None
        self.file: str | None = found["file"] if found else None
        self.line: int | None = int(found["line"]) if found and found["line"] else None
        self.key: str | None = found["key"] if found else None


class UsageError(Error, ValueError):
    """An argument is none that can be used."""


class InputError(Error, ValueError):
    """A file or a recording is missing, wrong, or does not hold what is needed."""


class MachineError(Error, OSError):
    """This machine does not let it: disk, permission."""

    def __str__(self) -> str:
        return self.message


def raised(message: str, code: int) -> Error:
    """The exception for an exit code."""
    kind = {2: UsageError, 3: InputError, 5: MachineError}.get(code, Error)
    return kind(message, code)
