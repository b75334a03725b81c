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
    """A folder of its own, in which frames become files, for as long as a verb works."""

    def __init__(self, progress: Progress) -> None:
        self.progress = progress
        self.notes: list[str] = []
        self.code = 0

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

    def from_here(self, path: str) -> str:
        """A path as the set names it: files of ours by their name, others whole."""
        return os.path.basename(path) if os.path.dirname(path) == self.folder else os.path.abspath(path)

    def text_file(self, name: str, text: str) -> str:
        path = self.path(name)
        with open(path, "w", encoding="utf-8") as file:
            file.write(text)
        return path

    def run(self, arguments: Sequence[str]) -> str:
        """Calls the verb; what it prints."""
        code, result, notes, error = self._watched(lambda progress: _backdrive.run(list(arguments), progress))
        self._ended(code, notes, error)
        return self.without_folder(result)

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

    def file(self, given: Any, name: str) -> str:
        """One recording as a path."""
        if _frames.is_path(given):
            numbers = numbers_of(os.fspath(given))
            if numbers is None:
                return os.fspath(given)
            given, name = numbers, os.path.splitext(os.path.basename(given))[0]
        shown = re.sub(r"[^\w.\-]+", "-", name).strip("-.") or "recording"
        path = self.path(shown + ".csv")
        if os.path.exists(path):
            raise UsageError(f"two recordings are called {shown}; give each a name of its own", 2)
        _frames.write(given, path, name)
        return path

    def files(self, given: Any, name: str) -> list[str]:
        """Recordings as paths: one, a sequence of them, or a dictionary of them by name."""
        if given is None:
            return []
        if _frames.is_path(given) or _frames.is_frame(given):
            return [self.file(given, name)]
        if isinstance(given, Mapping):
            return [self.file(one, str(key)) for key, one in given.items()]
        if isinstance(given, Sequence):
            return [self.file(one, f"{name}-{number}") for number, one in enumerate(given, 1)]
        raise UsageError(f"{type(given).__name__} is no recording: expected a path, a frame, a dictionary of arrays, or several of these", 2)

    def set(self, recordings: Any, held_out: Any, settings: Mapping[str, Any]) -> list[str]:
        """Recordings as arguments of a verb: paths unchanged where nothing else is stated, else a set that states it."""
        settings = {k: v for k, v in settings.items() if v}
        fit = self.files(recordings, "recording")
        if held_out is None and not settings and not any(os.path.dirname(f) == self.folder for f in fit):
            return fit
        if len(fit) == 1 and (os.path.isdir(fit[0]) or fit[0].endswith(".toml")):
            raise UsageError(f"{fit[0]}: a set states what is held out and how its columns are named; write it there, or give its files", 2)
        held = self.files(held_out, "held-out")
        if held_out is None and len(fit) > 1:
            held = [fit.pop()]
        names = {"fit": [self.from_here(f) for f in fit], "held_out": [self.from_here(f) for f in held]}
        text = _toml.document({**names, **settings})
        return [self.text_file("recordings.toml", text)]
