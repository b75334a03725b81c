"""Figures of a page as data, and drawn with matplotlib."""

from __future__ import annotations

import html
import json
import re
from typing import Any

_FIGURE = re.compile(r"<figure>(.*?)</figure>", re.DOTALL)
_DATA = re.compile(r'<script type="application/json">(.*?)</script>', re.DOTALL)
_CAPTION = re.compile(r"<figcaption>(.*?)</figcaption>", re.DOTALL)
_TAG = re.compile(r"<[^>]+>")


class Figure:
    """Panels over a common x axis: `data["panels"][i]["series"][j]` has `name`, `x`, `y`; the axes have `label` and `unit`."""

    def __init__(self, data: dict[str, Any], caption: str) -> None:
        self.data = data
        self.caption = caption

    @property
    def title(self) -> str:
        return self.data["panels"][0]["title"] if self.data["panels"] else ""

    def __repr__(self) -> str:
        return f"Figure({self.title!r}, {len(self.data['panels'])} panels)"

    def plot(self) -> Any:
        """Draws it; gives matplotlib's figure."""
        from matplotlib import pyplot

        panels = self.data["panels"]
        figure, all_axes = pyplot.subplots(len(panels), 1, sharex=True, squeeze=False, layout="constrained", figsize=(8.0, 1.0 + 2.4 * len(panels)))
        for panel, axes in zip(panels, all_axes[:, 0]):
            axes.set_title(panel["title"], fontsize="medium")
            places = sorted({x for series in panel["series"] if series["kind"] == "bars" for x in series["x"] if x is not None})
            width = 0.85 * min((b - a for a, b in zip(places, places[1:])), default=1.0)
            for number, series in enumerate(panel["series"]):
                _draw(axes, series, f"C{number}", width)
            for point in panel["points"]:
                axes.plot(point["x"], point["y"], "o", color="k", markersize=4)
                axes.annotate(point.get("label", ""), (point["x"], point["y"]), fontsize="small")
            for region in panel["regions"]:
                axes.axvspan(region["from"], region["to"], alpha=0.12, color="C3")
            for marker in panel["markers"]:
                (axes.axvline if marker["vertical"] else axes.axhline)(marker["at"], linestyle="--", linewidth=0.8, color="0.4", label=marker["label"] or None)
            _axis(axes, "y", panel["y"])
            if axes.get_legend_handles_labels()[0]:
                axes.legend(fontsize="small")
        _axis(all_axes[-1, 0], "x", self.data["x"])
        return figure


def _draw(axes: Any, series: dict[str, Any], colour: str, bar: float) -> None:
    import numpy

    # What no axis can show is null there, and a gap here.
    x, y, z = (numpy.array(series.get(key) or [], dtype=float) for key in ("x", "y", "z"))
    name = series["name"]
    kind = series["kind"]
    if kind == "band":
        axes.fill_between(x, y, z, alpha=0.25, label=name, color=colour, linewidth=0)
    elif kind == "bars":
        axes.bar(x, y, label=name, color=colour, width=bar)
    elif kind == "discs":
        from matplotlib.patches import Circle

        axes.plot(x, y, ".", markersize=2, label=name, color=colour)
        for middle in zip(x, y, z):
            axes.add_patch(Circle(middle[:2], middle[2], alpha=0.15, color=colour, linewidth=0))
    elif kind == "points":
        axes.plot(x, y, ".", label=name, color=colour)
    else:
        axes.plot(x, y, label=name, color=colour, linewidth=max(0.6, 0.6 * series.get("width", 1.5)))


def _axis(axes: Any, which: str, data: dict[str, Any]) -> None:
    unit = f" [{data['unit']}]" if data["unit"] else ""
    getattr(axes, f"set_{which}label")(data["label"] + unit)
    if data["log"]:
        getattr(axes, f"set_{which}scale")("log")
    getattr(axes, f"set_{which}lim")(data["lo"], data["hi"])
    if data.get("names"):
        getattr(axes, f"set_{which}ticks")(range(1, len(data["names"]) + 1), data["names"])


def figures_of(page: str) -> list[Figure]:
    """The figures of a page in their order; plots that stand beside each other are one each."""
    out = []
    for figure in _FIGURE.findall(page):
        caption = _CAPTION.search(figure)
        text = html.unescape(_TAG.sub("", caption[1])) if caption else ""
        out += [Figure(json.loads(data), text) for data in _DATA.findall(figure)]
    return out
