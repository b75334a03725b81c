from collections.abc import Callable
from typing import Any

__version__: str

Progress = Callable[[str, int, int | None], Any] | None
Columns = list[tuple[str, Any]]
Recordings = list[str] | dict[str, Any]

class Answer:
    code: int
    json: str
    text: str
    files: list[tuple[str, str]]
    tables: list[tuple[str, list[tuple[str, bytearray]]]]
    html: str | None
    notes: list[str]
    error: str | None
    raised: BaseException | None

def command_line(arguments: list[str], command: list[str]) -> int: ...
def diagnose(
    set: Recordings,
    *,
    model: str | None,
    grip: str | None,
    ignore_signal: list[str],
    without: list[str],
    effects: int | None,
    effort: float | None,
    seconds: float | None,
    out: Any,
    report: bool,
    progress: Progress,
) -> Answer: ...
def fleet(
    manifest: str,
    *,
    model: str | None,
    what: str,
    shard: tuple[int, int],
    jobs: int,
    out: str,
    false_discoveries: float,
    progress: Progress,
) -> Answer: ...
def fit(
    model: str,
    set: Recordings,
    *,
    grip: str | None,
    ignore_signal: list[str],
    effort: float | None,
    seconds: float | None,
    progress: Progress,
) -> Answer: ...
def simulate(
    model: str,
    drive: str | dict[str, Any],
    out: str,
    *,
    grip: str | None,
    input: str | None,
    rate: float | None,
    substeps: int | None,
    noise: int | None,
    progress: Progress,
) -> Answer: ...
def stability(
    recording: str,
    *,
    roles: Any,
    gain: float | None,
    mu: float | None,
    lambda_: float | None,
    sweep: tuple[float, float, int] | None,
    grips: list[float] | None,
    coupling: str | None,
    parts: dict[str, Any],
    progress: Progress,
) -> Answer: ...
def compare(
    session: str,
    *,
    laws: list[str],
    delays_ms: list[float] | None,
    jitter_ms: list[tuple[float, float]] | None,
    loss: list[float] | None,
    grips: list[float] | None,
    at_ms: float | None,
    lambda_: float | None,
    parts: dict[str, Any],
    progress: Progress,
) -> Answer: ...
def why(recording: str, *, roles: Any, progress: Progress) -> Answer: ...
def inspect(recordings: list[Any], *, rate: float | None, columns: list[str] | None, time: str | None, progress: Progress) -> Answer: ...
def export(
    model: str,
    to: str,
    *,
    language: str | None,
    width: float | None,
    step: float | None,
    on: Recordings | None,
    out: Any,
    overwrite: bool,
    progress: Progress,
) -> Answer: ...
def describe(model: str, *, grip: str | None, amplitude: float | None, progress: Progress) -> Answer: ...
def load_bag(path: str, *, topics: list[str] | None, progress: Progress) -> Answer: ...
def save_bag(recording: str | tuple[str, Columns], path: str, *, map: list[tuple[str, str]], overwrite: bool, progress: Progress) -> Answer: ...
def write_table(path: str, columns: Columns) -> None: ...
def patched(text: str, path: str, values: list[float], list: bool) -> str: ...
def anywhere(text: str, folder: Any) -> str: ...
def value_at(text: str, name: str, folder: Any, path: str | None) -> list[float]: ...
def without(text: str, tables: list[str]) -> str: ...
