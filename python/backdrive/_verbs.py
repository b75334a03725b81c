"""The verbs of the command line as functions: each calls the typed function behind the verb."""

from __future__ import annotations

import os
from collections.abc import Mapping, Sequence
from typing import Any

from . import _backdrive, _frames, _toml
from ._errors import UsageError
from ._model import Model
from ._results import Exported, Fit, Interrupted, Prediction, Report, Verdict, fields
from ._work import INTERRUPTED, Progress, Work, stated

Path = str | os.PathLike[str]

# Parts of a loop that `stability` and `compare` swap.
_PARTS = ("master", "grip", "slave", "environment", "canceller", "canceller_grip", "high_pass", "hand", "edge_without", "sensors", "limits", "script")


def _model_file(work: Work, model: Any, name: str = "model.toml") -> str:
    """A model as a path: its own where it has one, else a file of its text."""
    if isinstance(model, Model):
        return model.path or work.text_file(name, model.anywhere())
    return os.fspath(model)


def _folder_of(model: Any) -> str | None:
    if isinstance(model, Model):
        return None if model._folder is None else os.fspath(model._folder)
    return None if model is None else os.path.dirname(os.path.abspath(os.fspath(model)))


def _some(value: str | Sequence[str]) -> list[str]:
    return [value] if isinstance(value, str) else list(value)


def _list(values: Sequence[Any] | None) -> list[Any] | None:
    return None if values is None else list(values)


def _parts(given: Mapping[str, Any], without: str = "") -> dict[str, Any]:
    """Parts of a loop that are swapped, those that are not as `None`."""
    names = [name for name in _PARTS if name != without]
    unknown = ", ".join(given.keys() - set(names))
    if unknown:
        raise UsageError(f"{unknown}: is no part of a loop; there are {', '.join(names)}", 2)
    return {name: given.get(name) for name in _PARTS}


def _grip(work: Work, grip: Any) -> str | None:
    return None if grip is None else _model_file(work, grip, "grip.toml")


def diagnose(
    recordings: Any,
    model: Path | Model | None = None,
    *,
    held_out: Any = None,
    grip: Path | Model | None = None,
    columns: Mapping[str, Any] | None = None,
    joints: Mapping[str, Mapping[str, Any]] | None = None,
    initial: str | None = None,
    ignore: str | Sequence[str] = (),
    without: str | Sequence[str] = (),
    effects: int | None = None,
    effort: float | None = None,
    patience: float | None = None,
    settings: Mapping[str, Any] | None = None,
    out: Path | None = None,
    report: bool = True,
    progress: Progress = True,
) -> Verdict:
    """Finds the physics that a model leaves out, by recordings of its device.

    recordings: one or several: paths, frames, dictionaries of arrays, or a dictionary of these by name. Columns in SI units, `t` in s.
    model: the nominal model; without it the set's own.
    held_out: recordings that no fit uses; without this, the last one of several recordings.
    grip: the grip that holds the model, where a hand held the device.
    columns: which column is which signal: `{"position": {"column": "pos", "unit": "deg"}, "t": "time"}`.
    joints: of an arm, the columns of each joint: `{"elbow": {"position": "q2", "torque": "tau2"}}`, rad and N m.
    initial: "rest" (the device starts at rest) or "free" (it does not).
    ignore: recorded inputs that the model need not have. without: effects to exclude.
    effects: the largest number of missing effects. effort: how much to search; 1 is the default. patience: a time limit, s.
    settings: further keys of `set.toml`. out: a folder for verdict, model and report. report: whether to make the page.
    progress: whether to show it; or a function of message, position and length.

    Raises InputError where a file or a recording is wrong, with `file`, `line`, `key`; UsageError where an argument is; Interrupted, a KeyboardInterrupt, at
    Ctrl-C: its `verdict` is what was found until then. A second Ctrl-C does not wait for it.
    """
    with Work(progress) as work:
        if joints is not None:
            joints = {name: dict(table) for name, table in joints.items()}
        more = {"initial": initial, "columns": columns, "joints": joints, **(settings or {})}
        answer = work.asked(
            _backdrive.diagnose,
            work.set(recordings, held_out, more),
            model=None if model is None else _model_file(work, model),
            grip=_grip(work, grip),
            ignore_signal=_some(ignore),
            without=_some(without),
            effects=effects,
            effort=effort,
            seconds=patience,
            out=out,
            report=report,
        )
        files = {name: work.without_folder(text) for name, text in answer.files}
        html = None if answer.html is None else work.without_folder(answer.html)
        if answer.raised is None:
            return Verdict(files, work.notes, work.code, work.without_folder(answer.text), html, _folder_of(model))
        if not isinstance(answer.raised, KeyboardInterrupt):
            raise answer.raised
        found = Verdict(files, answer.notes, INTERRUPTED, work.without_folder(answer.text), html, _folder_of(model)) if files else None
        raise Interrupted(found) from answer.raised


