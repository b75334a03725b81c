from collections.abc import Callable
from typing import Any

__version__: str

Progress = Callable[[str, int, int | None], Any] | None

class Answer:
    code: int
    json: str
    text: str
    files: list[tuple[str, str]]
    tables: list[tuple[str, list[tuple[str, bytes]]]]
    html: str | None
    notes: list[str]
    error: str | None
    raised: BaseException | None

def diagnose(
    set: list[str],
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
def fit(
    model: str,
    set: list[str],
    *,
    grip: str | None,
    ignore_signal: list[str],
    effort: float | None,
    seconds: float | None,
    progress: Progress,
) -> Answer: ...
def simulate(
    model: str,
    drive: str,
    out: str,
    *,
    grip: str | None,
    input: str | None,
    rate: float | None,
    substeps: int | None,
    noise: int | None,
    columns: str | None,
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
def inspect(files: list[str], *, rate: float | None, columns: list[str] | None, time: str | None, progress: Progress) -> Answer: ...
def run(arguments: list[str], progress: Progress = None) -> tuple[int, str, list[str], str | None]: ...
def write_table(path: str, names: list[str], columns: list[bytes]) -> None: ...
def read_table(path: str) -> tuple[list[str], list[bytes]]: ...
def patched(text: str, path: str, values: list[float], list: bool) -> str: ...
def anywhere(text: str, folder: Any) -> str: ...
def value_at(text: str, name: str, folder: Any, path: str | None) -> list[float]: ...
def without(text: str, tables: list[str]) -> str: ...
