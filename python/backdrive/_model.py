"""Models: read, change, write, draw; from MuJoCo and to it; a feed-forward function for NumPy."""

from __future__ import annotations

import ast
import html as _html
import os
import tomllib
from collections.abc import Callable, Iterator, Mapping, Sequence
from typing import Any

from . import _backdrive, _toml
from ._errors import InputError, UsageError, raised


class Model:
    """A model file: what a device is believed to be.

        model = Model("motor.toml")
        model["elements.friction.force"] = 0.2          # N; comments and order of the file stay
        model.write("changed.toml")

    Given a path, or the text of a model file. Paths of numbers are those of the file: `bodies.NAME` (kg or kg m2), `elements.NAME.KEY`, `inputs.NAME.KEY`,
    `outputs.NAME.KEY`, `axes.NAME.KEY`.
    """

    def __init__(self, source: str | os.PathLike[str], *, name: str | None = None, folder: str | os.PathLike[str] | None = None) -> None:
        text = os.fspath(source)
        if "\n" in text:
            self.path: str | None = None
            self._text, self._name, self._folder = text, name or "model.toml", folder
        else:
            try:
                with open(text, encoding="utf-8") as file:
                    self._text = file.read()
            except (OSError, UnicodeDecodeError) as error:
                raise InputError(f"{text}: cannot be read: {getattr(error, 'strerror', None) or error}") from error
            self.path, self._name, self._folder = text, text, os.path.dirname(text) or "."
        self._value(None)

    def _value(self, path: str | None) -> list[float]:
        try:
            return _backdrive.value_at(self._text, self._name, self._folder, path)
        except ValueError as error:
            raise raised(str(error), 3) from None

    @property
    def text(self) -> str:
        """The file's text."""
        return self._text

    @property
    def data(self) -> dict[str, Any]:
        """The file as dictionaries and lists; changing them changes nothing."""
        return tomllib.loads(self._text)

    @property
    def name(self) -> str:
        """The model's name, from its file."""
        return str(self.data.get("name", ""))

    def __getitem__(self, path: str) -> float | list[float]:
        values = self._value(path)
        return values[0] if len(values) == 1 else values

    def __setitem__(self, path: str, value: float | Sequence[float]) -> None:
        numbers = value if isinstance(value, Sequence) else None
        given = [float(v) for v in numbers] if numbers is not None else [float(value)]  # type: ignore[arg-type]
        before, from_path = self._text, self.path
        try:
            self._text = _backdrive.patched(before, path, given, numbers is not None)
        except ValueError as error:
            raise InputError(f"{self._name}: {error}") from None
        self.path = None
        try:
            self._value(None)
        except InputError:
            self._text, self.path = before, from_path
            raise

    def numbers(self) -> dict[str, float]:
        """Every number of the bodies and elements by its path."""
        return dict(self._numbers())

    def _numbers(self) -> Iterator[tuple[str, float]]:
        data = self.data
        for name, inertia in data.get("bodies", {}).items():
            yield f"bodies.{name}", float(inertia)
        for element in data.get("elements", []):
            for key, value in element.items():
                if isinstance(value, (int, float)) and not isinstance(value, bool):
                    yield f"elements.{element['name']}.{key}", float(value)

    def driven(self, inputs: Sequence[Mapping[str, Any]], outputs: Sequence[Mapping[str, Any]]) -> Model:
        """The same network with other inputs and outputs, such as a force in the place of a motion: tables as in a model file,
        `[{"name": "force", "kind": "force", "on": "carriage"}]`. Axes, which name the old ones, are left out.
        """
        text = _backdrive.without(self._text, ["inputs", "outputs", "axes"]).rstrip() + "\n"
        for section, tables in (("inputs", inputs), ("outputs", outputs)):
            text += "".join(f"\n[[{section}]]\n{_toml.document(table)}" for table in tables)
        return Model(text, name=self._name, folder=self._folder)

    def copy(self) -> Model:
        """Another with the same text."""
        return Model(self._text if "\n" in self._text else self._text + "\n", name=self._name, folder=self._folder)

    def anywhere(self) -> str:
        """The text with the files that it names by their whole paths."""
        if self._folder is None:
            return self._text
        return _backdrive.anywhere(self._text, self._folder)

    def write(self, path: str | os.PathLike[str]) -> None:
        """Writes the model as a file, in place of one that is there. Files that it names are then named by their whole paths, where it goes elsewhere."""
        there = os.path.dirname(os.path.abspath(os.fspath(path)))
        same = self._folder is None or os.path.realpath(there) == os.path.realpath(self._folder)
        with open(path, "w", encoding="utf-8") as file:
            file.write(self._text if same else self.anywhere())

    def __repr__(self) -> str:
        return f"Model({self.name!r})\n{self.diagram}"

    def describe(self, *, grip: str | os.PathLike[str] | None = None, amplitude: float | None = None) -> Any:
        """The network with its equations, modes, poles and frequency responses. `amplitude`, m or rad: of the motion at which friction and play are seen."""
        from . import _verbs

        return _verbs.described(self, grip, amplitude)

    @property
    def diagram(self) -> str:
        """The network drawn in characters."""
        return str(self.describe()["diagram"])

    def _repr_html_(self) -> str:
        title = _html.escape(str(self.data.get("title") or self.name))
        return f"<b>{title}</b><pre style='line-height:1.2'>{_html.escape(self.diagram)}</pre>"

    def plot(self, *, grip: str | os.PathLike[str] | None = None, amplitude: float | None = None) -> Any:
        """Draws the frequency responses with matplotlib; gives matplotlib's figure."""
        from matplotlib import pyplot

        responses = self.describe(grip=grip, amplitude=amplitude)["responses"]
        figure, (size, phase) = pyplot.subplots(2, 1, sharex=True, layout="constrained", figsize=(8.0, 6.0))
        for response in responses:
            f = [p["frequency_hz"] for p in response["points"]]
            name = f"{response['input']} to {response['output']} [{response['unit']}]"
            size.loglog(f, [p["magnitude"] for p in response["points"]], label=name)
            phase.semilogx(f, [p["phase_deg"] for p in response["points"]])
        size.set_ylabel("magnitude")
        phase.set_ylabel("phase [deg]")
        phase.set_xlabel("frequency [Hz]")
        if responses:
            size.legend(fontsize="small")
        return figure

    def export(self, to: str, **options: Any) -> Any:
        """The model in another form: see `backdrive.export`."""
        from . import _verbs

        return _verbs.export(self, to, **options)

    def feedforward(self, *, width: float | None = None) -> dict[str, Callable[..., Any]]:
        """Friction and the like as functions for NumPy, one for each joint by its name: `f(q, dq, load=0.0)` gives the effort (N or N m) that a motor adds
        so that it is not felt. q in m or rad, dq in m/s or rad/s, load in N or N m; arrays or numbers. `width`: of the smooth sign tanh(dq/width).
        """
        return compiled(self.export("feedforward", language="python", width=width).text)

    @classmethod
    def from_mujoco(cls, source: Any, *, name: str | None = None, gravity_compensated: bool = False, actuators: bool = False) -> Model:
        """A model of the arm in an MJCF: a path, its text, an `MjSpec` or an `MjModel`. What it cannot hold is listed by `describe()["remarks"]`.

        `actuators`: take its motors as inputs; `gravity_compensated`: the motors hold the weight of the links.
        """
        if isinstance(source, str) and source.lstrip().startswith("<"):
            xml, name = source, name or "arm"
        elif isinstance(source, (str, os.PathLike)):
            with open(source, encoding="utf-8") as file:
                xml = file.read()
            name = name or os.path.splitext(os.path.basename(os.fspath(source)))[0]
        elif hasattr(source, "to_xml"):
            xml, name = source.to_xml(), name or getattr(source, "modelname", "") or "arm"
        elif hasattr(source, "nq") and hasattr(source, "njnt"):
            xml, name = _xml_of(source), name or "arm"
        else:
            raise UsageError(f"{type(source).__name__} is no MJCF: expected a path, text, MjSpec or MjModel", 2)
        text = f'name = {_toml.value(name)}\nsource = "an MJCF"\n\n[robot]\nxml = {_toml.value(xml)}\n'
        text += "gravity_compensated = true\n" * gravity_compensated + "actuators = true\n" * actuators
        return cls(text, name=name)

    def to_mujoco(self, *, step: float | None = None) -> Any:
        """The model as MuJoCo's `MjModel`. What MuJoCo cannot hold is listed by `export("mjcf").left_out`."""
        import mujoco

        return mujoco.MjModel.from_xml_string(self.export("mjcf", step=step).text)