def fit(
    recordings: Any,
    model: Path | Model,
    *,
    held_out: Any = None,
    grip: Path | Model | None = None,
    columns: Mapping[str, Any] | None = None,
    initial: str | None = None,
    ignore: str | Sequence[str] = (),
    effort: float | None = None,
    patience: float | None = None,
    settings: Mapping[str, Any] | None = None,
    progress: Progress = True,
) -> Fit:
    """Refits a model's parameters to recordings, its structure unchanged; arguments as those of `diagnose`. Models of one axis only."""
    with Work(progress) as work:
        answer = work.answer(
            _backdrive.fit,
            _model_file(work, model),
            work.set(recordings, held_out, {"initial": initial, "columns": columns, **(settings or {})}),
            grip=_grip(work, grip),
            ignore_signal=_some(ignore),
            effort=effort,
            seconds=patience,
        )
        fitted = Model(dict(answer.files)["fitted.toml"], name="fitted.toml", folder=_folder_of(model))
        return Fit(work.without_folder(answer.json), work.notes, work.code, fitted)


def simulate(
    model: Path | Model,
    drive: Any,
    *,
    grip: Path | Model | None = None,
    input: str | None = None,
    rate: float | None = None,
    substeps: int | None = None,
    noise: int | None = None,
    columns: Mapping[str, Any] | None = None,
    kind: str = "auto",
    progress: Progress = True,
) -> Prediction:
    """Runs a model on recordings, or on an excitation such as `"sweep:amplitude=2,from=1,to=200,duration=10"`.

    input: which input an excitation drives. rate: its samples per second, Hz. noise: add the sensors' noise and rounding, with this seed.
    kind: what the predictions are given as: "pandas", "polars", "numpy" (a dictionary of arrays), or "auto".
    """
    with Work(progress) as work:
        driven = work.recording(drive, "recording")
        several = isinstance(driven, str) and (os.path.isdir(driven) or driven.endswith(".toml"))
        is_file = isinstance(driven, str) and driven.lower().endswith((".csv", ".mcap"))
        answer = work.answer(
            _backdrive.simulate,
            _model_file(work, model),
            stated([driven], [], {"columns": columns} if columns else {}) if columns and is_file or not isinstance(driven, str) else driven,
            "predicted" if several else "predicted.csv",
            grip=_grip(work, grip),
            input=input,
            rate=rate,
            substeps=substeps,
            noise=noise,
        )
        text = work.without_folder(answer.json)
        tables = dict(answer.tables)
        frames = {run["recording"]: _frames.of_bytes(tables[run["out"]], kind) for run in fields(text)["runs"]}
        return Prediction(text, work.notes, work.code, frames)


def stability(
    recording: Any,
    *,
    gain: float | None = None,
    mu: float | None = None,
    lambda_: float | None = None,
    sweep: tuple[float, float, int] | None = None,
    grips: Sequence[float] | None = None,
    roles: Path | Mapping[str, Any] | None = None,
    coupling: str | None = None,
    progress: Progress = True,
    **parts: Any,
) -> Report:
    """Asks the bag of a run, or with `roles` any recording, whether its loop would be stable at a gain, and how far away the limit is.

    gain: the product mu*lambda asked about. sweep: (from, to, count): the whole curve. grips: factors on the grip's stiffness and damping.
    roles: which topic or column is which signal: a file, or the same as dictionaries (docs/roles-example.toml).
    parts: other parts of the loop, as on the command line: `master="model.toml"`, `canceller="none"`.
    """
    with Work(progress) as work:
        answer = work.answer(
            _backdrive.stability,
            work.file(recording, "recording"),
            roles=_roles(work, roles),
            gain=gain,
            mu=mu,
            lambda_=lambda_,
            sweep=sweep,
            grips=_list(grips),
            coupling=coupling,
            parts=_parts(parts),
        )
        return _report(work, answer)


