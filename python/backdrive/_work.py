"""One call of a verb: a folder for its files, its progress, its errors."""

from __future__ import annotations

import os
import re
import sys
import tempfile
import time
import warnings
from collections.abc import Callable, Mapping, Sequence
from typing import Any

from . import _backdrive, _frames, _toml
from ._errors import UsageError, raised
from ._readers import numbers_of

INTERRUPTED = 130
Frame = tuple[str, list[tuple[str, Any]]]  # a recording in memory: its name, and its columns with their headings
Progress = bool | Callable[[str, int, int | None], None]


class Bar:
    """Progress that shows itself once the work has taken half a second: a bar of tqdm where it is installed, else a line."""

    def __init__(self) -> None:
        self.began = time.monotonic()
        self.next = self.began + 0.5
        self.bar: Any = None  # False where there is no tqdm
        self.line = False

    def __call__(self, message: str, position: int, length: int | None) -> None:
        now = time.monotonic()
        if now < self.next:
            return
        self.next = now + 0.2
        if self.bar is None:
            try:
                with warnings.catch_warnings():
                    warnings.simplefilter("ignore")  # a notebook without widgets gets a bar of characters
                    from tqdm.auto import tqdm

                self.bar = tqdm(total=length, leave=False, bar_format="{desc} {bar} {elapsed}" if length else "{desc} {elapsed}")
            except ImportError:
                self.bar = False
        if self.bar is not False:  # a bar without an end has no truth
            self.bar.set_description_str(message, refresh=False)
            self.bar.total = length
            self.bar.n = min(position, length) if length else position
            self.bar.refresh()
        elif sys.stderr.isatty():
            sys.stderr.write(f"\r{message[:60]:60} {time.monotonic() - self.began:4.0f} s")
            sys.stderr.flush()
            self.line = True

    def close(self) -> None:
        if self.bar is not None and self.bar is not False:
            self.bar.close()
        if self.line:
            sys.stderr.write("\r" + 70 * " " + "\r")


class Work:
    """One call of a verb, with a folder for what it is given as text, such as a changed model."""

    def __init__(self, progress: Progress) -> None:
        self.progress = progress
        self.notes: list[str] = []
        self.code = 0
        self.names: set[str] = set()

    def __enter__(self) -> Work:
        self.temporary = tempfile.TemporaryDirectory(prefix="backdrive-", ignore_cleanup_errors=True)
        self.folder = self.temporary.name
        return self

    def __exit__(self, *_: object) -> None:
        self.temporary.cleanup()

    def path(self, name: str) -> str:
        return os.path.join(self.folder, name)

    def without_folder(self, text: str) -> str:
        """A text without the path of the temporary folder."""
        return text.replace(self.folder + os.sep, "").replace(self.folder, "the recordings")

    def text_file(self, name: str, text: str) -> str:
        path = self.path(name)
        with open(path, "w", encoding="utf-8") as file:
            file.write(text)
        return path

    def asked(self, verb: Callable[..., Any], *given: Any, **options: Any) -> Any:
        """Calls a function behind a verb; its answer. What was raised while it worked is in there."""
        answer = self._watched(lambda progress: verb(*given, **options, progress=progress))
        if answer.raised is None:
            self._ended(answer.code, answer.notes, answer.error)
        return answer

    def answer(self, verb: Callable[..., Any], *given: Any, **options: Any) -> Any:
        """The same; what was raised while it worked is raised."""
        answer = self.asked(verb, *given, **options)
        if answer.raised is not None:
            raise answer.raised
        return answer

    def _watched(self, call: Callable[[Any], Any]) -> Any:
        bar = Bar() if self.progress is True else None
        try:
            return call(bar or (self.progress if callable(self.progress) else None))
        finally:
            if bar:
                bar.close()

    def _ended(self, code: int, notes: Sequence[str], error: str | None) -> None:
        self.notes += [self.without_folder(note).removeprefix("note: ") for note in notes]
        self.code = code
        if error is not None and code != INTERRUPTED:
            raise raised(self.without_folder(error), code)

    def recording(self, given: Any, name: str) -> str | Frame:
        """One recording: a path, or its name and its columns."""
        if _frames.is_path(given):
            numbers = numbers_of(os.fspath(given))
            if numbers is None:
                return os.fspath(given)
            given, name = numbers, os.path.splitext(os.path.basename(given))[0]
        shown = (re.sub(r"[^\w.\-]+", "-", name).strip("-.") or "recording") + ".csv"
        if shown in self.names:
            raise UsageError(f"two recordings are called {shown.removesuffix('.csv')}; give each a name of its own", 2)
        self.names.add(shown)
        return shown, list(_frames.columns_of(given, name).items())

    def recordings(self, given: Any, name: str) -> list[str | Frame]:
        """One, a sequence of them, or a dictionary of them by name."""
        if given is None:
            return []
        if _frames.is_path(given) or _frames.is_frame(given):
            return [self.recording(given, name)]
        if isinstance(given, Mapping):
            return [self.recording(one, str(key)) for key, one in given.items()]
        if isinstance(given, Sequence):
            return [self.recording(one, f"{name}-{number}") for number, one in enumerate(given, 1)]
        raise UsageError(f"{type(given).__name__} is no recording: expected a path, a frame, a dictionary of arrays, or several of these", 2)

    def file(self, given: Any, name: str) -> str:
        """One recording as a path; columns go into the folder."""
        one = self.recording(given, name)
        if isinstance(one, str):
            return one
        path = self.path(one[0])
        _backdrive.write_table(path, one[1])
        return path

    def set(self, recordings: Any, held_out: Any, settings: Mapping[str, Any]) -> list[str] | dict[str, Any]:
        """Recordings of a verb: paths unchanged where nothing else is stated, else a set with its frames."""
        settings = {k: v for k, v in settings.items() if v}
        fit = self.recordings(recordings, "recording")
        paths = [one for one in fit if isinstance(one, str)]
        if held_out is None and not settings and len(paths) == len(fit):
            return paths
        if len(fit) == 1 and paths and (os.path.isdir(paths[0]) or paths[0].endswith(".toml")):
            raise UsageError(f"{paths[0]}: a set states what is held out and how its columns are named; write it there, or give its files", 2)
        return stated(fit, self.recordings(held_out, "held-out"), settings)


def stated(fit: Sequence[str | Frame], held_out: Sequence[str | Frame], settings: Mapping[str, Any]) -> dict[str, Any]:
    """A set: what stands in its `set.toml`, and those of its recordings that are no files."""
    names = [[os.path.abspath(one) if isinstance(one, str) else one[0] for one in some] for some in (fit, held_out)]
    text = _toml.document({"fit": names[0], "held_out": names[1], **settings})
    return {"settings": text, "frames": [one for one in (*fit, *held_out) if not isinstance(one, str)]}
