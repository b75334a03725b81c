"""What the verbs give: objects with the fields of the command line's JSON, its text and its page."""

from __future__ import annotations

import html as _html
import json
from typing import Any

from ._figures import Figure, figures_of
from ._model import Model


class Fields(dict):
    """A dictionary whose keys are attributes, too: `finding.physics` is `finding["physics"]`."""

    def __getattr__(self, name: str) -> Any:
        try:
            return self[name]
        except KeyError:
            raise AttributeError(f"there is no field {name!r}; there are {', '.join(self)}") from None

    def __dir__(self) -> list[str]:
        return [*super().__dir__(), *(k for k in self if str(k).isidentifier())]


def fields(text: str) -> Any:
    """JSON as objects."""
    return json.loads(text, object_hook=Fields)


class Result:
    """Fields of a result. `data` holds them all, `json` as the command line writes them, `notes` what should be known before them."""

    def __init__(self, text: str, notes: list[str], code: int) -> None:
        self.json: str = text
        self.data: Fields = fields(text)
        self.notes: list[str] = notes
        self.code: int = code

    def __getattr__(self, name: str) -> Any:
        if name.startswith("__") or "data" not in self.__dict__:
            raise AttributeError(name)
        return getattr(self.data, name)

    def __dir__(self) -> list[str]:
        return [*super().__dir__(), *self.data]

    @property
    def interrupted(self) -> bool:
        """Whether the work was cut off, and this is what was found until then."""
        return self.code == 130


class Report(Result):
    """A result with a page: `html` is the whole of it, `text` what the command line prints, `figures` the data that the page draws."""

    def __init__(self, text: str, notes: list[str], code: int, html: str | None, printed: str) -> None:
        super().__init__(text, notes, code)
        self.html: str | None = html
        self.text: str = printed

    def __str__(self) -> str:
        return self.text

    def __repr__(self) -> str:
        return self.text or super().__repr__()

    def _repr_html_(self) -> str | None:
        if self.html is None:
            return None
        return f'<iframe srcdoc="{_html.escape(self.html, quote=True)}" style="width:100%;height:720px;border:1px solid #ccc"></iframe>'

    @property
    def figures(self) -> list[Figure]:
        """The page's figures as data; each has `plot()`."""
        return figures_of(self.html or "")

    def plot(self, number: int = 0) -> Any:
        """Draws a figure of the page with matplotlib; gives matplotlib's figure."""
        return self.figures[number].plot()

    def write(self, path: str) -> None:
        """Writes the page, which opens without a network."""
        if self.html is None:
            raise ValueError("there is no page: it was asked for with report=False")
        with open(path, "w", encoding="utf-8") as file:
            file.write(self.html)


class Verdict(Report):
    """The result of a diagnosis; its fields are those of the verdict file (docs/verdict.schema.json).

    `verdict` is one word: missing, parameters, nothing_missing, unexplained, ambiguous, cannot_tell. `findings` are the physics that the model leaves out,
    most important first, each with `physics`, its place, `parameters` (value, ci95, unit) and `confidence`. `held_out` has the errors before and after on
    recordings that no fit saw. `model` is the model with what was found, `rivals` are models that explain the recordings about as well, `experiment` is
    the text of a proposed next experiment.
    """

    verdict: str
    sentence: str
    findings: list[Fields]
    parameters: Fields
    held_out: Fields
    audit: list[Fields]
    next_experiment: Fields | None
    detectable: list[Fields] | None
    arm: Fields | None

    def __init__(self, files: dict[str, str], notes: list[str], code: int, printed: str, html: str | None, folder: str | None) -> None:
        super().__init__(files["verdict.json"], notes, code, html, printed)
        self.model: Model = Model(files["model.diagnosed.toml"], name="model.diagnosed.toml", folder=folder)
        rivals = sorted(name for name in files if "rival" in name and name.endswith(".toml"))
        self.rivals: list[Model] = [Model(files[name], name=name, folder=folder) for name in rivals]
        self.experiment: str | None = next((text for name, text in files.items() if name.startswith("next-")), None)


class Interrupted(KeyboardInterrupt):
    """Ctrl-C ended a diagnosis. `verdict` is what it had found until then, which is never the word that all is well; `None` where it had not begun."""

    def __init__(self, verdict: Verdict | None) -> None:
        super().__init__("the diagnosis was stopped" + ("" if verdict is None else "; `verdict` of this exception is what was found until then"))
        self.verdict: Verdict | None = verdict


class Fit(Result):
    """A refit: `numbers` (name, unit, given, value, standard_error, ci95), `correlations`, `given` and `fitted` (errors of every recording), `agree`,
    `kept` (names of what the recordings do not determine) and `model`, the refitted one.
    """

    numbers: list[Fields]
    correlations: list[Fields]
    given: list[Fields]
    fitted: list[Fields]
    agree: bool
    kept: list[str]

    def __init__(self, text: str, notes: list[str], code: int, model: Model) -> None:
        # The commands that the command line offers next name files, and here there were none: `model` is in hand.
        said = {name: value for name, value in json.loads(text).items() if name != "next"}
        super().__init__(json.dumps(said, ensure_ascii=False), notes, code)
        self.refitted: Model = model

    @property
    def model(self) -> Model:
        """The model with the fitted numbers."""
        return self.refitted

    def __repr__(self) -> str:
        rows = [f"{n.name:32} {n.value:14.6g} {n.unit:8} ({n.ci95[0]:.6g} to {n.ci95[1]:.6g})" for n in self.data["numbers"] if n.determined]
        return "\n".join([*rows, *(f"{name:32} is not determined, and kept" for name in self.data["kept"])])


class Prediction(Result):
    """A simulation: `frame` is what the model did on the recording, `frames` on each of several; `nrmse` its error by output where that was recorded."""

    def __init__(self, text: str, notes: list[str], code: int, frames: dict[str, Any]) -> None:
        super().__init__(text, notes, code)
        self.frames: dict[str, Any] = frames

    @property
    def frame(self) -> Any:
        """What the model did; of several recordings on the first."""
        return next(iter(self.frames.values()))

    @property
    def nrmse(self) -> Fields:
        """Error by output, as a share of the output's own spread; of several recordings on the first."""
        return self.data["runs"][0]["nrmse"]

    def __repr__(self) -> str:
        return "\n".join(f"{r.recording}: {r.samples} samples of {r.period_s:.6g} s {dict(r.nrmse)}" for r in self.data["runs"])


class Exported(Result):
    """A model in another form: `text`, and `left_out`, what that form cannot hold."""

    left_out: list[Fields]

    def __init__(self, text: str, notes: list[str], code: int, exported: str) -> None:
        super().__init__(text, notes, code)
        self.text: str = exported

    def __str__(self) -> str:
        return self.text