def compare(
    session: Path,
    *,
    laws: str | Sequence[str] = (),
    delays: Sequence[float] | None = None,
    jitter: Sequence[tuple[float, float]] | None = None,
    loss: Sequence[float] | None = None,
    grips: Sequence[float] | None = None,
    at: float | None = None,
    lambda_: float | None = None,
    progress: Progress = True,
    **parts: Any,
) -> Report:
    """Compares laws between master and slave, and the canceller, by the same hand over delays, jitter, loss and grips.

    session: a graph file with an operator, or the bag of a run. laws: which; without it all, and the canceller.
    delays: ms each way. jitter: pairs of mean and largest deviation, ms each way. loss: shares of lost packets, 0 to 1.
    grips: factors on the grip's stiffness and damping. at: the delay at which loss and grips are tried, ms. An empty list leaves a kind out.
    lambda_: the force scale. parts: other parts of the loop, as for `stability`.
    """
    with Work(progress) as work:
        answer = work.answer(
            _backdrive.compare,
            os.fspath(session),
            laws=_some(laws),
            delays_ms=_list(delays),
            jitter_ms=_list(jitter),
            loss=_list(loss),
            grips=_list(grips),
            at_ms=at,
            lambda_=lambda_,
            parts=_parts(parts, without="script"),
        )
        return _report(work, answer)


def why(recording: Any, *, roles: Path | Mapping[str, Any] | None = None, progress: Progress = True) -> Report:
    """Asks the bag of a run, or with `roles` any recording, why its loop shakes and what would stop it."""
    with Work(progress) as work:
        return _report(work, work.answer(_backdrive.why, work.file(recording, "recording"), roles=_roles(work, roles)))


def inspect(recordings: Any, *, rate: float | None = None, columns: Sequence[str] | None = None, time: str | None = None, progress: Progress = True) -> Report:
    """Asks whether recordings are right: what each signal is, what is wrong with it, and how each joint answers its command. Needs no model.

    recordings: one or several: paths (tables, bags, datasets, folders), frames, dictionaries of arrays, or a dictionary of these by name.
    rate: rows per second of tables in which no column is the time, Hz. columns: headings of tables that have none. time: the column with the times.
    """
    with Work(progress) as work:
        given = work.recordings(recordings, "recording")
        return _report(work, work.answer(_backdrive.inspect, given, rate=rate, columns=_list(columns), time=time))


def _roles(work: Work, roles: Any) -> str | None:
    if roles is None or _frames.is_path(roles):
        return roles
    return work.text_file("roles.toml", _toml.document(roles))


def _report(work: Work, answer: Any) -> Report:
    text = work.without_folder(answer.json)
    html = None if answer.html is None else work.without_folder(answer.html)
    return Report(text + "\n", work.notes, work.code, html, text)


def load_bag(path: Path, *, topics: str | Sequence[str] = (), kind: str = "auto") -> Any:
    """The signals of a bag (MCAP) as a frame: `t` (s), and a column for each, `topic.field.axis`, NaN where nothing was measured.

    kind: "pandas", "polars", "numpy" (a dictionary of arrays), or "auto": pandas where it is installed. topics: only these.
    """
    with Work(False) as work:
        answer = work.answer(_backdrive.load_bag, os.fspath(path), topics=_some(topics) or None)
        return _frames.of_bytes(dict(answer.tables)["bag"], kind)


def save_bag(frame: Any, path: Path, *, map: Mapping[str, str] | None = None, overwrite: bool = False) -> None:
    """Writes a recording as a bag (MCAP). map: which column is what, `{"motor_position": "/master/measured_js.position[0]"}`."""
    with Work(False) as work:
        given = work.recording(frame, "recording")
        work.answer(_backdrive.save_bag, given, os.fspath(path), map=list((map or {}).items()), overwrite=overwrite)


def export(
    model: Path | Model,
    to: str,
    *,
    language: str | None = None,
    width: float | None = None,
    step: float | None = None,
    on: Any = None,
    out: Path | None = None,
    overwrite: bool = False,
) -> Exported:
    """A model in another form: `to` is "mjcf", "urdf", "isaac" or "feedforward" (`language`: "c", "python", "yaml").

    width: of a feed-forward's smooth sign, m/s or rad/s. step: of an MJCF, s. on: recordings on which the error is worked out that leaving something out
    makes. What the form cannot hold is in `left_out`.
    """
    with Work(False) as work:
        answer = work.answer(
            _backdrive.export,
            _model_file(work, model),
            to,
            language=language,
            width=width,
            step=step,
            on=None if on is None else work.set(on, None, {}),
            out=out,
            overwrite=overwrite,
        )
        return Exported(work.without_folder(answer.json), work.notes, work.code, answer.text)


def described(model: Model, grip: Any, amplitude: float | None) -> Any:
    """What `backdrive model show` prints about a model."""
    with Work(False) as work:
        return fields(work.answer(_backdrive.describe, _model_file(work, model), grip=_grip(work, grip), amplitude=amplitude).json)


__all__ = ["INTERRUPTED", "compare", "described", "diagnose", "export", "fit", "load_bag", "save_bag", "simulate", "stability", "why"]