def _xml_of(model: Any) -> str:
    import tempfile

    import mujoco

    with tempfile.TemporaryDirectory() as folder:
        path = os.path.join(folder, "model.xml")
        mujoco.mj_saveLastXML(path, model)
        with open(path, encoding="utf-8") as file:
            xml = file.read()
    again = mujoco.MjModel.from_xml_string(xml)
    if bytes(again.names) != bytes(model.names) or again.nv != model.nv:
        raise UsageError("MuJoCo keeps the text of the last MJCF only, and this MjModel is of an earlier one; give its MJCF or MjSpec", 2)
    return xml


class _Vectorised(ast.NodeTransformer):
    """Choices between two numbers as `where`, functions of `math` as those of NumPy."""

    def visit_IfExp(self, node: ast.IfExp) -> ast.AST:
        self.generic_visit(node)
        where = ast.Attribute(ast.Name("math", ast.Load()), "where", ast.Load())
        return ast.copy_location(ast.Call(where, [node.test, node.body, node.orelse], []), node)


def compiled(source: str) -> dict[str, Callable[..., Any]]:
    """The functions of an exported feed-forward, for arrays."""
    import numpy

    tree = ast.parse(source)
    tree.body = [node for node in tree.body if isinstance(node, ast.FunctionDef)]
    tree = ast.fix_missing_locations(_Vectorised().visit(tree))
    names = [node.name for node in tree.body if isinstance(node, ast.FunctionDef)]
    scope: dict[str, Any] = {"math": numpy, "abs": numpy.abs}
    exec(compile(tree, "<feed-forward>", "exec"), scope)  # noqa: S102: our own text
    return {name: scope[name] for name in names}


